//! Typed data shared by all systems, from the values of a scene: the shot, the objects, the output.

use crate::error::Result;
use crate::motion::{Space, Up};
use crate::scene::schema::toml_table::Table;
use crate::scene::schema::values::{Value, Values};
use crate::scene::{BaseMode, Frames, Object, Output, Role, Shot, VolumesOutput, snow};

impl Shot {
    pub(in crate::scene) fn of(values: &Values) -> Self {
        let frames = match values.get("shot.frames") {
            Some(Value::Frames(frames)) => *frames,
            _ => Frames { first: 0, last: 0 },
        };
        Self { frames, fps: values.settled("shot", None, "fps") }
    }
}

impl Object {
    /// The objects of a scene, in the file's order.
    pub(in crate::scene) fn all_of(values: &Values) -> Vec<Self> {
        let is_there = |index: &usize| values.of_object(*index, "file").is_some();
        (0..).take_while(is_there).map(|index| Self::of(values, index)).collect()
    }

    fn of(values: &Values, index: usize) -> Self {
        let value = |name: &str| values.of_object(index, name);
        let text = |name: &str| value(name).and_then(Value::text);
        let flag = |name: &str| value(name).and_then(Value::flag).unwrap_or(false);
        let number = |name: &str| value(name).and_then(Value::number).unwrap_or(0.0);
        Self {
            file: value("file").and_then(Value::path).map(Into::into).unwrap_or_default(),
            node: text("node").map(str::to_string),
            clip: text("clip").map(str::to_string),
            repeat: value("loop").is_none() || flag("loop"),
            offset: number("offset"),
            space: Space {
                scale: number("scale"),
                up: if text("up") == Some("z") { Up::Z } else { Up::Y },
                origin: value("origin").and_then(Value::numbers::<3>).unwrap_or_default().into(),
            },
            role: match text("role") {
                Some("base") => Role::Base,
                Some("grains") => Role::Grains,
                Some("static") => Role::Static,
                Some("ignore") => Role::Ignore,
                _ => Role::Collide,
            },
            noise: flag("noise"),
            keys: if let Some(Value::Poses(poses)) = value("keys") { poses.clone() } else { Vec::new() },
            ease: flag("ease"),
        }
    }
}

impl Output {
    pub(in crate::scene) fn of(values: &Values) -> Self {
        let holds = |name: &str, text: &str| values.get(name).is_some_and(|value| value.holds(text));
        let flag = |name: &str| values.get(name).and_then(Value::flag).unwrap_or(false);
        let mode = values.get("output.base_mode").and_then(Value::text);
        Self {
            base: holds("output.base", "vdb"),
            base_mode: if mode == Some("delta") { BaseMode::Delta } else { BaseMode::Full },
            half: flag("output.half"),
            removed: holds("output.removed", "vdb"),
            grains_vdb: holds("output.grains", "vdb"),
            grains_ply: holds("output.grains", "ply"),
            grains_usd: holds("output.grains", "usd"),
            grains_delta: values.get("output.grains_mode").and_then(Value::text) == Some("delta"),
            mist: holds("output.mist", "vdb"),
            volumes: VolumesOutput {
                fog_base: holds("output.fog", "base"),
                fog_grains: holds("output.fog", "grains"),
                fog_mist: holds("output.fog", "mist"),
                snow: flag("output.snow"),
                mesh_ply: holds("output.mesh", "ply"),
                mesh_usd: holds("output.mesh", "usd"),
            },
            objects_usd: holds("output.objects", "usd"),
            objects_ply: holds("output.objects", "ply"),
            usd: flag("output.usd"),
        }
    }

    /// Checks the keys in combination.
    ///
    /// # Errors
    /// 16-bit values where changes are stored, which must be exact.
    pub(in crate::scene) fn check(table: &Table, values: &Values) -> Result<()> {
        let output = Self::of(values);
        if snow::has_grains(values) && (output.half || !output.base) {
            let key = if output.half { "half" } else { "base" };
            return Err(
                table.error(key, "leaves out what `[grains]` reads of every frame: exact values of the base")
            );
        }
        if snow::has_grains(values) && output.grains_delta && !output.grains_vdb {
            return Err(
                table.error("grains_mode", "= \"delta\" is for .vdb files: `grains` must hold \"vdb\"")
            );
        }
        if snow::has_mist(values) && !output.grains_vdb {
            return Err(
                table.error("grains", "leaves out what `[mist]` reads of every frame: it must hold \"vdb\"")
            );
        }
        if output.half && output.base && output.base_mode == BaseMode::Delta {
            return Err(table.error("half", "goes with `base_mode = \"full\"` only: changes must be exact"));
        }
        snow::check_volumes(table, values, &output)
    }
}
