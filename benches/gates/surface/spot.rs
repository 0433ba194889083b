//! Gates of a detailed mesh on a real solver's cache, through the command: `spot_drop` of the test data.

use std::path::{Path, PathBuf};
use std::process::Command;

use frazil::Context;
use frazil::geometry::check::topology::components;
use frazil::geometry::mesh::attributes::{MeshArray, Number, On};
use frazil::geometry::{DVec3, DetailedMesh, TriMesh, Uvs};
use frazil::io::mesh;
use frazil::surface::{Params, Particles, Tracker};

use crate::common::character::output;
use crate::common::liquids::{context, surface_on};
use crate::common::nearest::distances;
use crate::common::spot::{FPS, FRAMES, SPACING, particles_at};
use crate::harness::{Harness, timed};
use crate::process::{frazil, quiet, works};
use crate::scenes::wanted_data;
use crate::snow::grains::passes::kill;

/// Frames whose particles' surface is triangulated on a quarter of the spacing.
const LOOKED_AT: [i32; 6] = [1, 3, 4, 11, 26, 41];
/// Rounds of smoothing that take the sculpted detail away.
const ROUNDS: usize = 20;

pub fn run(h: &mut Harness) {
    let of_shape = ["off_surface", "detail", "gain", "flagged_before", "flagged", "volume"];
    let of_shape = of_shape.map(|name| format!("surface.spot_{name}"));
    let of_arrays = ["surface.velocity", "surface.arrays_kept"];
    let of_bytes @ [kill, cpu] = ["surface.same_bytes_kill", "surface.same_bytes_cpu"];
    let names: Vec<&str> = of_shape.iter().map(String::as_str).chain(of_arrays).chain(of_bytes).collect();
    let Some(first) = wanted_data(h, &names, "particles/spot_drop/spot.0001.bgeo") else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let spot = Spot { cache: first.with_file_name("spot.%04d.bgeo"), folder: folder.path().to_path_buf() };
    let own = spot.write_mesh(&first.with_file_name("spot_detail.ply"));
    let (took, noisy) = timed(|| works(&mut spot.pass("once", 2)));
    println!("# {FRAMES} frames in {took:.1} s, with files{noisy}");
    let frames: Vec<DetailedMesh> = (1..=FRAMES).map(|frame| spot.frame("once", frame)).collect();
    h.measure_all(of_shape, || shape(&spot, &frames));
    h.measure_all(of_arrays, || carried(&own, &frames));
    h.measure(kill, || spot.is_same_after_kills(took));
    h.measure(cpu, || (spot.is_same_at_levels(&frames[..12]), "baseline and avx2, 12 frames"));
}

/// The cache, and where its shots go.
struct Spot {
    cache: PathBuf,
    folder: PathBuf,
}

impl Spot {
    /// Writes the mesh with a seam in its texture coordinates, and with arrays of vertices, faces and corners.
    fn write_mesh(&self, sculpted: &Path) -> DetailedMesh {
        let mesh = mesh::read(sculpted).expect("a mesh");
        let faces = mesh.triangles.len();
        let array = |name: &str, on, number, count: usize| MeshArray {
            name: name.into(),
            on,
            number,
            values: (0..count).map(|n| (n * 7 % 251) as f64).collect(),
        };
        let uvs = Uvs {
            coordinates: (0..3 * faces).map(|n| [n as f32 * 1.3e-5, 1.0 / (1.0 + n as f32)]).collect(),
            corners: Some((0..3 * faces as u32).collect()),
            missing: 0,
        };
        let arrays = vec![
            array("red", On::Vertices, Number::U8, mesh.positions.len()),
            array("part", On::Faces, Number::I32, faces),
            array("wet", On::Corners, Number::F32, 3 * faces),
        ];
        let written: Vec<&MeshArray> = arrays.iter().collect();
        let carried = mesh::Carried { uvs: Some(&uvs), arrays: &written, ..mesh::Carried::default() };
        mesh::write_carried(&self.folder.join("spot.ply"), &mesh, &carried).expect("a file");
        DetailedMesh { mesh, uvs: Some(uvs), arrays }
    }

    /// A pass into a folder of its own.
    fn pass(&self, out: &str, threads: usize) -> Command {
        let threads = threads.to_string();
        let mut run = frazil(["surface", "-q", "--set", "surface.rebuild=false", "--threads", &threads]);
        // Whole: USD leaves out triangles without an area.
        run.args(["--set", "output.surface=[\"ply\"]"]);
        run.args(["--fps", &FPS.to_string(), "--spacing", &SPACING.to_string()]);
        run.arg("-p").arg(&self.cache).arg("-m").arg(self.folder.join("spot.ply"));
        run.arg("-o").arg(self.folder.join(out));
        quiet(&mut run);
        run
    }

    fn frame(&self, out: &str, frame: i32) -> DetailedMesh {
        let path = self.folder.join(format!("{out}/surface/surface.{frame:04}.ply"));
        mesh::read_detailed(&path).expect("a frame")
    }

    /// Whether files are the same after kills, on one and two threads, where a pass takes a time (s).
    fn is_same_after_kills(&self, took: f64) -> (bool, String) {
        let files = |out: &str| output(&self.folder.join(out));
        let made = || std::fs::read_dir(self.folder.join("killed/surface")).map_or(0, |files| files.count());
        let kills =
            kill(|threads| self.pass("killed", threads), 0.25 * took, || Some(made()).filter(|n| *n > 0));
        works(&mut self.pass("killed", 2));
        let is_same = files("once") == files("killed") && kills.len() > 2;
        (is_same, format!("after kills at frames {kills:?}; 1 and 2 threads"))
    }

    /// Whether other CPU levels make the same first frames.
    fn is_same_at_levels(&self, once: &[DetailedMesh]) -> bool {
        let frames = format!("1-{}", once.len());
        ["baseline", "avx2"].iter().all(|level| {
            works(self.pass(level, 2).env("FRAZIL_CPU", level).args(["--frames", &frames]));
            (1..).zip(once).all(|(frame, own)| self.frame(level, frame) == *own)
        })
    }

    fn particles(&self, frame: i32) -> Particles {
        particles_at(&self.cache, frame)
    }

    /// Whether the particles' own surface merges or splits between a frame and the one before.
    fn changes(&self, ctx: &Context, frame: i32) -> bool {
        let [before, now] = [frame - 1, frame].map(|frame| self.phi(ctx, frame, 0.5));
        let kind = |surface: &TriMesh| (components(&surface.triangles).len(), surface.euler_characteristic());
        let [from, to] = [frame - 1, frame].map(|frame| self.particles(frame));
        let mut own = Tracker::new(ctx, Params::for_spacing(SPACING), &before, &from).expect("a tracker");
        let report = own.step(ctx, &from, &to, 1.0 / FPS).expect("a step");
        kind(&before) != kind(&now) || report.jumped + report.lost > 0
    }

    /// The particles' own surface at a frame, on cells of some share of the spacing.
    fn phi(&self, ctx: &Context, frame: i32, cell: f64) -> TriMesh {
        surface_on(ctx, &self.particles(frame).positions, SPACING, cell)
    }
}

fn array<'a>(mesh: &'a DetailedMesh, name: &str) -> &'a [f64] {
    &mesh.arrays.iter().find(|array| array.name == name).expect("an array").values
}

fn is_flagged(mesh: &DetailedMesh) -> Vec<bool> {
    array(mesh, "flagged").iter().map(|flag| *flag != 0.0).collect()
}

/// Distance to the surface, detail, flags and volume.
fn shape(spot: &Spot, frames: &[DetailedMesh]) -> [(f64, String); 6] {
    let ctx = context(2);
    let counts: Vec<usize> =
        frames.iter().map(|frame| is_flagged(frame).iter().filter(|flag| **flag).count()).collect();
    // The first frame at which the particles' own surface merges or splits: parts or handles are others, or a fold closes, so that
    // it does not lie where the particles carried it from the frame before.
    let change = (2..=FRAMES).find(|frame| spot.changes(&ctx, *frame));
    let last = change.unwrap_or(FRAMES + 1) - 1;
    let first_flag = counts.iter().position(|count| *count > 0).map_or(FRAMES, |index| index as i32);
    println!(
        "# the particles' own surface changes first at frame {change:?}, the first flag is at frame {}",
        first_flag + 1
    );

    let mut off = Vec::new();
    for frame in LOOKED_AT {
        let surface = spot.phi(&ctx, frame, 0.25);
        let (mesh, flags) = (&frames[frame as usize - 1], is_flagged(&frames[frame as usize - 1]));
        let delta = array(mesh, "delta");
        let distances = distances(&surface, &mesh.mesh.positions, 0.25 * SPACING);
        let kept = (0..flags.len()).filter(|vertex| !flags[*vertex] && !delta[*vertex].is_nan());
        let mut of_frame: Vec<f64> =
            kept.map(|vertex| (distances[vertex] - delta[vertex].abs()).abs() / SPACING).collect();
        of_frame.sort_unstable_by(f64::total_cmp);
        off.push(of_frame[of_frame.len() * 95 / 100]);
    }
    let worst = off.iter().copied().fold(0.0, f64::max);

    let around = neighbours(&frames[0].mesh);
    let before = detail(&frames[0].mesh, &around);
    let (mut correlation, mut gain) = (1.0f64, 1.0f64);
    for mesh in &frames[1..last as usize] {
        let flags = is_flagged(mesh);
        let is_whole =
            |vertex: &usize| !flags[*vertex] && around[*vertex].iter().all(|other| !flags[*other as usize]);
        let now = detail(&mesh.mesh, &around);
        let pairs: Vec<[f64; 2]> =
            (0..flags.len()).filter(is_whole).map(|vertex| [before[vertex], now[vertex]]).collect();
        let [r, slope] = regression(&pairs);
        correlation = correlation.min(r);
        if (slope - 1.0).abs() > (gain - 1.0).abs() {
            gain = slope;
        }
    }

    let share = |counts: &[usize]| {
        100.0 * counts.iter().sum::<usize>() as f64 / (counts.len() * frames[0].mesh.positions.len()) as f64
    };

    let ratio = |frame: i32| frames[frame as usize - 1].mesh.volume() / spot.phi(&ctx, frame, 0.5).volume();
    let begin = ratio(1);
    let drift = (2..=first_flag).map(|frame| 100.0 * (ratio(frame) / begin - 1.0).abs()).fold(0.0, f64::max);
    let flagged = counts.iter().max().expect("frames");
    [
        (worst, format!("the worst of frames {LOOKED_AT:?}: {off:.4?}")),
        (correlation, format!("the worst of frames 2 to {last}")),
        ((gain - 1.0).abs(), format!("a gain of {gain:.4} in the worst frame")),
        (share(&counts[..last as usize]), format!("frames 1 to {last}")),
        (share(&counts), format!("at most {flagged} vertices")),
        (drift, format!("frames 2 to {first_flag}, before the first flag")),
    ]
}

/// Velocities against the next frame's positions, and what the mesh carries.
fn carried(own: &DetailedMesh, frames: &[DetailedMesh]) -> [(f64, &'static str); 2] {
    let mut most = 0.0f64;
    for pair in frames.windows(2) {
        let speed = ["vx", "vy", "vz"].map(|name| array(&pair[0], name));
        for (vertex, position) in pair[0].mesh.positions.iter().enumerate() {
            let by = DVec3::new(speed[0][vertex], speed[1][vertex], speed[2][vertex]) / FPS;
            let next: DVec3 = pair[1].mesh.positions[vertex].cast();
            most = most.max((position.cast::<f64>() + by - next).norm() / SPACING);
        }
    }
    let is_kept = |frame: &DetailedMesh| {
        frame.uvs == own.uvs
            && frame.mesh.triangles == own.mesh.triangles
            && own.arrays.iter().all(|array| frame.arrays.contains(array))
    };
    let are_kept = f64::from(frames.iter().all(is_kept));
    [
        (most, "all vertices of all frames, positions and velocities in 32 bits"),
        (are_kept, "texture coordinates with seams, arrays of vertices, faces and corners"),
    ]
}

/// Vertices that share an edge with each.
pub fn neighbours(mesh: &TriMesh) -> Vec<Vec<u32>> {
    let mut around = vec![Vec::new(); mesh.positions.len()];
    for [a, b, c] in &mesh.triangles {
        for (from, to) in [(a, b), (b, c), (c, a), (b, a), (c, b), (a, c)] {
            around[*from as usize].push(*to);
        }
    }
    around.iter_mut().for_each(|list| {
        list.sort_unstable();
        list.dedup();
    });
    around
}

/// What smoothing takes away at each vertex, along the smooth mesh's normal (m).
pub fn detail(mesh: &TriMesh, around: &[Vec<u32>]) -> Vec<f64> {
    let mut places: Vec<DVec3> = mesh.positions.iter().map(|place| place.cast()).collect();
    for _ in 0..ROUNDS {
        let mean = |vertex: usize| {
            let list = &around[vertex];
            list.iter().map(|other| places[*other as usize]).sum::<DVec3>() / list.len().max(1) as f64
        };
        places = (0..places.len()).map(|vertex| 0.5 * (places[vertex] + mean(vertex))).collect();
    }
    let smooth = TriMesh {
        positions: places.iter().map(|place| place.cast()).collect(),
        triangles: mesh.triangles.clone(),
    };
    let normals = smooth.normals();
    let part =
        |vertex: usize| (mesh.positions[vertex].cast::<f64>() - places[vertex]).dot(&normals[vertex].cast());
    (0..places.len()).map(part).collect()
}

/// Correlation of pairs, and the slope of the second over the first.
pub fn regression(pairs: &[[f64; 2]]) -> [f64; 2] {
    let count = pairs.len() as f64;
    let mean = [0, 1].map(|n| pairs.iter().map(|pair| pair[n]).sum::<f64>() / count);
    let sum =
        |a: usize, b: usize| pairs.iter().map(|pair| (pair[a] - mean[a]) * (pair[b] - mean[b])).sum::<f64>();
    [sum(0, 1) / (sum(0, 0) * sum(1, 1)).sqrt(), sum(0, 1) / sum(0, 0)]
}
