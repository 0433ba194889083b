//! `frazil mesh compare`: how far two meshes lie apart, or two sequences of them frame by frame, and how much a sequence flickers.

use std::path::{Path, PathBuf};

use frazil::geometry::TriMesh;
use frazil::geometry::check::deviation::{
    Deviation, NearestTree, from_surface, from_vertices, second_differences,
};
use frazil::io::files::sequence::Pattern;
use frazil::scene::FrameChoice;
use frazil::{Context, Error, io};
use serde_json::{Map, Value, json};

use super::compared_mesh::ComparedMesh;
use crate::cli::options::{Origin, frame_path};
use crate::cli::output;
use crate::cli::session::{Failure, OrFailure, Session};

/// Report how far two meshes lie apart, or two sequences of them frame by frame, and how much a sequence flickers.
///
/// Distances are measured from points of one mesh, its vertices and the centres of its triangles, to the nearest positions of the other's
/// surface, and back, in the unit of the files (m). Each point is weighted by the area that it stands for: three quarters of a triangle's
/// go to its centre, a twelfth to each corner.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  frazil mesh compare before.obj after.obj
  frazil mesh compare body.%04d.obj boot.obj --frames 1-2 --json
  frazil mesh compare out/surface/surface.%04d.usdc --frames 1-3 --flicker")]
pub struct Args {
    /// Mesh (.obj, .ply, .stl), character at rest (.glb, .gltf), or a sequence of meshes (a.%04d.ply).
    a: PathBuf,
    /// The mesh to compare A with, of the same kinds; a single file is compared with every frame.
    #[arg(required_unless_present = "flicker")]
    b: Option<PathBuf>,
    /// Frames of sequences.
    #[arg(long, value_name = "A-B|A-BxN|A,B,C", allow_hyphen_values = true)]
    frames: Option<FrameChoice>,
    /// Also report for each sequence the second differences of its vertices' positions over three frames, x(n-1) - 2 x(n) + x(n+1)
    /// (m): the trembling that a still camera sees.
    #[arg(long)]
    flicker: bool,
    #[command(flatten)]
    origin: Origin,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args, session: &Session) -> Result<(), Failure> {
    match args.frames()? {
        Some(frames) => args.sequences(session, &frames),
        None => args.files(session),
    }
}

/// Printed if the faces of a sequence change.
const CHANGED: &str = "where faces change between two frames, no vertex can be followed and the surface's own motion cannot be \
                       subtracted: the distances between the two surfaces are given there instead";

impl Args {
    fn paths(&self) -> impl Iterator<Item = &PathBuf> {
        std::iter::once(&self.a).chain(&self.b)
    }

    /// The files' names in JSON; null for one that is not given.
    fn names(&self) -> Map<String, Value> {
        let name = |path: &PathBuf| json!(path.display().to_string());
        let b = self.b.as_ref().map_or(Value::Null, name);
        Map::from_iter([("a".to_string(), name(&self.a)), ("b".to_string(), b)])
    }

    /// The frames of sequences; none for single files.
    fn frames(&self) -> Result<Option<Vec<i32>>, Failure> {
        let refused = |what: &str| Err(Failure::refused(what));
        let sequence = self.paths().find(|path| Pattern::parse(path).is_some());
        let frames: Vec<i32> = match (sequence, &self.frames) {
            (Some(_), Some(frames)) => frames.iter().collect(),
            (Some(path), None) => {
                return Err(Failure::of_file(path, "holds many frames: choose them with --frames A-B"));
            }
            (None, Some(_)) => {
                return refused("--frames is for sequences such as a.%04d.ply, and none is given");
            }
            (None, None) if self.flicker => {
                return refused("--flicker is for sequences such as a.%04d.ply, and none is given");
            }
            (None, None) => return Ok(None),
        };
        let is_even = frames.windows(3).all(|three| three[2] - three[1] == three[1] - three[0]);
        if self.flicker && (frames.len() < 3 || !is_even) {
            return refused(
                "--flicker needs three frames or more, evenly apart, such as --frames 1-40 or 1-40x2",
            );
        }
        Ok(Some(frames))
    }

    /// Compares two files.
    fn files(&self, session: &Session) -> Result<(), Failure> {
        let meshes = self
            .paths()
            .map(|path| ComparedMesh::read(path, &self.origin))
            .collect::<frazil::Result<Vec<_>>>()
            .or_refuse()?;
        let [a, b] = &meshes[..] else { return Err(Failure::refused("a second mesh is missing")) };
        let found = Comparison::of(&session.ctx, a, b).or_fail()?;
        if self.json {
            let mut object = self.names();
            object.extend(found.json());
            return output::print(&format!("{:#}\n", Value::Object(object))).or_fail();
        }
        let names: Vec<String> = self.paths().map(|path| path.display().to_string()).collect();
        output::print(&found.in_words(&names[0], &names[1])).or_fail()
    }

    /// Compares two sequences, or checks one for flicker, frame by frame.
    fn sequences(&self, session: &Session, frames: &[i32]) -> Result<(), Failure> {
        for &frame in frames {
            for path in self.paths() {
                // Report a gap in a sequence before any work.
                io::files::source::open(&frame_path(path, frame)).or_refuse()?;
            }
        }
        let has_flicker = |path: &PathBuf| self.flicker && Pattern::parse(path).is_some();
        let flicker_of = |path: &PathBuf| has_flicker(path).then(|| Flicker::of(path));
        let mut flickers: Vec<Option<Flicker>> = self.paths().map(flicker_of).collect();
        let mut found: Vec<(i32, Comparison)> = Vec::new();
        let meshes = |frame: i32| {
            self.paths()
                .map(|path| ComparedMesh::read(&frame_path(path, frame), &self.origin))
                .collect::<frazil::Result<Vec<_>>>()
        };
        // Fail early if the first frame cannot be compared.
        self.compare_frame(session, meshes(frames[0]).or_refuse()?, frames[0], &mut found, &mut flickers)?;
        let result = frames[1..].iter().try_for_each(|&frame| {
            self.compare_frame(session, meshes(frame).or_fail()?, frame, &mut found, &mut flickers)
        });
        let flickers = || flickers.iter().flatten();
        if !self.json {
            result?;
            let text: String = flickers().map(Flicker::in_words).collect();
            return output::print(&(all_in_words(&found) + &text)).or_fail();
        }
        // Frames before an error are reported in JSON as in text, but `all_frames` is then null.
        let mut object = self.names();
        object.insert("frames".into(), found.iter().map(|(frame, found)| found.json_of(*frame)).collect());
        object.insert("all_frames".into(), all_json(if result.is_ok() { &found[..] } else { &[] }));
        object.insert("flicker".into(), flickers().map(|flicker| flicker.json(result.is_ok())).collect());
        output::print(&format!("{:#}\n", Value::Object(object))).or_fail()?;
        result
    }

    /// Compares the meshes of a frame, and prints the result.
    fn compare_frame(
        &self,
        session: &Session,
        meshes: Vec<ComparedMesh>,
        frame: i32,
        found: &mut Vec<(i32, Comparison)>,
        flickers: &mut [Option<Flicker>],
    ) -> Result<(), Failure> {
        session.ctx.check().or_fail()?;
        if let [a, b] = &meshes[..] {
            let comparison = Comparison::of(&session.ctx, a, b).or_fail()?;
            self.print_now(&format!("frame {frame}: {}\n", comparison.in_a_line()))?;
            found.push((frame, comparison));
        }
        for (flicker, mesh) in flickers.iter_mut().zip(meshes) {
            let Some(flicker) = flicker else { continue };
            if let Some(text) = flicker.add(&session.ctx, frame, mesh).or_fail()? {
                self.print_now(&text)?;
            }
        }
        Ok(())
    }

    /// Prints text as soon as it is known.
    fn print_now(&self, text: &str) -> Result<(), Failure> {
        if self.json { Ok(()) } else { output::print(text).or_fail() }
    }
}

/// Distances between the surfaces of two meshes, both ways.
struct SurfaceDistances {
    to: Deviation,
    back: Deviation,
}

impl SurfaceDistances {
    fn of(ctx: &Context, a: &TriMesh, b: &TriMesh) -> frazil::Result<Self> {
        ctx.phase("distances", || {
            let checked = |found: Option<Deviation>| {
                found.ok_or_else(|| Error::argument("a mesh without triangles has no surface to compare"))
            };
            let to = checked(from_surface(a, &NearestTree::new(b)))?;
            Ok(Self { to, back: checked(from_surface(b, &NearestTree::new(a)))? })
        })
    }

    /// The Hausdorff distance of the points (m).
    fn hausdorff(&self) -> f64 {
        self.to.max.max(self.back.max)
    }
}

/// The comparison of two meshes.
struct Comparison {
    distances: SurfaceDistances,
    /// From vertex to vertex, if both have the same faces.
    vertices: Option<Deviation>,
    /// Areas of both (m2).
    areas: [f64; 2],
    /// Volumes of both (m3).
    volumes: [f64; 2],
}

impl Comparison {
    fn of(ctx: &Context, a: &ComparedMesh, b: &ComparedMesh) -> frazil::Result<Self> {
        let both = [&a.mesh, &b.mesh];
        Ok(Self {
            distances: SurfaceDistances::of(ctx, &a.mesh, &b.mesh)?,
            vertices: if a.has_faces_of(b) { from_vertices(&a.mesh, &b.mesh) } else { None },
            areas: both.map(TriMesh::area),
            volumes: both.map(TriMesh::volume),
        })
    }

    fn json(&self) -> Map<String, Value> {
        let value = json!({
            "a_to_b": deviation_json(&self.distances.to),
            "b_to_a": deviation_json(&self.distances.back),
            "hausdorff_m": self.distances.hausdorff(),
            "same_faces": self.vertices.is_some(),
            "vertex_to_vertex": self.vertices.as_ref().map(deviation_json),
            "areas_m2": self.areas,
            "area_difference_percent": percent(self.areas),
            "volumes_m3": self.volumes,
            "volume_difference_percent": percent(self.volumes),
        });
        value.as_object().cloned().unwrap_or_default()
    }

    fn json_of(&self, frame: i32) -> Value {
        let mut object = self.json();
        object.insert("frame".into(), json!(frame));
        Value::Object(object)
    }

    fn in_words(&self, a: &str, b: &str) -> String {
        let ([area, other_area], [volume, other_volume]) = (self.areas, self.volumes);
        let (areas, volumes) = (difference(self.areas), difference(self.volumes));
        let vertices = match &self.vertices {
            Some(found) => format!("the same faces; from vertex to vertex {}", in_words(found)),
            None => "different faces, or in a different order".to_string(),
        };
        format!(
            "{a}: area {area:.6} m2, volume {volume:.6} m3\n\
             {b}: area {other_area:.6} m2 ({areas}), volume {other_volume:.6} m3 ({volumes})\n  \
             from {a} to {b}: {}\n  from {b} to {a}: {}\n  Hausdorff distance {:.6} m\n  {vertices}\n",
            in_words(&self.distances.to),
            in_words(&self.distances.back),
            self.distances.hausdorff()
        )
    }

    fn in_a_line(&self) -> String {
        let vertices = self.vertices.as_ref();
        let vertices = vertices.map_or("different faces".to_string(), |found| {
            format!("the same faces, from vertex to vertex {}", in_words(found))
        });
        let (areas, volumes) = (difference(self.areas), difference(self.volumes));
        let [to, back] = [&self.distances.to, &self.distances.back].map(in_words);
        format!("from A to B {to}; from B to A {back}; area {areas}, volume {volumes}; {vertices}")
    }
}

/// Distances over several frames.
struct Overall {
    mean: f64,
    p95: f64,
    max: f64,
    /// Frame of the maximum.
    frame: i32,
}

impl Overall {
    /// None if there are no frames.
    fn of<'a>(frames: impl Iterator<Item = (i32, &'a Deviation)>) -> Option<Self> {
        let (mut count, mut sum) = (0u32, 0.0);
        let mut all: Option<Self> = None;
        for (frame, found) in frames {
            count += 1;
            sum += found.mean;
            let overall = all.get_or_insert(Self { mean: 0.0, p95: 0.0, max: found.max, frame });
            overall.p95 = overall.p95.max(found.p95);
            if found.max > overall.max {
                (overall.max, overall.frame) = (found.max, frame);
            }
        }
        all.map(|all| Self { mean: sum / f64::from(count), ..all })
    }

    fn json(&self) -> Value {
        json!({ "mean_m": self.mean, "most_p95_m": self.p95, "max_m": self.max, "max_frame": self.frame })
    }

    fn in_words(&self) -> String {
        let Self { mean, p95, max, frame } = self;
        format!(
            "mean of the means {mean:.6} m; in every frame 95 % within {p95:.6} m, all within {max:.6} m (frame {frame})"
        )
    }
}

/// From A to B, back, and from vertex to vertex if all frames have the same faces.
fn overall(found: &[(i32, Comparison)]) -> [(&'static str, &'static str, Option<Overall>); 3] {
    let to = Overall::of(found.iter().map(|(frame, found)| (*frame, &found.distances.to)));
    let back = Overall::of(found.iter().map(|(frame, found)| (*frame, &found.distances.back)));
    let vertices: Option<Vec<(i32, &Deviation)>> =
        found.iter().map(|(frame, found)| Some((*frame, found.vertices.as_ref()?))).collect();
    let vertices = vertices.and_then(|vertices| Overall::of(vertices.into_iter()));
    [
        ("a_to_b", "from A to B", to),
        ("b_to_a", "from B to A", back),
        ("vertex_to_vertex", "from vertex to vertex", vertices),
    ]
}

fn all_json(found: &[(i32, Comparison)]) -> Value {
    if found.is_empty() {
        return Value::Null;
    }
    let entry = |(key, _, all): (&'static str, _, Option<Overall>)| {
        (key.to_string(), all.map_or(Value::Null, |all| all.json()))
    };
    let mut object: Map<String, Value> = overall(found).into_iter().map(entry).collect();
    object.insert("hausdorff_m".into(), json!(hausdorff(found)));
    Value::Object(object)
}

fn all_in_words(found: &[(i32, Comparison)]) -> String {
    if found.is_empty() {
        return String::new();
    }
    let line = |(_, name, all): (_, &str, Option<Overall>)| {
        all.map_or(String::new(), |all| format!("  {name}: {}\n", all.in_words()))
    };
    let lines: String = overall(found).into_iter().map(line).collect();
    format!("all frames:\n{lines}  Hausdorff distance at most {:.6} m\n", hausdorff(found))
}

/// The maximum over all frames (m).
fn hausdorff(found: &[(i32, Comparison)]) -> f64 {
    found.iter().map(|(_, found)| found.distances.hausdorff()).fold(0.0, f64::max)
}

/// The flicker of a sequence.
struct Flicker {
    name: String,
    /// The previous frames, at most two.
    last: Vec<(i32, ComparedMesh)>,
    steps: Vec<Step>,
}

/// The contribution of a frame.
enum Step {
    /// Second differences around the middle frame of three with the same faces.
    Vertices(i32, Deviation),
    /// Two frames with different faces.
    Surfaces([i32; 2], SurfaceDistances),
}

impl Flicker {
    fn of(path: &Path) -> Self {
        Self { name: path.display().to_string(), last: Vec::new(), steps: Vec::new() }
    }

    /// Adds the next frame; returns its contribution as text.
    fn add(&mut self, ctx: &Context, frame: i32, mesh: ComparedMesh) -> frazil::Result<Option<String>> {
        let step = match &self.last[..] {
            [.., (before, last)] if !mesh.has_faces_of(last) => {
                Some(Step::Surfaces([*before, frame], SurfaceDistances::of(ctx, &last.mesh, &mesh.mesh)?))
            }
            [(_, first), (middle, last)] if last.has_faces_of(first) => {
                let found = second_differences([&first.mesh, &last.mesh, &mesh.mesh]);
                found.map(|found| Step::Vertices(*middle, found))
            }
            _ => None,
        };
        if self.last.len() == 2 {
            self.last.remove(0);
        }
        self.last.push((frame, mesh));
        let text = step.as_ref().map(|step| format!("{}, {}\n", self.name, step.in_words()));
        self.steps.extend(step);
        Ok(text)
    }

    /// The second differences with their middle frames.
    fn vertices(&self) -> impl Iterator<Item = (i32, &Deviation)> {
        self.steps.iter().filter_map(|step| match step {
            Step::Vertices(frame, found) => Some((*frame, found)),
            Step::Surfaces(..) => None,
        })
    }

    fn json(&self, is_whole: bool) -> Value {
        let frames = self.vertices().map(|(frame, found)| {
            let mut value = deviation_json(found);
            value["frame"] = json!(frame);
            value
        });
        let changes = self.steps.iter().filter_map(|step| match step {
            Step::Vertices(..) => None,
            Step::Surfaces(frames, distances) => Some(json!({
                "frames": frames,
                "forward": deviation_json(&distances.to),
                "back": deviation_json(&distances.back),
                "hausdorff_m": distances.hausdorff(),
            })),
        });
        json!({
            "file": self.name,
            "frames": frames.collect::<Value>(),
            "all_frames": Overall::of(self.vertices()).filter(|_| is_whole).map(|all| all.json()),
            "changes": changes.collect::<Value>(),
        })
    }

    fn in_words(&self) -> String {
        let name = &self.name;
        let mut out = match Overall::of(self.vertices()) {
            Some(all) => format!("{name}, flicker over all frames: {}\n", all.in_words()),
            None => format!("{name}, flicker: no three frames have the same faces\n"),
        };
        if self.steps.iter().any(|step| matches!(step, Step::Surfaces(..))) {
            out += &format!("{name}: {CHANGED}\n");
        }
        out
    }
}

impl Step {
    fn in_words(&self) -> String {
        match self {
            Self::Vertices(frame, found) => format!("flicker around frame {frame}: {}", in_words(found)),
            Self::Surfaces([from, to], distances) => format!(
                "frames {from} and {to} have different faces: forward {}; back {}",
                in_words(&distances.to),
                in_words(&distances.back)
            ),
        }
    }
}

fn deviation_json(found: &Deviation) -> Value {
    let at = <[f64; 3]>::from(found.max_at);
    json!({ "mean_m": found.mean, "p95_m": found.p95, "max_m": found.max, "max_at_m": at })
}

fn in_words(found: &Deviation) -> String {
    let Deviation { mean, p95, max, max_at: at } = found;
    format!(
        "mean {mean:.6} m, 95 % within {p95:.6} m, all within {max:.6} m (at {:.4}, {:.4}, {:.4})",
        at.x, at.y, at.z
    )
}

/// The relative difference of the second number from the first, in percent; none if the first is 0.
fn percent([a, b]: [f64; 2]) -> Option<f64> {
    (a != 0.0).then(|| 100.0 * (b - a) / a.abs())
}

fn difference(both: [f64; 2]) -> String {
    percent(both).map_or("the first is 0".to_string(), |percent| format!("{percent:+.4} %"))
}
