//! What the base layer depends on.

use crate::error::Result;
use crate::io::seen::Seen;
use crate::scene::shot::Settings;
use crate::scene::text::keys::{Scope, scope, settings_of};
use crate::scene::{Ground, Layer, Role, Scene, shot};

/// The settings that the base depends on. Of the frames only the first counts: a shot may grow.
///
/// # Errors
/// An input that cannot be read.
pub(super) fn of_base(scene: &Scene, seen: &Seen) -> Result<Settings> {
    let mut settings = settings_of(scene, "base", seen, &[Role::Collide, Role::Static])?;
    let mut content = |key: &str, path| -> Result<()> {
        settings.insert(key.into(), format!("{}{}", shot::CONTENT, seen.hash(path)?));
        Ok(())
    };
    if let Some(Ground::Mesh(path)) = &scene.snow.ground {
        content("snow.ground", path)?;
    }
    if let Layer::Top(path) | Layer::Grid(path) = &scene.snow.layer {
        content("snow.top", path)?;
    }
    Ok(settings)
}

/// The settings that make the layer before the first frame: what was kept cannot go on as another layer. Static objects
/// are counted by themselves: others may come and go.
pub(super) fn of_layer(all: &Settings) -> Settings {
    let is_first = |key: &str| scope(key, "base") == Some(Scope::First);
    let of_snow = all.iter().filter(|(key, _)| is_first(key));
    let mut out: Settings = of_snow.map(|(key, value)| (key.clone(), value.clone())).collect();
    let index = |key: &str| key.strip_prefix("object[")?.strip_suffix("].role")?.parse::<usize>().ok();
    let statics = all.iter().filter(|(_, role)| *role == "\"static\"");
    let mut statics: Vec<usize> = statics.filter_map(|(key, _)| index(key)).collect();
    statics.sort_unstable();
    for (place, index) in statics.into_iter().enumerate() {
        let before = format!("object[{index}].");
        for (key, value) in all.iter().filter_map(|(key, value)| Some((key.strip_prefix(&before)?, value))) {
            if key != "role" {
                out.insert(format!("static object {}: {key}", place + 1), value.clone());
            }
            // When a clip starts depends on it.
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
    use crate::scene::text::keys::flattened;
    use shot::changed;

    #[test]
    fn static_objects_make_the_layer_wherever_they_stand() {
        let layer = |text: &str| of_layer(&flattened(text).unwrap());
        let rock = |scale: f64| format!("[[object]]\nrole = \"static\"\nscale = {scale:?}\n");
        let foot = "[[object]]\nrole = \"collide\"\nscale = 3.0\n";
        let [one, two] = [layer(&(rock(1.0) + foot)), layer(&(foot.to_string() + foot + &rock(1.0)))];
        assert_eq!(changed(&one, &two), Vec::<String>::new());
        assert_eq!(changed(&one, &layer(&(rock(2.0) + foot))), ["static object 1: scale was 1.0"]);
        assert_eq!(changed(&one, &layer(foot)), ["static object 1: scale was 1.0"]);
        assert_eq!(changed(&layer(foot), &one), ["static object 1: scale was not there"]);
    }

    #[test]
    fn only_what_makes_the_layer_is_of_the_layer() {
        let all = flattened("[snow]\ndepth = 0.3\nmin_crumb = 0\n[output]\nhalf = true\n").unwrap();
        assert_eq!(of_layer(&all).into_keys().collect::<Vec<_>>(), ["snow.depth"]);
    }
}
