//! Transfers between columns: scaled, in whole units, with the scalars that they carry (thesis 4.1.1, Eq. 4.2).

pub(super) mod inflow_limit;
pub(super) mod limiter;
pub(super) mod scalars;
pub(super) mod scale;
pub(super) mod whole_units;
