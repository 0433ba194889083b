//! Inputs of a step of grains besides the grains themselves, as colliders, and the changes in them that wake all grains.

use super::colliders::field::Field;
use super::colliders::ground::{FRICTION, Ground};
use super::colliders::set::{Colliders, Floor};
use super::colliders::shell::Shell;
use super::{Base, Params};
use crate::error::Result;
use crate::geometry::{DVec3, TriMesh};
use crate::snow::bounds::bounds;
use crate::sweep::Body;

/// Inputs of a step of grains.
pub struct Surroundings<'a> {
    /// The base layer; grains collide with its state at the end of the step.
    pub base: Base<'a>,
    /// Moving objects.
    pub objects: &'a [Object<'a>],
    /// Static meshes that collide on both sides: triangles and positions (m).
    pub statics: &'a [&'a TriMesh],
    /// Ground and static solids, in front of which grains stay.
    pub ground: &'a [Ground],
    /// Height of a level ground plane (m).
    pub floor: Option<f64>,
    /// Grains below this height (m) are dropped.
    pub lowest: f64,
}

/// A moving object.
#[derive(Clone, Copy)]
pub struct Object<'a> {
    /// Its mesh and motion.
    pub body: &'a Body,
    /// Friction of grains against it.
    pub friction: f64,
    /// Acceleration up to which it holds grains that touch it (multiples of gravity).
    pub stick: f64,
    /// Share of the snow it removes that does not become grains; none: [`Params::compression`].
    pub compression: Option<f64>,
    /// Whether it removes snow from the base layer.
    pub removes: bool,
    /// Whether it pushes grains.
    pub pushes: bool,
}

impl<'a> Object<'a> {
    /// An object that removes snow and pushes grains, with a friction against it.
    pub fn new(body: &'a Body, friction: f64) -> Self {
        Self { body, friction, stick: 0.0, compression: None, removes: true, pushes: true }
    }
}

/// Minimum and maximum corner (m) of a box.
pub type Bounds = [DVec3; 2];

/// The colliders of a step.
pub struct Obstacles<'a> {
    /// For the heap.
    pub colliders: Colliders<'a>,
    /// Largest displacement of a vertex near the grains in the step (m).
    pub max_displacement: f64,
    /// Bounding boxes of all meshes at the start and end of the step.
    pub boxes: [Vec<Bounds>; 2],
}

/// Largest jump (diameters) of a mesh's box between two steps; a larger one wakes all grains.
const JUMP: f64 = 0.1;
/// Holes of less than this share of an object's area are closed; an object with larger holes, such as a bowl, collides on both sides.
pub const MAX_CLOSED_HOLES: f64 = 0.1;
/// Speed (m/s) above which an object does not move through a step but is at its final position throughout: it jumps from one shot, or from
/// one side of a set, to the next.
pub const FASTEST_OBJECT: f64 = 100.0;
/// Number of values in [`Surroundings::wake_settings`].
pub const WAKE_SETTINGS: usize = 6;

impl<'a> Surroundings<'a> {
    /// Settings whose change wakes all grains: gravity, friction, attraction, whether grains rest, whether there is a base,
    /// and the floor's height.
    pub fn wake_settings(&self, params: &Params) -> [f64; WAKE_SETTINGS] {
        let Params { gravity, friction, attraction, rests, .. } = *params;
        let has_base = self.base.after().is_some();
        let floor = self.floor.unwrap_or(f64::MIN);
        [gravity, friction, attraction, f64::from(rests), f64::from(has_base), floor]
    }

    /// Whether a position (m) is below the floor, or at most `within` (m) behind ground.
    pub fn is_behind(&self, position: DVec3, within: f64) -> bool {
        self.floor.is_some_and(|floor| position.y < floor)
            || self.ground.iter().any(|ground| ground.is_behind(position, within))
    }

    /// The colliders near grains within a box (m), from `from` to `to` (s).
    ///
    /// # Errors
    /// A pose that cannot be computed.
    pub fn obstacles(&self, params: &Params, grains: &Bounds, [from, to]: [f64; 2]) -> Result<Obstacles<'a>> {
        let floor = self.floor.map(|height| Floor { height, friction: FRICTION });
        let field = |grid| Field { grid, friction: params.friction_of_base() as f32 };
        let mut colliders = Colliders { floor, field: self.base.after().map(field), shells: Vec::new() };
        let mut max_displacement = 0.0f64;
        let mut boxes = [Vec::new(), Vec::new()];
        for (index, object) in self.objects.iter().enumerate().filter(|(_, object)| object.pushes) {
            let body = object.body;
            let (mut first, mut last) = (Vec::new(), Vec::new());
            body.closed_pose(from, &mut first)?;
            body.closed_pose(to, &mut last)?;
            let closed = body.share_of_caps(&first) < MAX_CLOSED_HOLES && body.contradictions() == 0;
            let own = if closed { first.len() } else { body.motion().vertex_count() };
            first.truncate(own);
            last.truncate(own);
            boxes[0].push(bounds(&first));
            boxes[1].push(bounds(&last));
            let speed = speed(&first, &last, to - from);
            let jumps = speed > FASTEST_OBJECT;
            if jumps {
                let name = body.name().map_or_else(|| format!("body {}", index + 1), String::from);
                log::warn!(
                    "{name} moves at {speed:.0} m/s at {from:.3} s: over {FASTEST_OBJECT} m/s it is taken to jump, and carries no \
                     grains along"
                );
                first.clone_from(&last);
            }
            max_displacement = first
                .iter()
                .zip(&last)
                .map(|(a, b)| displacement_near(*a, *b, grains))
                .fold(max_displacement, f64::max);
            let triangles = match closed {
                true => body.closed_triangles().collect(),
                false => body.triangles().to_vec(),
            };
            let shell =
                Shell::new(object.friction as f32, triangles, closed, first).with_stick(object.stick as f32);
            let pose = move |share: f64, out: &mut Vec<DVec3>| {
                body.closed_pose(if jumps { to } else { from + (to - from) * share }, out)?;
                out.truncate(own);
                Ok(())
            };
            colliders.shells.push((shell, Box::new(pose)));
        }
        for mesh in self.statics {
            let pose: Vec<DVec3> = mesh.positions.iter().map(|position| position.cast::<f64>()).collect();
            boxes.iter_mut().for_each(|boxes| boxes.push(bounds(&pose)));
            let shell = Shell::new(FRICTION, mesh.triangles.clone(), false, pose.clone());
            let rests = move |_: f64, out: &mut Vec<DVec3>| {
                out.clone_from(&pose);
                Ok(())
            };
            colliders.shells.push((shell, Box::new(rests)));
        }
        for ground in self.ground {
            let shell = ground.shell.clone();
            let bounds = bounds(shell.vertices());
            boxes.iter_mut().for_each(|boxes| boxes.push(bounds));
            // Its shell ignores poses.
            let stands = |_: f64, _: &mut Vec<DVec3>| Ok(());
            colliders.shells.push((shell, Box::new(stands)));
        }
        Ok(Obstacles { colliders, max_displacement, boxes })
    }
}

/// Largest speed (m/s) of a vertex between two poses (m) that are `dt` (s) apart.
fn speed(first: &[DVec3], last: &[DVec3], dt: f64) -> f64 {
    first.iter().zip(last).map(|(a, b)| (b - a).norm_squared()).fold(0.0, f64::max).sqrt() / dt
}

/// Displacement of a vertex if it may come near a box, else 0; its path may deviate sideways by as much as the displacement.
fn displacement_near(from: DVec3, to: DVec3, [low, high]: &Bounds) -> f64 {
    let displacement = (to - from).norm();
    let margin = DVec3::repeat(displacement);
    let is_off = |axis: usize| {
        from[axis].max(to[axis]) + margin[axis] < low[axis]
            || from[axis].min(to[axis]) - margin[axis] > high[axis]
    };
    if (0..3).any(is_off) { 0.0 } else { displacement }
}

/// Whether the boxes agree to within a small part of a diameter (m).
pub fn have_stayed(boxes: &[Bounds], others: &[Bounds], diameter: f64) -> bool {
    let differ = |(a, b): (&Bounds, &Bounds)| a.iter().zip(b).any(|(a, b)| (a - b).amax() > JUMP * diameter);
    boxes.len() == others.len() && !boxes.iter().zip(others).any(differ)
}
