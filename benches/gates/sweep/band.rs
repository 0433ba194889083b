//! Gates of narrow bands: what turns, rolls and twists, its values against the union of dense poses. With `FRAZIL_BAND`
//! set to a part of a name, only bodies of that name are swept (all when it is empty), and a line for each course gives
//! the largest error (cells) at each cell size.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use frazil::geometry::mesh::coincident;
use frazil::geometry::{DVec3, TriMesh, Vec3};
use frazil::motion::{Character, Key, Keys, Motion, Placed, Play, Rigid, Space};
use frazil::sweep::{self, Body, Settings, Topology};
use frazil::vdb::{FloatGrid, Leaf};
use frazil::{Context, Result};
use rayon::prelude::*;

use crate::common::character::data;
use crate::common::{hero, shapes};
use crate::scenes::{self, context};
use crate::sweep::dense_union::Dense;
use crate::worst::Worst;

/// Cells from a body's middle to its farthest point.
const CELLS: [f64; 3] = [6.0, 12.0, 24.0];
/// Voxels of each sweep whose values are compared.
const SAMPLES: usize = 24;
/// Poses lie this far apart (cells of the finest), at most and at least so many.
const APART: f64 = 0.1;
const MOST_POSES: usize = 2048;
const MOST_SHAPES: usize = 192;
const LEAST_POSES: usize = 48;
/// Larger errors (cells) are printed with their position.
const PRINTED: f64 = 0.1;
/// Values of neighbours of opposite sign that differ by more (cells) jump.
const JUMP: f64 = 1.3;

/// A body about the origin.
struct Shape {
    name: &'static str,
    kind: Kind,
    /// From the origin to its farthest point (m).
    radius: f64,
}

enum Kind {
    Mesh(TriMesh),
    /// A figure that walks, as a .glb file.
    Figure(PathBuf),
}

/// How a body moves from time 0 to 1: by keys whose positions count in radii, and a twist about y.
struct Course {
    name: String,
    keys: Vec<Key>,
    /// Radians from one end to the other.
    twist: f64,
}

/// All of them.
pub fn measure() -> [(f64, String); 3] {
    let folder = tempfile::tempdir().expect("a folder");
    let only = std::env::var("FRAZIL_BAND").ok();
    let mut shapes = bodies(folder.path());
    shapes.retain(|shape| only.as_ref().is_none_or(|part| shape.name.contains(part.as_str())));
    let (mut found, mut in_snow) = (Found::default(), Found::default());
    for shape in &shapes {
        for course in &courses() {
            let most = course_of(shape, course, &mut found, &mut in_snow);
            if only.is_some() {
                println!("# {} {}: {most}", shape.name, course.name);
            }
        }
    }
    let jumps =
        |found: &Found| (found.jumps as f64, format!("{} pairs, {}", found.pairs, found.worst_jump.note()));
    let of_values = format!("{} values of {} sweeps, {}", found.values, found.sweeps, found.worst.note());
    [jumps(&found), jumps(&in_snow), (found.worst.value(), of_values)]
}

/// What was found, and where the worst of it.
#[derive(Default)]
struct Found {
    sweeps: usize,
    pairs: usize,
    jumps: usize,
    worst_jump: Worst,
    values: usize,
    worst: Worst,
}

/// Sweeps one body along one course with each cell, and once through snow.
fn course_of(shape: &Shape, course: &Course, found: &mut Found, in_snow: &mut Found) -> String {
    let ctx = context(2);
    let finest = shape.radius / CELLS[2];
    let dense = dense(shape, course, finest);
    let mut text = String::new();
    for cells in CELLS {
        let cell = shape.radius / cells;
        let body = [Body::new(motion(shape, course, DVec3::zeros()), 0.0).expect("a body")];
        let grid = sweep::chain(&ctx, &body, 0.0, 1.0, &Settings::new(cell)).expect("a sweep");
        let leaves = Leaves::of(&grid);
        let position = format!("{} {} radius of {cells} cells", shape.name, course.name);
        found.count_jumps(&leaves, &position);
        let error = found.compare(&ctx, &leaves, &dense, &position);
        text += &error;
        found.sweeps += 1;
        if cells == CELLS[1] {
            let mut base = scenes::snow(&ctx, 6.0 * shape.radius, cell, scenes::EXACT);
            // In the middle of its own height: the layer's top crosses the body.
            let body = [Body::new(motion(shape, course, DVec3::y() * 0.3), 0.0).expect("a body")];
            base.step(&ctx, &body, 0.0, 1.0, 1).expect("a step");
            in_snow.count_jumps(&Leaves::of(base.surface()), &position);
        }
    }
    text
}

impl Found {
    /// Counts neighbours of opposite sign, and those whose values jump.
    fn count_jumps(&mut self, leaves: &Leaves, position: &str) {
        leaves.each_voxel(|at, value| {
            for axis in 0..3 {
                let mut next = at;
                next[axis] += 1;
                let other = leaves.value(next);
                if (value < 0.0) == (other < 0.0) {
                    continue;
                }
                self.pairs += 1;
                let jump = (value - other).abs();
                self.jumps += usize::from(jump > JUMP);
                self.worst_jump.see(jump, || format!("{jump:.2} at {at:?} of {position}"));
            }
        });
    }

    /// Compares values within a cell of the surface; returns the largest error (cells), and where a large one is.
    fn compare(&mut self, ctx: &Context, leaves: &Leaves, dense: &Dense, position: &str) -> String {
        let mut near = Vec::new();
        leaves.each_voxel(|at, value| {
            if value.abs() < 1.0 {
                near.push((at, value));
            }
        });
        let step = (near.len() / SAMPLES).max(1);
        let sample: Vec<_> = near.into_iter().step_by(step).collect();
        let error = |&(at, value): &([i32; 3], f64)| {
            let p = DVec3::from(at.map(f64::from)) * leaves.cell;
            let limit = 1.4 * leaves.cell;
            let truth = dense.distance(p, limit) / leaves.cell;
            // A pit or slit may have been missed.
            let is_deeper = truth < 0.0 && value - truth > PRINTED;
            let truth = if is_deeper { dense.distance_closely(p, limit) / leaves.cell } else { truth };
            (truth, (value - truth).abs(), at, value)
        };
        let errors: Vec<_> =
            ctx.phase("oracle", || Ok(sample.par_iter().map(error).collect::<Vec<_>>())).expect("no cancel");
        self.values += errors.len();
        let worst = errors.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
        let Some((truth, error, at, value)) = worst else { return String::new() };
        let what = format!("{value:.3} for {truth:.3} at {at:?}");
        self.worst.see(error, || format!("{what} of {position}"));
        if error > PRINTED { format!("{error:.3} ({what}) ") } else { format!("{error:.3} ") }
    }
}

/// A grid's leaves by their origin.
struct Leaves<'a> {
    cell: f64,
    grid: &'a FloatGrid,
    leaves: HashMap<[i32; 3], Leaf<'a>>,
}

impl<'a> Leaves<'a> {
    fn of(grid: &'a FloatGrid) -> Self {
        let leaves = grid.leaves().expect("leaves").into_iter().map(|leaf| (leaf.origin, leaf)).collect();
        Self { cell: grid.voxel_size(), grid, leaves }
    }

    /// Value (cells) at a voxel.
    fn value(&self, at: [i32; 3]) -> f64 {
        let leaf = self.leaves.get(&at.map(|position| position & !7));
        f64::from(leaf.map_or_else(|| self.grid.value(at), |leaf| leaf.values[index(at)])) / self.cell
    }

    /// Calls `see` with each voxel of the leaves and its value (cells), in a fixed order.
    fn each_voxel(&self, mut see: impl FnMut([i32; 3], f64)) {
        let mut origins: Vec<_> = self.leaves.keys().collect();
        origins.sort_unstable();
        for origin in origins {
            for (index, value) in self.leaves[origin].values.iter().enumerate() {
                see(scenes::voxel(*origin, index), f64::from(*value) / self.cell);
            }
        }
    }
}

fn index(at: [i32; 3]) -> usize {
    let [x, y, z] = at.map(|position| (position & 7) as usize);
    x << 6 | y << 3 | z
}

/// Dense poses of a body along a course.
fn dense(shape: &Shape, course: &Course, finest: f64) -> Dense {
    let way = |pair: &[Key]| {
        shape.radius * ((pair[1].at - pair[0].at).norm() + (pair[1].turn - pair[0].turn).abs().sum())
    };
    let way: f64 = course.keys.windows(2).map(way).sum::<f64>() + course.twist.abs() * shape.radius;
    let count = (way / finest / APART) as usize;
    let many = count.clamp(LEAST_POSES, MOST_POSES);
    let keys = keys(shape, course, DVec3::zeros());
    let positions = (0..many).map(|index| keys.at(index as f64 / (many - 1) as f64));
    match &shape.kind {
        _ if course.twist != 0.0 => {
            Dense::posed(&*motion(shape, course, DVec3::zeros()), count.clamp(LEAST_POSES, MOST_SHAPES))
        }
        Kind::Mesh(mesh) => Dense::rigid(mesh, positions),
        Kind::Figure(path) => Dense::moved(&*walking(path), count.clamp(LEAST_POSES, MOST_SHAPES), positions),
    }
}

fn keys(shape: &Shape, course: &Course, from: DVec3) -> Keys {
    let key = |key: &Key| Key { at: from + key.at * shape.radius, ..*key };
    Keys::new(course.keys.iter().map(key).collect()).expect("keys")
}

/// A body's motion along a course that starts at a position (m).
fn motion(shape: &Shape, course: &Course, from: DVec3) -> Box<dyn Motion> {
    let keys = keys(shape, course, from);
    let inner: Box<dyn Motion> = match &shape.kind {
        Kind::Mesh(mesh) if course.twist == 0.0 => return Box::new(Rigid::new(mesh.clone(), keys)),
        Kind::Mesh(mesh) => Box::new(Rigid::new(mesh.clone(), Keys::new(Vec::new()).expect("no keys"))),
        Kind::Figure(path) => walking(path),
    };
    let twisted = Twisted { inner, rate: course.twist / (2.0 * shape.radius) };
    Box::new(Placed::new(Box::new(twisted), Space::OWN, keys))
}

/// A figure that walks about the origin.
fn walking(path: &Path) -> Box<dyn Motion> {
    // From its hips, a quarter of a round in the second.
    let space = Space { scale: 0.2, ..Space::OWN };
    let position = Keys::new(vec![Key { time: 0.0, at: DVec3::y() * -0.18, turn: DVec3::zeros() }]);
    let figure =
        Character::open(path, Play { clip: Some("walk".into()), ..Play::default() }).expect("the figure");
    Box::new(Placed::new(Box::new(Slow(figure)), space, position.expect("a key")))
}

/// A figure that takes its time.
struct Slow(Character);

/// Another motion, twisted about y ever more.
struct Twisted {
    inner: Box<dyn Motion>,
    /// Radians a metre of height at time 1.
    rate: f64,
}

/// Seconds of a figure's walk in one of a course.
const PACE: f64 = 0.25;

impl Motion for Slow {
    fn triangles(&self) -> &[[u32; 3]] {
        self.0.triangles()
    }

    fn vertex_count(&self) -> usize {
        self.0.vertex_count()
    }

    fn pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        self.0.pose(time * PACE, out)
    }

    fn breaks(&self, from: f64, to: f64) -> Vec<f64> {
        self.0.breaks(from * PACE, to * PACE).into_iter().map(|time| time / PACE).collect()
    }
}

impl Motion for Twisted {
    fn triangles(&self) -> &[[u32; 3]] {
        self.inner.triangles()
    }

    fn vertex_count(&self) -> usize {
        self.inner.vertex_count()
    }

    fn pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        self.inner.pose(time, out)?;
        for p in out {
            let (sin, cos) = (self.rate * time * p.y).sin_cos();
            (p.x, p.z) = (cos * p.x + sin * p.z, cos * p.z - sin * p.x);
        }
        Ok(())
    }

    fn breaks(&self, from: f64, to: f64) -> Vec<f64> {
        self.inner.breaks(from, to)
    }

    fn turning(&self, from: f64, to: f64) -> f64 {
        // About as high as it is wide: half of the twist is at either end.
        self.inner.turning(from, to) + self.rate.abs() * (to - from)
    }
}

fn bodies(folder: &Path) -> Vec<Shape> {
    let mesh = |name, mesh: TriMesh| Shape {
        name,
        radius: mesh.positions.iter().map(|p| f64::from(p.norm())).fold(0.0, f64::max),
        kind: Kind::Mesh(mesh),
    };
    let figure = folder.join("figure.glb");
    std::fs::write(&figure, hero::glb()).expect("a file");
    let mut out = vec![
        mesh("globe of 48", shapes::globe(0.2, 48, 24)),
        mesh("globe of 16", shapes::globe(0.2, 16, 8)),
        mesh("wheel of 6", shapes::wheel(0.2, 0.1, 6)),
        mesh("wheel of 32", shapes::wheel(0.2, 0.1, 32)),
        mesh("wheel of 64", shapes::wheel(0.2, 0.1, 64)),
        mesh("wheel of 128", shapes::wheel(0.2, 0.1, 128)),
        mesh("cube", shapes::cuboid([0.23; 3])),
        mesh("bar", shapes::cuboid([0.38, 0.06, 0.1])),
        mesh("torus", shapes::torus(0.14, 0.06, 40, 20)),
        Shape { name: "figure", kind: Kind::Figure(figure), radius: 0.2 },
    ];
    for (name, file) in [("spot", "mesh/spot.obj"), ("bunny", "mesh/stanford-bunny.obj")] {
        match data(file) {
            Some(path) => out.push(mesh(name, closed(&frazil::io::mesh::read(&path).expect("a mesh")))),
            None => println!("# {name} is left out: no {file} in FRAZIL_DATA"),
        }
    }
    out
}

/// A mesh, 0.2 m from its middle to its end, its holes closed.
fn closed(mesh: &TriMesh) -> TriMesh {
    let start = (Vec3::repeat(f32::INFINITY), Vec3::repeat(f32::NEG_INFINITY));
    let (low, high) = mesh.positions.iter().fold(start, |(low, high), p| (low.inf(p), high.sup(p)));
    let middle = (low + high) / 2.0;
    let reach = mesh.positions.iter().map(|p| (p - middle).norm()).fold(0.0, f32::max);
    let mut positions: Vec<DVec3> =
        mesh.positions.iter().map(|p| (p - middle).cast::<f64>() * (0.2 / f64::from(reach))).collect();
    let same = coincident(positions.iter().copied());
    let topology = Topology::new(&mesh.triangles, positions.len(), &same, true);
    topology.complete(&mut positions);
    let facing = |v: [u32; 3], sign: i8| if sign > 0 { v } else { [v[0], v[2], v[1]] };
    TriMesh {
        positions: positions.iter().map(|p| p.cast()).collect(),
        triangles: topology.simplices.iter().map(|simplex| facing(simplex.v, simplex.sign)).collect(),
    }
}

/// Forty ways to move.
fn courses() -> Vec<Course> {
    let key = |time: f64, at: DVec3, turn: DVec3| Key { time, at, turn: turn.map(f64::to_radians) };
    let none = DVec3::zeros();
    let go = |name: String, at: DVec3, turn: DVec3| Course {
        name,
        keys: vec![key(0.0, none, none), key(1.0, at, turn)],
        twist: 0.0,
    };
    let mut out = vec![go("at rest".into(), none, none)];
    let mut turn = |name: &str, axis: DVec3, degrees: &[f64]| {
        out.extend(degrees.iter().map(|by| go(format!("{name} by {by}"), none, axis * *by)));
    };
    turn("about y", DVec3::y(), &[1.0, 5.0, 20.0, 30.0, 45.0, 60.0, 90.0, 180.0, 270.0, 330.0, 360.0, 720.0]);
    turn("about x", DVec3::x(), &[30.0, 90.0, 350.0]);
    turn("about x and z", DVec3::new(1.0, 0.0, 1.0), &[30.0, 60.0, 180.0]);
    turn("about three axes", DVec3::new(1.0, 0.7, -0.6), &[5.0, 20.0, 45.0, 90.0, 180.0, 360.0]);
    let slide = DVec3::new(1.0, 0.3, 0.2);
    for by in [45.0, 180.0, 720.0] {
        out.push(go(format!("spinning by {by} on its way"), slide, DVec3::y() * by));
    }
    for by in [30.0f64, 60.0, 120.0, 360.0] {
        out.push(go(format!("rolling by {by}"), DVec3::z() * by.to_radians(), DVec3::x() * by));
    }
    for by in [0.02, 0.3, 2.0] {
        out.push(go(format!("sliding by {by} radii"), slide * by, none));
    }
    let back = |name: &str, at: DVec3, turn: DVec3| Course {
        name: name.into(),
        keys: vec![key(0.0, none, none), key(0.5, at, turn), key(1.0, none, none)],
        twist: 0.0,
    };
    out.push(back("turning to and fro", none, DVec3::y() * 40.0));
    out.push(back("sliding to and fro", slide * 0.6, none));
    for by in [40.0f64, 120.0] {
        out.push(Course { twist: by.to_radians(), ..go(format!("twisting by {by}"), none, none) });
    }
    out.push(Course {
        twist: 1.0,
        ..go("twisting on its way".into(), slide * 0.5, DVec3::new(0.0, 20.0, 30.0))
    });
    assert_eq!(out.len(), 40);
    out
}
