//! Everything that a scene with `[surface]` reads before its first frame.

pub(in crate::scene::surface) mod particle_times;
pub(in crate::scene::surface) mod sculpts;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::Surface;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::check::faults::Faults;
use crate::geometry::check::orientation::{Closing, Orientation};
use crate::geometry::mesh::attributes::{Number, On};
use crate::geometry::{DetailedMesh, MeshArray, TriMesh, mesh as base_mesh};
use crate::io::files::sequence::Pattern;
use crate::io::files::source;
use crate::io::mesh::{extension, parse_polygons_from};
use crate::io::records::input_hashes::InputHashes;
use crate::mesh_repair::{Prepared, Repaired, carry_attributes, repair};
use crate::scene::Scene;
use crate::surface::{Implicit, Isosurface, Particles, estimate_spacing, rough_spacing};
use particle_times::Liquid;

/// Arrays of input meshes that are dropped: each frame writes its own, or they are invalid once the mesh moves.
pub(super) const DROPPED_ARRAYS: [&str; 9] =
    ["vx", "vy", "vz", "delta", "flagged", "rebuilt", "nx", "ny", "nz"];
/// A spacing that differs from the estimate by more than this factor is probably a mistake.
const MAX_RATIO: f64 = 2.0;

/// Contents of a scene's files.
pub struct Inputs {
    /// The mesh at the first frame that has particles (m), with the data that it carries.
    pub mesh: Arc<DetailedMesh>,
    /// Detail retention of each vertex, 0 (fades as the parameters say) to 1 (never fades); empty: 0 everywhere.
    pub(super) detail_retention: Vec<f32>,
    /// Initial distance between particles (m).
    pub spacing: f64,
    /// The first frame of the shot that has particles; those before it have no mesh.
    pub begins: i32,
    /// The particles at that frame.
    pub particles: Particles,
    /// Frames at which an edited mesh replaces the tracked one, ascending.
    pub(super) sculpts: Vec<i32>,
    /// Contents of the files when they were read.
    pub(in crate::scene) input_hashes: Arc<InputHashes>,
    /// Warnings about the files, one sentence each; they are logged too.
    pub warnings: Vec<String>,
}

impl Inputs {
    /// Reads the mesh and the particles of the first frame that has any, and warns if a file of a later frame is missing: the frames before
    /// it can still be made. Edited meshes of later frames are checked now, and read again at their frames.
    ///
    /// # Errors
    /// Errors in files or keys, with file and key; cancel.
    pub fn load(ctx: &Context, scene: &Scene) -> Result<Self> {
        let (surface, shot) = (scene.surface()?, scene.shot);
        if Pattern::parse(&surface.particles).is_none() && shot.frames.count() > 1 {
            let what = "is one file, which never moves: a shot needs a sequence such as spot.%04d.bgeo";
            return Err(Error::file(&surface.particles, what));
        }
        let sculpts = sculpts::frames(surface, shot.frames)?;
        let input_hashes = Arc::new(InputHashes::default());
        let (begins, particles) = first_particles(ctx, scene, surface, &input_hashes)?;
        let first = surface.files_at(shot.frames, begins).swap_remove(0);
        if particles.ids.is_empty() && particles.velocities.is_empty() && shot.frames.count() > 1 {
            let what =
                "has neither ids nor velocities (attributes id and v): where its particles go is not known";
            return Err(Error::file(first, what));
        }
        let mut warnings: Vec<String> = missing_file(scene, surface).into_iter().collect();
        if begins > shot.frames.first {
            warnings.push(format!(
                "frames {} to {} have no particles, and get empty meshes: the mesh is that of frame {begins}",
                shot.frames.first,
                begins - 1
            ));
        }
        if surface.every && !surface.rebuild {
            warnings.push(r#"surface.match = "every" does nothing where surface.rebuild is false"#.into());
        }
        let spacing = spacing_of(surface, &particles, &first, &mut warnings)?;
        // The mesh lies near the particles, and has 32-bit positions.
        let far = base_mesh::farthest(particles.positions.iter());
        let name = first.display().to_string();
        warnings.extend(base_mesh::too_far_warning(
            &name,
            far,
            1.0,
            surface.cell * spacing,
            base_mesh::BY_KEY,
        ));
        let mut mesh = match &surface.mesh {
            Some(path) => {
                let (mesh, warning) = read_mesh(ctx, surface, path, &input_hashes, spacing)?;
                warnings.extend(warning);
                mesh
            }
            None => {
                let mesh = particles_surface(ctx, &particles, spacing, surface.cell)
                    .map_err(|error| error.in_file(&first))?;
                DetailedMesh { mesh, ..DetailedMesh::default() }
            }
        };
        if surface.mesh.is_some() {
            warnings.extend(volume_warning(&mesh.mesh, particles.positions.len(), spacing));
        }
        let fades = surface.half_life.is_some() || surface.fade != 0.0;
        let detail_retention = match &surface.mesh {
            Some(path) if fades => detail_retention(&mesh).map_err(|what| Error::file(path, what))?,
            // A mesh that is rebuilt stores it in its states: detail may begin to fade at a later frame, by --from with other settings.
            Some(_) if surface.rebuild => detail_retention(&mesh).unwrap_or_default(),
            _ => Vec::new(),
        };
        mesh.arrays.retain(|array| !DROPPED_ARRAYS.contains(&&*array.name));
        let mesh = Arc::new(mesh);
        let mut inputs =
            Self { mesh, detail_retention, spacing, begins, particles, sculpts, input_hashes, warnings };
        let sculpt_warnings = sculpts::check(ctx, surface, &inputs)?;
        inputs.warnings.extend(sculpt_warnings);
        inputs.warnings.iter().for_each(|warning| log::warn!("{warning}"));
        Ok(inputs)
    }
}

/// The spacing (m) of the particles in the file `first`: that of the scene, or else an estimate. Adds a warning if it is estimated, or if
/// it differs much from the estimate.
///
/// # Errors
/// Particles that allow no estimate, and no spacing in the scene.
fn spacing_of(
    surface: &Surface,
    particles: &Particles,
    first: &Path,
    warnings: &mut Vec<String>,
) -> Result<f64> {
    let Some(spacing) = surface.spacing else {
        let what =
            "has too few particles, or too many at one position, to tell their spacing: give surface.spacing";
        let estimate = estimate_spacing(&particles.positions).ok_or_else(|| Error::file(first, what))?;
        warnings.push(format!(
            "{}: the spacing of the particles is estimated as {estimate:.6} m; surface.spacing sets it",
            first.display()
        ));
        return Ok(estimate);
    };
    let differs = |estimate: &f64| !(1.0 / MAX_RATIO..=MAX_RATIO).contains(&(spacing / estimate));
    if let Some(estimate) = rough_spacing(&particles.positions).filter(differs) {
        warnings.push(format!(
            "{}: surface.spacing is {spacing} m, but particles lie {estimate:.6} m apart",
            first.display()
        ));
    }
    Ok(spacing)
}

/// A mesh from a file, in metres, and closed if it is to be rebuilt; with a warning in a sentence.
///
/// # Errors
/// A file that cannot be read, or that has changed since it was read; a mesh to be rebuilt that encloses nothing; cancel.
pub(super) fn read_mesh(
    ctx: &Context,
    surface: &Surface,
    path: &Path,
    input_hashes: &InputHashes,
    spacing: f64,
) -> Result<(DetailedMesh, Option<String>)> {
    let bytes = input_hashes.read(path)?;
    // Unused vertices have no surface to follow.
    let mut mesh = parse_polygons_from(path, &bytes, surface.space.origin)?.into_detailed().without_unused();
    let space = surface.space;
    mesh.mesh.positions.iter_mut().for_each(|p| *p = space.vector(p.cast()).cast());
    let orientation = Orientation::of_mesh(&mesh.mesh, Closing::Caps);
    let mesh = orientation.applied_to_detailed(mesh);
    let doubts = || orientation.warning().map(|what| format!("{}: {what}", path.display()));
    if !surface.rebuild {
        let warning = faults(path, &mesh.mesh).or_else(doubts);
        return Ok((mesh, warning));
    }
    let (mesh, warning) =
        repaired_mesh(ctx, mesh, spacing * surface.cell).map_err(|error| error.in_file(path))?;
    Ok((mesh, warning.map(|warning| format!("{}: {warning}", path.display())).or_else(doubts)))
}

/// Detail retention, painted in the array `detail` of the vertices: shares 0..=1, or bytes 0 to 255.
pub(super) fn detail_retention(mesh: &DetailedMesh) -> std::result::Result<Vec<f32>, String> {
    let is_detail = |array: &&MeshArray| array.name == "detail" && array.on == On::Vertices;
    let Some(array) = mesh.arrays.iter().find(is_detail) else { return Ok(Vec::new()) };
    let whole = if array.number == Number::U8 { 255.0 } else { 1.0 };
    let shares: Vec<f32> = array.values.iter().map(|value| (value / whole) as f32).collect();
    match shares.iter().position(|share| !(0.0..=1.0).contains(share)) {
        Some(at) => Err(format!("detail of vertex {} is {}, not within 0 to 1", at + 1, shares[at])),
        None => Ok(shares),
    }
}

/// Every particle file that the shot reads, each once.
pub(super) fn all_files(scene: &Scene, surface: &Surface) -> Vec<PathBuf> {
    let frames = scene.shot.frames;
    let [from, to] = [frames.first, frames.last].map(|frame| surface.time(frames, frame));
    surface.files(from, to)
}

/// A warning, in a sentence, if the volume of a closed mesh is much less, or more, than that of its particles with a spacing (m). The
/// particles' own surface lies half a spacing above the outermost ones: for thin sheets and small drops it encloses more than the
/// particles' volume.
fn volume_warning(mesh: &TriMesh, particles: usize, spacing: f64) -> Option<String> {
    let (volume, liquid) = (mesh.volume(), particles as f64 * spacing.powi(3));
    let is_mismatch = volume < liquid / MAX_RATIO || volume > MAX_RATIO * liquid + mesh.area() * spacing;
    (mesh.is_closed() && is_mismatch).then(|| {
        format!(
            "the mesh holds {volume:.4} m3, and the first frame's {particles} particles {liquid:.4} m3: are both in the same unit?"
        )
    })
}

/// The first frame of the shot that has particles, and these particles.
///
/// # Errors
/// A file up to there that cannot be read; no frame of the shot has any; cancel.
fn first_particles(
    ctx: &Context,
    scene: &Scene,
    surface: &Surface,
    input_hashes: &InputHashes,
) -> Result<(i32, Particles)> {
    let frames = scene.shot.frames;
    let mut liquid = Liquid::new(surface, scene.shot, input_hashes);
    for frame in frames.first..=frames.last {
        ctx.check()?;
        let particles = liquid.at(surface.time(frames, frame))?;
        if !particles.positions.is_empty() {
            return Ok((frame, Particles::clone(&particles)));
        }
    }
    let what = match frames.count() {
        1 => "holds no particles".into(),
        _ => format!("holds no particles at any frame of the shot, {frames}"),
    };
    Err(Error::file(&surface.particles, what))
}

/// A sentence that names a missing file of the shot, and the frames that can therefore not be made.
fn missing_file(scene: &Scene, surface: &Surface) -> Option<String> {
    let frames = scene.shot.frames;
    let missing_at = |frame: i32| {
        let before = frame.saturating_sub(1).max(frames.first);
        let files = surface.files(surface.time(frames, before), surface.time(frames, frame));
        files.into_iter().find_map(|path| Some((frame, source::open(&path).err()?)))
    };
    let (frame, error) = (frames.first..=frames.last).find_map(missing_at)?;
    Some(format!("{error}: frame {frame} and those after it cannot be made"))
}

/// The particles' own surface.
fn particles_surface(ctx: &Context, particles: &Particles, spacing: f64, cell: f64) -> Result<TriMesh> {
    let phi = Implicit::new(ctx, &particles.positions, spacing, cell * spacing)?;
    Ok(Isosurface::new(&phi).mesh(&phi))
}

/// The mesh made ready for rebuilding: a closed 2-manifold by index without self-intersections, repaired in cells with this edge (m) if
/// necessary; and a sentence about the repair.
fn repaired_mesh(ctx: &Context, mesh: DetailedMesh, cell: f64) -> Result<(DetailedMesh, Option<String>)> {
    let faults = ctx.pool().install(|| Faults::of(&mesh.mesh));
    let crossings = faults.crossings + faults.corner_crossings + faults.folds + faults.overlaps;
    let is_closed = faults.by_index.is_watertight();
    let is_outward = faults.volume > 0.0 && faults.inverted_parts == 0;
    if is_closed && is_outward && crossings == 0 {
        return Ok((mesh, None));
    }
    let repaired = repair(ctx, &mesh.mesh, cell)?;
    let report = &repaired.report;
    let warning = if is_only_joined(&mesh.mesh, &repaired) {
        let joined = report.prepared.joined_vertices;
        log::info!("{joined} vertices are joined with others that are the same corners");
        None
    } else {
        let fault = match (is_closed, is_outward) {
            (false, _) => Some("is not closed as its indices connect it"),
            (true, false) => Some("is inside out in parts"),
            (true, true) => None,
        };
        let what: Vec<&str> = fault.into_iter().chain((crossings > 0).then_some("crosses itself")).collect();
        let lost = report.losses.warning(report.cell).map_or(String::new(), |lost| format!("; {lost}"));
        Some(format!(
            "it {}: it was repaired, as `frazil mesh repair --cell {:.6}` does; {} of {} triangles are as they were \
             (surface.rebuild = false follows it as it is){lost}",
            what.join(" and "),
            report.cell,
            report.kept_triangles,
            mesh.mesh.triangles.len(),
        ))
    };
    let detail = carry_attributes(&mesh, repaired.mesh, &repaired.vertices, &repaired.sources, None);
    Ok((detail, warning))
}

/// Whether a repair only joined vertices that are one corner: the mesh was triangle soup, and closed.
fn is_only_joined(mesh: &TriMesh, Repaired { report, .. }: &Repaired) -> bool {
    let joined = Prepared { joined_vertices: report.prepared.joined_vertices, ..Prepared::default() };
    report.prepared == joined && report.rebuilt_cells == 0 && report.kept_triangles == mesh.triangles.len()
}

/// A warning about faults of a mesh that affect tracking.
fn faults(path: &Path, mesh: &TriMesh) -> Option<String> {
    // The corners of .stl files are not shared vertices: each triangle would move on its own.
    if extension(path) == "stl" {
        return Some(format!(
            "{}: .stl files do not say which triangles share their corners: a .ply or .obj file follows better",
            path.display()
        ));
    }
    let faults = Faults::of(mesh);
    let open = (faults.open_edges > 0).then(|| format!("{} open edges", faults.open_edges));
    let crossings = faults.crossings + faults.corner_crossings + faults.folds;
    let crossed = (crossings > 0).then(|| format!("{crossings} pairs of triangles that cross"));
    let what: Vec<String> = open.into_iter().chain(crossed).collect();
    (!what.is_empty()).then(|| {
        format!(
            "{}: has {}: it follows as it is, but nothing says there what is inside (`frazil mesh check`)",
            path.display(),
            what.join(" and ")
        )
    })
}
