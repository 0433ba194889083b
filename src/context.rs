//! Threads that several computations share ([`Pool`]) and the side channel of one of them
//! ([`Context`]: cancel flag, progress, stage times).

use crate::error::{Error, Result};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Worker threads, shared by any number of contexts; joined when dropped.
pub struct Pool {
    rayon: Option<rayon::ThreadPool>,
    threads: usize,
    workers: Mutex<Vec<JoinHandle<()>>>,
}

impl Pool {
    /// Starts `threads` workers; 0 runs everything on the caller's thread.
    pub fn new(threads: usize) -> Result<Arc<Self>> {
        let workers = Arc::new(Mutex::new(Vec::new()));
        // Even "no threads" needs a rayon pool of one, else rayon's global pool would be started.
        let spawned = workers.clone();
        let rayon = rayon::ThreadPoolBuilder::new()
            .num_threads(threads.max(1))
            .thread_name(|index| format!("frazil-{index}"))
            .spawn_handler(move |worker| {
                let name = worker.name().unwrap_or("frazil").to_string();
                let handle = std::thread::Builder::new().name(name).spawn(|| worker.run())?;
                spawned.lock().expect("no panic while spawning").push(handle);
                Ok(())
            })
            .build()
            .map_err(|error| Error::argument(format!("cannot start {threads} threads: {error}")))?;
        let workers = Mutex::new(std::mem::take(&mut *workers.lock().expect("no panic while spawning")));
        Ok(Arc::new(Self { rayon: Some(rayon), threads: threads.max(1), workers }))
    }

    /// A pool with one worker per core that this process may use.
    pub fn all_cores() -> Result<Arc<Self>> {
        Self::new(std::thread::available_parallelism().map_or(1, |count| count.get()))
    }

    /// Number of threads that work at once (at least 1).
    pub fn threads(&self) -> usize {
        self.threads
    }

    /// Runs `work` on a worker thread, so that its parallel loops use this pool.
    pub fn install<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        match &self.rayon {
            Some(pool) => pool.install(work),
            None => work(),
        }
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

/// How long one stage of a step took.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct StageTime {
    /// The stage's verb.
    pub name: &'static str,
    /// Wall-clock time.
    pub time: Duration,
}

/// What is being done, for a progress display.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Progress {
    /// The stage's verb, empty between stages.
    pub stage: &'static str,
    /// Stages finished since the context was made or reset.
    pub stages_done: usize,
}

/// Cancel flag, progress and stage times of one computation; cheap to make.
pub struct Context {
    pool: Arc<Pool>,
    cancelled: Arc<AtomicBool>,
    progress: Mutex<Progress>,
    timings: Mutex<Vec<StageTime>>,
}

impl Context {
    /// A context on the given threads.
    pub fn new(pool: Arc<Pool>) -> Self {
        Self {
            pool,
            cancelled: Arc::new(AtomicBool::new(false)),
            progress: Mutex::new(Progress::default()),
            timings: Mutex::new(Vec::new()),
        }
    }

    /// Its threads.
    pub fn pool(&self) -> &Arc<Pool> {
        &self.pool
    }

    /// Asks the running and all following stages to stop; sticky until [`Context::reset`].
    pub fn cancel(&self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }

    /// Forgets a cancel.
    pub fn reset(&self) {
        self.cancelled.store(false, Ordering::Relaxed);
    }

    /// Whether it was cancelled.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// The flag itself, for a signal handler or a C++ interrupter.
    pub fn cancel_flag(&self) -> Arc<AtomicBool> {
        self.cancelled.clone()
    }

    /// `Err(Cancelled)` once cancelled: long loops call it once a block of work.
    pub fn check(&self) -> Result<()> {
        if self.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }

    /// Runs one stage of a step on the pool: progress, cancel and timing at once.
    ///
    /// # Errors
    /// `Cancelled` when the context was cancelled before or during the stage, else what `work` returns.
    pub fn stage<R: Send>(&self, name: &'static str, work: impl FnOnce() -> Result<R> + Send) -> Result<R> {
        self.check()?;
        self.progress.lock().expect("progress lock").stage = name;
        let start = Instant::now();
        let result = self.pool.install(work);
        self.timings.lock().expect("timings lock").push(StageTime { name, time: start.elapsed() });
        let mut progress = self.progress.lock().expect("progress lock");
        progress.stage = "";
        progress.stages_done += 1;
        drop(progress);
        let value = result?;
        self.check()?;
        Ok(value)
    }

    /// What is being done now.
    pub fn progress(&self) -> Progress {
        *self.progress.lock().expect("progress lock")
    }

    /// Stage times since the last call, in order.
    pub fn take_timings(&self) -> Vec<StageTime> {
        std::mem::take(&mut *self.timings.lock().expect("timings lock"))
    }
}
