//! Pools of worker threads.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::capi::ffi::*;
use crate::context::Pool;

/// Worker threads that any number of contexts may share.
pub struct frz_pool {
    _opaque: [u8; 0],
}

/// A pool's threads, which live as long as the pool or one of its contexts.
pub(in crate::capi) struct Threads(pub Arc<Pool>, #[allow(dead_code, reason = "counts itself")] Arc<Alive>);

/// Counts the pools that are alive: after the last one none of frazil's threads is left.
pub(in crate::capi) struct Alive;

static ALIVE: AtomicUsize = AtomicUsize::new(0);

impl Threads {
    fn start(threads: u32) -> Outcome<Self> {
        let pool = Pool::new(threads as usize)?;
        ALIVE.fetch_add(1, Ordering::AcqRel);
        Ok(Self(pool, Arc::new(Alive)))
    }

    /// The same threads, for a context.
    pub(in crate::capi) fn share(&self) -> Self {
        Self(self.0.clone(), self.1.clone())
    }
}

impl Drop for Alive {
    fn drop(&mut self) {
        if ALIVE.fetch_sub(1, Ordering::AcqRel) == 1 {
            #[cfg(feature = "vdb")]
            crate::vdb::end_workers();
        }
    }
}

handle!(frz_pool, Threads, "pool", 1);

/// Starts worker threads.
///
/// Any number of contexts may share a pool. Results do not depend on the number of threads.
///
/// threads: number of workers, 0 to 1024. 0: no workers; the calling thread does all the work, and polls fall between pieces of work, at no
///     guaranteed interval.
/// out: receives the pool, to be destroyed with frz_pool_destroy; NULL after a failure.
///
/// Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_pool_create(threads: u32, out: *mut *mut frz_pool) -> frz_status {
    // SAFETY: `out` is NULL or valid.
    guard(|| unsafe {
        clear(out);
        required(out, "out")?;
        give(out, Threads::start(threads)?)
    })
}

/// Destroys a pool; NULL is ignored.
///
/// Its threads end, and are joined, once the contexts created on it are destroyed too. With the last pool OpenVDB's threads end as well,
/// unless the host uses TBB itself: they are then left to the host.
///
/// pool: may be NULL. Must not be called within a poll or log function.
///
/// Any thread.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn frz_pool_destroy(pool: *mut frz_pool) {
    // SAFETY: the pool is NULL or alive.
    guard(|| unsafe { destroy(pool) });
}
