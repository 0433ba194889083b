//! Open fractions of faces, from signed distances at their corners: a face is cut by the straight line through the zeros on its edges
//! (Batty, Bertails and Bridson 2007, section 5.1).

/// Open fraction below which a face counts as closed: flow through so small a gap is not resolved, and would make the pressure
/// ill-conditioned.
const MIN_OPEN: f32 = 0.05;

/// Open fraction of a square face with these signed distances (negative inside a solid) at its corners, in the order of two nested loops.
pub fn open(corners: [f32; 4]) -> f32 {
    let [a, b, c, d] = corners;
    let (min, max) = (a.min(b).min(c.min(d)), a.max(b).max(c.max(d)));
    match (min >= 0.0, max < 0.0) {
        (true, _) => 1.0,
        (_, true) => 0.0,
        _ => cut([a, b, d, c]),
    }
}

/// The open fraction of a face that a surface cuts, from its corners in cyclic order.
fn cut(ring: [f32; 4]) -> f32 {
    let inside = ring.iter().filter(|x| **x < 0.0).count();
    // The fraction of an edge on the side of its first end.
    let part = |from: f32, to: f32| from / (from - to);
    let first = |wanted: bool| {
        (0..4).find(|at| (ring[*at] < 0.0) == wanted && (ring[(at + 3) % 4] < 0.0) != wanted).unwrap_or(0)
    };
    let at = |index: usize| ring[index % 4];
    let closed = match inside {
        1 => {
            let corner = first(true);
            0.5 * part(at(corner), at(corner + 1)) * part(at(corner), at(corner + 3))
        }
        3 => {
            let corner = first(false);
            1.0 - 0.5 * part(at(corner), at(corner + 1)) * part(at(corner), at(corner + 3))
        }
        // Opposite corners: both are cut off.
        _ if (ring[0] < 0.0) == (ring[2] < 0.0) => {
            let corner = first(true);
            let one =
                |corner: usize| 0.5 * part(at(corner), at(corner + 1)) * part(at(corner), at(corner + 3));
            one(corner) + one(corner + 2)
        }
        _ => {
            let corner = first(true);
            0.5 * (part(at(corner + 1), at(corner + 2)) + part(at(corner), at(corner + 3)))
        }
    };
    if 1.0 - closed < MIN_OPEN { 0.0 } else { 1.0 - closed }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plane_cuts_off_what_lies_behind_it() {
        for turn in 0..64 {
            let angle = f64::from(turn) * std::f64::consts::TAU / 64.0;
            let (sine, cosine) = libm::sincos(angle);
            for step in -8..=8 {
                let off = f64::from(step) * 0.11;
                let distance = |x: f64, y: f64| (x - 0.5) * cosine + (y - 0.5) * sine + off;
                let corners = [(0.0, 0.0), (0.0, 1.0), (1.0, 0.0), (1.0, 1.0)];
                let open = open(corners.map(|(x, y)| distance(x, y) as f32));
                const FINE: i32 = 200;
                let middle = |at: i32| (f64::from(at) + 0.5) / f64::from(FINE);
                let cells = (0..FINE).flat_map(|x| (0..FINE).map(move |y| (middle(x), middle(y))));
                let free = cells.filter(|(x, y)| distance(*x, *y) > 0.0).count();
                let wanted = free as f64 / f64::from(FINE * FINE);
                let is_closed = open == 0.0 && wanted < f64::from(MIN_OPEN) + 0.012;
                let is_near = (f64::from(open) - wanted).abs() < 0.012;
                assert!(is_near || is_closed, "{turn} {step}: {open} {wanted}");
            }
        }
    }

    #[test]
    fn a_saddle_keeps_its_middle() {
        assert_eq!(open([-1.0, 1.0, 1.0, -1.0]), 0.75);
        assert_eq!(open([1.0, -1.0, -1.0, 1.0]), 0.75);
        assert_eq!(open([-1.0; 4]), 0.0);
        assert_eq!(open([1.0; 4]), 1.0);
    }
}
