//! Gates of the particles' surface against plain sums, and of a million particles under a million triangles.

use frazil::geometry::DVec3;
use frazil::surface::Implicit;

use crate::common::liquids::{ball, context, plain_phi, two_clouds, write_cache};
use crate::harness::Harness;
use crate::process::{frazil, json, works};

pub fn run(h: &mut Harness) {
    h.measure("surface.phi_sum", sums);
    h.measure_all(["surface.time_1m", "surface.memory_1m"], million);
}

/// The function at the nodes of two clouds, against sums over all particles in 64 bits.
fn sums() -> (f64, String) {
    let (ctx, spacing) = (context(2), 0.1);
    let positions = two_clouds(spacing);
    let phi = Implicit::new(&ctx, &positions, spacing, 0.5 * spacing).expect("a surface");
    let (mut most, mut count) = (0.0f64, 0);
    for (index, patch) in phi.patches().iter().enumerate() {
        for node in 0..64 {
            let at = [node >> 4, node >> 2 & 3, node & 3];
            let at = DVec3::from([0, 1, 2].map(|axis| f64::from(4 * patch[axis] + at[axis]))) * phi.cell();
            let expected = plain_phi(&positions, spacing, at);
            if expected.is_finite() && expected < 2.0 * spacing {
                let value = f64::from(phi.values(index)[node as usize]) * phi.cell();
                most = most.max((value - expected).abs() / spacing);
                count += 1;
            }
        }
    }
    (most, format!("{count} nodes of two clouds with a gap"))
}

/// One step by the command, on one thread: what advection, surface, distances and projection take, and the greatest memory.
fn million() -> [(f64, String); 2] {
    let folder = tempfile::tempdir().expect("a folder");
    let ball = ball(62.0, 289, 0.25);
    write_cache(folder.path(), "ball", &ball, 3);
    let arguments = "surface -p ball.%04d.bgeo -m ball.ply -o out -q --spacing 0.01 --threads 1 --report run.json --set surface.rebuild=false";
    works(frazil(arguments.split(' ')).current_dir(&folder));
    let read = |name: &str| json(&folder.path().join(name));
    let frame = read("out/report/surface.0003.json");
    let phases = frame["phases"].as_array().expect("phases");
    let seconds: f64 = phases.iter().map(|phase| phase["seconds"].as_f64().expect("seconds")).sum();
    let note =
        format!("{} particles, {} triangles; threads=1", ball.positions.len(), ball.mesh.triangles.len());
    let cpu = frazil::numeric::cpu::cpu_level();
    let peak = read("run.json")["peak_memory_bytes"].as_f64().expect("a peak") / 1e9;
    let of_time = format!("{note} cpu={cpu:?}; all phases of a frame");
    [(seconds, of_time), (peak, format!("{note}; the whole command"))]
}
