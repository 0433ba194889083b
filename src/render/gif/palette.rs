//! The colours of a GIF, chosen from pictures, and pictures in these colours.

use rayon::prelude::*;

use crate::context::Context;
use crate::error::{Error, Result};
use crate::render::picture::Picture;

/// Maximum number of colours: one index of a byte is left for unchanged pixels.
const MAX_COLOURS: usize = 255;
/// Bits of a channel in the histogram of pixels.
const COUNTED_BITS: u32 = 6;
/// Bits of a channel in the table of nearest colours.
const LOOKUP_BITS: u32 = 7;
/// Weights of squared differences in red, green and blue, by how visible they are.
const WEIGHTS: [i32; 3] = [2, 4, 3];
/// Iterations of k-means that improve the colours.
const ITERATIONS: usize = 6;
/// Edge of the dither matrix (pixels).
const MATRIX: usize = 8;
/// Maximum range of the change of a channel by dithering.
const MAX_DITHER: f64 = 12.0;

/// Colours for a flipbook.
pub struct Palette {
    colours: Vec<[u8; 3]>,
    /// The nearest colour of each cell of the colour cube.
    nearest: Vec<u8>,
    /// Range of the change of a channel by dithering.
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
            for _ in 0..ITERATIONS {
                ctx.check()?;
                colours = k_means_step(&bins, &colours);
            }
            let mut colours: Vec<[u8; 3]> = colours
                .iter()
                .map(|colour| colour.map(|value| value.round().clamp(0.0, 255.0) as u8))
                .collect();
            colours.sort_unstable();
            colours.dedup();
            let nearest = nearest_colours(ctx, &colours)?;
            Ok(Self { dither: spacing(&colours).min(MAX_DITHER), colours, nearest })
        })
    }

    /// Its colours (sRGB).
    pub fn colours(&self) -> &[[u8; 3]] {
        &self.colours
    }

    /// The index of a colour for each pixel of a picture. Colours are mixed by ordered dithering, whose pattern is fixed, so that parts
    /// of a flipbook that stand still do not flicker.
    pub fn indices(&self, ctx: &Context, picture: &Picture) -> Vec<u8> {
        let width = picture.size.width as usize;
        let mut out = vec![0; width * picture.size.height as usize];
        let rows = picture.rgb.par_chunks(3 * width).zip(out.par_chunks_mut(width)).enumerate();
        let find = |(y, (pixels, row)): (usize, (&[u8], &mut [u8]))| {
            for (x, (pixel, index)) in pixels.as_chunks::<3>().0.iter().zip(row).enumerate() {
                let shift = (self.dither * threshold(x % MATRIX, y % MATRIX)).round() as i32;
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
    colour.iter().fold(0, |cell, value| cell << LOOKUP_BITS | usize::from(*value) >> (8 - LOOKUP_BITS))
}

/// The histogram of pixels. Weights are square roots of counts, so that a large uniform area such as the sky gets fewer colours.
fn count(pictures: &[Picture]) -> Vec<Bin> {
    let shift = 8 - COUNTED_BITS;
    let mut bins = vec![([0u64; 3], 0u64); 1 << (3 * COUNTED_BITS)];
    for pixel in pictures.iter().flat_map(|picture| picture.rgb.as_chunks::<3>().0) {
        let bin = pixel.iter().fold(0, |bin, value| bin << COUNTED_BITS | usize::from(*value) >> shift);
        let (sums, count) = &mut bins[bin];
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

/// Splits the bins into groups, always the one with the largest variance along its widest channel; returns the means of the groups.
fn split(bins: Vec<Bin>) -> Vec<[f64; 3]> {
    if bins.is_empty() {
        return Vec::new();
    }
    let group = |bins: Vec<Bin>| {
        let spread = Spread::of(&bins);
        (bins, spread)
    };
    let mut groups = vec![group(bins)];
    while groups.len() < MAX_COLOURS {
        let wider =
            |best: usize, n: usize| if groups[n].1.variance > groups[best].1.variance { n } else { best };
        let widest = (0..groups.len()).fold(0, wider);
        let Spread { mean, axis, variance } = groups[widest].1;
        if variance <= 0.0 {
            break;
        }
        let bins = std::mem::take(&mut groups[widest].0);
        let (low, high): (Vec<Bin>, Vec<Bin>) =
            bins.into_iter().partition(|bin| bin.colour[axis] < mean[axis]);
        // Rounding may leave a side empty: such a group is as good as one colour.
        if low.is_empty() || high.is_empty() {
            groups[widest].1.variance = 0.0;
            continue;
        }
        groups[widest] = group(low);
        groups.push(group(high));
    }
    groups.iter().map(|(_, spread)| spread.mean).collect()
}

/// Mean and variance of the colours of a group.
#[derive(Clone, Copy)]
struct Spread {
    mean: [f64; 3],
    /// The channel with the largest variance.
    axis: usize,
    /// Weighted sum of squared distances from the mean along this channel; 0 for one colour.
    variance: f64,
}

impl Spread {
    fn of(bins: &[Bin]) -> Self {
        let weight: f64 = bins.iter().map(|bin| bin.weight).sum();
        let mean =
            [0, 1, 2].map(|axis| bins.iter().map(|bin| bin.weight * bin.colour[axis]).sum::<f64>() / weight);
        let variances = [0, 1, 2].map(|axis| {
            let off = bins.iter().map(|bin| (bin.colour[axis] - mean[axis], bin.weight));
            f64::from(WEIGHTS[axis]) * off.map(|(off, weight)| weight * off * off).sum::<f64>()
        });
        let axis = (0..3).fold(0, |best, axis| if variances[axis] > variances[best] { axis } else { best });
        let variance = if bins.len() < 2 { 0.0 } else { variances[axis] };
        Self { mean, axis, variance }
    }
}

/// Moves each colour to the mean of the bins nearest to it; a colour that is nearest to none stays.
fn k_means_step(bins: &[Bin], colours: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let distance = |a: &[f64; 3], b: &[f64; 3]| {
        (0..3).map(|axis| f64::from(WEIGHTS[axis]) * (a[axis] - b[axis]) * (a[axis] - b[axis])).sum::<f64>()
    };
    let nearest: Vec<usize> = bins
        .par_iter()
        .map(|bin| {
            let distances = colours.iter().map(|colour| distance(&bin.colour, colour)).enumerate();
            distances.fold((0, f64::INFINITY), |best, next| if next.1 < best.1 { next } else { best }).0
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
fn nearest_colours(ctx: &Context, colours: &[[u8; 3]]) -> Result<Vec<u8>> {
    let edge = 1usize << LOOKUP_BITS;
    let mut out = vec![0; edge * edge * edge];
    out.par_chunks_mut(edge * edge).enumerate().try_for_each(|(red, slice)| {
        ctx.check()?;
        for (index, nearest) in slice.iter_mut().enumerate() {
            let cell = [red, index / edge, index % edge];
            let middle = cell.map(|at| ((2 * at + 1) << (7 - LOOKUP_BITS)) as i32);
            let mut best = (0, i32::MAX);
            for (index, colour) in colours.iter().enumerate() {
                let off = [0, 1, 2].map(|axis| middle[axis] - i32::from(colour[axis]));
                let distance: i32 = (0..3).map(|axis| WEIGHTS[axis] * off[axis] * off[axis]).sum();
                if distance < best.1 {
                    best = (index, distance);
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
    let distance = |a: &[u8; 3], b: &[u8; 3]| {
        let off = [0, 1, 2].map(|axis| i32::from(a[axis]) - i32::from(b[axis]));
        off.iter().map(|off| off * off).sum::<i32>()
    };
    let nearest = colours.iter().enumerate().filter_map(|(n, colour)| {
        let others = colours.iter().enumerate().filter(|(other, _)| *other != n);
        others.map(|(_, other)| distance(colour, other)).min()
    });
    let (sum, count) =
        nearest.fold((0.0, 0), |(sum, count), distance| (sum + f64::from(distance).sqrt(), count + 1));
    if count == 0 { 0.0 } else { sum / f64::from(count) / 3.0f64.sqrt() }
}

/// The matrix of ordered dithering (Bayer 1973), -0.5 to 0.5.
fn threshold(x: usize, y: usize) -> f64 {
    let (mut rank, mut bits) = (0, [x ^ y, y]);
    for _ in 0..3 {
        rank = rank << 2 | (bits[0] & 1) << 1 | bits[1] & 1;
        bits = bits.map(|bits| bits >> 1);
    }
    (rank as f64 + 0.5) / (MATRIX * MATRIX) as f64 - 0.5
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
        assert!((200..=MAX_COLOURS).contains(&palette.colours().len()));
        let indices = palette.indices(&ctx, &picture);
        // The mean over the matrix is nearly the picture's.
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
    fn the_matrix_has_each_threshold_once() {
        let mut all: Vec<f64> = (0..64).map(|n| threshold(n % 8, n / 8) * 64.0 + 31.5).collect();
        all.sort_by(f64::total_cmp);
        assert!(all.iter().zip(0..).all(|(at, n)| (at - f64::from(n)).abs() < 1e-9), "{all:?}");
    }
}
