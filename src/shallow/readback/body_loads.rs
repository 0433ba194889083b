//! Forces of the liquid on the bodies in it, pressure and drag, for haptic tools; and the volume that the bodies displace.
//!
//! A body is a pillar in each cell that it covers (`terrain/shapes.rs`). Its faces are where liquid touches pillars: below, above, and at
//! the sides, where the pillar of one cell and the liquid of the next are at the same height. The weight of the liquid above a face acts on
//! it: rho g (eta - y) at the height y, where eta is the liquid's surface (in a flooded column, its head), integrated exactly over the
//! pillar. A submerged ball has the buoyancy of its pillars. The stagnation pressure, rho w^2 / 2, acts on faces that the liquid runs into,
//! and shear acts along all faces: the velocity changes over the depth of a film or of a flooded gap, or over half a cell at the sides.

use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::numeric::checks::check_each;
use crate::shallow::columns::Columns;
use crate::shallow::columns::grid::Grid;
use crate::shallow::pipes::side::Side;
use crate::shallow::solver::SLACK;
use crate::shallow::system::Shallow;
use crate::shallow::terrain::shapes::Shape;

/// For drag, a flooded gap that is lower than this (cells) counts as this high: some pillars of a round body come arbitrarily close to the
/// ground.
const MIN_GAP: f64 = 0.05;

/// The load on a body.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Load {
    /// Force of the liquid's weight (N): buoyancy, and the push of deeper liquid on one side.
    pub pressure: [f64; 3],
    /// Force of the liquid's motion relative to the body (N).
    pub drag: [f64; 3],
    /// Torque of both about the body's middle (N m).
    pub torque: [f64; 3],
    /// Volume of the body below the liquid's surface (m3). The surface is that of the flooded column below, else the mean at the body's
    /// sides.
    pub displaced: f64,
    /// Area of the faces of its pillars that touch liquid (m2).
    pub wetted: f64,
}

/// Sums over the faces of a body.
struct FaceSums<'a> {
    liquid: &'a Shallow,
    density: f64,
    velocity: DVec3,
    middle: DVec3,
    pressure: DVec3,
    drag: DVec3,
    torque: DVec3,
    wetted: f64,
    /// Height over which its sides touch liquid (units), summed over all side faces.
    contact: f64,
    /// The same sum, weighted by the level of the liquid and by the base of its column.
    levels: f64,
    bases: f64,
}

/// A face of a pillar.
struct Face {
    /// Its middle (m).
    at: DVec3,
    /// How far below its middle the pressure acts (m).
    lower: f64,
    /// Direction in which the liquid pushes it.
    push: DVec3,
    /// Its area (m2).
    area: f64,
}

impl Shallow {
    /// Current load on each of [`Shallow::bodies`]; `velocities` are theirs (m/s), `density` is the liquid's (kg/m3; blood 1,060, water
    /// 1,000). The liquid below a body is as the last step left it: after [`Shallow::set_bodies`], step first. Allocates nothing.
    ///
    /// # Errors
    /// `Argument`: a density that is not positive and finite, a count of velocities or of outputs other than the count of bodies, a
    /// velocity that is not finite.
    pub fn loads(&self, density: f64, velocities: &[[f64; 3]], out: &mut [Load]) -> Result<()> {
        if !(density > 0.0 && density.is_finite()) {
            return Err(Error::argument(format!("density = {density} kg/m3 is not positive and finite")));
        }
        let bodies = self.bodies();
        check_each(velocities.len(), "velocities", bodies.len(), "bodies")?;
        check_each(out.len(), "loads", bodies.len(), "bodies")?;
        if let Some(body) = velocities.iter().position(|velocity| !velocity.iter().all(|v| v.is_finite())) {
            return Err(Error::argument(format!("the velocity of body {body} is not finite")));
        }
        for ((body, velocity), out) in bodies.iter().zip(velocities).zip(out) {
            *out = self.load(body, density, DVec3::from(*velocity));
        }
        Ok(())
    }

    fn load(&self, body: &Shape, density: f64, velocity: DVec3) -> Load {
        let Columns { grid, heights, .. } = &self.columns;
        let mut sums = FaceSums {
            liquid: self,
            density,
            velocity,
            middle: body.middle(),
            pressure: DVec3::zeros(),
            drag: DVec3::zeros(),
            torque: DVec3::zeros(),
            wetted: 0.0,
            contact: 0.0,
            levels: 0.0,
            bases: 0.0,
        };
        body.each_cell(grid, heights, |cell, solid| sums.pillar(cell, solid));
        let around = [sums.levels, sums.bases].map(|sum| sum / sums.contact);
        let mut units = 0.0;
        body.each_cell(grid, heights, |cell, solid| units += self.submerged(cell, solid, around));
        Load {
            pressure: sums.pressure.into(),
            drag: sums.drag.into(),
            torque: sums.torque.into(),
            displaced: units * grid.cell * grid.cell * heights.unit,
            wetted: sums.wetted,
        }
    }

    /// The columns directly below and above a pillar, if they end at it.
    fn ends(&self, cell: [usize; 2], [bottom, top]: [i32; 2]) -> [Option<usize>; 2] {
        let columns = &self.columns;
        let mut ends = [None; 2];
        for column in columns.of_cell(cell) {
            if columns.ceilings()[column] == bottom {
                ends[0] = Some(column);
            }
            if columns.bases()[column] == top {
                ends[1] = Some(column);
            }
        }
        ends
    }

    /// The level of a column's liquid (units): its surface, or where it would be without the ceiling; none if it is dry.
    fn level(&self, column: usize) -> Option<f64> {
        let depth = self.flow.depth[column];
        let eta = f64::from(self.columns.bases()[column]) + f64::from(depth);
        (depth > 0).then(|| eta + f64::from(self.flow.network.excess_heads()[column].max(0.0)))
    }

    /// Whether a column is flooded up to its ceiling, within the tolerance of the solver.
    fn is_full(&self, column: usize) -> bool {
        let room = self.columns.ceilings()[column] - self.columns.bases()[column];
        self.flow.depth[column] > 0 && room - self.flow.depth[column] <= room / SLACK
    }

    /// The mean velocity of a column (m/s).
    fn mean_velocity(&self, column: usize) -> DVec3 {
        let [u, w] = self.velocity(column).map(f64::from);
        DVec3::new(u, 0.0, w)
    }

    /// Height of the part of a pillar below the surface (units); `level` and `ground` are the heights of the surface and of the ground at
    /// the sides of the body.
    fn submerged(&self, cell: [usize; 2], [bottom, top]: [i32; 2], [level, ground]: [f64; 2]) -> f64 {
        let [below, above] = self.ends(cell, [bottom, top]);
        let (bottom, top) = (f64::from(bottom), f64::from(top));
        let is_covered = above.is_some_and(|above| self.flow.depth[above] > 0);
        let level = match below {
            // Liquid that was pushed up onto a body does not submerge it.
            _ if is_covered => level,
            Some(below) => self.level(below).filter(|_| self.is_full(below)).unwrap_or(f64::NAN),
            None => level,
        };
        let bottom = if below.is_some() { bottom } else { bottom.max(ground) };
        // No known level means no liquid.
        if level.is_nan() { 0.0 } else { (level.min(top) - bottom).max(0.0) }
    }
}

impl FaceSums<'_> {
    /// Adds the loads on the faces of a pillar.
    fn pillar(&mut self, cell: [usize; 2], [bottom, top]: [i32; 2]) {
        let Columns { grid, heights, .. } = &self.liquid.columns;
        let (area, [x, z]) = (grid.cell * grid.cell, grid.centre(cell));
        let [below, above] = self.liquid.ends(cell, [bottom, top]);
        let depth = |column: usize| heights.length(f64::from(self.liquid.flow.depth[column]));
        let face = |end: i32, push: f64| Face {
            at: DVec3::new(x, heights.metres(end), z),
            lower: 0.0,
            push: DVec3::new(0.0, push, 0.0),
            area,
        };
        // Between a film and the body above it there is air.
        if let Some((column, level)) = self.level(below.filter(|&below| self.liquid.is_full(below))) {
            // A flooded gap: the flow through it, and what the body drags along.
            let sheared = 6.0 * self.liquid.mean_velocity(column) - self.velocity;
            let shear = 1.0 / depth(column).max(MIN_GAP * grid.cell);
            self.face(&face(bottom, 1.0), level - f64::from(bottom), column, sheared * shear);
        }
        if let Some((column, level)) = self.level(above) {
            // A film. If thinner than a cell it moves with the body, more so the thinner it is.
            let sheared = 3.0 * (self.liquid.mean_velocity(column) - self.velocity);
            let thick = depth(column);
            let shear = if thick < grid.cell { thick / (grid.cell * grid.cell) } else { 1.0 / thick };
            self.face(&face(top, -1.0), level - f64::from(top), column, sheared * shear);
        }
        for side in [Side::East, Side::West, Side::South, Side::North] {
            if let Some(beside) = side.cell(cell, grid.size) {
                self.side(grid, cell, beside, [bottom, top]);
            }
        }
    }

    /// A column with liquid, and its level (units).
    fn level(&self, column: Option<usize>) -> Option<(usize, f64)> {
        let column = column?;
        Some((column, self.liquid.level(column)?))
    }

    /// Adds the load of the liquid in an adjacent cell.
    fn side(&mut self, grid: &Grid, cell: [usize; 2], beside: [usize; 2], solid: [i32; 2]) {
        let columns = &self.liquid.columns;
        let out = [0, 1].map(|axis| beside[axis] as f64 - cell[axis] as f64);
        let [x, z] = grid.centre(cell);
        for column in columns.of_cell(beside) {
            let Some(level) = self.liquid.level(column) else { continue };
            let base = columns.bases()[column];
            let low = solid[0].max(base);
            let high = solid[1].min(base + self.liquid.flow.depth[column]);
            if low >= high {
                continue;
            }
            let (contact, middle) = (f64::from(high - low), 0.5 * (f64::from(low) + f64::from(high)));
            self.contact += contact;
            self.levels += contact * level;
            self.bases += contact * f64::from(base);
            let height = columns.heights.low + middle * columns.heights.unit;
            let half = 0.5 * grid.cell;
            let face = Face {
                at: DVec3::new(x + half * out[0], height, z + half * out[1]),
                // Centre of a pressure that grows downward.
                lower: columns.heights.length(contact * contact / (12.0 * (level - middle))),
                push: DVec3::new(-out[0], 0.0, -out[1]),
                area: columns.heights.length(contact) * grid.cell,
            };
            let sheared = (self.liquid.mean_velocity(column) - self.velocity) * (2.0 / grid.cell);
            self.face(&face, level - middle, column, sheared);
        }
    }

    /// Adds the load of a column on a face that lies `head` (units) below the column's level; `sheared` is the shear rate along it (1/s).
    fn face(&mut self, face: &Face, head: f64, column: usize, sheared: DVec3) {
        let liquid = self.liquid;
        let weight = -liquid.params.gravity[1] * liquid.columns.heights.length(head);
        let into = (liquid.mean_velocity(column) - self.velocity).dot(&face.push);
        let stagnant = if into > 0.0 { 0.5 * into * into } else { 0.0 };
        let along = sheared - face.push * sheared.dot(&face.push);
        let friction = along * liquid.params.liquid.viscosity_at(along.norm());
        let [pressure, drag] =
            [face.push * weight, face.push * stagnant + friction].map(|of| of * (self.density * face.area));
        self.pressure += pressure;
        self.drag += drag;
        let arm = face.at - self.middle;
        self.torque += (arm - DVec3::y() * face.lower).cross(&pressure) + arm.cross(&drag);
        self.wetted += face.area;
    }
}
