//! Which columns are full.

use crate::shallow::columns::STRIP;
use crate::shallow::columns::grid::TOP;

/// A column is full when its missing liquid is at most its height (base to ceiling) divided by this.
pub const SLACK: i32 = 128;

/// Which columns of a strip are full, given bases, ceilings and depths.
#[inline]
pub(super) fn full_of([base, ceiling, depth]: [&[i32; STRIP]; 3]) -> [i32; STRIP] {
    let mut full = [0; STRIP];
    for x in 0..STRIP {
        let room = ceiling[x] - base[x];
        full[x] = i32::from((depth[x] > 0) & (ceiling[x] < TOP) & (room - depth[x] <= room / SLACK));
    }
    full
}
