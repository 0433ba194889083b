//! Ctrl-C and SIGTERM raise the cancel flags. A second signal ends the program at once; so does the first, after a grace period, if the
//! work does not stop, for instance because it waits for a file.

use signal_hook::consts::signal::{SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::flag;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::time::Duration;

use super::exit;

/// Time that the work may take to stop.
const GRACE: Duration = Duration::from_millis(700);
/// Interval between checks for a signal.
const CHECK_INTERVAL: Duration = Duration::from_millis(50);

/// The signal that was received, if any.
pub struct Signals {
    code: Arc<AtomicUsize>,
}

impl Signals {
    /// Installs the handlers; they set the flags of `cancel`, one after the other, and nothing else.
    pub fn install(cancel: [Arc<AtomicBool>; 2]) -> std::io::Result<Self> {
        let code = Arc::new(AtomicUsize::new(0));
        let again = Arc::new(AtomicBool::new(false));
        for (signal, exit_code) in [(SIGINT, 130), (SIGTERM, 143)] {
            // The order matters: the first signal finds `again` unset and sets it for the second.
            flag::register_conditional_shutdown(signal, exit_code, again.clone())?;
            flag::register(signal, again.clone())?;
            flag::register_usize(signal, code.clone(), exit_code as usize)?;
            for flag in &cancel {
                flag::register(signal, flag.clone())?;
            }
        }
        // A file over the shell's size limit must be a failed write, not the end of the program.
        flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)))?;
        let signals = Self { code };
        signals.watch()?;
        Ok(signals)
    }

    /// Ends the program some time after a signal, whatever it is doing. This is safe at any moment, as files are written atomically.
    fn watch(&self) -> std::io::Result<()> {
        let code = self.code.clone();
        let watch = move || {
            while code.load(Ordering::Relaxed) == 0 {
                std::thread::sleep(CHECK_INTERVAL);
            }
            std::thread::sleep(GRACE);
            let code = code.load(Ordering::Relaxed) as u8;
            frazil::io::files::atomic::abandon();
            exit::print_stopped(code);
            // Destructors of other threads' data must not run.
            signal_hook::low_level::exit(code.into());
        };
        std::thread::Builder::new().name("signals".into()).spawn(watch).map(drop)
    }

    /// The exit code of the received signal: 130 or 143.
    pub fn received(&self) -> Option<u8> {
        match self.code.load(Ordering::Relaxed) {
            0 => None,
            code => Some(code as u8),
        }
    }
}
