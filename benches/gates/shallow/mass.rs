//! Gate of shallow's mass: what comes and goes adds up to the last unit.

use frazil::shallow::Shallow;
use frazil::shallow::material::Liquid;

use crate::common::bodies::Dice;
use crate::common::shallow::{Turn, busy, context};

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
    let all = liquid.balance();
    let ml = [all.poured, all.sourced, all.drained, all.absorbed, all.lost, all.inside].map(|v| v * 1e6);
    let [poured, sourced, drained, absorbed, lost, inside] = ml;
    let note = format!(
        "{steps} steps, {} links; ml poured {poured:.1}, sourced {sourced:.1}, drained {drained:.1}, absorbed \
         {absorbed:.1}, lost {lost:.1}, inside {inside:.1}",
        plan.links()
    );
    (f64::from(wrong), note)
}

/// Something that a trainer does between frames.
fn change(liquid: &mut Shallow, dice: &mut Dice) {
    // Liquid is poured, or dabbed off, here and there.
    for _ in 0..200 {
        let column = dice.below(liquid.columns().len());
        if liquid.columns().is_column(column) {
            liquid.pour(column, dice.between(-2e-3, 1e-3));
        }
    }
    // It gets another viscosity, and the table leans.
    let mut params = liquid.params().clone();
    params.liquid = Liquid::new([0.0, 1e-6, 4e-6, 4e-5, 4e-1][dice.below(5)]);
    params.gravity = [dice.between(-3.0, 3.0), -9.81, dice.between(-3.0, 3.0)];
    liquid.set_params(params).expect("parameters");
    // Moving terrain comes here.
}
