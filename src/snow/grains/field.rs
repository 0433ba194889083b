//! Grains beside a level set that does not move during the step: the base layer, ground as a grid.

use rayon::prelude::*;

use super::contacts::SKIN;
use super::layout::{Block, EDGE, Layout};
use super::rows::{Row, V, dot, norm, scaled};
use super::touch::{BASE, Touch};
use crate::base::blocks::{DIM, offset};
use crate::error::Result;
use crate::vdb::{FloatGrid, Probe};

/// A level set as a collider.
pub struct Field<'a> {
    /// The level set (m).
    pub grid: &'a FloatGrid,
    /// Friction against it.
    pub friction: f32,
}

impl Field<'_> {
    /// Members of some blocks near the surface, each with the plane that the surface is there.
    ///
    /// # Errors
    /// What the grid reports.
    pub fn touches(
        &self,
        layout: &Layout,
        which: &[u32],
        rows: &[Row],
        diameter: f64,
        reach: f32,
    ) -> Result<Vec<Vec<Touch>>> {
        let windows = self.windows(layout, which, diameter, MARGIN)?;
        let near = which.par_iter().zip(&windows).map(|(&index, window)| {
            let (block, Some(window)) = (&layout.blocks[index as usize], window) else { return Vec::new() };
            let near = |&slot: &u32| self.touch(block, slot, &rows[slot as usize], window, diameter, reach);
            block.members.iter().filter_map(near).collect()
        });
        Ok(near.collect())
    }

    /// The leaves around each block and a margin (cells); none where no surface is near.
    ///
    /// # Errors
    /// What the grid reports.
    pub fn windows(
        &self,
        layout: &Layout,
        which: &[u32],
        diameter: f64,
        margin: f64,
    ) -> Result<Vec<Option<Window<'_>>>> {
        let cell = self.grid.voxel_size();
        let bounds: Vec<[[i32; 3]; 2]> = which
            .par_iter()
            .map(|&index| {
                let at = layout.blocks[index as usize].at;
                let leaf = |x: f64| (x / DIM as f64).floor() as i32;
                let edge = f64::from(EDGE) * diameter / cell;
                let low = at.map(|at| leaf(f64::from(at) * edge - margin));
                let high = at.map(|at| leaf(f64::from(at + 1) * edge + margin));
                [low, high]
            })
            .collect();
        let windows = Window::all(self.grid, &bounds)?;
        Ok(windows.into_iter().map(|window| window.has_surface().then_some(window)).collect())
    }

    fn touch(
        &self,
        block: &Block,
        slot: u32,
        row: &Row,
        window: &Window<'_>,
        diameter: f64,
        reach: f32,
    ) -> Option<Touch> {
        let cell = self.grid.voxel_size();
        let scale = diameter / cell;
        let at = [0, 1, 2]
            .map(|axis| (f64::from(block.at[axis]) * f64::from(EDGE) + f64::from(row.place[axis])) * scale);
        let (distance, gradient) = window.sample(at);
        let distance = distance / diameter as f32;
        let steep = norm(gradient);
        let fast = norm(row.velocity) * reach;
        if distance > 0.5 + SKIN + fast {
            return None;
        }
        // Deep in the level set there is no direction: a touch that does nothing tells of the grain.
        let normal = if steep < 1.0e-6 { [0.0; 3] } else { scaled(gradient, 1.0 / steep) };
        Some(Touch {
            grain: slot,
            collider: BASE,
            normal,
            offset: dot(normal, row.place) - (distance - 0.5),
            friction: self.friction,
            ..Touch::default()
        })
    }
}

/// Room around a block for grains that left it since it was sorted (cells of the level set).
const MARGIN: f64 = 1.0;

/// Leaves of a level set side by side.
pub struct Window<'a> {
    /// Least leaf along each axis.
    low: [i32; 3],
    /// Leaves along each axis.
    size: [usize; 3],
    probes: Vec<Probe<'a>>,
}

impl<'a> Window<'a> {
    /// A window for each pair of a least and a greatest leaf (in leaves).
    ///
    /// # Errors
    /// What the grid reports.
    pub fn all(grid: &'a FloatGrid, bounds: &[[[i32; 3]; 2]]) -> Result<Vec<Self>> {
        let origins = |[low, high]: &[[i32; 3]; 2]| {
            let [low, high] = [*low, *high];
            let rows = (low[0]..=high[0]).flat_map(move |x| (low[1]..=high[1]).map(move |y| [x, y]));
            rows.flat_map(move |[x, y]| {
                (low[2]..=high[2]).map(move |z| [x, y, z].map(|leaf| leaf * DIM as i32))
            })
        };
        let all: Vec<[i32; 3]> = bounds.iter().flat_map(origins).collect();
        let mut probes = grid.probe(&all)?.into_iter();
        let window = |[low, high]: &[[i32; 3]; 2]| {
            let size = [0, 1, 2].map(|axis| (high[axis] - low[axis] + 1) as usize);
            Window { low: *low, size, probes: probes.by_ref().take(size.iter().product()).collect() }
        };
        Ok(bounds.iter().map(window).collect())
    }

    fn has_surface(&self) -> bool {
        self.probes.iter().any(|probe| matches!(probe, Probe::Leaf(_)))
    }

    fn value(&self, voxel: [i32; 3]) -> f32 {
        let leaf = [0, 1, 2]
            .map(|axis| ((voxel[axis] >> 3) - self.low[axis]).clamp(0, self.size[axis] as i32 - 1) as usize);
        let [x, y, z] = voxel.map(|at| (at & 7) as usize);
        match &self.probes[(leaf[0] * self.size[1] + leaf[1]) * self.size[2] + leaf[2]] {
            Probe::Leaf(leaf) => leaf.values[offset(x, y, z)],
            Probe::Tile { value, .. } => *value,
        }
    }

    /// Value and gradient (a voxel) at a place (voxels) by trilinear interpolation.
    pub fn sample(&self, at: [f64; 3]) -> (f32, V) {
        let low = at.map(|x| x.floor() as i32);
        let [u, v, w] = [0, 1, 2].map(|axis| (at[axis] - f64::from(low[axis])) as f32);
        let corner = |x: i32, y: i32, z: i32| self.value([low[0] + x, low[1] + y, low[2] + z]);
        let along = |x: i32, y: i32| {
            let (a, b) = (corner(x, y, 0), corner(x, y, 1));
            (a + (b - a) * w, b - a)
        };
        let [(a, az), (b, bz), (c, cz), (d, dz)] = [along(0, 0), along(0, 1), along(1, 0), along(1, 1)];
        let (front, back) = (a + (b - a) * v, c + (d - c) * v);
        let mix = |low: f32, high: f32, t: f32| low + (high - low) * t;
        let gradient = [back - front, mix(b - a, d - c, u), mix(mix(az, bz, v), mix(cz, dz, v), u)];
        (mix(front, back, u), gradient)
    }
}
