//! Meshes of binary USD files: all prims of the type Mesh, one after another. frazil's own frames hold one or several, such as a
//! character's.
//!
//! What frazil writes is read: positions in the layer's unit and axes, polygons, `velocities` (as vx, vy, vz), `primvars:st`, and primvars
//! with a value for each vertex, face or corner (`displayColor` as red, green and blue, `displayOpacity` as alpha, vectors as three arrays).
//! Transforms are applied; animation is read at the first of its times.

use crate::geometry::mesh::attributes::{MeshArray, Number, On};
use crate::geometry::mesh::uvs;
use crate::geometry::{DVec3, PolygonMesh, Uvs};
use crate::io::files::source::Parsed;
use crate::io::usd::binary::ReadPrim;
use crate::io::usd::layer::Value;
use crate::io::usd::read::UsdFile;

/// Reads the meshes of a file, with a warning about what cannot be kept.
pub(super) fn parse(bytes: &[u8], origin: [f64; 3]) -> Parsed<(PolygonMesh, Option<String>)> {
    let file = UsdFile::open(bytes)?;
    let mut joined = Joined::default();
    for prim in file.prims("Mesh", "mesh")? {
        let part = Part::read(&file, prim, origin.into()).map_err(|what| format!("{}: {what}", prim.path))?;
        joined.add(part);
    }
    Ok(joined.finish())
}

/// A mesh of a file, with its prim's path and its constant colour.
pub(in crate::io) type OneMesh = (String, Option<[f32; 3]>, PolygonMesh);

/// Reads the meshes of a file one by one; none is not an error.
pub(in crate::io) fn parse_each(bytes: &[u8]) -> Parsed<Vec<OneMesh>> {
    let file = UsdFile::open(bytes)?;
    if !file.has("Mesh") {
        return Ok(Vec::new());
    }
    let one = |prim: &ReadPrim| {
        let part = Part::read(&file, prim, DVec3::zeros());
        let mut joined = Joined::default();
        joined.add(part.map_err(|what| format!("{}: {what}", prim.path))?);
        let color = match prim.attribute("primvars:displayColor") {
            Some(attribute) if attribute.interpolation == "constant" => file.value(prim, &attribute.name)?,
            _ => None,
        };
        let color = if let Some(Value::Vectors(colors)) = color { colors.first().copied() } else { None };
        Ok((prim.path.clone(), color, joined.finish().0))
    };
    file.prims("Mesh", "mesh")?.into_iter().map(one).collect()
}

/// The mesh of one prim.
#[derive(Default)]
struct Part {
    mesh: PolygonMesh,
    /// Coordinates, and for each corner its index.
    uvs: Option<(Vec<[f32; 2]>, Vec<u32>)>,
}

/// The corners and faces of a prim that are read, by their positions in the file.
struct Order {
    corners: Vec<usize>,
    faces: Vec<usize>,
    /// Counts of vertices, corners and faces in the file.
    counts: [usize; 3],
}

impl Part {
    fn read(file: &UsdFile<'_>, prim: &ReadPrim, origin: DVec3) -> Parsed<Self> {
        let positions = file.positions(prim, origin)?;
        let integers = |name| match file.value(prim, name) {
            Ok(Some(Value::Ints(integers))) => Ok(integers),
            Ok(_) => Ok(Vec::new()),
            Err(what) => Err(what),
        };
        let (counts, indices) = (integers("faceVertexCounts")?, integers("faceVertexIndices")?);
        let order = Order::of(file, prim, [positions.len(), indices.len()], &counts)?;
        let mut mesh = PolygonMesh {
            positions: positions.iter().map(|position| position.cast()).collect(),
            ..Default::default()
        };
        let mut corners =
            order.corners.iter().map(|corner| u32::try_from(indices[*corner]).unwrap_or(u32::MAX));
        for face in &order.faces {
            mesh.push(corners.by_ref().take(counts[*face] as usize));
        }
        if let Some(velocities) = file.velocities(prim, positions.len())? {
            let parts = ["vx", "vy", "vz"].into_iter().enumerate();
            mesh.arrays.extend(parts.map(|(axis, name)| MeshArray {
                name: name.into(),
                on: On::Vertices,
                number: Number::F32,
                values: velocities.iter().map(|velocity| f64::from(velocity[axis] as f32)).collect(),
            }));
        }
        let mut uvs = None;
        for attribute in &prim.attributes {
            let Some(name) = attribute.name.strip_prefix("primvars:") else { continue };
            let on = match &*attribute.interpolation {
                "vertex" | "varying" => On::Vertices,
                "faceVarying" => On::Corners,
                "uniform" => On::Faces,
                _ => continue,
            };
            if name == "normals" || name.ends_with(":indices") {
                continue;
            }
            let Some(value) = file.value(prim, &attribute.name)? else { continue };
            let indices = file.value(prim, &format!("{}:indices", attribute.name))?;
            let indices = if let Some(Value::Ints(indices)) = indices { Some(indices) } else { None };
            let primvar = Primvar { name, on, indices };
            match value {
                Value::Pairs(pairs) if name == "st" => {
                    let at = primvar.of_corners(pairs.len(), &order, &mesh.corners)?;
                    uvs = Some((pairs, at));
                }
                value => mesh.arrays.extend(primvar.arrays(value, &order)?),
            }
        }
        Ok(Self { mesh, uvs })
    }
}

impl Order {
    fn of(
        file: &UsdFile<'_>,
        prim: &ReadPrim,
        [vertices, corners]: [usize; 2],
        counts: &[i32],
    ) -> Parsed<Self> {
        let is_left =
            matches!(file.value(prim, "orientation")?, Some(Value::Token(side)) if side == "leftHanded");
        // Seen from outside.
        let is_clockwise = is_left != file.is_mirrored(prim)?;
        let mut order =
            Self { corners: Vec::new(), faces: Vec::new(), counts: [vertices, corners, counts.len()] };
        let mut first = 0usize;
        for (face, count) in counts.iter().enumerate() {
            let of_face =
                usize::try_from(*count).ok().and_then(|count| Some(first..first.checked_add(count)?));
            let of_face = of_face.filter(|of_face| of_face.end <= corners);
            let of_face = of_face.ok_or_else(|| format!("face {} cannot have {count} corners", face + 1))?;
            first = of_face.end;
            if of_face.len() >= 3 {
                order.faces.push(face);
                if is_clockwise { order.corners.extend(of_face.rev()) } else { order.corners.extend(of_face) }
            }
        }
        if first == corners {
            Ok(order)
        } else {
            Err(format!("its faces have {first} corners, and there are indices of {corners}"))
        }
    }

    /// Count of the values in the file.
    fn count(&self, on: On) -> usize {
        let [vertices, corners, faces] = self.counts;
        match on {
            On::Vertices => vertices,
            On::Corners => corners,
            On::Faces => faces,
        }
    }

    /// Those of some values, one for each element of the file, that are kept.
    fn kept<T: Copy>(&self, on: On, values: Vec<T>) -> Vec<T> {
        match on {
            On::Vertices => values,
            On::Corners => self.corners.iter().map(|corner| values[*corner]).collect(),
            On::Faces => self.faces.iter().map(|face| values[*face]).collect(),
        }
    }
}

/// A primvar without its values.
struct Primvar<'a> {
    name: &'a str,
    on: On,
    /// Which value each element has; none if they follow one another.
    indices: Option<Vec<i32>>,
}

impl Primvar<'_> {
    /// The value of each element that is kept.
    fn each<T: Copy>(&self, values: Vec<T>, order: &Order) -> Parsed<Vec<T>> {
        let values = match &self.indices {
            Some(indices) => {
                let value = |index: &i32| values.get(usize::try_from(*index).ok()?).copied();
                let each: Option<Vec<T>> = indices.iter().map(value).collect();
                each.ok_or_else(|| format!("an index of primvar {} is out of range", self.name))?
            }
            None => values,
        };
        let (found, wanted) = (values.len(), order.count(self.on));
        if found != wanted {
            return Err(format!("primvar {} has {found} values for {wanted} elements", self.name));
        }
        Ok(order.kept(self.on, values))
    }

    /// The index of each kept corner's pair among the pairs.
    fn of_corners(&self, pairs: usize, order: &Order, corners: &[u32]) -> Parsed<Vec<u32>> {
        let each = self.each((0..pairs as u32).collect(), order)?;
        match self.on {
            // Vertices out of range are refused by the check of the mesh.
            On::Vertices => Ok(corners
                .iter()
                .map(|vertex| each.get(*vertex as usize).copied().unwrap_or(uvs::NONE))
                .collect()),
            On::Corners => Ok(each),
            On::Faces => Ok(vec![uvs::NONE; corners.len()]),
        }
    }

    /// The arrays that its values become: one for numbers, three for vectors.
    fn arrays(&self, value: Value, order: &Order) -> Parsed<Vec<MeshArray>> {
        let Some((number, components)) = components(value) else { return Ok(Vec::new()) };
        let names = match (self.name, components.len()) {
            ("displayColor", 3) => ["red", "green", "blue"].map(String::from).to_vec(),
            ("displayOpacity", 1) => vec!["alpha".into()],
            (name, 1) => vec![name.into()],
            (name, _) => ["x", "y", "z"].map(|axis| format!("{name}{axis}")).to_vec(),
        };
        let array =
            |(name, values)| Ok(MeshArray { name, on: self.on, number, values: self.each(values, order)? });
        names.into_iter().zip(components).map(array).collect()
    }
}

/// The numbers of an array, by component; none if a mesh cannot carry them.
fn components(value: Value) -> Option<(Number, Vec<Vec<f64>>)> {
    fn one<T: Into<f64>>(values: Vec<T>) -> Vec<Vec<f64>> {
        vec![values.into_iter().map(Into::into).collect()]
    }
    fn three<T: Into<f64> + Copy>(values: &[[T; 3]]) -> Vec<Vec<f64>> {
        [0, 1, 2].map(|axis| values.iter().map(|vector| vector[axis].into()).collect()).to_vec()
    }
    Some(match value {
        Value::Bools(values) => (Number::U8, one(values.into_iter().map(u8::from).collect())),
        Value::Ints(values) => (Number::I32, one(values)),
        Value::Uints(values) => (Number::U32, one(values)),
        Value::Floats(values) => (Number::F32, one(values)),
        Value::Doubles(values) => (Number::F64, one(values)),
        Value::Vectors(values) => (Number::F32, three(&values)),
        Value::DoubleVectors(values) => (Number::F64, three(&values)),
        Value::IntVectors(values) => (Number::I32, three(&values)),
        _ => return None,
    })
}

/// Meshes, one after another.
#[derive(Default)]
struct Joined {
    mesh: PolygonMesh,
    coordinates: Vec<[f32; 2]>,
    /// Index of each corner's coordinates.
    at: Vec<u32>,
    /// Names of arrays that some meshes lack.
    left_out: Vec<String>,
    has_meshes: bool,
}

impl Joined {
    fn add(&mut self, part: Part) {
        let PolygonMesh { positions, corners, ends, arrays, .. } = part.mesh;
        let [first_vertex, first_corner] =
            [self.mesh.positions.len(), self.mesh.corners.len()].map(|n| n as u32);
        let (coordinates, at) = part.uvs.unwrap_or_else(|| (Vec::new(), vec![uvs::NONE; corners.len()]));
        let first_pair = self.coordinates.len() as u32;
        let moved = |index: u32| if index == uvs::NONE { index } else { index.saturating_add(first_pair) };
        self.at.extend(at.into_iter().map(moved));
        self.coordinates.extend(coordinates);
        self.mesh.positions.extend(positions);
        // An index that is out of range stays so.
        self.mesh.corners.extend(corners.into_iter().map(|vertex| vertex.saturating_add(first_vertex)));
        self.mesh.ends.extend(ends.into_iter().map(|end| end + first_corner));
        if std::mem::replace(&mut self.has_meshes, true) {
            self.join(arrays);
        } else {
            self.mesh.arrays = arrays;
        }
    }

    /// Adds the values of arrays that both have; others are left out.
    fn join(&mut self, arrays: Vec<MeshArray>) {
        let is_same = |a: &MeshArray, b: &MeshArray| (&a.name, a.on, a.number) == (&b.name, b.on, b.number);
        let (kept, lacking): (Vec<_>, Vec<_>) = std::mem::take(&mut self.mesh.arrays)
            .into_iter()
            .partition(|own| arrays.iter().any(|other| is_same(own, other)));
        let new = arrays.iter().filter(|other| !kept.iter().any(|own| is_same(own, other)));
        let names = lacking.iter().chain(new).map(|array| array.name.clone());
        self.left_out.extend(names.collect::<Vec<_>>());
        self.mesh.arrays = kept;
        for own in &mut self.mesh.arrays {
            let other = arrays.iter().find(|other| is_same(own, other));
            own.values.extend(other.into_iter().flat_map(|other| &other.values));
        }
    }

    /// The mesh, with a warning.
    fn finish(mut self) -> (PolygonMesh, Option<String>) {
        let vertices = self.mesh.positions.len();
        self.mesh.uvs = Uvs::of_corners(self.coordinates, self.at, &self.mesh.corners, vertices);
        self.left_out.sort();
        self.left_out.dedup();
        let warning =
            || format!("primvars that not all of its meshes have are left out: {}", self.left_out.join(", "));
        (self.mesh, (!self.left_out.is_empty()).then(warning))
    }
}
