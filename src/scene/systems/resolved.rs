//! Writes a scene with every default filled in and commented: the file in the output folder that reproduces the output.

use crate::scene::Scene;
use crate::scene::schema::declaration::{Key, heading, is_table_array};
use crate::scene::schema::documentation::line;
use crate::scene::schema::shared_keys::tables;
use crate::scene::schema::values::{Value, pose_toml};
use std::fmt::Write;
use std::path::{Path, PathBuf};

impl Scene {
    /// The scene as TOML with every key, its meaning and absolute paths: valid in any folder.
    pub fn to_toml(&self) -> String {
        let mut out = format!(
            "# Every setting of this output, defaults filled in, made by frazil {}.\n\
             # SI units; `frazil {}` on this file makes the same output again.\n",
            env!("CARGO_PKG_VERSION"),
            self.system.name()
        );
        for table in tables(self.values.keys()) {
            let indices = match is_table_array(table) {
                true => (0..self.values.count(table)).map(Some).collect(),
                false => vec![None],
            };
            indices.into_iter().for_each(|index| self.write_table(&mut out, table, index));
        }
        out
    }

    /// As [`Scene::to_toml`], for a file in `folder`, with relative paths so that both folders can be moved together: if `folder` lies in the
    /// scene's folder, to files in the scene's folder; if it is a sibling of that, also to files in their parent. All others are absolute.
    pub fn to_toml_in(&self, folder: &Path) -> String {
        let mut scene = self.clone();
        let home = self.path.parent().filter(|home| !home.as_os_str().is_empty()).unwrap_or(Path::new("."));
        // Links are resolved: `..` goes up from a folder's real position.
        if let (Ok(home), Ok(folder)) = (home.canonicalize(), folder.canonicalize()) {
            let parent =
                home.parent().filter(|parent| folder.parent() == Some(parent) && *parent != Path::new("/"));
            let homes: Vec<&Path> = std::iter::once(home.as_path()).chain(parent).collect();
            for path in scene.values.paths_mut() {
                if let Some(relative) = homes.iter().find_map(|home| relative(path, &folder, home)) {
                    *path = relative;
                }
            }
        }
        scene.to_toml()
    }

    /// A table with its values, if it has any.
    fn write_table(&self, out: &mut String, table: &str, index: Option<usize>) {
        let own = self.values.iter().filter(|(key, of, _)| key.table == table && *of == index);
        let values: Vec<(&Key, &Value)> = own.map(|(key, _, value)| (key, value)).collect();
        if !values.is_empty() {
            let _ = writeln!(out, "\n{}", heading(table));
        }
        values.iter().for_each(|(key, value)| out.push_str(&lines(key, value)));
    }
}

/// A key with its value and meaning.
fn lines(key: &Key, value: &Value) -> String {
    match value {
        Value::Poses(poses) if !poses.is_empty() => {
            let poses: String = poses.iter().map(|key| format!("    {},\n", pose_toml(key))).collect();
            format!("{}{poses}]\n", line(&format!("{} = [", key.name), key.meaning))
        }
        value => line(&format!("{} = {value}", key.name), key.meaning),
    }
}

/// A file's path relative to a folder, if both lie in `home`; folder and home must be free of links.
pub(super) fn relative(path: &Path, folder: &Path, home: &Path) -> Option<PathBuf> {
    let up: PathBuf = folder.strip_prefix(home).ok()?.components().map(|_| "..").collect();
    let parent = path.parent()?.canonicalize().ok()?;
    Some(up.join(parent.strip_prefix(home).ok()?).join(path.file_name()?))
}
