//! Distances from a surface, triangle by triangle: what the library says of them is compared with these.

use frazil::geometry::spatial::bvh::Bvh;
use frazil::geometry::{DVec3, TriMesh, Vec3};
use rayon::prelude::*;

/// Distance (m) of each position from a surface. The search begins within `reach` (m), about as far as most positions are.
pub fn distances(surface: &TriMesh, positions: &[Vec3], reach: f64) -> Vec<f64> {
    let tree = Bvh::new(surface);
    let one = |position: &Vec3| {
        let at: DVec3 = position.cast();
        let mut within = reach;
        loop {
            let mut least = f64::INFINITY;
            let by = Vec3::repeat(within as f32);
            tree.in_box(position - by, position + by, |triangle| {
                least = least.min((at - closest(at, surface.corners(triangle))).norm());
            });
            if least <= within || within > 1e4 * reach {
                return least;
            }
            within *= 2.0;
        }
    };
    positions.par_iter().map(one).collect()
}

/// The position of a triangle that is nearest to a point: its own if that is above it, else the nearest one of its edges.
pub fn closest(p: DVec3, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let normal = (b - a).cross(&(c - a));
    let is_inside = [(a, b), (b, c), (c, a)].iter().all(|(u, v)| normal.cross(&(v - u)).dot(&(p - u)) >= 0.0);
    if is_inside && normal.norm_squared() > 0.0 {
        return p - normal * ((p - a).dot(&normal) / normal.norm_squared());
    }
    let on = |u: DVec3, v: DVec3| {
        let way = v - u;
        let length = way.norm_squared();
        let share = if length > 0.0 { ((p - u).dot(&way) / length).clamp(0.0, 1.0) } else { 0.0 };
        u + way * share
    };
    let edges = [on(a, b), on(b, c), on(c, a)];
    let nearest = edges.into_iter().min_by(|x, y| (p - x).norm().total_cmp(&(p - y).norm()));
    nearest.expect("three edges")
}
