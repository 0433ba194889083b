//! Looks at every input of every frame of a scene, and computes nothing else.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::Serialize;

use super::relief::Relief;
use super::walks::{Walk, walk};
use super::{Inputs, inputs, memory};
use crate::base::{DVec3, faults};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::motion::{Motion, Poses, span};
use crate::scene::{BaseMode, Layer, Object, Role, Scene, Value};
use crate::snow::base_layer::Reach;
use crate::snow::base_layer::initial::thin;
use crate::sweep::{Body, REACH};

/// Frames that one task poses, one after another.
const RUN: usize = 12;
/// Bytes of a whole base file for each column of cells, and of what a frame changes and removes besides.
const BYTES_PER_COLUMN: f64 = 20.0;
const BYTES_PER_CHANGE: f64 = 4e5;
/// Bytes of a whole base file for each leaf: two surfaces cross 3.2 leaves of 64 columns.
const BYTES_PER_LEAF: f64 = BYTES_PER_COLUMN * 64.0 / 3.2;
/// Bytes for each vertex of an object in a .usda and a .ply file.
const USDA_PER_VERTEX: f64 = 110.0;
const PLY_PER_VERTEX: f64 = 50.0;
/// Bytes for texture coordinates, and for a corner's index into them.
const USDA_PER_PLACE: f64 = 20.0;
const USDA_PER_INDEX: f64 = 7.0;
const PLY_PER_PLACE: f64 = 8.0;
/// How far a body turns between two looks at its way (radians), and most looks between two of its kinks.
const TURN: f64 = std::f64::consts::PI / 6.0;
const MOST_PARTS: f64 = 1000.0;
/// A character taller than this (m), or smaller, is likely in another unit.
const TALL: f64 = 20.0;
const SMALL: f64 = 0.02;

/// What a scene will do.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// First and last frame.
    pub frames: [i32; 2],
    /// Frames a second.
    pub fps: f64,
    /// Least and greatest x and z of the snow (m), where it is known before it is made.
    pub area_m: Option<[f64; 4]>,
    /// Edge of a voxel (m).
    pub cell_m: f64,
    /// The objects.
    pub objects: Vec<ObjectReport>,
    /// Memory that the run needs, about (bytes).
    pub memory_bytes: u64,
    /// Space that its files need, about (bytes).
    pub disk_bytes: Option<u64>,
    /// What looks wrong, one sentence each.
    pub warnings: Vec<String>,
    /// Every setting, defaults filled in: `snow.cell`, `object[1].scale`.
    pub settings: BTreeMap<String, Value>,
}

/// What an object does over the shot.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ObjectReport {
    /// Its file.
    pub file: String,
    /// collide or static.
    pub role: &'static str,
    /// Its triangles.
    pub triangles: usize,
    /// Open loops that are closed; those that share a vertex count once.
    pub closed_loops: usize,
    /// Holes at the first frame, counted as `frazil mesh check` does.
    pub holes: usize,
    /// Edges where its triangles do not agree about inside and outside.
    pub contradictions: usize,
    /// Width, height and depth at the first frame (m).
    pub size_m: [f64; 3],
    /// Least and greatest place over the shot (m).
    pub bounds_m: [[f64; 3]; 2],
    /// Greatest speed of a vertex on its way from frame to frame (m/s), and the frame that ends that step.
    pub fastest_m_per_s: f64,
    /// See [`ObjectReport::fastest_m_per_s`].
    pub fastest_frame: i32,
    /// First and last frame at which its bounds touch the snow's.
    pub touches: Option<[i32; 2]>,
    /// How deep it goes, where the ground is known and it comes over it.
    pub deepest: Option<Deepest>,
    /// How its clip must be carried.
    pub walk: Option<Walk>,
}

/// The place of an object that lies lowest against the ground.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Deepest {
    /// Frame at which it is there.
    pub frame: i32,
    /// Its y (m).
    pub y_m: f64,
    /// How far it is above the ground (m); negative below it.
    pub above_ground_m: f64,
    /// How deep it is under the snow's top (m); negative above it.
    pub below_top_m: f64,
}

/// An object's extent at one frame.
#[derive(Clone, Copy)]
struct Extent {
    frame: i32,
    low: DVec3,
    high: DVec3,
    /// Its lowest vertex.
    lowest: DVec3,
    /// Longest way of a vertex since the frame before (m).
    moved: f64,
}

/// Checks a scene whose inputs are open.
///
/// # Errors
/// A frame that cannot be read or fits no other; cancel.
pub fn check(ctx: &Context, scene: &Scene, inputs: &Inputs) -> Result<Report> {
    let mut warnings = inputs.warnings.clone();
    if let Layer::Depth(depth) = inputs.snow.layer {
        warnings.extend(thin(depth, inputs.snow.cell));
    }
    let area = inputs.area();
    let top = inputs.top();
    let colliders = scene.objects.iter().enumerate().filter(|(_, object)| object.role == Role::Collide);
    let relief = Relief::new(inputs);
    let mut objects = Vec::new();
    for ((index, object), body) in colliders.zip(&inputs.bodies) {
        let extents = ctx.phase("inputs", || extents(ctx, scene, body))?;
        warnings.extend(out_of_reach(ctx, scene, inputs, body, &extents)?);
        warnings.extend(too_fast(scene, body));
        let mut told = report(scene, index, object, body, &extents, area.zip(top), &mut warnings);
        told.holes = holes(scene, body)?;
        told.deepest = relief.as_ref().and_then(|relief| deepest(relief, &extents));
        told.walk = walk(scene, object, body.motion())?;
        warn_of_feet(inputs.snow.cell, &name_of(index, object), &told, &mut warnings);
        objects.push(told);
    }
    warnings.extend(
        inputs.far_static(scene).map(|(index, far)| inputs::too_far(scene, index, far, inputs.snow.cell)),
    );
    let columns = area.map(|[x0, z0, x1, z1]| (x1 - x0) * (z1 - z0) / inputs.snow.cell.powi(2));
    if objects.is_empty() {
        warnings.push("nothing moves through the snow: no object has the role collide".into());
    }
    Ok(Report {
        frames: [scene.shot.frames.first, scene.shot.frames.last],
        fps: scene.shot.fps,
        area_m: area,
        cell_m: inputs.snow.cell,
        objects,
        memory_bytes: memory::estimate(scene, inputs)?,
        disk_bytes: Some(disk(scene, inputs, whole_base(inputs, columns))),
        warnings,
        settings: scene.values.by_path(),
    })
}

/// Poses a body at every frame.
fn extents(ctx: &Context, scene: &Scene, body: &Body) -> Result<Vec<Extent>> {
    let frames: Vec<i32> = scene.shot.frames.iter().collect();
    let of_run = |run: &[i32]| -> Result<Vec<Extent>> {
        let at = |frame: i32| f64::from(frame) / scene.shot.fps;
        // Its first frame is compared with the one before it, if the shot has that.
        let mut time = at((run[0] - 1).max(scene.shot.frames.first));
        let mut poses = Poses::start(body.motion(), time)?;
        let mut ways = vec![0.0; body.motion().vertex_count()];
        let mut out = Vec::with_capacity(run.len());
        for &frame in run {
            ways.fill(0.0);
            for moment in moments(body.motion(), time, at(frame)) {
                ctx.check()?;
                let (before, pose) = poses.go_to(moment)?;
                let pairs = ways.iter_mut().zip(pose.iter().zip(before));
                pairs.for_each(|(way, (p, q))| *way += (p - q).norm());
            }
            time = at(frame);
            let (low, high) = span(poses.now());
            let lower = |a: DVec3, b: &DVec3| if b.y < a.y { *b } else { a };
            let lowest = poses.now().iter().fold(DVec3::repeat(f64::INFINITY), lower);
            let moved = ways.iter().copied().fold(0.0, f64::max);
            out.push(Extent { frame, low, high, lowest, moved });
        }
        Ok(out)
    };
    let runs: Vec<Vec<Extent>> = frames.par_chunks(RUN).map(of_run).collect::<Result<_>>()?;
    Ok(runs.concat())
}

/// Times up to `to` (s) at which a motion is looked at after `from`: its kinks, and between them as many as its turns need.
fn moments(motion: &dyn Motion, from: f64, to: f64) -> Vec<f64> {
    let mut out = Vec::new();
    let mut begin = from;
    for end in motion.breaks(from, to).into_iter().chain([to]) {
        let parts = (motion.turning(begin, end) / TURN).ceil().clamp(1.0, MOST_PARTS);
        out.extend((1..parts as usize).map(|part| begin + (end - begin) * part as f64 / parts));
        out.push(end);
        begin = end;
    }
    out
}

/// The first frame whose step turns a body too far to be made.
fn too_fast(scene: &Scene, body: &Body) -> Option<String> {
    let time = |frame: i32| f64::from(frame) / scene.shot.fps;
    scene.shot.frames.iter().skip(1).find_map(|frame| {
        let error = body.turning(time(frame - 1), time(frame)).err()?;
        Some(format!("frame {frame} cannot be made: {error}"))
    })
}

/// The first frame that a run could not make because a body that touches the snow reaches too far from it.
fn out_of_reach(
    ctx: &Context,
    scene: &Scene,
    inputs: &Inputs,
    body: &Body,
    extents: &[Extent],
) -> Result<Option<String>> {
    let Some((low, high)) = inputs.bounds() else { return Ok(None) };
    let (middle, cell) = (0.5 * (low + high), inputs.snow.cell);
    // The snow's own middle, known when it is made, may be another.
    let near = (0.5 * REACH * cell).min(REACH * cell - (high - low).norm());
    let is_far = |extent: &Extent| {
        let far = (extent.low - middle).abs().sup(&(extent.high - middle).abs()).max();
        far + extent.moved > near
    };
    let reach = Reach::of_snow(cell, low, high)?;
    let time = |frame: i32| f64::from(frame) / scene.shot.fps;
    for frame in extents.iter().filter(|extent| is_far(extent)).map(|extent| extent.frame) {
        let before = (frame - 1).max(scene.shot.frames.first);
        match reach.spans(ctx, body, time(before), time(frame)) {
            Ok(_) => {}
            Err(Error::Argument(what)) => return Ok(Some(format!("frame {frame} cannot be made: {what}"))),
            Err(other) => return Err(other),
        }
    }
    Ok(None)
}

fn report(
    scene: &Scene,
    index: usize,
    object: &Object,
    body: &Body,
    extents: &[Extent],
    snow: Option<([f64; 4], f64)>,
    warnings: &mut Vec<String>,
) -> ObjectReport {
    let name = name_of(index, object);
    let first = &extents[0];
    let size = first.high - first.low;
    let (low, high) =
        extents.iter().fold((first.low, first.high), |(l, h), e| (l.inf(&e.low), h.sup(&e.high)));
    let fastest =
        extents.iter().fold(first, |best, extent| if extent.moved > best.moved { extent } else { best });
    let touching = |extent: &&Extent| match snow {
        Some(([x0, z0, x1, z1], top)) => {
            let beside = extent.high.x < x0 || extent.low.x > x1 || extent.high.z < z0 || extent.low.z > z1;
            !beside && extent.low.y < top
        }
        None => true,
    };
    let touches = extents.iter().find(touching).zip(extents.iter().rev().find(touching));
    let tallest = size.max();
    if let Some(factor) = likely_scale(tallest) {
        let scale = object.space.scale * factor;
        warnings.push(format!("{name} is {tallest:.3} m large: scale = {scale}?"));
    }
    if let (None, Some((area, top))) = (touches, snow) {
        let what = if low.y >= top {
            format!("it stays {:.3} m above it", low.y - top)
        } else {
            format!("it stays beside the area {area:?}")
        };
        warnings.push(format!("{name} never touches the snow: {what}"));
    }
    if body.contradictions() > 0 {
        warnings.push(format!(
            "{name}: its triangles disagree about inside and outside at {} edges; holes are closed by cones, look at its prints",
            body.contradictions()
        ));
    }
    ObjectReport {
        file: object.file.display().to_string(),
        role: "collide",
        triangles: body.motion().triangles().len(),
        closed_loops: body.closed_loops(),
        holes: 0,
        contradictions: body.contradictions(),
        size_m: size.into(),
        bounds_m: [low.into(), high.into()],
        fastest_m_per_s: fastest.moved * scene.shot.fps,
        fastest_frame: fastest.frame,
        touches: touches.map(|(first, last)| [first.frame, last.frame]),
        deepest: None,
        walk: None,
    }
}

fn name_of(index: usize, object: &Object) -> String {
    format!("object {} ({})", index + 1, crate::scene::text::name(&object.file))
}

/// Holes of a body at the first frame.
fn holes(scene: &Scene, body: &Body) -> Result<usize> {
    let mut pose = Vec::new();
    body.motion().pose(f64::from(scene.shot.frames.first) / scene.shot.fps, &mut pose)?;
    Ok(faults::holes(&pose, body.motion().triangles()))
}

/// The lowest place against the ground, of the lowest vertices of all frames.
fn deepest(relief: &Relief, extents: &[Extent]) -> Option<Deepest> {
    let of = |extent: &Extent| {
        let (ground, top) = relief.at(extent.lowest.x, extent.lowest.z)?;
        let y = extent.lowest.y;
        Some(Deepest { frame: extent.frame, y_m: y, above_ground_m: y - ground, below_top_m: top - y })
    };
    extents.iter().filter_map(of).min_by(|a, b| a.above_ground_m.total_cmp(&b.above_ground_m))
}

/// What is wrong with where an object's lowest parts go.
fn warn_of_feet(cell: f64, name: &str, told: &ObjectReport, warnings: &mut Vec<String>) {
    if let Some(deep) = told.deepest.filter(|deep| deep.above_ground_m < -0.5 * cell) {
        warnings.push(format!(
            "{name} goes {:.3} m below the ground at frame {}: raise it by its keys, or its prints go through the snow",
            -deep.above_ground_m, deep.frame
        ));
    }
    if let Some(walk) = told.walk.as_ref().filter(|walk| walk.slips) {
        warnings.push(format!(
            "{name}: its feet slip at {:.2} m/s while they stand; its clip walks at {:.2} m/s: {}",
            walk.slips_m_per_s,
            DVec3::from(walk.carry_m_per_s).norm(),
            walk.keys
        ));
    }
}

/// The factor that a size (m) asks for when the file is likely in centimetres, millimetres, or in a unit too large.
fn likely_scale(size: f64) -> Option<f64> {
    let plausible = |factor: f64| (0.3..=5.0).contains(&(size * factor));
    match size {
        size if size > TALL => [0.01, 0.001].into_iter().find(|factor| plausible(*factor)),
        size if size < SMALL => [100.0, 1000.0].into_iter().find(|factor| plausible(*factor)),
        _ => None,
    }
}

/// Bytes of a whole base file: by its columns, or by the leaves of a layer that is given.
fn whole_base(inputs: &Inputs, columns: Option<f64>) -> f64 {
    match (inputs.given(), columns) {
        (Some(grid), _) => grid.leaf_count() as f64 * BYTES_PER_LEAF,
        (None, columns) => columns.unwrap_or(0.0) * BYTES_PER_COLUMN,
    }
}

/// Space that the files need, about (bytes), where a whole base takes so many.
fn disk(scene: &Scene, inputs: &Inputs, whole: f64) -> u64 {
    let (output, frames) = (scene.output, scene.shot.frames.count() as f64);
    let whole = whole * if output.half { 0.6 } else { 1.0 };
    let base = match (output.base, output.base_mode) {
        (false, _) => 0.0,
        (true, BaseMode::Full) => whole * frames,
        (true, BaseMode::Delta) => whole,
    };
    let objects = inputs.bodies.iter().map(|body| {
        let drawn = body.motion().drawn();
        let vertices = drawn.vertices as f64;
        let (places, corners) = drawn.uvs.map_or((0.0, 0.0), |uvs| {
            (uvs.places.len() as f64, uvs.corners.as_ref().map_or(0.0, |corners| corners.len() as f64))
        });
        let usda = vertices * USDA_PER_VERTEX + places * USDA_PER_PLACE + corners * USDA_PER_INDEX;
        let ply = vertices * PLY_PER_VERTEX + places.max(corners) * PLY_PER_PLACE;
        f64::from(output.objects_usd) * usda + f64::from(output.objects_ply) * ply
    });
    let objects = objects.sum::<f64>() * frames;
    (base + objects + frames * BYTES_PER_CHANGE) as u64
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
}
