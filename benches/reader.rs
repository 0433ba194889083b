//! What crate vdb-rs reads in a .vdb file: `reader FILE GRID` prints active voxels, class and cell (m). A program of its own,
//! which `gates` starts: it does not link frazil.

use std::fs::File;
use std::io::BufReader;

use vdb_rs::{Map, MetadataValue, VdbReader};

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    let [path, name] = arguments.as_slice() else {
        eprintln!("usage: reader FILE GRID");
        std::process::exit(2);
    };
    let file = BufReader::new(File::open(path).expect("file"));
    let grid = VdbReader::new(file).expect("header").read_grid::<f32>(name).expect("grid");
    let active: f64 = grid.iter().map(|(_, _, level)| f64::from(level.scale()).powi(3)).sum();
    let class = match grid.descriptor.meta_data.0.get("class") {
        Some(MetadataValue::String(class)) => class.clone(),
        other => format!("{other:?}"),
    };
    let cell = match grid.transform {
        Map::UniformScaleMap { voxel_size, .. } | Map::ScaleTranslateMap { voxel_size, .. } => voxel_size.x,
    };
    println!("{active} {class} {cell}");
}
