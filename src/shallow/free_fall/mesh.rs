//! A triangle mesh of the liquid in the air, written into the caller's buffers: a ball for each drop, and strands between consecutive drops
//! of an overflow edge, and from the edge to the newest drop.
//!
//! The cross-section of a strand is the mean volume of its drops (one at the overflow edge, else two) divided by its length. From a length
//! of 9.02 radii, the fastest-growing wavelength in a jet of low viscosity (Rayleigh 1878), its liquid drains into its drops, and at twice
//! that length it has broken. Drops in a strand are as thick as the strand.

use super::Droplet;
use crate::error::Result;
use crate::geometry::DVec3;
use crate::numeric::lists::{refill, reset};
use crate::shallow::surface::layout::check_buffers;
use crate::shallow::surface::{Counts, Indices, Layout, Up};

/// Vertices and triangles of a ball: an icosahedron whose edges are halved.
const BALL: [usize; 2] = [42, 80];
/// Sides of a strand, and its rings of vertices: at the ends and in the middle.
const SIDES: usize = 6;
const RINGS: usize = 3;
/// Circumradius of a hexagon with the area of a unit circle: sqrt(pi / (1.5 sqrt 3)).
const CIRCUMRADIUS: f64 = 1.099_636;
/// Length, in radii, from which on a strand between two drops gets thinner; it breaks at twice that.
const THINNING_LENGTH: f64 = 9.02;
/// Factor by which a strand is wider at its overflow edge, where it is as thick as the film.
const FLARE: f64 = 1.6;

/// Buffers of the caller. They are written sequentially from the beginning and never read, and may be longer than the mesh; leave out those
/// that are not needed. The balls' vertices come first, in the order of their drops.
#[derive(Debug, Default)]
pub struct Target<'a> {
    /// Three numbers per vertex (m x scale).
    pub positions: Option<&'a mut [f32]>,
    /// Three numbers per vertex: a unit vector.
    pub normals: Option<&'a mut [f32]>,
    /// Three numbers per vertex: velocity of its drop (m/s x scale).
    pub velocities: Option<&'a mut [f32]>,
    /// One number per vertex: the index of its drop in the list of drops.
    pub drops: Option<&'a mut [u32]>,
    /// Three indices per triangle.
    pub indices: Indices<'a>,
}

/// Upper bounds of the counts of a mesh of `drops` drops.
pub fn bound(drops: usize) -> Counts {
    of(drops, drops)
}

/// Counts for `drops` drops and `strands` strands; the strands' vertices count as `extras`.
fn of(drops: usize, strands: usize) -> Counts {
    let extras = RINGS * SIDES * strands;
    let triangles = BALL[1] * drops + 2 * (RINGS - 1) * SIDES * strands;
    Counts { vertices: BALL[0] * drops + extras, extras, indices: 3 * triangles }
}

/// A strand from a drop to the one that follows it, or to their overflow edge.
#[derive(Debug, Clone, Copy)]
struct Strand {
    drop: u32,
    next: Option<u32>,
    /// Radius (m) of its liquid's section.
    radius: f64,
    /// The part of its liquid that has not drained into the drops yet, 0 to 1.
    undrained: f64,
}

/// Builds meshes of drops; its buffers are reused.
#[derive(Debug)]
pub struct Balls {
    /// Directions of a ball's vertices, and its triangles, counter-clockwise from outside.
    vertices: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    /// Radius of the ball's vertices, at which the mesh has the volume of a ball of radius 1.
    size: f64,
    /// Drops by overflow edge, in the order in which they left it.
    order: Vec<u32>,
    strands: Vec<Strand>,
    /// Radius of each drop (m).
    radii: Vec<f64>,
    /// For each drop: the sums of its strands' radii (m) and of their `undrained`, and their count.
    sums: Vec<[f64; 3]>,
}

impl Default for Balls {
    fn default() -> Self {
        let (vertices, triangles) = ball();
        let volume: f64 = triangles.iter().map(|t| volume(t.map(|at| vertices[at as usize]))).sum();
        let size = libm::cbrt(4.0 / 3.0 * std::f64::consts::PI / volume);
        Self {
            vertices,
            triangles,
            size,
            order: Vec::new(),
            strands: Vec::new(),
            radii: Vec::new(),
            sums: Vec::new(),
        }
    }
}

impl Balls {
    /// Reserves capacity for `drops` drops, for which [`Balls::build`] then allocates nothing.
    pub fn reserve(&mut self, drops: usize) {
        self.order.clear();
        self.order.reserve(drops);
        self.strands.clear();
        self.strands.reserve(drops);
        self.radii.clear();
        self.radii.reserve(drops);
        self.sums.clear();
        self.sums.reserve(drops);
    }

    /// Size of the mesh that [`Balls::build`] would write.
    pub fn count(&mut self, drops: &[Droplet]) -> Counts {
        refill(&mut self.order, 0..drops.len() as u32);
        self.order.sort_unstable_by_key(|&at| (drops[at as usize].source, drops[at as usize].number, at));
        self.strands.clear();
        reset(&mut self.sums, drops.len(), [0.0; 3]);
        for (position, &at) in self.order.iter().enumerate() {
            let drop = &drops[at as usize];
            let next = self.order.get(position + 1).copied().filter(|&next| {
                let next = &drops[next as usize];
                drop.source == next.source && next.number - drop.number <= 1
            });
            let Some(strand) = Strand::new(drops, at, next) else { continue };
            for end in [Some(at), next].into_iter().flatten() {
                let [radius, undrained, count] = &mut self.sums[end as usize];
                *radius += strand.radius;
                *undrained += strand.undrained;
                *count += 1.0;
            }
            self.strands.push(strand);
        }
        refill(
            &mut self.radii,
            drops.iter().zip(&self.sums).map(|(drop, &[radius, undrained, count])| {
                // Between drops that are close together, the strand is no thicker than the drop.
                let part = if count > 0.0 { undrained / count } else { 0.0 };
                let strand = if count > 0.0 { (radius / count).min(drop.radius) } else { 0.0 };
                drop.radius + part * (strand - drop.radius)
            }),
        );
        of(drops.len(), self.strands.len())
    }

    /// Writes the mesh of some drops and returns its size, which [`bound`] limits.
    ///
    /// # Errors
    /// `Argument`, and nothing is written: a layout as in [`Surface::build`](crate::shallow::surface::Surface::build); a buffer that is too
    /// short; over 65,536 vertices for 16-bit indices.
    pub fn build(&mut self, drops: &[Droplet], layout: &Layout, target: &mut Target<'_>) -> Result<Counts> {
        layout.validate()?;
        let counts = self.count(drops);
        target.check(&counts)?;
        let (axes, scale) = (Axes::of(layout), layout.scale);
        let shape: [[f32; 3]; BALL[0]] =
            std::array::from_fn(|at| axes.convert(self.vertices[at]).map(|number| number as f32));
        let turned = |vector: DVec3| axes.convert(vector).map(|number| (number * scale) as f32);
        if let Some(to) = &mut target.positions {
            let (balls, strands) = split_strands(to, drops.len());
            for (to, (drop, radius)) in balls.zip(drops.iter().zip(&self.radii)) {
                let (centre, radius) = (turned(drop.position.into()), (radius * self.size * scale) as f32);
                for (to, normal) in to.iter_mut().zip(&shape) {
                    *to = [0, 1, 2].map(|n| centre[n] + radius * normal[n]);
                }
            }
            self.write_strands(drops, strands, |_, position, _| turned(position));
        }
        if let Some(to) = &mut target.normals {
            let (balls, strands) = split_strands(to, drops.len());
            balls.for_each(|to| to.copy_from_slice(&shape));
            self.write_strands(drops, strands, |normal, _, _| {
                axes.convert(normal).map(|number| number as f32)
            });
        }
        if let Some(to) = &mut target.velocities {
            let (balls, strands) = split_strands(to, drops.len());
            balls.zip(drops).for_each(|(to, drop)| to.fill(turned(drop.velocity.into())));
            self.write_strands(drops, strands, |_, _, drop| turned(drop.velocity.into()));
        }
        if let Some(to) = &mut target.drops {
            let (balls, strands) = to.split_at_mut(BALL[0] * drops.len());
            balls.chunks_exact_mut(BALL[0]).zip(0..).for_each(|(to, drop)| to.fill(drop));
            let rings = |strand: &Strand| [strand.drop, strand.drop, strand.next.unwrap_or(strand.drop)];
            let rings = self.strands.iter().flat_map(rings);
            strands.chunks_exact_mut(SIDES).zip(rings).for_each(|(to, drop)| to.fill(drop));
        }
        match &mut target.indices {
            Indices::None => {}
            Indices::U16(to) => {
                self.write_triangles(drops.len(), layout.left_handed, to, |index| index as u16)
            }
            Indices::U32(to) => self.write_triangles(drops.len(), layout.left_handed, to, |index| index),
        }
        Ok(counts)
    }

    /// Writes a vector for each vertex of the strands, from its normal, its position (m) and its drop.
    fn write_strands(
        &self,
        drops: &[Droplet],
        to: &mut [f32],
        vector: impl Fn(DVec3, DVec3, &Droplet) -> [f32; 3],
    ) {
        let mut to = to.as_chunks_mut::<3>().0.iter_mut();
        for strand in &self.strands {
            let first = &drops[strand.drop as usize];
            let own = self.radii[strand.drop as usize];
            let (last, position, edge, axes) =
                match (strand.next.map(|next| next as usize), first.overflow_edge) {
                    (Some(next), _) => (&drops[next], drops[next].position, None, [self.radii[next]; 2]),
                    (None, Some(overflow)) => (
                        first,
                        overflow.position,
                        Some(overflow.edge),
                        [FLARE * own, own.min(0.5 * overflow.depth)],
                    ),
                    (None, None) => (first, first.position, None, [own; 2]),
                };
            let [start, end] = [first.position, position].map(DVec3::from);
            let axis = end - start;
            let [aside, across] =
                edge.map_or_else(|| perpendiculars(axis), |edge| perpendiculars_near(axis, edge.into()));
            // Only what has not drained into the drops is left in the middle.
            let middle = [0, 1].map(|n| 0.5 * (own + axes[n]) * strand.undrained);
            let halfway = start + 0.5 * axis;
            for (drop, position, axes) in
                [(first, start, [own; 2]), (first, halfway, middle), (last, end, axes)]
            {
                let axes = axes.map(|radius| radius * CIRCUMRADIUS);
                for ([cos, sin], to) in HEXAGON.into_iter().zip(&mut to) {
                    let off = axes[0] * cos * aside + axes[1] * sin * across;
                    *to = vector(cos * aside + sin * across, position + off, drop);
                }
            }
        }
    }

    /// Writes the triangles of the balls of `drops` drops, and of the strands.
    fn write_triangles<T>(&self, drops: usize, is_turned: bool, to: &mut [T], index: impl Fn(u32) -> T) {
        let corners = |[a, b, c]: [u32; 3]| if is_turned { [a, c, b] } else { [a, b, c] };
        let shape: [[u32; 3]; BALL[1]] = std::array::from_fn(|at| corners(self.triangles[at]));
        let (balls, strands) = to.split_at_mut(3 * BALL[1] * drops);
        for (drop, to) in balls.as_chunks_mut::<3>().0.chunks_exact_mut(BALL[1]).enumerate() {
            let first = (drop * BALL[0]) as u32;
            for (to, triangle) in to.iter_mut().zip(&shape) {
                *to = triangle.map(|corner| index(first + corner));
            }
        }
        let mut to = strands.as_chunks_mut::<3>().0.iter_mut();
        for strand in 0..self.strands.len() {
            for quad in 0..(RINGS - 1) * SIDES {
                let (ring, side) = (quad / SIDES, quad % SIDES);
                let first = drops * BALL[0] + (strand * RINGS + ring) * SIDES;
                let [a, b] = [side, (side + 1) % SIDES].map(|corner| (first + corner) as u32);
                let [c, d] = [a, b].map(|corner| corner + SIDES as u32);
                for (triangle, to) in [[a, b, d], [a, d, c]].into_iter().zip(&mut to) {
                    *to = corners(triangle).map(&index);
                }
            }
        }
    }
}

impl Strand {
    /// The strand from a drop to the next one, or to its overflow edge; None if it has broken.
    fn new(drops: &[Droplet], at: u32, next: Option<u32>) -> Option<Self> {
        let drop = &drops[at as usize];
        let (position, volume) = match next.map(|next| &drops[next as usize]) {
            Some(next) => (next.position, 0.5 * (drop.volume + next.volume)),
            None => (drop.overflow_edge?.position, drop.volume),
        };
        let length = (DVec3::from(position) - DVec3::from(drop.position)).norm();
        if length <= 0.0 {
            return None;
        }
        let radius = (volume / (std::f64::consts::PI * length)).sqrt().min(drop.radius);
        let undrained = (2.0 - length / (THINNING_LENGTH * radius)).clamp(0.0, 1.0);
        (undrained > 0.0).then_some(Self { drop: at, next, radius, undrained })
    }
}

impl Target<'_> {
    /// Whether the mesh fits.
    fn check(&self, counts: &Counts) -> Result<()> {
        let vectors =
            [("positions", &self.positions), ("normals", &self.normals), ("velocities", &self.velocities)]
                .map(|(name, out)| (name, out.as_deref().map(<[f32]>::len), 3 * counts.vertices));
        let drops = ("drops", self.drops.as_deref().map(<[u32]>::len), counts.vertices);
        check_buffers("drops have", counts, vectors.into_iter().chain([drops]), &self.indices)
    }
}

/// Splits vectors into those of each ball and those of the strands.
fn split_strands(to: &mut [f32], drops: usize) -> (std::slice::ChunksExactMut<'_, [f32; 3]>, &mut [f32]) {
    let (balls, strands) = to.split_at_mut(3 * BALL[0] * drops);
    (balls.as_chunks_mut().0.chunks_exact_mut(BALL[0]), strands)
}

/// The caller's vector layout.
struct Axes {
    z_up: bool,
    sign: f64,
}

impl Axes {
    fn of(layout: &Layout) -> Self {
        let z_up = layout.up == Up::Z;
        Self { z_up, sign: if layout.left_handed != z_up { -1.0 } else { 1.0 } }
    }

    fn convert(&self, vector: DVec3) -> [f64; 3] {
        let [x, y, z] = vector.into();
        if self.z_up { [x, self.sign * z, y] } else { [x, y, self.sign * z] }
    }
}

/// Cosine and sine of the corners of a hexagon.
const HEXAGON: [[f64; 2]; SIDES] = {
    const SIN: f64 = 0.866_025_403_784_438_6;
    [[1.0, 0.0], [0.5, SIN], [-0.5, SIN], [-1.0, 0.0], [-0.5, -SIN], [0.5, -SIN]]
};

/// Two unit vectors perpendicular to a direction; right-handed, with the direction last.
fn perpendiculars(direction: DVec3) -> [DVec3; 2] {
    let is_steep = direction.x.abs() < 0.7 * direction.norm();
    perpendiculars_near(direction, if is_steep { DVec3::x() } else { DVec3::z() })
}

/// As [`perpendiculars`]; the first is close to another direction.
fn perpendiculars_near(direction: DVec3, other: DVec3) -> [DVec3; 2] {
    let direction = direction.normalize();
    let across = direction.cross(&other).normalize();
    [across.cross(&direction), across]
}

/// Volume of the tetrahedron of a triangle and the origin.
fn volume([a, b, c]: [DVec3; 3]) -> f64 {
    a.dot(&b.cross(&c)) / 6.0
}

/// Directions and triangles of a ball.
fn ball() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let golden = 0.5 * (1.0 + 5f64.sqrt());
    let mut vertices = Vec::with_capacity(BALL[0]);
    for one in [-1.0, 1.0] {
        for long in [-golden, golden] {
            let corners = [[0.0, one, long], [one, long, 0.0], [long, 0.0, one]];
            vertices.extend(corners.map(|corner| DVec3::from(corner).normalize()));
        }
    }
    // The corners of a face are neighbours of each other.
    let near = |a: usize, b: usize| (vertices[b] - vertices[a]).norm() < 1.2;
    let mut faces = Vec::with_capacity(20);
    for a in 0..12 {
        for b in (a + 1..12).filter(|&b| near(a, b)) {
            for c in (b + 1..12).filter(|&c| near(a, c) && near(b, c)) {
                let outward = volume([a, b, c].map(|at| vertices[at])) > 0.0;
                faces.push(if outward { [a, b, c] } else { [a, c, b] });
            }
        }
    }
    let mut triangles = Vec::with_capacity(BALL[1]);
    for face in faces {
        let middles: [u32; 3] = std::array::from_fn(|side| {
            let ends = [face[side], face[(side + 1) % 3]].map(|at| vertices[at]);
            let middle = (ends[0] + ends[1]).normalize();
            // An edge has two faces, whose midpoint sums are the same in either order.
            let at = vertices.iter().position(|vertex| *vertex == middle).unwrap_or(vertices.len());
            if at == vertices.len() {
                vertices.push(middle);
            }
            at as u32
        });
        let [a, b, c] = face.map(|at| at as u32);
        let [ab, bc, ca] = middles;
        triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
    }
    (vertices, triangles)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_is_closed_and_as_large_as_its_drop() {
        let (vertices, triangles) = ball();
        assert_eq!([vertices.len(), triangles.len()], BALL);
        let mut edges: Vec<[u32; 2]> =
            triangles.iter().flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]]).collect();
        edges.sort_unstable();
        assert!(edges.windows(2).all(|two| two[0] != two[1]));
        assert!(edges.iter().all(|&[a, b]| edges.binary_search(&[b, a]).is_ok()));
        let size = Balls::default().size;
        let all: f64 = triangles.iter().map(|t| volume(t.map(|at| vertices[at as usize] * size))).sum();
        assert!((all - 4.0 / 3.0 * std::f64::consts::PI).abs() < 1e-12, "{size} {all}");
    }
}
