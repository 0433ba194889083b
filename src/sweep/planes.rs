//! Which of many planes a short segment meets, sixteen planes at a time.

use std::ops::Range;

use crate::base::cpu::dispatch;

/// A start nearer than this (cells) to a plane counts as met: its side must be told exactly.
pub const CLEAR: f32 = 1e-3;
/// Planes handled at once.
const LANES: usize = 16;

/// Planes, each given by its unit normal and the height of the origin over it (cells).
#[derive(Default)]
pub struct Planes {
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    height: Vec<f32>,
}

impl Planes {
    /// Makes room for more planes.
    pub fn reserve(&mut self, count: usize) {
        for values in [&mut self.x, &mut self.y, &mut self.z, &mut self.height] {
            values.reserve_exact(count);
        }
    }

    /// Adds a plane: normal and height.
    pub fn push(&mut self, [x, y, z, height]: [f32; 4]) {
        self.x.push(x);
        self.y.push(y);
        self.z.push(z);
        self.height.push(height);
    }

    /// Normal and height of a plane.
    pub fn get(&self, index: usize) -> [f32; 4] {
        [self.x[index], self.y[index], self.z[index], self.height[index]]
    }

    /// Calls `met` with each plane of a range that the segment from `from` along `way` (cells) may meet, and the
    /// heights of its ends over the plane.
    pub fn for_each_met(
        &self,
        range: Range<usize>,
        from: [f32; 3],
        way: [f32; 3],
        mut met: impl FnMut(usize, f32, f32),
    ) {
        let mut first = range.start;
        while first + LANES <= range.end {
            let count = ((range.end - first) / LANES).min(u64::BITS as usize / LANES);
            let mut bits = self.met(first, count, from, way);
            while bits != 0 {
                let index = first + bits.trailing_zeros() as usize;
                let (begin, end) = self.heights(index, from, way);
                met(index, begin, end);
                bits &= bits - 1;
            }
            first += count * LANES;
        }
        for index in first..range.end {
            let (begin, end) = self.heights(index, from, way);
            if is_met(begin, end) {
                met(index, begin, end);
            }
        }
    }

    #[inline(always)]
    fn heights(&self, index: usize, from: [f32; 3], way: [f32; 3]) -> (f32, f32) {
        let [x, y, z, height] = self.get(index);
        let begin = height + x * from[0] + y * from[1] + z * from[2];
        (begin, begin + x * way[0] + y * way[1] + z * way[2])
    }

    /// A bit for each of `count` times sixteen planes (at most 64) that the segment may meet.
    fn met(&self, first: usize, count: usize, from: [f32; 3], way: [f32; 3]) -> u64 {
        let planes = self;
        #[inline(always)]
        fn body(planes: &Planes, first: usize, count: usize, from: [f32; 3], way: [f32; 3]) -> u64 {
            let mut bits = 0;
            for group in 0..count {
                let at = first + group * LANES;
                let [Some(x), Some(y), Some(z), Some(height)] =
                    [&planes.x, &planes.y, &planes.z, &planes.height].map(|v| v[at..].first_chunk::<LANES>())
                else {
                    return bits;
                };
                let mut flags = 0u32;
                for lane in 0..LANES {
                    let begin = height[lane] + x[lane] * from[0] + y[lane] * from[1] + z[lane] * from[2];
                    let end = begin + x[lane] * way[0] + y[lane] * way[1] + z[lane] * way[2];
                    flags |= u32::from(is_met(begin, end)) << lane;
                }
                bits |= u64::from(flags) << (group * LANES);
            }
            bits
        }
        dispatch!(body(planes: &Planes, first: usize, count: usize, from: [f32; 3], way: [f32; 3]) -> u64)
    }
}

/// Whether a segment is not clearly on one side.
#[inline(always)]
fn is_met(begin: f32, end: f32) -> bool {
    !((begin > CLEAR) & (end > 0.0) | (begin < -CLEAR) & (end < 0.0))
}
