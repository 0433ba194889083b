//! The caller's units and axes, and vertices in them.

use crate::shallow::columns::Columns;
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::surface::{Layout, Target, Up};

/// Velocity at the surface over the mean (Eq. 4.4).
const SURFACE_SPEED: f32 = 1.5;

/// Conversion to the caller's units and axes.
pub(in crate::shallow) struct Frame {
    z_up: bool,
    /// Sign of z.
    pub sign: f32,
    /// Height of 0 units (m x scale).
    low: f32,
    /// Length of a unit (m x scale).
    pub unit: f32,
    /// Centre of cell (0, 0) (m x scale).
    origin: [f32; 2],
    /// Edge of a cell (m x scale).
    pub cell: f32,
    /// Speed at the surface (m/s x scale) per mean speed (m/s).
    pub speed: f32,
    /// Opacity of a depth of one unit.
    pub opacity: f32,
}

/// A vertex, y up.
pub(in crate::shallow) struct Vertex {
    /// In the caller's units.
    pub position: [f32; 3],
    pub normal: [f32; 3],
    /// Mean over the depth (m/s).
    pub velocity: [f32; 2],
    pub carried: [f32; MAX_SCALARS],
    pub depth: i32,
    pub layer: u32,
    pub column: u32,
}

impl Frame {
    pub fn of(columns: &Columns, layout: &Layout) -> Self {
        let (grid, heights, scale) = (&columns.grid, &columns.heights, layout.scale);
        Self {
            z_up: layout.up == Up::Z,
            sign: if layout.left_handed == (layout.up == Up::Y) { -1.0 } else { 1.0 },
            low: (heights.low * scale) as f32,
            unit: (heights.unit * scale) as f32,
            origin: grid.centre([0, 0]).map(|centre| (centre * scale) as f32),
            cell: (grid.cell * scale) as f32,
            speed: SURFACE_SPEED * scale as f32,
            opacity: (heights.unit / layout.opaque_depth) as f32,
        }
    }

    /// Converts units to a height (m x scale).
    #[inline(always)]
    pub fn height(&self, units: f32) -> f32 {
        self.low + units * self.unit
    }

    /// Centre of a column or row of cells (m x scale).
    #[inline(always)]
    pub fn centre(&self, axis: usize, cell: i32) -> f32 {
        self.origin[axis] + cell as f32 * self.cell
    }

    /// Axes in the caller's order.
    #[inline(always)]
    pub fn order(&self, x: f32, up: f32, z: f32) -> [f32; 3] {
        if self.z_up { [x, z, up] } else { [x, up, z] }
    }

    /// Writes one vertex.
    pub fn put(&self, at: usize, vertex: &Vertex, target: &mut Target<'_>) {
        let put = |out: &mut Option<&mut [f32]>, [x, up, z]: [f32; 3]| {
            if let Some(out) = out {
                out[3 * at..][..3].copy_from_slice(&self.order(x, up, z * self.sign));
            }
        };
        let [u, w] = vertex.velocity.map(|speed| speed * self.speed);
        put(&mut target.positions, vertex.position);
        put(&mut target.normals, vertex.normal);
        put(&mut target.velocities, [u, 0.0, w]);
        if let Some(out) = &mut target.depths {
            out[at] = vertex.depth as f32 * self.unit;
        }
        if let Some(out) = &mut target.opacities {
            out[at] = (vertex.depth as f32 * self.opacity).min(1.0);
        }
        for (out, carried) in target.carried.iter_mut().zip(vertex.carried) {
            if let Some(out) = out {
                out[at] = carried;
            }
        }
        if let Some(out) = &mut target.layers {
            out[at] = vertex.layer;
        }
        if let Some(out) = &mut target.columns {
            out[at] = vertex.column;
        }
    }
}
