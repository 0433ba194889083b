//! A boot-sized box walks through snow: `cargo run --release --example press_snow DIR`.
//!
//! Each frame presses the moving box into the snow and writes the snow as DIR/snow.NNNN.vdb, and what the frame removed as
//! DIR/removed.NNNN.vdb (`frazil preview DIR/snow.0024.vdb -o snow.png` draws one). Change the keys in `walk` to move the box elsewhere,
//! `DEPTH` for deeper snow, or replace it by a mesh of your own (`frazil::io::mesh::read`).

use std::path::Path;

use frazil::geometry::{DVec3, TriMesh};
use frazil::motion::{Key, Keys, Rigid};
use frazil::snow::base_layer::{BaseLayer, Params, initial};
use frazil::sweep::Body;
use frazil::vdb::file::{self, WriteOptions};
use frazil::{Context, Error, Pool, Result};

/// Edge of a voxel, and the snow's depth (m).
const CELL: f64 = 0.02;
const DEPTH: f64 = 0.3;
/// Frames, and the time between two (s).
const FRAMES: i32 = 24;
const DT: f64 = 1.0 / 24.0;

/// Two steps along z: down into the snow, up, and down again.
fn walk() -> Result<Keys> {
    let key = |time, y, z| Key { time, at: DVec3::new(0.0, y, z), turn: DVec3::zeros() };
    Keys::new(vec![
        key(0.0, 0.5, -0.3),
        key(0.25, 0.2, -0.3),
        key(0.5, 0.5, 0.0),
        key(0.75, 0.2, 0.3),
        key(1.0, 0.5, 0.3),
    ])
}

fn main() -> Result<()> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "target/press_snow".into());
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, "create the folder", error))?;
    let ctx = Context::new(Pool::all_cores()?);

    let ground = initial::Ground::Plane { height: 0.0, area: [-0.5, -0.7, 0.5, 0.7] };
    let snow = initial::layer(&ctx, &ground, &[], &initial::Cover::Depth(DEPTH), CELL, 3.0)?;
    let mut base = BaseLayer::new(&ctx, snow, Params::for_cell(CELL))?;
    let boot = TriMesh::cuboid([-0.06, -0.1, -0.15], [0.06, 0.1, 0.15]);
    let body = Body::new(Box::new(Rigid::new(boot, walk()?)), 0.0)?;

    for frame in 1..=FRAMES {
        let end = f64::from(frame) * DT;
        let report = base.step(&ctx, std::slice::from_ref(&body), end - DT, end, frame)?;
        println!("frame {frame}: {:.2} litres removed", 1000.0 * report.removed_volume);
        for (name, grid) in [("snow", base.surface()), ("removed", base.removed())] {
            let path = folder.join(format!("{name}.{frame:04}.vdb"));
            file::write(&path, &[grid], &WriteOptions::default())?;
        }
    }
    Ok(())
}
