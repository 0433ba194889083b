//! Metadata of .vdb files about their frame.

use super::Scene;
use crate::vdb::MetaValue;

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
