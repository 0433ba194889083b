//! What .vdb files hold, for `frazil info`.

use std::path::Path;

use frazil::Context;
use frazil::scene::{changes_since, partial};
use frazil::vdb::{MetaValue, file, level_set, points};
use serde_json::{Map, Value, json};

/// A .vdb file's grids: what they are, and on request the area and volume of level sets.
pub fn grids(path: &Path, measure: bool, ctx: &Context) -> frazil::Result<Vec<Value>> {
    let mut out = Vec::new();
    for grid in file::describe(path)? {
        let mut entry = Map::new();
        let mut set = |key: &str, value: Value| entry.insert(key.into(), value);
        set("name", json!(grid.name));
        set("type", json!(grid.value_type));
        set("class", json!(grid.class));
        set("voxel_m", json!(grid.voxel));
        set("active_voxels", json!(grid.active_voxels));
        set("bbox", json!(grid.bbox));
        set("memory_bytes", json!(grid.memory));
        set("half", json!(grid.half));
        set("compression", json!(grid.compression));
        if measure && grid.class == "level set" {
            let size = level_set::measure(ctx, &file::read_named(path, Some(&grid.name))?)?;
            set("area_m2", json!(size.area));
            set("volume_m3", json!(size.volume));
        }
        if grid.value_type.starts_with("Tree_ptdataidx32") {
            let points = points::read(path, Some(&grid.name))?;
            entry.extend(crate::cli::cloud::described(&points));
            if let Some(since) = changes_since(path)? {
                entry.insert("partial".into(), json!(partial(since)));
            }
        }
        let mut set = |key: &str, value: Value| entry.insert(key.into(), value);
        for (key, value) in grid.metadata.iter().filter(|(key, _)| !key.starts_with("file_")) {
            set(key, meta(value));
        }
        out.push(Value::Object(entry));
    }
    Ok(out)
}

fn meta(value: &MetaValue) -> Value {
    match value {
        MetaValue::Text(text) | MetaValue::Other(_, text) => json!(text),
        MetaValue::Float(number) => json!(number),
        MetaValue::Double(number) => json!(number),
        MetaValue::Int(number) => json!(number),
        MetaValue::Bool(yes) => json!(yes),
    }
}
