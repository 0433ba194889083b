//! Pictures: what is there shows, where the camera looks, and the depth of a print reads.

use assert_cmd::Command;
use std::fs;
use std::path::Path;

use crate::picture::Picture;
use crate::program::{CUBE, Folder};

#[track_caller]
fn frazil(folder: &Path, arguments: &str) {
    let mut command = Command::cargo_bin("frazil").unwrap();
    let output = command.current_dir(folder).args(arguments.split_whitespace()).output().unwrap();
    assert!(output.status.success(), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
}

fn picture(folder: &Path, files: &str, options: &str) -> Picture {
    frazil(folder, &format!("preview {files} -o out.png --size 160x90 {options}"));
    Picture::open(&folder.join("out.png"))
}

/// Mean brightness (0 to 255) of the pixels around a position (parts of width and height).
fn brightness(picture: &Picture, x: f32, y: f32) -> f32 {
    let (cx, cy) = ((x * picture.width as f32) as usize, (y * picture.height as f32) as usize);
    let near = (cx - 3..cx + 3).flat_map(|x| (cy - 3..cy + 3).map(move |y| (x, y)));
    near.map(|(x, y)| picture.pixel(x, y).map(f32::from).iter().sum::<f32>() / 3.0).sum::<f32>() / 36.0
}

/// A folder with snow that a cube was pressed into, 0.2 m deep.
fn pressed() -> Folder {
    let folder = Folder::empty();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    let scene = "[shot]\nframes = \"1\"\n[snow]\nground = 0.0\narea = [-0.8, -0.8, 0.8, 0.8]\ndepth = 0.3\ncell = 0.02\n\
                 [[object]]\nfile = \"cube.obj\"\nnoise = false\nkeys = [{ frame = 1, at = [0, 0.1, 0] }]\n";
    fs::write(folder.join("shot.toml"), scene).unwrap();
    frazil(&folder, "snow shot.toml -o cache -q");
    folder
}

const ABOVE: &str = "--eye 0,3,0.01 --target 0,0,0 --fov 34 --sun 90,30";

#[test]
fn the_floor_of_a_print_is_in_the_shade_of_its_wall() {
    let folder = pressed();
    let picture = picture(&folder, "cache/base/base.0001.vdb", ABOVE);
    // The layer spans 0.25 to 0.75 of the width, the print 0.44 to 0.56; the sun stands at +x.
    let [left, lee, right] = [0.32, 0.53, 0.68].map(|x| brightness(&picture, x, 0.5));
    assert!(lee < 0.75 * left, "shade {lee}, top {left}");
    assert!((left - right).abs() < 3.0, "the level top is not even: {left} and {right}");
}

#[test]
fn the_automatic_camera_shows_the_whole_and_a_given_one_what_it_looks_at() {
    let folder = pressed();
    let whole = picture(&folder, "cache/base/base.0001.vdb cube.obj", "");
    let background = brightness(&whole, 0.04, 0.5);
    for (x, y) in [(0.04, 0.1), (0.96, 0.1), (0.04, 0.9), (0.96, 0.9)] {
        assert!((brightness(&whole, x, y) - background).abs() < 25.0, "the layer touches the corner {x} {y}");
    }
    assert!((brightness(&whole, 0.5, 0.5) - background).abs() > 25.0, "nothing in the middle");
    let away = picture(&folder, "cube.obj", "--eye 0,1,3 --target 0,5,9");
    let is_brown =
        |picture: &Picture| picture.pixels.iter().filter(|p| p[0] > p[2].saturating_add(10)).count();
    assert_eq!(is_brown(&away), 0, "a camera that looks away sees the cube");
    let towards = picture(&folder, "cube.obj", "--eye 0,1,3 --target 0,0.2,0");
    assert!(is_brown(&towards) > 100, "one that looks at it does not");
}

#[test]
fn a_mesh_hides_what_is_behind_it() {
    let folder = pressed();
    let snow = picture(&folder, "cache/base/base.0001.vdb", ABOVE);
    let both = picture(&folder, "cache/base/base.0001.vdb cube.obj", ABOVE);
    assert_eq!(snow.pixel(110, 45), both.pixel(110, 45), "the cube changes the snow towards the sun");
    // Brown over bluish shade.
    let [[r, _, b], [red, _, blue]] = [&snow, &both].map(|picture| picture.pixel(80, 45));
    assert!(r < b && red > blue + 30, "the cube is not seen: {r} {b}, {red} {blue}");
}

#[test]
fn the_same_picture_from_any_number_of_threads() {
    let folder = pressed();
    let one = picture(&folder, "cache/base/base.0001.vdb", "--threads 1");
    assert!(one == picture(&folder, "cache/base/base.0001.vdb", "--threads 3"));
}
