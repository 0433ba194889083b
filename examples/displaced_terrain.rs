//! A surface on layers, compared with one that only displaces the terrain (thesis Fig. 4.16): `cargo run --release --example displaced_terrain DIR`.
//!
//! Blood runs over shelves (`make_scenes` writes them). A terrain that is displaced by a depth has one height in each cell, seen from above: from the edges
//! of shelves and around the hole it hangs down in curtains, and it shows nothing of what runs below. Writes DIR/layered.png and
//! DIR/displaced.png.

use std::path::Path;

use frazil::geometry::{DVec3, TriMesh, Vec3};
use frazil::io::mesh;
use frazil::render::{Camera, Light, Model, Models, Size};
use frazil::shallow::columns::grid::{Grid, Heights};
use frazil::shallow::material::Liquid;
use frazil::shallow::sources::{FlowPoint, Kind};
use frazil::shallow::surface::heights::minimum_heights::{Distance, MinimumHeights};
use frazil::shallow::surface::{Depths, Indices, Layout, Surface, Target};
use frazil::shallow::terrain::triangles;
use frazil::shallow::{Params, Shallow};
use frazil::{Context, Error, Pool, Result};

/// Edge of a cell, and the depth from which blood is opaque (m).
const CELL: f64 = 0.0005;
const OPAQUE: f64 = 0.001;
/// Frames of 1/60 s.
const FRAMES: usize = 240;
/// Colours (linear red, green, blue).
const BLOOD: [f32; 3] = [0.30, 0.008, 0.006];
const STONE: [f32; 3] = [0.58, 0.54, 0.47];

fn main() -> Result<()> {
    let folder = std::env::args().nth(1).unwrap_or_else(|| "target/displaced_terrain".into());
    let folder = Path::new(&folder);
    std::fs::create_dir_all(folder).map_err(|error| Error::io(folder, "create the folder", error))?;
    let ctx = Context::new(Pool::all_cores()?);
    let ground = mesh::read(Path::new("target/demo/shelves.obj"))?;
    let liquid = poured(&ctx, &ground)?;
    let camera = Camera {
        eye: DVec3::new(0.085, 0.085, 0.085),
        target: DVec3::new(-0.002, 0.022, 0.0),
        fov_deg: 29.0,
    };
    let size = Size { width: 480, height: 400 };
    for (name, (surface, opacities)) in
        [("layered", layered(&liquid, &ground)?), ("displaced", displaced(&liquid))]
    {
        let models =
            Models::new(vec![Model::mesh(&ground, STONE), Model::liquid(&surface, BLOOD, opacities)]);
        let picture = models.draw(&ctx, &camera, &Light::from_degrees(-35.0, 40.0), size)?;
        picture.write(&folder.join(format!("{name}.png")))?;
    }
    Ok(())
}

/// Blood that was poured onto the upper shelf.
fn poured(ctx: &Context, ground: &TriMesh) -> Result<Shallow> {
    let grid = Grid { cell: CELL, origin: [-0.05, -0.05], size: [200, 200] };
    let heights = Heights::between(-0.01, 0.1)?;
    let solids = triangles::solids(&ground.positions, &ground.triangles, grid, heights)?;
    let params = Params { liquid: Liquid::BLOOD, ..Params::default() };
    let mut liquid = Shallow::new(ctx, &solids, params)?;
    let at = [-0.012, 0.042, 0.0];
    let source = FlowPoint { kind: Kind::Source, at, radius: 0.003, rate: 3e-6, pulse: None };
    liquid.set_flows(&[source], |_| "the source".into())?;
    for _ in 0..FRAMES {
        liquid.step(ctx, 1.0 / 60.0)?;
    }
    Ok(liquid)
}

/// The surface of all layers, and its opacities.
fn layered(liquid: &Shallow, ground: &TriMesh) -> Result<(TriMesh, Vec<f32>)> {
    let columns = liquid.columns();
    let mut lifts = MinimumHeights::default();
    lifts.find(columns, &ground.positions, &ground.triangles, Distance::default())?;
    let depths =
        Depths { depth: liquid.depths(), least: lifts.least(), sunk: lifts.sunk(), ..Depths::default() };
    let mut surface = Surface::default();
    let counts = surface.count(columns, &depths)?;
    let (mut places, mut opacities) = (vec![0.0; 3 * counts.vertices], vec![0.0; counts.vertices]);
    let mut indices = vec![0; counts.indices];
    let layout = Layout { fade_depth: 0.02 * CELL, opaque_depth: OPAQUE, ..Layout::default() };
    let mut target = Target {
        positions: Some(&mut places),
        opacities: Some(&mut opacities),
        indices: Indices::U32(&mut indices),
        ..Target::default()
    };
    surface.build(columns, &depths, &layout, &mut target)?;
    let positions = places.as_chunks::<3>().0.iter().map(|&place| Vec3::from(place)).collect();
    Ok((TriMesh { positions, triangles: indices.as_chunks::<3>().0.to_vec() }, opacities))
}

/// The terrain as it is seen from above, displaced by the depth of its topmost liquid; squares between four wet cells only.
fn displaced(liquid: &Shallow) -> (TriMesh, Vec<f32>) {
    let (columns, [nx, nz]) = (liquid.columns(), liquid.columns().grid.size);
    let (mut mesh, mut opacities) = (TriMesh::default(), Vec::new());
    for index in 0..nx * nz {
        let cell = [index % nx, index / nx];
        let [x, z] = columns.grid.centre(cell);
        let wet = columns.of_cell(cell).filter(|&column| liquid.depths()[column] > 0);
        let height = wet.last().map(|column| {
            let depth = f64::from(liquid.depths()[column]) * columns.heights.unit;
            opacities.push((depth / OPAQUE).min(1.0) as f32);
            columns.heights.low + f64::from(columns.bases()[column]) * columns.heights.unit + depth
        });
        if height.is_none() {
            opacities.push(0.0);
        }
        mesh.positions.push(Vec3::new(x as f32, height.map_or(f32::NAN, |height| height as f32), z as f32));
    }
    for index in (0..nx * (nz - 1)).filter(|index| index % nx + 1 < nx) {
        let [a, b, c, d] = [index, index + nx, index + nx + 1, index + 1];
        if [a, b, c, d].iter().all(|&at| mesh.positions[at].y.is_finite()) {
            let [a, b, c, d] = [a, b, c, d].map(|at| at as u32);
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    mesh.positions
        .iter_mut()
        .filter(|position| !position.y.is_finite())
        .for_each(|position| position.y = 0.0);
    (mesh, opacities)
}
