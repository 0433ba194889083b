//! Particle caches in files, by extension: classic .bgeo (version 5, plain or in gzip), legacy .vtk, .vtu, .xyz, .ply and binary USD.
//! Points in .vdb files are read by `vdb::points`.
//!
//! | file | what is read |
//! |---|---|
//! | .bgeo, .bgeo.gz, .bhclassic | classic version 5, as SPlisHSPlasH and Partio write it, plain or in gzip |
//! | .vtk | legacy 1.0 to 5.1, text and binary: POLYDATA and UNSTRUCTURED_GRID |
//! | .vtu | UnstructuredGrid, all pieces: text, base64, appended raw and base64; plain, zlib and LZ4 |
//! | .xyz | text with x, y and z in the first three columns, or little-endian 32-bit floats |
//! | .ply | vertices: see [`ply`] |
//! | .usdc, .usd | binary USD with one prim of points: v, id, pscale and primvars |
//!
//! Attributes keep the names of the file. Floats become 32-bit, positions stay 64-bit. Signed integers of up to 32 bits become 32-bit,
//! longer ones 64-bit. As in .ply, `id` becomes 64-bit integers, `active` and `trapped` become `bool`, and a value that all points share is
//! stored once. Attributes with a number of components other than one or three, texts, and attributes named `P` or without a name are
//! listed in a warning and left out.

mod bgeo;
pub mod ply;
mod usd;
mod vtk;
mod vtu;
mod vtu_data;
mod xyz;

use std::path::Path;

use super::files::caught::caught;
use super::files::numbers::{Kind, Numbers};
use super::files::source::Parsed;
use super::files::{atomic, source};
use crate::error::{Error, Result, fail_if, one_line};
use crate::geometry::DVec3;
use crate::geometry::mesh::spacing;
use crate::geometry::points::{Attribute, Column, Points, Values};

/// Extensions of the files that can be read.
pub const READ: [&str; 9] = ["bgeo", "bgeo.gz", "bhclassic", "ply", "usdc", "usd", "vtk", "vtu", "xyz"];
/// Extensions of the files that can be written.
pub const WRITTEN: [&str; 5] = ["bgeo", "bgeo.gz", "bhclassic", "ply", "xyz"];

/// Points of a file, and their voxel size if the file states it.
#[derive(Debug, Clone, PartialEq)]
pub struct ParticleData {
    /// Positions (m).
    pub positions: Vec<DVec3>,
    /// Attributes.
    pub attributes: Vec<Attribute>,
    /// Edge of a voxel (m), if the file states it.
    pub voxel_size: Option<f64>,
}

impl ParticleData {
    /// The values of the attribute of this name.
    pub fn attribute(&self, name: &str) -> Option<&Values> {
        self.attributes.iter().find(|attribute| attribute.name == name).map(|attribute| &attribute.values)
    }

    /// Removes the particles that are not to be kept.
    ///
    /// # Panics
    /// Unless there is one flag for each particle.
    pub fn retain(&mut self, kept: &[bool]) {
        assert_eq!(kept.len(), self.positions.len(), "one flag for each particle");
        let order: Vec<u32> = (0..).zip(kept).filter(|(_, kept)| **kept).map(|(n, _)| n).collect();
        self.positions = order.iter().map(|&n| self.positions[n as usize]).collect();
        self.attributes.iter_mut().for_each(|attribute| attribute.values.reorder(&order));
    }

    /// The points, in voxels of the given size (m), by default the file's own.
    ///
    /// # Errors
    /// No size, or positions out of its range: see [`Points::at`]; attributes that [`Points::validate`] refuses.
    pub fn into_points(self, voxel_size: Option<f64>) -> Result<Points> {
        let unknown = || Error::argument("the file does not say how large the voxels of its points are");
        let size = voxel_size.or(self.voxel_size).ok_or_else(unknown)?;
        let points = Points { attributes: self.attributes, ..Points::at(size, &self.positions)? };
        points.validate()?;
        Ok(points)
    }
}

impl From<Points> for ParticleData {
    fn from(points: Points) -> Self {
        let positions = (0..points.count()).map(|point| points.position(point)).collect();
        Self { positions, attributes: points.attributes, voxel_size: Some(points.voxel_size) }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Format {
    Bgeo,
    /// Houdini's own format, compressed.
    BgeoSc,
    Ply,
    Usd,
    Vtk,
    Vtu,
    Xyz,
}

fn format(path: &Path) -> Option<Format> {
    let name = path.file_name()?.to_string_lossy().to_lowercase();
    let endings = [
        (".bgeo", Format::Bgeo),
        (".bgeo.gz", Format::Bgeo),
        (".bhclassic", Format::Bgeo),
        (".bgeo.sc", Format::BgeoSc),
        (".ply", Format::Ply),
        (".usdc", Format::Usd),
        (".usd", Format::Usd),
        (".vtk", Format::Vtk),
        (".vtu", Format::Vtu),
        (".xyz", Format::Xyz),
    ];
    endings.into_iter().find(|(ending, _)| name.ends_with(ending)).map(|(_, format)| format)
}

/// Whether a file's name is that of a particle file: those of [`READ`], and .bgeo.sc, which [`read`] refuses with advice.
pub fn has_extension_of_particles(path: &Path) -> bool {
    format(path).is_some()
}

/// Whether a file of this name holds points or a mesh, whichever it says: .ply and USD.
pub fn may_hold_mesh(path: &Path) -> bool {
    matches!(format(path), Some(Format::Ply | Format::Usd))
}

/// Whether a file holds points and no mesh, as its contents say where [`may_hold_mesh`], and its name otherwise.
///
/// # Errors
/// A file that cannot be read.
pub fn holds_points(path: &Path) -> Result<bool> {
    Ok(match format(path) {
        Some(Format::Ply) => ply::holds_points(&source::read(path)?),
        Some(Format::Usd) => usd::holds_points(&source::read(path)?),
        other => other.is_some(),
    })
}

/// Advice about a file of this name that no reader accepts; none for other names.
pub fn advice(path: &Path) -> Option<&'static str> {
    (format(path) == Some(Format::BgeoSc)).then_some(bgeo::HOUDINI_JSON)
}

/// Whether [`write()`] accepts a file of this name.
pub fn can_write(path: &Path) -> bool {
    matches!(format(path), Some(Format::Bgeo | Format::Ply | Format::Xyz))
}

/// Reads the particles of a file, in the file's order and its units.
///
/// # Errors
/// A file that is missing, empty, cut short or malformed; a position that is not finite (the particle is named, counted from 1); an integer
/// that is out of its type's range; Houdini's own .bgeo.
pub fn read(path: &Path) -> Result<ParticleData> {
    parse(path, &source::read(path)?)
}

/// As [`read`], from the bytes of the file.
///
/// # Errors
/// As [`read`].
pub fn parse(path: &Path, bytes: &[u8]) -> Result<ParticleData> {
    fail_if(bytes.is_empty(), || Error::file(path, "the file is empty"))?;
    let found = |parse: fn(&[u8]) -> Parsed<ParticleColumns>| parse(bytes).map(ParticleColumns::into_parts);
    let parse = || match format(path) {
        Some(Format::Bgeo) => found(bgeo::parse),
        Some(Format::BgeoSc) => Err(bgeo::HOUDINI_JSON.into()),
        Some(Format::Ply) => ply::parse(bytes).map(|cloud| (cloud, Vec::new())),
        Some(Format::Usd) => found(usd::parse),
        Some(Format::Vtk) => found(vtk::parse),
        Some(Format::Vtu) => found(vtu::parse),
        Some(Format::Xyz) => found(xyz::parse),
        None => Err(format!("a file of particles must be {}", listed(&READ))),
    };
    let (cloud, left_out) = caught(path, || parse().map_err(|what| Error::file(path, one_line(&what))))?;
    if let Some(n) = cloud.positions.iter().position(|position| !position.iter().all(|part| part.is_finite()))
    {
        return Err(Error::file(path, format!("the position of particle {} is not finite", n + 1)));
    }
    if !left_out.is_empty() {
        let list = one_line(&left_out.join(", "));
        log::warn!("{}: attributes that points cannot have are left out: {list}", path.display());
    }
    Ok(cloud)
}

/// Writes points, whole or not at all: .bgeo and .bhclassic as classic version 5, gzipped, with 32-bit positions and integers; .xyz as
/// little-endian 32-bit floats, without attributes, which a warning names; .ply as [`ply`] does, with the voxel size if `keeps_voxels`.
///
/// # Errors
/// Another extension; integers that the format cannot hold; what the operating system reports.
pub fn write(path: &Path, points: &Points, keeps_voxels: bool) -> Result<()> {
    match format(path) {
        Some(Format::Ply) if keeps_voxels => ply::write(path, points),
        Some(Format::Ply) => ply::write_without_voxels(path, points),
        Some(Format::Bgeo) => {
            bgeo::check(points).map_err(|what| Error::file(path, what))?;
            warn_of_rounding(path, points);
            atomic::write(path, |out| bgeo::write(out, points))
        }
        Some(Format::Xyz) => {
            warn_of_rounding(path, points);
            if !points.attributes.is_empty() {
                let names: Vec<&str> =
                    points.attributes.iter().map(|attribute| &attribute.name[..]).collect();
                log::warn!("{}: .xyz holds positions only, without {}", path.display(), names.join(", "));
            }
            atomic::write(path, |out| xyz::write(out, points))
        }
        _ => Err(Error::file(path, format!("a file of particles must be {}", listed(&WRITTEN)))),
    }
}

fn listed(extensions: &[&str]) -> String {
    extensions.iter().map(|extension| format!(".{extension}")).collect::<Vec<_>>().join(", ")
}

/// Maximum rounding of a position (m) without a warning.
const MAX_ROUNDING: f64 = 1e-3;

fn warn_of_rounding(path: &Path, points: &Points) {
    let farthest = points.bounds().map_or(0.0, |(low, high)| low.amax().max(high.amax()));
    let rounding = spacing(farthest) / 2.0;
    if rounding > MAX_ROUNDING {
        log::warn!("{}: positions in 32 bits are rounded, by up to {rounding} m", path.display());
    }
}

/// The particles of a file, as a reader returns them.
#[derive(Debug)]
pub(super) struct ParticleColumns {
    positions: Vec<DVec3>,
    attributes: Vec<Attribute>,
    /// Attributes that no [`Values`] can hold.
    left_out: Vec<String>,
}

impl ParticleColumns {
    /// Positions, three numbers each; an incomplete last one is ignored.
    pub fn new(numbers: Numbers) -> Self {
        let numbers = numbers.into_floats();
        let positions = numbers
            .chunks_exact(3)
            .map(|position| DVec3::new(position[0], position[1], position[2]))
            .collect();
        Self { positions, attributes: Vec::new(), left_out: Vec::new() }
    }

    /// Number of particles.
    pub fn count(&self) -> usize {
        self.positions.len()
    }

    /// Adds an attribute with one value, or a fixed number of components, for each particle.
    ///
    /// # Errors
    /// Another number of values; an `id` that is not an integer.
    pub fn add(&mut self, name: &str, kind: Kind, components: usize, numbers: Numbers) -> Parsed<()> {
        if self.count().checked_mul(components) != Some(numbers.count()) {
            let count = self.count();
            return Err(format!(
                "attribute \"{name}\" does not have one value for each of {count} particles"
            ));
        }
        if name.is_empty() || name == "P" || ![1, 3].contains(&components) {
            self.leave_out(name);
            return Ok(());
        }
        let values = if components == 3 {
            let numbers = numbers.into_floats();
            vectors(numbers.chunks_exact(3).map(|v| [0, 1, 2].map(|axis| v[axis] as f32)))
        } else {
            scalars(name, numbers, kind.fits_int())?
        };
        self.attributes.push(Attribute { name: name.into(), values });
        Ok(())
    }

    /// Records an attribute that was left out.
    pub fn leave_out(&mut self, name: &str) {
        self.left_out.push(format!("\"{name}\""));
    }

    fn into_parts(self) -> (ParticleData, Vec<String>) {
        let Self { positions, attributes, left_out } = self;
        (ParticleData { positions, attributes, voxel_size: None }, left_out)
    }
}

/// An attribute of vectors.
fn vectors(all: impl Iterator<Item = [f32; 3]>) -> Values {
    Values::Vector(shared(all.collect(), |v| v.map(f32::to_bits)))
}

/// An attribute of one number for each particle: its type depends on its name, on the type of the numbers, and on whether integers fit 32
/// bits.
fn scalars(name: &str, numbers: Numbers, fits_int: bool) -> Parsed<Values> {
    Ok(match (name, numbers) {
        ("id", Numbers::Floats(numbers)) => Values::Long(shared(integers(name, &numbers)?, |&id| id)),
        ("active" | "trapped", numbers) => {
            let yes = numbers.into_floats().into_iter().map(|value| value != 0.0).collect();
            Values::Bool(shared(yes, |&yes| yes))
        }
        (_, Numbers::Floats(numbers)) => {
            let floats = numbers.into_iter().map(|value| value as f32).collect();
            Values::Float(shared(floats, |value| value.to_bits()))
        }
        (_, Numbers::Integers(numbers)) if name != "id" && fits_int => {
            let integers = numbers.into_iter().map(|value| value as i32).collect();
            Values::Int(shared(integers, |&value| value))
        }
        (_, Numbers::Integers(numbers)) => Values::Long(shared(numbers, |&value| value)),
    })
}

/// Floats as 64-bit integers, if all are integers.
fn integers(name: &str, column: &[f64]) -> Parsed<Vec<i64>> {
    let exact = |(row, &value): (usize, &f64)| {
        let is_whole = value.fract() == 0.0 && value.abs() <= (1u64 << 53) as f64;
        is_whole
            .then_some(value as i64)
            .ok_or_else(|| format!("{name} of particle {} is not a whole number", row + 1))
    };
    column.iter().enumerate().map(exact).collect()
}

/// A single value if all have the same key.
fn shared<T: Copy, K: PartialEq>(values: Vec<T>, key: impl Fn(&T) -> K) -> Column<T> {
    match values.first() {
        Some(first) if values.len() > 1 && values.iter().all(|value| key(value) == key(first)) => {
            Column::Uniform(*first)
        }
        _ => Column::Each(values),
    }
}
