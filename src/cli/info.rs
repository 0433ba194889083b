//! `frazil info`: the contents of files.

use std::path::{Path, PathBuf};

use frazil::io;
use frazil::motion::{Character, Play, gait, is_gltf};
use serde_json::{Map, Value, json};

use super::options::{Origin, warn_if_far};
use super::output;
use super::session::{Failure, OrFailure, Session};

/// Report what .vdb, mesh (.obj, .ply, .stl), character (.glb, .gltf) and particle files (.bgeo, .vtk, .vtu, .xyz, .ply) hold.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  frazil info cache/base/base.0048.vdb --measure")]
pub struct Args {
    /// Files.
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// Measure area and volume too (reads the whole file).
    #[arg(long)]
    measure: bool,
    #[command(flatten)]
    origin: Origin,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
#[cfg_attr(not(feature = "vdb"), expect(unused_variables, reason = "only grids are measured by threads"))]
pub fn run(args: Args, session: &Session) -> Result<(), Failure> {
    let mut all = Vec::new();
    for path in &args.files {
        let holds = match io::mesh::extension(path).as_str() {
            #[cfg(feature = "vdb")]
            "vdb" => super::vdb::info::grids(path, args.measure, &session.ctx),
            #[cfg(not(feature = "vdb"))]
            "vdb" => super::needs_openvdb(path),
            _ if is_gltf(path) => character(path, &args.origin),
            _ if io::particles::holds_points(path).is_ok_and(|yes| yes) => {
                super::points::info(path, args.origin.at)
            }
            _ => mesh(path, &args.origin),
        };
        all.push(json!({ "file": path.display().to_string(), "holds": holds.or_refuse()? }));
    }
    let text = if args.json { format!("{:#}\n", json!(all)) } else { all.iter().map(lines).collect() };
    output::print(&text).or_fail()
}

fn mesh(path: &Path, origin: &Origin) -> frazil::Result<Vec<Value>> {
    let mesh = io::mesh::read_any_from(path, origin.at)?.into_triangles();
    warn_if_far(path, &mesh);
    let vertices = mesh.positions.len();
    let mesh = mesh.without_unused();
    let bounds = mesh.bounds().map(|(low, high)| (<[f32; 3]>::from(low), <[f32; 3]>::from(high)));
    Ok(vec![json!({
        "type": "mesh",
        "vertices": vertices,
        "triangles": mesh.triangles.len(),
        "bounds_m": bounds,
        "closed": mesh.is_closed(),
        "manifold": mesh.is_manifold(),
        "euler_characteristic": mesh.euler_characteristic(),
        "area_m2": mesh.area(),
        "volume_m3": mesh.volume(),
    })])
}

fn character(path: &Path, origin: &Origin) -> frazil::Result<Vec<Value>> {
    let contents = Character::describe(path)?;
    let rest = Character::at_rest_from(path, origin.at)?;
    warn_if_far(path, &rest);
    let bounds = rest.bounds().map(|(low, high)| (<[f32; 3]>::from(low), <[f32; 3]>::from(high)));
    let (mut clips, mut gaits) = (Map::new(), Map::new());
    for (name, seconds) in contents.clips {
        let gait = clip_gait(path, &name, seconds)?;
        clips.insert(name.clone(), json!(seconds));
        gaits.insert(name, gait);
    }
    let mut entry = json!({
        "type": "character",
        "vertices": rest.positions.len(),
        "triangles": rest.triangles.len(),
        "skins": contents.skins,
        "bounds": bounds,
        "clips_s": clips,
        "nodes": contents.mesh_nodes,
    });
    if !gaits.is_empty() {
        entry["gaits"] = Value::Object(gaits);
    }
    if contents.mesh_nodes.len() > MAX_NODES_IN_LINE {
        let line = |(name, depth, has_mesh): &(String, usize, bool)| {
            format!("{}{name}{}", "  ".repeat(*depth), if *has_mesh { " (mesh)" } else { "" })
        };
        entry["node_tree"] = json!(contents.tree.iter().map(line).collect::<Vec<_>>());
    }
    Ok(vec![entry])
}

/// Maximum number of nodes listed in one line.
const MAX_NODES_IN_LINE: usize = 6;

/// How the lowest parts of a character move in a clip while they stand (in the file's unit, Y up).
fn clip_gait(path: &Path, clip: &str, seconds: f64) -> frazil::Result<Value> {
    let play = Play { clip: Some(clip.into()), repeat: false, ..Play::default() };
    let Some(gait) = gait(&Character::open(path, play)?, 0.0, seconds)? else {
        return Ok(json!({ "says": "no part stands still for long" }));
    };
    let (carry, speed) = (gait.carry(), gait.velocity.norm());
    let says = if speed * seconds < 0.02 * gait.height {
        "stays in place: no keys are needed".to_string()
    } else if gait.is_steady() {
        format!(
            "move it by [{:.3}, 0, {:.3}] in each cycle of {seconds:.3} s ({speed:.3} per second), or its feet slip",
            carry.x * seconds,
            carry.z * seconds
        )
    } else {
        "its lowest parts move too unevenly for one speed".to_string()
    };
    Ok(json!({
        "carry_per_s": [carry.x, 0.0, carry.z],
        "stride": speed * seconds,
        "steady": gait.is_steady(),
        "standing": gait.standing,
        "lowest": gait.lowest,
        "says": says,
    }))
}

fn lines(entry: &Value) -> String {
    let mut text = format!("{}\n", entry["file"].as_str().unwrap_or_default());
    for part in entry["holds"].as_array().into_iter().flatten() {
        for (key, value) in part.as_object().into_iter().flatten() {
            text += &row_of(key, value, part);
        }
        text += "\n";
    }
    text
}

/// One entry as text; clips and trees in one line each.
fn row_of(key: &str, value: &Value, part: &Value) -> String {
    let line = |name: &str, text: &str| format!("  {name:<22} {text}\n");
    let rows = |rows: Vec<String>| -> String {
        rows.iter().enumerate().map(|(row, text)| line(if row == 0 { key } else { "" }, text)).collect()
    };
    match (key, value) {
        ("gaits", Value::Object(gaits)) => rows(
            gaits
                .iter()
                .map(|(clip, gait)| {
                    let lowest =
                        gait["lowest"].as_f64().map_or(String::new(), |y| format!("; lowest y = {y:.4}"));
                    format!("\"{clip}\": {}{lowest}", gait["says"].as_str().unwrap_or_default())
                })
                .collect(),
        ),
        ("node_tree", Value::Array(nodes)) => {
            rows(nodes.iter().map(|node| node.as_str().unwrap_or_default().to_string()).collect())
        }
        // Already listed in the tree.
        ("nodes", Value::Array(nodes)) if part.get("node_tree").is_some() => {
            line(key, &format!("{} with a mesh", nodes.len()))
        }
        _ => line(key, &value.as_str().map_or_else(|| value.to_string(), str::to_string)),
    }
}
