//! `frazil mesh repair`: makes solids of meshes that are open, intersect themselves or are inside out in parts.

use std::path::{Path, PathBuf};

use frazil::geometry::{DVec3, DetailedMesh, TriMesh};
use frazil::io;
use frazil::io::files::sequence::Pattern;
use frazil::io::usd;
use frazil::mesh_repair::{Prepared, Repaired, carry_attributes, repair};
use frazil::motion::{Character, is_gltf};
use frazil::scene::FrameChoice;
use frazil::{Error, Result};
use serde_json::{Value, json};

use super::{count_line, noun};
use crate::cli::convert::{Losses, MeshFile, VELOCITY, check_output, prim_name};
use crate::cli::options::{
    MeshSpace, frame_path, needs_frames, one_frame, positive, refuse_one_file, warn_if_far,
};
use crate::cli::output;
use crate::cli::session::{Failure, OrFailure, Session};

/// Make solids of meshes that are open, intersect themselves, or are inside out in parts.
///
/// With each part turned outward, the solid is the set of points inside at least one part: overlapping parts become one, and cavities
/// are filled. The mesh is rebuilt in the cells of a grid where it is faulty; all other triangles stay as they are, with their
/// attributes. The output is in metres, with Y up.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  frazil mesh repair boot.obj -o solid.obj
  frazil mesh repair boot.obj -o solid.ply --cell 0.01 --json
  frazil mesh repair body.%04d.obj -o solid.%04d.ply --frames 1-2")]
pub struct Args {
    /// Mesh (.obj, .ply, .stl), character at rest (.glb, .gltf), or a sequence of meshes (body.%04d.obj).
    input: PathBuf,
    /// File to write (.obj, .ply, .stl, .usda), or a pattern of files.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Edge of the cells (m) [default: the median edge of the first mesh, but between a 400th and a 40th of its longest side].
    #[arg(long, value_name = "M", value_parser = positive)]
    cell: Option<f64>,
    /// Frames of a sequence; each mesh is repaired by itself.
    #[arg(long, value_name = "A-B|A-BxN", allow_hyphen_values = true)]
    frames: Option<FrameChoice>,
    /// Frames per second, for .usda.
    #[arg(long, default_value = "24", value_parser = positive)]
    fps: f64,
    #[command(flatten)]
    space: MeshSpace,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Runs the command.
pub fn run(args: &Args, session: &Session) -> std::result::Result<(), Failure> {
    check_output(&args.output)?;
    let frames = args.frames()?;
    output::check_writable(&args.output).or_refuse()?;
    for frame in frames.iter() {
        let from = frame_path(&args.input, frame);
        // Report a gap in a sequence before any work.
        io::files::source::open(&from).or_refuse()?;
        output::refuse_input(&frame_path(&args.output, frame), [from.as_path()]).or_refuse()?;
    }
    let mut chosen = args.cell.map(Cell::given);
    let mut reports: Vec<Value> = Vec::new();
    for frame in frames.iter() {
        session.ctx.check().or_fail()?;
        let (from, to) = (frame_path(&args.input, frame), frame_path(&args.output, frame));
        let detail = args.read(&from);
        // Fail early if the first file cannot be repaired.
        let detail = if reports.is_empty() { detail.or_refuse()? } else { detail.or_fail()? };
        if reports.is_empty() {
            args.warn_of_losses(&from, &detail).or_refuse()?;
        }
        let cell = *chosen.get_or_insert_with(|| Cell::of(&detail.mesh));
        let repaired = match repaired(session, &from, &detail.mesh, cell.edge) {
            Err(error @ Error::File { .. }) if reports.is_empty() => return Err(Failure::refused(error)),
            repaired => repaired.or_fail()?,
        };
        if let Some(what) = warning(&repaired) {
            log::warn!("{}: {what}", from.display());
        }
        let words = (!args.json).then(|| in_words(&from, &to, &detail.mesh, &repaired, cell));
        let mut report = report(&detail.mesh, &repaired, cell);
        report["file"] = json!(from.display().to_string());
        report["output"] = json!(to.display().to_string());
        if args.frames.is_some() {
            report["frame"] = json!(frame);
        }
        let detail = if is_unchanged(&detail.mesh, &repaired) {
            detail
        } else {
            let Repaired { mesh, vertices, sources, .. } = repaired;
            let carry = || Ok(carry_attributes(&detail, mesh, &vertices, &sources, None));
            session.ctx.phase("carry", carry).or_fail()?
        };
        args.write(&to, frame, &detail).or_fail()?;
        if let Some(words) = words {
            output::print(&words).or_fail()?;
        }
        reports.push(report);
    }
    session.record("meshes", json!(reports));
    if !args.json {
        return Ok(());
    }
    let all =
        if args.frames.is_some() { json!(reports) } else { reports.into_iter().next().unwrap_or_default() };
    output::print(&format!("{all:#}\n")).or_fail()
}

/// The error for a mesh that encloses nothing.
const NOTHING: &str = "nothing in the mesh encloses a volume";

/// Repairs the mesh of a file.
fn repaired(session: &Session, path: &Path, mesh: &TriMesh, cell: f64) -> Result<Repaired> {
    if cell <= 0.0 {
        return Err(Error::file(path, NOTHING));
    }
    #[cfg(feature = "vdb")]
    session.ctx.set_memory_limit(session.max_memory());
    repair(&session.ctx, mesh, cell).map_err(|error| error.in_file(path))
}

/// Warnings about a repair: what is lost, and ambiguous corners.
fn warning(repaired: &Repaired) -> Option<String> {
    let report = &repaired.report;
    let count = report.prepared.ambiguous_vertices;
    let unclear = format!(
        "{count} corners on open edges lie within rounding of others, but it is not clear which belong together: they are left as they are"
    );
    let all: Vec<String> =
        (count > 0).then_some(unclear).into_iter().chain(report.losses.warning(report.cell)).collect();
    (!all.is_empty()).then(|| all.join("; "))
}

/// Whether a mesh needed no repair.
fn is_unchanged(mesh: &TriMesh, repaired: &Repaired) -> bool {
    let count = mesh.triangles.len();
    let Repaired { mesh: after, report, .. } = repaired;
    report.prepared == Prepared::default()
        && report.rebuilt_cells == 0
        && report.kept_triangles == count
        && after.triangles.len() == count
}

/// The edge of the cells, and its reason.
#[derive(Clone, Copy)]
struct Cell {
    /// Edge (m); 0 for a mesh without any extent.
    edge: f64,
    /// The reason for that edge.
    reason: &'static str,
}

/// Minimum and maximum cell, as fractions of a mesh's longest side.
const CELL_FRACTIONS: [f64; 2] = [400.0, 40.0];

impl Cell {
    fn given(edge: f64) -> Self {
        Self { edge, reason: "" }
    }

    /// The default for a mesh, rounded to three digits, so that the printed value can be passed as an option.
    fn of(mesh: &TriMesh) -> Self {
        let mut lengths = Vec::with_capacity(3 * mesh.triangles.len());
        let (mut low, mut high) = (DVec3::repeat(f64::INFINITY), DVec3::repeat(f64::NEG_INFINITY));
        for triangle in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(triangle);
            lengths.extend([b - a, c - b, a - c].map(|edge| edge.norm()));
            low = low.inf(&a).inf(&b).inf(&c);
            high = high.sup(&a).sup(&b).sup(&c);
        }
        if lengths.is_empty() {
            return Self::given(0.0);
        }
        let middle = lengths.len() / 2;
        let median = *lengths.select_nth_unstable_by(middle, f64::total_cmp).1;
        let [min, max] = CELL_FRACTIONS.map(|part| (high - low).amax() / part);
        let (edge, reason) = if median < min {
            (min, ", a 400th of the longest side")
        } else if median > max {
            (max, ", a 40th of the longest side")
        } else {
            (median, ", the median edge")
        };
        Self { edge: format!("{edge:.2e}").parse().unwrap_or(edge), reason }
    }
}

impl Args {
    fn frames(&self) -> std::result::Result<FrameChoice, Failure> {
        match (Pattern::parse(&self.input), &self.frames) {
            (Some(_), None) => Err(needs_frames(&self.input)),
            (Some(_), Some(frames)) => {
                refuse_one_file(&self.output, frames, "solid.%04d.ply").map(|()| frames.clone())
            }
            (None, Some(_)) => Err(Failure::refused("--frames cannot be used with a single mesh")),
            (None, None) => Ok(one_frame()),
        }
    }

    fn keeps_space(&self) -> bool {
        self.space.space().keeps_vectors()
    }

    /// A mesh in metres with Y up, with its arrays; of a character only the mesh.
    fn read(&self, path: &Path) -> Result<DetailedMesh> {
        let mut detail = if is_gltf(path) {
            let mesh = Character::at_rest_from(path, self.space.origin.at)?;
            DetailedMesh { mesh, ..DetailedMesh::default() }
        } else {
            self.space.origin.read(path)?.into_detailed()
        };
        if !self.keeps_space() {
            self.space.convert(&mut detail.mesh);
            // Velocities are not converted to another space.
            detail.arrays.retain(|array| !VELOCITY.contains(&&*array.name));
        }
        warn_if_far(path, &detail.mesh);
        Ok(detail)
    }

    fn warn_of_losses(&self, path: &Path, detail: &DetailedMesh) -> Result<()> {
        let losses = Losses { output: &self.output, keeps_space: self.keeps_space(), is_sequence: false };
        losses.warn(path, detail.uvs.as_ref())
    }

    fn write(&self, path: &Path, frame: i32, detail: &DetailedMesh) -> Result<()> {
        let DetailedMesh { mesh, uvs, arrays } = detail;
        let (name, units) = (prim_name(&self.input), usd::Units::OWN);
        let file = MeshFile { path, name: &name, frame, fps: self.fps, units };
        file.write(mesh, uvs.as_ref(), arrays, |own| Ok(own.unwrap_or_default()))
    }
}

/// Report of a mesh's repair.
fn report(mesh: &TriMesh, repaired: &Repaired, cell: Cell) -> Value {
    let Repaired { mesh: after, report, .. } = repaired;
    let done = &report.prepared;
    json!({
        "solid_already": is_unchanged(mesh, repaired),
        "joined_vertices": done.joined_vertices,
        "dropped_triangles": done.dropped_triangles,
        "turned_triangles": done.turned_triangles,
        "turned_parts": done.turned_parts,
        "closed_holes": done.holes,
        "closing_triangles": done.added_triangles,
        "asked_cell_m": cell.edge,
        "cell_m": report.cell,
        "flagged_cells": report.flagged_cells,
        "rebuilt_cells": report.rebuilt_cells,
        "rung": report.rebuild_level,
        "triangles_before": mesh.triangles.len(),
        "kept_triangles": report.kept_triangles,
        "made_triangles": after.triangles.len() - report.kept_triangles,
        "triangles": after.triangles.len(),
        "slivers": report.slivers,
        "area_before_m2": report.losses.areas[0],
        "area_m2": report.losses.areas[1],
        "longest_side_before_m": report.losses.sides[0],
        "longest_side_m": report.losses.sides[1],
        "lost": report.losses.warning(report.cell).is_some(),
        "ambiguous_vertices": done.ambiguous_vertices,
        "volume_before_m3": mesh.volume(),
        "volume_m3": after.volume(),
    })
}

/// What was done before rebuilding: nouns for the counts, singular and plural.
const PREPARATIONS: [[&str; 2]; 5] = [
    [
        "vertex joined with another that is the same corner",
        "vertices joined with others that are the same corners",
    ],
    [
        "triangle left out: without area, doubled, or alone",
        "triangles left out: without area, doubled, or alone",
    ],
    ["triangle turned to agree with its neighbours", "triangles turned to agree with their neighbours"],
    ["part turned outward", "parts turned outward"],
    ["hole closed", "holes closed"],
];

/// Texts for the rebuild levels: how far rebuilding extended beyond the faulty cells and those that they require.
const REBUILD_LEVELS: [&str; 4] = [
    "",
    ", with a ring around",
    ", with all of the parts that they touch",
    ", with all that the mesh passes through",
];

/// A repair as text: only what was done.
fn in_words(from: &Path, to: &Path, before: &TriMesh, repaired: &Repaired, cell: Cell) -> String {
    let Repaired { mesh: after, report, .. } = repaired;
    let (file, output) = (from.display(), to.display());
    if is_unchanged(before, repaired) {
        return format!("{file} is a solid already: written as it is\n");
    }
    let is_lost = report.losses.warning(report.cell).is_some();
    let what = if is_lost { "a solid now, but not all of it" } else { "a solid now" };
    let mut out = format!("{file}: {what}, in {output}\n");
    let done = &report.prepared;
    let counts =
        [done.joined_vertices, done.dropped_triangles, done.turned_triangles, done.turned_parts, done.holes];
    for (count, nouns) in counts.into_iter().zip(PREPARATIONS).filter(|(count, _)| *count > 0) {
        out += &count_line(count, nouns);
    }
    let (used, Cell { edge, reason }) = (report.cell, cell);
    let reason = if used < edge { format!(": {edge} m would have left nothing") } else { reason.to_string() };
    let extent = REBUILD_LEVELS.get(report.rebuild_level).copied().unwrap_or_default();
    out += &format!(
        "  cells of {used} m{reason}\n  {:>8} {} flagged, {} rebuilt{extent}\n",
        report.flagged_cells,
        noun(report.flagged_cells, ["cell", "cells"]),
        report.rebuilt_cells
    );
    let (kept, made) = (report.kept_triangles, after.triangles.len() - report.kept_triangles);
    out += &format!("  {kept:>8} of {} triangles kept, {made} made\n", before.triangles.len());
    if report.slivers > 0 {
        out += &count_line(report.slivers, ["of these is a sliver", "of these are slivers"]);
    }
    let (volume, after) = (before.volume(), after.volume());
    out + &format!("  volume {volume:.6} m3 before, {after:.6} m3 now\n")
}
