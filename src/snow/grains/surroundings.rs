//! What a step of grains reads besides themselves, as colliders, and what of it wakes all of them when it changes.

use super::field::Field;
use super::heap::{Colliders, Floor};
use super::shell::Shell;
use super::{Base, Params};
use crate::base::{DVec3, TriMesh};
use crate::error::Result;
use crate::sweep::Body;

/// What a step of grains reads.
pub struct Surroundings<'a> {
    /// The base layer; grains collide with it as it is at the step's end.
    pub base: Base<'a>,
    /// What moves.
    pub objects: &'a [Object<'a>],
    /// Meshes that do not move, as triangles and places (m).
    pub statics: &'a [&'a TriMesh],
    /// Height of a level ground (m).
    pub floor: Option<f64>,
    /// Grains below this height (m) are dropped.
    pub lowest: f64,
}

/// Something that moves among grains.
#[derive(Clone, Copy)]
pub struct Object<'a> {
    /// Its mesh and motion.
    pub body: &'a Body,
    /// Friction of grains against it.
    pub friction: f64,
    /// With which it holds grains that touch it (weights of a grain).
    pub stick: f64,
    /// Share of the snow that it removes that becomes no grains; none: [`Params::compression`].
    pub compression: Option<f64>,
    /// Whether it takes snow from the base layer.
    pub removes: bool,
    /// Whether it pushes grains.
    pub pushes: bool,
}

impl<'a> Object<'a> {
    /// One that removes snow and pushes grains, with a friction against it.
    pub fn new(body: &'a Body, friction: f64) -> Self {
        Self { body, friction, stick: 0.0, compression: None, removes: true, pushes: true }
    }
}

/// Least and greatest place (m) of a box.
pub type Bounds = [DVec3; 2];

/// What grains cannot move in a step.
pub struct Obstacles<'a> {
    /// As the heap wants it.
    pub colliders: Colliders<'a>,
    /// How far objects move near the grains in the step (m).
    pub way: f64,
    /// The boxes of all meshes at the step's start and end.
    pub boxes: [Vec<Bounds>; 2],
}

/// Friction of grains against what does not move, besides the base.
const GROUND: f32 = 0.5;
/// Farthest (diameters) that a mesh's box may jump between two steps: more, and what rested on it wakes.
const JUMP: f64 = 0.1;
/// Share of an object's surface under which its holes are closed; what is open wider, a bowl, has two sides that collide.
const HOLES: f64 = 0.1;
/// Numbers in [`Surroundings::ties`].
pub const TIES: usize = 6;

impl<'a> Surroundings<'a> {
    /// What wakes all grains when it changes, besides the meshes: gravity, what they are made of, whether base and floor are there.
    pub fn ties(&self, params: &Params) -> [f64; TIES] {
        let Params { gravity, friction, attraction, rests, .. } = *params;
        let has_base = self.base.after().is_some();
        let floor = self.floor.unwrap_or(f64::MIN);
        [gravity, friction, attraction, f64::from(rests), f64::from(has_base), floor]
    }

    /// What grains within a box (m) cannot move from `from` to `to` (s).
    ///
    /// # Errors
    /// A pose that cannot be computed.
    pub fn obstacles(&self, params: &Params, grains: &Bounds, [from, to]: [f64; 2]) -> Result<Obstacles<'a>> {
        let floor = self.floor.map(|height| Floor { height, friction: GROUND });
        let field = |grid| Field { grid, friction: params.friction_of_base() as f32 };
        let mut colliders = Colliders { floor, field: self.base.after().map(field), shells: Vec::new() };
        let mut way = 0.0f64;
        let mut boxes = [Vec::new(), Vec::new()];
        for object in self.objects.iter().filter(|object| object.pushes) {
            let body = object.body;
            let (mut first, mut last) = (Vec::new(), Vec::new());
            body.closed_pose(from, &mut first)?;
            body.closed_pose(to, &mut last)?;
            let closed = body.share_of_caps(&first) < HOLES && body.contradictions() == 0;
            let own = if closed { first.len() } else { body.motion().vertex_count() };
            first.truncate(own);
            last.truncate(own);
            boxes[0].push(bounds(&first));
            boxes[1].push(bounds(&last));
            way = first.iter().zip(&last).map(|(a, b)| way_near(*a, *b, grains)).fold(way, f64::max);
            let turn = |triangle: &[u32; 3]| {
                if body.is_reversed() { [triangle[0], triangle[2], triangle[1]] } else { *triangle }
            };
            let triangles = match closed {
                true => body.closed_triangles().collect(),
                false => body.motion().triangles().iter().map(turn).collect(),
            };
            let shell =
                Shell::new(object.friction as f32, triangles, closed, first).with_stick(object.stick as f32);
            let pose = move |share: f64, out: &mut Vec<DVec3>| {
                body.closed_pose(from + (to - from) * share, out)?;
                out.truncate(own);
                Ok(())
            };
            colliders.shells.push((shell, Box::new(pose)));
        }
        for mesh in self.statics {
            let pose: Vec<DVec3> = mesh.positions.iter().map(|place| place.cast::<f64>()).collect();
            boxes.iter_mut().for_each(|boxes| boxes.push(bounds(&pose)));
            let shell = Shell::new(GROUND, mesh.triangles.clone(), false, pose.clone());
            let rests = move |_: f64, out: &mut Vec<DVec3>| {
                out.clone_from(&pose);
                Ok(())
            };
            colliders.shells.push((shell, Box::new(rests)));
        }
        Ok(Obstacles { colliders, way, boxes })
    }
}

/// The box of some places.
pub fn bounds(places: &[DVec3]) -> Bounds {
    let none = [DVec3::repeat(f64::MAX), DVec3::repeat(f64::MIN)];
    places.iter().fold(none, |[low, high], place| [low.inf(place), high.sup(place)])
}

/// How far a vertex goes from one place to another, where it can come near a box; its path may bend by as much as it is long.
fn way_near(from: DVec3, to: DVec3, [low, high]: &Bounds) -> f64 {
    let way = (to - from).norm();
    let room = DVec3::repeat(way);
    let is_off = |axis: usize| {
        from[axis].max(to[axis]) + room[axis] < low[axis]
            || from[axis].min(to[axis]) - room[axis] > high[axis]
    };
    if (0..3).any(is_off) { 0.0 } else { way }
}

/// Whether boxes are the same but for a small part of a diameter (m).
pub fn have_stayed(boxes: &[Bounds], others: &[Bounds], diameter: f64) -> bool {
    let differ = |(a, b): (&Bounds, &Bounds)| a.iter().zip(b).any(|(a, b)| (a - b).amax() > JUMP * diameter);
    boxes.len() == others.len() && !boxes.iter().zip(others).any(differ)
}
