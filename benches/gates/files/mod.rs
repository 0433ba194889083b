//! Files: other readers see what we see, and damaged ones do no harm.

pub mod damage;
pub mod readers;
