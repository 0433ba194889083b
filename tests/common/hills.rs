//! Ground of known height under snow that a ball sweeps, and the grains that lie behind it.

use frazil::Context;
use frazil::geometry::{DVec3, TriMesh, Vec3};
use frazil::motion::{Key, Keys, Rigid};
use frazil::snow::base_layer::initial::{self, Cover, layer};
use frazil::snow::base_layer::{BaseLayer, Params as BaseParams};
use frazil::snow::grains::{Base, Grains, Ground, Object, PACKING, Params, Surroundings};
use frazil::sweep::Body;

use super::shapes::{cuboid, sphere};

/// Edge of a cell of the snow (m).
const CELL: f64 = 0.01;
/// Vertical depth of the snow (m).
const DEPTH: f64 = 0.08;
/// Radius of the ball (m).
const BALL: f64 = 0.06;
/// Length and width of the ground (m), and the edge of its squares.
const SIZE: [f64; 2] = [0.64, 0.36];
const SQUARE: f64 = 0.02;
/// Frames of a sweep, 24 in a second.
pub const FRAMES: i32 = 12;

/// Ground whose height (m) is a function of x and z.
pub struct Terrain {
    pub name: &'static str,
    height: Box<dyn Fn(f64, f64) -> f64>,
    /// Whether it is a solid, 0.3 m thick.
    solid: bool,
}

/// Hills, valleys and slopes of up to 45 degrees.
pub fn terrains() -> Vec<Terrain> {
    let new = |name, height: Box<dyn Fn(f64, f64) -> f64>| Terrain { name, height, solid: false };
    let slope = |name, degrees: f64| {
        let steep = degrees.to_radians().tan();
        new(name, Box::new(move |x: f64, _: f64| steep * x))
    };
    // The steepest part of a hill of height h and width w rises by 0.858 h / w.
    let hill = |x: f64| (-(x / 0.12).powi(2)).exp();
    let solid = Terrain { solid: true, ..slope("a solid of 30 degrees", 30.0) };
    vec![
        slope("level", 0.0),
        slope("20 degrees", 20.0),
        slope("40 degrees", 40.0),
        solid,
        new("a ridge", Box::new(move |x: f64, _: f64| 0.14 * hill(x))),
        new("a hill", Box::new(move |x: f64, z: f64| 0.12 * hill(x) * hill(z))),
        new("a valley", Box::new(move |x: f64, _: f64| -0.12 * hill(x))),
        new("waves", Box::new(|x: f64, z: f64| 0.02 * (25.0 * x).sin() * (18.0 * z).cos())),
    ]
}

/// What became of the grains.
#[derive(Debug, Default)]
pub struct Outcome {
    /// Count of grains that were born.
    pub born: usize,
    /// Grains behind the ground, summed over the frames.
    pub behind: usize,
    /// How deep the deepest of them was (m).
    pub deepest: f64,
    /// Grains deeper than a tenth of their diameter in level ground, trapped ones included, summed over the frames.
    pub low: usize,
    /// Largest difference between the grains paid for and those born or owed, or between those born and those there or dropped.
    pub unaccounted: f64,
}

impl Terrain {
    fn counts() -> [usize; 2] {
        SIZE.map(|size| (size / SQUARE).round() as usize)
    }

    /// A corner of the mesh, rounded as the mesh is.
    fn corner(&self, x: usize, z: usize) -> Vec3 {
        let [x, z] = [(x, 0), (z, 1)].map(|(at, axis)| at as f64 * SQUARE - 0.5 * SIZE[axis]);
        DVec3::new(x, (self.height)(x, z), z).cast()
    }

    /// Its mesh.
    pub fn mesh(&self) -> TriMesh {
        let [columns, rows] = Self::counts();
        let mut mesh = TriMesh::default();
        for (x, z) in (0..=columns).flat_map(|x| (0..=rows).map(move |z| (x, z))) {
            mesh.positions.push(self.corner(x, z));
        }
        let index = |x: usize, z: usize| (x * (rows + 1) + z) as u32;
        for (x, z) in (0..columns).flat_map(|x| (0..rows).map(move |z| (x, z))) {
            let [a, b, c, d] = [index(x, z), index(x, z + 1), index(x + 1, z + 1), index(x + 1, z)];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
        if self.solid {
            let count = mesh.positions.len() as u32;
            let below: Vec<Vec3> = mesh.positions.iter().map(|at| at - Vec3::new(0.0, 0.3, 0.0)).collect();
            mesh.positions.extend(below);
            let under: Vec<[u32; 3]> =
                mesh.triangles.iter().map(|[a, b, c]| [a + count, c + count, b + count]).collect();
            mesh.triangles.extend(under);
            let mut wall =
                |a: u32, b: u32| mesh.triangles.extend([[a, b + count, b], [a, a + count, b + count]]);
            for x in 0..columns {
                wall(index(x + 1, 0), index(x, 0));
                wall(index(x, rows), index(x + 1, rows));
            }
            for z in 0..rows {
                wall(index(0, z), index(0, z + 1));
                wall(index(columns, z + 1), index(columns, z));
            }
        }
        mesh
    }

    /// Height (m) of the mesh over a position; none beyond its rim.
    pub fn height_at(&self, x: f64, z: f64) -> Option<f64> {
        let [u, v] = [(x, 0), (z, 1)].map(|(at, axis)| (at + 0.5 * SIZE[axis]) / SQUARE);
        let counts = Self::counts();
        let [column, row] = [u.floor(), v.floor()];
        if column < 0.0 || row < 0.0 || column >= counts[0] as f64 || row >= counts[1] as f64 {
            return None;
        }
        let (s, t) = (u - column, v - row);
        let [column, row] = [column as usize, row as usize];
        let corner = |x: usize, z: usize| f64::from(self.corner(column + x, row + z).y);
        let (low, high) = (corner(0, 0), corner(1, 1));
        // The diagonal runs from the least corner to the greatest.
        Some(if t > s {
            low + (corner(0, 1) - low) * t + (high - corner(0, 1)) * s
        } else {
            low + (corner(1, 0) - low) * s + (high - corner(1, 0)) * t
        })
    }

    /// A ball that sweeps over it along x, its lowest point so far (m) above the ground.
    fn ball(&self, clearance: f64) -> Body {
        let key = |step: i32| {
            let part = f64::from(step) / f64::from(FRAMES);
            let x = 0.44 * part - 0.22;
            let steep = ((self.height)(x + 1.0e-4, 0.0) - (self.height)(x - 1.0e-4, 0.0)) / 2.0e-4;
            let above = (BALL + clearance) * steep.hypot(1.0);
            let at = DVec3::new(x, (self.height)(x, 0.0) + above, 0.0);
            Key { time: f64::from(step) / 24.0, at, turn: DVec3::zeros() }
        };
        let keys = Keys::new((0..=FRAMES).map(key).collect()).unwrap();
        Body::new(Box::new(Rigid::new(sphere(BALL as f32, 16), keys)), 0.0).unwrap()
    }

    /// What becomes of the grains when a ball sweeps over snow on it, some way (m) above the ground.
    pub fn sweep(&self, ctx: &Context, clearance: f64, params: Params) -> Outcome {
        let mesh = self.mesh();
        let snow = layer(ctx, &initial::Ground::Mesh(mesh.clone()), &[], &Cover::Depth(DEPTH), CELL, 3.0);
        let (bodies, ground) = ([self.ball(clearance)], [Ground::new(&mesh)]);
        let lowest = mesh.bounds().map_or(0.0, |(low, _)| f64::from(low.y)) - 1.0;
        story(ctx, snow.unwrap(), &bodies, params, (&ground, None, lowest), |position| {
            self.height_at(position.x, position.z).map(|height| height - position.y)
        })
    }
}

/// Two plates that close on snow on a level plane until it has no room.
pub fn squeeze(ctx: &Context, params: Params) -> Outcome {
    let area = [-0.12, -0.1, 0.12, 0.1];
    let snow =
        layer(ctx, &initial::Ground::Plane { height: 0.0, area }, &[], &Cover::Depth(DEPTH), CELL, 3.0);
    let plate = |side: f64| {
        let key = |time, x: f64| Key { time, at: DVec3::new(side * x, 0.15, 0.0), turn: DVec3::zeros() };
        let keys = Keys::new(vec![key(0.0, 0.14), key(0.4, 0.016), key(0.5, 0.016)]).unwrap();
        Body::new(Box::new(Rigid::new(cuboid([0.03, 0.3, 0.16]), keys)), 0.0).unwrap()
    };
    story(ctx, snow.unwrap(), &[plate(-1.0), plate(1.0)], params, (&[], Some(0.0), -1.0), |position| {
        Some(-position.y)
    })
}

/// Parameters of grains in a seed's sweep.
pub fn params(seed: u64) -> Params {
    Params { seed, compression: [0.5, 0.0, 0.75][seed as usize % 3], ..Params::for_cell(CELL) }
}

/// The outcome of snow that bodies remove, on ground and a floor, with the lowest height of grains; `depth` is how deep (m) a position
/// lies behind them, none beyond them.
fn story(
    ctx: &Context,
    snow: frazil::vdb::FloatGrid,
    bodies: &[Body],
    params: Params,
    (ground, floor, lowest): (&[Ground], Option<f64>, f64),
    depth: impl Fn(DVec3) -> Option<f64>,
) -> Outcome {
    let mut base = BaseLayer::new(ctx, snow, BaseParams::for_cell(CELL)).unwrap();
    let mut grains = Grains::new(params).unwrap();
    let objects: Vec<Object<'_>> = bodies.iter().map(|body| Object::new(body, 0.3)).collect();
    let (mut out, mut owed, mut gone) = (Outcome::default(), 0.0, 0);
    let volume = std::f64::consts::PI * (2.0 * params.radius).powi(3) / 6.0;
    for frame in 1..=FRAMES {
        let [from, to] = [frame - 1, frame].map(|frame| f64::from(frame) / 24.0);
        let before = base.surface().deep_copy().unwrap();
        base.step(ctx, bodies, from, to, frame).unwrap();
        let layers = Base::Whole([&before, base.surface()]);
        let around = Surroundings { base: layers, objects: &objects, statics: &[], ground, floor, lowest };
        let report = grains.step(ctx, &around, [from, to], frame).unwrap();
        let paid = (1.0 - params.compression) * report.removed_volume * PACKING / volume;
        (out.born, gone) = (out.born + report.born, gone + report.dropped);
        let lost = (paid + owed - report.owed - report.born as f64).abs();
        owed = report.owed;
        out.unaccounted = out.unaccounted.max(lost).max(out.born.abs_diff(grains.count() + gone) as f64);
        for deep in grains.positions().filter_map(&depth) {
            if deep > 1.0e-6 * params.radius {
                (out.behind, out.deepest) = (out.behind + 1, out.deepest.max(deep));
            }
            if floor.is_some() && deep > -0.79 * params.radius {
                out.low += 1;
            }
        }
    }
    out
}
