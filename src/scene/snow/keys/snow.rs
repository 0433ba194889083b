//! The keys of `[snow]`, the keys of objects that concern the layer, and the layer that they describe.

use super::mist::mist_params;
use crate::error::Result;
use crate::io::mesh::{EXTENSIONS, extension};
use crate::scene::schema::declaration::Kind::{Cells, File, Flag, HeightOrFile, Number, Numbers, Whole};
use crate::scene::schema::declaration::{Key, OBJECT, Scope, Scopes, key, optional, or, or_cells, required};
use crate::scene::schema::{FAR, NO_ORIGIN, ORIGIN, Table, Value, Values};
use crate::scene::{Ground, Layer, Snow};
use crate::snow::NoiseParams;
use std::path::PathBuf;

/// All stages depend on the ground: grains fall on it, and mist flows along it.
const GROUND: Scopes = &[("base", Scope::First), ("grains", Scope::First), ("mist", Scope::First)];

/// Range of the edge of a voxel (m).
const CELL_RANGE: (f64, f64) = (1.0e-5, 10.0);
/// Extensions of `top`: a mesh of the top surface, or a level set of the whole layer.
const TOP_EXTENSIONS: &[&str] =
    &["vdb", EXTENSIONS[0], EXTENSIONS[1], EXTENSIONS[2], EXTENSIONS[3], EXTENSIONS[4]];

const FIRST: Scopes = &[("base", Scope::First)];
const STEP: Scopes = &[("base", Scope::Step)];

/// The keys of snow.
pub const KEYS: &[Key] = &[
    key(GROUND, "snow", "ground", HeightOrFile(FAR, &EXTENSIONS), optional("0.0").shown()).means(
        "height of a level plane (m), or a mesh (then no area); if the layer is a .vdb file, for grains and mist only",
    ),
    key(GROUND, "snow", "area", Numbers(4, FAR, "m"), optional("[-3.0, -3.0, 3.0, 3.0]").shown())
        .means("extent of the plane: x0, z0, x1, z1 (m)"),
    key(FIRST, "snow", "depth", Number(1.0e-4, 1000.0, "m"), optional("0.3").shown())
        .means("depth above ground and static objects (m)"),
    key(FIRST, "snow", "top", File(TOP_EXTENSIONS), optional("\"snow_top.ply\""))
        .means("instead of depth: mesh of the top surface, or the layer as a level set"),
    key(GROUND, "snow", "origin", ORIGIN, or(NO_ORIGIN))
        .means("position that becomes the origin of the meshes of ground and top (m), subtracted in 64 bits"),
    key(FIRST, "snow", "cell", Number(CELL_RANGE.0, CELL_RANGE.1, "m"), required("0.0075").shown())
        .means("edge of a voxel (m)"),
    key(STEP, "snow", "min_crumb", Whole(0, 10_000), or("0"))
        .means("islands of fewer voxels are removed; 0 = off"),
    key(STEP, "snow.noise", "amplitude", Cells(0.0, 32.0), or_cells(2.0))
        .means("maximum displacement, outward only (m); 0 = off"),
    key(STEP, "snow.noise", "size", Cells(2.0, 10_000.0), or_cells(8.0))
        .means("size of the largest features (m)"),
    key(STEP, "snow.noise", "octaves", Whole(1, 8), or("3"))
        .means("octaves, each half the size of the one before"),
    key(STEP, "snow.noise", "seed", Whole(0, i32::MAX as i64), or("0"))
        .means("another seed gives another pattern"),
    key(STEP, OBJECT, "noise", Flag, or("true")).means("whether its prints have ragged edges"),
];

impl Snow {
    /// The layer that a scene's values describe; `None` if it has no snow.
    pub(in crate::scene) fn of(values: &Values) -> Option<Self> {
        let snow = values.table("snow");
        let cell = snow.find("cell")?;
        let layer = match (snow.find("depth"), snow.find::<PathBuf>("top")) {
            (Some(depth), _) => Layer::Depth(depth),
            (None, Some(top)) if extension(&top) == "vdb" => Layer::Grid(top),
            (None, top) => Layer::Top(top?),
        };
        let plane = snow.find("ground").map(|height| Ground::Plane { height, area: snow.find("area") });
        let ground = plane.or_else(|| snow.find("ground").map(Ground::Mesh));
        let (origin, min_crumb) = (snow.get("origin"), snow.get("min_crumb"));
        Some(Self { ground, layer, origin, cell, noise: noise(values)?, min_crumb })
    }

    /// Checks the keys in combination.
    ///
    /// # Errors
    /// Keys that exclude each other, or a key without one that it needs; an area without extent; an origin without meshes.
    pub(in crate::scene) fn check(table: &Table, values: &Values) -> Result<()> {
        let snow = values.table("snow");
        let (ground, top) = (snow.value("ground"), snow.value("top"));
        match (snow.value("depth"), top) {
            (Some(_), Some(_)) => return Err(table.error("top", "excludes `depth`: give one of them")),
            (None, None) => return Err(table.error("depth", "is missing (or `top`, a mesh or .vdb file)")),
            _ => {}
        }
        let is_grid = top.and_then(Value::path).is_some_and(|path| extension(path) == "vdb");
        let is_mesh = ground.and_then(Value::path).is_some() || !is_grid && top.is_some();
        if snow.get::<[f64; 3]>("origin") != [0.0; 3] && !is_mesh {
            return Err(table.error("origin", "is for meshes of ground and top: leave it out"));
        }
        match (ground, snow.value("area")) {
            (_, Some(_)) if is_grid => {
                return Err(table.error("area", "is not used if `top` is a .vdb file: leave it out"));
            }
            (None, Some(_)) => return Err(table.error("area", "needs `ground`, the height of a plane")),
            (Some(Value::File(_)), Some(_)) => {
                return Err(table.error("area", "is not used if `ground` is a mesh: leave it out"));
            }
            (Some(Value::Number(_)), None) if !is_grid => {
                return Err(table.error("area", "is missing: a plane needs [x0, z0, x1, z1] (m)"));
            }
            (Some(_), Some(_)) => {
                let [x0, z0, x1, z1] = snow.find::<[f64; 4]>("area").unwrap_or_default();
                if x1 <= x0 || z1 <= z0 {
                    return Err(table.error("area", "must be [x0, z0, x1, z1] with x0 < x1 and z0 < z1"));
                }
            }
            _ => {}
        }
        if !is_grid && ground.is_none() {
            return Err(table.error("ground", "is missing"));
        }
        Ok(())
    }

    /// Checks `[snow.noise]`.
    ///
    /// # Errors
    /// Noise that would leave islands.
    pub(in crate::scene) fn check_noise(table: &Table, values: &Values) -> Result<()> {
        let Some(noise) = noise(values) else { return Ok(()) };
        let max_amplitude = noise.max_amplitude();
        if noise.amplitude <= max_amplitude {
            return Ok(());
        }
        let what = format!(
            "is too steep, {} m over {} m, and would leave islands: with this size, the amplitude may be at most {max_amplitude:.4} m",
            noise.amplitude, noise.size
        );
        Err(table.error(if table.has("amplitude") { "amplitude" } else { "size" }, what))
    }

    /// Makes the cells `factor` times as large; noise too fine for them becomes coarser.
    ///
    /// # Errors
    /// The reason.
    pub(in crate::scene) fn coarsen(
        &self,
        factor: f64,
        values: &mut Values,
    ) -> std::result::Result<(), String> {
        if let Layer::Grid(path) = &self.layer {
            return Err(format!("a preview needs other cells than those of {}", path.display()));
        }
        let cell = self.cell * factor;
        if !(CELL_RANGE.0..=CELL_RANGE.1).contains(&cell) {
            return Err(format!("a preview would have cells of {cell} m"));
        }
        let mut noise = self.noise;
        noise.size = noise.size.max(*NoiseParams::sizes(cell).start());
        noise.amplitude = noise.amplitude.min(noise.max_amplitude());
        values.set_number("snow.cell", cell);
        values.set_number("snow.noise.size", noise.size);
        values.set_number("snow.noise.amplitude", noise.amplitude);
        if let Some(radius) = values.number("grains.radius") {
            values.set_number("grains.radius", radius * factor);
        }
        if let Some(params) = mist_params(values) {
            let cell = params.cell * factor;
            values.set_number("mist.cell", cell);
            values.set_number("mist.turbulence_size", params.turbulence_size.max(8.0 * cell));
            values.set_number("mist.noise_size", params.noise_size.max(cell));
        }
        Ok(())
    }
}

fn noise(values: &Values) -> Option<NoiseParams> {
    let noise = values.table("snow.noise");
    Some(NoiseParams {
        amplitude: noise.find("amplitude")?,
        size: noise.find("size")?,
        octaves: noise.get("octaves"),
        seed: noise.get("seed"),
    })
}
