//! A tree of boxes over a mesh's triangles, for queries by ray and by box.

use crate::geometry::{DVec3, TriMesh, Vec3};

/// Maximum triangles in a leaf.
const LEAF: usize = 4;

/// Triangles of a mesh in a binary tree of boxes, split at medians.
pub struct Bvh {
    nodes: Vec<Node>,
    order: Vec<u32>,
    corners: Vec<[Vec3; 3]>,
}

/// The children of an inner node are the next node and `right`; a leaf has `count` triangles from `first`.
struct Node {
    low: Vec3,
    high: Vec3,
    right: u32,
    first: u32,
    count: u32,
}

/// Where a ray meets a triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RayHit {
    /// Along the ray, in multiples of its direction's length.
    pub distance: f64,
    /// The triangle.
    pub triangle: usize,
    /// Barycentric weight of the second corner.
    pub u: f64,
    /// Barycentric weight of the third corner.
    pub v: f64,
}

impl Bvh {
    /// Sorts a mesh's triangles into a tree.
    pub fn new(mesh: &TriMesh) -> Self {
        let corners: Vec<[Vec3; 3]> = mesh
            .triangles
            .iter()
            .map(|triangle| triangle.map(|index| mesh.positions[index as usize]))
            .collect();
        let mut tree = Self { nodes: Vec::new(), order: (0..corners.len() as u32).collect(), corners };
        if !tree.order.is_empty() {
            tree.split(0, tree.order.len());
        }
        tree
    }

    fn split(&mut self, first: usize, end: usize) -> u32 {
        let (mut low, mut high) = (Vec3::repeat(f32::INFINITY), Vec3::repeat(f32::NEG_INFINITY));
        for &triangle in &self.order[first..end] {
            for corner in &self.corners[triangle as usize] {
                (low, high) = (low.inf(corner), high.sup(corner));
            }
        }
        let index = self.nodes.len();
        self.nodes.push(Node { low, high, right: 0, first: first as u32, count: (end - first) as u32 });
        if end - first > LEAF {
            let axis = (high - low).imax();
            let middle = (first + end) / 2;
            let corners = &self.corners;
            let key =
                |&triangle: &u32| corners[triangle as usize].iter().map(|corner| corner[axis]).sum::<f32>();
            self.order[first..end]
                .select_nth_unstable_by(middle - first, |a, b| key(a).total_cmp(&key(b)).then(a.cmp(b)));
            self.nodes[index].count = 0;
            self.split(first, middle);
            self.nodes[index].right = self.split(middle, end);
        }
        index as u32
    }

    /// The first triangle that a ray hits before `limit`.
    pub fn ray(&self, origin: DVec3, direction: DVec3, limit: f64) -> Option<RayHit> {
        let mut best = None;
        self.traverse(origin, direction, limit, |hit| {
            best = Some(hit);
            Some(hit.distance)
        });
        best
    }

    /// Calls `see` with the triangles whose boxes touch a box.
    pub fn in_box(&self, low: Vec3, high: Vec3, mut see: impl FnMut(usize)) {
        let apart = |a: Vec3, b: Vec3| (0..3).any(|axis| a[axis] > high[axis] || b[axis] < low[axis]);
        let mut stack: Vec<u32> = if self.nodes.is_empty() { Vec::new() } else { vec![0] };
        while let Some(index) = stack.pop() {
            let node = &self.nodes[index as usize];
            if apart(node.low, node.high) {
                continue;
            }
            if node.count == 0 {
                stack.extend([node.right, index + 1]);
                continue;
            }
            for &triangle in &self.order[node.first as usize..(node.first + node.count) as usize] {
                let [a, b, c] = self.corners[triangle as usize];
                if !apart(a.inf(&b).inf(&c), a.sup(&b).sup(&c)) {
                    see(triangle as usize);
                }
            }
        }
    }

    /// Whether a ray hits any triangle before `limit`.
    pub fn any_hit(&self, origin: DVec3, direction: DVec3, limit: f64) -> bool {
        let mut found = false;
        self.traverse(origin, direction, limit, |_| {
            found = true;
            None
        });
        found
    }

    /// Winding number of a closed mesh around the origin of a ray: the triangles that the ray leaves through, minus those that it enters
    /// through. A ray that hits a common edge of triangles counts both.
    pub fn winding_number(&self, origin: DVec3, direction: DVec3) -> i32 {
        let mut sum = 0;
        self.crossings(origin, direction, |_, sign| sum += sign);
        sum
    }

    /// Calls `see` with all triangles that a ray passes through: with 1 if it leaves through the front, -1 if it enters.
    pub fn crossings(&self, origin: DVec3, direction: DVec3, mut see: impl FnMut(usize, i32)) {
        self.traverse(origin, direction, f64::INFINITY, |hit| {
            let [a, b, c] = self.corners[hit.triangle].map(|corner| corner.cast::<f64>());
            see(hit.triangle, if (b - a).cross(&(c - a)).dot(&direction) > 0.0 { 1 } else { -1 });
            Some(f64::INFINITY)
        });
    }

    /// Calls `see` with hits, in no order; `see` returns the new limit, or none to stop.
    fn traverse(
        &self,
        origin: DVec3,
        direction: DVec3,
        mut limit: f64,
        mut see: impl FnMut(RayHit) -> Option<f64>,
    ) {
        let inverse = direction.map(|value| 1.0 / value);
        let mut stack = [0u32; 64];
        let mut depth = usize::from(!self.nodes.is_empty());
        while depth > 0 {
            depth -= 1;
            let index = stack[depth];
            let node = &self.nodes[index as usize];
            if !enters(node, origin, inverse, limit) {
                continue;
            }
            if node.count == 0 {
                stack[depth] = node.right;
                stack[depth + 1] = index + 1;
                depth += 2;
                continue;
            }
            for &triangle in &self.order[node.first as usize..(node.first + node.count) as usize] {
                if let Some(hit) = intersect(&self.corners[triangle as usize], origin, direction, limit) {
                    match see(RayHit { triangle: triangle as usize, ..hit }) {
                        Some(nearer) => limit = nearer,
                        None => return,
                    }
                }
            }
        }
    }
}

fn enters(node: &Node, origin: DVec3, inverse: DVec3, limit: f64) -> bool {
    let (mut near, mut far) = (0.0f64, limit);
    for axis in 0..3 {
        let a = (f64::from(node.low[axis]) - origin[axis]) * inverse[axis];
        let b = (f64::from(node.high[axis]) - origin[axis]) * inverse[axis];
        // A ray that runs along a slab's side gives NaN, which min and max ignore.
        near = near.max(a.min(b));
        far = far.min(a.max(b));
    }
    near <= far * (1.0 + 1e-12)
}

/// The hit of a ray with a triangle (Moller and Trumbore 1997).
fn intersect(corners: &[Vec3; 3], origin: DVec3, direction: DVec3, limit: f64) -> Option<RayHit> {
    let [a, b, c] = corners.map(|corner| corner.cast::<f64>());
    let (e1, e2) = (b - a, c - a);
    let p = direction.cross(&e2);
    let determinant = e1.dot(&p);
    if determinant == 0.0 {
        return None;
    }
    let to = origin - a;
    let u = to.dot(&p) / determinant;
    let q = to.cross(&e1);
    let v = direction.dot(&q) / determinant;
    let distance = e2.dot(&q) / determinant;
    let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0 && distance < limit;
    inside.then_some(RayHit { distance, triangle: 0, u, v })
}
