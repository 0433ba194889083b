//! The data carried by a rebuilt mesh, in the exact state of a frame.

use crate::error::{Error, Result};
use crate::geometry::mesh::attributes::{Number, On};
use crate::geometry::{DetailedMesh, MeshArray, Uvs};
use crate::numeric::bytes::{Reader, Writer};
use crate::numeric::packed;
use crate::numeric::packed::Magic;
use crate::surface::{Params, Tracker};

/// Magic bytes, including the version.
const MAGIC: &Magic = b"frzsrm02";
/// Names the state in messages.
const NOUN: &str = "surface";

const NUMBERS: [Number; 8] =
    [Number::I8, Number::U8, Number::I16, Number::U16, Number::I32, Number::U32, Number::F32, Number::F64];
const ELEMENTS: [On; 3] = [On::Vertices, On::Corners, On::Faces];

/// A saved mesh.
pub struct SavedMesh {
    pub tracker: Tracker,
    /// The data that it carries; `None`: those of the first mesh.
    pub detail: Option<DetailedMesh>,
    /// The last frame at which an edited mesh replaced it.
    pub sculpted: Option<i32>,
}

/// The exact state of a mesh, with the data that it carries and the frame of the last edited mesh. Unless it was rebuilt, its data are
/// those of the first mesh and are not stored.
pub fn save(tracker: &Tracker, detail: &DetailedMesh, sculpted: Option<i32>) -> Vec<u8> {
    let tracker_bytes = tracker.save();
    if !tracker.is_rebuilt() {
        return tracker_bytes;
    }
    let mut to = Writer::default();
    to.count(tracker_bytes.len());
    to.0.extend(tracker_bytes);
    to.u32(u32::from(sculpted.is_some()));
    to.u32(sculpted.unwrap_or_default().cast_unsigned());
    to.count(detail.arrays.len());
    for array in &detail.arrays {
        let code = |found: Option<usize>| found.unwrap_or_default() as u32;
        to.u32(code(NUMBERS.iter().position(|number| *number == array.number)));
        to.u32(code(ELEMENTS.iter().position(|on| *on == array.on)));
        to.count(array.name.len());
        to.0.extend(array.name.as_bytes());
        to.count(array.values.len());
        array.values.iter().for_each(|value| to.f64(*value));
    }
    to.u32(u32::from(detail.uvs.is_some()));
    if let Some(uvs) = &detail.uvs {
        to.count(uvs.missing);
        to.count(uvs.coordinates.len());
        to.f32s(uvs.coordinates.as_flattened());
        let corners = uvs.corners.as_deref();
        to.u32(u32::from(corners.is_some()));
        corners.unwrap_or_default().iter().for_each(|corner| to.u32(*corner));
    }
    packed::pack(&to.0, MAGIC)
}

/// Resumes from what [`save`] wrote; `first` is the initial mesh. The carried data are `None` if they are those of `first`.
///
/// # Errors
/// Bytes that are not such a state, or a state of another mesh.
pub fn resume(params: Params, first: &DetailedMesh, bytes: &[u8]) -> Result<SavedMesh> {
    if !bytes.starts_with(MAGIC) {
        let tracker = Tracker::resume(params, &first.mesh, bytes)?;
        return Ok(SavedMesh { tracker, detail: None, sculpted: None });
    }
    let bytes = packed::unpack(bytes, MAGIC, NOUN)?;
    let mut from = Reader::new(&bytes);
    let length = from.count(1)?;
    let tracker = Tracker::resume(params, &first.mesh, from.bytes(length)?)?;
    let [has_sculpt, frame] = [from.u32()?, from.u32()?];
    let sculpted = (has_sculpt != 0).then_some(frame.cast_signed());
    let [vertices, faces] = [tracker.vertices().len(), tracker.triangles().len()];
    let mut arrays = Vec::new();
    for _ in 0..from.count(8)? {
        let number = *NUMBERS.get(from.u32()? as usize).ok_or_else(mismatch)?;
        let on = *ELEMENTS.get(from.u32()? as usize).ok_or_else(mismatch)?;
        let length = from.count(1)?;
        let name = std::str::from_utf8(from.bytes(length)?).map_err(|_| mismatch())?.to_string();
        let count = from.count(8)?;
        if count != on.count(vertices, faces) {
            return Err(mismatch());
        }
        // A file's data may be NaN.
        let values = (0..count).map(|_| Ok(f64::from_le_bytes(from.take()?))).collect::<Result<_>>()?;
        arrays.push(MeshArray { name, on, number, values });
    }
    let uvs = if from.u32()? == 0 { None } else { Some(uvs(&mut from, vertices, faces)?) };
    from.end()?;
    let detail = Some(DetailedMesh { uvs, arrays, ..DetailedMesh::default() });
    Ok(SavedMesh { tracker, detail, sculpted })
}

fn uvs(from: &mut Reader<'_>, vertices: usize, faces: usize) -> Result<Uvs> {
    let missing = u64::from_le_bytes(from.take()?) as usize;
    let count = from.count(8)?;
    let pair =
        |from: &mut Reader<'_>| Ok([f32::from_le_bytes(from.take()?), f32::from_le_bytes(from.take()?)]);
    let coordinates = (0..count).map(|_| pair(from)).collect::<Result<Vec<[f32; 2]>>>()?;
    if from.u32()? == 0 {
        return if count == vertices {
            Ok(Uvs { coordinates, corners: None, missing })
        } else {
            Err(mismatch())
        };
    }
    let corners = (0..3 * faces).map(|_| from.u32()).collect::<Result<Vec<u32>>>()?;
    if corners.iter().any(|corner| *corner as usize >= count) {
        return Err(mismatch());
    }
    Ok(Uvs { coordinates, corners: Some(corners), missing })
}

fn mismatch() -> Error {
    Error::Bytes("carries what does not fit its mesh".into())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::context::{Context, Pool};
    use crate::geometry::{DVec3, TriMesh};
    use crate::surface::test_particles::{own_surface, two_balls};

    /// A mesh that was rebuilt where two balls met, its initial mesh, and the data that it carries.
    fn rebuilt() -> (Tracker, DetailedMesh, DetailedMesh) {
        let ctx = Context::new(Pool::new(1).unwrap());
        let balls = |away: f64| two_balls(3.2, DVec3::new(away, 0.1, 0.0));
        let mut from = balls(5.0);
        let mesh = own_surface(&ctx, &from.positions);
        let params = Params { rebuild: true, ..Params::for_spacing(1.0) };
        let mut tracker = Tracker::new(&ctx, params, &mesh, &from).unwrap();
        for step in 1..=6 {
            let to = balls(5.0 - 0.3 * f64::from(step));
            tracker.step(&ctx, &from, &to, 0.04).unwrap();
            from = to;
        }
        assert!(tracker.is_rebuilt());
        let [vertices, faces] = [tracker.vertices().len(), tracker.triangles().len()];
        let array = |name: &str, on, count: usize| MeshArray {
            name: name.into(),
            on,
            number: Number::F32,
            values: (0..count).map(|n| if n == 3 { f64::NAN } else { n as f64 }).collect(),
        };
        let arrays = vec![array("wet", On::Vertices, vertices), array("part", On::Faces, faces)];
        let uvs = Uvs { coordinates: vec![[0.5, 0.25]; 7], corners: Some(vec![6; 3 * faces]), missing: 2 };
        let first = DetailedMesh { mesh, ..DetailedMesh::default() };
        (tracker, first, DetailedMesh { mesh: TriMesh::default(), uvs: Some(uvs), arrays })
    }

    #[test]
    fn a_state_round_trips_and_a_changed_one_is_refused_or_read() {
        let (tracker, first, detail) = rebuilt();
        let params = Params { rebuild: true, ..Params::for_spacing(1.0) };
        let bytes = save(&tracker, &detail, Some(-7));
        let SavedMesh { tracker: back, detail: carried, sculpted } = resume(params, &first, &bytes).unwrap();
        let carried = carried.unwrap();
        assert!(save(&back, &carried, sculpted) == bytes && carried.uvs == detail.uvs);
        assert_eq!(sculpted, Some(-7));
        // The checksum detects any damage; with a valid checksum, changed bytes must not panic either.
        let plain = packed::unpack(&bytes, MAGIC, NOUN).unwrap();
        let mut state = 5u64;
        let mut below = |count: usize| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 33) as usize % count
        };
        // The tracker's own bytes have their own checksum: the bytes after them are changed.
        let start = 8 + u64::from_le_bytes(plain[..8].try_into().unwrap()) as usize;
        let rounds = std::env::var("FRAZIL_FUZZ").ok().and_then(|text| text.parse().ok()).unwrap_or(2000);
        let saved = |kept: &SavedMesh| save(&kept.tracker, kept.detail.as_ref().unwrap(), kept.sculpted);
        let [mut refused, mut read] = [0; 2];
        for round in 0..rounds {
            let mut changed = plain.clone();
            if round % 4 == 0 {
                let length = start + below(plain.len() - start);
                changed.truncate(length);
                let is_read = resume(params, &first, &packed::pack(&changed, MAGIC)).is_ok();
                assert!(!is_read, "{length} of {} bytes", plain.len());
                continue;
            }
            let at = start + below(if round % 4 == 1 { 100 } else { plain.len() - start });
            changed[at] ^= 1 << below(8);
            match resume(params, &first, &packed::pack(&changed, MAGIC)) {
                Err(_) => refused += 1,
                Ok(kept) => {
                    // A valid state.
                    let again = saved(&kept);
                    let back = resume(params, &first, &again).unwrap();
                    assert!(saved(&back) == again, "byte {at}");
                    read += 1;
                }
            }
        }
        // Half of the bytes are numbers of arrays, which may have any value. Most others are indices of texture coordinates, of which few
        // values are valid.
        assert!(refused > rounds / 5 && read > rounds / 5, "{refused} refused, {read} read");
    }
}
