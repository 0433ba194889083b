//! Files of points that contain only what changed since another frame (`grains_mode = "delta"`): they are not a frame's points.

use std::path::Path;

use super::{MetaValue, file};
use crate::error::Result;

/// Metadata of such a file: the frame since which it contains changes.
pub const CHANGES_SINCE_KEY: &str = "frazil:changes_since";

/// The frame since which a .vdb file contains changes; none if it is complete.
///
/// # Errors
/// A file that cannot be read.
pub fn changes_since(path: &Path) -> Result<Option<i32>> {
    Ok(since(&file::metadata(path)?))
}

/// As [`changes_since`], from the metadata of the file.
pub fn since(metadata: &[(String, MetaValue)]) -> Option<i32> {
    metadata.iter().find_map(|(key, value)| match value {
        MetaValue::Int(frame) if key == CHANGES_SINCE_KEY => Some(*frame as i32),
        _ => None,
    })
}

/// Message about a file that contains changes since a frame.
pub fn partial(since: i32) -> String {
    format!(
        "holds only the grains that changed since frame {since}: `frazil vdb rebuild DIR --stage grains` makes it whole"
    )
}
