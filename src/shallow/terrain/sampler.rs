//! Solids of signed distances, such as OpenVDB level sets: the caller supplies a function that samples a batch of positions.

use super::Solids;
use super::solids::{Solid, unite};
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::numeric::lists::refill;
use crate::shallow::columns::grid::{BOTTOMLESS, Grid, Heights, TOP};

/// Positions per batch.
const BATCH: u64 = 1 << 14;
/// Maximum number of samples on a line, without its ends.
const MAX_SAMPLES: f64 = (1 << 24) as f64;
/// Maximum length of a line in voxels.
const MAX_STEPS: f64 = 1e15;

/// The solids of every cell: where distances are negative. Each line is sampled from the minimum height up in steps of a voxel (m), and
/// sign changes are located by linear interpolation; solids and gaps thinner than a voxel may be missed. What is solid at the minimum
/// height has no lower end.
///
/// Below and above the heights `between` (m) distances must not change their sign: only the ends of the lines are sampled there, so that a
/// level set may lie in a height range of any length.
///
/// `sample` gets positions (m), at most 16,384 at a time, and replaces the contents of its second argument by their distances (m).
///
/// # Errors
/// `Argument`: a grid that [`Grid::validate`] refuses, a voxel that is not a positive length or too small for the heights, a count of
/// distances that is not that of positions, a distance that is not finite. Also what `sample` returns.
pub fn solids(
    grid: Grid,
    heights: Heights,
    voxel: f64,
    between: [f64; 2],
    mut sample: impl FnMut(&[DVec3], &mut Vec<f32>) -> Result<()>,
) -> Result<Solids> {
    grid.validate()?;
    let samples = SampleHeights::new(heights, voxel, between)?;
    let mut out = Solids::empty(grid, heights);
    let (mut positions, mut distances) = (Vec::new(), Vec::new());
    let mut line = Line::default();
    let count = grid.cells() as u64 * samples.count;
    let mut next = 0;
    while next < count {
        let end = count.min(next + BATCH);
        refill(&mut positions, (next..end).map(|index| samples.position(&grid, index)));
        sample(&positions, &mut distances)?;
        if distances.len() != positions.len() {
            let (got, wanted) = (distances.len(), positions.len());
            return Err(Error::argument(format!(
                "the sampler returned {got} distances for {wanted} positions"
            )));
        }
        for ((position, distance), index) in positions.iter().zip(&distances).zip(next..) {
            if !distance.is_finite() {
                let [x, y, z] = [position.x, position.y, position.z];
                return Err(Error::argument(format!("the sampler returned {distance} m at ({x}, {y}, {z})")));
            }
            line.add_sample(position.y, f64::from(*distance), &heights);
            if (index + 1) % samples.count == 0 {
                line.finish();
                out.push(&line.solids);
                line.solids.clear();
            }
        }
        next = end;
    }
    Ok(out)
}

/// The heights at which each line is sampled.
struct SampleHeights {
    low: f64,
    high: f64,
    voxel: f64,
    /// Height of the second sample above the first one (voxels).
    first: u64,
    /// Count of samples, including both ends.
    count: u64,
}

impl SampleHeights {
    fn new(heights: Heights, voxel: f64, between: [f64; 2]) -> Result<Self> {
        let (low, high) = (heights.low, heights.metres(TOP));
        if !(voxel > 0.0 && voxel.is_finite()) {
            return Err(Error::argument(format!("a voxel of {voxel} m is not a positive length")));
        }
        let steps = ((high - low) / voxel).ceil();
        // The samples around `between`; none if it does not overlap the range of heights.
        let first = ((between[0] - low) / voxel).floor().clamp(1.0, steps.max(1.0));
        let end = (((between[1] - low) / voxel).ceil() + 1.0).clamp(first, steps.max(1.0));
        if steps < 1.0 || end - first >= MAX_SAMPLES || steps >= MAX_STEPS {
            return Err(Error::argument(format!(
                "a voxel of {voxel} m is too small for heights from {low} to {high} m"
            )));
        }
        Ok(Self { low, high, voxel, first: first as u64, count: (end - first) as u64 + 2 })
    }

    /// Position of a sample; samples are numbered upward, line by line.
    fn position(&self, grid: &Grid, index: u64) -> DVec3 {
        let (cell, step) = ((index / self.count) as usize, index % self.count);
        let [x, z] = grid.centre([cell % grid.size[0], cell / grid.size[0]]);
        let y = match step {
            0 => self.low,
            step if step + 1 == self.count => self.high,
            step => self.low + (self.first + step - 1) as f64 * self.voxel,
        };
        DVec3::new(x, y, z)
    }
}

/// A line as it is sampled upward.
#[derive(Default)]
struct Line {
    /// Height and distance of the sample below (m).
    below: Option<[f64; 2]>,
    /// The bottom of the solid that contains the sample below.
    bottom: Option<i32>,
    solids: Vec<Solid>,
}

impl Line {
    fn add_sample(&mut self, height: f64, distance: f64, heights: &Heights) {
        let is_solid = distance < 0.0;
        match self.below {
            None => self.bottom = is_solid.then_some(BOTTOMLESS),
            Some([from, before]) if is_solid != (before < 0.0) => {
                let part = before / (before - distance);
                let border = heights.round(from + part * (height - from));
                match self.bottom.take() {
                    Some(bottom) => self.add_solid([bottom, border]),
                    None => self.bottom = Some(border),
                }
            }
            Some(_) => {}
        }
        self.below = Some([height, distance]);
    }

    /// Adds a solid that is at least one unit high.
    fn add_solid(&mut self, solid: Solid) {
        if solid[0] < solid[1] {
            self.solids.push(solid);
        }
    }

    /// Ends the line at the maximum height; before the next one begins, the caller takes its solids.
    fn finish(&mut self) {
        if let Some(bottom) = self.bottom.take() {
            self.add_solid([bottom, TOP]);
        }
        self.below = None;
        unite(&mut self.solids);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { cell: 0.1, origin: [-1.0, -1.0], size: [20, 20] };

    fn heights() -> Heights {
        Heights::between(-1.0, 1.0).unwrap()
    }

    fn of(voxel: f64, distance: impl Fn(DVec3) -> f64) -> Result<Solids> {
        let mut largest = 0;
        let found = solids(GRID, heights(), voxel, [-1.0, 1.0], |positions, out| {
            largest = largest.max(positions.len());
            refill(out, positions.iter().map(|position| distance(*position) as f32));
            Ok(())
        });
        assert!(largest <= 1 << 14, "{largest}");
        found
    }

    #[test]
    fn a_shell_over_ground_has_three_solids_a_line() {
        let ground = |position: DVec3| position.y + 0.8;
        let shell = |position: DVec3| ((position - DVec3::new(0.0, 0.1, 0.0)).norm() - 0.5).abs() - 0.1;
        let found = of(0.03, |position| ground(position).min(shell(position))).unwrap();
        let mut layers = [0; 4];
        for z in 0..20 {
            for x in 0..20 {
                let cell = [x, z];
                let [px, pz] = GRID.centre(cell);
                let across = px * px + pz * pz;
                let reach = |radius: f64| (radius * radius - across).max(0.0).sqrt();
                let borders = [0.1 - reach(0.6), 0.1 - reach(0.4), 0.1 + reach(0.4), 0.1 + reach(0.6)];
                let solids = found.cell(GRID.index(cell));
                layers[solids.len()] += 1;
                assert_eq!(solids[0][0], BOTTOMLESS);
                assert!((heights().metres(solids[0][1]) + 0.8).abs() < 1e-6, "{cell:?}");
                // Near the rims a line is almost tangent.
                if solids.len() == 3 && reach(0.4) > 0.2 {
                    let metres = solids[1..].as_flattened().iter().map(|&units| heights().metres(units));
                    for (found, border) in metres.zip(borders) {
                        assert!((found - border).abs() < 0.002, "{cell:?}: {found} is not {border}");
                    }
                }
            }
        }
        assert!(layers[1] > 200 && layers[2] > 20 && layers[3] > 40 && layers[0] == 0, "{layers:?}");
    }

    #[test]
    fn what_is_solid_at_both_ends_of_the_range_goes_on_there() {
        let found = of(0.3, |position| 0.25 - position.y.abs()).unwrap();
        let units = |metres: f64| heights().round(metres);
        let [low, high] = [found.cell(7)[0], found.cell(7)[1]];
        assert_eq!((low[0], high[1], found.cell(7).len()), (BOTTOMLESS, TOP, 2));
        assert!(
            (low[1] - units(-0.25)).abs() < 100 && (high[0] - units(0.25)).abs() < 100,
            "{low:?} {high:?}"
        );
    }

    #[test]
    fn a_range_of_any_length_has_samples_where_distances_change_only() {
        let ball = |position: DVec3| (position.norm() - 0.55) as f32;
        let count = std::cell::Cell::new(0);
        let of = |heights: Heights, between: [f64; 2]| {
            count.set(0);
            let found = solids(GRID, heights, 0.1, between, |positions, out| {
                count.set(count.get() + positions.len());
                refill(out, positions.iter().map(|position| ball(*position)));
                Ok(())
            });
            found.unwrap()
        };
        let tall = Heights::between(-65_000.0, 66_000.0).unwrap();
        let found = of(tall, [-0.6, 0.6]);
        assert!(count.get() < 20 * 400, "{}", count.get());
        let middle = found.cell(GRID.index([10, 10]));
        let metres = middle.as_flattened().iter().map(|&units| tall.metres(units));
        assert!(
            middle.len() == 1
                && metres.zip([-0.55, 0.55]).all(|(found, wanted)| (found - wanted).abs() < 0.01),
            "{middle:?}"
        );
        // The same samples as for the whole range, and so the same solids.
        let whole = of(heights(), [-1.0, 1.0]);
        let part = of(heights(), [-0.6, 0.6]);
        assert!((0..GRID.cells()).all(|cell| whole.cell(cell) == part.cell(cell)));
        // A ball that lies above the range, or around all of it.
        assert!(
            (0..GRID.cells())
                .all(|cell| of(Heights::between(-9.0, -7.0).unwrap(), [-0.6, 0.6]).cell(cell).is_empty())
        );
        let inside = of(Heights::between(-0.1, 0.1).unwrap(), [-0.6, 0.6]);
        assert_eq!(inside.cell(GRID.index([10, 10])), [[BOTTOMLESS, TOP]]);
    }

    #[test]
    fn long_lines_are_sampled_in_several_batches() {
        let found = of(0.00005, |position| (position.y - 0.3).abs() - 0.2).unwrap();
        for cell in [0, 1, 399] {
            let [[bottom, top]] = *found.cell(cell) else { panic!("{:?}", found.cell(cell)) };
            let metres = [bottom, top].map(|units| heights().metres(units));
            assert!((metres[0] - 0.1).abs() < 1e-6 && (metres[1] - 0.5).abs() < 1e-6, "{metres:?}");
        }
    }

    #[test]
    fn bad_input_is_a_sentence() {
        let message = |found: Result<Solids>| found.unwrap_err().to_string();
        assert_eq!(message(of(0.0, |_| 1.0)), "a voxel of 0 m is not a positive length");
        let what = "a voxel of 0.00000001 m is too small for heights from -1 to 1 m";
        assert_eq!(message(of(1e-8, |_| 1.0)), what);
        let nan = of(0.5, |position| if position.y == 0.0 { f64::NAN } else { 1.0 });
        assert_eq!(message(nan), "the sampler returned NaN m at (-0.95, 0, -0.95)");
        let few = solids(GRID, heights(), 0.5, [-1.0, 1.0], |_, out| {
            *out = vec![1.0; 3];
            Ok(())
        });
        assert_eq!(message(few), "the sampler returned 3 distances for 2000 positions");
        let refused = solids(GRID, heights(), 0.5, [-1.0, 1.0], |_, _| Err(Error::argument("no grid")));
        assert_eq!(message(refused), "no grid");
    }
}
