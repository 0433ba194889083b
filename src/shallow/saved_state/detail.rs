//! The state of a liquid with cells of two sizes: both liquids, the flow across the edge between them, and remainders of less than a coarse
//! unit.
//!
//! | part | bytes |
//! |---|---|
//! | header: magic, version, count of scalars, total length, the near cells, counts of pipes and of cells with a remainder, lengths of both states, length of the last step | [`HEADER`] |
//! | cells with a remainder: the cell, 0, fine units, then an amount of each scalar | 16 each, and 8 a scalar |
//! | pipes along the edge: flux, remainder | 8 each |
//! | states of the fine and of the coarse liquid, as in [`super`] | |
//! | hash of everything above | [`CHECKSUM`] |

use super::encoding::{CHECKSUM, Format, SUMS, Writer, open, part, parts, require, write_checksum};
use super::{MAX_FLUX, STEP_LENGTH, Saved, is_over};
use crate::error::{Error, Result};
use crate::numeric::bytes::Reader;
use crate::shallow::Shallow;
use crate::shallow::columns::grid::Cells;
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::two_level::remainders::Contents;
use crate::shallow::two_level::{Detail, check_near};

const FORMAT: Format =
    Format { magic: *b"frz shld", version: 1, length_at: 16, of: "a shallow liquid in cells of two sizes" };
/// Bytes of the header.
const HEADER: usize = 72;

impl Detail {
    /// The state between two frames: everything except the terrain, the parameters, the flow points and the bodies, which the host has. It
    /// includes the near cells. The same bytes on any number of threads.
    pub fn save(&self) -> Vec<u8> {
        let mut out = vec![0; self.save_size()];
        self.write(&mut out);
        out
    }

    /// As [`Detail::save`], into the beginning of a slice; returns the count of bytes. Nothing is allocated.
    ///
    /// # Errors
    /// `Argument`: the slice is shorter than [`Detail::save_size`]; nothing is written.
    pub fn save_to(&self, out: &mut [u8]) -> Result<usize> {
        let (size, room) = (self.save_size(), out.len());
        let Some(out) = out.get_mut(..size) else {
            return Err(Error::argument(format!("a state of {size} bytes does not fit into {room}")));
        };
        self.write(out);
        Ok(size)
    }

    /// Count of bytes that [`Detail::save`] would return now.
    pub fn save_size(&self) -> usize {
        let own = HEADER
            + remainder_bytes(self.scalars().len()) * self.remainders.iter().count()
            + 8 * self.seam.numbers().len();
        own + self.fine.save_size() + self.coarse.save_size() + CHECKSUM
    }

    /// Replaces the liquid's state and its near cells by saved ones: it then continues as the saved liquid did, to the same bytes, with the
    /// same parameters, flow points and bodies, which must be set first ([`crate::shallow::Shallow::restore`]). Nothing is allocated if the
    /// near cells are already those of the state.
    ///
    /// # Errors
    /// `Bytes`, and the liquid is as it was: not a state of a liquid with cells of two sizes; another version; truncated or damaged;
    /// otherwise as [`crate::shallow::Shallow::restore`].
    pub fn restore(&mut self, bytes: &[u8]) -> Result<()> {
        let saved = SavedDetail::read(bytes)?;
        require(check_near(&saved.near, self.fine.columns.grid.size).is_ok(), "belongs to another terrain")?;
        if saved.near == self.near {
            saved.check(self)?;
            saved.apply(self);
            return Ok(());
        }
        // The saved states fit the columns only with the saved near cells.
        let own = self.save();
        self.set_near(saved.near.clone())?;
        let result = saved.check(self);
        if result.is_ok() {
            saved.apply(self);
        } else {
            let own = SavedDetail::read(&own)?;
            self.set_near(own.near.clone())?;
            own.apply(self);
        }
        result
    }

    /// Saves the state into a vector, with capacity for the largest state that this liquid can have.
    pub(in crate::shallow) fn save_rollback(&self, out: &mut Vec<u8>) {
        let sizes = [&self.fine, &self.coarse].map(Shallow::max_save_size);
        let remainders = remainder_bytes(self.scalars().len()) * self.remainders.len();
        out.clear();
        out.reserve(HEADER + remainders + 8 * self.seam.numbers().len() + sizes[0] + sizes[1] + CHECKSUM);
        out.resize(self.save_size(), 0);
        self.write(out);
    }

    /// Restores a state that was saved from this liquid, with the same near cells.
    pub(in crate::shallow) fn put_back(&mut self, bytes: &[u8]) {
        let saved = SavedDetail::read(bytes);
        debug_assert!(saved.is_ok());
        saved.into_iter().for_each(|saved| saved.apply(self));
    }

    fn write(&self, out: &mut [u8]) {
        let size = out.len();
        let mut to = Writer(&mut out[..size - CHECKSUM]);
        let sizes = [self.fine.save_size(), self.coarse.save_size()];
        let [x, z] = &self.near;
        to.bytes(&FORMAT.magic);
        to.numbers(&[FORMAT.version, self.scalars().len() as u32], u32::to_le_bytes);
        to.bytes(&(size as u64).to_le_bytes());
        to.numbers(&[x.start, x.end, z.start, z.end].map(|at| at as u32), u32::to_le_bytes);
        let counts = [self.seam.numbers().len(), self.remainders.iter().count()];
        to.numbers(&counts.map(|count| count as u32), u32::to_le_bytes);
        to.numbers(&sizes.map(|size| size as u64), u64::to_le_bytes);
        to.numbers(&[self.seam.last], f64::to_le_bytes);
        for (cell, contents) in self.remainders.iter() {
            to.numbers(&[cell as u32, 0], u32::to_le_bytes);
            to.bytes(&contents.units.to_le_bytes());
            to.numbers(&contents.amounts[..self.scalars().len()], i64::to_le_bytes);
        }
        self.seam.numbers().for_each(|numbers| to.numbers(&numbers, f32::to_le_bytes));
        for (liquid, size) in [&self.fine, &self.coarse].into_iter().zip(sizes) {
            liquid.write(&super::Counts::of(liquid), to.next(size));
        }
        debug_assert!(to.0.is_empty());
        write_checksum(out);
    }
}

/// Bytes of a cell's remainder, with this many scalars.
fn remainder_bytes(scalars: usize) -> usize {
    16 + 8 * scalars
}

/// A complete state, in its parts.
struct SavedDetail<'a> {
    near: Cells,
    last: f64,
    /// In elements of [`remainder_bytes`].
    remainders: &'a [u8],
    scalars: usize,
    /// Flux and rounding remainder of each.
    pipes: &'a [[u8; 4]],
    liquids: [Saved<'a>; 2],
}

impl<'a> SavedDetail<'a> {
    fn read(bytes: &'a [u8]) -> Result<Self> {
        let (header, body) = open::<HEADER>(bytes, &FORMAT)?;
        let mut from = Reader::new(&header[12..]);
        let scalars = from.u32()? as usize;
        from.take::<8>()?;
        let mut count = || from.u32().map(|count| count as usize);
        let near = [count()?..count()?, count()?..count()?];
        let [pipes, remainders] = [count()?, count()?];
        let sizes = [u64::from_le_bytes(from.take()?), u64::from_le_bytes(from.take()?)];
        let last = from.f64()?;
        require(scalars <= MAX_SCALARS, "is damaged")?;
        let fixed = (HEADER + remainder_bytes(scalars) * remainders + 8 * pipes + CHECKSUM) as u64;
        let all = sizes[0].checked_add(sizes[1]).and_then(|sum| sum.checked_add(fixed));
        require(all == Some(bytes.len() as u64), "is damaged")?;
        let mut from = Reader::new(&body[HEADER..]);
        let remainders = from.bytes(remainder_bytes(scalars) * remainders)?;
        let pipes = parts(&mut from, 2 * pipes)?;
        let [fine, coarse] = sizes.map(|size| size as usize);
        let liquids = [Saved::read(from.bytes(fine)?)?, Saved::read(from.bytes(coarse)?)?];
        Ok(Self { near, last, remainders, scalars, pipes, liquids })
    }

    /// Checks that it belongs to this liquid, whose near cells are the same.
    fn check(&self, detail: &Detail) -> Result<()> {
        let [fine, coarse] = &self.liquids;
        fine.check(&detail.fine)?;
        coarse.check(&detail.coarse)?;
        let (flux, left) = (self.pipes.iter().step_by(2), self.pipes.iter().skip(1).step_by(2));
        let cells = self.remainders().map(|(cell, _)| cell);
        let is_good = self.scalars == detail.scalars().len()
            && self.pipes.len() == 2 * detail.seam.numbers().len()
            && STEP_LENGTH.contains(&self.last)
            && !flux.copied().any(|flux| is_over(&[flux], MAX_FLUX))
            && !left.copied().any(|left| is_over(&[left], 1.0))
            && cells.clone().is_sorted_by(|a, b| a < b)
            && cells.last().is_none_or(|cell| cell < detail.remainders.len())
            && self.remainders().all(|(_, contents)| {
                contents.units >= 0
                    && contents != Contents::default()
                    && SUMS.contains(&contents.units)
                    && contents.amounts.iter().all(|amount| SUMS.contains(amount))
            });
        require(is_good, "is damaged")
    }

    fn remainders(&self) -> impl Iterator<Item = (usize, Contents)> + Clone {
        let (bytes, scalars) = (remainder_bytes(self.scalars), self.scalars);
        self.remainders.chunks_exact(bytes).map(move |remainder| {
            let mut amounts = [0; MAX_SCALARS];
            for (at, amount) in amounts[..scalars].iter_mut().enumerate() {
                *amount = i64::from_le_bytes(part(remainder, 16 + 8 * at));
            }
            let units = i64::from_le_bytes(part(remainder, 8));
            (u32::from_le_bytes(part(remainder, 0)) as usize, Contents { units, amounts })
        })
    }

    /// Applies the state.
    fn apply(&self, detail: &mut Detail) {
        let [fine, coarse] = &self.liquids;
        fine.apply(&mut detail.fine);
        coarse.apply(&mut detail.coarse);
        detail.remainders.clear();
        self.remainders().for_each(|(cell, contents)| detail.remainders.set(cell, contents));
        let numbers = self.pipes.as_chunks::<2>().0.iter().map(|pipe| pipe.map(f32::from_le_bytes));
        detail.seam.set_numbers(self.last, numbers);
    }
}
