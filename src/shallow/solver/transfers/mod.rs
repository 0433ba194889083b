//! Transfers between columns: scaled, in whole units, with the scalars that they carry (thesis 4.1.1, Eq. 4.2).

pub(in crate::shallow::solver) mod inflow_limit;
pub(in crate::shallow::solver) mod limiter;
pub(in crate::shallow::solver) mod scalars;
pub(in crate::shallow::solver) mod scale;
pub(in crate::shallow::solver) mod whole_units;
