//! Threads that several computations share ([`Pool`]) and the side channel of one of them
//! ([`Context`]: cancel flag, progress, warnings, stage times, memory limit).

mod memory;
mod pool;

use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

pub use memory::{machine_memory, peak_memory};
pub use pool::{MOST_THREADS, Pool};

use crate::error::{Error, Result};

/// Time between two polls.
const POLL_EVERY: Duration = Duration::from_millis(10);

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

/// Looks at the progress, some 10 ms apart; true cancels.
pub type Poll = Box<dyn FnMut(&Progress) -> bool + Send>;
/// Takes a warning.
pub type Log = Box<dyn Fn(&str) + Send>;

/// Cancel flag, progress, warnings, stage times and memory limit of one computation; cheap to make.
pub struct Context {
    pool: Arc<Pool>,
    cancelled: Arc<AtomicBool>,
    progress: Mutex<Progress>,
    timings: Mutex<Vec<StageTime>>,
    poll: Mutex<Option<Watch>>,
    log: Mutex<Option<Log>>,
    /// Bytes.
    memory_limit: AtomicU64,
}

/// A poll and when it was last asked.
struct Watch {
    poll: Poll,
    asked: Instant,
}

impl Context {
    /// A context on the given threads.
    pub fn new(pool: Arc<Pool>) -> Self {
        Self {
            pool,
            cancelled: Arc::new(AtomicBool::new(false)),
            progress: Mutex::new(Progress::default()),
            timings: Mutex::new(Vec::new()),
            poll: Mutex::new(None),
            log: Mutex::new(None),
            memory_limit: AtomicU64::new(u64::MAX),
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

    /// Forgets a cancel, and counts stages from 0 again.
    pub fn reset(&self) {
        self.cancelled.store(false, Ordering::Relaxed);
        *lock(&self.progress) = Progress::default();
    }

    /// Whether it was cancelled.
    pub fn is_cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }

    /// The flag itself, for a signal handler or a C++ interrupter.
    pub fn cancel_flag(&self) -> Arc<AtomicBool> {
        self.cancelled.clone()
    }

    /// Sets what looks on while stages run, on the thread that called them: at the beginning of each, then every
    /// 10 ms while the pool's workers are busy. In a pool without workers, where [`Context::check`] is called.
    pub fn set_poll(&self, poll: Option<Poll>) {
        *lock(&self.poll) = poll.map(|poll| Watch { poll, asked: Instant::now() });
    }

    /// Sets what takes warnings; without it they are dropped.
    pub fn set_log(&self, log: Option<Log>) {
        *lock(&self.log) = log;
    }

    /// Gives a warning to whoever listens, on this thread.
    pub fn warn(&self, text: &str) {
        if let Some(log) = &*lock(&self.log) {
            log(text);
        }
    }

    /// Sets how much memory (bytes) an object made with this context may need; `u64::MAX` is no limit.
    pub fn set_memory_limit(&self, bytes: u64) {
        self.memory_limit.store(bytes, Ordering::Relaxed);
    }

    /// How much memory (bytes) an object made with this context may need.
    pub fn memory_limit(&self) -> u64 {
        self.memory_limit.load(Ordering::Relaxed)
    }

    /// Asks for memory before it is taken.
    ///
    /// # Errors
    /// `Memory`, naming `what`, when `bytes` are more than the limit.
    pub fn allow(&self, what: &str, bytes: u64) -> Result<()> {
        let limit = self.memory_limit.load(Ordering::Relaxed);
        if bytes > limit {
            return Err(Error::Memory { what: what.to_string(), needed: bytes, limit });
        }
        Ok(())
    }

    /// `Err(Cancelled)` once cancelled: long loops call it once a block of work.
    ///
    /// # Errors
    /// `Cancelled`.
    pub fn check(&self) -> Result<()> {
        if self.pool.is_inline()
            && let Ok(mut watch) = self.poll.try_lock()
            && let Some(watch) = watch.as_mut().filter(|watch| watch.asked.elapsed() >= POLL_EVERY)
        {
            self.ask(watch);
        }
        if self.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }

    /// Runs one stage of a step on the pool: progress, poll, cancel and timing at once.
    ///
    /// # Errors
    /// `Cancelled` when the context was cancelled before or during the stage, else what `work` returns.
    pub fn stage<R: Send>(&self, name: &'static str, work: impl FnOnce() -> Result<R> + Send) -> Result<R> {
        self.check()?;
        lock(&self.progress).stage = name;
        self.begin();
        let result = if self.is_cancelled() { Err(Error::Cancelled) } else { self.timed(name, work) };
        lock(&self.progress).stage = "";
        let value = result?;
        lock(&self.progress).stages_done += 1;
        self.check()?;
        Ok(value)
    }

    /// Runs a step's last stage, which a cancel does not stop: what it began is put in place whole.
    ///
    /// # Errors
    /// What `work` returns.
    pub fn commit<R: Send>(&self, work: impl FnOnce() -> Result<R> + Send) -> Result<R> {
        const NAME: &str = "commit";
        lock(&self.progress).stage = NAME;
        let value = self.timed(NAME, work);
        let mut progress = lock(&self.progress);
        progress.stage = "";
        progress.stages_done += 1;
        value
    }

    /// What is being done now.
    pub fn progress(&self) -> Progress {
        *lock(&self.progress)
    }

    /// Stage times since the last call, in order.
    pub fn take_timings(&self) -> Vec<StageTime> {
        std::mem::take(&mut *lock(&self.timings))
    }

    /// The poll at a stage's beginning.
    fn begin(&self) {
        if let Ok(mut watch) = self.poll.try_lock()
            && let Some(watch) = watch.as_mut()
        {
            self.ask(watch);
        }
    }

    fn ask(&self, watch: &mut Watch) {
        if (watch.poll)(&self.progress()) {
            self.cancel();
        }
        watch.asked = Instant::now();
    }

    /// Runs work of several stages on the pool while this thread polls: what lies between the stages is looked on too.
    ///
    /// # Errors
    /// `Cancelled` when the context was cancelled before, else what `work` returns.
    pub fn polled<R: Send>(&self, work: impl FnOnce() -> Result<R> + Send) -> Result<R> {
        self.begin();
        self.check()?;
        self.run(work)
    }

    fn timed<R: Send>(&self, name: &'static str, work: impl FnOnce() -> R + Send) -> R {
        let start = Instant::now();
        let value = self.run(work);
        lock(&self.timings).push(StageTime { name, time: start.elapsed() });
        value
    }

    fn run<R: Send>(&self, work: impl FnOnce() -> R + Send) -> R {
        match (self.poll.try_lock(), self.pool.workers()) {
            (Ok(mut watch), Some(workers)) if watch.is_some() => {
                let watch = watch.as_mut().expect("it is there");
                self.watched(workers, watch, work)
            }
            (watch, _) => {
                // A pool without workers polls from within the work.
                drop(watch);
                self.pool.install(work)
            }
        }
    }

    /// Runs `work` on the workers while this thread polls.
    fn watched<R: Send>(
        &self,
        workers: &rayon::ThreadPool,
        watch: &mut Watch,
        work: impl FnOnce() -> R + Send,
    ) -> R {
        let done = Done::default();
        let mut value = None;
        workers.in_place_scope(|scope| {
            let signal = Signal(&done);
            let slot = &mut value;
            scope.spawn(move |_| {
                // Dropped after the value is there, or when the work panics.
                let _signal = signal;
                *slot = Some(work());
            });
            while !done.wait(POLL_EVERY) {
                self.ask(watch);
            }
        });
        value.expect("the scope passes a panic on")
    }
}

/// A lock whose holder may have panicked: what these locks guard is whole at every moment.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Whether some work has ended.
#[derive(Default)]
struct Done {
    ended: Mutex<bool>,
    changed: Condvar,
}

impl Done {
    /// Waits for at most `time`.
    fn wait(&self, time: Duration) -> bool {
        let ended = lock(&self.ended);
        let waited = self.changed.wait_timeout_while(ended, time, |ended| !*ended);
        *waited.unwrap_or_else(PoisonError::into_inner).0
    }
}

/// Says that the work has ended when it is dropped.
struct Signal<'a>(&'a Done);

impl Drop for Signal<'_> {
    fn drop(&mut self) {
        *lock(&self.0.ended) = true;
        self.0.changed.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicUsize;

    fn counting(ctx: &Context, cancel_at: usize) -> Arc<AtomicUsize> {
        let count = Arc::new(AtomicUsize::new(0));
        let (seen, caller) = (count.clone(), std::thread::current().id());
        ctx.set_poll(Some(Box::new(move |_| {
            assert_eq!(std::thread::current().id(), caller);
            seen.fetch_add(1, Ordering::Relaxed) + 1 == cancel_at
        })));
        count
    }

    /// Work that looks at the flag every millisecond, for at most two seconds.
    fn patient(ctx: &Context) -> Result<()> {
        for _ in 0..2000 {
            ctx.check()?;
            std::thread::sleep(Duration::from_millis(1));
        }
        Ok(())
    }

    #[test]
    fn the_caller_polls_while_workers_work_and_its_answer_cancels() {
        for threads in [0, 1, 2] {
            let ctx = Context::new(Pool::new(threads).unwrap());
            let count = counting(&ctx, 5);
            let start = Instant::now();
            assert!(matches!(ctx.stage("wait", || patient(&ctx)), Err(Error::Cancelled)));
            assert!(start.elapsed() < Duration::from_secs(1));
            assert_eq!(count.load(Ordering::Relaxed), 5);
            assert!(matches!(ctx.check(), Err(Error::Cancelled)), "a cancel is sticky");
            ctx.reset();
            assert!(ctx.stage("nothing", || Ok(())).is_ok());
        }
    }

    #[test]
    fn a_commit_is_polled_but_not_stopped() {
        let ctx = Context::new(Pool::new(1).unwrap());
        let count = counting(&ctx, 1);
        let slow = || {
            std::thread::sleep(Duration::from_millis(60));
            Ok(7)
        };
        assert_eq!(ctx.commit(slow).unwrap(), 7);
        assert!(count.load(Ordering::Relaxed) > 1);
        assert!(ctx.is_cancelled());
    }

    #[test]
    fn a_panic_in_watched_work_reaches_the_caller() {
        let ctx = Context::new(Pool::new(2).unwrap());
        counting(&ctx, usize::MAX);
        let work = || -> Result<()> { panic!("on purpose") };
        let caught = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| ctx.stage("fall", work)));
        assert!(caught.is_err());
        assert!(ctx.stage("stand", || Ok(())).is_ok());
    }

    #[test]
    fn memory_beyond_the_limit_is_refused_in_words() {
        let ctx = Context::new(Pool::new(0).unwrap());
        assert!(ctx.allow("a layer", u64::MAX).is_ok());
        ctx.set_memory_limit(1 << 20);
        let error = ctx.allow("a layer", 5 << 20).unwrap_err().to_string();
        assert_eq!(error, "a layer needs about 5 MB, more than the limit of 1 MB");
    }
}
