//! What a run says of the time that it will take, and `frazil check` of its memory.

use super::made::{Made, Progress};

/// The share of a run after which the time left must be right.
const KNOWN_FROM: f64 = 0.2;
/// Shares of time left below which a factor means nothing: the files of the last frames are being written.
const NEARLY_DONE: f64 = 0.03;

/// The greatest factor between two numbers, either way.
fn factor(a: f64, b: f64) -> f64 {
    if a > 0.0 && b > 0.0 { (a / b).max(b / a) } else { f64::INFINITY }
}

/// The worst of some factors, and all in words.
fn worst(of: impl Iterator<Item = (f64, &'static str)>) -> (f64, String) {
    let all: Vec<(f64, &str)> = of.collect();
    let note: Vec<String> = all.iter().map(|(factor, name)| format!("{name} {factor:.2}")).collect();
    (all.iter().map(|(factor, _)| *factor).fold(0.0, f64::max), note.join(", "))
}

/// The worst factor between the time left that was said and that it took, from a fifth of a run on.
pub fn time_left(shots: &[Made]) -> (f64, String) {
    worst(shots.iter().map(|shot| {
        let share = |progress: &&Progress| progress.at / shot.seconds;
        let counted = |progress: &&Progress| (KNOWN_FROM..1.0 - NEARLY_DONE).contains(&share(progress));
        let factors = shot.progress.iter().filter(counted);
        let factors = factors.map(|progress| factor(progress.left, shot.seconds - progress.at));
        (factors.fold(1.0, f64::max), shot.name)
    }))
}

/// The worst factor between the memory that was forecast and that was taken.
pub fn memory(shots: &[Made]) -> (f64, String) {
    worst(shots.iter().map(|shot| (factor(shot.memory[0], shot.memory[1]), shot.name)))
}
