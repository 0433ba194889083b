//! Options that several commands share, and how their values are written.

use frazil::Result;
use frazil::base::mesh::too_far;
use frazil::base::{DVec3, TriMesh};
use frazil::context::machine_memory;
use frazil::motion::{Space, Up};
use frazil::render::Size;
use std::path::Path;
use std::str::FromStr;

/// An amount of memory: bytes, or a part of the machine's.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Amount {
    /// So many bytes.
    Bytes(u64),
    /// A part of the machine's memory, 0..=1.
    Part(f64),
}

impl Amount {
    /// In bytes; without a limit when the machine does not report its memory.
    pub fn bytes(self) -> u64 {
        match self {
            Self::Bytes(bytes) => bytes,
            Self::Part(part) => machine_memory().map_or(u64::MAX, |bytes| (bytes as f64 * part) as u64),
        }
    }
}

impl FromStr for Amount {
    type Err = String;

    fn from_str(text: &str) -> std::result::Result<Self, String> {
        let wrong = || "write a size such as 8G, 512M or 50%".to_string();
        let split = text.find(|letter: char| letter.is_alphabetic() || letter == '%').unwrap_or(text.len());
        let number: f64 = text[..split].trim().parse().map_err(|_| wrong())?;
        let unit = text[split..].to_uppercase();
        let scale = match unit.trim_end_matches('B').trim_end_matches('I') {
            "%" if (0.0..=100.0).contains(&number) => return Ok(Self::Part(number / 100.0)),
            "" => 1.0,
            "K" => 1024.0,
            "M" => 1024.0 * 1024.0,
            "G" => 1024.0 * 1024.0 * 1024.0,
            "T" => 1024.0 * 1024.0 * 1024.0 * 1024.0,
            _ => return Err(wrong()),
        };
        let bytes = number * scale;
        if (0.0..1.0e19).contains(&bytes) { Ok(Self::Bytes(bytes as u64)) } else { Err(wrong()) }
    }
}

/// How a mesh file's space becomes metres with Y up.
#[derive(clap::Args)]
pub struct MeshSpace {
    /// Factor from the mesh file's unit to metres.
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = positive)]
    pub scale: f64,
    /// The mesh file's upward axis.
    #[arg(long, value_name = "AXIS", default_value = "y")]
    pub up: Axis,
}

/// An upward axis.
#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub enum Axis {
    /// As frazil, Houdini, Maya.
    Y,
    /// As Blender, 3ds Max.
    Z,
}

impl MeshSpace {
    /// As the library wants it.
    pub fn space(&self) -> Space {
        let up = match self.up {
            Axis::Y => Up::Y,
            Axis::Z => Up::Z,
        };
        Space { scale: self.scale, up }
    }

    /// Reads a mesh into metres, Y up.
    pub fn read(&self, path: &Path) -> Result<TriMesh> {
        let mut mesh = frazil::io::mesh::read(path)?;
        let space = self.space();
        mesh.positions.iter_mut().for_each(|position| *position = space.place(position.cast()).cast());
        Ok(mesh)
    }
}

/// The message for a mesh so far away (m) that its file's 32-bit positions are coarse compared with a cell (m).
pub fn far_mesh(path: &Path, mesh: &TriMesh, cell: f64) -> Option<String> {
    let farthest = mesh.positions.iter().map(|p| f64::from(p.amax())).fold(0.0, f64::max);
    too_far(&path.display().to_string(), farthest, 1.0, cell)
}

/// A picture's size: `1280x720`.
pub fn size(text: &str) -> std::result::Result<Size, String> {
    let wrong = || "write a size such as 1280x720, at most 16384 pixels each way".to_string();
    let (width, height) = text.split_once('x').ok_or_else(wrong)?;
    let pixels = |text: &str| text.parse::<u32>().ok().filter(|n| (1..=16_384).contains(n)).ok_or_else(wrong);
    Ok(Size { width: pixels(width)?, height: pixels(height)? })
}

/// Number of a positive length or factor.
pub fn positive(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number > 0.0 && number.is_finite() => Ok(number),
        _ => Err("it must be a number above 0".to_string()),
    }
}

/// A finite number.
pub fn finite(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(number) if number.is_finite() => Ok(number),
        _ => Err("it must be a finite number".to_string()),
    }
}

/// `X,Y,Z`.
pub fn triple(text: &str) -> std::result::Result<DVec3, String> {
    let numbers: Option<Vec<f64>> = text.split(',').map(|part| finite(part.trim()).ok()).collect();
    match numbers.as_deref() {
        Some([x, y, z]) => Ok(DVec3::new(*x, *y, *z)),
        _ => Err("write three numbers, X,Y,Z".to_string()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_of_memory_have_units() {
        assert_eq!("8G".parse(), Ok(Amount::Bytes(8 << 30)));
        assert_eq!("1.5 MiB".parse(), Ok(Amount::Bytes(3 << 19)));
        assert_eq!("100".parse(), Ok(Amount::Bytes(100)));
        assert_eq!("50%".parse(), Ok(Amount::Part(0.5)));
        for wrong in ["", "G", "-1G", "150%", "8 parsecs", "nan"] {
            assert!(wrong.parse::<Amount>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn points_are_three_numbers() {
        assert_eq!(triple("1,-2, 0.5"), Ok(DVec3::new(1.0, -2.0, 0.5)));
        assert!(triple("1,2").is_err());
        assert!(triple("1,2,nan").is_err());
    }
}
