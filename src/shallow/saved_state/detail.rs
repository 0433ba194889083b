//! The state of a liquid with cells of two sizes: both liquids, the flow across the edge between them, and rests smaller than a coarse
//! unit.
//!
//! | part | bytes |
//! |---|---|
//! | header: magic, version, count of scalars, total length, the near cells, counts of pipes and of cells with a rest, lengths of both states, length of the last step | [`HEADER`] |
//! | cells with a rest: the cell, 0, fine units, then an amount of each scalar | 16 each, and 8 |
//! | pipes along the edge: flux, remainder | 8 each |
//! | states of the fine and of the coarse liquid, as in [`super`] | |
//! | hash of everything above | [`SEAL`] |

use super::encoding::{Beginning, Put, SEAL, SUMS, open, part, parts, require, seal};
use super::{LAST, MOST_FLUX, Saved, is_over};
use crate::error::{Error, Result};
use crate::numeric::bytes::Reader;
use crate::shallow::Shallow;
use crate::shallow::columns::grid::Cells;
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::two_level::rests::Load;
use crate::shallow::two_level::{Detail, check_near};

const BEGINNING: Beginning = Beginning {
    magic: *b"frz shld",
    version: 1,
    length_at: 16,
    of: "a shallow liquid in cells of two sizes",
};
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
            + rest_bytes(self.scalars().len()) * self.rest.iter().count()
            + 8 * self.seam.numbers().len();
        own + self.fine.save_size() + self.coarse.save_size() + SEAL
    }

    /// Replaces the liquid's state, and its near cells, by a saved one: it continues as the saved liquid did, to the same bytes, with the
    /// same parameters, flow points and bodies, which must be set first ([`crate::shallow::Shallow::restore`]). Nothing is allocated if the
    /// near cells are already those of the state.
    ///
    /// # Errors
    /// `Bytes`, and the liquid is as it was: not a state of a liquid with cells of two sizes; another version; truncated or damaged;
    /// otherwise as [`crate::shallow::Shallow::restore`].
    pub fn restore(&mut self, bytes: &[u8]) -> Result<()> {
        let saved = Both::read(bytes)?;
        require(check_near(&saved.near, self.fine.columns.grid.size).is_ok(), "belongs to another terrain")?;
        if saved.near == self.near {
            saved.check(self)?;
            saved.apply(self);
            return Ok(());
        }
        // Its states fit the columns only with these near cells.
        let own = self.save();
        self.set_near(saved.near.clone())?;
        let result = saved.check(self);
        if result.is_ok() {
            saved.apply(self);
        } else {
            let own = Both::read(&own)?;
            self.set_near(own.near.clone())?;
            own.apply(self);
        }
        result
    }

    /// Saves the state into a vector, with capacity for the largest state that this liquid can have.
    pub(in crate::shallow) fn keep(&self, out: &mut Vec<u8>) {
        let most = [&self.fine, &self.coarse].map(Shallow::most_save_size);
        let rests = rest_bytes(self.scalars().len()) * self.rest.len();
        out.clear();
        out.reserve(HEADER + rests + 8 * self.seam.numbers().len() + most[0] + most[1] + SEAL);
        out.resize(self.save_size(), 0);
        self.write(out);
    }

    /// Restores a state that was saved from this liquid, with the same near cells.
    pub(in crate::shallow) fn put_back(&mut self, bytes: &[u8]) {
        let saved = Both::read(bytes);
        debug_assert!(saved.is_ok());
        saved.into_iter().for_each(|saved| saved.apply(self));
    }

    fn write(&self, out: &mut [u8]) {
        let size = out.len();
        let mut to = Put(&mut out[..size - SEAL]);
        let sizes = [self.fine.save_size(), self.coarse.save_size()];
        let [x, z] = &self.near;
        to.bytes(&BEGINNING.magic);
        to.numbers(&[BEGINNING.version, self.scalars().len() as u32], u32::to_le_bytes);
        to.bytes(&(size as u64).to_le_bytes());
        to.numbers(&[x.start, x.end, z.start, z.end].map(|at| at as u32), u32::to_le_bytes);
        let counts = [self.seam.numbers().len(), self.rest.iter().count()];
        to.numbers(&counts.map(|count| count as u32), u32::to_le_bytes);
        to.numbers(&sizes.map(|size| size as u64), u64::to_le_bytes);
        to.numbers(&[self.seam.last], f64::to_le_bytes);
        for (cell, load) in self.rest.iter() {
            to.numbers(&[cell as u32, 0], u32::to_le_bytes);
            to.bytes(&load.units.to_le_bytes());
            to.numbers(&load.amounts[..self.scalars().len()], i64::to_le_bytes);
        }
        self.seam.numbers().for_each(|numbers| to.numbers(&numbers, f32::to_le_bytes));
        for (liquid, size) in [&self.fine, &self.coarse].into_iter().zip(sizes) {
            liquid.write(&super::Counts::of(liquid), to.next(size));
        }
        debug_assert!(to.0.is_empty());
        seal(out);
    }
}

/// Bytes of a cell's rest, with so many scalars.
fn rest_bytes(scalars: usize) -> usize {
    16 + 8 * scalars
}

/// A complete state, in its parts.
struct Both<'a> {
    near: Cells,
    last: f64,
    /// In elements of the bytes of a cell's rest.
    rests: &'a [u8],
    scalars: usize,
    /// Flux and remainder.
    pipes: &'a [[u8; 4]],
    liquids: [Saved<'a>; 2],
}

impl<'a> Both<'a> {
    fn read(bytes: &'a [u8]) -> Result<Self> {
        let (header, body) = open::<HEADER>(bytes, &BEGINNING)?;
        let mut from = Reader::new(&header[12..]);
        let scalars = from.u32()? as usize;
        from.take::<8>()?;
        let mut count = || from.u32().map(|count| count as usize);
        let near = [count()?..count()?, count()?..count()?];
        let [pipes, rests] = [count()?, count()?];
        let sizes = [u64::from_le_bytes(from.take()?), u64::from_le_bytes(from.take()?)];
        let last = from.f64()?;
        require(scalars <= MAX_SCALARS, "is damaged")?;
        let fixed = (HEADER + rest_bytes(scalars) * rests + 8 * pipes + SEAL) as u64;
        let all = sizes[0].checked_add(sizes[1]).and_then(|sum| sum.checked_add(fixed));
        require(all == Some(bytes.len() as u64), "is damaged")?;
        let mut from = Reader::new(&body[HEADER..]);
        let rests = from.bytes(rest_bytes(scalars) * rests)?;
        let pipes = parts(&mut from, 2 * pipes)?;
        let [fine, coarse] = sizes.map(|size| size as usize);
        let liquids = [Saved::read(from.bytes(fine)?)?, Saved::read(from.bytes(coarse)?)?];
        Ok(Self { near, last, rests, scalars, pipes, liquids })
    }

    /// Checks that it belongs to this liquid, whose near cells are the same.
    fn check(&self, detail: &Detail) -> Result<()> {
        let [fine, coarse] = &self.liquids;
        fine.check(&detail.fine)?;
        coarse.check(&detail.coarse)?;
        let (flux, left) = (self.pipes.iter().step_by(2), self.pipes.iter().skip(1).step_by(2));
        let cells = self.rests().map(|(cell, _)| cell);
        let is_good = self.scalars == detail.scalars().len()
            && self.pipes.len() == 2 * detail.seam.numbers().len()
            && LAST.contains(&self.last)
            && !flux.copied().any(|flux| is_over(&[flux], MOST_FLUX))
            && !left.copied().any(|left| is_over(&[left], 1.0))
            && cells.clone().is_sorted_by(|a, b| a < b)
            && cells.last().is_none_or(|cell| cell < detail.rest.len())
            && self.rests().all(|(_, load)| {
                load.units >= 0
                    && load != Load::default()
                    && SUMS.contains(&load.units)
                    && load.amounts.iter().all(|amount| SUMS.contains(amount))
            });
        require(is_good, "is damaged")
    }

    fn rests(&self) -> impl Iterator<Item = (usize, Load)> + Clone {
        let (bytes, scalars) = (rest_bytes(self.scalars), self.scalars);
        self.rests.chunks_exact(bytes).map(move |rest| {
            let mut amounts = [0; MAX_SCALARS];
            for (at, amount) in amounts[..scalars].iter_mut().enumerate() {
                *amount = i64::from_le_bytes(part(rest, 16 + 8 * at));
            }
            let units = i64::from_le_bytes(part(rest, 8));
            (u32::from_le_bytes(part(rest, 0)) as usize, Load { units, amounts })
        })
    }

    /// Applies the state.
    fn apply(&self, detail: &mut Detail) {
        let [fine, coarse] = &self.liquids;
        fine.apply(&mut detail.fine);
        coarse.apply(&mut detail.coarse);
        detail.rest.clear();
        self.rests().for_each(|(cell, load)| detail.rest.set(cell, load));
        let numbers = self.pipes.as_chunks::<2>().0.iter().map(|pipe| pipe.map(f32::from_le_bytes));
        detail.seam.set_numbers(self.last, numbers);
    }
}
