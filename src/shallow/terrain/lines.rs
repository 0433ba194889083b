//! The vertical lines through the cells of a grid, and which of them a triangle may cross.

/// Count of lines that are tested together.
pub const LANES: usize = 4;

/// Unit roundoff of f64.
pub(super) const ROUNDOFF: f64 = f64::EPSILON / 2.0;

/// The coordinates of the lines through the cells of one axis.
pub struct Lines {
    /// Ascending, with one infinity before the first and several after the last.
    positions: Vec<f64>,
    /// Count of lines.
    count: usize,
    /// 1 / cell (1/m).
    inverse: f64,
    /// Maximum magnitude of the numbers that a coordinate is computed from (m).
    reach: f64,
}

impl Lines {
    /// Lines at strictly ascending coordinates; `reach` bounds the magnitude of these and of the grid's origin.
    pub fn new(centres: impl Iterator<Item = f64>, cell: f64, reach: f64) -> Self {
        let mut positions = vec![f64::NEG_INFINITY];
        positions.extend(centres);
        let count = positions.len() - 1;
        positions.extend([f64::INFINITY; LANES]);
        Self { positions, count, inverse: 1.0 / cell, reach }
    }

    /// Coordinate of a line.
    pub fn at(&self, line: u32) -> f64 {
        self.positions[line as usize + 1]
    }

    /// Coordinates of a line and the next ones; infinity after the last.
    #[inline(always)]
    pub fn from(&self, line: u32) -> &[f64; LANES] {
        self.positions[line as usize + 1..].first_chunk().expect("infinities follow the last line")
    }

    /// A coordinate (m) converted to a count of lines after the first, with rounding errors.
    fn in_lines(&self, position: f64) -> f64 {
        (position - self.positions[1]) * self.inverse
    }

    /// Exact count of the lines left of a coordinate, with the lines shifted symbolically (`crossings.rs`). A triangle can only cross the
    /// lines from the minimum rank of its corners to the line before the maximum.
    #[inline]
    pub fn rank(&self, position: f64) -> u32 {
        // A guess that is usually right.
        let guess = min(max(self.in_lines(position) + 1.0, 0.0), self.count as f64);
        let mut rank = guess as i32 as usize;
        while self.positions[rank + 1] < position {
            rank += 1;
        }
        while self.positions[rank] >= position {
            rank -= 1;
        }
        rank as u32
    }
}

/// The edges of a triangle, to find the lines of a row that may cross it.
pub struct Outline {
    edges: [Edge; 3],
    /// How far (lines) a computed position may be from the exact one.
    error: f64,
}

/// An edge of a triangle, as x over z.
struct Edge {
    /// Minimum and maximum z (m); empty if they are equal.
    range: [f64; 2],
    /// z (m) and x (lines) of its first end.
    from: [f64; 2],
    /// Change of x (lines) with z (m).
    slope: f64,
}

/// For several rows, the first line that may cross a triangle, and the one after the last; as numbers from [`whole`].
#[derive(Default)]
pub struct Spans {
    first: [f64; LANES],
    last: [f64; LANES],
}

impl Outline {
    /// The outline of a triangle over lines along x.
    #[inline(always)]
    pub fn new(corners: &[Corner; 3], x: &Lines) -> Self {
        let edge = |corner: usize| {
            let (a, b) = (&corners[corner], &corners[(corner + 1) % 3]);
            // An edge along x: the row through it meets it where the two other edges end.
            let range = if a[2] == b[2] { [1.0, -1.0] } else { [min(a[2], b[2]), max(a[2], b[2])] };
            let slope = (b[0] - a[0]) * x.inverse / (b[2] - a[2]);
            Edge { range, from: [a[2], x.in_lines(a[0])], slope }
        };
        let reach = corners.iter().fold(x.reach, |reach, corner| max(reach, corner[0].abs()));
        // Up to 11 roundings of at most 2 reach for a position and 6 of at most 1 reach for a line: 28 in all. 128 leaves a margin.
        Self { edges: [edge(0), edge(1), edge(2)], error: 128.0 * ROUNDOFF * reach * x.inverse }
    }

    /// Of the lines from `first` to before `last`, finds those that may cross the triangle, in rows at several z.
    #[inline(always)]
    pub fn spans(&self, z: &[f64; LANES], [first, last]: [u32; 2], out: &mut Spans) {
        let [a, b, c] = &self.edges;
        let [first, last] = [first, last].map(|line| f64::from(line as i32));
        for lane in 0..LANES {
            let z = z[lane];
            let position = |edge: &Edge, none: f64| {
                let position = edge.from[1] + edge.slope * (z - edge.from[0]);
                let position = if z < edge.range[0] { none } else { position };
                if z > edge.range[1] { none } else { position }
            };
            let lowest = |edge: &Edge| position(edge, f64::INFINITY);
            let highest = |edge: &Edge| position(edge, f64::NEG_INFINITY);
            let start = min(min(lowest(a), lowest(b)), lowest(c)) - self.error;
            let end = max(max(highest(a), highest(b)), highest(c)) + self.error;
            // Rounding a position plus half a line gives the first line after it; the error margin is larger than the rounding of this sum.
            out.first[lane] = whole(min(max(start + 0.5, first), last));
            out.last[lane] = whole(min(max(end + 0.5, first), last));
        }
    }
}

impl Spans {
    /// The first line of a row, and the one after the last.
    #[inline(always)]
    pub fn lines(&self, row: usize) -> [u32; 2] {
        [self.first[row], self.last[row]].map(integer_of)
    }
}

/// Encodes a number from 0 to below 2^32, rounded to the nearest integer (ties to even), for [`integer_of`].
#[inline(always)]
pub(super) fn whole(number: f64) -> f64 {
    number + WHOLE
}

/// The integer that [`whole`] encoded.
#[inline(always)]
pub(super) fn integer_of(whole: f64) -> u32 {
    whole.to_bits() as u32
}

/// At this magnitude f64 has no fraction bits: added integers appear in its lowest bits.
pub(super) const WHOLE: f64 = (1u64 << 52) as f64;

/// The smaller of two numbers that are not NaN: one instruction, unlike `f64::min`.
#[inline(always)]
pub(super) fn min(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The larger of two numbers that are not NaN.
#[inline(always)]
pub(super) fn max(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Corner of a triangle (m).
pub type Corner = [f64; 3];
