//! Iterative limiter of integer transfers: no column gives more than it has or takes more than it has room for.
//!
//! Each round cuts all transfers simultaneously, in integers, so that nothing depends on their order: first to what the donors have, then,
//! until no column would overflow, to the receivers' room, including what they give. Each cut makes its columns safer as donors, but may
//! leave them too little room as receivers; the next round corrects that.

use crate::shallow::columns::NONE;
use crate::shallow::solver::pressurised::edges::Edge;
use crate::shallow::solver::stop::Stop;

/// Rounds in which inflow is cut in proportion; after these it is cut to 0.
const CUTS: usize = 64;

/// A column at an end of a limited transfer.
#[derive(Debug, Clone, Copy, Default)]
pub(in crate::shallow::solver) struct Party {
    /// Its index.
    pub column: u32,
    /// Units that it has, and units that it has room for.
    pub has: i64,
    pub room: i64,
    /// Units that it gives and takes in this round.
    pub gives: i64,
    pub takes: i64,
}

/// Limits the units of transfers, unless it is stopped.
pub(in crate::shallow::solver) fn limit(parties: &mut [Party], edges: &mut [Edge], stop: &Stop) {
    count(parties, edges);
    for edge in edges.iter_mut() {
        if let Some(donor) = parties.get(edge.ends[usize::from(edge.units < 0)] as usize)
            && donor.gives > donor.has
        {
            edge.units = share(edge.units, donor.has, donor.gives);
        }
    }
    for round in 0.. {
        count(parties, edges);
        if parties.iter().all(|party| party.takes - party.gives <= party.room) || stop.is_requested() {
            return;
        }
        for edge in edges.iter_mut() {
            let receiver = edge.ends[usize::from(edge.units > 0)];
            if let Some(receiver) = parties.get(receiver as usize).filter(|_| receiver != NONE)
                && receiver.takes - receiver.gives > receiver.room
            {
                let allowed = if round < CUTS { receiver.room + receiver.gives } else { 0 };
                edge.units = share(edge.units, allowed, receiver.takes);
            }
        }
    }
}

/// units x part / whole, rounded toward zero.
fn share(units: i64, part: i64, whole: i64) -> i64 {
    (i128::from(units) * i128::from(part) / i128::from(whole)) as i64
}

fn count(parties: &mut [Party], edges: &[Edge]) {
    for party in parties.iter_mut() {
        (party.gives, party.takes) = (0, 0);
    }
    for edge in edges.iter().filter(|edge| edge.units != 0) {
        let donor = usize::from(edge.units < 0);
        if let Some(party) = parties.get_mut(edge.ends[donor] as usize) {
            party.gives += edge.units.abs();
        }
        if let Some(party) = parties.get_mut(edge.ends[1 - donor] as usize) {
            party.takes += edge.units.abs();
        }
    }
}
