//! Points in a parcel: the head describes them; their arrays follow it in the same order, each aligned.

use std::fs::File;
use std::io::Write;

use super::head::{ALIGN, Cursor, Head};
use crate::geometry::points::{Attribute, Column, Points, Values};
use crate::vdb::point_arrays::kind;

/// A type whose values pass through a parcel as bytes.
///
/// # Safety
/// Every byte of a value is initialised: there is no padding.
unsafe trait Plain: Copy {
    /// A value from its bytes, which must be exactly as many as it has.
    fn of(bytes: &[u8]) -> Option<Self>;
}

macro_rules! plain {
    ($($type:ty: $of:expr;)*) => {
        $(
            // SAFETY: numbers, arrays of numbers and bools have no padding.
            unsafe impl Plain for $type {
                fn of(bytes: &[u8]) -> Option<Self> {
                    ($of)(bytes)
                }
            }
        )*
    };
}
plain! {
    f32: |bytes: &[u8]| bytes.try_into().ok().map(f32::from_ne_bytes);
    i32: |bytes: &[u8]| bytes.try_into().ok().map(i32::from_ne_bytes);
    i64: |bytes: &[u8]| bytes.try_into().ok().map(i64::from_ne_bytes);
    bool: |bytes: &[u8]| bytes.first().map(|&byte| byte != 0);
    [f32; 3]: |bytes: &[u8]| {
        Some([f32::of(bytes.get(..4)?)?, f32::of(bytes.get(4..8)?)?, f32::of(bytes.get(8..12)?)?])
    };
    [i32; 3]: |bytes: &[u8]| {
        Some([i32::of(bytes.get(..4)?)?, i32::of(bytes.get(4..8)?)?, i32::of(bytes.get(8..12)?)?])
    };
}

fn bytes_of<T: Plain>(values: &[T]) -> &[u8] {
    // SAFETY: every byte of such values can be read; the array stays borrowed.
    unsafe { std::slice::from_raw_parts(values.as_ptr().cast(), size_of_val(values)) }
}

/// Describes points in a head.
pub(in crate::vdb) fn describe(head: &mut Head, points: &Points, skipped: &[String]) {
    head.number(points.voxel_size.to_bits());
    head.number(points.count() as u64);
    head.number(skipped.len() as u64);
    skipped.iter().for_each(|text| head.text(text));
    head.number(points.attributes.len() as u64);
    for Attribute { name, values } in &points.attributes {
        head.text(name);
        head.number(kind(values) as u64);
        head.number(values.is_uniform().into());
        if values.is_uniform() {
            head.bytes(stored(values));
        }
    }
}

/// The bytes of the stored values.
fn stored(values: &Values) -> &[u8] {
    match values {
        Values::Float(column) => bytes_of(column.stored()),
        Values::Int(column) => bytes_of(column.stored()),
        Values::Long(column) => bytes_of(column.stored()),
        Values::Bool(column) => bytes_of(column.stored()),
        Values::Vector(column) => bytes_of(column.stored()),
    }
}

/// Appends the arrays of points to a file; `at` is its length.
pub(in crate::vdb) fn write(mut file: &File, at: &mut usize, points: &Points) -> std::io::Result<()> {
    let each = points.attributes.iter().filter(|attribute| !attribute.values.is_uniform());
    let attributes = each.map(|attribute| stored(&attribute.values));
    for bytes in [bytes_of(&points.cells), bytes_of(&points.offsets)].into_iter().chain(attributes) {
        file.write_all(&[0; ALIGN][..at.next_multiple_of(ALIGN) - *at])?;
        file.write_all(bytes)?;
        *at = at.next_multiple_of(ALIGN) + bytes.len();
    }
    Ok(())
}

/// Reads points described by a head, whose arrays begin at an offset in the parcel, and the omitted attributes. None if they are inconsistent.
pub(in crate::vdb) fn read(
    head: &mut Cursor<'_>,
    parcel: &[u8],
    mut at: usize,
) -> Option<(Points, Vec<String>)> {
    let voxel_size = f64::from_bits(head.number()?);
    let count = usize::try_from(head.number()?).ok()?;
    let skipped = (0..head.number()?).map(|_| head.text()).collect::<Option<_>>()?;
    let mut arrays = Arrays { parcel, at: &mut at, count };
    let (cells, offsets) = (arrays.next()?, arrays.next()?);
    let attributes = (0..head.number()?).map(|_| attribute(head, &mut arrays)).collect::<Option<_>>()?;
    let points = Points { voxel_size, cells, offsets, attributes };
    points.validate().ok()?;
    Some((points, skipped))
}

fn attribute(head: &mut Cursor<'_>, arrays: &mut Arrays<'_>) -> Option<Attribute> {
    let name = head.text()?;
    let (kind, uniform) = (head.number()?, head.number()? != 0);
    let values = match kind {
        0 => Values::Float(column(head, arrays, uniform)?),
        1 => Values::Int(column(head, arrays, uniform)?),
        2 => Values::Long(column(head, arrays, uniform)?),
        3 => Values::Bool(column(head, arrays, uniform)?),
        4 => Values::Vector(column(head, arrays, uniform)?),
        _ => return None,
    };
    Some(Attribute { name, values })
}

fn column<T: Plain>(head: &mut Cursor<'_>, arrays: &mut Arrays<'_>, uniform: bool) -> Option<Column<T>> {
    if uniform {
        let bytes = head.bytes()?;
        return (bytes.len() == size_of::<T>()).then(|| T::of(bytes).map(Column::Uniform))?;
    }
    Some(Column::Each(arrays.next()?))
}

/// The arrays of a parcel, one after another.
struct Arrays<'a> {
    parcel: &'a [u8],
    at: &'a mut usize,
    count: usize,
}

impl Arrays<'_> {
    fn next<T: Plain>(&mut self) -> Option<Vec<T>> {
        let begin = self.at.next_multiple_of(ALIGN);
        *self.at = begin.checked_add(self.count.checked_mul(size_of::<T>())?)?;
        let bytes = self.parcel.get(begin..*self.at)?;
        bytes.chunks_exact(size_of::<T>()).map(T::of).collect()
    }
}
