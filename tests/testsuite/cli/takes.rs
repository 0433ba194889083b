//! `take`: copies of scenes with settings. A copy is the scene that the settings make, in another folder.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use frazil::scene::{Override, Scene, System, Value};

use crate::program::{CUBE, Folder, command, complains, fails, frazil, works};

const SHOT: &str = "# A cube in snow.\n[shot]\nframes = \"1-2\"   # few\n\n[snow]\nground = 0.0\n\
                    area = [-0.6, -0.6, 0.6, 0.6]\n# Not deep.\ndepth = 0.3 # m\ncell = 0.06\n\n[[object]]\nfile = \"props/cube.obj\"\n\
                    keys = [{ frame = 1, at = [0, 0.1, 0] }, { frame = 2, at = [0.1, 0.1, 0] }]\n# The end.\n";

/// A folder with the shot, and its cube in `props`.
fn shot() -> Folder {
    let folder = Folder::empty();
    fs::create_dir(folder.join("props")).unwrap();
    fs::write(folder.join("props/cube.obj"), CUBE).unwrap();
    fs::write(folder.join("shot.toml"), SHOT).unwrap();
    folder
}

fn text(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap()
}

/// The values of a scene, and its files as they really are.
fn contents(scene: &Scene) -> (BTreeMap<String, Value>, BTreeMap<String, PathBuf>) {
    let mut values = scene.values().by_path();
    let mut files = BTreeMap::new();
    values.retain(|key, value| {
        let Some(path) = value.path() else { return true };
        let folder = path.parent().unwrap();
        let folder = folder.canonicalize().unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
        files.insert(key.clone(), folder.join(path.file_name().unwrap()));
        false
    });
    (values, files)
}

#[test]
fn every_example_scene_is_the_same_in_a_take() {
    let folder = Folder::empty();
    let scenes = folder.join("show/examples/scenes");
    [&scenes, &folder.join("show/target/demo")].iter().for_each(|path| fs::create_dir_all(path).unwrap());
    let originals = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/scenes");
    let mut count = 0;
    for entry in fs::read_dir(originals).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_str().unwrap();
        let copy = scenes.join(name);
        fs::copy(&path, &copy).unwrap();
        let settings: &[&str] = match Scene::read(&copy).unwrap().system() {
            System::Shallow => {
                &["shot.fps=25", "shallow.origin=[1, 2, 3]", "output.usd=false", "shallow.liquid=honey"]
            }
            _ => &[
                "shot.frames=1-7",
                "snow.noise.seed=9",
                "object.1.scale=0.5",
                "output.objects=[\"ply\"]",
                "output.usd=false",
            ],
        };
        let set: Vec<String> =
            settings.iter().flat_map(|setting| ["--set".into(), setting.to_string()]).collect();
        for (take, set) in [("as_it_is", &[][..]), ("take 2", &set[..])] {
            let mut command = Command::new(env!("CARGO_BIN_EXE_frazil"));
            let output =
                command.current_dir(&folder).arg("take").arg(&copy).arg(take).args(set).output().unwrap();
            assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
            let overrides: Vec<Override> =
                set.iter().skip(1).step_by(2).map(|text| text.parse().unwrap()).collect();
            let wanted = contents(&Scene::read_with(&copy, &overrides).unwrap());
            let made = scenes.join(take).join(name);
            assert_eq!(contents(&Scene::read(&made).unwrap()), wanted, "{name}");
            assert!(!wanted.1.is_empty(), "{name} has no files");
            // Comments stay, in their order.
            let comments = |text: &str| {
                text.split('\n')
                    .filter_map(|line| Some(line.split_once('#')?.1.to_string()))
                    .collect::<Vec<_>>()
            };
            assert_eq!(
                comments(&fs::read_to_string(made).unwrap()),
                comments(&fs::read_to_string(&copy).unwrap()),
                "{name}"
            );
        }
        fs::remove_dir_all(scenes.join("as_it_is")).unwrap();
        fs::remove_dir_all(scenes.join("take 2")).unwrap();
        count += 1;
    }
    assert_eq!(count, 19);
}

#[test]
fn a_take_is_the_scene_with_its_settings_in_their_places() {
    let folder = &shot();
    let said =
        works(folder, "take shot.toml deep --set snow.depth=0.4 --set snow.noise.seed=2 --set shot.fps=25");
    let settings = "snow.depth=0.4, snow.noise.seed=2, shot.fps=25";
    let run = "frazil snow deep/shot.toml -o deep/cache";
    assert_eq!(said, format!("deep/shot.toml: shot.toml with {settings}\n{run}\n"));
    let wanted = SHOT
        .replace("# few\n", "# few\nfps = 25\n")
        .replace("depth = 0.3 # m", "depth = 0.4 # m")
        .replace("cell = 0.06\n", "cell = 0.06\n\n[snow.noise]\nseed = 2\n")
        .replace("\"props/", "\"../props/");
    assert_eq!(text(folder, "deep/shot.toml"), wanted);
    assert_eq!(text(folder, "shot.toml"), SHOT);
    // The command that was printed makes what the settings make.
    works(folder, &format!("{} -q", run.strip_prefix("frazil ").unwrap()));
    works(folder, "snow shot.toml -o same -q --set snow.depth=0.4 --set snow.noise.seed=2 --set shot.fps=25");
    for file in ["base/base.0001.vdb", "base/base.0002.vdb", "removed/removed.0002.vdb"] {
        let [take, same] = ["deep/cache", "same"].map(|of| fs::read(folder.join(of).join(file)).unwrap());
        assert!(take == same, "{file}");
    }
    // A take of a take, and one without settings.
    works(folder, "take deep/shot.toml again");
    let again = text(folder, "deep/again/shot.toml");
    assert_eq!(again, wanted.replace("\"../props/", "\"../../props/"));
}

#[test]
fn settings_go_into_tables_of_every_form() {
    let folder = &shot();
    let inline = "shot = { frames = \"1-2\" }\nsnow = { cell = 0.1, ground = 0, depth = 0.3, area = [0, 0, 1, 1], noise = { seed = 1 } }\n\
                  object = [{ file = \"props/cube.obj\" }]\n";
    fs::write(folder.join("inline.toml"), inline).unwrap();
    let settings =
        "--set snow.noise.seed=2 --set snow.noise.size=3 --set object.1.role=static --set grains.max=100";
    works(folder, &format!("take inline.toml inline {settings}"));
    let wanted = inline
        .replace("seed = 1", "seed = 2, size = 3")
        .replace("\"props/cube.obj\"", "\"../props/cube.obj\", role = \"static\"");
    assert_eq!(text(folder, "inline/inline.toml"), format!("{wanted}\n[grains]\nmax = 100\n"));
    // A table becomes a value.
    fs::write(
        folder.join("noise.toml"),
        SHOT.replace("\n[[object]]", "\n[snow.noise]\nseed = 2\n\n[[object]]"),
    )
    .unwrap();
    works(folder, "take noise.toml noise --set snow.noise={size=3}");
    let made = text(folder, "noise/noise.toml");
    assert!(made.contains("cell = 0.06\nnoise = {size=3}\n") && !made.contains("seed"), "{made}");
    // The ends of lines as on Windows.
    fs::write(folder.join("windows.toml"), SHOT.replace('\n', "\r\n")).unwrap();
    works(folder, "take windows.toml windows");
    assert_eq!(
        text(folder, "windows/windows.toml"),
        SHOT.replace("\"props/", "\"../props/").replace('\n', "\r\n")
    );
}

#[test]
fn files_of_settings_are_relative_to_the_current_folder() {
    let folder = &shot();
    let other = Folder::empty();
    fs::write(other.join("ball.obj"), CUBE).unwrap();
    fs::create_dir(folder.join("work")).unwrap();
    let other_file = other.canonicalize().unwrap().join("ball.obj");
    let cases = [
        ("inside", "../props/cube.obj".to_string(), "../props/cube.obj".to_string()),
        ("outside", other_file.display().to_string(), other_file.display().to_string()),
        ("sequence", "cube.%04d.obj".to_string(), "../work/cube.%04d.obj".to_string()),
    ];
    for (name, typed, written) in cases {
        works(&folder.join("work"), &format!("take ../shot.toml {name} --set object.1.file={typed}"));
        let made = text(folder, &format!("{name}/shot.toml"));
        assert!(made.contains(&format!("\nfile = \"{written}\"\n")), "{made}");
    }
    // In the scene's own folder, it is the scene's own path.
    works(folder, "take shot.toml here --set object.1.file=props/./cube.obj");
    assert!(text(folder, "here/shot.toml").contains("file = \"../props/./cube.obj\""));
    // A table in one setting.
    let objects = "object=[{file=\"../props/cube.obj\",role=\"static\"}]";
    works(&folder.join("work"), &format!("take ../shot.toml one --set {objects}"));
    let scene = Scene::read(&folder.join("one/shot.toml")).unwrap();
    assert!(
        scene.objects()[0].file.canonicalize().unwrap()
            == folder.join("props/cube.obj").canonicalize().unwrap()
    );
}

#[test]
fn settings_are_refused_as_they_are_by_a_run() {
    let folder = &shot();
    let settings = [
        "snow.dept=1",
        "snow.depth=deep",
        "snow.depth=-1",
        "object.2.scale=2",
        "object.1.file=cube.abc",
        "shot.frames=9",
        "snow.depth.x=1",
        "output.base=[\"ply\"]",
    ];
    for setting in settings {
        let taken = frazil(folder, &format!("take shot.toml new --set {setting}"));
        let run = frazil(folder, &format!("snow shot.toml -o new --set {setting}"));
        complains(&taken, 2, &["shot.toml", setting]);
        assert_eq!(taken.status.code(), run.status.code());
        let [taken, run] = [taken, run].map(|output| String::from_utf8(output.stderr).unwrap());
        assert_eq!(taken, run);
        assert!(!folder.join("new").exists(), "{setting}");
    }
    fails(folder, "take none.toml new", 2, &["none.toml"]);
    fails(folder, "take shot.toml new --set depth", 2, &["depth", "is not a setting"]);
    fs::write(folder.join("wrong.toml"), "[shot\n").unwrap();
    fails(folder, "take wrong.toml new", 2, &["wrong.toml:1"]);
    assert!(!folder.join("new").exists());
}

#[test]
fn a_take_overwrites_nothing_and_is_never_half_written() {
    let folder = &shot();
    fs::create_dir(folder.join("empty")).unwrap();
    std::os::unix::fs::symlink("empty", folder.join("link")).unwrap();
    fails(folder, "take shot.toml link", 2, &["link", "not a folder"]);
    works(folder, "take shot.toml empty");
    let made = text(folder, "empty/shot.toml");
    fails(folder, "take shot.toml empty --set shot.fps=25", 2, &["empty", "not empty"]);
    assert_eq!(text(folder, "empty/shot.toml"), made);
    fails(folder, "take shot.toml shot.toml", 2, &["shot.toml", "not a folder"]);
    for name in ["", ".", "..", "a/b", "../a", "/tmp", "a/", "a\\b", "a\nb"] {
        let output = command(folder, "take shot.toml").arg(name).output().unwrap();
        complains(&output, 2, &["is not the name of a folder"]);
    }
    // A name that a shell would take apart.
    let output = command(folder, "take shot.toml").arg("it's 2").output().unwrap();
    assert!(
        String::from_utf8(output.stdout)
            .unwrap()
            .ends_with("frazil snow 'it'\\''s 2/shot.toml' -o 'it'\\''s 2/cache'\n")
    );
    // A file system without room for the file.
    let script = "ulimit -f 0; exec \"$0\" take shot.toml full";
    let output = Command::new("sh")
        .current_dir(folder)
        .args(["-c", script, env!("CARGO_BIN_EXE_frazil")])
        .output()
        .unwrap();
    complains(&output, 1, &["full/shot.toml", "write"]);
    assert!(!folder.join("full").exists());
}
