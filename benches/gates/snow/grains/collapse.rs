//! Gate of collapsing columns as scenes with default settings, made by the program: grains that settled in a cylinder are the
//! `initial` ones of a scene, on its snow. Run-out after Lube et al. (2004): see `columns`.

use std::fmt::Write;
use std::path::Path;

use frazil::geometry::DVec3;
use frazil::io::particles::ply;

use crate::harness::Harness;
use crate::process::{frazil, works};
use crate::snow::grains::column_collapse::{self, D};

/// Approximate count of grains of a column.
const GRAINS: f64 = 12_000.0;
/// Depth (m) of the snow on which it stands.
const DEPTH: f64 = 0.04;
/// Frames of a collapse.
const FRAMES: i32 = 30;

pub fn run(h: &mut Harness) {
    column_collapse::compare(h, "snow.grains.collapse", &[0.5, 1.0, 3.0, 10.0], |aspect| {
        let (column, radius, height) = column_collapse::settled(aspect, GRAINS);
        let positions: Vec<DVec3> = column.heap.positions().map(|at| at + DVec3::y() * DEPTH).collect();
        let folder = tempfile::tempdir().expect("a folder");
        (column_collapse::edge(&collapsed(folder.path(), &positions)) / radius - 1.0, height / radius)
    });
}

/// Positions (m) of grains at the end of a scene that begins with them.
fn collapsed(folder: &Path, positions: &[DVec3]) -> Vec<DVec3> {
    let mut cloud = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\nend_header\n",
        positions.len()
    );
    positions.iter().for_each(|at| writeln!(cloud, "{} {} {}", at.x, at.y, at.z).expect("text"));
    let scene = format!(
        "[shot]\nframes = \"1-{FRAMES}\"\n[snow]\nground = 0.0\narea = [-0.6, -0.6, 0.6, 0.6]\ndepth = {DEPTH}\ncell = 0.01\n\
         [grains]\nradius = {}\ninitial = \"column.ply\"\n[output]\ngrains = [\"ply\"]\nusd = false\n",
        0.5 * D
    );
    std::fs::write(folder.join("column.ply"), cloud).expect("points");
    std::fs::write(folder.join("scene.toml"), scene).expect("a scene");
    works(frazil("snow scene.toml -o out -q --threads 2".split(' ')).current_dir(folder));
    let last = folder.join(format!("out/grains/grains.{FRAMES:04}.ply"));
    let end = ply::read(&last).expect("grains").positions;
    assert_eq!(end.len(), positions.len(), "none is lost");
    end
}
