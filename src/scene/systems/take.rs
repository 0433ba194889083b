//! Takes: copies of a scene file with settings, in folders beside it.

use std::path::{Path, PathBuf};

use super::file::{folder_of, text_of};
use super::resolved::relative;
use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::scene::schema::edited_text::EditedText;
use crate::scene::schema::overrides::Override;
use crate::scene::schema::values::Values;

/// A copy of a scene file with settings written into it.
#[derive(Debug, Clone, PartialEq)]
pub struct Take {
    /// The copy as it will be read: with its path, which need not exist yet.
    pub scene: Scene,
    /// The text of its file, with the comments of the original.
    pub text: String,
}

impl Take {
    /// A copy of the scene file at `path`, with settings of the command line written into it, for a file of the same name in the folder
    /// `name` beside it. Every file is still the same: relative paths of the scene get `..` in front. Those of settings start from the
    /// current folder; they become relative if the file lies in the scene's folder, and absolute if it does not.
    ///
    /// # Errors
    /// As [`Scene::read_with`]; a file whose path is not UTF-8, which TOML cannot hold.
    pub fn of(path: &Path, name: &str, overrides: &[Override]) -> Result<Self> {
        let original = text_of(path)?;
        let scene = Scene::parse(&original, path, overrides)?;
        let unedited = || Error::Internal(format!("{}: its text cannot be edited", path.display()));
        let mut edited = EditedText::parse(&original).ok_or_else(unedited)?;
        overrides.iter().try_for_each(|setting| edited.set(setting)).ok_or_else(unedited)?;
        let home = folder_of(path)?;
        for (key, index, value) in scene.values.iter() {
            let (Some(file), Some(text)) = (value.path(), edited.text_of(key, index)) else { continue };
            if let Some(text) = path_in_take(file, text, &home, name)? {
                edited.replace(key, index, text);
            }
        }
        let text = edited.text();
        let folder = path.with_file_name(name);
        let copy = Scene::parse(&text, &folder.join(path.file_name().unwrap_or_default()), &[])?;
        // Whatever form a scene's tables have, a copy that is another scene is never handed out.
        if without_paths(&copy) != without_paths(&scene) {
            return Err(unedited());
        }
        Ok(Self { scene: copy, text })
    }
}

/// The text of a file's path in the folder `name` inside of `home`, if it is not the text that names it in `home`.
fn path_in_take(file: &Path, text: &str, home: &Path, name: &str) -> Result<Option<String>> {
    let path = match Path::new(text) {
        absolute if absolute.is_absolute() => return Ok(None),
        own if home.join(own) == file => Path::new("..").join(own),
        // Of a setting: relative to the current folder.
        _ => moved(file, home, name).unwrap_or_else(|| file.to_path_buf()),
    };
    let text = path.to_str().map(String::from);
    text.map(Some).ok_or_else(|| Error::file(file, "its path is not UTF-8, which a scene cannot hold"))
}

/// The path of a file in `home`, relative to the folder `name` inside of `home`.
fn moved(file: &Path, home: &Path, name: &str) -> Option<PathBuf> {
    let home = home.canonicalize().ok()?;
    relative(file, &home.join(name), &home)
}

/// The values of a scene, without the paths of files.
fn without_paths(scene: &Scene) -> Values {
    let mut values = scene.values.clone();
    values.paths_mut().for_each(|path| *path = PathBuf::new());
    values
}
