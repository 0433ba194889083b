//! The same bytes from any number of threads.

use frazil::shallow::columns::grid::{BOTTOMLESS, Heights};
use frazil::shallow::pipes::Border;
use frazil::shallow::sources::Kind;
use frazil::shallow::terrain::Solids;
use frazil::shallow::{Params, Shallow};
use frazil::{Context, Pool};

use crate::common::flowing::{from_corner, point, pour_each};

/// Waves on uneven ground with shelves above it, too low for some of the liquid, in over 100,000 columns.
fn shelves(ctx: &Context) -> Shallow {
    let size = 300;
    let heights = Heights::between(0.0, 0.1).unwrap();
    let solids = Solids::new(
        from_corner(0.0005, [size, size]),
        heights,
        (0..size * size).map(|index| {
            let (x, z) = (index % size, index / size);
            let rise = heights.round(0.0005 + 0.0001 * ((x * 7 + z * 3) % 11) as f64 + 0.00002 * x as f64);
            let shelf = [rise + heights.round(0.002), rise + heights.round(0.003)];
            if (x / 20 + z / 30) % 3 > 0 { vec![[BOTTOMLESS, rise], shelf] } else { vec![[BOTTOMLESS, rise]] }
        }),
    );
    let params = Params { border: Border::Open, ..Params::default() };
    let mut liquid = Shallow::new(ctx, &solids, params).unwrap();
    pour_each(&mut liquid, |[x, z]| 0.0001 * ((x * x + 5 * z) % 23) as f64);
    let source = point(Kind::Source, [0.07, 0.0, 0.0745], 0.004, 4e-6);
    liquid.set_flows(&[source], |_| "the source".into()).unwrap();
    liquid
}

#[test]
fn bands_of_rows_find_the_same_numbers() {
    let run = |threads: usize| {
        let ctx = Context::new(Pool::new(threads).unwrap());
        let mut liquid = shelves(&ctx);
        let reports: Vec<_> = (0..3).map(|_| liquid.step(&ctx, 1.0 / 60.0).unwrap()).collect();
        (liquid, reports)
    };
    let (alone, reports) = run(0);
    assert!(reports[0].emptied > 0 && reports.iter().all(|report| report.filled > 0), "{reports:?}");
    assert_eq!(alone.balance().error, 0);
    assert!(alone.balance().lost > 0.0);
    for threads in [2, 3, 5] {
        let (other, others) = run(threads);
        assert_eq!(others, reports, "{threads} threads");
        assert!(alone.depths() == other.depths(), "{threads} threads");
        assert!(alone.fluxes() == other.fluxes(), "{threads} threads");
        assert_eq!(alone.balance(), other.balance());
    }
}

#[test]
fn a_frame_within_a_budget_is_replayed_to_the_same_bytes() {
    let ctx = Context::new(Pool::new(0).unwrap());
    let (mut hasty, mut replayed) = (shelves(&ctx), shelves(&ctx));
    for _ in 0..3 {
        let report = hasty.step_within(&ctx, 1.0 / 60.0, 1e-9).unwrap();
        assert_eq!(report.steps, 1, "the budget is over after the first");
        assert!(report.seconds < 1.0 / 60.0);
        replayed.replay(&ctx, hasty.last_steps()).unwrap();
    }
    assert!(hasty.depths() == replayed.depths());
    assert_eq!(hasty.balance().error, 0);
    assert!(hasty.step_within(&ctx, 0.01, 0.0).unwrap_err().to_string().contains("budget"));
    assert!(hasty.replay(&ctx, &[0.001, 0.0]).unwrap_err().to_string().contains("step of 0 s"));
    assert!(hasty.step(&ctx, f64::NAN).unwrap_err().to_string().contains("NaN"));
}
