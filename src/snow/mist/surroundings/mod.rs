//! The surroundings that mist flows around: the base layer, the ground and objects.
//!
//! Objects that bound a solid are evaluated by their winding number ([`crate::sweep`]), so that self-intersecting characters have one
//! inside; meshes with large holes, and the ground mesh, count as sheets two cells thick.

#[cfg(feature = "vdb")]
mod corners;
#[cfg(feature = "vdb")]
mod open_faces;

use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::{Mutex, PoisonError};

use rayon::prelude::*;

use super::{Mist, Source};
use crate::context::Context;
use crate::error::Result;
use crate::flow::{Coord, Faces, Solids, Tiles};
use crate::geometry::DVec3;
use crate::snow::bounds::bounds;
use crate::snow::grains::colliders::shell::Shell;
use crate::snow::grains::{FASTEST_OBJECT, MAX_CLOSED_HOLES};
use crate::sweep::{self, Body, Settings};
use crate::vdb::{FloatGrid, level_set};
use corners::{Grid, Lattice};

/// The surroundings that mist flows around in a step.
pub struct Surroundings<'a> {
    /// The base layer at the beginning of the step. The layer at its end is already open along the whole path of the objects: air would be
    /// pressed out through gaps that do not exist yet. It opens as the objects of [`Self::removing`] move into it.
    pub base: Option<&'a FloatGrid>,
    /// Objects, moving or not.
    pub bodies: &'a [&'a Body],
    /// Whether each object removes the snow that it moves through; objects beyond the end of this list do not.
    pub removing: &'a [bool],
    /// Height of a level ground plane (m).
    pub floor: Option<f64>,
}

/// The boundaries of a step: see [`Surroundings::during`].
pub struct Walls<'a> {
    around: &'a Surroundings<'a>,
    bodies: Vec<StepBody<'a>>,
    /// Start of the step, and its length (s).
    from: f64,
    dt: f64,
    /// Edge of the finest cells (m).
    cell: f64,
    cache: Mutex<Cache>,
}

/// Results that later calls in the same step request again.
#[derive(Default)]
struct Cache {
    /// Objects that do not move.
    fixed: Option<Snapshot>,
    /// Moving objects at the last moment requested: finer and wider cells request the same one.
    moving: Option<Snapshot>,
    /// The part of the base layer that moving objects have removed since the step began.
    opened: Option<Opened>,
    /// Faces of tiles that no moving object approaches in the step, by the cells' edge (m, its bits) and the tile; none: all are open.
    faces: HashMap<(u64, Coord), Option<Faces>>,
}

/// Objects at a moment.
struct Snapshot {
    /// Share 0..=1 of the step.
    share: f64,
    /// Indices of the objects in it.
    near: Vec<usize>,
    /// Level set of the objects that have an inside.
    solid: Option<FloatGrid>,
    /// The surfaces of the others, and of moving objects.
    surfaces: Vec<Surface>,
}

/// The volume that objects have swept since the step began.
struct Opened {
    /// Share 0..=1 of the step up to which it is swept.
    share: f64,
    /// Indices of the objects.
    near: Vec<usize>,
    swept: FloatGrid,
}

/// An object during a step.
struct StepBody<'a> {
    body: &'a Body,
    /// Whether it has no inside.
    is_sheet: bool,
    /// Whether it moves too fast to carry the air along: it is then at its final position throughout the step.
    jumps: bool,
    /// Whether it opens the base layer as it moves.
    opens: bool,
    /// Its triangles, counter-clockwise seen from outside.
    triangles: Vec<[u32; 3]>,
    /// Minimum and maximum corner over the step (m).
    bounds: [DVec3; 2],
    /// Largest mean speed (m/s) of a vertex over the step.
    speed: f64,
}

/// Half thickness of a sheet (cells): enough to close all faces next to the sheet, wherever it lies between them.
const SHEET_HALF: f64 = 1.0;
/// Share of the step over which the speed of a surface is measured.
const INSTANT: f64 = 0.125;
/// Distance from a surface (cells) within which covered faces move with it; faces farther inside do not touch air.
const NEAR: f64 = 2.0;
/// Maximum spacing of the corners (cells of the base): with it, a narrow band of three cells on each side reaches a corner next to the
/// surface.
const MAX_SPACING: f64 = 2.9;
/// Maximum number of parts of a cell's edge. In cells wider than 11 voxels of the base, only the sign change locates the base's surface.
const MAX_PARTS: usize = 4;

impl<'a> Surroundings<'a> {
    /// The walls in a step from `from` to `to` (s), for cells `cell` m wide and wider ones.
    ///
    /// # Errors
    /// A pose that cannot be computed.
    pub fn during(&'a self, [from, to]: [f64; 2], cell: f64) -> Result<Walls<'a>> {
        let removes = self.removing.iter().chain(std::iter::repeat(&false));
        let removes = removes.map(|removes| *removes && self.base.is_some());
        let bodies = self.bodies.iter().zip(removes);
        let bodies =
            bodies.map(|(body, removes)| StepBody::new(body, removes, [from, to])).collect::<Result<_>>()?;
        Ok(Walls { around: self, bodies, from, dt: to - from, cell, cache: Mutex::default() })
    }
}

impl<'a> StepBody<'a> {
    fn new(body: &'a Body, removes: bool, [from, to]: [f64; 2]) -> Result<Self> {
        let (mut first, mut last) = (Vec::new(), Vec::new());
        body.closed_pose(from, &mut first)?;
        body.closed_pose(to, &mut last)?;
        let is_sheet = body.share_of_caps(&first) >= MAX_CLOSED_HOLES || body.contradictions() > 0;
        let farthest = first.iter().zip(&last).map(|(a, b)| (b - a).norm()).fold(0.0, f64::max);
        let jumps = farthest > FASTEST_OBJECT * (to - from);
        // A rotation may carry vertices outside the bounding box of both poses.
        let margin = DVec3::repeat(if jumps { 0.0 } else { farthest });
        let positions = last.iter().chain(first.iter().filter(|_| !jumps));
        let [low, high] = bounds(positions);
        Ok(Self {
            body,
            is_sheet,
            jumps,
            opens: removes && farthest > 0.0 && !jumps && !is_sheet,
            triangles: body.closed_triangles().collect(),
            bounds: [low - margin, high + margin],
            speed: if jumps { 0.0 } else { farthest / (to - from) },
        })
    }

    /// Whether it comes within a distance (m) of a box.
    fn is_near(&self, [low, high]: &[DVec3; 2], distance: f64) -> bool {
        let margin = DVec3::repeat(distance);
        self.bounds[0] - margin <= *high && *low <= self.bounds[1] + margin
    }
}

impl Walls<'_> {
    /// Open fractions and speeds of faces at a share 0..=1 of the step, for tiles with cells `cell` m wide.
    ///
    /// # Errors
    /// A pose that cannot be computed; cancel; errors of a grid.
    pub fn faces(&self, ctx: &Context, tiles: &Tiles, cell: f32, share: f64) -> Result<Solids> {
        let cell = f64::from(cell);
        if tiles.count() == 0 {
            return Ok(Solids::none(tiles));
        }
        let lattice = Lattice { cell, parts: if cell > 1.5 * self.cell { 1 } else { self.parts() } };
        let mut cache = self.cache.lock().unwrap_or_else(PoisonError::into_inner);
        let Cache { fixed, moving, opened, faces: known } = &mut *cache;
        let key = |tile: &Coord| (cell.to_bits(), *tile);
        let slots = (0..tiles.count()).filter(|slot| !known.contains_key(&key(&tiles.coords()[*slot])));
        let slots: Vec<usize> = slots.collect();
        let unknown: Vec<Coord> = slots.iter().map(|slot| tiles.coords()[*slot]).collect();
        let bounds = lattice.bounds(tiles.coords());
        let is_near = |body: &StepBody<'_>| body.is_near(&bounds, NEAR * cell);
        let fixed = self.snapshot(ctx, fixed, 1.0, |body| body.speed == 0.0 && is_near(body))?;
        let moving = self.snapshot(ctx, moving, share, |body| body.speed > 0.0 && is_near(body))?;
        let opened = self.opened(ctx, opened, share, |body| body.opens && is_near(body))?;
        let grid = |grid| Grid::new(ctx, grid, &unknown, &lattice);
        // A level set with a narrower band has no distances that deep.
        let band = moving.solid.as_ref().map_or(0.0, |grid| f64::from(grid.background()));
        let around = SampledWalls {
            lattice,
            floor: self.around.floor,
            still: [grid(self.around.base)?, grid(fixed.solid.as_ref())?],
            opened: grid(opened)?,
            moving: grid(moving.solid.as_ref())?,
            bodies: &self.bodies,
            surfaces: [&fixed.surfaces, &moving.surfaces],
            deepest: if NEAR * cell < 0.999 * band { -NEAR * cell } else { f64::NEG_INFINITY },
        };
        let made = unknown.par_iter().enumerate().with_min_len(4).map(|(index, tile)| {
            ctx.check()?;
            Ok(around.faces(index, *tile))
        });
        let made: Vec<Option<Faces>> = made.collect::<Result<_>>()?;
        let mut out = Vec::new();
        for ((slot, tile), faces) in slots.into_iter().zip(&unknown).zip(made) {
            let bounds = lattice.bounds(&[*tile]);
            let moves = |body: &StepBody<'_>| body.speed > 0.0 && body.is_near(&bounds, NEAR * cell);
            match self.bodies.iter().any(moves) {
                true => out.extend(faces.map(|faces| (slot as u32, faces))),
                false => drop(known.insert(key(tile), faces)),
            }
        }
        let stay = |(slot, tile): (usize, &Coord)| Some((slot as u32, known.get(&key(tile))?.clone()?));
        out.extend(tiles.coords().iter().enumerate().filter_map(stay));
        Ok(Solids::new(tiles, out))
    }

    /// Largest speed (m/s) of objects that come near the air, or near grains that raise mist, during the step.
    pub fn fastest_near(&self, mist: &Mist, sources: &[Source]) -> f64 {
        let cell = mist.params().cell;
        let lattice = Lattice { cell, parts: 1 };
        let raising = sources.iter().filter(|source| source.raises(mist.params()));
        let positions =
            raising.map(|source| source.position).chain(lattice.bounds(mist.flow().tiles().coords()));
        let bounds = bounds(positions);
        let near = self.bodies.iter().filter(|body| body.is_near(&bounds, NEAR * cell));
        near.map(|body| body.speed).fold(0.0, f64::max)
    }

    /// Number of parts into which the edge of the finest cells is divided, so that corners lie in the base's narrow band; at most
    /// [`MAX_PARTS`]. Wider cells are for air far away, and are not divided.
    fn parts(&self) -> usize {
        let max_spacing = self.around.base.map_or(f64::INFINITY, |base| MAX_SPACING * base.voxel_size());
        (1..MAX_PARTS).find(|parts| self.cell / *parts as f64 <= max_spacing).unwrap_or(MAX_PARTS)
    }

    /// The wanted objects at a share 0..=1 of the step; the cached ones if they match.
    fn snapshot<'h>(
        &self,
        ctx: &Context,
        cache: &'h mut Option<Snapshot>,
        share: f64,
        is_wanted: impl Fn(&StepBody<'_>) -> bool,
    ) -> Result<&'h Snapshot> {
        let near: Vec<usize> = (0..self.bodies.len()).filter(|body| is_wanted(&self.bodies[*body])).collect();
        let has_all = |snapshot: &Snapshot| near.iter().all(|body| snapshot.near.contains(body));
        let snapshot = match cache.take().filter(|snapshot| snapshot.share == share && has_all(snapshot)) {
            Some(snapshot) => snapshot,
            None => {
                let solid = self.solid(ctx, &near, share)?;
                let has_surface =
                    |body: &&usize| self.bodies[**body].is_sheet || self.bodies[**body].speed > 0.0;
                let surfaces = near.iter().filter(has_surface).map(|body| self.surface(*body, share));
                let surfaces = surfaces.collect::<Result<_>>()?;
                Snapshot { share, near, solid, surfaces }
            }
        };
        Ok(cache.insert(snapshot))
    }

    /// The level set of the volume that objects have swept since the step began; continues from the last one requested.
    fn opened<'h>(
        &self,
        ctx: &Context,
        cache: &'h mut Option<Opened>,
        share: f64,
        is_wanted: impl Fn(&StepBody<'_>) -> bool,
    ) -> Result<Option<&'h FloatGrid>> {
        let near: Vec<usize> = (0..self.bodies.len()).filter(|body| is_wanted(&self.bodies[*body])).collect();
        let has_all = |opened: &Opened| near.iter().all(|body| opened.near.contains(body));
        let (near, from, mut swept) =
            match cache.take().filter(|cache| cache.share <= share && has_all(cache)) {
                Some(cache) => (cache.near, cache.share, Some(cache.swept)),
                None => (near, 0.0, None),
            };
        if swept.is_none() || from < share {
            for body in &near {
                self.add_sweep(ctx, &mut swept, &self.bodies[*body], [from, share])?;
            }
        }
        *cache = swept.map(|swept| Opened { share, near, swept });
        Ok(cache.as_ref().map(|cache| &cache.swept))
    }

    fn time(&self, body: &StepBody<'_>, share: f64) -> f64 {
        self.from + self.dt * if body.jumps { 1.0 } else { share }
    }

    /// The level set of the objects that have an inside.
    fn solid(&self, ctx: &Context, near: &[usize], share: f64) -> Result<Option<FloatGrid>> {
        let mut out = None;
        for body in near.iter().map(|body| &self.bodies[*body]).filter(|body| !body.is_sheet) {
            self.add_sweep(ctx, &mut out, body, [share; 2])?;
        }
        Ok(out)
    }

    /// Adds the volume that an object sweeps between two shares 0..=1 of the step to a level set.
    fn add_sweep(
        &self,
        ctx: &Context,
        to: &mut Option<FloatGrid>,
        body: &StepBody<'_>,
        shares: [f64; 2],
    ) -> Result<()> {
        let lattice = Lattice { cell: self.cell, parts: self.parts() };
        let [first, last] = shares.map(|share| self.time(body, share));
        let settings = Settings::new(lattice.spacing());
        let swept = sweep::chain(ctx, std::slice::from_ref(body.body), first, last, &settings)?;
        match to {
            None => *to = Some(swept),
            Some(to) => level_set::union(ctx, to, swept)?,
        }
        Ok(())
    }

    /// The triangles of an object, with their displacements back to where they were an [`INSTANT`] before.
    fn surface(&self, index: usize, share: f64) -> Result<Surface> {
        let body = &self.bodies[index];
        let (mut now, mut before) = (Vec::new(), Vec::new());
        body.body.closed_pose(self.time(body, share), &mut now)?;
        let earlier = (share - INSTANT).max(0.0);
        body.body.closed_pose(self.time(body, earlier), &mut before)?;
        let mut shell = Shell::new(0.0, body.triangles.clone(), false, now);
        shell.advance(&before);
        let passed = self.dt * (share - earlier);
        let rate = if passed > 0.0 { -1.0 / passed } else { 0.0 };
        Ok(Surface { body: index, shell, rate })
    }
}

/// An object's triangles at a moment.
struct Surface {
    /// Index of the object.
    body: usize,
    shell: Shell,
    /// Minus the inverse of the time (1/s) over which its displacements, which lead backward, are measured.
    rate: f64,
}

/// The base layer, the floor and objects at a moment, sampled around the tiles.
struct SampledWalls<'a> {
    lattice: Lattice,
    floor: Option<f64>,
    /// The base layer, and objects that do not move.
    still: [Option<Grid<'a>>; 2],
    /// The part of the base layer that moving objects have removed.
    opened: Option<Grid<'a>>,
    /// Moving objects.
    moving: Option<Grid<'a>>,
    bodies: &'a [StepBody<'a>],
    /// Surfaces of objects that do not move, and of moving ones.
    surfaces: [&'a [Surface]; 2],
    /// Signed distance (m) below which the velocity of a covered face does not matter.
    deepest: f64,
}

/// Signed distances (m) at the corners of a tile.
struct Corners {
    /// Along an edge.
    count: usize,
    /// To static and to moving surroundings.
    distances: [Vec<f32>; 2],
    /// To the nearer of both.
    nearest: Vec<f32>,
}

impl Corners {
    fn at(&self, [x, y, z]: [usize; 3]) -> f32 {
        self.nearest[(x * self.count + y) * self.count + z]
    }

    /// Whether the moving surroundings are nearer than the static ones.
    fn moves(&self, [x, y, z]: [usize; 3]) -> bool {
        let index = (x * self.count + y) * self.count + z;
        self.distances[1][index] < self.distances[0][index]
    }
}

impl SampledWalls<'_> {
    /// The faces of a tile with this `index` in the grids; none: all are open.
    fn faces(&self, index: usize, tile: Coord) -> Option<Faces> {
        let bounds = self.lattice.bounds(&[tile]);
        let is_sheet = |surface: &&Surface| {
            let body = &self.bodies[surface.body];
            body.is_sheet && body.is_near(&bounds, SHEET_HALF * self.lattice.cell)
        };
        let sheets: [Vec<&Surface>; 2] =
            self.surfaces.map(|surfaces| surfaces.iter().filter(is_sheet).collect());
        let mut grids = self.still.iter().chain([&self.moving]).flatten();
        let is_low = self.floor.is_some_and(|floor| bounds[0].y < floor);
        if !(is_low
            || grids.any(|grid| grid.is_near(index))
            || sheets.iter().any(|sheets| !sheets.is_empty()))
        {
            return None;
        }
        let corners = self.corners(index, tile, &sheets);
        if corners.nearest.iter().all(|distance| *distance >= 0.0) {
            return None;
        }
        let mut faces = Faces::open();
        for axis in 0..3 {
            for cell in 0..512usize {
                let at = [cell >> 6, cell >> 3 & 7, cell & 7];
                let open = self.open(&corners, axis, at);
                faces.open[axis][cell] = open;
                if open < 1.0 {
                    faces.speed[axis][cell] = self.speed(&corners, tile, axis, at);
                }
            }
        }
        Some(faces)
    }

    fn corners(&self, index: usize, tile: Coord, sheets: &[Vec<&Surface>; 2]) -> Corners {
        let count = self.lattice.corners();
        let far = (NEAR * self.lattice.cell) as f32;
        let half = SHEET_HALF * self.lattice.cell;
        let mut distances = [Vec::with_capacity(count.pow(3)), Vec::with_capacity(count.pow(3))];
        let grids = [&self.still[0], &self.still[1], &self.opened, &self.moving];
        let [base, fixed, opened, moving] =
            grids.map(|grid| grid.as_ref()?.corners(index, tile, &self.lattice));
        for corner in 0..count.pow(3) {
            let of = |values: &Option<Cow<'_, [f32]>>| values.as_ref().map(|values| values[corner]);
            let position = || {
                let at = [corner / (count * count), corner / count % count, corner % count];
                self.lattice.position(tile, at)
            };
            let floor = self.floor.map(|floor| (position().y - floor) as f32);
            let open = of(&opened).map_or(f32::NEG_INFINITY, |swept| -swept);
            let base = of(&base).map(|base| base.max(open));
            let still = [base, of(&fixed), floor].into_iter().flatten();
            let solids = [still.fold(far, f32::min), of(&moving).map_or(far, |moving| far.min(moving))];
            for side in 0..2 {
                let near = sheets[side].iter().filter_map(|sheet| sheet.shell.nearest(position(), half));
                let nearest = near.map(|near| (near.square.sqrt() - half) as f32);
                distances[side].push(nearest.fold(solids[side], f32::min));
            }
        }
        let nearest = distances[0].iter().zip(&distances[1]).map(|(a, b)| a.min(*b)).collect();
        Corners { count, distances, nearest }
    }

    /// Open fraction of the lower face of a cell on an axis: the mean over its parts.
    fn open(&self, corners: &Corners, axis: usize, cell: [usize; 3]) -> f32 {
        let (parts, count) = (self.lattice.parts, corners.count);
        let steps = [count * count, count, 1];
        let first = (cell[0] * steps[0] + cell[1] * steps[1] + cell[2]) * parts;
        let (one, other) = (steps[(axis + 1) % 3], steps[(axis + 2) % 3]);
        let mut sum = 0.0;
        for part in 0..parts * parts {
            let at = first + part / parts * one + part % parts * other;
            let near = &corners.nearest;
            sum += open_faces::open([near[at], near[at + other], near[at + one], near[at + one + other]]);
        }
        sum / (parts * parts) as f32
    }

    /// Speed (m/s), along the axis, of the solid that covers a cell's lower face.
    fn speed(&self, corners: &Corners, tile: Coord, axis: usize, cell: [usize; 3]) -> f32 {
        let parts = self.lattice.parts;
        // The corner nearest to the centre of the face.
        let mut middle = cell.map(|x| x * parts + parts / 2);
        middle[axis] = cell[axis] * parts;
        if !corners.moves(middle) || f64::from(corners.at(middle)) < self.deepest {
            return 0.0;
        }
        let half = 0.5 * self.lattice.cell;
        let mut position = self.lattice.position(tile, cell.map(|x| x * parts)).add_scalar(half);
        position[axis] -= half;
        let near = self.surfaces[1].iter().filter_map(|shell| {
            let found = shell.shell.nearest(position, NEAR * self.lattice.cell)?;
            Some((found.square, found.displacement[axis] * shell.rate))
        });
        let nearest = near.reduce(|a, b| if b.0 < a.0 { b } else { a });
        nearest.map_or(0.0, |(_, speed)| speed as f32)
    }
}
