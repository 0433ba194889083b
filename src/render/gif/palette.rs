//! The colours of a GIF, chosen from pictures, and pictures in these colours.

use rayon::prelude::*;

use crate::context::Context;
use crate::error::{Error, Result};
use crate::render::picture::Picture;

/// Maximum number of colours: one index of a byte is left for unchanged pixels.
const MOST: usize = 255;
/// Bits of a channel by which pixels are counted...
const COUNTED_BITS: u32 = 6;
/// ...and by which the nearest colour is looked up.
const LOOKED_UP_BITS: u32 = 7;
/// How much differences in red, green and blue matter to the eye.
const WEIGHTS: [i32; 3] = [2, 4, 3];
/// Iterations in which colours move to the mean of the bins nearest to them.
const ROUNDS: usize = 6;
/// Edge of the threshold pattern (pixels).
const PATTERN: usize = 8;
/// Maximum change of a channel by the pattern, from end to end.
const MOST_DITHER: f64 = 12.0;

/// Colours for a flipbook.
pub struct Palette {
    colours: Vec<[u8; 3]>,
    /// The nearest colour of each cell of the colour cube.
    nearest: Vec<u8>,
    /// How much the pattern changes a channel, from end to end.
    dither: f64,
}

/// Pixels of about the same colour.
#[derive(Clone, Copy)]
struct Bin {
    colour: [f64; 3],
    weight: f64,
}

impl Palette {
    /// At most 255 colours that fit pictures, the same with any number of threads.
    ///
    /// # Errors
    /// Cancel.
    pub fn of(ctx: &Context, pictures: &[Picture]) -> Result<Self> {
        ctx.phase("palette", || {
            let bins = count(pictures);
            let mut colours = split(bins.clone());
            for _ in 0..ROUNDS {
                ctx.check()?;
                colours = moved(&bins, &colours);
            }
            let mut colours: Vec<[u8; 3]> = colours
                .iter()
                .map(|colour| colour.map(|value| value.round().clamp(0.0, 255.0) as u8))
                .collect();
            colours.sort_unstable();
            colours.dedup();
            let nearest = look_up(ctx, &colours)?;
            Ok(Self { dither: spacing(&colours).min(MOST_DITHER), colours, nearest })
        })
    }

    /// Its colours (sRGB).
    pub fn colours(&self) -> &[[u8; 3]] {
        &self.colours
    }

    /// For each pixel of a picture the index of a colour. A fixed threshold pattern mixes neighbouring colours, so that parts of a flipbook
    /// that stand still do not flicker.
    pub fn indices(&self, ctx: &Context, picture: &Picture) -> Vec<u8> {
        let width = picture.size.width as usize;
        let mut out = vec![0; width * picture.size.height as usize];
        let rows = picture.rgb.par_chunks(3 * width).zip(out.par_chunks_mut(width)).enumerate();
        let find = |(y, (pixels, row)): (usize, (&[u8], &mut [u8]))| {
            for (x, (pixel, index)) in pixels.as_chunks::<3>().0.iter().zip(row).enumerate() {
                let shift = (self.dither * threshold(x % PATTERN, y % PATTERN)).round() as i32;
                *index =
                    self.nearest[cell(pixel.map(|value| (i32::from(value) + shift).clamp(0, 255) as u8))];
            }
        };
        ctx.pool().install(|| rows.for_each(find));
        out
    }
}

/// The cell of a colour in the cube in which the nearest colours are looked up.
fn cell(colour: [u8; 3]) -> usize {
    colour.iter().fold(0, |cell, value| cell << LOOKED_UP_BITS | usize::from(*value) >> (8 - LOOKED_UP_BITS))
}

/// Pixels by colour, in the order of the colours. Many pixels of one colour count less than as many of several: the sky is large and
/// uniform.
fn count(pictures: &[Picture]) -> Vec<Bin> {
    let shift = 8 - COUNTED_BITS;
    let mut bins = vec![([0u64; 3], 0u64); 1 << (3 * COUNTED_BITS)];
    for pixel in pictures.iter().flat_map(|picture| picture.rgb.as_chunks::<3>().0) {
        let position =
            pixel.iter().fold(0, |position, value| position << COUNTED_BITS | usize::from(*value) >> shift);
        let (sums, count) = &mut bins[position];
        sums.iter_mut().zip(pixel).for_each(|(sum, value)| *sum += u64::from(*value));
        *count += 1;
    }
    let filled = bins.into_iter().filter(|(_, count)| *count > 0);
    let bin = |(sums, count): ([u64; 3], u64)| Bin {
        colour: sums.map(|sum| sum as f64 / count as f64),
        weight: (count as f64).sqrt(),
    };
    filled.map(bin).collect()
}

/// Means of groups of bins, which are split where they differ most until there are enough.
fn split(bins: Vec<Bin>) -> Vec<[f64; 3]> {
    if bins.is_empty() {
        return Vec::new();
    }
    let group = |bins: Vec<Bin>| {
        let spread = Spread::of(&bins);
        (bins, spread)
    };
    let mut groups = vec![group(bins)];
    while groups.len() < MOST {
        let wider = |best: usize, n: usize| if groups[n].1.amount > groups[best].1.amount { n } else { best };
        let widest = (0..groups.len()).fold(0, wider);
        let Spread { mean, axis, amount } = groups[widest].1;
        if amount <= 0.0 {
            break;
        }
        let bins = std::mem::take(&mut groups[widest].0);
        let (low, high): (Vec<Bin>, Vec<Bin>) =
            bins.into_iter().partition(|bin| bin.colour[axis] < mean[axis]);
        // Rounding may leave a side empty: such a group is as good as one colour.
        if low.is_empty() || high.is_empty() {
            groups[widest].1.amount = 0.0;
            continue;
        }
        groups[widest] = group(low);
        groups.push(group(high));
    }
    groups.iter().map(|(_, spread)| spread.mean).collect()
}

/// How far the colours of a group spread.
#[derive(Clone, Copy)]
struct Spread {
    mean: [f64; 3],
    /// The channel along which it is largest.
    axis: usize,
    /// Sum of the squared distances from the mean along this channel; 0 for one colour.
    amount: f64,
}

impl Spread {
    fn of(bins: &[Bin]) -> Self {
        let weight: f64 = bins.iter().map(|bin| bin.weight).sum();
        let mean =
            [0, 1, 2].map(|axis| bins.iter().map(|bin| bin.weight * bin.colour[axis]).sum::<f64>() / weight);
        let amounts = [0, 1, 2].map(|axis| {
            let off = bins.iter().map(|bin| (bin.colour[axis] - mean[axis], bin.weight));
            f64::from(WEIGHTS[axis]) * off.map(|(off, weight)| weight * off * off).sum::<f64>()
        });
        let axis = (0..3).fold(0, |best, axis| if amounts[axis] > amounts[best] { axis } else { best });
        let amount = if bins.len() < 2 { 0.0 } else { amounts[axis] };
        Self { mean, axis, amount }
    }
}

/// Colours moved to the mean of the bins nearest to each; a colour that is nearest to none stays.
fn moved(bins: &[Bin], colours: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let distance = |a: &[f64; 3], b: &[f64; 3]| {
        (0..3).map(|axis| f64::from(WEIGHTS[axis]) * (a[axis] - b[axis]) * (a[axis] - b[axis])).sum::<f64>()
    };
    let nearest: Vec<usize> = bins
        .par_iter()
        .map(|bin| {
            let apart = colours.iter().map(|colour| distance(&bin.colour, colour)).enumerate();
            apart.fold((0, f64::INFINITY), |best, next| if next.1 < best.1 { next } else { best }).0
        })
        .collect();
    let mut sums = vec![([0.0; 3], 0.0); colours.len()];
    for (bin, nearest) in bins.iter().zip(nearest) {
        let (sum, weight) = &mut sums[nearest];
        (0..3).for_each(|axis| sum[axis] += bin.weight * bin.colour[axis]);
        *weight += bin.weight;
    }
    let mean = |((sum, weight), colour): (&([f64; 3], f64), &[f64; 3])| {
        if *weight > 0.0 { sum.map(|sum| sum / weight) } else { *colour }
    };
    sums.iter().zip(colours).map(mean).collect()
}

/// The nearest colour of each cell of the colour cube, by the cell's middle.
fn look_up(ctx: &Context, colours: &[[u8; 3]]) -> Result<Vec<u8>> {
    let edge = 1usize << LOOKED_UP_BITS;
    let mut out = vec![0; edge * edge * edge];
    out.par_chunks_mut(edge * edge).enumerate().try_for_each(|(red, slice)| {
        ctx.check()?;
        for (position, nearest) in slice.iter_mut().enumerate() {
            let cell = [red, position / edge, position % edge];
            let middle = cell.map(|at| ((2 * at + 1) << (7 - LOOKED_UP_BITS)) as i32);
            let mut best = (0, i32::MAX);
            for (index, colour) in colours.iter().enumerate() {
                let off = [0, 1, 2].map(|axis| middle[axis] - i32::from(colour[axis]));
                let apart: i32 = (0..3).map(|axis| WEIGHTS[axis] * off[axis] * off[axis]).sum();
                if apart < best.1 {
                    best = (index, apart);
                }
            }
            *nearest = best.0 as u8;
        }
        Ok::<(), Error>(())
    })?;
    Ok(out)
}

/// Mean distance (levels of a channel) between a colour and the nearest other.
fn spacing(colours: &[[u8; 3]]) -> f64 {
    let apart = |a: &[u8; 3], b: &[u8; 3]| {
        let off = [0, 1, 2].map(|axis| i32::from(a[axis]) - i32::from(b[axis]));
        off.iter().map(|off| off * off).sum::<i32>()
    };
    let nearest = colours.iter().enumerate().filter_map(|(n, colour)| {
        let others = colours.iter().enumerate().filter(|(other, _)| *other != n);
        others.map(|(_, other)| apart(colour, other)).min()
    });
    let (sum, count) =
        nearest.fold((0.0, 0), |(sum, count), apart| (sum + f64::from(apart).sqrt(), count + 1));
    if count == 0 { 0.0 } else { sum / f64::from(count) / 3.0f64.sqrt() }
}

/// The ordered pattern of thresholds (Bayer 1973), -0.5 to 0.5.
fn threshold(x: usize, y: usize) -> f64 {
    let (mut rank, mut bits) = (0, [x ^ y, y]);
    for _ in 0..3 {
        rank = rank << 2 | (bits[0] & 1) << 1 | bits[1] & 1;
        bits = bits.map(|bits| bits >> 1);
    }
    (rank as f64 + 0.5) / (PATTERN * PATTERN) as f64 - 0.5
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Pool;
    use crate::render::Size;

    fn ctx(threads: usize) -> Context {
        Context::new(Pool::new(threads).unwrap())
    }

    /// A picture of 64 x 64 pixels.
    fn picture(colour: impl Fn(usize, usize) -> [u8; 3]) -> Picture {
        let pixels = (0..64).flat_map(|y| (0..64).map(move |x| (x, y)));
        Picture {
            size: Size { width: 64, height: 64 },
            rgb: pixels.flat_map(|(x, y)| colour(x, y)).collect(),
        }
    }

    #[test]
    fn few_colours_are_kept_as_they_are() {
        let picture = picture(|x, y| {
            if x < 20 {
                [250, 251, 255]
            } else if y < 9 {
                [90, 40, 20]
            } else {
                [0, 0, 0]
            }
        });
        let ctx = ctx(1);
        let palette = Palette::of(&ctx, std::slice::from_ref(&picture)).unwrap();
        assert_eq!(palette.colours(), [[0, 0, 0], [90, 40, 20], [250, 251, 255]]);
        let seen: Vec<u8> = palette
            .indices(&ctx, &picture)
            .iter()
            .flat_map(|index| palette.colours()[usize::from(*index)])
            .collect();
        assert_eq!(seen, picture.rgb);
    }

    #[test]
    fn a_gradient_stays_one() {
        let picture = picture(|x, y| [(2 * x + y) as u8, (3 * x + y) as u8, (60 + x + 2 * y) as u8]);
        let ctx = ctx(1);
        let palette = Palette::of(&ctx, std::slice::from_ref(&picture)).unwrap();
        assert!((200..=MOST).contains(&palette.colours().len()));
        let indices = palette.indices(&ctx, &picture);
        // The mean over the pattern is nearly the picture's.
        for corner in (0..56).step_by(8).flat_map(|y| (0..56).step_by(8).map(move |x| [x, y])) {
            let mut off = [0i32; 3];
            for at in (0..64).map(|n| (corner[1] + n / 8) * 64 + corner[0] + n % 8) {
                let colour = palette.colours()[usize::from(indices[at])];
                (0..3).for_each(|axis| {
                    off[axis] += i32::from(colour[axis]) - i32::from(picture.rgb[3 * at + axis]);
                });
            }
            assert!(off.iter().all(|off| off.abs() < 4 * 64), "{corner:?}: {off:?}");
        }
    }

    #[test]
    fn colours_do_not_depend_on_threads() {
        let picture = picture(|x, y| [(x * y % 251) as u8, (x * 5 % 256) as u8, (y * 7 % 256) as u8]);
        let [one, four] = [1, 4].map(|threads| {
            let ctx = ctx(threads);
            let palette = Palette::of(&ctx, std::slice::from_ref(&picture)).unwrap();
            let indices = palette.indices(&ctx, &picture);
            (palette.colours, palette.nearest, indices)
        });
        assert!(one == four);
    }

    #[test]
    fn the_pattern_has_each_threshold_once() {
        let mut all: Vec<f64> = (0..64).map(|n| threshold(n % 8, n / 8) * 64.0 + 31.5).collect();
        all.sort_by(f64::total_cmp);
        assert!(all.iter().zip(0..).all(|(at, n)| (at - f64::from(n)).abs() < 1e-9), "{all:?}");
    }
}
