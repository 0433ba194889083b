//! The node tree: transforms of nodes, from their own and their parents'.

use nalgebra::{Matrix4, Quaternion, UnitQuaternion};

use crate::geometry::DVec3;

/// A node's own transform, which a clip may animate.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Local {
    pub translation: DVec3,
    pub rotation: UnitQuaternion<f64>,
    pub scale: DVec3,
    /// Weights of the morph targets of its mesh.
    pub weights: Vec<f64>,
}

/// A node of the tree.
pub(super) struct Node {
    pub name: String,
    pub parent: Option<usize>,
    pub rest: Local,
    /// Its transform, if the file has it as a matrix: such a node cannot be animated.
    pub matrix: Option<Matrix4<f64>>,
}

impl Local {
    /// Translation x rotation x scale.
    pub fn matrix(&self) -> Matrix4<f64> {
        let turn = self.rotation.to_rotation_matrix();
        let mut out = turn.to_homogeneous();
        (0..3).for_each(|axis| out.column_mut(axis).scale_mut(self.scale[axis]));
        out.fixed_view_mut::<3, 1>(0, 3).copy_from(&self.translation);
        out
    }
}

/// A rotation from a file's x, y, z, w; the identity when all are 0.
pub(super) fn rotation([x, y, z, w]: [f64; 4]) -> UnitQuaternion<f64> {
    let quaternion = Quaternion::new(w, x, y, z);
    UnitQuaternion::try_new(quaternion, 1e-12).unwrap_or_else(UnitQuaternion::identity)
}

/// All nodes of a document, in its order.
pub(super) fn read(document: &gltf::Document) -> Vec<Node> {
    let mut nodes: Vec<Node> = document
        .nodes()
        .map(|node| {
            let (translation, turn, scale) = node.transform().decomposed();
            let mesh = node.mesh();
            let weights = node.weights().or_else(|| mesh.as_ref().and_then(|mesh| mesh.weights()));
            let matrix = match node.transform() {
                gltf::scene::Transform::Matrix { matrix } => Some(matrix4(&matrix)),
                gltf::scene::Transform::Decomposed { .. } => None,
            };
            Node {
                name: node.name().map_or_else(|| format!("node {}", node.index()), str::to_string),
                parent: None,
                rest: Local {
                    translation: DVec3::from(translation.map(f64::from)),
                    rotation: rotation(turn.map(f64::from)),
                    scale: DVec3::from(scale.map(f64::from)),
                    weights: weights.unwrap_or_default().iter().map(|&weight| f64::from(weight)).collect(),
                },
                matrix,
            }
        })
        .collect();
    for node in document.nodes() {
        node.children().for_each(|child| nodes[child.index()].parent = Some(node.index()));
    }
    nodes
}

/// A matrix from a file's columns.
pub(super) fn matrix4(columns: &[[f32; 4]; 4]) -> Matrix4<f64> {
    Matrix4::from_fn(|row, column| f64::from(columns[column][row]))
}

/// The nodes in an order with parents first; `None` if the tree has a cycle.
pub(super) fn parents_first(nodes: &[Node]) -> Option<Vec<usize>> {
    let mut order = Vec::with_capacity(nodes.len());
    let mut placed = vec![false; nodes.len()];
    for start in 0..nodes.len() {
        let mut path = Vec::new();
        let mut at = Some(start);
        while let Some(node) = at.filter(|&node| !placed[node]) {
            if path.len() > nodes.len() {
                return None;
            }
            path.push(node);
            at = nodes[node].parent;
        }
        for node in path.into_iter().rev() {
            placed[node] = true;
            order.push(node);
        }
    }
    Some(order)
}

/// World transforms of all nodes from their own; `order` has parents first.
pub(super) fn globals(nodes: &[Node], order: &[usize], locals: &[Local]) -> Vec<Matrix4<f64>> {
    let mut out = vec![Matrix4::identity(); nodes.len()];
    for &index in order {
        let own = nodes[index].matrix.unwrap_or_else(|| locals[index].matrix());
        out[index] = match nodes[index].parent {
            Some(parent) => out[parent] * own,
            None => own,
        };
    }
    out
}
