//! Skins that fold inside out.
//!
//! Where a pose winds around a point negatively, outward motion only brings the point back to 0: it is not swept, though
//! the surface passed it outward. Swept is what a winding number reaches 1 at some time, so what passes outward near such
//! places is asked, at points of it, what the pose before winds around them, and what passes them earlier in the same
//! step; what comes from below 0 does not count. A point that the first pose winds around negatively starts below 0 in the
//! chain too: what brings it to 0 for the first time counts.

use std::borrow::Cow;
use std::collections::HashSet;

use rayon::prelude::*;

use super::chain::{Face, STILL, Window};
use super::lattice::{Fixed, UNITS};
use super::lists::Lists;
use super::region::{Region, each_block, extent};
use super::topology::{Simplex, Topology};
use super::winding::Lines;
use crate::base::DVec3;
use crate::context::Context;
use crate::error::Result;

/// Negative stretches of a line that are shorter than this (cells) are none.
const SHORT: f64 = 1e-3;
/// Least edge of the boxes that tetrahedra and faces are sorted into (fixed-point units).
const BOX: f64 = UNITS as f64;
/// Boxes for each thing that is sorted into them, at most.
const BOXES: usize = 4;
/// Triangles or edges that a task handles.
const GRAIN: usize = 4096;
/// Points that a task asks.
const FEW: usize = 64;
/// Where a tetrahedron is asked: barycentric weights, off all symmetries.
const SAMPLES: [[f64; 4]; 5] = [
    [0.252, 0.249, 0.251, 0.248],
    [0.703, 0.102, 0.097, 0.098],
    [0.098, 0.703, 0.102, 0.097],
    [0.097, 0.098, 0.703, 0.102],
    [0.102, 0.097, 0.098, 0.703],
];

/// Clears the bits (see [`super::chain`]) of tetrahedra through which the surface only comes back from inside out.
///
/// # Errors
/// Cancel.
pub fn drop_returns(
    ctx: &Context,
    topology: &Topology,
    levels: &[Vec<Fixed>],
    window: &Window,
    outward: &mut [u8],
) -> Result<()> {
    let Some(folded) = Folded::find(ctx, topology, levels, window)? else { return Ok(()) };
    let poses = Poses { ctx, topology, levels };
    let steps = levels.len() - 1;
    let found: Vec<Returns> = (0..steps)
        .into_par_iter()
        .map(|step| poses.returns(step, &folded.triangles(topology, levels, step)))
        .collect::<Result<_>>()?;
    let early: Vec<Early> = found.iter().flat_map(|found| found.early.iter().copied()).collect();
    let first: HashSet<Place> = poses.first_ones(early)?.into_iter().collect();
    for place in found.iter().flat_map(|found| &found.places).filter(|place| !first.contains(place)) {
        outward[place.triangle as usize * steps + place.step as usize] &= !(1 << place.part);
    }
    Ok(())
}

/// Where to look for passages that come back from inside out.
enum Folded {
    /// The poses are the first one, moved as a whole, and these triangles are near what it winds around negatively.
    Rigid(Vec<u32>),
    /// The blocks near what each pose winds around negatively.
    Blocks(Vec<HashSet<[i32; 3]>>),
}

impl Folded {
    /// None when nothing folds.
    fn find(
        ctx: &Context,
        topology: &Topology,
        levels: &[Vec<Fixed>],
        window: &Window,
    ) -> Result<Option<Self>> {
        let rigid = is_rigid(topology, levels);
        let (asked, window) =
            if rigid { (&levels[..1], &come_from(levels, window)) } else { (levels, window) };
        let blocks: Vec<HashSet<[i32; 3]>> = asked
            .par_iter()
            .map(|level| folded_blocks(ctx, topology, level, window))
            .collect::<Result<_>>()?;
        if blocks.iter().all(HashSet::is_empty) {
            return Ok(None);
        }
        Ok(Some(if rigid {
            Self::Rigid(touching(topology, &levels[0], &blocks[0]))
        } else {
            Self::Blocks(blocks)
        }))
    }

    /// The triangles that may come back in a step, ascending.
    fn triangles(&self, topology: &Topology, levels: &[Vec<Fixed>], step: usize) -> Cow<'_, [u32]> {
        match self {
            Self::Rigid(triangles) => Cow::Borrowed(triangles),
            Self::Blocks(blocks) => {
                let [mut before, after] =
                    [step, step + 1].map(|level| touching(topology, &levels[level], &blocks[level]));
                before.extend(after);
                before.sort_unstable();
                before.dedup();
                Cow::Owned(before)
            }
        }
    }
}

/// Where what comes into a window is at the first pose.
fn come_from(levels: &[Vec<Fixed>], window: &Window) -> Window {
    let way = |level: &Vec<Fixed>| {
        let ways =
            levels[0].iter().zip(level).map(|(from, to)| [0, 1, 2].map(|axis| from[axis].abs_diff(to[axis])));
        ways.fold([0; 3], |most, way| [0, 1, 2].map(|axis| most[axis].max(way[axis])))
    };
    let most =
        levels.par_iter().map(way).reduce(|| [0; 3], |a, b| [0, 1, 2].map(|axis| a[axis].max(b[axis])));
    let [min, max] = [window.min, window.max];
    Window {
        min: [0, 1, 2].map(|axis| min[axis].saturating_sub_unsigned(most[axis])),
        max: [0, 1, 2].map(|axis| max[axis].saturating_add_unsigned(most[axis])),
    }
}

/// The triangles of a pose that touch these blocks, ascending.
fn touching(topology: &Topology, level: &[Fixed], blocks: &HashSet<[i32; 3]>) -> Vec<u32> {
    if blocks.is_empty() {
        return Vec::new();
    }
    let block = |cells: [f32; 3]| cells.map(|value| (value / 8.0).floor() as i32);
    let touches = |simplex: &Simplex| {
        let (low, high) = extent(&simplex.v.map(|vertex| level[vertex as usize]));
        each_block(block(low), block(high)).any(|block| blocks.contains(&block))
    };
    (0..topology.simplices.len() as u32).filter(|&id| touches(&topology.simplices[id as usize])).collect()
}

/// The blocks in which a pose winds negatively, and those around them.
fn folded_blocks(
    ctx: &Context,
    topology: &Topology,
    level: &[Fixed],
    window: &Window,
) -> Result<HashSet<[i32; 3]>> {
    ctx.check()?;
    let simplices = topology.simplices.par_iter().with_min_len(GRAIN);
    let faces: Vec<Face> = simplices.map(|simplex| face(simplex, level)).collect();
    let around = |block: [i32; 3]| {
        let [low, high] = [-1, 1].map(|by| block.map(|place| place + by));
        each_block(low, high)
    };
    Ok(negative_blocks(&faces, window).into_iter().flat_map(around).collect())
}

fn face(simplex: &Simplex, level: &[Fixed]) -> Face {
    let [a, b, c] = simplex.v.map(|vertex| level[vertex as usize]);
    Face { v: if simplex.sign > 0 { [a, b, c] } else { [a, c, b] }, coef: 1 }
}

/// Whether all poses are the first one, moved as a whole.
fn is_rigid(topology: &Topology, levels: &[Vec<Fixed>]) -> bool {
    let length = |level: &[Fixed], [i, j]: [u32; 2]| {
        let [a, b] = [i, j].map(|vertex| place(level[vertex as usize]));
        (a - b).norm()
    };
    levels[1..].iter().all(|level| {
        let same = |edge: &[u32; 2]| (length(level, *edge) - length(&levels[0], *edge)).abs() < 4.0;
        topology.edges.par_iter().with_min_len(GRAIN).all(same)
    })
}

/// The blocks in which closed faces wind negatively around points on lines through voxels.
fn negative_blocks(faces: &[Face], window: &Window) -> Vec<[i32; 3]> {
    let cells = |p: Fixed| p.map(|value| value.div_euclid(UNITS));
    let Ok(region) = Region::around(faces, 0.0, cells(window.min), cells(window.max)) else {
        return Vec::new();
    };
    let mut out = Vec::new();
    let lines = Lines::scan(faces, &region);
    if lines.least_winding() >= 0 {
        return out;
    }
    lines.each_line(|[x, y], line| {
        let negative = line.windows(2).filter(|pair| pair[0].1 < 0 && pair[1].0 - pair[0].0 > SHORT);
        for pair in negative {
            let [first, last] = [pair[0].0, pair[1].0].map(|z| (z / 8.0).floor() as i32);
            out.extend((first..=last).map(|z| [x >> 3, y >> 3, z]));
        }
    });
    out.dedup();
    out
}

/// One of the tetrahedra that the surface passes through.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
struct Place {
    /// The triangle whose prism it is of, the step, and which of the three it is.
    triangle: u32,
    step: u32,
    part: u32,
}

/// A tetrahedron that the surface passes through.
struct Passage {
    place: Place,
    /// 1 when the surface moves outward, -1 when inward.
    sign: i32,
    corners: [DVec3; 4],
    /// Three rows that give the weights of the second to fourth corner from a way from the first.
    weights: [DVec3; 3],
}

/// What comes back in a step.
#[derive(Default)]
struct Returns {
    places: Vec<Place>,
    /// Points of them that the first pose winds around negatively, and that may come to 0 for the first time.
    early: Vec<Early>,
}

/// A point of a tetrahedron.
#[derive(Clone, Copy)]
struct Early {
    place: Place,
    at: DVec3,
}

/// What a passage brings a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Change {
    /// A winding number above 0.
    Counts,
    /// Back to 0, or less; it has been there in the same step.
    Returns,
    /// To 0 or less, and the step began below 0.
    Rises,
}

/// The poses of a moving mesh.
struct Poses<'a> {
    ctx: &'a Context,
    topology: &'a Topology,
    levels: &'a [Vec<Fixed>],
}

impl Poses<'_> {
    /// The outward passages of some triangles in a step that do not count anywhere.
    fn returns(&self, step: usize, triangles: &[u32]) -> Result<Returns> {
        self.ctx.check()?;
        let passages: Vec<Passage> = triangles
            .iter()
            .flat_map(|&triangle| self.passages(step, triangle))
            .filter(|passage| passage.sign > 0)
            .collect();
        if passages.is_empty() {
            return Ok(Returns::default());
        }
        let points: Vec<DVec3> = passages.iter().flat_map(Passage::samples).collect();
        let (during, first) = (Step::new(self, step, &points), Still::new(self, 0, &points));
        let ask = |passage: &Passage| {
            let mut early = Vec::new();
            for at in passage.samples() {
                match during.change(passage.place, &at) {
                    Change::Counts => return None,
                    Change::Rises if first.winding(&at) < 0 => early.push(Early { place: passage.place, at }),
                    Change::Rises | Change::Returns => {}
                }
            }
            Some((passage.place, early))
        };
        let found: Vec<_> = passages.par_iter().with_min_len(FEW).filter_map(ask).collect();
        let places = found.iter().map(|(place, _)| *place).collect();
        Ok(Returns { places, early: found.into_iter().flat_map(|(_, early)| early).collect() })
    }

    /// Those whose points no earlier step brings to 0.
    fn first_ones(&self, mut early: Vec<Early>) -> Result<Vec<Place>> {
        let mut first = Vec::new();
        for step in 0..self.levels.len() - 1 {
            early.retain(|point| {
                let is_now = point.place.step as usize == step;
                first.extend(is_now.then_some(point.place));
                !is_now
            });
            if early.is_empty() {
                break;
            }
            self.ctx.check()?;
            let points: Vec<DVec3> = early.iter().map(|point| point.at).collect();
            let during = Step::new(self, step, &points);
            early =
                early.into_par_iter().with_min_len(FEW).filter(|point| during.is_below(&point.at)).collect();
        }
        Ok(first)
    }

    /// The tetrahedra that a triangle passes in a step.
    fn passages(&self, step: usize, triangle: u32) -> impl Iterator<Item = Passage> {
        let [a, b] = self.prism(step, triangle);
        let still = STILL * (a[1] - a[0]).cross(&(a[2] - a[0])).norm();
        let sign = i32::from(self.topology.simplices[triangle as usize].sign);
        let place = move |part| Place { triangle, step: step as u32, part };
        let tetrahedra = tetrahedra(a, b).into_iter().zip(0..);
        tetrahedra.filter_map(move |(corners, part)| Passage::new(place(part), corners, sign, still))
    }

    /// A triangle before and after a step.
    fn prism(&self, step: usize, triangle: u32) -> [[DVec3; 3]; 2] {
        let corners = self.topology.simplices[triangle as usize].v;
        [step, step + 1].map(|level| corners.map(|vertex| place(self.levels[level][vertex as usize])))
    }
}

/// A pose, to be asked at points.
struct Still {
    faces: Vec<[DVec3; 3]>,
    /// Which of them are above and below each box.
    columns: Boxes,
}

impl Still {
    fn new(poses: &Poses<'_>, level: usize, points: &[DVec3]) -> Self {
        let flat = |p: DVec3| DVec3::new(p.x, p.y, 0.0);
        let (least, most) = bounds(points);
        let is_near = |corners: &[DVec3; 3]| {
            let (low, high) = bounds(corners);
            low.x <= most.x && high.x >= least.x && low.y <= most.y && high.y >= least.y && high.z >= least.z
        };
        let corners = |simplex| face(simplex, &poses.levels[level]).v.map(place);
        let faces: Vec<[DVec3; 3]> = poses.topology.simplices.iter().map(corners).filter(is_near).collect();
        let extents: Vec<_> = faces.iter().map(|corners| bounds(&corners.map(flat))).collect();
        let columns = Boxes::new(points.iter().map(|p| flat(*p)), &extents);
        Self { faces, columns }
    }

    /// How often the pose winds around one of the points.
    fn winding(&self, p: &DVec3) -> i32 {
        let column = self.columns.at(&DVec3::new(p.x, p.y, 0.0)).iter();
        column.map(|&id| self.faces[id as usize]).map(|[a, b, c]| above(p, &a, &b, &c)).sum()
    }
}

/// A pose and the passages to the next one, to be asked at points.
struct Step {
    before: Still,
    passages: Vec<Passage>,
    boxes: Boxes,
}

impl Step {
    fn new(poses: &Poses<'_>, step: usize, points: &[DVec3]) -> Self {
        let (least, most) = bounds(points);
        let is_near = |triangle: &u32| {
            let corners = poses.prism(step, *triangle);
            let (low, high) = bounds(corners.as_flattened());
            (0..3).all(|axis| low[axis] <= most[axis] && high[axis] >= least[axis])
        };
        let near = (0..poses.topology.simplices.len() as u32).filter(is_near);
        let passages: Vec<Passage> = near.flat_map(|triangle| poses.passages(step, triangle)).collect();
        let extents: Vec<_> = passages.iter().map(|passage| bounds(&passage.corners)).collect();
        let boxes = Boxes::new(points.iter().copied(), &extents);
        Self { before: Still::new(poses, step, points), passages, boxes }
    }

    /// What passes one of the points, in order of time.
    fn passing(&self, p: &DVec3) -> Vec<(f64, &Passage)> {
        let near = self.boxes.at(p).iter().map(|&id| &self.passages[id as usize]);
        let mut passing: Vec<(f64, &Passage)> =
            near.filter_map(|passage| passage.time(p).map(|time| (time, passage))).collect();
        // Of the same time, in the order of triangles.
        passing.sort_by(|a, b| a.0.total_cmp(&b.0));
        passing
    }

    /// What a passage brings one of the points.
    fn change(&self, place: Place, p: &DVec3) -> Change {
        let mut winding = self.before.winding(p);
        let mut was_back = winding >= 0;
        for (_, passage) in self.passing(p) {
            if passage.place == place {
                return match (winding >= 0, was_back) {
                    (true, _) => Change::Counts,
                    (false, true) => Change::Returns,
                    (false, false) => Change::Rises,
                };
            }
            winding += passage.sign;
            was_back |= winding >= 0;
        }
        Change::Counts
    }

    /// Whether one of the points is below 0 throughout.
    fn is_below(&self, p: &DVec3) -> bool {
        let mut winding = self.before.winding(p);
        winding < 0
            && self.passing(p).iter().all(|(_, passage)| {
                winding += passage.sign;
                winding < 0
            })
    }
}

/// Things by the boxes that they touch, where points are asked.
struct Boxes {
    low: DVec3,
    edge: DVec3,
    size: [usize; 3],
    /// Things that touch each box that holds a point.
    things: Lists<u32>,
}

impl Boxes {
    /// Boxes about as large as the things with these bounds.
    fn new(points: impl Iterator<Item = DVec3> + Clone, things: &[(DVec3, DVec3)]) -> Self {
        let start = (DVec3::repeat(f64::INFINITY), DVec3::repeat(f64::NEG_INFINITY));
        let (low, high) = points.clone().fold(start, |(low, high), p| (low.inf(&p), high.sup(&p)));
        let count = things.len().max(1);
        let sum: DVec3 = things.iter().map(|(low, high)| high - low).sum();
        let mut edge = (sum / count as f64).map(|mean| mean.max(BOX));
        let size = |edge: &DVec3| [0, 1, 2].map(|axis| ((high - low)[axis] / edge[axis]).floor() + 1.0);
        while size(&edge).iter().product::<f64>() > (BOXES * count) as f64 {
            edge *= 1.5;
        }
        let mut out =
            Self { low, edge, size: size(&edge).map(|value| value as usize), things: Lists::one(Vec::new()) };
        let mut asked = vec![false; out.size.iter().product()];
        points.for_each(|p| asked[out.number(out.place(&p))] = true);
        let mut pairs = Vec::new();
        for ((from, to), id) in things.iter().zip(0..) {
            if (0..3).any(|axis| to[axis] < low[axis] || from[axis] > high[axis]) {
                continue;
            }
            let [first, last] = [from, to].map(|p| out.place(p).map(|place| place as i32));
            for at in each_block(first, last) {
                let number = out.number(at.map(|place| place as usize));
                if asked[number] {
                    pairs.push((number as u32, id));
                }
            }
        }
        out.things = Lists::new(asked.len(), &[pairs]);
        out
    }

    /// What touches the box around a point.
    fn at(&self, p: &DVec3) -> &[u32] {
        self.things.get(self.number(self.place(p)))
    }

    /// The box around a point, or the nearest one.
    fn place(&self, p: &DVec3) -> [usize; 3] {
        let place = (p - self.low).component_div(&self.edge);
        [0, 1, 2].map(|axis| (place[axis].max(0.0) as usize).min(self.size[axis] - 1))
    }

    fn number(&self, [x, y, z]: [usize; 3]) -> usize {
        (x * self.size[1] + y) * self.size[2] + z
    }
}

/// Corners of the three tetrahedra of a prism, as [`super::chain`] has them: of the second, one that is passed outward by
/// a triangle of sign 1 has a volume below 0.
fn tetrahedra([a0, a1, a2]: [DVec3; 3], [b0, b1, b2]: [DVec3; 3]) -> [[DVec3; 4]; 3] {
    [[a0, a1, a2, b2], [a0, a1, b1, b2], [a0, b0, b1, b2]]
}

impl Passage {
    /// A tetrahedron of a triangle of this sign; none when the surface stands still in it.
    fn new(place: Place, corners: [DVec3; 4], sign: i32, still: f64) -> Option<Self> {
        let [u, v, w] = [1, 2, 3].map(|corner| corners[corner] - corners[0]);
        let volume = u.cross(&v).dot(&w);
        if volume.abs() <= still || volume == 0.0 {
            return None;
        }
        let outward = ((volume > 0.0) == (place.part != 1)) == (sign > 0);
        let weights = [v.cross(&w) / volume, w.cross(&u) / volume, u.cross(&v) / volume];
        Some(Self { place, sign: if outward { 1 } else { -1 }, corners, weights })
    }

    /// Where it is asked.
    fn samples(&self) -> impl Iterator<Item = DVec3> {
        let at = |weights: &[f64; 4]| {
            self.corners.iter().zip(weights).map(|(corner, weight)| corner * *weight).sum()
        };
        SAMPLES.iter().map(at)
    }

    /// When the surface passes a point (0 to 1 within the step), if it does here: the weight of the later pose's corners,
    /// which are the last one, two or three.
    fn time(&self, p: &DVec3) -> Option<f64> {
        let way = p - self.corners[0];
        let [u, v, w] = self.weights.map(|row| row.dot(&way));
        let is_within = u >= 0.0 && v >= 0.0 && w >= 0.0 && u + v + w <= 1.0;
        is_within.then_some([w, v + w, u + v + w][self.place.part as usize])
    }
}

/// 1 when a face above a point faces up, -1 when down; 0 when it is not above.
fn above(p: &DVec3, a: &DVec3, b: &DVec3, c: &DVec3) -> i32 {
    let side = |s: &DVec3, t: &DVec3| (t.x - s.x) * (p.y - s.y) - (t.y - s.y) * (p.x - s.x);
    let sides = [side(a, b), side(b, c), side(c, a)];
    let up = sides.iter().all(|side| *side > 0.0);
    let down = sides.iter().all(|side| *side < 0.0);
    if !up && !down {
        return 0;
    }
    let normal = (b - a).cross(&(c - a));
    let is_above = normal.dot(&(p - a)) * normal.z < 0.0;
    match (is_above, up) {
        (false, _) => 0,
        (true, true) => 1,
        (true, false) => -1,
    }
}

fn place(p: Fixed) -> DVec3 {
    DVec3::from(p.map(f64::from))
}

fn bounds(points: &[DVec3]) -> (DVec3, DVec3) {
    points.iter().fold((points[0], points[0]), |(low, high), p| (low.inf(p), high.sup(p)))
}
