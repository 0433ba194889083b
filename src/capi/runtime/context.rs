//! Contexts: cancel, progress, warnings and times of a computation.

use std::ffi::{CString, c_char, c_int, c_void};
use std::ops::Deref;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use super::library::FRZ_ABI_VERSION;
use super::pool::{Threads, frz_pool};
use crate::capi::ffi::guard::frz_status::*;
use crate::capi::ffi::*;
use crate::context::{Context, PhaseTime, Phases, Progress, Running, machine_memory};
use crate::error::Error;

/// A computation: its cancel flag, progress, polls, warnings and phase times. Cheap: create one for each cook (evaluation of a node).
pub struct frz_context {
    _opaque: [u8; 0],
}

/// The progress of a call.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_progress {
    /// Name of the running phase, for instance "distance"; empty between phases. Zero-terminated.
    pub stage: [c_char; 32],
    /// Phases finished since the context was created or reset.
    pub stages_done: u64,
    /// Seconds since the running call began; 0 between calls.
    pub seconds: f64,
    /// Completed fraction of the running phase, 0 to 1; -1 if unknown. Since interface 1.1: programs compiled with a header of 1.0 do not
    /// have this field, and it is not written.
    pub fraction: f64,
}

/// Bytes of frz_progress in the header of interface 1.0.
const FIRST_PROGRESS_BYTES: usize = std::mem::offset_of!(frz_progress, fraction);

/// The time that a phase took.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct frz_stage_time {
    /// Name of the phase. Zero-terminated.
    pub stage: [c_char; 32],
    /// Seconds; the sum over all of its runs in the call.
    pub seconds: f64,
}

/// Called while the library works; a return value other than 0 cancels. It must return: no exception, no longjmp.
///
/// user: the pointer given to frz_context_set_poll.
/// progress: what is being done; owned by the library, valid until the function returns.
pub type frz_poll_function =
    Option<unsafe extern "C" fn(user: *mut c_void, progress: *const frz_progress) -> c_int>;

/// Receives a warning. It must return: no exception, no longjmp.
///
/// user: the pointer given to frz_context_set_log.
/// text: one sentence in UTF-8; owned by the library, valid until the function returns.
pub type frz_log_function = Option<unsafe extern "C" fn(user: *mut c_void, text: *const c_char)>;

/// When the running call began.
#[derive(Clone, Default)]
struct CallStart(Arc<Mutex<Option<Instant>>>);

impl CallStart {
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
pub(in crate::capi) struct ContextHandle {
    /// The library's own context.
    pub ctx: Context,
    /// Dropped last: the context's threads.
    _threads: Threads,
    /// Size of frz_progress in the caller's header (bytes).
    progress_room: usize,
    entered: AtomicBool,
    poisoned: AtomicBool,
    call_start: CallStart,
    timings: Mutex<Vec<PhaseTime>>,
}

handle!(frz_context, ContextHandle, "context", 2);

/// A real-time call, which has exclusive use of a context except for cancel, reset and progress. It takes no lock, allocates nothing,
/// reads no clock, and has no phases, polls or progress.
pub(in crate::capi) struct LightCall<'a>(Reading<'a, ContextHandle>);

impl<'a> LightCall<'a> {
    /// # Safety
    /// The context must be NULL or not destroyed.
    unsafe fn begin(context: *const frz_context) -> Outcome<Self> {
        // SAFETY: guaranteed by the caller.
        let state = unsafe { read(context) }?;
        if state.entered.swap(true, Ordering::AcqRel) {
            return Err(Failure::new(FRZ_ERROR_BUSY, "the context is in use by another call"));
        }
        let call = Self(state);
        if call.0.poisoned.load(Ordering::Acquire) {
            let text = "the context saw an internal error before and can only be destroyed";
            return Err(Failure::new(FRZ_ERROR_POISONED, text));
        }
        Ok(call)
    }

    /// The library's own context.
    pub(in crate::capi) fn ctx(&self) -> &Context {
        &self.0.ctx
    }
}

impl Drop for LightCall<'_> {
    fn drop(&mut self) {
        if std::thread::panicking() {
            self.0.poisoned.store(true, Ordering::Release);
        }
        self.0.entered.store(false, Ordering::Release);
    }
}

/// Begins a real-time call with a context, unless it is cancelled. A later cancel takes effect only in frames that may take a long time.
///
/// # Safety
/// As [`enter`].
pub(in crate::capi) unsafe fn enter_light<'a>(context: *const frz_context) -> Outcome<LightCall<'a>> {
    // SAFETY: guaranteed by the caller.
    let call = unsafe { LightCall::begin(context) }?;
    if call.ctx().is_cancelled() {
        return Err(Error::Cancelled.into());
    }
    Ok(call)
}

/// A call with phases, polls and progress; it has exclusive use of a context as a [`LightCall`] has.
pub(in crate::capi) struct Call<'a> {
    /// Dropped before `light`, which admits the next call: that call must not inherit this one's cancel.
    phases: (Running, Phases),
    light: LightCall<'a>,
}

impl<'a> Deref for Call<'a> {
    type Target = LightCall<'a>;
    fn deref(&self) -> &LightCall<'a> {
        &self.light
    }
}

impl Drop for Call<'_> {
    fn drop(&mut self) {
        let timings = self.phases.1.times();
        if !timings.is_empty() {
            *self.light.0.timings.lock().unwrap_or_else(PoisonError::into_inner) = timings;
        }
        self.light.0.call_start.set(None);
    }
}

/// Begins a call with a context.
///
/// # Safety
/// The context must be NULL or not destroyed.
pub(in crate::capi) unsafe fn enter<'a>(context: *const frz_context) -> Outcome<Call<'a>> {
    // SAFETY: guaranteed by the caller.
    let light = unsafe { LightCall::begin(context) }?;
    let phases = (light.ctx().begin(), light.ctx().collect());
    light.0.call_start.set(Some(Instant::now()));
    Ok(Call { phases, light })
}

/// The body of an interface function that creates an object: `out` receives it, or NULL after a failure.
///
/// # Safety
/// As [`enter`] and [`give`].
pub(in crate::capi) unsafe fn creates<N: HandleType, V: Into<N::Value>>(
    context: *const frz_context,
    out: *mut *mut N,
    make: impl FnOnce(&Context) -> Outcome<V>,
) -> frz_status {
    // SAFETY: guaranteed by the caller.
    guard(|| unsafe {
        clear(out);
        let call = enter(context)?;
        required(out, "out")?;
        give(out, make(call.ctx())?.into())
    })
}

/// The body of an interface function that moves an object through a step and reports what the step did.
///
/// # Safety
/// As [`enter`], [`change`] and [`reports`].
pub(in crate::capi) unsafe fn steps<N: HandleType, T: Sized32>(
    context: *const frz_context,
    object: *mut N,
    report: *mut T,
    step: impl FnOnce(&Context, &mut N::Value) -> Outcome<T>,
) -> frz_status {
    // SAFETY: guaranteed by the caller.
    guard(|| unsafe {
        reports(report, || {
            let call = enter(context)?;
            step(call.ctx(), &mut *change(object)?)
        })
    })
}

/// A pointer of a host, which is passed back to it and never dereferenced.
#[derive(Clone, Copy)]
struct User(*mut c_void);

// SAFETY: the library never dereferences it, and passes it back on the calling thread.
unsafe impl Send for User {}

impl User {
    fn pointer(self) -> *mut c_void {
        self.0
    }
}

/// A text as a zero-terminated array, cut to 31 bytes.
fn zero_terminated(verb: &str) -> [c_char; 32] {
    let mut out = [0; 32];
    out.iter_mut().take(31).zip(verb.bytes()).for_each(|(to, from)| *to = from as c_char);
    out
}

/// Memory limit of a new context (bytes).
fn default_memory_limit() -> u64 {
    machine_memory().unwrap_or(u64::MAX)
}

fn progress_of(progress: &Progress, call_start: &CallStart) -> frz_progress {
    frz_progress {
        stage: zero_terminated(progress.phase),
        stages_done: progress.phases_done as u64,
        seconds: call_start.seconds(),
        fraction: progress.part.map_or(-1.0, f64::from),
    }
}

/// Creates a context on a pool.
///
/// abi: FRZ_ABI_VERSION of the caller's header. FRZ_ERROR_VERSION if the major numbers differ, or if the library is older than the header.
/// pool: provides the threads; it may be destroyed before the context.
/// out: receives the context, to be destroyed with frz_context_destroy; NULL after a failure.
///
/// Any thread. A context serves one call at a time (FRZ_ERROR_BUSY), except frz_context_cancel, frz_context_reset and frz_context_progress.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_context_create(
    abi: u32,
    pool: *mut frz_pool,
    out: *mut *mut frz_context,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    guard(|| unsafe {
        clear(out);
        required(out, "out")?;
        if abi >> 16 != FRZ_ABI_VERSION >> 16 || abi & 0xffff > FRZ_ABI_VERSION & 0xffff {
            let [major, minor] = [abi >> 16, abi & 0xffff];
            let [own, own_minor] = [FRZ_ABI_VERSION >> 16, FRZ_ABI_VERSION & 0xffff];
            let text = format!("the header has interface {major}.{minor}, this library {own}.{own_minor}");
            return Err(Failure::new(FRZ_ERROR_VERSION, text));
        }
        let threads = read(pool.cast_const())?.share();
        let ctx = Context::new(threads.0.clone());
        ctx.set_memory_limit(default_memory_limit());
        give(
            out,
            ContextHandle {
                ctx,
                _threads: threads,
                progress_room: if abi & 0xffff == 0 {
                    FIRST_PROGRESS_BYTES
                } else {
                    size_of::<frz_progress>()
                },
                entered: AtomicBool::new(false),
                poisoned: AtomicBool::new(false),
                call_start: CallStart::default(),
                timings: Mutex::default(),
            },
        )
    })
}

/// Destroys a context; NULL is ignored.
///
/// context: may be NULL. It is not destroyed while a call with it runs.
///
/// Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_context_destroy(context: *mut frz_context) {
    // SAFETY: the context is NULL or alive.
    guard(|| unsafe { destroy(context) });
}

/// Sets the function that is called while the library works, for a progress bar and an escape key.
///
/// It is called on the thread that called the library: at the beginning of each phase, then every 10 to 50 ms, also inside long phases.
/// Without worker threads (a pool of 0 threads) it is called between pieces of work, at no guaranteed interval. The function may call
/// frz_context_cancel and frz_context_progress, but nothing else with this context.
///
/// poll: NULL for none.
/// user: passed to the function; may be NULL.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_context_set_poll(
    context: *mut frz_context,
    poll: frz_poll_function,
    user: *mut c_void,
) -> frz_status {
    guard(|| {
        // SAFETY: the context is NULL or alive.
        let call = unsafe { enter(context) }?;
        let user = User(user);
        let call_start = call.0.call_start.clone();
        call.ctx().set_poll(poll.map(|poll| {
            let call_host = move |progress: &Progress| {
                let reported = progress_of(progress, &call_start);
                // SAFETY: the host guarantees a function that takes these.
                unsafe { poll(user.pointer(), &reported) != 0 }
            };
            Box::new(call_host) as crate::context::Poll
        }));
        Ok(())
    })
}

/// Sets the function that receives warnings: what a user should know although the call succeeds, for instance that a mesh is open.
///
/// It is called on the thread that called the library. The library itself never prints. The function must call nothing with this context.
///
/// log: NULL for none; warnings are then dropped.
/// user: passed to the function; may be NULL.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_context_set_log(
    context: *mut frz_context,
    log: frz_log_function,
    user: *mut c_void,
) -> frz_status {
    guard(|| {
        // SAFETY: the context is NULL or alive.
        let call = unsafe { enter(context) }?;
        let user = User(user);
        call.ctx().set_log(log.map(|log| {
            let call_host = move |text: &str| {
                let text = CString::new(text.replace('\0', "")).unwrap_or_default();
                // SAFETY: the host guarantees a function that takes these.
                unsafe { log(user.pointer(), text.as_ptr()) };
            };
            Box::new(call_host) as crate::context::Log
        }));
        Ok(())
    })
}

/// Sets the memory limit of objects that are created or changed with this context.
///
/// The memory of a call is estimated before any is allocated; a call that would need more returns FRZ_ERROR_MEMORY and changes nothing.
/// This guards against a wrong voxel size; it does not account for every byte.
///
/// bytes: 0 for the limit of a new context, the machine's memory; UINT64_MAX for no limit.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_context_set_memory_limit(context: *mut frz_context, bytes: u64) -> frz_status {
    guard(|| {
        // SAFETY: the context is NULL or alive.
        let call = unsafe { enter(context) }?;
        call.ctx().set_memory_limit(if bytes == 0 { default_memory_limit() } else { bytes });
        Ok(())
    })
}

/// Cancels the call that runs with the context, and every later one until frz_context_reset: they return FRZ_CANCELLED and change nothing.
/// A call whose work is done when it is cancelled returns normally.
///
/// context: may be NULL.
///
/// Any thread, any time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_context_cancel(context: *mut frz_context) {
    // SAFETY: the context is NULL or alive.
    if let Ok(state) = unsafe { read(context.cast_const()) } {
        state.ctx.cancel();
    }
}

/// Clears a cancel and restarts the count of phases, for the calls that follow. A call that is running stays cancelled: it never continues
/// with part of its work left out.
///
/// context: may be NULL.
///
/// Any thread, any time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_context_reset(context: *mut frz_context) {
    guard(|| {
        // SAFETY: the context is NULL or alive.
        unsafe { read(context.cast_const()) }?.ctx.reset();
        Ok(())
    });
}

/// Reports the progress of the context's call.
///
/// out: receives it; all zeroes after a failure, except fraction.
///
/// Any thread, any time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_context_progress(
    context: *const frz_context,
    out: *mut frz_progress,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid, and `out` has as much room as the header of the context's creator states.
    guard(|| unsafe {
        let out = required(out, "out")?.cast::<u8>();
        out.write_bytes(0, FIRST_PROGRESS_BYTES);
        let state = read(context)?;
        let progress = progress_of(&state.ctx.progress(), &state.call_start);
        std::ptr::copy_nonoverlapping((&raw const progress).cast::<u8>(), out, state.progress_room);
        Ok(())
    })
}

/// Reports how long the phases of the last call that had phases took, in the order of their first runs; a phase that ran several times is
/// one entry with the sum.
///
/// dst: room for elements of frz_stage_time; with data NULL only the count is reported. FRZ_ERROR_CAPACITY if it is too small.
/// count: receives the number of phases; 0 after other failures.
///
/// One thread at a time.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_context_timings(
    context: *const frz_context,
    dst: frz_span,
    count: *mut usize,
) -> frz_status {
    // SAFETY: the pointers are NULL or valid.
    unsafe {
        lists(count, || {
            let call = enter(context)?;
            let timings = call.0.timings.lock().unwrap_or_else(PoisonError::into_inner);
            let time = |PhaseTime { name, time, .. }: &PhaseTime| frz_stage_time {
                stage: zero_terminated(name),
                seconds: time.as_secs_f64(),
            };
            list(timings.iter().map(time), &dst, count)
        })
    }
}
