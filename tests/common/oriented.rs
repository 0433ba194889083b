//! Meshes whose parts are turned every way, with the volumes that they mean by their construction.

use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use frazil::geometry::{TriMesh, Vec3};
use serde_json::{Value, json};

use super::shapes;

/// What must become of a mesh.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// It is right: it stays as it is.
    Correct,
    /// It is turned, doubled or mixed, and there is one solid that it means.
    Decidable,
    /// Which solid it means cannot be told: a warning says so.
    Doubtful,
}

/// A mesh around the origin, within 0.43 m in x and 0.22 m in y and z.
pub struct Case {
    pub name: String,
    pub kind: Kind,
    pub mesh: TriMesh,
    /// Whether its triangles share vertices.
    pub is_shared: bool,
    /// Volume (m3).
    pub volume: f64,
    /// Volume (m3) that it sweeps when it moves along z by [`MOVE`].
    pub swept: f64,
    /// Area (m2) of the solids that lie in no other, seen from above, and the volume (m3) of cavities without what is in them.
    pub seen: [f64; 2],
}

/// How far bodies move along z (m).
pub const MOVE: f64 = 0.02;
/// Sizes of a cavity and of the solid in it, over the outer one's.
const NESTED: [f64; 3] = [1.0, 0.7, 0.5];

/// Numbers from a seed.
pub struct Random(u64);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1234_5678)
    }

    pub fn below(&mut self, count: u64) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) % count
    }
}

/// A solid that stands apart, a shell, or a shell with a solid in it.
#[derive(Clone, Copy)]
struct Root {
    /// Half an edge of a box or the radius of a ball (m).
    size: f64,
    is_ball: bool,
    /// Its middle (m).
    at: [f64; 3],
    /// 1 to 3 surfaces.
    levels: usize,
}

impl Root {
    fn surface(&self, level: usize) -> TriMesh {
        let size = (self.size * NESTED[level]) as f32;
        let mut mesh = if self.is_ball {
            shapes::welded(&shapes::sphere(size, 14))
        } else {
            shapes::cuboid([2.0 * size; 3])
        };
        let at = Vec3::from(self.at.map(|x| x as f32));
        mesh.positions.iter_mut().for_each(|p| *p += at);
        if level == 1 { mesh.reversed() } else { mesh }
    }

    /// Volume, that which a level covers at some time while it moves, or that which it covers at all times, and area from above.
    fn measures(&self, level: usize) -> [f64; 4] {
        let (r, d) = (self.size * NESTED[level], MOVE);
        if self.is_ball {
            let (area, volume) = (std::f64::consts::PI * r * r, 4.0 / 3.0 * std::f64::consts::PI * r.powi(3));
            // Two balls have a lens in common.
            let lens = std::f64::consts::PI * (4.0 * r + d) * (2.0 * r - d).powi(2) / 12.0;
            return [volume, volume + area * d, lens, area];
        }
        let area = 4.0 * r * r;
        [area * 2.0 * r, area * (2.0 * r + d), area * (2.0 * r - d), area]
    }
}

/// The mesh of a seed: of ten that follow each other two are correct and one is doubtful.
pub fn case(seed: u64) -> Case {
    let mut random = Random::new(seed);
    let count = 1 + random.below(2) as usize;
    let mut roots: Vec<Root> = (0..count)
        .map(|at| {
            let x = if count == 1 { 0.0 } else { 0.46 * at as f64 - 0.23 };
            let [y, z] = [(); 2].map(|()| 0.01 * random.below(5) as f64 - 0.02);
            let (is_ball, levels) = (random.below(2) == 1, 1 + random.below(3) as usize);
            Root { size: 0.2, is_ball, at: [x, y, z], levels }
        })
        .collect();
    let variant = seed % 10;
    let which = if variant == 9 { 9 + seed / 10 % 3 } else { variant };
    if which == 9 {
        roots[0].levels = 2;
    } else if which > 9 {
        roots = vec![Root { size: 0.1875, is_ball: false, at: [0.1875, 0.0, 0.0], levels: 1 }];
    }
    let mut mesh = TriMesh::default();
    let (mut volume, mut swept, mut seen) = (0.0, 0.0, [0.0; 2]);
    for root in &roots {
        // Some roots are turned: with all that is in them, or the outer surface where it is clear that the others stay.
        let is_turned = which == 9 || [2, 7].contains(&which) && (count == 1 || random.below(2) == 1);
        let is_outer_alone = which == 9 || root.levels == 3 && random.below(2) == 1;
        for level in 0..root.levels {
            let surface = root.surface(level);
            let surface =
                if is_turned && (level == 0 || !is_outer_alone) { surface.reversed() } else { surface };
            let surface = match which {
                6 | 7 => mixed(surface, root.levels > 1, &mut random),
                _ => surface,
            };
            mesh.append(&surface);
            let [whole, moved, always, area] = root.measures(level);
            let way = if level == 1 { -1.0 } else { 1.0 };
            volume += way * whole;
            swept += if level == 1 { -always } else { moved };
            seen[0] += if level == 0 { area } else { 0.0 };
            seen[1] += if level == 0 { 0.0 } else { -way * whole };
        }
    }
    let (kind, what) = match which {
        0 => (Kind::Correct, "as it is"),
        1 => (Kind::Correct, "loose triangles"),
        2 => (Kind::Decidable, "roots turned"),
        3 => (Kind::Decidable, "all turned"),
        4 => (Kind::Decidable, "both sides"),
        5 => (Kind::Decidable, "copies"),
        6 => (Kind::Decidable, "mixed"),
        7 => (Kind::Decidable, "both sides, mixed, roots turned"),
        8 => (Kind::Decidable, "mirrored, loose triangles"),
        9 => (Kind::Doubtful, "a shell with its outer side turned"),
        10 => (Kind::Doubtful, "a surface with one side"),
        _ => (Kind::Doubtful, "two boxes with a common wall, mixed"),
    };
    match which {
        3 => mesh = mesh.reversed(),
        4 | 7 => {
            let back = mesh.clone().reversed().triangles;
            mesh.triangles.extend(back);
        }
        5 => {
            let copy = mesh.clone();
            mesh.append(&if random.below(2) == 1 { copy.reversed() } else { copy });
        }
        8 => mesh.positions.iter_mut().for_each(|p| p.x = -p.x),
        10 => mesh.append(&klein()),
        11 => {
            // The corners of the wall are the same to the last bit.
            let mut beside = shapes::cuboid([0.375; 3]);
            beside.positions.iter_mut().for_each(|p| p.x -= 0.1875);
            mesh.append(&beside);
            mesh = shapes::welded(&mesh);
            let turned = random.below(8) as usize;
            mesh.triangles[turned].swap(1, 2);
        }
        _ => {}
    }
    let is_loose = [1, 8].contains(&which);
    if is_loose {
        mesh = loose(&mesh);
    }
    let levels: Vec<usize> = roots.iter().map(|root| root.levels).collect();
    let name = format!("{seed}: {what}, surfaces {levels:?}");
    Case { name, kind, mesh, is_shared: !is_loose, volume, swept, seen }
}

/// Some triangles turned round: every third, so that the sense of most stays, or any.
fn mixed(mut mesh: TriMesh, is_few: bool, random: &mut Random) -> TriMesh {
    for (at, triangle) in mesh.triangles.iter_mut().enumerate() {
        if if is_few { at % 3 == 1 } else { random.below(2) == 1 } {
            triangle.swap(1, 2);
        }
    }
    mesh
}

/// The mesh with vertices of its own for each triangle.
pub fn loose(mesh: &TriMesh) -> TriMesh {
    let positions =
        mesh.triangles.as_flattened().iter().map(|&vertex| mesh.positions[vertex as usize]).collect();
    let triangles = (0..mesh.triangles.len() as u32).map(|at| [3 * at, 3 * at + 1, 3 * at + 2]).collect();
    TriMesh { positions, triangles }
}

/// The text of a .gltf file that has a mesh mirrored in x, right side out where the mesh is, as a skin whose joint hangs on a node that
/// mirrors it back: glTF says that its faces turn with it.
pub fn mirrored_skin(mesh: &TriMesh) -> String {
    let vertices = mesh.positions.len();
    let mirrored = mesh.positions.iter().flat_map(|p| [-p.x, p.y, p.z]).flat_map(f32::to_le_bytes);
    let weights = (0..vertices).flat_map(|_| [1.0f32, 0.0, 0.0, 0.0]).flat_map(f32::to_le_bytes);
    let indices = mesh.triangles.iter().flat_map(|&[a, b, c]| [a, c, b]).flat_map(u32::to_le_bytes);
    let parts: [Vec<u8>; 4] =
        [mirrored.collect(), vec![0; 4 * vertices], weights.collect(), indices.collect()];
    let mut start = 0;
    let views: Vec<Value> = parts
        .iter()
        .map(|part| {
            start += part.len();
            json!({ "buffer": 0, "byteOffset": start - part.len(), "byteLength": part.len() })
        })
        .collect();
    let (low, high) = mesh.bounds().unwrap_or_default();
    let data = STANDARD.encode(parts.concat());
    json!({
        "asset": { "version": "2.0" }, "scene": 0, "scenes": [{ "nodes": [0] }],
        "nodes": [{ "scale": [-1, 1, 1], "children": [1, 2] }, { "name": "joint" }, { "mesh": 0, "skin": 0 }],
        "skins": [{ "joints": [1] }],
        "meshes": [{ "primitives": [
            { "attributes": { "POSITION": 0, "JOINTS_0": 1, "WEIGHTS_0": 2 }, "indices": 3 }
        ] }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "type": "VEC3", "count": vertices,
              "min": [-high.x, low.y, low.z], "max": [-low.x, high.y, high.z] },
            { "bufferView": 1, "componentType": 5121, "type": "VEC4", "count": vertices },
            { "bufferView": 2, "componentType": 5126, "type": "VEC4", "count": vertices },
            { "bufferView": 3, "componentType": 5125, "type": "SCALAR", "count": 3 * mesh.triangles.len() },
        ],
        "bufferViews": views,
        "buffers": [{ "byteLength": start, "uri": format!("data:application/octet-stream;base64,{data}") }],
    })
    .to_string()
}

/// A Klein bottle: closed, and with one side only.
fn klein() -> TriMesh {
    // An odd count: the middle of the figure of eight, where it passes through itself, is no vertex twice.
    let (n, m) = (24u32, 15u32);
    let at = |i: u32, j: u32| {
        let [u, v] = [(i, n), (j, m)].map(|(k, of)| f64::from(k) / f64::from(of) * std::f64::consts::TAU);
        let (half_sin, half_cos) = (u / 2.0).sin_cos();
        let (across, up) = (
            half_cos * v.sin() - half_sin * (2.0 * v).sin(),
            half_sin * v.sin() + half_cos * (2.0 * v).sin(),
        );
        let reach = 0.09 + 0.03 * across;
        Vec3::new((reach * u.cos() - 0.22) as f32, (0.03 * up) as f32, (reach * u.sin()) as f32)
    };
    let positions = (0..n).flat_map(|i| (0..m).map(move |j| at(i, j))).collect();
    let index = |i: u32, j: u32| if i < n { i * m + j % m } else { (m - j % m) % m };
    let mut triangles = Vec::new();
    for i in 0..n {
        for j in 0..m {
            let [a, b, c, d] = [index(i, j), index(i + 1, j), index(i + 1, j + 1), index(i, j + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    TriMesh { positions, triangles }
}
