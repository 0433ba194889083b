//! `frazil info`: what files hold.

use std::path::{Path, PathBuf};

use frazil::motion::Character;
use frazil::vdb::{MetaValue, file, level_set};
use frazil::{Context, io};
use serde_json::{Map, Value, json};

use super::exit::{Failure, Phase};
use super::output;
use super::session::Session;

/// Say what .vdb, .obj, .ply, .stl, .glb and .gltf files hold.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  frazil info cache/base/base.0048.vdb --measure")]
pub struct Args {
    /// Files.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Measure area and volume too (reads everything).
    #[arg(long)]
    measure: bool,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: Args, session: &Session) -> Result<(), Failure> {
    let mut all = Vec::new();
    for path in &args.files {
        let extension = path.extension().unwrap_or_default().to_string_lossy().to_lowercase();
        let told = match extension.as_str() {
            "vdb" => grids(path, args.measure, &session.ctx),
            "glb" | "gltf" => character(path),
            _ => mesh(path),
        };
        all.push(json!({ "file": path.display().to_string(), "holds": told.before()? }));
    }
    let text = if args.json { format!("{:#}\n", json!(all)) } else { all.iter().map(lines).collect() };
    output::print(&text).during()
}

fn grids(path: &Path, measure: bool, ctx: &Context) -> frazil::Result<Vec<Value>> {
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

fn mesh(path: &Path) -> frazil::Result<Vec<Value>> {
    let mesh = io::mesh::read(path)?;
    let bounds = mesh.bounds().map(|(low, high)| (<[f32; 3]>::from(low), <[f32; 3]>::from(high)));
    Ok(vec![json!({
        "type": "mesh",
        "vertices": mesh.positions.len(),
        "triangles": mesh.triangles.len(),
        "bounds_m": bounds,
        "closed": mesh.is_closed(),
        "manifold": mesh.is_manifold(),
        "euler_characteristic": mesh.euler_characteristic(),
        "area_m2": mesh.area(),
        "volume_m3": mesh.volume(),
    })])
}

fn character(path: &Path) -> frazil::Result<Vec<Value>> {
    let contents = Character::describe(path)?;
    let rest = Character::at_rest(path)?;
    let bounds = rest.bounds().map(|(low, high)| (<[f32; 3]>::from(low), <[f32; 3]>::from(high)));
    let mut clips = Map::new();
    contents.clips.into_iter().for_each(|(name, seconds)| {
        clips.insert(name, json!(seconds));
    });
    Ok(vec![json!({
        "type": "character",
        "vertices": rest.positions.len(),
        "triangles": rest.triangles.len(),
        "skins": contents.skins,
        "bounds": bounds,
        "clips_s": clips,
        "nodes": contents.mesh_nodes,
    })])
}

fn lines(entry: &Value) -> String {
    let mut text = format!("{}\n", entry["file"].as_str().unwrap_or_default());
    for part in entry["holds"].as_array().into_iter().flatten() {
        for (key, value) in part.as_object().into_iter().flatten() {
            let value = value.as_str().map_or_else(|| value.to_string(), str::to_string);
            text += &format!("  {key:<22} {value}\n");
        }
        text += "\n";
    }
    text
}
