//! The import law: which room may use which.

use std::fs;
use std::path::{Path, PathBuf};

/// Each room with what it may use besides itself, `error` and `context`.
const LAW: [(&str, &[&str]); 16] = [
    ("numeric", &[]),
    ("geometry", &["numeric"]),
    ("io", &["numeric", "geometry"]),
    ("vdb", &["numeric", "geometry", "io"]),
    ("motion", &["numeric", "geometry", "io"]),
    ("distance", &["numeric", "geometry"]),
    ("mesh_repair", &["numeric", "geometry", "distance"]),
    ("sweep", &["numeric", "geometry", "vdb", "motion", "distance"]),
    ("flow", &["numeric", "geometry"]),
    ("render", &["numeric", "geometry", "io", "vdb"]),
    ("snow", &["numeric", "geometry", "vdb", "motion", "sweep", "flow"]),
    ("surface", &["numeric", "geometry", "vdb", "distance", "mesh_repair"]),
    ("shallow", &["numeric", "geometry"]),
    (
        "scene",
        &[
            "numeric",
            "geometry",
            "io",
            "vdb",
            "motion",
            "mesh_repair",
            "sweep",
            "flow",
            "snow",
            "surface",
            "shallow",
        ],
    ),
    (
        "capi",
        &[
            "numeric",
            "geometry",
            "io",
            "vdb",
            "motion",
            "mesh_repair",
            "sweep",
            "flow",
            "snow",
            "surface",
            "shallow",
        ],
    ),
    ("cli", &[]),
];

/// Files besides those of vdb and capi that may contain `unsafe`.
const UNSAFE: [&str; 10] = [
    "src/numeric/cpu.rs",
    "src/numeric/lanes.rs",
    "src/context/memory.rs",
    "src/context/pool.rs",
    "src/shallow/solver/transfers/whole_units.rs",
    "src/snow/grains/solver/collide.rs",
    "src/snow/grains/solver/layout.rs",
    "src/snow/grains/solver/rows.rs",
    "src/snow/grains/colliders/search.rs",
    "src/snow/grains/solver/solve.rs",
];

fn sources(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            out.push(path);
        }
    }
}

pub(super) fn all_sources() -> Vec<PathBuf> {
    let mut out = Vec::new();
    sources(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src"), &mut out);
    out
}

fn room(path: &Path) -> String {
    let inner = path.strip_prefix(Path::new(env!("CARGO_MANIFEST_DIR")).join("src")).unwrap();
    let first = inner.components().next().unwrap().as_os_str().to_str().unwrap();
    first.trim_end_matches(".rs").to_string()
}

#[test]
fn rooms_use_only_the_rooms_that_the_law_allows() {
    for path in all_sources() {
        let text = fs::read_to_string(&path).unwrap();
        let room = room(&path);
        let allowed: &[&str] = match room.as_str() {
            "error" | "context" => &["numeric", "geometry"],
            "lib" | "main" => continue,
            name => {
                LAW.iter().find(|(room, _)| *room == name).unwrap_or_else(|| panic!("{name} has no law")).1
            }
        };
        for (at, _) in text.match_indices("crate::") {
            let used: String =
                text[at + 7..].chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect();
            let free =
                used == room || used == "error" || used == "context" || !LAW.iter().any(|(r, _)| *r == used);
            assert!(
                free || allowed.contains(&used.as_str()),
                "{}: {room} may not use {used}",
                path.display()
            );
        }
    }
}

#[test]
fn the_table_of_contributing_is_the_law() {
    let text = fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("CONTRIBUTING.md")).unwrap();
    for (room, allowed) in LAW {
        let row = text.lines().find(|line| line.starts_with(&format!("| {room} |")));
        let row = row.unwrap_or_else(|| panic!("CONTRIBUTING.md has no row for {room}"));
        let listed = row.trim_end_matches(" |").rsplit(" | ").next().unwrap();
        let law = match room {
            "numeric" => "nobody".to_string(),
            // The command is another crate: it sees what the library shows.
            "cli" => "everything but capi".to_string(),
            _ => allowed.join(", "),
        };
        assert_eq!(listed, law, "CONTRIBUTING.md, {room}");
    }
}

#[test]
fn words_stay_in_their_rooms() {
    for path in all_sources() {
        let text = fs::read_to_string(&path).unwrap();
        let room = room(&path);
        let only = |word: &str, rooms: &[&str]| {
            assert!(!text.contains(word) || rooms.contains(&room.as_str()), "{}: {word}", path.display());
        };
        only("bridge::", &["vdb"]);
        only("clap::", &["cli"]);
        only("extern \"C\"", &["capi"]);
        only("println!", &["cli"]);
        let has_unsafe =
            room != "vdb" && text.contains("unsafe ") && !UNSAFE.iter().any(|file| path.ends_with(file));
        assert!(!has_unsafe || room == "capi", "{}: unsafe", path.display());
        assert!(!["utils", "helpers", "common"].contains(&room.as_str()), "a room named {room}");
        assert!(text.lines().count() <= 500, "{} is over 500 lines", path.display());
    }
}

#[test]
fn sines_powers_and_logarithms_are_those_of_libm() {
    // The C library's differ from one to the next in the last bit, and so would the files.
    let methods = "sin cos tan sin_cos asin acos atan atan2 sinh cosh tanh asinh acosh atanh exp exp2 exp_m1 ln ln_1p \
                   log log2 log10 powf cbrt hypot slerp";
    // nalgebra's that call them.
    let makers = "from_euler_angles euler_angles from_axis_angle from_scaled_axis new_perspective angle_to";
    for path in all_sources() {
        let text = fs::read_to_string(&path).unwrap();
        // Behind the tests' beginning nothing reaches a file.
        let code = text.split("#[cfg(test)]").next().unwrap();
        for name in methods.split_whitespace() {
            for form in [format!(".{name}("), format!("f64::{name}"), format!("f32::{name}")] {
                let mut rest = code;
                while let Some(at) = rest.find(&form) {
                    rest = &rest[at + form.len()..];
                    // `f64::sin` is std's, `f64::singular` is not.
                    let whole =
                        form.ends_with('(') || !rest.starts_with(|c: char| c.is_alphanumeric() || c == '_');
                    assert!(!whole, "{}: {form} is the C library's: take libm::{name}", path.display());
                }
            }
        }
        for name in makers.split_whitespace() {
            assert!(!code.contains(name), "{}: {name} calls the C library's sine", path.display());
        }
    }
}

#[test]
fn every_file_of_tests_is_run() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/testsuite");
    let main = fs::read_to_string(folder.join("main.rs")).unwrap();
    let mut files = Vec::new();
    sources(&folder, &mut files);
    for file in files.iter().filter(|file| file.parent() != Some(&folder)) {
        let [room, name] =
            [file.parent().unwrap(), file].map(|path| path.file_stem().unwrap().to_str().unwrap());
        let of_room =
            main.split(&format!("\nmod {room} {{\n")).nth(1).unwrap_or("").split("\n}").next().unwrap();
        assert!(of_room.contains(&format!("mod {name};")), "{room}/{name}.rs has no line in main.rs");
    }
}
