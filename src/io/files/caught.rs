//! Converts panics in third-party parsers to errors.

use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::Once;

use super::source;
use crate::error::{Error, Result};

thread_local! {
    static DEPTH: Cell<u32> = const { Cell::new(0) };
}

/// Reads a file with code that may panic on unexpected damage.
///
/// # Errors
/// What `read` returns; for a panic, that the file is damaged; [`Error::Cancelled`] once readers must stop.
pub fn caught<T>(path: &Path, read: impl FnOnce() -> Result<T>) -> Result<T> {
    silence_panics();
    DEPTH.set(DEPTH.get() + 1);
    let outcome = catch_unwind(AssertUnwindSafe(read));
    DEPTH.set(DEPTH.get() - 1);
    // If readers were stopped, the error itself does not matter.
    source::check()?;
    outcome.unwrap_or_else(|_| Err(Error::file(path, "the file is damaged: it contradicts itself")))
}

/// Panics of readers become errors and are not printed; other panics go to the previous panic hook.
fn silence_panics() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let before = std::panic::take_hook();
        std::panic::set_hook(Box::new(move |panic| {
            if DEPTH.get() == 0 {
                before(panic);
            }
        }));
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_becomes_an_error_that_names_the_file() {
        let error = caught::<()>(Path::new("a.glb"), || panic!("on purpose")).unwrap_err();
        assert_eq!(error.to_string(), "a.glb: the file is damaged: it contradicts itself");
    }
}
