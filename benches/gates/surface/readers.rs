//! Gates of particle caches: other programs find the same particles in them, and damaged ones do no harm.

use std::path::{Path, PathBuf};

use frazil::geometry::DVec3;
use frazil::geometry::points::{Column, Points, Values};
use frazil::io::mesh::extension;
use frazil::io::particles::{self, ParticleData};
use frazil::vdb::file::{Compression, WriteOptions};
use frazil::vdb::points::to_bytes;
use frazil::vdb::reading::guard::Guard;
use rayon::prelude::*;

use crate::common::caches::{IDS, POSITIONS, VELOCITIES, samples};
use crate::common::{character, clients};
use crate::harness::Harness;
use crate::process::{frazil, works};
use crate::reliability::damage;
use crate::scenes::context;

const SAME: &str = "surface.readers_same";
/// Files of other programs, below `particles` of the outside data.
const OUTSIDE: [&str; 9] = [
    "bunny_frame_14_7705_particles.vtk",
    "double_dam_break_frame_01_4732_particles.vtk",
    "double_dam_break_frame_26_4732_particles.vtk",
    "fluid_250_particles.vtu",
    "fluid_encoded_250_particles.vtu",
    "dam_break_frame_23_24389_particles.bgeo",
    "dam_break_frame_9_6859_particles.bgeo",
    "dambreak/dambreak.0031.bgeo",
    "spot_drop/spot.0041.bgeo",
];
/// Those that `frazil convert` writes as each of these; and the voxels of .vdb (m).
const CONVERTED: [&str; 2] = [OUTSIDE[0], OUTSIDE[8]];
const WRITTEN: [&str; 4] = ["vdb", "bgeo", "ply", "xyz"];
const VOXEL: &str = "0.01";
/// Bytes of a particle in what the other programs write: its identity, and x, y and z.
const RECORD: usize = 32;
/// How far positions of .vdb files may be apart (m), each a sum and a product in 64 bits; those of the others are the same bits.
const ROUNDING: f64 = 1.0e-12;

/// What the kinds of damaged particles begin with, before the file's extension.
pub const KIND: &str = "particles.";
/// Extensions of damaged files, and how many are tried of each.
const KINDS: [&str; 6] = ["bgeo", "vtk", "vtu", "ply", "xyz", "vdb"];
const INPUTS: usize = 10_000;

pub fn run(h: &mut Harness) {
    if h.wants(SAME) {
        same(h);
    }
    h.measure("surface.readers_crashes", crashes);
}

/// A particle: identity and position (m).
type Particle = (i64, DVec3);

fn same(h: &mut Harness) {
    let Some(python) = clients::particles_python() else {
        return h.skipped(SAME, "pysplashsurf and meshio are not installed: make test-clients");
    };
    let program = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/ctest/particle_reader");
    if !program.is_file() {
        return h.skipped(SAME, "tests/ctest is not built: make gates does it");
    }
    let find = |name: &str| character::data(&format!("particles/{name}"));
    let Some(mut files) = OUTSIDE.into_iter().map(find).collect::<Option<Vec<PathBuf>>>() else {
        return h.skipped(SAME, "no data");
    };
    let folder = tempfile::tempdir().expect("a folder");
    for (n, name) in CONVERTED.into_iter().enumerate() {
        let input = find(name).expect("it was there");
        files.extend(WRITTEN.map(|ending| converted(&input, folder.path().join(format!("{n}.{ending}")))));
    }
    let (mut count, mut wrong) = (0, Vec::new());
    for file in &files {
        let records = folder.path().join("records");
        let said = match extension(file).as_str() {
            "vdb" => clients::reads_vdb_particles(&program, file, &records),
            _ => clients::reads_particles(&python, file, &records),
        };
        let (ours, theirs) = (ours(file), recorded(&records));
        count += ours.len();
        if said.is_err() || !are_same(file, &ours, &theirs) {
            let name = file.file_name().unwrap_or_default().to_string_lossy();
            let said = said.unwrap_or_else(|error| error);
            let last = said.trim().lines().last().unwrap_or_default();
            wrong.push(format!("{name}: {} against {} particles, {last}", ours.len(), theirs.len()));
        }
        let _ = std::fs::remove_file(records);
    }
    let note = format!("{} files, {count} particles {}", files.len(), wrong.join("; "));
    h.holds(SAME, wrong.is_empty(), note.trim());
}

/// A file of particles as another that the command writes.
fn converted(input: &Path, output: PathBuf) -> PathBuf {
    let mut command = frazil(["convert", "-q"]);
    command.arg(input).arg(&output);
    if extension(&output) == "vdb" {
        command.args(["--voxel", VOXEL]);
    }
    works(&mut command);
    output
}

/// The particles of a file as the library reads them: in the file's order, those of a .vdb in that of their identities.
fn ours(path: &Path) -> Vec<Particle> {
    if extension(path) == "vdb" {
        let points = damage::decoder(u64::MAX).read_points(path, None).expect("points");
        let mut particles = numbered(&ParticleData::from(points));
        particles.sort_unstable_by_key(|particle| particle.0);
        return particles;
    }
    numbered(&particles::read(path).expect("particles"))
}

/// Particles with what numbers them; with their index where nothing does.
fn numbered(cloud: &ParticleData) -> Vec<Particle> {
    let ids = cloud.attribute("id").or(cloud.attribute("index"));
    let id = |n: usize| ids.map_or(n as i64, |ids| ids.number(n) as i64);
    cloud.positions.iter().enumerate().map(|(n, position)| (id(n), *position)).collect()
}

/// The particles that another program wrote down; none without a file.
fn recorded(path: &Path) -> Vec<Particle> {
    let word =
        |bytes: &[u8], at: usize| -> [u8; 8] { bytes[8 * at..8 * at + 8].try_into().expect("8 bytes") };
    let one = |record: &[u8]| {
        let position = [1, 2, 3].map(|at| f64::from_le_bytes(word(record, at)));
        (i64::from_le_bytes(word(record, 0)), DVec3::from(position))
    };
    std::fs::read(path).unwrap_or_default().chunks_exact(RECORD).map(one).collect()
}

fn are_same(path: &Path, ours: &[Particle], theirs: &[Particle]) -> bool {
    let most = if extension(path) == "vdb" { ROUNDING } else { 0.0 };
    let is_same = |(a, b): (&Particle, &Particle)| a.0 == b.0 && (a.1 - b.1).amax() <= most;
    !ours.is_empty() && ours.len() == theirs.len() && ours.iter().zip(theirs).all(is_same)
}

fn crashes() -> (f64, String) {
    let (mut accepted, mut failed) = (Vec::new(), Vec::new());
    let one = |ending: &&'static str| {
        let tried = damage::tried(&format!("{KIND}{ending}"), INPUTS);
        println!(
            "# .{ending}: {INPUTS} damaged files, {} accepted, {} failed",
            tried.accepted,
            tried.failed.len()
        );
        (*ending, tried)
    };
    let all: Vec<_> = KINDS.par_iter().map(one).collect();
    for (ending, tried) in all {
        accepted.push(format!(".{ending} {}", tried.accepted));
        failed.extend(tried.failed.iter().map(|which| format!(".{ending} {which}")));
    }
    let note = format!("{INPUTS} inputs of each, accepted: {} {}", accepted.join(", "), failed.join(", "));
    (failed.len() as f64, note)
}

/// Small intact files with an extension.
pub fn intact(ending: &str, folder: &Path) -> Vec<Vec<u8>> {
    let of_kind = |name: &str| name.rsplit('.').next() == Some(ending);
    let mut files: Vec<Vec<u8>> =
        samples().into_iter().filter(|(name, _)| of_kind(name)).map(|(_, bytes)| bytes).collect();
    match ending {
        "ply" => {
            let path = folder.join("intact.ply");
            particles::write(&path, &four(), true).expect("a file");
            files.push(std::fs::read(path).expect("its bytes"));
            let text = "ply\nformat ascii 1.0\nelement vertex 2\nproperty double x\nproperty float y\nproperty float z\n\
                        property int id\nproperty list uchar int near\nend_header\n0 0 0 7 1 1\n1 0.5 -2 9 2 0 1\n";
            files.push(text.into());
        }
        "vdb" => {
            for compression in [Compression::None, Compression::Zip, Compression::Blosc] {
                let options = WriteOptions { compression, ..WriteOptions::default() };
                files.push(to_bytes(&context(1), "grains", &four(), &options).expect("bytes"));
            }
        }
        "vtu" => {
            let name = format!("particles/{}", OUTSIDE[3]);
            files.extend(character::data(&name).and_then(|path| std::fs::read(path).ok()));
        }
        _ => {}
    }
    files
}

/// The particles of the made caches, as points.
fn four() -> Points {
    let positions = POSITIONS.map(|position| DVec3::from(position.map(f64::from)));
    let mut out = Points::at(0.5, &positions).expect("points");
    out.set("id", Values::Long(Column::Each(IDS.map(i64::from).to_vec())));
    out.set("velocity", Values::Vector(Column::Each(VELOCITIES.to_vec())));
    out.set("pscale", Values::Float(Column::Uniform(0.1)));
    out
}

/// Whether a damaged file is read.
///
/// # Panics
/// When a reader panicked and was caught.
pub fn is_read(path: &Path, guard: &Guard) -> bool {
    if extension(path) == "vdb" {
        return guard.read_points(path, None).is_ok();
    }
    match particles::read(path) {
        Ok(cloud) => cloud.into_points(Some(1.0)).is_ok(),
        Err(error) => {
            let text = error.to_string();
            assert!(!text.contains("it contradicts itself"), "{text}");
            false
        }
    }
}
