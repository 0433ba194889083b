//! How two triangles meet, decided by exact signs, without rounding or tolerance.
//!
//! The cases are those of P. Guigue and O. Devillers, *Fast and Robust Triangle-Triangle Overlap Test Using Orientation Predicates*
//! (Journal of Graphics Tools 8, 2003), extended to common corners and edges. Two triangles whose planes differ meet along the line where
//! the planes do; the orientations of sets of four points give the order of both triangles' ends on it.

use super::predicates::{orient2d, orient3d};
use crate::geometry::Vec3;

/// How two triangles meet outside the corners, or the edge, that they have in common.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Meeting {
    /// Nowhere.
    Apart,
    /// In points that are inside at most one of them: a corner on a face, an edge across an edge.
    Touch,
    /// In one plane, over an area.
    Overlap,
    /// Through each other: at an angle, in points that are inside both.
    Cross,
}

type Triangle = [Vec3; 3];

/// How two triangles meet. Corners at the same position are common; both triangles must have an area ([`super::predicates::is_flat`]) and
/// finite coordinates.
pub fn meeting(first: &[Vec3; 3], second: &[Vec3; 3]) -> Meeting {
    let common = first.map(|corner| second.iter().position(|other| *other == corner));
    match common {
        [None, None, None] => without_corner(first, second),
        [Some(at), None, None] => at_corner(first, &rotated_to(second, at)),
        [None, Some(at), None] => at_corner(&rotated_to(first, 1), &rotated_to(second, at)),
        [None, None, Some(at)] => at_corner(&rotated_to(first, 2), &rotated_to(second, at)),
        [Some(_), Some(_), None] => along_edge(first, second),
        [None, Some(_), Some(_)] => along_edge(&rotated_to(first, 1), second),
        [Some(_), None, Some(_)] => along_edge(&rotated_to(first, 2), second),
        [Some(_), Some(_), Some(_)] => Meeting::Overlap,
    }
}

/// The triangle rotated to begin with another corner.
fn rotated_to(triangle: &Triangle, corner: usize) -> Triangle {
    [0, 1, 2].map(|next| triangle[(corner + next) % 3])
}

/// Triangles with a common edge, the first two corners of `first`: they overlap if folded onto each other along it.
fn along_edge(first: &Triangle, second: &Triangle) -> Meeting {
    let [a, b, c] = *first;
    let Some(&apex) = second.iter().find(|corner| !first.contains(corner)) else { return Meeting::Overlap };
    let folded = View::of(first).turn(a, b, apex) >= 0 && orient3d(a, b, c, apex) == 0;
    if folded { Meeting::Overlap } else { Meeting::Apart }
}

/// Triangles whose first corner is common.
fn at_corner(first: &Triangle, second: &Triangle) -> Meeting {
    let view = View::of(first);
    if !wedges_meet(view, first, second) {
        return Meeting::Apart;
    }
    let ([v, a, b], [_, c, d]) = (*first, *second);
    let on_first = [orient3d(v, a, b, c), orient3d(v, a, b, d)];
    if on_first == [0, 0] {
        return if areas_meet(view, first, second) { Meeting::Overlap } else { Meeting::Touch };
    }
    let on_second = [orient3d(v, c, d, a), orient3d(v, c, d, b)];
    if one_sided(&on_first) || one_sided(&on_second) {
        return Meeting::Apart;
    }
    // Each covers an interval of the common line that begins at the corner: in the same direction, or in opposite ones.
    if (on_first[0] - on_first[1]) * (on_second[0] - on_second[1]) > 0 {
        return Meeting::Apart;
    }
    if straddles(&on_first) && straddles(&on_second) { Meeting::Cross } else { Meeting::Touch }
}

/// Triangles without a common corner.
fn without_corner(first: &Triangle, second: &Triangle) -> Meeting {
    let view = View::of(first);
    if is_separated(view, first, second, -1) || is_separated(View::of(second), second, first, -1) {
        return Meeting::Apart;
    }
    let on_first = sides(first, second);
    if one_sided(&on_first) {
        return Meeting::Apart;
    }
    if on_first == [0, 0, 0] {
        return if areas_meet(view, first, second) { Meeting::Overlap } else { Meeting::Touch };
    }
    let on_second = sides(second, first);
    if one_sided(&on_second) {
        return Meeting::Apart;
    }
    // Each covers an interval of the common line, between the two edges that leave its lone corner.
    let ([p, p1, p2], [q, q1, q2]) = (rotated_to(first, lone(on_second)), rotated_to(second, lone(on_first)));
    let order = [[p1, q1], [p1, q2], [p2, q1], [p2, q2]].map(|[end, other]| orient3d(p, end, q, other));
    if one_sided(&order) {
        return Meeting::Apart;
    }
    let through = straddles(&order) && straddles(&on_first) && straddles(&on_second);
    if through { Meeting::Cross } else { Meeting::Touch }
}

/// On which sides of a triangle's plane the corners of another lie.
fn sides([a, b, c]: &Triangle, other: &Triangle) -> [i32; 3] {
    other.map(|corner| orient3d(*a, *b, *c, corner))
}

fn one_sided(signs: &[i32]) -> bool {
    signs.iter().all(|&sign| sign > 0) || signs.iter().all(|&sign| sign < 0)
}

fn straddles(signs: &[i32]) -> bool {
    signs.contains(&1) && signs.contains(&-1)
}

/// The corner that lies alone on its side of the plane.
fn lone(signs: [i32; 3]) -> usize {
    let apart = |&corner: &usize| {
        let [a, b] = [signs[(corner + 1) % 3], signs[(corner + 2) % 3]];
        signs[corner] > a.max(b) || signs[corner] < a.min(b)
    };
    (0..3).find(apart).unwrap_or(0)
}

/// Two axes along which a triangle appears counter-clockwise, with an area.
#[derive(Clone, Copy)]
struct View(usize, usize);

impl View {
    fn of(triangle: &Triangle) -> Self {
        let [a, b, c] = *triangle;
        let normal = (b - a).cast::<f64>().cross(&(c - a).cast::<f64>());
        // Any view in which the triangle has an area will do; the one with the largest area decides most cases without exact sums.
        for next in 0..3 {
            let axis = (normal.iamax() + next) % 3;
            let view = Self((axis + 1) % 3, (axis + 2) % 3);
            match view.turn(a, b, c) {
                0 => {}
                1.. => return view,
                _ => return Self(view.1, view.0),
            }
        }
        Self(0, 1)
    }

    fn turn(self, a: Vec3, b: Vec3, c: Vec3) -> i32 {
        let [a, b, c] = [a, b, c].map(|p| [p[self.0], p[self.1]]);
        orient2d(a, b, c)
    }
}

/// Whether, in a view that shows `triangle` counter-clockwise, the line of one of its edges separates it from another: strictly (`max_turn`
/// is -1), or with corners on the line (0).
fn is_separated(view: View, triangle: &Triangle, other: &Triangle, max_turn: i32) -> bool {
    (0..3).any(|edge| {
        let (a, b) = (triangle[edge], triangle[(edge + 1) % 3]);
        other.iter().all(|&corner| view.turn(a, b, corner) <= max_turn)
    })
}

/// Whether coplanar triangles overlap in an area.
fn areas_meet(view: View, first: &Triangle, second: &Triangle) -> bool {
    let second = counter_clockwise(view, second);
    !is_separated(view, first, &second, 0) && !is_separated(view, &second, first, 0)
}

fn counter_clockwise(view: View, triangle: &Triangle) -> Triangle {
    let [a, b, c] = *triangle;
    if view.turn(a, b, c) < 0 { [a, c, b] } else { [a, b, c] }
}

/// Whether, in a view of the first, the wedges that two triangles span at their common first corner share more than that corner. If not,
/// the triangles do not meet, whatever their planes.
fn wedges_meet(view: View, first: &Triangle, second: &Triangle) -> bool {
    let [v, a, b] = *first;
    let [_, c, d] = counter_clockwise(view, second);
    let within = |a: Vec3, b: Vec3, point: Vec3| view.turn(v, a, point) >= 0 && view.turn(v, point, b) >= 0;
    // A second triangle seen edge-on is two rays.
    within(a, b, c) || within(a, b, d) || (view.turn(v, c, d) != 0 && (within(c, d, a) || within(c, d, b)))
}

#[cfg(test)]
mod tests {
    use super::*;

    type Whole = [i64; 3];

    fn minus(a: Whole, b: Whole) -> Whole {
        [0, 1, 2].map(|axis| a[axis] - b[axis])
    }

    fn cross(a: Whole, b: Whole) -> Whole {
        [(1, 2), (2, 0), (0, 1)].map(|(y, z)| a[y] * b[z] - a[z] * b[y])
    }

    fn dot(a: Whole, b: Whole) -> i64 {
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
    }

    fn normal([a, b, c]: [Whole; 3]) -> Whole {
        cross(minus(b, a), minus(c, a))
    }

    /// Whether a plane separates two triangles, which may be edges: `strictly`, or so that their interiors have no common point. If any
    /// plane does, one of finitely many directions does.
    fn is_parted(first: [Whole; 3], second: [Whole; 3], strictly: bool) -> bool {
        let edges = |t: [Whole; 3]| [minus(t[1], t[0]), minus(t[2], t[1]), minus(t[0], t[2])];
        let (of_first, of_second) = (edges(first), edges(second));
        let normals = [normal(first), normal(second)];
        let mut directions = normals.to_vec();
        directions.extend(of_first.iter().flat_map(|&e| of_second.map(|f| cross(e, f))));
        for &edge in of_first.iter().chain(&of_second) {
            directions.extend(normals.map(|normal| cross(normal, edge)));
        }
        let range = |direction: Whole, t: [Whole; 3]| {
            let along = t.map(|corner| dot(direction, corner));
            (along.iter().copied().min().unwrap(), along.iter().copied().max().unwrap())
        };
        directions.into_iter().filter(|direction| *direction != [0; 3]).any(|direction| {
            let (a, b) = (range(direction, first), range(direction, second));
            let flat = a.0 == a.1 && a == b;
            if strictly { a.1 < b.0 || b.1 < a.0 } else { !flat && (a.1 <= b.0 || b.1 <= a.0) }
        })
    }

    /// The definition, by separating planes.
    fn by_planes(first: [Whole; 3], second: [Whole; 3]) -> Meeting {
        let is_flat = second.iter().all(|&corner| dot(normal(first), minus(corner, first[0])) == 0);
        if !is_parted(first, second, false) {
            return if is_flat { Meeting::Overlap } else { Meeting::Cross };
        }
        let common: Vec<Whole> = first.into_iter().filter(|corner| second.contains(corner)).collect();
        let opposite = |t: [Whole; 3]| {
            let others: Vec<Whole> = t.into_iter().filter(|corner| *corner != common[0]).collect();
            [others[0], others[1], others[1]]
        };
        let apart = match common.len() {
            0 => is_parted(first, second, true),
            1 => is_parted(opposite(first), second, true) && is_parted(first, opposite(second), true),
            _ => true,
        };
        if apart { Meeting::Apart } else { Meeting::Touch }
    }

    #[test]
    fn triangles_of_a_coarse_lattice_meet_as_the_definition_says() {
        let mut state = 11u64;
        let mut below = |count: u64| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) % count
        };
        let mut seen = [0; 4];
        for round in 0..24_000u64 {
            let size = [2, 3, 4, 6][round as usize % 4];
            let mut point = || [below(size) as i64, below(size) as i64, below(size) as i64];
            let first = [point(), point(), point()];
            let mut second = [point(), point(), point()];
            for corner in 0..round as usize % 3 {
                second[(corner + below(2) as usize) % 3] = first[below(3) as usize];
            }
            if normal(first) == [0; 3] || normal(second) == [0; 3] {
                continue;
            }
            let floats = |t: [Whole; 3]| t.map(|p| Vec3::from(p.map(|x| x as f32)));
            let (got, want) = (meeting(&floats(first), &floats(second)), by_planes(first, second));
            assert_eq!(got, want, "{first:?} {second:?}");
            assert_eq!(meeting(&floats(second), &floats(first)), want, "{second:?} {first:?}");
            seen[want as usize] += 1;
        }
        assert!(seen.iter().all(|&count| count > 100), "{seen:?}");
    }

    #[test]
    fn one_step_of_a_coordinate_decides() {
        // An edge of the second ends below, on or above the first, whose plane is x + y + z = 1.
        let plane = [Vec3::x(), Vec3::y(), Vec3::z()];
        let tip = |z: f32| [Vec3::new(0.25, 0.25, z), Vec3::new(1.0, 1.0, 1.0), Vec3::new(1.0, 1.5, 1.0)];
        let at = |z: f32| meeting(&plane, &tip(z));
        assert_eq!(at(0.5f32.next_down()), Meeting::Cross);
        assert_eq!((at(0.5), at(0.5f32.next_up())), (Meeting::Touch, Meeting::Apart));
        // With a common corner.
        let flat = [Vec3::zeros(), Vec3::new(2.0, -1.0, 0.0), Vec3::new(2.0, 1.0, 0.0)];
        let at = |z: f32| meeting(&flat, &[Vec3::zeros(), Vec3::new(1.0, 0.0, 1.0), Vec3::new(1.0, 0.0, z)]);
        let least = f32::from_bits(1);
        assert_eq!((at(-least), at(0.0), at(least)), (Meeting::Cross, Meeting::Touch, Meeting::Apart));
        // With a common edge.
        let leaning = [Vec3::zeros(), Vec3::y(), Vec3::new(1.0, 0.25, 1.0)];
        let at = |z: f32| meeting(&leaning, &[Vec3::y(), Vec3::zeros(), Vec3::new(1.0, 0.5, z)]);
        assert_eq!((at(1f32.next_down()), at(1f32.next_up())), (Meeting::Apart, Meeting::Apart));
        assert_eq!((at(1.0), at(-1.0)), (Meeting::Overlap, Meeting::Apart));
    }
}
