//! Restriction of residuals to a coarser level, and prolongation of corrections back.

use rayon::prelude::*;

use super::operator::Operator;
use super::stencil::{Stencil, mean_residuals};
use crate::flow::tiles::{NONE, Tile};
use crate::flow::window::{Span, Window};
use crate::numeric::cpu::dispatch;

/// Squared ratio of the cell widths, which the stencils leave out.
const SQUARED_RATIO: f32 = 4.0;

/// The coarse right-hand side: the mean of the residual b - L x.
pub fn restrict(fine: &Operator, (b, x): (&[Tile], &[Tile]), children: &[[u32; 8]], coarse: &mut [Tile]) {
    coarse.par_iter_mut().zip(children).with_min_len(4).for_each(|(out, children)| {
        for (octant, child) in children.iter().enumerate() {
            let mut means = [0.0; 64];
            if *child != NONE {
                let slot = *child as usize;
                mean_residuals(fine.near(x, slot), &b[slot], &mut means);
            }
            let corner = (octant >> 2) << 8 | (octant >> 1 & 1) << 5 | (octant & 1) << 2;
            for (row, means) in means.chunks_exact(4).enumerate() {
                let to = &mut out[corner + ((row >> 2) << 6 | (row & 3) << 3)..][..4];
                to.iter_mut().zip(means).for_each(|(to, mean)| *to = SQUARED_RATIO * mean);
            }
        }
    });
}

/// Adds the interpolated coarse correction to the cells that take part.
pub fn prolong(
    coarse: &Operator,
    correction: &[Tile],
    fine: &Operator,
    parents: &[(u32, u8)],
    x: &mut [Tile],
) {
    let near = coarse.tiles.neighbours();
    let tiles = x.par_iter_mut().zip(parents).enumerate().with_min_len(16);
    tiles.for_each_init(Window::default, |window, (slot, (out, (parent, octant)))| {
        let corner = [octant >> 2 & 1, octant >> 1 & 1, octant & 1].map(|x| i32::from(x) * 4);
        let span = Span::new(corner.map(|x| x - 1), corner.map(|x| x + 5));
        window.fill(correction, &near[*parent as usize], &span, 0.0);
        add_tile(window, corner, fine.stencil(slot), out);
    });
}

fn add_tile(window: &Window, corner: [i32; 3], stencil: Option<&Stencil>, out: &mut Tile) {
    dispatch!(add_rows(window: &Window, corner: [i32; 3], stencil: Option<&Stencil>, out: &mut Tile))
}

/// Along each axis, a fine cell takes 3/4 of the coarse cell that contains it and 1/4 of the nearest other one.
#[inline(always)]
fn add_rows(window: &Window, corner: [i32; 3], stencil: Option<&Stencil>, out: &mut Tile) {
    let two = |fine: usize| (fine / 2 + 1, fine / 2 + 2 * (fine & 1));
    let mix = |own: [f32; 8], next: [f32; 8]| -> [f32; 8] {
        std::array::from_fn(|lane| 0.75 * own[lane] + 0.25 * next[lane])
    };
    // Along z, then y, then x.
    let mut lines = [[[0.0f32; 8]; 6]; 6];
    for (x, lines) in lines.iter_mut().enumerate() {
        for (y, line) in lines.iter_mut().enumerate() {
            let [x, y] = [corner[0] + x as i32 - 1, corner[1] + y as i32 - 1];
            let six: [f32; 6] = std::array::from_fn(|z| window.at(x, y, corner[2] + z as i32 - 1));
            *line = mix(std::array::from_fn(|z| six[two(z).0]), std::array::from_fn(|z| six[two(z).1]));
        }
    }
    let mut planes = [[[0.0f32; 8]; 8]; 6];
    for (lines, plane) in lines.iter().zip(&mut planes) {
        for (y, row) in plane.iter_mut().enumerate() {
            let (own, next) = two(y);
            *row = mix(lines[own], lines[next]);
        }
    }
    for row in 0..64 {
        let (own, next) = two(row >> 3);
        let mut added = mix(planes[own][row & 7], planes[next][row & 7]);
        if let Some(stencil) = stencil {
            for lane in 0..8 {
                added[lane] = if stencil.inverse[row * 8 + lane] > 0.0 { added[lane] } else { 0.0 };
            }
        }
        for (value, added) in out[row * 8..][..8].iter_mut().zip(added) {
            *value += added;
        }
    }
}
