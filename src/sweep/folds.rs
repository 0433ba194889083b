//! Skins that fold inside out.
//!
//! Where a pose winds around a point negatively, outward motion only brings the point back to 0: it is not swept, though
//! the surface passed it outward. Swept is what a winding number reaches 1 at some time, so the passages through such
//! places are put in order of time, and those that come from below 0 do not count. A point that the first pose winds
//! around negatively starts below 0 in the chain too: what brings it to 0 for the first time counts.

use std::collections::{HashMap, HashSet};

use rayon::prelude::*;

use super::chain::{Face, STILL, Window};
use super::lattice::{Fixed, UNITS};
use super::region::{Region, each_block, extent};
use super::topology::{Simplex, Topology};
use super::winding::Lines;
use crate::base::DVec3;

/// Negative stretches of a line that are shorter than this (cells) are none.
const SHORT: f64 = 1e-3;
/// Edge of the boxes that tetrahedra are sorted into (cells).
const BOX: f64 = 1.0;
/// Triangles or edges that a task handles.
const GRAIN: usize = 4096;
/// Where a tetrahedron is asked: barycentric weights, off all symmetries.
const SAMPLES: [[f64; 4]; 5] = [
    [0.252, 0.249, 0.251, 0.248],
    [0.703, 0.102, 0.097, 0.098],
    [0.098, 0.703, 0.102, 0.097],
    [0.097, 0.098, 0.703, 0.102],
    [0.102, 0.097, 0.098, 0.703],
];

/// A tetrahedron that the surface passes through.
struct Passage {
    /// The triangle whose prism it is of, the step, and which of the three it is.
    triangle: u32,
    step: u32,
    part: u32,
    /// 1 when the surface moves outward, -1 when inward.
    sign: i32,
    corners: [DVec3; 4],
    /// Three rows that give the weights of the second to fourth corner from a way from the first.
    weights: [DVec3; 3],
}

/// Clears the bits (see [`super::chain`]) of tetrahedra through which the surface only comes back from inside out.
pub fn drop_returns(topology: &Topology, levels: &[Vec<Fixed>], window: &Window, outward: &mut [u8]) {
    let folded = folded_blocks(topology, levels, window);
    if folded.is_empty() {
        return;
    }
    let order = Order::new(topology, levels, &folded);
    let outward_ones = order.passages.par_iter().enumerate().filter(|(_, passage)| passage.sign > 0);
    let returns: Vec<usize> = outward_ones.filter(|(id, _)| !order.counts(*id)).map(|(id, _)| id).collect();
    let steps = levels.len() - 1;
    for id in returns {
        let Passage { triangle, step, part, .. } = order.passages[id];
        outward[triangle as usize * steps + step as usize] &= !(1 << part);
    }
}

/// The blocks in which some pose winds negatively, and those around them.
fn folded_blocks(topology: &Topology, levels: &[Vec<Fixed>], window: &Window) -> HashSet<[i32; 3]> {
    let rigid = is_rigid(topology, levels);
    let levels = if rigid { &levels[..1] } else { levels };
    let blocks: Vec<Vec<[i32; 3]>> = levels
        .par_iter()
        .map(|level| {
            let simplices = topology.simplices.par_iter().with_min_len(GRAIN);
            let faces: Vec<Face> = simplices.map(|simplex| face(simplex, level)).collect();
            negative_blocks(&faces, window)
        })
        .collect();
    let around = |block: [i32; 3]| {
        let [low, high] = [-1, 1].map(|by| block.map(|place| place + by));
        each_block(low, high)
    };
    blocks.into_iter().flatten().flat_map(around).collect()
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

/// Passages through the folded blocks, to be asked in order of time.
struct Order {
    passages: Vec<Passage>,
    /// Which of them touch each box.
    boxes: HashMap<[i32; 3], Vec<u32>>,
    /// Faces of the first pose above and below each box column.
    columns: HashMap<[i32; 2], Vec<[DVec3; 3]>>,
}

impl Order {
    fn new(topology: &Topology, levels: &[Vec<Fixed>], folded: &HashSet<[i32; 3]>) -> Self {
        let passages = passages(topology, levels, folded);
        let mut boxes: HashMap<[i32; 3], Vec<u32>> = HashMap::new();
        for (id, passage) in passages.iter().enumerate() {
            let (low, high) = bounds(&passage.corners);
            each_block(box_of(low), box_of(high)).for_each(|at| boxes.entry(at).or_default().push(id as u32));
        }
        let wanted: HashSet<[i32; 2]> = folded.iter().map(|[x, y, _]| [*x, *y]).collect();
        let mut columns: HashMap<[i32; 2], Vec<[DVec3; 3]>> = HashMap::new();
        for simplex in &topology.simplices {
            let v = face(simplex, &levels[0]).v;
            let (low, high) = extent(&v);
            let block = |value: f32| (value / 8.0).floor() as i32;
            let [first, last] = [low, high].map(|p| [block(p[0]), block(p[1]), 0]);
            if !each_block(first, last).any(|[x, y, _]| wanted.contains(&[x, y])) {
                continue;
            }
            let corners = v.map(place);
            let (low, high) = bounds(&corners);
            let [first, last] = [box_of(low), box_of(high)];
            for [x, y, _] in each_block([first[0], first[1], 0], [last[0], last[1], 0]) {
                columns.entry([x, y]).or_default().push(corners);
            }
        }
        Self { passages, boxes, columns }
    }

    /// Whether a passage outward counts anywhere in its tetrahedron.
    fn counts(&self, id: usize) -> bool {
        SAMPLES.iter().any(|weights| {
            let corners = self.passages[id].corners.iter().zip(weights);
            self.counts_at(id, corners.map(|(corner, weight)| corner * *weight).sum())
        })
    }

    /// Whether a passage does not come from below 0 at a point, or for the first time since the first pose.
    fn counts_at(&self, id: usize, p: DVec3) -> bool {
        let near = self.boxes.get(&box_of(p)).map(Vec::as_slice).unwrap_or_default();
        let time = |&other: &u32| {
            let passage = &self.passages[other as usize];
            passage.time(&p).map(|time| (passage.step, time, other as usize))
        };
        let mut times: Vec<(u32, f64, usize)> = near.iter().filter_map(time).collect();
        times.sort_unstable_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
        let mut winding = self.winding(&p);
        let mut was_back = winding >= 0;
        for (_, _, other) in times {
            if other == id {
                return winding >= 0 || !was_back;
            }
            winding += self.passages[other].sign;
            was_back |= winding >= 0;
        }
        true
    }

    /// How often the first pose winds around a point.
    fn winding(&self, p: &DVec3) -> i32 {
        let [x, y, _] = box_of(*p);
        let column = self.columns.get(&[x, y]).map(Vec::as_slice).unwrap_or_default();
        column.iter().map(|[a, b, c]| above(p, a, b, c)).sum()
    }
}

/// The passages of all steps that touch the folded blocks.
fn passages(topology: &Topology, levels: &[Vec<Fixed>], folded: &HashSet<[i32; 3]>) -> Vec<Passage> {
    let block = |p: DVec3| [p.x, p.y, p.z].map(|value| (value / 8.0 / f64::from(UNITS)).floor() as i32);
    let of_triangle = |triangle: usize| {
        let simplex = &topology.simplices[triangle];
        let mut out = Vec::new();
        for step in 0..levels.len() - 1 {
            let [a, b] =
                [step, step + 1].map(|level| simplex.v.map(|vertex| place(levels[level][vertex as usize])));
            for (part, corners) in tetrahedra(a, b).into_iter().enumerate() {
                let (low, high) = bounds(&corners);
                if each_block(block(low), block(high)).any(|block| folded.contains(&block)) {
                    let still = STILL * (a[1] - a[0]).cross(&(a[2] - a[0])).norm();
                    let at = [triangle as u32, step as u32, part as u32];
                    out.extend(Passage::new(at, corners, i32::from(simplex.sign), still));
                }
            }
        }
        out
    };
    let parts: Vec<Vec<Passage>> = (0..topology.simplices.len()).into_par_iter().map(of_triangle).collect();
    parts.into_iter().flatten().collect()
}

/// Corners of the three tetrahedra of a prism, as [`super::chain`] has them: of the second, one that is passed outward by
/// a triangle of sign 1 has a volume below 0.
fn tetrahedra([a0, a1, a2]: [DVec3; 3], [b0, b1, b2]: [DVec3; 3]) -> [[DVec3; 4]; 3] {
    [[a0, a1, a2, b2], [a0, a1, b1, b2], [a0, b0, b1, b2]]
}

impl Passage {
    /// A tetrahedron of a triangle of this sign; none when the surface stands still in it.
    fn new([triangle, step, part]: [u32; 3], corners: [DVec3; 4], sign: i32, still: f64) -> Option<Self> {
        let [u, v, w] = [1, 2, 3].map(|corner| corners[corner] - corners[0]);
        let volume = u.cross(&v).dot(&w);
        if volume.abs() <= still || volume == 0.0 {
            return None;
        }
        let outward = ((volume > 0.0) == (part != 1)) == (sign > 0);
        let weights = [v.cross(&w) / volume, w.cross(&u) / volume, u.cross(&v) / volume];
        Some(Self { triangle, step, part, sign: if outward { 1 } else { -1 }, corners, weights })
    }

    /// When the surface passes a point (0 to 1 within the step), if it does here: the weight of the later pose's corners,
    /// which are the last one, two or three.
    fn time(&self, p: &DVec3) -> Option<f64> {
        let way = p - self.corners[0];
        let [u, v, w] = self.weights.map(|row| row.dot(&way));
        let is_within = u >= 0.0 && v >= 0.0 && w >= 0.0 && u + v + w <= 1.0;
        is_within.then_some([w, v + w, u + v + w][self.part as usize])
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

fn box_of(p: DVec3) -> [i32; 3] {
    [p.x, p.y, p.z].map(|value| (value / BOX / f64::from(UNITS)).floor() as i32)
}

fn bounds(points: &[DVec3]) -> (DVec3, DVec3) {
    points.iter().fold((points[0], points[0]), |(low, high), p| (low.inf(p), high.sup(p)))
}
