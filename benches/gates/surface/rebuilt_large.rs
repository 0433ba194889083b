//! Gates of a mesh that is rebuilt where large liquids merge: as many particles and triangles as in the thesis' largest scene, and a
//! million, whose memory is that of a process of its own.

use frazil::geometry::{DVec3, TriMesh};

use crate::common::liquids::{ball, context};
use crate::common::shapes::welded;
use crate::harness::Harness;
use crate::process::{kilobytes, number_of, own, printed};
use crate::surface::rebuilt_frames::{DETAIL, Lump, SPACING, Scene, flying, params};

/// Radius of the seven objects (spacings), squares along an edge of their meshes' six faces, steps; how far two objects come nearer to
/// each other in each (spacings), those of the million too.
const OBJECT: (f64, usize) = (20.7, 67);
const FALLING: usize = 12;
const NEARER: f64 = 0.25;
/// Gaps between them and the one in the middle at the first frame: the least, and by how much each is greater than the one before
/// (spacings). At about 3 they merge.
const GAPS: [f64; 2] = [3.5, 0.25];
/// Radius of the two halves of the million (spacings), squares, the gap between them at the first frame (spacings), steps. At about 2.2
/// they merge.
const HALF: (f64, usize) = (49.25, 204);
const GAP: f64 = 2.5;
const MERGING: usize = 5;

pub fn run(h: &mut Harness) {
    h.measure("surface.frame_260k", || {
        let scene = objects();
        let (seconds, note) = scene.told(&scene.follow(&context(1), params()));
        (seconds, format!("{note} thesis=63.4 s"))
    });
    h.measure_all(["surface.frame_million", "surface.rebuilt_memory"], || {
        let text = printed(&mut own("rebuilt-million"));
        let number = |key: &str| number_of(&text, key).expect("what the million took");
        let note = text.lines().find_map(|line| line.strip_prefix("note ")).expect("a note");
        let of_memory = "the peak of a process with mesh and particles, the making of both included; steps alone, without easing, arrays \
                         and files";
        [(number("seconds "), note.to_string()), (number("gigabytes "), of_memory.into())]
    });
}

/// The run that follows the million, and prints what that took.
pub fn print_million() {
    let scene = million();
    let (seconds, note) = scene.told(&scene.follow(&context(1), params()));
    println!("seconds {seconds}\nnote {note}\ngigabytes {}", kilobytes("self", "VmHWM:") * 1024.0 / 1e9);
}

/// The falling objects (Fig. 2.12): viscous objects that fall on top of one another and merge. The thesis matched their topology in 38 %
/// of the frames. Here six come nearer to one from all sides, and each touches it somewhat later than the one before.
fn objects() -> Scene {
    let (radius, squares) = OBJECT;
    let object = |index: usize| {
        let mut side = DVec3::zeros();
        side[index / 2] = if index.is_multiple_of(2) { 1.0 } else { -1.0 };
        let gap = GAPS[0] + GAPS[1] * index as f64;
        Lump { radius, centre: side * (2.0 * radius + gap), way: side * -NEARER }
    };
    let middle = Lump { radius, centre: DVec3::zeros(), way: DVec3::zeros() };
    let lumps: Vec<Lump> = std::iter::once(middle).chain((0..6).map(object)).collect();
    merging(&lumps, squares, FALLING)
}

/// Two balls that merge.
fn million() -> Scene {
    let (radius, squares) = HALF;
    let half = |side: f64| Lump {
        radius,
        centre: DVec3::x() * (side * (radius + 0.5 * GAP)),
        way: DVec3::x() * (-0.5 * side * NEARER),
    };
    merging(&[half(-1.0), half(1.0)], squares, MERGING)
}

/// Lumps that merge, each with a mesh of its own of 12 times `squares`^2 triangles.
fn merging(lumps: &[Lump], squares: usize, steps: usize) -> Scene {
    let mut mesh = TriMesh::default();
    for lump in lumps {
        let mut own = ball(lump.radius, squares, DETAIL).mesh;
        let by = lump.centre * SPACING;
        own.positions.iter_mut().for_each(|position| *position = (position.cast::<f64>() + by).cast());
        mesh.append(&own);
    }
    Scene { mesh: welded(&mesh), motion: flying(lumps, 0.0), steps, is_matched: true }
}
