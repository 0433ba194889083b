//! Tests that others would disturb, one at a time and apart from `testsuite`: those that hold how soon an answer comes, those
//! that change what a whole process shares, and those that run shots in this process. Such a run locks its folder, and a
//! program that another test starts at that moment holds the lock for an instant longer.

#[path = "../common/mod.rs"]
mod common;
#[path = "../common/program.rs"]
#[allow(dead_code)]
mod program;

mod abandon;
mod shot_stages;
mod waits;

use std::sync::{Mutex, MutexGuard, PoisonError};

/// Waits until no other of these tests runs. A test that fails does not fail the rest.
fn turn() -> MutexGuard<'static, ()> {
    static TURN: Mutex<()> = Mutex::new(());
    TURN.lock().unwrap_or_else(PoisonError::into_inner)
}
