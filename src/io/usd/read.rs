//! Opens binary USD files that are read: what meshes and points have in common.

use super::binary::{Crate, ReadPrim};
use super::file::Units;
use super::layer::Value;
use super::transforms::{self, Transform, Transforms};
use crate::error::fail_if;
use crate::geometry::DVec3;
use crate::io::files::source::Parsed;

/// A file that has been opened, with its units and transforms.
pub(in crate::io) struct UsdFile<'a> {
    data: Crate<'a>,
    units: Units,
    transforms: Transforms,
}

impl<'a> UsdFile<'a> {
    /// Opens a file.
    ///
    /// # Errors
    /// A text file; a file that is cut short or damaged; a unit that is not a length.
    pub fn open(bytes: &'a [u8]) -> Parsed<Self> {
        let data = Crate::open(bytes)?;
        // USD's own unit, where a file gives none, is the centimetre.
        let metres = data.metadata_number("metersPerUnit")?.unwrap_or(0.01);
        fail_if(!(metres.is_finite() && metres > 0.0), || format!("its unit cannot be {metres} m"))?;
        let z_up = data.metadata_token("upAxis").is_some_and(|axis| axis == "Z");
        let transforms = transforms::of_all(&data);
        Ok(Self { data, units: Units { metres, z_up }, transforms })
    }

    /// Whether it has a prim of a type.
    pub fn has(&self, class: &str) -> bool {
        self.data.prims().iter().any(|prim| prim.class == class)
    }

    /// The prims of a type.
    ///
    /// # Errors
    /// There is no such prim.
    pub fn prims(&self, class: &str, what: &str) -> Parsed<Vec<&ReadPrim>> {
        let prims: Vec<&ReadPrim> = self.data.prims().iter().filter(|prim| prim.class == class).collect();
        fail_if(prims.is_empty(), || format!("it has no {what}"))?;
        Ok(prims)
    }

    /// The value of a prim's attribute, at the first of its times.
    ///
    /// # Errors
    /// A file that is cut short or damaged.
    pub fn value(&self, prim: &ReadPrim, name: &str) -> Parsed<Option<Value>> {
        prim.attribute(name).map_or(Ok(None), |attribute| self.data.value(attribute))
    }

    /// Its transform to the layer's space.
    fn transform(&self, prim: &ReadPrim) -> Parsed<Transform> {
        self.transforms.get(&prim.path).cloned().unwrap_or_else(|| Err("it is not in the file".into()))
    }

    /// Whether a prim's transform mirrors it.
    ///
    /// # Errors
    /// A transform that cannot be read.
    pub fn is_mirrored(&self, prim: &ReadPrim) -> Parsed<bool> {
        Ok(self.transform(prim)?.mirrors())
    }

    /// Metres per unit of length in a prim's space.
    ///
    /// # Errors
    /// A transform that cannot be read.
    pub fn scale(&self, prim: &ReadPrim) -> Parsed<f64> {
        Ok(self.transform(prim)?.scale() * self.units.metres)
    }

    /// A prim's positions relative to `origin`, which is in the file's unit and axes, in metres with Y up.
    ///
    /// # Errors
    /// As [`UsdFile::value`]; a transform that cannot be read.
    pub fn positions(&self, prim: &ReadPrim, origin: DVec3) -> Parsed<Vec<DVec3>> {
        let transform = self.transform(prim)?;
        let moved = |position: DVec3| self.in_metres(transform.point(position) - origin);
        Ok(match self.value(prim, "points")? {
            Some(Value::Vectors(all)) => all.into_iter().map(|p| moved(p.map(f64::from).into())).collect(),
            Some(Value::DoubleVectors(all)) => all.into_iter().map(|p| moved(p.into())).collect(),
            _ => Vec::new(),
        })
    }

    /// A prim's velocities (m/s); none unless it has one for each of `count` points.
    ///
    /// # Errors
    /// As [`UsdFile::positions`].
    pub fn velocities(&self, prim: &ReadPrim, count: usize) -> Parsed<Option<Vec<DVec3>>> {
        let Some(Value::Vectors(all)) = self.value(prim, "velocities")? else { return Ok(None) };
        let transform = self.transform(prim)?;
        let in_metres = |velocity: [f32; 3]| self.in_metres(transform.vector(velocity.map(f64::from).into()));
        Ok((all.len() == count).then(|| all.into_iter().map(in_metres).collect()))
    }

    /// A vector of the file in metres with Y up.
    fn in_metres(&self, vector: DVec3) -> DVec3 {
        let vector = vector * self.units.metres;
        if self.units.z_up { DVec3::new(vector.x, vector.z, -vector.y) } else { vector }
    }
}
