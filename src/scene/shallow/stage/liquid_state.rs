//! The liquid of a scene from frame to frame.

use super::saved_liquid;
use crate::context::Context;
use crate::error::Result;
use crate::geometry::TriMesh;
use crate::scene::Scene;
use crate::scene::shallow::inputs::united;
use crate::scene::shallow::inputs::{flow_points, obstacles, pours};
use crate::scene::shallow::{Inputs, Point, Shallow};
use crate::shallow::remap::Moved;
use crate::shallow::sources::FlowPoint;
use crate::shallow::terrain::shapes::Shape;
use crate::shallow::terrain::{Solids, triangles};
use crate::shallow::{self, Report, Stains};

/// A scene with its liquid and the contents of its files.
type Of<'a> = (&'a Scene, &'a Shallow, &'a Inputs);

/// A scene's liquid, at a frame.
pub(in crate::scene::shallow) struct LiquidState<'a> {
    scene: &'a Scene,
    of: &'a Shallow,
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
    /// Whether ground or obstacles have changed since this was last taken.
    pub is_stirred: bool,
}

impl<'a> LiquidState<'a> {
    /// The liquid at the first frame.
    ///
    /// # Errors
    /// A source inside solid, and anything else that a liquid refuses; cancel.
    pub fn begin(ctx: &Context, (scene, of, inputs): Of<'a>) -> Result<Self> {
        let first = scene.shot.frames.first;
        let shapes = obstacles::shapes_at(of, first)?;
        let mut course = Self::dry(ctx, (scene, of, inputs), first, shapes)?;
        flow_points::position(scene, of, &mut course.liquid, &course.points)?;
        of.source_scalars(&mut course.liquid)?;
        course.liquid.set_poured(&of.start())?;
        if let Some(height) = of.fill {
            course.liquid.fill(height);
        }
        pours::pour(scene, of, &mut course.liquid, first)?;
        Ok(course)
    }

    /// Resumes from a state saved at a frame.
    ///
    /// # Errors
    /// Files that can no longer be read; a state for another terrain.
    pub fn resume(ctx: &Context, (scene, of, inputs): Of<'a>, frame: i32, bytes: &[u8]) -> Result<Self> {
        let kept = saved_liquid::read(bytes)?;
        let mut course = Self::dry(ctx, (scene, of, inputs), frame, kept.shapes)?;
        // The terrain may have covered some of them since the first frame.
        let named = |index: usize| format!("flow point {}", index + 1);
        course.liquid.set_flows_resting(&kept.points, named)?;
        course.liquid.restore(&kept.liquid)?;
        if let Some(stains) = &mut course.stains {
            stains.restore(&kept.stains)?;
        }
        if course.points != kept.points {
            // The points have changed: these apply from here on.
            course.liquid.set_flows_resting(&course.points, |index| of.points[index].title())?;
        }
        of.source_scalars(&mut course.liquid)?;
        Ok(course)
    }

    /// Dry ground at a frame, with obstacles; its points are not set.
    fn dry(ctx: &Context, (scene, of, inputs): Of<'a>, frame: i32, standing: Vec<Shape>) -> Result<Self> {
        let (ground, solids) = inputs.moved(of, frame)?.unzip();
        let solids = solids.as_ref().unwrap_or(&inputs.solids);
        let points = flow_points::at(of, inputs, ground.as_ref(), frame);
        let liquid = shallow::Shallow::new(ctx, solids, of.params.clone());
        let mut liquid = liquid.map_err(|error| error.in_file(&scene.path))?;
        of.carry(scene, &mut liquid)?;
        let stained = of.staining.zip(ground.as_ref().or(inputs.still.as_ref()));
        let stains = stained.map(|(how, mesh)| Stains::new(&liquid, &mesh.positions, &mesh.triangles, how));
        let stains = stains.transpose()?;
        let (shapes, is_stirred) = (Vec::new(), true);
        let mut course =
            Self { scene, of, inputs, liquid, shapes, points, frame, stains, ground, is_stirred };
        course.put(standing)?;
        Ok(course)
    }

    /// Advances to the next frame; returns the report of the flow, and the effect of moving terrain and obstacles on the liquid.
    ///
    /// # Errors
    /// Files that cannot be read; errors of a step; cancel.
    pub fn go(&mut self, ctx: &Context) -> Result<(Report, Moved)> {
        let moved = ctx.phase("terrain", || self.go_still())?;
        let report = ctx.phase("flow", || self.liquid.step(ctx, 1.0 / self.scene.shot.fps))?;
        let mesh = self.ground.as_ref().or(self.inputs.still.as_ref());
        if let Some((stains, mesh)) = self.stains.as_mut().zip(mesh) {
            ctx.phase("stains", || stains.update(&mut self.liquid, &mesh.positions))?;
        }
        pours::pour(self.scene, self.of, &mut self.liquid, self.frame)?;
        Ok((report, moved))
    }

    /// Moves terrain, obstacles and points to the next frame without any flow or pour; returns the effect on the liquid.
    ///
    /// # Errors
    /// Files that cannot be read.
    pub fn go_still(&mut self) -> Result<Moved> {
        let frame = self.frame + 1;
        let (ground, solids) = self.inputs.moved(self.of, frame)?.unzip();
        let of_terrain = match &solids {
            Some(solids) => self.liquid.update_terrain(solids)?,
            None => Moved::default(),
        };
        self.is_stirred |= ground.is_some();
        self.ground = ground;
        let of_obstacles = self.put(obstacles::shapes_at(self.of, frame)?)?;
        let points = flow_points::at(self.of, self.inputs, self.ground.as_ref(), frame);
        flow_points::turn(&mut self.liquid, &self.points, &points)?;
        self.points = points;
        self.frame = frame;
        let last = if of_obstacles.cells > 0 { of_obstacles } else { of_terrain };
        Ok(Moved { displaced: of_terrain.displaced + of_obstacles.displaced, ..last })
    }

    /// Names of the points that should act over the step to its frame but rest, as they lie inside solid or outside the area.
    pub fn resting(&self) -> Vec<String> {
        flow_points::resting(self.of, &self.liquid, self.frame).map(Point::title).collect()
    }

    /// Replaces the obstacles.
    fn put(&mut self, shapes: Vec<Shape>) -> Result<Moved> {
        if shapes == self.shapes {
            return Ok(Moved::default());
        }
        let moved = self.liquid.set_bodies(&shapes)?;
        self.shapes = shapes;
        self.is_stirred = true;
        Ok(moved)
    }

    /// The terrain with the stain of each of its vertices; `None` if nothing stains it.
    ///
    /// # Errors
    /// None for its own stains.
    pub fn stained(&self) -> Result<Option<(TriMesh, Vec<f32>)>> {
        let Some((stains, mesh)) = self.stains.as_ref().zip(self.terrain()) else { return Ok(None) };
        let mut out = vec![0.0; stains.len()];
        stains.stains(&mut out)?;
        Ok(Some((mesh.clone(), out)))
    }

    /// The terrain, if it is a mesh that moves, or one that does not and is needed.
    fn terrain(&self) -> Option<&TriMesh> {
        self.ground.as_ref().or(self.inputs.still.as_ref())
    }

    /// The ground as one mesh, with the meshes that stand on it (m); `None` if it is not a mesh.
    pub fn ground(&self) -> Option<TriMesh> {
        let mut all = self.terrain()?.clone();
        self.inputs.meshes.iter().for_each(|mesh| all.append(mesh));
        Some(all)
    }
}

impl Inputs {
    /// The terrain's mesh at a frame, and the solids of it and of the meshes that stand on it; `None` if it does not move.
    fn moved(&self, of: &Shallow, frame: i32) -> Result<Option<(TriMesh, Solids)>> {
        let Some(mesh) = self.terrain_at(of, frame)? else { return Ok(None) };
        let mut solids = triangles::solids(&mesh.positions, &mesh.triangles, self.grid, self.heights)?;
        for own in &self.meshes {
            let on_it = triangles::solids(&own.positions, &own.triangles, self.grid, self.heights)?;
            solids = united(&solids, &on_it);
        }
        Ok(Some((mesh, solids)))
    }
}
