//! Requirements of the `[output]` keys for render volumes on the rest of a scene.

use crate::error::Result;
use crate::scene::schema::{Table, Values};
use crate::scene::snow::{has_grains, has_mist};
use crate::scene::{Output, VolumesOutput};

/// The stages that a scene's volumes are made from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Needs {
    /// Whether they read the base.
    pub base: bool,
    /// Whether they read grains.
    pub grains: bool,
    /// Whether they read mist.
    pub mist: bool,
}

impl Needs {
    /// The stages for a scene.
    pub fn of(volumes: VolumesOutput, values: &Values) -> Self {
        Self {
            base: volumes.fog_base || volumes.snow || volumes.mesh(),
            grains: volumes.fog_grains || volumes.snow && has_grains(values),
            mist: volumes.fog_mist,
        }
    }
}

/// Checks that a scene has, and writes, the data that its volumes are made from.
///
/// # Errors
/// A stage that the scene does not have; files that are not written.
pub fn check_volumes(table: &Table, values: &Values, output: &Output) -> Result<()> {
    let volumes = output.volumes;
    let needs = Needs::of(volumes, values);
    if volumes.fog_grains && !has_grains(values) {
        return Err(table.error("fog", "names \"grains\", but the scene has no table [grains]"));
    }
    if volumes.fog_mist && !has_mist(values) {
        return Err(table.error("fog", "names \"mist\", but the scene has no table [mist]"));
    }
    let reader = match (volumes.fog(), volumes.snow) {
        (true, _) => "fog",
        (false, true) => "snow",
        (false, false) => "mesh",
    };
    if needs.base
        && let Some(key) = output.inexact_base()
    {
        let what = format!("leaves out what `{reader}` reads of every frame: exact values of the base");
        return Err(table.error(key, what));
    }
    if needs.grains && !output.grains_readable() {
        let what = format!("leaves out the files that `{reader}` is made from: add \"usd\" or \"vdb\"");
        return Err(table.error("grains", what));
    }
    if needs.mist && !output.mist {
        return Err(table.error("mist", "leaves out the .vdb files that `fog` is made from: add \"vdb\""));
    }
    Ok(())
}
