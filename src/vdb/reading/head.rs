//! The head of a parcel: numbers, texts and descriptions of grids, before the arrays.

use crate::vdb::bridge::ffi;
use crate::vdb::grid::MetaValue;
use crate::vdb::grid_info::GridInfo;
use crate::vdb::vectors::AnyGrid;

/// Arrays begin at multiples of this.
pub(in crate::vdb) const ALIGN: usize = 64;

/// Builds a head.
#[derive(Default)]
pub(in crate::vdb) struct Head(pub(super) Vec<u8>);

impl Head {
    pub(in crate::vdb) fn number(&mut self, number: u64) {
        self.0.extend(number.to_ne_bytes());
    }

    pub(in crate::vdb) fn bytes(&mut self, bytes: &[u8]) {
        self.number(bytes.len() as u64);
        self.0.extend(bytes);
    }

    pub(in crate::vdb) fn text(&mut self, text: &str) {
        self.bytes(text.as_bytes());
    }

    pub fn option(&mut self, number: Option<u64>) {
        self.number(number.is_some().into());
        self.number(number.unwrap_or(0));
    }

    pub fn info(&mut self, info: &GridInfo) {
        let words = [&info.name, &info.value_type, &info.class, &info.compression];
        words.iter().for_each(|text| self.text(text));
        self.number(info.voxel.to_bits());
        self.option(info.active_voxels);
        self.option(info.memory);
        self.number(info.half.into());
        self.number(info.bbox.is_some().into());
        let (low, high) = info.bbox.unwrap_or_default();
        low.iter().chain(&high).for_each(|&position| self.number(position as u64));
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

    pub fn grid(&mut self, grid: &AnyGrid, leaves: usize) -> Result<(), cxx::Exception> {
        let (own, background, tiles) = match grid {
            AnyGrid::Floats(grid) => {
                let background = [grid.background(), 0.0, 0.0];
                (ffi::grid_head(&grid.inner)?, background, ffi::tiles(&grid.inner)?)
            }
            AnyGrid::Vectors(grid) => {
                (ffi::vector_head(&grid.inner)?, grid.background(), ffi::vector_tiles(&grid.inner)?)
            }
        };
        self.number(matches!(grid, AnyGrid::Vectors(_)).into());
        self.bytes(own.as_bytes());
        background.iter().for_each(|component| self.number(component.to_bits().into()));
        self.number(tiles.len() as u64);
        for tile in tiles {
            let [x, y, z] = [tile.x, tile.y, tile.z].map(|position| position as u32);
            let [a, b, c] = tile.value.map(f32::to_bits);
            let words = [x, y, z, tile.level, tile.active.into(), a, b, c];
            self.0.extend(words.iter().flat_map(|word| word.to_ne_bytes()));
        }
        self.number(leaves as u64);
        Ok(())
    }
}

/// The part of a head that is still to be read.
pub(in crate::vdb) struct Cursor<'a>(pub(super) &'a [u8]);

impl<'a> Cursor<'a> {
    pub fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    pub(in crate::vdb) fn number(&mut self) -> Option<u64> {
        Some(u64::from_ne_bytes(self.take(8)?.try_into().ok()?))
    }

    pub(in crate::vdb) fn bytes(&mut self) -> Option<&'a [u8]> {
        let length = usize::try_from(self.number()?).ok()?;
        self.take(length)
    }

    pub(in crate::vdb) fn text(&mut self) -> Option<String> {
        Some(String::from_utf8_lossy(self.bytes()?).into_owned())
    }

    pub fn option(&mut self) -> Option<Option<u64>> {
        let (is_there, number) = (self.number()?, self.number()?);
        Some((is_there != 0).then_some(number))
    }

    pub fn tile(&mut self) -> Option<ffi::Tile> {
        let mut word = || Some(u32::from_ne_bytes(self.take(4)?.try_into().ok()?));
        let [x, y, z, level, active] = [word()?, word()?, word()?, word()?, word()?];
        let value = [word()?, word()?, word()?].map(f32::from_bits);
        let [x, y, z] = [x, y, z].map(|position| position as i32);
        let known = (1..=3).contains(&level);
        known.then_some(ffi::Tile { x, y, z, level, active: active != 0, value })
    }

    pub fn info(&mut self) -> Option<GridInfo> {
        let [name, value_type, class, compression] = [self.text()?, self.text()?, self.text()?, self.text()?];
        let voxel = f64::from_bits(self.number()?);
        let (active_voxels, memory) = (self.option()?, self.option()?);
        let half = self.number()? != 0;
        let has_box = self.number()? != 0;
        let mut position = || Some(self.number()? as i32);
        let (low, high) = ([position()?, position()?, position()?], [position()?, position()?, position()?]);
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

    pub fn meta(&mut self) -> Option<(String, MetaValue)> {
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
