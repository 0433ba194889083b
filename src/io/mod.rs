//! Files that are not .vdb.
