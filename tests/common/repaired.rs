//! Whether a repaired mesh is what it should be: a closed surface without slivers of its own, what is kept as it was, and within a
//! cell of the solid that is meant.

use std::ops::Range;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};

use frazil::distance::triangle::Triangle;
use frazil::geometry::check::topology::Topology;
use frazil::geometry::mesh::spacing;
use frazil::geometry::spatial::bvh::Bvh;
use frazil::geometry::{DVec3, TriMesh};
use frazil::mesh_repair::{Repaired, Source, repair};
use frazil::{Context, Pool};

use super::bodies::Dice;
use super::broken_meshes::{Broken, mesh};

/// What is said of a mesh that encloses nothing.
pub const NOTHING: &str = "nothing in the mesh encloses a volume";
/// A repair that takes longer is taken for one that never ends.
const LONGEST: Duration = Duration::from_secs(120);
/// Least altitude of a triangle that was made (its longest edge).
const FLATTEST: f64 = 1e-4;
/// Positions along each side of the lattice on which solids are compared, and how far it reaches beyond what is meant (cells).
const SIDE: usize = 20;
const MARGIN: f64 = 2.0;
/// What 32-bit distances may be off by (cells).
const ROUNDING: f64 = 1e-3;
/// Directions along which no edges of made meshes run.
const ASLANT: [DVec3; 3] = [
    DVec3::new(0.5773, 0.6533, 0.4896),
    DVec3::new(-0.3719, 0.8411, -0.3919),
    DVec3::new(0.7127, -0.2893, -0.6391),
];

/// Repairs the meshes of these seeds on all cores. A sentence for each that fails, in their order; `tell` hears it at once.
pub fn failures(seeds: Range<u64>, models: &[TriMesh], tell: impl Fn(&str) + Sync) -> Vec<String> {
    let next = AtomicU64::new(seeds.start);
    let found = Mutex::new(Vec::new());
    let work = || {
        let pool = Pool::new(1).expect("a thread");
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= seeds.end {
                break;
            }
            if let Some(failure) = failure(&pool, seed, models) {
                tell(&failure);
                found.lock().unwrap_or_else(PoisonError::into_inner).push((seed, failure));
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(work);
        }
    });
    let mut found = found.into_inner().unwrap_or_else(PoisonError::into_inner);
    found.sort_unstable();
    found.into_iter().map(|(_, failure)| failure).collect()
}

/// What is wrong with the repaired mesh of a seed.
fn failure(pool: &Arc<Pool>, seed: u64, models: &[TriMesh]) -> Option<String> {
    let broken = mesh(seed, models);
    let work = || {
        let ctx = Context::new(pool.clone());
        let start = Instant::now();
        ctx.set_poll(Some(Box::new(move |_| start.elapsed() > LONGEST)));
        match repair(&ctx, &broken.mesh, broken.cell) {
            Ok(repaired) => faults(&broken, &repaired),
            Err(error) if error.to_string() == NOTHING && !Solid::of(&broken).is_deep() => None,
            Err(error) => Some(format!("it is refused: {error}")),
        }
    };
    let fault = catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| Some("repairing it panics".into()));
    fault.map(|fault| format!("seed {seed}: {}: {fault}", broken.what))
}

/// The first thing that is wrong with a repaired mesh.
pub fn faults(broken: &Broken, repaired: &Repaired) -> Option<String> {
    let solid = Solid::of(broken);
    if repaired.mesh.triangles.is_empty() {
        return solid.is_deep().then(|| "nothing is left of it".into());
    }
    unsound(&repaired.mesh)
        .or_else(|| changed(&broken.mesh, repaired))
        .or_else(|| flat(repaired))
        .or_else(|| solid.strayed(broken, repaired))
        .or_else(|| solid.differs(broken, &repaired.mesh))
}

/// What keeps a mesh from being a closed surface that is turned outward.
fn unsound(mesh: &TriMesh) -> Option<String> {
    let topology = Topology::of(mesh.positions.len(), &mesh.triangles);
    if let Some(vertex) = mesh.positions.iter().position(|position| !position.iter().all(|x| x.is_finite())) {
        return Some(format!("vertex {vertex} is not finite"));
    }
    if !topology.is_watertight() {
        return Some(format!("it is not watertight: {topology:?}"));
    }
    let volume = mesh.volume();
    (volume.is_nan() || volume <= 0.0).then(|| format!("its volume is {volume} m3"))
}

/// Where a repaired mesh does not have what it says that it kept.
fn changed(mesh: &TriMesh, repaired: &Repaired) -> Option<String> {
    let Repaired { mesh: after, vertices, sources, .. } = repaired;
    if (vertices.len(), sources.len()) != (after.positions.len(), after.triangles.len()) {
        return Some("its origins are not those of its vertices and triangles".into());
    }
    let moved = |(vertex, from): (usize, &Option<u32>)| {
        let from = (*from)?;
        let is_same = mesh.positions.get(from as usize) == Some(&after.positions[vertex]);
        (!is_same).then(|| format!("vertex {vertex} is not where vertex {from} was"))
    };
    let other = |(triangle, source): (usize, &Source)| {
        let Source::Whole(from) = *source else { return None };
        let is_same = mesh.triangles.get(from as usize).is_some_and(|corners| {
            let was = corners.map(|corner| mesh.positions[corner as usize]);
            let [a, b, c] = after.triangles[triangle].map(|corner| after.positions[corner as usize]);
            [[a, b, c], [b, c, a], [c, a, b], [a, c, b], [c, b, a], [b, a, c]].contains(&was)
        });
        (!is_same).then(|| format!("triangle {triangle} is not what triangle {from} was"))
    };
    let vertex = vertices.iter().enumerate().find_map(moved);
    vertex.or_else(|| sources.iter().enumerate().find_map(other))
}

/// The first triangle that was made and is a sliver.
fn flat(repaired: &Repaired) -> Option<String> {
    let made = |triangle: &usize| !matches!(repaired.sources[*triangle], Source::Whole(_));
    (0..repaired.sources.len()).filter(made).find_map(|triangle| {
        let [a, b, c] = repaired.mesh.corners(triangle);
        let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
        let altitude = (b - a).cross(&(c - a)).norm() / longest;
        let is_sound = altitude >= FLATTEST * longest;
        let source = repaired.sources[triangle];
        (!is_sound).then(|| {
            format!("triangle {triangle}, {source:?}, is {altitude:e} m high and {longest:e} m long")
        })
    })
}

/// The solid that is meant, in cells from a corner below it, and the lattice on which it is compared with another.
struct Solid {
    mesh: TriMesh,
    tree: Bvh,
    triangles: Vec<Triangle>,
    /// The corner (m), and the cell (m).
    corner: DVec3,
    cell: f64,
    /// What counts as within a cell (cells).
    reach: f64,
    /// From one position of the lattice to the next, about (cells).
    step: DVec3,
    /// Positions of the lattice's columns (cells), and of the lattice along each of them.
    columns: Vec<[f64; 2]>,
    heights: Vec<f64>,
}

impl Solid {
    fn of(broken: &Broken) -> Self {
        let mut mesh = TriMesh::default();
        broken.parts.iter().for_each(|part| mesh.append(part));
        let (low, high) = mesh.bounds().expect("a part");
        let cell = broken.cell;
        let corner = low.cast::<f64>() - DVec3::repeat(MARGIN * cell);
        let size = (high.cast::<f64>() - corner) / cell + DVec3::repeat(MARGIN);
        let farthest = f64::from(low.amax().max(high.amax()));
        let in_cells = |position: DVec3| -> [f32; 3] { ((position - corner) / cell).cast::<f32>().into() };
        let triangle = |triangle: usize| Triangle::of_cells(mesh.corners(triangle).map(in_cells));
        let triangles = (0..mesh.triangles.len()).map(triangle).collect();
        let step = size / SIDE as f64;
        let mut dice = Dice(1);
        // Within its box of the lattice.
        let mut within = |n: usize| n as f64 + dice.between(0.05, 0.95);
        let columns =
            (0..SIDE * SIDE).map(|n| [within(n / SIDE) * step.x, within(n % SIDE) * step.y]).collect();
        let heights = (0..SIDE * SIDE * SIDE).map(|n| within(n % SIDE) * step.z).collect();
        Self {
            tree: Bvh::new(&mesh),
            triangles,
            mesh,
            corner,
            cell,
            reach: 1.0 + 2.0 * spacing(farthest) / cell + ROUNDING,
            step,
            columns,
            heights,
        }
    }

    fn in_cells(&self, position: DVec3) -> DVec3 {
        (position - self.corner) / self.cell
    }

    /// A position of the lattice (m).
    fn position(&self, n: usize) -> DVec3 {
        let [x, y] = self.columns[n / SIDE];
        self.corner + DVec3::new(x, y, self.heights[n]) * self.cell
    }

    /// Whether the surface of a part is within a cell of a position (m).
    fn is_near(&self, position: DVec3) -> bool {
        let at = self.in_cells(position);
        let by = DVec3::repeat(self.reach * self.cell);
        let mut is_near = false;
        self.tree.in_box((position - by).cast(), (position + by).cast(), |triangle| {
            let nearest =
                || DVec3::from(self.triangles[triangle].closest(at.cast::<f32>().into()).map(f64::from));
            is_near = is_near || (nearest() - at).norm() <= self.reach;
        });
        is_near
    }

    /// How often a closed mesh surrounds each position of the lattice: signed crossings of the lines above them.
    fn windings(&self, mesh: &TriMesh) -> Vec<i32> {
        let mut lines: Vec<Vec<(f64, i32)>> = vec![Vec::new(); self.columns.len()];
        for triangle in 0..mesh.triangles.len() {
            let corners = mesh.corners(triangle).map(|position| self.in_cells(position));
            let [a, b, c] = corners;
            let (low, high) = (a.inf(&b).inf(&c), a.sup(&b).sup(&c));
            let range = |axis: usize| {
                let number = |x: f64| (x / self.step[axis]).clamp(0.0, (SIDE - 1) as f64) as usize;
                number(low[axis])..=number(high[axis])
            };
            for column in range(0).flat_map(|i| range(1).map(move |j| i * SIDE + j)) {
                let turns = turns(&corners, self.columns[column]);
                if turns != 0 {
                    lines[column].push((height(&corners, self.columns[column]), turns));
                }
            }
        }
        let above = |(n, at): (usize, &f64)| {
            let line = &lines[n / SIDE];
            line.iter().filter(|(height, _)| height > at).map(|(_, turns)| turns).sum::<i32>()
        };
        self.heights.iter().enumerate().map(above).collect()
    }

    /// Whether it is deeper than a cell anywhere on the lattice.
    fn is_deep(&self) -> bool {
        let windings = self.windings(&self.mesh);
        windings.iter().enumerate().any(|(n, winding)| *winding > 0 && !self.is_near(self.position(n)))
    }

    /// The first vertex that was made farther than a cell from all that is meant.
    fn strayed(&self, broken: &Broken, repaired: &Repaired) -> Option<String> {
        let made = repaired.vertices.iter().enumerate().filter(|(_, from)| from.is_none());
        made.map(|(vertex, _)| vertex).find_map(|vertex| {
            let position: DVec3 = repaired.mesh.positions[vertex].cast();
            let is_astray = !self.is_near(position) && !broken.is_unclear(position);
            is_astray.then(|| {
                format!("vertex {vertex} lies over a cell from the surface, at {} m", text(position))
            })
        })
    }

    /// The first position, over a cell from all surfaces that are meant, where a mesh is not the solid that is.
    fn differs(&self, broken: &Broken, mesh: &TriMesh) -> Option<String> {
        let (meant, found) = (self.windings(&self.mesh), self.windings(mesh));
        let is_wrong = |n: &usize| found[*n] != i32::from(meant[*n] > 0);
        let mut tree = None;
        (0..found.len()).filter(is_wrong).find_map(|n| {
            let position = self.position(n);
            if broken.is_unclear(position) || self.is_near(position) {
                return None;
            }
            // Rounding may let a line pass by a thin triangle, but not in all directions.
            let tree = tree.get_or_insert_with(|| Bvh::new(mesh));
            let is_right = |way: &DVec3| {
                tree.winding_number(position, *way) == i32::from(self.tree.winding_number(position, *way) > 0)
            };
            if ASLANT.iter().any(is_right) {
                return None;
            }
            let side = if meant[n] > 0 { "inside" } else { "outside" };
            Some(format!("the winding number is {} at {} m, over a cell {side}", found[n], text(position)))
        })
    }
}

fn text(position: DVec3) -> String {
    format!("({:e}, {:e}, {:e})", position.x, position.y, position.z)
}

/// How often a triangle runs around a column, seen from above: 1 counter-clockwise, -1 clockwise. Neighbours agree about an edge that
/// they have in common, whatever rounding does.
pub fn turns(corners: &[DVec3; 3], [x, y]: [f64; 2]) -> i32 {
    let [a, b, c] = corners;
    let crossing = |(from, to): (&DVec3, &DVec3)| {
        let (low, high, way) = if from.y <= to.y { (from, to, 1) } else { (to, from, -1) };
        let is_left = (high.x - low.x) * (y - low.y) > (high.y - low.y) * (x - low.x);
        if (low.y..high.y).contains(&y) && is_left { way } else { 0 }
    };
    crossing((a, b)) + crossing((b, c)) + crossing((c, a))
}

/// Where a column meets a triangle.
pub fn height([a, b, c]: &[DVec3; 3], [x, y]: [f64; 2]) -> f64 {
    let normal = (b - a).cross(&(c - a));
    let height = a.z - (normal.x * (x - a.x) + normal.y * (y - a.y)) / normal.z;
    // Of a triangle that stands, rounding makes anything.
    height.max(a.z.min(b.z).min(c.z)).min(a.z.max(b.z).max(c.z))
}
