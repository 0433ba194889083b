//! Descriptions of grids in files, known before their values are read.

use crate::vdb::grid::MetaValue;

/// The description of a grid in a file.
#[derive(Debug, Clone, PartialEq)]
pub struct GridInfo {
    /// Name.
    pub name: String,
    /// OpenVDB's type name, for instance `Tree_float_5_4_3`.
    pub value_type: String,
    /// Class: "level set", "fog volume", "unknown" ...
    pub class: String,
    /// Edge of a cell along x (m).
    pub voxel: f64,
    /// Active voxels, if the file states them.
    pub active_voxels: Option<u64>,
    /// Minimum and maximum active voxel, if the file states them.
    pub bbox: Option<([i32; 3], [i32; 3])>,
    /// Memory when loaded (bytes), if the file states it.
    pub memory: Option<u64>,
    /// Whether values are stored in 16 bits.
    pub half: bool,
    /// Codecs.
    pub compression: String,
    /// All metadata.
    pub metadata: Vec<(String, MetaValue)>,
}
