//! A skinned tube whose elbow folds inside out when it bends.

use frazil::base::{DVec3, TriMesh};
use frazil::error::Result;
use frazil::motion::Motion;

use super::shapes::tube;

/// A tube along y whose upper half turns about x at the origin, blended linearly over a short joint as game engines do:
/// on the inner side vertices pass through each other, and the skin winds backward there.
pub struct Elbow {
    mesh: TriMesh,
    /// Radians at time 0 and at time 1.
    pub bend: [f64; 2],
    /// Half the height over which the two halves are blended (m).
    pub joint: f64,
}

impl Elbow {
    /// A tube 0.4 m long and 0.08 m wide.
    pub fn new(bend: [f64; 2], joint: f64) -> Self {
        Self { mesh: tube(0.04, 0.4, 24, 48), bend, joint }
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
            p.lerp(&turned, ((p.y + self.joint) / (2.0 * self.joint)).clamp(0.0, 1.0))
        }));
        Ok(())
    }

    fn breaks(&self, from: f64, to: f64) -> Vec<f64> {
        [0.0, 1.0].into_iter().filter(|&time| time > from && time < to).collect()
    }
}
