//! The size of a surface's mesh.

/// Size of a mesh.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Count of vertices.
    pub vertices: usize,
    /// Of these, extras.
    pub extras: usize,
    /// Count of vertex indices: three for each triangle.
    pub indices: usize,
}
