//! Point clouds: snow grains and other particles.

use super::DVec3;
use crate::error::{Error, Result, fail_if};

/// A point cloud. Positions are split into a voxel and an offset within it, as VDB Points stores them: they keep the same
/// resolution however far they lie from the origin, and pass through a file bit for bit.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Points {
    /// Edge of a voxel (m), above 0.
    pub voxel_size: f64,
    /// The voxel of each point; voxel (i, j, k) has its centre at (i, j, k) x `voxel_size`.
    pub cells: Vec<[i32; 3]>,
    /// The position of each point relative to the centre of its voxel (voxels), from -0.5 to 0.5.
    pub offsets: Vec<[f32; 3]>,
    /// Other data of the points; no two attributes have the same name.
    pub attributes: Vec<Attribute>,
}

/// A named property of points.
#[derive(Debug, Clone, PartialEq)]
pub struct Attribute {
    /// Name, not empty; `P` stands for the position and cannot be one.
    pub name: String,
    /// Values.
    pub values: Values,
}

/// The values of an attribute.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// 32-bit floats.
    Float(Column<f32>),
    /// 32-bit integers.
    Int(Column<i32>),
    /// 64-bit integers.
    Long(Column<i64>),
    /// Booleans.
    Bool(Column<bool>),
    /// Vectors of three 32-bit floats.
    Vector(Column<[f32; 3]>),
}

/// Values of one type.
#[derive(Debug, Clone, PartialEq)]
pub enum Column<T> {
    /// One value for each point.
    Each(Vec<T>),
    /// One value shared by all points; it takes no space in a file.
    Uniform(T),
}

impl<T: Copy> Column<T> {
    /// The value of a point.
    ///
    /// # Panics
    /// When there is no such point.
    pub fn get(&self, point: usize) -> T {
        match self {
            Self::Each(values) => values[point],
            Self::Uniform(value) => *value,
        }
    }

    /// The stored values: one for each point, or one.
    pub fn stored(&self) -> &[T] {
        match self {
            Self::Each(values) => values,
            Self::Uniform(value) => std::slice::from_ref(value),
        }
    }

    /// As [`Self::stored`], mutable.
    pub fn stored_mut(&mut self) -> &mut [T] {
        match self {
            Self::Each(values) => values,
            Self::Uniform(value) => std::slice::from_mut(value),
        }
    }

    fn count(&self) -> Option<usize> {
        match self {
            Self::Each(values) => Some(values.len()),
            Self::Uniform(_) => None,
        }
    }

    fn reorder(&mut self, order: &[u32]) {
        if let Self::Each(values) = self {
            *values = picked(values, order);
        }
    }
}

impl<T: Copy + PartialEq> Column<T> {
    /// Appends the values of other points; the counts are of both sets of points.
    fn append(&mut self, other: &Self, [own, others]: [usize; 2]) {
        if self == other && matches!(self, Self::Uniform(_)) {
            return;
        }
        let all = (0..own).map(|point| self.get(point)).chain((0..others).map(|point| other.get(point)));
        *self = Self::Each(all.collect());
    }
}

/// Runs the same code on the column of each type.
macro_rules! each_type {
    ($values:expr, $column:ident => $what:expr) => {
        match $values {
            Values::Float($column) => $what,
            Values::Int($column) => $what,
            Values::Long($column) => $what,
            Values::Bool($column) => $what,
            Values::Vector($column) => $what,
        }
    };
}

impl Values {
    /// The type's name in OpenVDB: `float`, `int32`, `int64`, `bool` or `vec3s`.
    pub fn type_name(&self) -> &'static str {
        match self {
            Self::Float(_) => "float",
            Self::Int(_) => "int32",
            Self::Long(_) => "int64",
            Self::Bool(_) => "bool",
            Self::Vector(_) => "vec3s",
        }
    }

    /// Reorders the values of points, or drops some.
    ///
    /// # Panics
    /// If `order` names a point that does not exist.
    pub fn reorder(&mut self, order: &[u32]) {
        each_type!(self, column => column.reorder(order));
    }

    /// Whether all points share one value.
    pub fn is_uniform(&self) -> bool {
        each_type!(self, column => column.count().is_none())
    }

    /// Minimum and maximum, component by component; `bool` counts as 0 and 1. `None` without values.
    pub fn range(&self) -> Option<(Vec<f64>, Vec<f64>)> {
        fn of<T: Copy, const N: usize>(
            column: &Column<T>,
            numbers: impl Fn(T) -> [f64; N],
        ) -> Option<(Vec<f64>, Vec<f64>)> {
            let first = numbers(*column.stored().first()?);
            let (mut low, mut high) = (first, first);
            for value in column.stored() {
                let value = numbers(*value);
                for n in 0..N {
                    low[n] = low[n].min(value[n]);
                    high[n] = high[n].max(value[n]);
                }
            }
            Some((low.to_vec(), high.to_vec()))
        }
        match self {
            Self::Float(column) => of(column, |value| [f64::from(value)]),
            Self::Int(column) => of(column, |value| [f64::from(value)]),
            Self::Long(column) => of(column, |value| [value as f64]),
            Self::Bool(column) => of(column, |value| [f64::from(u8::from(value))]),
            Self::Vector(column) => of(column, |value| value.map(f64::from)),
        }
    }

    /// The value of a point as a number: the length of a vector, 0 or 1 for `bool`.
    ///
    /// # Panics
    /// When there is no such point.
    pub fn number(&self, point: usize) -> f64 {
        match self {
            Self::Float(column) => column.get(point).into(),
            Self::Int(column) => column.get(point).into(),
            Self::Long(column) => column.get(point) as f64,
            Self::Bool(column) => u8::from(column.get(point)).into(),
            Self::Vector(column) => DVec3::from(column.get(point).map(f64::from)).norm(),
        }
    }

    /// The first point whose value is not finite.
    fn first_not_finite(&self) -> Option<usize> {
        match self {
            Self::Float(column) => column.stored().iter().position(|value| !value.is_finite()),
            Self::Vector(column) => {
                column.stored().iter().position(|value| value.iter().any(|part| !part.is_finite()))
            }
            _ => None,
        }
    }
}

impl Points {
    /// Points at world positions (m), without attributes; each gets the voxel whose centre is nearest.
    ///
    /// # Errors
    /// A voxel size that is not a positive number; a position that is not finite, or farther from the origin than 2^31
    /// voxels.
    pub fn at(voxel_size: f64, positions: &[DVec3]) -> Result<Self> {
        check_voxel(voxel_size)?;
        let limit = f64::from(i32::MAX);
        let split = |(point, position): (usize, &DVec3)| -> Result<([i32; 3], [f32; 3])> {
            let index = position / voxel_size;
            let cell = index.map(f64::round);
            // Negated to refuse NaN too.
            if !cell.iter().all(|part| part.abs() < limit) {
                let what = format!("point {} is not finite, or too far from the origin", point + 1);
                return Err(Error::argument(what));
            }
            Ok((cell.map(|part| part as i32).into(), (index - cell).map(|part| part as f32).into()))
        };
        let (cells, offsets) =
            positions.iter().enumerate().map(split).collect::<Result<(Vec<_>, Vec<_>)>>()?;
        Ok(Self { voxel_size, cells, offsets, attributes: Vec::new() })
    }

    /// Number of points.
    pub fn count(&self) -> usize {
        self.cells.len()
    }

    /// World position (m) of a point.
    ///
    /// # Panics
    /// When there is no such point.
    pub fn position(&self, point: usize) -> DVec3 {
        let (cell, offset) = (self.cells[point], self.offsets[point]);
        DVec3::from([0, 1, 2].map(|axis| f64::from(cell[axis]) + f64::from(offset[axis]))) * self.voxel_size
    }

    /// Minimum and maximum corner (m) of the points' positions; `None` without points.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        let positions = (0..self.count()).map(|point| self.position(point));
        positions.map(|position| (position, position)).reduce(|a, b| (a.0.inf(&b.0), a.1.sup(&b.1)))
    }

    /// The values of the attribute of this name.
    pub fn attribute(&self, name: &str) -> Option<&Values> {
        self.attributes.iter().find(|attribute| attribute.name == name).map(|attribute| &attribute.values)
    }

    /// Adds an attribute, or replaces the values of the one with this name.
    pub fn set(&mut self, name: &str, values: Values) {
        match self.attributes.iter_mut().find(|attribute| attribute.name == name) {
            Some(attribute) => attribute.values = values,
            None => self.attributes.push(Attribute { name: name.into(), values }),
        }
    }

    /// Reorders the points: point `order[n]` becomes point `n`.
    ///
    /// # Panics
    /// If `order` names a point that does not exist.
    pub fn reorder(&mut self, order: &[u32]) {
        self.cells = picked(&self.cells, order);
        self.offsets = picked(&self.offsets, order);
        for attribute in &mut self.attributes {
            attribute.values.reorder(order);
        }
    }

    /// Appends other points with the same attributes and voxel size; if there are no points yet, the others replace everything. A value that
    /// all points share stays uniform.
    ///
    /// # Errors
    /// Different attributes or voxels; the points are then unchanged.
    pub fn append(&mut self, other: Self) -> Result<()> {
        if other.count() == 0 {
            return Ok(());
        }
        if self.count() == 0 {
            *self = other;
            return Ok(());
        }
        let is_alike = |(a, b): (&Attribute, &Attribute)| {
            a.name == b.name && a.values.type_name() == b.values.type_name()
        };
        let are_alike = self.attributes.len() == other.attributes.len()
            && self.attributes.iter().zip(&other.attributes).all(is_alike);
        if self.voxel_size != other.voxel_size || !are_alike {
            return Err(Error::argument("the points have other attributes or voxels"));
        }
        let counts = [self.count(), other.count()];
        for (own, others) in self.attributes.iter_mut().zip(&other.attributes) {
            match (&mut own.values, &others.values) {
                (Values::Float(a), Values::Float(b)) => a.append(b, counts),
                (Values::Int(a), Values::Int(b)) => a.append(b, counts),
                (Values::Long(a), Values::Long(b)) => a.append(b, counts),
                (Values::Bool(a), Values::Bool(b)) => a.append(b, counts),
                (Values::Vector(a), Values::Vector(b)) => a.append(b, counts),
                _ => return Err(Error::Internal("attributes of one type differ in it".into())),
            }
        }
        self.cells.extend(other.cells);
        self.offsets.extend(other.offsets);
        Ok(())
    }

    /// Checks that all arrays have one value for each point, that numbers are finite, that offsets lie within their voxel, and that names
    /// are not empty and differ.
    ///
    /// # Errors
    /// Names the attribute or the first invalid point, counted from 1.
    pub fn validate(&self) -> Result<()> {
        check_voxel(self.voxel_size)?;
        let count = self.count();
        fail_if(self.offsets.len() != count, || {
            Error::argument(format!("there are {count} voxels of points, but {} offsets", self.offsets.len()))
        })?;
        // NaN is outside too.
        let is_outside = |offset: &[f32; 3]| !offset.iter().all(|part| (-0.5..=0.5).contains(part));
        if let Some(point) = self.offsets.iter().position(is_outside) {
            let what = format!("the offset of point {} is not within -0.5 to 0.5", point + 1);
            return Err(Error::argument(what));
        }
        for (n, Attribute { name, values }) in self.attributes.iter().enumerate() {
            if name.is_empty() || name == "P" {
                return Err(Error::argument(format!("\"{name}\" cannot be the name of an attribute")));
            }
            if self.attributes[..n].iter().any(|before| before.name == *name) {
                return Err(Error::argument(format!("two attributes have the name \"{name}\"")));
            }
            let stored = each_type!(values, column => column.count()).unwrap_or(count);
            fail_if(stored != count, || {
                Error::argument(format!("attribute \"{name}\" has {stored} values for {count} points"))
            })?;
            if let Some(point) = values.first_not_finite() {
                let what = format!("attribute \"{name}\" of point {} is not finite", point + 1);
                return Err(Error::argument(what));
            }
        }
        Ok(())
    }
}

fn check_voxel(size: f64) -> Result<()> {
    if size > 0.0 && size.is_finite() {
        return Ok(());
    }
    Err(Error::argument(format!("the voxel size of points must be above 0, not {size} m")))
}

/// The values with these indices.
fn picked<T: Copy>(values: &[T], order: &[u32]) -> Vec<T> {
    order.iter().map(|&point| values[point as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn three() -> Points {
        let positions = [[0.26, -0.26, 0.0], [1.0e6, 0.0, -3.0], [0.0; 3]].map(DVec3::from);
        let mut points = Points::at(0.5, &positions).unwrap();
        points.set("id", Values::Long(Column::Each(vec![5, 6, 7])));
        points.set("pscale", Values::Float(Column::Uniform(0.1)));
        points
    }

    #[test]
    fn positions_are_split_and_put_together_again() {
        let points = three();
        assert_eq!(points.cells, [[1, -1, 0], [2_000_000, 0, -6], [0; 3]]);
        assert!((points.position(0) - DVec3::new(0.26, -0.26, 0.0)).norm() < 1e-8);
        assert_eq!(points.position(1), DVec3::new(1.0e6, 0.0, -3.0));
        let (low, high) = points.bounds().unwrap();
        assert_eq!((low.z, high.x), (-3.0, 1.0e6));
        points.validate().unwrap();
        assert!(Points::at(0.5, &[DVec3::new(2.0e9, 0.0, 0.0)]).is_err());
        assert!(Points::at(0.5, &[DVec3::new(f64::NAN, 0.0, 0.0)]).is_err());
    }

    #[test]
    fn reordering_applies_to_every_array() {
        let mut points = three();
        points.reorder(&[2, 0, 1]);
        assert_eq!(points.cells[1], [1, -1, 0]);
        assert_eq!(points.attribute("id"), Some(&Values::Long(Column::Each(vec![7, 5, 6]))));
        assert_eq!(points.attribute("id").unwrap().range(), Some((vec![5.0], vec![7.0])));
        assert_eq!(points.attribute("pscale").unwrap().number(2), f64::from(0.1f32));
    }

    #[test]
    fn points_are_appended() {
        let mut points = three();
        let mut more = three();
        more.set("id", Values::Long(Column::Uniform(9)));
        points.append(more.clone()).unwrap();
        assert_eq!((points.count(), points.cells[3]), (6, points.cells[0]));
        assert_eq!(points.attribute("id"), Some(&Values::Long(Column::Each(vec![5, 6, 7, 9, 9, 9]))));
        assert_eq!(points.attribute("pscale"), Some(&Values::Float(Column::Uniform(0.1))));
        points.validate().unwrap();
        let before = points.clone();
        more.set("id", Values::Int(Column::Uniform(9)));
        assert!(points.append(more).is_err());
        points.append(Points::default()).unwrap();
        assert_eq!(points, before);
        let mut none = Points::default();
        none.append(before.clone()).unwrap();
        assert_eq!(none, before);
    }

    #[test]
    fn errors_name_the_fault() {
        let refused = |change: fn(&mut Points), what: &str| {
            let mut points = three();
            change(&mut points);
            let error = points.validate().unwrap_err().to_string();
            assert!(error.contains(what), "{error}");
        };
        refused(|points| points.voxel_size = 0.0, "voxel size");
        refused(|points| points.offsets.truncate(2), "2 offsets");
        refused(|points| points.offsets[1][2] = 0.6, "offset of point 2");
        refused(|points| points.offsets[2][0] = f32::NAN, "offset of point 3");
        refused(|points| points.set("m", Values::Int(Column::Each(vec![1]))), "\"m\" has 1 values");
        refused(|points| points.set("P", Values::Int(Column::Uniform(1))), "\"P\"");
        refused(|points| points.attributes[1].name = "id".into(), "two attributes");
        let wild = |points: &mut Points| {
            points
                .set("v", Values::Vector(Column::Each(vec![[0.0; 3], [0.0, f32::INFINITY, 0.0], [0.0; 3]])));
        };
        refused(wild, "\"v\" of point 2");
    }
}
