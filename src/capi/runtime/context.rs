//! One computation's side channel.

use std::ffi::{CString, c_char, c_int, c_void};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use super::library::FRZ_ABI_VERSION;
use super::pool::{Threads, frz_pool};
use crate::capi::ffi::guard::frz_status::*;
use crate::capi::ffi::guard::{Failure, Outcome, frz_status, guard};
use crate::capi::ffi::handle::{Noun, Reading, clear, destroy, give, read, required};
use crate::capi::ffi::views::{Plain, frz_span};
use crate::context::{Context, PhaseTime, Phases, Progress, Running, machine_memory};
use crate::error::Error;

/// One computation: cancel flag, progress, polls, warnings, phase times. Cheap: make one for every cook.
pub struct frz_context {
    _opaque: [u8; 0],
}

/// What is being done.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_progress {
    /// The verb of the phase that runs, for instance "distance"; empty between phases. It ends with a zero.
    pub stage: [c_char; 32],
    /// Phases finished since the context was made or reset.
    pub stages_done: u64,
    /// Seconds since the running call began; 0 between calls.
    pub seconds: f64,
    /// Fraction of the running phase that is done, 0 to 1; -1 where it is not known. Since interface 1.1: programs that
    /// were compiled with a header of 1.0 have no such field, and it is not written.
    pub fraction: f64,
}

/// Bytes of frz_progress in the header of interface 1.0.
const FIRST_PROGRESS: usize = std::mem::offset_of!(frz_progress, fraction);

/// How long a phase took.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_stage_time {
    /// The phase's verb. It ends with a zero.
    pub stage: [c_char; 32],
    /// Seconds; the sum of all its runs in the call.
    pub seconds: f64,
}

/// Called while the library works; returning other than 0 cancels. It must return, not throw or jump.
///
/// user: what was given with it.
/// progress: what is being done; it is the library's, and valid until the function returns.
pub type frz_poll_function =
    Option<unsafe extern "C" fn(user: *mut c_void, progress: *const frz_progress) -> c_int>;

/// Receives a warning. It must return, not throw or jump.
///
/// user: what was given with it.
/// text: one sentence in UTF-8; it is the library's, and valid until the function returns.
pub type frz_log_function = Option<unsafe extern "C" fn(user: *mut c_void, text: *const c_char)>;

/// When the running call began.
#[derive(Clone, Default)]
struct Began(Arc<Mutex<Option<Instant>>>);

impl Began {
    fn set(&self, at: Option<Instant>) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = at;
    }

    fn seconds(&self) -> f64 {
        let at = *self.0.lock().unwrap_or_else(PoisonError::into_inner);
        at.map_or(0.0, |at| at.elapsed().as_secs_f64())
    }
}

// SAFETY: characters and a number, without padding.
unsafe impl Plain for frz_stage_time {}

/// The value of a context's handle.
pub(in crate::capi) struct State {
    /// The library's own context.
    pub ctx: Context,
    /// Dropped last: its threads.
    _threads: Threads,
    /// Size of frz_progress in the caller's header (bytes).
    progress_room: usize,
    entered: AtomicBool,
    poisoned: AtomicBool,
    began: Began,
    timings: Mutex<Vec<PhaseTime>>,
}

impl Noun for frz_context {
    type Value = State;
    const NAME: &'static str = "context";
    const TAG: u32 = 0x6672_7a02;
}

/// A call that has a context to itself, except for cancel, reset and progress; and its phases.
pub(in crate::capi) struct Call<'a>(Reading<'a, State>, Option<(Running, Phases)>);

impl Call<'_> {
    /// The library's own context.
    pub(in crate::capi) fn ctx(&self) -> &Context {
        &self.0.ctx
    }
}

/// Begins a call with a context.
///
/// # Safety
/// The context must be NULL or not destroyed.
pub(in crate::capi) unsafe fn enter<'a>(context: *const frz_context) -> Outcome<Call<'a>> {
    // SAFETY: the caller's promise.
    let state = unsafe { read(context) }?;
    if state.entered.swap(true, Ordering::AcqRel) {
        return Err(Failure::new(FRZ_ERROR_BUSY, "the context is in use by another call"));
    }
    let mut call = Call(state, None);
    if call.0.poisoned.load(Ordering::Acquire) {
        let text = "the context saw an internal error before and can only be destroyed";
        return Err(Failure::new(FRZ_ERROR_POISONED, text));
    }
    call.1 = Some((call.ctx().begin(), call.ctx().collect()));
    call.0.began.set(Some(Instant::now()));
    Ok(call)
}

/// A call of a frame in real time, which has a context to itself as a [`Call`] has. It takes no lock, allocates nothing, asks no
/// clock, and has no phases, polls or progress.
pub(in crate::capi) struct LightCall<'a>(Reading<'a, State>);

impl LightCall<'_> {
    /// The library's own context.
    pub(in crate::capi) fn ctx(&self) -> &Context {
        &self.0.ctx
    }
}

/// Begins a call of a frame in real time with a context, unless it is cancelled, which is looked at here only.
///
/// # Safety
/// As [`enter`].
pub(in crate::capi) unsafe fn enter_light<'a>(context: *const frz_context) -> Outcome<LightCall<'a>> {
    // SAFETY: the caller's promise.
    let state = unsafe { read(context) }?;
    if state.entered.swap(true, Ordering::AcqRel) {
        return Err(Failure::new(FRZ_ERROR_BUSY, "the context is in use by another call"));
    }
    let call = LightCall(state);
    if call.0.poisoned.load(Ordering::Acquire) {
        let text = "the context saw an internal error before and can only be destroyed";
        return Err(Failure::new(FRZ_ERROR_POISONED, text));
    }
    if call.ctx().is_cancelled() {
        return Err(Error::Cancelled.into());
    }
    Ok(call)
}

impl Drop for LightCall<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.poisoned.store(true, Ordering::Release);
        }
        self.0.entered.store(false, Ordering::Release);
    }
}

/// A function of the interface that makes an object: `out` receives it, or NULL after a failure.
///
/// # Safety
/// As [`enter`] and [`give`].
pub(in crate::capi) unsafe fn creates<N: Noun>(
    context: *const frz_context,
    out: *mut *mut N,
    make: impl FnOnce(&Context) -> Outcome<N::Value>,
) -> frz_status {
    guard(|| {
        // SAFETY: the caller's promise.
        unsafe {
            clear(out);
            let call = enter(context)?;
            required(out, "out")?;
            give(out, make(call.ctx())?)
        }
    })
}

impl Drop for Call<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.poisoned.store(true, Ordering::Release);
        }
        let timings = self.1.as_ref().map_or_else(Vec::new, |(_, phases)| phases.times());
        if !timings.is_empty() {
            *self.0.timings.lock().unwrap_or_else(PoisonError::into_inner) = timings;
        }
        self.0.began.set(None);
        // The next call must not begin within this one: it would have its cancel.
        self.1.take();
        self.0.entered.store(false, Ordering::Release);
    }
}

/// A host's pointer, which is only ever passed back to it.
#[derive(Clone, Copy)]
struct User(*mut c_void);

// SAFETY: the library never dereferences it, and passes it back on the thread that called.
unsafe impl Send for User {}

impl User {
    fn pointer(self) -> *mut c_void {
        self.0
    }
}

/// A verb in an array that ends with a zero.
fn letters(verb: &str) -> [c_char; 32] {
    let mut out = [0; 32];
    out.iter_mut().take(31).zip(verb.bytes()).for_each(|(to, from)| *to = from as c_char);
    out
}

/// Memory limit of a new context (bytes).
fn usual_limit() -> u64 {
    machine_memory().unwrap_or(u64::MAX)
}

fn progress_of(progress: &Progress, began: &Began) -> frz_progress {
    let Progress { phase, phases_done, part, .. } = *progress;
    let fraction = part.map_or(-1.0, f64::from);
    frz_progress {
        stage: letters(phase),
        stages_done: phases_done as u64,
        seconds: began.seconds(),
        fraction,
    }
}

/// Makes a context on a pool.
///
/// abi: FRZ_ABI_VERSION, as the caller's header has it: FRZ_ERROR_VERSION when the major numbers differ, or the
///     library is older than the header.
/// pool: whose threads do the work; it may be destroyed before the context.
/// out: receives the context, to be destroyed with frz_context_destroy; NULL after a failure.
///
/// Any thread. A context serves one call at a time (FRZ_ERROR_BUSY), except frz_context_cancel, _reset and _progress.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_context_create(
    abi: u32,
    pool: *mut frz_pool,
    out: *mut *mut frz_context,
) -> frz_status {
    guard(|| {
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            clear(out);
            required(out, "out")?;
            if abi >> 16 != FRZ_ABI_VERSION >> 16 || abi & 0xffff > FRZ_ABI_VERSION & 0xffff {
                let [major, minor] = [abi >> 16, abi & 0xffff];
                let [own, own_minor] = [FRZ_ABI_VERSION >> 16, FRZ_ABI_VERSION & 0xffff];
                let text =
                    format!("the header has interface {major}.{minor}, this library {own}.{own_minor}");
                return Err(Failure::new(FRZ_ERROR_VERSION, text));
            }
            let threads = read(pool.cast_const())?.share();
            let ctx = Context::new(threads.0.clone());
            ctx.set_memory_limit(usual_limit());
            give(
                out,
                State {
                    ctx,
                    _threads: threads,
                    progress_room: if abi & 0xffff == 0 { FIRST_PROGRESS } else { size_of::<frz_progress>() },
                    entered: AtomicBool::new(false),
                    poisoned: AtomicBool::new(false),
                    began: Began::default(),
                    timings: Mutex::default(),
                },
            )
        }
    })
}

/// Destroys a context; NULL is fine.
///
/// context: may be NULL. Not while a call with it runs: it then stays.
///
/// Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_context_destroy(context: *mut frz_context) {
    // SAFETY: the context is NULL or was not destroyed.
    guard(|| unsafe { destroy(context) });
}

/// Sets the function that is called while the library works, for a progress bar and an escape key.
///
/// It is called on the thread that called the library: at the beginning of each phase, then every 10 to 50 ms, also
/// inside long phases. Without worker threads (a pool of 0) it is called between pieces of work, with no interval
/// promised. Within it frz_context_cancel and frz_context_progress may be called, and nothing else with this context.
///
/// poll: NULL for none.
/// user: handed to it; may be NULL.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_context_set_poll(
    context: *mut frz_context,
    poll: frz_poll_function,
    user: *mut c_void,
) -> frz_status {
    guard(|| {
        // SAFETY: the context is NULL or was not destroyed.
        let call = unsafe { enter(context) }?;
        let user = User(user);
        let began = call.0.began.clone();
        call.ctx().set_poll(poll.map(|poll| {
            let ask = move |progress: &Progress| {
                let told = progress_of(progress, &began);
                // SAFETY: the host promised a function that takes these.
                unsafe { poll(user.pointer(), &told) != 0 }
            };
            Box::new(ask) as crate::context::Poll
        }));
        Ok(())
    })
}

/// Sets the function that receives warnings: what a user should know though the call succeeds, for instance that a mesh
/// is open.
///
/// It is called on the thread that called the library. The library itself never prints. Within it nothing else may be
/// called with this context.
///
/// log: NULL for none; warnings are then dropped.
/// user: handed to it; may be NULL.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_context_set_log(
    context: *mut frz_context,
    log: frz_log_function,
    user: *mut c_void,
) -> frz_status {
    guard(|| {
        // SAFETY: the context is NULL or was not destroyed.
        let call = unsafe { enter(context) }?;
        let user = User(user);
        call.ctx().set_log(log.map(|log| {
            let tell = move |text: &str| {
                let text = CString::new(text.replace('\0', "")).unwrap_or_default();
                // SAFETY: the host promised a function that takes these.
                unsafe { log(user.pointer(), text.as_ptr()) };
            };
            Box::new(tell) as crate::context::Log
        }));
        Ok(())
    })
}

/// Sets how much memory an object may take that is made or changed with this context.
///
/// The need is estimated before memory is taken; a call that would need more returns FRZ_ERROR_MEMORY and changes
/// nothing. It is a guard against a wrong voxel size, not an account of every byte.
///
/// bytes: 0 for the limit of a new context, the machine's memory; UINT64_MAX for none.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_context_set_memory_limit(context: *mut frz_context, bytes: u64) -> frz_status {
    guard(|| {
        // SAFETY: the context is NULL or was not destroyed.
        let call = unsafe { enter(context) }?;
        call.ctx().set_memory_limit(if bytes == 0 { usual_limit() } else { bytes });
        Ok(())
    })
}

/// Cancels the call that runs with the context, and every later one until frz_context_reset: they return
/// FRZ_CANCELLED and change nothing. A call whose work is done when the cancel comes returns as if there were none.
///
/// context: may be NULL.
///
/// Any thread, any time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_context_cancel(context: *mut frz_context) {
    // SAFETY: the context is NULL or was not destroyed.
    if let Ok(state) = unsafe { read(context.cast_const()) } {
        state.ctx.cancel();
    }
}

/// Clears a cancel and restarts the count of phases, for the calls that follow. A call that runs meanwhile keeps its
/// cancel: it never continues with half of its work left out.
///
/// context: may be NULL.
///
/// Any thread, any time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_context_reset(context: *mut frz_context) {
    guard(|| {
        // SAFETY: the context is NULL or was not destroyed.
        unsafe { read(context.cast_const()) }?.ctx.reset();
        Ok(())
    });
}

/// Reports what the context is doing.
///
/// out: receives it; all zeroes after a failure, except the fraction.
///
/// Any thread, any time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_context_progress(
    context: *const frz_context,
    out: *mut frz_progress,
) -> frz_status {
    guard(|| {
        let out = required(out, "out")?.cast::<u8>();
        // SAFETY: the pointers are NULL or the caller's, who has as much room as the header of its context says.
        unsafe {
            out.write_bytes(0, FIRST_PROGRESS);
            let state = read(context)?;
            let told = progress_of(&state.ctx.progress(), &state.began);
            std::ptr::copy_nonoverlapping((&raw const told).cast::<u8>(), out, state.progress_room);
        }
        Ok(())
    })
}

/// Reports how long the phases of the last call with phases took, in the order of their first runs; a phase that ran
/// several times is one entry with the sum.
///
/// dst: room for frz_stage_time; with data NULL only the count is reported. FRZ_ERROR_CAPACITY when it is too small.
/// count: receives the number of phases; 0 after other failures.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_context_timings(
    context: *const frz_context,
    dst: frz_span,
    count: *mut usize,
) -> frz_status {
    guard(|| {
        let count = required(count, "count")?;
        // SAFETY: the pointers are NULL or the caller's.
        unsafe {
            count.write(0);
            let call = enter(context)?;
            let timings = call.0.timings.lock().unwrap_or_else(PoisonError::into_inner);
            let time = |time: &PhaseTime| frz_stage_time {
                stage: letters(time.name),
                seconds: time.time.as_secs_f64(),
            };
            dst.list(count, timings.len(), || Ok(timings.iter().map(time).collect()))
        }
    })
}
