//! `frazil surface` before the liquid merges: the mesh that is written sets out towards what comes, the one that goes on does not.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use frazil::geometry::{DVec3, DetailedMesh, Vec3};

use crate::common::character::{are_same, output};
use crate::common::followed::{frame, values};
use crate::common::liquids::{ball, write_numbered};
use crate::program::{Folder, command, fails, kill_at, works};

/// Initial distance between particles (m).
const SPACING: f64 = 0.01;
/// Frames of the cache, and the last one of a shot that ends before the balls meet, which it sees coming.
const FRAMES: i32 = 12;
const EARLIER: i32 = 6;
/// Frames ahead that are usual.
const AHEAD: i32 = 4;
/// Positions that are nearer to each other than this are one (spacings): what 32 bits of a position and a velocity hold.
const SAME: f64 = 1e-5;

const SHOT: &str = "surface -p two.%04d.bgeo --spacing 0.01 --set shot.frames=1-12";
const SHORT: &str = "surface -p two.%04d.bgeo --spacing 0.01 --set shot.frames=1-6";

fn path(folder: &Path, frame: i32) -> PathBuf {
    folder.join(format!("two.{frame:04}.bgeo"))
}

/// The cache of two balls that come nearer to each other until they are one. They drift besides, for vertices not to lie where the grid
/// is: what is cut there would lie at the positions of those that go.
fn write_shot(folder: &Path) {
    let one = ball(5.0, 10, 0.1);
    for frame in 1..=FRAMES {
        let time = f64::from(frame);
        let drift = DVec3::new(0.0, 0.03, 0.02) * time;
        let middle = |side: f64| (DVec3::new(8.26 - 0.26 * time, 0.1, 0.2) * side + drift) * SPACING;
        let moved = |by: DVec3| one.positions.iter().map(move |position| position + by);
        let positions: Vec<DVec3> = moved(middle(-1.0)).chain(moved(middle(1.0))).collect();
        write_numbered(&path(folder, frame), &positions, 0);
    }
}

/// Those of all frames.
fn frames(folder: &Path, out: &str) -> Vec<DetailedMesh> {
    (1..=FRAMES).map(|number| frame(folder, out, number)).collect()
}

/// What a frame goes on from.
fn state(folder: &Path, out: &str, frame: i32) -> Vec<u8> {
    fs::read(folder.join(format!("{out}/state/surface.{frame:04}.surface"))).unwrap()
}

/// Where the vertices of a frame are in the next (m), as their velocities say.
fn led(mesh: &DetailedMesh) -> Vec<DVec3> {
    let [x, y, z] = ["vx", "vy", "vz"].map(|name| values(mesh, name));
    let position = |(vertex, position): (usize, &Vec3)| {
        position.cast::<f64>() + DVec3::new(x[vertex], y[vertex], z[vertex]) / 24.0
    };
    mesh.mesh.positions.iter().enumerate().map(position).collect()
}

/// Distance of two positions (spacings).
fn off(position: &Vec3, other: &DVec3) -> f64 {
    (position.cast::<f64>() - other).norm() / SPACING
}

/// Vertices that lie elsewhere than in a mesh of the same triangles.
#[track_caller]
fn moved(shown: &DetailedMesh, own: &DetailedMesh) -> Vec<usize> {
    assert!(shown.mesh.triangles == own.mesh.triangles);
    let pairs = shown.mesh.positions.iter().zip(&own.mesh.positions).enumerate();
    pairs.filter(|(_, (shown, own))| shown != own).map(|(vertex, _)| vertex).collect()
}

/// What a vertex of a frame, of a mesh that is not eased, is in the next one; none: it is gone.
fn is_then(now: &DetailedMesh, next: &DetailedMesh, led: &[DVec3], vertex: usize) -> Option<usize> {
    if now.mesh.triangles == next.mesh.triangles {
        return Some(vertex);
    }
    next.mesh.positions.iter().position(|position| off(position, &led[vertex]) < SAME)
}

/// Whether only those vertices are moved which a change takes away within so many frames; how many in all frames, and how far at most
/// (spacings).
#[track_caller]
fn only_what_goes_is_moved(shown: &[DetailedMesh], own: &[DetailedMesh], ahead: i32) -> (usize, f64) {
    // Frames until which each has to be gone.
    let mut due: BTreeMap<usize, i32> = BTreeMap::new();
    let (mut count, mut most) = (0, 0.0f64);
    for (number, (shown, own_now)) in (1..).zip(shown.iter().zip(own)) {
        let left = ahead.min(FRAMES - number);
        for vertex in moved(shown, own_now) {
            assert!(left > 0, "vertex {vertex} at frame {number}");
            due.entry(vertex).or_insert(left);
            count += 1;
            most = most.max(off(&shown.mesh.positions[vertex], &own_now.mesh.positions[vertex].cast()));
        }
        assert!(number > 1 || due.is_empty(), "nothing comes soon after the first frame");
        let Some(next) = own.get(number as usize) else { break };
        let led = led(own_now);
        let then = |(vertex, left): (usize, i32)| {
            let vertex = is_then(own_now, next, &led, vertex)?;
            assert!(left > 1, "vertex {vertex} at frame {} was moved, and is still there", number + 1);
            Some((vertex, left - 1))
        };
        due = due.into_iter().filter_map(then).collect();
    }
    (count, most)
}

/// Whether velocities lead to the next frame's positions, between frames of the same triangles; how many of the vertices are on the way to a
/// change.
#[track_caller]
fn velocities_lead_on(shown: &[DetailedMesh], own: &[DetailedMesh]) -> usize {
    let mut on_the_way = 0;
    for (number, (pair, own)) in (1..).zip(shown.windows(2).zip(own)) {
        let [now, next] = pair else { unreachable!("two frames") };
        if now.mesh.triangles != next.mesh.triangles {
            continue;
        }
        for (vertex, (position, led)) in next.mesh.positions.iter().zip(&led(now)).enumerate() {
            let off = off(position, led);
            assert!(off < SAME, "{off} spacings at frame {number}, vertex {vertex}");
        }
        on_the_way += moved(now, own).len();
    }
    on_the_way
}

#[test]
fn what_a_change_takes_away_sets_out_before_it_and_the_states_are_those_without() {
    let folder = &Folder::empty();
    write_shot(folder);
    works(folder, &format!("{SHOT} -o usual"));
    for ahead in [0, 1] {
        works(folder, &format!("{SHOT} -o ahead{ahead} --set surface.ahead={ahead}"));
    }
    let own = frames(folder, "ahead0");
    assert!(own.windows(2).any(|pair| pair[0].mesh.triangles != pair[1].mesh.triangles));
    for (out, ahead) in [("ahead1", 1), ("usual", AHEAD)] {
        for number in 1..=FRAMES {
            let is_same = state(folder, out, number) == state(folder, "ahead0", number);
            assert!(is_same, "{out} at frame {number}");
        }
        let shown = frames(folder, out);
        let (count, most) = only_what_goes_is_moved(&shown, &own, ahead);
        assert!(count > 5 && most > 0.1, "{out}: {count} vertices by up to {most} spacings");
        let on_the_way = velocities_lead_on(&shown, &own);
        assert!(ahead == 1 || on_the_way > 0, "no frame before the changes");
    }
    velocities_lead_on(&own, &own);
    let words = ["ahead", "must lie in 0 to 100, not 101"];
    fails(folder, &format!("{SHOT} -o no --set surface.ahead=101"), 2, &words);
}

#[test]
fn threads_kills_and_frames_made_again_give_the_same_bytes() {
    let folder = &Folder::empty();
    write_shot(folder);
    let shot = format!("{SHOT} --set output.surface=[\"ply\",\"usd\",\"obj\"]");
    works(folder, &format!("{shot} -o whole --threads 2"));
    let whole = output(&folder.join("whole"));
    let path = |out: &str| folder.join(out);
    works(folder, &format!("{shot} -o one --threads 1"));
    are_same(&whole, &path("one"), |_| true);
    let mut plain = command(folder, &format!("{shot} -o baseline"));
    assert!(plain.env("FRAZIL_CPU", "baseline").status().unwrap().success());
    are_same(&whole, &path("baseline"), |_| true);
    kill_at(folder, &format!("{shot} -o killed"), "killed/surface/surface.0005.usdc");
    works(folder, &format!("{shot} -o killed"));
    are_same(&whole, &path("killed"), |_| true);
    works(folder, &format!("{shot} -o part --frames 5-6"));
    works(folder, &format!("{shot} -o part"));
    are_same(&whole, &path("part"), |_| true);
    // Records say from which frame on a shot was made again.
    for from in [9, 6] {
        works(folder, &format!("{shot} -o one --from {from}"));
        are_same(&whole, &path("one"), |name| !name.ends_with(".json"));
    }
}

#[test]
fn a_shot_sees_what_its_cache_has_beyond_it_also_when_that_comes_later() {
    let folder = &Folder::empty();
    write_shot(folder);
    works(folder, &format!("{SHOT} -o whole"));
    works(folder, &format!("{SHORT} -o short"));
    let bytes = |out: &str, number: i32| {
        fs::read(folder.join(format!("{out}/surface/surface.{number:04}.usdc"))).unwrap()
    };
    for number in 1..=EARLIER {
        assert!(bytes("whole", number) == bytes("short", number), "frame {number}");
        assert!(state(folder, "whole", number) == state(folder, "short", number), "frame {number}");
    }
    // The cache is still being written.
    let away = folder.join("later");
    fs::create_dir(&away).unwrap();
    for number in EARLIER + 1..=FRAMES {
        fs::rename(path(folder, number), path(&away, number)).unwrap();
    }
    works(folder, &format!("{SHORT} -o grown"));
    let last = ["short", "grown"].map(|out| frame(folder, out, EARLIER));
    assert!(!moved(&last[0], &last[1]).is_empty());
    for number in EARLIER + 1..=FRAMES {
        fs::rename(path(&away, number), path(folder, number)).unwrap();
    }
    works(folder, &format!("{SHORT} -o grown"));
    are_same(&output(&folder.join("short")), &folder.join("grown"), |_| true);
}
