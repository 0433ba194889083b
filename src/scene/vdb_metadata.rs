//! Metadata of .vdb files about their frame, and the contents of their grids.

use super::Scene;
use crate::geometry::DVec3;
use crate::io::usd::{Contents, ContentsByName};
use crate::vdb::{FloatGrid, MetaValue};

/// Metadata of every .vdb file of a shot.
pub(super) fn metadata(scene: &Scene, frame: i32, made_from: &str) -> Vec<(String, MetaValue)> {
    let fps = scene.shot.fps;
    let text = |text: &str| MetaValue::Text(text.into());
    vec![
        ("frazil:frame".into(), MetaValue::Int(frame.into())),
        ("frazil:fps".into(), MetaValue::Double(fps)),
        ("frazil:seconds".into(), MetaValue::Double(f64::from(frame) / fps)),
        ("frazil:units".into(), text("metres")),
        ("frazil:up".into(), text("y")),
        ("frazil:version".into(), text(env!("CARGO_PKG_VERSION"))),
        ("frazil:inputs".into(), text(made_from)),
    ]
}

/// The contents of grids, for the frame's report and `shot.usda`.
pub(super) fn contents(grids: &[&FloatGrid]) -> ContentsByName {
    let of = |grid: &&FloatGrid| (grid.name(), Contents { extent: extent(grid), ..Contents::default() });
    grids.iter().map(of).collect()
}

/// Minimum and maximum corner of a box around the active voxels, whose edges are parallel to the axes (m).
fn extent(grid: &FloatGrid) -> Option<[[f32; 3]; 2]> {
    let (low, high) = grid.active_bbox()?;
    let corner = |voxel: [i32; 3], by: f64| {
        let index = DVec3::from(voxel.map(f64::from)).add_scalar(by);
        grid.index_to_world(index).cast::<f32>().into()
    };
    Some([corner(low, -0.5), corner(high, 0.5)])
}
