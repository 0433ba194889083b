//! Times of the phases that run with a context, collected by the callers of the work around them.

use std::sync::{Arc, Mutex, Weak};
use std::time::Duration;

use super::locking::lock;

/// How long one phase took, over all its runs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PhaseTime {
    /// Name of the phase.
    pub name: &'static str,
    /// Wall-clock time, summed over the runs.
    pub time: Duration,
    /// How many times it ran.
    pub count: usize,
}

/// Collects the phases that run with a context, from [`super::Context::collect`] until this is dropped.
#[must_use]
#[derive(Debug)]
pub struct Phases(Arc<Mutex<Vec<PhaseTime>>>);

impl Phases {
    /// One entry for each phase so far, in the order of their first runs.
    pub fn times(&self) -> Vec<PhaseTime> {
        lock(&self.0).clone()
    }
}

/// The collectors of a context. A new one may start while others collect, and each gets every phase.
#[derive(Default)]
pub(super) struct Collectors(Mutex<Vec<Weak<Mutex<Vec<PhaseTime>>>>>);

impl Collectors {
    /// A new one, with no phases yet.
    pub(super) fn collect(&self) -> Phases {
        let phases = Phases(Arc::default());
        lock(&self.0).push(Arc::downgrade(&phases.0));
        phases
    }

    /// Adds a run of a phase to all of them, and drops those that are gone.
    pub(super) fn add(&self, name: &'static str, time: Duration) {
        lock(&self.0).retain(|phases| {
            let Some(phases) = phases.upgrade() else { return false };
            let mut phases = lock(&phases);
            match phases.iter_mut().find(|phase| phase.name == name) {
                Some(phase) => {
                    phase.time += time;
                    phase.count += 1;
                }
                None => phases.push(PhaseTime { name, time, count: 1 }),
            }
            true
        });
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Context, Pool};
    use super::*;
    use crate::error::Error;

    fn names(times: &[PhaseTime]) -> Vec<(&'static str, usize)> {
        times.iter().map(|phase| (phase.name, phase.count)).collect()
    }

    fn context() -> Context {
        Context::new(Pool::new(1).unwrap())
    }

    #[test]
    fn a_phase_that_runs_many_times_is_one_entry_with_their_sum() {
        let ctx = context();
        let phases = ctx.collect();
        let pause = Duration::from_millis(2);
        for _ in 0..5 {
            ctx.phase("wait", || {
                std::thread::sleep(pause);
                Ok(())
            })
            .unwrap();
            ctx.phase("rest", || Ok(())).unwrap();
        }
        let times = phases.times();
        assert_eq!(names(&times), [("wait", 5), ("rest", 5)]);
        assert!(times[0].time >= 5 * pause);
    }

    #[test]
    fn a_step_has_its_own_phases_and_an_outer_collector_has_those_of_all_steps() {
        let ctx = context();
        let run = ctx.collect();
        ctx.phase("before", || Ok(())).unwrap();
        let step = || {
            ctx.step(2, || {
                ctx.phase("move", || Ok(()))?;
                ctx.commit(|| Ok(()))
            })
        };
        for _ in 0..3 {
            let ((), times) = step().unwrap();
            assert_eq!(names(&times), [("move", 1), ("commit", 1)]);
        }
        assert_eq!(names(&run.times()), [("before", 1), ("move", 3), ("commit", 3)]);
    }

    #[test]
    fn a_collector_has_nothing_from_before_it_and_nothing_of_a_step_that_failed_is_left_to_the_next() {
        let ctx = context();
        let fails = || -> crate::Result<()> { Err(Error::argument("no")) };
        assert!(ctx.step(1, || ctx.phase("fall", fails)).is_err());
        let ((), times) = ctx.step(1, || ctx.phase("stand", || Ok(()))).unwrap();
        assert_eq!(names(&times), [("stand", 1)]);
        assert!(ctx.collect().times().is_empty());
    }

    #[test]
    fn the_fraction_of_a_step_grows_from_0_to_1_and_is_unknown_outside() {
        let ctx = context();
        assert_eq!(ctx.progress().fraction, None);
        let seen = Mutex::new(Vec::new());
        let look = || -> crate::Result<()> {
            lock(&seen).push(ctx.progress().fraction.unwrap());
            Ok(())
        };
        let cut = || {
            look()?;
            ctx.expect(2);
            ctx.advance();
            look()
        };
        let step = || {
            look()?;
            ctx.phase("cut", cut)?;
            look()?;
            ctx.phase("whole", look)?;
            ctx.commit(look)?;
            look()
        };
        ctx.step(4, step).unwrap();
        assert_eq!(*lock(&seen), [0.0, 0.0, 0.125, 0.25, 0.25, 0.5, 0.75]);
        assert_eq!(ctx.progress().fraction, None);
        // More phases than were planned.
        let fraction = ctx.step(1, || {
            ctx.phase("a", || Ok(()))?;
            ctx.phase("b", || Ok(ctx.progress().fraction))
        });
        assert_eq!(fraction.unwrap().0, Some(1.0));
    }
}
