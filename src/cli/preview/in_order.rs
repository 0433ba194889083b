//! Several frames at once: read in order, processed in parallel, taken in order.

use std::collections::VecDeque;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

use frazil::{Error, Result};

/// A frame to be made: its index, and the channel for its result.
type Job<T> = (usize, Sender<Result<T>>);

/// Makes frames 0 to `count` - 1 on several threads. `read` is called for one frame after the other, `make` for several at once,
/// each on the thread that read it, and `take` with their results in order on the caller's thread. At most one frame more
/// than there are threads is in flight.
///
/// # Errors
/// The first error, in order of frames; no later frame is read any more.
pub fn in_order<R, T: Send, E: From<Error>>(
    count: usize,
    threads: usize,
    read: impl FnMut(usize) -> Result<R> + Send,
    make: impl Fn(usize, R) -> Result<T> + Sync,
    mut take: impl FnMut(usize, T) -> std::result::Result<(), E>,
) -> std::result::Result<(), E> {
    let (sender, jobs) = channel::<Job<T>>();
    let (queue, failed) = (Mutex::new((jobs, read)), AtomicBool::new(false));
    std::thread::scope(|scope| {
        for _ in 0..threads.max(1) {
            scope.spawn(|| run_jobs(&queue, &failed, &make));
        }
        // Dropped with the closure; this ends the threads.
        let sender = sender;
        let mut in_flight: VecDeque<Receiver<Result<T>>> = VecDeque::new();
        let mut next = 0;
        let mut take_next = |index: usize| {
            while next < count && in_flight.len() <= threads {
                let (done, made) = channel();
                sender.send((next, done)).map_err(|_| threads_ended())?;
                in_flight.push_back(made);
                next += 1;
            }
            let made =
                in_flight.pop_front().ok_or_else(threads_ended)?.recv().map_err(|_| threads_ended())?;
            take(index, made?)
        };
        let result = (0..count).try_for_each(&mut take_next);
        failed.store(result.is_err(), Ordering::Relaxed);
        result
    })
}

/// Takes jobs until none are left.
fn run_jobs<R, T>(
    queue: &Mutex<(Receiver<Job<T>>, impl FnMut(usize) -> Result<R>)>,
    failed: &AtomicBool,
    make: &impl Fn(usize, R) -> Result<T>,
) {
    loop {
        // One thread at a time waits for a job and reads it, while the others process theirs. A panic there poisons the lock and ends all.
        let Ok(mut guard) = queue.lock() else { return };
        let (jobs, read) = &mut *guard;
        let Ok((frame, done)) = jobs.recv() else { return };
        // Jobs that were sent before a frame failed are still in the channel.
        if failed.load(Ordering::Relaxed) {
            return;
        }
        let raw = read(frame);
        drop(guard);
        // The receiver is gone if an earlier frame failed.
        let _ = done.send(raw.and_then(|raw| make(frame, raw)));
    }
}

fn threads_ended() -> Error {
    Error::Internal("the threads that make frames are gone".into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicUsize;
    use std::time::Duration;

    #[test]
    fn frames_are_read_and_taken_in_order_and_few_are_under_way() {
        for threads in [1, 3] {
            let (mut read, mut taken) = (Vec::new(), Vec::new());
            let under_way = AtomicUsize::new(0);
            let begin = |frame: usize| {
                read.push(frame);
                assert!(under_way.fetch_add(1, Ordering::SeqCst) <= threads);
                Ok(frame)
            };
            let make = |frame: usize, raw: usize| {
                // Later frames finish sooner.
                std::thread::sleep(Duration::from_millis(3 * (20 - frame as u64) % 7));
                Ok(10 * raw)
            };
            let take = |frame: usize, made: usize| {
                under_way.fetch_sub(1, Ordering::SeqCst);
                taken.push((frame, made));
                Ok::<(), Error>(())
            };
            in_order(20, threads, begin, make, take).unwrap();
            assert_eq!(read, (0..20).collect::<Vec<_>>());
            assert_eq!(taken, (0..20).map(|frame| (frame, 10 * frame)).collect::<Vec<_>>());
        }
        in_order(0, 2, |_| Ok(()), |_, ()| Ok(()), |_, ()| Ok::<(), Error>(())).unwrap();
    }

    #[test]
    fn the_first_error_ends_it() {
        for faulty in [0, 4, 19] {
            let mut taken = 0;
            let make = |frame: usize, ()| {
                if frame >= faulty { Err(Error::argument(frame.to_string())) } else { Ok(()) }
            };
            let take = |_, ()| {
                taken += 1;
                Ok::<(), Error>(())
            };
            let error = in_order(20, 3, |_| Ok(()), make, take).unwrap_err();
            assert_eq!((error.to_string(), taken), (faulty.to_string(), faulty));
        }
        let full =
            in_order(9, 2, |_| Ok(()), |_, ()| Ok(()), |_, ()| Err(Error::argument("full"))).unwrap_err();
        assert_eq!(full.to_string(), "full");
    }
}
