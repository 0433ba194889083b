//! The parts of a mesh, even if it has doubled triangles, triangles that disagree, or non-manifold edges.

use super::nesting::{ASLANT, Shape, Turns, turns};
use super::outcome::{Closing, Fate, Orientation};
use crate::geometry::check::duplicates::{Doubles, copies};
use crate::geometry::check::edges::{
    Agreement, Use, agree, edge_uses, imbalance, is_same_edge, mark_closed_manifolds, parts_of,
};
use crate::geometry::check::topology::Sets;
use crate::geometry::shape::{bounds, normal, six_volumes};
use crate::geometry::spatial::bvh::Bvh;
use crate::geometry::{DVec3, TriMesh};

/// The volume of a part counts as 0 if it is at most this fraction of the cube of the part's size: rounding alone can produce as much.
const ROUNDING: f64 = 1e-12;
/// An open part counts as closed if its caps have at most this share of its area.
const CAPS: f64 = 0.05;

/// The triangles of a mesh that are not left out, and their parts.
#[derive(Default)]
pub(super) struct Pieces<'a> {
    positions: &'a [DVec3],
    /// Corners of each triangle: vertices of the mesh in parts that are closed by their indices, else joined vertices. If there are both, the
    /// number of vertices is added to the indices of the joined ones.
    named: Vec<[u32; 3]>,
    /// Index of each triangle in the mesh.
    numbers: Vec<u32>,
    /// The part of each triangle.
    part: Vec<u32>,
    /// Whether each part is open, indexed by the name of the part.
    is_open: Vec<bool>,
}

impl<'a> Pieces<'a> {
    /// Triangles with these named corners, and their indices in the mesh.
    pub(super) fn new(positions: &'a [DVec3], named: Vec<[u32; 3]>, numbers: Vec<u32>) -> Self {
        Self { positions, named, numbers, ..Self::default() }
    }

    pub(super) fn count(&self) -> usize {
        self.named.len()
    }

    /// Sets the parts of triangles that all agree with their neighbours.
    pub(super) fn set_parts(&mut self, part: Vec<u32>, uses: &[Use]) {
        self.is_open = vec![false; part.len()];
        self.part = part;
        let open = uses.chunk_by(is_same_edge).filter(|run| run.len() == 1);
        open.for_each(|run| self.is_open[self.part[run[0].1 as usize] as usize] = true);
    }

    fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.named[triangle].map(|name| self.positions[name as usize % self.positions.len()])
    }

    fn area(&self, triangle: usize) -> f64 {
        normal(&self.corners(triangle)).norm()
    }

    /// Leaves triangles out.
    fn leave_out(&mut self, is_out: &[bool], out: &mut Orientation) {
        let is_in = |at: &usize| !is_out[*at];
        let outs = self.numbers.iter().zip(is_out).filter(|(_, is_out)| **is_out);
        outs.for_each(|(number, _)| out.fates[*number as usize] = Fate::LeftOut);
        let kept: Vec<usize> = (0..self.named.len()).filter(is_in).collect();
        self.named = kept.iter().map(|at| self.named[*at]).collect();
        self.numbers = kept.iter().map(|at| self.numbers[*at]).collect();
    }

    fn turn(&mut self, triangle: usize, out: &mut Orientation) {
        self.named[triangle].swap(1, 2);
        let fate = &mut out.fates[self.numbers[triangle] as usize];
        *fate = if *fate == Fate::Turned { Fate::Stays } else { Fate::Turned };
    }

    /// Finds the parts of triangles that have duplicates, neighbours that disagree, or non-manifold edges.
    pub(super) fn find_parts(&mut self, triangles: &[[u32; 3]], closing: Closing, out: &mut Orientation) {
        let vertices = self.positions.len();
        let raw: Vec<[u32; 3]> = self.numbers.iter().map(|at| triangles[*at as usize]).collect();
        let uses = edge_uses(vertices, &raw);
        let parts = parts_of(raw.len(), &uses);
        let is_closed_manifold = mark_closed_manifolds(&raw, &uses, &parts);
        let sorted = |at: usize| {
            let mut corners = self.named[at];
            corners.sort_unstable();
            corners
        };
        let is_copy = copies(&parts, |at| is_closed_manifold[at], sorted);
        for (at, corners) in raw.iter().enumerate() {
            let joined = self.named[at].map(|vertex| vertex + vertices as u32);
            self.named[at] = if is_closed_manifold[at] { *corners } else { joined };
        }
        if is_copy.contains(&true) {
            self.leave_out(&is_copy, out);
        }
        let uses = edge_uses(2 * vertices, &self.named);
        let Doubles { is_double, is_two_sided } = Doubles::of(&self.named, &uses);
        let mut two_sided: Vec<u32> = Vec::new();
        if is_double.contains(&true) {
            two_sided =
                self.numbers.iter().zip(&is_two_sided).filter(|(_, is)| **is).map(|(at, _)| *at).collect();
            self.leave_out(&is_double, out);
        }
        let uses = edge_uses(2 * vertices, &self.named);
        let agreement = agree(&self.named, &uses, |at| self.area(at));
        self.divide(&uses, &agreement, out);
        for at in 0..self.named.len() {
            let is_alone = self.part[at] == agreement.patch[at];
            let is_one_sided = agreement.one_sided.binary_search(&agreement.patch[at]).is_ok();
            if agreement.turned[at] && is_alone && !is_one_sided {
                self.turn(at, out);
            }
        }
        self.face_up(&agreement, &two_sided, closing, out);
    }

    /// Names the parts: patches that are closed or connected to no other, and what remains of each component.
    fn divide(&mut self, uses: &[Use], agreement: &Agreement, out: &mut Orientation) {
        let count = self.named.len();
        let components = parts_of(count, uses);
        let Agreement { turned, patch, one_sided } = agreement;
        let agreed: Vec<[u32; 3]> = self
            .named
            .iter()
            .zip(turned)
            .map(|(&[a, b, c], turned)| if *turned { [a, c, b] } else { [a, b, c] })
            .collect();
        let (mut is_closed, mut has_non_manifold) = (vec![true; count], vec![false; count]);
        let mut of_run: Vec<Use> = Vec::new();
        for run in uses.chunk_by(is_same_edge).filter(|run| run.len() != 2) {
            has_non_manifold[components[run[0].1 as usize] as usize] |= run.len() > 2;
            of_run.clear();
            of_run.extend_from_slice(run);
            of_run.sort_by_key(|used| patch[used.1 as usize]);
            for own in of_run.chunk_by(|a, b| patch[a.1 as usize] == patch[b.1 as usize]) {
                is_closed[patch[own[0].1 as usize] as usize] &= imbalance(&agreed, own) == 0;
            }
        }
        one_sided.iter().for_each(|patch| is_closed[*patch as usize] = false);
        let is_left = |at: usize| has_non_manifold[components[at] as usize] && !is_closed[patch[at] as usize];
        // What remains of a component has a name that no patch has.
        self.part = (0..count)
            .map(|at| if is_left(at) { count as u32 + components[at] } else { patch[at] })
            .collect();
        self.is_open = (0..count).map(|patch| !is_closed[patch]).chain(vec![false; count]).collect();
        for run in uses.chunk_by(is_same_edge) {
            let left: Vec<Use> = run.iter().copied().filter(|used| is_left(used.1 as usize)).collect();
            let off = imbalance(&self.named, &left);
            if off != 0 {
                self.is_open[count + components[left[0].1 as usize] as usize] = true;
                out.doubts.non_manifold_edges += usize::from(left.len().is_multiple_of(2));
            }
        }
        out.doubts.one_sided += one_sided.len();
        let left: Vec<u32> = (0..count as u32).filter(|at| is_left(*at as usize)).collect();
        if left.iter().any(|at| !self.is_open[self.part[*at as usize] as usize]) {
            out.doubts.non_manifold_edges += self.count_inverted(&left, patch);
        }
    }

    /// Of the patches that make up closed remainders, counts those with a negative winding number on either side: there, a part of the
    /// remainder is inside out.
    fn count_inverted(&self, left: &[u32], patch: &[u32]) -> usize {
        let mut order: Vec<u32> = left.to_vec();
        order.sort_by_key(|at| self.part[*at as usize]);
        let mut found = 0;
        for part in order.chunk_by(|a, b| self.part[*a as usize] == self.part[*b as usize]) {
            if self.is_open[self.part[part[0] as usize] as usize] {
                continue;
            }
            let (volume, low, size) = self.volume(part);
            let sign = if volume < 0.0 { -1 } else { 1 };
            let local = |at: &u32| self.corners(*at as usize).map(|p| (p - low).cast::<f32>());
            let tree = Bvh::new(&TriMesh::soup(part.iter().flat_map(local).collect()));
            let mut largest: Vec<(u32, f64, u32)> =
                part.iter().map(|at| (patch[*at as usize], self.area(*at as usize), *at)).collect();
            largest.sort_by(|a, b| a.0.cmp(&b.0).then(b.1.total_cmp(&a.1)));
            for of_patch in largest.chunk_by(|a, b| a.0 == b.0) {
                let [a, b, c] = self.corners(of_patch[0].2 as usize).map(|p| p - low);
                let off = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_default() * (1e-4 * size);
                let beside =
                    [off, -off].map(|off| tree.winding_number((a + b + c) / 3.0 + off, ASLANT[0]) * sign);
                found += usize::from(beside.iter().any(|count| *count < 0));
            }
        }
        found
    }

    /// Turns open parts whose own orientation is ambiguous (two-sided sheets, and parts in which neighbouring triangles disagreed) so that
    /// they face up (`Below`) or their volume is positive (`Caps`).
    fn face_up(&mut self, agreement: &Agreement, two_sided: &[u32], closing: Closing, out: &mut Orientation) {
        let count = self.named.len();
        let mut is_undecided = vec![false; count];
        for at in 0..count {
            let is_mixed = agreement.turned[at] && self.part[at] == agreement.patch[at];
            if is_mixed || two_sided.binary_search(&self.numbers[at]).is_ok() {
                is_undecided[agreement.patch[at] as usize] = true;
            }
        }
        agreement.one_sided.iter().for_each(|patch| is_undecided[*patch as usize] = false);
        let mut sums = vec![0.0f64; count];
        let is_candidate = |pieces: &Self, at: usize| {
            let part = pieces.part[at] as usize;
            part < count && is_undecided[part] && pieces.is_open[part]
        };
        for at in (0..count).filter(|at| is_candidate(self, *at)) {
            let first = self.corners(self.part[at] as usize)[0];
            let corners = self.corners(at);
            sums[self.part[at] as usize] += match closing {
                Closing::Below => normal(&corners).y,
                Closing::Caps => six_volumes(&corners, &first),
            };
        }
        for at in 0..count {
            if is_candidate(self, at) && sums[self.part[at] as usize] < 0.0 {
                self.turn(at, out);
            }
        }
    }

    /// Signed volume (m3) of triangles, 0 where rounding decides, with their minimum corner and their size (m).
    fn volume(&self, triangles: &[u32]) -> (f64, DVec3, f64) {
        let (low, high) = bounds(triangles.iter().flat_map(|at| self.corners(*at as usize)));
        let six = triangles.iter().map(|at| six_volumes(&self.corners(*at as usize), &low));
        let size = (high - low).norm();
        (substantial(six.sum::<f64>() / 6.0, size), low, size)
    }

    /// Turns the parts that are inside out.
    pub(super) fn turn_outward(&mut self, closing: Closing, count: usize, out: &mut Orientation) {
        let mut order: Vec<u32> = (0..self.named.len() as u32).collect();
        order.sort_by_key(|at| self.part[*at as usize]);
        let parts: Vec<&[u32]> =
            order.chunk_by(|a, b| self.part[*a as usize] == self.part[*b as usize]).collect();
        let is_open = |part: &[u32]| self.is_open[self.part[part[0] as usize] as usize];
        let shapes: Vec<Shape> = parts.iter().map(|part| self.shape(part, is_open(part), closing)).collect();
        if shapes.iter().any(|shape| !shape.can_turn) {
            out.open = vec![false; count];
            for (part, _) in parts.iter().zip(&shapes).filter(|(_, shape)| !shape.can_turn) {
                part.iter().for_each(|at| out.open[self.numbers[*at as usize] as usize] = true);
            }
        }
        let closed =
            |shapes: &[Shape]| -> f64 { shapes.iter().filter(|s| s.can_turn).map(|s| s.volume).sum() };
        out.volumes = [closed(&shapes); 2];
        if !shapes.iter().any(|shape| shape.can_turn && shape.volume < 0.0) {
            return;
        }
        let shapes: Vec<Shape> =
            parts.iter().zip(shapes).map(|(part, shape)| self.filled(part, shape)).collect();
        let Turns { turned, ambiguous } = turns(&shapes);
        out.doubts.nested += ambiguous;
        out.turned_parts += turned.iter().filter(|turned| **turned).count();
        for (_, shape) in turned.iter().zip(&shapes).filter(|(turned, _)| **turned) {
            out.volumes[1] -= 2.0 * shape.volume;
        }
        if out.fates.is_empty() {
            out.fates = vec![Fate::Stays; count];
        }
        let to_turn: Vec<u32> = parts
            .iter()
            .zip(&turned)
            .filter(|(_, turned)| **turned)
            .flat_map(|(part, _)| part.to_vec())
            .collect();
        to_turn.into_iter().for_each(|at| self.turn(at as usize, out));
    }

    /// A part without its own triangles, but with those that close it.
    fn shape(&self, part: &[u32], is_open: bool, closing: Closing) -> Shape {
        let (volume, low, size) = self.volume(part);
        let mut shape =
            Shape { triangles: Vec::new(), own: 0, volume, can_turn: !is_open, is_bottomless: false };
        if is_open {
            shape.is_bottomless = closing == Closing::Below;
            if closing == Closing::Caps {
                shape.triangles = self.caps(part);
                let own: f64 = part.iter().map(|at| self.area(*at as usize)).sum();
                let of_caps: f64 = shape.triangles.iter().map(|corners| normal(corners).norm()).sum();
                shape.can_turn = of_caps <= CAPS * own;
                let six =
                    part.iter().map(|at| self.corners(*at as usize)).chain(shape.triangles.iter().copied());
                shape.volume =
                    substantial(six.map(|corners| six_volumes(&corners, &low)).sum::<f64>() / 6.0, size);
            }
        }
        shape
    }

    /// The part with its triangles.
    fn filled(&self, part: &[u32], shape: Shape) -> Shape {
        let mut triangles: Vec<[DVec3; 3]> = part.iter().map(|at| self.corners(*at as usize)).collect();
        triangles.extend(&shape.triangles);
        Shape { triangles, own: part.len(), ..shape }
    }

    /// Cones to the centres of a part's open loops.
    fn caps(&self, part: &[u32]) -> Vec<[DVec3; 3]> {
        let triangles: Vec<[u32; 3]> = part.iter().map(|at| self.named[*at as usize]).collect();
        let mut edges: Vec<([u32; 2], i32)> = triangles
            .iter()
            .flat_map(|&[a, b, c]| [[a, b], [b, c], [c, a]])
            .map(|[i, j]| if i < j { ([i, j], 1) } else { ([j, i], -1) })
            .collect();
        edges.sort_unstable();
        let off = |run: &[([u32; 2], i32)]| (run[0].0, run.iter().map(|(_, sign)| sign).sum::<i32>());
        let open: Vec<([u32; 2], i32)> =
            edges.chunk_by(|a, b| a.0 == b.0).map(off).filter(|(_, off)| *off != 0).collect();
        let mut rim: Vec<u32> = open.iter().flat_map(|(ends, _)| *ends).collect();
        rim.sort_unstable();
        rim.dedup();
        let index = |name: u32| rim.partition_point(|other| *other < name) as u32;
        let mut loops = Sets::new(rim.len());
        open.iter().for_each(|([i, j], _)| loops.join(index(*i), index(*j)));
        let position = |name: u32| self.positions[name as usize % self.positions.len()];
        let mut sums = vec![(DVec3::zeros(), 0.0); rim.len()];
        for (at, name) in (0..).zip(&rim) {
            let sum = &mut sums[loops.root(at) as usize];
            *sum = (sum.0 + position(*name), sum.1 + 1.0);
        }
        let mut out = Vec::new();
        for ([i, j], off) in open {
            let (sum, count) = sums[loops.root(index(i)) as usize];
            let [from, to] = if off > 0 { [j, i] } else { [i, j] };
            out.extend((0..off.abs()).map(|_| [position(from), position(to), sum / count]));
        }
        out
    }
}

/// The volume of a part of this size, or 0 where rounding decides.
fn substantial(volume: f64, size: f64) -> f64 {
    if volume.abs() > ROUNDING * size.powi(3) { volume } else { 0.0 }
}
