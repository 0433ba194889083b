//! Writes a scene with every default filled in and commented: the file beside the output that reproduces it.

use super::keys;
use crate::motion::{Up, is_gltf};
use crate::scene::{BaseMode, Ground, Layer, Object, Role, Scene};
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
        line(out, "shot.frames", &quoted(&self.shot.frames.to_string()))?;
        line(out, "shot.fps", &number(self.shot.fps))?;
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
        line(out, "output.base", kinds(output.base))?;
        line(out, "output.base_mode", &quoted(mode))?;
        line(out, "output.half", &output.half.to_string())?;
        line(out, "output.removed", kinds(output.removed))?;
        let objects: Vec<&str> = [("usd", output.objects_usd), ("ply", output.objects_ply)]
            .into_iter()
            .filter(|(_, written)| *written)
            .map(|(kind, _)| kind)
            .collect();
        line(out, "output.objects", &format!("{objects:?}"))?;
        line(out, "output.usd", &output.usd.to_string())
    }

    fn write_snow(&self, out: &mut String) -> std::fmt::Result {
        writeln!(out, "\n[snow]")?;
        match &self.snow.ground {
            Some(Ground::Plane { height, area }) => {
                line(out, "snow.ground", &number(*height))?;
                line(out, "snow.area", &numbers(area))?;
            }
            Some(Ground::Mesh(path)) => line(out, "snow.ground", &file(path))?,
            None => {}
        }
        match &self.snow.layer {
            Layer::Depth(depth) => line(out, "snow.depth", &number(*depth))?,
            Layer::Top(path) | Layer::Grid(path) => line(out, "snow.top", &file(path))?,
        }
        line(out, "snow.cell", &number(self.snow.cell))?;
        line(out, "snow.min_crumb", &self.snow.min_crumb.to_string())?;
        let noise = &self.snow.noise;
        writeln!(out, "\n[snow.noise]")?;
        line(out, "snow.noise.amplitude", &number(noise.amplitude))?;
        line(out, "snow.noise.size", &number(noise.size))?;
        line(out, "snow.noise.octaves", &noise.octaves.to_string())?;
        line(out, "snow.noise.seed", &noise.seed.to_string())
    }
}

const VERSION: &str = env!("CARGO_PKG_VERSION");

fn write_object(out: &mut String, object: &Object) -> std::fmt::Result {
    writeln!(out, "\n[[object]]")?;
    line(out, "object.file", &file(&object.file))?;
    if is_gltf(&object.file) {
        if let Some(node) = &object.node {
            line(out, "object.node", &quoted(node))?;
        }
        if let Some(clip) = &object.clip {
            line(out, "object.clip", &quoted(clip))?;
        }
        line(out, "object.loop", &object.repeat.to_string())?;
    }
    line(out, "object.offset", &number(object.offset))?;
    line(out, "object.scale", &number(object.space.scale))?;
    let up = match object.space.up {
        Up::Y => "y",
        Up::Z => "z",
    };
    line(out, "object.up", &quoted(up))?;
    let role = match object.role {
        Role::Collide => "collide",
        Role::Static => "static",
        Role::Ignore => "ignore",
    };
    line(out, "object.role", &quoted(role))?;
    line(out, "object.noise", &object.noise.to_string())?;
    line(out, "object.ease", &object.ease.to_string())?;
    if object.keys.is_empty() {
        return line(out, "object.keys", "[]");
    }
    writeln!(out, "keys = [  # {}: m, degrees about x, then y, then z", meaning("object.keys"))?;
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

/// A key by its path, with its value and meaning.
fn line(out: &mut String, path: &str, value: &str) -> std::fmt::Result {
    let name = path.rsplit('.').next().unwrap_or(path);
    let assignment = format!("{name} = {value}");
    match meaning(path) {
        "" => writeln!(out, "{assignment}"),
        meaning => writeln!(out, "{assignment:<32} # {meaning}"),
    }
}

fn meaning(path: &str) -> &'static str {
    keys::find(path).map_or("", |key| key.meaning)
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
