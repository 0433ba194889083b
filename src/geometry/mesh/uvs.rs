//! Texture coordinates of a mesh: one for each vertex, or, where there are seams, for each corner of a face.

/// Index of a corner that has no texture coordinates.
pub const NONE: u32 = u32::MAX;

/// Texture coordinates: u to the right, v upward.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Uvs {
    /// The coordinates; one pair for each vertex if `corners` is `None`.
    pub coordinates: Vec<[f32; 2]>,
    /// Indices into `coordinates`, one for each corner of the faces, in their order.
    pub corners: Option<Vec<u32>>,
    /// Corners without coordinates in the file: they have 0, 0.
    pub missing: usize,
}

impl Uvs {
    /// Coordinates 0, 0 for meshes without any, with these numbers of vertices and triangles; by corner if `has_corners`, else by vertex.
    pub fn zeros(has_corners: bool, vertices: usize, faces: usize) -> Self {
        match has_corners {
            true => {
                Self { coordinates: vec![[0.0; 2]], corners: Some(vec![0; 3 * faces]), missing: 3 * faces }
            }
            false => Self { coordinates: vec![[0.0; 2]; vertices], corners: None, missing: vertices },
        }
    }

    /// Those of some faces of a mesh of triangles, which use these vertices.
    pub fn of_part(&self, vertices: &[u32], faces: &[usize]) -> Self {
        match &self.corners {
            None => {
                let coordinates = vertices.iter().map(|&vertex| self.coordinates[vertex as usize]).collect();
                Self { coordinates, corners: None, missing: 0 }
            }
            Some(corners) => {
                let own = faces.iter().flat_map(|face| corners[3 * face..3 * face + 3].iter().copied());
                Self { coordinates: self.coordinates.clone(), corners: Some(own.collect()), missing: 0 }
            }
        }
    }

    /// Coordinates of the corners of faces: for each corner `at` has an index into `coordinates`, or [`NONE`], and `vertices` its vertex. If
    /// all corners of every vertex agree, coordinates are stored by vertex. `None` if no corner has any.
    pub fn of_corners(
        mut coordinates: Vec<[f32; 2]>,
        mut at: Vec<u32>,
        vertices: &[u32],
        count: usize,
    ) -> Option<Self> {
        let missing = at.iter().filter(|&&index| index == NONE).count();
        if missing == at.len() {
            return None;
        }
        if missing > 0 {
            at.iter_mut().filter(|index| **index == NONE).for_each(|index| *index = coordinates.len() as u32);
            coordinates.push([0.0; 2]);
        }
        let mut own: Vec<Option<[f32; 2]>> = vec![None; count];
        let agrees = |(&vertex, &index): (&u32, &u32)| {
            let coordinate = coordinates[index as usize];
            // Vertices out of range are refused by the check of the mesh.
            own.get_mut(vertex as usize).is_none_or(|own| *own.get_or_insert(coordinate) == coordinate)
        };
        if vertices.iter().zip(&at).all(agrees) {
            let coordinates = own.into_iter().map(Option::unwrap_or_default).collect();
            return Some(Self { coordinates, corners: None, missing });
        }
        Some(Self { coordinates, corners: Some(at), missing })
    }

    /// The coordinates of a triangulation, whose triangles have indices of the faces' corners.
    pub fn of_triangles(self, triangles: &[[usize; 3]]) -> Self {
        let corners =
            self.corners.map(|corners| triangles.as_flattened().iter().map(|&c| corners[c]).collect());
        Self { corners, ..self }
    }

    /// Coordinates of several triangle meshes, one after another, each with its numbers of vertices and triangles. A mesh without any gets
    /// 0, 0. `None` if no mesh has any.
    pub fn joined<'a>(
        parts: impl Iterator<Item = (Option<&'a Self>, usize, &'a [[u32; 3]])> + Clone,
    ) -> Option<Self> {
        if parts.clone().all(|(uvs, ..)| uvs.is_none()) {
            return None;
        }
        let by_corner = parts.clone().any(|(uvs, ..)| uvs.is_some_and(|uvs| uvs.corners.is_some()));
        let mut out = Self { corners: by_corner.then(Vec::new), ..Self::default() };
        for (uvs, vertices, triangles) in parts {
            let first = out.coordinates.len() as u32;
            match uvs {
                Some(uvs) => out.coordinates.extend_from_slice(&uvs.coordinates),
                None => out.coordinates.resize(out.coordinates.len() + vertices, [0.0; 2]),
            }
            let own = uvs.and_then(|uvs| uvs.corners.as_deref()).unwrap_or(triangles.as_flattened());
            out.corners.iter_mut().for_each(|corners| corners.extend(own.iter().map(|index| first + index)));
            out.missing += uvs.map_or(0, |uvs| uvs.missing);
        }
        Some(out)
    }

    /// Indices into `coordinates` of a triangle's corners, in a mesh of these triangles.
    pub fn indices(&self, triangles: &[[u32; 3]], triangle: usize) -> [u32; 3] {
        match &self.corners {
            Some(corners) => [0, 1, 2].map(|corner| corners[3 * triangle + corner]),
            None => triangles[triangle],
        }
    }
}

/// Whether both numbers of a coordinate are finite.
pub fn is_finite(coordinate: [f32; 2]) -> bool {
    coordinate.iter().all(|value| value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;

    const COORDINATES: [[f32; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [1.0, 0.0]];

    #[test]
    fn corners_that_agree_are_vertices_and_a_seam_keeps_them_apart() {
        let vertices = [0, 2, 1, 1, 2, 3];
        // The same coordinates may occur twice.
        let uvs = Uvs::of_corners(COORDINATES.to_vec(), vec![0, 1, 2, 2, 3, 0], &vertices, 5).unwrap();
        assert_eq!(uvs.coordinates, [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [0.0, 0.0], [0.0, 0.0]]);
        assert_eq!((uvs.corners, uvs.missing), (None, 0));
        let uvs = Uvs::of_corners(COORDINATES.to_vec(), vec![0, 1, 2, 2, 0, 0], &vertices, 5).unwrap();
        assert_eq!((uvs.coordinates, uvs.corners), (COORDINATES.to_vec(), Some(vec![0, 1, 2, 2, 0, 0])));
    }

    #[test]
    fn corners_without_any_have_0() {
        let uvs = Uvs::of_corners(COORDINATES.to_vec(), vec![1, NONE, NONE], &[0, 1, 1], 2).unwrap();
        assert_eq!((uvs.coordinates, uvs.corners, uvs.missing), (vec![[1.0, 0.0], [0.0, 0.0]], None, 2));
        assert_eq!(Uvs::of_corners(COORDINATES.to_vec(), vec![NONE; 3], &[0, 1, 2], 3), None);
    }

    #[test]
    fn meshes_are_joined_with_and_without() {
        let (seam, smooth) = ([[0, 1, 2], [2, 1, 3]], [[2, 0, 1]]);
        let corners = Some(vec![0, 1, 2, 2, 1, 0]);
        let first = Uvs { coordinates: COORDINATES[..3].to_vec(), corners, missing: 0 };
        let second = Uvs { coordinates: COORDINATES[1..].to_vec(), corners: None, missing: 1 };
        let parts = [(Some(&first), 4, &seam[..]), (None, 3, &smooth), (Some(&second), 3, &smooth)];
        let all = Uvs::joined(parts.into_iter()).unwrap();
        assert_eq!(all.corners.as_deref(), Some(&[0, 1, 2, 2, 1, 0, 5, 3, 4, 8, 6, 7][..]));
        assert_eq!((all.coordinates[4], all.coordinates[6], all.missing), ([0.0; 2], COORDINATES[1], 1));
        let all = Uvs::joined(parts[1..].iter().copied()).unwrap();
        assert_eq!((all.corners, all.coordinates.len()), (None, 6));
        assert_eq!(Uvs::joined(parts[1..2].iter().copied()), None);
    }
}
