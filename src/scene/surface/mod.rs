//! Meshes that follow a liquid in scenes: the keys of `[surface]`, what the files hold ([`Inputs`]), what a check says of it
//! ([`check`]), memory and disk space that it takes among it, and the stage `surface` (`track.rs`).

#[cfg(feature = "vdb")]
mod check;
mod estimate;
#[cfg(feature = "vdb")]
mod inputs;
mod keys;
#[cfg(feature = "vdb")]
mod plan;
#[cfg(feature = "vdb")]
mod track;

use std::path::PathBuf;

pub(super) use keys::KEYS;
#[cfg(feature = "vdb")]
pub use {
    check::{Report, check},
    inputs::Inputs,
    plan::plan,
};

use super::Frames;
use super::schema::{Value, Values};
use crate::io::files::sequence::Pattern;
use crate::motion::{Space, Up};
use crate::surface::Weighting;

/// A mesh that follows the particles of a liquid, and what is written of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// A file of particles, or the pattern of a sequence.
    pub particles: PathBuf,
    /// The mesh at the first frame; none: the particles' own surface there.
    pub mesh: Option<PathBuf>,
    /// The pattern of edited meshes, which need not be there for each frame; none: there are none.
    pub resculpt: Option<PathBuf>,
    /// The files' unit and upward axis.
    pub space: Space,
    /// The sequence starts this many frames later.
    pub offset: f64,
    /// Frames of the sequence that pass in one of the shot.
    pub speed: f64,
    /// Initial distance between particles (m); none: it is estimated.
    pub spacing: Option<f64>,
    /// Edge of a cell (spacings).
    pub cell: f64,
    /// Greatest distance that projection moves a vertex (spacings).
    pub change: f64,
    /// The mesh is rebuilt where the liquid merges or splits; else it is flagged there.
    pub rebuild: bool,
    /// Where it is rebuilt, its topology is matched all over it in every step; else where vertices are flagged.
    pub every: bool,
    /// Where it is rebuilt, least count of particles in a part of it.
    pub min_drop: usize,
    /// Where it is rebuilt, frames before a change from which on it eases towards it (0..=100).
    pub ahead: i32,
    /// How particles carry vertices.
    pub weighting: Weighting,
    /// Time in which half of the detail fades (s); none: it stays.
    pub half_life: Option<f64>,
    /// How much detail fades where the mesh is strained.
    pub fade: f64,
    /// What is written.
    pub output: Files,
}

/// What is written of the mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Files {
    /// `surface/surface.%04d.ply`.
    pub ply: bool,
    /// `surface/surface.%04d.obj`.
    pub obj: bool,
    /// `surface/surface.%04d.usda`.
    pub usd: bool,
    /// Velocities over the coming frame.
    pub velocities: bool,
    /// The distance that each vertex keeps.
    pub delta: bool,
    /// Whether a vertex is flagged.
    pub flagged: bool,
    /// Whether a face was made, and its texture torn.
    pub rebuilt: bool,
}

impl Surface {
    /// That of a scene; none where it has no such table.
    pub(super) fn of(values: &Values) -> Option<Self> {
        let value = |name: &str| values.get(&format!("surface.{name}"));
        let number = |name: &str| value(name).and_then(Value::number);
        let text = |name: &str| value(name).and_then(Value::text);
        let asked = |name: &str, text: &str| values.get(name).is_some_and(|value| value.holds(text));
        Some(Self {
            particles: value("particles")?.path()?.to_path_buf(),
            mesh: value("mesh").and_then(Value::path).map(Into::into),
            resculpt: value("resculpt").and_then(Value::path).map(Into::into),
            space: Space {
                scale: values.settled("surface", None, "scale"),
                up: if text("up") == Some("z") { Up::Z } else { Up::Y },
                origin: value("origin").and_then(Value::numbers::<3>).unwrap_or_default().into(),
            },
            offset: values.settled("surface", None, "offset"),
            speed: values.settled("surface", None, "speed"),
            spacing: number("spacing"),
            cell: values.settled("surface", None, "cell"),
            change: values.settled("surface", None, "change"),
            rebuild: values.settled("surface", None, "rebuild"),
            every: text("match") == Some("every"),
            min_drop: values.settled::<i64>("surface", None, "min_drop") as usize,
            ahead: values.settled::<i64>("surface", None, "ahead") as i32,
            weighting: match text("weighting") {
                Some("mean") => Weighting::Mean,
                _ => Weighting::Affine,
            },
            half_life: number("half_life"),
            fade: values.settled("surface", None, "fade"),
            output: Files {
                ply: asked("output.surface", "ply"),
                obj: asked("output.surface", "obj"),
                usd: asked("output.surface", "usd"),
                velocities: asked("output.attributes", "v"),
                delta: asked("output.attributes", "delta"),
                flagged: asked("output.attributes", "flagged"),
                rebuilt: asked("output.attributes", "rebuilt"),
            },
        })
    }

    /// The time of a frame of the shot, in frames of the sequence.
    pub(super) fn time(&self, shot: Frames, frame: i32) -> f64 {
        let passed = f64::from(frame) - f64::from(shot.first);
        let time = f64::from(shot.first) - self.offset + self.speed * passed;
        // What rounding leaves would read one file more.
        let whole = time.round();
        if (time - whole).abs() < 1e-6 { whole } else { time }
    }

    /// The files that hold the particles at a frame of the shot: one, or the two around it.
    pub(super) fn files_at(&self, shot: Frames, frame: i32) -> Vec<PathBuf> {
        let time = self.time(shot, frame);
        self.files(time, time)
    }

    /// The files from a time to another, in frames of the sequence.
    pub(super) fn files(&self, from: f64, to: f64) -> Vec<PathBuf> {
        match Pattern::parse(&self.particles) {
            None => vec![self.particles.clone()],
            Some(pattern) => {
                (from.floor() as i32..=to.ceil() as i32).map(|file| pattern.path(file)).collect()
            }
        }
    }
}
