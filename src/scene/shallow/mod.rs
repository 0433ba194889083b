//! Scenes of a little liquid on a terrain: their keys, the contents of their files ([`Inputs`]), the check ([`check`]), estimates of
//! memory and disk space, the stage `liquid` (`stage/`), and the surroundings for a picture ([`Surroundings`]).

mod check;
mod estimate;
mod inputs;
mod keys;
mod pipeline;
mod stage;
mod surroundings;

use std::path::{Path, PathBuf};

pub use check::{Report, check};
pub use inputs::Inputs;
pub use inputs::scalars::SceneScalar;
pub(super) use keys::{KEYS, TABLE_ARRAY_KEYS};
pub use pipeline::pipeline;
pub use surroundings::Surroundings;

use super::schema::Values;
use super::schema::declaration::OBJECT;
use super::{KeyPose, Role};
use crate::io::files::sequence::Pattern;
use crate::motion::Space;
use crate::shallow::free_fall::Falls;
use crate::shallow::material::Liquid;
use crate::shallow::params::{Friction, Section, TimeStepping};
use crate::shallow::pipes::Border;
use crate::shallow::sources::FlowPoint;
use crate::shallow::{Params, Staining, sources};

/// Cubic metres in a millilitre.
pub const ML: f64 = 1.0e-6;

/// A liquid that flows over a terrain, and its output.
#[derive(Debug, Clone, PartialEq)]
pub struct Shallow {
    /// File of a mesh, of a level set or of an image of heights, or the pattern of a sequence of a moving mesh.
    pub terrain: PathBuf,
    /// Placement of an image on the ground.
    pub image: Option<ImagePlacement>,
    /// A mesh's unit and upward axis.
    pub space: Space,
    /// A sequence starts this many frames later.
    pub offset: i32,
    /// Edge of a cell (m).
    pub cell: f64,
    /// Minimum and maximum x and z of the cells, `[x0, z0, x1, z1]` (m); `None`: those of the terrain.
    pub area: Option<[f64; 4]>,
    /// Minimum height of ground and liquid (m); `None`: from the terrain.
    pub bottom: Option<f64>,
    /// Maximum height of ground and liquid (m); `None`: from the terrain.
    pub top: Option<f64>,
    /// Its look: water, blood, paint or honey.
    pub look: String,
    /// Parameters of the flow.
    pub params: Params,
    /// Height up to which it stands at the first frame (m).
    pub fill: Option<f64>,
    /// The scalars that the liquid carries.
    pub scalars: Vec<SceneScalar>,
    /// Liquid poured at given frames.
    pub pours: Vec<Pour>,
    /// Sources, then drains, then absorbers, each in the file's order.
    pub points: Vec<TimedFlowPoint>,
    /// Obstacles, at rest or moving.
    pub obstacles: Vec<Obstacle>,
    /// How it stains a terrain that is a mesh; the stained terrain is then written. `None`: not at all.
    pub staining: Option<Staining>,
    /// Whether films get minimum heights, so that a terrain that is a mesh does not show through.
    pub minimum_heights: bool,
    /// Whether the surface comes down where the ground ends.
    pub skirts: bool,
    /// Depth from which it is opaque (m).
    pub opaque_depth: f64,
    /// Which files are written.
    pub output: OutputFiles,
}

/// How an image of heights is placed around the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImagePlacement {
    /// Lengths along x and z (m).
    pub size: [f64; 2],
    /// Heights of black and of white (m).
    pub heights: [f64; 2],
}

/// Liquid that is poured at a frame.
#[derive(Debug, Clone, PartialEq)]
pub struct Pour {
    /// Centre (m).
    pub at: [f64; 3],
    /// Radius of the circle, seen from above (m).
    pub radius: f64,
    /// Its volume (m3).
    pub volume: f64,
    /// Its frame; `None`: the first.
    pub frame: Option<i32>,
    /// Concentrations of the scalars.
    pub carries: Vec<f64>,
}

/// A source, a drain or an absorber with the frames at which it is active.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedFlowPoint {
    /// Its table, such as `source`, and its index there, from 0.
    pub name: (&'static str, usize),
    /// The flow point; if it follows the terrain, at the position that the scene gives.
    pub flow_point: FlowPoint,
    /// Concentrations of the scalars in the liquid of a source.
    pub carries: Vec<f64>,
    /// Whether it moves with the terrain.
    pub follows: bool,
    /// First frame; `None`: from the beginning.
    pub from: Option<i32>,
    /// Last frame; `None`: to the end.
    pub until: Option<i32>,
}

/// An obstacle, at rest or moving.
#[derive(Debug, Clone, PartialEq)]
pub struct Obstacle {
    /// Its shape.
    pub shape: ObstacleShape,
    /// Its poses at frames, ascending; may be empty.
    pub keys: Vec<KeyPose>,
    /// Whether the motion between keys is eased.
    pub ease: bool,
}

/// The shape of an obstacle, centred at the origin.
#[derive(Debug, Clone, PartialEq)]
pub enum ObstacleShape {
    /// A sphere of this radius (m).
    Sphere(f64),
    /// A capsule along y: its radius, and the distance between the centres of its ends (m).
    Capsule(f64, f64),
    /// A box: lengths along x, y and z (m).
    Cuboid([f64; 3]),
    /// A closed mesh that does not move, with its file's unit and axis.
    Mesh(PathBuf, Space),
}

/// Which files and arrays are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct OutputFiles {
    /// `liquid/liquid.%04d.ply`.
    pub ply: bool,
    /// `liquid/liquid.%04d.usdc`.
    pub usd: bool,
    /// `volume/volume.%04d.vdb`.
    pub vdb: bool,
    /// `terrain/terrain.%04d.ply`: the terrain, if it moves or is stained.
    pub terrain_ply: bool,
    /// Terrain and obstacles in USD: `surroundings.usdc`, `terrain/terrain.%04d.usdc` and `obstacles/obstacles.%04d.usdc`.
    pub terrain_usd: bool,
    /// Velocities of the surface.
    pub velocities: bool,
    /// Depths.
    pub depth: bool,
    /// Layers, from the bottom.
    pub layer: bool,
    /// Opacities.
    pub alpha: bool,
    /// Whether each vertex is in the air.
    pub falling: bool,
    /// Concentrations of scalars.
    pub scalars: bool,
}

impl Shallow {
    /// The liquid of a scene; `None` without `[shallow]`.
    pub(super) fn of(values: &Values) -> Option<Self> {
        let (own, output) = (values.table("shallow"), values.table("output"));
        let (size, heights) = (own.find("terrain_size"), own.find("terrain_height"));
        Some(Self {
            terrain: own.find("terrain")?,
            image: size.zip(heights).map(|(size, heights)| ImagePlacement { size, heights }),
            space: own.space(),
            offset: own.get("offset"),
            cell: own.find("cell")?,
            area: own.find("area"),
            bottom: own.find("bottom"),
            top: own.find("top"),
            look: own.get("liquid"),
            params: params(values),
            fill: own.find("fill"),
            scalars: SceneScalar::all_of(values),
            pours: (0..values.count("pour")).map(|index| Pour::of(values, index)).collect(),
            points: TimedFlowPoint::all_of(values),
            obstacles: (0..values.count(OBJECT)).filter_map(|index| Obstacle::of(values, index)).collect(),
            staining: own.get::<bool>("stains").then(|| Staining {
                scalar: inputs::scalars::staining(values),
                half_life: own.get("stain_half_life"),
                ..Staining::default()
            }),
            minimum_heights: own.get("lifts"),
            skirts: own.get("skirts"),
            opaque_depth: own.get("opaque_depth"),
            output: OutputFiles {
                ply: output.holds("liquid", "ply"),
                usd: output.holds("liquid", "usd"),
                vdb: output.holds("volume", "vdb"),
                terrain_ply: output.holds("terrain", "ply"),
                terrain_usd: output.holds("terrain", "usd"),
                velocities: output.holds("attributes", "v"),
                depth: output.holds("attributes", "depth"),
                layer: output.holds("attributes", "layer"),
                alpha: output.holds("attributes", "alpha"),
                falling: output.holds("attributes", "falling"),
                scalars: output.holds("attributes", "scalars"),
            },
        })
    }

    /// The terrain's pattern, if it is a sequence.
    pub(super) fn sequence(&self) -> Option<Pattern> {
        Pattern::parse(&self.terrain)
    }

    /// The terrain's file at a frame of the shot.
    pub(super) fn terrain_at(&self, frame: i32) -> PathBuf {
        match self.sequence() {
            Some(pattern) => pattern.path(frame.saturating_sub(self.offset)),
            None => self.terrain.clone(),
        }
    }
}

impl Pour {
    fn of(values: &Values, index: usize) -> Self {
        let own = values.element("pour", index);
        Self {
            at: own.get("at"),
            radius: own.get("radius"),
            volume: own.get::<f64>("volume_ml") * ML,
            frame: own.find("frame"),
            carries: inputs::scalars::concentrations(values, "pour", index),
        }
    }
}

impl TimedFlowPoint {
    fn all_of(values: &Values) -> Vec<Self> {
        let all =
            |table: &'static str| (0..values.count(table)).map(move |index| Self::of(values, table, index));
        all("source").chain(all("drain")).chain(all("absorber")).collect()
    }

    fn of(values: &Values, table: &'static str, index: usize) -> Self {
        let own = values.element(table, index);
        let kind = match table {
            "source" => sources::Kind::Source,
            "drain" => match own.find::<f64>("orifice_mm2") {
                Some(area) => sources::Kind::Orifice(area * 1e-6 * own.get::<f64>("discharge")),
                None => sources::Kind::Drain,
            },
            _ => sources::Kind::Absorber(own.get::<f64>("capacity_ml") * ML),
        };
        // Absorbers do not pulse.
        let pulse = own.find("frequency").zip(own.find("swing"));
        let flow_point = FlowPoint {
            kind,
            at: own.get("at"),
            radius: own.get("radius"),
            rate: own.get::<f64>("rate_ml") * ML,
            pulse: pulse
                .filter(|(frequency, share)| *frequency > 0.0 && *share > 0.0)
                .map(|(frequency, share)| sources::Pulse { frequency, share }),
        };
        Self {
            name: (table, index),
            flow_point,
            carries: inputs::scalars::concentrations(values, table, index),
            follows: own.get("follows"),
            from: own.find("from"),
            until: own.find("until"),
        }
    }

    /// Whether it is active over the step to a frame.
    pub(super) fn is_active(&self, frame: i32) -> bool {
        self.from.is_none_or(|from| from <= frame) && self.until.is_none_or(|until| frame <= until)
    }

    /// Its name in messages: `source.2`.
    pub(super) fn title(&self) -> String {
        format!("{}.{}", self.name.0, self.name.1 + 1)
    }
}

impl Obstacle {
    fn of(values: &Values, index: usize) -> Option<Self> {
        let own = values.element(OBJECT, index);
        let shape = match own.text("shape") {
            Some("sphere") => ObstacleShape::Sphere(own.find("radius")?),
            Some("capsule") => ObstacleShape::Capsule(own.find("radius")?, own.find("length")?),
            Some(_) => ObstacleShape::Cuboid(own.find("size")?),
            None => ObstacleShape::Mesh(own.find("file")?, own.space()),
        };
        Some(Self { shape, keys: own.get("keys"), ease: own.get("ease") })
    }

    /// The file of a mesh.
    pub(super) fn file(&self) -> Option<&Path> {
        if let ObstacleShape::Mesh(path, _) = &self.shape { Some(path) } else { None }
    }
}

/// Parameters of a scene's liquid.
fn params(values: &Values) -> Params {
    let own = values.table("shallow");
    Params {
        liquid: if own.get("thinning") { Liquid::THINNING_BLOOD } else { Liquid::new(own.get("viscosity")) },
        gravity: own.get("gravity"),
        kept: own.get("kept"),
        pace: match own.text("pace") {
            Some("realtime") => TimeStepping::Realtime(own.get("step")),
            _ => TimeStepping::Exact,
        },
        border: match own.text("border") {
            Some("closed") => Border::Closed,
            Some("absorbing") => Border::Absorbing,
            _ => Border::Open,
        },
        section: Section::default(),
        friction: if own.text("friction") == Some("walls") { Friction::Walls } else { Friction::Ground },
        thickening: inputs::scalars::thickening(values),
        falls: own.get::<bool>("falls").then(|| Falls {
            height: own.get("falls_height"),
            interval: own.get("falls_interval"),
            drop: own.get::<f64>("falls_drop_ml") * ML,
            max_packets: own.get("falls_most"),
        }),
        rest: own.get("rest"),
    }
}

/// Roles of objects that matter to settings: the objects of such a scene have none.
const ROLES: &[Role] = &[];

#[cfg(test)]
mod tests {
    use super::super::systems::keys::{self, template};
    use super::*;
    use crate::scene::{Scene, System};
    use crate::shallow::Thickening;

    fn scene(lines: &str) -> Scene {
        let text = format!("[shot]\nframes = \"1-2\"\n[shallow]\nterrain = \"a.obj\"\ncell = 0.01\n{lines}");
        Scene::parse(&text, Path::new("/s/shot.toml"), &[]).unwrap()
    }

    #[test]
    fn viscosities_of_the_keys_are_those_of_the_library() {
        for name in ["water", "blood", "paint", "honey"] {
            let scene = scene(&format!("liquid = \"{name}\"\n"));
            let shallow = scene.shallow().unwrap();
            assert_eq!((&*shallow.look, Some(shallow.params.liquid)), (name, Liquid::named(name)));
        }
        // Except for border and pace, a scene's defaults are the library's.
        let params = scene("").shallow().unwrap().params.clone();
        assert_eq!(params, Params { border: Border::Open, pace: TimeStepping::Exact, ..Params::default() });
        let thick = scene("liquid = \"paint\"\nviscosity = 0.25\n");
        assert_eq!(thick.shallow().unwrap().params.liquid, Liquid::new(0.25));
        let other = scene("friction = \"walls\"\nrest = 0.0\n").shallow().unwrap().params.clone();
        assert_eq!((other.friction, other.rest, other.thickening), (Friction::Walls, 0.0, None));
        let carries = "[[scalar]]\nname = \"a\"\n[[scalar]]\nname = \"b\"\nrange = 9\nthickens_times = 3\nthickens_from = 5\nthickens_to = 1\n";
        let law = Thickening { scalar: 1, from: 5.0, to: 1.0, times: 3.0 };
        assert_eq!(scene(carries).shallow().unwrap().params.thickening, Some(law));
        assert_eq!(scene("thinning = true\n").shallow().unwrap().params.liquid, Liquid::THINNING_BLOOD);
    }

    #[test]
    fn arrays_of_tables_keep_their_order_through_the_resolved_scene() {
        let lines = "[[source]]\nat = [0, 0, 0]\nradius = 1\nrate_ml = 2\nfrom = 3\nuntil = 4\n\
                  [[source]]\nat = [5, 0, 0]\nradius = 0\nrate_ml = 1\nfrequency = 2\nswing = 0.5\n\
                  [[drain]]\nat = [1, 2, 3]\nradius = 1\nrate_ml = 7\n\
                  [[pour]]\nat = [0, 1, 0]\nradius = 0.1\nvolume_ml = 3\n\
                  [[object]]\nshape = \"sphere\"\nradius = 0.5\nkeys = [{ frame = 1, at = [0, 1, 0] }]\n\
                  [[object]]\nfile = \"stone.obj\"\nscale = 0.001\n";
        let first = scene(lines);
        let shallow = first.shallow().unwrap();
        let titles: Vec<String> = shallow.points.iter().map(TimedFlowPoint::title).collect();
        assert_eq!(titles, ["source.1", "source.2", "drain.1"]);
        let is_active = |frame| shallow.points[0].is_active(frame);
        assert_eq!([2, 3, 4, 5].map(is_active), [false, true, true, false]);
        assert_eq!(shallow.pours[0].volume, 3e-6);
        assert!(matches!(shallow.obstacles[0].shape, ObstacleShape::Sphere(radius) if radius == 0.5));
        assert_eq!(shallow.obstacles[1].file(), Some(Path::new("/s/stone.obj")));
        let again = Scene::parse(&first.to_toml(), Path::new("/s/shot.toml"), &[]).unwrap();
        assert_eq!(again, first);
    }

    #[test]
    fn values_of_the_starter_scene_are_valid() {
        let shown = template(System::Shallow);
        let text: Vec<&str> = shown
            .lines()
            .map(|line| line.trim_start_matches("# "))
            .skip_while(|line| *line != "[shot]")
            .filter(|line| {
                !["file =", "size =", "terrain_", "half_life"].iter().any(|start| line.starts_with(start))
            })
            .collect();
        let scene = Scene::parse(&text.join("\n"), Path::new("/s/shot.toml"), &[]).unwrap();
        let missing: Vec<&str> = keys::of(System::Shallow)
            .iter()
            .filter(|key| !scene.values.iter().any(|(own, _, _)| own == *key))
            .map(|key| key.name)
            .collect();
        assert_eq!(missing, ["terrain_size", "terrain_height", "half_life", "size", "file"]);
    }
}
