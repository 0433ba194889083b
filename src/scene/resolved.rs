//! Writes a scene with every default filled in and commented: the file beside the output that reproduces it.

use super::objects::is_character;
use super::{BaseMode, Ground, Layer, Object, Role, Scene};
use crate::motion::Up;
use std::fmt::Write;
use std::path::{Path, PathBuf};

impl Scene {
    /// The scene as TOML with every key, its meaning and absolute paths: for any folder.
    pub fn to_toml(&self) -> String {
        let mut text = String::new();
        self.write_toml(&mut text).expect("writing to a String does not fail");
        text
    }

    /// The same for a file in `folder`: what lies in the scene's own folder, with `folder` in there too, is named
    /// relative to it, so that the whole may be moved; so is what lies around two output folders side by side, when the
    /// scene is the other one's. All other paths are absolute.
    pub fn to_toml_in(&self, folder: &Path) -> String {
        let mut scene = self.clone();
        let home = self.path.parent().filter(|home| !home.as_os_str().is_empty()).unwrap_or(Path::new("."));
        // Links are followed: `..` goes up from where a folder really is.
        if let (Ok(home), Ok(folder)) = (home.canonicalize(), folder.canonicalize()) {
            let around =
                home.parent().filter(|around| folder.parent() == Some(around) && *around != Path::new("/"));
            let homes: Vec<&Path> = std::iter::once(home.as_path()).chain(around).collect();
            for path in scene.paths_mut() {
                let near = homes.iter().find_map(|home| relative(path, &folder, home));
                *path = near.unwrap_or_else(|| path.clone());
            }
        }
        scene.to_toml()
    }

    /// Every file that the scene names.
    fn paths_mut(&mut self) -> impl Iterator<Item = &mut PathBuf> {
        let ground = self.snow.ground.as_mut().and_then(|ground| match ground {
            Ground::Mesh(path) => Some(path),
            Ground::Plane { .. } => None,
        });
        let layer = match &mut self.snow.layer {
            Layer::Top(path) | Layer::Grid(path) => Some(path),
            Layer::Depth(_) => None,
        };
        ground.into_iter().chain(layer).chain(self.objects.iter_mut().map(|object| &mut object.file))
    }

    fn write_toml(&self, out: &mut String) -> std::fmt::Result {
        writeln!(out, "# Every setting of this output, defaults filled in, made by frazil {VERSION}.")?;
        writeln!(out, "# SI units; `frazil snow` on this file makes the same output again.\n")?;
        writeln!(out, "[shot]")?;
        line(out, "frames", &quoted(&self.shot.frames.to_string()), "first and last")?;
        line(out, "fps", &number(self.shot.fps), "frames per second")?;
        self.write_snow(out)?;
        for object in &self.objects {
            write_object(out, object)?;
        }
        writeln!(out, "\n[output]")?;
        let output = &self.output;
        let mode = match output.base_mode {
            BaseMode::Full => "full",
            BaseMode::Delta => "delta",
        };
        line(out, "base", kinds(output.base), "base/base.%04d.vdb: surface, compression, touched")?;
        line(out, "base_mode", &quoted(mode), "full, or delta: first frame whole, then what changed")?;
        line(out, "half", &output.half.to_string(), "16-bit values, for rendering only")?;
        line(out, "removed", kinds(output.removed), "removed/removed.%04d.vdb: what each frame took away")?;
        let objects: Vec<&str> = [("usd", output.objects_usd), ("ply", output.objects_ply)]
            .into_iter()
            .filter(|(_, written)| *written)
            .map(|(kind, _)| kind)
            .collect();
        line(
            out,
            "objects",
            &format!("{objects:?}"),
            "\"usd\", \"ply\": objects/, as they moved, with velocities",
        )?;
        line(out, "usd", &output.usd.to_string(), "shot.usda: the whole shot for programs that read USD")
    }

    fn write_snow(&self, out: &mut String) -> std::fmt::Result {
        writeln!(out, "\n[snow]")?;
        match &self.snow.ground {
            Some(Ground::Plane { height, area }) => {
                line(out, "ground", &number(*height), "height of a level plane (m)")?;
                line(out, "area", &numbers(area), "x0, z0, x1, z1 (m)")?;
            }
            Some(Ground::Mesh(path)) => line(out, "ground", &file(path), "mesh")?,
            None => {}
        }
        match &self.snow.layer {
            Layer::Depth(depth) => {
                line(out, "depth", &number(*depth), "above ground and static objects (m)")?
            }
            Layer::Top(path) => line(out, "top", &file(path), "mesh of the top surface")?,
            Layer::Grid(path) => line(out, "top", &file(path), "the layer as a level set")?,
        }
        line(out, "cell", &number(self.snow.cell), "edge of a voxel (m)")?;
        let crumb = self.snow.min_crumb.to_string();
        line(out, "min_crumb", &crumb, "islands of fewer voxels are taken away; 0 = none")?;
        let noise = &self.snow.noise;
        writeln!(out, "\n[snow.noise]")?;
        line(out, "amplitude", &number(noise.amplitude), "greatest displacement, outward only (m); 0 = off")?;
        line(out, "size", &number(noise.size), "size of the largest features (m)")?;
        line(out, "octaves", &noise.octaves.to_string(), "each of half the size of the one before")?;
        line(out, "seed", &noise.seed.to_string(), "")
    }
}

const VERSION: &str = env!("CARGO_PKG_VERSION");

fn write_object(out: &mut String, object: &Object) -> std::fmt::Result {
    writeln!(out, "\n[[object]]")?;
    line(out, "file", &file(&object.file), "character, mesh or sequence")?;
    if is_character(&object.file) {
        if let Some(node) = &object.node {
            line(out, "node", &quoted(node), "only nodes of this name and what hangs on them")?;
        }
        if let Some(clip) = &object.clip {
            line(out, "clip", &quoted(clip), "empty: the pose at rest")?;
        }
        line(out, "loop", &object.repeat.to_string(), "the clip starts again when it ends")?;
    }
    line(out, "offset", &number(object.offset), "frames that a sequence or clip starts later")?;
    line(out, "scale", &number(object.space.scale), "from the file's unit to metres")?;
    let up = match object.space.up {
        Up::Y => "y",
        Up::Z => "z",
    };
    line(out, "up", &quoted(up), "the file's upward axis: y or z")?;
    let role = match object.role {
        Role::Collide => "collide",
        Role::Static => "static",
        Role::Ignore => "ignore",
    };
    line(out, "role", &quoted(role), "collide, static or ignore")?;
    line(out, "noise", &object.noise.to_string(), "ragged edges")?;
    line(out, "ease", &object.ease.to_string(), "smooth between keys, else straight")?;
    if object.keys.is_empty() {
        return line(out, "keys", "[]", "rigid motion over the file's own");
    }
    writeln!(out, "keys = [  # rigid motion over the file's own: m, degrees about x, then y, then z")?;
    for key in &object.keys {
        let (at, turn) = (numbers(&key.at), numbers(&key.turn_deg));
        writeln!(out, "    {{ frame = {}, at = {at}, turn_deg = {turn} }},", number(key.frame))?;
    }
    writeln!(out, "]")
}

/// A file's path from a folder, where both lie in `home`; folder and home are free of links.
fn relative(path: &Path, folder: &Path, home: &Path) -> Option<PathBuf> {
    let up: PathBuf = folder.strip_prefix(home).ok()?.components().map(|_| "..").collect();
    let parent = path.parent()?.canonicalize().ok()?;
    Some(up.join(parent.strip_prefix(home).ok()?).join(path.file_name()?))
}

fn line(out: &mut String, key: &str, value: &str, meaning: &str) -> std::fmt::Result {
    let assignment = format!("{key} = {value}");
    if meaning.is_empty() {
        return writeln!(out, "{assignment}");
    }
    writeln!(out, "{assignment:<32} # {meaning}")
}

fn kinds(written: bool) -> &'static str {
    if written { "[\"vdb\"]" } else { "[]" }
}

/// The shortest text that reads back as the same number.
fn number(value: f64) -> String {
    format!("{value:?}")
}

fn numbers(values: &[f64]) -> String {
    let values: Vec<String> = values.iter().map(|value| number(*value)).collect();
    format!("[{}]", values.join(", "))
}

fn file(path: &Path) -> String {
    quoted(&path.to_string_lossy())
}

fn quoted(text: &str) -> String {
    toml::Value::String(text.to_string()).to_string()
}
