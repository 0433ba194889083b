//! Text in files of meshes and particles as programs write it, and as editors and other systems leave it: every variant of a text
//! holds the same mesh, and what cannot be read for certain is refused in one sentence that says why.

use std::fmt::Write as _;
use std::path::Path;
use std::time::{Duration, Instant};

use crate::program::Folder;
use frazil::geometry::{DVec3, PolygonMesh, TriMesh, Vec3};
use frazil::io::{mesh, particles};
use proptest::prelude::*;

fn polygons(name: &str, bytes: &[u8]) -> frazil::Result<PolygonMesh> {
    mesh::parse_polygons(Path::new(name), bytes)
}

fn read(name: &str, bytes: &[u8]) -> frazil::Result<TriMesh> {
    polygons(name, bytes).map(PolygonMesh::into_triangles)
}

fn positions(bytes: &[u8]) -> frazil::Result<Vec<DVec3>> {
    particles::parse(Path::new("a.xyz"), bytes).map(|cloud| cloud.positions)
}

/// How a text is written.
#[derive(Debug, Clone, Copy)]
struct Style {
    /// Line end, and a second one that takes turns with it.
    ends: [&'static str; 2],
    /// What stands before each word.
    blank: &'static str,
    /// Of keywords of STL: lower, upper, capital.
    letters: usize,
    /// Of numbers: plain, 1e-3, 1E-03, 1D-03.
    number: usize,
    head: usize,
    name: usize,
    solids: usize,
    has_end: bool,
}

const ENDS: [&str; 3] = ["\n", "\r\n", "\r"];

fn styles() -> impl Strategy<Value = Style> {
    let of = (0usize..3, 0usize..3, 0usize..3, 0usize..3, 0usize..4);
    (of, 0usize..6, 0usize..6, 1usize..5, any::<bool>()).prop_map(
        |((a, b, blank, letters, number), head, name, solids, has_end)| Style {
            ends: [ENDS[a], ENDS[b]],
            blank: [" ", "\t", "  \t "][blank],
            letters,
            number,
            head,
            name,
            solids,
            has_end,
        },
    )
}

impl Style {
    fn keyword(&self, word: &str) -> String {
        match self.letters {
            0 => word.to_string(),
            1 => word.to_uppercase(),
            _ => word[..1].to_uppercase() + &word[1..],
        }
    }

    /// A number with all its digits.
    fn number(&self, value: f32) -> String {
        let text = format!("{value:e}");
        let (digits, exponent) = text.split_once('e').unwrap();
        let exponent: i32 = exponent.parse().unwrap();
        match self.number {
            0 => value.to_string(),
            1 => text,
            2 => format!("{digits}E{exponent:+03}"),
            _ => format!("{digits}D{exponent:+03}"),
        }
    }

    /// Lines with their ends.
    fn joined(&self, lines: &[Vec<u8>]) -> Vec<u8> {
        let mut out = Vec::new();
        for (n, line) in lines.iter().enumerate() {
            out.extend_from_slice(line);
            out.extend_from_slice(self.ends[n % 2].as_bytes());
        }
        out
    }

    /// What stands before the first line.
    fn head(&self) -> Vec<Vec<u8>> {
        match self.head {
            0 => vec![b"\xef\xbb\xbf".to_vec()],
            1 => vec![Vec::new(), b"  \t".to_vec()],
            2 => vec![b"# made by K\xf6rper 2".to_vec(), b"#".to_vec()],
            3 => vec![b"\xef\xbb\xbf# a".to_vec()],
            _ => Vec::new(),
        }
    }

    fn stl(&self, mesh: &TriMesh) -> Vec<u8> {
        let names: [&[u8]; 6] =
            [b"", b"a", b"K\xf6rper \xff", b"solid endsolid", b"a\tfacet of it", "Körper # 1".as_bytes()];
        let words = |text: &str| {
            let words: Vec<String> = text.split(' ').map(|word| self.keyword(word)).collect();
            words.join(self.blank).into_bytes()
        };
        let named = |word: &str| [&words(word)[..], self.blank.as_bytes(), names[self.name]].concat();
        let mut lines = self.head();
        let size = mesh.triangles.len().div_ceil(self.solids).max(1);
        // Some programs begin with a solid of nothing.
        if self.name == 1 {
            lines.extend([named("solid"), named("endsolid")]);
        }
        let parts: Vec<&[[u32; 3]]> = mesh.triangles.chunks(size).collect();
        for (n, part) in parts.iter().enumerate() {
            lines.push(named("solid"));
            for triangle in *part {
                lines.push([&words("facet normal")[..], b" nan -1.#IND 0"].concat());
                lines.push(words("outer loop"));
                for &corner in triangle {
                    let mut line = words("vertex");
                    for value in mesh.positions[corner as usize].iter() {
                        line.extend(format!("{}{}", self.blank, self.number(*value)).into_bytes());
                    }
                    lines.push(line);
                }
                let [end_loop, end_facet] =
                    if self.solids == 2 { ["end loop", "end facet"] } else { ["endloop", "endfacet"] };
                lines.extend([words(end_loop), words(end_facet)]);
            }
            if self.has_end || n + 1 < parts.len() {
                lines.push(if self.solids == 2 { words("end solid") } else { named("endsolid") });
            }
        }
        self.joined(&lines)
    }

    fn obj(&self, mesh: &TriMesh) -> Vec<u8> {
        // A backslash at the end of a name or comment means nothing.
        let mut lines = vec![b"# C:\\models\\".to_vec(), b"o part\\".to_vec()];
        lines.splice(0..0, self.head());
        let goes_on = |n: usize| {
            if n % 3 == self.solids % 3 { format!("\\{}", self.ends[n % 2]) } else { String::new() }
        };
        for (n, p) in mesh.positions.iter().enumerate() {
            let [x, y, z] = [p.x, p.y, p.z].map(|value| self.number(value));
            let blank = self.blank;
            let mut line = String::new();
            write!(line, "v{blank}{x}{blank}{}{y}{blank}{z}", goes_on(n)).unwrap();
            // Without a blank before or behind it too.
            let note = ["", " # a note\r# of two lines", "  "][n % 3];
            lines.push((line + note).into_bytes());
        }
        for (n, [a, b, c]) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = [a + 1, b + 1, c + 1];
            let more = goes_on(n);
            lines.push(format!("f {a}{}{more}{b} {more} {c}", self.blank).into_bytes());
        }
        self.joined(&lines)
    }

    /// A header with the first line end throughout.
    fn ply(&self, mesh: &TriMesh, format: &str, body: &[u8]) -> Vec<u8> {
        let end = self.ends[0];
        let mark: &[u8] = if self.head == 0 { b"\xef\xbb\xbf" } else { b"" };
        let lines = [
            "ply",
            &format!("format {format} 1.0"),
            "comment K\u{f6}rper, until end_header",
            &format!("element vertex {}", mesh.positions.len()),
            "property float x",
            "property float y",
            "property float z",
            &format!("element face {}", mesh.triangles.len()),
            "property list uchar int vertex_indices",
            "end_header",
        ];
        let text: String = lines.iter().map(|line| format!("{line}{end}")).collect();
        // Latin-1, as most of these programs have it.
        let head: Vec<u8> = text.chars().map(|letter| letter as u8).collect();
        [mark, &head, body].concat()
    }

    fn ply_text(&self, mesh: &TriMesh) -> Vec<u8> {
        let vertex = |p: &Vec3| [p.x, p.y, p.z].map(|value| self.number(value)).join(self.blank).into_bytes();
        let face = |[a, b, c]: &[u32; 3]| format!("3 {a} {b} {c}").into_bytes();
        let lines: Vec<Vec<u8>> =
            mesh.positions.iter().map(vertex).chain(mesh.triangles.iter().map(face)).collect();
        self.ply(mesh, "ascii", &self.joined(&lines))
    }

    fn ply_binary(&self, mesh: &TriMesh) -> Vec<u8> {
        let mut body = Vec::new();
        mesh.positions.iter().flat_map(|p| p.iter()).for_each(|value| body.extend(value.to_le_bytes()));
        for triangle in &mesh.triangles {
            body.push(3);
            triangle.iter().for_each(|index| body.extend((*index as i32).to_le_bytes()));
        }
        self.ply(mesh, "binary_little_endian", &body)
    }
}

/// Any triangles over any finite positions; the first byte of binary numbers is a line feed.
fn meshes() -> impl Strategy<Value = TriMesh> {
    let value =
        prop_oneof![prop::num::f32::NORMAL | prop::num::f32::ZERO, (-9i32..9).prop_map(|value| value as f32)];
    let places = prop::collection::vec(prop::array::uniform3(value), 3..20);
    (places, prop::collection::vec(prop::array::uniform3(any::<prop::sample::Index>()), 1..12)).prop_map(
        |(mut places, corners)| {
            places[0][0] = f32::from_le_bytes([b'\n', b'\r', b'\n', 0x40]);
            let triangles = corners
                .iter()
                .map(|corners| corners.map(|corner| corner.index(places.len()) as u32))
                .collect();
            TriMesh { positions: places.into_iter().map(Vec3::from).collect(), triangles }
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(300))]

    #[test]
    fn every_variant_of_a_text_holds_the_same_mesh(style in styles(), mesh in meshes()) {
        let folder = Folder::empty();
        let binary = folder.join("a.stl");
        mesh::write(&binary, &mesh).unwrap();
        let text = style.stl(&mesh);
        let found = read("b.stl", &text);
        prop_assert_eq!(found.unwrap(), mesh::read(&binary).unwrap(), "{}", String::from_utf8_lossy(&text));
        for (name, bytes) in [
            ("a.obj", style.obj(&mesh)),
            ("a.ply", style.ply_text(&mesh)),
            ("b.ply", style.ply_binary(&mesh)),
        ] {
            let found = read(name, &bytes);
            prop_assert_eq!(found.unwrap(), mesh.clone(), "{}", String::from_utf8_lossy(&bytes));
        }
    }

    /// Numbers between separators of every kind, with points or commas.
    #[test]
    fn every_variant_of_xyz_holds_the_same_particles(
        style in styles(),
        rows in prop::collection::vec(prop::array::uniform3((-999_999i64..999_999, 0u32..4)), 1..20),
        separator in 0usize..6,
        more in any::<bool>(),
    ) {
        let decimal = |(digits, positions): (i64, u32)| {
            let ten = 10i64.pow(positions);
            let sign = if digits < 0 { "-" } else { "" };
            let (whole, part) = (digits.abs() / ten, digits.abs() % ten);
            let point = format!("{sign}{whole}.{part:0width$}", width = positions as usize);
            if positions == 0 { format!("{sign}{whole}") } else { point }
        };
        let rows: Vec<[String; 3]> = rows.iter().map(|row| row.map(decimal)).collect();
        let expected: Vec<DVec3> =
            rows.iter().map(|row| DVec3::from(row.clone().map(|text| text.parse::<f64>().unwrap()))).collect();
        for has_commas in [false, true] {
            // A comma that is a decimal one and one that separates are only told apart with a blank.
            let separator = [" ", "\t", ";", "; ", ", ", ","][if has_commas { separator % 5 } else { separator }];
            let mut lines = style.head();
            for row in &rows {
                let mut line = row.join(separator);
                if more {
                    line += &format!("{separator}255{separator}{}", if has_commas { "0.05" } else { "7" });
                }
                lines.push(if has_commas && separator == ", " {
                    let words: Vec<String> = row.iter().map(|word| word.replace('.', ",")).collect();
                    words.join(", ").into_bytes()
                } else if has_commas {
                    line.replace('.', ",").into_bytes()
                } else {
                    line.into_bytes()
                });
            }
            let text = style.joined(&lines);
            let found = positions(&text);
            prop_assert_eq!(found.unwrap(), expected.clone(), "{}", String::from_utf8_lossy(&text));
        }
    }
}

const FACET: &str =
    "facet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";

/// The sentence about a file that is refused.
#[track_caller]
fn refusal(name: &str, bytes: &[u8]) -> String {
    let error = match name {
        "a.xyz" => positions(bytes).map(drop).unwrap_err(),
        "a.vtk" => particles::parse(Path::new(name), bytes).map(drop).unwrap_err(),
        _ => polygons(name, bytes).map(drop).unwrap_err(),
    };
    let text = error.to_string();
    assert!(text.starts_with(&format!("{name}: ")) && !text.contains('\n'), "{text}");
    text
}

#[test]
fn text_stl_is_read_with_what_programs_leave_out_or_add() {
    let square = FACET.replace("endloop", "vertex 0 1 1\nendloop");
    let one_line = format!("solid a {}endsolid", FACET.replace('\n', " "));
    for (text, triangles) in [
        (format!("solid\n{FACET}endsolid"), 1),
        (format!("{FACET}{FACET}"), 2),
        (format!("solid a\n{FACET}"), 1),
        (format!("solid a\nendsolid\nsolid b\n{FACET}endsolid b\nsolid c\nendsolid"), 1),
        (FACET.replace("normal 0 0 1", ""), 1),
        (format!("solid a\n{square}endsolid"), 2),
        (one_line, 1),
    ] {
        let mesh = read("a.stl", text.as_bytes()).unwrap();
        assert_eq!(mesh.triangles.len(), triangles, "{text}");
    }
}

#[test]
fn what_is_wrong_with_text_stl_is_named_by_its_line() {
    let solid = |facet: String| format!("solid a\r\n\r\n{facet}endsolid a\n");
    for (text, words) in [
        (solid(FACET.replace("vertex 1 0 0", "vertex 1,5 0 0")), &["line 6", "\"1,5\"", "decimal comma"][..]),
        (solid(FACET.replace("vertex 1 0 0", "vertex 1 x 0")), &["line 6", "\"x\" is not a number"]),
        (solid(FACET.replace("vertex 1 0 0", "vertex 1 nan 0")), &["line 6", "\"nan\" is not a finite number"]),
        (solid(FACET.replace("vertex 1 0 0", "vertex 1 1e99 0")), &["line 6", "\"1e99\" is not a finite number"]),
        (solid(FACET.replace("vertex 1 0 0\n", "")), &["line 8", "a facet of 2 corners"]),
        (solid(FACET.replace("vertex 1 0 0", "point 1 0 0")), &["line 6", "\"point\"", "\"vertex\""]),
        (solid(FACET.replace("vertex 1 0 0", "vertex 1 0")), &["line 7", "\"vertex\" is not a number"]),
        (solid(FACET.replace("outer loop", "")), &["line 5", "\"vertex\"", "\"outer loop\""]),
        (solid(FACET.replace("endfacet", "")), &["line 10", "\"endsolid\"", "\"endfacet\""]),
        (format!("solid a\n{FACET}part b\n"), &["line 9", "\"part\"", "\"facet\""]),
        (format!("solid a\n{}", &FACET[..50]), &["ends in triangle 1"]),
        ("solid a\nendsolid a\n".into(), &["no faces"]),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n# of an .obj file, but longer than the header of a binary .stl\n".repeat(3), &["not an .stl file"]),
    ] {
        let what = refusal("a.stl", text.as_bytes());
        words.iter().for_each(|word| assert!(what.contains(word), "no {word:?} in {what}"));
    }
}

#[test]
fn decimal_commas_utf_16_and_other_kinds_of_text_are_named() {
    let wide = |text: &str| -> Vec<u8> {
        [0xfeffu16].into_iter().chain(text.encode_utf16()).flat_map(u16::to_le_bytes).collect()
    };
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    let ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    let vtk = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 1 float\n0,5 1 2\n";
    for (name, bytes, words) in [
        (
            "a.obj",
            obj.replace("v 1 0 0", "v 1,5 0 0").into_bytes(),
            &["line 2", "\"1,5\" has a decimal comma"][..],
        ),
        ("a.ply", format!("{ply}0,5 1 2\n").into_bytes(), &["vertex 1", "\"0,5\" has a decimal comma"]),
        ("a.vtk", vtk.into(), &["\"0,5\" has a decimal comma"]),
        ("a.obj", wide(obj), &["UTF-16"]),
        ("a.stl", wide(FACET), &["UTF-16"]),
        ("a.ply", wide(ply), &["UTF-16"]),
        ("a.xyz", wide("0 0 0\n1 2 3\n"), &["UTF-16"]),
        ("a.vtk", wide(vtk), &["UTF-16"]),
        ("a.vtk", vtk.replace("ASCII", "BINARY").replace('\n', "\r").into(), &["carriage returns"]),
        ("a.xyz", b"1,5,0,05,2,5\n".to_vec(), &["line 1", "\"05\"", "decimal points"]),
        ("a.xyz", b"1,234.5 2 3\n".to_vec(), &["line 1", "\"1,234.5\""]),
        ("a.xyz", b"5,000,123.5 2 3\n".to_vec(), &["line 1", "\"000\""]),
        ("a.xyz", b"1 2 3\n,5 ,25 ,125\n".to_vec(), &["line 2", "\",5\""]),
        ("a.xyz", b"1.5 2 3\n1,5 2 3\n".to_vec(), &["line 2", "decimal commas", "line 1"]),
        ("a.xyz", b"1,5 2 3\n1 2 3\n1.5 2 3\n".to_vec(), &["line 3", "decimal commas in line 1"]),
        ("a.xyz", b"1,5 2 x\n".to_vec(), &["line 1", "\"x\" is not a number"]),
    ] {
        let what = refusal(name, &bytes);
        words.iter().for_each(|word| assert!(what.contains(word), "no {word:?} in {what}"));
    }
    let cr = vtk.replace("0,5", "0.5").replace('\n', "\r");
    let cloud = particles::parse(Path::new("a.vtk"), cr.as_bytes()).unwrap();
    assert_eq!(cloud.positions, [DVec3::new(0.5, 1.0, 2.0)]);
}

/// A changed copy of a text: bytes, words and lines are others, doubled or gone.
fn mutated(bytes: &[u8], seed: u64) -> Vec<u8> {
    let mut state = seed;
    let mut below = |end: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) as usize) % end.max(1)
    };
    let words: [&[u8]; 14] = [
        b"\r",
        b"\n",
        b"\\\n",
        b"#",
        b" ",
        b"\0",
        b"nan",
        b"-1",
        b"99999999999",
        b"solid",
        b"endloop",
        b",",
        b"1e999",
        b"\xff",
    ];
    let mut out = bytes.to_vec();
    for _ in 0..1 + below(4) {
        let at = below(out.len());
        let end = (at + 1 + below(30)).min(out.len());
        match below(5) {
            0 if at < out.len() => out[at] = below(256) as u8,
            1 => drop(out.drain(at..end)),
            2 => {
                let again = out[at..end].to_vec();
                drop(out.splice(at..at, again));
            }
            3 => out.truncate(at),
            _ => drop(out.splice(at..at, words[below(words.len())].iter().copied())),
        }
    }
    out
}

/// As many as `FRAZIL_FUZZ` says, and all cuts: 10,000 of each were tried when this was made.
#[test]
fn damaged_texts_are_a_mesh_or_a_sentence() {
    let count = std::env::var("FRAZIL_FUZZ").ok().and_then(|text| text.parse().ok()).unwrap_or(200);
    let mesh = TriMesh::cuboid([0.25, -1.5, 0.0], [1.0, 2.0, 3.0e-7]);
    let style = Style {
        ends: ["\r\n", "\r"],
        blank: "\t",
        letters: 1,
        number: 2,
        head: 3,
        name: 1,
        solids: 2,
        has_end: true,
    };
    let xyz = "1,5 2 3\n# a\r-0,25, 1e3, 7\n";
    let samples = [
        ("a.stl", style.stl(&mesh)),
        ("a.obj", style.obj(&mesh)),
        ("a.ply", style.ply_text(&mesh)),
        ("b.ply", Style { ends: ["\r"; 2], ..style }.ply_binary(&mesh)),
        ("a.xyz", xyz.into()),
    ];
    for (name, bytes) in samples {
        let cuts = (0..bytes.len()).map(|length| (length as u64, bytes[..length].to_vec()));
        let changed = (0..count).map(|seed| (seed, mutated(&bytes, seed)));
        for (seed, bytes) in cuts.chain(changed) {
            let start = Instant::now();
            let outcome = match name {
                "a.xyz" => positions(&bytes).map(drop),
                _ => read(name, &bytes).map(|mesh| mesh.validate().unwrap()),
            };
            if let Err(error) = outcome {
                let text = error.to_string();
                assert!(text.starts_with(&format!("{name}: ")) && !text.contains('\n'), "{seed}: {text}");
                // As a panic is reported.
                assert!(!text.contains("it contradicts itself"), "{name} {seed}: {text}");
            }
            assert!(start.elapsed() < Duration::from_secs(2), "{name} {seed}");
        }
    }
}

/// Meshes and particles of a file of many solids are those of as many files.
#[test]
fn a_solid_that_is_alone_is_the_same_as_among_others() {
    let cubes = [0.0f32, 3.0, 7.0].map(|x| TriMesh::cuboid([x, 0.0, 0.0], [x + 1.0, 1.0, 1.0 + x]));
    let style = Style {
        ends: ["\n"; 2],
        blank: " ",
        letters: 0,
        number: 0,
        head: 9,
        name: 2,
        solids: 1,
        has_end: true,
    };
    let text: Vec<u8> = cubes.iter().flat_map(|cube| style.stl(cube)).collect();
    let all = read("a.stl", &text).unwrap();
    assert_eq!((all.triangles.len(), all.positions.len()), (36, 24));
    assert!(all.is_manifold() && (all.volume() - 1.0 - 4.0 - 8.0).abs() < 1e-6, "{}", all.volume());
}
