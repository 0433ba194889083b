//! Transforms of prims that are read (USD's schema Xformable): the product of the operations in `xformOpOrder`, the last of which is applied
//! to a point first, and of the transforms of the parent prims.

use std::collections::HashMap;

use nalgebra::{Matrix3, Matrix4, Quaternion, UnitQuaternion};

use super::binary::{Crate, ReadPrim};
use crate::geometry::DVec3;
use crate::io::files::source::Parsed;

/// From the space of a prim to that of the layer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Transform(Matrix4<f64>);

/// The transforms of all prims by path, or why one cannot be read.
pub(super) type Transforms = HashMap<String, Parsed<Transform>>;

/// Names an operation that is to be inverted.
const INVERSE: &str = "!invert!";
/// First in the order of a prim that ignores the transforms of its parents.
const RESET: &str = "!resetXformStack!";
/// Namespace of operations.
const OPERATION: &str = "xformOp:";

impl Transform {
    /// A point in the layer's space.
    pub fn point(&self, point: DVec3) -> DVec3 {
        self.vector(point) + self.0.fixed_view::<3, 1>(0, 3)
    }

    /// A velocity in the layer's space, without the motion of an animated transform.
    pub fn vector(&self, vector: DVec3) -> DVec3 {
        self.linear() * vector
    }

    /// Whether it mirrors: faces that are counter-clockwise seen from outside become clockwise.
    pub fn mirrors(&self) -> bool {
        self.linear().determinant() < 0.0
    }

    /// By how much it scales lengths: the geometric mean, if directions differ.
    pub fn scale(&self) -> f64 {
        libm::cbrt(self.linear().determinant().abs())
    }

    fn linear(&self) -> Matrix3<f64> {
        self.0.fixed_view::<3, 3>(0, 0).into_owned()
    }
}

/// The transforms of all prims of a crate.
pub(super) fn of_all(data: &Crate<'_>) -> Transforms {
    let mut all = Transforms::new();
    // Parents come first.
    for prim in data.prims() {
        let parent = prim.path.rsplit_once('/').and_then(|(parent, _)| all.get(parent));
        let parent = parent.cloned().unwrap_or(Ok(Transform(Matrix4::identity())));
        all.insert(prim.path.clone(), of_prim(data, prim, parent));
    }
    all
}

fn of_prim(data: &Crate<'_>, prim: &ReadPrim, parent: Parsed<Transform>) -> Parsed<Transform> {
    let order = prim.attribute("xformOpOrder").map_or(Ok(Vec::new()), |order| data.words(order))?;
    let resets = order.first().is_some_and(|first| first == RESET);
    let mut matrix = if resets { Matrix4::identity() } else { parent?.0 };
    for name in &order[usize::from(resets)..] {
        matrix *= operation(data, prim, name)?;
    }
    let is_finite = matrix.iter().all(|number| number.is_finite());
    if is_finite {
        Ok(Transform(matrix))
    } else {
        Err(format!("the transform of {} is not finite", prim.path))
    }
}

/// The matrix of an operation of `xformOpOrder`.
fn operation(data: &Crate<'_>, prim: &ReadPrim, name: &str) -> Parsed<Matrix4<f64>> {
    let (name, is_inverse) = name.strip_prefix(INVERSE).map_or((name, false), |name| (name, true));
    let numbers = prim.attribute(name).map_or(Ok(None), |attribute| data.numbers(attribute))?;
    let kind = name.strip_prefix(OPERATION).and_then(|name| name.split(':').next());
    let matrix = kind.zip(numbers).and_then(|(kind, numbers)| matrix(kind, &numbers));
    let matrix = matrix.ok_or_else(|| format!("the transform `{name}` of {} cannot be read", prim.path))?;
    if !is_inverse {
        return Ok(matrix);
    }
    matrix.try_inverse().ok_or_else(|| format!("the transform `{name}` of {} has no inverse", prim.path))
}

/// The matrix of an operation with these numbers; none for an unknown one, or other numbers than it has.
fn matrix(kind: &str, numbers: &[f64]) -> Option<Matrix4<f64>> {
    if let Some(axes) = kind.strip_prefix("rotate") {
        return rotation(axes, numbers);
    }
    Some(match (kind, numbers) {
        ("translate", [x, y, z]) => Matrix4::new_translation(&DVec3::new(*x, *y, *z)),
        ("scale", [x, y, z]) => Matrix4::new_nonuniform_scaling(&DVec3::new(*x, *y, *z)),
        ("orient", [i, j, k, real]) => {
            UnitQuaternion::try_new(Quaternion::new(*real, *i, *j, *k), 0.0)?.to_homogeneous()
        }
        // USD multiplies rows by matrices, so that its rows are columns here. A projection is refused.
        ("transform", [_, _, _, 0.0, _, _, _, 0.0, _, _, _, 0.0, _, _, _, 1.0]) => {
            Matrix4::from_column_slice(numbers)
        }
        _ => return None,
    })
}

/// Rotations around these axes by these angles (degrees), the first axis first.
fn rotation(axes: &str, degrees: &[f64]) -> Option<Matrix4<f64>> {
    const ORDERS: [&str; 9] = ["X", "Y", "Z", "XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX"];
    if !ORDERS.contains(&axes) || degrees.len() != axes.len() {
        return None;
    }
    let around = |axis: char| {
        // Three angles are those around x, y and z in any order of rotations.
        let index = "XYZ".find(axis)?;
        let half = degrees.get(index).or(degrees.first())?.to_radians() / 2.0;
        let along = DVec3::ith(index, libm::sin(half));
        let quaternion = Quaternion::from_parts(libm::cos(half), along);
        Some(UnitQuaternion::new_unchecked(quaternion).to_homogeneous())
    };
    axes.chars().try_fold(Matrix4::identity(), |before, axis| Some(around(axis)? * before))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn moved(kind: &str, numbers: &[f64], point: [f64; 3]) -> [f64; 3] {
        let moved = Transform(matrix(kind, numbers).unwrap()).point(point.into());
        moved.map(|part| (part * 1e9).round() / 1e9).into()
    }

    #[test]
    fn operations_are_those_of_usd() {
        assert_eq!(moved("translate", &[1.0, 2.0, 3.0], [0.5; 3]), [1.5, 2.5, 3.5]);
        assert_eq!(moved("scale", &[1.0, 2.0, -3.0], [1.0; 3]), [1.0, 2.0, -3.0]);
        assert_eq!(moved("rotateZ", &[90.0], [1.0, 0.0, 0.0]), [0.0, 1.0, 0.0]);
        // Around x first: y becomes z, which a rotation around z leaves.
        assert_eq!(moved("rotateXYZ", &[90.0, 0.0, 90.0], [0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
        assert_eq!(moved("rotateZYX", &[90.0, 0.0, 90.0], [0.0, 1.0, 0.0]), [-1.0, 0.0, 0.0]);
        let half = 0.5f64.sqrt();
        assert_eq!(moved("orient", &[half, 0.0, 0.0, half], [0.0, 1.0, 0.0]), [0.0, 0.0, 1.0]);
        let rows = [0.0, 1.0, 0.0, 0.0, -1.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 5.0, 6.0, 7.0, 1.0];
        assert_eq!(moved("transform", &rows, [1.0, 0.0, 0.0]), [5.0, 7.0, 7.0]);
        let refused = [
            ("translate", &[1.0][..]),
            ("rotateXX", &[1.0, 1.0]),
            ("shear", &[1.0; 3]),
            ("transform", &[1.0; 16]),
        ];
        for (kind, numbers) in refused {
            assert_eq!(matrix(kind, numbers), None, "{kind}");
        }
        let transform = |kind, numbers: &[f64]| Transform(matrix(kind, numbers).unwrap());
        assert!(transform("scale", &[1.0, -1.0, 1.0]).mirrors());
        assert!((transform("scale", &[2.0, 4.0, 8.0]).scale() - 4.0).abs() < 1e-12);
    }
}
