//! Gate of crowded grains: a box ploughs through snow all the way, faster than the grains can push each other aside.

use std::collections::HashMap;

use frazil::io::mesh;
use frazil::vdb::points;

use crate::common::shapes::cuboid;
use crate::process::works;
use crate::snow::grains::passes::pass;

/// Largest count of grains in a cube of two diameters, in any frame: a random packing fits ten.
pub fn measure() -> (f64, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let object = folder.path().join("box.obj");
    mesh::write(&object, &cuboid([0.06, 0.1, 0.12])).expect("a mesh");
    let scene = folder.path().join("plough.toml");
    let text = format!(
        "[shot]\nframes = \"1-12\"\n[snow]\nground = 0.0\narea = [-0.5, -0.25, 0.5, 0.25]\ndepth = 0.1\ncell = 0.0075\n\
         [grains]\nradius = 0.002\ncompression = 0.0\n[[object]]\nfile = '{}'\nkeys = [\n\
         {{ frame = 1, at = [-0.35, 0.08, 0.0] }},\n{{ frame = 12, at = [0.15, 0.08, 0.0] }},\n]\n",
        object.display()
    );
    std::fs::write(&scene, text).expect("a scene");
    let out = folder.path().join("out");
    works(&mut pass(&scene, &out, 2));
    let (mut most, mut grains) = (0, 0);
    for frame in 2..=12 {
        let points = points::read(&out.join(format!("grains/grains.{frame:04}.vdb")), None).expect("points");
        let mut counts = HashMap::new();
        grains = points.count();
        for index in 0..grains {
            // The cells in which grains count as crowded.
            let cell: [i64; 3] = points.position(index).map(|x| (x / 0.008).floor() as i64).into();
            *counts.entry(cell).or_insert(0u32) += 1;
        }
        most = most.max(counts.into_values().max().unwrap_or(0));
    }
    (f64::from(most), format!("at 1.1 m/s, {grains} grains in the end"))
}
