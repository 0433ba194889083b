//! Dyes: a clear liquid takes the colour of another in proportion to the dye that it carries.

use std::str::FromStr;

use crate::cli::preview::parts::LiquidLook;
use frazil::geometry::DetailedMesh;

/// A scalar that tints a liquid.
#[derive(Clone, Debug, PartialEq)]
pub struct Tint {
    /// The scalar: 0 is water, 1 the full dye.
    pub name: String,
    look: LiquidLook,
}

/// Colours (linear red, green, blue) and opacities of vertices.
pub type Tinted = (Vec<[f32; 3]>, Vec<f32>);

impl FromStr for Tint {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || "write a scalar and what it looks like, such as dye=blood: blood, paint, honey, milk or coffee";
        let (name, look) = text.split_once('=').ok_or_else(wrong)?;
        let look = LiquidLook::DYES.into_iter().find(|known| known.name == look).ok_or_else(wrong)?;
        Ok(Self { name: name.into(), look })
    }
}

impl Tint {
    /// The colours and opacities of vertices, from their depths and concentrations of dye (Lambert, Beer); none for a mesh that lacks
    /// either array.
    pub fn of(&self, liquid: &DetailedMesh) -> Option<Tinted> {
        let (shares, depths) = (liquid.of_vertices(&self.name)?, liquid.of_vertices("depth")?);
        let [clear, dye] = [LiquidLook::WATER, self.look].map(|look| (look.colour, 1.0 / look.depth));
        let vertex = |(share, depth): (f64, f64)| {
            let share = share.clamp(0.0, 1.0);
            let [clear_part, dye_part] = [(1.0 - share) * clear.1, share * dye.1];
            let absorption = clear_part + dye_part;
            let mix = (dye_part / absorption) as f32;
            let colour = [0, 1, 2].map(|n| (1.0 - mix) * clear.0[n] + mix * dye.0[n]);
            (colour, (1.0 - libm::exp(-depth.max(0.0) * absorption)) as f32)
        };
        Some(shares.into_iter().zip(depths).map(vertex).unzip())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use frazil::geometry::mesh::attributes::{MeshArray, Number, On};
    use frazil::geometry::{TriMesh, Vec3};

    #[test]
    fn more_of_a_dye_and_more_depth_hide_more() {
        let tint: Tint = "milk=milk".parse().unwrap();
        let array = |name: &str, values: &[f64]| MeshArray {
            name: name.into(),
            on: On::Vertices,
            number: Number::F32,
            values: values.to_vec(),
        };
        let mesh = TriMesh { positions: vec![Vec3::zeros(); 4], triangles: vec![[0, 1, 2]] };
        let arrays = vec![array("milk", &[0.0, 0.1, 1.0, 1.0]), array("depth", &[0.001, 0.001, 0.001, 0.0])];
        let (colours, opacities) = tint.of(&DetailedMesh { mesh, uvs: None, arrays }).unwrap();
        assert!(opacities.windows(2).take(2).all(|two| two[0] < two[1]), "{opacities:?}");
        assert!(opacities[0] < 0.05 && opacities[2] > 0.9 && opacities[3] == 0.0, "{opacities:?}");
        assert_eq!((colours[0], colours[2]), (LiquidLook::WATER.colour, LiquidLook::MILK.colour));
        assert!("milk".parse::<Tint>().is_err() && "milk=snow".parse::<Tint>().is_err());
    }
}
