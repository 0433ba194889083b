//! Parameters of falling liquid.

use crate::error::{Error, Result};
use crate::numeric::checks::{check_not_negative, check_within};
use crate::shallow::columns::Columns;
use crate::shallow::pipes::cliffs::Cliffs;

/// Parameters of falling liquid.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Falls {
    /// Liquid falls freely where the surface below is more than this (m) below the base of the donor column; 0 or more. Default: 0.01. Over
    /// steps lower than a cell's edge it never does.
    pub height: f64,
    /// Time between packets of an overflow edge (s), 0.0001 to 1; a step, if that is longer. Default: 1/120.
    pub interval: f64,
    /// Volume of a drop (m3), 0 or more. If an overflow edge takes longer than 8 intervals to deliver this volume, its liquid waits there
    /// until there is enough for one drop, for 60 intervals at most. Default: 6.5e-11, a ball half a millimetre across.
    pub drop: f64,
    /// Maximum count of packets in the air, 1 to 1,048,576; their memory is reserved from the beginning. Default: 8192. At the maximum,
    /// liquid that goes over an overflow edge arrives below at once.
    pub max_packets: usize,
}

impl Default for Falls {
    fn default() -> Self {
        Self { height: 0.01, interval: 1.0 / 120.0, drop: 6.5e-11, max_packets: 8192 }
    }
}

impl Falls {
    /// Checks the numbers.
    ///
    /// # Errors
    /// `Argument`, naming the field and its range.
    pub fn validate(&self) -> Result<()> {
        check_not_negative("falls.height", self.height)?;
        check_not_negative("falls.drop", self.drop)?;
        check_within("falls.interval", self.interval, " s", 1e-4..=1.0)?;
        if !(1..=1 << 20).contains(&self.max_packets) {
            return Err(Error::argument(format!(
                "falls.most = {} is not within 1 to 1048576",
                self.max_packets
            )));
        }
        Ok(())
    }

    /// The pipes through which liquid may fall freely.
    pub(in crate::shallow) fn cliffs(falls: Option<&Self>, columns: &Columns) -> Cliffs {
        let Some(falls) = falls else { return Cliffs::NONE };
        let height = falls.height.max(columns.grid.cell) / columns.heights.unit;
        Cliffs(height.min(f64::from(i32::MAX - 1)) as i32)
    }
}
