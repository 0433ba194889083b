//! Gates of surfaces of particles against splashsurf 0.14 (Löschner et al. 2023), which `make test-clients` installs: the whole
//! command with its files, on one thread, with the same cells and the same radius of influence.

use std::path::{Path, PathBuf};
use std::process::Command;

use frazil::geometry::DVec3;
use frazil::geometry::points::Points;
use frazil::io::particles;

use crate::common::liquids::Random;
use crate::harness::{Harness, median, timed};
use crate::process::{frazil, works};

/// Gates, with the count of particles along an edge of their block.
const GATES: [(&str, i32); 3] =
    [("surface.splashsurf_20k", 27), ("surface.splashsurf_260k", 64), ("surface.splashsurf_1m", 100)];
/// Initial distance between particles (m).
const SPACING: f64 = 0.1;
/// Arguments of both. Splashsurf's lengths are in radii of particles, half a spacing, and its kernel reaches twice its smoothing length:
/// 4 spacings as ours.
const OTHERS: &str = "-r 0.05 -l 4.0 -c 1.0 -t 0.6 -n 1 -o other.ply -q";
const OWN: &str = "vdb from-particles --spacing 0.1 --mesh own.ply --threads 1 -q";
/// Runs of each, one after the other by turns.
const RUNS: usize = 5;

pub fn run(h: &mut Harness) {
    if !GATES.iter().any(|(name, _)| h.wants(name)) {
        return;
    }
    let other = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/clients/bin/pysplashsurf");
    if !other.is_file() {
        GATES.iter().for_each(|(name, _)| h.skipped(name, "splashsurf is not installed: make test-clients"));
        return;
    }
    let folder = tempfile::tempdir().expect("a folder");
    for (name, edge) in GATES {
        h.measure(name, || {
            let file = block(folder.path(), edge);
            let time = |command: &mut Command| timed(|| works(command.current_dir(&folder))).0;
            let (mut own, mut others) = (Vec::new(), Vec::new());
            for _ in 0..RUNS {
                others.push(time(Command::new(&other).arg("reconstruct").arg(&file).args(OTHERS.split(' '))));
                own.push(time(frazil(OWN.split(' ')).arg(&file)));
            }
            let (own, others) = (median(own), median(others));
            let note = format!("{own:.2} s, splashsurf {others:.2} s, of {} particles", edge.pow(3));
            (own / others, note)
        });
    }
}

/// A block of particles with a wavy surface, as a file.
fn block(folder: &Path, edge: i32) -> PathBuf {
    let mut random = Random(1);
    let mut positions = Vec::with_capacity(edge.pow(3) as usize);
    for n in 0..edge.pow(3) {
        let at =
            DVec3::new(f64::from(n / edge / edge), f64::from(n / edge % edge), f64::from(n % edge)) * SPACING;
        let wave = 0.8 * libm::sin(1.5 * at.x) * libm::cos(1.2 * at.z);
        positions.push(at + DVec3::new(0.0, wave, 0.0) + random.vector(0.2 * SPACING));
    }
    let path = folder.join(format!("block{edge}.xyz"));
    particles::write(&path, &Points::at(1.0, &positions).expect("points"), false).expect("a file");
    path
}
