//! Writing the mesh into the caller's buffers.

pub(super) mod capacity;
pub(in crate::shallow) mod frame;
pub(super) mod indices;
pub(in crate::shallow) mod normals;
pub(super) mod vertices;
