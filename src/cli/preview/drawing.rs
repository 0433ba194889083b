//! How what was read is drawn.

use frazil::base::DVec3;
use frazil::render::{Camera, Cloud, Light, Model, Models, Size};
use frazil::{Context, Error, Result};

use super::sources::Part;

/// The colour of meshes (linear red, green, blue): leather, which snow is seen beside.
const BROWN: [f32; 3] = [0.35, 0.16, 0.08];

/// What the user chose about the picture.
pub struct Look {
    /// Pixels.
    pub size: Size,
    /// Where the camera is, what it looks at (m), and its field of view (degrees).
    pub camera: Option<(DVec3, DVec3, f64)>,
    /// Azimuth and elevation of the sun (degrees).
    pub sun: Option<(f64, f64)>,
    /// The attribute that colours points.
    pub color: Option<String>,
    /// Extinction of a fog of density 1 (1/m).
    #[cfg_attr(not(feature = "vdb"), expect(dead_code, reason = "fogs come from .vdb files"))]
    pub fog_density: f64,
}

/// What is drawn of a frame.
pub struct Drawing {
    /// It.
    pub models: Models,
    /// Whether there are points in it.
    pub has_points: bool,
    /// A fog that has no density, in words.
    pub hollow: Option<String>,
}

impl Look {
    /// Prepares parts to be drawn.
    ///
    /// # Errors
    /// Points without the attribute; a fog that cannot be drawn; cancel.
    #[cfg_attr(not(feature = "vdb"), expect(unused_variables, unused_mut, reason = "of grids only"))]
    pub fn build(&self, ctx: &Context, parts: Vec<Part>) -> Result<Drawing> {
        let (mut models, mut clouds, mut fogs, mut hollow) = (Vec::new(), Vec::new(), Vec::new(), None);
        for part in parts {
            match part {
                Part::Mesh(mesh) => models.push(Model::mesh(&mesh, BROWN)),
                Part::Points(path, points) => {
                    let cloud = Cloud::new(&points, self.color.as_deref());
                    clouds.push(cloud.map_err(|error| Error::file(path, error.to_string()))?);
                }
                #[cfg(feature = "vdb")]
                Part::Surface(grid) => models.push(Model::level_set(ctx, &grid)?),
                #[cfg(feature = "vdb")]
                Part::Fog(path, grid) => {
                    let fog = frazil::render::Fog::grid(ctx, &grid, self.fog_density);
                    let fog = fog.map_err(|error| match error {
                        Error::Argument(what) => Error::file(&path, what),
                        other => other,
                    })?;
                    if fog.is_empty() {
                        let name = grid.name();
                        hollow = Some(format!("{}: grid \"{name}\" has no density above 0", path.display()));
                    }
                    fogs.push(fog);
                }
            }
        }
        let has_points = !clouds.is_empty();
        Ok(Drawing { models: Models::new(models).with_clouds(clouds).with_fogs(fogs), has_points, hollow })
    }

    /// The camera that was chosen, or one that sees everything in a box (m).
    pub fn camera(&self, bounds: (DVec3, DVec3)) -> Camera {
        match self.camera {
            Some((eye, target, fov_deg)) => Camera { eye, target, fov_deg },
            None => Camera::framing(bounds, self.size),
        }
    }

    /// The sun that was chosen, or one beside the camera.
    pub fn light(&self, camera: &Camera) -> Light {
        match self.sun {
            Some((azimuth, elevation)) => Light::from_degrees(azimuth, elevation),
            None => Light::beside(camera),
        }
    }
}
