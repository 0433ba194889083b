//! The liquid of a scene from frame to frame.

use super::inputs::united;
use super::{Inputs, Shallow, kept, obstacles, points, pours};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::scene::Scene;
use crate::shallow::remap::Moved;
use crate::shallow::terrain::shapes::Shape;
use crate::shallow::terrain::{Solids, triangles};
use crate::shallow::{self, Report};

/// A scene with its liquid and what its files hold.
type Of<'a> = (&'a Scene, &'a Shallow, &'a Inputs);

/// A scene's liquid, at a frame.
pub(super) struct Course<'a> {
    scene: &'a Scene,
    of: &'a Shallow,
    inputs: &'a Inputs,
    pub liquid: shallow::Shallow,
    /// The obstacles that stand in it.
    pub shapes: Vec<Shape>,
    pub frame: i32,
}

impl<'a> Course<'a> {
    /// The liquid at the first frame.
    ///
    /// # Errors
    /// A source inside solid, and whatever else a liquid refuses; cancel.
    pub fn begin(ctx: &Context, (scene, of, inputs): Of<'a>) -> Result<Self> {
        let first = scene.shot.frames.first;
        let shapes = obstacles::shapes_at(of, first)?;
        let mut course = Self::dry(ctx, (scene, of, inputs), first, shapes)?;
        points::place(scene, of, &mut course.liquid, first)?;
        if let Some(height) = of.fill {
            course.liquid.fill(height);
        }
        pours::pour(scene, of, &mut course.liquid, first)?;
        Ok(course)
    }

    /// Goes on from a state that was kept at a frame.
    ///
    /// # Errors
    /// Files that can no longer be read; a state of another terrain.
    pub fn resume(ctx: &Context, (scene, of, inputs): Of<'a>, frame: i32, bytes: &[u8]) -> Result<Self> {
        let kept = kept::read(bytes)?;
        let mut course = Self::dry(ctx, (scene, of, inputs), frame, kept.shapes)?;
        course.liquid.set_flows(&kept.points, |index| format!("flow point {}", index + 1))?;
        course.liquid.restore(&kept.liquid)?;
        if points::at(of, frame) != kept.points {
            // Others from here on.
            points::place(scene, of, &mut course.liquid, frame)?;
        }
        Ok(course)
    }

    /// Dry ground as it is at a frame, with obstacles.
    fn dry(ctx: &Context, (scene, of, inputs): Of<'a>, frame: i32, shapes: Vec<Shape>) -> Result<Self> {
        let moved = inputs.moved(of, frame)?;
        let solids = moved.as_ref().unwrap_or(&inputs.solids);
        let liquid = shallow::Shallow::new(ctx, solids, of.params.clone()).map_err(|error| match error {
            Error::Argument(what) => Error::file(&scene.path, what),
            other => other,
        });
        let mut course = Self { scene, of, inputs, liquid: liquid?, shapes: Vec::new(), frame };
        course.put(shapes)?;
        Ok(course)
    }

    /// Goes on to the next frame; what the flow did, and what terrain and obstacles that moved did to the liquid.
    ///
    /// # Errors
    /// Files that cannot be read; what a step refuses; cancel.
    pub fn go(&mut self, ctx: &Context) -> Result<(Report, Moved)> {
        let frame = self.frame + 1;
        let moved = ctx.phase("terrain", || {
            let of_terrain = match self.inputs.moved(self.of, frame)? {
                Some(solids) => self.liquid.update_terrain(&solids)?,
                None => Moved::default(),
            };
            let of_obstacles = self.put(obstacles::shapes_at(self.of, frame)?)?;
            let last = if of_obstacles.cells > 0 { of_obstacles } else { of_terrain };
            Ok(Moved { displaced: of_terrain.displaced + of_obstacles.displaced, ..last })
        })?;
        let report = ctx.phase("flow", || {
            points::turn(self.of, &mut self.liquid, frame)?;
            self.liquid.step(ctx, 1.0 / self.scene.shot.fps)
        })?;
        pours::pour(self.scene, self.of, &mut self.liquid, frame)?;
        self.frame = frame;
        Ok((report, moved))
    }

    /// Puts obstacles in the place of those that there are.
    fn put(&mut self, shapes: Vec<Shape>) -> Result<Moved> {
        if shapes == self.shapes {
            return Ok(Moved::default());
        }
        let moved = self.liquid.set_bodies(&shapes)?;
        self.shapes = shapes;
        Ok(moved)
    }
}

impl Inputs {
    /// The solids of a frame, with the meshes that stand on the terrain; none where it does not move.
    fn moved(&self, of: &Shallow, frame: i32) -> Result<Option<Solids>> {
        let Some(mesh) = self.terrain_at(of, frame)? else { return Ok(None) };
        let mut solids = triangles::solids(&mesh.positions, &mesh.triangles, self.grid, self.heights)?;
        for mesh in &self.meshes {
            let on_it = triangles::solids(&mesh.positions, &mesh.triangles, self.grid, self.heights)?;
            solids = united(&solids, &on_it);
        }
        Ok(Some(solids))
    }
}
