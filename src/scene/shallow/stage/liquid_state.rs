//! The liquid of a scene, and how it advances from frame to frame.

use super::saved_liquid;
use super::surroundings_usd::TerrainFrame;
use crate::context::Context;
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::scene::Scene;
use crate::scene::shallow::inputs::united;
use crate::scene::shallow::inputs::{flow_points, obstacles, pours};
use crate::scene::shallow::{Inputs, Shallow, TimedFlowPoint};
use crate::shallow::remap::Moved;
use crate::shallow::sources::FlowPoint;
use crate::shallow::terrain::shapes::Shape;
use crate::shallow::terrain::{Solids, triangles};
use crate::shallow::{self, Report, Stains};

/// A scene, the setup of its liquid, and the contents of its files.
type SceneInputs<'a> = (&'a Scene, &'a Shallow, &'a Inputs);

/// A scene's liquid, at a frame.
pub(in crate::scene::shallow) struct LiquidState<'a> {
    scene: &'a Scene,
    setup: &'a Shallow,
    inputs: &'a Inputs,
    pub liquid: shallow::Shallow,
    /// The obstacles that stand in it.
    pub shapes: Vec<Shape>,
    /// Its sources, drains and absorbers.
    pub points: Vec<FlowPoint>,
    pub frame: i32,
    /// Its stains on the terrain.
    pub stains: Option<Stains>,
    /// The terrain, if it is a mesh that moves (m).
    ground: Option<TriMesh>,
    /// Whether terrain or obstacles have changed since minimum heights were last found.
    pub has_new_ground: bool,
}

impl<'a> LiquidState<'a> {
    /// The liquid at the first frame.
    ///
    /// # Errors
    /// A source inside solid, and anything else that a liquid refuses; cancel.
    pub fn begin(ctx: &Context, (scene, setup, inputs): SceneInputs<'a>) -> Result<Self> {
        let first = scene.shot.frames.first;
        let shapes = obstacles::shapes_at(setup, first)?;
        let mut state = Self::dry(ctx, (scene, setup, inputs), first, shapes)?;
        flow_points::add(scene, setup, &mut state.liquid, &state.points)?;
        setup.set_source_scalars(&mut state.liquid)?;
        state.liquid.set_poured(&setup.start())?;
        if let Some(height) = setup.fill {
            state.liquid.fill(height);
        }
        pours::pour(scene, setup, &mut state.liquid, first)?;
        Ok(state)
    }

    /// Resumes from a state saved at a frame.
    ///
    /// # Errors
    /// Files that can no longer be read; a state for another terrain.
    pub fn resume(
        ctx: &Context,
        (scene, setup, inputs): SceneInputs<'a>,
        frame: i32,
        bytes: &[u8],
    ) -> Result<Self> {
        let saved = saved_liquid::read(bytes)?;
        let mut state = Self::dry(ctx, (scene, setup, inputs), frame, saved.shapes)?;
        // Since the first frame the terrain may have covered some points, which then rest.
        let named = |index: usize| format!("flow point {}", index + 1);
        state.liquid.set_flows_resting(&saved.points, named)?;
        state.liquid.restore(&saved.liquid)?;
        if let Some(stains) = &mut state.stains {
            stains.restore(&saved.stains)?;
        }
        if state.points != saved.points {
            // The scene's points have changed: the new ones apply from this frame on.
            state.liquid.set_flows_resting(&state.points, |index| setup.points[index].title())?;
        }
        setup.set_source_scalars(&mut state.liquid)?;
        Ok(state)
    }

    /// Dry ground at a frame, with obstacles; the flow points are not yet added to the liquid.
    fn dry(
        ctx: &Context,
        (scene, setup, inputs): SceneInputs<'a>,
        frame: i32,
        obstacles: Vec<Shape>,
    ) -> Result<Self> {
        let (ground, solids) = inputs.terrain_and_solids(setup, frame)?.unzip();
        let solids = solids.as_ref().unwrap_or(&inputs.solids);
        let points = flow_points::at_frame(setup, inputs, ground.as_ref(), frame);
        let liquid = shallow::Shallow::new(ctx, solids, setup.params.clone());
        let mut liquid = liquid.map_err(|error| error.in_file(&scene.path))?;
        setup.set_scalars(scene, &mut liquid)?;
        let stained = setup.staining.zip(ground.as_ref().or(inputs.still_terrain.as_ref()));
        let stains = stained.map(|(how, mesh)| Stains::new(&liquid, &mesh.positions, &mesh.triangles, how));
        let stains = stains.transpose()?;
        let (shapes, has_new_ground) = (Vec::new(), true);
        let mut state =
            Self { scene, setup, inputs, liquid, shapes, points, frame, stains, ground, has_new_ground };
        state.set_obstacles(obstacles)?;
        Ok(state)
    }

    /// Advances to the next frame; returns the report of the flow, and the effect of moving terrain and obstacles on the liquid.
    ///
    /// # Errors
    /// Files that cannot be read; errors of a step; cancel.
    pub fn advance(&mut self, ctx: &Context) -> Result<(Report, Moved)> {
        let moved = ctx.phase("terrain", || self.advance_without_flow())?;
        let report = ctx.phase("flow", || self.liquid.step(ctx, 1.0 / self.scene.shot.fps))?;
        let mesh = self.ground.as_ref().or(self.inputs.still_terrain.as_ref());
        if let Some((stains, mesh)) = self.stains.as_mut().zip(mesh) {
            ctx.phase("stains", || stains.update(&mut self.liquid, &mesh.positions))?;
        }
        pours::pour(self.scene, self.setup, &mut self.liquid, self.frame)?;
        Ok((report, moved))
    }

    /// Moves terrain, obstacles and points to the next frame without any flow or pour; returns the effect on the liquid.
    ///
    /// # Errors
    /// Files that cannot be read.
    pub fn advance_without_flow(&mut self) -> Result<Moved> {
        let frame = self.frame + 1;
        let (ground, solids) = self.inputs.terrain_and_solids(self.setup, frame)?.unzip();
        let of_terrain = match &solids {
            Some(solids) => self.liquid.update_terrain(solids)?,
            None => Moved::default(),
        };
        self.has_new_ground |= ground.is_some();
        self.ground = ground;
        let of_obstacles = self.set_obstacles(obstacles::shapes_at(self.setup, frame)?)?;
        let points = flow_points::at_frame(self.setup, self.inputs, self.ground.as_ref(), frame);
        flow_points::update(&mut self.liquid, &self.points, &points)?;
        self.points = points;
        self.frame = frame;
        let last = if of_obstacles.cells > 0 { of_obstacles } else { of_terrain };
        Ok(Moved { displaced: of_terrain.displaced + of_obstacles.displaced, ..last })
    }

    /// Names of the points that are active over the step to this frame but rest, as they lie inside solid or outside the area.
    pub fn resting(&self) -> Vec<String> {
        flow_points::resting(self.setup, &self.liquid, self.frame).map(TimedFlowPoint::title).collect()
    }

    /// Replaces the obstacles.
    fn set_obstacles(&mut self, shapes: Vec<Shape>) -> Result<Moved> {
        if shapes == self.shapes {
            return Ok(Moved::default());
        }
        let moved = self.liquid.set_bodies(&shapes)?;
        self.shapes = shapes;
        self.has_new_ground = true;
        Ok(moved)
    }

    /// The terrain at this frame, with its stains; `None` if it is not known as a mesh.
    ///
    /// # Errors
    /// None for its own stains.
    pub fn terrain_frame(&self) -> Result<Option<TerrainFrame>> {
        let Some(mesh) = self.terrain() else { return Ok(None) };
        let values = |stains: &Stains| {
            let mut out = vec![0.0; stains.len()];
            stains.stains(&mut out).map(|()| out)
        };
        let stains = self.stains.as_ref().map(values).transpose()?;
        Ok(Some(TerrainFrame { mesh: mesh.clone(), stains }))
    }

    /// The terrain's mesh at this frame; `None` if it has none, or none that is needed ([`Inputs::still_terrain`]).
    fn terrain(&self) -> Option<&TriMesh> {
        self.ground.as_ref().or(self.inputs.still_terrain.as_ref())
    }

    /// The terrain and the meshes that stand on it as one mesh (m); `None` if the terrain is not a mesh.
    pub fn ground(&self) -> Option<TriMesh> {
        let mut all = self.terrain()?.clone();
        self.inputs.meshes.iter().for_each(|mesh| all.append(mesh));
        Some(all)
    }
}

impl Inputs {
    /// The terrain's mesh at a frame, and the solids of it and of the meshes that stand on it; `None` if the terrain does not move.
    fn terrain_and_solids(&self, setup: &Shallow, frame: i32) -> Result<Option<(TriMesh, Solids)>> {
        let Some(mesh) = self.terrain_at(setup, frame)? else { return Ok(None) };
        let mut solids = triangles::solids(&mesh.positions, &mesh.triangles, self.grid, self.heights)?;
        for own in &self.meshes {
            let on_it = triangles::solids(&own.positions, &own.triangles, self.grid, self.heights)?;
            solids = united(&solids, &on_it);
        }
        Ok(Some((mesh, solids)))
    }
}
