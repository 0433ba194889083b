//! Lists that keep their memory while their contents are replaced, and checks of their lengths.

use crate::error::{Error, Result};

/// Makes a list of so many copies of a value.
pub fn reset<T: Clone>(list: &mut Vec<T>, len: usize, value: T) {
    list.clear();
    list.resize(len, value);
}

/// Replaces the contents of a list.
pub fn refill<T>(list: &mut Vec<T>, items: impl IntoIterator<Item = T>) {
    list.clear();
    list.extend(items);
}

/// Divides each of some lists at an index, or at its end if that comes first.
pub fn split_each<T, const N: usize>(lists: [&mut [T]; N], at: usize) -> [[&mut [T]; N]; 2] {
    let mut behind = [(); N].map(|()| Default::default());
    let mut ends = behind.iter_mut();
    let before = lists.map(|list| {
        let (before, end) = list.split_at_mut(at.min(list.len()));
        *ends.next().expect("as many") = end;
        before
    });
    [before, behind]
}

/// Checks that there is one of something for each of some others.
///
/// # Errors
/// `Argument`: there is another count.
pub fn check_each(count: usize, what: &str, others: usize, of: &str) -> Result<()> {
    if count == others {
        return Ok(());
    }
    Err(Error::argument(format!("{count} {what} are not one for each of {others} {of}")))
}

/// As [`check_each`], for room that the caller gives for results.
///
/// # Errors
/// `Argument`: there is another count.
pub fn check_room(room: usize, what: &str, others: usize, of: &str) -> Result<()> {
    if room == others {
        return Ok(());
    }
    Err(Error::argument(format!("room for {room} {what} is not that of {others} {of}")))
}
