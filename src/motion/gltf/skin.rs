//! The vertices: morphed by their targets, moved by their joints or by their node.

use std::collections::HashMap;
use std::ops::Range;

use gltf::Semantic;
use gltf::mesh::Mode;
use nalgebra::{Matrix3x4, Matrix4};

use super::file::File;
use super::nodes::{Local, matrix4};
use crate::geometry::{DVec3, Uvs, Vec3};
use crate::motion::drawn::{self, Parts};

/// A skin: the nodes that move vertices, and their inverse bind matrices.
struct Skin {
    joints: Vec<usize>,
    inverse_bind: Vec<Matrix4<f64>>,
}

/// Maximum triangles, or vertices, that copies of a mesh may have.
const MAX_COPIED: usize = 1 << 25;

/// Vertices of one node that move alike: all by joints of one skin, or all by the node.
#[derive(Clone)]
struct Part {
    node: usize,
    skin: Option<usize>,
    /// Transform of this copy of the mesh, relative to the node; `None` if there is only one.
    instance: Option<Matrix4<f64>>,
    /// Its triangles among all.
    triangles: Range<usize>,
    /// Its vertices among all: `first..first + rest.len()`.
    first: usize,
    rest: Vec<DVec3>,
    /// One list for each morph target.
    deltas: Vec<Vec<DVec3>>,
    /// Joints of each vertex and their weights, which sum to 1: `spans[v]..spans[v + 1]` of `influences`.
    spans: Vec<u32>,
    influences: Vec<(u32, f64)>,
}

/// Data of a corner in the file: corners that agree in all of it are one vertex.
#[derive(PartialEq, Eq, Hash)]
struct Corner {
    position: [u32; 3],
    joints: Vec<(u32, u32)>,
    deltas: Vec<[u32; 3]>,
}

/// All vertices of the chosen nodes.
#[derive(Default)]
pub(super) struct Vertices {
    skins: Vec<Skin>,
    parts: Vec<Part>,
    pub triangles: Vec<[u32; 3]>,
    pub count: usize,
    pub drawn: FileVertices,
}

/// The vertices in the order of the file: primitive by primitive of each node, in the accessor's order.
#[derive(Default)]
pub(super) struct FileVertices {
    /// For each vertex of the file, the one of [`Vertices`] that moves like it.
    pub vertices: Vec<u32>,
    /// The same triangles as `Vertices` has, in the same order, over these vertices.
    pub triangles: Vec<[u32; 3]>,
    /// One pair for each vertex, as soon as a primitive has any.
    pub uvs: Option<Uvs>,
    /// Their division by node and colour.
    pub parts: Parts,
    /// The part that triangles are added to.
    part: usize,
    /// Vertices of the current node that primitives share: their accessors, and where they begin.
    shared: Vec<(Vec<usize>, usize)>,
}

impl Vertices {
    /// Reads the meshes of the chosen nodes.
    ///
    /// # Errors
    /// Numbers that are missing, out of range or not finite.
    pub fn read<'a>(
        file: &File,
        wanted: impl Fn(usize) -> bool,
        name: impl Fn(usize) -> &'a str,
    ) -> Result<Self, String> {
        let mut out = Self::default();
        for skin in file.document.skins() {
            let joints: Vec<usize> = skin.joints().map(|joint| joint.index()).collect();
            let inverse_bind = match skin.inverse_bind_matrices() {
                None => vec![Matrix4::identity(); joints.len()],
                Some(accessor) => {
                    let columns =
                        |m: [f32; 16]| std::array::from_fn(|c| std::array::from_fn(|r| m[4 * c + r]));
                    file.rows::<16>(&accessor)?.into_iter().map(|m| matrix4(&columns(m))).collect()
                }
            };
            if inverse_bind.len() < joints.len() {
                return Err(format!(
                    "skin {} has {} joints but {} matrices",
                    skin.index(),
                    joints.len(),
                    inverse_bind.len()
                ));
            }
            out.skins.push(Skin { joints, inverse_bind });
        }
        for node in file.document.nodes().filter(|node| wanted(node.index())) {
            let Some(mesh) = node.mesh() else { continue };
            // A skin places vertices by its joints, whatever the node's transform.
            let instances = if node.skin().is_some() { None } else { file.instances(node.index())? };
            if instances.as_ref().is_some_and(Vec::is_empty) {
                continue;
            }
            let begin = [out.triangles.len(), out.drawn.vertices.len(), out.drawn.triangles.len()];
            let part = Part {
                node: node.index(),
                skin: node.skin().map(|skin| skin.index()),
                instance: instances.as_ref().map(|instances| instances[0].matrix()),
                triangles: begin[0]..begin[0],
                first: out.count,
                rest: Vec::new(),
                deltas: Vec::new(),
                spans: vec![0],
                influences: Vec::new(),
            };
            out.parts.push(part);
            out.drawn.shared.clear();
            let first_part = out.drawn.parts.list.len();
            let mut known = HashMap::new();
            for primitive in mesh.primitives() {
                let colour = file.base_colours.get(&(mesh.index(), primitive.index())).copied();
                out.drawn.begin_part(first_part, drawn::Part { name: name(node.index()).into(), colour });
                out.add(file, &primitive, &mut known).map_err(|what| {
                    format!("mesh \"{}\": {what}", mesh.name().or(node.name()).unwrap_or("without a name"))
                })?;
            }
            out.parts.last_mut().expect("just added").triangles.end = out.triangles.len();
            if let Some([_, copies @ ..]) = instances.as_deref() {
                out.copy_last(copies, begin)?;
            }
        }
        Ok(out)
    }

    /// Adds copies of the last part; its triangles, drawn vertices and drawn triangles begin at `begin`.
    fn copy_last(&mut self, copies: &[Local], begin: [usize; 3]) -> Result<(), String> {
        let original = self.parts.last().expect("a part to copy").clone();
        let [triangles, corners] = [original.triangles.len(), self.drawn.vertices.len() - begin[1]];
        if triangles.max(corners).saturating_mul(copies.len()) > MAX_COPIED {
            return Err(format!(
                "its {} instances of {triangles} triangles are more than {MAX_COPIED} triangles",
                copies.len() + 1
            ));
        }
        for copy in copies {
            let shift = (self.count - original.first) as u32;
            let first = self.triangles.len();
            let shifted = |triangle: &[u32; 3], by: u32| triangle.map(|vertex| vertex + by);
            for at in original.triangles.clone() {
                self.triangles.push(shifted(&self.triangles[at], shift));
            }
            self.drawn.copy(begin[1]..begin[1] + corners, begin[2]..begin[2] + triangles, shift);
            self.parts.push(Part {
                instance: Some(copy.matrix()),
                triangles: first..self.triangles.len(),
                first: self.count,
                ..original.clone()
            });
            self.count += original.rest.len();
        }
        Ok(())
    }

    /// Adds a primitive's corners and triangles to the last part.
    fn add(
        &mut self,
        file: &File,
        primitive: &gltf::Primitive,
        known: &mut HashMap<Corner, u32>,
    ) -> Result<(), String> {
        if matches!(primitive.mode(), Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip) {
            return Ok(());
        }
        let positions = primitive.get(&Semantic::Positions).ok_or("a primitive has no positions")?;
        let positions = file.rows::<3>(&positions)?;
        let targets = primitive.morph_targets().map(|target| match target.positions() {
            Some(accessor) => file.rows::<3>(&accessor),
            None => Ok(vec![[0.0; 3]; positions.len()]),
        });
        let targets = targets.collect::<Result<Vec<_>, String>>()?;
        let part = self.parts.last_mut().expect("the caller made one");
        let joint_count = part.skin.map_or(0, |skin| self.skins[skin].joints.len());
        let joints = joints(file, primitive, part.skin.is_some(), positions.len(), joint_count)?;
        if targets.iter().any(|target| target.len() != positions.len()) {
            return Err("a morph target has another number of vertices".into());
        }
        // A primitive with fewer targets is not moved by the others.
        while part.deltas.len() < targets.len() {
            part.deltas.push(vec![DVec3::zeros(); part.rest.len()]);
        }
        let bits = |p: [f32; 3]| p.map(|value| (value + 0.0).to_bits());
        let mut numbers = Vec::with_capacity(positions.len());
        for (vertex, &position) in positions.iter().enumerate() {
            let corner = Corner {
                position: bits(position),
                joints: joints[vertex].iter().map(|&(joint, weight)| (joint, weight.to_bits())).collect(),
                deltas: targets.iter().map(|target| bits(target[vertex])).collect(),
            };
            let next = (part.first + part.rest.len()) as u32;
            let number = *known.entry(corner).or_insert(next);
            if number == next {
                part.rest.push(Vec3::from(position).cast());
                let at = |target: usize| targets.get(target).map_or([0.0; 3], |target| target[vertex]);
                part.deltas.iter_mut().enumerate().for_each(|(t, list)| list.push(Vec3::from(at(t)).cast()));
                let sum: f64 = joints[vertex].iter().map(|&(_, weight)| f64::from(weight)).sum();
                let share = |&(joint, weight): &(u32, f32)| (joint, f64::from(weight) / sum);
                part.influences.extend(joints[vertex].iter().map(share));
                part.spans.push(part.influences.len() as u32);
            }
            numbers.push(number);
        }
        self.count = part.first + part.rest.len();
        let indices: Vec<u32> = match primitive.indices() {
            Some(accessor) => file.indices::<1>(&accessor)?.into_iter().map(|[index]| index).collect(),
            None => (0..positions.len() as u32).collect(),
        };
        if indices.iter().any(|&index| index as usize >= numbers.len()) {
            return Err("an index names a vertex that does not exist".into());
        }
        let own = triangles(primitive.mode(), &indices);
        self.triangles.extend(own.iter().map(|triangle| triangle.map(|index| numbers[index as usize])));
        self.drawn.add(file, primitive, &numbers, &own)
    }

    /// Flips the triangles of parts that are mirrored by the transforms of their node or their joints.
    pub fn face_outward(&mut self, globals: &[Matrix4<f64>]) {
        for part in &self.parts {
            if self.is_mirrored(part, globals) {
                let own = part.triangles.clone();
                self.triangles[own.clone()].iter_mut().for_each(|triangle| triangle.swap(1, 2));
                self.drawn.triangles[own].iter_mut().for_each(|triangle| triangle.swap(1, 2));
            }
        }
    }

    /// Whether the transforms of a part mirror it: for a skinned part, most of its vertices by weight, wherever in the tree the mirroring
    /// node is.
    fn is_mirrored(&self, part: &Part, globals: &[Matrix4<f64>]) -> bool {
        let handedness = |matrix: Matrix4<f64>| {
            let determinant = matrix.fixed_view::<3, 3>(0, 0).determinant();
            if determinant == 0.0 { 0.0 } else { determinant.signum() }
        };
        let Some(skin) = part.skin.map(|skin| &self.skins[skin]) else {
            return handedness(part.node_matrix(globals)) < 0.0;
        };
        let pairs = skin.joints.iter().zip(&skin.inverse_bind);
        let joints: Vec<f64> = pairs.map(|(&joint, inverse)| handedness(globals[joint] * inverse)).collect();
        let weighted = part.influences.iter().map(|&(joint, weight)| joints[joint as usize] * weight);
        weighted.sum::<f64>() < 0.0
    }

    /// World positions of all vertices (the file's unit).
    pub fn pose(&self, locals: &[Local], globals: &[Matrix4<f64>], out: &mut Vec<DVec3>) {
        out.clear();
        out.reserve(self.count);
        let upper = |matrix: Matrix4<f64>| -> Matrix3x4<f64> { matrix.fixed_rows::<3>(0).into_owned() };
        let skins: Vec<Vec<Matrix3x4<f64>>> = self
            .skins
            .iter()
            .map(|skin| {
                let pairs = skin.joints.iter().zip(&skin.inverse_bind);
                pairs.map(|(&joint, inverse)| upper(globals[joint] * inverse)).collect()
            })
            .collect();
        for part in &self.parts {
            let weights = &locals[part.node].weights;
            let node = [upper(part.node_matrix(globals))];
            let matrices = part.skin.map_or(&node[..], |skin| &skins[skin]);
            for (vertex, rest) in part.rest.iter().enumerate() {
                let moved = part.deltas.iter().zip(weights).filter(|(_, weight)| **weight != 0.0);
                let position =
                    moved.fold(*rest, |position, (deltas, weight)| position + deltas[vertex] * *weight);
                let position = position.push(1.0);
                let span = part.spans[vertex] as usize..part.spans[vertex + 1] as usize;
                out.push(match &part.influences[span] {
                    [] => matrices[0] * position,
                    [(joint, _)] => matrices[*joint as usize] * position,
                    many => many
                        .iter()
                        .map(|&(joint, weight)| matrices[joint as usize] * position * weight)
                        .sum::<DVec3>(),
                });
            }
        }
    }
}

impl Part {
    /// The transform of its vertices if it has no skin.
    fn node_matrix(&self, globals: &[Matrix4<f64>]) -> Matrix4<f64> {
        self.instance.map_or(globals[self.node], |instance| globals[self.node] * instance)
    }
}

impl FileVertices {
    /// Adds a copy of some vertices and of the triangles over them; `shift` is the index of a moving vertex's copy minus that of the vertex.
    fn copy(&mut self, vertices: Range<usize>, triangles: Range<usize>, shift: u32) {
        let by = (self.vertices.len() - vertices.start) as u32;
        for at in triangles {
            self.triangles.push(self.triangles[at].map(|vertex| vertex + by));
            self.parts.of_triangles.push(self.parts.of_triangles[at]);
        }
        if let Some(uvs) = &mut self.uvs {
            uvs.coordinates.extend_from_within(vertices.clone());
        }
        for at in vertices {
            self.vertices.push(self.vertices[at] + shift);
        }
    }

    /// Makes a part of the current node the one that triangles are added to; the node's parts begin at `first`.
    fn begin_part(&mut self, first: usize, part: drawn::Part) {
        let parts = &mut self.parts;
        let known = parts.list[first..].iter().position(|known| *known == part);
        self.part = first + known.unwrap_or(parts.list.len() - first);
        if known.is_none() {
            parts.list.push(part);
        }
    }

    /// Adds a primitive: its vertices, with the vertices that move like them (`numbers`), and its triangles over its own vertices.
    fn add(
        &mut self,
        file: &File,
        primitive: &gltf::Primitive,
        numbers: &[u32],
        triangles: &[[u32; 3]],
    ) -> Result<(), String> {
        let uvs = primitive.get(&Semantic::TexCoords(0));
        let named = [primitive.get(&Semantic::Positions), uvs.clone()];
        let accessors: Vec<usize> = named.iter().flatten().map(gltf::Accessor::index).collect();
        let is_same = |(others, begin): &&(Vec<usize>, usize)| {
            *others == accessors && self.vertices.get(*begin..*begin + numbers.len()) == Some(numbers)
        };
        let first = match self.shared.iter().find(is_same) {
            Some((_, begin)) => *begin,
            None => {
                let begin = self.vertices.len();
                self.vertices.extend_from_slice(numbers);
                self.add_uvs(file, uvs, begin)?;
                self.shared.push((accessors, begin));
                begin
            }
        };
        self.triangles.extend(triangles.iter().map(|triangle| triangle.map(|index| index + first as u32)));
        self.parts.of_triangles.resize(self.triangles.len(), self.part as u32);
        Ok(())
    }

    /// Texture coordinates of the vertices from `begin` on; in glTF v points down from the top.
    fn add_uvs(&mut self, file: &File, accessor: Option<gltf::Accessor>, begin: usize) -> Result<(), String> {
        let count = self.vertices.len() - begin;
        let Some(accessor) = accessor else {
            if let Some(uvs) = &mut self.uvs {
                uvs.coordinates.resize(self.vertices.len(), [0.0; 2]);
                uvs.missing += count;
            }
            return Ok(());
        };
        let coordinates = file.rows::<2>(&accessor)?;
        if coordinates.len() != count {
            return Err("does not have texture coordinates for every vertex".into());
        }
        let before = || Uvs { coordinates: vec![[0.0; 2]; begin], corners: None, missing: begin };
        let uvs = self.uvs.get_or_insert_with(before);
        uvs.coordinates.extend(coordinates.into_iter().map(|[u, v]| [u, 1.0 - v]));
        Ok(())
    }
}

/// The joints and the weights above 0 of each vertex; a skinned vertex without any follows the first joint.
fn joints(
    file: &File,
    primitive: &gltf::Primitive,
    skinned: bool,
    count: usize,
    joint_count: usize,
) -> Result<Vec<Vec<(u32, f32)>>, String> {
    let mut out = vec![Vec::new(); count];
    if !skinned {
        return Ok(out);
    }
    for set in 0.. {
        let accessors = (primitive.get(&Semantic::Joints(set)), primitive.get(&Semantic::Weights(set)));
        let (Some(joints), Some(weights)) = accessors else { break };
        let (joints, weights) = (file.indices::<4>(&joints)?, file.rows::<4>(&weights)?);
        if joints.len() != count || weights.len() != count {
            return Err("does not have joints and weights for every vertex".into());
        }
        for (vertex, (joints, weights)) in out.iter_mut().zip(joints.iter().zip(&weights)) {
            vertex.extend(joints.iter().copied().zip(weights.iter().copied()).filter(|(_, w)| *w > 0.0));
        }
    }
    for vertex in &mut out {
        if vertex.is_empty() {
            vertex.push((0, 1.0));
        }
        vertex.sort_unstable_by_key(|(joint, _)| *joint);
        if vertex.iter().any(|&(joint, _)| joint as usize >= joint_count) {
            return Err(format!("names a joint beyond the {joint_count} of its skin"));
        }
    }
    Ok(out)
}

fn triangles(mode: Mode, corners: &[u32]) -> Vec<[u32; 3]> {
    let strip =
        |(number, c): (usize, &[u32])| if number % 2 == 0 { [c[0], c[1], c[2]] } else { [c[1], c[0], c[2]] };
    match mode {
        Mode::TriangleStrip => corners.windows(3).enumerate().map(strip).collect(),
        Mode::TriangleFan => corners.windows(2).skip(1).map(|c| [corners[0], c[0], c[1]]).collect(),
        _ => corners.chunks_exact(3).map(|c| [c[0], c[1], c[2]]).collect(),
    }
}
