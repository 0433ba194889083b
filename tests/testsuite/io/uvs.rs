//! Vertices in their file's order, and UVs, through a shot's `objects/` and through `convert`.

use std::fs;
use std::path::Path;

use crate::common::usda;
use crate::program::{Folder, works};
use frazil::geometry::PolygonMesh;
use frazil::io::mesh;

/// A cube of 0.4 m as .obj: its vertices in an order that no face follows, one that no face names, quads and seams.
const SEAMS: &str = "v -.2 .4 .2\nv .2 0 -.2\nv 5 9 -5\nv -.2 0 .2\nv .2 .4 -.2\nv -.2 0 -.2\nv .2 .4 .2\nv .2 0 .2\n\
v -.2 .4 -.2\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvt .25 .5\nvt .5 .75\nvt .125 -.5\n\
g lid\nf 9/4 1/1 7/2 5/3\ng sides\nusemtl wood\nf 6/5/ 9/6 5/7 2/1\nf 4/5 8/6 7/7 1/2\nf 6/5 2/1 8/6 4/6\nf 2/1 5/7 7/7 8/6\n\
f 6/5 4/5 1/2 9/6\n";

/// What a corner is: where it lies, and its UVs.
type Corner = ([f32; 3], [f32; 2]);

/// The triangles of a mesh file by their corners.
fn corners(path: &Path) -> (Vec<[f32; 3]>, Vec<Vec<Corner>>) {
    of_polygons(mesh::read_polygons(path).unwrap())
}

fn of_polygons(polygons: PolygonMesh) -> (Vec<[f32; 3]>, Vec<Vec<Corner>>) {
    let (mesh, uvs) = polygons.into_textured();
    let uvs = uvs.expect("there are UVs");
    let positions: Vec<[f32; 3]> = mesh.positions.iter().map(|&p| p.into()).collect();
    let triangle = |index: usize| {
        let at = uvs.indices(&mesh.triangles, index);
        (0..3)
            .map(|i| (positions[mesh.triangles[index][i] as usize], uvs.coordinates[at[i] as usize]))
            .collect()
    };
    let triangles = (0..mesh.triangles.len()).map(triangle).collect();
    (positions, triangles)
}

/// The corners of a mesh in a USD file of one frame.
fn usd(path: &Path, seams: bool) -> (Vec<[f32; 3]>, Vec<Vec<Corner>>) {
    let text = usda::text(path);
    let numbers = |attribute: &str| usda::numbers(&text, attribute);
    let points: Vec<[f32; 3]> = numbers("points").chunks(3).map(|p| [p[0], p[1], p[2]]).collect();
    let positions: Vec<[f32; 2]> = numbers("primvars:st").chunks(2).map(|p| [p[0], p[1]]).collect();
    assert!(numbers("faceVertexCounts").iter().all(|&count| count == 3.0));
    let faces: Vec<usize> = numbers("faceVertexIndices").iter().map(|&i| i as usize).collect();
    let kind = if seams { "faceVarying" } else { "vertex" };
    let declared = text.split_once("texCoord2f[] primvars:st (").unwrap().1.trim_start();
    assert!(declared.starts_with(&format!("interpolation = \"{kind}\"")), "{text}");
    let at = if seams {
        numbers("primvars:st:indices").iter().map(|&i| i as usize).collect()
    } else {
        assert_eq!(positions.len(), points.len());
        faces.clone()
    };
    assert_eq!(at.len(), faces.len());
    let all: Vec<Corner> = faces.iter().zip(&at).map(|(&p, &t)| (points[p], positions[t])).collect();
    (points, all.chunks(3).map(<[Corner]>::to_vec).collect())
}

/// Moves a mesh by whole quarters of a metre, which changes no bit of the cube's coordinates but by rounding.
fn moved(
    (positions, triangles): (Vec<[f32; 3]>, Vec<Vec<Corner>>),
    by: [f64; 3],
) -> (Vec<[f32; 3]>, Vec<Vec<Corner>>) {
    let there = |p: [f32; 3]| [0, 1, 2].map(|axis| (f64::from(p[axis]) + by[axis]) as f32);
    let positions = positions.into_iter().map(there).collect();
    let corner = |(p, uv): Corner| (there(p), uv);
    (positions, triangles.into_iter().map(|corners| corners.into_iter().map(corner).collect()).collect())
}

/// Runs a shot of one object that is carried through the snow.
fn shot(folder: &Path, object: &str, out: &str) {
    let scene = format!(
        "[shot]\nframes = \"1-3\"\n[snow]\nground = 0.0\narea = [-0.6, -0.6, 0.6, 0.6]\ndepth = 0.2\ncell = 0.04\n\
         [output]\nobjects = [\"usd\", \"ply\"]\n[[object]]\nfile = \"{object}\"\n\
         keys = [{{ frame = 1, at = [0, 0.25, 0] }}, {{ frame = 3, at = [0.25, 0, -0.25] }}]\n"
    );
    fs::write(folder.join("shot.toml"), scene).unwrap();
    works(folder, &format!("snow shot.toml -o {out} -q"));
}

/// A mesh as it is in USD, where vertices of no face are at the first one of a face.
fn placed((points, faces): (Vec<[f32; 3]>, Vec<Vec<Corner>>)) -> (Vec<[f32; 3]>, Vec<Vec<Corner>>) {
    let is_used = |point: &[f32; 3]| faces.iter().flatten().any(|(corner, _)| corner == point);
    let first = *points.iter().find(|point| is_used(point)).unwrap();
    (points.iter().map(|point| if is_used(point) { *point } else { first }).collect(), faces)
}

/// Compares a shot's objects at its last frame with a mesh where it is then.
fn same_objects(folder: &Path, out: &str, want: &(Vec<[f32; 3]>, Vec<Vec<Corner>>), seams: bool) {
    let file = |extension: &str| folder.join(format!("{out}/objects/objects.0003.{extension}"));
    let want = moved(want.clone(), [0.25, 0.0, -0.25]);
    assert_eq!(corners(&file("ply")), want, "ply");
    assert_eq!(usd(&file("usdc"), seams), placed(want), "usd");
    let stage = fs::read_to_string(folder.join(out).join("shot.usda")).unwrap();
    let kind = if seams { "faceVarying" } else { "vertex" };
    let declared = format!("texCoord2f[] primvars:st (\n                interpolation = \"{kind}\"\n");
    assert!(stage.contains(&declared), "{stage}");
    let manifest = fs::read_to_string(folder.join(out).join("objects/objects.manifest.usda")).unwrap();
    assert!(manifest.contains("texCoord2f[] primvars:st ("), "{manifest}");
    assert_eq!(manifest.contains("int[] primvars:st:indices"), seams, "{manifest}");
}

/// The first base of a shot, but for what it says of its inputs.
fn base(folder: &Path, out: &str) -> Vec<Vec<u8>> {
    let grid = |frame: i32| {
        let path = folder.join(format!("{out}/base/base.{frame:04}.vdb"));
        let grid = frazil::vdb::file::read_named(&path, Some("surface")).unwrap();
        frazil::vdb::file::to_bytes(&[&grid], &Default::default()).unwrap()
    };
    (1..=3).map(grid).collect()
}

#[test]
fn an_obj_with_seams_keeps_every_vertex_and_corner() {
    let folder = &Folder::empty();
    fs::write(folder.join("seams.obj"), SEAMS).unwrap();
    // What the file's own lines say, without a reader of ours.
    let floats = |word: &str| -> Vec<Vec<f32>> {
        let lines = SEAMS.lines().filter_map(|line| line.strip_prefix(word));
        lines.map(|line| line.split_whitespace().map(|w| w.parse().unwrap()).collect()).collect()
    };
    let (v, vt) = (floats("v "), floats("vt "));
    let read = corners(&folder.join("seams.obj"));
    assert_eq!(read.0, v.iter().map(|p| [p[0], p[1], p[2]]).collect::<Vec<_>>());
    let mut quads = SEAMS.lines().filter_map(|line| line.strip_prefix("f "));
    for pair in read.1.chunks(2) {
        let corner = |word: &str| {
            let mut parts = word.split('/').map(|part| part.parse::<usize>().unwrap_or(0));
            let (p, t) = (&v[parts.next().unwrap() - 1], &vt[parts.next().unwrap() - 1]);
            ([p[0], p[1], p[2]], [t[0], t[1]])
        };
        let quad: Vec<Corner> = quads.next().unwrap().split_whitespace().map(corner).collect();
        assert_eq!(pair, [vec![quad[0], quad[1], quad[2]], vec![quad[0], quad[2], quad[3]]]);
    }
    shot(folder, "seams.obj", "out");
    same_objects(folder, "out", &read, true);
    for name in ["out.obj", "out.ply"] {
        let said = works(folder, &format!("convert seams.obj {name}"));
        assert!(said.contains("groups") && !said.contains("UVs"), "{said}");
        assert_eq!(corners(&folder.join(name)), read, "{name}");
    }
    works(folder, "convert out.ply back.obj");
    assert_eq!(corners(&folder.join("back.obj")), read);
    works(folder, "convert seams.obj out.usda");
    assert_eq!(usd(&folder.join("out.usda"), true), placed(read));
    assert!(works(folder, "convert seams.obj out.stl").contains("seams.obj: UVs"));
}

#[test]
fn a_seam_opens_nothing_and_a_vertex_without_a_face_sweeps_nothing() {
    let folder = &Folder::empty();
    let lines = SEAMS.lines().filter(|line| !line.starts_with("vt"));
    let plain: String = lines.map(|line| format!("{line}\n")).collect();
    let plain = with_faces(&plain, |vertex, _| format!(" {vertex}"));
    // Without the vertex that no face names, the others' numbers are one less.
    let without = SEAMS.replace("v 5 9 -5\n", "");
    let without =
        with_faces(&without, |vertex, rest| format!(" {}/{rest}", vertex - usize::from(vertex > 3)));
    let far = SEAMS.replace("v 5 9 -5\n", "v 5000000 0 0\n");
    fs::write(folder.join("seams.obj"), SEAMS).unwrap();
    fs::write(folder.join("plain.obj"), plain).unwrap();
    fs::write(folder.join("without.obj"), without).unwrap();
    fs::write(folder.join("far.obj"), far).unwrap();
    for name in ["seams", "plain", "without", "far"] {
        shot(folder, &format!("{name}.obj"), name);
        assert_eq!(base(folder, name), base(folder, "seams"), "{name}");
        let said = works(folder, &format!("check shot.toml --set object.1.file={name}.obj"));
        assert!(!said.contains("hole") && !said.contains("loop") && !said.contains("warn"), "{name}: {said}");
    }
    // As ground too: its area is that of its faces.
    for name in ["without", "far"] {
        let ground = format!("snow shot.toml -o on-{name} -q --set snow.ground={name}.obj --frames 1");
        let scene = fs::read_to_string(folder.join("shot.toml")).unwrap();
        fs::write(folder.join("shot.toml"), scene.replace("area = [-0.6, -0.6, 0.6, 0.6]\n", "")).unwrap();
        works(folder, &ground);
    }
    let first = |name: &str| {
        let path = folder.join(format!("on-{name}/base/base.0001.vdb"));
        let grid = frazil::vdb::file::read_named(&path, Some("surface")).unwrap();
        frazil::vdb::file::to_bytes(&[&grid], &Default::default()).unwrap()
    };
    assert_eq!(first("far"), first("without"));
}

/// An .obj whose faces' corners are written again, from their vertex and what follows its slash.
fn with_faces(text: &str, corner: impl Fn(usize, &str) -> String) -> String {
    let word = |word: &str| {
        let (vertex, rest) = word.split_once('/').unwrap();
        corner(vertex.parse().unwrap(), rest)
    };
    let line = |line: &str| match line.strip_prefix("f ") {
        Some(corners) => format!("f{}\n", corners.split_whitespace().map(word).collect::<String>()),
        None => format!("{line}\n"),
    };
    text.lines().map(line).collect()
}

#[test]
fn plys_keep_the_uvs_of_their_vertices_and_of_their_faces() {
    let folder = &Folder::empty();
    let head = |names: &str, list: &str| {
        format!(
            "ply\nformat ascii 1.0\nelement vertex 5\nproperty float {}\nproperty float x\nproperty float y\n\
             property float z\nproperty float {}\nelement face 4\nproperty list uchar int vertex_indices\n{list}end_header\n",
            names.split(' ').next().unwrap(),
            names.split(' ').nth(1).unwrap()
        )
    };
    // A tetrahedron, and a vertex that no face names, first.
    let points = ["9 9 9", "0 .4 0", ".3 0 -.3", "-.3 0 -.3", "0 0 .3"];
    let faces = [[1, 2, 3], [1, 3, 4], [1, 4, 2], [2, 4, 3]];
    let face = |f: &[i32; 3]| format!("3 {} {} {}", f[0], f[1], f[2]);
    for names in ["s t", "u v", "texture_u texture_v"] {
        let rows: Vec<String> = (0..5).map(|i| format!(".{i} {} .{}", points[i], 7 - i)).collect();
        let faces: Vec<String> = faces.iter().map(face).collect();
        let text = format!("{}{}\n{}\n", head(names, ""), rows.join("\n"), faces.join("\n"));
        fs::write(folder.join("own.ply"), text).unwrap();
        let read = corners(&folder.join("own.ply"));
        assert_eq!(read.1[3][1], ([0.0, 0.0, 0.3], [0.4, 0.3]), "{names}");
        let out = names.replace(' ', "-");
        shot(folder, "own.ply", &out);
        same_objects(folder, &out, &read, false);
        works(folder, "convert own.ply out.obj");
        assert_eq!(corners(&folder.join("out.obj")), read);
    }
    let rows: Vec<String> = (0..5).map(|i| format!("0 {} 0", points[i])).collect();
    let of_face = |i: usize| format!("{} 6 0 .{i} .25 .5 {i} 1", face(&faces[i]));
    let faces: Vec<String> = (0..4).map(of_face).collect();
    let list = "property list uchar float texcoord\n";
    let text = format!("{}{}\n{}\n", head("quality power", list), rows.join("\n"), faces.join("\n"));
    fs::write(folder.join("seams.ply"), text).unwrap();
    let read = corners(&folder.join("seams.ply"));
    assert_eq!(
        read.1[2],
        [([0.0, 0.4, 0.0], [0.0, 0.2]), ([0.0, 0.0, 0.3], [0.25, 0.5]), ([0.3, 0.0, -0.3], [2.0, 1.0])]
    );
    shot(folder, "seams.ply", "seams");
    same_objects(folder, "seams", &read, true);
}

type Places = Vec<[f32; 3]>;
type TextureCoordinates = Vec<[f32; 2]>;

/// A cube in a .gltf file: four vertices for each face, whose triangles name them backwards; every face its own UVs.
fn gltf(folder: &Path) -> (Places, TextureCoordinates, Vec<[usize; 3]>) {
    let (mut positions, mut uvs, mut triangles) = (Vec::new(), Vec::new(), Vec::new());
    for axis in 0..3 {
        for side in [-0.2f32, 0.2] {
            let first = positions.len();
            for (i, (a, b)) in
                [(-0.2f32, -0.2f32), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)].into_iter().enumerate()
            {
                let mut p = [side; 3];
                (p[(axis + 1) % 3], p[(axis + 2) % 3]) = (a, b);
                p[1] += 0.2;
                positions.push(p);
                uvs.push([0.125 * first as f32 + 0.0625 * i as f32, 0.25 * i as f32]);
            }
            let turn = |t: [usize; 3]| if side > 0.0 { t } else { [t[0], t[2], t[1]] };
            triangles.extend([[3, 1, 2], [0, 1, 3]].map(turn).map(|t| t.map(|i| first + i)));
        }
    }
    let mut bytes: Vec<u8> = positions.as_flattened().iter().flat_map(|v| v.to_le_bytes()).collect();
    bytes.extend(uvs.as_flattened().iter().flat_map(|v: &f32| v.to_le_bytes()));
    bytes.extend(triangles.as_flattened().iter().flat_map(|&i| (i as u16).to_le_bytes()));
    fs::write(folder.join("cube.bin"), &bytes).unwrap();
    let view = |start: usize, length: usize| {
        format!("{{\"buffer\":0,\"byteOffset\":{start},\"byteLength\":{length}}}")
    };
    let json = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scene\":0,\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0}}],\
         \"meshes\":[{{\"primitives\":[{{\"attributes\":{{\"POSITION\":0,\"TEXCOORD_0\":1}},\"indices\":2}}]}}],\
         \"accessors\":[{{\"bufferView\":0,\"componentType\":5126,\"count\":24,\"type\":\"VEC3\",\"min\":[-0.2,0,-0.2],\
         \"max\":[0.2,0.4,0.2]}},{{\"bufferView\":1,\"componentType\":5126,\"count\":24,\"type\":\"VEC2\"}},\
         {{\"bufferView\":2,\"componentType\":5123,\"count\":36,\"type\":\"SCALAR\"}}],\
         \"bufferViews\":[{},{},{}],\"buffers\":[{{\"uri\":\"cube.bin\",\"byteLength\":{}}}]}}",
        view(0, 288),
        view(288, 192),
        view(480, 72),
        bytes.len()
    );
    fs::write(folder.join("cube.gltf"), json).unwrap();
    (positions, uvs, triangles)
}

#[test]
fn a_gltf_keeps_its_vertices_though_those_that_move_alike_are_joined() {
    let folder = &Folder::empty();
    let (positions, uvs, triangles) = gltf(folder);
    // v points down in glTF.
    let corner = |i: usize| (positions[i], [uvs[i][0], 1.0 - uvs[i][1]]);
    let want: Vec<Vec<Corner>> = triangles.iter().map(|t| t.map(corner).to_vec()).collect();
    let want = (positions, want);
    shot(folder, "cube.gltf", "out");
    same_objects(folder, "out", &want, false);
    let said = works(folder, "check shot.toml");
    assert!(!said.contains("hole") && !said.contains("warn"), "{said}");
    for name in ["out.obj", "out.ply"] {
        assert_eq!(works(folder, &format!("convert cube.gltf {name}")), "");
        assert_eq!(corners(&folder.join(name)), want, "{name}");
    }
    assert!(works(folder, "convert cube.gltf out.stl").contains("cube.gltf: UVs are not carried over"));
}

#[test]
fn corners_without_uvs_are_reported_and_bad_ones_are_named() {
    let folder = &Folder::empty();
    fs::write(folder.join("part.obj"), SEAMS.replace("f 6/5/ 9/6 5/7", "f 6 9//1 5/7")).unwrap();
    let said = works(folder, "convert part.obj out.obj");
    assert!(said.contains("part.obj: 2 corners or vertices have no UVs"), "{said}");
    let (_, triangles) = corners(&folder.join("out.obj"));
    assert_eq!(triangles[2][0].1, [0.0, 0.0]);
    fs::write(folder.join("nan.obj"), SEAMS.replace("vt .5 .75", "vt nan .75")).unwrap();
    assert!(works(folder, "convert nan.obj out.obj").contains("6 corners or vertices have no UVs"));
    for (bad, line) in [("f 6/8 9/6 5/7", 21), ("f 6/x 9/6 5/7", 21), ("f 6/-8 9/6 5/7", 21)] {
        fs::write(folder.join("bad.obj"), SEAMS.replace("f 6/5/ 9/6 5/7", bad)).unwrap();
        let error = mesh::read(&folder.join("bad.obj")).unwrap_err().to_string();
        assert!(
            error.contains(&format!("line {line}: ")) && error.contains("texture coordinates"),
            "{error}"
        );
    }
}
