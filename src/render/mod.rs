//! Preview pictures of meshes, level sets, points and fog: sun, sky and shadows, so that the depth of a print reads;
//! cuts through fields; and flipbooks of them.
//!
//! ```no_run
//! # use frazil::{Context, Pool, io, render::{Camera, Light, Model, Size, Models}};
//! let ctx = Context::new(Pool::all_cores()?);
//! let boot = io::mesh::read("boot.obj".as_ref())?;
//! let models = Models::new(vec![Model::mesh(&boot, [0.6, 0.3, 0.2])]);
//! let size = Size { width: 640, height: 360 };
//! let camera = Camera::framing(models.bounds().expect("a boot is not empty"), size);
//! models.draw(&ctx, &camera, &Light::beside(&camera), size)?.write("boot.png".as_ref())?;
//! # Ok::<(), frazil::Error>(())
//! ```

mod camera;
mod cut;
pub mod fog;
mod gif;
mod linear;
mod liquid;
mod model;
mod models;
mod picture;
mod plane;
mod ramp;
mod shade;
mod sphere_shadows;
mod spheres;
#[cfg(feature = "vdb")]
mod volume;

pub use crate::render::plane::Plane;
pub use camera::{Camera, Size};
pub use cut::{Cut, Field};
pub use fog::Fog;
pub use gif::palette::Palette;
pub use gif::{Gif, delays};
pub use linear::{LinearPicture, LinearPixel};
pub use model::Model;
pub use models::Models;
pub use picture::Picture;
pub use shade::{Light, SNOW};
pub use spheres::Cloud;
