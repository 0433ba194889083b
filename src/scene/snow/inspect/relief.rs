//! Heights of the ground and of the snow's top, with which `check` compares the path of an object.

use crate::geometry::spatial::bvh::Bvh;
use crate::geometry::{DVec3, TriMesh};
use crate::scene::snow::Inputs;
use crate::snow::base_layer::initial::{Cover, Ground};

/// The ground and the snow on it, as far as heights are known before the layer is made.
pub(in crate::scene::snow) struct Relief {
    ground: Surface,
    snow: Snow,
}

enum Surface {
    Plane { height: f64, area: [f64; 4] },
    Mesh(Heights),
}

enum Snow {
    /// Depth above the ground (m).
    Depth(f64),
    Top(Heights),
}

/// Heights of a mesh seen from above.
struct Heights {
    tree: Bvh,
    /// Height from which rays are cast down (m).
    above: f64,
}

impl Heights {
    fn new(mesh: &TriMesh) -> Self {
        let above =
            mesh.bounds().map_or(0.0, |(low, high)| f64::from(high.y) + f64::from((high - low).norm()) + 1.0);
        Self { tree: Bvh::new(mesh), above }
    }

    fn at(&self, x: f64, z: f64) -> Option<f64> {
        let hit = self.tree.ray(DVec3::new(x, self.above, z), -DVec3::y(), f64::INFINITY)?;
        Some(self.above - hit.distance)
    }
}

impl Relief {
    /// The relief of a scene; none when the snow is given as a level set.
    pub fn new(inputs: &Inputs) -> Option<Self> {
        let (ground, cover) = inputs.made()?;
        let ground = match ground {
            Ground::Plane { height, area } => Surface::Plane { height: *height, area: *area },
            Ground::Mesh(mesh) => Surface::Mesh(Heights::new(mesh)),
        };
        let snow = match cover {
            Cover::Depth(depth) => Snow::Depth(*depth),
            Cover::Top(mesh) => Snow::Top(Heights::new(mesh)),
        };
        Some(Self { ground, snow })
    }

    /// Heights (m) of the ground and of the snow's top at x and z (m); `None` outside them. Static objects are ignored.
    pub fn at(&self, x: f64, z: f64) -> Option<(f64, f64)> {
        let ground = match &self.ground {
            Surface::Plane { height, area: [x0, z0, x1, z1] } => {
                ((*x0..=*x1).contains(&x) && (*z0..=*z1).contains(&z)).then_some(*height)?
            }
            Surface::Mesh(heights) => heights.at(x, z)?,
        };
        let top = match &self.snow {
            Snow::Depth(depth) => ground + depth,
            Snow::Top(heights) => heights.at(x, z)?,
        };
        Some((ground, top))
    }
}
