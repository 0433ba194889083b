//! Colours of vertices: linear in USD, and as the bytes that programs expect in .ply, in sRGB.

use crate::geometry::MeshArray;
use crate::geometry::mesh::attributes::{Number, On};

const NAMES: [&str; 3] = ["red", "green", "blue"];

/// Colours as linear floats.
pub(super) fn linear(colours: &[[f32; 3]]) -> [MeshArray; 3] {
    arrays(colours, Number::F32, f64::from)
}

/// Colours as sRGB bytes.
pub(in crate::scene::shallow) fn srgb(colours: &[[f32; 3]]) -> [MeshArray; 3] {
    arrays(colours, Number::U8, |part| (srgb_of(part.into()) * 255.0).round())
}

fn arrays(colours: &[[f32; 3]], number: Number, value: fn(f32) -> f64) -> [MeshArray; 3] {
    [0, 1, 2].map(|axis| {
        let values = colours.iter().map(|colour| value(colour[axis])).collect();
        MeshArray { name: NAMES[axis].into(), on: On::Vertices, number, values }
    })
}

/// Linear light, 0 to 1, in sRGB (IEC 61966-2-1).
fn srgb_of(linear: f64) -> f64 {
    let linear = linear.clamp(0.0, 1.0);
    if linear <= 0.003_130_8 { 12.92 * linear } else { 1.055 * libm::pow(linear, 1.0 / 2.4) - 0.055 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_those_of_srgb() {
        let values = srgb(&[[0.0, 0.5, 1.0], [0.001, 0.214, 2.0]]).map(|array| array.values);
        assert_eq!(values, [vec![0.0, 3.0], vec![188.0, 127.0], vec![255.0, 255.0]]);
    }
}
