//! Gate of shallow's mass: what comes and goes adds up to the last unit.

use crate::common::bodies::Dice;
use crate::common::shallow::{Turn, busy, context};
use crate::shallow::ground::{change, fate};

/// Steps of the run.
const STEPS: u32 = 100_000;
/// Frames between changes.
const EVERY: u32 = 25;

/// Frames after which units are missing, or too many.
pub fn measure() -> (f64, String) {
    let ctx = context();
    let plan = busy([93, 61]);
    let mut liquid = plan.make(&ctx, Turn::NONE);
    let mut dice = Dice(17);
    let (mut steps, mut frame, mut wrong) = (0, 0, 0);
    while steps < STEPS {
        if frame % EVERY == 0 {
            change(&mut liquid, &mut dice);
        }
        steps += liquid.step(&ctx, 1.0 / 60.0).expect("a frame").steps;
        wrong += u32::from(liquid.balance().error != 0);
        frame += 1;
    }
    let note = format!("{steps} steps, {} links; {}", plan.links(), fate(&liquid.balance()));
    (f64::from(wrong), note)
}
