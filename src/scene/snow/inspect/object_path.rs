//! The path of an object over a shot, and warnings about it.

use std::ops::RangeInclusive;

use rayon::prelude::*;
use serde::Serialize;

use super::foot_slip::{FootSlip, foot_slip};
use super::relief::Relief;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::geometry::check::faults;
use crate::geometry::shape::bounds;
use crate::motion::{Motion, Poses};
use crate::scene::snow::Inputs;
use crate::scene::{Object, Scene};
use crate::snow::base_layer::Reach;
use crate::snow::grains::FASTEST_OBJECT;
use crate::sweep::{Body, REACH};

/// Number of consecutive frames that one task poses.
const BATCH: usize = 12;
/// Maximum rotation (radians) of a body between two samples of its path.
const MAX_ROTATION: f64 = std::f64::consts::PI / 6.0;
/// Maximum count of samples between two breaks of its motion.
const MAX_SAMPLES: f64 = 1000.0;
/// An object larger or smaller than these sizes (m) probably uses another unit.
const LARGEST: f64 = 20.0;
const SMALLEST: f64 = 0.02;

/// The path of a moving object.
pub struct ObjectPath<'a> {
    scene: &'a Scene,
    inputs: &'a Inputs,
    /// Its name in messages.
    name: String,
    object: &'a Object,
    body: &'a Body,
    /// At each frame of the shot.
    extents: Vec<Extent>,
}

/// The extent of an object at one frame.
#[derive(Clone, Copy)]
struct Extent {
    frame: i32,
    low: DVec3,
    high: DVec3,
    /// Its lowest vertex.
    lowest: DVec3,
    /// Longest path of a vertex since the previous frame (m).
    moved: f64,
}

impl<'a> ObjectPath<'a> {
    /// The paths of all moving objects, each posed at every frame.
    ///
    /// # Errors
    /// A frame that cannot be read or does not match the others; cancel.
    pub fn all(ctx: &Context, scene: &'a Scene, inputs: &'a Inputs) -> Result<Vec<Self>> {
        let colliders = scene.objects.iter().enumerate().filter(|(_, object)| object.role.moves());
        let of = |((index, object), body): ((usize, &'a Object), &'a Body)| {
            let name = format!("object {} ({})", index + 1, crate::scene::schema::file_name(&object.file));
            let extents = ctx.phase("inputs", || extents(ctx, scene, body))?;
            Ok(Self { scene, inputs, name, object, body, extents })
        };
        colliders.zip(&inputs.bodies).map(of).collect()
    }

    /// The report on the object.
    ///
    /// # Errors
    /// A pose that cannot be read.
    pub fn report(&self, relief: Option<&Relief>) -> Result<ObjectReport> {
        let first = self.extents[0];
        let (low, high) = self.bounds();
        let faster = |best: Extent, extent: &Extent| if extent.moved > best.moved { *extent } else { best };
        let fastest = self.extents.iter().fold(first, faster);
        Ok(ObjectReport {
            file: self.object.file.display().to_string(),
            role: self.object.role.name(),
            triangles: self.body.motion().triangles().len(),
            closed_loops: self.body.closed_loops(),
            holes: self.holes()?,
            contradictions: self.body.contradictions(),
            size_m: (first.high - first.low).into(),
            bounds_m: [low.into(), high.into()],
            fastest_m_per_s: fastest.moved * self.scene.shot.fps,
            fastest_frame: fastest.frame,
            touches: self.touches(),
            deepest: relief.and_then(|relief| self.deepest(relief)),
            walk: foot_slip(self.scene, self.object, self.body.motion())?,
        })
    }

    /// Warnings, one sentence each.
    ///
    /// # Errors
    /// Cancel.
    pub fn warnings(&self, ctx: &Context, report: &ObjectReport) -> Result<Vec<String>> {
        let all = [
            self.out_of_reach(ctx)?,
            self.rotates_too_far(),
            self.jumping(report),
            self.other_unit().or_else(|| self.other_height(report)),
            self.untouched(report),
            self.inside_out(),
            self.below_ground(report),
            self.slipping(report),
        ];
        Ok(all.into_iter().flatten().collect())
    }

    /// Minimum and maximum corner over the shot (m).
    fn bounds(&self) -> (DVec3, DVec3) {
        let first = self.extents[0];
        self.extents.iter().fold((first.low, first.high), |(l, h), e| (l.inf(&e.low), h.sup(&e.high)))
    }

    /// First and last frame at which its bounds overlap those of the snow; the shot's first and last frame if the snow's
    /// bounds are unknown.
    fn touches(&self) -> Option<[i32; 2]> {
        let snow = self.inputs.area().zip(self.inputs.top());
        let touching = |extent: &&Extent| match snow {
            Some(([x0, z0, x1, z1], top)) => {
                let beside =
                    extent.high.x < x0 || extent.low.x > x1 || extent.high.z < z0 || extent.low.z > z1;
                !beside && extent.low.y < top
            }
            None => true,
        };
        let (first, last) =
            self.extents.iter().find(touching).zip(self.extents.iter().rev().find(touching))?;
        Some([first.frame, last.frame])
    }

    /// The object in the scene.
    pub fn object(&self) -> &Object {
        self.object
    }

    /// Its mesh and motion.
    pub fn body(&self) -> &Body {
        self.body
    }

    /// Height of the snow's highest point (m), if it is known.
    pub fn top_of_snow(&self) -> Option<f64> {
        self.inputs.top()
    }

    /// The frames from the first to the last at which its bounds overlap those of the snow.
    #[expect(clippy::reversed_empty_ranges, reason = "no frame")]
    pub fn frames_near_snow(&self) -> RangeInclusive<i32> {
        self.touches().map_or(1..=0, |[first, last]| first..=last)
    }

    /// Minimum and maximum corner (m) at each of these frames.
    pub fn boxes_near_snow(&self) -> impl Iterator<Item = (i32, [DVec3; 2])> {
        let frames = self.frames_near_snow();
        let near = self.extents.iter().filter(move |extent| frames.contains(&extent.frame));
        near.map(|extent| (extent.frame, [extent.low, extent.high]))
    }

    /// The times (s) of the frame before a frame and of its own, and the longest path of a vertex between them (m). The first frame has
    /// none before it.
    pub fn step_to(&self, frame: i32) -> ([f64; 2], f64) {
        let shot = self.scene.shot;
        let first = shot.frames.first;
        let times = [(frame - 1).max(first), frame].map(|frame| shot.time(frame));
        (times, self.extents[(frame - first) as usize].moved)
    }

    /// Count of holes at the first frame.
    fn holes(&self) -> Result<usize> {
        let mut pose = Vec::new();
        let shot = self.scene.shot;
        self.body.motion().pose(shot.time(shot.frames.first), &mut pose)?;
        Ok(faults::holes(&pose, self.body.motion().triangles(), self.body.corners()))
    }

    /// The lowest vertex of all frames, by height above the ground.
    fn deepest(&self, relief: &Relief) -> Option<Deepest> {
        let of = |extent: &Extent| {
            let (ground, top) = relief.at(extent.lowest.x, extent.lowest.z)?;
            let y = extent.lowest.y;
            Some(Deepest { frame: extent.frame, y_m: y, above_ground_m: y - ground, below_top_m: top - y })
        };
        self.extents.iter().filter_map(of).min_by(|a, b| a.above_ground_m.total_cmp(&b.above_ground_m))
    }

    /// The first frame that cannot be simulated, because a body that touches the snow extends too far from it.
    fn out_of_reach(&self, ctx: &Context) -> Result<Option<String>> {
        let Self { scene, inputs, body, extents, .. } = self;
        let Some((low, high)) = inputs.bounds() else { return Ok(None) };
        let (middle, cell) = (0.5 * (low + high), inputs.snow.cell);
        // The centre of the actual snow, known only once it is made, may differ.
        let limit = (0.5 * REACH * cell).min(REACH * cell - (high - low).norm());
        let is_far = |extent: &Extent| {
            let far = (extent.low - middle).abs().sup(&(extent.high - middle).abs()).max();
            far + extent.moved > limit
        };
        let reach = Reach::of_snow(cell, low, high)?;
        let time = |frame: i32| scene.shot.time(frame);
        for frame in extents.iter().filter(|extent| is_far(extent)).map(|extent| extent.frame) {
            let before = (frame - 1).max(scene.shot.frames.first);
            match reach.spans(ctx, body, time(before), time(frame)) {
                Ok(_) => {}
                Err(Error::Argument(what)) => {
                    return Ok(Some(format!("frame {frame} cannot be made: {what}")));
                }
                Err(other) => return Err(other),
            }
        }
        Ok(None)
    }

    /// The first frame in which the body rotates too far for one step.
    fn rotates_too_far(&self) -> Option<String> {
        let shot = self.scene.shot;
        shot.frames.iter().skip(1).find_map(|frame| {
            let error = self.body.turning(shot.time(frame - 1), shot.time(frame)).err()?;
            Some(format!("frame {frame} cannot be made: {error}"))
        })
    }

    /// The fastest step, if it is probably a jump.
    fn jumping(&self, report: &ObjectReport) -> Option<String> {
        (report.fastest_m_per_s > FASTEST_OBJECT).then(|| {
            format!(
                "{} moves at {:.0} m/s in the step to frame {}: if that is a jump, it still cuts the snow on its way, but for \
                 grains it stands at its new position from the step's start",
                self.name, report.fastest_m_per_s, report.fastest_frame
            )
        })
    }

    /// The size, if it suggests another unit.
    fn other_unit(&self) -> Option<String> {
        let tallest = (self.extents[0].high - self.extents[0].low).max();
        let scale = self.object.space.scale * likely_scale(tallest)?;
        Some(format!("{} is {tallest:.3} m large: scale = {scale}?", self.name))
    }

    /// The height of a figure that walks, if it is that of no person.
    fn other_height(&self, report: &ObjectReport) -> Option<String> {
        report.walk.as_ref()?;
        let tall = report.size_m[1];
        let factor = likely_scale_of_figure(tall)?;
        let scale = rounded(self.object.space.scale * factor);
        Some(format!(
            "{} walks and is {tall:.3} m tall: scale = {scale} makes it as tall as a person ({PERSON} m)",
            self.name
        ))
    }

    /// That it never touches the snow, and on which side it stays.
    fn untouched(&self, report: &ObjectReport) -> Option<String> {
        let (area, top) = self.inputs.area().zip(self.inputs.top()).filter(|_| report.touches.is_none())?;
        let (low, _) = self.bounds();
        let what = if low.y >= top {
            format!("it stays {:.3} m above it", low.y - top)
        } else {
            format!("it stays beside the area {area:?}")
        };
        Some(format!("{} never touches the snow: {what}", self.name))
    }

    /// Triangles that disagree about inside and outside.
    fn inside_out(&self) -> Option<String> {
        if let Some(what) = self.body.doubts() {
            return Some(format!("{}: {what}", self.name));
        }
        let edges = self.body.contradictions();
        (edges > 0).then(|| {
            format!(
                "{}: its triangles disagree about inside and outside at {edges} edges; holes are closed by cones, look at \
                 its prints",
                self.name
            )
        })
    }

    /// Its lowest vertex, if that is below the ground.
    fn below_ground(&self, report: &ObjectReport) -> Option<String> {
        let deep = report.deepest.filter(|deep| deep.above_ground_m < -0.5 * self.inputs.snow.cell)?;
        Some(format!(
            "{} goes {:.3} m below the ground at frame {}: raise it by its keys, or its prints go through the snow",
            self.name, -deep.above_ground_m, deep.frame
        ))
    }

    /// Feet that slip too fast.
    fn slipping(&self, report: &ObjectReport) -> Option<String> {
        let walk = report.walk.as_ref().filter(|walk| walk.slips)?;
        Some(format!(
            "{}: its feet slip at {:.2} m/s while they stand; its clip walks at {:.2} m/s: {}",
            self.name,
            walk.slips_m_per_s,
            DVec3::from(walk.carry_m_per_s).norm(),
            walk.keys
        ))
    }
}

/// Poses a body at every frame.
fn extents(ctx: &Context, scene: &Scene, body: &Body) -> Result<Vec<Extent>> {
    let frames: Vec<i32> = scene.shot.frames.iter().collect();
    let of_batch = |batch: &[i32]| -> Result<Vec<Extent>> {
        let at = |frame: i32| scene.shot.time(frame);
        // The first frame of a batch is compared with the frame before it, if the shot has one.
        let mut time = at((batch[0] - 1).max(scene.shot.frames.first));
        let mut poses = Poses::start(body.motion(), time)?;
        let mut lengths = vec![0.0; body.motion().vertex_count()];
        let mut out = Vec::with_capacity(batch.len());
        for &frame in batch {
            lengths.fill(0.0);
            for moment in sample_times(body.motion(), time, at(frame)) {
                ctx.check()?;
                let (before, pose) = poses.go_to(moment)?;
                let pairs = lengths.iter_mut().zip(pose.iter().zip(before));
                pairs.for_each(|(length, (p, q))| *length += (p - q).norm());
            }
            time = at(frame);
            let (low, high) = bounds(poses.now());
            let lower = |a: DVec3, b: &DVec3| if b.y < a.y { *b } else { a };
            let lowest = poses.now().iter().fold(DVec3::repeat(f64::INFINITY), lower);
            let moved = lengths.iter().copied().fold(0.0, f64::max);
            out.push(Extent { frame, low, high, lowest, moved });
        }
        Ok(out)
    };
    let batches: Vec<Vec<Extent>> = frames.par_chunks(BATCH).map(of_batch).collect::<Result<_>>()?;
    Ok(batches.concat())
}

/// Sample times of a motion after `from` and up to `to` (s): its breaks, and between them as many as its rotation requires.
fn sample_times(motion: &dyn Motion, from: f64, to: f64) -> Vec<f64> {
    let mut out = Vec::new();
    let mut begin = from;
    for end in motion.breaks(from, to).into_iter().chain([to]) {
        let parts = (motion.turning(begin, end) / MAX_ROTATION).ceil().clamp(1.0, MAX_SAMPLES);
        out.extend((1..parts as usize).map(|part| begin + (end - begin) * part as f64 / parts));
        out.push(end);
        begin = end;
    }
    out
}

/// The scale factor that makes an implausible size (m) plausible, as for a file in centimetres or millimetres.
fn likely_scale(size: f64) -> Option<f64> {
    let plausible = |factor: f64| (0.3..=5.0).contains(&(size * factor));
    match size {
        size if size > LARGEST => [0.01, 0.001].into_iter().find(|factor| plausible(*factor)),
        size if size < SMALLEST => [100.0, 1000.0].into_iter().find(|factor| plausible(*factor)),
        _ => None,
    }
}

/// Height of a person (m), and of the shortest and the tallest figure that is taken for one.
const PERSON: f64 = 1.7;
const HEIGHTS: [f64; 2] = [0.8, 2.5];

/// The scale factor that makes a figure that walks as tall as a person, if it is not about so already.
fn likely_scale_of_figure(height: f64) -> Option<f64> {
    let is_plausible = (HEIGHTS[0]..=HEIGHTS[1]).contains(&height);
    (!is_plausible && height > 0.0).then_some(PERSON / height)
}

/// A factor rounded to three significant digits.
fn rounded(factor: f64) -> f64 {
    format!("{factor:.2e}").parse().unwrap_or(factor)
}

/// The lowest position of an object relative to the ground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Deepest {
    /// Frame of that position.
    pub frame: i32,
    /// Its y (m).
    pub y_m: f64,
    /// Height above the ground (m); negative below it.
    pub above_ground_m: f64,
    /// Depth below the snow's top (m); negative above it.
    pub below_top_m: f64,
}

/// Summary of an object over the shot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObjectReport {
    /// Its file.
    pub file: String,
    /// collide, base or grains.
    pub role: &'static str,
    /// Its triangles.
    pub triangles: usize,
    /// Open loops that are closed; loops that share a vertex count once.
    pub closed_loops: usize,
    /// Holes at the first frame, counted as in `frazil mesh check`.
    pub holes: usize,
    /// Edges where its triangles disagree on inside and outside.
    pub contradictions: usize,
    /// Width, height and depth at the first frame (m).
    pub size_m: [f64; 3],
    /// Minimum and maximum position over the shot (m).
    pub bounds_m: [[f64; 3]; 2],
    /// Maximum speed of a vertex between two frames (m/s).
    pub fastest_m_per_s: f64,
    /// The later of these two frames.
    pub fastest_frame: i32,
    /// First and last frame at which its bounds touch the snow's.
    pub touches: Option<[i32; 2]>,
    /// Its lowest position relative to the ground, if the ground is known and the object passes over it.
    pub deepest: Option<Deepest>,
    /// The speed that its clip requires of its keys, and the slip of its feet.
    pub walk: Option<FootSlip>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_in_other_units_are_recognised() {
        assert_eq!(likely_scale(172.0), Some(0.01));
        assert_eq!(likely_scale(1720.0), Some(0.001));
        assert_eq!(likely_scale(1.72), None);
        assert_eq!(likely_scale(0.0172), Some(100.0));
        assert_eq!(likely_scale(1e6), None);
    }

    #[test]
    fn figures_that_walk_are_as_tall_as_people() {
        // The robot of RobotExpressive.glb is 4.4 m tall.
        assert_eq!(likely_scale_of_figure(4.4).map(rounded), Some(0.386));
        assert_eq!(likely_scale_of_figure(0.4).map(rounded), Some(4.25));
        assert_eq!([0.8, 1.7, 2.5].map(likely_scale_of_figure), [None; 3]);
    }
}
