//! The surface of the liquid and its drops in the air as one mesh, and its files.

use crate::error::Result;
use crate::geometry::mesh::attributes::{Number, On};
use crate::geometry::{MeshArray, TriMesh, Vec3};
use crate::scene::shallow::{OutputFiles, Shallow as Setup};
use crate::shallow::Shallow;
use crate::shallow::free_fall::Droplet;
use crate::shallow::free_fall::mesh::{Balls, Target as BallTarget};
use crate::shallow::scalars::MAX_SCALARS;
use crate::shallow::surface::heights::minimum_heights::{Distance, MinimumHeights};
use crate::shallow::surface::rim::ledges::Ledges;
use crate::shallow::surface::rim::silhouette::Silhouette;
use crate::shallow::surface::{Counts, Depths, Indices, Layout, Surface, Target};

/// Minimum height of a wet vertex above its ground, in cells: the ground does not show through a film (thesis 4.2.4).
const MIN_DEPTH: f64 = 0.05;
/// Depth at which a wet vertex reaches its minimum height, in cells: it rises gradually, so that it does not jump when its column gets wet
/// or dry.
const FADE_DEPTH: f64 = 0.02;

/// Builds meshes; its buffers are reused from frame to frame.
#[derive(Default)]
pub(in crate::scene::shallow) struct Mesher {
    surface: Surface,
    balls: Balls,
    minimum_heights: MinimumHeights,
    ledges: Option<Ledges>,
    silhouette: Silhouette,
    velocity: Vec<[f32; 2]>,
    concentrations: [Vec<f32>; MAX_SCALARS],
    drops: Vec<Droplet>,
}

/// The surface at a frame, followed by the drops in the air (m, m/s).
#[derive(Default)]
pub(in crate::scene::shallow) struct LiquidMesh {
    pub mesh: TriMesh,
    /// Velocities of the surface.
    pub velocities: Vec<Vec3>,
    /// Depths; for drops their diameters.
    pub depths: Vec<f32>,
    /// Opacities: depth / opaque depth, at most 1.
    pub alpha: Vec<f32>,
    pub layers: Vec<u32>,
    /// First vertex in the air: the drops come last. `None` if liquid does not fall.
    pub falling: Option<usize>,
    /// Scalars by name.
    pub scalars: Vec<(String, Vec<f32>)>,
}

impl Mesher {
    /// Finds minimum heights above the ground, if that is a mesh, and the edges where the ground ends, each if the scene asks for it.
    ///
    /// # Errors
    /// A mesh with a vertex that is not finite.
    pub fn fit_to_ground(&mut self, liquid: &Shallow, ground: Option<TriMesh>, setup: &Setup) -> Result<()> {
        let columns = liquid.columns();
        let ledges = setup.skirts.then(|| self.ledges.get_or_insert_default());
        let Some(TriMesh { positions, triangles }) = &ground else {
            ledges.into_iter().for_each(|ledges| ledges.find(columns));
            return Ok(());
        };
        if let Some(ledges) = ledges {
            self.silhouette.fit(ledges, columns, positions, triangles)?;
        }
        if setup.minimum_heights {
            self.minimum_heights.find(columns, positions, triangles, Distance::default())?;
        }
        Ok(())
    }

    /// The surface of a liquid that is opaque from this depth on (m).
    ///
    /// # Errors
    /// None for a liquid's own columns.
    pub fn build(&mut self, liquid: &Shallow, opaque_depth: f64) -> Result<LiquidMesh> {
        let Self { surface, balls, minimum_heights, ledges, velocity, concentrations, drops, .. } = self;
        let columns = liquid.columns();
        velocity.clear();
        velocity.extend((0..columns.len()).map(|index| liquid.velocity(index)));
        for (index, concentrations) in concentrations.iter_mut().enumerate().take(liquid.scalars().len()) {
            concentrations.resize(columns.len(), 0.0);
            liquid.concentrations(index, concentrations)?;
        }
        drops.clear();
        drops.extend(liquid.drops());
        let depths = Depths {
            depth: liquid.depths(),
            velocity,
            least: minimum_heights.least(),
            sunk: minimum_heights.sunk(),
            ledges: ledges.as_ref(),
            carried: concentrations.each_ref().map(|numbers| &numbers[..]),
            ..Depths::default()
        };
        let on_ground = surface.count(columns, &depths)?;
        let all = sum(on_ground, balls.count(drops));
        let mut out = LiquidMesh::with_buffers(liquid, all, on_ground.vertices);
        let (mut positions, mut velocities) = (vec![0.0; 3 * all.vertices], vec![0.0; 3 * all.vertices]);
        let cell = columns.grid.cell;
        let layout = Layout {
            least_depth: MIN_DEPTH * cell,
            fade_depth: if minimum_heights.least().is_empty() { 0.0 } else { FADE_DEPTH * cell },
            opaque_depth,
            ..Layout::default()
        };
        let mut carried = [const { None }; MAX_SCALARS];
        carried.iter_mut().zip(&mut out.scalars).for_each(|(to, (_, own))| *to = Some(&mut own[..]));
        let mut target = Target {
            positions: Some(&mut positions),
            velocities: Some(&mut velocities),
            depths: Some(&mut out.depths),
            opacities: Some(&mut out.alpha),
            layers: Some(&mut out.layers),
            carried,
            indices: Indices::U32(out.mesh.triangles.as_flattened_mut()),
            ..Target::default()
        };
        surface.build(columns, &depths, &layout, &mut target)?;
        let (first, triangle) = (on_ground.vertices, on_ground.indices / 3);
        let mut of_drops = vec![0; all.vertices - first];
        let mut target = BallTarget {
            positions: Some(&mut positions[3 * first..]),
            velocities: Some(&mut velocities[3 * first..]),
            drops: Some(&mut of_drops),
            indices: Indices::U32(out.mesh.triangles[triangle..].as_flattened_mut()),
            ..BallTarget::default()
        };
        balls.build(drops, &layout, &mut target)?;
        let in_air = out.mesh.triangles[triangle..].as_flattened_mut();
        in_air.iter_mut().for_each(|corner| *corner += first as u32);
        for (vertex, drop) in (first..).zip(of_drops) {
            let diameter = 2.0 * drops[drop as usize].radius;
            out.depths[vertex] = diameter as f32;
            out.alpha[vertex] = (diameter / opaque_depth).min(1.0) as f32;
            for ((_, own), concentration) in out.scalars.iter_mut().zip(drops[drop as usize].concentrations) {
                own[vertex] = concentration;
            }
        }
        let vectors = |numbers: &[f32]| numbers.as_chunks::<3>().0.iter().map(|&v| Vec3::from(v)).collect();
        out.mesh.positions = vectors(&positions);
        out.velocities = vectors(&velocities);
        Ok(out)
    }
}

/// Counts of two meshes together.
fn sum(a: Counts, b: Counts) -> Counts {
    Counts { vertices: a.vertices + b.vertices, extras: a.extras + b.extras, indices: a.indices + b.indices }
}

impl LiquidMesh {
    /// An empty mesh, with the arrays of a scene's liquid.
    pub fn empty(setup: &Setup) -> Self {
        let named = |name: &String| (name.clone(), Vec::new());
        let scalars = setup.scalars.iter().map(|carried| named(&carried.scalar.name)).collect();
        Self { falling: setup.params.falls.map(|_| 0), scalars, ..Self::default() }
    }

    /// Buffers for a mesh of a liquid; the first `on_ground` vertices are its surface.
    fn with_buffers(liquid: &Shallow, counts: Counts, on_ground: usize) -> Self {
        let Counts { vertices, indices, .. } = counts;
        let scalar = |scalar: &crate::shallow::Scalar| (scalar.name.clone(), vec![0.0; vertices]);
        Self {
            mesh: TriMesh { positions: Vec::new(), triangles: vec![[0; 3]; indices / 3] },
            velocities: Vec::new(),
            depths: vec![0.0; vertices],
            alpha: vec![0.0; vertices],
            layers: vec![0; vertices],
            falling: liquid.params().falls.map(|_| on_ground),
            scalars: liquid.scalars().iter().map(scalar).collect(),
        }
    }

    /// The requested arrays, besides velocities.
    pub fn arrays(&self, output: OutputFiles) -> Vec<MeshArray> {
        let array =
            |name: &str, number, values| MeshArray { name: name.into(), on: On::Vertices, number, values };
        let floats = |values: &[f32]| values.iter().map(|value| f64::from(*value)).collect();
        let depth = output.depth.then(|| array("depth", Number::F32, floats(&self.depths)));
        let alpha = output.alpha.then(|| array("alpha", Number::F32, floats(&self.alpha)));
        let layers = || self.layers.iter().map(|layer| f64::from(*layer)).collect();
        let layer = output.layer.then(|| array("layer", Number::U16, layers()));
        let count = self.layers.len();
        let in_air = |first: usize| (0..count).map(|vertex| f64::from(u8::from(vertex >= first))).collect();
        let falling = self.falling.filter(|_| output.falling);
        let falling = falling.map(|first| array("falling", Number::U8, in_air(first)));
        let scalars = self.scalars.iter().filter(|_| output.scalars);
        let scalars = scalars.map(|(name, values)| array(name, Number::F32, floats(values)));
        depth.into_iter().chain(alpha).chain(layer).chain(falling).chain(scalars).collect()
    }
}
