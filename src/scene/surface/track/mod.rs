//! The stage `surface`: a detailed mesh follows the particles of a liquid.

#[cfg(feature = "vdb")]
mod frame_report;
#[cfg(feature = "vdb")]
mod saved_arrays;
#[cfg(feature = "vdb")]
mod tracked_shot;
#[cfg(feature = "vdb")]
mod vertex_paths;

use std::sync::Arc;

use super::{Inputs, Surface};
use crate::context::Context;
use crate::error::Result;
use crate::geometry::mesh::attributes::{Number, On};
use crate::geometry::{DetailedMesh, MeshArray, TriMesh, Vec3};
use crate::io::usd::materials::Look;
use crate::io::usd::{ClipPrims, Clips, MeshPrim, Shading, primvars};
use crate::io::{mesh, usd};
use crate::mesh_repair::Traced;
use crate::scene::Scene;
use crate::scene::run::settings::{settings_of, settings_of_first_state};
use crate::scene::run::{
    CONTENT, DoneFrames, FileKind, FrameFiles, Reads, Settings, Stage, StepTarget, Stepped, Stepping,
};
use tracked_shot::{TrackedFrame, TrackedShot, reads};

/// Name of the stage, and of the kind of its files.
const NAME: &str = "surface";

/// The stage for a scene.
pub struct Track<'a> {
    pub scene: &'a Scene,
    pub surface: &'a Surface,
    pub inputs: &'a Inputs,
}

/// The mesh at a frame whose files are written; empty for a frame without particles.
#[derive(Default)]
pub struct WrittenMesh {
    mesh: TriMesh,
    /// The data that the mesh carries; `None`: those of the first mesh.
    detail: Option<Arc<DetailedMesh>>,
    velocities: Vec<Vec3>,
    delta: Vec<f32>,
    flags: Vec<bool>,
    state: Vec<u8>,
}

impl Track<'_> {
    /// The arrays that each frame computes. `unchanged_faces` is the count of faces of a mesh that was never rebuilt and carries no mask of
    /// created faces: such a mesh gets a mask of zeros.
    fn arrays(&self, delta: &[f32], flags: &[bool], unchanged_faces: Option<usize>) -> Vec<MeshArray> {
        let array = |name: &str, on, number, values| MeshArray { name: name.into(), on, number, values };
        let output = self.surface.output;
        let delta = output.delta.then(|| {
            let values = delta.iter().map(|delta| f64::from(*delta)).collect();
            array("delta", On::Vertices, Number::F32, values)
        });
        let flagged = output.flagged.then(|| {
            let values = flags.iter().map(|flag| f64::from(u8::from(*flag))).collect();
            array("flagged", On::Vertices, Number::U8, values)
        });
        let unchanged_faces = unchanged_faces.filter(|_| output.rebuilt);
        let rebuilt =
            unchanged_faces.map(|faces| array(Traced::MASK, On::Faces, Number::U8, vec![0.0; faces]));
        delta.into_iter().chain(flagged).chain(rebuilt).collect()
    }

    /// The arrays that the mesh carries and that are written.
    fn carried<'m>(&self, detail: &'m DetailedMesh) -> impl Iterator<Item = &'m MeshArray> {
        let is_written = self.surface.output.rebuilt;
        detail.arrays.iter().filter(move |array| is_written || array.name != Traced::MASK)
    }
}

impl Stage for Track<'_> {
    fn name(&self) -> &'static str {
        NAME
    }

    fn noun(&self) -> &'static str {
        "mesh"
    }

    fn kinds(&self) -> &'static [FileKind] {
        &[FileKind { name: NAME, extensions: &["ply", "usdc", "usda", "obj"] }]
    }

    fn writes(&self, _kind: &str) -> bool {
        let output = self.surface.output;
        output.ply || output.usd || output.obj
    }

    fn state_extension(&self) -> &'static str {
        NAME
    }

    fn keeps_every_state(&self) -> bool {
        true
    }

    fn usd_kinds(&self) -> Vec<&'static str> {
        self.surface.output.usd.then_some(NAME).into_iter().collect()
    }

    fn settings(&self) -> Result<Settings> {
        let input_hashes = &self.inputs.input_hashes;
        let mut settings = settings_of(self.scene, NAME, input_hashes, &[])?;
        settings.insert("surface.particles".into(), format!("{CONTENT}of each frame"));
        settings.insert("surface.spacing".into(), format!("{:?}", self.inputs.spacing));
        if self.surface.resculpt.is_some() {
            settings.insert("surface.resculpt".into(), format!("{CONTENT}of each frame"));
        }
        if let Some(path) = &self.surface.mesh {
            settings.insert("surface.mesh".into(), format!("{CONTENT}{}", input_hashes.hash(path)?));
        }
        Ok(settings)
    }

    fn first_state_settings(&self, settings: &Settings) -> Settings {
        settings_of_first_state(self.scene.values.keys(), settings, NAME)
    }

    fn reads(&self, frame: i32) -> Reads {
        reads(self.scene, self.surface, self.inputs, frame)
    }

    fn clips(&self) -> Vec<Clips<'_>> {
        let (mesh, frame_arrays) = (&self.inputs.mesh, self.arrays(&[], &[], Some(0)));
        let arrays: Vec<&MeshArray> = self.carried(mesh).chain(&frame_arrays).collect();
        let primvars = primvars::primvars(&arrays);
        let uvs = mesh.uvs.as_ref();
        let (name, shading) = (NAME.into(), Shading::Smooth);
        let mesh = MeshPrim { name, look: Look::Object, moves: true, uvs, primvars, shading };
        vec![Clips::new(NAME, ClipPrims::Meshes(vec![mesh]))]
    }
}

impl<'a> Stepping for Track<'a> {
    type State = TrackedShot<'a>;
    type Step = Option<WrittenMesh>;
    type Writer = ();

    fn load(&self, ctx: &Context, done: &DoneFrames, after: Option<i32>) -> Result<TrackedShot<'a>> {
        let Some(frame) = after else {
            // A mesh that is not near the particles is refused before anything is written.
            return TrackedShot::begin(ctx, self.scene, self.surface, self.inputs);
        };
        let params = self.surface.params(self.inputs.spacing);
        let saved = done.resume(frame, |bytes| saved_arrays::resume(params, &self.inputs.mesh, bytes))?;
        TrackedShot::resume(ctx, (self.scene, self.surface, self.inputs), frame, saved)
    }

    fn step(
        &self,
        ctx: &Context,
        shot: &mut TrackedShot<'a>,
        to: &StepTarget<'_>,
    ) -> Result<Stepped<Self::Step>> {
        shot.advance_to(ctx, to.frame)?;
        let TrackedFrame { tracker, detail, report, source, is_dry, .. } = shot.current();
        let written = || {
            let carried = detail.as_deref().unwrap_or(&self.inputs.mesh);
            let state = saved_arrays::save(tracker, carried, source.sculpted);
            if *is_dry {
                let detail = Some(Arc::new(carried.emptied()));
                return Ok(WrittenMesh { detail, state, ..WrittenMesh::default() });
            }
            let (positions, velocities) = shot.output_vertices(ctx)?;
            let positions = usd::to_floats(&positions);
            let mesh = TriMesh { positions, triangles: tracker.triangles().to_vec() };
            let (delta, flags) = (tracker.delta().to_vec(), tracker.flags().to_vec());
            Ok(WrittenMesh { mesh, detail: detail.clone(), velocities, delta, flags, state })
        };
        Ok(Stepped { step: to.made_from.map(|_| written()).transpose()?, report: report.clone() })
    }

    fn writer(&self, _ctx: &Context, _shot: &TrackedShot<'a>) -> Result<()> {
        Ok(())
    }

    fn writes_frames_independently(&self) -> bool {
        true
    }

    fn write(&self, _writer: &mut (), step: Self::Step, files: Option<&mut FrameFiles>) -> Result<()> {
        let (Some(step), Some(files)) = (step, files) else { return Ok(()) };
        let (output, detail) = (self.surface.output, step.detail.as_deref().unwrap_or(&self.inputs.mesh));
        let has_mask = detail.arrays.iter().any(|array| array.name == Traced::MASK);
        let unchanged_faces = (!has_mask).then_some(step.mesh.triangles.len());
        let frame_arrays = self.arrays(&step.delta, &step.flags, unchanged_faces);
        let arrays: Vec<&MeshArray> = self.carried(detail).chain(&frame_arrays).collect();
        let with_velocities =
            mesh::Carried { velocities: &step.velocities, uvs: detail.uvs.as_ref(), arrays: &arrays };
        let velocities = if output.velocities { with_velocities.velocities } else { &[] };
        let carried = mesh::Carried { velocities, ..with_velocities };
        if output.ply {
            files.save(NAME, "ply", &mesh::ply_bytes(&step.mesh, &carried))?;
        }
        if output.obj {
            files.save(NAME, "obj", &mesh::obj_bytes(&step.mesh, &carried))?;
        }
        if output.usd {
            files.save_clip(NAME, self.scene.shot.fps, &step.mesh, &with_velocities)?;
        }
        files.save_state(&step.state)
    }
}
