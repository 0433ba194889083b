//! Parts of a check of a scene: heights, paths of objects, feet, and keys without effect.

pub(in crate::scene::snow) mod foot_slip;
pub(in crate::scene::snow) mod object_path;
pub(in crate::scene::snow) mod relief;
pub(in crate::scene::snow) mod warnings;
