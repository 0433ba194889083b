//! Room for what a host draws: the surface of a liquid, and its drops.

use frazil::shallow::columns::Columns;
use frazil::shallow::free_fall::mesh::{Target as DropTarget, bound as drops_bound};
use frazil::shallow::surface::rim::ledges::Ledges;
use frazil::shallow::surface::{Indices, Target, bound};

/// The caller's arrays.
pub struct Buffers {
    pub positions: Vec<f32>,
    pub normals: Vec<f32>,
    pub velocities: Vec<f32>,
    pub depths: Vec<f32>,
    pub opacities: Vec<f32>,
    pub layers: Vec<u32>,
    pub columns: Vec<u32>,
    pub indices: Vec<u32>,
}

impl Buffers {
    /// As large as any liquid in these columns needs them, with skirts at ledges, or so many drops.
    pub fn new(columns: &Columns, ledges: &Ledges, drops: usize) -> Self {
        let (flat, skirts, round) = (bound(columns), ledges.bound(), drops_bound(drops));
        let vertices = (flat.vertices + skirts.vertices).max(round.vertices);
        let [positions, normals, velocities] = [(); 3].map(|()| vec![0.0; 3 * vertices]);
        let [depths, opacities] = [(); 2].map(|()| vec![0.0; vertices]);
        let [layers, of] = [(); 2].map(|()| vec![0; vertices]);
        let indices = vec![0; (flat.indices + skirts.indices).max(round.indices)];
        Self { positions, normals, velocities, depths, opacities, layers, columns: of, indices }
    }

    /// What one needs to draw a surface: positions, normals, depths for the opacity, triangles.
    pub fn drawn(&mut self) -> Target<'_> {
        Target {
            positions: Some(&mut self.positions),
            normals: Some(&mut self.normals),
            depths: Some(&mut self.depths),
            indices: Indices::U32(&mut self.indices),
            ..Target::default()
        }
    }

    /// What one needs to draw drops.
    pub fn drops(&mut self) -> DropTarget<'_> {
        DropTarget {
            positions: Some(&mut self.positions),
            normals: Some(&mut self.normals),
            indices: Indices::U32(&mut self.indices),
            ..DropTarget::default()
        }
    }

    /// What a check needs.
    pub fn checked(&mut self) -> Target<'_> {
        Target {
            columns: Some(&mut self.columns),
            indices: Indices::U32(&mut self.indices),
            ..Target::default()
        }
    }

    /// All of them.
    pub fn all(&mut self) -> Target<'_> {
        Target {
            positions: Some(&mut self.positions),
            normals: Some(&mut self.normals),
            velocities: Some(&mut self.velocities),
            depths: Some(&mut self.depths),
            opacities: Some(&mut self.opacities),
            layers: Some(&mut self.layers),
            columns: Some(&mut self.columns),
            indices: Indices::U32(&mut self.indices),
            ..Target::default()
        }
    }
}
