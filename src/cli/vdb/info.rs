//! The contents of .vdb files, for `frazil info`.

use std::path::Path;

use frazil::Context;
use frazil::vdb::changes::{changes_since, partial};
use frazil::vdb::{MetaValue, distances, file, level_set, points};
use serde_json::{Map, Value, json};

/// A .vdb file's grids: their descriptions, and on request the area and volume of level sets.
pub fn grids(path: &Path, measure: bool, ctx: &Context) -> frazil::Result<Vec<Value>> {
    let mut out = Vec::new();
    let grids = file::describe(path)?;
    for (index, grid) in grids.iter().enumerate() {
        let same = |other: &&file::GridInfo| other.name == grid.name;
        let (count, before) = (grids.iter().filter(same).count(), grids[..index].iter().filter(same).count());
        let mut entry = Map::new();
        let mut set = |key: &str, value: Value| entry.insert(key.into(), value);
        set("name", json!(grid.name));
        if count > 1 {
            let which =
                format!("{} of {count} of this name; commands that take a name read the first", before + 1);
            set("namesakes", json!(which));
        }
        set("type", json!(grid.value_type));
        set("class", json!(grid.class));
        set("voxel_m", json!(grid.voxel));
        set("active_voxels", json!(grid.active_voxels));
        set("bbox", json!(grid.bbox));
        set("memory_bytes", json!(grid.memory));
        set("half", json!(grid.half));
        set("compression", json!(grid.compression));
        if measure && grid.class == "level set" {
            let (own, what) = distances::mended(ctx, file::read_nth(path, index)?)?;
            let size = level_set::measure(ctx, &own)?;
            if let Some(what) = what {
                log::warn!("{}: grid \"{}\" {what}", path.display(), grid.name);
            }
            set("area_m2", json!(size.area));
            set("volume_m3", json!(size.volume));
        }
        if grid.value_type.starts_with("Tree_ptdataidx32") {
            let points = points::read(path, Some(&grid.name))?;
            entry.extend(crate::cli::points::description(&points));
            if let Some(since) = changes_since(path)? {
                entry.insert("partial".into(), json!(partial(since)));
            }
        }
        let metadata = grid.metadata.iter().filter(|(key, _)| !key.starts_with("file_"));
        entry.extend(metadata.map(|(key, value)| (key.clone(), meta(value))));
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
