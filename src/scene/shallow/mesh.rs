//! The surface of the liquid as a mesh, and its files.

use super::Files;
use crate::base::arrays::{Number, On};
use crate::base::{MeshArray, TriMesh, Vec3};
use crate::error::Result;
use crate::shallow::Shallow;
use crate::shallow::surface::{Counts, Depths, Indices, Layout, Surface, Target};

/// Least height of a wet vertex above its ground, in cells: the ground does not show through a film (thesis 4.2.4).
const LEAST_DEPTH: f64 = 0.05;

/// Makes meshes; keeps its memory from one to the next.
#[derive(Default)]
pub(super) struct Mesher {
    surface: Surface,
    velocity: Vec<[f32; 2]>,
}

/// The surface at a frame (m, m/s).
#[derive(Default)]
pub(super) struct Drawn {
    pub mesh: TriMesh,
    /// Velocities of the surface.
    pub velocities: Vec<Vec3>,
    pub depths: Vec<f32>,
    /// Opacities: depth / the depth from which it is opaque, at most 1.
    pub alpha: Vec<f32>,
    pub layers: Vec<u32>,
}

impl Mesher {
    /// The surface of a liquid that is opaque from a depth on (m).
    ///
    /// # Errors
    /// None of a liquid's own columns.
    pub fn draw(&mut self, liquid: &Shallow, opaque_depth: f64) -> Result<Drawn> {
        let columns = liquid.columns();
        self.velocity.clear();
        self.velocity.extend((0..columns.len()).map(|index| liquid.velocity(index)));
        let depths = Depths { depth: liquid.depths(), velocity: &self.velocity, ..Depths::default() };
        let Counts { vertices, indices, .. } = self.surface.count(columns, &depths)?;
        let mut drawn = Drawn {
            mesh: TriMesh { positions: vec![Vec3::zeros(); vertices], triangles: vec![[0; 3]; indices / 3] },
            velocities: Vec::new(),
            depths: vec![0.0; vertices],
            alpha: vec![0.0; vertices],
            layers: vec![0; vertices],
        };
        let (mut places, mut speeds) = (vec![0.0; 3 * vertices], vec![0.0; 3 * vertices]);
        let layout =
            Layout { least_depth: LEAST_DEPTH * columns.grid.cell, opaque_depth, ..Layout::default() };
        let mut target = Target {
            positions: Some(&mut places),
            velocities: Some(&mut speeds),
            depths: Some(&mut drawn.depths),
            opacities: Some(&mut drawn.alpha),
            layers: Some(&mut drawn.layers),
            indices: Indices::U32(drawn.mesh.triangles.as_flattened_mut()),
            ..Target::default()
        };
        self.surface.build(columns, &depths, &layout, &mut target)?;
        let vectors = |numbers: &[f32]| numbers.as_chunks::<3>().0.iter().map(|&v| Vec3::from(v)).collect();
        drawn.mesh.positions = vectors(&places);
        drawn.velocities = vectors(&speeds);
        Ok(drawn)
    }
}

impl Drawn {
    /// The arrays that are asked for, besides velocities.
    pub fn arrays(&self, output: Files) -> Vec<MeshArray> {
        let array =
            |name: &str, number, values| MeshArray { name: name.into(), on: On::Vertices, number, values };
        let floats = |values: &[f32]| values.iter().map(|value| f64::from(*value)).collect();
        let depth = output.depth.then(|| array("depth", Number::F32, floats(&self.depths)));
        let alpha = output.alpha.then(|| array("alpha", Number::F32, floats(&self.alpha)));
        let layers = || self.layers.iter().map(|layer| f64::from(*layer)).collect();
        let layer = output.layer.then(|| array("layer", Number::U16, layers()));
        depth.into_iter().chain(alpha).chain(layer).collect()
    }
}
