//! The exact state of a mesh that follows particles as bytes, from which a run resumes.

use xxhash_rust::xxh3::xxh3_128;

use super::params::Params;
use super::remesh::drift::{Drift, WINDOW};
use super::remesh::sizes;
use super::tracked_mesh::Tracker;
use crate::error::{Error, Result, fail_if};
use crate::geometry::{DVec3, TriMesh};
use crate::numeric::bytes::{Reader, Writer};
use crate::numeric::packed;
use crate::numeric::packed::Magic;

/// Magic bytes, including the version.
const MAGIC: &Magic = b"frzsrf04";
/// Name in messages.
const NOUN: &str = "surface";

impl Tracker {
    /// The exact state, the same bytes for any number of threads; triangles, detail retention and sizes are included only if the mesh was
    /// rebuilt.
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
            self.flags
                .iter()
                .zip(&self.never_covered)
                .map(|(flag, never_covered)| u8::from(*flag) | u8::from(*never_covered) << 1),
        );
        packed::pack(&to.0, MAGIC)
    }

    /// Unpacked size (bytes) of a saved state; 0 if it is invalid.
    pub fn unpacked_size(bytes: &[u8]) -> u64 {
        packed::unpacked_size(bytes, MAGIC, NOUN)
    }

    /// Resumes from a state that [`Tracker::save`] wrote; `mesh` is the initial mesh.
    ///
    /// # Errors
    /// Parameters out of range; bytes that are not a valid state, or the state for another spacing, cell or mesh.
    pub fn resume(params: Params, mesh: &TriMesh, bytes: &[u8]) -> Result<Self> {
        params.validate()?;
        mesh.validate()?;
        let bytes = packed::unpack(bytes, MAGIC, NOUN)?;
        let mut from = Reader::new(&bytes);
        let wrong = |what: &str| Error::Bytes(what.into());
        for (name, own) in [("spacing", params.spacing), ("cell", params.cell)] {
            let there = from.f64()?;
            fail_if(there != own, || wrong(&format!("has a {name} of {there}, not {own}")))?;
        }
        let reach = from.f64()?;
        // No valid state has more, and a band that wide would exhaust memory.
        fail_if(!(0.0..=100.0).contains(&reach), || wrong(&format!("has a band of {reach} spacings")))?;
        let drift = drift(&mut from)?;
        let is_rebuilt = from.u32()? != 0;
        let (mut is_other, mut made) = (false, (mesh.triangles.clone(), Vec::new(), Vec::new()));
        if is_rebuilt {
            made = (
                list(&mut from, 3 * 4, |from| Ok([from.u32()?, from.u32()?, from.u32()?]))?,
                list(&mut from, 4, |from| Ok(from.f32s::<1>()?[0]))?,
                list(&mut from, 8, |from| from.f32s::<2>())?,
            );
        } else {
            is_other = from.take::<16>()? != seal(&mesh.triangles);
        }
        let (triangles, detail_retention, own) = made;
        let count = from.count(3 * 8 + 4 + 1)?;
        fail_if(!is_rebuilt && count != mesh.positions.len(), || {
            wrong(&format!("belongs to a mesh of {count} vertices, not {}", mesh.positions.len()))
        })?;
        fail_if(is_other, || wrong("belongs to a mesh with other triangles"))?;
        let is_wild = triangles.as_flattened().iter().any(|corner| *corner as usize >= count);
        fail_if(is_wild, || wrong("has a triangle with a vertex that does not exist"))?;
        let is_share = |share: &f32| (0.0..=1.0).contains(share);
        let fits = [0, count].contains(&detail_retention.len()) && detail_retention.iter().all(is_share);
        fail_if(!fits, || wrong("has shares of detail that do not fit"))?;
        let vertex = |_| Ok(DVec3::new(from.f64()?, from.f64()?, from.f64()?));
        let vertices = (0..count).map(vertex).collect::<Result<Vec<_>>>()?;
        // NaN for a vertex without a distance.
        let delta = (0..count).map(|_| Ok(f32::from_le_bytes(from.take()?))).collect::<Result<Vec<f32>>>()?;
        let is_wild = delta.iter().any(|delta| delta.is_infinite());
        fail_if(is_wild, || wrong("has a distance that is not finite"))?;
        let bits = from.bytes(count)?;
        from.end()?;
        let [flags, never_covered] = [1, 2].map(|bit| bits.iter().map(|bits| bits & bit != 0).collect());
        let sizes = match (params.rebuild, is_rebuilt) {
            (false, _) => Vec::new(),
            (true, true) if own.len() == count => own,
            (true, true) => return Err(wrong("has sizes that do not fit")),
            (true, false) => {
                let positions: Vec<DVec3> = mesh.positions.iter().map(|position| position.cast()).collect();
                sizes(&positions, &mesh.triangles)
            }
        };
        let drift = match (params.rebuild, drift.vertices.len()) {
            (false, _) => Drift::default(),
            (true, 0) => Drift::at_reference(count),
            (true, own) if own == count => drift,
            (true, _) => return Err(wrong("has displacements that do not fit")),
        };
        let own = Self::of(params, vertices, triangles);
        Ok(Self { delta, detail_retention, flags, never_covered, reach, is_rebuilt, sizes, drift, ..own })
    }
}

/// Reads a list: its length, then its items of this many bytes each.
fn list<T>(
    from: &mut Reader<'_>,
    bytes: usize,
    item: impl Fn(&mut Reader<'_>) -> Result<T>,
) -> Result<Vec<T>> {
    let count = from.count(bytes)?;
    (0..count).map(|_| item(from)).collect()
}

/// Reads the drift.
fn drift(from: &mut Reader<'_>) -> Result<Drift> {
    let steps = from.u32()?;
    let vertices = list(from, 12, |from| from.f32s::<3>())?;
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
