//! Gates of the file format: other readers see what we see.

use std::io::BufReader;
use std::process::Command;

use frazil::vdb::file::{WriteOptions, write};
use vdb_rs::{Map, MetadataValue, VdbReader};

use crate::harness::Harness;
use crate::scenes::{self, context};

/// All of them: active count, class and cell of a level set.
pub fn run(h: &mut Harness) {
    if !h.wants("snow.base.readers") {
        return;
    }
    let ctx = context(2);
    let base = scenes::snow(&ctx, 1.0, 0.01, scenes::EXACT);
    let path = std::env::temp_dir().join(format!("frazil-gates-{}.vdb", std::process::id()));
    write(&path, &[base.surface()], &WriteOptions::default()).expect("write");
    let expected = format!("{} level set 0.01", base.surface().active_voxels());

    let file = BufReader::new(std::fs::File::open(&path).expect("file"));
    let grid = VdbReader::new(file).expect("header").read_grid::<f32>("surface").expect("grid");
    let active: f64 = grid.iter().map(|(_, _, level)| f64::from(level.scale()).powi(3)).sum();
    let class = match grid.descriptor.meta_data.0.get("class") {
        Some(MetadataValue::String(class)) => class.clone(),
        other => format!("{other:?}"),
    };
    let cell = match grid.transform {
        Map::UniformScaleMap { voxel_size, .. } | Map::ScaleTranslateMap { voxel_size, .. } => voxel_size.x,
    };
    let said = format!("{active} {class} {cell}");
    h.holds("snow.base.readers_vdb_rs", said == expected, &format!("{said} | {expected}"));

    let script = "import sys, pyopenvdb as v; g = v.read(sys.argv[1], 'surface'); \
                  print(g.activeVoxelCount(), g.gridClass, g.transform.voxelSize()[0])";
    let python = Command::new("/usr/bin/python3").args(["-c", script]).arg(&path).output();
    let said = python.map(|output| String::from_utf8_lossy(&output.stdout).trim().to_string());
    let said = said.unwrap_or_default();
    h.holds("snow.base.readers_pyopenvdb", said == expected, &format!("{said} | {expected}"));
    let print = Command::new("vdb_print").arg("-l").arg(&path).output();
    h.holds("snow.base.readers_vdb_print", print.is_ok_and(|output| output.status.success()), "");
    let _ = std::fs::remove_file(path);
}
