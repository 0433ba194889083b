//! What mist flows around: the base layer, the ground and objects.
//!
//! Objects that bound a solid count by their winding number ([`crate::sweep`]), so that self-intersecting characters have one
//! inside; meshes with large holes, and the ground's, count as sheets two cells thick.

use rayon::prelude::*;

use super::shares;
use crate::base::DVec3;
use crate::context::Context;
use crate::error::Result;
use crate::flow::{Coord, Faces, Solids, Tiles};
use crate::snow::grains::field::Window;
use crate::snow::grains::shell::Shell;
use crate::snow::grains::{FASTEST_OBJECT, HOLES};
use crate::sweep::{self, Body, Settings};
use crate::vdb::FloatGrid;

/// What mist flows around in a step.
pub struct Surroundings<'a> {
    /// The base layer at the end of the step.
    pub base: Option<&'a FloatGrid>,
    /// Objects, moving or not.
    pub bodies: &'a [&'a Body],
    /// Height of a level ground plane (m).
    pub floor: Option<f64>,
}

/// The boundaries of a step: see [`Surroundings::during`].
pub struct Walls<'a> {
    around: &'a Surroundings<'a>,
    bodies: Vec<Moving<'a>>,
    /// Start of the step, and its length (s).
    from: f64,
    dt: f64,
}

/// An object during a step.
struct Moving<'a> {
    body: &'a Body,
    /// Whether it has no inside.
    is_sheet: bool,
    /// Whether it moves too fast to carry the air along: it then stands where it ends.
    jumps: bool,
    /// Its triangles, counter-clockwise seen from outside.
    triangles: Vec<[u32; 3]>,
    /// Least and greatest corner over the step (m).
    bounds: [DVec3; 2],
    moves: bool,
}

/// Half thickness of a sheet (cells): it then closes all faces next to it, wherever it lies between them.
const SHEET: f64 = 1.0;
/// Share of the step over which the speed of a surface is measured.
const INSTANT: f64 = 0.125;
/// Distance from a surface (cells) within which covered faces move as it does.
const NEAR: f64 = 3.0;
/// Most spacing of the corners (cells of the base) at which a narrow band of three cells on each side shows where the surface
/// is.
const BAND: f64 = 2.9;

impl<'a> Surroundings<'a> {
    /// What is around in a step from `from` to `to` (s).
    ///
    /// # Errors
    /// A pose that cannot be computed.
    pub fn during(&'a self, [from, to]: [f64; 2]) -> Result<Walls<'a>> {
        let bodies = self.bodies.iter().map(|body| Moving::new(body, from, to)).collect::<Result<_>>()?;
        Ok(Walls { around: self, bodies, from, dt: to - from })
    }
}

impl<'a> Moving<'a> {
    fn new(body: &'a Body, from: f64, to: f64) -> Result<Self> {
        let (mut first, mut last) = (Vec::new(), Vec::new());
        body.closed_pose(from, &mut first)?;
        body.closed_pose(to, &mut last)?;
        let is_sheet = body.share_of_caps(&first) >= HOLES || body.contradictions() > 0;
        let farthest = first.iter().zip(&last).map(|(a, b)| (b - a).norm()).fold(0.0, f64::max);
        let jumps = farthest > FASTEST_OBJECT * (to - from);
        // A turn may lead outside the box of both poses.
        let room = DVec3::repeat(if jumps { 0.0 } else { farthest });
        let places = last.iter().chain(first.iter().filter(|_| !jumps));
        let none = [DVec3::repeat(f64::MAX), DVec3::repeat(f64::MIN)];
        let [low, high] = places.fold(none, |[low, high], place| [low.inf(place), high.sup(place)]);
        Ok(Self {
            body,
            is_sheet,
            jumps,
            triangles: body.closed_triangles().collect(),
            bounds: [low - room, high + room],
            moves: farthest > 0.0 && !jumps,
        })
    }

    /// Whether it comes within a distance (m) of a box.
    fn is_near(&self, [low, high]: &[DVec3; 2], distance: f64) -> bool {
        let room = DVec3::repeat(distance);
        self.bounds[0] - room <= *high && *low <= self.bounds[1] + room
    }
}

impl Walls<'_> {
    /// Open shares and speeds of faces at a share 0..=1 of the step, for tiles with cells of an edge (m).
    ///
    /// # Errors
    /// A pose that cannot be computed; cancel; errors of a grid.
    pub fn faces(&self, ctx: &Context, tiles: &Tiles, cell: f32, share: f64) -> Result<Solids> {
        let cell = f64::from(cell);
        if tiles.count() == 0 {
            return Ok(Solids::none(tiles));
        }
        let parts = self.parts(cell);
        let lattice = Lattice { cell, parts };
        let bounds = lattice.bounds(tiles.coords());
        let near: Vec<&Moving<'_>> =
            self.bodies.iter().filter(|body| body.is_near(&bounds, NEAR * cell)).collect();
        let solid = self.solid(ctx, &near, &lattice, share)?;
        let shells: Vec<Surface<'_>> =
            near.iter().map(|body| self.surface(body, share)).collect::<Result<_>>()?;
        let base = Grid::new(self.around.base, tiles.coords(), &lattice)?;
        let solid = Grid::new(solid.as_ref(), tiles.coords(), &lattice)?;
        let around = Around { lattice, floor: self.around.floor, base, solid, shells };
        let faces = (0..tiles.count()).into_par_iter().with_min_len(4).filter_map(|slot| {
            ctx.check().ok()?;
            let faces = around.faces(slot, tiles.coords()[slot])?;
            Some((slot as u32, faces))
        });
        let faces: Vec<(u32, Faces)> = faces.collect();
        ctx.check()?;
        Ok(Solids::new(tiles, faces))
    }

    /// Into how many parts the edge of a cell is divided so that the base's band shows where its surface is.
    fn parts(&self, cell: f64) -> usize {
        let most = self.around.base.map_or(f64::INFINITY, |base| BAND * base.voxel_size());
        (0..6).map(|power| 1usize << power).find(|parts| cell / *parts as f64 <= most).unwrap_or(64)
    }

    fn time(&self, body: &Moving<'_>, share: f64) -> f64 {
        self.from + self.dt * if body.jumps { 1.0 } else { share }
    }

    /// The level set of the objects that have an inside.
    fn solid(
        &self,
        ctx: &Context,
        near: &[&Moving<'_>],
        lattice: &Lattice,
        share: f64,
    ) -> Result<Option<FloatGrid>> {
        let mut out: Option<FloatGrid> = None;
        for body in near.iter().filter(|body| !body.is_sheet) {
            let time = self.time(body, share);
            let settings = Settings::new(lattice.spacing());
            let grid = sweep::chain(ctx, std::slice::from_ref(&body.body), time, time, &settings)?;
            match &mut out {
                None => out = Some(grid),
                Some(out) => crate::vdb::level_set::union(ctx, out, grid)?,
            }
        }
        Ok(out)
    }

    /// The triangles of an object, with the way that they have made lately.
    fn surface<'b>(&self, body: &'b Moving<'b>, share: f64) -> Result<Surface<'b>> {
        let (mut now, mut before) = (Vec::new(), Vec::new());
        body.body.closed_pose(self.time(body, share), &mut now)?;
        let earlier = (share - INSTANT).max(0.0);
        body.body.closed_pose(self.time(body, earlier), &mut before)?;
        let mut shell = Shell::new(0.0, body.triangles.clone(), false, now);
        shell.follow(&before);
        let passed = self.dt * (share - earlier);
        let rate = if body.moves && passed > 0.0 { -1.0 / passed } else { 0.0 };
        Ok(Surface { body, shell, rate })
    }
}

/// The corners of cells, and of the parts into which they are divided.
#[derive(Clone, Copy)]
struct Lattice {
    /// Edge of a cell (m).
    cell: f64,
    /// Parts of an edge.
    parts: usize,
}

impl Lattice {
    /// Distance of two corners (m).
    fn spacing(&self) -> f64 {
        self.cell / self.parts as f64
    }

    /// Corners along the edge of a tile, both ends included.
    fn corners(&self) -> usize {
        8 * self.parts + 1
    }

    /// Least and greatest corner (m) of tiles.
    fn bounds(&self, tiles: &[Coord]) -> [DVec3; 2] {
        let low = |coord: &Coord| DVec3::from(coord.map(f64::from)) * (8.0 * self.cell);
        let none = [DVec3::repeat(f64::MAX), DVec3::repeat(f64::MIN)];
        let [least, greatest] =
            tiles.iter().map(low).fold(none, |[least, most], at| [least.inf(&at), most.sup(&at)]);
        [least, greatest.add_scalar(8.0 * self.cell)]
    }

    /// The corner (m) at an index in a tile.
    fn place(&self, tile: Coord, at: [usize; 3]) -> DVec3 {
        let index = |axis: usize| f64::from(tile[axis] * 8 * self.parts as i32 + at[axis] as i32);
        DVec3::new(index(0), index(1), index(2)) * self.spacing()
    }
}

/// The leaves of a level set around tiles.
struct Grid<'a> {
    /// Corners' spacing in cells of the level set.
    scale: f64,
    windows: Vec<Option<Window<'a>>>,
}

impl<'a> Grid<'a> {
    fn new(grid: Option<&'a FloatGrid>, tiles: &[Coord], lattice: &Lattice) -> Result<Option<Self>> {
        let Some(grid) = grid else { return Ok(None) };
        let Some((low, high)) = grid.active_bbox() else { return Ok(None) };
        let scale = lattice.spacing() / grid.voxel_size();
        let edge = 8.0 * lattice.parts as f64 * scale;
        let bounds = tiles.iter().map(|tile| {
            let low = tile.map(|at| (f64::from(at) * edge).floor() as i32);
            let high = tile.map(|at| (f64::from(at + 1) * edge).ceil() as i32 + 1);
            [low, high]
        });
        // Beside the level set, and above it, nothing is solid; below it, what it encloses ends.
        let is_near = |[least, most]: &[[i32; 3]; 2]| {
            (0..3).all(|axis| least[axis] <= high[axis] + 1 && most[axis] >= low[axis] - 1)
        };
        let bounds: Vec<Option<[[i32; 3]; 2]>> = bounds.map(|bounds| Some(bounds).filter(is_near)).collect();
        let leaves = bounds.iter().flatten().map(|bounds| bounds.map(|voxel| voxel.map(|x| x >> 3)));
        let leaves: Vec<[[i32; 3]; 2]> = leaves.collect();
        let mut windows = Window::all(grid, &leaves)?.into_iter();
        let windows = bounds.iter().map(|bounds| bounds.and_then(|_| windows.next())).collect();
        Ok(Some(Self { scale, windows }))
    }

    /// Whether a tile may have corners inside.
    fn is_near(&self, slot: usize) -> bool {
        self.windows[slot].as_ref().is_some_and(Window::has_inside)
    }

    /// Signed distance (m) at a corner of a tile; none far away.
    fn at(&self, slot: usize, corner: DVec3) -> Option<f32> {
        let window = self.windows[slot].as_ref()?;
        Some(window.sample((corner * self.scale).into()).0)
    }
}

/// An object's triangles at a moment.
struct Surface<'a> {
    body: &'a Moving<'a>,
    shell: Shell,
    /// Inverse of the time (1/s) in which its points made their way.
    rate: f64,
}

/// All that is around at a moment.
struct Around<'a> {
    lattice: Lattice,
    floor: Option<f64>,
    base: Option<Grid<'a>>,
    solid: Option<Grid<'a>>,
    shells: Vec<Surface<'a>>,
}

/// Signed distances (m) at the corners of a tile.
struct Corners {
    /// Along an edge.
    count: usize,
    /// To what stands still, and to what moves.
    distances: [Vec<f32>; 2],
}

impl Corners {
    /// To the nearest of all.
    fn at(&self, [x, y, z]: [usize; 3]) -> f32 {
        let index = (x * self.count + y) * self.count + z;
        self.distances[0][index].min(self.distances[1][index])
    }

    /// Whether what moves is nearer than what stands still.
    fn moves(&self, [x, y, z]: [usize; 3]) -> bool {
        let index = (x * self.count + y) * self.count + z;
        self.distances[1][index] < self.distances[0][index]
    }
}

impl Around<'_> {
    /// The faces of a tile; none: all are open.
    fn faces(&self, slot: usize, tile: Coord) -> Option<Faces> {
        let bounds = self.lattice.bounds(&[tile]);
        let sheets: Vec<&Surface<'_>> = self
            .shells
            .iter()
            .filter(|shell| shell.body.is_sheet && shell.body.is_near(&bounds, SHEET * self.lattice.cell))
            .collect();
        let has = |grid: &Option<Grid<'_>>| grid.as_ref().is_some_and(|grid| grid.is_near(slot));
        let is_low = self.floor.is_some_and(|floor| bounds[0].y < floor);
        if !(is_low || has(&self.base) || has(&self.solid) || !sheets.is_empty()) {
            return None;
        }
        let corners = self.corners(slot, tile, &sheets);
        if corners.distances.iter().flatten().all(|distance| *distance >= 0.0) {
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

    fn corners(&self, slot: usize, tile: Coord, sheets: &[&Surface<'_>]) -> Corners {
        let count = self.lattice.corners();
        let far = (NEAR * self.lattice.cell) as f32;
        let half = SHEET * self.lattice.cell;
        let mut distances = [Vec::with_capacity(count.pow(3)), Vec::with_capacity(count.pow(3))];
        for index in 0..count.pow(3) {
            let at = [index / (count * count), index / count % count, index % count];
            // Levels sets are sampled in their own cells: the corner's index keeps what is exact so.
            let place = self.lattice.place(tile, at);
            let corner = DVec3::from([0, 1, 2].map(|axis| {
                f64::from(tile[axis] * 8 * self.lattice.parts as i32 + at[axis] as i32)
            }));
            let of = |grid: &Option<Grid<'_>>| grid.as_ref().and_then(|grid| grid.at(slot, corner));
            let floor = self.floor.map(|floor| (place.y - floor) as f32);
            let mut still = [of(&self.base), floor].into_iter().flatten().fold(far, f32::min);
            let mut moving = of(&self.solid).unwrap_or(far).min(far);
            for sheet in sheets {
                if let Some(near) = sheet.shell.nearest(place, half) {
                    let distance = (near.square.sqrt() - half) as f32;
                    let nearest = if sheet.body.moves { &mut moving } else { &mut still };
                    *nearest = nearest.min(distance);
                }
            }
            distances[0].push(still);
            distances[1].push(moving);
        }
        Corners { count, distances }
    }

    /// Open share of the lower face of a cell on an axis: the mean of its parts.
    fn open(&self, corners: &Corners, axis: usize, cell: [usize; 3]) -> f32 {
        let parts = self.lattice.parts;
        let [one, other] = [(axis + 1) % 3, (axis + 2) % 3];
        let mut sum = 0.0;
        for part in 0..parts * parts {
            let mut at = cell.map(|x| x * parts);
            at[one] += part / parts;
            at[other] += part % parts;
            let four = [[0, 0], [0, 1], [1, 0], [1, 1]].map(|[i, j]| {
                let mut corner = at;
                corner[one] += i;
                corner[other] += j;
                corners.at(corner)
            });
            sum += shares::open(four);
        }
        sum / (parts * parts) as f32
    }

    /// Speed (m/s) on its axis of what covers the lower face of a cell.
    fn speed(&self, corners: &Corners, tile: Coord, axis: usize, cell: [usize; 3]) -> f32 {
        let parts = self.lattice.parts;
        // The corner next to the middle of the face: deep inside, distances are cut off and the velocity does not matter.
        let mut middle = cell.map(|x| x * parts + parts / 2);
        middle[axis] = cell[axis] * parts;
        if !corners.moves(middle) {
            return 0.0;
        }
        let half = 0.5 * self.lattice.cell;
        let mut place = self.lattice.place(tile, cell.map(|x| x * parts)).add_scalar(half);
        place[axis] -= half;
        let near = self.shells.iter().filter(|shell| shell.rate != 0.0).filter_map(|shell| {
            let found = shell.shell.nearest(place, NEAR * self.lattice.cell)?;
            Some((found.square, found.motion[axis] * shell.rate))
        });
        let nearest = near.reduce(|a, b| if b.0 < a.0 { b } else { a });
        nearest.map_or(0.0, |(_, speed)| speed as f32)
    }
}
