//! Writing the mesh into the caller's buffers.

pub(in crate::shallow::surface) mod capacity;
pub(in crate::shallow) mod frame;
pub(in crate::shallow::surface) mod indices;
pub(in crate::shallow) mod normals;
pub(in crate::shallow::surface) mod vertices;
