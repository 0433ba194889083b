//! What cannot be right is refused or reported: thin layers, far offsets, far meshes, fog.

use crate::common::shapes;
use crate::picture::Picture;
use crate::program::{CUBE, Folder, fails, works};
use frazil::numeric::blocks::{Block, BlockEdit};
use frazil::vdb::file::{self, WriteOptions};
use frazil::vdb::level_set::{self, Scheme};
use frazil::vdb::{FloatGrid, GridClass};
use frazil::{Context, Pool};
use std::fs;

fn folder(snow: &str) -> Folder {
    let folder = Folder::empty();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    let scene = format!("[shot]\nframes = \"1\"\n[snow]\n{snow}\n[[object]]\nfile = \"cube.obj\"\n");
    fs::write(folder.join("shot.toml"), scene).unwrap();
    folder
}

#[test]
fn a_layer_that_cells_cannot_hold_is_refused_and_a_rough_one_is_reported() {
    let folder = folder("ground = 0.0\narea = [-1, -1, 1, 1]\ndepth = 0.3\ncell = 0.05");
    assert!(!works(&folder, "check shot.toml").contains("cells thick"));
    for command in ["check shot.toml", "snow shot.toml -o out"] {
        let set = |what: &str| format!("{command} --set {what}");
        fails(&folder, &set("snow.cell=10"), 2, &["shot.toml", "depth = 0.3 m", "cell of 10 m"]);
        fails(&folder, &set("snow.depth=0.04"), 2, &["depth = 0.04 m", "less than a cell"]);
        fails(&folder, &set("snow.area=[-1,0,1,0.02]"), 2, &["extent in z", "less than a cell"]);
        assert!(works(&folder, &set("snow.depth=0.1")).contains("thick"), "two cells are reported");
    }
    assert!(!folder.join("out/base/base.0002.vdb").exists());
}

#[test]
fn an_offset_beyond_the_band_is_right_or_refused() {
    let ctx = Context::new(Pool::new(2).unwrap());
    let (radius, cell) = (0.5, 0.02);
    let make = || level_set::from_mesh(&ctx, &shapes::sphere(radius, 48), cell, 3.0).unwrap();
    let measured = |grid: &FloatGrid| {
        let volume = level_set::to_mesh(&ctx, grid, 0.0, 0.0).unwrap().volume();
        (volume * 0.75 / std::f64::consts::PI).cbrt()
    };
    for by in [-0.3f32, 0.2] {
        let mut grid = make();
        let wanted = measured(&grid) + f64::from(by);
        let refused = level_set::offset(&ctx, &mut make(), by, Scheme::FirstOrder).unwrap_err().to_string();
        assert!(refused.contains("band") && refused.contains("weno5"), "{refused}");
        level_set::offset(&ctx, &mut grid, by, Scheme::Weno5).unwrap();
        assert!((measured(&grid) - wanted).abs() < 0.15 * cell, "{by}: {} for {wanted}", measured(&grid));
    }
    level_set::offset(&ctx, &mut make(), 0.06, Scheme::FirstOrder).unwrap();
    let folder = folder("");
    let path = folder.join("ball.vdb");
    file::write(&path, &[&make()], &WriteOptions::default()).unwrap();
    fails(
        &folder,
        "vdb offset ball.vdb --by -0.3 --scheme first-order -o out.vdb",
        2,
        &["--scheme", "weno5"],
    );
    works(&folder, "vdb offset ball.vdb --by -0.3 -o out.vdb");
    let found = measured(&file::read_named(&folder.join("out.vdb"), None).unwrap());
    assert!((found - (measured(&make()) - 0.3)).abs() < 0.15 * cell, "{found}");
}

#[test]
fn a_mesh_far_from_the_origin_is_named_with_what_to_do() {
    let folder = folder("ground = 0.0\narea = [59999, -1, 60001, 1]\ndepth = 0.3\ncell = 0.05");
    let far: String = CUBE
        .lines()
        .map(|line| match line.strip_prefix("v ") {
            Some(rest) => {
                let mut numbers = rest.split(' ').map(|n| n.parse::<f64>().unwrap());
                let (x, y, z) = (numbers.next().unwrap(), numbers.next().unwrap(), numbers.next().unwrap());
                format!("v {} {y} {z}\n", x + 60_000.0)
            }
            None => format!("{line}\n"),
        })
        .collect();
    fs::write(folder.join("far.obj"), far).unwrap();
    for command in
        ["check shot.toml --set object.1.file=far.obj", "vdb from-mesh far.obj --cell 0.01 -o out.vdb"]
    {
        let said = works(&folder, command);
        for word in ["far.obj", "60000 m from the origin", "3.9 mm", "64 bits"] {
            assert!(said.contains(word), "{command}: no {word:?} in {said}");
        }
    }
    let near = "check shot.toml --set object.1.keys=[{frame=1,at=[60000,0.1,0]}]";
    assert!(!works(&folder, near).contains("origin"), "keys are 64-bit");
}

#[test]
fn a_fog_volume_is_drawn_as_fog() {
    let folder = folder("");
    let ctx = Context::new(Pool::new(1).unwrap());
    let mut fog = FloatGrid::new(0.05, 0.0).unwrap();
    let density = |index: usize| {
        let off = [index >> 6, index >> 3 & 7, index & 7].map(|i| (i as f32 - 3.5) / 3.5);
        (1.0 - off.iter().map(|v| v * v).sum::<f32>()).max(0.0)
    };
    let block = |factor: f32| {
        let values = Box::new(std::array::from_fn(|index| factor * density(index)));
        BlockEdit::Dense(Block { origin: [0; 3], values, mask: [u64::MAX; 8] })
    };
    fog.replace_blocks(&ctx, &[block(1.0)]).unwrap();
    fog.set_class(GridClass::Fog).unwrap();
    fog.set_name("density").unwrap();
    let path = folder.join("cloud.vdb");
    file::write(&path, &[&fog], &WriteOptions::default()).unwrap();
    let draw = |options: &str| {
        works(&folder, &format!("preview cloud.vdb -o out.png --size 90x60 {options}"));
        Picture::open(&folder.join("out.png"))
    };
    let [thin, thick] = ["--fog-density 0.1", "--fog-density 40"].map(draw);
    let changed = |picture: &Picture| {
        let (seen, sky) = (picture.pixel(45, 30), picture.pixel(2, 30));
        (0..3).map(|channel| i32::from(seen[channel].abs_diff(sky[channel]))).sum::<i32>()
    };
    assert!(
        (1..20).contains(&changed(&thin)) && changed(&thick) > 60,
        "{} {}",
        changed(&thin),
        changed(&thick)
    );
    fog.replace_blocks(&ctx, &[block(0.0)]).unwrap();
    file::write(&path, &[&fog], &WriteOptions::default()).unwrap();
    fails(&folder, "preview cloud.vdb -o out.png", 2, &["cloud.vdb", "\"density\"", "no density"]);
}

#[test]
fn the_disk_space_is_reported_for_a_layer_from_a_file() {
    // So large that the layer takes most of the disk.
    let folder = folder("ground = 0.0\narea = [-3, -3, 3, 3]\ndepth = 0.3\ncell = 0.02");
    works(&folder, "snow shot.toml -o out -q");
    let scene = "[shot]\nframes = \"1-10\"\n[snow]\ntop = \"out/base/base.0001.vdb\"\ncell = 0.02\n[[object]]\nfile = \"cube.obj\"\n";
    fs::write(folder.join("next.toml"), scene).unwrap();
    let disk = |scene: &str| {
        let said = works(&folder, &format!("check {scene} --set shot.frames=1-10 --json"));
        serde_json::Deserializer::from_str(&said).into_iter::<serde_json::Value>().next().unwrap().unwrap()["disk_bytes"]
            .as_f64()
            .unwrap()
    };
    let (made, given) = (disk("shot.toml"), disk("next.toml"));
    assert!((0.5..2.0).contains(&(given / made)), "{given} and {made} bytes");
}
