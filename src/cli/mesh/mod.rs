//! `frazil mesh`: checks meshes and changes them; one file for each command.

mod compare;
mod compared;
mod repair;

use std::path::{Path, PathBuf};

use clap::Subcommand;
use frazil::geometry::check::faults::Faults;
use frazil::geometry::check::predicates::is_flat;
use frazil::geometry::check::topology::{self, Topology};
use frazil::geometry::mesh::weld::Weld;
use frazil::geometry::{DVec3, TriMesh};
use frazil::motion::{Character, is_gltf};
use serde_json::{Value, json};

use super::options::{MeshSpace, warn_if_far};
use super::output;
use super::session::Session;
use super::session::exit::{Failure, Phase};

/// Check, compare and repair meshes.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  frazil mesh check boot.obj
  frazil mesh compare before.obj after.obj
  frazil mesh repair boot.obj -o solid.obj")]
pub struct Args {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    Check(CheckArgs),
    Compare(compare::Args),
    Repair(repair::Args),
}

/// Report whether meshes bound a solid, and if not, why; characters in their pose at rest.
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
    match &args.command {
        Command::Check(args) => check(args, session),
        Command::Compare(args) => compare::run(args, session),
        Command::Repair(args) => repair::run(args, session),
    }
}

fn check(args: &CheckArgs, session: &Session) -> Result<(), Failure> {
    let mut all = Vec::new();
    for path in &args.files {
        let mesh = args.read(path).before()?;
        warn_if_far(path, &mesh);
        let faults = session.ctx.phase("faults", || Ok(Faults::of(&mesh))).during()?;
        let bodies = session.ctx.phase("bodies", || Ok(Body::all(&mesh, &faults))).during()?;
        let report = report(path, &mesh, &faults, &bodies);
        if args.json {
            all.push(report);
        } else {
            output::print(&in_words(&report)).during()?;
        }
    }
    if args.json { output::print(&format!("{:#}\n", json!(all))).during() } else { Ok(()) }
}

impl CheckArgs {
    fn read(&self, path: &Path) -> frazil::Result<TriMesh> {
        if !is_gltf(path) {
            return self.space.read(path);
        }
        let mut mesh = Character::at_rest_from(path, self.space.origin.at)?;
        self.space.bring(&mut mesh);
        Ok(mesh)
    }
}

/// The check of a mesh.
fn report(path: &Path, mesh: &TriMesh, faults: &Faults, bodies: &[Body]) -> Value {
    let size = mesh.bounds().map(|(low, high)| <[f32; 3]>::from(high - low));
    json!({
        "file": path.display().to_string(),
        "solid": faults.is_solid(),
        "vertices": mesh.positions.len(),
        "triangles": mesh.triangles.len(),
        "size_m": size,
        "area_m2": faults.area,
        "volume_m3": faults.volume,
        "parts": faults.parts,
        "inverted_parts": faults.inverted_parts,
        "genus": faults.genus,
        "holes": faults.holes,
        "open_edges": faults.open_edges,
        "crowded_edges": faults.crowded_edges,
        "turned_edges": faults.turned_edges,
        "non_manifold_vertices": faults.non_manifold_vertices,
        "embedded": faults.is_embedded(),
        "crossings": faults.crossings,
        "corner_crossings": faults.corner_crossings,
        "folds": faults.folds,
        "overlaps": faults.overlaps,
        "touches": faults.touches,
        "degenerate_triangles": faults.degenerate,
        "doubled_triangles": faults.doubled_triangles,
        "doubled_vertices": faults.doubled_vertices,
        "near_vertices": faults.near_vertices,
        "ambiguous_vertices": faults.ambiguous_vertices,
        "unused_vertices": faults.unused_vertices,
        "bodies": bodies.iter().map(Body::report).collect::<Value>(),
        "by_index": by_index(&faults.by_index),
    })
}

/// The part of the mesh's topology that depends on vertices as the file has them.
fn by_index(topology: &Topology) -> Value {
    json!({
        "watertight": topology.is_watertight(),
        "open_edges": topology.open_edges,
        "crowded_edges": topology.crowded_edges,
        "turned_edges": topology.turned_edges,
        "non_manifold_vertices": topology.non_manifold_vertices,
        "collapsed_triangles": topology.collapsed_triangles,
        "doubled_triangles": topology.doubled_triangles,
    })
}

/// A component: triangles with an area that are connected by edges, with vertices at one position joined.
struct Body {
    mesh: TriMesh,
    faults: Faults,
}

impl Body {
    /// The bodies of a mesh with these faults, in the order of their first triangles.
    fn all(mesh: &TriMesh, faults: &Faults) -> Vec<Self> {
        let bodies = bodies(mesh);
        let is_alone = bodies.len() == 1;
        let body = |mesh: TriMesh| {
            let faults = if is_alone { faults.clone() } else { Faults::of(&mesh) };
            Self { mesh, faults }
        };
        bodies.into_iter().map(body).collect()
    }

    fn report(&self) -> Value {
        let Self { mesh, faults } = self;
        let bounds = mesh.bounds().map(|(low, high)| [low, high].map(<[f32; 3]>::from));
        json!({
            "solid": faults.is_solid(),
            "triangles": mesh.triangles.len(),
            "genus": faults.genus,
            "holes": faults.holes,
            "embedded": faults.is_embedded(),
            "area_m2": faults.area,
            "volume_m3": faults.volume,
            "bounds_m": bounds,
        })
    }
}

/// See [`Body`].
fn bodies(mesh: &TriMesh) -> Vec<TriMesh> {
    let places: Vec<DVec3> = mesh.positions.iter().map(|place| place.cast()).collect();
    let same = Weld::of(&places, &mesh.triangles).firsts;
    let joined = mesh.triangles.iter().map(|corners| corners.map(|vertex| same[vertex as usize]));
    let place = |vertex: u32| mesh.positions[vertex as usize];
    let triangles: Vec<[u32; 3]> = joined.filter(|corners| !is_flat(&corners.map(place))).collect();
    let alone = |body: Vec<u32>| {
        let corners: Vec<[u32; 3]> = body.iter().map(|triangle| triangles[*triangle as usize]).collect();
        let mut vertices = corners.as_flattened().to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        let number = |vertex: u32| vertices.partition_point(|other| *other < vertex) as u32;
        TriMesh {
            positions: vertices.iter().map(|&vertex| place(vertex)).collect(),
            triangles: corners.iter().map(|corners| corners.map(number)).collect(),
        }
    };
    topology::bodies(&triangles).into_iter().map(alone).collect()
}

/// A key of the report, and the noun for its count, singular and plural.
pub type Counted = (&'static str, &'static str, &'static str);

const PARTS: [Counted; 2] = [
    ("holes", "hole: closed by a cone to its centre", "holes: closed by cones to their centres"),
    (
        "inverted_parts",
        "part is inside out: it is turned outward where the mesh is used",
        "parts are inside out: they are turned outward where the mesh is used",
    ),
];

/// Faulty edges and vertices, joined by position or by index.
const JOINTS: [Counted; 4] = [
    ("open_edges", "edge with one triangle", "edges with one triangle"),
    (
        "crowded_edges",
        "non-manifold edge: it has more than two triangles",
        "non-manifold edges: they have more than two triangles",
    ),
    (
        "turned_edges",
        "inconsistently oriented edge: its triangles disagree about which side is out",
        "inconsistently oriented edges: their triangles disagree about which side is out",
    ),
    (
        "non_manifold_vertices",
        "non-manifold vertex: its triangles form no single fan",
        "non-manifold vertices: their triangles form no single fan",
    ),
];

const TRIANGLES: [Counted; 11] = [
    (
        "crossings",
        "pair of triangles cuts each other: harmless only where both are right side out",
        "pairs of triangles cut each other: harmless only where both are right side out",
    ),
    (
        "corner_crossings",
        "pair of triangles with a common corner cuts each other: harmless only where both are right side out",
        "pairs of triangles with a common corner cut each other: harmless only where both are right side out",
    ),
    (
        "folds",
        "pair of triangles is folded onto each other along its common edge",
        "pairs of triangles are folded onto each other along their common edges",
    ),
    (
        "overlaps",
        "pair of triangles lies on each other in one plane",
        "pairs of triangles lie on each other in one plane",
    ),
    (
        "touches",
        "pair of triangles touches beyond common corners",
        "pairs of triangles touch beyond common corners",
    ),
    ("degenerate_triangles", "triangle without area: ignored", "triangles without area: ignored"),
    ("doubled_triangles", "triangle with the corners of another", "triangles with the corners of another"),
    (
        "doubled_vertices",
        "vertex at the position of another: joined",
        "vertices at the position of another: joined",
    ),
    (
        "near_vertices",
        "vertex on an open edge within rounding of another: joined",
        "vertices on open edges within rounding of others: joined",
    ),
    (
        "ambiguous_vertices",
        "vertex on an open edge within rounding of others: which of them it is is not clear",
        "vertices on open edges within rounding of others: which of them are one is not clear",
    ),
    ("unused_vertices", "vertex that no triangle names: ignored", "vertices that no triangle names: ignored"),
];

/// A mesh as text: what it is, then only the faults that it has.
fn in_words(mesh: &Value) -> String {
    let count = |key: &str| mesh[key].as_u64().unwrap_or(0);
    let as_it_is = |key: &str| mesh["by_index"][key].as_u64().unwrap_or(0);
    let what = match (mesh["solid"] == json!(true), as_it_is("open_edges")) {
        (false, _) => "not a solid as it is",
        (true, 0) => "a solid",
        (true, _) if count("near_vertices") > 0 => {
            "a solid, once vertices within rounding of one position are joined"
        }
        (true, _) => "a solid, once vertices at one position are joined",
    };
    let [vertices, triangles, parts] = [
        ("vertices", ["vertex", "vertices"]),
        ("triangles", ["triangle", "triangles"]),
        ("parts", ["part", "parts"]),
    ]
    .map(|(key, forms)| format!("{} {}", count(key), form(count(key), forms)));
    let file = mesh["file"].as_str().unwrap_or_default();
    let mut out = format!("{file}: {what}\n  {vertices}, {triangles}, {parts}");
    if let Some(genus) = mesh["genus"].as_i64() {
        out += &format!(", genus {genus}");
    }
    if let Some(size) = mesh["size_m"].as_array() {
        let size: Vec<String> = size.iter().map(|v| format!("{:.4}", v.as_f64().unwrap_or(0.0))).collect();
        out += &format!("\n  {} m, ", size.join(" x "));
    }
    let number = |key: &str| mesh[key].as_f64().unwrap_or(0.0);
    let (area, volume) = (number("area_m2"), number("volume_m3"));
    // If the parts' volumes cancel, the rest is rounding.
    let is_rounding = volume.abs() < 1e-9 * area * area.sqrt();
    let volume = if is_rounding { 0.0 } else { volume };
    out += &format!("area {area:.6} m2, volume {volume:.6} m3\n");
    out += &bodies_in_words(mesh["bodies"].as_array().map_or(&[][..], Vec::as_slice));
    for (key, one, several) in [&PARTS[..], &JOINTS, &TRIANGLES].concat() {
        if count(key) > 0 {
            out += &line(count(key), [one, several]);
        }
    }
    // Faults hidden by joining vertices by position.
    for (key, one, several) in
        JOINTS.into_iter().filter(|(key, ..)| ![0, count(key)].contains(&as_it_is(key)))
    {
        let (count, noun) = (as_it_is(key), form(as_it_is(key), [one, several]));
        out += &format!("  {count:>8} {noun}, by the vertices' indices\n");
    }
    if volume < 0.0 {
        out += "           inside out: turned outward where it is used\n";
    }
    out
}

/// Maximum number of bodies listed in text.
const TOLD: usize = 8;

/// Several bodies, the largest first; the rest only as a count.
fn bodies_in_words(bodies: &[Value]) -> String {
    if bodies.len() < 2 {
        return String::new();
    }
    let mut order: Vec<&Value> = bodies.iter().collect();
    let area = |body: &Value| body["area_m2"].as_f64().unwrap_or(0.0);
    order.sort_by(|&a, &b| area(b).total_cmp(&area(a)));
    let line = |&body: &&Value| {
        let count = body["triangles"].as_u64().unwrap_or(0);
        let genus = body["genus"].as_i64().map_or("open".to_string(), |genus| format!("genus {genus}"));
        let (area, volume) = (area(body), body["volume_m3"].as_f64().unwrap_or(0.0));
        let triangles = form(count, ["triangle", "triangles"]);
        format!("  body: {count} {triangles}, {genus}, area {area:.6} m2, volume {volume:.6} m3\n")
    };
    let mut out: String = order.iter().take(TOLD).map(line).collect();
    if let Some(others) = bodies.len().checked_sub(TOLD).filter(|others| *others > 0) {
        out += &format!("  and {others} more {}\n", form(others as u64, ["body", "bodies"]));
    }
    out
}

/// A line with a count and its noun.
pub fn line(count: u64, forms: [&'static str; 2]) -> String {
    format!("  {count:>8} {}\n", form(count, forms))
}

/// The noun for a count, singular or plural.
pub fn form(count: u64, [one, several]: [&'static str; 2]) -> &'static str {
    if count == 1 { one } else { several }
}
