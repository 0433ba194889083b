//! Solids of simple moving shapes: obstacles that are intersected with vertical lines analytically, without triangles.

use super::solids::Solid;
use crate::error::{Error, Result};
use crate::geometry::DVec3;
use crate::shallow::columns::grid::{Cells, Grid, Heights};

/// Tolerance for the axes of a cuboid, which must be perpendicular unit vectors.
const SKEW: f64 = 1e-6;

/// A solid shape (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Shape {
    /// A ball.
    Sphere {
        /// Its middle.
        centre: DVec3,
        /// Its radius.
        radius: f64,
    },
    /// All positions within a distance of a line segment.
    Capsule {
        /// The ends of the segment.
        ends: [DVec3; 2],
        /// The distance.
        radius: f64,
    },
    /// A box in any orientation.
    Cuboid {
        /// Its middle.
        centre: DVec3,
        /// Unit vectors along its edges, perpendicular to each other.
        axes: [DVec3; 3],
        /// Half of its length along each.
        half: [f64; 3],
    },
}

impl Shape {
    /// Checks the numbers.
    ///
    /// # Errors
    /// `Argument`: a position that is not finite, a length that is not positive and finite, axes that are not perpendicular unit vectors
    /// (within 1e-6).
    pub fn validate(&self) -> Result<()> {
        let (positions, lengths): (&[DVec3], &[f64]) = match self {
            Self::Sphere { centre, radius } => (std::slice::from_ref(centre), std::slice::from_ref(radius)),
            Self::Capsule { ends, radius } => (ends, std::slice::from_ref(radius)),
            Self::Cuboid { centre, half, .. } => (std::slice::from_ref(centre), half),
        };
        if let Some(position) =
            positions.iter().find(|position| !position.iter().all(|value| value.is_finite()))
        {
            let [x, y, z] = [position.x, position.y, position.z];
            return Err(Error::argument(format!("an obstacle at ({x}, {y}, {z}) is not finite")));
        }
        if let Some(length) = lengths.iter().find(|length| !(**length > 0.0 && length.is_finite())) {
            return Err(Error::argument(format!(
                "an obstacle has a length of {length} m: it must be positive and finite"
            )));
        }
        if let Self::Cuboid { axes: [a, b, c], .. } = self {
            let skew = [a.dot(a) - 1.0, b.dot(b) - 1.0, c.dot(c) - 1.0, a.dot(b), b.dot(c), c.dot(a)];
            if !skew.iter().all(|skew| skew.abs() <= SKEW) {
                return Err(Error::argument("the axes of a box are not perpendicular unit vectors"));
            }
        }
        Ok(())
    }

    /// Its middle (m).
    pub fn middle(&self) -> DVec3 {
        match self {
            Self::Sphere { centre, .. } | Self::Cuboid { centre, .. } => *centre,
            Self::Capsule { ends: [a, b], .. } => 0.5 * (a + b),
        }
    }

    /// The cells that it may cover: ranges of x and of z. Other cells contain no solid of it.
    pub fn cells(&self, grid: &Grid) -> Cells {
        let bounds = self.bounds();
        [0, 1].map(|axis| {
            let count = grid.size[axis] as f64;
            // In cells, from the centre of the first.
            let [first, last] =
                bounds[axis].map(|position| ((position - grid.origin[axis]) / grid.cell - 0.5).floor());
            let start = first.clamp(0.0, count) as usize;
            start..((last + 2.0).clamp(0.0, count) as usize).max(start)
        })
    }

    /// Minimum and maximum x, and z (m).
    fn bounds(&self) -> [[f64; 2]; 2] {
        let around = |middle: f64, reach: f64| [middle - reach, middle + reach];
        match self {
            Self::Sphere { centre, radius } => [around(centre.x, *radius), around(centre.z, *radius)],
            Self::Capsule { ends: [a, b], radius } => {
                [[a.x, b.x], [a.z, b.z]].map(|[a, b]| [a.min(b) - radius, a.max(b) + radius])
            }
            Self::Cuboid { centre, axes: [a, b, c], half } => {
                let reach =
                    |axis: usize| a[axis].abs() * half[0] + b[axis].abs() * half[1] + c[axis].abs() * half[2];
                [around(centre.x, reach(0)), around(centre.z, reach(2))]
            }
        }
    }

    /// The part of the vertical line at (x, z) inside the shape: bottom and top (m).
    pub fn interval(&self, at: [f64; 2]) -> Option<[f64; 2]> {
        match self {
            Self::Sphere { centre, radius } => {
                let [x, z] = [at[0] - centre.x, at[1] - centre.z];
                let half = root(radius * radius - (x * x + z * z))?;
                Some([centre.y - half, centre.y + half])
            }
            Self::Capsule { ends, radius } => of_capsule(ends, *radius, at),
            Self::Cuboid { centre, axes, half } => of_cuboid(centre, axes, half, at),
        }
    }

    /// The solid of the vertical line at (x, z) in units, if it is at least one unit high.
    pub fn solid(&self, at: [f64; 2], heights: &Heights) -> Option<Solid> {
        let [bottom, top] = self.interval(at)?.map(|height| heights.round(height));
        (bottom < top).then_some([bottom, top])
    }

    /// Calls `visit` with each cell (x, z) that has a solid of it, row by row along x.
    pub fn each_cell(&self, grid: &Grid, heights: &Heights, mut visit: impl FnMut([usize; 2], Solid)) {
        let [columns, rows] = self.cells(grid);
        for z in rows {
            for x in columns.clone() {
                if let Some(solid) = self.solid(grid.centre([x, z]), heights) {
                    visit([x, z], solid);
                }
            }
        }
    }
}

/// The square root; none of negative numbers.
fn root(square: f64) -> Option<f64> {
    (square >= 0.0).then(|| square.sqrt())
}

/// A sphere that moves from one end to the other sweeps the capsule. The top and the bottom of the line's part inside the capsule each lie
/// on the sphere at one of its positions.
fn of_capsule([from, to]: &[DVec3; 2], radius: f64, at: [f64; 2]) -> Option<[f64; 2]> {
    let segment = to - from;
    let [x, z] = [at[0] - from.x, at[1] - from.z];
    let square = segment.x * segment.x + segment.z * segment.z;
    if square == 0.0 {
        let half = root(radius * radius - (x * x + z * z))?;
        return Some([from.y.min(to.y) - half, from.y.max(to.y) + half]);
    }
    let length = square.sqrt();
    // Seen from above: the line's distance along the segment, and from it.
    let along = (x * segment.x + z * segment.z) / length;
    let beside = (x * segment.z - z * segment.x) / length;
    let room = radius * radius - beside * beside;
    let slant = segment.y / (square + segment.y * segment.y).sqrt();
    let reach = root(room)? * slant;
    // The top (+1) and the bottom (-1).
    let end = |side: f64| {
        let part = ((along + side * reach) / length).clamp(0.0, 1.0);
        let off = part * length - along;
        Some(from.y + part * segment.y + side * root(room - off * off)?)
    };
    Some([end(-1.0)?, end(1.0)?])
}

/// Intersects the slabs between parallel faces.
fn of_cuboid(centre: &DVec3, axes: &[DVec3; 3], half: &[f64; 3], at: [f64; 2]) -> Option<[f64; 2]> {
    let [x, z] = [at[0] - centre.x, at[1] - centre.z];
    let (mut bottom, mut top) = (f64::NEG_INFINITY, f64::INFINITY);
    for (axis, half) in axes.iter().zip(half) {
        let position = axis.x * x + axis.z * z;
        if axis.y == 0.0 {
            if position.abs() > *half {
                return None;
            }
            continue;
        }
        let ends = [(-half - position) / axis.y, (half - position) / axis.y];
        bottom = bottom.max(ends[0].min(ends[1]));
        top = top.min(ends[0].max(ends[1]));
    }
    (bottom <= top).then(|| [centre.y + bottom, centre.y + top])
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { cell: 0.05, origin: [-1.0, -1.0], size: [40, 40] };

    fn heights() -> Heights {
        Heights::between(-2.0, 2.0).unwrap()
    }

    /// A box rotated about all axes.
    fn cuboid(centre: DVec3, half: [f64; 3]) -> Shape {
        let a = DVec3::new(0.6, 0.64, 0.48);
        let b = DVec3::new(0.8, -0.48, -0.36);
        Shape::Cuboid { centre, axes: [a, b, a.cross(&b)], half }
    }

    fn shapes() -> [Shape; 7] {
        let position = DVec3::new;
        let capsule = |a: DVec3, b: DVec3, radius: f64| Shape::Capsule { ends: [a, b], radius };
        let upright = [DVec3::z(), DVec3::x(), DVec3::y()];
        [
            Shape::Sphere { centre: position(0.1, 0.2, -0.3), radius: 0.4 },
            capsule(position(-0.5, 0.1, -0.4), position(0.4, 0.6, 0.3), 0.2),
            capsule(position(0.2, -0.7, 0.1), position(0.2, 0.8, 0.1), 0.3),
            capsule(position(0.2, -0.7, 0.1), position(0.2 + 1e-9, 0.8, 0.1), 0.3),
            capsule(position(-0.9, 0.3, 0.2), position(1.3, 0.3, 0.2), 0.1),
            cuboid(position(0.1, -0.2, 0.05), [0.5, 0.2, 0.3]),
            Shape::Cuboid { centre: position(0.0, 0.5, 0.0), axes: upright, half: [0.31, 0.42, 0.53] },
        ]
    }

    fn is_within(shape: &Shape, position: DVec3) -> bool {
        match shape {
            Shape::Sphere { centre, radius } => (position - centre).norm() <= *radius,
            Shape::Capsule { ends: [a, b], radius } => {
                let part = ((position - a).dot(&(b - a)) / (b - a).dot(&(b - a))).clamp(0.0, 1.0);
                (position - (a + (b - a) * part)).norm() <= *radius
            }
            Shape::Cuboid { centre, axes, half } => {
                axes.iter().zip(half).all(|(axis, half)| axis.dot(&(position - centre)).abs() <= *half)
            }
        }
    }

    #[test]
    fn intervals_end_where_the_shape_does() {
        for shape in shapes() {
            shape.validate().unwrap();
            let mut count = 0;
            let [columns, rows] = shape.cells(&GRID);
            for z in 0..40 {
                for x in 0..40 {
                    let at = GRID.centre([x, z]);
                    let interval = shape.interval(at);
                    let within = |y: f64| is_within(&shape, DVec3::new(at[0], y, at[1]));
                    for step in 0..=80 {
                        let y = f64::from(step) * 0.05 - 2.0 + 1e-4;
                        let listed = interval.is_some_and(|[bottom, top]| (bottom..=top).contains(&y));
                        assert_eq!(listed, within(y), "{shape:?} at ({x}, {z}), {y} m: {interval:?}");
                    }
                    let Some([bottom, top]) = interval else { continue };
                    count += 1;
                    assert!(columns.contains(&x) && rows.contains(&z), "{shape:?}: ({x}, {z}) is not listed");
                    if top - bottom > 1e-6 {
                        for (inner, outer) in [(bottom + 1e-9, bottom - 1e-9), (top - 1e-9, top + 1e-9)] {
                            assert!(within(inner) && !within(outer), "{shape:?} at ({x}, {z}): {interval:?}");
                        }
                    }
                }
            }
            assert!(count > 50, "{shape:?}: {count} cells");
            assert!(columns.len() < 40 || rows.len() < 40, "{shape:?}");
        }
    }

    #[test]
    fn each_cell_of_a_shape_is_seen_once_in_units() {
        for shape in shapes() {
            let mut seen = Vec::new();
            shape.each_cell(&GRID, &heights(), |cell, solid| seen.push((GRID.index(cell), solid)));
            assert!(seen.is_sorted_by(|a, b| a.0 < b.0), "{shape:?}");
            for (index, [bottom, top]) in seen {
                let at = GRID.centre([index % 40, index / 40]);
                let units = shape.interval(at).unwrap().map(|height| heights().round(height));
                assert!(bottom < top && units == [bottom, top], "{shape:?}: cell {index}");
            }
        }
        let above = Shape::Sphere { centre: DVec3::new(0.0, 9.0, 0.0), radius: 1.0 };
        above.each_cell(&GRID, &heights(), |cell, _| panic!("{cell:?} is below it"));
        let beside = Shape::Sphere { centre: DVec3::new(9.0, 0.0, -7.0), radius: 1.0 };
        assert_eq!(beside.cells(&GRID).map(|range| range.len()), [0, 0]);
    }

    #[test]
    fn mirrored_and_turned_shapes_have_the_same_bits() {
        let change = |shape: &Shape, change: fn(&DVec3) -> DVec3| match shape {
            Shape::Sphere { centre, radius } => Shape::Sphere { centre: change(centre), radius: *radius },
            Shape::Capsule { ends: [a, b], radius } => {
                Shape::Capsule { ends: [change(a), change(b)], radius: *radius }
            }
            Shape::Cuboid { centre, axes: [a, b, c], half } => {
                Shape::Cuboid { centre: change(centre), axes: [change(a), change(b), change(c)], half: *half }
            }
        };
        let bits = |interval: Option<[f64; 2]>| interval.map(|ends| ends.map(f64::to_bits));
        for shape in shapes() {
            let mirrored = change(&shape, |p| DVec3::new(-p.x, p.y, p.z));
            let turned = change(&shape, |p| DVec3::new(p.z, p.y, -p.x));
            for n in 0..400 {
                let [x, z] = [f64::from(n % 20) * 0.0917 - 0.9, f64::from(n / 20) * 0.0873 - 0.8];
                let expected = bits(shape.interval([x, z]));
                assert_eq!(bits(mirrored.interval([-x, z])), expected, "{shape:?} at ({x}, {z}) mirrored");
                assert_eq!(bits(turned.interval([z, -x])), expected, "{shape:?} at ({x}, {z}) turned");
            }
        }
    }

    #[test]
    fn bad_shapes_are_a_sentence() {
        let message = |shape: Shape| shape.validate().unwrap_err().to_string();
        let centre = DVec3::new(0.0, f64::NAN, 1.0);
        assert_eq!(
            message(Shape::Sphere { centre, radius: 1.0 }),
            "an obstacle at (0, NaN, 1) is not finite"
        );
        let ends = [DVec3::zeros(), DVec3::x()];
        assert_eq!(
            message(Shape::Capsule { ends, radius: 0.0 }),
            "an obstacle has a length of 0 m: it must be positive and finite"
        );
        let axes = [DVec3::x(), DVec3::y(), DVec3::y()];
        let skewed = Shape::Cuboid { centre: DVec3::zeros(), axes, half: [1.0; 3] };
        assert_eq!(message(skewed), "the axes of a box are not perpendicular unit vectors");
    }
}
