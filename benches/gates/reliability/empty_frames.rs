//! Frames of sequences that are empty or missing: every frame that can be made is made, and is empty where its input is.

use std::path::Path;

use frazil::geometry::points::{Column, Points, Values};
use frazil::geometry::{DVec3, TriMesh};
use frazil::io::{mesh, particles};

use crate::common::bodies::Dice;
use crate::process::{self, quiet};

/// Frames of a sequence, and patterns of them.
const FRAMES: usize = 8;
const PATTERNS: usize = 12;

/// What a frame of a sequence holds.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Frame {
    Full,
    Empty,
    Missing,
}

/// Frames that could be made and were not, or that hold something else, of so many.
#[derive(Default)]
struct Count {
    lost: usize,
    all: usize,
}

pub fn measure() -> (f64, String) {
    let folder = tempfile::tempdir().expect("a folder");
    let mut count = Count::default();
    for (n, pattern) in patterns().iter().enumerate() {
        let folder = folder.path().join(n.to_string());
        std::fs::create_dir_all(&folder).expect("a folder");
        (1..=FRAMES).zip(pattern).for_each(|(number, frame)| write(&folder, number, *frame));
        alone(&folder, pattern, &mut count);
        followed(&folder, pattern, &mut count);
        moved(&folder, pattern, &mut count);
    }
    let note = format!("of {} frames of {PATTERNS} patterns in 7 stages", count.all);
    (count.lost as f64, note)
}

/// Emitters, drains, what comes back, gaps, and any.
fn patterns() -> Vec<[Frame; FRAMES]> {
    let made = ["..######", "#####...", "###..###", "###?####", "..##..##", "########"];
    let of = |text: &&str| {
        let frame = |n: usize| match text.as_bytes()[n] {
            b'#' => Frame::Full,
            b'.' => Frame::Empty,
            _ => Frame::Missing,
        };
        std::array::from_fn(frame)
    };
    let mut dice = Dice(47);
    let mut any =
        || std::array::from_fn(|_| [Frame::Full, Frame::Full, Frame::Empty, Frame::Missing][dice.below(4)]);
    let mut out: Vec<[Frame; FRAMES]> = made.iter().map(of).collect();
    out.resize_with(PATTERNS, &mut any);
    out
}

/// Writes a frame: a box of particles that moves, and a mesh of such a box.
fn write(folder: &Path, number: usize, frame: Frame) {
    if frame == Frame::Missing {
        return;
    }
    let speed = DVec3::new(0.6, -0.2, 0.1);
    let from = speed * (number as f64 / 24.0);
    let lattice =
        (0..6 * 6 * 6).map(|n| DVec3::new(f64::from(n / 36), f64::from(n / 6 % 6), f64::from(n % 6)) * 0.1);
    let positions: Vec<DVec3> =
        lattice.map(|position| position + from).filter(|_| frame == Frame::Full).collect();
    let mut points = Points::at(0.1, &positions).expect("places");
    points.set("id", Values::Long(Column::Each((0..positions.len() as i64).collect())));
    points.set("v", Values::Vector(Column::Each(vec![speed.cast::<f32>().into(); positions.len()])));
    particles::write(&folder.join(format!("p.{number:04}.bgeo")), &points, false).expect("a file");
    let [low, high] = [from, from.add_scalar(0.5)].map(|position| position.cast::<f32>().into());
    let solid = if frame == Frame::Full { TriMesh::cuboid(low, high) } else { TriMesh::default() };
    mesh::write(&folder.join(format!("m.{number:04}.ply")), &solid).expect("a file");
}

/// Whether the command worked.
fn frazil(folder: &Path, arguments: &str) -> bool {
    quiet(process::frazil(arguments.split(' ')).current_dir(folder)).status().expect("frazil").success()
}

/// Stages in which each frame is made by itself.
fn alone(folder: &Path, pattern: &[Frame; FRAMES], count: &mut Count) {
    let frames = format!("--frames 1-{FRAMES} -q");
    let commands = [
        (
            format!("vdb from-particles p.%04d.bgeo --spacing 0.1 --mesh a.%04d.ply -o a.%04d.vdb {frames}"),
            "a",
            "vdb",
        ),
        (format!("convert p.%04d.bgeo b.%04d.xyz {frames}"), "b", "xyz"),
        (format!("convert m.%04d.ply c.%04d.obj {frames}"), "c", "obj"),
        (format!("convert m.%04d.ply d.%04d.usda {frames}"), "d", "usda"),
        (format!("preview m.%04d.ply -o e.%04d.png --size 32x32 {frames}"), "e", "png"),
    ];
    for (command, name, extension) in commands {
        let worked = frazil(folder, &command);
        let is_whole = !pattern.contains(&Frame::Missing);
        for (number, frame) in (1..=FRAMES).zip(pattern).filter(|(_, frame)| **frame != Frame::Missing) {
            count.all += 1;
            let path = folder.join(format!("{name}.{number:04}.{extension}"));
            let is_right = match name {
                "a" => holds(&path.with_extension("ply"), *frame) && path.is_file(),
                "c" => holds(&path, *frame),
                _ => path.is_file(),
            };
            count.lost += usize::from(!is_right || worked != is_whole);
        }
    }
}

/// The stage in which each frame goes on from the one before; what is missing comes later, and the run is taken up again.
fn followed(folder: &Path, pattern: &[Frame; FRAMES], count: &mut Count) {
    let command = "surface -p p.%04d.bgeo -o s -q --set surface.spacing=0.1 --set shot.frames=1-8";
    let end = pattern.iter().position(|frame| *frame == Frame::Missing).unwrap_or(FRAMES);
    let can_begin = pattern[..end].contains(&Frame::Full);
    let mut check = |end: usize, pattern: &[Frame]| {
        for (number, frame) in (1..=end).zip(pattern) {
            count.all += 1;
            count.lost +=
                usize::from(!holds(&folder.join(format!("s/surface/surface.{number:04}.usdc")), *frame));
        }
    };
    if can_begin {
        frazil(folder, command);
        check(end, pattern);
    }
    let filled = pattern.map(|frame| if frame == Frame::Missing { Frame::Full } else { frame });
    (1..=FRAMES).zip(pattern).filter(|(_, frame)| **frame == Frame::Missing).for_each(|(number, _)| {
        write(folder, number, Frame::Full);
    });
    let worked = frazil(folder, command);
    check(if worked { FRAMES } else { 0 }, &filled);
    if !worked {
        count.lost += FRAMES;
    }
}

/// The stage in which a sequence is an object: it must keep its faces, so that a gap is refused before any work, and an empty frame ends the
/// run after those before it.
fn moved(folder: &Path, pattern: &[Frame; FRAMES], count: &mut Count) {
    // What was missing is there by now.
    let end = pattern.iter().position(|frame| *frame == Frame::Empty).unwrap_or(FRAMES);
    let scene = "[shot]\nframes = \"1-8\"\n[snow]\nground = -0.4\narea = [-0.2, -0.2, 0.9, 0.7]\ndepth = 0.5\ncell = 0.05\n\
                 [[object]]\nfile = \"m.%04d.ply\"\n";
    std::fs::write(folder.join("snow.toml"), scene).expect("a scene");
    let worked = frazil(folder, "snow snow.toml -o n -q");
    for number in 1..=end {
        count.all += 1;
        let is_made = folder.join(format!("n/base/base.{number:04}.vdb")).is_file();
        count.lost += usize::from(!is_made || worked != (end == FRAMES));
    }
}

/// Whether a file holds a mesh, or an empty one.
fn holds(path: &Path, frame: Frame) -> bool {
    mesh::read_any(path).is_ok_and(|mesh| mesh.ends.is_empty() == (frame == Frame::Empty))
}
