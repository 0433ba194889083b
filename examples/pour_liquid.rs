//! Blood runs down an incline in real time: `cargo run --release --example pour_liquid DIR`. It needs no OpenVDB.
//!
//! A source pours onto a tilted plate; each second's surface is DIR/blood.NNNN.ply. Change `Liquid::BLOOD` to another liquid, the source's rate
//! and position, or the plate to a terrain of your own (`frazil::io::mesh::read`).

use std::path::Path;

use frazil::geometry::{TriMesh, Vec3};
use frazil::io::mesh;
use frazil::shallow::columns::grid::{Grid, Heights};
use frazil::shallow::material::Liquid;
use frazil::shallow::sources::{FlowPoint, Kind};
use frazil::shallow::surface::{Depths, Indices, Layout, Surface, Target};
use frazil::shallow::terrain::triangles;
use frazil::shallow::{Params, Shallow};
use frazil::{Context, Error, Pool, Result};

/// Edge of a cell (m).
const CELL: f64 = 0.001;
/// Seconds, and frames per second.
const SECONDS: usize = 4;
const RATE: usize = 60;

/// A plate of 10 cm that falls by 2 cm along x.
fn plate() -> TriMesh {
    let corner = |x: f32, z: f32| Vec3::new(x, 0.03 - 0.2 * x, z);
    let positions = vec![corner(-0.05, -0.05), corner(-0.05, 0.05), corner(0.05, 0.05), corner(0.05, -0.05)];
    TriMesh { positions, triangles: vec![[0, 1, 2], [0, 2, 3]] }
}

fn main() -> Result<()> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "target/pour_liquid".into());
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, "create the folder", error))?;
    let ctx = Context::new(Pool::all_cores()?);

    let grid = Grid { cell: CELL, origin: [-0.05, -0.05], size: [100, 100] };
    let ground = plate();
    let solids =
        triangles::solids(&ground.positions, &ground.triangles, grid, Heights::between(-0.01, 0.1)?)?;
    let mut liquid = Shallow::new(&ctx, &solids, Params { liquid: Liquid::BLOOD, ..Params::default() })?;
    let source =
        FlowPoint { kind: Kind::Source, at: [-0.03, 0.036, 0.0], radius: 0.004, rate: 1e-6, pulse: None };
    liquid.set_flows(&[source], |_| "the source".into())?;

    for second in 1..=SECONDS {
        for _ in 0..RATE {
            liquid.step(&ctx, 1.0 / RATE as f64)?;
        }
        let millilitres = 1e6 * liquid.balance().inside;
        println!("after {second} s: {millilitres:.2} ml on the plate");
        mesh::write(&folder.join(format!("blood.{second:04}.ply")), &surface(&liquid)?)?;
    }
    Ok(())
}

/// The liquid's surface. A renderer passes its own buffers in place of these vectors.
fn surface(liquid: &Shallow) -> Result<TriMesh> {
    let depths = Depths { depth: liquid.depths(), ..Depths::default() };
    let mut surface = Surface::default();
    let counts = surface.count(liquid.columns(), &depths)?;
    let (mut positions, mut indices) = (vec![0.0; 3 * counts.vertices], vec![0; counts.indices]);
    let mut target =
        Target { positions: Some(&mut positions), indices: Indices::U32(&mut indices), ..Target::default() };
    surface.build(liquid.columns(), &depths, &Layout::default(), &mut target)?;
    let positions = positions.as_chunks::<3>().0.iter().map(|&position| Vec3::from(position)).collect();
    Ok(TriMesh { positions, triangles: indices.as_chunks::<3>().0.to_vec() })
}
