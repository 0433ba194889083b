//! `frazil shallow`, `new shallow`, `check` and `preview` of a liquid on a terrain, as a user meets them.

use std::fs;
use std::path::Path;

use frazil::geometry::{TriMesh, Vec3};
use frazil::io::mesh;
use serde_json::Value;

use crate::common::character::output;
use crate::picture::Picture;
use crate::program::{CUBE, Folder, fails, frazil, works};

const CLI: &str = include_str!("../../../docs/cli.md");

/// A dish of 8 cm: a sheet that rises towards its edge.
fn write_dish(folder: &Path) {
    let count = 17u32;
    let position = |index: u32| {
        let [x, z] = [index % count, index / count].map(|at| 0.005 * (at as f32 - 8.0));
        Vec3::new(x, 8.0 * (x * x + z * z), z)
    };
    let is_square = |index: &u32| index % count + 1 < count && index / count + 1 < count;
    let square = |a: u32| [[a, a + count, a + count + 1], [a, a + count + 1, a + 1]];
    let triangles = (0..count * count).filter(is_square).flat_map(square).collect();
    let dish = TriMesh { positions: (0..count * count).map(position).collect(), triangles };
    mesh::write(&folder.join("dish.obj"), &dish).unwrap();
}

/// A scene with a dish, of a few frames, and more lines.
fn write_scene(folder: &Path, lines: &str) {
    write_dish(folder);
    let scene = "[shot]\nframes = \"1-3\"\nfps = 60\n[shallow]\nterrain = \"dish.obj\"\ncell = 0.002\n";
    fs::write(folder.join("spill.toml"), format!("{scene}{lines}")).unwrap();
}

const POUR: &str = "[[pour]]\nat = [0, 0.03, 0]\nradius = 0.01\nvolume_ml = 2\n";

fn json(path: &Path) -> Value {
    serde_json::from_slice(&fs::read(path).unwrap()).unwrap()
}

#[test]
fn the_page_of_the_command_line_spills() {
    let folder = &Folder::empty();
    write_dish(folder);
    let section = CLI.split("## Spills\n").nth(1).unwrap().split("\n## ").next().unwrap();
    let block = |kind: &str| {
        let text = section.split(&format!("```{kind}\n")).nth(1).unwrap();
        text.split("```").next().unwrap()
    };
    fs::write(folder.join("spill.toml"), block("toml").replace("cell = 0.001", "cell = 0.002")).unwrap();
    let lines: Vec<&str> = block("sh").lines().filter_map(|line| line.strip_prefix("frazil ")).collect();
    assert_eq!(lines.len(), 5, "{lines:?}");
    for line in lines {
        works(folder, line.split(" #").next().unwrap());
    }
    let report = json(&folder.join("run.json"));
    let ml = |name: &str| report[name].as_f64().unwrap();
    assert!((ml("poured_ml") - 2.0).abs() < 1e-6 && ml("sourced_ml") > 0.5, "{report}");
    let sum = ml("inside_ml") + ml("lost_ml") - ml("poured_ml") - ml("sourced_ml");
    assert!(sum.abs() < 1e-9, "{report}");
    for phase in ["terrain", "flow", "surface"] {
        let of = &report["ms"][phase];
        assert!(of["worst"].as_f64().unwrap() >= of["mean"].as_f64().unwrap(), "{report}");
    }
}

#[test]
fn a_new_scene_runs_as_it_is() {
    let folder = &Folder::empty();
    write_dish(folder);
    let scene =
        works(folder, "new shallow").replace("terrain.obj", "dish.obj").replace("\"1-120\"", "\"1-4\"");
    fs::write(folder.join("new.toml"), scene).unwrap();
    works(folder, "check new.toml");
    works(folder, "shallow new.toml -o new");
    assert!(json(&folder.join("new/report/liquid.0004.json"))["sourced_ml"].as_f64().unwrap() > 0.0);
    // The scene beside the output makes the same again.
    works(folder, "shallow new/scene.toml -o again");
    let file = |out: &str| fs::read(folder.join(out).join("liquid/liquid.0004.usdc")).unwrap();
    assert!(file("new") == file("again"));
}

#[test]
fn a_check_counts_cells_and_millilitres() {
    let folder = &Folder::empty();
    write_scene(
        folder,
        &format!("border = \"closed\"\n{POUR}[[source]]\nat = [0, 0, 0]\nradius = 0\nrate_ml = 3\n"),
    );
    let said = works(folder, "check spill.toml -o out");
    for words in
        ["dish.obj, 512 triangles", "40 x 40 of 0.002 m", "1600 in up to 1 layers", "2.0000 ml", "0.1000 ml"]
    {
        assert!(said.contains(words), "no {words:?} in {said}");
    }
    assert!(!said.contains("warning"), "{said}");
    let report: Value = serde_json::from_str(&works(folder, "check spill.toml --json")).unwrap();
    assert_eq!(
        (report["columns"].as_u64(), &report["settings"]["shallow.viscosity"]),
        (Some(1600), &4e-6.into())
    );
    assert!(report["deepest_m"].as_f64().unwrap() > 0.005, "{report}");
    let odd = |set: &str, words: &[&str]| {
        let said = works(folder, &format!("check spill.toml {set}"));
        words.iter().for_each(|word| assert!(said.contains(word), "no {word:?} in {said}"));
    };
    odd(
        "--set shallow.area=[0,0,0.5,0.5] --set pour.1.at=[0.01,0.1,0.01] --set source.1.at=[0.01,0,0.01]",
        &["no ground"],
    );
    odd("--set shallow.border=open --set shallow.fill=0.02", &["flows off at the border"]);
    odd("--set shallow.top=5000", &["multiples of"]);
    fails(folder, "check spill.toml --preview 2", 2, &["--preview is for snow"]);
    // In millimetres: where that takes too much, one is told what may be meant, too.
    works(folder, "convert dish.obj dish.obj.ply --scale 1000");
    let large = "check spill.toml --set shallow.terrain=dish.obj.ply";
    let output = frazil(folder, large);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(said.contains("0.001 takes millimetres") && said.contains("40000 x 40000 cells"), "{said}");
    let said = works(folder, &format!("{large} --set shallow.scale=0.001"));
    assert!(!said.contains("warning"), "{said}");
    // A level set has no scale that could be set.
    fs::write(folder.join("block.obj"), CUBE).unwrap();
    works(folder, "convert block.obj block.ply --scale 100");
    works(folder, "vdb from-mesh block.ply --cell 5 -o block.vdb");
    for file in ["block.ply", "block.vdb"] {
        let at = "--set pour.1.at=[0,60,0] --set source.1.at=[0,60,0]";
        let set = format!("--set shallow.terrain={file} --set shallow.cell=1 --set shallow.top=1000 {at}");
        let said = works(folder, &format!("check spill.toml {set}"));
        assert_eq!(said.contains("millimetres"), file == "block.ply", "{said}");
    }
}

#[test]
fn what_is_wrong_is_one_sentence_and_leaves_nothing_behind() {
    let folder = &Folder::empty();
    write_scene(folder, POUR);
    let refused = |set: &str, words: &[&str]| {
        fails(folder, &format!("shallow spill.toml -o no {set}"), 2, words);
        assert!(!folder.join("no").exists(), "{set}");
    };
    refused("--set shallow.viscosity=-1", &["`viscosity`", "0 to 1000000 m2/s", "not -1"]);
    refused("--set shallow.liquid=mud", &["`liquid`", "\"honey\"", "not \"mud\""]);
    refused("--set shallow.cell=0", &["`cell`", "not 0"]);
    refused("--set shallow.cell=1e-6", &["shallow.cell = 0.000001 m makes 80000 cells"]);
    refused("--set shot.fps=nan", &["`fps`", "finite number"]);
    refused("--set shot.fps=0", &["`fps`", "not 0"]);
    refused("--set shallow.step=0", &["`step`", "not 0"]);
    refused("--set shallow.step=nan", &["`step`", "finite number"]);
    refused("--set shallow.gravity=[0,9.81,0]", &["`gravity`", "must point down"]);
    refused("--set shallow.gravity=[9,-2,0]", &["`gravity`", "45 degrees"]);
    refused("--set shallow.terrain=none.obj", &["none.obj", "cannot read"]);
    refused("--set shallow.terrain=dish.txt", &["`terrain`", ".png"]);
    refused("--set shallow.area=[1,1,0,0]", &["`area`", "x0 < x1"]);
    refused("--set shallow.area=[1,1,2,2]", &["dish.obj", "no surface that faces up"]);
    refused("--set shallow.top=-1", &["from 0 m up to -1 m"]);
    refused("--set shallow.thinning=true --set shallow.liquid=water", &["`thinning`", "for blood only"]);
    refused("--set shallow.terrain_size=[1,1]", &["`terrain_size`", "for a .png image"]);
    refused("--set shallow.ground=1", &["unknown key `ground`", "the keys are"]);
    refused("--set pour.1.at=[1,0,0]", &["pour.1", "outside of the area"]);
    refused("--set pour.1.volume_ml=1e9", &["pour.1", "do not fit"]);
    refused("--set pour.1.frame=0", &["`frame`", "first frame, 1"]);
    refused("--set pour.1.volume_ml=-1", &["`volume_ml` in [[pour]]", "not -1"]);
    refused("--from 2 --set shallow.cell=1e-9", &["`cell`"]);
    let with = |lines: &str, words: &[&str]| {
        write_scene(folder, lines);
        refused("", words);
    };
    with("[[source]]\nat = [0, 0, 0]\nradius = 0\n", &["spill.toml:7", "`rate_ml` in [[source]] is missing"]);
    with(
        "[[source]]\nat = [0, 0.5, 0]\nradius = 0\nrate_ml = 1\n",
        &["source.1", "only solid, or it lies outside", "the nearest ground is at ("],
    );
    with("[[drain]]\nat = [3, 0, 0]\nradius = 1\nrate_ml = 1\n", &["drain.1"]);
    let drain = "[[drain]]\nat = [0, 0, 0]\nradius = 0\nrate_ml = 1\n";
    with(&format!("{drain}from = 3\nuntil = 2\n"), &["spill.toml:12", "`until`", "`from`, 3"]);
    with("[[absorber]]\nat = [0, 0, 0]\nradius = 0\nrate_ml = 1\n", &["`capacity_ml`", "is missing"]);
    for (table, more) in [("source", ""), ("drain", ""), ("absorber", "capacity_ml = 1\n")] {
        let point = format!("[[{table}]]\nat = [0, 0, 0]\nradius = 0\nrate_ml = 1\n{more}follows = true\n");
        with(&point, &["spill.toml:1", "`follows`", "the terrain does not move", "a sequence of meshes"]);
    }
    write_scene(folder, drain);
    refused("--set drain.1.follows=true", &["`follows`", "the terrain does not move"]);
    refused("--set drain.1.follows=1", &["`follows`", "true or false"]);
    let dye = "[[scalar]]\nname = \"dye\"\n";
    let pour = |carries: &str| format!("{dye}{POUR}carries = {carries}\n");
    with(&pour("{ dey = 1.0 }"), &["`carries` in [[pour]]", "`dey`, which is the name of no [[scalar]]"]);
    with(&pour("{ dye = 1.5 }"), &["`carries`", "dye = 1.5, which is not within -1 to 1"]);
    with(&pour("{ dye = nan }"), &["`carries`", "finite numbers", "`dye`"]);
    with(&pour("[1.0]"), &["`carries`", "a table of numbers, not a list"]);
    with("[[scalar]]\nlaw = \"dye\"\n", &["spill.toml:7", "`name` in [[scalar]] is missing"]);
    for (name, words) in [
        ("", "letters, digits and _"),
        ("a b", "letters"),
        ("1", "begin with no digit"),
        ("alpha", "an array of that name"),
    ] {
        with(&format!("[[scalar]]\nname = \"{name}\"\n"), &["`name` in [[scalar]]", words]);
    }
    with(&dye.repeat(2), &["spill.toml:10", "another scalar has that name"]);
    let five: String = (0..5).map(|at| format!("[[scalar]]\nname = \"dye{at}\"\n")).collect();
    with(&five, &["`name`", "one too many", "4 scalars at most"]);
    with(&format!("{dye}law = \"decays\"\n"), &["`half_life`", "is missing"]);
    with(&format!("{dye}half_life = 3\n"), &["`half_life`", "leave it out"]);
    with(&format!("{dye}range = 0\n"), &["`range`", "not 0"]);
    with(&format!("{dye}start = 2\n"), &["`start`", "-1 to 1, its range"]);
    with(&format!("{dye}stains = true\n"), &["`stains` in [[scalar]]", "where shallow.stains is"]);
    write_scene(folder, &format!("{POUR}{dye}stains = true\n[[scalar]]\nname = \"age\"\nstains = true\n"));
    refused("--set shallow.stains=true", &["`stains` in [[scalar]]", "another scalar stains"]);
    refused("--set shallow.stain_half_life=0", &["`stain_half_life`", "0.001 to"]);
    let thick = format!("{dye}thickens_times = 9\n");
    with(&thick, &["`thickens_to` in [[scalar]]", "is missing"]);
    with(&format!("{thick}thickens_to = 0\n"), &["`thickens_to`", "must not be `thickens_from`, 0"]);
    with(&format!("{thick}thickens_to = 2\n"), &["`thickens_to`", "-1 to 1, its range"]);
    with(&format!("{thick}thickens_to = 1\nthickens_from = -3\n"), &["`thickens_from`", "-1 to 1"]);
    with(&format!("{dye}thickens_to = 1\n"), &["`thickens_to`", "with `thickens_times`: leave it out"]);
    with(&format!("{dye}thickens_times = 0\n"), &["`thickens_times`", "not 0"]);
    let second = "[[scalar]]\nname = \"age\"\nthickens_times = 2\nthickens_to = 1\n";
    with(&format!("{thick}thickens_to = 1\n{second}"), &["`thickens_times`", "another scalar thickens"]);
    write_scene(folder, &format!("{POUR}{thick}thickens_to = 1\n"));
    refused("--set shallow.viscosity=0", &["`thickens_times`", "shallow.viscosity is 0"]);
    with(
        "[[source]]\nat = [0, 0, 0]\nradius = 0\nrate_ml = 1\ncarries = { dye = 1 }\n",
        &["`carries` in [[source]]", "`dye`"],
    );
    write_scene(folder, POUR);
    refused("--set shallow.falls=2", &["`falls`", "true or false"]);
    refused("--set shallow.falls_most=0", &["`falls_most`", "1 to 1048576, not 0"]);
    refused("--set shallow.falls_height=-1", &["`falls_height`", "not -1"]);
    refused("--set shallow.falls_interval=2", &["`falls_interval`", "0.0001 to 1 s"]);
    refused("--set shallow.falls_drop_ml=nan", &["`falls_drop_ml`", "finite"]);
    refused("--set shallow.friction=floor", &["`friction`", "ground", "walls"]);
    refused("--set shallow.rest=0.1", &["`rest`", "0 to 0.01 m/s"]);
    refused("--set shallow.rest=nan", &["`rest`", "finite"]);
    refused("--set shallow.lifts=1", &["`lifts`", "true or false"]);
    with("[[object]]\nradius = 1\n", &["`shape`", "is missing (or `file`"]);
    with("[[object]]\nshape = \"sphere\"\n", &["`radius`", "is missing"]);
    with("[[object]]\nshape = \"box\"\nsize = [1, 1, 0]\n", &["`size`", "over 0 m"]);
    with("[[object]]\nshape = \"box\"\nsize = [1, 1, 1]\nradius = 2\n", &["`radius`", "not for a box"]);
    with(
        "[[object]]\nshape = \"sphere\"\nradius = 1\nfile = \"dish.obj\"\n",
        &["`file`", "excludes `shape`"],
    );
    let moving = "[[object]]\nfile = \"dish.obj\"\nkeys = [{ frame = 1 }, { frame = 2 }]\n";
    with(moving, &["`keys`", "a mesh does not move"]);
    // Scenes of one system are not for the command of another.
    fs::write(folder.join("spot.toml"), "[shot]\nframes = \"1\"\n[surface]\nparticles = \"a.%04d.bgeo\"\n")
        .unwrap();
    fails(folder, "shallow spot.toml -o no", 2, &["spot.toml", "`shallow` is missing"]);
    fs::write(
        folder.join("two.toml"),
        "[shot]\nframes = \"1\"\n[surface]\nparticles = \"a.ply\"\n[shallow]\n",
    )
    .unwrap();
    fails(folder, "shallow two.toml -o no", 2, &["two.toml:5", "one system"]);
}

#[test]
fn terrains_that_face_down_or_are_nothing_are_told() {
    let folder = &Folder::empty();
    write_scene(folder, POUR);
    works(folder, "shallow spill.toml -o up");
    let dish = mesh::read(&folder.join("dish.obj")).unwrap();
    mesh::write(&folder.join("dish.obj"), &dish.clone().reversed()).unwrap();
    let said = works(folder, "shallow spill.toml -o down");
    assert!(said.contains("its triangles face down: they are turned round"), "{said}");
    let file = |out: &str| fs::read(folder.join(out).join("liquid/liquid.0003.usdc")).unwrap();
    assert!(file("up") == file("down"));
    // A wall has no surface that faces up.
    fs::write(folder.join("dish.obj"), "v 0 0 0\nv 0 1 0\nv 0 1 1\nf 1 2 3\n").unwrap();
    fails(folder, "shallow spill.toml -o no", 2, &["dish.obj", "no surface that faces up"]);
    fs::write(folder.join("dish.obj"), "v 0 0 0\nv 0 nan 0\nv 0 1 1\nf 1 2 3\n").unwrap();
    fails(folder, "shallow spill.toml -o no", 2, &["dish.obj"]);
}

#[test]
fn an_image_of_heights_is_a_terrain_with_its_size() {
    let folder = &Folder::empty();
    write_scene(folder, POUR);
    // A slope, drawn by the program itself.
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 16, 16);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Eight);
    let greys: Vec<u8> = (0..256).map(|index| (index % 16 * 17) as u8).collect();
    encoder.write_header().unwrap().write_image_data(&greys).unwrap();
    fs::write(folder.join("slope.png"), bytes).unwrap();
    let image = "--set shallow.terrain=slope.png";
    fails(folder, &format!("shallow spill.toml -o no {image}"), 2, &["`terrain_size`", "is missing"]);
    let size =
        format!("{image} --set shallow.terrain_size=[0.08,0.08] --set shallow.terrain_height=[0,0.03]");
    let said = works(folder, &format!("check spill.toml {size}"));
    assert!(said.contains("40 x 40 of 0.002 m") && said.contains("0.0800 x 0.0300 x 0.0800 m"), "{said}");
    works(folder, &format!("shallow spill.toml -o slope {size}"));
    // It flows towards black.
    let liquid = mesh::read(&folder.join("slope/liquid/liquid.0003.usdc")).unwrap();
    let middle =
        |mesh: &TriMesh| mesh.positions.iter().map(|p| p.x).sum::<f32>() / mesh.positions.len() as f32;
    let before = mesh::read(&folder.join("slope/liquid/liquid.0001.usdc")).unwrap();
    assert!(middle(&liquid) < middle(&before) - 0.0005, "{} from {}", middle(&liquid), middle(&before));
    works(folder, "preview slope -o slope.png --size 32x24");
}

#[test]
fn a_picture_shows_the_ground_through_thin_liquid() {
    let folder = &Folder::empty();
    write_scene(folder, POUR);
    works(folder, "shallow spill.toml -o thin --set shallow.opaque_depth=0.5");
    works(folder, "shallow spill.toml -o thick --set shallow.opaque_depth=0.0001");
    works(folder, "shallow spill.toml -o honey --set shallow.opaque_depth=0.0001 --set shallow.liquid=honey");
    let middle = |out: &str, more: &str| {
        let view = "--size 64x48 --eye 0,0.2,0.001 --target 0,0,0 --fov 25";
        works(folder, &format!("preview {out} -o {out}.png {view} {more}"));
        Picture::open(&folder.join(format!("{out}.png"))).pixel(32, 24).map(i32::from)
    };
    let ground = {
        works(
            folder,
            "preview dish.obj -o ground.png --size 64x48 --eye 0,0.2,0.001 --target 0,0,0 --fov 25",
        );
        Picture::open(&folder.join("ground.png")).pixel(32, 24).map(i32::from)
    };
    let [thin, thick, honey] = ["thin", "thick", "honey"].map(|out| middle(out, ""));
    // Blood is red, honey golden, and pale stone is neither, even with a little blood on it.
    assert!(thick[0] > 3 * thick[1], "{thick:?}");
    assert!(honey[0] > honey[1] && honey[1] > 2 * honey[2], "{honey:?}");
    assert!(thin[0] < 2 * thin[1] && thin[1] > 2 * thick[1], "{thin:?}, {thick:?} opaque, {ground:?} brown");
    // Numbers give colours in place of these.
    let deep = middle("thick", "--color depth");
    assert!(deep != thick, "{deep:?}");
    fails(folder, "preview thick -o no.png --color heat", 2, &["--color heat"]);
    fails(folder, "preview thick --frame 9 -o no.png", 2, &["frame 9 does not exist", "1 to 3, of liquid"]);
    works(folder, "preview thick --frames 1-3 -o thick.gif --size 32x24");
    works(folder, "preview thick --cut z=0 -o cut.png --size 32x24");
    // Without its terrain the liquid is drawn alone, and a warning says so.
    fs::remove_file(folder.join("dish.obj")).unwrap();
    let said = works(folder, "preview thick -o alone.png --size 32x24");
    assert!(said.contains("dish.obj") && said.contains("drawn without its terrain"), "{said}");
}

#[test]
fn frames_without_liquid_are_drawn_too() {
    let folder = &Folder::empty();
    write_scene(folder, "[[source]]\nat = [0, 0, 0]\nradius = 0.004\nrate_ml = 5\nfrom = 3\n");
    works(folder, "shallow spill.toml -o out");
    let reports = [1, 2, 3].map(|frame| json(&folder.join(format!("out/report/liquid.000{frame}.json"))));
    assert_eq!(reports.each_ref().map(|report| report["vertices"] == 0), [true, true, false]);
    works(folder, "preview out --frames 1-3 -o p.%04d.png --size 32x24");
    works(folder, "check out");
}

#[test]
fn a_folder_holds_the_shot_of_one_system() {
    let folder = &Folder::empty();
    write_scene(folder, POUR);
    works(folder, "shallow spill.toml -o out -q --frames 1-2");
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    let snow = "[shot]\nframes = \"1-2\"\n[snow]\nground = 0.0\narea = [-1, -1, 1, 1]\ndepth = 0.3\ncell = 0.1\n\
                [[object]]\nfile = \"cube.obj\"\n";
    fs::write(folder.join("walk.toml"), snow).unwrap();
    let before = output(&folder.join("out"));
    let words = ["out: holds a shot of [shallow]", "one of [snow]", "another -o"];
    fails(folder, "snow walk.toml -o out", 2, &words);
    assert!(before == output(&folder.join("out")));
    fails(folder, "shallow walk.toml -o other", 2, &["walk.toml", "[snow]", "frazil snow"]);
}
