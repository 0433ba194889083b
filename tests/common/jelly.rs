//! A ball of jelly with raised letters: it falls, is squashed, bends and twists. Where each position of it goes is a formula that
//! keeps all volumes, so that it moves as a viscous liquid may.

use std::f64::consts::TAU;
use std::path::Path;

use frazil::geometry::mesh::attributes::{Number, On};
use frazil::geometry::points::{Column, Points, Values};
use frazil::geometry::{DVec3, MeshArray, TriMesh};
use frazil::io::files::atomic;
use frazil::io::{mesh, particles};

use super::liquids::filled;
use super::shapes::globe;

/// Frames of the shot, from 1 on.
pub const FRAMES: i32 = 36;
/// Frames per second.
const FPS: f64 = 24.0;
/// Radius of the ball (m).
const RADIUS: f64 = 0.2;
/// Time at which it touches the ground (s).
const CONTACT: f64 = 4.0 / FPS;
/// Acceleration of its fall (m/s2).
const GRAVITY: f64 = 9.81;
/// How far letters and flutes stand out of it (m).
const LETTERS: f64 = 0.011;
const FLUTES: f64 = 0.005;
/// Edge of a square of a letter, as an angle seen from the centre (rad).
const SQUARE: f64 = 0.066;
/// Its letters, in squares.
const TEXT: [&str; 7] = [
    "#####.####...###..#####.###.#....",
    "#.....#...#.#...#.....#..#..#....",
    "#.....#...#.#...#....#...#..#....",
    "####..####..#####...#....#..#....",
    "#.....#.#...#...#..#.....#..#....",
    "#.....#..#..#...#.#......#..#....",
    "#.....#...#.#...#.#####.###.#####",
];

/// The ball at rest around the origin, its letters towards +z.
pub struct Jelly {
    /// Distance between particles (m).
    pub spacing: f64,
    /// Positions of the particles (m).
    pub positions: Vec<DVec3>,
    /// The sculpted surface.
    pub mesh: TriMesh,
}

impl Jelly {
    /// A ball of particles so far apart (m), and a mesh of 4 n (n - 1) triangles.
    pub fn new(spacing: f64, n: usize) -> Self {
        let size = RADIUS + LETTERS + FLUTES;
        // The surface of particles lies half a spacing above the outermost.
        let is_inside = |position: DVec3| position.norm() + 0.5 * spacing <= reach(direction(position));
        let positions = filled(spacing, 0.1, size, is_inside);
        let mut mesh = globe(1.0, 2 * n, n);
        for position in &mut mesh.positions {
            let unit = direction(position.cast());
            *position = (unit * reach(unit)).cast();
        }
        Self { spacing, positions, mesh }
    }

    /// Numbers of the mesh's vertices that tell letters from the body: 1 on letters, less beside them.
    pub fn paint(&self) -> MeshArray {
        let values = self.mesh.positions.iter().map(|position| paint(direction(position.cast()))).collect();
        MeshArray { name: "paint".into(), on: On::Vertices, number: Number::F32, values }
    }

    /// The particles at a frame, with ids and the radius of what they are drawn as.
    ///
    /// # Errors
    /// None for a spacing over 0.
    pub fn points(&self, frame: i32) -> frazil::Result<Points> {
        let positions: Vec<DVec3> = self.positions.iter().map(|position| moved(*position, frame)).collect();
        let mut points = Points::at(self.spacing, &positions)?;
        points.set("id", Values::Long(Column::Each((0..positions.len() as i64).collect())));
        points.set("pscale", Values::Float(Column::Uniform((0.5 * self.spacing) as f32)));
        Ok(points)
    }

    /// The mesh at the first frame, which is where the tracker finds it.
    pub fn first_mesh(&self) -> TriMesh {
        let mut mesh = self.mesh.clone();
        mesh.positions.iter_mut().for_each(|position| *position = moved(position.cast(), 1).cast());
        mesh
    }

    /// The scene of its shot.
    pub fn scene(&self) -> String {
        format!(
            "[shot]\nframes = \"1-{FRAMES}\"\nfps = {FPS:?}\n\n[surface]\nparticles = \"liquid.%04d.bgeo\"\n\
             mesh = \"liquid.ply\"\nspacing = {:?}\n",
            self.spacing
        )
    }

    /// Writes liquid.0001.bgeo and so on, liquid.ply and liquid.toml into a folder.
    ///
    /// # Errors
    /// What the operating system reports.
    pub fn write(&self, folder: &Path) -> frazil::Result<()> {
        for frame in 1..=FRAMES {
            particles::write(&folder.join(format!("liquid.{frame:04}.bgeo")), &self.points(frame)?, false)?;
        }
        let paint = self.paint();
        let carried = mesh::Carried { arrays: &[&paint], ..mesh::Carried::default() };
        mesh::write_carried(&folder.join("liquid.ply"), &self.first_mesh(), &carried)?;
        atomic::write_bytes(&folder.join("liquid.toml"), self.scene().as_bytes())
    }
}

/// Where a position of the ball at rest is at a frame (m).
pub fn moved(position: DVec3, frame: i32) -> DVec3 {
    let time = f64::from(frame - 1) / FPS;
    let since = (time - CONTACT).max(0.0);
    let fallen = 0.5 * GRAVITY * (CONTACT * CONTACT - time * time).max(0.0);
    // Decays by e in 1 / `rate` seconds.
    let swing =
        |most: f64, rate: f64, hertz: f64| most * libm::exp(-rate * since) * libm::sin(TAU * hertz * since);
    // Each of these steps keeps volumes: lower and as much wider; layers turned; layers moved.
    let lower = 1.0 - swing(0.4, 2.5, 1.8);
    let wider = 1.0 / lower.sqrt();
    let (x, y, z) = (position.x * wider, (position.y + RADIUS) * lower, position.z * wider);
    let (sine, cosine) = libm::sincos(swing(2.4, 1.0, 1.25) * y);
    let (x, z) = (x * cosine + z * sine, z * cosine - x * sine);
    DVec3::new(x + swing(1.1, 1.2, 1.6) * y * y, y + fallen, z)
}

/// The unit vector to a position; up for the centre.
fn direction(position: DVec3) -> DVec3 {
    position.try_normalize(0.0).unwrap_or_else(DVec3::y)
}

/// Distance of the surface from the centre in a direction (m).
fn reach(direction: DVec3) -> f64 {
    RADIUS + LETTERS * letters(direction) + FLUTES * flutes(direction)
}

/// How much a direction belongs to a letter, 0 to 1: between the squares' middles the text is interpolated, and its edge steepened.
fn letters(direction: DVec3) -> f64 {
    let (longitude, latitude) = angles(direction);
    let column = longitude / SQUARE + 0.5 * (TEXT[0].len() as f64 - 1.0);
    let row = 0.5 * (TEXT.len() as f64 - 1.0) - latitude / SQUARE;
    let (left, above) = (column.floor(), row.floor());
    let (right, down) = (column - left, row - above);
    let ink = |x: f64, y: f64| {
        let square = TEXT.get(y as usize).and_then(|line| line.as_bytes().get(x as usize));
        if x >= 0.0 && y >= 0.0 && square == Some(&b'#') { 1.0 } else { 0.0 }
    };
    let upper = ink(left, above) * (1.0 - right) + ink(left + 1.0, above) * right;
    let lower = ink(left, above + 1.0) * (1.0 - right) + ink(left + 1.0, above + 1.0) * right;
    smooth((upper * (1.0 - down) + lower * down - 0.3) / 0.4)
}

/// Flutes above and below the letters, -1 to 1.
fn flutes(direction: DVec3) -> f64 {
    let (longitude, latitude) = angles(direction);
    let level = direction.x * direction.x + direction.z * direction.z;
    libm::cos(12.0 * longitude + 5.0 * latitude) * level * smooth((latitude.abs() - 0.3) / 0.15)
}

/// A number for the colour of a direction, 0 to 1.
fn paint(direction: DVec3) -> f64 {
    let stripes = (4.0 * flutes(direction)).clamp(-1.0, 1.0);
    let body = 0.3 + 0.2 * stripes;
    body + (1.0 - body) * letters(direction)
}

/// Longitude (0 towards +z, greater towards +x) and latitude of a direction (rad).
fn angles(direction: DVec3) -> (f64, f64) {
    (libm::atan2(direction.x, direction.z), libm::asin(direction.y.clamp(-1.0, 1.0)))
}

/// From 0 to 1 without a corner while `part` does so.
fn smooth(part: f64) -> f64 {
    let part = part.clamp(0.0, 1.0);
    part * part * (3.0 - 2.0 * part)
}
