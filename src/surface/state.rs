//! The exact state of a mesh that follows particles as bytes, from which a run resumes.

use xxhash_rust::xxh3::xxh3_128;

use super::params::Params;
use super::remesh::drift::{Drift, WINDOW};
use super::remesh::sizes;
use super::tracked_mesh::Tracker;
use crate::error::{Error, Result};
use crate::geometry::{DVec3, TriMesh};
use crate::numeric::bytes::{Reader, Writer};
use crate::numeric::packed;
use crate::numeric::packed::Magic;

/// Magic bytes, including the version.
const MAGIC: &Magic = b"frzsrf04";
/// Name in messages.
const NOUN: &str = "surface";

impl Tracker {
    /// The exact state, the same bytes for any number of threads; triangles and detail retention are included only if the mesh was rebuilt.
    pub fn save(&self) -> Vec<u8> {
        let mut to = Writer::default();
        [self.params.spacing, self.params.cell, self.reach].into_iter().for_each(|number| to.f64(number));
        to.u32(self.drift.steps);
        to.count(self.drift.vertices.len());
        to.f32s(self.drift.vertices.as_flattened());
        to.u32(u32::from(self.is_rebuilt));
        if self.is_rebuilt {
            to.count(self.triangles.len());
            self.triangles.as_flattened().iter().for_each(|corner| to.u32(*corner));
            to.count(self.detail_retention.len());
            to.f32s(&self.detail_retention);
            to.count(self.sizes.len());
            to.f32s(self.sizes.as_flattened());
        } else {
            to.0.extend(seal(&self.triangles));
        }
        to.count(self.vertices.len());
        self.vertices.iter().flatten().for_each(|part| to.f64(*part));
        to.f32s(&self.delta);
        to.0.extend(
            self.flags.iter().zip(&self.bare).map(|(flag, bare)| u8::from(*flag) | u8::from(*bare) << 1),
        );
        packed::pack(&to.0, MAGIC)
    }

    /// Unpacked size (bytes) of a saved state; 0 if it is invalid.
    pub fn unpacked(bytes: &[u8]) -> u64 {
        packed::unpacked(bytes, MAGIC, NOUN)
    }

    /// Resumes from a state that [`Tracker::save`] wrote; `mesh` is the initial mesh.
    ///
    /// # Errors
    /// Parameters out of range; bytes that are not a valid state, or the state of other cells or of another mesh.
    pub fn resume(params: Params, mesh: &TriMesh, bytes: &[u8]) -> Result<Self> {
        params.validate()?;
        mesh.validate()?;
        let bytes = packed::unpack(bytes, MAGIC, NOUN)?;
        let mut from = Reader::new(&bytes);
        let wrong = |what: String| Err(Error::Bytes(what));
        for (name, own) in [("spacing", params.spacing), ("cell", params.cell)] {
            let there = from.f64()?;
            if there != own {
                return wrong(format!("has a {name} of {there}, not {own}"));
            }
        }
        let reach = from.f64()?;
        // No valid state has more, and a band that wide would exhaust memory.
        if !(0.0..=100.0).contains(&reach) {
            return wrong(format!("has a band of {reach} spacings"));
        }
        let drift = drift(&mut from)?;
        let is_rebuilt = from.u32()? != 0;
        let (mut triangles, mut detail_retention) = (mesh.triangles.clone(), Vec::new());
        let (mut is_other, mut own) = (false, Vec::new());
        if is_rebuilt {
            let count = from.count(3 * 4)?;
            triangles =
                (0..count).map(|_| Ok([from.u32()?, from.u32()?, from.u32()?])).collect::<Result<_>>()?;
            let count = from.count(4)?;
            detail_retention = (0..count).map(|_| Ok(from.f32s::<1>()?[0])).collect::<Result<Vec<f32>>>()?;
            let count = from.count(8)?;
            own = (0..count).map(|_| from.f32s::<2>()).collect::<Result<_>>()?;
        } else {
            is_other = from.take::<16>()? != seal(&mesh.triangles);
        }
        let count = from.count(3 * 8 + 4 + 1)?;
        if !is_rebuilt && count != mesh.positions.len() {
            return wrong(format!("is of a mesh of {count} vertices, not {}", mesh.positions.len()));
        }
        if is_other {
            return wrong("is of a mesh of other triangles".into());
        }
        if triangles.as_flattened().iter().any(|corner| *corner as usize >= count) {
            return wrong("has a triangle without a vertex".into());
        }
        if !(detail_retention.is_empty() || detail_retention.len() == count)
            || !detail_retention.iter().all(|share| (0.0..=1.0).contains(share))
        {
            return wrong("has shares of detail that do not fit".into());
        }
        let mut vertices = Vec::with_capacity(count);
        for _ in 0..count {
            vertices.push(DVec3::new(from.f64()?, from.f64()?, from.f64()?));
        }
        // NaN for a vertex without a distance.
        let delta = (0..count).map(|_| Ok(f32::from_le_bytes(from.take()?))).collect::<Result<Vec<f32>>>()?;
        if delta.iter().any(|delta| delta.is_infinite()) {
            return wrong("has a distance that is not finite".into());
        }
        let bits = from.bytes(count)?;
        from.end()?;
        let [flags, bare] = [1, 2].map(|bit| bits.iter().map(|bits| bits & bit != 0).collect());
        let sizes = match (params.rebuild, is_rebuilt) {
            (false, _) => Vec::new(),
            (true, true) if own.len() == count => own,
            (true, true) => return wrong("has sizes that do not fit".into()),
            (true, false) => {
                let positions: Vec<DVec3> = mesh.positions.iter().map(|position| position.cast()).collect();
                sizes(&positions, &mesh.triangles)
            }
        };
        let drift = match (params.rebuild, drift.vertices.len()) {
            (false, _) => Drift::default(),
            (true, 0) => Drift::at_reference(count),
            (true, own) if own == count => drift,
            (true, _) => return wrong("has displacements that do not fit".into()),
        };
        let own = Self::of(params, vertices, triangles);
        Ok(Self { delta, detail_retention, flags, bare, reach, is_rebuilt, sizes, drift, ..own })
    }
}

/// The drift of a state.
fn drift(from: &mut Reader<'_>) -> Result<Drift> {
    let steps = from.u32()?;
    let count = from.count(12)?;
    let vertices = (0..count).map(|_| from.f32s::<3>()).collect::<Result<Vec<_>>>()?;
    if steps >= WINDOW {
        return Err(Error::Bytes(format!("has displacements over {steps} steps, not under {WINDOW}")));
    }
    Ok(Drift { steps, vertices })
}

/// Checksum that identifies a mesh by its triangles.
fn seal(triangles: &[[u32; 3]]) -> [u8; 16] {
    let bytes: Vec<u8> = triangles.as_flattened().iter().flat_map(|corner| corner.to_le_bytes()).collect();
    xxh3_128(&bytes).to_le_bytes()
}
