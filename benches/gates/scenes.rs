//! Layers and bodies of the gates.

use std::path::PathBuf;

use frazil::geometry::{DVec3, TriMesh};
use frazil::motion::{Key, Keys, Rigid};
use frazil::snow::base_layer::initial::{self, Cover, Ground};
use frazil::snow::base_layer::{BaseLayer, Params};
use frazil::sweep::Body;
use frazil::{Context, Pool};

use crate::common::character::data;
use crate::harness::Harness;

/// The character of most gates, in the outside data.
pub const MAN: &str = "character/CesiumMan.glb";

/// A file of the outside data, where one of these gates is wanted; without the file they are skipped.
pub fn wanted_data(h: &mut Harness, names: &[&str], file: &str) -> Option<PathBuf> {
    let wanted: Vec<&str> = names.iter().copied().filter(|name| h.wants(name)).collect();
    let found = data(file);
    if found.is_none() {
        wanted.iter().for_each(|name| h.skipped(name, "no data"));
    }
    found.filter(|_| !wanted.is_empty())
}

/// A context on so many threads.
pub fn context(threads: usize) -> Context {
    Context::new(Pool::new(threads).expect("threads"))
}

/// Snow 0.3 m deep on a square around the origin, on the ground at y = 0.
pub fn snow(ctx: &Context, edge: f64, cell: f64, params: Params) -> BaseLayer {
    snow_on(ctx, 0.0, edge, cell, params)
}

/// Snow on the ground at a height (m).
fn snow_on(ctx: &Context, height: f64, edge: f64, cell: f64, params: Params) -> BaseLayer {
    let half = edge / 2.0;
    layer(ctx, height, [-half, -half, half, half], 0.3, cell, params)
}

/// Snow of a depth on level ground: a height, an area, the depth and the edge of a cell (m).
pub fn layer(ctx: &Context, height: f64, area: [f64; 4], depth: f64, cell: f64, params: Params) -> BaseLayer {
    let ground = Ground::Plane { height, area };
    let snow = initial::layer(ctx, &ground, &[], &Cover::Depth(depth), cell, 3.0).expect("snow");
    BaseLayer::new(ctx, snow, params).expect("base layer")
}

/// A body that moves in a straight line, turning at a constant rate; times in frames.
pub fn body(mesh: TriMesh, at: [DVec3; 2], turn: [DVec3; 2], frames: f64) -> Body {
    let key = |time: f64, index: usize| Key { time, at: at[index], turn: turn[index] };
    let keys = Keys::new(vec![key(0.0, 0), key(frames, 1)]).expect("keys");
    Body::new(Box::new(Rigid::new(mesh, keys)), 0.0).expect("body")
}

/// Frames of the timed scenes.
pub const FRAMES: i32 = 6;

/// A 0.4 m blob of 49,152 triangles, half sunk, 0.1 m and 0.3 rad a frame, 5 mm.
pub fn small(ctx: &Context, layer: f64) -> (BaseLayer, Body) {
    let frames = f64::from(FRAMES);
    let ends = [DVec3::new(-0.35, 0.3, 0.0), DVec3::new(-0.35 + 0.1 * frames, 0.3, 0.0)];
    let turn = [DVec3::zeros(), DVec3::new(0.1, 0.2, 0.2) * frames];
    let body = body(crate::common::shapes::blob(0.4, 64), ends, turn, frames);
    (snow(ctx, layer, 0.005, Params::for_cell(0.005)), body)
}

/// A 1.7 m figure of 47,628 triangles that wades, 0.1 m and 0.05 rad a frame, 7.5 mm.
pub fn large(ctx: &Context, layer: f64) -> (BaseLayer, Body) {
    let frames = f64::from(FRAMES);
    let ends = [DVec3::new(0.0, 0.05, -0.5), DVec3::new(0.0, 0.05, -0.5 + 0.1 * frames)];
    let turn = [DVec3::zeros(), DVec3::new(0.0, 0.05, 0.0) * frames];
    let body = body(crate::common::shapes::figure(21), ends, turn, frames);
    // Between two planes of voxels, as a ground usually is: on one, five of a band's six layers are active.
    (snow_on(ctx, 0.002, layer, 0.0075, Params::for_cell(0.0075)), body)
}

/// Cell of the demonstration's walk (m).
pub const WALK_CELL: f64 = 0.0075;

/// No noise.
pub const EXACT: Params = Params { noise: None, tolerance: 0.02 };

/// The boots of the demonstration's walk and their keys, frames 1 to 48, moved by so much (m).
pub fn boots(by: DVec3) -> [(TriMesh, Keys); 2] {
    use crate::common::boot::{left_boot, right_boot};
    use crate::common::walk::walk;
    let keys = |side: f64| {
        let keys = walk(side, 48, 0.08).into_iter().map(|step| Key {
            time: f64::from(step.frame),
            at: DVec3::from(step.at) + (by - DVec3::z() * 1.5),
            turn: DVec3::from(step.turn_deg.map(f64::to_radians)),
        });
        Keys::new(keys.collect()).expect("keys")
    };
    [(left_boot(), keys(1.0)), (right_boot(), keys(-1.0))]
}

/// The boots as bodies.
pub fn walkers() -> Vec<Body> {
    walkers_at(DVec3::zeros())
}

/// The boots as bodies, moved by so much (m).
pub fn walkers_at(by: DVec3) -> Vec<Body> {
    let body = |(mesh, keys)| Body::new(Box::new(Rigid::new(mesh, keys)), 1.0).expect("body");
    boots(by).map(body).into()
}
