//! Scene files (TOML) describe a shot. They are read with every default filled in ([`Scene::read`], `schema/`, `systems/`), checked
//! against their inputs, and run frame by frame.
//!
//! [`run`] runs any stage. [`snow`], [`surface`] and [`shallow`] each have the inputs, the check and the stages of one system. The stage
//! `objects` writes the objects as they move. A new stage is a type with the traits [`run::Stage`] and [`run::Stepping`] in its system's
//! folder, listed in the system's pipeline ([`snow::pipeline`]) and in the scopes of the keys that it depends on.
//!
//! # Glossary
//!
//! | word | meaning |
//! |---|---|
//! | shot | the frames of a scene and their output folder |
//! | stage | a part of a shot with its own files: objects, base, grains, mist, volumes, surface, liquid |
//! | upstream | the stages whose frames a stage reads |
//! | pass | a stage's loop over the frames to be made |
//! | record | the manifest of a frame's files, written last: a frame is done when it exists |
//! | settings | the values that a stage depends on; if one changes, the stage's frames must be made again |
//! | take | a copy of a scene file with settings written into it, in a folder beside it |
//! | state | the exact data that a pass resumes from: a stage's own files, or bytes in `state/` |

mod moving;
mod objects;
pub mod run;
mod schema;
pub mod shallow;
pub mod snow;
pub mod surface;
mod systems;
#[cfg(feature = "vdb")]
mod vdb_metadata;

pub use objects::Objects;
pub use schema::{FrameChoice, Frames, Override, Value, Values};
pub use shallow::Shallow;
#[cfg(feature = "vdb")]
pub use snow::{FootSlip, Forecast, Inputs, MovingObjects, Rebuild, RebuildGrains, check_memory, estimate};
pub use surface::Surface;
pub use systems::{Take, keys_json, reference, template};

use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::io::files::sequence::Pattern;
use crate::motion::Space;
use crate::snow::NoiseParams;
use std::path::{Path, PathBuf};

/// A scene with every default filled in and every path absolute. After parsing, only [`Scene::coarsen`] changes it.
#[derive(Debug, Clone, PartialEq)]
pub struct Scene {
    pub(crate) path: PathBuf,
    pub(crate) system: System,
    pub(crate) shot: Shot,
    pub(crate) snow: Option<Snow>,
    pub(crate) surface: Option<Surface>,
    pub(crate) shallow: Option<Shallow>,
    pub(crate) objects: Vec<Object>,
    pub(crate) output: Output,
    /// The value of every key; the other fields are derived from them.
    pub(crate) values: Values,
}

/// The system that makes a scene's frames: the one whose table the scene has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum System {
    /// `[snow]`: objects move through a deep layer of snow.
    Snow,
    /// `[surface]`: a detailed mesh follows the particles of a liquid.
    Surface,
    /// `[shallow]`: a little liquid flows over a terrain.
    Shallow,
}

impl System {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Snow, Self::Surface, Self::Shallow];

    /// The name of its table in a scene, and of its command.
    pub fn name(self) -> &'static str {
        match self {
            Self::Snow => "snow",
            Self::Surface => "surface",
            Self::Shallow => "shallow",
        }
    }

    /// The system with a stage of this name.
    pub(crate) fn of_stage(name: &str) -> Option<Self> {
        match name {
            "base" | "grains" | "mist" | "volumes" | "objects" => Some(Self::Snow),
            "surface" => Some(Self::Surface),
            "liquid" => Some(Self::Shallow),
            _ => None,
        }
    }

    /// A title for its starter scene.
    pub(crate) fn title(self) -> &'static str {
        match self {
            Self::Snow => "Snow that objects press into",
            Self::Surface => "A detailed mesh that follows a liquid",
            Self::Shallow => "A little liquid on a terrain",
        }
    }
}

/// The frames of a shot, and their rate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shot {
    /// First and last frame.
    pub frames: Frames,
    /// Frames per second, above 0, up to 100,000.
    pub fps: f64,
}

impl Shot {
    /// The time of a frame (s).
    pub fn time(&self, frame: i32) -> f64 {
        f64::from(frame) / self.fps
    }
}

/// The layer of snow before the first frame, and how it is cut.
#[derive(Debug, Clone, PartialEq)]
pub struct Snow {
    /// The ground under the snow. Optional if `layer` is a .vdb file; it is then for grains and mist only.
    pub ground: Option<Ground>,
    /// How the layer is given.
    pub layer: Layer,
    /// A position in the meshes of ground and top (m) that becomes the origin.
    pub origin: DVec3,
    /// Edge of a voxel (m), above 0, up to 10.
    pub cell: f64,
    /// Raggedness of cut edges; an amplitude of 0 switches it off.
    pub noise: NoiseParams,
    /// Islands of fewer voxels than this are removed (0..=10,000); 0: none are.
    pub min_crumb: usize,
}

/// The ground under the snow.
#[derive(Debug, Clone, PartialEq)]
pub enum Ground {
    /// A level plane.
    Plane {
        /// Its y (m).
        height: f64,
        /// Minimum and maximum x and z of the layer: `[x0, z0, x1, z1]` (m); `None` if the layer is a .vdb file.
        area: Option<[f64; 4]>,
    },
    /// A mesh file.
    Mesh(PathBuf),
}

/// How the layer is given.
#[derive(Debug, Clone, PartialEq)]
pub enum Layer {
    /// Its vertical depth above ground and static objects (m).
    Depth(f64),
    /// A mesh of its top surface, above the ground.
    Top(PathBuf),
    /// A level set in a .vdb file: the whole layer.
    Grid(PathBuf),
}

/// One object of the scene.
#[derive(Debug, Clone, PartialEq)]
pub struct Object {
    /// A glTF character, a mesh file, or the pattern of a sequence of mesh files (`body.%04d.obj`).
    pub file: PathBuf,
    /// For a character: only the nodes of this name (`*` matches any characters, `?` exactly one) and their descendants.
    pub node: Option<String>,
    /// The character's clip; `None`: its only one.
    pub clip: Option<String>,
    /// Whether the clip starts again when it ends.
    pub repeat: bool,
    /// Frames by which its sequence or clip starts later; with 0 a clip starts at the shot's first frame.
    pub offset: f64,
    /// The file's unit and upward axis.
    pub space: Space,
    /// What it does to the snow.
    pub role: Role,
    /// Whether its cuts have ragged edges.
    pub noise: bool,
    /// Poses of a rigid motion on top of the file's own, ascending by frame; may be empty.
    pub keys: Vec<KeyPose>,
    /// Whether the motion between keys is eased: see [`crate::motion::Keys::with_ease`].
    pub ease: bool,
}

/// A rigid pose at a frame. Motion is linear (or eased) between poses; there is none before the first and after the last.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct KeyPose {
    /// Frame of the shot.
    pub frame: f64,
    /// Position of the object's origin (m).
    pub at: [f64; 3],
    /// Rotations about the x, then the y, then the z axis (degrees).
    pub turn_deg: [f64; 3],
}

/// What an object does to the snow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Role {
    /// It moves through the snow, removes what it touches, and pushes grains.
    Collide,
    /// It removes snow, but pushes no grains.
    Base,
    /// It pushes grains, but removes no snow.
    Grains,
    /// The snow lies on it from the start.
    Static,
    /// Nothing.
    Ignore,
}

impl Role {
    /// All of them.
    pub(crate) const ALL: [Self; 5] = [Self::Collide, Self::Base, Self::Grains, Self::Static, Self::Ignore];

    /// The roles of objects that move.
    pub const MOVING: [Self; 3] = [Self::Collide, Self::Base, Self::Grains];

    /// Whether an object with this role moves.
    pub fn moves(self) -> bool {
        Self::MOVING.contains(&self)
    }

    /// Whether an object with this role removes snow.
    pub fn removes(self) -> bool {
        matches!(self, Self::Collide | Self::Base)
    }

    /// Whether an object with this role pushes grains.
    pub fn pushes(self) -> bool {
        matches!(self, Self::Collide | Self::Grains)
    }

    /// Its name in a scene.
    pub fn name(self) -> &'static str {
        match self {
            Self::Collide => "collide",
            Self::Base => "base",
            Self::Grains => "grains",
            Self::Static => "static",
            Self::Ignore => "ignore",
        }
    }
}

/// Which files are written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Output {
    /// `base/base.%04d.vdb`.
    pub base: bool,
    /// How much of the base each frame's file holds.
    pub base_mode: BaseMode,
    /// 16-bit values in `base` and `removed`: for rendering only; `state/` then keeps what resuming needs.
    pub half: bool,
    /// `removed/removed.%04d.vdb`.
    pub removed: bool,
    /// `grains/grains.%04d.vdb`: grains as points.
    pub grains_vdb: bool,
    /// `grains/grains.%04d.ply`.
    pub grains_ply: bool,
    /// `grains/grains.%04d.usdc`.
    pub grains_usd: bool,
    /// Whether the grains' .vdb files hold only the changes since the previous frame, except every 24th.
    pub grains_delta: bool,
    /// `mist/mist.%04d.vdb`.
    pub mist: bool,
    /// Whether its values have 16 bits; `state/` keeps what resuming needs.
    pub mist_half: bool,
    /// Whether its grids have the names that Blender looks for.
    pub blender_names: bool,
    /// Volumes to render.
    pub volumes: VolumesOutput,
    /// `objects/objects.%04d.usdc`: the moving objects, with velocities.
    pub objects_usd: bool,
    /// `objects/objects.%04d.ply`: the same, all in one mesh.
    pub objects_ply: bool,
    /// How often the exact states of grains and mist are kept: after every Nth frame; 0 = only after the last ones.
    pub keep_states: i32,
    /// `shot.usda`.
    pub usd: bool,
}

/// Which volumes for rendering, and which meshes, are written.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct VolumesOutput {
    /// In `fog/fog.%04d.vdb`: the density of the base.
    pub fog_base: bool,
    /// In `fog/fog.%04d.vdb`: the density of grains.
    pub fog_grains: bool,
    /// In `fog/fog.%04d.vdb`: the density of the mist.
    pub fog_mist: bool,
    /// `snow/snow.%04d.vdb`: the base united with resting grains.
    pub snow: bool,
    /// `mesh/mesh.%04d.ply`: the surface of the base.
    pub mesh_ply: bool,
    /// `mesh/mesh.%04d.usdc`: the surface of the base.
    pub mesh_usd: bool,
    /// How far the triangles of these meshes are merged where the surface is flat, in 0..=1.
    pub mesh_adaptivity: f64,
}

impl VolumesOutput {
    /// Whether any fog is written.
    pub fn fog(self) -> bool {
        self.fog_base || self.fog_grains || self.fog_mist
    }

    /// Whether any mesh is written.
    pub fn mesh(self) -> bool {
        self.mesh_ply || self.mesh_usd
    }
}

/// How much of the base a frame's file holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BaseMode {
    /// All of it.
    Full,
    /// All of it at the first frame, then the blocks that changed.
    Delta,
}

impl Scene {
    /// The file that it was read from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Its system.
    pub fn system(&self) -> System {
        self.system
    }

    /// Its frames and frame rate.
    pub fn shot(&self) -> Shot {
        self.shot
    }

    /// The objects, in the file's order.
    pub fn objects(&self) -> &[Object] {
        &self.objects
    }

    /// Which files are written.
    pub fn output(&self) -> Output {
        self.output
    }

    /// The value of every key.
    pub fn values(&self) -> &Values {
        &self.values
    }

    /// Its layer of snow.
    ///
    /// # Errors
    /// A scene without snow.
    pub fn snow(&self) -> Result<&Snow> {
        self.part(System::Snow, self.snow.as_ref())
    }

    /// How its mesh follows a liquid.
    ///
    /// # Errors
    /// A scene without such a mesh.
    pub fn surface(&self) -> Result<&Surface> {
        self.part(System::Surface, self.surface.as_ref())
    }

    /// How its liquid flows over a terrain.
    ///
    /// # Errors
    /// A scene without such a liquid.
    pub fn shallow(&self) -> Result<&Shallow> {
        self.part(System::Shallow, self.shallow.as_ref())
    }

    fn part<'a, T>(&self, of: System, part: Option<&'a T>) -> Result<&'a T> {
        let missing = || {
            let (own, path) = (self.system.name(), self.path.display());
            Error::argument(format!(
                "{path}: is a scene of [{own}], for `frazil {own}`; `{}` is missing",
                of.name()
            ))
        };
        part.ok_or_else(missing)
    }

    /// The files that it reads; of sequences, those of the shot's first frame.
    pub(crate) fn files(&self) -> Vec<PathBuf> {
        let mut out = Vec::new();
        if let Some(shallow) = &self.shallow {
            out.push(shallow.terrain_at(self.shot.frames.first));
            out.extend(
                shallow.obstacles.iter().filter_map(|obstacle| obstacle.file().map(Path::to_path_buf)),
            );
        }
        if let Some(surface) = &self.surface {
            out.extend(surface.mesh.clone());
            out.extend(surface.files_at(self.shot.frames, self.shot.frames.first));
            let sculpts = surface.resculpt.as_deref().and_then(Pattern::parse);
            out.extend(sculpts.map(|pattern| pattern.path(self.shot.frames.first)));
        }
        if let Some(snow) = &self.snow {
            out.extend(snow.files().map(|(_, path)| path.clone()));
        }
        out.extend(self.values.table("mist").find::<PathBuf>("wind"));
        out.extend(self.values.table("grains").find::<PathBuf>("initial"));
        for object in &self.objects {
            let first = f64::from(self.shot.frames.first) - object.offset;
            out.push(match Pattern::parse(&object.file) {
                Some(pattern) => pattern.path(first.floor() as i32),
                None => object.file.clone(),
            });
        }
        out
    }
}

impl Snow {
    /// The files that describe it, with their keys.
    pub(crate) fn files(&self) -> impl Iterator<Item = (&'static str, &PathBuf)> {
        let ground = match &self.ground {
            Some(Ground::Mesh(path)) => Some(("snow.ground", path)),
            _ => None,
        };
        let top = match &self.layer {
            Layer::Top(path) | Layer::Grid(path) => Some(("snow.top", path)),
            Layer::Depth(_) => None,
        };
        ground.into_iter().chain(top)
    }
}

impl Output {
    /// Whether a run can resume from the files of the base alone.
    pub fn base_restarts(&self) -> bool {
        self.inexact_base().is_none()
    }

    /// Whether other stages can read the grains from their files.
    pub(crate) fn grains_readable(&self) -> bool {
        self.grains_vdb || self.grains_usd
    }

    /// The key that keeps exact values out of the base's files, if one does.
    pub(crate) fn inexact_base(&self) -> Option<&'static str> {
        match self {
            Self { half: true, .. } => Some("half"),
            Self { base: false, .. } => Some("base"),
            _ => None,
        }
    }
}
