//! Gates of mist beside solids that move: what flows through them, and pockets that they seal off.

use frazil::flow::tiles::shifted;
use frazil::flow::{Coord, Flow, Solids, Tiles};
use frazil::geometry::{DVec3, TriMesh};
use frazil::motion::{Key, Keys, Rigid};
use frazil::snow::mist::{Mist, Params, StepInputs, Surroundings};
use frazil::sweep::Body;

use crate::common::shapes::cuboid;
use crate::harness::Harness;
use crate::scenes::{context, voxel};
use crate::snow::mist::walled;

/// Length of a frame (s), and edge of a cell (m).
const FRAME: f64 = 1.0 / 24.0;
const CELL: f64 = 0.01;

pub fn run(h: &mut Harness) {
    h.measure("snow.mist.flux", flux);
    h.measure("snow.mist.pocket", pocket);
}

/// Outer edge (m) and wall (m) of a hollow box, and how fast it moves (m/s).
const EDGE: f32 = 0.2;
const WALL: f32 = 0.04;
const SPEED: f64 = 2.0;
/// Frames in which it moves through mist.
const FRAMES: i32 = 12;

/// A box with a closed hollow inside is drawn through mist: the share of the mist on its way that is inside it in the end. What
/// does not flow around it flows through its walls.
fn flux() -> (f64, String) {
    let ctx = context(2);
    let params = Params { half_life: f64::INFINITY, gravity: 0.0, ..Params::for_cell(CELL) };
    let mut mist = Mist::new(params).expect("mist");
    // From a tile before the box on, as wide as three of it.
    let tiles: Vec<Coord> =
        (2..16).flat_map(|x| (-4..4).flat_map(move |y| (-4..4).map(move |z| [x, y, z]))).collect();
    mist.add(&tiles, |_| (1.0, [0.0; 3]));
    let body = hollow();
    for frame in 0..FRAMES {
        let times = [frame, frame + 1].map(|frame| f64::from(frame) * FRAME);
        let around = Surroundings { base: None, bodies: &[&body], removing: &[], floor: None };
        let walls = around.during(times, CELL).expect("poses");
        let boundary = |tiles: &Tiles, cell: f32, share: f64| walls.faces(&ctx, tiles, cell, share);
        let around = StepInputs { sources: &[], boundary: &boundary, fastest: SPEED, wind: None };
        mist.step(&ctx, &around, times).expect("a step");
    }
    let way = SPEED * f64::from(FRAMES) * FRAME;
    let inside = inside(&mist, way);
    let swept = f64::from(EDGE).powi(2) * (way - 0.06);
    (inside / swept, format!("{inside:.3e} m3 inside, {swept:.3e} m3 on the way of {way} m"))
}

/// The box, which starts with its front 6 cm before the mist, and moves along x.
fn hollow() -> Body {
    let mut mesh: TriMesh = cuboid([EDGE; 3]);
    let inner = cuboid([EDGE - 2.0 * WALL; 3]);
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(inner.positions);
    mesh.triangles.extend(inner.triangles.iter().map(|[a, b, c]| [first + a, first + c, first + b]));
    let key = |frame: i32| {
        let time = f64::from(frame) * FRAME;
        Key { time, at: DVec3::new(SPEED * time, 0.0, 0.0), turn: DVec3::zeros() }
    };
    let keys = Keys::new(vec![key(0), key(FRAMES)]).expect("keys");
    Body::new(Box::new(Rigid::new(mesh, keys)), 0.0).expect("a body")
}

/// Mist (m3) in the hollow of the box after its way (m), and in the inner half of its walls.
fn inside(mist: &Mist, way: f64) -> f64 {
    let half = 0.5 * f64::from(EDGE - WALL);
    let mut sum = 0.0;
    for (coord, tile) in mist.flow().tiles().coords().iter().zip(mist.flow().density()) {
        for (cell, density) in tile.iter().enumerate() {
            let position = voxel(coord.map(|x| 8 * x), cell).map(|at| (f64::from(at) + 0.5) * CELL);
            if (position[0] - way).abs() < half && position[1..].iter().all(|x| x.abs() < half) {
                sum += f64::from(*density);
            }
        }
    }
    sum * CELL.powi(3)
}

/// A closed box whose lid comes down until no cell is left open: every projection is solved, and finite.
fn pocket() -> (bool, String) {
    let ctx = context(2);
    let mut flow = Flow::new(CELL, [0.0; 3]).expect("a flow");
    flow.resize(&[[0, 0, 0], [0, 0, 1], [0, 1, 0], [0, 1, 1], [1, 0, 0], [1, 0, 1], [1, 1, 0], [1, 1, 1]]);
    let (mut is_solved, mut fastest, mut most) = (true, 0.0f32, 0);
    for step in 0..28 {
        let lid = 14.0 - 0.5 * step as f32;
        let boundary = |tiles: &Tiles, cell: f32| Ok(lidded(tiles, cell / CELL as f32, lid));
        let solved = flow.project(&ctx, &boundary, 1.0e-5).expect("a projection");
        let is_finite = flow.velocity().iter().flatten().flatten().all(|speed| speed.is_finite());
        fastest = fastest.max(flow.fastest());
        is_solved &= is_finite && solved.divergence <= 1.0e-4 * solved.fastest && fastest < 10.0;
        most = most.max(solved.iterations);
        flow.advect(&ctx, 0.01, Default::default()).expect("no cancel");
    }
    (is_solved, format!("at most {most} iterations, {fastest:.2} m/s under a lid of 0.5 m/s"))
}

/// Walls around the cells from 2 to 14 on each axis, and a lid over them at a height (fine cells) that comes down at 0.5 m/s.
fn lidded(tiles: &Tiles, wider: f32, lid: f32) -> Solids {
    let is_inside = |cell: [i32; 3]| {
        let middle = cell.map(|x| (x as f32 + 0.5) * wider);
        middle.iter().all(|x| (2.0..14.0).contains(x)) && middle[1] < lid
    };
    walled(tiles, is_inside, |at, axis| {
        let is_lid =
            axis == 1 && is_inside(shifted(at, 1, -1)) && !is_inside(at) && at[1] as f32 * wider > 2.0;
        if is_lid { -0.5 } else { 0.0 }
    })
}
