//! `frazil mesh`: what is wrong with a mesh.

use std::path::{Path, PathBuf};

use clap::Subcommand;
use frazil::base::TriMesh;
use frazil::base::faults::Faults;
use frazil::base::topology::Topology;
use frazil::motion::{Character, is_gltf};
use serde_json::{Value, json};

use super::exit::{Failure, Phase};
use super::options::MeshSpace;
use super::output;
use super::session::Session;

/// Look at meshes.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  frazil mesh check boot.obj")]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Check(CheckArgs),
}

/// Say whether meshes bound a solid, and what keeps them from it; characters in their pose at rest.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  frazil mesh check boot.obj box.obj --json")]
struct CheckArgs {
    /// Meshes (.obj, .ply, .stl) and characters (.glb, .gltf).
    #[arg(required = true)]
    files: Vec<PathBuf>,
    #[command(flatten)]
    space: MeshSpace,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args, session: &Session) -> Result<(), Failure> {
    let Command::Check(args) = &args.command;
    let mut all = Vec::new();
    for path in &args.files {
        let mesh = args.read(path).before()?;
        let faults = session.ctx.phase("faults", || Ok(Faults::of(&mesh))).during()?;
        let size = mesh.bounds().map(|(low, high)| <[f32; 3]>::from(high - low));
        all.push(json!({
            "file": path.display().to_string(),
            "solid": faults.is_solid(),
            "vertices": mesh.positions.len(),
            "triangles": mesh.triangles.len(),
            "size_m": size,
            "area_m2": mesh.area(),
            "volume_m3": mesh.volume(),
            "parts": faults.parts,
            "genus": faults.genus,
            "holes": faults.holes,
            "open_edges": faults.open_edges,
            "crowded_edges": faults.crowded_edges,
            "turned_edges": faults.turned_edges,
            "pinched_vertices": faults.pinched_vertices,
            "embedded": faults.is_embedded(),
            "crossings": faults.crossings,
            "corner_crossings": faults.corner_crossings,
            "folds": faults.folds,
            "overlaps": faults.overlaps,
            "touches": faults.touches,
            "degenerate_triangles": faults.degenerate,
            "doubled_triangles": faults.doubled_triangles,
            "doubled_vertices": faults.doubled_vertices,
            "unused_vertices": faults.unused_vertices,
            "by_index": by_index(&faults.by_index),
        }));
    }
    let text = if args.json { format!("{:#}\n", json!(all)) } else { all.iter().map(in_words).collect() };
    output::print(&text).during()
}

impl CheckArgs {
    fn read(&self, path: &Path) -> frazil::Result<TriMesh> {
        if !is_gltf(path) {
            return self.space.read(path);
        }
        let (mut mesh, space) = (Character::at_rest(path)?, self.space.space());
        mesh.positions.iter_mut().for_each(|p| *p = space.place(p.cast()).cast());
        Ok(mesh)
    }
}

/// What of the mesh's topology hangs on vertices as the file has them.
fn by_index(topology: &Topology) -> Value {
    json!({
        "watertight": topology.is_watertight(),
        "open_edges": topology.open_edges,
        "crowded_edges": topology.crowded_edges,
        "turned_edges": topology.turned_edges,
        "pinched_vertices": topology.pinched_vertices,
        "collapsed_triangles": topology.collapsed_triangles,
        "doubled_triangles": topology.doubled_triangles,
    })
}

/// Edges and vertices at fault, joined by place or by index, in words.
const JOINTS: [(&str, &str); 4] = [
    ("open_edges", "edges with one triangle"),
    ("crowded_edges", "edges with more than two triangles"),
    ("turned_edges", "edges whose triangles disagree about which side is out"),
    ("pinched_vertices", "vertices whose triangles form no single fan"),
];

/// A mesh in words: what it is, then only the faults that it has.
fn in_words(mesh: &Value) -> String {
    let count = |key: &str| mesh[key].as_u64().unwrap_or(0);
    let as_it_is = |key: &str| mesh["by_index"][key].as_u64().unwrap_or(0);
    let what = match (mesh["solid"] == json!(true), as_it_is("open_edges")) {
        (false, _) => "not a solid as it is",
        (true, 0) => "a solid",
        (true, _) => "a solid, once vertices at one place are joined",
    };
    let mut out = format!(
        "{}: {}\n  {} vertices, {} triangles, {} parts",
        mesh["file"].as_str().unwrap_or_default(),
        what,
        count("vertices"),
        count("triangles"),
        count("parts"),
    );
    if let Some(genus) = mesh["genus"].as_i64() {
        out += &format!(", genus {genus}");
    }
    if let Some(size) = mesh["size_m"].as_array() {
        let size: Vec<String> = size.iter().map(|v| format!("{:.4}", v.as_f64().unwrap_or(0.0))).collect();
        out += &format!("\n  {} m, ", size.join(" x "));
    }
    let number = |key: &str| mesh[key].as_f64().unwrap_or(0.0);
    out += &format!("area {:.6} m2, volume {:.6} m3\n", number("area_m2"), number("volume_m3"));
    let holes = [("holes", "holes: closed by cones to their centres")];
    let faults = [
        ("crossings", "pairs of triangles cut each other: harmless, what lies in any part is inside"),
        ("corner_crossings", "pairs of triangles with a common corner cut each other: harmless, too"),
        ("folds", "pairs of triangles are folded onto each other along their common edge"),
        ("overlaps", "pairs of triangles lie on each other in one plane"),
        ("touches", "pairs of triangles touch beyond their common corners"),
        ("degenerate_triangles", "triangles without area: ignored"),
        ("doubled_triangles", "triangles with the corners of another"),
        ("doubled_vertices", "vertices at the place of another: joined"),
        ("unused_vertices", "vertices that no triangle names: ignored"),
    ];
    for (key, meaning) in holes.into_iter().chain(JOINTS).chain(faults).filter(|(key, _)| count(key) > 0) {
        out += &format!("  {:>8} {meaning}\n", count(key));
    }
    // What joining by place hides.
    for (key, meaning) in JOINTS.into_iter().filter(|(key, _)| ![0, count(key)].contains(&as_it_is(key))) {
        out += &format!("  {:>8} {meaning}, by the vertices' indices\n", as_it_is(key));
    }
    if number("volume_m3") < 0.0 {
        out += "           inside out: flipped where it is used\n";
    }
    out
}
