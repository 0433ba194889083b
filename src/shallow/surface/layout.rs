//! Input of a surface, the layout of its mesh, and the buffers for it.

use super::counts::Counts;
use super::rim::ledges::Ledges;
use crate::error::{Error, Result};
use crate::numeric::checks::{check_not_negative, ensure};
use crate::shallow::scalars::MAX_SCALARS;

/// The liquid in columns.
#[derive(Debug, Clone, Copy, Default)]
pub struct Depths<'a> {
    /// Depth of each index (units), at most from base to ceiling; 0 or less is dry, and so are indices without a column.
    pub depth: &'a [i32],
    /// Mean velocity of each index along x and z (m/s); may be empty.
    pub velocity: &'a [[f32; 2]],
    /// Whether each strip may have a wet column; if absent, all strips are searched.
    pub active: Option<&'a [bool]>,
    /// Minimum depth at which each index is shown where it is wet (units), at most from base to ceiling; replaces [`Layout::least_depth`].
    /// May be empty. See [`MinimumHeights`](super::heights::minimum_heights::MinimumHeights).
    pub least: &'a [i32],
    /// How far below its base each index is shown where it is dry (units), at most down to the underside of its solid; replaces
    /// [`Layout::least_depth`]. May be empty.
    pub sunk: &'a [i32],
    /// One number per index for each array of [`Target::carried`]: concentrations of scalars. May be empty.
    pub carried: [&'a [f32]; MAX_SCALARS],
    /// Adds skirts at ledges, down to the ground's edge; if absent, the surface ends in the middle of the last cell.
    pub ledges: Option<&'a Ledges>,
}

/// The axis that points up.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Up {
    /// Y: x to the east, z to the south.
    #[default]
    Y,
    /// Z: x to the east, y to the north.
    Z,
}

/// How the mesh is written. Triangles are counter-clockwise seen from above, or clockwise with `left_handed`. In both cases the cross
/// product of a triangle's edges points along its normals.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layout {
    /// The caller's units per metre: 1, or 100 for centimetres. For positions, depths and velocities.
    pub scale: f64,
    /// The axis that points up.
    pub up: Up,
    /// Left-handed axes: the horizontal axis that is not x is reversed (Y up: z to the north; Z up: y to the south).
    pub left_handed: bool,
    /// Minimum height of a wet vertex above its base (m), against flicker where the terrain is drawn too (thesis 4.2.4: 0.05 of a cell). A
    /// dry vertex is at least as far below its base, and further where the liquid around is lower.
    pub least_depth: f64,
    /// Depth (m) from which a wet vertex is at its full height. Below it, the thinner the liquid, the closer its vertex is to that of a dry
    /// column, so that no vertex jumps as its column wets or dries. 0: full height at any depth; 0.02 of a cell works well.
    pub fade_depth: f64,
    /// Depth from which the liquid is opaque (m), for [`Target::opacities`].
    pub opaque_depth: f64,
}

impl Default for Layout {
    fn default() -> Self {
        Self {
            scale: 1.0,
            up: Up::Y,
            left_handed: false,
            least_depth: 0.0,
            fade_depth: 0.0,
            opaque_depth: 0.01,
        }
    }
}

impl Layout {
    pub(in crate::shallow) fn validate(&self) -> Result<()> {
        let positive = |name: &str, value: f64| {
            let holds = value > 0.0 && value.is_finite();
            ensure(holds, format_args!("{name} = {value} is not positive and finite"))
        };
        positive("scale", self.scale)?;
        positive("opaque_depth", self.opaque_depth)?;
        check_not_negative("least_depth", self.least_depth)?;
        check_not_negative("fade_depth", self.fade_depth)
    }
}

/// Where vertex indices are written.
#[derive(Debug, Default)]
pub enum Indices<'a> {
    /// Nowhere.
    #[default]
    None,
    /// 16 bits: for at most 65,536 vertices.
    U16(&'a mut [u16]),
    /// 32 bits.
    U32(&'a mut [u32]),
}

/// Buffers of the caller. They are written from the start, in order, and never read; they may be longer than the mesh. Absent ones are
/// skipped. Vertices are in the order of their columns' indices, followed by extras.
#[derive(Debug, Default)]
pub struct Target<'a> {
    /// Three numbers per vertex (m x scale).
    pub positions: Option<&'a mut [f32]>,
    /// Three numbers per vertex: a unit vector.
    pub normals: Option<&'a mut [f32]>,
    /// One number per vertex (m x scale); 0 for dry vertices and extras.
    pub depths: Option<&'a mut [f32]>,
    /// One number per vertex: depth / [`Layout::opaque_depth`], at most 1 (thesis 4.2.2).
    pub opacities: Option<&'a mut [f32]>,
    /// Three numbers per vertex (m/s x scale): velocity at the surface, 1.5 times the mean (Eq. 4.4); the upward component is 0.
    pub velocities: Option<&'a mut [f32]>,
    /// One number per vertex for each array of [`Depths::carried`]; for a dry vertex or an extra, the mean of the wet columns around.
    pub carried: [Option<&'a mut [f32]>; MAX_SCALARS],
    /// Layer of each vertex's column; for an extra, the lowest layer of the wet columns around whose surface ends there.
    pub layers: Option<&'a mut [u32]>,
    /// Index of each vertex's column; [`NONE`](crate::shallow::columns::NONE) for an extra.
    pub columns: Option<&'a mut [u32]>,
    /// Three per triangle.
    pub indices: Indices<'a>,
}

impl Target<'_> {
    /// Checks that the liquid has what the buffers are for.
    pub(in crate::shallow) fn check_wanted(&self, depths: &Depths<'_>) -> Result<()> {
        if self.velocities.is_some() && depths.velocity.is_empty() && !depths.depth.is_empty() {
            return Err(Error::argument("velocities of the surface are wanted, and the liquid has none"));
        }
        let is_missing = |(to, from): (&Option<&mut [f32]>, &&[f32])| to.is_some() && from.is_empty();
        if !depths.depth.is_empty() && self.carried.iter().zip(&depths.carried).any(is_missing) {
            return Err(Error::argument("concentrations of the surface are wanted, and the liquid has none"));
        }
        Ok(())
    }

    /// Checks that the mesh fits the buffers.
    pub(in crate::shallow) fn check(&self, counts: &Counts) -> Result<()> {
        let count = counts.vertices;
        let numbers = [
            ("positions", self.positions.as_deref(), 3 * count),
            ("normals", self.normals.as_deref(), 3 * count),
            ("depths", self.depths.as_deref(), count),
            ("opacities", self.opacities.as_deref(), count),
            ("velocities", self.velocities.as_deref(), 3 * count),
        ];
        let carried = self.carried.iter().map(|out| ("carried", out.as_deref(), count));
        let numbers = numbers.into_iter().chain(carried);
        let numbers = numbers.map(|(name, out, needed)| (name, out.map(<[f32]>::len), needed));
        let ids = [("layers", self.layers.as_deref()), ("columns", self.columns.as_deref())];
        let ids = ids.map(|(name, out)| (name, out.map(<[u32]>::len), count));
        check_buffers("surface has", counts, numbers.chain(ids), &self.indices)
    }
}

/// Checks that a mesh fits its buffers; each is given as its name, its length (none if it is absent), and the length needed.
pub(in crate::shallow) fn check_buffers<'a>(
    mesh_has: &str,
    counts: &Counts,
    buffers: impl Iterator<Item = (&'a str, Option<usize>, usize)>,
    indices: &Indices<'_>,
) -> Result<()> {
    let room = match indices {
        Indices::None => None,
        Indices::U16(out) => Some(out.len()),
        Indices::U32(out) => Some(out.len()),
    };
    for (name, room, needed) in buffers.chain([("indices", room, counts.indices)]) {
        if let Some(room) = room.filter(|room| *room < needed) {
            return Err(Error::argument(format!(
                "{name} has room for {room} numbers, and the {mesh_has} {needed}"
            )));
        }
    }
    let count = counts.vertices;
    ensure(
        count <= 1 << 16 || !matches!(indices, Indices::U16(_)),
        format_args!("{count} vertices are too many for indices of 16 bits: use those of 32"),
    )?;
    Ok(())
}
