//! Whole shots in pictures: one frame of one, a picture of each, or a GIF that plays.

use std::fs;
use std::fs::File;
use std::path::Path;
use std::time::{Duration, Instant};

use frazil::io::records::manifest::{Keeps, Manifest, Written};
use frazil::numeric::blocks::{Block, BlockEdit};
use frazil::vdb::file::{WriteOptions, to_bytes};
use frazil::vdb::{FloatGrid, GridClass};
use frazil::{Context, Pool};

use crate::picture::Picture;
use crate::program::{CUBE, Folder, GRAINS, answer_to_sigterm, command, fails, works};

const SIZE: &str = "--size 96x64";

/// A folder with a shot of four frames, 12 a second, in `shot`: a cube is pushed through snow. The same as changes is in
/// `delta`.
fn shots() -> Folder {
    let folder = Folder::empty();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    let scene = "[shot]\nframes = \"1-4\"\nfps = 12\n[snow]\nground = 0.0\narea = [-0.6, -0.6, 0.6, 1.0]\ndepth = 0.3\n\
                 cell = 0.04\n[grains]\n[output]\ngrains = [\"vdb\"]\nobjects = [\"ply\"]\n[[object]]\nfile = \"cube.obj\"\n\
                 keys = [{ frame = 1, at = [0, 0.1, 0] }, { frame = 4, at = [0, 0.1, 0.3] }]\n";
    fs::write(folder.join("shot.toml"), scene).unwrap();
    works(&folder, "snow shot.toml -o shot -q");
    works(&folder, "snow shot.toml -o delta -q --set output.base_mode=delta --set output.grains_mode=delta");
    folder
}

fn read(folder: &Path, name: &str) -> Vec<u8> {
    fs::read(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The frames of a GIF as they are seen, each with how long (1/100 s).
fn frames(path: &Path) -> Vec<(Vec<[u8; 3]>, u16)> {
    let mut options = gif::DecodeOptions::new();
    options.set_color_output(gif::ColorOutput::RGBA);
    let mut decoder = options.read_info(File::open(path).unwrap()).unwrap();
    assert_eq!(decoder.repeat(), gif::Repeat::Infinite);
    let width = usize::from(decoder.width());
    let mut canvas = vec![[0u8; 3]; width * usize::from(decoder.height())];
    let mut out = Vec::new();
    while let Some(frame) = decoder.read_next_frame().unwrap() {
        let (left, top) = (usize::from(frame.left), usize::from(frame.top));
        for (n, pixel) in frame.buffer.chunks_exact(4).enumerate().filter(|(_, pixel)| pixel[3] > 0) {
            let (x, y) = (n % usize::from(frame.width), n / usize::from(frame.width));
            canvas[(top + y) * width + left + x].copy_from_slice(&pixel[..3]);
        }
        out.push((canvas.clone(), frame.delay));
    }
    out
}

#[test]
fn each_frame_of_a_shot_is_what_its_files_show() {
    let folder = &shots();
    let camera = "--eye 1,1.2,2 --target 0,0.2,0.2";
    works(folder, &format!("preview shot --frames 1-4x3 -o p.%04d.png {SIZE} {camera} -q"));
    works(folder, &format!("preview delta --frames 2-4 -o d.%04d.png {SIZE} {camera} -q --threads 1"));
    for frame in [1, 4] {
        let files = ["base/base.000N.vdb", "grains/grains.000N.vdb", "objects/objects.000N.ply"];
        let files = files.map(|file| format!("shot/{}", file.replace('N', &frame.to_string()))).join(" ");
        works(folder, &format!("preview {files} -o files.png {SIZE} {camera}"));
        assert!(read(folder, &format!("p.000{frame}.png")) == read(folder, "files.png"), "frame {frame}");
    }
    assert!(read(folder, "p.0001.png") != read(folder, "p.0004.png"));
    assert!(read(folder, "d.0004.png") == read(folder, "p.0004.png"), "from changes");
    assert!(!folder.join("p.0002.png").exists() && !folder.join("d.0001.png").exists());
    // Alone, the last frame; of a sequence, the frame that is chosen.
    works(folder, &format!("preview delta -o last.png {SIZE} {camera}"));
    assert!(read(folder, "last.png") == read(folder, "p.0004.png"));
    let sequences = "shot/base/base.%04d.vdb shot/grains/grains.%04d.vdb shot/objects/objects.%04d.ply";
    works(folder, &format!("preview {sequences} --frame 4 -o chosen.png {SIZE} {camera}"));
    assert!(read(folder, "chosen.png") == read(folder, "p.0004.png"));
}

#[test]
fn the_camera_of_a_flipbook_stands_still() {
    let folder = shots();
    works(&folder, &format!("preview shot -o p.%02d.png {SIZE} -q"));
    let [first, last] = ["p.01.png", "p.04.png"].map(|name| Picture::open(&folder.join(name)));
    let changed = first.pixels.iter().zip(&last.pixels).filter(|(a, b)| a != b).count();
    // What the cube moves through, and no edge of the snow.
    assert!((50..96 * 64 / 2).contains(&changed), "{changed}");
    for x in [2, 47, 93] {
        assert_eq!((first.pixel(x, 1), first.pixel(x, 62)), (last.pixel(x, 1), last.pixel(x, 62)));
    }
}

#[test]
fn a_gif_plays_the_pictures_at_the_speed_of_the_shot() {
    let folder = &shots();
    works(folder, &format!("preview shot -o p.%04d.png {SIZE} -q --threads 1"));
    works(folder, &format!("preview shot -o shot.gif {SIZE} -q --threads 1"));
    works(folder, &format!("preview shot --frames 1-4 -o again.gif {SIZE} -q --threads 3"));
    works(folder, &format!("preview shot --frames 1-4 -o again.%04d.png {SIZE} -q --threads 3"));
    assert!(read(folder, "shot.gif") == read(folder, "again.gif"));
    let frames = frames(&folder.join("shot.gif"));
    assert_eq!(frames.iter().map(|(_, delay)| *delay).collect::<Vec<_>>(), [8, 9, 8, 8]);
    for ((pixels, _), frame) in frames.iter().zip(1..) {
        assert!(read(folder, &format!("p.000{frame}.png")) == read(folder, &format!("again.000{frame}.png")));
        let picture = Picture::open(&folder.join(format!("p.000{frame}.png")));
        let off = pixels.as_flattened().iter().zip(picture.pixels.as_flattened());
        let off: Vec<u32> = off.map(|(a, b)| u32::from(a.abs_diff(*b))).collect();
        let mean = f64::from(off.iter().sum::<u32>()) / off.len() as f64;
        let worst = off.iter().max().unwrap();
        assert!(mean < 3.0 && *worst < 40, "frame {frame}: mean {mean}, worst {worst}");
    }
    works(folder, &format!("preview shot --frames 2,4 -o few.gif {SIZE} -q --fps 25"));
    assert_eq!(
        self::frames(&folder.join("few.gif")).iter().map(|(_, delay)| *delay).collect::<Vec<_>>(),
        [8, 8]
    );
}

/// Puts mist over the snow into the folder of a shot, as its stage would, in so many blocks.
fn add_mist(folder: &Path, frame: i32, blocks: usize) {
    let mut grid = FloatGrid::new(0.05, 0.0).unwrap();
    let block = |x, z| {
        let values = Box::new([2.0; 512]);
        BlockEdit::Dense(Block { origin: [x, 8, z], values, mask: [u64::MAX; 8] })
    };
    let ctx = Context::new(Pool::new(1).unwrap());
    grid.replace_blocks(&ctx, &[block(-8, 0), block(0, 0)][..blocks]).unwrap();
    grid.set_class(GridClass::Fog).unwrap();
    grid.set_name("density").unwrap();
    let bytes = to_bytes(&[&grid], &WriteOptions::default()).unwrap();
    let path = format!("mist/mist.{frame:04}.vdb");
    fs::create_dir_all(folder.join("mist")).unwrap();
    fs::write(folder.join(&path), &bytes).unwrap();
    let files = vec![Written::new(path, &bytes)];
    let manifest =
        Manifest { frame, inputs: String::new(), keeps: Keeps::Whole, files, state: None, next: None };
    manifest.write(folder, "mist").unwrap();
}

#[test]
fn objects_without_files_are_drawn_in_their_poses_and_the_camera_follows_what_moves() {
    let folder = Folder::empty();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    // A cube of 0.4 m in the corner of a field of 6 m.
    let scene = "[shot]\nframes = \"1-4\"\n[snow]\nground = 0.0\narea = [-0.6, -0.6, 5.4, 5.4]\ndepth = 0.3\ncell = 0.04\n\
                 [output]\nmesh = []\n[[object]]\nfile = \"cube.obj\"\n\
                 keys = [{ frame = 1, at = [0, 0.1, 0] }, { frame = 4, at = [0, 0.1, 0.3] }]\n";
    fs::write(folder.join("shot.toml"), scene).unwrap();
    for (out, objects) in [("usd", "[\"usd\"]"), ("ply", "[\"ply\"]"), ("none", "[]")] {
        works(&folder, &format!("snow shot.toml -o {out} -q --set output.objects={objects}"));
    }
    let draw = |what: &str| {
        works(&folder, &format!("preview {what} -o p.png {SIZE}"));
        read(&folder, "p.png")
    };
    let camera = "--frame 3 --eye 1,1.2,2 --target 0,0.2,0.2";
    let posed = draw(&format!("none {camera}"));
    assert!(posed == draw(&format!("ply {camera}")) && posed == draw(&format!("usd {camera}")));
    // With automatic cameras; that of single files sees everything.
    let whole = "ply/base/base.0004.vdb ply/objects/objects.0004.ply";
    let [whole, ply, usd, none] = [whole, "ply", "usd", "none"].map(|what| {
        draw(what);
        share_of_brown(&folder.join("p.png"))
    });
    assert!(
        [ply, usd, none].iter().all(|share| *share > 5.0 * whole && *share > 0.02),
        "{whole} {ply} {usd} {none}"
    );
    // Without the object's file the snow is drawn alone.
    fs::remove_file(folder.join("cube.obj")).unwrap();
    assert!(draw(&format!("none {camera}")) != posed);
    assert!(draw(&format!("usd {camera}")) == posed);
}

/// The share of a picture's pixels that have the colour of objects.
fn share_of_brown(path: &Path) -> f64 {
    let pixels = Picture::open(path).pixels;
    let is_brown = |[red, _, blue]: &&[u8; 3]| i32::from(*red) > i32::from(*blue) + 20;
    pixels.iter().filter(is_brown).count() as f64 / pixels.len() as f64
}

#[test]
fn mist_is_drawn_over_the_snow_of_its_frame() {
    let folder = &shots();
    // The camera of a folder follows its objects, that of files sees everything.
    let draw = |what: &str| {
        works(folder, &format!("preview {what} -o p.png {SIZE} --eye 1,1.2,2 --target 0,0.2,0.2"));
        read(folder, "p.png")
    };
    let without = draw("shot --frame 2");
    add_mist(&folder.join("shot"), 2, 2);
    let with = draw("shot --frame 2");
    assert!(with != without);
    let files = "shot/base/base.0002.vdb shot/grains/grains.0002.vdb shot/mist/mist.0002.vdb shot/objects/objects.0002.ply";
    assert!(with == draw(files));
    assert!(with != draw(&format!("{files} --fog-density 1")));
    // What a stage lacks is not left out: the last frame that all have is drawn.
    assert!(with == draw("shot"));
    fails(
        folder,
        "preview shot --frame 3 -o p.png",
        2,
        &["shot", "frame 3", "1 frames, 2 to 2", "base and grains and mist"],
    );
    // Mist that is not there yet.
    add_mist(&folder.join("shot"), 1, 0);
    works(folder, &format!("preview shot --frames 1-2 -o p.gif {SIZE} -q"));
    works(folder, &format!("preview shot --frame 1 -o first.png {SIZE}"));
    // A file that is not what its record says.
    let path = folder.join("shot/mist/mist.0002.vdb");
    let mut bytes = fs::read(&path).unwrap();
    let last = bytes.len() - 1;
    bytes[last] ^= 1;
    fs::write(path, bytes).unwrap();
    fails(folder, &format!("preview shot --frame 2 -o p.png {SIZE}"), 2, &["mist.0002.vdb"]);
    // Only a flipbook needs to know the frame rate.
    fs::remove_file(folder.join("shot/scene.toml")).unwrap();
    works(folder, &format!("preview shot --frame 1 -o p.png {SIZE}"));
    fails(folder, &format!("preview shot --frames 1 -o p.gif {SIZE}"), 2, &["scene.toml", "--fps"]);
}

#[test]
fn what_cannot_be_drawn_is_said_before_anything_is_written() {
    let folder = &shots();
    fs::create_dir(folder.join("bare")).unwrap();
    fs::write(folder.join("grains.ply"), GRAINS).unwrap();
    works(folder, "snow shot.toml -o first -q --frames 1");
    works(folder, "snow shot.toml -o last -q");
    (1..=3)
        .for_each(|frame| fs::remove_file(folder.join(format!("last/state/base.000{frame}.json"))).unwrap());
    let refused: [(&str, &[&str]); 21] = [
        ("shot --frames 3-9 -o p.%04d.png", &["shot", "frame 5", "1 to 4", "base and grains"]),
        ("shot --frames 0-2 -o p.gif", &["shot", "frame 0"]),
        ("shot --frame 1.5 -o p.png", &["shot", "whole frames", "1.5"]),
        ("shot --frames 1-4 -o p.png", &["p.png", "p.%04d.png", ".gif"]),
        ("shot -o p.%04d.gif", &["p.%04d.gif", "one name"]),
        ("shot --frame 2 -o p.gif", &["p.gif", "--frames"]),
        ("shot --frame 2 -o p.%04d.png", &["p.%04d.png", "--frames"]),
        ("cube.obj -o p.gif", &["p.gif", "--frames"]),
        ("shot/base/base.0001.vdb --frames 1-4 -o p.gif", &["--frames", "none is given"]),
        ("shot/base/base.0001.vdb --fps 12 -o p.png", &["--fps", "none is given"]),
        ("bare -o p.gif", &["bare", "not the folder of a shot"]),
        ("shot/base/base.%04d.vdb -o p.png", &["base.0000.vdb", "--frame"]),
        ("shot/base/base.%04d.vdb --frames 5-6 -o p.gif", &["base.0005.vdb", "does not exist"]),
        ("shot --frames 1-4 -o none/p.%04d.png", &["none"]),
        ("grains.ply cube.obj --clip walk -o p.png", &["--clip"]),
        ("shot --frame 2 --fps 12 -o p.png", &["--fps", ".gif"]),
        ("shot first --frames 2 -o p.png", &["first", "frame 2"]),
        ("first last -o p.gif", &["no frame in common"]),
        ("first last -o p.png", &["no frame in common"]),
        ("shot -o shot/grains/grains.0002.vdb", &["grains.0002.vdb", ".png", ".gif"]),
        ("nowhere/ --frame 3 -o p.png", &["nowhere", "no such file"]),
    ];
    for (arguments, words) in refused {
        fails(folder, &format!("preview {arguments}"), 2, words);
    }
    // A sequence may have gaps: the frames that are there are drawn.
    let gap = "preview shot/base/base.%04d.vdb --frames 3-5 -o gap";
    fails(folder, &format!("{gap}.gif {SIZE}"), 1, &["base.0005.vdb", "1 of 3 frames were not made: 5"]);
    fails(folder, &format!("{gap}.%04d.png {SIZE}"), 1, &["base.0005.vdb", "1 of 3 frames"]);
    for name in ["gap.gif", "gap.0003.png", "gap.0004.png"] {
        fs::remove_file(folder.join(name)).unwrap();
    }
    // Binary USD is drawn as .ply is.
    works(folder, "snow shot.toml -o usd -q --frames 1 --set output.objects=[\"usd\"]");
    let said = works(folder, &format!("preview usd -o usd.png {SIZE}"));
    assert!(!said.contains("not drawn"), "{said}");
    let drawn = ["shot/objects/objects.0001.ply", "usd/objects/objects.0001.usdc"].map(|file| {
        works(folder, &format!("preview {file} -o objects.png {SIZE}"));
        fs::read(folder.join("objects.png")).unwrap()
    });
    assert!(drawn[0] == drawn[1]);
    let left: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    let left: Vec<_> =
        left.iter().filter_map(|name| name.to_str()).filter(|name| name.starts_with("p.")).collect();
    assert!(left.is_empty(), "{left:?}");
}

#[test]
fn a_damaged_frame_costs_a_flipbook_no_other_picture() {
    let folder = &shots();
    // Of the length that its record names; the camera is found without it.
    let path = folder.join("shot/base/base.0002.vdb");
    let mut bytes = fs::read(&path).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0xff;
    fs::write(&path, bytes).unwrap();
    fails(folder, &format!("preview shot --frames 1-4 -o p.%04d.png {SIZE} -q"), 1, &["base.0002.vdb"]);
    assert!(folder.join("p.0001.png").exists() && !folder.join("p.0002.png").exists());
    assert!(folder.join("p.0003.png").exists() && folder.join("p.0004.png").exists());
    fails(folder, &format!("preview shot --frames 1-4 -o p.gif {SIZE} -q"), 1, &["base.0002.vdb"]);
    assert!(folder.join("p.gif").exists());
}

/// Files that are not finished.
fn parts(folder: &Path) -> Vec<String> {
    let names = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    names.filter(|name| name.ends_with(".part")).collect()
}

#[test]
fn a_flipbook_that_is_stopped_leaves_nothing_half_written() {
    let folder = &shots();
    let child = command(folder, "preview shot -o p.gif --size 3000x2000 -q").spawn().unwrap();
    let begun = Instant::now();
    while parts(folder).is_empty() && begun.elapsed() < Duration::from_secs(60) {
        std::thread::sleep(Duration::from_millis(5));
    }
    let (code, took) = answer_to_sigterm(child);
    assert_eq!(code, Some(143));
    assert!(took < Duration::from_secs(2), "{took:?}");
    assert!(parts(folder).is_empty() && !folder.join("p.gif").exists());
}
