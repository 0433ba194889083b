//! Meshes edited by hand: at its frame each replaces the mesh that has followed the liquid so far.

use std::path::PathBuf;

use super::{DROPPED_ARRAYS, detail_retention, read_mesh};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::geometry::mesh::attributes::{Number, On};
use crate::geometry::{DetailedMesh, MeshArray, Uvs};
use crate::io::files::sequence::Pattern;
use crate::scene::Frames;
use crate::scene::surface::{Inputs, Surface};

/// Arrays of shares: floats 0..=1 correspond to bytes 0 to 255.
const SHARE_ARRAYS: [&str; 5] = ["red", "green", "blue", "alpha", "detail"];

/// An edited mesh that replaces the tracked one.
pub struct Sculpt {
    /// Its file.
    pub path: PathBuf,
    /// The mesh (m), with the same arrays as the mesh of the first frame, in the same order.
    pub mesh: DetailedMesh,
    /// Detail retention of each vertex, 0 (fades as the parameters say) to 1 (never fades); empty: 0 everywhere.
    pub detail_retention: Vec<f32>,
    /// Warnings about data that it lacks, or that is ignored.
    warnings: Vec<String>,
}

/// The frames of a shot after its first that have an edited mesh, ascending.
///
/// # Errors
/// A name without a placeholder for the frame number; a mesh for the first frame; no mesh for any other.
pub fn frames(surface: &Surface, shot: Frames) -> Result<Vec<i32>> {
    let Some(path) = &surface.resculpt else { return Ok(Vec::new()) };
    let Some(pattern) = Pattern::parse(path) else {
        let what =
            "is one file: surface.resculpt needs a place for the frame's number, as in sculpts/spot.%04d.ply";
        return Err(Error::file(path, what));
    };
    let first = pattern.path(shot.first);
    if first.exists() {
        let what =
            "is for the shot's first frame, whose mesh is surface.mesh: surface.resculpt is for later ones";
        return Err(Error::file(first, what));
    }
    let frames: Vec<i32> = (shot.first..=shot.last).filter(|frame| pattern.path(*frame).exists()).collect();
    if frames.is_empty() {
        let what = format!(
            "no edited mesh (surface.resculpt) exists for any frame of the shot after its first, {}",
            shot.first
        );
        return Err(Error::file(path, what));
    }
    Ok(frames)
}

/// The file of a frame's edited mesh, if it is one of the frames that [`frames`] found.
pub fn path_at(surface: &Surface, sculpts: &[i32], frame: i32) -> Option<PathBuf> {
    sculpts.binary_search(&frame).ok()?;
    Some(Pattern::parse(surface.resculpt.as_ref()?)?.path(frame))
}

/// Checks every edited mesh; returns warnings, one sentence each.
///
/// # Errors
/// As [`read_sculpt`].
pub fn check(ctx: &Context, surface: &Surface, inputs: &Inputs) -> Result<Vec<String>> {
    let mut out = Vec::new();
    for frame in &inputs.sculpts {
        ctx.check()?;
        out.extend(read_sculpt(ctx, surface, inputs, *frame)?.into_iter().flat_map(|sculpt| sculpt.warnings));
    }
    Ok(out)
}

/// The edited mesh of a frame; `None` if it has none.
///
/// # Errors
/// A file that cannot be read, or that has changed since it was checked; a mesh to be rebuilt that encloses nothing; shares of detail out
/// of range, if any fades; cancel.
pub fn read_sculpt(ctx: &Context, surface: &Surface, inputs: &Inputs, frame: i32) -> Result<Option<Sculpt>> {
    let Some(path) = path_at(surface, &inputs.sculpts, frame) else { return Ok(None) };
    let (mesh, warning) = read_mesh(ctx, surface, &path, &inputs.input_hashes, inputs.spacing)?;
    let mut warnings: Vec<String> = warning.into_iter().collect();
    let fades = surface.half_life.is_some() || surface.fade != 0.0;
    let detail_retention = match detail_retention(&mesh) {
        Err(what) if fades => return Err(Error::file(path, what)),
        // States store it: detail may begin to fade at a later frame, by --from with other settings.
        other => other.unwrap_or_default(),
    };
    let (mesh, faults) = conformed(mesh, &inputs.mesh);
    warnings.extend(faults.iter().map(|fault| format!("{}: {fault}", path.display())));
    Ok(Some(Sculpt { path, mesh, detail_retention, warnings }))
}

/// A mesh with the same data as that of the first frame, so that all frames have the same; and the differences, a sentence each.
fn conformed(edited: DetailedMesh, first: &DetailedMesh) -> (DetailedMesh, Vec<String>) {
    let DetailedMesh { mesh, uvs, mut arrays } = edited;
    arrays.retain(|array| !DROPPED_ARRAYS.contains(&&*array.name));
    let (vertices, faces) = (mesh.positions.len(), mesh.triangles.len());
    let (mut missing, mut faults): (Vec<&str>, Vec<String>) = (Vec::new(), Vec::new());
    let mut out = Vec::with_capacity(first.arrays.len());
    for wanted in &first.arrays {
        let found = arrays.iter().find(|array| array.name == wanted.name && array.on == wanted.on);
        let values = match found {
            Some(array) => converted(array, wanted.number),
            None => {
                missing.push(&wanted.name);
                vec![0.0; wanted.on.count(vertices, faces)]
            }
        };
        out.push(MeshArray { name: wanted.name.clone(), on: wanted.on, number: wanted.number, values });
    }
    // Detail retention is used even if the first mesh has no such array.
    let is_used = |array: &MeshArray| {
        let is_known = first.arrays.iter().any(|wanted| wanted.name == array.name);
        is_known || array.name == "detail" && array.on == On::Vertices
    };
    let mut ignored: Vec<&str> =
        arrays.iter().filter(|array| !is_used(array)).map(|array| &*array.name).collect();
    ignored.dedup();
    let uvs = match (uvs, &first.uvs) {
        (Some(_), None) => {
            ignored.push("texture coordinates");
            None
        }
        (None, None) => None,
        (None, Some(first_uvs)) => {
            missing.push("texture coordinates");
            Some(Uvs::zeros(first_uvs.corners.is_some(), vertices, faces))
        }
        (Some(uvs), Some(first_uvs)) => match (&uvs.corners, first_uvs.corners.is_some()) {
            (None, true) => {
                let corners = mesh.triangles.as_flattened().to_vec();
                Some(Uvs { corners: Some(corners), ..uvs })
            }
            (Some(corners), false) => {
                faults.push(
                    "its texture coordinates have seams, those of the first frame's mesh have none: a vertex on one has those of \
                     one side"
                        .into(),
                );
                let coordinates = by_vertex(&uvs.coordinates, corners, &mesh.triangles, vertices);
                Some(Uvs { coordinates, corners: None, missing: uvs.missing })
            }
            _ => Some(uvs),
        },
    };
    if !missing.is_empty() {
        let names = missing.join(", ");
        faults.push(format!(
            "lacks what the first frame's mesh carries: {names}; they are 0 from this frame on"
        ));
    }
    if !ignored.is_empty() {
        let names = ignored.join(", ");
        faults.push(format!("carries what the first frame's mesh does not, which is left out: {names}"));
    }
    (DetailedMesh { mesh, uvs, arrays: out }, faults)
}

/// The numbers of an array, converted to another type.
fn converted(array: &MeshArray, to: Number) -> Vec<f64> {
    let is_share = SHARE_ARRAYS.contains(&&*array.name);
    let scaled = |value: f64| match (array.number, to) {
        (Number::U8, to) if is_share && to.is_float() => value / 255.0,
        (from, Number::U8) if is_share && from.is_float() => value * 255.0,
        _ => value,
    };
    array.values.iter().map(|value| nearest_of_type(scaled(*value), to)).collect()
}

/// The nearest number of a type; NaN becomes 0 if the type has none.
fn nearest_of_type(value: f64, to: Number) -> f64 {
    let (low, high) = match to {
        Number::F64 => return value,
        Number::F32 => return f64::from(value as f32),
        Number::I8 => (f64::from(i8::MIN), f64::from(i8::MAX)),
        Number::U8 => (0.0, f64::from(u8::MAX)),
        Number::I16 => (f64::from(i16::MIN), f64::from(i16::MAX)),
        Number::U16 => (0.0, f64::from(u16::MAX)),
        Number::I32 => (f64::from(i32::MIN), f64::from(i32::MAX)),
        Number::U32 => (0.0, f64::from(u32::MAX)),
    };
    if value.is_nan() { 0.0 } else { value.round().clamp(low, high) }
}

/// The texture coordinates of each vertex: those of its first corner.
fn by_vertex(
    coordinates: &[[f32; 2]],
    corners: &[u32],
    triangles: &[[u32; 3]],
    vertices: usize,
) -> Vec<[f32; 2]> {
    let mut first: Vec<Option<[f32; 2]>> = vec![None; vertices];
    for (vertex, index) in triangles.as_flattened().iter().zip(corners) {
        first[*vertex as usize].get_or_insert(coordinates[*index as usize]);
    }
    first.into_iter().map(Option::unwrap_or_default).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{TriMesh, Vec3};

    fn array(name: &str, on: On, number: Number, values: &[f64]) -> MeshArray {
        MeshArray { name: name.into(), on, number, values: values.to_vec() }
    }

    /// A tetrahedron, or the two triangles of one of its edges.
    fn mesh(faces: usize) -> TriMesh {
        let position = |n: u8| Vec3::new(f32::from(n & 1), f32::from(n >> 1 & 1), f32::from(n / 3));
        let mut triangles = vec![[0, 1, 2], [0, 3, 1], [1, 3, 2], [2, 3, 0]];
        triangles.truncate(faces);
        TriMesh { positions: (0..4).map(position).collect(), triangles }
    }

    #[test]
    fn an_edited_mesh_carries_what_the_first_one_does() {
        let first = DetailedMesh {
            mesh: mesh(4),
            uvs: None,
            arrays: vec![
                array("red", On::Vertices, Number::U8, &[9.0; 4]),
                array("mask", On::Vertices, Number::F64, &[9.0; 4]),
                array("part", On::Faces, Number::I32, &[9.0; 4]),
                array("wet", On::Corners, Number::I8, &[9.0; 12]),
            ],
        };
        let arrays = vec![
            array("wet", On::Corners, Number::F32, &[-300.0, 1.6, f64::NAN, 2.5, 0.0, 300.0]),
            array("vx", On::Vertices, Number::F32, &[1.0; 4]),
            array("heat", On::Vertices, Number::F32, &[1.0; 4]),
            array("detail", On::Vertices, Number::F32, &[1.0; 4]),
            array("part", On::Vertices, Number::I32, &[5.0; 4]),
            array("red", On::Vertices, Number::F32, &[0.0, 1.0, 0.5, 7.0]),
        ];
        let uvs = Some(Uvs { coordinates: vec![[0.5; 2]; 4], corners: None, missing: 0 });
        let (taken, faults) = conformed(DetailedMesh { mesh: mesh(2), uvs, arrays }, &first);
        assert!(taken.mesh == mesh(2) && taken.uvs.is_none());
        let wanted = [
            array("red", On::Vertices, Number::U8, &[0.0, 255.0, 128.0, 255.0]),
            array("mask", On::Vertices, Number::F64, &[0.0; 4]),
            array("part", On::Faces, Number::I32, &[0.0; 2]),
            array("wet", On::Corners, Number::I8, &[-128.0, 2.0, 0.0, 3.0, 0.0, 127.0]),
        ];
        assert_eq!(taken.arrays, wanted);
        let [missing, ignored] = &faults[..] else { panic!("{faults:?}") };
        assert!(missing.contains(": mask, part; they are 0"), "{missing}");
        assert!(ignored.ends_with("left out: heat, texture coordinates"), "{ignored}");
        // Nothing is changed for the same kind of mesh, and there is no warning.
        let (same, faults) = conformed(first.clone(), &first);
        assert!(same == first && faults.is_empty(), "{faults:?}");
    }

    #[test]
    fn bytes_of_colours_become_shares_and_other_numbers_stay() {
        let bytes = |name: &str| array(name, On::Vertices, Number::U8, &[0.0, 51.0, 255.0]);
        assert_eq!(converted(&bytes("green"), Number::F32), [0.0, f64::from(0.2f32), 1.0]);
        assert_eq!(converted(&bytes("mask"), Number::F32), [0.0, 51.0, 255.0]);
        assert_eq!(converted(&bytes("green"), Number::I32), [0.0, 51.0, 255.0]);
    }

    #[test]
    fn texture_coordinates_have_the_form_that_those_of_the_first_mesh_have() {
        let coordinates = vec![[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]];
        let seamless = Uvs { coordinates: coordinates.clone(), corners: None, missing: 0 };
        let seams =
            Uvs { coordinates: coordinates.clone(), corners: Some(vec![3, 1, 2, 0, 3, 1]), missing: 1 };
        let with = |uvs: Option<&Uvs>| DetailedMesh { mesh: mesh(2), uvs: uvs.cloned(), arrays: Vec::new() };
        let taken = |uvs, first| {
            let (mesh, faults) = conformed(with(uvs), &with(first));
            (mesh.uvs.unwrap(), faults.join(" "))
        };
        let (uvs, faults) = taken(Some(&seamless), Some(&seams));
        let corners = Some(vec![0, 1, 2, 0, 3, 1]);
        assert_eq!((uvs, faults), (Uvs { coordinates, corners, missing: 0 }, String::new()));
        let (uvs, faults) = taken(Some(&seams), Some(&seamless));
        assert_eq!(uvs.coordinates, [[1.0, 1.0], [1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]);
        assert!(uvs.corners.is_none() && uvs.missing == 1 && faults.contains("seams"), "{faults}");
        let (uvs, faults) = taken(None, Some(&seams));
        assert_eq!((uvs.corners, uvs.missing), (Some(vec![0; 6]), 6));
        assert!(faults.contains("carries: texture coordinates; they are 0"), "{faults}");
        let (uvs, _) = taken(None, Some(&seamless));
        assert_eq!((uvs.coordinates, uvs.corners, uvs.missing), (vec![[0.0; 2]; 4], None, 4));
    }
}
