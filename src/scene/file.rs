//! Reads a scene file: keys to fields, defaults filled in, ranges checked.

use super::table::{Document, Table};
use super::{Frames, Ground, Key, Layer, Object, Output, Role, Scene, Shot, Snow};
use crate::error::{Error, Result};
use crate::motion::{Space, Up};
use crate::snow::base_layer::NoiseParams;
use std::path::{Path, PathBuf};
use toml::de::DeTable;

/// Farthest coordinate that a scene may name (m): f32 positions keep millimetres up to here.
const FAR: f64 = 1.0e5;

impl Scene {
    /// Reads a scene file. Relative paths in it are taken from its own folder.
    ///
    /// # Errors
    /// An unreadable file, a TOML mistake, an unknown key, a wrong type or a value outside its range, each
    /// with file and line.
    pub fn read(path: &Path) -> Result<Self> {
        let bytes = std::fs::read(path).map_err(|error| Error::io(path, "read", error))?;
        let text = String::from_utf8(bytes).map_err(|_| Error::file(path, "is not a text file"))?;
        Self::parse(&text, path)
    }

    /// Reads a scene from text; `path` names it in messages and gives the folder of its relative paths.
    ///
    /// # Errors
    /// As [`Scene::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self> {
        let document = Document { path, text };
        let root = DeTable::parse(text).map_err(|error| {
            let offset = error.span().map_or(0, |span| span.start);
            document.error(offset, error.message().trim().replace('\n', ", "))
        })?;
        let known = ["shot", "snow", "object", "output"];
        let root = Table::open(&document, "", root.get_ref(), 0, &known)?;
        let folder = folder_of(path)?;
        let snow = root.table("snow", "[snow]", &["ground", "area", "depth", "top", "cell", "noise"])?;
        Ok(Self {
            path: path.to_path_buf(),
            shot: shot(&root)?,
            snow: snow_layer(&snow.ok_or_else(|| root.error("snow", "is missing"))?, &folder)?,
            objects: objects(&root, &folder)?,
            output: output(&root)?,
        })
    }
}

/// The absolute folder that a scene's relative paths start from.
fn folder_of(path: &Path) -> Result<PathBuf> {
    let absolute = std::path::absolute(path).map_err(|error| Error::io(path, "find", error))?;
    Ok(absolute.parent().unwrap_or(Path::new("/")).to_path_buf())
}

fn shot(root: &Table) -> Result<Shot> {
    let shot = root.table("shot", "[shot]", &["frames", "fps"])?;
    let shot = shot.ok_or_else(|| root.error("shot", "is missing"))?;
    let frames = shot.text("frames")?.ok_or_else(|| shot.error("frames", "is missing"))?;
    let frames: Frames = frames.parse().map_err(|what| shot.error("frames", format!("is wrong: {what}")))?;
    let fps = shot.number_in("fps", 0.001..=100_000.0, "frames per second")?.unwrap_or(24.0);
    Ok(Shot { frames, fps })
}

fn snow_layer(snow: &Table, folder: &Path) -> Result<Snow> {
    let cell = snow.number_in("cell", 1.0e-5..=10.0, "m")?;
    let cell = cell.ok_or_else(|| snow.error("cell", "is missing"))?;
    let layer = layer(snow, folder)?;
    let ground = ground(snow, folder)?;
    match layer {
        Layer::Grid(_) if ground.is_some() => {
            return Err(snow.error("ground", "is of no use beside a .vdb layer in `top`: leave it out"));
        }
        Layer::Depth(_) | Layer::Top(_) if ground.is_none() => {
            return Err(snow.error("ground", "is missing"));
        }
        _ => {}
    }
    Ok(Snow { ground, layer, cell, noise: noise(snow, cell)? })
}

fn layer(snow: &Table, folder: &Path) -> Result<Layer> {
    match (snow.number_in("depth", 1.0e-4..=1000.0, "m")?, snow.text("top")?) {
        (Some(depth), None) => Ok(Layer::Depth(depth)),
        (None, Some(top)) => {
            let path = folder.join(top);
            match extension(&path).as_str() {
                "vdb" => Ok(Layer::Grid(path)),
                "obj" | "ply" => Ok(Layer::Top(path)),
                _ => Err(snow.error("top", format!("must be a .vdb, .obj or .ply file, not \"{top}\""))),
            }
        }
        (Some(_), Some(_)) => Err(snow.error("top", "excludes `depth`: give one of them")),
        (None, None) => Err(snow.error("depth", "is missing (or `top`, a mesh or .vdb file)")),
    }
}

fn ground(snow: &Table, folder: &Path) -> Result<Option<Ground>> {
    let area = snow.numbers::<4>("area")?;
    if !snow.has("ground") {
        return match area {
            Some(_) => Err(snow.error("area", "needs `ground`, the height of a plane")),
            None => Ok(None),
        };
    }
    if let Ok(Some(text)) = snow.text("ground") {
        let path = folder.join(text);
        if !matches!(extension(&path).as_str(), "obj" | "ply") {
            let what = format!("must be a number or a .obj or .ply file, not \"{text}\"");
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
    let table = snow.table("noise", "[snow.noise]", &["amplitude", "size", "octaves", "seed"])?;
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

fn objects(root: &Table, folder: &Path) -> Result<Vec<Object>> {
    let known = ["file", "offset", "scale", "up", "role", "noise", "keys"];
    let tables = root.tables("object", "[[object]]", &known)?;
    tables.iter().map(|table| object(table, folder)).collect()
}

fn object(table: &Table, folder: &Path) -> Result<Object> {
    let file = table.text("file")?.ok_or_else(|| table.error("file", "is missing"))?;
    if !matches!(extension(Path::new(file)).as_str(), "obj" | "ply") {
        return Err(table.error("file", format!("must be a .obj or .ply file, not \"{file}\"")));
    }
    Ok(Object {
        file: folder.join(file),
        offset: table.number_in("offset", -1.0e7..=1.0e7, "frames")?.unwrap_or(0.0),
        space: Space {
            scale: table.number_in("scale", 1.0e-9..=1.0e9, "")?.unwrap_or(1.0),
            up: table.choice("up", &[("y", Up::Y), ("z", Up::Z)])?.unwrap_or(Up::Y),
        },
        role: table.choice("role", &ROLES)?.unwrap_or(Role::Collide),
        noise: table.flag("noise")?.unwrap_or(true),
        keys: keys(table)?,
    })
}

/// The roles by name.
pub(super) const ROLES: [(&str, Role); 3] =
    [("collide", Role::Collide), ("static", Role::Static), ("ignore", Role::Ignore)];

fn keys(object: &Table) -> Result<Vec<Key>> {
    let mut keys: Vec<Key> = Vec::new();
    for table in object.tables("keys", "keys of [[object]]", &["frame", "at", "turn_deg"])? {
        let frame = table.number_in("frame", -1.0e8..=1.0e8, "")?;
        let frame = frame.ok_or_else(|| table.error("frame", "is missing"))?;
        if keys.last().is_some_and(|before| before.frame >= frame) {
            return Err(table.error("frame", "must be greater than the key's before it"));
        }
        let at = table.numbers("at")?.unwrap_or([0.0; 3]);
        if at.iter().any(|value: &f64| value.abs() > FAR) {
            return Err(table.error("at", format!("must lie within {FAR} m of the origin")));
        }
        let turn_deg = table.numbers("turn_deg")?.unwrap_or([0.0; 3]);
        if turn_deg.iter().any(|value: &f64| value.abs() > 1.0e6) {
            return Err(table.error("turn_deg", "must lie in -1000000 to 1000000 degrees"));
        }
        keys.push(Key { frame, at, turn_deg });
    }
    Ok(keys)
}

fn output(root: &Table) -> Result<Output> {
    let Some(table) = root.table("output", "[output]", &["base", "removed"])? else {
        return Ok(Output { base: true, removed: true });
    };
    let written = |key| Ok(table.choices(key, &[("vdb", ())])?.is_none_or(|kinds| !kinds.is_empty()));
    Ok(Output { base: written("base")?, removed: written("removed")? })
}

/// A file's extension in lower case, empty when it has none.
fn extension(path: &Path) -> String {
    path.extension().and_then(|text| text.to_str()).unwrap_or("").to_lowercase()
}
