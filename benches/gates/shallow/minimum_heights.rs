//! Gates of minimum heights: films on rough ground, whose mesh must not show through, and whose rim must not hover.

use std::collections::HashMap;

use frazil::geometry::Vec3;
use frazil::shallow::Shallow;
use frazil::shallow::columns::{Columns, NONE};
use frazil::shallow::material::Liquid;
use frazil::shallow::params::Params;
use frazil::shallow::surface::heights::minimum_heights::{Distance, Fitted, MinimumHeights};
use frazil::shallow::surface::{Depths, Indices, Layout, Surface, Target, bound};

use crate::common::bodies::Dice;
use crate::common::rough_ground::{CELL, Kind, Rough, rough};
use crate::common::shallow::context;
use crate::harness::Harness;

/// Grounds that are looked at.
const SEEDS: u64 = 54;
/// Depth from which a vertex is at its full height (cells).
const FADE: f64 = 0.02;

/// All of them.
pub fn run(h: &mut Harness) {
    h.measure_all(["shallow.lift_uncovered", "shallow.lift_discarded"], covered);
    h.measure("shallow.surface_rim", rim);
    h.measure("shallow.surface_jump", jump);
}

/// A surface: heights and columns of its vertices, positions in cells from the centre of cell (0, 0), and triangles.
struct Mesh {
    positions: Vec<[f64; 3]>,
    columns: Vec<u32>,
    triangles: Vec<[u32; 3]>,
}

/// Ground, and what is known of it.
struct Ground {
    rough: Rough,
    lifts: MinimumHeights,
    fitted: Fitted,
    surface: Surface,
    /// Triangles over each cell, in cells from the centre of cell (0, 0).
    facets: HashMap<[i64; 2], Vec<[[f64; 3]; 3]>>,
}

/// Cells from the centre of cell (0, 0), and height.
fn position(columns: &Columns, [x, y, z]: [f32; 3]) -> [f64; 3] {
    let at = |length: f32, axis: usize| (f64::from(length) - columns.grid.centre([0, 0])[axis]) / CELL;
    [at(x, 0), f64::from(y) / CELL, at(z, 1)]
}

/// Parts of the corners of a triangle, seen from above, if a position is over it.
fn parts(corners: [[f64; 3]; 3], [x, z]: [f64; 2]) -> Option<[f64; 3]> {
    let [a, b, c] = corners;
    let area = |p: [f64; 3], q: [f64; 3]| (p[0] - x) * (q[2] - z) - (p[2] - z) * (q[0] - x);
    let (u, v, w) = (area(b, c), area(c, a), area(a, b));
    let sum = u + v + w;
    let parts = [u / sum, v / sum, w / sum];
    (sum != 0.0 && parts.iter().all(|part| *part >= -1e-9)).then_some(parts)
}

fn height_at(corners: [[f64; 3]; 3], at: [f64; 2]) -> Option<f64> {
    parts(corners, at).map(|parts| (0..3).map(|n| parts[n] * corners[n][1]).sum())
}

impl Ground {
    fn new(seed: u64, kind: Kind) -> Self {
        let rough = rough(seed, kind);
        let mut lifts = MinimumHeights::default();
        let fitted = lifts
            .find(&rough.columns, &rough.positions, &rough.faces, Distance::default())
            .expect("minimum heights");
        let mut facets: HashMap<[i64; 2], Vec<_>> = HashMap::new();
        for face in &rough.faces {
            let corners =
                face.map(|corner| position(&rough.columns, rough.positions[corner as usize].into()));
            let range = |axis: usize| {
                let of = corners.map(|corner| corner[axis]);
                let low = of.into_iter().fold(f64::INFINITY, f64::min).floor() as i64;
                low..=of.into_iter().fold(f64::NEG_INFINITY, f64::max).floor() as i64
            };
            for z in range(2) {
                range(0).for_each(|x| facets.entry([x, z]).or_default().push(corners));
            }
        }
        Self { rough, lifts, fitted, surface: Surface::default(), facets }
    }

    /// Builds a surface: with lifts, or with a least depth only.
    fn build(&mut self, depth: &[i32], lifted: bool, fade: f64) -> Mesh {
        let columns = &self.rough.columns;
        let most = bound(columns);
        let mut positions = vec![0.0f32; 3 * most.vertices];
        let (mut of, mut indices) = (vec![0; most.vertices], vec![0; most.indices]);
        let mut target = Target {
            positions: Some(&mut positions),
            columns: Some(&mut of),
            indices: Indices::U32(&mut indices),
            ..Target::default()
        };
        let depths = match lifted {
            true => Depths { depth, least: self.lifts.least(), sunk: self.lifts.sunk(), ..Depths::default() },
            false => Depths { depth, ..Depths::default() },
        };
        let layout = Layout { least_depth: 0.05 * CELL, fade_depth: fade * CELL, ..Layout::default() };
        let counts = self.surface.build(columns, &depths, &layout, &mut target).expect("a surface");
        Mesh {
            positions: positions.as_chunks().0[..counts.vertices]
                .iter()
                .map(|at| position(columns, *at))
                .collect(),
            columns: of[..counts.vertices].to_vec(),
            triangles: indices[..counts.indices].as_chunks().0.to_vec(),
        }
    }

    /// Depths that are wet where a smooth field is over 0, and at least so deep there (cells).
    fn patches(&self, seed: u64, least: f64, deepest: f64, dry: f64) -> Vec<i32> {
        let mut dice = Dice(seed);
        let waves: Vec<[f64; 3]> = (0..4)
            .map(|_| [dice.between(-0.6, 0.6), dice.between(-0.6, 0.6), dice.between(0.0, 6.3)])
            .collect();
        let columns = &self.rough.columns;
        let mut depth = vec![0; columns.len()];
        for index in columns.indices() {
            let [x, z] = columns.cell(index).map(|at| at as f64);
            let wave: f64 = waves.iter().map(|[p, q, r]| libm::sin(p * x + q * z + r)).sum();
            let share = wave / 4.0 + 1.0 - 2.0 * dry;
            if share > 0.0 {
                let units = (least + (deepest - least) * share.min(1.0)) * CELL / columns.heights.unit;
                depth[index] = (units.ceil() as i32).min(columns.ceilings()[index] - columns.bases()[index]);
            }
        }
        depth
    }

    /// How far a position is over the ground below it (cells); 0 within the ground.
    fn gap(&self, [x, y, z]: [f64; 3]) -> f64 {
        let near = self.facets.get(&[x.floor() as i64, z.floor() as i64]);
        let mut winding = 0.0;
        let mut below = f64::NEG_INFINITY;
        for corners in near.into_iter().flatten() {
            let Some(height) = height_at(*corners, [x, z]) else { continue };
            let [a, b, c] = *corners;
            let up = (b[2] - a[2]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[2] - a[2]);
            if height > y {
                winding += up.signum();
            } else {
                below = below.max(height);
            }
        }
        if winding > 0.0 || below == f64::NEG_INFINITY { 0.0 } else { y - below }
    }
}

impl Mesh {
    /// Triangles by the cell of their first corners to the north-west.
    fn by_quartet(&self) -> HashMap<[i64; 2], Vec<[u32; 3]>> {
        let mut out: HashMap<_, Vec<_>> = HashMap::new();
        for triangle in &self.triangles {
            let least = |axis: usize| {
                let of = triangle.map(|vertex| self.positions[vertex as usize][axis]);
                of.into_iter().fold(f64::INFINITY, f64::min).round() as i64
            };
            out.entry([least(0), least(2)]).or_default().push(*triangle);
        }
        out
    }
}

/// What is above surfaces.
#[derive(Default)]
struct Above {
    looked: usize,
    /// Above the surface of columns that films link, and that liquid of their depths links.
    film: usize,
    deep: usize,
    highest: f64,
}

impl Above {
    /// Looks at vertices that face up, were not given up, and lie in the rooms of three wet columns of a triangle.
    fn look(&mut self, ground: &Ground, mesh: &Mesh, depth: &[i32]) {
        let Rough { positions, faces, columns } = &ground.rough;
        let mut up = vec![0.0; positions.len()];
        for face in faces {
            let [a, b, c]: [Vec3; 3] = face.map(|corner| positions[corner as usize]);
            let (b, c) = ((b - a).cast::<f64>(), (c - a).cast::<f64>());
            face.iter().for_each(|&corner| up[corner as usize] += b.z * c.x - b.x * c.z);
        }
        let triangles = mesh.by_quartet();
        let bare = ground.lifts.uncovered();
        for (vertex, at) in positions.iter().enumerate().filter(|(vertex, _)| up[*vertex] > 0.0) {
            if bare.binary_search(&(vertex as u32)).is_ok() {
                continue;
            }
            let [x, y, z] = position(columns, (*at).into());
            let height = (f64::from(at.y) - columns.heights.low) / columns.heights.unit;
            for triangle in triangles.get(&[x.floor() as i64, z.floor() as i64]).into_iter().flatten() {
                let of = triangle.map(|corner| mesh.columns[corner as usize]);
                let is_own = |column: u32| {
                    column != NONE && depth[column as usize] > 0 && {
                        let room = columns.unders()[column as usize]..columns.ceilings()[column as usize];
                        f64::from(room.start) <= height && height < f64::from(room.end)
                    }
                };
                let corners = triangle.map(|corner| mesh.positions[corner as usize]);
                let Some(surface) = height_at(corners, [x, z]).filter(|_| of.iter().all(|&of| is_own(of)))
                else {
                    continue;
                };
                self.looked += 1;
                if surface < y {
                    let is_film = of.iter().all(|&i| {
                        of.iter().all(|&j| {
                            let (i, base) = (i as usize, columns.bases()[j as usize]);
                            (columns.unders()[i]..columns.ceilings()[i]).contains(&base)
                        })
                    });
                    *if is_film { &mut self.film } else { &mut self.deep } += 1;
                    self.highest = self.highest.max(y - surface);
                }
            }
        }
    }
}

/// Films of many depths on many grounds.
fn covered() -> [(f64, String); 2] {
    let (mut lifted, mut plain) = (Above::default(), Above::default());
    let mut sum = Fitted::default();
    let mut most = 0.0f64;
    for seed in 0..SEEDS {
        let mut ground = Ground::new(seed, Kind::of(seed));
        let Fitted { upward, discarded, capped } = ground.fitted;
        (sum.upward, sum.discarded, sum.capped) =
            (sum.upward + upward, sum.discarded + discarded, sum.capped + capped);
        let unit = ground.rough.columns.heights.unit / CELL;
        most = ground.lifts.least().iter().fold(most, |most, lift| most.max(f64::from(*lift) * unit));
        for (deepest, dry) in [(FADE, 0.0), (0.1, 0.1), (0.5, 0.3), (2.0, 0.1)] {
            let depth = ground.patches(seed, FADE, deepest, dry);
            let mesh = ground.build(&depth, true, FADE);
            lifted.look(&ground, &mesh, &depth);
            let mesh = ground.build(&depth, false, 0.0);
            plain.look(&ground, &mesh, &depth);
        }
    }
    let note = format!(
        "{SEEDS} grounds; of {} vertices under wet triangles; {} more where only deep liquid links columns, by {:.3} cells at most; with a \
         least depth of 0.05 cells only {}, by {:.3} cells",
        lifted.looked, lifted.deep, lifted.highest, plain.film, plain.highest
    );
    let Fitted { upward, discarded, capped } = sum;
    let share = 100.0 * (discarded + capped) as f64 / upward as f64;
    let of_lifts = format!(
        "{discarded} of {upward} that face up, and {capped} under low ceilings; the greatest lift is {most:.2} cells"
    );
    [(lifted.film as f64, note), (share, of_lifts)]
}

/// How far rims are over the ground.
#[derive(Default)]
struct Rims {
    samples: usize,
    /// Samples of over 0.05 cells.
    over: usize,
    worst: f64,
    /// Edges at wet columns, which nothing is linked with, or at walls.
    ends: usize,
}

impl Rims {
    /// Looks at the edges of a surface that have one triangle, but those at the border.
    fn look(&mut self, ground: &Ground, mesh: &Mesh, depth: &[i32]) {
        let mut sides: HashMap<[u32; 2], usize> = HashMap::new();
        for &[a, b, c] in &mesh.triangles {
            for [p, q] in [[a, b], [b, c], [c, a]] {
                *sides.entry([p.min(q), p.max(q)]).or_default() += 1;
            }
        }
        let last = ground.rough.columns.grid.size[0] as f64 - 1.0;
        for ends in sides.into_iter().filter(|(_, count)| *count == 1).map(|(edge, _)| edge) {
            let [a, b] = ends.map(|vertex| mesh.positions[vertex as usize]);
            let on_border = |axis: usize| {
                let of = [a[axis], b[axis]];
                of.iter().all(|at| *at < 1e-3) || of.iter().all(|at| *at > last - 1e-3)
            };
            if on_border(0) || on_border(2) {
                continue;
            }
            let of = ends.map(|vertex| mesh.columns[vertex as usize]);
            if of.iter().any(|&column| column == NONE || depth[column as usize] > 0) {
                self.ends += 1;
                continue;
            }
            for step in 0..=16 {
                let share = f64::from(step) / 16.0;
                let gap = ground.gap([0, 1, 2].map(|n| a[n] + (b[n] - a[n]) * share));
                self.samples += 1;
                self.over += usize::from(gap > 0.05);
                self.worst = self.worst.max(gap);
            }
        }
    }
}

/// Edges of patches of liquid on open ground; under slabs and at cliffs of two cells and more, where they hang over, they are counted.
fn rim() -> (f64, String) {
    let mut lifted: [Rims; 3] = Default::default();
    let mut plain = Rims::default();
    for seed in 0..SEEDS {
        let mut ground = Ground::new(seed, Kind::of(seed));
        for (deepest, dry) in [(0.1, 0.5), (1.0, 0.6)] {
            let depth = ground.patches(seed + 100, 1e-3, deepest, dry);
            let mesh = ground.build(&depth, true, FADE);
            lifted[usize::from(seed >= 36) + usize::from(seed >= 48)].look(&ground, &mesh, &depth);
            if seed < 36 {
                let mesh = ground.build(&depth, false, 0.0);
                plain.look(&ground, &mesh, &depth);
            }
        }
    }
    let [open, slab, cliff] = lifted;
    let note = format!(
        "{} places on rims; with a least depth of 0.05 cells only {:.3}, and {} over 0.05; at slabs {} of {} are over 0.05, and {} edges end at \
         wet columns or walls; at cliffs {} of {}, by {:.3} at most",
        open.samples,
        plain.worst,
        plain.over,
        slab.over,
        slab.samples,
        slab.ends,
        cliff.over,
        cliff.samples,
        cliff.worst
    );
    (open.worst, note)
}

/// Blood that runs over rough ground, and dries there.
fn jump() -> (f64, String) {
    let ctx = context();
    let (mut worst, mut flips) = ([0.0f64; 2], 0);
    let mut frames = Vec::new();
    for seed in 0..12 {
        let mut ground = Ground::new(seed, Kind::of(seed));
        let columns = &ground.rough.columns;
        let params = Params { liquid: Liquid::BLOOD, ..Params::default() };
        let mut liquid = Shallow::new(&ctx, &solids(columns), params).expect("a liquid");
        let depth = ground.patches(seed + 200, 0.3, 0.6, 0.65);
        let unit = columns.heights.unit;
        for index in columns.indices() {
            liquid.pour(index, f64::from(depth[index]) * unit);
        }
        let mut before = liquid.depths().to_vec();
        for _ in 0..30 {
            liquid.step(&ctx, 1.0 / 240.0).expect("a frame");
            let after = liquid.depths().to_vec();
            let flipped = |from: &[i32], to: &[i32]| {
                from.iter().zip(to).map(|(from, to)| if *from == 0 { (*to).min(1) } else { *from }).collect()
            };
            // The moment of wetting, and that of drying, with all else as it is.
            let (wets, dries): (Vec<i32>, Vec<i32>) = (flipped(&before, &after), flipped(&after, &before));
            flips += wets.iter().zip(&before).filter(|(a, b)| a != b).count();
            flips += dries.iter().zip(&after).filter(|(a, b)| a != b).count();
            for (kind, fade) in [(0, FADE), (1, 0.0)] {
                for (from, to) in [(&before, &wets), (&dries, &after)] {
                    let [from, to] = [from, to].map(|depth| ground.visible(depth, fade));
                    worst[kind] =
                        from.iter().zip(&to).map(|(a, b)| (a - b).abs()).fold(worst[kind], f64::max);
                }
            }
            let [old, new] = [&before, &after].map(|depth| ground.visible(depth, FADE));
            for index in (0..after.len()).filter(|&index| (before[index] == 0) != (after[index] == 0)) {
                let own = f64::from(before[index].abs_diff(after[index])) * ground.rough.columns.heights.unit
                    / CELL;
                frames.push(((old[index] - new[index]).abs() - own).max(0.0));
            }
            before = after;
        }
    }
    frames.sort_unstable_by(f64::total_cmp);
    let at = |share: f64| frames[((frames.len() - 1) as f64 * share) as usize];
    let note = format!(
        "{flips} columns that wet or dry; without fading {:.3}; over what the liquid rises in 1/240 s: median {:.3}, 99 % {:.3}, most {:.3}",
        worst[1],
        at(0.5),
        at(0.99),
        at(1.0)
    );
    (worst[0], note)
}

/// The solids of columns.
fn solids(columns: &Columns) -> frazil::shallow::terrain::Solids {
    let [nx, nz] = columns.grid.size;
    let cell = |index: usize| {
        let of = columns.of_cell([index % nx, index / nx]);
        of.map(|column| [columns.unders()[column], columns.bases()[column]]).collect()
    };
    frazil::shallow::terrain::Solids::new(columns.grid, columns.heights, (0..nx * nz).map(cell))
}

impl Ground {
    /// Height of each index above its base, as one sees it (cells): 0 where there is no vertex, or one in the ground.
    fn visible(&mut self, depth: &[i32], fade: f64) -> Vec<f64> {
        let mesh = self.build(depth, true, fade);
        let columns = &self.rough.columns;
        let mut out = vec![0.0; depth.len()];
        for (&column, position) in
            mesh.columns.iter().zip(&mesh.positions).filter(|(column, _)| **column != NONE)
        {
            let base = columns.heights.metres(columns.bases()[column as usize]) / CELL;
            out[column as usize] = (position[1] - base).max(0.0);
        }
        out
    }
}
