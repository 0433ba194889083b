//! Settings of the stages of a scene with snow, including hashes of the files that they depend on.

use std::path::Path;

use crate::error::Result;
use crate::io::records::input_hashes::InputHashes;
use crate::scene::run::settings::{settings_of, settings_of_first_state};
use crate::scene::run::{CONTENT, Settings};
use crate::scene::schema::declaration::Key;
use crate::scene::{Layer, Role, Scene};

/// The settings that the base depends on. Of the shot's frames only the first is one of them, as a shot may be extended.
///
/// # Errors
/// An input that cannot be read.
pub(in crate::scene::snow) fn of_base(scene: &Scene, input_hashes: &InputHashes) -> Result<Settings> {
    let mut settings = settings_of(scene, "base", input_hashes, &[Role::Collide, Role::Base, Role::Static])?;
    for (key, path) in scene.snow.iter().flat_map(|snow| snow.files()) {
        settings.insert(key.into(), format!("{CONTENT}{}", input_hashes.hash(path)?));
    }
    // A given layer does not depend on the ground below it.
    if scene.snow.as_ref().is_some_and(|snow| matches!(snow.layer, Layer::Grid(_))) {
        settings.remove("snow.ground");
    }
    Ok(settings)
}

/// The settings of a stage that depends on all objects, on the ground and on `file`, which is given with its key.
///
/// # Errors
/// An input that cannot be read.
pub(in crate::scene::snow) fn of_stage(
    scene: &Scene,
    stage: &str,
    input_hashes: &InputHashes,
    file: Option<(&'static str, &Path)>,
) -> Result<Settings> {
    let mut settings =
        settings_of(scene, stage, input_hashes, &[&Role::MOVING[..], &[Role::Static]].concat())?;
    let files = scene.snow.iter().flat_map(|snow| snow.files()).map(|(key, path)| (key, path.as_path()));
    for (key, path) in files.filter(|(key, _)| *key == "snow.ground").chain(file) {
        settings.insert(key.into(), format!("{CONTENT}{}", input_hashes.hash(path)?));
    }
    Ok(settings)
}

/// The settings that determine the layer before the first frame: stored frames cannot continue another layer. Static objects are numbered
/// separately, as other objects may be added or removed.
pub(in crate::scene::snow) fn of_layer(keys: &[Key], all: &Settings) -> Settings {
    let mut out = settings_of_first_state(keys, all, "base");
    let index = |key: &str| key.strip_prefix("object[")?.strip_suffix("].role")?.parse::<usize>().ok();
    let statics = all.iter().filter(|(_, role)| *role == "\"static\"");
    let mut statics: Vec<usize> = statics.filter_map(|(key, _)| index(key)).collect();
    statics.sort_unstable();
    for (position, index) in statics.into_iter().enumerate() {
        let before = format!("object[{index}].");
        for (key, value) in all.iter().filter_map(|(key, value)| Some((key.strip_prefix(&before)?, value))) {
            if key != "role" {
                out.insert(format!("static object {}: {key}", position + 1), value.clone());
            }
            // The time at which a clip starts depends on the frame rate.
            if key == "clip" || key == "loop" {
                out.extend(all.get("shot.fps").map(|fps| ("shot.fps".to_string(), fps.clone())));
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::System;
    use crate::scene::run::changed;
    use crate::scene::systems::keys;

    fn settings(all: &[(&str, &str)]) -> Settings {
        all.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect()
    }

    #[test]
    fn static_objects_count_whatever_their_index() {
        const ROLES: [(&str, &str); 2] = [("object[1].role", "\"static\""), ("object[3].role", "\"static\"")];
        let rock =
            |scale| of_layer(keys::of(System::Snow), &settings(&[ROLES[0], ("object[1].scale", scale)]));
        let later = of_layer(
            keys::of(System::Snow),
            &settings(&[("object[2].scale", "3.0"), ROLES[1], ("object[3].scale", "1.0")]),
        );
        let none = of_layer(
            keys::of(System::Snow),
            &settings(&[("object[1].scale", "3.0"), ("object[1].role", "\"collide\"")]),
        );
        assert_eq!(changed(&rock("1.0"), &later), Vec::<String>::new());
        assert_eq!(changed(&rock("1.0"), &rock("2.0")), ["static object 1: scale was 1.0"]);
        assert_eq!(changed(&rock("1.0"), &none), ["static object 1: scale was 1.0"]);
        assert_eq!(changed(&none, &rock("1.0")), ["static object 1: scale was not set"]);
    }

    #[test]
    fn the_layer_depends_only_on_keys_of_its_first_frame() {
        let all = settings(&[("snow.depth", "0.3"), ("snow.min_crumb", "0"), ("output.half", "true")]);
        assert_eq!(of_layer(keys::of(System::Snow), &all).into_keys().collect::<Vec<_>>(), ["snow.depth"]);
    }
}
