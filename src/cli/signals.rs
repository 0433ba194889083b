//! Ctrl-C and SIGTERM raise the cancel flags; a second one ends the program at once.

use signal_hook::consts::signal::{SIGINT, SIGTERM, SIGXFSZ};
use signal_hook::flag;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

/// Which signal came, if one did.
pub struct Signals {
    code: Arc<AtomicUsize>,
}

impl Signals {
    /// Installs the handlers; they set the flags of `cancel`, one after the other, and nothing else.
    pub fn install(cancel: [Arc<AtomicBool>; 2]) -> std::io::Result<Self> {
        let code = Arc::new(AtomicUsize::new(0));
        let again = Arc::new(AtomicBool::new(false));
        for (signal, exit_code) in [(SIGINT, 130), (SIGTERM, 143)] {
            // The order matters: the first signal finds `again` unset and raises it for the second.
            flag::register_conditional_shutdown(signal, exit_code, again.clone())?;
            flag::register(signal, again.clone())?;
            flag::register_usize(signal, code.clone(), exit_code as usize)?;
            for flag in &cancel {
                flag::register(signal, flag.clone())?;
            }
        }
        // A file over the shell's size limit is to be a failed write, not the end of the program.
        flag::register(SIGXFSZ, Arc::new(AtomicBool::new(false)))?;
        Ok(Self { code })
    }

    /// The exit code of the signal that came: 130 or 143.
    pub fn received(&self) -> Option<u8> {
        match self.code.load(Ordering::Relaxed) {
            0 => None,
            code => Some(code as u8),
        }
    }
}
