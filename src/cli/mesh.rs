//! `frazil mesh`: what is wrong with a mesh.

use std::path::{Path, PathBuf};

use clap::Subcommand;
use frazil::base::TriMesh;
use frazil::base::faults::Faults;
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
            "crossings": faults.crossings,
            "degenerate_triangles": faults.degenerate,
            "doubled_triangles": faults.doubled_triangles,
            "doubled_vertices": faults.doubled_vertices,
            "unused_vertices": faults.unused_vertices,
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

/// A mesh in words: what it is, then only the faults that it has.
fn in_words(mesh: &Value) -> String {
    let count = |key: &str| mesh[key].as_u64().unwrap_or(0);
    let mut out = format!(
        "{}: {}\n  {} vertices, {} triangles, {} parts",
        mesh["file"].as_str().unwrap_or_default(),
        if mesh["solid"] == json!(true) { "a solid" } else { "not a solid as it is" },
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
    let faults = [
        ("holes", "holes: closed by cones to their centres"),
        ("open_edges", "edges with one triangle"),
        ("crowded_edges", "edges with more than two triangles"),
        ("turned_edges", "edges whose triangles disagree about which side is out"),
        ("crossings", "pairs of triangles cut each other: harmless, what lies in any part is inside"),
        ("degenerate_triangles", "triangles without area: ignored"),
        ("doubled_triangles", "triangles with the corners of another"),
        ("doubled_vertices", "vertices at the place of another: joined"),
        ("unused_vertices", "vertices that no triangle names: ignored"),
    ];
    for (key, meaning) in faults.into_iter().filter(|(key, _)| count(key) > 0) {
        out += &format!("  {:>8} {meaning}\n", count(key));
    }
    if number("volume_m3") < 0.0 {
        out += "           inside out: flipped where it is used\n";
    }
    out
}
