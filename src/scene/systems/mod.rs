//! The one place that knows all systems: their keys, and how a scene is read from a file and written back to one.

mod file;
pub(in crate::scene) mod keys;
mod resolved;
mod take;
mod typed;

pub use keys::{keys_json, reference, template};
pub use take::Take;

#[cfg(test)]
mod tests {
    use super::super::{Scene, System};
    use super::keys;
    use super::*;
    use crate::io::records::input_hashes::InputHashes;
    use crate::scene::run::settings::settings_of;
    use crate::scene::schema::Value;
    use crate::scene::schema::declaration::{Key, Kind, Scope, key, or};
    use crate::scene::schema::values::key_path;
    use crate::scene::schema::{reference_of, template_of};
    use std::path::Path;

    const TEXT: &str =
        "[shot]\nframes = \"1-2\"\n[snow]\nground = 0\narea = [0, 0, 1, 1]\ndepth = 0.2\ncell = 0.01\n";

    /// All keys of snow and a new one, which is declared only here.
    fn with_a_new_key() -> &'static [Key] {
        let glitter = Kind::Number(0.0, 2.0, "m");
        let new = key(&[("base", Scope::Step)], "snow", "glitter", glitter, or("0.5"))
            .means("how far it can be seen");
        let mut keys = keys::of(System::Snow).to_vec();
        let last = keys.iter().rposition(|key| key.table == "snow").unwrap();
        keys.insert(last + 1, new);
        keys.leak()
    }

    fn read(text: &str, keys: &'static [Key]) -> crate::Result<Scene> {
        Scene::parse_keys(text, Path::new("/s/shot.toml"), &[], |_| keys)
    }

    #[test]
    fn a_key_is_declared_in_one_place() {
        let keys = with_a_new_key();
        let scene = read(TEXT, keys).unwrap();
        assert_eq!(scene.values.number("snow.glitter"), Some(0.5));
        let resolved = scene.to_toml();
        let line = "glitter = 0.5                    # how far it can be seen\n";
        assert!(resolved.contains(line), "{resolved}");
        assert_eq!(read(&resolved, keys).unwrap().to_toml(), resolved);
        assert!(
            template_of([System::Snow.title(), System::Snow.name()], keys)
                .contains("\n# glitter = 0.5                  # how far it can be seen\n")
        );
        assert!(reference_of(keys).contains("| `glitter` | 0 to 2 m | `0.5` | how far it can be seen |\n"));
        // `frazil check` prints these.
        assert_eq!(scene.values.by_path()["snow.glitter"], Value::Number(0.5));
        let settings = |stage| settings_of(&scene, stage, &InputHashes::default(), &[]).unwrap();
        assert_eq!(settings("base").get("snow.glitter").map(String::as_str), Some("0.5"));
        assert_eq!(settings("objects").get("snow.glitter"), None);
    }

    #[test]
    fn a_new_key_is_checked_as_it_is_declared() {
        let keys = with_a_new_key();
        let refused = |line: &str| read(&format!("{TEXT}{line}\n"), keys).unwrap_err().to_string();
        assert_eq!(refused("glitter = 3"), "/s/shot.toml:8: `glitter` in [snow] must lie in 0 to 2 m, not 3");
        assert!(refused("gliter = 1").ends_with("unknown key `gliter` in [snow]; did you mean `glitter`?"));
        assert!(refused("glitter = \"far\"").ends_with("must be a finite number, not a text"));
        assert!(read(&format!("{TEXT}glitter = 3\n"), keys::of(System::Snow)).is_err());
    }

    #[test]
    fn defaults_and_examples_are_what_their_keys_may_hold() {
        let shown: String = template(System::Snow)
            .lines()
            .map(|line| format!("{}\n", line.trim_start_matches("# ")))
            .collect();
        // Every line of the starter scene is a valid value, except `top`, which excludes `depth`.
        let text: String = shown
            .lines()
            .skip_while(|line| *line != "[shot]")
            .filter(|line| !line.starts_with("top ="))
            .map(|line| format!("{line}\n"))
            .collect();
        let scene = read(&text, keys::of(System::Snow)).unwrap();
        let written: Vec<String> = scene.values.iter().map(|(key, index, _)| key_path(key, index)).collect();
        let all: Vec<String> = keys::of(System::Snow)
            .iter()
            .map(|key| key_path(key, None).replace("object.", "object[1]."))
            .collect();
        let missing: Vec<&String> = all.iter().filter(|path| !written.contains(path)).collect();
        assert_eq!(missing, ["snow.top"]);
        for key in keys::of(System::Snow) {
            assert!(!key.meaning.is_empty(), "{} means nothing", key.name);
            let again = keys::of(System::Snow)
                .iter()
                .filter(|other| (other.table, other.name) == (key.table, key.name));
            assert_eq!(again.count(), 1, "{} is declared twice", key.name);
        }
    }
}
