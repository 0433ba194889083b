//! Any input: what is right, what is refused, and what ends.

pub mod bugs;
pub mod damage;
pub mod empty_frames;
pub mod gltf_valid;
pub mod guard_page;
pub mod orientation;
pub mod soup;
pub mod step_calls;
pub mod step_meshes;
pub mod watch;
