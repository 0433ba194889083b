//! The camera, the light and the size of a picture, as users choose them.

use frazil::geometry::DVec3;
use frazil::render::{Camera, Light, Size};

use crate::cli::options;
use crate::cli::session::Failure;

/// Camera, light and size; by default a camera that sees what moves, or everything, with the sun beside it.
#[derive(clap::Args)]
pub struct CameraOptions {
    /// Pixels.
    #[arg(long, default_value = "1280x720", value_parser = options::size)]
    pub size: Size,
    /// Position of the camera (m) [default: so that what moves is seen, or everything].
    #[arg(long, value_name = "X,Y,Z", value_parser = options::triple, allow_hyphen_values = true, requires = "target")]
    pub eye: Option<DVec3>,
    /// Point that the camera looks at (m).
    #[arg(long, value_name = "X,Y,Z", value_parser = options::triple, allow_hyphen_values = true, requires = "eye")]
    target: Option<DVec3>,
    /// Vertical field of view (degrees).
    #[arg(long, default_value_t = 35.0, requires = "eye")]
    fov: f64,
    /// Azimuth and elevation of the sun (degrees) [default: beside the camera].
    #[arg(long, value_name = "AZ,EL", value_parser = sun, allow_hyphen_values = true)]
    sun: Option<(f64, f64)>,
}

fn sun(text: &str) -> Result<(f64, f64), String> {
    let (azimuth, elevation) = text.split_once(',').ok_or("give azimuth,elevation")?;
    let number = |text: &str| text.trim().parse::<f64>().map_err(|_| format!("\"{text}\" is not a number"));
    let (azimuth, elevation) = (number(azimuth)?, number(elevation)?);
    if !(1.0..=90.0).contains(&elevation) || !azimuth.is_finite() {
        return Err("the elevation must be within 1 to 90 degrees".into());
    }
    Ok((azimuth, elevation))
}

impl CameraOptions {
    /// The chosen camera; `None` for the automatic one.
    ///
    /// # Errors
    /// A field of view out of range; a camera that looks at its own position.
    pub fn camera(&self) -> Result<Option<Camera>, Failure> {
        if !(1.0..=170.0).contains(&self.fov) {
            return Err(Failure::refused(format!("--fov {} is not within 1 to 170 degrees", self.fov)));
        }
        match self.eye.zip(self.target) {
            Some((eye, target)) if eye == target => {
                Err(Failure::refused("--eye and --target are the same point"))
            }
            Some((eye, target)) => Ok(Some(Camera { eye, target, fov_deg: self.fov })),
            None => Ok(None),
        }
    }

    /// The chosen light; `None` for the sun beside the camera.
    pub fn light(&self) -> Option<Light> {
        self.sun.map(|(azimuth, elevation)| Light::from_degrees(azimuth, elevation))
    }
}
