//! The stage `objects`: the objects as they move, with their velocities over the coming frame.

mod prims;

use std::sync::Arc;

use super::run::{
    DoneFrames, FileKind, FrameFiles, Reads, Report, Settings, Stage, StepTarget, Stepped, Stepping,
};
use super::{Role, Scene, moving};
use crate::context::Context;
use crate::error::Result;
use crate::geometry::{DVec3, TriMesh, Uvs, Vec3};
use crate::io::records::input_hashes::InputHashes;
use crate::io::records::manifest::Keeps;
use crate::io::usd::{ClipPrims, Clips};
use crate::io::{mesh, usd};
use crate::motion::Drawn;
use crate::scene::run::settings::settings_of;
use crate::sweep::Body;
use prims::{ObjectPrim, prims_of};

/// The moving objects of a scene.
pub struct Objects<'a> {
    scene: &'a Scene,
    bodies: &'a [Body],
    input_hashes: &'a Arc<InputHashes>,
    /// The prims of each object.
    prims: Vec<Vec<ObjectPrim>>,
}

/// The objects at a frame: positions (m) and velocities (m/s) of their vertices.
pub struct Poses {
    frame: i32,
    meshes: Vec<(Vec<Vec3>, Vec<Vec3>)>,
}

impl<'a> Objects<'a> {
    /// The objects of a scene; `bodies` are in its order.
    pub fn new(scene: &'a Scene, bodies: &'a [Body], input_hashes: &'a Arc<InputHashes>) -> Self {
        let drawn = bodies.iter().map(|body| body.motion().drawn());
        Self { scene, bodies, input_hashes, prims: prims_of(scene, drawn) }
    }

    /// All objects in one mesh.
    fn ply(&self, poses: &Poses, drawn: &[Drawn<'_>]) -> Vec<u8> {
        let (mut all, mut velocities) = (TriMesh::default(), Vec::new());
        for (drawn, (positions, of_mesh)) in drawn.iter().zip(&poses.meshes) {
            all.append(&TriMesh { positions: positions.clone(), triangles: drawn.triangles.to_vec() });
            velocities.extend_from_slice(of_mesh);
        }
        let uvs = Uvs::joined(drawn.iter().map(|drawn| (drawn.uvs, drawn.vertices, drawn.triangles)));
        let carried = mesh::Carried { velocities: &velocities, uvs: uvs.as_ref(), arrays: &[] };
        mesh::ply_bytes(&all, &carried)
    }

    /// A value clip with a mesh for each prim.
    fn usd(&self, poses: &Poses) -> usd::File {
        let of_objects = self.prims.iter().zip(&poses.meshes);
        let of_prims = of_objects.flat_map(|(prims, (points, velocities))| {
            prims.iter().map(move |prim| (prim, [prim.gather(points), prim.gather(velocities)]))
        });
        let of_prims: Vec<(&ObjectPrim, [Vec<Vec3>; 2])> = of_prims.collect();
        let frames: Vec<usd::MeshFrame> =
            of_prims.iter().map(|(prim, [points, velocities])| prim.frame(points, velocities)).collect();
        let (fps, units) = (self.scene.shot.fps, usd::Units::OWN);
        usd::clip("objects", poses.frame, fps, units, &frames)
    }
}

impl Stage for Objects<'_> {
    fn name(&self) -> &'static str {
        "objects"
    }

    fn kinds(&self) -> &'static [FileKind] {
        &[FileKind { name: "objects", extensions: &["usdc", "usda", "ply"] }]
    }

    fn usd_kinds(&self) -> Vec<&'static str> {
        self.scene.output.objects_usd.then_some("objects").into_iter().collect()
    }

    fn settings(&self) -> Result<Settings> {
        settings_of(self.scene, self.name(), self.input_hashes, &Role::MOVING)
    }

    /// Earlier versions wrote one prim for all nodes of a character.
    fn is_outdated(&self, done: &DoneFrames) -> Result<bool> {
        let Some(first) = done.frames().next().filter(|_| self.scene.output.objects_usd) else {
            return Ok(false);
        };
        let Some(contents) = done.contents(first, "objects")? else { return Ok(false) };
        Ok(self.prims.iter().flatten().any(|prim| contents.get(&prim.name).is_none()))
    }

    fn has_memory(&self) -> bool {
        false
    }

    fn reads(&self, frame: i32) -> Reads {
        Reads { files: moving::files(self.scene, frame), ahead: moving::files_ahead(self.scene, frame) }
    }

    fn keeps(&self, _frame: i32) -> Keeps {
        Keeps::Whole
    }

    fn clips(&self) -> Vec<Clips<'_>> {
        let meshes = self.prims.iter().flatten().map(ObjectPrim::mesh).collect();
        vec![Clips::new("objects", ClipPrims::Meshes(meshes))]
    }
}

impl Stepping for Objects<'_> {
    type State = ();
    type Step = Option<Poses>;
    type Writer = ();

    fn load(&self, _ctx: &Context, _done: &DoneFrames, _after: Option<i32>) -> Result<()> {
        Ok(())
    }

    fn step(&self, ctx: &Context, _state: &mut (), to: &StepTarget<'_>) -> Result<Stepped<Option<Poses>>> {
        let StepTarget { frame, made_from, .. } = *to;
        let fps = self.scene.shot.fps;
        let mut meshes = Vec::with_capacity(self.bodies.len());
        let (mut pose, mut velocities) = (Vec::<DVec3>::new(), Vec::<DVec3>::new());
        for body in self.bodies.iter().filter(|_| made_from.is_some()) {
            ctx.check()?;
            body.motion().drawn_pose(f64::from(frame) / fps, &mut pose)?;
            body.motion().velocities_ahead(f64::from(frame) / fps, 1.0 / fps, &mut velocities)?;
            meshes.push((usd::to_floats(&pose), usd::to_floats(&velocities)));
        }
        let step = made_from.map(|_| Poses { frame, meshes });
        Ok(Stepped { step, report: Report::default() })
    }

    fn writer(&self, _ctx: &Context, _state: &()) -> Result<()> {
        Ok(())
    }

    fn writes_frames_independently(&self) -> bool {
        true
    }

    fn write(&self, _writer: &mut (), step: Option<Poses>, files: Option<&mut FrameFiles>) -> Result<()> {
        let (Some(poses), Some(files)) = (step, files) else { return Ok(()) };
        if self.scene.output.objects_ply {
            let drawn: Vec<Drawn> = self.bodies.iter().map(|body| body.motion().drawn()).collect();
            files.save("objects", "ply", &self.ply(&poses, &drawn))?;
        }
        if self.scene.output.objects_usd {
            files.save_usd("objects", self.usd(&poses))?;
        }
        Ok(())
    }
}
