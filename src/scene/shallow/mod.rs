//! A little liquid on a terrain in scenes: the keys of `[shallow]` and of the tables beside it, the contents of its files ([`Inputs`]), the
//! check ([`check`]), estimates of memory and disk space, the stage `liquid` (`stage/`), and the surroundings for a picture of it
//! ([`Surroundings`]).

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
pub use inputs::scalars::Carried;
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
    /// A mesh, the pattern of a sequence of a moving mesh, a level set or an image of heights.
    pub terrain: PathBuf,
    /// Placement of an image on the ground.
    pub image: Option<ImagePlace>,
    /// A mesh's unit and upward axis.
    pub space: Space,
    /// A sequence starts this many frames later.
    pub offset: i32,
    /// Edge of a cell (m).
    pub cell: f64,
    /// Minimum and maximum x and z of the cells, `[x0, z0, x1, z1]` (m); `None`: those of the terrain.
    pub area: Option<[f64; 4]>,
    /// Minimum height (m); `None`: from the terrain.
    pub bottom: Option<f64>,
    /// Maximum height (m); `None`: from the terrain.
    pub top: Option<f64>,
    /// Its look: water, blood, paint or honey.
    pub look: String,
    /// How it flows.
    pub params: Params,
    /// Height up to which it stands at the first frame (m).
    pub fill: Option<f64>,
    /// The scalars that the liquid carries.
    pub scalars: Vec<Carried>,
    /// Liquid poured at given frames.
    pub pours: Vec<Pour>,
    /// Sources, then drains, then absorbers, each in the file's order.
    pub points: Vec<Point>,
    /// Obstacles, at rest or moving.
    pub obstacles: Vec<Obstacle>,
    /// How it stains a terrain that is a mesh, which is then written; `None`: not at all.
    pub staining: Option<Staining>,
    /// Whether films get minimum heights, so that a terrain that is a mesh does not show through.
    pub lifts: bool,
    /// Whether the surface comes down where the ground ends.
    pub skirts: bool,
    /// Depth from which it is opaque (m).
    pub opaque_depth: f64,
    /// Which files are written.
    pub output: Files,
}

/// How an image of heights is placed around the origin.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ImagePlace {
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

/// A source, a drain or an absorber, active at some frames.
#[derive(Debug, Clone, PartialEq)]
pub struct Point {
    /// Its table, `source`, and its index there, from 0.
    pub name: (&'static str, usize),
    /// The flow point itself; if it follows the terrain, before it is attached to that.
    pub point: FlowPoint,
    /// Concentrations of the scalars in what a source brings.
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
    pub form: Form,
    /// Its poses at frames, ascending; may be empty.
    pub keys: Vec<KeyPose>,
    /// Whether the motion between keys is eased.
    pub ease: bool,
}

/// The shape of an obstacle, around the origin.
#[derive(Debug, Clone, PartialEq)]
pub enum Form {
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
pub struct Files {
    /// `liquid/liquid.%04d.ply`.
    pub ply: bool,
    /// `liquid/liquid.%04d.usda`.
    pub usd: bool,
    /// `volume/volume.%04d.vdb`.
    pub vdb: bool,
    /// Velocities of the surface.
    pub velocities: bool,
    /// Depths.
    pub depth: bool,
    /// Layers, from the bottom.
    pub layer: bool,
    /// Opacities.
    pub alpha: bool,
    /// Whether vertices are in the air.
    pub falling: bool,
    /// Concentrations of scalars.
    pub scalars: bool,
}

impl Shallow {
    /// The liquid of a scene; `None` if it has no such table.
    pub(super) fn of(values: &Values) -> Option<Self> {
        let (own, output) = (values.table("shallow"), values.table("output"));
        let (size, heights) = (own.find("terrain_size"), own.find("terrain_height"));
        Some(Self {
            terrain: own.find("terrain")?,
            image: size.zip(heights).map(|(size, heights)| ImagePlace { size, heights }),
            space: own.space(),
            offset: own.get("offset"),
            cell: own.find("cell")?,
            area: own.find("area"),
            bottom: own.find("bottom"),
            top: own.find("top"),
            look: own.get("liquid"),
            params: params(values),
            fill: own.find("fill"),
            scalars: Carried::all_of(values),
            pours: (0..values.count("pour")).map(|index| Pour::of(values, index)).collect(),
            points: Point::all_of(values),
            obstacles: (0..values.count(OBJECT)).filter_map(|index| Obstacle::of(values, index)).collect(),
            staining: own.get::<bool>("stains").then(|| Staining {
                scalar: inputs::scalars::staining(values),
                half_life: own.get("stain_half_life"),
                ..Staining::default()
            }),
            lifts: own.get("lifts"),
            skirts: own.get("skirts"),
            opaque_depth: own.get("opaque_depth"),
            output: Files {
                ply: output.holds("liquid", "ply"),
                usd: output.holds("liquid", "usd"),
                vdb: output.holds("volume", "vdb"),
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
        let own = values.one("pour", index);
        Self {
            at: own.get("at"),
            radius: own.get("radius"),
            volume: own.get::<f64>("volume_ml") * ML,
            frame: own.find("frame"),
            carries: inputs::scalars::brought(values, "pour", index),
        }
    }
}

impl Point {
    fn all_of(values: &Values) -> Vec<Self> {
        let of =
            |table: &'static str| (0..values.count(table)).map(move |index| Self::of(values, table, index));
        of("source").chain(of("drain")).chain(of("absorber")).collect()
    }

    fn of(values: &Values, table: &'static str, index: usize) -> Self {
        let own = values.one(table, index);
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
        let point = FlowPoint {
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
            point,
            carries: inputs::scalars::brought(values, table, index),
            follows: own.get("follows"),
            from: own.find("from"),
            until: own.find("until"),
        }
    }

    /// Whether it acts over the step to a frame.
    pub(super) fn acts(&self, frame: i32) -> bool {
        self.from.is_none_or(|from| from <= frame) && self.until.is_none_or(|until| frame <= until)
    }

    /// Its name in messages: `source.2`.
    pub(super) fn title(&self) -> String {
        format!("{}.{}", self.name.0, self.name.1 + 1)
    }
}

impl Obstacle {
    fn of(values: &Values, index: usize) -> Option<Self> {
        let own = values.one(OBJECT, index);
        let form = match own.text("shape") {
            Some("sphere") => Form::Sphere(own.find("radius")?),
            Some("capsule") => Form::Capsule(own.find("radius")?, own.find("length")?),
            Some(_) => Form::Cuboid(own.find("size")?),
            None => Form::Mesh(own.find("file")?, own.space()),
        };
        Some(Self { form, keys: own.get("keys"), ease: own.get("ease") })
    }

    /// The file of a mesh.
    pub(super) fn file(&self) -> Option<&Path> {
        if let Form::Mesh(path, _) = &self.form { Some(path) } else { None }
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
            most: own.get("falls_most"),
        }),
        rest: own.get("rest"),
    }
}

/// Objects of such a scene have no roles.
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
    fn what_there_may_be_many_of_keeps_its_order_through_the_resolved_scene() {
        let of = "[[source]]\nat = [0, 0, 0]\nradius = 1\nrate_ml = 2\nfrom = 3\nuntil = 4\n\
                  [[source]]\nat = [5, 0, 0]\nradius = 0\nrate_ml = 1\nfrequency = 2\nswing = 0.5\n\
                  [[drain]]\nat = [1, 2, 3]\nradius = 1\nrate_ml = 7\n\
                  [[pour]]\nat = [0, 1, 0]\nradius = 0.1\nvolume_ml = 3\n\
                  [[object]]\nshape = \"sphere\"\nradius = 0.5\nkeys = [{ frame = 1, at = [0, 1, 0] }]\n\
                  [[object]]\nfile = \"stone.obj\"\nscale = 0.001\n";
        let first = scene(of);
        let shallow = first.shallow().unwrap();
        let titles: Vec<String> = shallow.points.iter().map(Point::title).collect();
        assert_eq!(titles, ["source.1", "source.2", "drain.1"]);
        let acts = |frame| shallow.points[0].acts(frame);
        assert_eq!([2, 3, 4, 5].map(acts), [false, true, true, false]);
        assert_eq!(shallow.pours[0].volume, 3e-6);
        assert!(matches!(shallow.obstacles[0].form, Form::Sphere(radius) if radius == 0.5));
        assert_eq!(shallow.obstacles[1].file(), Some(Path::new("/s/stone.obj")));
        let again = Scene::parse(&first.to_toml(), Path::new("/s/shot.toml"), &[]).unwrap();
        assert_eq!(again, first);
    }

    #[test]
    fn the_scene_to_begin_with_holds_what_its_keys_may_hold() {
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
