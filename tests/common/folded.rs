//! Skins that fold inside out.

use frazil::error::Result;
use frazil::geometry::{DVec3, TriMesh, Vec3};
use frazil::motion::Motion;

use super::shapes::{sphere, tube};

/// A tube along y whose upper half turns about x at the origin, blended linearly over a short joint as game engines do:
/// on the inner side the skin passes through itself.
pub struct Elbow {
    mesh: TriMesh,
    /// Radians at time 0 and at time 1.
    bend: [f64; 2],
}

/// Half the height over which an elbow's two halves are blended (m).
const JOINT: f64 = 0.02;

impl Elbow {
    /// A tube 0.4 m long and 0.08 m wide.
    pub fn new(bend: [f64; 2]) -> Self {
        Self { mesh: tube(0.04, 0.4, 24, 48), bend }
    }
}

impl Motion for Elbow {
    fn triangles(&self) -> &[[u32; 3]] {
        &self.mesh.triangles
    }

    fn vertex_count(&self) -> usize {
        self.mesh.positions.len()
    }

    fn pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        let [from, to] = self.bend;
        let (sin, cos) = (from + (to - from) * time.clamp(0.0, 1.0)).sin_cos();
        out.clear();
        out.extend(self.mesh.positions.iter().map(|p| {
            let p: DVec3 = p.cast();
            let turned = DVec3::new(p.x, cos * p.y - sin * p.z, sin * p.y + cos * p.z);
            p.lerp(&turned, ((p.y + JOINT) / (2.0 * JOINT)).clamp(0.0, 1.0))
        }));
        Ok(())
    }

    fn breaks(&self, from: f64, to: f64) -> Vec<f64> {
        [0.0, 1.0].into_iter().filter(|&time| time > from && time < to).collect()
    }
}

/// A ball that is pressed flat along x, comes out inside out, twice as thick, and goes back the same way.
pub struct Mirrored(TriMesh);

impl Mirrored {
    /// A ball of 0.1 m.
    pub fn new() -> Self {
        Self(sphere(0.05, 6))
    }
}

impl Motion for Mirrored {
    fn triangles(&self) -> &[[u32; 3]] {
        &self.0.triangles
    }

    fn vertex_count(&self) -> usize {
        self.0.positions.len()
    }

    fn pose(&self, time: f64, out: &mut Vec<DVec3>) -> Result<()> {
        let along = 1.0 - 3.0 * (1.0 - (2.0 * time - 1.0).abs());
        let position = |p: &Vec3| DVec3::new(f64::from(p.x) * along, f64::from(p.y), f64::from(p.z));
        out.clear();
        out.extend(self.0.positions.iter().map(position));
        Ok(())
    }

    fn breaks(&self, from: f64, to: f64) -> Vec<f64> {
        [0.5].into_iter().filter(|&time| time > from && time < to).collect()
    }
}
