//! What the keys of `[output]` that ask for volumes to render need of the rest of a scene.

use super::has_grains;
use crate::error::Result;
use crate::scene::text::{Table, Value, Values};
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
    /// Those of a scene.
    pub fn of(asked: VolumesOutput, values: &Values) -> Self {
        Self {
            base: asked.fog_base || asked.snow || asked.mesh(),
            grains: asked.fog_grains || asked.snow && has_grains(values),
            mist: asked.fog_mist,
        }
    }
}

/// Whether a scene has mist.
fn has_mist(values: &Values) -> bool {
    values.number("mist.cell").is_some()
}

/// Checks that a scene has, and writes, what its volumes are made from.
///
/// # Errors
/// A part that the scene does not have; files that are not written.
pub fn check_volumes(table: &Table, values: &Values, output: &Output) -> Result<()> {
    let asked = output.volumes;
    let needs = Needs::of(asked, values);
    for (part, is_asked, is_there) in
        [("grains", asked.fog_grains, has_grains(values)), ("mist", asked.fog_mist, has_mist(values))]
    {
        if is_asked && !is_there {
            return Err(table.error("fog", format!("names \"{part}\", but the scene has no table [{part}]")));
        }
    }
    let reader = match (asked.fog(), asked.snow) {
        (true, _) => "fog",
        (false, true) => "snow",
        (false, false) => "mesh",
    };
    if needs.base && (output.half || !output.base) {
        let key = if output.half { "half" } else { "base" };
        let what = format!("leaves out what `{reader}` reads of every frame: exact values of the base");
        return Err(table.error(key, what));
    }
    let lacks_vdb = |key: &str| values.get(key).is_some_and(|files: &Value| !files.holds("vdb"));
    for (part, is_needed) in [("grains", needs.grains), ("mist", needs.mist)] {
        if is_needed && lacks_vdb(&format!("output.{part}")) {
            let what = format!("leaves out the .vdb files that `{reader}` is made from: add \"vdb\"");
            return Err(table.error(part, what));
        }
    }
    Ok(())
}
