//! Threads that several computations share ([`Pool`]) and the side channel of one of them
//! ([`Context`]: cancel flag, progress, warnings, phase times, memory limit).

mod cancel;
mod locking;
mod memory;
mod phases;
mod pool;
mod progress;

use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Condvar, Mutex, PoisonError};
use std::time::{Duration, Instant};

use locking::lock;

pub use cancel::Running;
#[cfg(feature = "scene")]
pub(crate) use memory::release_freed_memory;
pub use memory::{machine_memory, peak_memory};
pub use phases::{PhaseTime, Phases};
pub use pool::{MAX_THREADS, Pool};
pub use progress::Progress;

use crate::error::{Error, Result};
use cancel::Cancel;
use phases::Collectors;
use progress::{Planned, State};

/// Time between two polls.
const POLL_EVERY: Duration = Duration::from_millis(10);

/// Called with the progress about every 10 ms; returning true cancels.
pub type Poll = Box<dyn FnMut(&Progress) -> bool + Send>;
/// Receives a warning.
pub type Log = Box<dyn Fn(&str) + Send>;

/// Cancel, progress, warnings, phase times and memory limit of one computation; cheap to make.
pub struct Context {
    pool: Arc<Pool>,
    cancel: Arc<Cancel>,
    state: Mutex<State>,
    /// Whether the next call restarts the count of phases at 0.
    recount: AtomicBool,
    /// Finished pieces of work of the running phase, and their total; 0 if unknown.
    pieces: [AtomicUsize; 2],
    collectors: Collectors,
    poll: Mutex<Option<Watch>>,
    log: Mutex<Option<Log>>,
    /// Bytes.
    memory_limit: AtomicU64,
}

/// A poll and when it was last called.
struct Watch {
    poll: Poll,
    called: Instant,
}

impl Context {
    /// A context on the given threads.
    pub fn new(pool: Arc<Pool>) -> Self {
        Self {
            pool,
            cancel: Arc::default(),
            state: Mutex::default(),
            recount: AtomicBool::new(false),
            pieces: Default::default(),
            collectors: Collectors::default(),
            poll: Mutex::new(None),
            log: Mutex::new(None),
            memory_limit: AtomicU64::new(u64::MAX),
        }
    }

    /// Its threads.
    pub fn pool(&self) -> &Arc<Pool> {
        &self.pool
    }

    /// Begins a call; everything that runs with this context is part of it until the returned value is dropped. Phases and tools begin one
    /// themselves; hold one around work of several phases that is to be cancelled as a whole.
    pub fn begin(&self) -> Running {
        let outermost = !self.cancel.is_running();
        if outermost && self.recount.swap(false, Ordering::SeqCst) {
            *lock(&self.state) = State::default();
        }
        self.cancel.begin()
    }

    /// As [`Context::begin`], for work in real time: it takes no lock, allocates nothing, and does not restart the
    /// count of phases.
    pub fn begin_light(&self) -> Running {
        self.cancel.begin()
    }

    /// Cancels the running call and all later ones until [`Context::reset`].
    pub fn cancel(&self) {
        self.cancel.request();
    }

    /// Clears a cancel and restarts the count of phases, for the calls that follow. A running call keeps its cancel and its count.
    pub fn reset(&self) {
        self.cancel.clear();
        self.recount.store(true, Ordering::SeqCst);
    }

    /// Whether the running call is cancelled; between calls, whether the next one will be.
    pub fn is_cancelled(&self) -> bool {
        self.cancel.is_requested()
    }

    /// The flags that a signal handler sets, in this order, to cancel.
    pub fn cancel_flags(&self) -> [Arc<AtomicBool>; 2] {
        self.cancel.flags().map(Arc::clone)
    }

    /// Sets the function that is called while phases run, on the thread that called them: at the start of each, then every 10 ms while the
    /// pool's workers are busy; in a pool without workers, from [`Context::check`].
    pub fn set_poll(&self, poll: Option<Poll>) {
        *lock(&self.poll) = poll.map(|poll| Watch { poll, called: Instant::now() });
    }

    /// Sets the function that receives warnings; without one they are dropped.
    pub fn set_log(&self, log: Option<Log>) {
        *lock(&self.log) = log;
    }

    /// Passes a warning to the log function, on this thread.
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

    /// Checks an allocation against the limit before it is made.
    ///
    /// # Errors
    /// `Memory`, naming `what`, when `bytes` are more than the limit.
    pub fn allow(&self, what: &str, bytes: u64) -> Result<()> {
        Error::check_memory(bytes, self.memory_limit(), || what.to_string())
    }

    /// `Err(Cancelled)` once cancelled: long loops call it once per block of work.
    ///
    /// # Errors
    /// `Cancelled`.
    pub fn check(&self) -> Result<()> {
        if self.pool.is_inline()
            && let Ok(mut watch) = self.poll.try_lock()
            && let Some(watch) = watch.as_mut().filter(|watch| watch.called.elapsed() >= POLL_EVERY)
        {
            self.call(watch);
        }
        if self.is_cancelled() { Err(Error::Cancelled) } else { Ok(()) }
    }

    /// Runs one step, a sequence of `phases` phases, and returns its result and the times of its phases.
    ///
    /// # Errors
    /// What `work` returns.
    pub fn step<R>(&self, phases: usize, work: impl FnOnce() -> Result<R>) -> Result<(R, Vec<PhaseTime>)> {
        let _running = self.begin();
        let collector = self.collect();
        let _planned = Planned::new(&self.state, phases);
        Ok((work()?, collector.times()))
    }

    /// Collects the times of the phases that run from now on, until the returned value is dropped.
    pub fn collect(&self) -> Phases {
        self.collectors.collect()
    }

    /// Runs one phase of a step on the pool: progress, poll, cancel and timing at once.
    ///
    /// # Errors
    /// `Cancelled` when the context was cancelled before or during the phase, else what `work` returns.
    pub fn phase<R: Send>(&self, name: &'static str, work: impl FnOnce() -> Result<R> + Send) -> Result<R> {
        let _running = self.begin();
        let value = self.phase_in_place(name, work)?;
        self.check()?;
        Ok(value)
    }

    /// As [`Context::phase`], for work that puts its result in place itself at its end: a cancel after that comes too late.
    ///
    /// # Errors
    /// `Cancelled` when the context was cancelled before the phase, else what `work` returns.
    pub fn phase_in_place<R: Send>(
        &self,
        name: &'static str,
        work: impl FnOnce() -> Result<R> + Send,
    ) -> Result<R> {
        let _running = self.begin();
        self.check()?;
        self.enter(name);
        self.poll_once();
        let result = if self.is_cancelled() { Err(Error::Cancelled) } else { self.timed(name, work) };
        self.leave(result.is_ok());
        result
    }

    /// Runs the last phase of a step, which a cancel does not stop: changes are applied completely.
    ///
    /// # Errors
    /// What `work` returns.
    pub fn commit<R: Send>(&self, work: impl FnOnce() -> Result<R> + Send) -> Result<R> {
        const NAME: &str = "commit";
        let _running = self.begin();
        self.enter(NAME);
        let result = self.timed(NAME, work);
        self.leave(true);
        result
    }

    fn enter(&self, name: &'static str) {
        let mut state = lock(&self.state);
        state.phase = name;
        self.expect(0);
    }

    /// Ends a phase; the count of phases replaces its count of pieces under one lock, so that no fraction decreases.
    fn leave(&self, done: bool) {
        let mut state = lock(&self.state);
        state.phase = "";
        state.phases_done += usize::from(done);
        self.expect(0);
    }

    /// What is being done now.
    pub fn progress(&self) -> Progress {
        if self.recount.load(Ordering::SeqCst) && !self.cancel.is_running() {
            return Progress::default();
        }
        let state = lock(&self.state);
        let [done, all] = self.pieces.each_ref().map(|count| count.load(Ordering::Relaxed));
        let part = (all > 0).then(|| (done as f32 / all as f32).min(1.0));
        state.progress(part)
    }

    /// Sets how many pieces of work the running phase has; [`Context::advance`] counts them.
    pub fn expect(&self, pieces: usize) {
        self.pieces[0].store(0, Ordering::Relaxed);
        self.pieces[1].store(pieces, Ordering::Relaxed);
    }

    /// Counts one more piece of the running phase's work as done.
    pub fn advance(&self) {
        self.pieces[0].fetch_add(1, Ordering::Relaxed);
    }

    /// Polls once, at the beginning of a phase.
    fn poll_once(&self) {
        if let Ok(mut watch) = self.poll.try_lock()
            && let Some(watch) = watch.as_mut()
        {
            self.call(watch);
        }
    }

    fn call(&self, watch: &mut Watch) {
        if (watch.poll)(&self.progress()) {
            self.cancel();
        }
        watch.called = Instant::now();
    }

    /// Runs work of several phases on the pool while this thread polls, between the phases too.
    ///
    /// # Errors
    /// `Cancelled` when the context was cancelled before, else what `work` returns.
    pub fn polled<R: Send>(&self, work: impl FnOnce() -> Result<R> + Send) -> Result<R> {
        let _running = self.begin();
        self.poll_once();
        self.check()?;
        self.run(work)
    }

    fn timed<R: Send>(&self, name: &'static str, work: impl FnOnce() -> R + Send) -> R {
        let start = Instant::now();
        let value = self.run(work);
        self.collectors.add(name, start.elapsed());
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
                // Dropped once the value is there, or when the work panics.
                let _signal = signal;
                *slot = Some(work());
            });
            while !done.wait(POLL_EVERY) {
                self.call(watch);
            }
        });
        value.expect("the scope passes a panic on")
    }
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

/// Signals that the work has ended when it is dropped.
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

    /// Work that checks the flag every millisecond, for at most two seconds.
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
            assert!(matches!(ctx.phase("wait", || patient(&ctx)), Err(Error::Cancelled)));
            assert!(start.elapsed() < Duration::from_secs(1));
            assert_eq!(count.load(Ordering::Relaxed), 5);
            assert!(matches!(ctx.check(), Err(Error::Cancelled)), "a cancel is sticky");
            ctx.reset();
            assert!(ctx.phase("nothing", || Ok(())).is_ok());
        }
    }

    #[test]
    fn progress_has_the_part_of_a_phase_that_is_done() {
        let ctx = Context::new(Pool::new(1).unwrap());
        let work = || {
            assert_eq!(ctx.progress().part, None);
            ctx.expect(4);
            (0..3).for_each(|_| ctx.advance());
            assert_eq!(ctx.progress().part, Some(0.75));
            Ok(())
        };
        ctx.phase("work", work).unwrap();
        assert_eq!(ctx.progress().part, None);
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
    fn a_reset_during_a_call_is_for_the_calls_that_follow() {
        let ctx = Context::new(Pool::new(1).unwrap());
        let forgetful = || {
            ctx.cancel();
            ctx.reset();
            Ok(())
        };
        // The work does not check for a cancel itself: the phase does so at its end.
        assert!(matches!(ctx.phase("forget", forgetful), Err(Error::Cancelled)));
        assert!(ctx.phase("next", || Ok(())).is_ok());
        let call = ctx.begin();
        assert!(ctx.phase("first", || Ok(())).is_ok());
        forgetful().unwrap();
        assert_eq!(ctx.progress().phases_done, 2, "the running call's count");
        assert!(matches!(ctx.phase("second", || Ok(())), Err(Error::Cancelled)));
        drop(call);
        assert_eq!(ctx.progress().phases_done, 0);
        assert!(ctx.phase("next", || Ok(())).is_ok());
    }

    #[test]
    fn a_cancel_after_work_that_is_in_place_comes_too_late_for_it() {
        let ctx = Context::new(Pool::new(1).unwrap());
        let late = || {
            ctx.cancel();
            Ok(7)
        };
        assert_eq!(ctx.phase_in_place("put", late).unwrap(), 7);
        assert!(matches!(ctx.phase_in_place("put", late), Err(Error::Cancelled)));
    }

    #[test]
    fn a_panic_in_watched_work_reaches_the_caller() {
        let ctx = Context::new(Pool::new(2).unwrap());
        counting(&ctx, usize::MAX);
        let work = || -> Result<()> { panic!("on purpose") };
        let caught = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| ctx.phase("fall", work)));
        assert!(caught.is_err());
        assert!(ctx.phase("stand", || Ok(())).is_ok());
    }

    #[test]
    fn memory_beyond_the_limit_is_refused() {
        let ctx = Context::new(Pool::new(0).unwrap());
        assert!(ctx.allow("a layer", u64::MAX).is_ok());
        ctx.set_memory_limit(1_900_000);
        let error = ctx.allow("a layer", 4_000_001).unwrap_err().to_string();
        assert_eq!(error, "a layer needs about 5 MB, more than the limit of 1 MB");
    }
}
