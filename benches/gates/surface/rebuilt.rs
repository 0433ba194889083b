//! Gates of a mesh that is rebuilt where the liquid merges and splits, over whole sequences: it is closed in every frame, it has the
//! liquid inside, and little of it is rebuilt.

use frazil::Context;
use frazil::geometry::check::topology::Topology;
use frazil::geometry::{DVec3, TriMesh};
use frazil::mesh_repair::Source;
use frazil::surface::{Change, Distances, Implicit, Isosurface, Sampler};

use crate::common::liquids::{context, own_surface};
use crate::harness::Harness;
use crate::surface::edit_history::History;
use crate::surface::rebuilt_sequences::{CELL, Frame, Sequence, dambreak, made, spot_drop, walk};
use crate::surface::windings::{depth_and_share, empty_parts, inside};
use crate::worst::Worst;

/// Least altitude of a triangle in the frame in which it was made (its longest edge).
const FLATTEST: f64 = 1e-4;
/// Frames of the caches from one look at the lattice to the next.
const LATTICE: usize = 5;
/// And from one look at the particles inside to the next: what is wrong for over two frames is seen.
const INSIDE: usize = 3;
/// So many particles that are outside of the mesh may be a cluster that it misses.
const CLUSTER: usize = 20;
/// How far distances from the particles' surface are known (cells), and how deep a particle is that must be inside (spacings).
const REACH: f32 = 5.0;
const DEEP: f64 = 1.0;
/// Which edges are as long as they should be (targets).
const EDGES: std::ops::RangeInclusive<f64> = 0.5..=1.5;

/// Of all sequences: frames at fault, rebuilt over flagged cells, changes that needed more than their cells.
const OF_ALL: &[&str] = &[
    "surface.rebuilt_valid",
    "surface.rebuilt_cells_median",
    "surface.rebuilt_cells_p99",
    "surface.rebuilt_levels",
];
/// Of all sequences, on the lattice.
const OF_LATTICE: &[&str] = &["surface.rebuilt_winding_depth", "surface.rebuilt_winding_volume"];
/// Of `spot_drop` and `dambreak`.
const OF_CACHES: &[&str] = &["surface.rebuilt_inside", "surface.rebuilt_empty", "surface.rebuilt_clusters"];
/// Of `spot_drop`.
const OF_SPOT: &[&str] = &["surface.rebuilt_alive", "surface.rebuilt_jump", "surface.rebuilt_volume"];
/// Of the made sets.
const OF_MADE: &[&str] = &["surface.rebuilt_quality_angle", "surface.rebuilt_quality_edges"];

pub fn run(h: &mut Harness) {
    let groups = [OF_ALL, OF_LATTICE, OF_CACHES, OF_SPOT, OF_MADE];
    let wanted @ [all, lattice, caches, spot, made_sets] =
        groups.map(|names| names.iter().any(|name| h.wants(name)));
    if wanted == [false; 5] {
        return;
    }
    let ctx = context(2);
    let mut tally = Tally::default();
    let mut missing = Vec::new();
    let of_cache = || Look {
        lattice: if lattice { LATTICE } else { 0 },
        inside: if caches { INSIDE } else { 0 },
        ..Look::default()
    };
    if all || lattice || caches || spot {
        match spot_drop() {
            Some(sequence) => {
                tally.follow(&ctx, &sequence, &Look { volumes: spot, ..of_cache() });
            }
            None => missing.push("spot_drop"),
        }
    }
    if all || lattice || caches {
        match dambreak(&ctx) {
            Some(sequence) => tally.follow(&ctx, &sequence, &of_cache()),
            None => missing.push("dambreak"),
        }
    }
    if all || lattice || made_sets {
        let look = Look { lattice: usize::from(lattice), shapes: made_sets, ..Look::default() };
        made(&ctx).iter().for_each(|sequence| tally.follow(&ctx, sequence, &look));
    }
    missing.iter().for_each(|name| println!("# {name} is skipped: no data"));
    let is_there = |group: usize| match group {
        2 => missing.len() < 2,
        3 => !missing.contains(&"spot_drop"),
        // Of the others the made sets are left.
        _ => true,
    };
    let results = tally.results(&missing);
    for (group, names) in groups.iter().enumerate() {
        for name in names.iter() {
            if !h.wants(name) {
                continue;
            }
            let result = results.iter().find(|result| result.0 == *name);
            match result.filter(|_| is_there(group)) {
                Some((_, value, note)) => h.gate(name, *value, note),
                None => h.skipped(name, "no data"),
            }
        }
    }
}

/// What is looked at in a sequence, besides what is in all of them.
#[derive(Default)]
struct Look {
    /// Frames from one look at the lattice to the next; 0: none.
    lattice: usize,
    /// Frames from one look at the particles inside to the next; 0: none.
    inside: usize,
    volumes: bool,
    /// Whether triangles that were made are well shaped.
    shapes: bool,
}

/// What was found.
#[derive(Default)]
struct Tally {
    names: Vec<&'static str>,
    frames: usize,
    /// Frames at fault.
    failures: usize,
    /// How deep positions are that the mesh surrounds neither once nor never (cells), and their share of its volume.
    depth: Worst,
    astray: Worst,
    /// Particles that must be inside of the mesh, and those that are.
    deep: [usize; 2],
    /// Parts of the mesh without a particle, in all frames that were looked at.
    empty: usize,
    /// Most particles that must be inside and are not, of a frame, and the frames with [`CLUSTER`] of them or more.
    outside: Worst,
    clusters: usize,
    /// Frames that were looked at so.
    looked: usize,
    /// Rebuilt over flagged cells of each change.
    shares: Vec<f64>,
    /// Changes by how much more than their cells they needed.
    rebuild_levels: [usize; 4],
    /// Percent.
    alive: f64,
    jump: Worst,
    drift: Worst,
    /// Least angles of triangles that were made (deg).
    angles: Vec<f64>,
    /// Their edges, those that are as long as they should be, and those that would be if all had the cell as their target.
    edges: [usize; 3],
}

impl Tally {
    fn follow(&mut self, ctx: &Context, sequence: &Sequence, look: &Look) {
        self.names.push(sequence.name);
        let mut history = History::new(sequence.mesh.positions.len(), &sequence.mesh.triangles);
        let over_phi = |mesh: &TriMesh, positions: &[DVec3]| {
            mesh.volume() / own_surface(ctx, positions, sequence.spacing).volume()
        };
        let begin = if look.volumes { over_phi(&sequence.mesh, &sequence.at(0).positions) } else { 1.0 };
        let ended = walk(ctx, sequence, |frame| {
            self.frames += 1;
            let title = || sequence.title(frame.index);
            let mesh = frame.tracker.mesh();
            let change = frame.report.change.as_ref();
            if let Some(change) = change {
                history.follow(change);
                self.count(change);
                if look.volumes {
                    self.jump.see(jump(frame, change), title);
                }
                if look.shapes {
                    self.shapes(&mesh, change, sequence.cell());
                }
            }
            let unsound = unsound(&mesh);
            let is_sound = unsound.is_none();
            if let Some(fault) = unsound.or_else(|| flat(&mesh, change)) {
                self.failures += 1;
                println!("# {}: {fault}", title());
            }
            if look.volumes {
                let drift = 100.0 * (over_phi(&mesh, &frame.particles.positions) / begin - 1.0).abs();
                self.drift.see(drift, title);
            }
            // Windings mean nothing where it is not closed.
            if is_sound && is_due(look.lattice, frame.index) {
                self.lattice(&mesh, sequence.cell(), title);
            }
            if is_sound && is_due(look.inside, frame.index) {
                self.inside(ctx, &mesh, &frame.particles.positions, sequence.spacing, title);
            }
        });
        if let Some(error) = ended {
            self.failures += 1;
            println!("# {error}");
        }
        if look.volumes {
            self.alive = history.alive();
        }
    }

    /// How much a change rebuilt.
    fn count(&mut self, change: &Change) {
        if change.rebuilt_cells > 0 {
            self.rebuild_levels[change.rebuild_level.min(3)] += 1;
        }
        if change.flagged_cells > 0 {
            self.shares.push(change.rebuilt_cells as f64 / change.flagged_cells as f64);
        }
    }

    /// Looks for positions of a lattice that the mesh surrounds neither once nor never.
    fn lattice(&mut self, mesh: &TriMesh, cell: f64, title: impl Fn() -> String) {
        let [depth, share] = depth_and_share(mesh, cell);
        self.depth.see(depth, &title);
        self.astray.see(share, &title);
    }

    /// Looks for particles that are outside of the mesh, and for parts of it that have none.
    fn inside(
        &mut self,
        ctx: &Context,
        mesh: &TriMesh,
        positions: &[DVec3],
        spacing: f64,
        title: impl Fn() -> String,
    ) {
        let deep = deep(ctx, positions, spacing);
        let kept = inside(mesh, &deep);
        self.deep[0] += deep.len();
        self.deep[1] += kept;
        let outside = deep.len() - kept;
        self.outside.see(outside as f64, title);
        self.clusters += usize::from(outside >= CLUSTER);
        self.empty += empty_parts(mesh, positions);
        self.looked += 1;
    }

    /// Measures the triangles that were made, in a mesh on cells of an edge (m).
    fn shapes(&mut self, mesh: &TriMesh, change: &Change, cell: f64) {
        let mut edges = Vec::new();
        for (triangle, _) in created(&change.sources) {
            self.angles.push(least_angle(mesh.corners(triangle)));
            let [a, b, c] = mesh.triangles[triangle];
            edges.extend([[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)]));
        }
        edges.sort_unstable();
        edges.dedup();
        let length = |ends: &[u32; 2]| {
            let [a, b] = ends.map(|end| mesh.positions[end as usize].cast::<f64>());
            (b - a).norm()
        };
        // As improvement has it: the lengths of both ends at their birth say what is too short and what is too long; where they do
        // not agree the middle counts.
        let target = |ends: &[u32; 2]| {
            let [one, two] = ends.map(|end| change.sizes[end as usize].map(f64::from));
            let (shortest, longest) = (one[0].max(two[0]), one[1].min(two[1]));
            if shortest <= longest { [shortest, longest] } else { [0.5 * (shortest + longest); 2] }
        };
        let is_good = |ends: &&[u32; 2]| {
            let [shortest, longest] = target(ends);
            (EDGES.start() * shortest..=EDGES.end() * longest).contains(&length(ends))
        };
        self.edges[0] += edges.len();
        self.edges[1] += edges.iter().filter(is_good).count();
        self.edges[2] += edges.iter().filter(|ends| EDGES.contains(&(length(ends) / cell))).count();
    }

    /// Each gate with its value and a note.
    fn results(&mut self, missing: &[&str]) -> Vec<(&'static str, f64, String)> {
        let mut whole = format!("{} frames of {}", self.frames, self.names.join(", "));
        if !missing.is_empty() {
            whole += &format!("; no {}", missing.join(", "));
        }
        self.shares.sort_unstable_by(f64::total_cmp);
        self.angles.sort_unstable_by(f64::total_cmp);
        let most = self.shares.last().copied().unwrap_or(f64::NAN);
        let of_changes = format!("{} changes, at most {most:.1}; {whole}", self.shares.len());
        let changes: usize = self.rebuild_levels.iter().sum();
        let [cells, ring, parts, everything] = self.rebuild_levels;
        let levels = format!(
            "of {changes} changes {ring} took a ring, {parts} whole parts, {everything} everything; {whole}"
        );
        let percent = |count: usize, all: usize| 100.0 * count as f64 / all as f64;
        let [deep, kept] = self.deep;
        let outside = format!("{} of {deep} particles are not, in {} frames", deep - kept, self.looked);
        // Without a look nothing is known.
        let looked = |count: usize| if self.looked > 0 { count as f64 } else { f64::NAN };
        let clusters = format!(
            "of {} frames; an upper bound, as {CLUSTER} particles or more that are outside in one frame need not lie together, nor be \
             outside for over 2 frames; at most {} in a frame, {}",
            self.looked,
            self.outside.value(),
            self.outside.note()
        );
        let least = self.angles.first().copied().unwrap_or(f64::NAN);
        let angles = format!("p1 of {} triangles that were made; at least {least:.2}", self.angles.len());
        let [edges, good, of_cell] = self.edges;
        vec![
            (OF_ALL[0], self.failures as f64, whole.clone()),
            (OF_ALL[1], quantile(&self.shares, 0.5), of_changes.clone()),
            (OF_ALL[2], quantile(&self.shares, 0.99), of_changes),
            (OF_ALL[3], percent(changes - cells, changes), levels),
            (OF_LATTICE[0], self.depth.value(), self.depth.note()),
            (OF_LATTICE[1], self.astray.value(), self.astray.note()),
            (OF_CACHES[0], percent(kept, deep), outside),
            (OF_CACHES[1], looked(self.empty), format!("in {} frames", self.looked)),
            (OF_CACHES[2], looked(self.clusters), clusters),
            (OF_SPOT[0], self.alive, "of the sculpted triangles, at the end".into()),
            (OF_SPOT[1], self.jump.value(), self.jump.note()),
            (OF_SPOT[2], self.drift.value(), self.drift.note()),
            (OF_MADE[0], quantile(&self.angles, 0.01), angles),
            (
                OF_MADE[1],
                percent(good, edges),
                format!(
                    "of {edges} edges, as they were made; {:.1} % if the cell were the target of all",
                    percent(of_cell, edges)
                ),
            ),
        ]
    }
}

fn is_due(every: usize, frame: usize) -> bool {
    every > 0 && frame.is_multiple_of(every)
}

/// What so much of some ascending numbers keeps within; NaN where there are none.
fn quantile(values: &[f64], share: f64) -> f64 {
    let at = (values.len() as f64 * share) as usize;
    values.get(at.min(values.len().saturating_sub(1))).copied().unwrap_or(f64::NAN)
}

/// The triangles that were made in a frame, parts of others among them, and their sources.
fn created(sources: &[Source]) -> impl Iterator<Item = (usize, &Source)> {
    sources.iter().enumerate().filter(|(_, source)| !matches!(source, Source::Whole(_)))
}

/// What keeps a mesh from being a closed surface that is turned outward.
pub fn unsound(mesh: &TriMesh) -> Option<String> {
    if let Some(vertex) = mesh.positions.iter().position(|position| !position.iter().all(|x| x.is_finite())) {
        return Some(format!("vertex {vertex} is not finite"));
    }
    let topology = Topology::of(mesh.positions.len(), &mesh.triangles);
    if !topology.is_watertight() {
        return Some(format!("it is not watertight: {topology:?}"));
    }
    let volume = mesh.volume();
    (volume.is_nan() || volume <= 0.0).then(|| format!("its volume is {volume} m3"))
}

/// Slivers among the triangles that a change made, as files have their corners.
fn flat(mesh: &TriMesh, change: Option<&Change>) -> Option<String> {
    let sources = &change?.sources;
    if sources.len() != mesh.triangles.len() {
        return Some(format!("it has {} triangles, but {} sources", mesh.triangles.len(), sources.len()));
    }
    let flatness = |(triangle, _): (usize, &Source)| {
        let [a, b, c] = mesh.corners(triangle);
        let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
        let share = if longest > 0.0 { (b - a).cross(&(c - a)).norm() / longest } else { 0.0 };
        (share < FLATTEST).then_some((triangle, share, longest.sqrt()))
    };
    let slivers: Vec<(usize, f64, f64)> = created(sources).filter_map(flatness).collect();
    let (triangle, share, long) = *slivers.iter().min_by(|a, b| a.1.total_cmp(&b.1))?;
    let source = sources[triangle];
    Some(format!(
        "{} slivers; triangle {triangle}, {source:?}, is {long:e} m long and {share:e} of that high",
        slivers.len()
    ))
}

/// The least angle of a triangle (deg).
fn least_angle(corners: [DVec3; 3]) -> f64 {
    let angle = |at: usize| {
        let [here, next, last] = [at, (at + 1) % 3, (at + 2) % 3].map(|at| corners[at]);
        let (u, v) = (next - here, last - here);
        libm::atan2(u.cross(&v).norm(), u.dot(&v)).to_degrees()
    };
    (0..3).map(angle).fold(f64::INFINITY, f64::min)
}

/// By how much a change changes the volume (percent of it), within its frame.
fn jump(frame: &Frame<'_>, change: &Change) -> f64 {
    let before = volume(&change.before, frame.before);
    100.0 * (volume(&change.vertices, &change.triangles) / before - 1.0).abs()
}

/// What triangles with corners at some places (m) enclose (m3).
fn volume(positions: &[DVec3], triangles: &[[u32; 3]]) -> f64 {
    let Some(origin) = positions.first() else { return 0.0 };
    let six = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|corner| positions[corner as usize] - origin);
        a.dot(&b.cross(&c))
    };
    triangles.iter().map(six).sum::<f64>() / 6.0
}

/// The positions (m) of particles that lie deeper than [`DEEP`] below their own surface.
fn deep(ctx: &Context, positions: &[DVec3], spacing: f64) -> Vec<DVec3> {
    let phi = Implicit::new(ctx, positions, spacing, CELL * spacing).expect("a surface");
    let known = Distances::new(ctx, &phi, &Isosurface::new(&phi), REACH).expect("distances");
    let mut sampler = Sampler::new(&known);
    let is_deep = |position: &&DVec3| {
        let at = **position / phi.cell();
        match sampler.at(at) {
            Some((distance, _)) => f64::from(distance) < -DEEP / CELL,
            None => is_inside(&phi, at),
        }
    };
    positions.iter().filter(is_deep).copied().collect()
}

/// Whether the node nearest to a position (cells), far from the surface, is inside.
fn is_inside(phi: &Implicit, at: DVec3) -> bool {
    let node = [0, 1, 2].map(|axis| at[axis].round() as i32);
    // Patches have 4 nodes along an edge.
    let patch = node.map(|x| x.div_euclid(4));
    match phi.find(patch) {
        Some(found) => {
            let [x, y, z] = node.map(|x| x.rem_euclid(4) as usize);
            phi.values(found)[x << 4 | y << 2 | z] < 0.0
        }
        None => phi.is_inside(patch),
    }
}
