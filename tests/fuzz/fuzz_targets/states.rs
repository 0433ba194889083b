//! Exact states that hosts save and bring back: of a mesh that follows particles, and of a shallow liquid.
#![no_main]

use std::sync::LazyLock;

use frazil::geometry::TriMesh;
use frazil::shallow::columns::grid::{Grid, Heights};
use frazil::shallow::terrain::triangles;
use frazil::shallow::{self, Shallow};
use frazil::surface::{self, Tracker};
use frazil::{Context, Pool};

/// One thread: the fuzzer runs several processes.
static CTX: LazyLock<Context> = LazyLock::new(|| Context::new(Pool::new(1).unwrap()));

libfuzzer_sys::fuzz_target!(|data: &[u8]| {
    let Some((kind, bytes)) = data.split_first() else { return };
    if kind % 2 == 0 {
        let mesh = TriMesh::cuboid([0.0; 3], [1.0; 3]);
        let _ = Tracker::resume(surface::Params::for_spacing(0.5), &mesh, bytes);
    } else {
        let grid = Grid { cell: 0.1, origin: [0.0; 2], size: [16, 16] };
        let ground = TriMesh::cuboid([0.0, -0.1, 0.0], [1.6, 0.0, 1.6]);
        let heights = Heights::between(-1.0, 1.0).unwrap();
        let solids = triangles::solids(&ground.positions, &ground.triangles, grid, heights).unwrap();
        let mut liquid = Shallow::new(&CTX, &solids, shallow::Params::default()).unwrap();
        let _ = liquid.restore(bytes);
    }
});
