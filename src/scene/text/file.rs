//! Reads a scene file: keys to fields, defaults filled in, ranges checked.

use super::keys::names;
use super::objects::objects;
use super::overrides::Override;
use super::table::{Document, Table};
use crate::error::{Error, Result};
use crate::io::mesh::{EXTENSIONS, extension};
use crate::scene::{BaseMode, Frames, Ground, Layer, Output, Scene, Shot, Snow};
use crate::snow::base_layer::NoiseParams;
use std::path::{Path, PathBuf};
use toml::de::DeTable;

/// Farthest coordinate that a scene may name (m): f32 positions keep millimetres up to here.
pub(super) const FAR: f64 = 1.0e5;

impl Scene {
    /// Reads a scene file. Relative paths in it are taken from its own folder.
    ///
    /// # Errors
    /// An unreadable file, a TOML mistake, an unknown key, a wrong type or a value outside its range, each
    /// with file and line.
    pub fn read(path: &Path) -> Result<Self> {
        Self::read_with(path, &[])
    }

    /// Reads a scene file with settings of the command line put over its own; relative paths in those are taken
    /// from the current folder.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn read_with(path: &Path, overrides: &[Override]) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(|error| Error::io(path, "read", error))?;
        let text = String::from_utf8(bytes).map_err(|_| Error::file(path, "is not a text file"))?;
        Self::parse(&text, path, overrides)
    }

    /// Reads a scene from text; `path` names it in messages and gives the folder of its relative paths.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn parse(text: &str, path: &Path, overrides: &[Override]) -> Result<Self> {
        let document = Document { path, text, folder: folder_of(path)?, overrides };
        let mut root = DeTable::parse(text).map_err(|error| {
            let offset = error.span().map_or(0, |span| span.start);
            document.error(offset, error.message().trim().replace('\n', ", "))
        })?;
        for (index, setting) in overrides.iter().enumerate() {
            setting.apply(root.get_mut(), document.place_of(index), path)?;
        }
        let known = ["shot", "snow", "object", "output"];
        let root = Table::open(&document, "", root.get_ref(), 0, &known)?;
        let snow = root.table("snow", "[snow]", &known_with("snow", &["noise"]))?;
        Ok(Self {
            path: path.to_path_buf(),
            shot: shot(&root)?,
            snow: snow_layer(&snow.ok_or_else(|| root.error("snow", "is missing"))?)?,
            objects: objects(&root)?,
            output: output(&root)?,
        })
    }

    /// Makes the cells `factor` times as large, for a quick look; noise too fine for them becomes coarser.
    ///
    /// # Errors
    /// A layer from a .vdb file, whose cells are what they are; a cell out of range.
    pub fn coarsen(&mut self, factor: f64) -> Result<()> {
        let refused = |what: String| Error::argument(format!("{}: {what}", self.path.display()));
        if let Layer::Grid(path) = &self.snow.layer {
            return Err(refused(format!("a preview needs other cells than those of {}", path.display())));
        }
        let cell = self.snow.cell * factor;
        if !CELLS.contains(&cell) {
            return Err(refused(format!("a preview would have cells of {cell} m")));
        }
        let noise = &mut self.snow.noise;
        noise.size = noise.size.max(*NoiseParams::sizes(cell).start());
        noise.amplitude = noise.amplitude.min(noise.steepest());
        self.snow.cell = cell;
        Ok(())
    }
}

/// The names of a table's keys, and of the tables in it.
fn known_with(table: &str, tables: &[&'static str]) -> Vec<&'static str> {
    names(table).into_iter().chain(tables.iter().copied()).collect()
}

/// Edges of voxels that a scene may have (m).
const CELLS: std::ops::RangeInclusive<f64> = 1.0e-5..=10.0;

/// The absolute folder that a scene's relative paths start from.
fn folder_of(path: &Path) -> Result<PathBuf> {
    let absolute = std::path::absolute(path).map_err(|error| Error::io(path, "find", error))?;
    Ok(absolute.parent().unwrap_or(Path::new("/")).to_path_buf())
}

fn shot(root: &Table) -> Result<Shot> {
    let shot = root.table("shot", "[shot]", &names("shot"))?;
    let shot = shot.ok_or_else(|| root.error("shot", "is missing"))?;
    let frames = shot.text("frames")?.ok_or_else(|| shot.error("frames", "is missing"))?;
    let frames: Frames = frames.parse().map_err(|what| shot.error("frames", format!("is wrong: {what}")))?;
    let fps = shot.number_in("fps", 0.001..=100_000.0, "frames per second")?.unwrap_or(24.0);
    Ok(Shot { frames, fps })
}

fn snow_layer(snow: &Table) -> Result<Snow> {
    let cell = snow.number_in("cell", CELLS, "m")?;
    let cell = cell.ok_or_else(|| snow.error("cell", "is missing"))?;
    let layer = layer(snow)?;
    let ground = ground(snow)?;
    match layer {
        Layer::Grid(_) if ground.is_some() => {
            return Err(snow.error("ground", "is of no use beside a .vdb layer in `top`: leave it out"));
        }
        Layer::Depth(_) | Layer::Top(_) if ground.is_none() => {
            return Err(snow.error("ground", "is missing"));
        }
        _ => {}
    }
    let min_crumb = snow.integer_in("min_crumb", 0..=10_000)?.unwrap_or(0) as usize;
    Ok(Snow { ground, layer, cell, noise: noise(snow, cell)?, min_crumb })
}

fn layer(snow: &Table) -> Result<Layer> {
    match (snow.number_in("depth", 1.0e-4..=1000.0, "m")?, snow.path("top")?) {
        (Some(depth), None) => Ok(Layer::Depth(depth)),
        (None, Some(top)) => match extension(&top).as_str() {
            "vdb" => Ok(Layer::Grid(top)),
            known if EXTENSIONS.contains(&known) => Ok(Layer::Top(top)),
            _ => {
                Err(snow
                    .error("top", format!("must be a .vdb, .obj, .ply or .stl file, not \"{}\"", name(&top))))
            }
        },
        (Some(_), Some(_)) => Err(snow.error("top", "excludes `depth`: give one of them")),
        (None, None) => Err(snow.error("depth", "is missing (or `top`, a mesh or .vdb file)")),
    }
}

fn ground(snow: &Table) -> Result<Option<Ground>> {
    let area = snow.numbers::<4>("area")?;
    if !snow.has("ground") {
        return match area {
            Some(_) => Err(snow.error("area", "needs `ground`, the height of a plane")),
            None => Ok(None),
        };
    }
    if let Ok(Some(path)) = snow.path("ground") {
        if !EXTENSIONS.contains(&extension(&path).as_str()) {
            let what = format!("must be a number or a .obj, .ply or .stl file, not \"{}\"", name(&path));
            return Err(snow.error("ground", what));
        }
        if area.is_some() {
            return Err(snow.error("area", "is of no use beside a mesh in `ground`: leave it out"));
        }
        return Ok(Some(Ground::Mesh(path)));
    }
    let height = match snow.number("ground") {
        Ok(Some(height)) if height.abs() <= FAR => height,
        Ok(_) => return Err(snow.error("ground", format!("must lie in -{FAR} to {FAR} m"))),
        Err(_) => return Err(snow.error("ground", "must be a number (m) or the name of a mesh file")),
    };
    let area = area.ok_or_else(|| snow.error("area", "is missing: a plane needs [x0, z0, x1, z1] (m)"))?;
    let [x0, z0, x1, z1] = area;
    if x1 <= x0 || z1 <= z0 || area.iter().any(|value| value.abs() > FAR) {
        let what = format!("must be [x0, z0, x1, z1] with x0 < x1 and z0 < z1 within {FAR} m");
        return Err(snow.error("area", what));
    }
    Ok(Some(Ground::Plane { height, area }))
}

fn noise(snow: &Table, cell: f64) -> Result<NoiseParams> {
    let defaults = NoiseParams::for_cell(cell);
    let table = snow.table("noise", "[snow.noise]", &names("snow.noise"))?;
    let Some(table) = table else { return Ok(defaults) };
    let (amplitudes, sizes) = (NoiseParams::amplitudes(cell), NoiseParams::sizes(cell));
    let noise = NoiseParams {
        amplitude: table.number_in("amplitude", amplitudes, "m (32 cells)")?.unwrap_or(defaults.amplitude),
        size: table.number_in("size", sizes, "m (2 to 10000 cells)")?.unwrap_or(defaults.size),
        octaves: table.integer_in("octaves", 1..=8)?.map_or(defaults.octaves, |value| value as u32),
        seed: table.integer_in("seed", 0..=i64::from(i32::MAX))?.map_or(defaults.seed, |value| value as i32),
    };
    let key = if table.has("amplitude") { "amplitude" } else { "size" };
    let most = noise.steepest();
    if noise.amplitude > most {
        let what = format!(
            "is too steep, {} m over {} m, and would leave islands: an amplitude of at most {most:.4} m goes with this size",
            noise.amplitude, noise.size
        );
        return Err(table.error(key, what));
    }
    Ok(noise)
}

fn output(root: &Table) -> Result<Output> {
    let Some(table) = root.table("output", "[output]", &names("output"))? else {
        return Ok(Output::default());
    };
    let defaults = Output::default();
    let written = |key, kind, default| -> Result<bool> {
        Ok(table.choices(key, &[(kind, ())])?.map_or(default, |kinds| !kinds.is_empty()))
    };
    let objects = table.choices("objects", &[("usd", "usd"), ("ply", "ply")])?.unwrap_or_default();
    let modes = [("full", BaseMode::Full), ("delta", BaseMode::Delta)];
    let output = Output {
        base: written("base", "vdb", defaults.base)?,
        base_mode: table.choice("base_mode", &modes)?.unwrap_or(defaults.base_mode),
        half: table.flag("half")?.unwrap_or(defaults.half),
        removed: written("removed", "vdb", defaults.removed)?,
        objects_usd: objects.contains(&"usd"),
        objects_ply: objects.contains(&"ply"),
        usd: table.flag("usd")?.unwrap_or(defaults.usd),
    };
    if output.half && output.base && output.base_mode == BaseMode::Delta {
        return Err(table.error("half", "goes with `base_mode = \"full\"` only: changes must be exact"));
    }
    Ok(output)
}

/// A file's name without its folder.
pub(in crate::scene) fn name(path: &Path) -> String {
    path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned()
}
