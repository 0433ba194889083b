//! `compare`: a frame of two folders side by side, and the numbers that differ.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::picture::Picture;
use crate::program::{CUBE, Folder, fails, works};

const SIZE: &str = "--size 96x64";
const VIEW: &str = "--size 96x64 --eye 1,1.2,2 --target 0,0.2,0.2";

/// A folder with a shot of three frames in `a`, and of two in `b`, whose snow is deeper.
fn shots() -> Folder {
    let folder = Folder::empty();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    let scene = "[shot]\nframes = \"1-3\"\n[snow]\nground = 0.0\narea = [-0.6, -0.6, 0.6, 1.0]\ndepth = 0.3\n\
                 cell = 0.05\n[[object]]\nfile = \"cube.obj\"\n\
                 keys = [{ frame = 1, at = [0, 0.1, 0] }, { frame = 3, at = [0, 0.1, 0.3] }]\n";
    fs::write(folder.join("shot.toml"), scene).unwrap();
    works(&folder, "snow shot.toml -o a -q");
    works(&folder, "snow shot.toml -o b -q --frames 1-2 --set snow.depth=0.9");
    folder
}

/// The pixels of a picture's columns.
fn columns(picture: &Picture, from: usize, width: usize) -> Vec<[u8; 3]> {
    (0..picture.height).flat_map(|y| (0..width).map(move |x| picture.pixel(from + x, y))).collect()
}

/// The two halves of a comparison, without the line between them.
fn halves(path: &Path) -> [Vec<[u8; 3]>; 2] {
    let both = Picture::open(path);
    assert_eq!((both.width, both.height), (2 * 96 + 2, 64));
    [columns(&both, 0, 96), columns(&both, 98, 96)]
}

fn report(folder: &Path, name: &str) -> Value {
    serde_json::from_slice(&fs::read(folder.join(name)).unwrap()).unwrap()
}

#[test]
fn each_half_is_a_preview_from_the_same_camera() {
    let folder = &shots();
    works(folder, &format!("compare a b --frame 1 -o both.png {VIEW} --threads 1"));
    for (half, of) in halves(&folder.join("both.png")).iter().zip(["a", "b"]) {
        works(folder, &format!("preview {of} --frame 1 -o one.png {VIEW}"));
        assert!(*half == Picture::open(&folder.join("one.png")).pixels, "{of}");
    }
    // Without a camera of the user's: one that sees all of both.
    works(folder, &format!("compare a b --frame 1 -o both.png {SIZE}"));
    works(folder, &format!("compare b a --frame 1 -o swapped.png {SIZE}"));
    works(folder, &format!("preview a b --frame 1 -o all.png {SIZE}"));
    let [[a, b], [b_again, a_again]] = ["both.png", "swapped.png"].map(|name| halves(&folder.join(name)));
    assert!(a == a_again && b == b_again && a != b);
    // The deeper snow hides the other one: drawn together, they look as it does alone, from the same camera.
    let all = Picture::open(&folder.join("all.png")).pixels;
    let off =
        all.iter().zip(&b).filter(|(all, b)| all.iter().zip(*b).any(|(x, y)| x.abs_diff(*y) > 12)).count();
    assert!(off < 96 * 64 / 20, "{off} pixels differ");
    works(folder, &format!("preview a --frame 1 -o alone.png {SIZE}"));
    assert!(Picture::open(&folder.join("alone.png")).pixels != a, "alone it is framed more closely");
}

#[test]
fn the_numbers_that_differ_are_listed() {
    let folder = &shots();
    // Frame 2 is the last that both have.
    let said = works(folder, &format!("compare a b -o both.png {SIZE} --report run.json"));
    let mut lines = said.lines();
    assert_eq!(lines.next(), Some("both.png: frame 2 of a (left) and b (right)"));
    let [a, b] = ["a", "b"].map(|of| report(folder, &format!("{of}/report/base.0002.json")));
    let wanted = format!("base.removed_m3 {} {}", a["removed_m3"], b["removed_m3"]);
    let listed: Vec<&str> = lines.collect();
    assert!(a["removed_m3"] != b["removed_m3"] && listed.contains(&&*wanted), "no {wanted} in {said}");
    let is_time =
        |line: &&str| line.contains("phases") || line.contains("seconds") || line.contains(".check");
    assert!(!listed.iter().any(is_time), "{said}");
    assert!(listed.iter().all(|line| line.split(' ').count() == 3), "{said}");
    let run = report(folder, "run.json");
    assert_eq!((&run["frame"], &run["differences"]["base.removed_m3"][1]), (&2.into(), &b["removed_m3"]));
    let same = works(folder, &format!("compare a a -o same.png {SIZE}"));
    assert_eq!(
        same,
        "same.png: frame 3 of a (left) and a (right)\nthe numbers in their reports are the same\n"
    );
    let [left, right] = halves(&folder.join("same.png"));
    assert!(left == right);
    // A number that only one of them has.
    fs::remove_file(folder.join("b/report/base.0002.json")).unwrap();
    let said = works(folder, &format!("compare b a -o both.png {SIZE}"));
    assert!(said.contains(&format!("base.removed_m3 - {}\n", a["removed_m3"])), "{said}");
}

#[test]
fn what_cannot_be_compared_is_named() {
    let folder = &shots();
    fs::create_dir(folder.join("bare")).unwrap();
    works(folder, "snow shot.toml -o late -q");
    (1..=2)
        .for_each(|frame| fs::remove_file(folder.join(format!("late/state/base.000{frame}.json"))).unwrap());
    let refused: [(&str, &[&str]); 8] = [
        ("a none -o p.png", &["none", "does not exist"]),
        ("shot.toml a -o p.png", &["shot.toml", "not the folder of a shot"]),
        ("a bare -o p.png", &["bare", "not the folder of a shot"]),
        ("a b --frame 3 -o p.png", &["b: ", "frame 3", "1 to 2"]),
        ("b late -o p.png", &["b and late", "no frame in common"]),
        ("a b -o p.exr", &["p.exr", ".png"]),
        ("a b -o none/p.png", &["none"]),
        ("a b -o p.png --eye 1,1,1 --target 1,1,1", &["--eye", "--target"]),
    ];
    for (arguments, words) in refused {
        fails(folder, &format!("compare {arguments}"), 2, words);
    }
    let path = folder.join("b/report/base.0002.json");
    fs::write(&path, fs::read_to_string(&path).unwrap().replace("removed_m3\": ", "removed_m3\": 1"))
        .unwrap();
    fails(folder, "compare a b -o p.png", 2, &["base.0002.json", "not the report that was written"]);
    assert!(!folder.join("p.png").exists());
}
