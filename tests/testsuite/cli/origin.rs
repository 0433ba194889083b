//! Files far from the origin are warned of by every command and system, and read exactly less an origin; vertices that no face
//! names count nowhere, however far they are.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;

use frazil::geometry::{DVec3, TriMesh, Vec3};

use crate::program::{Folder, fails, works};

/// A position on a map; all coordinates of the tests are whole 1024ths, which 32 bits round there.
const FAR: [f64; 3] = [652_301.375, 12.5, 5_182_300.25];
const ORIGIN: &str = "652301.375,12.5,5182300.25";
const KEY: &str = "[652301.375, 12.5, 5182300.25]";

/// A terrain of some metres, open below.
fn hill() -> TriMesh {
    let count = 13u32;
    let height = |x: u32, z: u32| {
        let (x, z) = (f64::from(x) - 6.0, f64::from(z) - 6.0);
        ((0.8 - 0.02 * (x * x + z * z) + 0.03 * x * z) * 1024.0).round() / 1024.0
    };
    let position = |n: u32| {
        let (x, z) = (n % count, n / count);
        Vec3::new(x as f32 * 0.5 - 3.0, height(x, z) as f32, z as f32 * 0.5 - 3.0)
    };
    let square = |n: u32| [[n, n + count, n + count + 1], [n, n + count + 1, n + 1]];
    let is_square = |n: &u32| n % count + 1 < count && n / count + 1 < count;
    TriMesh {
        positions: (0..count * count).map(position).collect(),
        triangles: (0..count * count).filter(is_square).flat_map(square).collect(),
    }
}

fn block() -> TriMesh {
    TriMesh::cuboid([-0.5, 1.5, -0.25], [0.25, 2.25, 0.5])
}

/// How an .obj file is written.
#[derive(Clone, Copy, PartialEq)]
enum As {
    Plain,
    /// Moved by [`FAR`].
    Far,
    /// Among vertices that no face names.
    Wild,
}

/// Vertices a million metres away.
const WILD: &str = "v 1000000 0 0\nv 0 -1000000 0\nv 0 0 1e6\nv -1e6 1e6 -1e6\n";

fn obj(mesh: &TriMesh, how: As) -> String {
    let off = if how == As::Far { FAR } else { [0.0; 3] };
    let (mut text, first) = if how == As::Wild { (WILD.to_string(), 5) } else { (String::new(), 1) };
    for p in &mesh.positions {
        let [x, y, z] = [0, 1, 2].map(|axis| f64::from(p[axis]) + off[axis]);
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|vertex| vertex + first);
        writeln!(text, "f {a} {b} {c}").unwrap();
    }
    if how == As::Wild { text + WILD } else { text }
}

/// A folder with the meshes and scenes; `origin` is the line of a key, or nothing.
fn folder(how: As, origin: &str) -> Folder {
    let folder = Folder::empty();
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).unwrap();
    let mut open = block();
    open.triangles.pop();
    let mut moved = block();
    moved.positions.iter_mut().for_each(|p| p.x += 0.25);
    for (name, mesh) in
        [("hill.obj", hill()), ("block.obj", block()), ("open.obj", open), ("moved.obj", moved)]
    {
        write(name, &obj(&mesh, how));
    }
    write(
        "snow.toml",
        &format!(
            "[shot]\nframes = \"1-2\"\n[snow]\nground = \"hill.obj\"\ndepth = 0.3\ncell = 0.1\n{origin}\n[[object]]\nfile = \"block.obj\"\n{origin}\n"
        ),
    );
    write(
        "spill.toml",
        &format!(
            "[shot]\nframes = \"1-2\"\n[shallow]\nterrain = \"hill.obj\"\ncell = 0.125\nliquid = \"water\"\n{origin}\n[[object]]\nfile = \"block.obj\"\n{origin}\n[[pour]]\nat = [0.0, 3.0, 0.0]\nradius = 1.0\nvolume_ml = 50000.0\n"
        ),
    );
    let off = if how == As::Far { FAR } else { [0.0; 3] };
    let particle = |n: u32| {
        let [x, y, z] = [n % 6, n / 6 % 6, n / 36].map(f64::from);
        let [x, y, z] =
            [-0.4375 + 0.125 * x + off[0], 1.5625 + 0.125 * y + off[1], -0.1875 + 0.125 * z + off[2]];
        format!("{x} {y} {z}\n")
    };
    write("drop.xyz", &(0..216).map(particle).collect::<String>());
    write(
        "drop.toml",
        &format!(
            "[shot]\nframes = \"1-1\"\n[surface]\nparticles = \"drop.xyz\"\nmesh = \"block.obj\"\nspacing = 0.125\n{origin}\n"
        ),
    );
    folder
}

/// What a command says, but for numbers of vertices and what each run has of its own.
fn said(folder: &Path, command: &str) -> String {
    let said = works(folder, command).replace(&folder.display().to_string(), "");
    let of_run = ["vertices", "seconds", "origin", "memory", "disk"];
    let is_same = |line: &&str| !of_run.iter().any(|word| line.contains(word));
    said.lines().filter(is_same).collect::<Vec<_>>().join("\n")
}

/// The same is said and written in both folders; `option` goes with the commands of the second.
#[track_caller]
fn are_the_same(plain: &Path, other: &Path, option: &str) {
    for command in [
        "info hill.obj block.obj OPTION --json",
        "mesh check hill.obj block.obj open.obj OPTION --json",
        "mesh compare block.obj moved.obj OPTION --json",
        "check snow.toml",
        "check spill.toml",
        "check drop.toml",
    ] {
        let [a, b] = [(plain, ""), (other, option)]
            .map(|(folder, option)| said(folder, &command.replace("OPTION", option)));
        assert_eq!(a, b, "{command}");
    }
    for (command, output) in [
        ("vdb from-mesh block.obj OPTION --cell 0.05 -o a.vdb", "a.vdb"),
        ("vdb sweep block.obj OPTION --move 0,0,0.4 --cell 0.05 -o b.vdb", "b.vdb"),
        ("vdb sweep block.obj moved.obj OPTION --cell 0.05 -o c.vdb", "c.vdb"),
        ("vdb from-particles drop.xyz OPTION --spacing 0.125 -o d.vdb", "d.vdb"),
        ("mesh repair open.obj OPTION -o e.obj", "e.obj"),
        ("shallow spill.toml -o f --threads 1", "f/liquid/liquid.0002.usdc"),
    ] {
        let outputs = [(plain, ""), (other, option)].map(|(folder, option)| {
            works(folder, &command.replace("OPTION", option));
            match output.ends_with("vdb") {
                // The file has an identifier of its own.
                true => said(folder, &format!("info {output} --measure")).into_bytes(),
                false => fs::read(folder.join(output)).unwrap(),
            }
        });
        assert!(outputs[0] == outputs[1], "{command}");
    }
}

#[test]
fn vertices_without_faces_count_nowhere() {
    let [plain, wild] = [As::Plain, As::Wild].map(|how| folder(how, ""));
    let (plain, wild) = (plain.path(), wild.path());
    are_the_same(plain, wild, "");
    let pictures = [plain, wild].map(|folder| {
        works(folder, "preview block.obj -o a.png --size 64x48");
        fs::read(folder.join("a.png")).unwrap()
    });
    assert!(pictures[0] == pictures[1], "the picture is framed otherwise");
    // They stay where a file is converted, outside of its extent.
    let extents = [(plain, 8), (wild, 16)].map(|(folder, count)| {
        works(folder, "convert block.obj c.usda");
        works(folder, "convert block.obj c.ply");
        assert_eq!(frazil::io::mesh::read(&folder.join("c.ply")).unwrap().positions.len(), count);
        let text = fs::read_to_string(folder.join("c.usda")).unwrap();
        text.lines().find(|line| line.contains("extent")).unwrap().to_string()
    });
    assert_eq!(extents[0], extents[1]);
}

#[test]
fn coordinates_of_a_map_keep_their_digits_less_an_origin() {
    let [plain, far] = [(As::Plain, String::new()), (As::Far, format!("origin = {KEY}"))]
        .map(|(how, key)| folder(how, &key));
    let (plain, far) = (plain.path(), far.path());
    are_the_same(plain, far, &format!("--origin={ORIGIN}"));
    // Converted, one or a sequence, they have the same bytes.
    for frame in 1..=2 {
        for folder in [plain, far] {
            fs::copy(folder.join("hill.obj"), folder.join(format!("hill.{frame:04}.obj"))).unwrap();
        }
    }
    works(plain, "convert hill.obj a.ply");
    works(far, &format!("convert hill.obj a.ply --origin {ORIGIN}"));
    works(far, &format!("convert hill.%04d.obj b.%04d.ply --frames 1-2 --origin {ORIGIN}"));
    let expected = fs::read(plain.join("a.ply")).unwrap();
    for name in ["a.ply", "b.0001.ply", "b.0002.ply"] {
        assert!(fs::read(far.join(name)).unwrap() == expected, "{name}");
    }
    // In the file's own axes.
    fs::write(
        far.join("one.obj"),
        "v 5000001.5 3000000.25 10\nv 5000000 3000000 10\nv 5000000 3000001 11\nf 1 2 3\n",
    )
    .unwrap();
    works(far, "convert one.obj one.ply --up z --scale 2 --origin 5000000,3000000,10");
    let mesh = frazil::io::mesh::read(&far.join("one.ply")).unwrap();
    assert_eq!(mesh.positions, [[3.0, 0.0, -0.5], [0.0; 3], [0.0, 2.0, -2.0]].map(Vec3::from));
}

#[test]
fn every_door_warns_of_what_lies_far_from_the_origin() {
    let far = &folder(As::Far, "");
    for command in [
        "info hill.obj",
        "mesh check hill.obj",
        "mesh compare hill.obj hill.obj",
        "mesh repair open.obj -o a.obj --cell 1",
        "convert hill.obj a.ply",
        "vdb sweep block.obj --move 0,0,0.4 --cell 0.05 -o b.vdb",
        "check snow.toml",
        "check spill.toml",
    ] {
        let output = crate::program::frazil(far, command);
        let said =
            [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned()).concat();
        assert!(said.contains("32-bit numbers are") && said.contains("origin"), "{command}: {said}");
    }
    let near = folder(As::Plain, "");
    let said = works(near.path(), "info hill.obj block.obj") + &works(near.path(), "check spill.toml");
    assert!(!said.contains("32-bit"), "{said}");
    let level = "[shot]\nframes = \"1-1\"\n[snow]\nground = 0.0\narea = [-1.0, -1.0, 1.0, 1.0]\ndepth = 0.3\ncell = 0.1\norigin = [1.0, 0.0, 0.0]\n";
    fs::write(far.join("level.toml"), level).unwrap();
    fails(far, "check level.toml", 2, &["origin", "is for meshes"]);
}

/// Text of any precision, and 64-bit numbers, keep what they hold.
#[test]
fn readers_subtract_an_origin_in_64_bits() {
    let position = DVec3::new(652_301.000_123_4, -0.062_5, 5_182_300.999_876_5);
    let origin = DVec3::new(652_301.0, 0.0, 5_182_300.0);
    let expected: Vec3 = (position - origin).cast();
    let vertices = [position, position + DVec3::x(), position + DVec3::y()];
    let lines = |before: &str| -> String {
        vertices.iter().map(|p| format!("{before}{} {} {}\n", p.x, p.y, p.z)).collect()
    };
    let head = |format: &str, number: &str| {
        let axes = ["x", "y", "z"].map(|axis| format!("property {number} {axis}\n")).concat();
        format!(
            "ply\nformat {format} 1.0\nelement vertex 3\n{axes}element face 1\nproperty list uchar int vertex_indices\nend_header\n"
        )
    };
    let mut doubles = head("binary_little_endian", "double").into_bytes();
    vertices.iter().flat_map(|p| p.iter()).for_each(|value| doubles.extend(value.to_le_bytes()));
    doubles.push(3);
    [0i32, 1, 2].iter().for_each(|index| doubles.extend(index.to_le_bytes()));
    for (name, bytes) in [
        ("a.obj", (lines("v ") + "f 1 2 3\n").into_bytes()),
        ("a.ply", (head("ascii", "float") + &lines("") + "3 0 1 2\n").into_bytes()),
        ("b.ply", doubles),
        (
            "a.stl",
            format!(
                "solid\nfacet normal 0 0 0\nouter loop\n{}endloop\nendfacet\nendsolid\n",
                lines("vertex ")
            )
            .into_bytes(),
        ),
    ] {
        let mesh = frazil::io::mesh::parse_polygons_from(Path::new(name), &bytes, origin).unwrap();
        assert_eq!(mesh.positions[0], expected, "{name}");
        assert!((mesh.positions[1] - mesh.positions[0] - Vec3::x()).norm() < 1e-6, "{name}");
    }
}
