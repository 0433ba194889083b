//! Meshes that follow a liquid in scenes: the keys of `[surface]`, the contents of its files ([`Inputs`]), the check ([`check`]), estimates
//! of memory and disk space, and the stage `surface` (`track/`).

#[cfg(feature = "vdb")]
mod check;
#[cfg(feature = "vdb")]
mod estimate;
#[cfg(feature = "vdb")]
mod inputs;
mod keys;
#[cfg(feature = "vdb")]
mod pipeline;
#[cfg(feature = "vdb")]
mod track;

use std::path::PathBuf;

pub(super) use keys::KEYS;
#[cfg(feature = "vdb")]
pub use {
    check::{Report, check},
    estimate::costs::costs,
    inputs::Inputs,
    pipeline::pipeline,
};

use super::Frames;
use super::schema::Values;
use crate::io::files::sequence::Pattern;
use crate::motion::Space;
use crate::surface::Weighting;

/// A mesh that follows the particles of a liquid, and its output.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    /// A particle file, or the pattern of a sequence.
    pub particles: PathBuf,
    /// The mesh at the first frame; `None`: the particles' own surface there.
    pub mesh: Option<PathBuf>,
    /// The pattern of edited meshes, which need not exist for every frame; `None`: there are none.
    pub resculpt: Option<PathBuf>,
    /// The files' unit and upward axis.
    pub space: Space,
    /// The sequence starts this many frames later.
    pub offset: f64,
    /// Frames of the sequence per frame of the shot.
    pub speed: f64,
    /// Initial distance between particles (m); `None`: estimated.
    pub spacing: Option<f64>,
    /// Edge of a cell (spacings).
    pub cell: f64,
    /// Maximum distance that projection moves a vertex (spacings).
    pub change: f64,
    /// Whether the mesh is rebuilt where the liquid merges or splits; else it is flagged there.
    pub rebuild: bool,
    /// If it is rebuilt: whether its topology is matched everywhere in every step; else only where vertices are flagged.
    pub every: bool,
    /// If it is rebuilt: parts with fewer particles are removed, unless the mesh is a single part.
    pub min_drop: usize,
    /// If it is rebuilt: number of frames before a change over which the mesh eases towards the change (0..=100).
    pub ahead: i32,
    /// How particles carry vertices.
    pub weighting: Weighting,
    /// Time in which half of the detail fades (s); `None`: it stays.
    pub half_life: Option<f64>,
    /// How much detail fades where the mesh is strained.
    pub fade: f64,
    /// Which files are written.
    pub output: Files,
}

/// Which files and arrays of the mesh are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Files {
    /// `surface/surface.%04d.ply`.
    pub ply: bool,
    /// `surface/surface.%04d.obj`.
    pub obj: bool,
    /// `surface/surface.%04d.usdc`.
    pub usd: bool,
    /// The arrays of velocities over the coming frame.
    pub velocities: bool,
    /// The array `delta`: the distance from the particles' surface that each vertex keeps.
    pub delta: bool,
    /// The array `flagged`: whether a vertex is flagged.
    pub flagged: bool,
    /// The array `rebuilt`: whether a face was created, and whether its texture is torn.
    pub rebuilt: bool,
}

impl Surface {
    /// The mesh of a scene; `None` if it has no such table.
    pub(super) fn of(values: &Values) -> Option<Self> {
        let (keys, output) = (values.table("surface"), values.table("output"));
        Some(Self {
            particles: keys.find("particles")?,
            mesh: keys.find("mesh"),
            resculpt: keys.find("resculpt"),
            space: keys.space(),
            offset: keys.get("offset"),
            speed: keys.get("speed"),
            spacing: keys.find("spacing"),
            cell: keys.get("cell"),
            change: keys.get("change"),
            rebuild: keys.get("rebuild"),
            every: keys.text("match") == Some("every"),
            min_drop: keys.get("min_drop"),
            ahead: keys.get("ahead"),
            weighting: match keys.text("weighting") {
                Some("mean") => Weighting::Mean,
                _ => Weighting::Affine,
            },
            half_life: keys.find("half_life"),
            fade: keys.get("fade"),
            output: Files {
                ply: output.holds("surface", "ply"),
                obj: output.holds("surface", "obj"),
                usd: output.holds("surface", "usd"),
                velocities: output.holds("attributes", "v"),
                delta: output.holds("attributes", "delta"),
                flagged: output.holds("attributes", "flagged"),
                rebuilt: output.holds("attributes", "rebuilt"),
            },
        })
    }

    /// The time of a frame of the shot, in frames of the sequence.
    pub(super) fn time(&self, shot: Frames, frame: i32) -> f64 {
        let passed = f64::from(frame) - f64::from(shot.first);
        let time = f64::from(shot.first) - self.offset + self.speed * passed;
        // Without this a rounding error would cause one more file to be read.
        let whole = time.round();
        if (time - whole).abs() < 1e-6 { whole } else { time }
    }

    /// The files that hold the particles at a frame of the shot: one, or the two around it.
    pub(super) fn files_at(&self, shot: Frames, frame: i32) -> Vec<PathBuf> {
        let time = self.time(shot, frame);
        self.files(time, time)
    }

    /// The files between two times, in frames of the sequence.
    pub(super) fn files(&self, from: f64, to: f64) -> Vec<PathBuf> {
        match Pattern::parse(&self.particles) {
            None => vec![self.particles.clone()],
            Some(pattern) => {
                (from.floor() as i32..=to.ceil() as i32).map(|file| pattern.path(file)).collect()
            }
        }
    }
}
