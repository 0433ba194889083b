//! Distances from points of one mesh to the nearest positions on another. For meshes with the same triangles also distances between their
//! vertices, and how much these jitter over three frames.

use rayon::prelude::*;

use crate::geometry::{DVec3, TriMesh, Vec3};

/// Maximum triangles in a leaf.
const LEAF: usize = 4;
/// Points, triangles or leaves per task.
const GRAIN: usize = 1024;
/// Size of the stack of a search, which has at most one pending node for each of at most 30 levels.
const STACK: usize = 64;
/// A triangle is degenerate if the sine of the angle at its first corner is at most this. Only its edges are searched then: every point of
/// it lies within this fraction of its length from one of them.
const NEEDLE: f64 = 1e-8;
/// Distances up to this fraction of the largest coordinate are rounding in 64 bits, and count as 0; meshes have 32-bit coordinates, whose
/// spacing there is 6e-8 of the coordinate.
const ROUNDING: f64 = 1e-12;
/// Weights of a triangle's centre and of each corner, as shares of its area: exact for quadratic integrands.
const CENTRE: f64 = 0.75;
const CORNER: f64 = 1.0 / 12.0;
/// Fraction of the points, by weight, whose distance is at most [`Deviation::p95`].
const PERCENTILE: f64 = 0.95;

/// Minimum and maximum corner of a box (m).
type Span = (Vec3, Vec3);
/// The empty box.
const EMPTY: Span = (Vec3::new(FAR, FAR, FAR), Vec3::new(-FAR, -FAR, -FAR));
const FAR: f32 = f32::INFINITY;
/// Centre of a triangle (m), and its index.
type Item = (Vec3, u32);

/// Summary of the distances of points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Deviation {
    /// Mean (m).
    pub mean: f64,
    /// 95th percentile (m).
    pub p95: f64,
    /// Largest (m).
    pub max: f64,
    /// The point (m) with the largest distance; the first if there are several.
    pub max_at: DVec3,
}

/// Distances from a mesh to the surface of another, at the vertices that its triangles use and at the triangles' centres. Each point is
/// weighted by the area that it represents: three quarters of a triangle's area for its centre, a twelfth for each corner. On a mesh
/// without area all points weigh the same. `None` if either mesh has no triangles.
pub fn from_surface(mesh: &TriMesh, to: &NearestTree) -> Option<Deviation> {
    let samples: Vec<Vec<Sample>> = points(mesh).par_chunks(GRAIN).map(|points| to.samples(points)).collect();
    Deviation::of(&samples.concat())
}

/// Distances from the vertices of a mesh to the same vertices of another with the same triangles. Only vertices that triangles use count,
/// with equal weights; `None` without triangles.
pub fn from_vertices(mesh: &TriMesh, to: &TriMesh) -> Option<Deviation> {
    let pairs = mesh.positions.iter().zip(&to.positions);
    let distances = pairs.map(|(from, to)| {
        let (from, to) = (from.cast::<f64>(), to.cast::<f64>());
        (from, (to - from).norm())
    });
    Deviation::of(&vertex_samples(mesh, distances))
}

/// Lengths of the second differences of each vertex position, x(n - 1) - 2 x(n) + x(n + 1), over three frames of meshes with the same
/// triangles: 0 where a vertex moves uniformly. Only vertices that triangles use count, with equal weights; `None` without triangles.
pub fn second_differences([before, here, after]: [&TriMesh; 3]) -> Option<Deviation> {
    let positions = before.positions.iter().zip(&here.positions).zip(&after.positions);
    let differences = positions.map(|((before, here), after)| {
        let [before, here, after] = [before, here, after].map(|position| position.cast::<f64>());
        (here, (before - here * 2.0 + after).norm())
    });
    Deviation::of(&vertex_samples(here, differences))
}

/// A point (m) with its distance (m).
#[derive(Clone, Copy)]
struct Sample {
    at: DVec3,
    distance: f64,
    /// The area that it represents (m2), or 1.
    weight: f64,
}

impl Deviation {
    fn of(samples: &[Sample]) -> Option<Self> {
        let first = samples.first()?;
        let farthest = samples.iter().fold(first, |a, b| if b.distance > a.distance { b } else { a });
        let area: f64 = samples.iter().map(|sample| sample.weight).sum();
        let weight = |sample: &Sample| if area > 0.0 { sample.weight } else { 1.0 };
        let total = if area > 0.0 { area } else { samples.len() as f64 };
        let sum: f64 = samples.iter().map(|sample| weight(sample) * sample.distance).sum();
        let mut order: Vec<(f64, f64)> =
            samples.iter().map(|sample| (sample.distance, weight(sample))).collect();
        // Stable, so that the weighted sum has a fixed order.
        order.par_sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut within = 0.0;
        let last = order.iter().find(|(_, weight)| {
            within += weight;
            within >= PERCENTILE * total
        });
        let max = farthest.distance;
        // Rounding may lift the mean of equal numbers above them.
        let mean = (sum / total).min(max);
        Some(Self { mean, p95: last.map_or(max, |(distance, _)| *distance), max, max_at: farthest.at })
    }
}

/// The vertices that triangles use; `distances` has the position and the distance (m) of every vertex.
fn vertex_samples(mesh: &TriMesh, distances: impl Iterator<Item = (DVec3, f64)>) -> Vec<Sample> {
    let mut is_used = vec![false; mesh.positions.len()];
    mesh.triangles.as_flattened().iter().for_each(|&vertex| is_used[vertex as usize] = true);
    let used = distances.zip(is_used).filter(|(_, is_used)| *is_used);
    used.map(|((at, distance), _)| Sample { at, distance, weight: 1.0 }).collect()
}

/// The points of a mesh (m), each with the area (m2) that it represents: the vertices that triangles use, then the centres.
fn points(mesh: &TriMesh) -> Vec<(DVec3, f64)> {
    let mut areas: Vec<Option<f64>> = vec![None; mesh.positions.len()];
    let mut centres = Vec::with_capacity(mesh.triangles.len());
    for (triangle, vertices) in mesh.triangles.iter().enumerate() {
        let [a, b, c] = mesh.corners(triangle);
        let area = (b - a).cross(&(c - a)).norm() / 2.0;
        for &vertex in vertices {
            *areas[vertex as usize].get_or_insert(0.0) += CORNER * area;
        }
        centres.push(((a + b + c) / 3.0, CENTRE * area));
    }
    let vertices = mesh.positions.iter().zip(areas);
    vertices.filter_map(|(position, area)| Some((position.cast::<f64>(), area?))).chain(centres).collect()
}

/// The triangles of a mesh in a binary tree of boxes, for nearest-position queries.
pub struct NearestTree {
    /// One for each node; the children of node i are 2 i + 1 and 2 i + 2.
    boxes: Vec<Span>,
    /// In the order of the leaves, which are the last nodes and share the facets evenly.
    facets: Vec<Facet>,
    /// Levels below the root.
    levels: u32,
    /// Largest coordinate (m).
    reach: f64,
}

/// The position on a mesh that is nearest to a point.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// The position (m).
    pub position: DVec3,
    /// Distance to the point (m); 0 if it is at most 1e-12 of the largest coordinate.
    pub distance: f64,
    /// The triangle that it lies on; any one if there are several.
    pub triangle: usize,
}

/// The position on a facet that is nearest to a point.
#[derive(Clone, Copy)]
pub(in crate::geometry) struct FacetPoint {
    position: DVec3,
    /// Squared distance (m2).
    pub(in crate::geometry) square: f64,
    facet: usize,
}

impl NearestTree {
    /// Sorts a mesh's triangles into a tree; positions must be finite and indices in range.
    pub fn new(mesh: &TriMesh) -> Self {
        let count = mesh.triangles.len();
        let mut levels = 0u32;
        while count > LEAF << levels {
            levels += 1;
        }
        let corners =
            |triangle: u32| mesh.triangles[triangle as usize].map(|vertex| mesh.positions[vertex as usize]);
        let middle = |triangle: u32| {
            // Divided first: the sum of three then fits in 32 bits.
            let [a, b, c] = corners(triangle).map(|corner| corner / 3.0);
            (a + b + c, triangle)
        };
        let mut order: Vec<Item> = (0..count as u32).map(middle).collect();
        sort(&mut order, count, levels, 0, 0);
        let facet = |&(_, triangle): &Item| Facet::new(corners(triangle), triangle);
        let facets: Vec<Facet> = order.par_iter().with_min_len(GRAIN).map(facet).collect();
        let leaves = 1usize << levels;
        let around = |leaf: usize| {
            let facets = &facets[starts(count, levels, leaf)..starts(count, levels, leaf + 1)];
            let corners = facets.iter().flat_map(|facet| &facet.corners);
            corners.fold(EMPTY, |(low, high), corner| (low.inf(corner), high.sup(corner)))
        };
        let mut boxes = vec![EMPTY; leaves - 1];
        boxes.par_extend((0..leaves).into_par_iter().with_min_len(GRAIN).map(around));
        for node in (0..leaves - 1).rev() {
            let [one, two] = [boxes[2 * node + 1], boxes[2 * node + 2]];
            boxes[node] = (one.0.inf(&two.0), one.1.sup(&two.1));
        }
        let reach = mesh.farthest();
        Self { boxes, facets, levels, reach }
    }

    /// The position that is nearest to a point (m); `None` without triangles.
    pub fn nearest(&self, point: DVec3) -> Option<Nearest> {
        let found = self.search(point, None)?;
        let triangle = self.facets[found.facet].triangle as usize;
        Some(Nearest { position: found.position, distance: self.distance(point, &found), triangle })
    }

    /// The distances of points, each with its weight.
    fn samples(&self, points: &[(DVec3, f64)]) -> Vec<Sample> {
        // Consecutive points are mostly neighbours: the last one's facet is a good first guess.
        let mut guess = None;
        let sample = |&(at, weight): &(DVec3, f64)| {
            let found = self.search(at, guess)?;
            guess = Some(found.facet);
            Some(Sample { at, weight, distance: self.distance(at, &found) })
        };
        points.iter().filter_map(sample).collect()
    }

    fn distance(&self, from: DVec3, to: &FacetPoint) -> f64 {
        let distance = to.square.sqrt();
        if distance <= ROUNDING * self.reach.max(from.amax()) { 0.0 } else { distance }
    }

    /// The nearest position; `guess` is the index of a facet that is probably near, for speed.
    fn search(&self, point: DVec3, guess: Option<usize>) -> Option<FacetPoint> {
        let mut best = guess.map(|facet| self.facets[facet].nearest(point, facet));
        let mut bound = best.map_or(f64::INFINITY, |found| found.square);
        let node = |index: usize| (squared_distance_to(&self.boxes[index], point), index);
        let first_leaf = (1usize << self.levels) - 1;
        let mut stack = [(0.0, 0usize); STACK];
        stack[0] = node(0);
        let mut count = 1;
        while count > 0 {
            count -= 1;
            let (square, index) = stack[count];
            if square >= bound {
                continue;
            }
            if index < first_leaf {
                let (one, two) = (node(2 * index + 1), node(2 * index + 2));
                let (near, far) = if two.0 < one.0 { (two, one) } else { (one, two) };
                stack[count] = far;
                stack[count + 1] = near;
                count += 2;
                continue;
            }
            let leaf = index - first_leaf;
            let [begin, end] = [leaf, leaf + 1].map(|leaf| starts(self.facets.len(), self.levels, leaf));
            for (facet, number) in self.facets[begin..end].iter().zip(begin..) {
                let found = facet.nearest(point, number);
                if found.square < bound {
                    bound = found.square;
                    best = Some(found);
                }
            }
        }
        best
    }
}

/// Index of the first item of a node at a level, out of `count` items, which the nodes of a level share evenly.
fn starts(count: usize, level: u32, node: usize) -> usize {
    (node * count) >> level
}

/// Orders the items of a node so that those of each node below it are consecutive, at [`starts`].
fn sort(items: &mut [Item], count: usize, levels: u32, level: u32, node: usize) {
    if level == levels {
        return;
    }
    let around = |(low, high): Span, (middle, _): &Item| (low.inf(middle), high.sup(middle));
    let (low, high) = items.iter().fold(EMPTY, around);
    let axis = (high - low).imax();
    let half = starts(count, level + 1, 2 * node + 1) - starts(count, level, node);
    items.select_nth_unstable_by(half, |a, b| a.0[axis].total_cmp(&b.0[axis]).then(a.1.cmp(&b.1)));
    let (less, more) = items.split_at_mut(half);
    rayon::join(
        || sort(less, count, levels, level + 1, 2 * node),
        || sort(more, count, levels, level + 1, 2 * node + 1),
    );
}

/// Squared distance of a point from a box (m2): 0 inside.
fn squared_distance_to((low, high): &Span, point: DVec3) -> f64 {
    let beyond = |axis: usize| {
        let [low, high] = [low, high].map(|corner| f64::from(corner[axis]));
        (low - point[axis]).max(point[axis] - high).max(0.0)
    };
    let [x, y, z] = [0, 1, 2].map(beyond);
    x * x + y * y + z * z
}

/// A triangle.
pub(in crate::geometry) struct Facet {
    corners: [Vec3; 3],
    triangle: u32,
    /// Whether only its edges are searched.
    is_needle: bool,
}

impl Facet {
    pub(in crate::geometry) fn new(corners: [Vec3; 3], triangle: u32) -> Self {
        let [a, b, c] = corners.map(|corner| corner.cast::<f64>());
        let (ab, ac) = (b - a, c - a);
        let square = ab.cross(&ac).norm_squared();
        let is_needle = square <= NEEDLE * NEEDLE * ab.norm_squared() * ac.norm_squared();
        Self { corners, triangle, is_needle }
    }

    /// The position nearest to a point: on the face if the point lies on the inner side of all edges, else on one of these (Ericson,
    /// Real-Time Collision Detection, 2005, 5.1.5). Here planes along the edges separate the regions; Ericson uses products of projections,
    /// whose rounding grows with the square of a needle's length.
    pub(in crate::geometry) fn nearest(&self, point: DVec3, facet: usize) -> FacetPoint {
        let [a, b, c] = self.corners.map(|corner| corner.cast::<f64>());
        let edges = [(a, b), (b, c), (c, a)];
        let normal = (b - a).cross(&(c - a));
        let is_inward = |&(from, to): &(DVec3, DVec3)| (to - from).cross(&(point - from)).dot(&normal) > 0.0;
        if !self.is_needle && edges.iter().all(is_inward) {
            let above = normal * ((point - a).dot(&normal) / normal.norm_squared());
            return FacetPoint { position: point - above, square: above.norm_squared(), facet };
        }
        let on_edge = |(from, to): (DVec3, DVec3)| {
            let position = nearest_of_edge(point, from, to);
            FacetPoint { position, square: (position - point).norm_squared(), facet }
        };
        let [one, two, three] = edges.map(on_edge);
        let nearer = if two.square < one.square { two } else { one };
        if three.square < nearer.square { three } else { nearer }
    }
}

/// The position on an edge that is nearest to a point.
fn nearest_of_edge(point: DVec3, from: DVec3, to: DVec3) -> DVec3 {
    let along = to - from;
    let square = along.norm_squared();
    let projection = (point - from).dot(&along);
    // Exact at the ends.
    if projection <= 0.0 || square == 0.0 {
        from
    } else if projection >= square {
        to
    } else {
        from + along * (projection / square)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers from -1 to 1, the same in every run.
    struct Random(u64);

    impl Random {
        fn next(&mut self) -> f32 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 40) as f32 / (1 << 23) as f32 - 1.0
        }

        fn vector(&mut self, size: f32) -> Vec3 {
            Vec3::new(self.next(), self.next(), self.next()) * size
        }
    }

    /// Random triangles of all sizes: some are needles, some have no area.
    fn litter(seed: u64, count: usize) -> TriMesh {
        let mut random = Random(seed);
        let triangle = |n: usize| {
            let size = [1.0, 0.1, 0.01][n % 3];
            let [a, b, c] = [random.vector(1.0), random.vector(size), random.vector(size)];
            let c = [b * 0.5 + c * 1e-5, b * 2.0, b * 0.0, c, c, c, c][n % 7];
            [a, a + b, a + c]
        };
        TriMesh::soup((0..count).flat_map(triangle).collect())
    }

    #[test]
    fn the_tree_agrees_with_brute_force() {
        for (seed, count) in [(1, 1), (2, 5), (3, 64), (4, 1001)] {
            let mesh = litter(seed, count);
            let tree = NearestTree::new(&mesh);
            let mut seen: Vec<u32> = tree.facets.iter().map(|facet| facet.triangle).collect();
            seen.sort_unstable();
            assert!(seen.into_iter().eq(0..count as u32), "every triangle has one facet");
            let mut random = Random(seed + 100);
            let mut guess = None;
            for n in 0..300 {
                let point: DVec3 = random.vector([1.2, 0.2, 20.0][n % 3]).cast();
                let best = |found: f64, facet: &Facet| found.min(facet.nearest(point, 0).square);
                let expected = tree.facets.iter().fold(f64::INFINITY, best).sqrt();
                let nearest = tree.nearest(point).unwrap();
                let hinted = tree.search(point, guess).unwrap();
                let squares = [nearest.distance, (nearest.position - point).norm(), hinted.square.sqrt()];
                let is_expected =
                    squares.iter().all(|squares| (squares - expected).abs() <= 1e-12 * (1.0 + expected));
                assert!(is_expected, "{squares:?}: {expected}");
                guess = Some(hinted.facet);
            }
        }
    }

    #[test]
    fn no_position_of_a_triangle_is_nearer_than_the_one_found() {
        let mesh = litter(7, 700);
        let mut random = Random(8);
        for triangle in 0..mesh.triangles.len() {
            let corners = mesh.triangles[triangle].map(|vertex| mesh.positions[vertex as usize]);
            let facet = Facet::new(corners, 0);
            let [a, b, c] = mesh.corners(triangle);
            let size = (b - a).norm().max((c - a).norm()).max((c - b).norm());
            for scale in [0.3, 1.0, 3.0] {
                let point = (a + b + c) / 3.0 + random.vector(scale).cast::<f64>() * size;
                let found = facet.nearest(point, 0);
                let close = 1e-6 * size * size;
                // The nearest position of a convex set: all of the set lies behind the plane through it that faces the point.
                let outward = point - found.position;
                assert!([a, b, c].iter().all(|corner| outward.dot(&(corner - found.position)) <= close));
                // It lies in the triangle: its triangles with the edges are together no larger than the whole.
                let area = |p: DVec3, q: DVec3, r: DVec3| (q - p).cross(&(r - p)).norm();
                let position = found.position;
                let parts = area(position, a, b) + area(position, b, c) + area(position, c, a);
                assert!(parts <= area(a, b, c) + close, "{triangle}: {parts}");
                let beyond = [a, b, c].iter().map(|corner| (corner - position).norm()).fold(0.0, f64::max);
                assert!(beyond <= size * (1.0 + 1e-6), "{triangle}: {beyond} of {size}");
            }
        }
    }

    #[test]
    fn a_mesh_lies_on_itself() {
        for mesh in [TriMesh::cuboid([-0.1; 3], [0.3, 0.7, 1.1]), TriMesh::cuboid([99.9; 3], [100.1; 3])] {
            let found = from_surface(&mesh, &NearestTree::new(&mesh)).unwrap();
            assert_eq!((found.mean, found.p95, found.max), (0.0, 0.0, 0.0));
            assert_eq!(from_vertices(&mesh, &mesh).unwrap().max, 0.0);
            assert_eq!(second_differences([&mesh; 3]).unwrap().max, 0.0);
            let nothing = TriMesh::default();
            let none = [from_surface(&nothing, &NearestTree::new(&mesh)), from_vertices(&nothing, &nothing)];
            assert_eq!((none, from_surface(&mesh, &NearestTree::new(&nothing))), ([None; 2], None));
        }
    }

    #[test]
    fn points_are_weighted_by_the_area_that_they_represent() {
        // Squares in planes across y.
        let square = |x: f32, y: f32, size: f32| {
            let corners = [[x, y, 0.0], [x, y, size], [x + size, y, size], [x + size, y, 0.0]];
            TriMesh { positions: corners.map(Vec3::from).to_vec(), triangles: vec![[0, 1, 2], [0, 2, 3]] }
        };
        let plane = square(-8.0, 0.0, 16.0);
        let mut sheet = square(0.0, 0.0, 1.0);
        sheet.append(&square(2.0, 0.25, 3.0));
        // A vertex that no triangle uses.
        sheet.positions.push(Vec3::new(0.0, 100.0, 0.0));
        let found = from_surface(&sheet, &NearestTree::new(&plane)).unwrap();
        assert!((found.mean - 0.25 * 9.0 / 10.0).abs() < 1e-12, "{found:?}");
        assert_eq!((found.p95, found.max, found.max_at), (0.25, 0.25, DVec3::new(2.0, 0.25, 0.0)));
        // Here only the small square is off the plane: less than a tenth of the area.
        let mut sheet = square(0.0, 0.25, 1.0);
        sheet.append(&square(2.0, 0.0, 5.0));
        let found = from_surface(&sheet, &NearestTree::new(&plane)).unwrap();
        assert!((found.mean - 0.25 / 26.0).abs() < 1e-12, "{found:?}");
        assert_eq!((found.p95, found.max), (0.0, 0.25));
        // A slope's mean is exact: from 0 to 1 over the square.
        let mut slope = square(0.0, 0.0, 1.0);
        slope.positions[1..3].iter_mut().for_each(|position| position.y = 1.0);
        let found = from_surface(&slope, &NearestTree::new(&plane)).unwrap();
        assert!((found.mean - 0.5).abs() < 1e-12 && found.max == 1.0, "{found:?}");
    }

    #[test]
    fn second_differences_measure_jitter() {
        let at = |x: f32| {
            let mut cube = TriMesh::cuboid([x, 0.0, 0.0], [x + 1.0, 1.0, 1.0]);
            cube.positions.push(Vec3::new(x * x, 0.0, 0.0));
            cube
        };
        let even = second_differences([&at(0.0), &at(0.25), &at(0.5)]).unwrap();
        assert_eq!((even.mean, even.p95, even.max), (0.0, 0.0, 0.0));
        let jump = second_differences([&at(0.0), &at(0.25), &at(1.0)]).unwrap();
        assert_eq!((jump.mean, jump.p95, jump.max, jump.max_at.x), (0.5, 0.5, 0.5, 0.25));
        let away = from_vertices(&at(0.0), &at(0.25)).unwrap();
        assert_eq!((away.mean, away.p95, away.max), (0.25, 0.25, 0.25));
    }

    #[test]
    fn any_number_of_threads_gives_the_same_result() {
        let (mesh, other) = (litter(11, 20_000), litter(12, 3_000));
        let with = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                [(&mesh, &other), (&other, &mesh)].map(|(a, b)| from_surface(a, &NearestTree::new(b)))
            })
        };
        let one = with(1);
        assert!(one.iter().all(|found| found.is_some_and(|found| found.max > found.p95)), "{one:?}");
        assert_eq!(one, with(3));
    }
}
