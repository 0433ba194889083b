//! How the inputs are drawn, and from which camera.

use std::path::Path;

use frazil::geometry::{DVec3, DetailedMesh};
use frazil::render::{Camera, Cloud, Cut, Light, Model, Models, Picture, Plane, Size};
#[cfg(feature = "vdb")]
use frazil::render::{Field, SNOW};
#[cfg(feature = "vdb")]
use frazil::vdb::level_set;
use frazil::{Context, Error, Result};

use super::format::PictureFormat;
use super::sources::Sources;
use super::tint::{Tint, Tinted};
use crate::cli::preview::parts::Part;
use crate::cli::session::Failure;

/// The colour of meshes (linear red, green, blue): leather, to contrast with snow.
const BROWN: [f32; 3] = [0.35, 0.16, 0.08];
/// The colours of the ground below a liquid (pale stone) and of objects that stand or move in it (steel).
const STONE: [f32; 3] = [0.58, 0.54, 0.47];
const STEEL: [f32; 3] = [0.24, 0.26, 0.29];
/// Weight of the liquid's colour in a full stain.
const STAIN_WEIGHT: f64 = 0.6;
/// The colour of static meshes in a liquid: linen.
const LINEN: [f32; 3] = [0.78, 0.76, 0.70];
/// The colour of the lines in which a cut intersects meshes.
const INK: [f32; 3] = [0.0; 3];

/// The user's choices for the picture.
pub struct Look {
    /// Pixels.
    pub size: Size,
    /// The camera; none: one that sees what moves, or everything.
    pub camera: Option<Camera>,
    /// The light; none: one beside the camera.
    pub light: Option<Light>,
    /// The attribute that colours points and meshes.
    pub color: Option<String>,
    /// The scalar that tints liquids, and the liquid that it looks like.
    pub tint: Option<Tint>,
    /// The plane to draw instead of the whole.
    pub cut: Option<Plane>,
    /// Extinction (1/m) of a fog of density 1 whose file does not give it.
    #[cfg_attr(not(feature = "vdb"), expect(dead_code, reason = "fogs come from .vdb files"))]
    pub fog_density: f64,
}

/// The drawable content of a frame.
pub struct Drawing {
    content: Content,
    /// Whether any part has the attribute of `--color`.
    has_colors: bool,
    /// Whether any liquid is tinted.
    has_tint: bool,
    /// Why a part is invisible: a fog without density, or points that a cut leaves out.
    invisible_reason: Option<String>,
}

/// All contents of a picture.
enum Content {
    Models(Models),
    Cut(Cut),
}

/// Shared by all pictures of a flipbook.
pub struct View {
    camera: Camera,
    light: Light,
    /// Pixels.
    pub size: Size,
}

impl Look {
    /// Prepares parts to be drawn.
    ///
    /// # Errors
    /// Points without the attribute; a fog that cannot be drawn; cancel.
    #[cfg_attr(not(feature = "vdb"), expect(unused_mut, reason = "of grids only"))]
    pub fn build(&self, ctx: &Context, parts: Vec<Part>) -> Result<Drawing> {
        if let Some(plane) = self.cut {
            return cut(ctx, parts, plane);
        }
        let (mut models, mut clouds, mut fogs, mut invisible_reason) =
            (Vec::new(), Vec::new(), Vec::new(), None);
        let (mut has_colors, mut has_tint) = (false, false);
        for part in parts {
            match part {
                Part::Mesh(detailed) => {
                    let model = Model::mesh(&detailed.mesh, BROWN);
                    let numbers = self.numbers(&detailed);
                    has_colors |= numbers.is_some();
                    models.push(if let Some(numbers) = numbers { model.coloured(&numbers) } else { model });
                }
                Part::Liquid(detailed, look) => {
                    let (numbers, tinted) =
                        (self.numbers(&detailed), self.tint.as_ref().and_then(|tint| tint.of(&detailed)));
                    has_colors |= numbers.is_some();
                    has_tint |= tinted.is_some();
                    models.push(liquid(&detailed, look.colour, numbers, tinted));
                }
                Part::Ground(mesh, stains, look) => {
                    let model = Model::mesh(&mesh, STONE);
                    let stain =
                        |share: &f64| interpolate(STONE, look.colour, STAIN_WEIGHT * share.clamp(0.0, 1.0));
                    let is_stained = stains.len() == mesh.positions.len();
                    let painted = is_stained.then(|| stains.iter().map(stain).collect());
                    models.push(if let Some(painted) = painted { model.painted(painted) } else { model });
                }
                Part::Obstacle(mesh) => models.push(Model::mesh(&mesh, STEEL)),
                Part::StaticMesh(mesh) => models.push(Model::mesh(&mesh, LINEN)),
                Part::Points(path, points) => {
                    let cloud = Cloud::new(&points, self.color.as_deref());
                    clouds.push(cloud.map_err(|error| Error::file(path, error.to_string()))?);
                }
                #[cfg(feature = "vdb")]
                Part::Surface(grid) => models.push(Model::level_set(ctx, &grid)?),
                #[cfg(feature = "vdb")]
                Part::Fog(path, grid) => {
                    let fog = frazil::render::Fog::grid(ctx, &grid, self.fog_density);
                    let fog = fog.map_err(|error| error.in_file(&path))?;
                    if fog.is_empty() {
                        let what = format!("grid \"{}\" has no density above 0", grid.name());
                        invisible_reason = Some(log_invisible(&path, &what));
                    }
                    fogs.push(fog);
                }
            }
        }
        has_colors |= !clouds.is_empty();
        let models = Models::new(models).with_clouds(clouds).with_fogs(fogs);
        Ok(Drawing { content: Content::Models(models), has_colors, has_tint, invisible_reason })
    }

    /// What the picture should show: see [`Sources::focus`]; `None` if the camera is chosen or faces a plane.
    pub fn wanted_focus(&self, sources: &mut Sources) -> Option<[DVec3; 2]> {
        let is_free = self.camera.is_none() && self.cut.is_none();
        is_free.then(|| sources.focus()).flatten()
    }

    /// The numbers of the vertices that `--color` chooses.
    fn numbers(&self, detailed: &DetailedMesh) -> Option<Vec<f64>> {
        detailed.of_vertices(self.color.as_deref()?)
    }

    /// The chosen camera and light, or ones that show `focus` (m), as far as it is drawn, or all drawings completely.
    ///
    /// # Errors
    /// Nothing to see; nothing that `--color` can colour; a plane that misses everything.
    pub fn view(
        &self,
        drawings: &[Drawing],
        focus: Option<[DVec3; 2]>,
    ) -> std::result::Result<View, Failure> {
        if let Some(name) = self.color.as_ref().filter(|_| drawings.iter().all(|drawing| !drawing.has_colors))
        {
            let what =
                format!("--color {name}: no points are drawn, and no mesh has such an array of its vertices");
            return Err(Failure::refused(what));
        }
        if let Some(tint) = self.tint.as_ref().filter(|_| drawings.iter().all(|drawing| !drawing.has_tint)) {
            let name = &tint.name;
            let what = format!("--tint {name}: no liquid is drawn that has arrays {name} and depth");
            return Err(Failure::refused(what));
        }
        let boxes = drawings.iter().filter_map(|drawing| drawing.content.bounds());
        let bounds = boxes.reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)));
        let bounds = bounds.ok_or_else(|| {
            let invisible_reason = drawings.iter().find_map(|drawing| drawing.invisible_reason.as_deref());
            let why = invisible_reason.unwrap_or("the files are empty");
            Failure::refused(format!("there is nothing to draw: {why}"))
        })?;
        if let Some(plane) = self.cut {
            let [low, high] = [bounds.0, bounds.1].map(|corner| corner[plane.axis]);
            if !(low..=high).contains(&plane.at) {
                let there = format!("which lies between {low:.6} and {high:.6} m");
                return Err(Failure::refused(format!("--cut {plane} misses what is drawn, {there}")));
            }
        }
        let camera = self.camera.unwrap_or_else(|| match self.cut {
            Some(plane) => Camera::facing(bounds, plane, self.size),
            None => {
                Camera::framing(focus.and_then(|focus| within(focus, bounds)).unwrap_or(bounds), self.size)
            }
        });
        Ok(View { camera, light: self.light.unwrap_or_else(|| Light::beside(&camera)), size: self.size })
    }
}

/// The part of a box that lies within another; `None` if it is empty.
fn within([low, high]: [DVec3; 2], around: (DVec3, DVec3)) -> Option<(DVec3, DVec3)> {
    let (low, high) = (low.sup(&around.0), high.inf(&around.1));
    (low.x < high.x && low.y < high.y && low.z < high.z).then_some((low, high))
}

/// Prepares parts to be cut by a plane: the first grid gives the colours, level sets and meshes become lines.
#[cfg_attr(not(feature = "vdb"), expect(unused_variables, reason = "of grids only"))]
fn cut(ctx: &Context, parts: Vec<Part>, plane: Plane) -> Result<Drawing> {
    let (mut cut, mut invisible_reason) = (Cut::new(plane), None);
    for part in parts {
        match part {
            Part::Mesh(detailed) | Part::Liquid(detailed, _) => cut = cut.with_surface(&detailed.mesh, INK),
            Part::Ground(mesh, ..) | Part::Obstacle(mesh) | Part::StaticMesh(mesh) => {
                cut = cut.with_surface(&mesh, INK)
            }
            Part::Points(path, _) => {
                invisible_reason = Some(log_invisible(&path, "points are left out of a cut"))
            }
            #[cfg(feature = "vdb")]
            Part::Surface(grid) => {
                let surface = level_set::to_mesh(ctx, &grid, 0.0, 0.0)?;
                cut = cut.with_surface(&surface, SNOW).with_field(Field::grid(ctx, grid)?);
            }
            #[cfg(feature = "vdb")]
            Part::Fog(_, grid) => cut = cut.with_field(Field::grid(ctx, grid)?),
        }
    }
    if let Some([low, high]) = cut.range() {
        log::info!("the colours of the cut go from {low}, dark blue, to {high}, pale yellow");
    }
    Ok(Drawing { content: Content::Cut(cut), has_colors: false, has_tint: false, invisible_reason })
}

/// The surface of a liquid, coloured by numbers or tinted, if they are given; without opacities it hides the ground.
fn liquid(
    detailed: &DetailedMesh,
    colour: [f32; 3],
    numbers: Option<Vec<f64>>,
    tinted: Option<Tinted>,
) -> Model {
    let mesh = &detailed.mesh;
    if let Some(numbers) = numbers {
        return Model::mesh(mesh, colour).coloured(&numbers);
    }
    if let Some((colours, alpha)) = tinted {
        return Model::liquid(mesh, colour, alpha).painted(colours);
    }
    let alpha = detailed.of_vertices("alpha").unwrap_or_else(|| vec![1.0; mesh.positions.len()]);
    Model::liquid(mesh, colour, alpha.iter().map(|opacity| *opacity as f32).collect())
}

/// Logs and returns the reason why a part of a file is invisible.
fn log_invisible(path: &Path, what: &str) -> String {
    let what = format!("{}: {what}", path.display());
    log::info!("{what}");
    what
}

/// Interpolates two colours.
fn interpolate(from: [f32; 3], to: [f32; 3], share: f64) -> [f32; 3] {
    [0, 1, 2].map(|n| from[n] + share as f32 * (to[n] - from[n]))
}

impl Content {
    /// Minimum and maximum corner (m); none if it is empty.
    fn bounds(&self) -> Option<(DVec3, DVec3)> {
        match self {
            Self::Models(models) => models.bounds(),
            Self::Cut(cut) => cut.bounds(),
        }
    }
}

impl View {
    /// Draws a picture.
    ///
    /// # Errors
    /// Cancel.
    pub fn draw(&self, ctx: &Context, drawing: &Drawing) -> Result<Picture> {
        match &drawing.content {
            Content::Models(models) => models.draw(ctx, &self.camera, &self.light, self.size),
            Content::Cut(cut) => cut.draw(ctx, &self.camera, self.size),
        }
    }

    /// Draws a picture, as the bytes of a file.
    ///
    /// # Errors
    /// Cancel; an EXR of a cut, whose colours are not light.
    pub fn encoded(&self, ctx: &Context, drawing: &Drawing, format: PictureFormat) -> Result<Vec<u8>> {
        match (format, &drawing.content) {
            (PictureFormat::Png, _) => self.draw(ctx, drawing)?.png(),
            (PictureFormat::Exr, Content::Models(models)) => {
                models.draw_linear(ctx, &self.camera, &self.light, self.size)?.exr()
            }
            (PictureFormat::Exr, Content::Cut(_)) => {
                Err(Error::argument("the colours of a cut are not light, which an EXR holds"))
            }
        }
    }

    /// The same view for a picture that is smaller by a factor along each edge.
    pub fn smaller(&self, factor: u32) -> Self {
        let Size { width, height } = self.size;
        let size = Size { width: width.div_ceil(factor), height: height.div_ceil(factor) };
        Self { camera: self.camera, light: self.light, size }
    }
}
