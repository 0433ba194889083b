//! Every example in the README and in `--help` runs as it stands.

use assert_cmd::Command;
use std::fs;
use std::path::Path;

use crate::common::hero;
use crate::common::liquids::{ball, write_cache};
use crate::program::{CUBE, Folder, GRAINS};

const README: &str = include_str!("../../../README.md");
const CLI: &str = include_str!("../../../docs/cli.md");
const SCENE: &str = include_str!("../../../docs/scene.md");
const TUTORIALS: [(&str, &str); 3] = [
    ("snow", include_str!("../../../docs/tutorials/snow.md")),
    ("surface", include_str!("../../../docs/tutorials/surface.md")),
    ("shallow", include_str!("../../../docs/tutorials/shallow.md")),
];

/// The size of pictures: small ones show as much.
const SIZE: &str = "160x90";

/// Runs a line `frazil ...` in a folder and gives what it says on stdout.
#[track_caller]
fn works(folder: &Path, line: &str) -> String {
    let line = line.split(" #").next().unwrap().replace("640x360", SIZE);
    let draws = ["frazil preview", "frazil compare"].iter().any(|command| line.starts_with(command));
    let draws = draws && !line.contains("--size") && !line.contains("--help");
    let size = if draws { &["--size", SIZE][..] } else { &[] };
    // A shell would put the output into the file behind `>`.
    let (line, file) =
        line.split_once(" > ").map_or((&line[..], None), |(line, file)| (line, Some(file.trim())));
    let arguments = line.split_whitespace().skip(1).chain(size.iter().copied());
    let output = Command::cargo_bin("frazil").unwrap().current_dir(folder).args(arguments).output().unwrap();
    assert!(output.status.success(), "{line}: {}", String::from_utf8_lossy(&output.stderr));
    if let Some(file) = file {
        fs::write(folder.join(file), &output.stdout).unwrap();
    }
    String::from_utf8(output.stdout).unwrap()
}

/// The first block of a kind behind a heading.
fn block(text: &'static str, heading: &str, kind: &str) -> &'static str {
    let behind = text.split(heading).nth(1).unwrap();
    behind.split(&format!("```{kind}\n")).nth(1).unwrap().split("```").next().unwrap()
}

/// The commands of a block.
fn lines(block: &'static str) -> Vec<&'static str> {
    block.lines().filter(|line| line.starts_with("frazil ")).collect()
}

#[test]
fn the_readme_runs() {
    let folder = Folder::empty();
    fs::write(folder.join("boot.obj"), CUBE).unwrap();
    write_cache(&folder, "spot", &ball(4.0, 8, 0.0), 3);
    // As in the README but for the cells: a test need not be fine.
    let scene = block(README, "## Commands", "toml").replace("cell = 0.005", "cell = 0.02");
    assert!(scene.contains("cell = 0.02"));
    fs::write(folder.join("shot.toml"), scene).unwrap();
    let spill = "[shot]\nframes = \"1-3\"\n[shallow]\nterrain = \"boot.obj\"\ncell = 0.02\n\
                 [[source]]\nat = [0.0, 0.42, 0.0]\nradius = 0.05\nrate_ml = 100.0\n";
    fs::write(folder.join("spill.toml"), spill).unwrap();
    let lines = lines(block(README, "## Commands", "sh"));
    assert!(lines.len() >= 8, "{lines:?}");
    lines.iter().for_each(|line| {
        works(&folder, line);
    });
}

/// Puts the example scenes into a folder, with coarse cells and a walk named as in the file.
fn write_scenes(folder: &Path) {
    let scenes = folder.join("examples/scenes");
    fs::create_dir_all(&scenes).unwrap();
    for entry in fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes")).unwrap() {
        let path = entry.unwrap().path();
        let text = fs::read_to_string(&path).unwrap();
        let coarse: Vec<&str> =
            text.lines().map(|line| if line.starts_with("cell =") { "cell = 0.03" } else { line }).collect();
        fs::write(scenes.join(path.file_name().unwrap()), coarse.join("\n")).unwrap();
    }
}

#[test]
fn the_readme_takes_a_character_through_snow() {
    let folder = Folder::empty();
    write_scenes(&folder);
    // Our own figure in the place of CesiumMan: it has two clips.
    let path = folder.join("examples/scenes/walking_character.toml");
    let text = fs::read_to_string(&path).unwrap().replace("scale =", "clip = \"walk\"\nscale =");
    fs::write(&path, text).unwrap();
    fs::write(folder.join("CesiumMan.glb"), hero::glb()).unwrap();
    let lines = lines(block(README, "## A character walks", "sh"));
    assert_eq!(lines.len(), 4, "{lines:?}");
    lines.iter().for_each(|line| {
        works(&folder, line);
    });
}

#[test]
fn the_example_scenes_are_sound() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes");
    let paths: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert_eq!(paths.len(), 19);
    for path in paths {
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let scene = frazil::scene::Scene::read(&path).unwrap();
        let text = fs::read_to_string(&path).unwrap();
        if scene.system() == frazil::scene::System::Shallow {
            let command = format!("frazil shallow examples/scenes/{name}.toml -o spill/");
            assert!(text.contains(&command) && SCENE.contains(&format!("{name}.toml")), "{name}");
            continue;
        }
        assert!(README.contains(&name), "the README does not name {name}");
        // The command in the comment is the one that the README gives, with this scene's file.
        let file = scene.objects()[0].file.file_name().unwrap().to_string_lossy().into_owned();
        let command = format!("frazil snow examples/scenes/{name}.toml --set object.1.file={file} -o cache/");
        assert!(text.contains(&command), "{text}");
    }
}

#[test]
fn the_page_of_the_command_line_runs() {
    let folder = Folder::empty();
    fs::write(folder.join("hero.glb"), hero::glb()).unwrap();
    let (shot, rebuild) = ("## A shot from beginning", "## What a folder holds");
    let mut count = 0;
    for line in lines(block(CLI, shot, "sh")) {
        if line.starts_with("frazil preview") {
            // What comes next asks for a cache of changes.
            works(&folder, "frazil snow shot.toml -o changes -q --set output.base_mode=delta");
        }
        works(&folder, line);
        if line.starts_with("frazil new") {
            // As one would edit it.
            let path = folder.join("shot.toml");
            let text = fs::read_to_string(&path).unwrap();
            let edited =
                text.replace("# clip = \"Walk\"", "clip = \"walk\"").replace("cell = 0.0075", "cell = 0.03");
            assert!(edited.len() < text.len() + 4 && edited.contains("cell = 0.03"));
            fs::write(&path, edited).unwrap();
        }
        count += 1;
    }
    for line in lines(block(CLI, rebuild, "sh")) {
        works(&folder, &line.replace("cache/", "changes/"));
        count += 1;
    }
    for line in lines(block(CLI, "## Takes", "sh")) {
        works(&folder, line);
        count += 1;
    }
    for line in lines(block(CLI, "## Farms", "sh")) {
        works(&folder, line);
        count += 1;
    }
    for line in lines(block(CLI, "## Pictures", "sh")) {
        // A few frames show as much as all.
        works(&folder, &line.replace(" -o shot.gif", " --frames 1-120x40 -o shot.gif"));
        count += 1;
    }
    assert_eq!(count, 22);
}

/// Two frames of points.
fn write_grains(folder: &Path) {
    fs::write(folder.join("any.ply"), GRAINS).unwrap();
    for frame in [1, 2] {
        works(folder, &format!("frazil convert any.ply grains.000{frame}.vdb --voxel 0.1"));
    }
}

/// Two frames of a particle cache.
fn write_splash(folder: &Path) {
    let position = |n: i32| {
        format!("{} {} {}\n", 0.1 * f64::from(n % 5), 0.1 * f64::from(n / 5 % 5), 0.1 * f64::from(n / 25))
    };
    fs::write(folder.join("splash.xyz"), (0..125).map(position).collect::<String>()).unwrap();
    for frame in [1, 2] {
        works(folder, &format!("frazil convert splash.xyz splash.000{frame}.bgeo"));
    }
}

#[test]
fn the_page_of_the_command_line_makes_surfaces_of_particles() {
    let folder = Folder::empty();
    write_splash(&folder);
    fs::write(folder.join("rock.obj"), CUBE).unwrap();
    let lines = lines(block(CLI, "## Surfaces of particles", "sh"));
    assert_eq!(lines.len(), 7, "{lines:?}");
    lines.iter().for_each(|line| {
        works(&folder, line);
    });
}

#[test]
fn the_page_of_the_command_line_handles_points() {
    let folder = Folder::empty();
    write_grains(&folder);
    let lines = lines(block(CLI, "## Points", "sh"));
    assert_eq!(lines.len(), 7, "{lines:?}");
    lines.iter().for_each(|line| {
        works(&folder, line);
    });
}

#[test]
fn the_page_of_the_command_line_repairs_meshes() {
    let folder = Folder::empty();
    // A cube without its lid.
    let (open, _) = CUBE.rsplit_once("f ").unwrap();
    for name in ["broken", "broken.0001", "broken.0002"] {
        fs::write(folder.join(format!("{name}.obj")), open).unwrap();
    }
    let lines = lines(block(CLI, "## Repaired meshes", "sh"));
    assert_eq!(lines.len(), 4, "{lines:?}");
    let said: Vec<String> = lines.iter().map(|line| works(&folder, line)).collect();
    assert!(said[0].starts_with("broken.obj: a solid now, in solid.ply\n"), "{}", said[0]);
    assert!(said[1].starts_with("solid.ply: a solid\n"), "{}", said[1]);
}

/// The commands that a help text lists, each with the command before it.
fn commands_of(folder: &Path, command: &str) -> Vec<String> {
    let help = works(folder, &format!("{command} --help"));
    let listed =
        help.lines().skip_while(|line| *line != "Commands:").skip(1).take_while(|line| !line.is_empty());
    let names = listed.filter_map(|line| line.split_whitespace().next()).filter(|name| *name != "help");
    names.map(|name| format!("{command} {name}")).collect()
}

#[test]
fn every_command_has_help_with_an_example_that_runs() {
    let folder = &Folder::empty();
    for name in ["boot", "box", "bunny", "before", "after", "body.0001", "body.0002"] {
        fs::write(folder.join(format!("{name}.obj")), CUBE).unwrap();
    }
    let scene = "[shot]\nframes = \"1-48\"\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 0.5, 1.5]\ndepth = 0.3\n\
                 cell = 0.05\n[[object]]\nfile = \"boot.obj\"\nkeys = [{ frame = 1 }, { frame = 48, at = [0, 0, 1] }]\n";
    fs::write(folder.join("walker.toml"), scene).unwrap();
    fs::write(folder.join("hero.glb"), hero::glb()).unwrap();
    works(folder, "frazil snow walker.toml -o cache -q");
    // The same base, with grains.
    fs::write(folder.join("grains.toml"), format!("{scene}[grains]\n[output]\ngrains = [\"vdb\"]\n"))
        .unwrap();
    works(folder, "frazil snow grains.toml -o cache -q");
    for (name, by) in [("left", "0.1,0,0"), ("snow", "0,0.1,0")] {
        works(folder, &format!("frazil vdb sweep box.obj --move {by} --cell 0.02 -o {name}.vdb -q"));
    }
    works(folder, "frazil vdb from-mesh box.obj --cell 0.02 -o boot.vdb");
    works(folder, "frazil vdb from-mesh box.obj --cell 0.02 -o right.vdb");
    write_grains(folder);
    write_splash(folder);
    write_cache(folder, "spot", &ball(4.0, 8, 0.0), 3);
    let shot = "[shot]\nframes = \"1-3\"\n[surface]\nparticles = \"spot.%04d.bgeo\"\nmesh = \"spot.ply\"\n";
    fs::write(folder.join("spot.toml"), shot).unwrap();
    let spill = "[shot]\nframes = \"1-3\"\n[shallow]\nterrain = \"box.obj\"\ncell = 0.02\n\
                 [[pour]]\nat = [0, 1, 0]\nradius = 0.1\nvolume_ml = 100\n";
    fs::write(folder.join("spill.toml"), spill).unwrap();
    let mut commands = vec!["frazil".to_string()];
    commands.extend(commands_of(folder, "frazil"));
    for group in ["frazil vdb", "frazil mesh"] {
        commands.extend(commands_of(folder, group));
    }
    assert!(commands.len() > 1 + 8 + 10, "{commands:?}");
    for command in commands {
        let help = works(folder, &format!("{command} --help"));
        let examples: Vec<&str> = help.lines().filter_map(|line| line.strip_prefix("  frazil ")).collect();
        assert!(!examples.is_empty(), "{command} has no example: {help}");
        for example in examples.iter().flat_map(|line| line.split(" && ")) {
            // Fine cells take a long time and prove nothing more.
            let line = format!("frazil {}", example.strip_prefix("frazil ").unwrap_or(example));
            works(folder, &line.replace("--cell 0.00", "--cell 0.0"));
        }
    }
}

#[test]
fn the_docs_have_every_key_of_a_scene() {
    let folder = Folder::empty();
    let (snow, shallow) = SCENE.split_once("\n## Keys of a little liquid\n\n").unwrap();
    for (text, system) in [(snow.split("## Keys\n\n").nth(1).unwrap(), "snow"), (shallow, "shallow")] {
        let keys = works(&folder, &format!("frazil new {system} --keys"));
        assert!(text == keys, "docs/scene.md is not what `frazil new {system} --keys` says:\n{keys}");
    }
}

/// The keys of JSON are those of the table, and each says what its kind of value needs.
#[test]
fn keys_in_json_are_complete() {
    let folder = Folder::empty();
    for system in ["snow", "surface", "shallow"] {
        let text = works(&folder, &format!("frazil new {system} --keys"));
        let json = works(&folder, &format!("frazil new {system} --keys --json"));
        let keys: Vec<serde_json::Value> = serde_json::from_str(&json).unwrap();
        let rows = text.lines().filter(|line| line.starts_with("| `"));
        let names: Vec<&str> = rows.map(|row| row.split('`').nth(1).unwrap()).collect();
        assert_eq!(keys.iter().map(|key| key["name"].as_str().unwrap()).collect::<Vec<_>>(), names);
        for key in &keys {
            let has = |name: &str| !key[name].is_null();
            let kind = key["kind"].as_str().unwrap();
            assert_eq!(has("choices"), kind.starts_with("choice"), "{key}");
            assert_eq!(has("extensions"), kind.ends_with("file"), "{key}");
            assert_eq!(has("count"), kind.starts_with("numbers"), "{key}");
            assert_eq!(has("min"), has("max"), "{key}");
            assert!(!(key["is_required"] == true && has("default")), "{key}");
        }
        // Defaults are values, not texts of them; so are those of presets.
        let default = |name: &str| keys.iter().find(|key| key["name"] == name).unwrap()["default"].clone();
        assert_eq!((default("fps"), default("usd")), (24.0.into(), true.into()));
    }
    let keys: serde_json::Value =
        serde_json::from_str(&works(&folder, "frazil new snow --keys --json")).unwrap();
    let air = keys.as_array().unwrap().iter().find(|key| key["name"] == "air").unwrap();
    assert_eq!(air["presets"], serde_json::json!({ "powder": 0.3, "wet": 0.8 }));
    assert_eq!(
        (&air["min"], &air["max"], &air["is_optional_table"]),
        (&0.0.into(), &1.0.into(), &true.into())
    );
}

#[test]
fn the_page_of_surface_runs_and_has_every_key() {
    let folder = &Folder::empty();
    const SURFACE: &str = include_str!("../../../docs/surface.md");
    let keys = works(folder, "frazil new surface --keys");
    let said = "docs/surface.md is not what `frazil new surface --keys` says";
    assert_eq!(SURFACE.split("what follows.\n\n").nth(1), Some(&keys[..]), "{said}");
    write_cache(folder, "spot", &ball(4.0, 8, 0.0), 41);
    fs::create_dir(folder.join("cache")).unwrap();
    write_cache(&folder.join("cache"), "spot", &ball(4.0, 8, 0.0), 41);
    let scene = block(SURFACE, "## A shot", "toml").replace("0.00862", "0.01");
    fs::write(folder.join("spot.toml"), scene).unwrap();
    let blocks = SURFACE.split("```sh\n").skip(1).map(|text| text.split("```").next().unwrap());
    let commands: Vec<&str> = blocks.flat_map(lines).collect();
    assert_eq!(commands.len(), 6, "{commands:?}");
    for line in commands {
        // Two shots of one name are not one folder.
        let line = if line.contains("spot.toml") { line.replace("out/", "scene/") } else { line.to_string() };
        works(folder, &line);
    }
    let scene = works(folder, "frazil new surface");
    fs::write(folder.join("new.toml"), scene.replace("\"1-120\"", "\"1-41\"")).unwrap();
    works(folder, "frazil surface new.toml -o new/");
}

/// The blocks of a page: what kind each is, the line of text before it, and what it holds.
fn blocks(text: &'static str) -> Vec<[&'static str; 3]> {
    let parts: Vec<&str> = text.split("```").collect();
    let pairs = parts.windows(2).step_by(2);
    let block = |pair: &[&'static str]| {
        let (kind, body) = pair[1].split_once('\n').unwrap();
        [kind, pair[0].trim_end().lines().last().unwrap_or_default(), body]
    };
    pairs.map(block).collect()
}

/// A file or a command of a tutorial with coarse cells, few frames and small pictures, and with the spacing of the tests' ball, which
/// has no colours.
fn coarse(text: &str) -> String {
    let changes = [
        ("cell = 0.01 ", "cell = 0.04 "),
        ("cell = 0.03 ", "cell = 0.12 "),
        ("cell = 0.001 ", "cell = 0.004 "),
        ("cell = 0.0005 ", "cell = 0.004 "),
        ("0.0125", "0.01"),
        (" --color paint", ""),
        ("\"1-48\"", "\"1-10\""),
        ("--frames 1-34", "--frames 1-8"),
        ("--frame 30", "--frame 8"),
        ("--frame 34", "--frame 8"),
        ("--frame 48", "--frame 10"),
        (" --size 360x240", ""),
        (" --size 320x214", ""),
        (" --size 240x160", ""),
        (" --size 240x288", ""),
    ];
    changes.iter().fold(text.to_string(), |text, (from, to)| text.replace(from, to))
}

#[test]
fn the_tutorials_run() {
    for (name, text) in TUTORIALS {
        let folder = Folder::empty();
        fs::write(folder.join("hero.glb"), hero::glb()).unwrap();
        write_cache(&folder, "drip", &ball(4.0, 8, 0.0), 32);
        let mut count = 0;
        for [kind, before, body] in blocks(text) {
            if kind == "sh" {
                for line in lines(body) {
                    works(&folder, &coarse(line));
                    count += 1;
                }
                continue;
            }
            // "Save this as `FILE`:", or "Add this at the end of `FILE`:".
            let file = folder.join(before.split('`').nth_back(1).unwrap());
            let begun =
                if before.contains("end of") { fs::read_to_string(&file).unwrap() } else { String::new() };
            fs::write(&file, begun + &coarse(body)).unwrap();
        }
        assert!(count >= 10, "{name}: {count}");
    }
}

#[test]
fn a_check_lists_every_setting() {
    let folder = Folder::empty();
    fs::write(folder.join("hero.obj"), CUBE).unwrap();
    let scene = works(&folder, "frazil new snow")
        .replace("hero.glb", "hero.obj")
        .replace("cell = 0.0075", "cell = 0.1");
    fs::write(folder.join("shot.toml"), scene).unwrap();
    let report: serde_json::Value =
        serde_json::from_str(&works(&folder, "frazil check shot.toml --json")).unwrap();
    let settings = &report["settings"];
    assert_eq!(settings["snow.noise.amplitude"], 0.2);
    assert_eq!(settings["shot.frames"], "1-120");
    assert_eq!(settings["object[1].keys"][1]["frame"], 120.0);
    assert_eq!(settings["output.base"], serde_json::json!(["vdb"]));
    assert_eq!(settings["object[1].clip"], serde_json::Value::Null);
}
