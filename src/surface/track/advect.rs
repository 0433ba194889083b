//! Advection of the mesh by the particles around it (thesis 2.2).
//!
//! The thesis moves a vertex by the weighted mean of the particles' displacements. That is accurate to zeroth order only: a vertex outside
//! the particles moves as those inside do, and lags where the liquid rotates. By default, affine maps are fitted to the displacements
//! (weighted least squares) at the nodes of a grid, one spacing apart, and a vertex follows the eight maps around it: affine motion is
//! exact, and there are far fewer nodes than vertices of a detailed mesh.
//!
//! If particles move farther than their spacing in a frame, their paths are divided into parts, which are followed one after the other.

use nalgebra::Vector3;
use rayon::prelude::*;

use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::coords::nodes_of;
use crate::geometry::{Coord, DVec3};
use crate::surface::Particles;
use crate::surface::params::{Params, Weighting};
use crate::surface::particles::affine_fit::{AffineMap, Near, Sums, sums};
use crate::surface::particles::grid::Cells;
use crate::surface::particles::paths::Paths;

/// Radius within which particles count for a mean (spacings; thesis 2.2).
const MEAN_RADIUS: f32 = 2.0;
/// Radius within which particles count for a map (spacings): the more there are, the less their jitter moves vertices.
const MAP_RADIUS: f32 = 3.0;
/// Maximum displacement in one part of a frame (spacings).
const STEP: f64 = 1.0;
/// Maximum number of parts of a frame.
const MAX_PARTS: usize = 64;
/// How often the radius is doubled where no particle is near.
const DOUBLINGS: u32 = 8;
/// Maximum coordinate of a cell.
const LIMIT: f64 = (i32::MAX / 4) as f64;

/// Where particles carry positions (m) from one frame to the next, `dt` (s, over 0) later: as
/// [`Tracker::step`](crate::surface::Tracker::step) carries its vertices before projection, but for any positions, with the spacing and
/// weighting of `params`.
///
/// # Errors
/// Parameters out of range, a time that is not positive; particles that are not valid or too far apart, or have neither ids nor
/// velocities; cancel.
pub fn carried(
    ctx: &Context,
    positions: &[DVec3],
    from: &Particles,
    to: &Particles,
    dt: f64,
    params: &Params,
) -> Result<Vec<DVec3>> {
    params.validate()?;
    validate_step(from, to, dt)?;
    ctx.phase("advect", || {
        let paths = Paths::between(from, to, dt)?;
        let mut out = positions.to_vec();
        advect(ctx, &mut out, &paths, params.spacing, params.weighting)?;
        Ok(out)
    })
}

/// Scratch buffers of one thread.
#[derive(Default)]
struct Scratch {
    of_cell: Near,
    of_position: Near,
}

/// Carries positions (m) along the paths of particles whose spacing is `spacing` (m). Returns the count of parts into which the
/// frame is divided.
///
/// # Errors
/// Particles too far apart; cancel.
pub fn advect(
    ctx: &Context,
    vertices: &mut [DVec3],
    paths: &Paths,
    spacing: f64,
    weighting: Weighting,
) -> Result<usize> {
    let parts = (paths.max_displacement() / (STEP * spacing)).ceil().clamp(1.0, MAX_PARTS as f64) as usize;
    if paths.count() == 0 {
        return Ok(parts);
    }
    let (mut from, mut to) = (Vec::new(), Vec::new());
    paths.at(0.0, &mut from);
    let mut order: Vec<(Coord, u32)> = (0..vertices.len() as u32).map(|vertex| ([0; 3], vertex)).collect();
    for part in 1..=parts {
        paths.at(part as f64 / parts as f64, &mut to);
        let cells = Cells::new(&from, 2.0 * spacing, |path| paths.rank(path))?;
        let displacements = cells.order.par_iter().with_min_len(4096).map(|path| {
            let displacement = (to[*path as usize] - from[*path as usize]) / spacing;
            [displacement.x as f32, displacement.y as f32, displacement.z as f32]
        });
        let field = Field { cells: &cells, displacements: displacements.collect(), spacing };
        match weighting {
            Weighting::Affine => field.carry_by_maps(ctx, vertices, &mut order)?,
            Weighting::Mean => field.carry_by_means(ctx, vertices, &mut order)?,
        }
        std::mem::swap(&mut from, &mut to);
    }
    Ok(parts)
}

/// Particles and their displacements in a part of a frame.
struct Field<'a> {
    cells: &'a Cells,
    /// Displacements in the order of cells (spacings).
    displacements: Vec<[f32; 3]>,
    /// m.
    spacing: f64,
}

/// Sorts vertices (m) by cells of `edge` (m). `order` holds their cells and indices in the previous order.
fn sort(vertices: &[DVec3], edge: f64, order: &mut [(Coord, u32)]) {
    order.par_iter_mut().with_min_len(4096).for_each(|(cell, vertex)| {
        let position = vertices[*vertex as usize];
        *cell = [0, 1, 2].map(|axis| (position[axis] / edge).floor().clamp(-LIMIT, LIMIT) as i32);
    });
    order.par_sort_unstable();
}

impl Field<'_> {
    /// Carries vertices (m) by the affine maps at the nodes around them.
    fn carry_by_maps(&self, ctx: &Context, vertices: &mut [DVec3], order: &mut [(Coord, u32)]) -> Result<()> {
        sort(vertices, self.spacing, order);
        let groups: Vec<&[(Coord, u32)]> = order.chunk_by(|a, b| a.0 == b.0).collect();
        let mut nodes: Vec<Coord> = groups.iter().flat_map(|group| nodes_of(group[0].0)).collect();
        nodes.par_sort_unstable_by_key(|node| (node.map(|x| x >> 1), *node));
        nodes.dedup();
        // Nodes in the same particle cell share the particles around them.
        let shared: Vec<&[Coord]> = nodes.chunk_by(|a, b| a.map(|x| x >> 1) == b.map(|x| x >> 1)).collect();
        let maps: Vec<Vec<Option<AffineMap>>> = shared
            .par_iter()
            .with_min_len(4)
            .map_init(Scratch::default, |scratch, nodes| {
                ctx.check()?;
                Ok(self.maps_at(nodes, scratch))
            })
            .collect::<Result<_>>()?;
        let maps: Vec<Option<AffineMap>> = maps.into_iter().flatten().collect();
        let find = |node: &Coord| {
            let key = (node.map(|x| x >> 1), *node);
            let at = nodes.binary_search_by_key(&key, |node| (node.map(|x| x >> 1), *node));
            at.ok().and_then(|at| maps[at])
        };
        let follow = |group: &[(Coord, u32)]| {
            let cell = group[0].0;
            let around = nodes_of(cell).each_ref().map(find);
            let displacement = |(_, vertex): &(Coord, u32)| {
                let at = vertices[*vertex as usize] / self.spacing - DVec3::from(cell.map(f64::from));
                blended(&around, at).unwrap_or_else(|| self.mean_far(vertices[*vertex as usize]))
                    * self.spacing
            };
            group.iter().map(displacement).collect()
        };
        let displacements = displacements_of(ctx, &groups, follow)?;
        displace(&groups, &displacements, vertices);
        Ok(())
    }

    /// The maps at nodes in one of the particles' cells; none where no particle is near.
    fn maps_at(&self, nodes: &[Coord], scratch: &mut Scratch) -> Vec<Option<AffineMap>> {
        let Scratch { of_cell, of_position } = scratch;
        let cell = nodes[0].map(|x| x >> 1);
        self.gather(cell, 2, of_cell);
        let map = |node: &Coord| {
            let at = [0, 1, 2].map(|axis| (node[axis] - 2 * cell[axis]) as f32);
            sums(of_cell, of_position, at, MAP_RADIUS).map(|sums| sums.map())
        };
        nodes.iter().map(map).collect()
    }

    /// Carries vertices (m) by the mean displacement of the particles around them.
    fn carry_by_means(
        &self,
        ctx: &Context,
        vertices: &mut [DVec3],
        order: &mut [(Coord, u32)],
    ) -> Result<()> {
        sort(vertices, self.cells.edge(), order);
        let groups: Vec<&[(Coord, u32)]> = order.chunk_by(|a, b| a.0 == b.0).collect();
        let follow = |group: &[(Coord, u32)]| {
            let cell = group[0].0;
            let (mut of_cell, mut of_position) = (Near::default(), Near::default());
            self.gather(cell, 1, &mut of_cell);
            let displacement = |(_, vertex): &(Coord, u32)| {
                let position = vertices[*vertex as usize];
                let sums = sums(&of_cell, &mut of_position, self.seen_from(cell, position), MEAN_RADIUS);
                sums.map_or_else(|| self.mean_far(position), |sums| sums.mean()) * self.spacing
            };
            group.iter().map(displacement).collect()
        };
        let displacements = displacements_of(ctx, &groups, follow)?;
        displace(&groups, &displacements, vertices);
        Ok(())
    }

    /// A position (m) relative to the corner of one of the particles' cells (spacings).
    fn seen_from(&self, cell: Coord, position: DVec3) -> [f32; 3] {
        let at = (position - DVec3::from(cell.map(f64::from)) * self.cells.edge()) / self.spacing;
        [at.x as f32, at.y as f32, at.z as f32]
    }

    /// The particles in the cells around a cell, in spacings from its corner.
    fn gather(&self, cell: Coord, rings: i32, out: &mut Near) {
        out.clear();
        let [low, high] = [-rings, rings].map(|by| cell.map(|at| at.saturating_add(by)));
        self.cells.near(low, high, cell, |particle, offset| {
            out.push(offset.map(|x| 2.0 * x), self.displacements[particle]);
        });
    }

    /// The mean displacement (spacings) for a position (m) without particles nearby: the thesis' radius is doubled until there are some.
    fn mean_far(&self, position: DVec3) -> DVec3 {
        let cell =
            [0, 1, 2].map(|axis| (position[axis] / self.cells.edge()).floor().clamp(-LIMIT, LIMIT) as i32);
        let (mut near, mut in_radius) = (Near::default(), Near::default());
        let found: Option<Sums> = (1..=DOUBLINGS).find_map(|doubling| {
            self.gather(cell, 1 << doubling, &mut near);
            sums(&near, &mut in_radius, self.seen_from(cell, position), MEAN_RADIUS * (1 << doubling) as f32)
        });
        found.map_or_else(DVec3::zeros, |sums| sums.mean())
    }
}

/// The displacements (m) of the vertices of each group.
fn displacements_of(
    ctx: &Context,
    groups: &[&[(Coord, u32)]],
    follow: impl Fn(&[(Coord, u32)]) -> Vec<DVec3> + Sync,
) -> Result<Vec<Vec<DVec3>>> {
    let one = |group: &&[(Coord, u32)]| {
        ctx.check()?;
        Ok(follow(group))
    };
    groups.par_iter().with_min_len(16).map(one).collect()
}

fn displace(groups: &[&[(Coord, u32)]], displacements: &[Vec<DVec3>], vertices: &mut [DVec3]) {
    for ((_, vertex), displacement) in groups.iter().copied().flatten().zip(displacements.iter().flatten()) {
        vertices[*vertex as usize] += displacement;
    }
}

/// Blends the maps at the corners of a cell at a position in it (0..1 on each axis): weights grow with proximity and with the particle
/// weight behind a map. None without maps.
fn blended(maps: &[Option<AffineMap>; 8], at: DVec3) -> Option<DVec3> {
    let (mut sum, mut all) = (Vector3::zeros(), 0.0);
    for (n, map) in maps.iter().enumerate() {
        let Some(map) = map else { continue };
        let corner = DVec3::new((n >> 2) as f64, (n >> 1 & 1) as f64, (n & 1) as f64);
        let share = (0..3).map(|axis| 1.0 - (at[axis] - corner[axis]).abs()).product::<f64>() * map.weight;
        sum += map.at(at - corner) * share;
        all += share;
    }
    (all > 0.0).then(|| sum / all)
}

/// Validates the frames of a step, `dt` (s) apart.
pub(in crate::surface) fn validate_step(from: &Particles, to: &Particles, dt: f64) -> Result<()> {
    if !(dt > 0.0 && dt.is_finite()) {
        return Err(Error::argument(format!("dt = {dt} s must be positive and finite")));
    }
    from.validate()?;
    to.validate()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::surface::test_particles::context;

    #[test]
    fn positions_outside_of_the_particles_turn_with_them_and_lag_behind_by_the_mean() {
        let ctx = context(2);
        let grid = (0..729).map(|n| [n / 81, n / 9 % 9, n % 9].map(|x| f64::from(x) - 4.0));
        let positions: Vec<DVec3> = grid.map(DVec3::from).collect();
        let turn = |position: &DVec3| position + DVec3::new(-position.z, 0.0, position.x) * 0.05;
        let at =
            |positions: Vec<DVec3>| Particles { positions, velocities: Vec::new(), ids: (0..729).collect() };
        let (from, to) = (at(positions.clone()), at(positions.iter().map(turn).collect()));
        let outside = [DVec3::new(4.5, 0.0, 0.0), DVec3::new(0.2, 4.7, 4.6)];
        let off = |weighting| {
            let params = Params { weighting, ..Params::for_spacing(1.0) };
            let there = carried(&ctx, &outside, &from, &to, 0.1, &params).unwrap();
            there
                .iter()
                .zip(&outside)
                .map(|(there, position)| (there - turn(position)).norm())
                .fold(0.0, f64::max)
        };
        assert!(off(Weighting::Affine) < 1e-3, "{}", off(Weighting::Affine));
        assert!(off(Weighting::Mean) > 0.02, "{}", off(Weighting::Mean));
        let params = Params::for_spacing(1.0);
        let error = carried(&ctx, &outside, &from, &to, 0.0, &params).unwrap_err();
        assert_eq!(error.to_string(), "dt = 0 s must be positive and finite");
    }
}
