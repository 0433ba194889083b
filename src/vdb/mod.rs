//! The only door to OpenVDB.
