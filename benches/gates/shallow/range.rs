//! Gate of shallow's range of depths: whatever is asked for, liquid stays between the ground and what is above it.

use crate::common::shallow::{Turn, context, extreme, extreme_frame, violations};

/// Scenes.
const SCENES: u64 = 10_000;
/// Frames of each.
const FRAMES: usize = 12;

/// Depths out of range, and fluxes that are not finite, over random scenes.
pub fn measure() -> (f64, String) {
    let mut sums = Sums::default();
    (0..SCENES).for_each(|seed| sums.add(&flow(seed)));
    let Sums { violations, missing, columns, emptied, filled } = sums;
    let note = format!(
        "{SCENES} scenes of {} columns on average, {missing} with units missing; rows scaled by K_min {emptied}, by K_max \
         {filled}",
        columns / SCENES
    );
    ((violations + missing) as f64, note)
}

/// What a scene did, and all of them.
#[derive(Default)]
struct Sums {
    violations: u64,
    missing: u64,
    columns: u64,
    emptied: u64,
    filled: u64,
}

impl Sums {
    fn add(&mut self, other: &Self) {
        self.violations += other.violations;
        self.missing += other.missing;
        self.columns += other.columns;
        self.emptied += other.emptied;
        self.filled += other.filled;
    }
}

/// One of them.
fn flow(seed: u64) -> Sums {
    let ctx = context();
    let (plan, step) = extreme(seed);
    let mut liquid = plan.make(&ctx, Turn::NONE);
    let mut sums = Sums { columns: liquid.columns().count() as u64, ..Sums::default() };
    for frame in 0..FRAMES {
        let report = extreme_frame(&ctx, &mut liquid, step, frame);
        sums.violations += violations(&liquid) as u64;
        sums.missing += u64::from(liquid.balance().error != 0);
        sums.emptied += report.emptied;
        sums.filled += report.filled;
    }
    sums
}
