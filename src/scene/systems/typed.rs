//! Typed data shared by all systems, from the values of a scene: the shot, the objects, the output.

use crate::error::Result;
use crate::scene::schema::declaration::OBJECT;
use crate::scene::schema::toml_table::Table;
use crate::scene::schema::values::{TableValues, Values};
use crate::scene::{BaseMode, Object, Output, Shot, VolumesOutput, snow};

impl Shot {
    pub(in crate::scene) fn of(values: &Values) -> Self {
        let shot = values.table("shot");
        Self { frames: shot.get("frames"), fps: shot.get("fps") }
    }
}

impl Object {
    /// The objects of a scene, in the file's order.
    pub(in crate::scene) fn all_of(values: &Values) -> Vec<Self> {
        (0..values.count(OBJECT)).map(|index| Self::of(values.element(OBJECT, index))).collect()
    }

    fn of(values: TableValues) -> Self {
        Self {
            file: values.get("file"),
            node: values.find("node"),
            clip: values.find("clip"),
            repeat: values.get("loop"),
            offset: values.get("offset"),
            space: values.space(),
            role: values.get("role"),
            noise: values.get("noise"),
            keys: values.get("keys"),
            ease: values.get("ease"),
        }
    }
}

impl Output {
    pub(in crate::scene) fn of(values: &Values) -> Self {
        // A system declares only the keys of its own files.
        let output = values.table("output");
        let is_on = |name: &str| output.find(name) == Some(true);
        let is_delta = |name: &str| output.text(name) == Some("delta");
        let mut all = Self {
            base: output.holds("base", "vdb"),
            base_mode: if is_delta("base_mode") { BaseMode::Delta } else { BaseMode::Full },
            half: is_on("half"),
            removed: output.holds("removed", "vdb"),
            grains_vdb: output.holds("grains", "vdb"),
            grains_ply: output.holds("grains", "ply"),
            grains_usd: output.holds("grains", "usd"),
            grains_delta: is_delta("grains_mode"),
            mist: output.holds("mist", "vdb"),
            mist_half: is_on("mist_half"),
            blender_names: output.text("names") == Some("blender"),
            volumes: VolumesOutput {
                fog_base: output.holds("fog", "base"),
                fog_grains: output.holds("fog", "grains"),
                fog_mist: output.holds("fog", "mist"),
                snow: is_on("snow"),
                mesh_ply: output.holds("mesh", "ply"),
                mesh_usd: output.holds("mesh", "usd"),
                mesh_adaptivity: output.find("mesh_adaptivity").unwrap_or_default(),
            },
            objects_usd: output.holds("objects", "usd"),
            objects_ply: output.holds("objects", "ply"),
            keep_states: output.find("keep_states").unwrap_or_default(),
            usd: is_on("usd"),
        };
        // By default, the mesh is written where it can be made: other systems write no base.
        all.volumes.mesh_usd |= output.value("mesh").is_none() && all.base_restarts();
        // Only .vdb files hold changes; other systems write no grains.
        let no_grains_key = output.value("grains").is_none();
        all.grains_usd |= no_grains_key;
        all.grains_vdb |= no_grains_key && all.grains_delta;
        all
    }

    /// Checks the keys in combination.
    ///
    /// # Errors
    /// A key that leaves out what another stage reads; 16-bit values where changes are stored, which must be exact.
    pub(in crate::scene) fn check(table: &Table, values: &Values) -> Result<()> {
        let output = Self::of(values);
        if snow::has_grains(values)
            && let Some(key) = output.inexact_base()
        {
            return Err(
                table.error(key, "leaves out what `[grains]` reads of every frame: exact values of the base")
            );
        }
        if snow::has_grains(values) && output.grains_delta && !output.grains_vdb {
            return Err(
                table.error("grains_mode", "= \"delta\" is for .vdb files: `grains` must hold \"vdb\"")
            );
        }
        if snow::has_mist(values) && !output.grains_readable() {
            return Err(table.error(
                "grains",
                "leaves out what `[mist]` reads of every frame: it must hold \"usd\" or \"vdb\"",
            ));
        }
        if output.half && output.base && output.base_mode == BaseMode::Delta {
            return Err(table.error("half", "goes with `base_mode = \"full\"` only: changes must be exact"));
        }
        snow::check_volumes(table, values, &output)
    }
}
