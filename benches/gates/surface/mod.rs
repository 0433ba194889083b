//! A mesh that follows a liquid.

pub mod cancel;
pub mod detail_kept;
pub mod easing;
pub mod edit_history;
pub mod first_flag;
pub mod known_motion;
pub mod large;
pub mod matching;
pub mod readers;
pub mod rebuilt;
pub mod rebuilt_frames;
pub mod rebuilt_large;
pub mod rebuilt_sequences;
pub mod rebuilt_speed;
pub mod rebuilt_topology;
pub mod repair;
pub mod rest_kept;
pub mod splashsurf;
pub mod spot;
pub mod textures;
pub mod vortex;
pub mod windings;
