//! What a step does where a liquid merges, in meshes to look at: `cargo run --release --example surface_stages DIR`.
//!
//! Two balls of particles meet under a mesh with ripples. The step in which they become one is taken apart, as a program that follows
//! its own liquid may do: [`Tracker::step`] says in a [`Change`] which triangles stay, which are parts of old ones, and which are new. These
//! files are written to DIR:
//!
//! | file | holds |
//! |---|---|
//! | flagged.ply | the mesh before the change, its triangles with flagged vertices darker |
//! | cells.ply | the cells of the grid in which triangles are removed or made |
//! | cut.ply | what stays of the mesh; parts of triangles are darker |
//! | made.ply | the mesh after the change; new triangles are darkest |
//! | liquid.bgeo | the particles |
//!
//! `frazil preview DIR/made.ply --color stage -o made.png --eye 0.03,0.03,0.1 --target 0,0,0 --fov 34` draws one of them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use frazil::geometry::mesh::attributes::{Number, On};
use frazil::geometry::{DVec3, MeshArray, Points, TriMesh};
use frazil::io::{mesh, particles};
use frazil::mesh_repair::Source;
use frazil::surface::{Change, Params, Particles, Tracker};
use frazil::{Context, Error, Pool};

/// Initial distance between particles (m).
const SPACING: f64 = 0.01;
/// Edge of a cell (m); the grid begins at the origin.
const CELL: f64 = 0.5 * SPACING;
/// Radius of a ball (spacings).
const RADIUS: f64 = 6.0;
/// How far a ball goes in a frame (spacings).
const SPEED: f64 = 0.22;
/// Time between frames (s).
const DT: f64 = 1.0 / 24.0;
/// The balls have met long before this frame.
const LAST: i32 = 24;
/// Values of the array `stage`: triangles that stay, parts of old triangles, and new triangles.
const KEPT: f64 = 1.0;
const PART: f64 = 0.72;
const MADE: f64 = 0.5;
/// How much these values vary, to tell triangles from their neighbours.
const SHADE: f64 = 0.2;

fn main() -> frazil::Result<()> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "target/surface_stages".into());
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, "create the folder", error))?;
    let ctx = Context::new(Pool::all_cores()?);
    let (ball, first) = (ball(), first_mesh());
    let params = Params { rebuild: true, ..Params::for_spacing(SPACING) };
    let mut from = liquid(&ball, 0);
    let mut tracker = Tracker::new(&ctx, params, &first, &from)?;
    for frame in 1..=LAST {
        let before = tracker.clone();
        let to = liquid(&ball, frame);
        let report = tracker.step(&ctx, &from, &to, DT)?;
        // The Euler characteristic of one body without a hole through it is 2.
        let is_one = tracker.mesh().euler_characteristic() == 2;
        if is_one && let Some(change) = &report.change {
            // The same step without rebuilding flags the vertices at which the mesh no longer fits.
            let flagging = Params { rebuild: false, ..params };
            let mut flagged = Tracker::resume(flagging, &first, &before.save())?;
            flagged.step(&ctx, &from, &to, DT)?;
            let step = Step { triangles: before.triangles(), flags: flagged.flags(), change };
            step.flagged().write(&folder.join("flagged.ply"))?;
            step.cells().write(&folder.join("cells.ply"))?;
            step.after(false).write(&folder.join("cut.ply"))?;
            step.after(true).write(&folder.join("made.ply"))?;
            return particles::write(
                &folder.join("liquid.bgeo"),
                &Points::at(SPACING, &to.positions)?,
                false,
            );
        }
        from = to;
    }
    Err(Error::argument("the balls did not meet"))
}

/// A step that changed a mesh.
struct Step<'a> {
    /// The triangles before the step.
    triangles: &'a [[u32; 3]],
    /// For each vertex before the step, whether the mesh no longer fits there.
    flags: &'a [bool],
    change: &'a Change,
}

impl Step<'_> {
    /// The mesh at the end of the step as it would be without the change.
    fn flagged(&self) -> Drawing {
        let mut drawing = Drawing::default();
        for (n, corners) in self.triangles.iter().enumerate() {
            let is_flagged = corners.iter().any(|corner| self.flags[*corner as usize]);
            let stage = if is_flagged { MADE } else { KEPT };
            drawing.face(&self.before(*corners), stage - shade(n));
        }
        drawing
    }

    /// The mesh after the change, with or without the new triangles.
    fn after(&self, with_made: bool) -> Drawing {
        let mut drawing = Drawing::default();
        for (n, (corners, source)) in self.change.triangles.iter().zip(&self.change.sources).enumerate() {
            let stage = match source {
                Source::Whole(_) => KEPT,
                Source::Part(_) => PART,
                Source::New => MADE,
            };
            if with_made || *source != Source::New {
                drawing.face(&self.now(*corners), stage - shade(n));
            }
        }
        drawing
    }

    /// The outer faces of the cells with triangles that the step removed or made.
    fn cells(&self) -> Drawing {
        let mut is_gone = vec![true; self.triangles.len()];
        let mut cells = BTreeSet::new();
        for (corners, source) in self.change.triangles.iter().zip(&self.change.sources) {
            match source {
                Source::Whole(of) | Source::Part(of) => is_gone[*of as usize] = false,
                Source::New => cells.extend(cells_of(self.now(*corners))),
            }
        }
        let gone = self.triangles.iter().zip(&is_gone).filter(|(_, is_gone)| **is_gone);
        cells.extend(gone.flat_map(|(corners, _)| cells_of(self.before(*corners))));
        let mut drawing = Drawing::default();
        for cell in &cells {
            let stage = MADE - SHADE * f64::from(cell.iter().sum::<i32>().rem_euclid(2));
            for (axis, side) in (0..6usize).map(|n| (n / 2, (n % 2) as i32)) {
                let mut beside = *cell;
                beside[axis] += 2 * side - 1;
                if cells.contains(&beside) {
                    continue;
                }
                let corner = |[u, v]: [i32; 2]| {
                    let mut at = *cell;
                    at[axis] += side;
                    at[(axis + 1) % 3] += u;
                    at[(axis + 2) % 3] += v;
                    DVec3::from(at.map(f64::from)) * CELL
                };
                drawing.face(&[[0, 0], [1, 0], [1, 1], [0, 1]].map(corner), stage);
            }
        }
        drawing
    }

    /// Where the corners of a triangle before the change are at the end of the step (m).
    fn before(&self, corners: [u32; 3]) -> [DVec3; 3] {
        corners.map(|corner| self.change.before[corner as usize])
    }

    /// The corners of a triangle after the change (m).
    fn now(&self, corners: [u32; 3]) -> [DVec3; 3] {
        corners.map(|corner| self.change.vertices[corner as usize])
    }
}

/// The cells through which a triangle passes, found by sampling it.
fn cells_of([a, b, c]: [DVec3; 3]) -> Vec<[i32; 3]> {
    const PARTS: usize = 4;
    let share = |n: usize| (n as f64 + 1.0 / 3.0) / PARTS as f64;
    let pairs = (0..PARTS).flat_map(|i| (0..PARTS - i).map(move |j| [i, j]));
    let cell = |pair: [usize; 2]| {
        let [u, v] = pair.map(share);
        let position = (a * u + b * v + c * (1.0 - u - v)) / CELL;
        [0, 1, 2].map(|axis| position[axis].floor() as i32)
    };
    pairs.map(cell).collect()
}

/// A pseudo-random part of [`SHADE`] for a triangle.
fn shade(number: usize) -> f64 {
    SHADE * (0.618_034 * number as f64).fract()
}

/// Faces, each with a number.
#[derive(Default)]
struct Drawing {
    mesh: TriMesh,
    /// The number for each vertex; faces share no vertices.
    stage: Vec<f64>,
}

impl Drawing {
    /// Adds a flat face without inner angles over 180 degrees.
    fn face(&mut self, corners: &[DVec3], stage: f64) {
        let (first, count) = (self.mesh.positions.len() as u32, corners.len() as u32);
        self.mesh.positions.extend(corners.iter().map(|corner| corner.cast::<f32>()));
        self.mesh.triangles.extend((1..count - 1).map(|n| [first, first + n, first + n + 1]));
        self.stage.resize(self.mesh.positions.len(), stage);
    }

    fn write(mut self, path: &Path) -> frazil::Result<()> {
        // A picture's colours go from the least number to the greatest, so a degenerate triangle with 0 and 1 is added.
        let first = self.mesh.positions.len() as u32;
        let position = self.mesh.positions.first().copied().unwrap_or_default();
        self.mesh.positions.extend([position; 3]);
        self.mesh.triangles.push([first, first + 1, first + 2]);
        self.stage.extend([0.0, 1.0, 1.0]);
        let stage =
            MeshArray { name: "stage".into(), on: On::Vertices, number: Number::F32, values: self.stage };
        let carried = mesh::Carried { arrays: &[&stage], ..mesh::Carried::default() };
        mesh::write_carried(path, &self.mesh, &carried)
    }
}

/// Particles in a ball around the origin (spacings), on a grid, each of them moved a little.
fn ball() -> Vec<DVec3> {
    let mut state = 2u64;
    // Numbers that look random and are always the same (Knuth's MMIX).
    let mut off = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        0.2 * ((state >> 40) as f64 / (1u64 << 24) as f64 - 0.5)
    };
    let on = || -7..7;
    let mut positions = Vec::new();
    for [x, y, z] in on().flat_map(|x| on().flat_map(move |y| on().map(move |z| [x, y, z]))) {
        let position = DVec3::new(f64::from(x), f64::from(y), f64::from(z)) + DVec3::repeat(0.5);
        let moved = position + DVec3::new(off(), off(), off());
        if position.norm() < RADIUS {
            positions.push(moved);
        }
    }
    positions
}

/// The middle of the ball on a side, -1 or 1, at a frame (spacings).
fn middle(side: f64, frame: i32) -> DVec3 {
    DVec3::new(side * (RADIUS + 2.0 - SPEED * f64::from(frame)), 0.0, 0.0)
}

/// The particles of both balls at a frame. A particle has the same id in all frames.
fn liquid(ball: &[DVec3], frame: i32) -> Particles {
    let half = |side: f64| ball.iter().map(move |position| (position + middle(side, frame)) * SPACING);
    let positions: Vec<DVec3> = half(-1.0).chain(half(1.0)).collect();
    Particles { ids: (0..positions.len() as i64).collect(), velocities: Vec::new(), positions }
}

/// The mesh at frame 0: around each ball a sphere with ripples.
fn first_mesh() -> TriMesh {
    let (directions, triangles) = sphere(4);
    let half = |side: f64| {
        let position = |way: &DVec3| {
            let wave = libm::sin(9.0 * way.x) * libm::sin(9.0 * way.y) * libm::sin(9.0 * way.z);
            ((way * (RADIUS + 0.35 * wave) + middle(side, 0)) * SPACING).cast::<f32>()
        };
        TriMesh { positions: directions.iter().map(position).collect(), triangles: triangles.clone() }
    };
    let mut both = half(-1.0);
    both.append(&half(1.0));
    both
}

/// Directions and triangles of a sphere: an octahedron whose triangles are divided into four, `times` times.
fn sphere(times: usize) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let mut positions = vec![DVec3::x(), -DVec3::x(), DVec3::y(), -DVec3::y(), DVec3::z(), -DVec3::z()];
    let mut triangles: Vec<[u32; 3]> =
        vec![[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
    for _ in 0..times {
        let mut middles = BTreeMap::new();
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[i, j]| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    positions.push((positions[i as usize] + positions[j as usize]).normalize());
                    positions.len() as u32 - 1
                })
            });
            finer.extend([[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    (positions, triangles)
}
