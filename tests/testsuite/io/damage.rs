//! Files that are damaged, cut, or made to harm: one sentence, no crash, no hang, and nothing outside is touched.

use crate::common::skip::skipped;
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::Arc;
use std::time::{Duration, Instant};

use crate::common::character;
use crate::common::shapes;
use crate::program::{self, CUBE, Folder, complains, fails, frazil, works};
use frazil::numeric::blocks::{Block, BlockEdit};
use frazil::vdb::file::{Compression, WriteOptions};
use frazil::vdb::reading::guard::Guard;
use frazil::vdb::reading::layout;
use frazil::vdb::{FloatGrid, MetaValue, file, level_set};
use frazil::{Context, Pool, io};

/// A file of the outside data.
fn outside(name: &str) -> Option<PathBuf> {
    let path = character::data(name);
    if path.is_none() {
        skipped(&format!("no {name}"));
    }
    path
}

/// Runs the program on an absolute path.
fn on(folder: &Path, before: &str, path: &Path, after: &str) -> Output {
    let mut command = program::command(folder, before);
    command.arg(path).args(after.split_whitespace()).output().unwrap()
}

fn guard() -> Guard {
    let program = env!("CARGO_BIN_EXE_frazil").into();
    Guard { program, memory: u64::MAX, threads: 2, cancel: Arc::default() }
}

fn ball(ctx: &Context) -> FloatGrid {
    let mut grid = level_set::from_mesh(ctx, &shapes::sphere(0.5, 24), 0.01, 3.0).unwrap();
    grid.set_name("ball").unwrap();
    grid.set_metadata("who", MetaValue::Text("nobody".into())).unwrap();
    grid.set_metadata("weight", MetaValue::Double(0.5)).unwrap();
    grid
}

#[test]
fn known_breakers_of_openvdb_are_refused_in_a_sentence() {
    let folder = Folder::empty();
    let names = [
        "trunc_base_1800",
        "trunc_blosc_800",
        "trunc_zip_365",
        "trunc_zip_893",
        "vdb_crash134_1120",
        "vdb_crash134_339",
        "vdb_crash135_1181",
        "vdb_crash139_305",
        "vdb_crash139_530",
        "vdb_hang_19",
        "vdb_hang_240",
        "vdb_hang_345",
    ];
    for name in names {
        let Some(path) = outside(&format!("broken/{name}.vdb")) else { return };
        for (command, after) in [("info --measure", ""), ("vdb to-mesh", "-o out.obj")] {
            let start = Instant::now();
            let output = on(&folder, command, &path, after);
            assert!(start.elapsed() < Duration::from_secs(30), "{name}: {:?}", start.elapsed());
            // Damage of what a command does not read is not seen by it.
            if !output.status.success() {
                complains(&output, 2, &[name]);
            }
            if name.starts_with("trunc") {
                complains(&output, 2, &["cut short"]);
            }
        }
        // A byte flipped inside a value may crash OpenVDB or just be another value.
        let read = guard().read(&path);
        assert!(read.is_err() || name.starts_with("vdb_crash"), "{name}");
        if name.starts_with("trunc") {
            let bytes = fs::read(&path).unwrap();
            assert!(layout::read(std::io::Cursor::new(bytes)).is_err(), "{name}");
        }
    }
}

#[test]
fn known_breakers_of_other_readers_are_refused_in_a_sentence() {
    let folder = Folder::empty();
    for (name, code) in
        [("min_ply_hang.ply", 0), ("min_ply_memory.ply", 0), ("glb_620.glb", 2), ("gltf_798.gltf", 2)]
    {
        let Some(path) = outside(&format!("broken/{name}")) else { return };
        let start = Instant::now();
        let output = on(&folder, "info", &path, "");
        assert!(start.elapsed() < Duration::from_secs(5), "{name}");
        match code {
            0 => assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr)),
            _ => complains(&output, code, &[name]),
        }
    }
    let Some(path) = outside("broken/min_obj_escape.obj") else { return };
    let output = on(&folder, "info", &path, "");
    complains(&output, 2, &["line 4", "[31mX"]);
    assert!(!output.stderr.contains(&0x1b), "{:?}", output.stderr);
}

#[test]
fn intact_files_pass_and_every_cut_is_refused_before_openvdb_sees_it() {
    let ctx = Context::new(Pool::new(1).unwrap());
    let own = file::to_bytes(&[&ball(&ctx)], &WriteOptions::default()).unwrap();
    let mut files = vec![own];
    for name in ["vdb/smoke.vdb", "vdb/sphere.vdb"] {
        let Some(path) = outside(name) else { continue };
        assert!(!file::describe(&path).unwrap().is_empty());
        files.push(fs::read(path).unwrap());
    }
    for bytes in files {
        let read = |length: usize| layout::read(std::io::Cursor::new(&bytes[..length]));
        assert!(read(bytes.len()).unwrap().grids.is_some());
        let cuts = (0..3000).chain((0..500).map(|part| bytes.len() * part / 500)).chain([bytes.len() - 1]);
        cuts.for_each(|length| assert!(read(length).is_err(), "cut at {length}"));
    }
}

#[test]
fn what_a_child_hands_over_is_what_the_file_holds() {
    let ctx = Context::new(Pool::new(2).unwrap());
    let folder = Folder::empty();
    let path = folder.join("ball.vdb");
    let mut flat = FloatGrid::new(0.25, 7.0).unwrap();
    flat.set_name("flat").unwrap();
    for compression in [Compression::None, Compression::Zip, Compression::Blosc] {
        let options = WriteOptions { compression, ..WriteOptions::default() };
        file::write(&path, &[&ball(&ctx), &flat], &options).unwrap();
        same(&path, &["ball", "flat"]);
        assert_eq!(guard().read(&path).unwrap().len(), 2);
    }
    let error = guard().read_named(&path, Some("cube")).err().unwrap().to_string();
    assert!(error.contains("\"ball\"") && error.contains("\"flat\""), "{error}");
    for (name, grid) in [("vdb/smoke.vdb", "density"), ("vdb/sphere.vdb", "ls_sphere")] {
        let Some(path) = outside(name) else { continue };
        same(&path, &[grid]);
    }
}

/// A grid is the same, whoever reads it.
fn same(path: &Path, names: &[&str]) {
    assert_eq!(guard().describe(path).unwrap(), file::describe(path).unwrap());
    for name in names {
        let bytes = |grid: &FloatGrid| file::to_bytes(&[grid], &WriteOptions::default()).unwrap();
        let (child, own) =
            (guard().read_named(path, Some(name)).unwrap(), file::read_named(path, Some(name)).unwrap());
        assert!(bytes(&child) == bytes(&own), "{}: {name}", path.display());
    }
}

#[test]
fn a_program_that_is_not_frazil_is_named() {
    let ctx = Context::new(Pool::new(1).unwrap());
    let folder = Folder::empty();
    let path = folder.join("ball.vdb");
    file::write(&path, &[&ball(&ctx)], &WriteOptions::default()).unwrap();
    for (program, word) in [("/bin/true", "/bin/true"), ("/no/such/program", "cannot start")] {
        let guard = Guard { program: program.into(), ..guard() };
        let error = guard.describe(&path).unwrap_err().to_string();
        assert!(error.contains(word), "{error}");
    }
}

#[test]
fn a_file_that_needs_more_memory_than_it_may_is_refused() {
    let ctx = Context::new(Pool::new(1).unwrap());
    let folder = Folder::empty();
    let path = folder.join("large.vdb");
    let mut grid = FloatGrid::new(0.1, 0.0).unwrap();
    let block =
        |i: i32| Block { origin: [i % 400 * 8, i / 400 * 8, 0], values: Box::new([1.5; 512]), mask: [1; 8] };
    grid.replace_blocks(&ctx, &(0..60_000).map(|i| BlockEdit::Dense(block(i))).collect::<Vec<_>>()).unwrap();
    file::write(&path, &[&grid], &WriteOptions::default()).unwrap();
    assert_eq!(guard().read_named(&path, None).unwrap().leaf_count(), 60_000);
    let guard = Guard { memory: 1 << 20, ..guard() };
    let error = guard.read_named(&path, None).err().unwrap().to_string();
    assert!(error.contains("memory"), "{error}");
}

#[test]
fn a_stream_without_offsets_is_read_and_its_end_is_noticed() {
    let ctx = Context::new(Pool::new(1).unwrap());
    let folder = Folder::empty();
    let path = folder.join("stream.vdb");
    let mut bytes = file::to_bytes(&[&ball(&ctx)], &WriteOptions::default()).unwrap();
    // The flag that says that offsets are there.
    bytes[20] = 0;
    fs::write(&path, &bytes).unwrap();
    assert!(layout::read(std::io::Cursor::new(&bytes)).unwrap().is_stream());
    assert_eq!(file::describe(&path).unwrap()[0].name, "ball");
    same(&path, &["ball"]);
    let cuts = (1..60).map(|part| bytes.len() * part / 60).chain(bytes.len() - 40..bytes.len());
    for length in cuts {
        fs::write(&path, &bytes[..length]).unwrap();
        assert!(file::read(&path).is_err(), "cut at {length} of {}", bytes.len());
        assert!(length % 10 != 0 || guard().read(&path).is_err(), "cut at {length} of {}", bytes.len());
    }
}

#[test]
fn only_regular_files_are_read() {
    let folder = Folder::empty();
    for name in ["pipe.obj", "pipe.ply", "pipe.stl", "pipe.vdb", "pipe.glb"] {
        assert!(Command::new("mkfifo").arg(folder.join(name)).status().unwrap().success());
        fails(&folder, &format!("info {name}"), 2, &[name, "pipe"]);
    }
    fs::create_dir(folder.join("folder.obj")).unwrap();
    fails(&folder, "info folder.obj", 2, &["folder.obj", "is a folder"]);
}

/// A model of one triangle whose buffer is a file.
fn model(uri: &str) -> String {
    format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3"}}],
        "bufferViews":[{{"buffer":0,"byteLength":36}}],"buffers":[{{"byteLength":36,"uri":"{uri}"}}]}}"#
    )
}

#[test]
fn a_model_names_no_file_outside_its_folder() {
    let folder = Folder::empty();
    let inner = folder.join("in");
    fs::create_dir_all(inner.join("below")).unwrap();
    let triangle: Vec<u8> =
        [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    for position in ["secret.bin", "in/own data.bin", "in/below/more.bin"] {
        fs::write(folder.join(position), &triangle).unwrap();
    }
    let secret = folder.join("secret.bin");
    let secret = secret.display();
    for uri in ["own%20data.bin", "below/more.bin", "./below/more.bin"] {
        fs::write(inner.join("model.gltf"), model(uri)).unwrap();
        works(&folder, "info in/model.gltf");
    }
    let outward = [
        "../secret.bin".to_string(),
        "below/../../secret.bin".into(),
        "%2e%2e/secret.bin".into(),
        "%2E%2E%2Fsecret.bin".into(),
        secret.to_string(),
        format!("file://{secret}"),
        format!("file:{secret}"),
        "/dev/zero".into(),
        "..\\\\secret.bin".into(),
        "http://example.com/a.bin".into(),
    ];
    for uri in outward {
        fs::write(inner.join("model.gltf"), model(&uri)).unwrap();
        fails(&folder, "info in/model.gltf", 2, &["model.gltf", "buffer"]);
    }
    for uri in ["%FF.bin", "%2", "none.bin", "a%00b.bin"] {
        fs::write(inner.join("model.gltf"), model(uri)).unwrap();
        fails(&folder, "info in/model.gltf", 2, &["model.gltf", "buffer"]);
    }
    assert!(Command::new("mkfifo").arg(inner.join("pipe.bin")).status().unwrap().success());
    fs::write(inner.join("model.gltf"), model("pipe.bin")).unwrap();
    fails(&folder, "info in/model.gltf", 2, &["model.gltf", "pipe.bin"]);
}

#[test]
fn numbers_without_data_take_no_memory() {
    let folder = Folder::empty();
    let data: Vec<u8> = vec![0; 36];
    fs::write(folder.join("a.bin"), data).unwrap();
    let sparse =
        r#""sparse":{"count":1,"indices":{"bufferView":0,"componentType":5125},"values":{"bufferView":0}},"#;
    let without_view =
        model("a.bin").replacen("\"bufferView\":0,", sparse, 1).replace("\"count\":3", "\"count\":268435456");
    let one_on_another = model("a.bin")
        .replace("\"byteLength\":36}],\"buffers\"", "\"byteLength\":36,\"byteStride\":4}],\"buffers\"")
        .replace("\"count\":3", "\"count\":7");
    for text in [without_view, one_on_another] {
        fs::write(folder.join("model.gltf"), text).unwrap();
        let start = Instant::now();
        fails(&folder, "info model.gltf", 2, &["model.gltf", "accessor"]);
        assert!(start.elapsed() < Duration::from_secs(2), "{:?}", start.elapsed());
    }
    let animated = model("a.bin").replace(
        "\"accessors\"",
        "\"animations\":[{\"channels\":[{\"sampler\":3,\"target\":{\"node\":0,\"path\":\"rotation\"}}],\"samplers\":[]}],\"accessors\"",
    );
    fs::write(folder.join("model.gltf"), animated).unwrap();
    fails(&folder, "info model.gltf", 2, &["model.gltf", "sampler"]);
}

#[test]
fn an_obj_may_begin_with_a_byte_order_mark_and_be_of_another_encoding() {
    let folder = Folder::empty();
    let path = folder.join("cube.obj");
    fs::write(&path, CUBE).unwrap();
    let plain = io::mesh::read(&path).unwrap();
    let mut text = b"\xef\xbb\xbf".to_vec();
    text.extend(CUBE.as_bytes());
    fs::write(&path, &text).unwrap();
    assert_eq!(io::mesh::read(&path).unwrap(), plain);
    let text =
        [b"# Fran\xe7ois\ng Stra\xdfe\n".as_slice(), CUBE.as_bytes(), b"usemtl b\xf6se # \xff\n"].concat();
    fs::write(&path, text).unwrap();
    assert_eq!(io::mesh::read(&path).unwrap(), plain);
}

#[test]
fn convert_says_what_it_drops() {
    let folder = Folder::empty();
    let text = format!("mtllib a.mtl\nvt 0 0\nvn 0 1 0\nusemtl paint\n{CUBE}");
    fs::write(folder.join("cube.obj"), text).unwrap();
    let said = works(&folder, "convert cube.obj out.ply");
    assert!(said.contains("cube.obj: UVs, normals and materials are not carried over"), "{said}");
    let said = works(&folder, "convert out.ply again.obj");
    assert!(!said.contains("carried"), "{said}");
}

#[test]
fn an_argument_that_is_not_text_does_not_panic() {
    let folder = Folder::empty();
    let name = std::ffi::OsStr::from_bytes(b"caf\xe9.obj");
    fs::write(folder.join(name), CUBE).unwrap();
    let mut command = program::command(&folder, "--report report.json info");
    let output = command.arg(name).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut command = program::command(&folder, "snow -o");
    complains(
        &command.arg(std::ffi::OsStr::from_bytes(b"\xff")).arg("none.toml").output().unwrap(),
        2,
        &["none.toml"],
    );
}

#[test]
fn names_out_of_files_do_not_command_a_terminal() {
    let ctx = Context::new(Pool::new(1).unwrap());
    let folder = Folder::empty();
    let mut grid = ball(&ctx);
    grid.set_name("red\u{1b}[31m\u{9b}5m\u{202e}").unwrap();
    grid.set_metadata("who\u{7}", MetaValue::Text("a\u{1b}]0;title\u{7}\nb".into())).unwrap();
    file::write(&folder.join("a.vdb"), &[&grid], &WriteOptions::default()).unwrap();
    let clean = |bytes: &[u8]| {
        let text = String::from_utf8_lossy(bytes).into_owned();
        assert!(
            !text.contains(|letter: char| letter.is_control() && letter != '\n' || letter == '\u{202e}'),
            "{text:?}"
        );
    };
    let output = frazil(&folder, "info a.vdb");
    clean(&output.stdout);
    assert!(output.status.success());
    let output = frazil(&folder, "vdb smooth a.vdb --grid none -o b.vdb");
    clean(&output.stderr);
    assert!(!output.status.success());
}

#[test]
fn a_stray_leaf_far_away_costs_no_memory() {
    use frazil::snow::base_layer::{BaseLayer, Params};
    let ctx = Context::new(Pool::new(2).unwrap());
    let solid = level_set::from_mesh(&ctx, &shapes::cuboid([2.0, 0.5, 2.0]), 0.02, 3.0).unwrap();
    let volume = |grid: FloatGrid| BaseLayer::new(&ctx, grid, Params::for_cell(0.02)).unwrap().volume();
    let own = volume(solid.deep_copy().unwrap());
    assert!((own - 2.0).abs() < 0.02, "{own}");
    let mut stray = solid.deep_copy().unwrap();
    let outside = Block {
        origin: [1 << 22, 1 << 22, 1 << 22],
        values: Box::new([solid.background(); 512]),
        mask: [1; 8],
    };
    stray.replace_blocks(&ctx, &[BlockEdit::Dense(outside)]).unwrap();
    let start = Instant::now();
    assert_eq!(volume(stray), own);
    assert!(start.elapsed() < Duration::from_secs(5));
}
