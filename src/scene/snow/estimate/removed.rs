//! Forecast of the snow that objects remove in each frame, before the base is made: the objects are posed, and each column of snow loses what
//! lies between the lowest and the highest surface that has been there. Ragged edges and static objects are ignored.

use std::path::Path;

use nalgebra::Vector2;
use rayon::prelude::*;

use super::grains::Removed;
use crate::context::Context;
use crate::error::Result;
use crate::geometry::DVec3;
use crate::motion::Poses;
use crate::scene::Scene;
use crate::scene::run::DoneFrames;
use crate::scene::snow::Inputs;
use crate::scene::snow::inspect::object_path::ObjectPath;
use crate::scene::snow::inspect::relief::Relief;

/// Maximum count of columns: in larger areas they are wider than the cells of the snow.
const MAX_COLUMNS: f64 = 262_144.0;
/// Path of a vertex between two poses, as a multiple of a column's edge, and the maximum number of poses in a frame.
const STEP: f64 = 2.0;
const MAX_POSES: f64 = 16.0;
/// Number of consecutive frames that one task poses, and those that are in memory at once.
const BATCH: usize = 4;
const IN_MEMORY: usize = 64;

type DVec2 = Vector2<f64>;
/// The lowest and highest y (m) of a surface in a column.
type Span = [f64; 2];

/// The snow that is removed in each frame: as far as a base in `folder` tells, then by the poses of objects, if heights of the snow are known.
///
/// # Errors
/// A damaged record of the base; a pose that cannot be computed; cancel.
pub(in crate::scene::snow) fn removed_snow(
    ctx: &Context,
    scene: &Scene,
    inputs: &Inputs,
    folder: Option<&Path>,
    paths: &[ObjectPath],
    relief: Option<&Relief>,
) -> Result<Removed> {
    let by_base = match folder {
        Some(folder) => Removed::by_base(scene, &DoneFrames::read(folder, "base")?, scene.shot.frames.last)?,
        None => Removed::default(),
    };
    match relief.filter(|_| by_base.missing(scene) > 0) {
        Some(relief) => Ok(by_base.and_estimated(&estimated(ctx, scene, relief, paths, inputs.snow.cell)?)),
        None => Ok(by_base),
    }
}

/// Volume (m3) that all objects remove in each frame of the shot; in the first one, that of their first poses.
fn estimated(
    ctx: &Context,
    scene: &Scene,
    relief: &Relief,
    paths: &[ObjectPath],
    cell: f64,
) -> Result<Vec<f64>> {
    let frames: Vec<i32> = scene.shot.frames.iter().collect();
    let removers: Vec<&ObjectPath> = paths.iter().filter(|path| path.object().role.removes()).collect();
    let Some(columns) = Columns::around(&removers, cell) else { return Ok(vec![0.0; frames.len()]) };
    let mut snow: Vec<Snow> = vec![Snow::Unknown; columns.len()];
    let mut out = Vec::with_capacity(frames.len());
    for frames in frames.chunks(IN_MEMORY) {
        let of_batch = |batch: &[i32]| batch_spans(ctx, &columns, &removers, batch);
        let spans: Vec<Vec<Vec<(usize, Span)>>> =
            frames.par_chunks(BATCH).map(of_batch).collect::<Result<_>>()?;
        for spans in spans.into_iter().flatten() {
            let lost: f64 = spans
                .into_iter()
                .map(|(column, span)| {
                    snow[column].lose(span, || {
                        let [x, z] = columns.centre(column).into();
                        relief.at(x, z)
                    })
                })
                .sum();
            out.push(lost * columns.edge * columns.edge);
        }
    }
    Ok(out)
}

/// The snow of a column.
#[derive(Clone, Copy)]
enum Snow {
    /// No object was there yet.
    Unknown,
    /// There is none.
    None,
    /// Heights of the ground and of the top, and between which heights objects have been (m).
    Layer { bottom: f64, top: f64, cut: Span },
}

impl Snow {
    /// Removes the snow of a span; returns how much less there is (m). `heights` gives those of ground and top.
    fn lose(&mut self, span: Span, heights: impl FnOnce() -> Option<(f64, f64)>) -> f64 {
        if let Self::Unknown = self {
            *self = heights().map_or(Self::None, |(bottom, top)| Self::Layer {
                bottom,
                top,
                cut: [f64::INFINITY, f64::NEG_INFINITY],
            });
        }
        let Self::Layer { bottom, top, cut } = self else { return 0.0 };
        let height = |cut: &Span| (cut[1].min(*top) - cut[0].max(*bottom)).max(0.0);
        let before = height(cut);
        *cut = [cut[0].min(span[0]), cut[1].max(span[1])];
        height(cut) - before
    }
}

/// Columns that cover the paths of some objects near the snow.
struct Columns {
    /// Edge of a column (m).
    edge: f64,
    /// Lowest x and z (m).
    low: DVec2,
    /// Count along x and z.
    count: [usize; 2],
}

impl Columns {
    /// None if no object comes near the snow.
    fn around(paths: &[&ObjectPath], cell: f64) -> Option<Self> {
        let boxes = paths.iter().flat_map(|path| path.boxes_near_snow().map(|(_, corners)| corners));
        let [low, high] = boxes.reduce(|a, b| [a[0].inf(&b[0]), a[1].sup(&b[1])])?;
        let (low, size) = (low.xz(), (high - low).xz());
        // A margin of one column, and no more than the maximum of them.
        let edge = cell.max((size.x * size.y / MAX_COLUMNS).sqrt()).max(size.max() / MAX_COLUMNS);
        let count = [size.x, size.y].map(|length| (length / edge).ceil() as usize + 1);
        Some(Self { edge, low: low - DVec2::repeat(0.5 * edge), count })
    }

    fn len(&self) -> usize {
        self.count[0] * self.count[1]
    }

    /// x and z of the centre of a column (m).
    fn centre(&self, column: usize) -> DVec2 {
        let [x, z] = [column % self.count[0], column / self.count[0]].map(|at| at as f64 + 0.5);
        self.low + self.edge * DVec2::new(x, z)
    }

    /// Widens the spans of the columns whose centres lie below or above a triangle.
    fn widen(&self, [a, b, c]: [DVec3; 3], spans: &mut Spans) {
        let flat = |p: DVec3| (p.xz() - self.low) / self.edge - DVec2::repeat(0.5);
        let (p, u, v) = (flat(a), flat(b) - flat(a), flat(c) - flat(a));
        let area = u.perp(&v);
        if area == 0.0 {
            return;
        }
        let low = p + DVec2::zeros().inf(&u).inf(&v);
        let high = p + DVec2::zeros().sup(&u).sup(&v);
        let range = |axis: usize| {
            let end = (high[axis].floor() + 1.0).clamp(0.0, self.count[axis] as f64);
            low[axis].ceil().max(0.0) as usize..end as usize
        };
        for z in range(1) {
            for x in range(0) {
                let offset = DVec2::new(x as f64, z as f64) - p;
                let [s, t] = [offset.perp(&v) / area, u.perp(&offset) / area];
                if s >= 0.0 && t >= 0.0 && s + t <= 1.0 {
                    spans.widen(z * self.count[0] + x, a.y + s * (b.y - a.y) + t * (c.y - a.y));
                }
            }
        }
    }
}

/// Spans of the columns where surfaces are, in the order in which they were met.
struct Spans {
    /// Of all columns; empty ones are reversed.
    all: Vec<[f64; 2]>,
    met: Vec<usize>,
}

impl Spans {
    const EMPTY: Span = [f64::INFINITY, f64::NEG_INFINITY];

    fn new(columns: usize) -> Self {
        Self { all: vec![Self::EMPTY; columns], met: Vec::new() }
    }

    fn widen(&mut self, column: usize, y: f64) {
        let [low, high] = &mut self.all[column];
        if *low > *high {
            self.met.push(column);
        }
        (*low, *high) = (low.min(y), high.max(y));
    }

    /// The spans, which are empty from then on.
    fn take(&mut self) -> Vec<(usize, Span)> {
        let all = &mut self.all;
        self.met.drain(..).map(|column| (column, std::mem::replace(&mut all[column], Self::EMPTY))).collect()
    }
}

/// The spans that objects have in each frame of a batch: at the poses after the frame before it, and up to its own.
fn batch_spans(
    ctx: &Context,
    columns: &Columns,
    paths: &[&ObjectPath],
    batch: &[i32],
) -> Result<Vec<Vec<(usize, Span)>>> {
    let mut spans = Spans::new(columns.len());
    let mut out = vec![Vec::new(); batch.len()];
    for path in paths {
        let (motion, near) = (path.body().motion(), path.frames_near_snow());
        for (frame, out) in batch.iter().zip(&mut out) {
            ctx.check()?;
            let Some((times, moved)) = near.contains(frame).then(|| path.step_to(*frame)) else { continue };
            let poses = (moved / (STEP * columns.edge)).ceil().clamp(1.0, MAX_POSES) as usize;
            let mut pose = Poses::start(motion, times[1])?;
            for at in 1..=poses {
                if at > 1 {
                    let part = (poses + 1 - at) as f64 / poses as f64;
                    pose.go_to(times[0] + part * (times[1] - times[0]))?;
                }
                let positions = pose.now();
                let corners = |triangle: &[u32; 3]| triangle.map(|vertex| positions[vertex as usize]);
                motion.triangles().iter().for_each(|triangle| columns.widen(corners(triangle), &mut spans));
            }
            out.append(&mut spans.take());
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_triangle_is_over_as_many_columns_as_its_area_and_at_its_own_heights() {
        let columns = Columns { edge: 0.01, low: DVec2::new(-0.5, 0.25), count: [100, 150] };
        let mut spans = Spans::new(columns.len());
        // In the plane y = 2 x - z, one corner beside the columns.
        let corner = |x: f64, z: f64| DVec3::new(x, 2.0 * x - z, z);
        let corners = [corner(-0.4, 0.3), corner(0.3, 0.7), corner(-0.1, 1.8)];
        columns.widen(corners, &mut spans);
        let found = spans.take();
        for (column, [low, high]) in &found {
            let at = columns.centre(*column);
            assert!(low == high && (low - (2.0 * at.x - at.y)).abs() < 1e-12, "{at:?} {low} {high}");
        }
        // Without the part beyond z = 1.75, which cuts two edges near the last corner.
        let area = |[a, b, c]: [DVec3; 3]| 0.5 * (b - a).xz().perp(&(c - a).xz()).abs();
        let beyond = 0.05 / 1.5 * 0.05 / 1.1;
        let inside = area(corners) * (1.0 - beyond);
        assert!((found.len() as f64 * 1e-4 / inside - 1.0).abs() < 0.01, "{} {inside}", found.len());
        // A second surface widens the spans, and what was taken is gone.
        columns.widen(corners, &mut spans);
        columns.widen(corners.map(|corner| corner + DVec3::y()), &mut spans);
        let again = spans.take();
        assert!(
            again.len() == found.len()
                && again.iter().all(|(_, [low, high])| (high - low - 1.0).abs() < 1e-12)
        );
    }

    #[test]
    fn a_column_loses_what_is_between_all_spans_within_its_snow() {
        let mut snow = Snow::Unknown;
        let mut lose = |span: Span| (snow.lose(span, || Some((0.1, 0.4))) * 1e9).round() / 1e9;
        assert_eq!(lose([0.5, 2.0]), 0.0);
        assert_eq!(lose([0.3, 2.0]), 0.1);
        assert_eq!(lose([0.35, 1.0]), 0.0);
        assert_eq!(lose([-1.0, 0.2]), 0.2);
        assert_eq!(lose([-2.0, 3.0]), 0.0);
        assert_eq!(Snow::Unknown.lose([0.0, 1.0], || None), 0.0);
    }
}
