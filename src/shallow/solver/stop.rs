//! What ends a step that takes long before it is done.

use std::sync::atomic::{AtomicBool, Ordering};

/// Whether a frame is to end at once. What a step has then made is of no use: whoever asks puts the liquid back as it was.
#[derive(Clone, Copy)]
pub struct Stop<'a>(Option<&'a AtomicBool>);

impl<'a> Stop<'a> {
    /// Nothing does.
    pub const NEVER: Self = Self(None);

    /// When a flag is set.
    pub fn when(flag: &'a AtomicBool) -> Self {
        Self(Some(flag))
    }

    /// Whether it is.
    pub fn is_asked(&self) -> bool {
        self.0.is_some_and(|flag| flag.load(Ordering::Relaxed))
    }
}
