//! What a mesh that was rebuilt carries, in the exact state of a frame.

use crate::base::arrays::{Number, On};
use crate::base::bytes::{Reader, Writer};
use crate::base::packed::{self, Magic};
use crate::base::{DetailedMesh, MeshArray, Uvs};
use crate::error::{Error, Result};
use crate::surface::{Params, Tracker};

/// Magic bytes, including the version.
const MAGIC: &Magic = b"frzsrm01";
/// What messages call it.
const NOUN: &str = "surface";

const NUMBERS: [Number; 8] =
    [Number::I8, Number::U8, Number::I16, Number::U16, Number::I32, Number::U32, Number::F32, Number::F64];
const PLACES: [On; 3] = [On::Vertices, On::Corners, On::Faces];

/// The exact state of a mesh, with what it carries now; as long as it was not rebuilt that is what it began with.
pub fn save(tracker: &Tracker, detail: &DetailedMesh) -> Vec<u8> {
    let own = tracker.save();
    if !tracker.is_rebuilt() {
        return own;
    }
    let mut to = Writer::default();
    to.count(own.len());
    to.0.extend(own);
    to.count(detail.arrays.len());
    for array in &detail.arrays {
        let code = |found: Option<usize>| found.unwrap_or_default() as u32;
        to.u32(code(NUMBERS.iter().position(|number| *number == array.number)));
        to.u32(code(PLACES.iter().position(|on| *on == array.on)));
        to.count(array.name.len());
        to.0.extend(array.name.as_bytes());
        to.count(array.values.len());
        array.values.iter().for_each(|value| to.f64(*value));
    }
    to.u32(u32::from(detail.uvs.is_some()));
    if let Some(uvs) = &detail.uvs {
        to.count(uvs.missing);
        to.count(uvs.places.len());
        to.f32s(uvs.places.as_flattened());
        let corners = uvs.corners.as_deref();
        to.u32(u32::from(corners.is_some()));
        corners.unwrap_or_default().iter().for_each(|corner| to.u32(*corner));
    }
    packed::pack(&to.0, MAGIC)
}

/// Resumes from what [`save`] wrote; `first` is the mesh that it began with. What it carries is none where that is what `first`
/// carries.
///
/// # Errors
/// Bytes that are no such state, or one of another mesh.
pub fn resume(params: Params, first: &DetailedMesh, bytes: &[u8]) -> Result<(Tracker, Option<DetailedMesh>)> {
    if !bytes.starts_with(MAGIC) {
        return Ok((Tracker::resume(params, &first.mesh, bytes)?, None));
    }
    let bytes = packed::unpack(bytes, MAGIC, NOUN)?;
    let mut from = Reader::new(&bytes);
    let length = from.count(1)?;
    let tracker = Tracker::resume(params, &first.mesh, from.bytes(length)?)?;
    let [vertices, faces] = [tracker.vertices().len(), tracker.triangles().len()];
    let mut arrays = Vec::new();
    for _ in 0..from.count(8)? {
        let number = *NUMBERS.get(from.u32()? as usize).ok_or_else(wrong)?;
        let on = *PLACES.get(from.u32()? as usize).ok_or_else(wrong)?;
        let length = from.count(1)?;
        let name = std::str::from_utf8(from.bytes(length)?).map_err(|_| wrong())?.to_string();
        let count = from.count(8)?;
        let wanted = match on {
            On::Vertices => vertices,
            On::Corners => 3 * faces,
            On::Faces => faces,
        };
        if count != wanted {
            return Err(wrong());
        }
        // What a file carries may be no number.
        let values = (0..count).map(|_| Ok(f64::from_le_bytes(from.take()?))).collect::<Result<_>>()?;
        arrays.push(MeshArray { name, on, number, values });
    }
    let uvs = if from.u32()? == 0 { None } else { Some(uvs(&mut from, vertices, faces)?) };
    from.end()?;
    Ok((tracker, Some(DetailedMesh { uvs, arrays, ..DetailedMesh::default() })))
}

fn uvs(from: &mut Reader<'_>, vertices: usize, faces: usize) -> Result<Uvs> {
    let missing = u64::from_le_bytes(from.take()?) as usize;
    let count = from.count(8)?;
    let place =
        |from: &mut Reader<'_>| Ok([f32::from_le_bytes(from.take()?), f32::from_le_bytes(from.take()?)]);
    let places = (0..count).map(|_| place(from)).collect::<Result<Vec<[f32; 2]>>>()?;
    if from.u32()? == 0 {
        return if count == vertices { Ok(Uvs { places, corners: None, missing }) } else { Err(wrong()) };
    }
    let corners = (0..3 * faces).map(|_| from.u32()).collect::<Result<Vec<u32>>>()?;
    if corners.iter().any(|corner| *corner as usize >= count) {
        return Err(wrong());
    }
    Ok(Uvs { places, corners: Some(corners), missing })
}

fn wrong() -> Error {
    Error::Bytes("carries what does not fit its mesh".into())
}
