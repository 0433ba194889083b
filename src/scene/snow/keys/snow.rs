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

/// Grains fall on the ground too, and mist flows along it.
const GROUND: Scopes = &[("base", Scope::First), ("grains", Scope::First), ("mist", Scope::First)];

/// Edges of voxels (m).
const CELLS: (f64, f64) = (1.0e-5, 10.0);
/// A mesh of the top, or a level set of the whole layer.
const TOPS: &[&str] = &["vdb", EXTENSIONS[0], EXTENSIONS[1], EXTENSIONS[2]];

const FIRST: Scopes = &[("base", Scope::First)];
const STEP: Scopes = &[("base", Scope::Step)];

/// All of them.
pub const KEYS: &[Key] = &[
    key(GROUND, "snow", "ground", HeightOrFile(FAR, &EXTENSIONS), optional("0.0").shown()).means(
        "height of a level plane (m), or a mesh (then no area); beside a .vdb layer only grains lie on it",
    ),
    key(GROUND, "snow", "area", Numbers(4, FAR, "m"), optional("[-3.0, -3.0, 3.0, 3.0]").shown())
        .means("extent of the plane: x0, z0, x1, z1 (m)"),
    key(FIRST, "snow", "depth", Number(1.0e-4, 1000.0, "m"), optional("0.3").shown())
        .means("depth above ground and static objects (m)"),
    key(FIRST, "snow", "top", File(TOPS), optional("\"snow_top.ply\""))
        .means("instead of depth: mesh of the top surface, or the layer as a level set"),
    key(GROUND, "snow", "origin", ORIGIN, or(NO_ORIGIN))
        .means("position that becomes the origin of the meshes of ground and top (m), subtracted in 64 bits"),
    key(FIRST, "snow", "cell", Number(CELLS.0, CELLS.1, "m"), required("0.0075").shown())
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
        let own = values.table("snow");
        let cell = own.find("cell")?;
        let layer = match (own.find("depth"), own.find::<PathBuf>("top")) {
            (Some(depth), _) => Layer::Depth(depth),
            (None, Some(top)) if extension(&top) == "vdb" => Layer::Grid(top),
            (None, top) => Layer::Top(top?),
        };
        let plane = own.find("ground").map(|height| Ground::Plane { height, area: own.find("area") });
        let ground = plane.or_else(|| own.find("ground").map(Ground::Mesh));
        let (origin, min_crumb) = (own.get("origin"), own.get("min_crumb"));
        Some(Self { ground, layer, origin, cell, noise: noise(values)?, min_crumb })
    }

    /// Checks the keys in combination.
    ///
    /// # Errors
    /// Keys that exclude each other, or a key without one that it needs; noise that would leave islands.
    pub(in crate::scene) fn check(snow: &Table, values: &Values) -> Result<()> {
        let own = values.table("snow");
        let (ground, top) = (own.value("ground"), own.value("top"));
        match (own.value("depth"), top) {
            (Some(_), Some(_)) => return Err(snow.error("top", "excludes `depth`: give one of them")),
            (None, None) => return Err(snow.error("depth", "is missing (or `top`, a mesh or .vdb file)")),
            _ => {}
        }
        let is_grid = top.and_then(Value::path).is_some_and(|path| extension(path) == "vdb");
        let is_mesh = ground.and_then(Value::path).is_some() || !is_grid && top.is_some();
        if own.get::<[f64; 3]>("origin") != [0.0; 3] && !is_mesh {
            return Err(snow.error("origin", "is for meshes of ground and top: leave it out"));
        }
        match (ground, own.value("area")) {
            (_, Some(_)) if is_grid => {
                return Err(snow.error("area", "is of no use beside a .vdb layer in `top`: leave it out"));
            }
            (None, Some(_)) => return Err(snow.error("area", "needs `ground`, the height of a plane")),
            (Some(Value::File(_)), Some(_)) => {
                return Err(snow.error("area", "is of no use beside a mesh in `ground`: leave it out"));
            }
            (Some(Value::Number(_)), None) if !is_grid => {
                return Err(snow.error("area", "is missing: a plane needs [x0, z0, x1, z1] (m)"));
            }
            (Some(_), Some(_)) => {
                let [x0, z0, x1, z1] = own.find::<[f64; 4]>("area").unwrap_or_default();
                if x1 <= x0 || z1 <= z0 {
                    return Err(snow.error("area", "must be [x0, z0, x1, z1] with x0 < x1 and z0 < z1"));
                }
            }
            _ => {}
        }
        if !is_grid && ground.is_none() {
            return Err(snow.error("ground", "is missing"));
        }
        Ok(())
    }

    /// Checks `[snow.noise]`.
    ///
    /// # Errors
    /// Noise that would leave islands.
    pub(in crate::scene) fn check_noise(table: &Table, values: &Values) -> Result<()> {
        let Some(noise) = noise(values) else { return Ok(()) };
        let most = noise.max_amplitude();
        if noise.amplitude <= most {
            return Ok(());
        }
        let what = format!(
            "is too steep, {} m over {} m, and would leave islands: an amplitude of at most {most:.4} m goes with this size",
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
        if !(CELLS.0..=CELLS.1).contains(&cell) {
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
    let own = values.table("snow.noise");
    Some(NoiseParams {
        amplitude: own.find("amplitude")?,
        size: own.find("size")?,
        octaves: own.get("octaves"),
        seed: own.get("seed"),
    })
}
