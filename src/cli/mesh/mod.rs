//! `frazil mesh`: checks meshes and changes them; one file for each command.

mod compare;
mod compared_mesh;
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
use super::session::{Failure, OrFailure, Session};

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
        let mesh = args.read(path).or_refuse()?;
        warn_if_far(path, &mesh);
        let faults = session.ctx.phase("faults", || Ok(Faults::of(&mesh))).or_fail()?;
        let bodies = session.ctx.phase("bodies", || Ok(Body::all(&mesh, &faults))).or_fail()?;
        if args.json {
            all.push(report(path, &mesh, &faults, &bodies));
        } else {
            output::print(&in_words(path, &mesh, &faults, &bodies)).or_fail()?;
        }
    }
    if args.json { output::print(&format!("{:#}\n", json!(all))).or_fail() } else { Ok(()) }
}

impl CheckArgs {
    fn read(&self, path: &Path) -> frazil::Result<TriMesh> {
        if !is_gltf(path) {
            return self.space.read(path);
        }
        let mut mesh = Character::at_rest_from(path, self.space.origin.at)?;
        self.space.convert(&mut mesh);
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
        "crowded_edges": faults.non_manifold_edges,
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
        "crowded_edges": topology.non_manifold_edges,
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
        let is_single = bodies.len() == 1;
        let body = |mesh: TriMesh| {
            let faults = if is_single { faults.clone() } else { Faults::of(&mesh) };
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

/// The meshes of the bodies of a mesh.
fn bodies(mesh: &TriMesh) -> Vec<TriMesh> {
    let positions: Vec<DVec3> = mesh.positions.iter().map(|position| position.cast()).collect();
    let same = Weld::of(&positions, &mesh.triangles).firsts;
    let joined = mesh.triangles.iter().map(|corners| corners.map(|vertex| same[vertex as usize]));
    let position = |vertex: u32| mesh.positions[vertex as usize];
    let triangles: Vec<[u32; 3]> = joined.filter(|corners| !is_flat(&corners.map(position))).collect();
    let component = |body: Vec<u32>| {
        let corners: Vec<[u32; 3]> = body.iter().map(|triangle| triangles[*triangle as usize]).collect();
        let mut vertices = corners.as_flattened().to_vec();
        vertices.sort_unstable();
        vertices.dedup();
        let number = |vertex: u32| vertices.partition_point(|other| *other < vertex) as u32;
        TriMesh {
            positions: vertices.iter().map(|&vertex| position(vertex)).collect(),
            triangles: corners.iter().map(|corners| corners.map(number)).collect(),
        }
    };
    topology::components(&triangles).into_iter().map(component).collect()
}

/// The nouns of faults, singular and plural.
type Nouns<const N: usize> = [[&'static str; 2]; N];

const PARTS: Nouns<2> = [
    ["hole: closed by a cone to its centre", "holes: closed by cones to their centres"],
    [
        "part is inside out: it is turned outward where the mesh is used",
        "parts are inside out: they are turned outward where the mesh is used",
    ],
];

/// Faulty edges and vertices, joined by position or by index.
const JOINED: Nouns<4> = [
    ["edge with one triangle", "edges with one triangle"],
    [
        "non-manifold edge: it has more than two triangles",
        "non-manifold edges: they have more than two triangles",
    ],
    [
        "inconsistently oriented edge: its triangles disagree about which side is out",
        "inconsistently oriented edges: their triangles disagree about which side is out",
    ],
    [
        "non-manifold vertex: its triangles form no single fan",
        "non-manifold vertices: their triangles form no single fan",
    ],
];

const TRIANGLES: Nouns<11> = [
    [
        "pair of triangles that cut each other: harmless only where both are right side out",
        "pairs of triangles that cut each other: harmless only where both are right side out",
    ],
    [
        "pair of triangles with a common corner that cut each other: harmless only where both are right side out",
        "pairs of triangles with a common corner that cut each other: harmless only where both are right side out",
    ],
    [
        "pair of triangles folded onto each other along their common edge",
        "pairs of triangles folded onto each other along their common edges",
    ],
    [
        "pair of triangles that lie on each other in one plane",
        "pairs of triangles that lie on each other in one plane",
    ],
    [
        "pair of triangles that touch beyond common corners",
        "pairs of triangles that touch beyond common corners",
    ],
    ["triangle without area: ignored", "triangles without area: ignored"],
    ["triangle with the corners of another", "triangles with the corners of another"],
    ["vertex at the position of another: joined", "vertices at the position of another: joined"],
    [
        "vertex on an open edge within rounding of another: joined",
        "vertices on open edges within rounding of others: joined",
    ],
    [
        "vertex on an open edge within rounding of others: it is not clear to which it belongs",
        "vertices on open edges within rounding of others: it is not clear which belong together",
    ],
    ["vertex that no triangle refers to: ignored", "vertices that no triangle refers to: ignored"],
];

/// A mesh as text: what it is, then only the faults that it has.
fn in_words(path: &Path, mesh: &TriMesh, faults: &Faults, bodies: &[Body]) -> String {
    let by_index = &faults.by_index;
    let what = match (faults.is_solid(), by_index.open_edges) {
        (false, _) => "not a solid as it is",
        (true, 0) => "a solid",
        (true, _) if faults.near_vertices > 0 => {
            "a solid, once vertices within rounding of one position are joined"
        }
        (true, _) => "a solid, once vertices at one position are joined",
    };
    let [vertices, triangles, parts] = [
        (mesh.positions.len(), ["vertex", "vertices"]),
        (mesh.triangles.len(), ["triangle", "triangles"]),
        (faults.parts, ["part", "parts"]),
    ]
    .map(|(count, nouns)| format!("{count} {}", noun(count, nouns)));
    let mut out = format!("{}: {what}\n  {vertices}, {triangles}, {parts}", path.display());
    if let Some(genus) = faults.genus {
        out += &format!(", genus {genus}");
    }
    if let Some((low, high)) = mesh.bounds() {
        let [x, y, z] = (high - low).into();
        out += &format!("\n  {x:.4} x {y:.4} x {z:.4} m, ");
    }
    // If the parts' volumes cancel, the rest is rounding.
    let is_rounding = faults.volume.abs() < 1e-9 * faults.area * faults.area.sqrt();
    let (area, volume) = (faults.area, if is_rounding { 0.0 } else { faults.volume });
    out += &format!("area {area:.6} m2, volume {volume:.6} m3\n");
    out += &bodies_in_words(bodies);
    let joined_counts =
        [faults.open_edges, faults.non_manifold_edges, faults.turned_edges, faults.non_manifold_vertices];
    let triangles = [
        faults.crossings,
        faults.corner_crossings,
        faults.folds,
        faults.overlaps,
        faults.touches,
        faults.degenerate,
        faults.doubled_triangles,
        faults.doubled_vertices,
        faults.near_vertices,
        faults.ambiguous_vertices,
        faults.unused_vertices,
    ];
    let parts = [faults.holes, faults.inverted_parts].into_iter().zip(PARTS);
    let all = parts.chain(joined_counts.into_iter().zip(JOINED)).chain(triangles.into_iter().zip(TRIANGLES));
    out.extend(all.filter(|(count, _)| *count > 0).map(|(count, nouns)| count_line(count, nouns)));
    // Faults hidden by joining vertices by position.
    let as_it_is = [
        by_index.open_edges,
        by_index.non_manifold_edges,
        by_index.turned_edges,
        by_index.non_manifold_vertices,
    ];
    for ((count, joined), nouns) in as_it_is.into_iter().zip(joined_counts).zip(JOINED) {
        if count > 0 && count != joined {
            out += &format!("  {count:>8} {}, by the vertices' indices\n", noun(count, nouns));
        }
    }
    if volume < 0.0 {
        out += "           inside out: turned outward where it is used\n";
    }
    out
}

/// Maximum number of bodies listed in text.
const MAX_LISTED: usize = 8;

/// Several bodies, the largest first; the rest only as a count.
fn bodies_in_words(bodies: &[Body]) -> String {
    if bodies.len() < 2 {
        return String::new();
    }
    let mut order: Vec<&Body> = bodies.iter().collect();
    order.sort_by(|a, b| b.faults.area.total_cmp(&a.faults.area));
    let line = |Body { mesh, faults }: &&Body| {
        let count = mesh.triangles.len();
        let genus = faults.genus.map_or("open".to_string(), |genus| format!("genus {genus}"));
        let (area, volume) = (faults.area, faults.volume);
        let triangles = noun(count, ["triangle", "triangles"]);
        format!("  body: {count} {triangles}, {genus}, area {area:.6} m2, volume {volume:.6} m3\n")
    };
    let mut out: String = order.iter().take(MAX_LISTED).map(line).collect();
    if let Some(others) = bodies.len().checked_sub(MAX_LISTED).filter(|others| *others > 0) {
        out += &format!("  and {others} more {}\n", noun(others, ["body", "bodies"]));
    }
    out
}

/// A line with a count and its noun.
pub fn count_line(count: usize, nouns: [&'static str; 2]) -> String {
    format!("  {count:>8} {}\n", noun(count, nouns))
}

/// The noun for a count, singular or plural.
pub fn noun(count: usize, [one, several]: [&'static str; 2]) -> &'static str {
    if count == 1 { one } else { several }
}
