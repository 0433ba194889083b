//! What one process hands to another: what a file says of its grids, or grids, their leaves as plain blocks.
//!
//! A parcel is `MAGIC`, the length of its head, the head, and for each grid three arrays: origins, masks, values of its
//! leaves. The magic number is written last: without it a parcel is not whole. Whoever opens one checks every length,
//! as the process that packed it may have been led astray by a damaged file.

use std::fs::File;
use std::io::{IoSlice, Write};
use std::os::unix::fs::FileExt;

use super::bridge::ffi;
use super::file::GridInfo;
use super::grid::{FloatGrid, MetaValue};
use super::leaf::Leaf;
use super::mapping::Mapping;
use crate::base::blocks::{Mask, Values};

/// The first bytes of a parcel; they change with its form.
const MAGIC: [u8; 8] = *b"frzpack1";
/// Arrays begin at multiples of this.
const ALIGN: usize = 64;
/// Bytes of a leaf in each of the three arrays.
const SIZES: [usize; 3] = [12, size_of::<Mask>(), size_of::<Values>()];
/// Leaves that one write takes.
const BATCH: usize = 512;

/// What is handed over.
pub(super) enum Contents {
    /// What a file says of its grids.
    Infos(Vec<GridInfo>),
    /// Grids.
    Grids(Vec<FloatGrid>),
    /// Why there is neither; the text goes behind the file's name.
    Refusal(String),
}

/// Writes a parcel into an empty file.
///
/// # Errors
/// What the operating system reports, or OpenVDB when memory runs out.
pub(super) fn pack(mut file: &File, contents: &Contents) -> Result<(), String> {
    let mut head = Head::default();
    let mut lists = Vec::new();
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
        Contents::Grids(grids) => {
            head.number(2);
            head.number(grids.len() as u64);
            for grid in grids {
                let leaves = grid.leaves().map_err(|error| error.to_string())?;
                head.grid(grid, leaves.len()).map_err(|error| error.what().to_string())?;
                lists.push(leaves);
            }
        }
    }
    let io = |error: std::io::Error| error.to_string();
    let start = [&[0; 8][..], &(head.0.len() as u64).to_le_bytes(), &head.0].concat();
    let mut at = start.len();
    file.write_all(&start).map_err(io)?;
    for leaves in &lists {
        write_leaves(file, &mut at, leaves).map_err(io)?;
    }
    file.write_all_at(&MAGIC, 0).map_err(io)
}

fn write_leaves(mut file: &File, at: &mut usize, leaves: &[Leaf<'_>]) -> std::io::Result<()> {
    for (array, size) in SIZES.into_iter().enumerate() {
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
            let mut left = slices.as_mut_slice();
            while !left.is_empty() {
                let written = file.write_vectored(left)?;
                IoSlice::advance_slices(&mut left, written);
            }
        }
    }
    Ok(())
}

/// Opens a parcel; none when it is not whole or contradicts itself.
pub(super) fn unpack(parcel: &Mapping, threads: usize) -> Option<Contents> {
    let mut start = Cursor(parcel);
    (start.take(8)? == MAGIC).then_some(())?;
    let length = usize::try_from(start.number()?).ok()?;
    let mut head = Cursor(start.take(length)?);
    let mut at = 16 + length;
    let kind = head.number()?;
    if kind == 0 {
        return Some(Contents::Refusal(head.text()?));
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

/// Builds a grid: a copy for each leaf, nothing more.
fn grid(head: &mut Cursor<'_>, parcel: &[u8], at: &mut usize, threads: usize) -> Option<FloatGrid> {
    let own = head.bytes()?;
    let background = f32::from_bits(head.number()? as u32);
    let tiles = (0..head.number()?).map(|_| head.tile()).collect::<Option<Vec<_>>>()?;
    let count = usize::try_from(head.number()?).ok()?;
    let mut arrays = [&parcel[..0]; 3];
    for (array, size) in arrays.iter_mut().zip(SIZES) {
        let begin = at.next_multiple_of(ALIGN);
        *at = begin.checked_add(size.checked_mul(count)?)?;
        *array = parcel.get(begin..*at)?;
    }
    let [origins, masks, values] = arrays;
    let whole = |four: &[u8]| i32::from_ne_bytes([four[0], four[1], four[2], four[3]]);
    let origins: Vec<i32> = origins.chunks_exact(4).map(whole).collect();
    origins.iter().all(|place| place % 8 == 0).then_some(())?;
    let mut inner = ffi::assemble(own, background, &tiles).ok()?;
    let addresses = |array: &[u8], size: usize| -> Vec<usize> {
        (0..count).map(|leaf| array.as_ptr() as usize + leaf * size).collect()
    };
    let call = ffi::Call { threads: threads as i32, cancel: 0 };
    let (values, masks) = (addresses(values, SIZES[2]), addresses(masks, SIZES[1]));
    let mut blocks = ffi::make_blocks(&call, &origins, &values, &masks, &vec![0.0; count]).ok()?;
    ffi::put_blocks(inner.pin_mut(), blocks.pin_mut()).ok()?;
    Some(FloatGrid { inner })
}

/// A head in the making.
#[derive(Default)]
struct Head(Vec<u8>);

impl Head {
    fn number(&mut self, number: u64) {
        self.0.extend(number.to_ne_bytes());
    }

    fn bytes(&mut self, bytes: &[u8]) {
        self.number(bytes.len() as u64);
        self.0.extend(bytes);
    }

    fn text(&mut self, text: &str) {
        self.bytes(text.as_bytes());
    }

    fn option(&mut self, number: Option<u64>) {
        self.number(number.is_some().into());
        self.number(number.unwrap_or(0));
    }

    fn info(&mut self, info: &GridInfo) {
        let words = [&info.name, &info.value_type, &info.class, &info.compression];
        words.iter().for_each(|text| self.text(text));
        self.number(info.voxel.to_bits());
        self.option(info.active_voxels);
        self.option(info.memory);
        self.number(info.half.into());
        self.number(info.bbox.is_some().into());
        let (low, high) = info.bbox.unwrap_or_default();
        low.iter().chain(&high).for_each(|&place| self.number(place as u64));
        self.number(info.metadata.len() as u64);
        for (key, value) in &info.metadata {
            self.text(key);
            let (kind, number, text, word) = match value {
                MetaValue::Text(text) => (0, 0, text.as_str(), ""),
                MetaValue::Float(value) => (1, value.to_bits().into(), "", ""),
                MetaValue::Double(value) => (2, value.to_bits(), "", ""),
                MetaValue::Int(value) => (3, *value as u64, "", ""),
                MetaValue::Bool(value) => (4, u64::from(*value), "", ""),
                MetaValue::Other(word, text) => (5, 0, text.as_str(), word.as_str()),
            };
            self.number(kind);
            self.number(number);
            self.text(text);
            self.text(word);
        }
    }

    fn grid(&mut self, grid: &FloatGrid, leaves: usize) -> Result<(), cxx::Exception> {
        self.bytes(ffi::grid_head(&grid.inner)?.as_bytes());
        self.number(grid.background().to_bits().into());
        let tiles = ffi::tiles(&grid.inner)?;
        self.number(tiles.len() as u64);
        for tile in tiles {
            let words = [
                tile.x as u32,
                tile.y as u32,
                tile.z as u32,
                tile.level,
                tile.active.into(),
                tile.value.to_bits(),
            ];
            self.0.extend(words.iter().flat_map(|word| word.to_ne_bytes()));
        }
        self.number(leaves as u64);
        Ok(())
    }
}

/// The rest of a head.
struct Cursor<'a>(&'a [u8]);

impl<'a> Cursor<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn number(&mut self) -> Option<u64> {
        Some(u64::from_ne_bytes(self.take(8)?.try_into().ok()?))
    }

    fn bytes(&mut self) -> Option<&'a [u8]> {
        let length = usize::try_from(self.number()?).ok()?;
        self.take(length)
    }

    fn text(&mut self) -> Option<String> {
        Some(String::from_utf8_lossy(self.bytes()?).into_owned())
    }

    fn option(&mut self) -> Option<Option<u64>> {
        let (is_there, number) = (self.number()?, self.number()?);
        Some((is_there != 0).then_some(number))
    }

    fn tile(&mut self) -> Option<ffi::Tile> {
        let mut word = || Some(u32::from_ne_bytes(self.take(4)?.try_into().ok()?));
        let [x, y, z, level, active, value] = [word()?, word()?, word()?, word()?, word()?, word()?];
        let [x, y, z] = [x, y, z].map(|place| place as i32);
        let known = (1..=3).contains(&level);
        known.then_some(ffi::Tile { x, y, z, level, active: active != 0, value: f32::from_bits(value) })
    }

    fn info(&mut self) -> Option<GridInfo> {
        let [name, value_type, class, compression] = [self.text()?, self.text()?, self.text()?, self.text()?];
        let voxel = f64::from_bits(self.number()?);
        let (active_voxels, memory) = (self.option()?, self.option()?);
        let half = self.number()? != 0;
        let has_box = self.number()? != 0;
        let mut place = || Some(self.number()? as i32);
        let (low, high) = ([place()?, place()?, place()?], [place()?, place()?, place()?]);
        let metadata = (0..self.number()?).map(|_| self.meta()).collect::<Option<_>>()?;
        let bbox = has_box.then_some((low, high));
        Some(GridInfo {
            name,
            value_type,
            class,
            voxel,
            active_voxels,
            bbox,
            memory,
            half,
            compression,
            metadata,
        })
    }

    fn meta(&mut self) -> Option<(String, MetaValue)> {
        let key = self.text()?;
        let (kind, number, text, word) = (self.number()?, self.number()?, self.text()?, self.text()?);
        let value = match kind {
            0 => MetaValue::Text(text),
            1 => MetaValue::Float(f32::from_bits(number as u32)),
            2 => MetaValue::Double(f64::from_bits(number)),
            3 => MetaValue::Int(number as i64),
            4 => MetaValue::Bool(number != 0),
            5 => MetaValue::Other(word, text),
            _ => return None,
        };
        Some((key, value))
    }
}
