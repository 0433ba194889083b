//! A layer as bytes, for a host's own cache: the difference from the layer before the first step, packed.
//!
//! Blocks are packed and unpacked in groups, in parallel. The narrow band's values of each block are stored exactly, with their bytes
//! sorted by significance before LZ4; data that can be computed from the snow itself (compression, heights, tiles) is not stored. The bytes
//! are the same for any number of threads.

use rayon::prelude::*;
use xxhash_rust::xxh3::{Xxh3, xxh3_64, xxh3_128};

use super::{BaseLayer, Changes, Params};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::numeric::blocks::{Block, BlockEdit, Mask, Origin, VOXELS, Values};
use crate::vdb::{FloatGrid, Leaf, Probe};

const MAGIC: [u8; 8] = *b"frz base";
const VERSION: u32 = 1;
/// Bytes before the groups.
const HEADER: usize = 80;
/// Blocks packed together.
const GROUP: usize = 256;
/// Maximum bytes of a block before packing: values and frames of every voxel, three masks, origin, kind.
const BLOCK: usize = 2 * 4 * VOXELS + 3 * 64 + 16;

/// How a block is stored; [`TOUCHED`] is added if it has frames of its last change.
const CONSTANT: u8 = 0;
/// The narrow band's values; all others are plus or minus the background.
const BAND: u8 = 1;
/// All 512 values.
const WHOLE: u8 = 2;
const TOUCHED: u8 = 4;

impl BaseLayer {
    /// The state between two steps, as bytes.
    ///
    /// # Errors
    /// Cancel; when memory runs out.
    pub fn save(&self, ctx: &Context) -> Result<Vec<u8>> {
        ctx.phase("save", || {
            let mut origins: Vec<Origin> = self.changed.iter().copied().collect();
            origins.par_sort_unstable();
            let surface = self.grids.surface.probe(&origins)?;
            let touched = self.grids.touched.probe(&origins)?;
            let background = self.grids.surface.background();
            let count = origins.len().div_ceil(GROUP);
            ctx.expect(count);
            let groups: Vec<Vec<u8>> = (0..count)
                .into_par_iter()
                .map(|group| {
                    ctx.check()?;
                    ctx.advance();
                    let range = group * GROUP..((group + 1) * GROUP).min(origins.len());
                    let [surface, touched] = [&surface, &touched].map(|probes| &probes[range.clone()]);
                    Ok(pack(&origins[range.clone()], surface, touched, background))
                })
                .collect::<Result<_>>()?;
            let mut bytes = self.header(groups.iter().map(Vec::len).sum());
            groups.iter().for_each(|group| bytes.extend_from_slice(group));
            let checksum = checksum(&bytes);
            bytes[HEADER - 16..HEADER].copy_from_slice(&checksum);
            Ok(bytes)
        })
    }

    /// Upper bound on the bytes of [`BaseLayer::save`].
    pub fn save_bound(&self) -> usize {
        let groups = self.changed.len().div_ceil(GROUP);
        HEADER + groups * (12 + lz4_flex::block::get_maximum_output_size(GROUP * BLOCK))
    }

    /// The layer that was saved; `initial` is the layer before the first step, as it was given to
    /// [`BaseLayer::new`].
    ///
    /// # Errors
    /// As [`BaseLayer::new`]; bytes that are damaged, of another version, or of another initial layer.
    pub fn restore(ctx: &Context, initial: FloatGrid, params: Params, state: &[u8]) -> Result<Self> {
        // Too few bytes are rejected by `unpack`.
        let volume = state.get(44..52).map(|bytes| f64::from_le_bytes(array(bytes)));
        let mut layer = Self::with_volume(ctx, initial, params, volume)?;
        let (surface, touched) = ctx.phase("unpack", || layer.unpack(ctx, state))?;
        let columns = ctx.phase("columns", || layer.new_columns(surface.iter().map(BlockEdit::origin)))?;
        let surfaces: Vec<&BlockEdit> = surface.iter().collect();
        let compression =
            ctx.phase("compression", || layer.compression_edits(ctx, &columns, &surfaces, &touched))?;
        let removed = super::empty_removed(layer.surface().voxel_size(), layer.half_width)?;
        let (before, volume) = (Vec::new(), layer.changes.volume);
        let changes = Changes { surface, touched, compression, before, removed, volume };
        layer.commit(ctx, changes, columns)?;
        // The restored state counts as unchanged.
        layer.take_changes()?;
        Ok(layer)
    }

    /// Offsets: 0 magic, 8 version, 12 blocks, 16 cell, 24 background, 28 initial layer, 44 volume, 52 number of bytes that follow, 60
    /// unused, 64 checksum.
    fn header(&self, following: usize) -> Vec<u8> {
        let mut out = Vec::with_capacity(HEADER + following);
        out.extend(MAGIC);
        out.extend(VERSION.to_le_bytes());
        out.extend((self.changed.len() as u32).to_le_bytes());
        out.extend(self.grids.surface.voxel_size().to_le_bytes());
        out.extend(self.grids.surface.background().to_le_bytes());
        out.extend(self.initial.to_le_bytes());
        out.extend(self.changes.volume.to_le_bytes());
        out.extend((following as u64).to_le_bytes());
        out.resize(HEADER, 0);
        out
    }

    /// The blocks of a state: the snow, and the frames of its last changes.
    fn unpack(&self, ctx: &Context, state: &[u8]) -> Result<(Vec<BlockEdit>, Vec<BlockEdit>)> {
        let refused = |what: &str| Error::Bytes(format!("the saved state {what}"));
        if state.len() < HEADER || state[..8] != MAGIC {
            return Err(refused("is not of a base layer"));
        }
        let version = u32::from_le_bytes(array(&state[8..12]));
        if version != VERSION {
            return Err(refused(&format!("has format {version}, this library reads {VERSION}")));
        }
        let following = u64::from_le_bytes(array(&state[52..60]));
        if following != (state.len() - HEADER) as u64 || checksum(state) != state[HEADER - 16..HEADER] {
            return Err(refused("is cut short or damaged"));
        }
        let same = state[16..24] == self.grids.surface.voxel_size().to_le_bytes()
            && state[24..28] == self.grids.surface.background().to_le_bytes()
            && state[28..44] == self.initial.to_le_bytes();
        if !same {
            return Err(refused("belongs to another initial layer"));
        }
        let damaged = || refused("is damaged");
        let mut reader = Reader(&state[HEADER..]);
        let mut groups = Vec::new();
        while !reader.0.is_empty() {
            let [blocks, length] = [reader.u32(), reader.u32()].map(|n| n.map(|n| n as usize));
            let packed = reader.take(length.ok_or_else(damaged)?).ok_or_else(damaged)?;
            groups.push((blocks.filter(|&blocks| blocks <= GROUP).ok_or_else(damaged)?, packed));
        }
        let background = self.grids.surface.background();
        let unpacked: Vec<(Vec<BlockEdit>, Vec<BlockEdit>)> = groups
            .into_par_iter()
            .map(|(blocks, packed)| {
                ctx.check()?;
                let raw = lz4_flex::block::decompress(packed, blocks * BLOCK).map_err(|_| damaged())?;
                read_group(&mut Reader(&raw), blocks, background).ok_or_else(damaged)
            })
            .collect::<Result<_>>()?;
        let (surface, touched): (Vec<_>, Vec<_>) = unpacked.into_iter().unzip();
        Ok((surface.into_iter().flatten().collect(), touched.into_iter().flatten().collect()))
    }
}

/// Hash of a layer's leaves, which identifies it.
pub fn fingerprint(surface: &FloatGrid) -> Result<u128> {
    let leaf = |leaf: &Leaf<'_>| {
        let mut bytes = [0u8; 12 + 4 * VOXELS + 64];
        let (origin, rest) = bytes.split_at_mut(12);
        let (values, mask) = rest.split_at_mut(4 * VOXELS);
        origin
            .chunks_exact_mut(4)
            .zip(leaf.origin)
            .for_each(|(to, from)| to.copy_from_slice(&from.to_le_bytes()));
        values
            .chunks_exact_mut(4)
            .zip(leaf.values)
            .for_each(|(to, from)| to.copy_from_slice(&from.to_le_bytes()));
        mask.chunks_exact_mut(8)
            .zip(leaf.mask)
            .for_each(|(to, from)| to.copy_from_slice(&from.to_le_bytes()));
        xxh3_64(&bytes)
    };
    let leaves: Vec<u64> = surface.leaves()?.par_iter().map(leaf).collect();
    Ok(xxh3_128(&leaves.iter().flat_map(|hash| hash.to_le_bytes()).collect::<Vec<u8>>()))
}

/// Hash of the state except its own 16 bytes.
fn checksum(state: &[u8]) -> [u8; 16] {
    let mut hash = Xxh3::new();
    hash.update(&state[..HEADER - 16]);
    hash.update(&state[HEADER..]);
    hash.digest128().to_le_bytes()
}

/// A group, preceded by its number of blocks and its length.
fn pack(origins: &[Origin], surface: &[Probe<'_>], touched: &[Probe<'_>], background: f32) -> Vec<u8> {
    let packed = lz4_flex::block::compress(&write_group(origins, surface, touched, background));
    let mut out = Vec::with_capacity(8 + packed.len());
    out.extend((origins.len() as u32).to_le_bytes());
    out.extend((packed.len() as u32).to_le_bytes());
    out.extend(packed);
    out
}

fn write_group(origins: &[Origin], surface: &[Probe<'_>], touched: &[Probe<'_>], background: f32) -> Vec<u8> {
    let (mut head, mut masks) = (Vec::new(), Vec::new());
    let (mut values, mut frames) = (Vec::new(), Vec::new());
    let mut put_mask = |mask: &Mask| masks.extend(mask.iter().flat_map(|word| word.to_le_bytes()));
    for ((origin, surface), touched) in origins.iter().zip(surface).zip(touched) {
        let marked = matches!(touched, Probe::Leaf(_));
        let kind = match surface {
            Probe::Tile { .. } => CONSTANT,
            Probe::Leaf(leaf) if is_band(leaf, background) => BAND,
            Probe::Leaf(_) => WHOLE,
        };
        head.extend(origin.iter().flat_map(|index| index.to_le_bytes()));
        head.push(kind | if marked { TOUCHED } else { 0 });
        match surface {
            Probe::Tile { value, .. } => values.push(*value),
            Probe::Leaf(leaf) => {
                put_mask(leaf.mask);
                if kind == BAND {
                    put_mask(&std::array::from_fn(|x| {
                        (0..64).fold(0, |word, at| word | negative(leaf, x, at))
                    }));
                    values.extend(active(leaf.mask).map(|index| leaf.values[index]));
                } else {
                    values.extend(leaf.values);
                }
            }
        }
        if let Probe::Leaf(leaf) = touched {
            put_mask(leaf.mask);
            frames.extend(active(leaf.mask).map(|index| leaf.values[index]));
        }
    }
    let mut out = head;
    out.append(&mut masks);
    for numbers in [&values, &frames] {
        for byte in (0..4).rev() {
            out.extend(numbers.iter().map(|number| number.to_le_bytes()[byte]));
        }
    }
    out
}

/// Bits of inactive values that are negative.
fn negative(leaf: &Leaf<'_>, x: usize, at: usize) -> u64 {
    u64::from(leaf.mask[x] >> at & 1 == 0 && leaf.values[x << 6 | at] < 0.0) << at
}

/// Whether all inactive values are plus or minus the background.
fn is_band(leaf: &Leaf<'_>, background: f32) -> bool {
    leaf.mask.iter().zip(leaf.values.chunks_exact(64)).all(|(&word, values)| {
        let other = |at: usize| u64::from(values[at].abs() != background) << at;
        (0..64).fold(0, |others, at| others | other(at)) & !word == 0
    })
}

/// Indices of the bits that are set in a mask, ascending.
fn active(mask: &Mask) -> impl Iterator<Item = usize> + '_ {
    mask.iter().enumerate().flat_map(|(x, &word)| {
        std::iter::successors((word != 0).then_some(word), |word| {
            Some(word & (word - 1)).filter(|left| *left != 0)
        })
        .map(move |word| x << 6 | word.trailing_zeros() as usize)
    })
}

/// Reads what [`write_group`] wrote; none if the bytes are invalid.
fn read_group(
    reader: &mut Reader<'_>,
    blocks: usize,
    background: f32,
) -> Option<(Vec<BlockEdit>, Vec<BlockEdit>)> {
    let heads: Vec<(Origin, u8)> = (0..blocks)
        .map(|_| {
            let origin = [reader.u32()?, reader.u32()?, reader.u32()?].map(|index| index as i32);
            Some((origin, reader.take(1)?[0]))
        })
        .collect::<Option<_>>()?;
    if heads.iter().any(|(origin, kind)| kind & !TOUCHED > WHOLE || origin.iter().any(|index| index & 7 != 0))
    {
        return None;
    }
    let (mut value_count, mut frame_count) = (0, 0);
    let mut all_masks = Vec::with_capacity(blocks);
    for (_, kind) in &heads {
        let mut mask = |wanted: bool| if wanted { reader.mask() } else { Some([0; 8]) };
        let (plain, touched) = (kind & !TOUCHED, kind & TOUCHED != 0);
        let masks = [mask(plain != CONSTANT)?, mask(plain == BAND)?, mask(touched)?];
        value_count += match plain {
            CONSTANT => 1,
            BAND => count(&masks[0]),
            _ => VOXELS,
        };
        frame_count += count(&masks[2]);
        all_masks.push(masks);
    }
    let values = reader.numbers(value_count)?;
    let frames = reader.numbers(frame_count)?;
    let (mut values, mut frames) = (values.as_slice(), frames.as_slice());
    let (mut surface, mut touched) = (Vec::with_capacity(blocks), Vec::with_capacity(blocks));
    for (&(origin, kind), [mask, signs, marked]) in heads.iter().zip(all_masks) {
        surface.push(match kind & !TOUCHED {
            CONSTANT => BlockEdit::Constant(origin, values.split_off_first().copied()?),
            BAND => {
                let sign = |index: usize| signs[index >> 6] >> (index & 63) & 1 == 1;
                let mut all =
                    Box::new(std::array::from_fn(|index| if sign(index) { -background } else { background }));
                put(&mut all, &mask, &mut values);
                BlockEdit::Dense(Block { origin, values: all, mask })
            }
            _ => {
                let all = Box::new(*values.split_off(..VOXELS)?.first_chunk()?);
                BlockEdit::Dense(Block { origin, values: all, mask })
            }
        });
        touched.push(if kind & TOUCHED == 0 {
            BlockEdit::Constant(origin, 0.0)
        } else {
            let mut all = Box::new([0.0; VOXELS]);
            put(&mut all, &marked, &mut frames);
            BlockEdit::Dense(Block { origin, values: all, mask: marked })
        });
    }
    reader.0.is_empty().then_some((surface, touched))
}

/// Moves numbers from the front of `numbers` to the voxels of the mask.
fn put(values: &mut Values, mask: &Mask, numbers: &mut &[f32]) {
    let (taken, rest) = numbers.split_at(count(mask));
    let mut at = 0;
    active(mask).for_each(|index| {
        values[index] = taken[at];
        at += 1;
    });
    *numbers = rest;
}

fn count(mask: &Mask) -> usize {
    mask.iter().map(|word| word.count_ones() as usize).sum()
}

/// Bytes that are consumed from the front.
struct Reader<'a>(&'a [u8]);

impl<'a> Reader<'a> {
    fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (taken, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(taken)
    }

    fn u32(&mut self) -> Option<u32> {
        Some(u32::from_le_bytes(array(self.take(4)?)))
    }

    fn mask(&mut self) -> Option<Mask> {
        let bytes = self.take(64)?;
        Some(std::array::from_fn(|x| u64::from_le_bytes(array(&bytes[8 * x..8 * x + 8]))))
    }

    /// Numbers whose bytes are sorted by significance, the highest first.
    fn numbers(&mut self, count: usize) -> Option<Vec<f32>> {
        let [a, b, c, d] = [self.take(count)?, self.take(count)?, self.take(count)?, self.take(count)?];
        Some((0..count).map(|index| f32::from_be_bytes([a[index], b[index], c[index], d[index]])).collect())
    }
}

/// A slice of known length as an array.
fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
    bytes.try_into().expect("the slice has this length")
}
