//! Worker threads that several computations share.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

use crate::error::{Error, Result};
use crate::numeric::cpu::FlushDenormals;

/// Maximum number of threads in a pool.
pub const MAX_THREADS: usize = 1024;

/// Worker threads, shared by any number of contexts; joined when dropped.
pub struct Pool {
    /// None: everything runs on the thread that asks for it.
    rayon: Option<rayon::ThreadPool>,
    workers: Mutex<Vec<JoinHandle<()>>>,
}

impl Pool {
    /// Starts `threads` workers, at most [`MAX_THREADS`]; 0 runs everything on the caller's thread.
    ///
    /// # Errors
    /// Too many threads, or the system refuses to start them.
    pub fn new(threads: usize) -> Result<Arc<Self>> {
        if threads > MAX_THREADS {
            return Err(Error::argument(format!("threads = {threads} is not within 0 to {MAX_THREADS}")));
        }
        if threads == 0 {
            return Ok(Arc::new(Self { rayon: None, workers: Mutex::default() }));
        }
        let workers = Arc::new(Mutex::new(Vec::new()));
        let spawned = workers.clone();
        let rayon = rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .thread_name(|index| format!("frazil-{index}"))
            .spawn_handler(move |worker| {
                let name = worker.name().unwrap_or("frazil").to_string();
                let work = || {
                    let _flush = FlushDenormals::begin();
                    worker.run();
                };
                let handle = std::thread::Builder::new().name(name).spawn(work)?;
                spawned.lock().expect("no panic while spawning").push(handle);
                Ok(())
            })
            .build()
            .map_err(|error| Error::argument(format!("cannot start {threads} threads: {error}")))?;
        let workers = Mutex::new(std::mem::take(&mut *workers.lock().expect("no panic while spawning")));
        Ok(Arc::new(Self { rayon: Some(rayon), workers }))
    }

    /// A pool with one worker per core that this process may use.
    ///
    /// # Errors
    /// As [`Pool::new`].
    pub fn all_cores() -> Result<Arc<Self>> {
        Self::new(std::thread::available_parallelism().map_or(1, |count| count.get()).min(MAX_THREADS))
    }

    /// Number of threads that work at once (at least 1).
    pub fn threads(&self) -> usize {
        self.rayon.as_ref().map_or(1, rayon::ThreadPool::current_num_threads)
    }

    /// Runs `work` on a worker thread, or on this one when there are no workers; its parallel loops use this
    /// pool. Denormal numbers count as 0 meanwhile.
    pub fn install<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        match &self.rayon {
            Some(pool) => pool.install(work),
            None => {
                let _flush = FlushDenormals::begin();
                on_this_thread(work)
            }
        }
    }

    /// The workers, if the calling thread is not one of them and can watch while they work.
    pub(super) fn workers(&self) -> Option<&rayon::ThreadPool> {
        self.rayon.as_ref().filter(|pool| pool.current_thread_index().is_none())
    }

    /// Whether everything runs on the thread that asks for it.
    pub(super) fn is_inline(&self) -> bool {
        self.rayon.is_none()
    }
}

impl Drop for Pool {
    fn drop(&mut self) {
        // Dropping a rayon pool only asks its threads to end: wait until they have.
        self.rayon = None;
        let workers = self.workers.get_mut().map(std::mem::take).unwrap_or_default();
        for worker in workers {
            let _ = worker.join();
        }
    }
}

/// Runs `work` with this thread as the only worker of a temporary pool: rayon's loops, without a pool around them, would start a
/// process-wide one. On a thread that is already some pool's worker they run there.
fn on_this_thread<R: Send>(work: impl FnOnce() -> R + Send) -> R {
    if rayon::current_thread_index().is_some() {
        return work();
    }
    let mut worker_slot = None;
    let spawn = |worker| {
        worker_slot = Some(worker);
        Ok(())
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).spawn_handler(spawn).build();
    let (Ok(pool), Some(worker)) = (pool, worker_slot) else { return work() };
    let mut result = None;
    let owner = Arc::new(Mutex::new(Some(pool)));
    {
        let (slot, owned) = (&mut result, owner.clone());
        let job: Box<dyn FnOnce() + Send + '_> = Box::new(move || {
            *slot = Some(catch_unwind(AssertUnwindSafe(work)));
            // The worker returns when its pool is dropped and this job is done.
            drop(owned.lock().unwrap_or_else(PoisonError::into_inner).take());
        });
        // SAFETY: `run` returns only once the pool was dropped and no job is left. Only the job drops the pool, at its end: by then it has
        // run, and everything that it borrows is still alive.
        let job =
            unsafe { std::mem::transmute::<Box<dyn FnOnce() + Send + '_>, Box<dyn FnOnce() + Send>>(job) };
        if let Some(pool) = &*owner.lock().unwrap_or_else(PoisonError::into_inner) {
            pool.spawn(job);
        }
        worker.run();
    }
    match result.expect("the job was run") {
        Ok(value) => value,
        Err(panic) => resume_unwind(panic),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    #[test]
    fn a_pool_without_workers_stays_on_the_callers_thread() {
        let pool = Pool::new(0).unwrap();
        let here = std::thread::current().id();
        for _ in 0..2 {
            let all_here = pool.install(|| {
                (0..10_000)
                    .into_par_iter()
                    .map(|_| std::thread::current().id() == here)
                    .reduce(|| true, |a, b| a & b)
            });
            assert!(all_here);
        }
        assert_eq!(pool.threads(), 1);
        assert_eq!(rayon::current_thread_index(), None, "afterwards it is no worker any more");
        let fall = || -> usize { panic!("on purpose") };
        let caught = catch_unwind(AssertUnwindSafe(|| pool.install(fall)));
        assert_eq!(caught.unwrap_err().downcast_ref::<&str>(), Some(&"on purpose"));
        assert_eq!(pool.install(|| pool.install(|| 7)), 7);
    }

    #[test]
    fn denormals_are_zero_in_a_pool_and_come_back() {
        let tiny = std::hint::black_box(f32::MIN_POSITIVE);
        let halved = || std::hint::black_box(tiny) * 0.5;
        for threads in [0, 2] {
            assert_eq!(Pool::new(threads).unwrap().install(halved) > 0.0, !cfg!(target_arch = "x86_64"));
            assert!(halved() > 0.0);
        }
    }

    #[test]
    fn more_threads_than_any_machine_has_are_refused() {
        assert!(Pool::new(MAX_THREADS + 1).is_err());
    }
}
