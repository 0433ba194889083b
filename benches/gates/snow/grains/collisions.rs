//! Gates of objects that move through grains: how many grains end a frame inside one, or in the base below it.

use std::path::Path;

use frazil::geometry::{DVec3, TriMesh};
use frazil::motion::{Key, Keys, Motion, Rigid};
use frazil::snow::grains::heap::Shell;
use frazil::snow::grains::{Grains, Object, Params, Surroundings};
use frazil::sweep::Body;
use rayon::prelude::*;

use crate::common::shapes::cuboid;
use crate::harness::Harness;
use crate::process::works;
use crate::scenes::{MAN, context, wanted_data};
use crate::snow::grains::passes::{pass, walk};
use crate::snow::grains::{FRAME, ON_A_FLOOR};

/// Diameter of the grains (m).
const D: f64 = 0.005;
/// Depth (diameters) beyond which a grain counts as inside.
const DEEP: f64 = 0.1;

pub fn run(h: &mut Harness) {
    plate(h);
    blades(h);
    sheet(h);
    walker(h);
}

/// Indices of the grains in a mesh, trapped or not: nearer to its surface than 0.4 diameters, or inside it if it is closed.
fn deep(positions: &[DVec3], mesh: &TriMesh, closed: bool) -> Vec<usize> {
    let pose: Vec<DVec3> = mesh.positions.iter().map(|position| position.cast::<f64>()).collect();
    let shell = Shell::at_rest(mesh.triangles.clone(), pose.clone());
    let near = (0.5 - DEEP) * D;
    let is_deep = |position: &DVec3| {
        shell.distance(*position, near).is_some_and(|distance| distance < near)
            || closed
                && shell.distance(*position, 0.1).is_some()
                && winding(*position, &mesh.triangles, &pose) > 0.5
    };
    (0..positions.len()).into_par_iter().filter(|index| is_deep(&positions[*index])).collect()
}

/// Winding number of a closed mesh around a position: its solid angle (van Oosterom and Strackee 1983) over 4 pi.
fn winding(position: DVec3, triangles: &[[u32; 3]], pose: &[DVec3]) -> f64 {
    let angle = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|index| pose[index as usize] - position);
        let (x, y, z) = (a.norm(), b.norm(), c.norm());
        let below = x * y * z + a.dot(&b) * z + b.dot(&c) * x + c.dot(&a) * y;
        2.0 * a.dot(&b.cross(&c)).atan2(below)
    };
    triangles.iter().map(angle).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

/// Moves an object through a heap of grains for some frames; counts grains that end one of them inside it but not trapped.
fn through(h: &mut Harness, name: &str, motion: Box<dyn Motion>, frames: i32) {
    let ctx = context(2);
    let mut grains = Grains::new(Params { radius: 0.5 * D, ..Params::for_cell(1.5 * D) }).expect("grains");
    let sites = (0..20).flat_map(|y| (0..30).flat_map(move |x| (0..30).map(move |z| [x, y, z])));
    let off = |site: [i32; 3]| {
        DVec3::new(f64::from(site[0]) - 14.5, f64::from(site[1]) + 0.5, f64::from(site[2]) - 14.5)
    };
    let shift = |site: [i32; 3]| f64::from((site[0] * 7 + site[1] * 5 + site[2] * 3) % 11) * 0.01;
    let places: Vec<DVec3> =
        sites.map(|site| (off(site) + DVec3::new(shift(site), 0.0, -shift(site))) * 1.1 * D).collect();
    grains.emit(&places, &[], 0).expect("grains");
    let body = Body::new(motion, 0.0).expect("a body");
    let closed = body.closed_loops() == 0;
    let (mut bad, mut most, mut trapped) = (0, 0, 0);
    for frame in 1..=12 + frames {
        let objects = [Object::new(&body, 0.3)];
        let objects = if frame <= 12 { &objects[..0] } else { &objects[..] };
        let around = Surroundings { objects, ..ON_A_FLOOR };
        let times = [frame - 13, frame - 12].map(|frame| f64::from(frame.max(0)) * FRAME);
        let times = if frame <= 12 { [0.0, FRAME] } else { times };
        let report = grains.step(&ctx, &around, times, frame).expect("a step");
        if frame <= 12 {
            continue;
        }
        let mut pose = Vec::new();
        body.motion().pose(times[1], &mut pose).expect("a pose");
        let positions = pose.iter().map(|place| place.cast::<f32>()).collect();
        let mesh = TriMesh { positions, triangles: body.motion().triangles().to_vec() };
        let places: Vec<DVec3> = grains.positions().collect();
        let ids = grains.ids();
        let is_free = |index: &usize| grains.trapped().binary_search(&ids[*index]).is_err();
        let deep = deep(&places, &mesh, closed);
        let now = deep.iter().filter(|index| is_free(index)).count();
        if now > 0 {
            println!(
                "# frame {}: {now} of {} deep ones are free, {} sub-steps",
                frame - 12,
                deep.len(),
                report.sub_steps
            );
        }
        (bad, most, trapped) = (bad + now, most.max(now), trapped + report.trapped);
    }
    h.gate(name, bad as f64, &format!("in {frames} frames, at most {most} in one; {trapped} times trapped"));
}

fn rigid(mesh: TriMesh, keys: &[(f64, [f64; 3], [f64; 3])]) -> Box<dyn Motion> {
    let key = |&(time, at, turn): &(f64, [f64; 3], [f64; 3])| Key {
        time,
        at: DVec3::from(at),
        turn: DVec3::from(turn),
    };
    Box::new(Rigid::new(mesh, Keys::new(keys.iter().map(key).collect()).expect("keys")))
}

/// A plate 2 mm thick that moves through them at 10 m/s.
fn plate(h: &mut Harness) {
    if h.wants("snow.grains.deep_plate") {
        let keys = [(0.0, [0.0, 0.06, -1.0], [0.0; 3]), (0.2, [0.0, 0.06, 1.0], [0.0; 3])];
        through(h, "snow.grains.deep_plate", rigid(cuboid([0.1, 0.1, 0.002]), &keys), 6);
    }
}

/// Four blades 2 mm thick that rotate twice a second.
fn blades(h: &mut Harness) {
    if h.wants("snow.grains.deep_blades") {
        let mut mesh = cuboid([0.12, 0.03, 0.002]);
        mesh.append(&cuboid([0.002, 0.03, 0.12]));
        let keys = [
            (0.0, [0.0, 0.05, 0.0], [0.0; 3]),
            (1.0, [0.0, 0.05, 0.0], [0.0, 4.0 * std::f64::consts::PI, 0.0]),
        ];
        through(h, "snow.grains.deep_blades", rigid(mesh, &keys), 24);
    }
}

/// An open sheet that waves.
struct Sheet(Vec<[u32; 3]>);

/// Count of vertices along its edge.
const EDGE: u32 = 25;

impl Motion for Sheet {
    fn triangles(&self) -> &[[u32; 3]] {
        &self.0
    }

    fn vertex_count(&self) -> usize {
        (EDGE * EDGE) as usize
    }

    fn breaks(&self, _: f64, _: f64) -> Vec<f64> {
        Vec::new()
    }

    fn pose(&self, time: f64, out: &mut Vec<DVec3>) -> frazil::Result<()> {
        let at = |index: u32| f64::from(index) / f64::from(EDGE - 1) * 0.24 - 0.12;
        let position = |index: u32| {
            let (x, z) = (at(index % EDGE), at(index / EDGE));
            DVec3::new(x, 0.05 + 0.03 * (30.0 * x + 18.0 * time).sin() * (18.0 * time).cos(), z)
        };
        out.clear();
        out.extend((0..EDGE * EDGE).map(position));
        Ok(())
    }
}

fn sheet(h: &mut Harness) {
    if h.wants("snow.grains.deep_sheet") {
        let cells = (0..EDGE - 1).flat_map(|z| (0..EDGE - 1).map(move |x| z * EDGE + x));
        let triangles = cells.flat_map(|a| [[a, a + EDGE, a + 1], [a + 1, a + EDGE, a + EDGE + 1]]).collect();
        through(h, "snow.grains.deep_sheet", Box::new(Sheet(triangles)), 24);
    }
}

/// A character that walks through snow: its soles press grains against the base.
fn walker(h: &mut Harness) {
    let name = "snow.grains.deep_walker";
    let Some(man) = wanted_data(h, &[name], MAN) else { return };
    let folder = tempfile::tempdir().expect("a folder");
    let scene = walk(folder.path(), &man, 48, 0.012, "");
    let mut text = std::fs::read_to_string(&scene).expect("a scene");
    text.insert_str(0, "output = { objects = [\"ply\"] }\n");
    std::fs::write(&scene, text).expect("a scene");
    let out = folder.path().join("out");
    works(&mut pass(&scene, &out, 2));
    let (mut in_object, mut in_base, mut trapped, mut count) = (0, 0, 0, 0);
    for frame in (6..=48).step_by(6) {
        let [object, base, marked, all] = walker_frame(&out, frame);
        println!(
            "# frame {frame}: {object} in the character, {base} in the base, {marked} trapped, of {all}"
        );
        (in_object, in_base) = (in_object + object, in_base + base);
        (trapped, count) = (trapped + marked, count + all);
    }
    let note = format!(
        "{in_object} in the character, {in_base} in the base; {trapped} trapped of {count}, 8 frames"
    );
    h.gate(name, (in_object + in_base) as f64, &note);
}

/// Counts of grains of a frame: not trapped but in the character, or in the base; trapped; all.
fn walker_frame(out: &Path, frame: i32) -> [usize; 4] {
    use frazil::geometry::points::Values;
    let points =
        frazil::vdb::points::read(&out.join(format!("grains/grains.{frame:04}.vdb")), None).expect("points");
    let positions: Vec<DVec3> = (0..points.count()).map(|index| points.position(index)).collect();
    let Some(Values::Bool(trapped)) = points.attribute("trapped") else { panic!("no attribute trapped") };
    let mesh = frazil::io::mesh::read(&out.join(format!("objects/objects.{frame:04}.ply"))).expect("a mesh");
    let base = out.join(format!("base/base.{frame:04}.vdb"));
    let base = frazil::vdb::file::read_named(&base, Some("surface")).expect("the base");
    let mut radius = 0.0;
    if let Some(Values::Float(scale)) = points.attribute("pscale") {
        radius = f64::from(scale.get(0));
    }
    let near = (1.0 - 2.0 * DEEP) * radius;
    let pose: Vec<DVec3> = mesh.positions.iter().map(|position| position.cast::<f64>()).collect();
    let shell = Shell::at_rest(mesh.triangles.clone(), pose.clone());
    let free: Vec<usize> = (0..positions.len()).filter(|index| !trapped.get(*index)).collect();
    let in_object = free.par_iter().filter(|index| {
        let position = positions[**index];
        shell.distance(position, near).is_some_and(|distance| distance < near)
            || shell.distance(position, 0.15).is_some() && winding(position, &mesh.triangles, &pose) > 0.5
    });
    let in_object = in_object.count();
    let at: Vec<DVec3> = free.iter().map(|index| positions[*index]).collect();
    let mut values = Vec::new();
    base.sample_linear(&context(2), &at, &mut values).expect("values");
    let in_base = values.iter().filter(|value| f64::from(**value) < near).count();
    [in_object, in_base, positions.len() - free.len(), positions.len()]
}
