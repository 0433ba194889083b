//! Damaged and outside particle caches: one sentence for each that is refused, no panic, no memory for data that a file does not hold.

use crate::common::skip::skipped;
use std::time::{Duration, Instant};

use frazil::geometry::DVec3;
use frazil::geometry::points::Values;
use frazil::io::particles::{self, ParticleData};

use super::particles::parse;
use crate::common::caches::{Vtu, bgeo, samples, vtk, zipped};
use crate::common::character;

/// Whatever is read is whole, and whatever is not is a sentence about the file; nothing panics on the way.
#[track_caller]
fn is_whole_or_refused(name: &str, bytes: &[u8], what: &str) -> Option<ParticleData> {
    let start = Instant::now();
    let cloud = match parse(name, bytes) {
        Ok(cloud) => {
            assert!(
                cloud.positions.iter().all(|position| position.iter().all(|part| part.is_finite())),
                "{name} {what}"
            );
            for attribute in &cloud.attributes {
                let stored = match &attribute.values {
                    Values::Float(column) => column.stored().len(),
                    Values::Int(column) => column.stored().len(),
                    Values::Long(column) => column.stored().len(),
                    Values::Bool(column) => column.stored().len(),
                    Values::Vector(column) => column.stored().len(),
                };
                assert!(stored == cloud.positions.len() || attribute.values.is_uniform(), "{name} {what}");
            }
            Some(cloud)
        }
        Err(error) => {
            let text = error.to_string();
            assert!(text.starts_with(&format!("{name}: ")) && !text.contains('\n'), "{name} {what}: {text}");
            // As a panic is reported.
            assert!(!text.contains("it contradicts itself"), "{name} {what}: {text}");
            None
        }
    };
    assert!(start.elapsed() < Duration::from_secs(5), "{name} {what}: {:?}", start.elapsed());
    cloud
}

#[test]
fn cut_files_are_refused_or_lack_whole_arrays_only() {
    for (name, bytes) in samples() {
        let whole = is_whole_or_refused(name, &bytes, "whole").unwrap();
        for length in 0..bytes.len() {
            let what = format!("cut at {length} of {}", bytes.len());
            let Some(cut) = is_whole_or_refused(name, &bytes[..length], &what) else { continue };
            // Behind the points of plain .bgeo, and between the arrays of .vtk, nothing says that more was there; .xyz has no count.
            match name {
                "a.bgeo" => assert!(cut == whole && length >= bytes.len() - 2, "{name} {what}"),
                // The last number of a text may have lost digits.
                "a.vtk" => assert!(cut.positions.len() == whole.positions.len(), "{name} {what}"),
                "b.vtk" => {
                    let is_there = |attribute| whole.attributes.contains(attribute);
                    let are_there = cut.attributes.iter().all(is_there);
                    assert!(cut.positions == whole.positions && are_there, "{name} {what}");
                }
                "a.xyz" => assert!(cut.positions.len() <= whole.positions.len(), "{name} {what}"),
                "b.xyz" => assert!(length == 12, "{name} {what}"),
                _ => panic!("{name} {what} was accepted"),
            }
        }
    }
}

/// A changed copy of a file: a few bytes or digits are others, or gone.
fn mutated(bytes: &[u8], seed: u64) -> Vec<u8> {
    let mut state = seed;
    let mut below = |end: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((state >> 33) as usize) % end.max(1)
    };
    let mut out = bytes.to_vec();
    for _ in 0..1 + below(5) {
        let at = below(out.len());
        match below(6) {
            0 => out[at] ^= 1 << below(8),
            1 => out[at] = below(256) as u8,
            2 => {
                let value = [0u32, 1, 0x7fff_ffff, 0x8000_0000, u32::MAX, 0x1000_0000][below(6)];
                let end = (at + 4).min(out.len());
                out[at..end].copy_from_slice(&value.to_be_bytes()[..end - at]);
            }
            3 => {
                let end = (at + 1 + below(16)).min(out.len());
                out.drain(at..end);
            }
            4 => {
                // The next number that is written out becomes an odd one.
                let odd: &[u8] =
                    [&b"-1"[..], b"0", b"4294967297", b"18446744073709551615", b"nan", b"1e999", b"x"]
                        [below(7)];
                let start = out[at..].iter().position(u8::is_ascii_digit).map_or(at, |digit| at + digit);
                let length = out[start..].iter().take_while(|byte| byte.is_ascii_digit()).count();
                out.splice(start..start + length, odd.iter().copied());
            }
            _ => {
                let end = (at + 1 + below(40)).min(out.len());
                let again = out[at..end].to_vec();
                out.splice(at..at, again);
            }
        }
        if out.is_empty() {
            break;
        }
    }
    out
}

/// As many of each kind as `FRAZIL_FUZZ` says: 10,000 were tried when this was made.
#[test]
fn flipped_files_are_whole_or_a_sentence() {
    let count = std::env::var("FRAZIL_FUZZ").ok().and_then(|text| text.parse().ok()).unwrap_or(200);
    for (name, bytes) in samples() {
        let read = (0..count).filter(|&seed| {
            let damaged = mutated(&bytes, seed);
            is_whole_or_refused(name, &damaged, &format!("with seed {seed}")).is_some()
        });
        println!("{name}: {} of {count} were read", read.count());
    }
}

#[test]
fn a_count_alone_takes_no_memory() {
    let mut many = bgeo();
    many[9..13].copy_from_slice(&0x7fff_ffffu32.to_be_bytes());
    let vtk = |points: &str, encoding: &str| {
        format!(
            "# vtk DataFile Version 3.0\nx\n{encoding}\nDATASET POLYDATA\nPOINTS {points} double\n1 2 3\n"
        )
        .into_bytes()
    };
    let huge = ["999999999999", "18446744073709551615", "6148914691236517206"];
    let mut files = vec![("a.bgeo", many.clone()), ("z.bgeo", zipped(&many))];
    for points in huge {
        files.extend([("a.vtk", vtk(points, "ASCII")), ("b.vtk", vtk(points, "BINARY"))]);
        let vtu = Vtu { format: "binary", encoding: "", blocks: Some(16), long: true, big: false, pieces: 1 };
        let text = String::from_utf8(vtu.file()).unwrap();
        files.push((
            "a.vtu",
            text.replace("NumberOfPoints=\"4\"", &format!("NumberOfPoints=\"{points}\"")).into_bytes(),
        ));
    }
    // A hundred million zeros in a hundred thousand bytes are not the particles that the head promises.
    let zeros = [bgeo(), vec![0; 100_000_000]].concat();
    let bomb = zipped(&[&many[..many.len()], &zeros].concat());
    files.push(("bomb.bgeo", bomb));
    for (name, bytes) in files {
        let start = Instant::now();
        let error = parse(name, &bytes).unwrap_err().to_string();
        assert!(error.starts_with(name), "{error}");
        assert!(start.elapsed() < Duration::from_secs(2), "{error}: {:?}", start.elapsed());
    }
    // Elements in one another, which a parser that calls itself would pay with its stack.
    let deep = "<a>".repeat(1_000_000);
    assert!(parse("deep.vtu", deep.as_bytes()).is_err());
}

#[test]
fn a_position_that_is_not_finite_is_named() {
    let vtk = vtk(false, "3.0", "POLYDATA");
    let text =
        String::from_utf8(vtk).unwrap().replacen("POINTS 4 float\n0.1 -2.5", "POINTS 4 float\n0.1 nan", 1);
    let mut bgeo = bgeo();
    let last = bgeo.windows(4).rposition(|four| four == 0.25f32.to_be_bytes()).unwrap();
    bgeo[last..last + 4].copy_from_slice(&f32::INFINITY.to_be_bytes());
    let cases = [
        ("a.vtk", text.into_bytes(), 1),
        ("a.bgeo", bgeo, 4),
        ("a.xyz", b"1 2 3\n1 2 inf\n".to_vec(), 2),
        ("b.xyz", [0.0f32, 1.0, 2.0, f32::NAN, 0.0, 0.0].iter().flat_map(|part| part.to_le_bytes()).collect(), 2),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n1 nan 3\n".to_vec(), 2),
    ];
    for (name, bytes, particle) in cases {
        let error = parse(name, &bytes).unwrap_err().to_string();
        assert_eq!(error, format!("{name}: the position of particle {particle} is not finite"));
    }
}

/// Particles of a file of the outside data.
fn outside(name: &str) -> Option<ParticleData> {
    let path = character::data(&format!("particles/{name}"));
    if path.is_none() {
        skipped(&format!("no particles/{name}"));
    }
    path.map(|path| particles::read(&path).unwrap())
}

/// A file of another program with its count, first and last position, and attributes, as meshio (.vtk, .vtu) and Python's struct
/// (.bgeo) read them.
type Known = (&'static str, usize, [[f64; 3]; 2], &'static [&'static str]);
const KNOWN: [Known; 9] = [
    (
        "bunny_frame_14_7705_particles.vtk",
        7706,
        [
            [0.12854121625423431, 0.8383985757827759, 0.11624263226985931],
            [-0.19719751179218292, 1.998595952987671, -0.167732834815979],
        ],
        &["id", "velocity"],
    ),
    (
        "double_dam_break_frame_01_4732_particles.vtk",
        4732,
        [
            [0.8500000238418579, 0.09999018907546997, 0.8500000238418579],
            [-0.8500000238418579, 0.04999019205570221, -0.8500000238418579],
        ],
        &["id", "velocity"],
    ),
    (
        "double_dam_break_frame_26_4732_particles.vtk",
        4732,
        [
            [0.002692208159714937, 0.2675342559814453, 0.03149385750293732],
            [0.03384226933121681, 0.2771833837032318, 0.07713911682367325],
        ],
        &["id", "velocity"],
    ),
    ("fluid_250_particles.vtu", 250, FLUID, &["velocity", "pressure", "density", "index"]),
    ("fluid_encoded_250_particles.vtu", 250, FLUID, &["velocity", "pressure", "density", "index"]),
    (
        "dam_break_frame_23_24389_particles.bgeo",
        24_389,
        [
            [0.4560402035713196, 0.13293562829494476, 0.16532506048679352],
            [0.3806244134902954, 0.04838905856013298, 0.06240019202232361],
        ],
        &[],
    ),
    (
        "dam_break_frame_9_6859_particles.bgeo",
        6859,
        [
            [-1.910224199295044, 0.05864475294947624, 0.15789386630058289],
            [-1.0363256931304932, 0.5212406516075134, 0.05060062184929848],
        ],
        &["id", "density", "velocity"],
    ),
    (
        "dambreak/dambreak.0031.bgeo",
        24_389,
        [
            [-1.8154382705688477, 0.07422363758087158, 0.1110600158572197],
            [1.2196441888809204, 0.04075149446725845, 0.04679609462618828],
        ],
        &["id", "velocity"],
    ),
    (
        "spot_drop/spot.0041.bgeo",
        20_036,
        [
            [0.10522621870040894, 0.12855742871761322, 0.03149886429309845],
            [0.01057090237736702, 0.22671140730381012, -0.2533705234527588],
        ],
        &["id", "velocity"],
    ),
];
const FLUID: [[f64; 3]; 2] = [
    [0.3286479863716946, 0.21009526877553064, 0.2049105240508048],
    [4.526842968782311, 0.7943321669635605, 0.8754105636240367],
];

#[test]
fn files_of_other_programs_have_the_particles_that_other_readers_find() {
    for (name, count, ends, attributes) in KNOWN {
        let Some(cloud) = outside(name) else { return };
        assert_eq!(cloud.positions.len(), count, "{name}");
        assert_eq!([cloud.positions[0], cloud.positions[count - 1]], ends.map(DVec3::from), "{name}");
        let names: Vec<&str> = cloud.attributes.iter().map(|attribute| &attribute.name[..]).collect();
        assert_eq!(names, attributes, "{name}");
        if let Some(Values::Long(ids)) = cloud.attribute("id").or(cloud.attribute("index")) {
            let mut ids = ids.stored().to_vec();
            ids.sort_unstable();
            ids.dedup();
            assert_eq!(ids.len(), count, "{name}: particles share identities");
        }
    }
    // Two encodings of one frame.
    let [a, b] =
        ["fluid_250_particles.vtu", "fluid_encoded_250_particles.vtu"].map(|name| outside(name).unwrap());
    assert_eq!(a, b);
}
