//! Gates of currents down the incline of the thesis' Fig. 4.14, with its three viscosities, on cells as large as the current is deep, against Huppert's film
//! (1982); and what other models of friction do to a film: Mould and Yang's drag (1997), which knows no depth, and explicit viscosity.

use frazil::Context;
use frazil::shallow::Params;
use frazil::shallow::params::Friction;

use crate::common::shallow::context;
use crate::harness::Harness;
use crate::shallow::ground::{G, between, dry, front, ground, ratios, run_until, viscous};

/// The incline's slope, and viscosities (m2/s).
const SLOPE: f64 = 0.35;
const VISCOSITIES: [f64; 3] = [1.0e-3, 4.0e-3, 2.0e-2];
/// 1 ml over 16 mm, the width of what is poured (m2), and the first and last position of the front (m): so far that its nose, which theory does not know, is short.
const AREA: f64 = 1.0e-6 / 0.016;
const FIRST: f64 = 0.1;
const LAST: f64 = 0.2;
/// Rows of cells: walls do not reach the middle.
const WIDE: usize = 81;
/// From one position of the front that is measured to the last.
const STEPS: u32 = 6;

/// All gates.
pub fn run(h: &mut Harness) {
    h.measure("shallow.incline_front", fronts);
    h.measure("shallow.mould_yang", mould_yang);
    h.measure("shallow.explicit_step", explicit);
}

fn slowed(viscosity: f64) -> f64 {
    viscosity * (1.0 + SLOPE * SLOPE).powi(2)
}

/// Theory: when the front is at a position (s).
fn time_at(front: f64, viscosity: f64) -> f64 {
    front.powi(3) * 4.0 * slowed(viscosity) / (9.0 * AREA * AREA * G * SLOPE)
}

/// Fronts in the middle of the incline, with each viscosity and friction.
fn fronts() -> (f64, String) {
    let ctx = context();
    let (mut worst, mut notes) = (0.0f64, Vec::new());
    for viscosity in VISCOSITIES {
        let [own, thesis] =
            [Friction::Walls, Friction::Ground].map(|friction| front_off(&ctx, viscosity, friction));
        worst = worst.max(own);
        notes.push(format!("{viscosity} m2/s: {own:.2} %, with friction at the ground only {thesis:.2} %"));
    }
    (worst, format!("cells as large as the front is deep; {}", notes.join("; ")))
}

/// How far the front is off theory at most (%).
fn front_off(ctx: &Context, viscosity: f64, friction: Friction) -> f64 {
    let cell = 1.5 * AREA / LAST;
    let count = (1.15 * LAST / cell) as usize;
    let high = SLOPE * cell * count as f64;
    let solids = ground([count, WIDE], cell, between(0.0, 1.5 * high), |[x, _]| high - SLOPE * x);
    let mut liquid = dry(ctx, &solids, Params { friction, ..viscous(viscosity) });
    let first = (0.1 * FIRST / cell).ceil();
    for cell_at in (0..first as usize).flat_map(|x| (0..WIDE).map(move |z| [x, z])) {
        let column = liquid.columns().column(cell_at, 0).expect("ground everywhere");
        liquid.pour(column, AREA / (first * cell));
    }
    let off = |position: f64| {
        let time = time_at(position, viscosity);
        run_until(&mut liquid, ctx, time, time_at(LAST, viscosity) / 200.0);
        // Half of the depth of theory behind the front.
        100.0 * (front(&liquid, WIDE / 2, 0.75 * AREA / position) / position - 1.0).abs()
    };
    ratios(FIRST, LAST, STEPS).map(off).fold(0.0, f64::max)
}

/// Nusselt's film on the incline (m/s).
fn film(thick: f64, viscosity: f64) -> f64 {
    G * SLOPE * thick * thick / (3.0 * slowed(viscosity))
}

/// A drag that keeps the same part of a flux each second, whatever its depth: right for blood of 0.2 mm, it is tried on films of half and twice the depth.
fn mould_yang() -> (f64, String) {
    let (viscosity, dt) = (4.0e-6, 1.0e-4);
    let kept = 1.0 - G * SLOPE * dt / film(2e-4, viscosity);
    let steady = |_thick: f64| (0..20_000).fold(0.0, |u, _| kept * u + dt * G * SLOPE);
    let off = [1e-4, 2e-4, 4e-4].map(|thick| 100.0 * (steady(thick) / film(thick, viscosity) - 1.0));
    let note =
        format!("films of blood of 0.1, 0.2 and 0.4 mm: {:+.0}, {:+.0} and {:+.0} %", off[0], off[1], off[2]);
    (off.into_iter().map(f64::abs).fold(0.0, f64::max), note)
}

/// The longest stable step of explicit viscosity, by trial: du/dt = g S - 3 nu u / H^2 + nu d2u/dy2 in a channel of 8 cells of 0.5 mm, 1 mm deep.
fn explicit() -> (f64, String) {
    let (cell, thick) = (5e-4, 1e-3);
    let is_stable = |dt: f64, viscosity: f64| {
        let mut u = [0.0f64; 8];
        for _ in 0..20_000 {
            let last = u;
            for i in 0..8 {
                let before = if i > 0 { last[i - 1] } else { -last[i] };
                let behind = if i < 7 { last[i + 1] } else { -last[i] };
                let across = (before - 2.0 * last[i] + behind) / (cell * cell);
                let held = viscosity * (across - 3.0 * last[i] / (thick * thick));
                // Not the same everywhere, as no flow is.
                u[i] += dt * (G * SLOPE * (1.0 + 0.01 * ((i * i) % 3) as f64) + held);
            }
        }
        u.iter().all(|u| u.abs() < 1e3)
    };
    let longest = |viscosity: f64| {
        let mut range = [1e-9f64, 10.0];
        for _ in 0..40 {
            let middle = (range[0] * range[1]).sqrt();
            range[usize::from(!is_stable(middle, viscosity))] = middle;
        }
        1e3 * range[0]
    };
    let [blood, drop, syrup] = [4e-6, 1e-3, 0.4].map(longest);
    let note = format!(
        "syrup of 0.4 m2/s; {drop:.3} ms with 1e-3 m2/s, {blood:.2} ms with 4e-6; ours: 3 ms and as long as one likes"
    );
    (syrup, note)
}
