//! Solids of height fields: each cell is solid from its height down to [`BOTTOMLESS`].

use super::Solids;
use crate::error::{Error, Result};
use crate::numeric::checks::ensure;
use crate::shallow::columns::grid::{BOTTOMLESS, Grid, Heights};

/// One solid per cell, from heights (m) at the centres of the cells, row by row along x (`Grid::index`). Heights are clamped to the range.
///
/// # Errors
/// `Argument`: a grid that [`Grid::validate`] refuses, a count of heights that is not that of cells, a height that is not finite.
pub fn solids(tops: impl ExactSizeIterator<Item = f64>, grid: Grid, heights: Heights) -> Result<Solids> {
    grid.validate()?;
    let [nx, nz] = grid.size;
    if tops.len() != grid.cells() {
        return Err(Error::argument(format!("{} heights are not those of {nx} x {nz} cells", tops.len())));
    }
    let mut out = Solids::empty(grid, heights);
    for (index, top) in tops.enumerate() {
        if !top.is_finite() {
            let (x, z) = (index % nx, index / nx);
            return Err(Error::argument(format!("the height of cell ({x}, {z}) is not finite")));
        }
        out.push(&[[BOTTOMLESS, heights.round(top)]]);
    }
    Ok(out)
}

/// One solid per cell, from an image of heights.
///
/// # Errors
/// `Argument`: as [`solids`] and [`Image::validate`].
pub fn of_image(image: &Image<'_>, grid: Grid, heights: Heights) -> Result<Solids> {
    image.validate()?;
    grid.validate()?;
    let nx = grid.size[0];
    let tops = (0..grid.cells()).map(|index| image.height(grid.centre([index % nx, index / nx])));
    solids(tops, grid, heights)
}

/// A grey image that lies in the (x, z) plane, whose values are heights.
#[derive(Debug, Clone, Copy)]
pub struct Image<'a> {
    /// Values of the pixels, row by row along x, the first row at the minimum z: 0 is black and 1 is white.
    pub greys: &'a [f32],
    /// Count of pixels along x and along z.
    pub size: [usize; 2],
    /// The corner with the minimum x and z (m).
    pub corner: [f64; 2],
    /// Length along x and along z (m).
    pub extent: [f64; 2],
    /// Heights (m) of black and of white.
    pub levels: [f64; 2],
}

impl Image<'_> {
    /// Checks the numbers.
    ///
    /// # Errors
    /// `Argument`: no pixel, a count of values that is not that of pixels, a value that is not finite, an extent that is not a positive
    /// length, a corner or level that is not finite.
    pub fn validate(&self) -> Result<()> {
        let ([width, height], count) = (self.size, self.greys.len());
        ensure(
            width > 0 && height > 0 && width.checked_mul(height) == Some(count),
            format_args!("{count} values are not an image of {width} x {height} pixels"),
        )?;
        if let Some(index) = self.greys.iter().position(|grey| !grey.is_finite()) {
            let (x, z) = (index % width, index / width);
            return Err(Error::argument(format!("pixel ({x}, {z}) of the image is not finite")));
        }
        let [x, z] = self.extent;
        if !(x > 0.0 && z > 0.0 && x.is_finite() && z.is_finite()) {
            return Err(Error::argument(format!("an image of {x} x {z} m is not an area")));
        }
        if let Some(wild) = self.corner.iter().chain(&self.levels).find(|value| !value.is_finite()) {
            return Err(Error::argument(format!("{wild} m is neither a corner nor a level of an image")));
        }
        Ok(())
    }

    /// Height (m) at a position, bilinear between the centres of pixels and constant beyond the outermost ones. Mirroring image and
    /// position about the image's middle, or rotating both by 90 degrees, gives the same bits.
    pub fn height(&self, at: [f64; 2]) -> f64 {
        let [x, z] = [0, 1].map(|axis| self.beside(axis, at[axis]));
        let grey = |x: usize, z: usize| f64::from(self.greys[z * self.size[0] + x]);
        let greys = [0, 1].map(|j| [0, 1].map(|i| grey(x[i].0, z[j].0)));
        let min = greys.as_flattened().iter().fold(f64::INFINITY, |min, grey| min.min(*grey));
        // Differences from the minimum, so that a uniform image stays uniform.
        let part = |i: usize, j: usize| x[i].1 * z[j].1 * (greys[j][i] - min);
        let grey = min + ((part(0, 0) + part(1, 1)) + (part(1, 0) + part(0, 1)));
        let [black, white] = self.levels;
        black + grey * (white - black)
    }

    /// The two pixels between whose centres a coordinate lies, and their weights; the same pixel twice if its weight is 1.
    fn beside(&self, axis: usize, position: f64) -> [(usize, f64); 2] {
        let (count, last) = (self.size[axis] as f64, self.size[axis] - 1);
        let pixel = self.extent[axis] / count;
        // Relative to the middle of the image, so that mirroring about it changes only signs.
        let position = position - (self.corner[axis] + self.extent[axis] / 2.0);
        let centre = |index: usize| (index as f64 + 0.5 - count / 2.0) * pixel;
        let first = (position / pixel + (count - 1.0) / 2.0).floor().clamp(0.0, last as f64) as usize;
        let next = (first + 1).min(last);
        let [behind, ahead] = [position - centre(first), centre(next) - position]
            .map(|length| (length / pixel).clamp(0.0, 1.0));
        if behind == 0.0 {
            [(first, 1.0), (first, 0.0)]
        } else if ahead == 0.0 {
            [(next, 1.0), (next, 0.0)]
        } else {
            [(first, ahead), (next, behind)]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { cell: 0.5, origin: [-1.0, -1.0], size: [4, 4] };

    fn heights() -> Heights {
        Heights::between(0.0, 2.0).unwrap()
    }

    fn image(greys: &[f32]) -> Image<'_> {
        Image { greys, size: [3, 2], corner: [-1.5, -1.0], extent: [3.0, 2.0], levels: [0.5, 1.5] }
    }

    #[test]
    fn each_cell_is_solid_from_its_height_down() {
        let tops: Vec<f32> = (0..16).map(|index| index as f32 / 8.0 - 0.25).collect();
        let found = solids(tops.iter().map(|&top| top.into()), GRID, heights()).unwrap();
        for (index, &top) in tops.iter().enumerate() {
            assert_eq!(found.cell(index), [[BOTTOMLESS, heights().round(top.max(0.0).into())]], "{index}");
        }
        let message = |tops: &[f64]| solids(tops.iter().copied(), GRID, heights()).unwrap_err().to_string();
        assert_eq!(message(&[1.0; 15]), "15 heights are not those of 4 x 4 cells");
        let mut tops = [1.0; 16];
        tops[6] = f64::NAN;
        assert_eq!(message(&tops), "the height of cell (2, 1) is not finite");
    }

    #[test]
    fn an_image_is_bilinear_between_its_pixels_and_even_beyond_them() {
        let greys = [0.0, 0.5, 1.0, 0.25, 0.75, 0.0];
        let image = image(&greys);
        let near = |at: [f64; 2], height: f64| assert!((image.height(at) - height).abs() < 1e-15, "{at:?}");
        for (index, grey) in greys.iter().enumerate() {
            assert_eq!(
                image.height([(index % 3) as f64 - 1.0, (index / 3) as f64 - 0.5]),
                0.5 + f64::from(*grey)
            );
        }
        near([-0.5, -0.5], 0.75);
        near([-0.75, 0.25], 0.5 + 0.25 * (0.75 * 0.0 + 0.25 * 0.5) + 0.75 * (0.75 * 0.25 + 0.25 * 0.75));
        near([-7.0, 7.0], 0.75);
        near([1.4, -0.5], 1.5);
        let even = Image { greys: &[0.3; 6], ..image };
        assert_eq!(even.height([0.1234, 0.0567]), 0.5 + f64::from(0.3f32));
        let one = Image { greys: &[0.25], size: [1, 1], ..image };
        assert_eq!(one.height([0.3, 0.4]), 0.75);
        let found = of_image(&image, GRID, heights()).unwrap();
        assert_eq!(
            found.cell(GRID.index([1, 2])),
            [[BOTTOMLESS, heights().round(image.height([-0.25, 0.25]))]]
        );
    }

    #[test]
    fn a_mirrored_or_turned_image_gives_the_same_bits() {
        let greys = [0.1, 0.7, 0.3, 0.9, 0.2, 0.6f32];
        let mirrored: Vec<f32> = [2, 1, 0, 5, 4, 3].iter().map(|&index: &usize| greys[index]).collect();
        // (x, z) becomes (z, -x): rows run along the former z.
        let turned: Vec<f32> = [2, 5, 1, 4, 0, 3].iter().map(|&index: &usize| greys[index]).collect();
        let turned = Image { size: [2, 3], corner: [-1.0, -1.5], extent: [2.0, 3.0], ..image(&turned) };
        for x in -20..=20 {
            for z in -20..=20 {
                let [x, z] = [x, z].map(|position| f64::from(position) * 0.0813);
                let height = image(&greys).height([x, z]).to_bits();
                assert_eq!(image(&mirrored).height([-x, z]).to_bits(), height, "({x}, {z}) mirrored");
                assert_eq!(turned.height([z, -x]).to_bits(), height, "({x}, {z}) turned");
            }
        }
    }

    #[test]
    fn bad_images_are_a_sentence() {
        let greys = [0.0, 0.5, 1.0, 0.25, 0.75, f32::NAN];
        let message = |image: Image<'_>| image.validate().unwrap_err().to_string();
        assert_eq!(message(image(&greys)), "pixel (2, 1) of the image is not finite");
        assert_eq!(message(image(&greys[..5])), "5 values are not an image of 3 x 2 pixels");
        let flat = Image { extent: [3.0, 0.0], ..image(&[0.0; 6]) };
        assert_eq!(message(flat), "an image of 3 x 0 m is not an area");
        let wild = Image { levels: [f64::NAN, 1.0], ..image(&[0.0; 6]) };
        assert_eq!(message(wild), "NaN m is neither a corner nor a level of an image");
    }
}
