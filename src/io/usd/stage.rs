//! The stage of a shot: its volumes, and value clips for the parts that have one USD file per frame.

use std::collections::BTreeMap;

use super::file::{BINARY, Format, Units};
use super::layer::{Attribute, Layer, Prim, Value};
use super::materials::{self, Look};
use super::mesh::MeshPrim;
use super::points;
use super::volumes::VolumeFiles;
use crate::error::Result;
use crate::geometry::Points;

/// Frames of a stage, and their rate.
#[derive(Debug, Clone, Copy)]
pub struct StageTime {
    /// First frame.
    pub first: i32,
    /// Last frame.
    pub last: i32,
    /// Frames per second.
    pub fps: f64,
}

/// A set of files, one per frame.
pub struct Clips<'a> {
    /// The prim that holds their contents.
    pub kind: &'static str,
    /// The existing frames, ascending, with their files, relative to the stage: `./objects/objects.0001.usdc`.
    pub files: Vec<(i32, String)>,
    /// Their contents.
    pub prims: ClipPrims<'a>,
}

/// The contents of a clip's files that all frames have in common.
pub enum ClipPrims<'a> {
    /// Moving meshes, under a prim of the kind's name.
    Meshes(Vec<MeshPrim<'a>>),
    /// A `Points` prim with the kind's name, as [`points::frame`] writes it; the points here only tell which attributes it declares.
    Points(Points),
}

/// Meshes that never change, in a file of their own beside the stage.
pub struct StillMeshes {
    /// The prim that holds them, and the name of the file: see [`still_path`].
    pub kind: &'static str,
    /// The bytes of the file.
    pub bytes: Vec<u8>,
    /// The meshes by name, with their materials.
    pub looks: Vec<(String, Look)>,
}

impl StillMeshes {
    /// Its prim in the shot.
    fn prim(&self) -> Prim {
        let mut prim = Prim::def("Xform", self.kind);
        prim.metadata.push(("prepend references", Value::Asset(format!("./{}", still_path(self.kind)))));
        for (name, look) in &self.looks {
            let mut mesh = Prim::over(name.as_str());
            mesh.schemas.push(Look::SCHEMA);
            look.bind(&mut mesh);
            prim.children.push(mesh);
        }
        prim
    }
}

/// Path of the file of meshes that never change, relative to the stage.
pub fn still_path(kind: &str) -> String {
    format!("{kind}.{BINARY}")
}

impl<'a> Clips<'a> {
    /// No frames yet.
    pub fn new(kind: &'static str, prims: ClipPrims<'a>) -> Self {
        Self { kind, files: Vec::new(), prims }
    }

    /// The materials of its prims.
    fn looks(&self) -> Vec<Look> {
        match &self.prims {
            ClipPrims::Meshes(meshes) => meshes.iter().map(|mesh| mesh.look).collect(),
            ClipPrims::Points(_) => vec![Look::Snow],
        }
    }

    /// Its prim in the shot.
    fn prim(&self) -> Prim {
        let mut prim = match &self.prims {
            ClipPrims::Meshes(meshes) => {
                let mut prim = Prim::def("Xform", self.kind);
                prim.children = meshes.iter().map(MeshPrim::defined).collect();
                prim
            }
            ClipPrims::Points(points) => {
                let mut prim = Prim::def("Points", self.kind);
                prim.schemas.push(Look::SCHEMA);
                // Viewports show grains only when asked for the render purpose.
                prim.add(Attribute::token("purpose", "render"));
                Look::Snow.bind(&mut prim);
                points::declared(points).into_iter().for_each(|attribute| prim.add(attribute));
                prim
            }
        };
        let numbered =
            || self.files.iter().enumerate().map(|(clip, (frame, _))| (f64::from(*frame), clip as f64));
        let set = BTreeMap::from([
            ("assetPaths", Value::Assets(self.files.iter().map(|(_, file)| file.clone()).collect())),
            ("manifestAssetPath", Value::Asset(format!("./{}", manifest_path(self.kind)))),
            ("primPath", Value::Text(format!("/{}", self.kind))),
            ("active", Value::DoublePairs(numbered().map(|(frame, clip)| [frame, clip]).collect())),
            ("times", Value::DoublePairs(numbered().map(|(frame, _)| [frame, frame]).collect())),
        ]);
        let clips = Value::Dictionary(BTreeMap::from([("default", Value::Dictionary(set))]));
        prim.metadata.push(("clips", clips));
        prim
    }
}

/// Path of the manifest of a kind, relative to the stage.
pub fn manifest_path(kind: &str) -> String {
    format!("{kind}/{kind}.manifest.usda")
}

/// The clip manifest, which USD requires: the attributes that the files of a kind have.
///
/// # Errors
/// A layer that cannot be written.
pub fn clip_manifest(kind: &str, prims: &ClipPrims) -> Result<Vec<u8>> {
    let mut root = Prim::over(kind);
    match prims {
        ClipPrims::Meshes(meshes) => root.children = meshes.iter().map(MeshPrim::varying).collect(),
        ClipPrims::Points(points) => {
            points::declared(points).into_iter().for_each(|attribute| root.add(attribute));
        }
    }
    Format::Text.bytes(Layer::new(root, Vec::new()))
}

/// Name of the layer with the samples of [`samples`], beside the stage.
pub const SAMPLES: &str = "shot.samples.usdc";

/// The values of a shot's volumes that vary with time.
///
/// # Errors
/// A layer that cannot be written.
pub fn samples(volumes: &[VolumeFiles]) -> Result<Vec<u8>> {
    let mut root = Prim::over(SHOT);
    root.children = volumes.iter().map(VolumeFiles::samples).collect();
    Format::Binary.bytes(Layer::new(root, Vec::new()))
}

/// The prim of a shot.
const SHOT: &str = "shot";

/// A stage with the shot's volumes, whose samples are in a layer of its own if there are any, clips, and meshes that never change.
///
/// # Errors
/// A layer that cannot be written.
pub fn stage(
    comment: &str,
    time: StageTime,
    volumes: &[VolumeFiles],
    clips: &[Clips],
    still: &[StillMeshes],
) -> Result<Vec<u8>> {
    let mut root = Prim::def("Xform", SHOT);
    let of_volumes = volumes.iter().filter_map(|volume| volume.look());
    let of_still = still.iter().flat_map(|still| still.looks.iter().map(|(_, look)| *look));
    let of_clips = clips.iter().flat_map(Clips::looks);
    let materials = materials::scope(of_volumes.chain(of_clips).chain(of_still).collect());
    let prims = volumes.iter().map(VolumeFiles::prim).chain(still.iter().map(StillMeshes::prim));
    root.children = materials.into_iter().chain(prims).chain(clips.iter().map(Clips::prim)).collect();
    let StageTime { first, last, fps } = time;
    let mut metadata = vec![("comment", Value::Text(comment.into()))];
    if !volumes.is_empty() {
        metadata.push(("subLayers", Value::Assets(vec![format!("./{SAMPLES}")])));
    }
    metadata.extend(Units::OWN.metadata(first, last, fps));
    metadata.push(("framesPerSecond", Value::Double(fps)));
    Format::Text.bytes(Layer::new(root, metadata))
}
