//! A drop that hangs from a ball by a neck: it falls, the neck is drawn out to a thread and tears, and the drop comes down on a pool
//! and spreads. A formula that keeps volumes, except where the thread tears, moves each position. Lengths are in spacings, except in
//! the files.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use frazil::geometry::mesh::attributes::{Number, On};
use frazil::geometry::points::{Column, Points, Values};
use frazil::geometry::{DVec3, MeshArray, TriMesh};
use frazil::io::files::atomic;
use frazil::io::{mesh, particles};

use crate::common::liquids::{filled, turned};
use crate::common::shapes::globe;

/// Initial distance between particles (m).
const SPACING: f64 = 0.0125;
/// Frames of the shot, from 1 on.
const FRAMES: i32 = 32;
/// Frames per second.
const FPS: f64 = 24.0;
/// Radii of the ball, of the drop, and of the neck between them.
const BALL: f64 = 8.0;
const DROP: f64 = 6.5;
const NECK: f64 = 3.2;
/// Half of the neck's length.
const HALF: f64 = 5.0;
/// How far the drop falls; the pool begins one spacing below that.
const FALL: f64 = 10.0;
/// Acceleration of its fall (spacings/s2): 0.4 m/s2, in slow motion.
const GRAVITY: f64 = 32.0;
/// Radius and half of the height of the pool. Its highest position is the origin.
const POOL: [f64; 2] = [15.0, 4.0];
/// Pieces of an outline.
const PIECES: usize = 600;

/// Writes drip.0001.bgeo and so on, drip.ply with its array `paint`, and drip.toml into a folder.
///
/// # Errors
/// What the operating system reports.
pub fn write(folder: &Path) -> frazil::Result<()> {
    let (hanging, pool) = (Outline::hanging(), Outline::pool());
    let positions = positions(&hanging);
    for frame in 1..=FRAMES {
        let now: Vec<DVec3> = positions.iter().map(|position| moved(*position, frame) * SPACING).collect();
        let mut points = Points::at(SPACING, &now)?;
        points.set("id", Values::Long(Column::Each((0..now.len() as i64).collect())));
        points.set("pscale", Values::Float(Column::Uniform((0.5 * SPACING) as f32)));
        particles::write(&folder.join(format!("drip.{frame:04}.bgeo")), &points, false)?;
    }
    let (mut body, flutes) = hanging.sculpted([96, 150], [8.0, 6.0], 0.45);
    let (rest, rings) = pool.sculpted([120, 90], [0.0, 14.0], 0.35);
    body.append(&rest);
    body.positions.iter_mut().for_each(|position| *position *= SPACING as f32);
    let painted = |middle: f64| move |wave: &f64| middle + 0.25 * wave;
    let values = flutes.iter().map(painted(0.75)).chain(rings.iter().map(painted(0.25))).collect();
    let paint = MeshArray { name: "paint".into(), on: On::Vertices, number: Number::F32, values };
    let carried = mesh::Carried { arrays: &[&paint], ..mesh::Carried::default() };
    mesh::write_carried(&folder.join("drip.ply"), &body, &carried)?;
    let scene = format!(
        "[shot]\nframes = \"1-{FRAMES}\"\nfps = {FPS:?}\n\n[surface]\nparticles = \"drip.%04d.bgeo\"\nmesh = \"drip.ply\"\n\
         spacing = {SPACING:?}\n"
    );
    atomic::write_bytes(&folder.join("drip.toml"), scene.as_bytes())
}

/// The particles at the first frame.
fn positions(hanging: &Outline) -> Vec<DVec3> {
    // On a rotated grid: on an unrotated one, the thread would tear along the planes of the grid.
    let set = |position: DVec3| turned(position, 0.7, DVec3::new(0.0, 20.0, 0.0));
    // The surface of particles lies half a spacing above the outermost.
    let is_inside = |position: DVec3| {
        let position = set(position);
        let across = libm::hypot(position.x, position.z);
        if position.y > 0.0 {
            return across + 0.5 < hanging.reach(position.y);
        }
        let [x, y] = [across / (POOL[0] - 0.5), (position.y + POOL[1]) / (POOL[1] - 0.5)];
        x * x + y * y < 1.0
    };
    filled(1.0, 0.1, 33.0, is_inside).into_iter().map(set).collect()
}

/// Height of the middle of the neck at the first frame.
fn middle() -> f64 {
    FALL + 1.0 + DROP + (DROP * DROP - NECK * NECK).sqrt() + HALF
}

/// Where a position of the first frame has moved by another frame.
fn moved(position: DVec3, frame: i32) -> DVec3 {
    if position.y < 0.0 {
        return position;
    }
    let time = f64::from(frame - 1) / FPS;
    let contact = (2.0 * FALL / GRAVITY).sqrt();
    let fallen = 0.5 * GRAVITY * time.min(contact) * time.min(contact);
    // Half the length of the part of the neck that is drawn out: all of the neck at first, then ever less, which becomes the thread.
    let drawn = HALF * (1.0 - 0.94 * smooth(time / (0.85 * contact)));
    let along = ((drawn + middle() - position.y) / (2.0 * drawn)).clamp(0.0, 1.0);
    let share = smooth(along);
    // Thinner where it is stretched, so that the volume stays the same.
    let thinner = 1.0 / (1.0 + fallen * 6.0 * along * (1.0 - along) / (2.0 * drawn)).sqrt();
    let (x, y, z) = (position.x * thinner, position.y - fallen * share, position.z * thinner);
    // What has come down with the drop spreads.
    let since = if share > 0.5 { (time - contact).max(0.0) } else { 0.0 };
    let lower = 1.0 - 0.45 * (1.0 - libm::exp(-5.0 * since));
    let wider = 1.0 / lower.sqrt();
    DVec3::new(x * wider, y * lower, z * wider)
}

/// A smooth step from 0 to 1 while `part` goes from 0 to 1.
fn smooth(part: f64) -> f64 {
    let part = part.clamp(0.0, 1.0);
    part * part * (3.0 - 2.0 * part)
}

/// The outline of a body of revolution about the y axis, from its upper end to its lower one: distances from the axis, and heights.
/// Points are evenly spaced, and heights decrease.
struct Outline(Vec<[f64; 2]>);

impl Outline {
    /// Of the ball, the neck and the drop.
    fn hanging() -> Self {
        let [upper, lower] = [BALL, DROP].map(|radius| libm::asin(NECK / radius));
        let mut line = arc(middle() + HALF + BALL * libm::cos(upper), [BALL; 2], [0.0, PI - upper]);
        line.extend(arc(middle() - HALF - DROP * libm::cos(lower), [DROP; 2], [lower, PI]));
        // Creases at the neck's ends are rounded.
        let mut line = even(&line);
        for _ in 0..800 {
            let mean = |three: &[[f64; 2]]| {
                [0, 1].map(|axis| 0.25 * three[0][axis] + 0.5 * three[1][axis] + 0.25 * three[2][axis])
            };
            let inner: Vec<[f64; 2]> = line.windows(3).map(mean).collect();
            line[1..PIECES].copy_from_slice(&inner);
        }
        Self(even(&line))
    }

    fn pool() -> Self {
        Self(even(&arc(-POOL[1], POOL, [0.0, PI])))
    }

    /// The point at a share of its length.
    fn at(&self, share: f64) -> [f64; 2] {
        let position = share * PIECES as f64;
        let piece = (position as usize).min(PIECES - 1);
        between(self.0[piece], self.0[piece + 1], position - piece as f64)
    }

    /// Distance from the axis at a height; 0 beyond the ends.
    fn reach(&self, height: f64) -> f64 {
        let next = self.0.partition_point(|point| point[1] > height);
        if next == 0 || next == self.0.len() {
            return 0.0;
        }
        let [above, below] = [self.0[next - 1], self.0[next]];
        between(above, below, (above[1] - height) / (above[1] - below[1]))[0]
    }

    /// The mesh of the body, with `columns` and `rings`, and with `around` waves of this height around it, which make `turns` turns from
    /// end to end; also the wave of each vertex, -1 to 1.
    fn sculpted(
        &self,
        [columns, rings]: [usize; 2],
        [around, turns]: [f64; 2],
        height: f64,
    ) -> (TriMesh, Vec<f64>) {
        let mut body = globe(1.0, columns, rings);
        let mut waves = Vec::with_capacity(body.positions.len());
        for (vertex, position) in body.positions.iter_mut().enumerate() {
            // The upper end and the lower one come last.
            let (share, turn) = match vertex.checked_sub(columns * (rings - 1)) {
                Some(end) => (end as f64, 0.0),
                None => {
                    ((vertex / columns + 1) as f64 / rings as f64, (vertex % columns) as f64 / columns as f64)
                }
            };
            let [across, up] = self.at(share);
            let (sine, cosine) = libm::sincos(TAU * turn);
            *position = DVec3::new(across * cosine, up, across * sine).cast();
            waves.push(libm::sin(TAU * (around * turn + turns * share)) * (0.25 * across).min(1.0));
        }
        let normals = body.normals();
        for ((position, normal), wave) in body.positions.iter_mut().zip(&normals).zip(&waves) {
            *position += normal * (height * wave) as f32;
        }
        (body, waves)
    }
}

/// An arc of an ellipse from one angle to another (rad; 0 is its upper end, pi the lower one). Its centre is on the axis at the height
/// `middle`; `width` and `height` are half of its width and height.
fn arc(middle: f64, [width, height]: [f64; 2], [from, to]: [f64; 2]) -> Vec<[f64; 2]> {
    let point = |n: usize| {
        let (sine, cosine) = libm::sincos(from + (to - from) * n as f64 / PIECES as f64);
        [width * sine, middle + height * cosine]
    };
    (0..=PIECES).map(point).collect()
}

/// The line through points, no two of which coincide, divided into pieces of the same length.
fn even(line: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut so_far = vec![0.0];
    for pair in line.windows(2) {
        let piece = libm::hypot(pair[1][0] - pair[0][0], pair[1][1] - pair[0][1]);
        so_far.push(so_far[so_far.len() - 1] + piece);
    }
    let whole = so_far[so_far.len() - 1];
    let point = |n: usize| {
        let at = whole * n as f64 / PIECES as f64;
        let next = so_far.partition_point(|far| *far < at).clamp(1, line.len() - 1);
        let [before, behind] = [so_far[next - 1], so_far[next]];
        between(line[next - 1], line[next], (at - before) / (behind - before))
    };
    (0..=PIECES).map(point).collect()
}

/// The point at a share of the way from one to another.
fn between(from: [f64; 2], to: [f64; 2], share: f64) -> [f64; 2] {
    [0, 1].map(|axis| from[axis] + share * (to[axis] - from[axis]))
}
