//! What the frames of stages take, estimated before they are made.

use std::ops::RangeInclusive;

/// What each frame of a shot takes in each stage (s), on the computer where stages were measured: for comparison with one another.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct FrameCosts {
    first: i32,
    stages: Vec<(&'static str, Vec<f64>)>,
}

impl FrameCosts {
    /// Of a shot whose first frame is `first`.
    pub fn new(first: i32) -> Self {
        Self { first, stages: Vec::new() }
    }

    /// Adds those of a stage, from the shot's first frame on (s, greater than 0).
    pub fn add(&mut self, stage: &'static str, of_frames: Vec<f64>) {
        self.stages.push((stage, of_frames));
    }

    /// The sum over consecutive frames of a stage; a second for each whose cost is not known.
    pub fn sum(&self, stage: &str, frames: RangeInclusive<i32>) -> f64 {
        let known = self.stages.iter().find(|(name, _)| *name == stage).map(|(_, costs)| costs);
        let cost = |frame: i32| known?.get(usize::try_from(frame - self.first).ok()?).copied();
        frames.map(|frame| cost(frame).unwrap_or(1.0)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_that_are_not_known_cost_a_second() {
        let mut costs = FrameCosts::new(-1);
        costs.add("base", vec![0.5, 0.25]);
        assert_eq!([-1..=-1, -1..=0, 0..=1].map(|frames| costs.sum("base", frames)), [0.5, 0.75, 1.25]);
        assert_eq!(costs.sum("mist", 3..=4), 2.0);
    }
}
