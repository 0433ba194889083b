//! Gates of the energy of standing waves in a closed basin.
//!
//! Depths and fluxes leap over each other: a flux lies half a step before the depths that it makes, and half a step behind those that drive it.
//! At the time of the depths the flux of a pipe is the mean f of the two around them; its kinetic energy is rho f^2 dx / (2 A), with the wetted
//! section A = dx H between both columns, and that of a column is rho g dx^2 eta^2 / 2, potential.

use frazil::Context;
use frazil::shallow::Shallow;

use crate::common::liquids::context;
use crate::plots::Plot;
use crate::shallow::ground::{G, between, dry, even, ground, pour, viscous};

/// Cells along an edge of the basin: a wave.
const CELLS: usize = 128;
const CELL: f64 = 1.0e-3;
/// Depth at rest (m), and heights of the waves over it.
const DEEP: f64 = 0.01;
const AMPLITUDES: [f64; 2] = [0.01, 0.1];
const STEPS: usize = 10_000;
/// Energy is summed after so many steps; a period is 256.
const SAMPLE: usize = 16;
const PERIOD: usize = 256 / SAMPLE;
/// Water (m2/s).
const WATER: f64 = 1.0e-6;

pub fn measure() -> [(f64, String); 3] {
    let ctx = context(0);
    let [free, steep] = AMPLITUDES.map(|amplitude| Waves::run(&ctx, 0.0, amplitude));
    let most = |waves: &Waves| waves.energies.iter().fold(0.0f64, |most, energy| most.max(*energy));
    let note = |waves: &Waves| format!("{:.6} at the end", waves.energies[waves.energies.len() - 1]);
    let slowed = AMPLITUDES.map(|amplitude| Waves::run(&ctx, WATER, amplitude));
    let growth = |waves: &Waves| {
        let pairs = waves.energies.iter().zip(&waves.energies[PERIOD..]);
        pairs.map(|(before, behind)| behind / before - 1.0).fold(f64::MIN, f64::max)
    };
    let growths = slowed.each_ref().map(growth);
    let of_growth = format!("water, waves of 1 % and 10 % of the depth: {growths:.6?}");
    let [slowed, _] = slowed;
    let shown = |waves: &Waves| -> Vec<[f64; 2]> {
        let energies = waves.energies.iter().enumerate().step_by(24);
        energies.map(|(n, energy)| [n as f64 / PERIOD as f64, *energy]).collect()
    };
    let periods = STEPS as f64 / (PERIOD * SAMPLE) as f64;
    let decay = |t: f64| (-3.0 * WATER / (DEEP * DEEP) * t * slowed.period).exp();
    Plot::linear("Energy of standing waves", "time (periods)", "energy over its start")
        .line("theory, nu = 0", [[0.0, 1.0], [periods, 1.0]])
        .line("theory, water", even(0.0, periods, 50).map(|t| [t, decay(t)]))
        .points("pipes, nu = 0", shown(&free))
        .points("pipes, water", shown(&slowed))
        .write("shallow_energy");
    [(most(&free), note(&free)), (most(&steep), note(&steep)), (growths[0].max(growths[1]), of_growth)]
}

/// Waves that have run.
struct Waves {
    /// Energy over its start, at every sample.
    energies: Vec<f64>,
    /// Their period (s).
    period: f64,
}

impl Waves {
    /// Waves as high as a share of the depth, in a liquid of a viscosity (m2/s).
    fn run(ctx: &Context, viscosity: f64, amplitude: f64) -> Self {
        let solids = ground([CELLS; 2], CELL, between(0.0, 2.0 * DEEP), |_| 0.0);
        let mut shallow = dry(ctx, &solids, viscous(viscosity));
        let k = std::f64::consts::TAU / (CELLS as f64 * CELL);
        pour(&mut shallow, |[x, z]| DEEP * (1.0 + amplitude * (k * x).cos() * (k * z).cos()));
        let speed = (G * DEEP).sqrt();
        let dt = 0.5 * CELL / (speed * std::f64::consts::SQRT_2);
        // At rest.
        let first = energy(&shallow, shallow.depths(), &shallow.fluxes().map(<[f32]>::to_vec), dt);
        let mut energies = vec![1.0];
        for _ in 0..STEPS / SAMPLE {
            shallow.replay(ctx, &[dt; SAMPLE - 1]).expect("steps");
            let before = shallow.fluxes().map(<[f32]>::to_vec);
            let depths = shallow.depths().to_vec();
            shallow.replay(ctx, &[dt]).expect("a step");
            energies.push(energy(&shallow, &depths, &before, dt) / first);
        }
        Self { energies, period: std::f64::consts::TAU / (speed * k * std::f64::consts::SQRT_2) }
    }
}

/// Energy over rho, of depths (units), and of the fluxes of the steps before and behind them; the last step is the latter.
fn energy(shallow: &Shallow, depths: &[i32], before: &[Vec<f32>; 2], dt: f64) -> f64 {
    let (columns, behind) = (shallow.columns(), shallow.fluxes());
    let unit = columns.heights.unit;
    let area = CELL * CELL;
    let index = |x: usize, z: usize| columns.column([x, z], 0).expect("water everywhere");
    let mut sum = 0.0;
    for z in 0..CELLS {
        for x in 0..CELLS {
            let i = index(x, z);
            let own = f64::from(depths[i]) * unit;
            sum += 0.5 * G * area * (own - DEEP).powi(2);
            for (axis, beyond) in [(0, [x + 1, z]), (1, [x, z + 1])] {
                if beyond[axis] < CELLS {
                    let other = f64::from(depths[index(beyond[0], beyond[1])]) * unit;
                    let mean = 0.5 * (f64::from(before[axis][i]) + f64::from(behind[axis][i]));
                    let flux = mean * unit * area / dt;
                    // A = dx H.
                    sum += flux * flux / (own + other);
                }
            }
        }
    }
    sum
}
