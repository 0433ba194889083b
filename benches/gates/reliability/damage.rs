//! Gates of damaged files: mutated ones, cut ones, and what the process costs that decodes foreign .vdb files.

use std::path::{Path, PathBuf};
use std::process::Stdio;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use frazil::io::mesh;
use frazil::motion::{Character, Motion, Play};
use frazil::vdb::file::{Compression, WriteOptions, to_bytes};
use frazil::vdb::reading::guard::Guard;
use frazil::vdb::{MetaValue, file, level_set};

use crate::common::{character, hero, shapes};
use crate::harness::{Harness, median, timed};
use crate::process::own;
use crate::scenes::{self, context};
use crate::surface::readers;

/// Inputs that are tried of each kind in this process, and of .vdb files.
const INPUTS: usize = 10_000;
const VDB_INPUTS: usize = 2_000;
/// Inputs that one process tries.
const BATCH: usize = 500;
/// Positions where each file is cut.
const CUTS: usize = 2_000;
/// Limits of an input: seconds, bytes.
const LONGEST: Duration = Duration::from_secs(10);
const MOST_MEMORY: u64 = 1 << 30;
/// The kinds whose readers run in this process.
const KINDS: [&str; 5] = ["obj", "ply", "stl", "gltf", "glb"];

/// All of them.
pub fn run(h: &mut Harness) {
    for kind in KINDS.into_iter().chain(["vdb"]) {
        let name = format!("reliability.fuzz_{kind}");
        if h.wants(&name) {
            fuzz(h, &name, kind);
        }
    }
    h.measure("reliability.cut", cut);
    h.measure("reliability.child_cost", child_cost);
}

/// Numbers that look random and are always the same (xorshift).
struct Dice(u64);

impl Dice {
    fn new(seed: usize) -> Self {
        Self((seed as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as usize % end.max(1)
    }
}

/// A changed copy of a file.
fn mutated(bytes: &[u8], dice: &mut Dice) -> Vec<u8> {
    let words: Vec<&str> =
        "0 -1 1 2 255 65536 2147483648 4294967295 18446744073709551615 1e999 nan -0.0 \"\" null"
            .split(' ')
            .collect();
    let mut out = bytes.to_vec();
    for _ in 0..1 + dice.below(6) {
        let length = out.len();
        // Headers are small and hold what the rest hangs on.
        let at = if dice.below(3) == 0 { dice.below(length.min(600)) } else { dice.below(length) };
        match dice.below(8) {
            0 | 1 if length > 0 => out[at] ^= 1 << dice.below(8),
            2 if length > 0 => out[at] = dice.below(256) as u8,
            3 => {
                let value = [0u32, 1, 0x7fff_ffff, 0x8000_0000, u32::MAX, 0x1000_0000][dice.below(6)];
                let end = (at + 4).min(length);
                out[at..end].copy_from_slice(&value.to_le_bytes()[..end - at]);
            }
            4 => {
                // The number in a text that is nearest.
                let is_digit = |byte: &u8| byte.is_ascii_digit();
                let Some(begin) = out[at..].iter().position(is_digit).map(|step| at + step) else { continue };
                let end =
                    out[begin..].iter().position(|byte| !is_digit(byte)).map_or(length, |step| begin + step);
                out.splice(begin..end, words[dice.below(words.len())].bytes());
            }
            5 => {
                let end = (at + 1 + dice.below(64)).min(length);
                out.drain(at..end);
            }
            6 => {
                let end = (at + 1 + dice.below(64)).min(length);
                let piece = out[at..end].to_vec();
                let to = dice.below(length);
                out.splice(to..to, piece);
            }
            _ if dice.below(4) == 0 => out.truncate(at),
            _ => {}
        }
    }
    out
}

/// Intact files of a kind: made by code, and the small ones from outside.
fn intact(kind: &str, folder: &Path) -> Vec<Vec<u8>> {
    if let Some(ending) = kind.strip_prefix(readers::KIND) {
        return readers::intact(ending, folder);
    }
    let written = |mesh: &frazil::geometry::TriMesh| {
        let path = folder.join(format!("intact.{kind}"));
        mesh::write(&path, mesh).expect("a mesh");
        std::fs::read(path).expect("its bytes")
    };
    let mut files: Vec<Vec<u8>> = match kind {
        "obj" => {
            let text = "mtllib a.mtl\no body\nv 0 0 0\nv 1 0 0 # right\nv 1 1 0\nv 0 1 0\nvt 0 0\nvn 0 0 1\nusemtl b\n\
                        f 1/1/1 2/1/1 3/1/1 4/1/1\nf -4//1 -3//1 -2//1\nl 1 2\n";
            vec![written(&shapes::sphere(1.0, 4)), text.into()]
        }
        "ply" => {
            let text = "ply\nformat ascii 1.0\ncomment a\nelement vertex 4\nproperty float x\nproperty double y\n\
                        property float z\nproperty uchar red\nelement face 2\nproperty list uchar int vertex_indices\n\
                        element edge 1\nproperty int a\nend_header\n0 0 0 1\n1 0 0 2\n1 1 0 3\n0 1 0 4\n4 0 1 2 3\n\
                        3 0 1 2\n7\n";
            let strips = "ply\nformat binary_big_endian 1.0\nelement vertex 3\nproperty float x\nproperty float y\n\
                          property float z\nelement tristrips 1\nproperty list int int vertex_indices\nend_header\n";
            let positions =
                [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].into_iter().flat_map(f32::to_be_bytes);
            let strip = [4, 0, 1, 2, -1].into_iter().flat_map(i32::to_be_bytes);
            let strips = strips.bytes().chain(positions).chain(strip).collect();
            vec![written(&shapes::sphere(1.0, 4)), text.into(), strips]
        }
        "stl" => {
            let text = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\n\
                        endfacet\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 1\nendloop\n\
                        endfacet\nendsolid a\n";
            vec![written(&shapes::sphere(1.0, 4)), text.into()]
        }
        "glb" => vec![hero::glb()],
        "gltf" => {
            let (text, buffer) = gltf_of(&hero::glb());
            std::fs::write(folder.join("hero.bin"), buffer).expect("a buffer");
            vec![text]
        }
        _ => vdb_files(),
    };
    let outside: &[&str] = match kind {
        "glb" => &["character/CesiumMan.glb"],
        "gltf" => &["character/SimpleSkin.gltf"],
        "obj" => &["mesh/cow.obj"],
        _ => &[],
    };
    files.extend(outside.iter().filter_map(|name| std::fs::read(character::data(name)?).ok()));
    files
}

/// A .glb file as text and the file beside it.
fn gltf_of(glb: &[u8]) -> (Vec<u8>, Vec<u8>) {
    let length = |at: usize| u32::from_le_bytes(glb[at..at + 4].try_into().expect("four bytes")) as usize;
    let json = &glb[20..20 + length(12)];
    let buffer = glb[20 + length(12) + 8..].to_vec();
    let mut root: serde_json::Value = serde_json::from_slice(json).expect("JSON");
    root["buffers"][0]["uri"] = "hero.bin".into();
    (root.to_string().into_bytes(), buffer)
}

/// Small files of each codec, in half and in full, with values of several kinds and more than one grid.
fn vdb_files() -> Vec<Vec<u8>> {
    let ctx = context(1);
    let mut ball = level_set::from_mesh(&ctx, &shapes::sphere(0.2, 12), 0.02, 3.0).expect("a ball");
    ball.set_name("ball").expect("a name");
    ball.set_metadata("who", MetaValue::Text("nobody".into())).expect("metadata");
    let mut other = ball.deep_copy().expect("a copy");
    other.set_name("other").expect("a name");
    let mut files = Vec::new();
    for compression in [Compression::None, Compression::Zip, Compression::Blosc] {
        for half in [false, true] {
            let options = WriteOptions { compression, half, metadata: vec![("a".into(), MetaValue::Int(1))] };
            files.push(to_bytes(&[&ball, &other], &options).expect("bytes"));
            files.push(to_bytes(&[&ball], &options).expect("bytes"));
        }
    }
    // One without offsets.
    let mut stream = files[0].clone();
    stream[20] = 0;
    files.push(stream);
    files
}

fn read(kind: &str, path: &Path, guard: &Guard) -> bool {
    match kind {
        _ if kind.starts_with(readers::KIND) => readers::is_read(path, guard),
        "vdb" => guard.read(path).is_ok(),
        "gltf" | "glb" => {
            let described = Character::describe(path).and_then(|_| Character::extras(path)).is_ok();
            let posed = Character::at_rest(path).is_ok();
            let play = Play { clip: Some("walk".into()), ..Play::default() };
            let moved = Character::open(path, play).and_then(|it| it.pose(0.3, &mut Vec::new()));
            described && posed && moved.is_ok()
        }
        _ => mesh::read(path).is_ok(),
    }
}

/// Lets the command decode .vdb files, with so much memory (bytes).
pub fn decoder(memory: u64) -> Guard {
    Guard { program: env!("CARGO_BIN_EXE_frazil").into(), memory, threads: 2, cancel: Arc::default() }
}

/// The run that reads mutated files - their kind, the first and the last one are its next arguments -, and prints how many were accepted; the run ends when one takes too long or too much memory.
pub fn read_mutated() {
    let arguments: Vec<String> = std::env::args().skip(2).collect();
    let [kind, first, last] = arguments.as_slice() else { return };
    let (first, last): (usize, usize) = (first.parse().expect("a number"), last.parse().expect("a number"));
    let folder = std::env::temp_dir().join(format!("frazil-mutated-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let files = intact(kind, &folder);
    let guard = decoder(MOST_MEMORY);
    let path = folder.join(format!("mutated.{kind}"));
    let at = Arc::new(AtomicUsize::new(first));
    let seen = at.clone();
    // An input that never ends must not hold up the rest.
    std::thread::spawn(move || {
        let (mut last, mut since) = (0, Instant::now());
        loop {
            std::thread::sleep(Duration::from_millis(50));
            let now = seen.load(Ordering::Relaxed);
            if now != last {
                (last, since) = (now, Instant::now());
            }
            if since.elapsed() > LONGEST
                || frazil::context::peak_memory().is_some_and(|peak| peak > MOST_MEMORY)
            {
                std::process::exit(3);
            }
        }
    });
    let mut accepted = 0;
    for index in first..last {
        at.store(index, Ordering::Relaxed);
        let mut dice = Dice::new(index);
        let bytes = mutated(&files[index % files.len()], &mut dice);
        std::fs::write(&path, &bytes).expect("a file");
        // The parent knows from this which one it was.
        std::fs::write(folder.with_extension("at"), index.to_string()).expect("a file");
        accepted += usize::from(read(kind, &path, &guard));
    }
    let _ = std::fs::remove_dir_all(&folder);
    let _ = std::fs::remove_file(folder.with_extension("at"));
    println!("{accepted}");
}

fn fuzz(h: &mut Harness, name: &str, kind: &str) {
    let count = if kind == "vdb" { VDB_INPUTS } else { INPUTS };
    let Tried { accepted, failed } = tried(kind, count);
    let note = format!("{count} inputs, {accepted} accepted {}", failed.join(", "));
    h.gate(name, failed.len() as f64, &note);
}

/// What became of mutated files: how many were read, and which ended the process that read them.
pub struct Tried {
    pub accepted: usize,
    pub failed: Vec<String>,
}

/// Lets other processes read so many mutated files of a kind.
pub fn tried(kind: &str, count: usize) -> Tried {
    let (mut accepted, mut failed) = (0, Vec::new());
    let mut first = 0;
    while first < count {
        let last = (first + BATCH).min(count);
        let child = own("read-mutated")
            .args([kind, &first.to_string(), &last.to_string()])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("this program starts");
        let own = std::env::temp_dir().join(format!("frazil-mutated-{}", child.id()));
        let output = child.wait_with_output().expect("this program ends");
        first = last;
        if output.status.success() {
            accepted += String::from_utf8_lossy(&output.stdout).trim().parse::<usize>().unwrap_or(0);
        } else {
            // On with the one after it.
            let at = std::fs::read_to_string(own.with_extension("at"))
                .ok()
                .and_then(|at| at.parse::<usize>().ok());
            failed.push(format!("{} ({})", at.map_or("?".into(), |at| at.to_string()), output.status));
            first = at.map_or(last, |at| at + 1);
            let _ = std::fs::remove_file(own.with_extension("at"));
        }
    }
    Tried { accepted, failed }
}

/// The files whose formats say how long they are.
fn sized(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let mut out = Vec::new();
    for kind in ["ply", "stl", "glb"] {
        out.push((kind.to_string(), intact(kind, folder).swap_remove(0)));
    }
    let ctx = context(2);
    let layer = scenes::snow(&ctx, 0.5, 0.01, scenes::EXACT);
    for compression in [Compression::None, Compression::Zip, Compression::Blosc] {
        let options = WriteOptions { compression, ..WriteOptions::default() };
        out.push(("vdb".into(), to_bytes(&[layer.surface(), layer.removed()], &options).expect("bytes")));
    }
    let names = [
        "character/CesiumMan.glb",
        "character/RobotExpressive.glb",
        "mesh/igea.ply",
        "vdb/smoke.vdb",
        "vdb/sphere.vdb",
    ];
    for name in names {
        let Some(path) = character::data(name) else { continue };
        let kind = path.extension().unwrap_or_default().to_string_lossy().into_owned();
        out.push((kind, std::fs::read(path).expect("a file")));
    }
    out
}

fn cut() -> (f64, String) {
    let folder = std::env::temp_dir().join(format!("frazil-cut-{}", std::process::id()));
    std::fs::create_dir_all(&folder).expect("a folder");
    let guard = decoder(MOST_MEMORY);
    let (mut accepted, mut cuts, files) = (0, 0, sized(&folder));
    for (kind, bytes) in &files {
        let path: PathBuf = folder.join(format!("cut.{kind}"));
        let mut dice = Dice::new(bytes.len());
        for turn in 0..CUTS {
            // Half of them near the beginning, where everything else hangs on what is lost.
            let length =
                if turn % 2 == 0 { dice.below(bytes.len()) } else { dice.below(bytes.len().min(4096)) };
            std::fs::write(&path, &bytes[..length]).expect("a file");
            cuts += 1;
            let read = match kind.as_str() {
                "vdb" => guard.describe(&path).is_ok(),
                "glb" => Character::describe(&path).is_ok(),
                _ => mesh::read(&path).is_ok(),
            };
            accepted += usize::from(read);
        }
    }
    let _ = std::fs::remove_dir_all(&folder);
    let note = format!("{cuts} cuts of {} files", files.len());
    (accepted as f64, note)
}

fn child_cost() -> (f64, String) {
    let ctx = context(2);
    let layer = scenes::snow(&ctx, 3.1, 0.005, scenes::EXACT);
    let mut surface = layer.surface().deep_copy().expect("a copy");
    // A layer as it is after some steps does not pack as well as a flat one.
    let mut dice = Dice::new(7);
    for leaf in surface.leaves_mut().expect("leaves") {
        leaf.values.iter_mut().for_each(|value| *value += dice.below(1000) as f32 * 1e-7);
    }
    let path = std::env::temp_dir().join(format!("frazil-foreign-{}.vdb", std::process::id()));
    file::write(&path, &[&surface], &WriteOptions::default()).expect("a file");
    let megabytes = std::fs::metadata(&path).map_or(0.0, |file| file.len() as f64 / 1e6);
    let guard = decoder(u64::MAX);
    let (mut direct, mut child, mut note) = (Vec::new(), Vec::new(), String::new());
    for turn in 0..6 {
        let (a, noise) = timed(|| drop(file::read_named(&path, None).expect("read")));
        let (b, more) = timed(|| drop(guard.read_named(&path, None).expect("read by a child")));
        if turn > 0 {
            direct.push(a);
            child.push(b);
            note = format!("{noise}{more}");
        }
    }
    let _ = std::fs::remove_file(path);
    let (direct, child) = (median(direct), median(child));
    let note =
        format!("{megabytes:.1} MB, {} leaves, {direct:.3} s and {child:.3} s{note}", surface.leaf_count());
    (child / direct, note)
}
