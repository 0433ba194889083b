//! Data passed from one process to another: descriptions of a file's grids, or grids with their leaves as plain blocks, or points.
//!
//! A parcel is `MAGIC`, the length of its head, the head, and for each grid three arrays: origins, masks and values of its leaves. The
//! magic number is written last: without it a parcel is incomplete. The reader checks every length, because a damaged file may have misled
//! the process that wrote it.

use std::fs::File;
use std::io::{IoSlice, Write};
use std::os::unix::fs::FileExt;

use super::head::{ALIGN, Cursor, Head};
use super::mapping::Mapping;
use super::parcel_points;
use crate::geometry::Points;
use crate::numeric::blocks::{Mask, Values};
use crate::vdb::bridge::ffi;
use crate::vdb::grid::FloatGrid;
use crate::vdb::grid_info::GridInfo;
use crate::vdb::leaf::{Leaf, LeafValues, Vectors};
use crate::vdb::vectors::{AnyGrid, VectorGrid};

/// The first bytes of a parcel; they change with its format.
const MAGIC: [u8; 8] = *b"frzpack3";

/// Bytes per leaf in each of the three arrays, for leaves with values of type `V`.
const fn array_sizes<V>() -> [usize; 3] {
    [12, size_of::<Mask>(), size_of::<V>()]
}
/// Leaves per write.
const BATCH: usize = 512;

/// The contents of a parcel.
pub(in crate::vdb) enum Contents {
    /// Descriptions of a file's grids.
    Infos(Vec<GridInfo>),
    /// Grids.
    Grids(Vec<AnyGrid>),
    /// Points, and the attributes that were omitted.
    Points(Points, Vec<String>),
    /// Why there is neither; the message is appended to the file's name.
    Refusal(String),
}

/// Writes a parcel into an empty file.
///
/// # Errors
/// What the operating system reports, or OpenVDB when memory runs out.
pub(in crate::vdb) fn pack(mut file: &File, contents: &Contents) -> Result<(), String> {
    let mut head = Head::default();
    let mut lists: Vec<Leaves<'_>> = Vec::new();
    match contents {
        Contents::Refusal(text) => {
            head.number(0);
            head.text(text);
        }
        Contents::Infos(infos) => {
            head.number(1);
            head.number(infos.len() as u64);
            infos.iter().for_each(|info| head.info(info));
        }
        Contents::Points(points, skipped) => {
            head.number(3);
            parcel_points::describe(&mut head, points, skipped);
        }
        Contents::Grids(grids) => {
            head.number(2);
            head.number(grids.len() as u64);
            for grid in grids {
                let leaves = match grid {
                    AnyGrid::Floats(grid) => grid.leaves().map(Leaves::Floats),
                    AnyGrid::Vectors(grid) => grid.leaves().map(Leaves::Vectors),
                };
                let leaves = leaves.map_err(|error| error.to_string())?;
                head.grid(grid, leaves.count()).map_err(|error| error.what().to_string())?;
                lists.push(leaves);
            }
        }
    }
    let io = |error: std::io::Error| error.to_string();
    let start = [&[0; 8][..], &(head.0.len() as u64).to_le_bytes(), &head.0].concat();
    let mut at = start.len();
    file.write_all(&start).map_err(io)?;
    for leaves in &lists {
        let written = match leaves {
            Leaves::Floats(leaves) => write_leaves(file, &mut at, leaves),
            Leaves::Vectors(leaves) => write_leaves(file, &mut at, leaves),
        };
        written.map_err(io)?;
    }
    if let Contents::Points(points, _) = contents {
        parcel_points::write(file, &mut at, points).map_err(io)?;
    }
    file.write_all_at(&MAGIC, 0).map_err(io)
}

/// The leaves of a grid.
enum Leaves<'a> {
    Floats(Vec<Leaf<'a>>),
    Vectors(Vec<Leaf<'a, Vectors>>),
}

impl Leaves<'_> {
    fn count(&self) -> usize {
        match self {
            Self::Floats(leaves) => leaves.len(),
            Self::Vectors(leaves) => leaves.len(),
        }
    }
}

fn write_leaves<V: LeafValues>(
    mut file: &File,
    at: &mut usize,
    leaves: &[Leaf<'_, V>],
) -> std::io::Result<()> {
    for (array, size) in array_sizes::<V>().into_iter().enumerate() {
        file.write_all(&[0; ALIGN][..at.next_multiple_of(ALIGN) - *at])?;
        *at = at.next_multiple_of(ALIGN) + size * leaves.len();
        for batch in leaves.chunks(BATCH) {
            if array == 0 {
                let origins: Vec<u8> =
                    batch.iter().flat_map(|leaf| leaf.origin).flat_map(i32::to_ne_bytes).collect();
                file.write_all(&origins)?;
                continue;
            }
            let mut slices: Vec<IoSlice<'_>> = batch
                .iter()
                .map(|leaf| IoSlice::new(if array == 1 { leaf.mask_bytes() } else { leaf.value_bytes() }))
                .collect();
            let mut remaining = slices.as_mut_slice();
            while !remaining.is_empty() {
                let written = file.write_vectored(remaining)?;
                IoSlice::advance_slices(&mut remaining, written);
            }
        }
    }
    Ok(())
}

/// Opens a parcel; none if it is incomplete or inconsistent.
pub(in crate::vdb) fn unpack(parcel: &Mapping, threads: usize) -> Option<Contents> {
    let mut start = Cursor(parcel);
    (start.take(8)? == MAGIC).then_some(())?;
    let length = usize::try_from(start.number()?).ok()?;
    let mut head = Cursor(start.take(length)?);
    let mut at = 16 + length;
    let kind = head.number()?;
    if kind == 0 {
        return Some(Contents::Refusal(head.text()?));
    }
    if kind == 3 {
        let (points, skipped) = parcel_points::read(&mut head, parcel, at)?;
        return Some(Contents::Points(points, skipped));
    }
    let count = head.number()?;
    match kind {
        1 => Some(Contents::Infos((0..count).map(|_| head.info()).collect::<Option<_>>()?)),
        2 => {
            let grids = (0..count).map(|_| grid(&mut head, parcel, &mut at, threads));
            Some(Contents::Grids(grids.collect::<Option<_>>()?))
        }
        _ => None,
    }
}

/// Builds a grid with one copy per leaf and nothing more.
fn grid(head: &mut Cursor<'_>, parcel: &[u8], at: &mut usize, threads: usize) -> Option<AnyGrid> {
    let call = ffi::Call { threads: threads as i32, cancel: 0 };
    let is_vectors = head.number()? != 0;
    let own = head.bytes()?;
    let mut component = || Some(f32::from_bits(head.number()? as u32));
    let background = [component()?, component()?, component()?];
    let tiles = (0..head.number()?).map(|_| head.tile()).collect::<Option<Vec<_>>>()?;
    let count = usize::try_from(head.number()?).ok()?;
    if is_vectors {
        let Arrays { origins, values, masks } = arrays::<Vectors>(parcel, at, count)?;
        let mut inner = ffi::assemble_vectors(own, background, &tiles).ok()?;
        let constants = vec![0.0; 3 * count];
        let mut blocks = ffi::make_vector_blocks(&call, &origins, &values, &masks, &constants).ok()?;
        ffi::put_vector_blocks(inner.pin_mut(), blocks.pin_mut()).ok()?;
        return Some(AnyGrid::Vectors(VectorGrid { inner }));
    }
    let Arrays { origins, values, masks } = arrays::<Values>(parcel, at, count)?;
    let mut inner = ffi::assemble(own, background[0], &tiles).ok()?;
    let mut blocks = ffi::make_blocks(&call, &origins, &values, &masks, &vec![0.0; count]).ok()?;
    ffi::put_blocks(inner.pin_mut(), blocks.pin_mut()).ok()?;
    Some(AnyGrid::Floats(FloatGrid { inner }))
}

/// The positions of a grid's leaves.
struct Arrays {
    origins: Vec<i32>,
    /// Addresses.
    values: Vec<usize>,
    masks: Vec<usize>,
}

/// The arrays of this many leaves, from an offset in the parcel, which then moves past them.
fn arrays<V>(parcel: &[u8], at: &mut usize, count: usize) -> Option<Arrays> {
    let array_sizes = array_sizes::<V>();
    let mut arrays = [&parcel[..0]; 3];
    for (array, size) in arrays.iter_mut().zip(array_sizes) {
        let begin = at.next_multiple_of(ALIGN);
        *at = begin.checked_add(size.checked_mul(count)?)?;
        *array = parcel.get(begin..*at)?;
    }
    let [origins, masks, values] = arrays;
    let integer = |four: &[u8]| i32::from_ne_bytes([four[0], four[1], four[2], four[3]]);
    let origins: Vec<i32> = origins.chunks_exact(4).map(integer).collect();
    origins.iter().all(|position| position % 8 == 0).then_some(())?;
    let addresses = |array: &[u8], size: usize| -> Vec<usize> {
        (0..count).map(|leaf| array.as_ptr() as usize + leaf * size).collect()
    };
    Some(Arrays {
        origins,
        values: addresses(values, array_sizes[2]),
        masks: addresses(masks, array_sizes[1]),
    })
}
