//! Stains on the ground, which fade, and liquid that the ground absorbs. Both are stored at the vertices of the terrain's mesh, and move
//! with it where it deforms.
//!
//! A vertex is *wet* while a column of its cell has a film within a cell's edge of its height (`wet.rs`). Then its *stain* approaches the
//! value that the liquid there gives; after the vertex has dried, half of the stain fades in each half-life. Fading is computed only when a
//! vertex is read or becomes wet again: dry ground costs nothing. Absorbing ground takes whole units, which the liquid's balance counts.

mod state;
mod wet;

use xxhash_rust::xxh3::xxh3_128;

use super::scalars::MAX_SCALARS;
use super::scalars::amounts::Account;
use super::system::Shallow;
use crate::error::{Error, Result};
use crate::geometry::Vec3;
use crate::numeric::checks::{check_not_negative, check_room};
use wet::WetColumns;

/// Below this, stains are invisible and set to 0, before they are so small that processors give different results.
const INVISIBLE: f64 = 1e-6;

/// How liquid stains the ground.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Staining {
    /// The scalar that stains: a stain is its concentration divided by its range, 0 to 1, so that liquid without it washes stains off.
    /// None: any liquid stains, fully.
    pub scalar: Option<usize>,
    /// Minimum depth of a film that wets (m), 0 and up. Default: 1e-5.
    pub film: f64,
    /// Time (s) in which 63 % of a stain develops or is washed off, 0 and up. Default: 0.2.
    pub takes: f64,
    /// Half-life of a stain on dry ground (s), 1e-3 and up; infinite: it stays. Default: 60.
    pub half_life: f64,
    /// How the ground absorbs liquid; None: it does not.
    pub absorbs: Option<Absorbing>,
}

/// Absorption of the ground: at `rate` while it is dry, decreasing as it fills, by the factor 1 - held / capacity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Absorbing {
    /// Capacity (m: m3 for each m2 of its mesh), above 0; gauze some 1e-3, soft tissue 1e-4.
    pub capacity: f64,
    /// Rate at which dry ground absorbs (m/s), 0 and up.
    pub rate: f64,
}

impl Default for Staining {
    fn default() -> Self {
        Self { scalar: None, film: 1e-5, takes: 0.2, half_life: 60.0, absorbs: None }
    }
}

impl Staining {
    /// Checks the numbers.
    ///
    /// # Errors
    /// `Argument`, naming the field and its range.
    pub fn validate(&self) -> Result<()> {
        check_not_negative("film", self.film)?;
        check_not_negative("takes", self.takes)?;
        if self.half_life.is_nan() || self.half_life < 1e-3 {
            return Err(Error::argument(format!("half_life = {} s is not 0.001 or more", self.half_life)));
        }
        let Some(Absorbing { capacity, rate }) = self.absorbs else { return Ok(()) };
        check_not_negative("absorbs.rate", rate)?;
        if !(capacity > 0.0 && capacity <= 1e3) {
            return Err(Error::argument(format!(
                "absorbs.capacity = {capacity} m is not above 0 and at most 1000"
            )));
        }
        Ok(())
    }
}

/// The stains on a mesh, and the liquid that it has absorbed.
#[derive(Debug, Clone)]
pub struct Stains {
    staining: Staining,
    /// Hash of the mesh's triangles.
    mesh: [u8; 16],
    /// For each vertex, the time when it was last wet (s).
    last_wet: Vec<f64>,
    /// For each vertex, its stain at that time.
    stain: Vec<f32>,
    /// For each vertex, units absorbed. Empty if the ground does not absorb.
    held: Vec<i64>,
    /// For each vertex, units that it can absorb. Empty if the ground does not absorb.
    capacity: Vec<i64>,
    /// Volume of a unit of the liquid (m3).
    unit: f64,
    /// Simulated time at the last update (s).
    time: f64,
    wet: WetColumns,
}

impl Stains {
    /// Clean, dry ground under a liquid: a mesh (positions in m) whose vertices may move, but whose triangles are fixed.
    ///
    /// # Errors
    /// `Argument`: as [`Staining::validate`]; the liquid has no such scalar; a triangle refers to a missing vertex; a vertex is not finite.
    pub fn new(
        liquid: &Shallow,
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        staining: Staining,
    ) -> Result<Self> {
        staining.validate()?;
        let scalars = liquid.scalars().len();
        if let Some(scalar) = staining.scalar.filter(|&scalar| scalar >= scalars) {
            return Err(Error::argument(format!(
                "there is no scalar {scalar} among {scalars} to stain with"
            )));
        }
        let count = positions.len();
        if let Some(bad) = triangles.iter().flatten().find(|&&vertex| vertex as usize >= count) {
            return Err(Error::argument(format!("there is no vertex {bad} among {count}")));
        }
        check_finite(positions)?;
        let unit = unit_of(liquid);
        let bytes: Vec<u8> =
            triangles.as_flattened().iter().flat_map(|vertex| vertex.to_le_bytes()).collect();
        let capacity = staining.absorbs.map_or(Vec::new(), |absorbing| {
            let units = |area: &f64| (absorbing.capacity * area / unit).min(1e15) as i64;
            areas(positions, triangles).iter().map(units).collect()
        });
        Ok(Self {
            staining,
            mesh: xxh3_128(&bytes).to_le_bytes(),
            stain: vec![0.0; count],
            last_wet: vec![f64::NEG_INFINITY; count],
            held: vec![0; capacity.len()],
            capacity,
            unit,
            time: liquid.time(),
            wet: WetColumns::default(),
        })
    }

    /// Count of vertices.
    pub fn len(&self) -> usize {
        self.stain.len()
    }

    /// Whether the mesh has no vertex.
    pub fn is_empty(&self) -> bool {
        self.stain.is_empty()
    }

    /// Advances to the liquid's time; call it once a frame. `positions` are the present positions (m) of the vertices of the liquid's
    /// ground. Allocates nothing after the first call. Returns the volume that the ground has absorbed since the last call (m3).
    ///
    /// # Errors
    /// `Argument`, and nothing changes: a count of vertices other than the mesh's; a vertex that is not finite; a liquid with other units,
    /// or that no longer has the scalar.
    pub fn update(&mut self, liquid: &mut Shallow, positions: &[Vec3]) -> Result<f64> {
        self.check(liquid, positions)?;
        let (last, now) = (self.time, liquid.time());
        self.time = now;
        // The liquid may have been restored to an earlier time.
        let passed = (now - last).max(0.0);
        let heights = liquid.columns.heights;
        self.wet.find(&liquid.columns, &liquid.flow, (self.staining.film / heights.unit).min(2e9) as i32);
        if self.wet.is_empty() {
            return Ok(0.0);
        }
        let approach = 1.0 - libm::exp(-passed / self.staining.takes);
        // 0 / 0: staining takes no time, and none has passed.
        let approach = if approach.is_nan() { 1.0 } else { approach };
        // Share of its free capacity that a vertex absorbs.
        let filled =
            self.staining.absorbs.map_or(0.0, |absorbing| absorbing.rate * passed / absorbing.capacity);
        let mut absorbed = 0;
        for (vertex, position) in positions.iter().enumerate() {
            let Some(column) = self.wet.column_at(&liquid.columns, &liquid.flow.depth, position) else {
                continue;
            };
            let target = match self.staining.scalar {
                Some(scalar) => {
                    let range = liquid.flow.amounts.scalars[scalar].range;
                    (f64::from(liquid.concentration(scalar, column)) / range).clamp(0.0, 1.0)
                }
                None => 1.0,
            };
            let before = self.stain_at(vertex, last);
            let after = before + (target - before) * approach;
            self.stain[vertex] = if after < INVISIBLE { 0.0 } else { after as f32 };
            self.last_wet[vertex] = now;
            if let (Some(held), Some(capacity)) = (self.held.get_mut(vertex), self.capacity.get(vertex)) {
                let room = *capacity - *held;
                let requested = (room as f64 * filled).round_ties_even().min(room as f64) as i64;
                if requested > 0 {
                    let flow = &mut liquid.flow;
                    let taken =
                        -flow.add(&liquid.columns, column, -requested, &[0; MAX_SCALARS], Account::Absorbed);
                    *held += taken;
                    absorbed += taken;
                }
            }
        }
        liquid.flow_points.absorbed += absorbed;
        Ok(absorbed as f64 * self.unit)
    }

    /// The present stain of each vertex, 0 to 1.
    ///
    /// # Errors
    /// `Argument`: `out` does not have one element for each vertex.
    pub fn stains(&self, out: &mut [f32]) -> Result<()> {
        check_room(out.len(), "stains", self.len(), "vertices")?;
        out.iter_mut().zip(self.each()).for_each(|(out, stain)| *out = stain);
        Ok(())
    }

    /// The stain of each vertex.
    pub(crate) fn each(&self) -> impl ExactSizeIterator<Item = f32> {
        (0..self.len()).map(|vertex| self.stain_at(vertex, self.time) as f32)
    }

    /// Absorbed liquid at each vertex as a share of its capacity, 0 to 1; 0 if the ground does not absorb.
    ///
    /// # Errors
    /// As [`Stains::stains`].
    pub fn soaked(&self, out: &mut [f32]) -> Result<()> {
        check_room(out.len(), "soaked fractions", self.len(), "vertices")?;
        out.iter_mut().zip(self.each_soaked()).for_each(|(out, soaked)| *out = soaked);
        Ok(())
    }

    /// Absorbed liquid at each vertex, as a share of its capacity.
    pub(crate) fn each_soaked(&self) -> impl ExactSizeIterator<Item = f32> {
        (0..self.len()).map(|vertex| match (self.held.get(vertex), self.capacity.get(vertex)) {
            (Some(held), Some(capacity)) => *held as f32 / (*capacity).max(1) as f32,
            _ => 0.0,
        })
    }

    /// Volume that the ground has absorbed (m3): part of [`Balance::absorbed`](super::Balance).
    pub fn absorbed(&self) -> f64 {
        self.held.iter().sum::<i64>() as f64 * self.unit
    }

    /// The stain of a vertex at a time (s).
    fn stain_at(&self, vertex: usize, time: f64) -> f64 {
        let (stain, dry) = (f64::from(self.stain[vertex]), time - self.last_wet[vertex]);
        if stain == 0.0 || dry <= 0.0 { stain } else { stain * libm::exp2(-dry / self.staining.half_life) }
    }

    fn check(&self, liquid: &Shallow, positions: &[Vec3]) -> Result<()> {
        if positions.len() != self.len() {
            let (given, count) = (positions.len(), self.len());
            return Err(Error::argument(format!(
                "{given} vertices are not the {count} of the terrain that is stained"
            )));
        }
        if unit_of(liquid).to_bits() != self.unit.to_bits() {
            return Err(Error::argument("the stains were made for a liquid with other cells or heights"));
        }
        let scalars = liquid.scalars().len();
        if let Some(scalar) = self.staining.scalar.filter(|&scalar| scalar >= scalars) {
            return Err(Error::argument(format!(
                "there is no scalar {scalar} among {scalars} to stain with"
            )));
        }
        check_finite(positions)
    }
}

/// Volume of a unit (m3).
fn unit_of(liquid: &Shallow) -> f64 {
    let columns = liquid.columns();
    columns.grid.cell * columns.grid.cell * columns.heights.unit
}

fn check_finite(positions: &[Vec3]) -> Result<()> {
    let finite = |position: &Vec3| position.iter().fold(true, |all, number| all & number.is_finite());
    match positions.iter().position(|position| !finite(position)) {
        Some(vertex) => Err(Error::argument(format!("vertex {vertex} of the terrain is not finite"))),
        None => Ok(()),
    }
}

/// A third of the area of the triangles around each vertex (m2).
fn areas(positions: &[Vec3], triangles: &[[u32; 3]]) -> Vec<f64> {
    let mut areas = vec![0.0; positions.len()];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|vertex| positions[vertex as usize].cast::<f64>());
        let area = 0.5 * (b - a).cross(&(c - a)).norm();
        triangle.iter().for_each(|&vertex| areas[vertex as usize] += area / 3.0);
    }
    areas
}
