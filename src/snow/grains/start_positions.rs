//! State of grains at the beginning of the last step: mist is raised along their paths from there.

use super::Grains;
use super::heap::Start;
use crate::geometry::DVec3;

impl Grains {
    /// Position and velocity of each grain at the beginning of the last step; for grains that the step created, the position of birth, at
    /// rest. None before the first step, and for grains that were emitted since.
    pub fn starts(&self) -> impl Iterator<Item = Option<Start>> + '_ {
        let [first, end] = self.starts.born;
        self.ids().iter().zip(self.rests()).map(move |(id, rest)| {
            let is_born = || (first..end).contains(id).then(|| (DVec3::from(rest.map(f64::from)), [0.0; 3]));
            self.starts.find(*id).or_else(is_born)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Base, Params, Surroundings};
    use super::*;
    use crate::context::{Context, Pool};

    #[test]
    fn grains_know_where_their_last_step_began() {
        let ctx = Context::new(Pool::new(1).unwrap());
        let mut grains = Grains::new(Params::for_cell(0.02)).unwrap();
        let around = Surroundings {
            base: Base::Missing,
            objects: &[],
            statics: &[],
            ground: &[],
            floor: None,
            lowest: -100.0,
        };
        grains.emit(&[DVec3::zeros(), DVec3::x()], &[[0.0, 1.0, 0.0], [0.0; 3]], 0).unwrap();
        assert!(grains.starts().all(|start| start.is_none()));
        let by_id = |grains: &Grains| {
            let mut all: Vec<(u32, Start)> =
                grains.ids().iter().copied().zip(grains.positions().zip(grains.velocities())).collect();
            all.sort_by_key(|(id, _)| *id);
            all
        };
        for frame in 1..=3 {
            let before = by_id(&grains);
            let times = [f64::from(frame) / 24.0, f64::from(frame + 1) / 24.0];
            grains.step(&ctx, &around, times, frame).unwrap();
            let mut starts: Vec<(u32, Start)> =
                grains.ids().iter().copied().zip(grains.starts().map(Option::unwrap)).collect();
            starts.sort_by_key(|(id, _)| *id);
            assert_eq!(starts, before);
            // A failed step does not count.
            ctx.cancel();
            assert!(grains.step(&ctx, &around, times, frame).is_err());
            ctx.reset();
            assert!(grains.starts().flatten().eq(grains.ids().iter().map(|id| before[*id as usize].1)));
        }
        grains.emit(&[DVec3::y()], &[], 3).unwrap();
        assert_eq!(grains.starts().filter(Option::is_none).count(), 1);
    }
}
