//! What an artist asks of a figure: how fast to carry it, how deep it goes, a look at a pose.

use crate::common::hero;
use crate::picture::Picture;
use crate::program::{CUBE, Folder, fails, works};
use serde_json::Value;
use std::fs;
use std::path::Path;

/// A hero of 1 s a round who walks at 1.1 m/s, over 49 frames at 24 frames per second, in snow of 0.15 m.
fn folder(keys: &str) -> Folder {
    let folder = Folder::empty();
    fs::write(folder.join("hero.glb"), hero::glb()).unwrap();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    let scene = format!(
        "[shot]\nframes = \"1-49\"\n[snow]\nground = 0.0\narea = [-1, -1, 1, 4]\ndepth = 0.15\ncell = 0.02\n\
         [[object]]\nfile = \"hero.glb\"\n{keys}\n"
    );
    fs::write(folder.join("walk.toml"), scene).unwrap();
    folder
}

fn check(folder: &Path, more: &str) -> Value {
    let said = works(folder, &format!("check walk.toml --json {more}"));
    // Warnings go to stderr, behind the JSON.
    serde_json::Deserializer::from_str(&said).into_iter::<Value>().next().unwrap().unwrap()
}

fn warnings(report: &Value) -> Vec<&str> {
    report["warnings"].as_array().unwrap().iter().map(|what| what.as_str().unwrap()).collect()
}

#[test]
fn check_prints_the_keys_that_keep_feet_from_slipping_and_they_do() {
    let folder = folder("clip = \"walk\"\nkeys = [{ frame = 1, at = [0, 0.06, 0] }]");
    let slips = check(&folder, "");
    let walk = &slips["objects"][0]["walk"];
    let number = |key: &str| walk[key].as_f64().unwrap();
    assert!((number("stride_m") - 1.1).abs() < 0.03 && (number("round_s") - 1.0).abs() < 1e-5, "{walk}");
    assert!((number("slips_m_per_s") - 1.1).abs() < 0.03, "{walk}");
    assert!(walk["carry_m_per_s"][2].as_f64().unwrap() > 1.05, "towards +z: {walk}");
    let said = warnings(&slips).join("\n");
    assert!(said.contains("feet slip at 1.") && said.contains("keys = ["), "{said}");
    let keys = walk["keys"].as_str().unwrap();
    let text = fs::read_to_string(folder.join("walk.toml")).unwrap();
    let before = text.lines().find(|line| line.starts_with("keys")).unwrap().to_string();
    fs::write(folder.join("walk.toml"), text.replace(&before, keys)).unwrap();
    let stands = check(&folder, "");
    let walk = &stands["objects"][0]["walk"];
    assert!(walk["slips_m_per_s"].as_f64().unwrap() < 0.03, "{walk}");
    assert!(!warnings(&stands).join("\n").contains("slip"), "{stands}");
    let words = works(&folder, "check walk.toml");
    assert!(words.contains("walks at 1.") && words.contains("m deep in the snow, 0.0"), "{words}");
}

#[test]
fn check_prints_how_deep_feet_go_and_when_something_is_below_the_ground() {
    let folder = folder(
        "clip = \"walk\"\nkeys = [{ frame = 1, at = [0, 0.06, 0] }, { frame = 49, at = [0, 0.06, 2.2] }]",
    );
    let deepest = |report: &Value, key: &str| report["objects"][0]["deepest"][key].as_f64().unwrap();
    let good = check(&folder, "");
    assert!((deepest(&good, "above_ground_m") - 0.06).abs() < 0.01, "{good}");
    assert!((deepest(&good, "below_top_m") - 0.09).abs() < 0.01, "{good}");
    assert!(!warnings(&good).join("\n").contains("below the ground"));
    let sunk = check(&folder, "--set snow.ground=0.2");
    assert!((deepest(&sunk, "above_ground_m") + 0.14).abs() < 0.01, "{sunk}");
    let said = warnings(&sunk).join("\n");
    assert!(said.contains("hero.glb") && said.contains("m below the ground at frame"), "{said}");
    // The same over a mesh, at another height.
    fs::write(folder.join("ground.obj"), "v -1 .2 -1\nv 1 .2 -1\nv 1 .2 4\nv -1 .2 4\nf 4 3 2 1\n").unwrap();
    let text = fs::read_to_string(folder.join("walk.toml")).unwrap();
    let text = text.replace("ground = 0.0\narea = [-1, -1, 1, 4]", "ground = \"ground.obj\"");
    fs::write(folder.join("walk.toml"), text).unwrap();
    let mesh = check(&folder, "");
    assert!((deepest(&mesh, "above_ground_m") + 0.14).abs() < 0.01, "{mesh}");
}

#[test]
fn info_prints_how_a_clip_is_to_be_carried_and_many_nodes_as_a_tree() {
    let folder = folder("");
    let info: Value = serde_json::from_str(&works(&folder, "info hero.glb --json")).unwrap();
    let gait = &info[0]["holds"][0]["gaits"]["walk"];
    assert!((gait["stride"].as_f64().unwrap() - 1.1).abs() < 0.03 && gait["steady"] == true, "{gait}");
    let words = works(&folder, "info hero.glb");
    assert!(words.contains("\"walk\": move it by [") && words.contains("or its feet slip"), "{words}");
    // Eight boxes that hang on two empty nodes.
    let node = |n: usize| format!("{{\"name\":\"box{n}\",\"mesh\":0}}");
    let boxes: Vec<String> = (0..8).map(node).collect();
    let gltf = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scene\":0,\"scenes\":[{{\"nodes\":[8]}}],\"nodes\":[{},\
         {{\"name\":\"root\",\"children\":[9]}},{{\"name\":\"shelf\",\"children\":[0,1,2,3,4,5,6,7]}}],\
         \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0}}}}]}}],\
         \"accessors\":[{{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}}],\
         \"bufferViews\":[{{\"buffer\":0,\"byteLength\":36}}],\
         \"buffers\":[{{\"byteLength\":36,\"uri\":\"data:application/octet-stream;base64,\
         AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA\"}}]}}",
        boxes.join(",")
    );
    fs::write(folder.join("shelf.gltf"), gltf).unwrap();
    let words = works(&folder, "info shelf.gltf");
    for line in ["8 with a mesh", " root\n", "   shelf\n", "     box0 (mesh)\n", "     box7 (mesh)\n"] {
        assert!(words.contains(line), "no {line:?} in {words}");
    }
}

#[test]
fn a_clip_is_drawn_at_a_frame() {
    let folder = folder("");
    let draw = |options: &str| {
        works(
            &folder,
            &format!("preview hero.glb {options} -o out.png --size 120x90 --eye 4,1,0.5 --target 0,0.9,0"),
        );
        Picture::open(&folder.join("out.png"))
    };
    let (rest, begin, middle) = (draw(""), draw("--clip walk"), draw("--clip walk --frame 7"));
    assert!(rest != begin && begin != middle && middle != rest);
    assert_eq!(begin, draw("--clip walk --frame 1"), "from its first key");
    assert_eq!(middle, draw("--clip walk --frame 31"), "a round later");
    assert_eq!(middle, draw("--clip walk --frame 13 --fps 48"));
    fails(
        &folder,
        "preview hero.glb --clip run --frame 7 -o out.png",
        2,
        &["hero.glb", "\"run\"", "\"walk\""],
    );
    fails(&folder, "preview hero.glb --frame 7 -o out.png", 2, &["hero.glb", "none is chosen"]);
    fails(&folder, "preview cube.obj --frame 7 -o out.png", 2, &["--frame"]);
}

#[test]
fn mesh_check_looks_at_characters_and_check_counts_holes_as_it_does() {
    let folder = folder("");
    let said = works(&folder, "mesh check hero.glb");
    assert!(said.contains("hero.glb: ") && said.contains("vertices"), "{said}");
    // Without two opposite faces a cube has two holes; they share no vertex.
    let open: Vec<&str> = CUBE.lines().filter(|line| !["f 1 4 3 2", "f 5 6 7 8"].contains(line)).collect();
    fs::write(folder.join("cube.obj"), open.join("\n") + "\n").unwrap();
    let mesh: Value = serde_json::from_str(&works(&folder, "mesh check cube.obj --json")).unwrap();
    assert_eq!(mesh[0]["holes"], 2);
    let scene = check(&folder, "--set object.1.file=cube.obj");
    assert_eq!(scene["objects"][0]["holes"], mesh[0]["holes"], "{scene}");
    assert!(works(&folder, "check walk.toml --set object.1.file=cube.obj").contains("2 holes closed"));
}

#[test]
fn eased_keys_start_at_rest_and_the_resolved_scene_may_be_moved_with_its_files() {
    let folder = folder("");
    let keys = "noise = false\nkeys = [{ frame = 1, at = [0, 0.1, 0] }, { frame = 25, at = [0, 0.1, 2] }]";
    let scene = |ease: &str| {
        format!(
            "[shot]\nframes = \"1-7\"\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 0.5, 1.5]\ndepth = 0.3\ncell = 0.05\n\
             [output]\nobjects = [\"ply\"]\n[[object]]\nfile = \"cube.obj\"\n{ease}{keys}\n"
        )
    };
    let project = folder.join("project");
    fs::create_dir(&project).unwrap();
    fs::write(project.join("cube.obj"), CUBE).unwrap();
    fs::write(project.join("walk.toml"), scene("ease = true\n")).unwrap();
    fs::write(project.join("straight.toml"), scene("")).unwrap();
    works(&project, "snow walk.toml -o out -q");
    works(&project, "snow straight.toml -o straight -q");
    let z = |cache: &str, frame: i32| {
        let mesh =
            frazil::io::mesh::read(&project.join(format!("{cache}/objects/objects.{frame:04}.ply"))).unwrap();
        let (low, high) = mesh.bounds().unwrap();
        f64::from(low.z + high.z) / 2.0
    };
    assert!((z("straight", 7) - 0.5).abs() < 1e-5);
    assert!((z("out", 7) - 2.0 * 0.15625).abs() < 1e-5 && z("out", 2) < 0.02, "{}", z("out", 7));
    // The cache's own scene names the cube from where it lies, and makes the same again after a move.
    let text = fs::read_to_string(project.join("out/scene.toml")).unwrap();
    assert!(text.contains("file = \"../cube.obj\"") && text.contains("ease = true"), "{text}");
    let moved = folder.join("elsewhere");
    fs::rename(&project, &moved).unwrap();
    works(&moved, "snow out/scene.toml -o again -q");
    let base = |cache: &str| fs::read(moved.join(cache).join("objects/objects.0007.ply")).unwrap();
    assert_eq!(base("again"), base("out"));
    // Outside of the scene's folder nothing is relative.
    works(&moved, "snow out/scene.toml -o ../far -q");
    let text = fs::read_to_string(folder.join("far/scene.toml")).unwrap();
    assert!(!text.contains("\"../"), "{text}");
}
