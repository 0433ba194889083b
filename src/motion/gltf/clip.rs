//! A clip: the animation of the nodes' transforms.

use gltf::animation::{Interpolation, Property};

use super::file::File;
use super::nodes::{Local, rotation};
use crate::geometry::DVec3;

/// Kinks closer together than this (s) are one: times in files are 32-bit floats.
const SAME_TIME: f64 = 1e-5;
/// A jump begins this long before its key (s).
pub(super) const JUMP: f64 = 1e-4;

/// One animated property of one node.
struct Channel {
    node: usize,
    property: Property,
    interpolation: Interpolation,
    /// Key times (s), non-decreasing.
    times: Vec<f64>,
    /// `width` numbers for each key; for cubic splines three such rows: in-tangent, value, out-tangent.
    values: Vec<f64>,
    width: usize,
}

/// A named set of channels.
pub(super) struct Clip {
    channels: Vec<Channel>,
    /// First and last key (s).
    pub start: f64,
    pub end: f64,
}

impl Clip {
    /// Reads a clip.
    ///
    /// # Errors
    /// Keys that are not in order; numbers that are missing or not finite.
    pub fn read(file: &File, animation: &gltf::Animation) -> Result<Self, String> {
        let mut channels = Vec::new();
        for channel in animation.channels() {
            // Extensions may omit the node, but only nodes are animated here.
            let node = channel.target().node();
            let sampler = channel.sampler();
            let times = numbers::<1>(file, &sampler.input())?;
            if times.is_empty() {
                continue;
            }
            if times.windows(2).any(|pair| pair[1] < pair[0]) {
                return Err(format!("the keys of node \"{}\" are not in order", node.name().unwrap_or("?")));
            }
            let property = channel.target().property();
            let values = match property {
                Property::Translation | Property::Scale => numbers::<3>(file, &sampler.output())?,
                Property::Rotation => numbers::<4>(file, &sampler.output())?,
                Property::MorphTargetWeights => numbers::<1>(file, &sampler.output())?,
            };
            let interpolation = sampler.interpolation();
            let rows = times.len() * if interpolation == Interpolation::CubicSpline { 3 } else { 1 };
            let width = values.len() / rows;
            if width == 0 || width * rows != values.len() {
                return Err(format!(
                    "node \"{}\" does not have one value per key",
                    node.name().unwrap_or("?")
                ));
            }
            channels.push(Channel { node: node.index(), property, interpolation, times, values, width });
        }
        let ends = channels.iter().map(|channel| (channel.times[0], channel.times[channel.times.len() - 1]));
        let ends = ends.reduce(|a, b| (a.0.min(b.0), a.1.max(b.1)));
        let (start, end) = ends.unwrap_or_default();
        Ok(Self { channels, start, end })
    }

    /// Sets the transforms that the clip animates to their values at a time of the clip (s).
    pub fn apply(&self, time: f64, locals: &mut [Local]) {
        let mut row = Vec::new();
        for channel in &self.channels {
            channel.at(time, &mut row);
            let Some(local) = locals.get_mut(channel.node) else { continue };
            match (channel.property, &row[..]) {
                (Property::Translation, &[x, y, z]) => local.translation = DVec3::new(x, y, z),
                (Property::Scale, &[x, y, z]) => local.scale = DVec3::new(x, y, z),
                (Property::Rotation, &[x, y, z, w]) => local.rotation = rotation([x, y, z, w]),
                (Property::MorphTargetWeights, weights) => local.weights = weights.to_vec(),
                _ => {}
            }
        }
    }

    /// Times of the clip (s), ascending, at which its motion has a kink; a jump is two of them, close together.
    pub fn kinks(&self) -> Vec<f64> {
        let mut out: Vec<f64> = Vec::new();
        for channel in &self.channels {
            for (key, &time) in channel.times.iter().enumerate() {
                if channel.interpolation != Interpolation::Step {
                    out.push(time);
                } else if key > 0 && channel.value(key) != channel.value(key - 1) {
                    out.extend([time - JUMP, time]);
                }
            }
        }
        out.sort_unstable_by(f64::total_cmp);
        out.dedup_by(|later, earlier| *later - *earlier < SAME_TIME);
        out
    }
}

impl Channel {
    /// The value of a key.
    fn value(&self, key: usize) -> &[f64] {
        let row = if self.interpolation == Interpolation::CubicSpline { 3 * key + 1 } else { key };
        &self.values[row * self.width..(row + 1) * self.width]
    }

    /// The value at a time; constant before the first key and after the last.
    fn at(&self, time: f64, out: &mut Vec<f64>) {
        out.clear();
        let next = self.times.partition_point(|&key| key <= time);
        let last = self.times.len() - 1;
        if next == 0 || next > last {
            return out.extend(self.value(if next == 0 { 0 } else { last }));
        }
        let (key, span) = (next - 1, self.times[next] - self.times[next - 1]);
        let part = (time - self.times[key]) / span;
        match self.interpolation {
            Interpolation::Step => out.extend(self.value(key)),
            Interpolation::Linear if self.property == Property::Rotation && self.width == 4 => {
                out.extend(slerp(self.value(key), self.value(next), part));
            }
            Interpolation::Linear => {
                let ends = self.value(key).iter().zip(self.value(next));
                out.extend(ends.map(|(a, b)| a + (b - a) * part));
            }
            Interpolation::CubicSpline => {
                let row = |key: usize, which: usize| &self.values[(3 * key + which) * self.width..];
                let (square, cube) = (part * part, part * part * part);
                // Hermite basis; tangents are per second.
                let weights = [
                    2.0 * cube - 3.0 * square + 1.0,
                    span * (cube - 2.0 * square + part),
                    3.0 * square - 2.0 * cube,
                    span * (cube - square),
                ];
                let rows = [row(key, 1), row(key, 2), row(next, 1), row(next, 0)];
                out.extend((0..self.width).map(|i| (0..4).map(|r| weights[r] * rows[r][i]).sum::<f64>()));
            }
        }
    }
}

/// The numbers of an accessor, row after row.
fn numbers<const N: usize>(file: &File, accessor: &gltf::Accessor) -> Result<Vec<f64>, String> {
    Ok(file.rows::<N>(accessor)?.as_flattened().iter().map(|&number| f64::from(number)).collect())
}

/// Interpolates two rotations (x, y, z, w) along the shorter arc.
fn slerp(a: &[f64], b: &[f64], part: f64) -> [f64; 4] {
    let [a, b] = [a, b].map(|q| [q[0], q[1], q[2], q[3]]);
    let (a, mut b) = (rotation(a).into_inner().coords, rotation(b).into_inner().coords);
    let mut cosine = a.dot(&b);
    if cosine < 0.0 {
        (b, cosine) = (-b, -cosine);
    }
    let (from, to) = if cosine > 1.0 - 1e-9 {
        (1.0 - part, part)
    } else {
        let angle = libm::acos(cosine);
        let sine = libm::sin(angle);
        (libm::sin((1.0 - part) * angle) / sine, libm::sin(part * angle) / sine)
    };
    let mixed = a * from + b * to;
    [mixed[0], mixed[1], mixed[2], mixed[3]]
}
