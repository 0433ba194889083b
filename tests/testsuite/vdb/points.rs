//! Points in .vdb files: what is written is read bit by bit, the same bytes from any number of threads, and damage is one
//! sentence.

use std::fs;
use std::path::Path;
use std::sync::Arc;

use crate::common::liquids::context;
use crate::program::Folder;
use frazil::Error;
use frazil::geometry::DVec3;
use frazil::geometry::points::{Column, Points, Values};
use frazil::vdb::file::{Compression, WriteOptions};
use frazil::vdb::reading::guard::Guard;
use frazil::vdb::{FloatGrid, MetaValue, file, points};

fn guard() -> Guard {
    let program = env!("CARGO_BIN_EXE_frazil").into();
    Guard { program, memory: u64::MAX, threads: 2, cancel: Arc::default() }
}

/// Numbers from 0 to 1 that look random and are always the same.
fn dice(seed: u64) -> impl FnMut() -> f64 {
    let mut state = seed;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64
    }
}

/// Grains in no order, some far from the origin, with an attribute of each type.
fn cloud(count: usize) -> Points {
    let mut random = dice(7);
    let position = |n: usize, random: &mut dyn FnMut() -> f64| {
        let far = [0.0, 1.0e6, -1.0e6][n % 3];
        DVec3::from([0.0; 3].map(|_: f64| (far + 40.0 * random() - 20.0) * 0.01))
    };
    let positions: Vec<DVec3> = (0..count).map(|n| position(n, &mut random)).collect();
    let mut points = Points::at(0.01, &positions).unwrap();
    // Values of both ends of what an offset may be, and a negative zero.
    points.offsets[0] = [0.5, -0.5, -0.0];
    let mut vectors = || (0..count).map(|_| [0.0; 3].map(|_: f32| random() as f32 - 0.5)).collect();
    points.set("v", Values::Vector(Column::Each(vectors())));
    points.set("rest", Values::Vector(Column::Each(vectors())));
    points.set("id", Values::Long(Column::Each((0..count as i64).map(|id| id * 3_000_000_000).collect())));
    points.set("pscale", Values::Float(Column::Uniform(0.0025)));
    points.set("source_frame", Values::Int(Column::Each((0..count as i32).map(|n| n % 50 - 3).collect())));
    points.set("active", Values::Bool(Column::Each((0..count).map(|n| n % 7 < 3).collect())));
    points.set("one_each", Values::Float(Column::Each(vec![0.1; count])));
    points.set("all", Values::Vector(Column::Uniform([1.0, 2.0, -3.0])));
    points
}

/// The same points in the order of a file.
fn sorted(mut points: Points) -> Points {
    if let Some(order) = points::order(&context(2), &points.cells).unwrap() {
        points.reorder(&order);
    }
    points
}

fn bits(points: &Points) -> String {
    let offsets: Vec<[u32; 3]> = points.offsets.iter().map(|offset| offset.map(f32::to_bits)).collect();
    format!("{} {:?} {offsets:?} {:?}", points.voxel_size.to_bits(), points.cells, points.attributes)
}

#[test]
fn a_file_gives_back_every_bit_near_the_origin_and_far_from_it() {
    let ctx = context(2);
    let folder = Folder::empty();
    let path = folder.join("grains.vdb");
    let given = cloud(20_000);
    for compression in [Compression::None, Compression::Zip, Compression::Blosc] {
        let metadata = vec![("frazil:frame".to_string(), MetaValue::Int(12))];
        let options = WriteOptions { compression, metadata, ..WriteOptions::default() };
        points::write(&ctx, &path, "grains", &given, &options).unwrap();
        let back = points::read_own(&path, Some("grains")).unwrap();
        assert!(bits(&back) == bits(&sorted(given.clone())));
        assert_eq!(bits(&guard().read_points(&path, None).unwrap()), bits(&back));
        // Points in the order of a file are written as they are.
        assert!(points::order(&ctx, &back.cells).unwrap().is_none());
    }
    let header = &file::describe(&path).unwrap()[0];
    assert_eq!((header.name.as_str(), header.voxel), ("grains", 0.01));
}

#[test]
fn the_bytes_do_not_depend_on_threads() {
    let given = cloud(20_000);
    let bytes = |threads: usize| {
        points::to_bytes(&context(threads), "grains", &given, &WriteOptions::default()).unwrap()
    };
    let one = bytes(1);
    for threads in [0, 2, 8] {
        assert!(bytes(threads) == one, "{threads} threads");
    }
}

#[test]
fn points_of_a_voxel_keep_their_order_and_equal_positions_their_values() {
    let ctx = context(2);
    let folder = Folder::empty();
    let path = folder.join("heap.vdb");
    let mut heap = Points::at(1.0, &[DVec3::new(0.1, 0.2, 0.3); 1000]).unwrap();
    heap.set("id", Values::Long(Column::Each((0..1000).rev().collect())));
    points::write(&ctx, &path, "heap", &heap, &WriteOptions::default()).unwrap();
    assert_eq!(points::read_own(&path, None).unwrap(), heap);
}

#[test]
fn no_points_are_a_file_too() {
    let folder = Folder::empty();
    let path = folder.join("none.vdb");
    let none = Points { voxel_size: 0.5, ..Points::default() };
    points::write(&context(1), &path, "grains", &none, &WriteOptions::default()).unwrap();
    assert_eq!(points::read_own(&path, None).unwrap(), none);
    assert_eq!(guard().read_points(&path, None).unwrap(), none);
}

#[test]
fn wrong_points_and_other_grids_are_refused_in_a_sentence() {
    let ctx = context(1);
    let folder = Folder::empty();
    let path = folder.join("a.vdb");
    let mut wrong = cloud(9);
    wrong.offsets[4][1] = f32::NAN;
    let error = points::to_bytes(&ctx, "grains", &wrong, &WriteOptions::default()).unwrap_err();
    assert!(error.to_string().contains("point 5"), "{error}");
    let mut grid = FloatGrid::new(0.1, 0.0).unwrap();
    grid.set_name("heat").unwrap();
    file::write(&path, &[&grid], &WriteOptions::default()).unwrap();
    for name in [None, Some("heat"), Some("grains")] {
        let error = points::read_own(&path, name).unwrap_err().to_string();
        assert!(error.contains("a.vdb") && error.contains("\"heat\""), "{error}");
    }
    points::write(&ctx, &path, "grains", &cloud(9), &WriteOptions::default()).unwrap();
    let error = file::read_named(&path, None).err().unwrap().to_string();
    assert!(error.contains("\"grains\" (points)"), "{error}");
    ctx.cancel();
    let error = points::to_bytes(&ctx, "grains", &cloud(9), &WriteOptions::default()).unwrap_err();
    assert!(matches!(error, Error::Cancelled), "{error}");
}

/// A changed copy of a file: a few bytes are others, more often among the first, where lengths and counts are.
fn mutated(bytes: &[u8], seed: u64) -> Vec<u8> {
    let mut random = dice(seed);
    let mut below = |end: usize| ((random() * end as f64) as usize).min(end - 1);
    let mut out = bytes.to_vec();
    for _ in 0..1 + below(5) {
        let end = [out.len(), 1500][below(2)];
        let at = below(end.min(out.len()));
        match below(4) {
            0 => out[at] ^= 1 << below(8),
            1 => out[at] = below(256) as u8,
            2 => {
                let value = [0u32, 1, 0x7fff_ffff, 0x8000_0000, u32::MAX, 0x1000_0000][below(6)];
                let end = (at + 4).min(out.len());
                out[at..end].copy_from_slice(&value.to_le_bytes()[..end - at]);
            }
            _ => {
                let end = (at + 1 + below(16)).min(out.len());
                out.drain(at..end);
            }
        }
    }
    out
}

/// Reads damaged files in other processes: whatever is read must be whole, and whatever is not is a sentence.
fn survives(folder: &Path, bytes: &[u8], count: u64) -> usize {
    let path = folder.join("damaged.vdb");
    let mut read = 0;
    for seed in 0..count {
        let damaged = match seed % 4 {
            0 => bytes[..bytes.len() * (seed as usize) / (count as usize)].to_vec(),
            _ => mutated(bytes, seed),
        };
        fs::write(&path, damaged).unwrap();
        match guard().read_points(&path, None) {
            Ok(points) => {
                points.validate().unwrap();
                read += 1;
            }
            Err(error) => {
                let text = error.to_string();
                assert!(text.contains("damaged.vdb"), "{seed}: {text}");
            }
        }
    }
    read
}

/// As many as `FRAZIL_FUZZ` says: 10,000 were tried when this was made.
#[test]
fn damaged_points_are_a_sentence() {
    let ctx = context(2);
    let folder = Folder::empty();
    let count = std::env::var("FRAZIL_FUZZ").ok().and_then(|text| text.parse().ok()).unwrap_or(200);
    for compression in [Compression::Blosc, Compression::None] {
        let options = WriteOptions { compression, ..WriteOptions::default() };
        let bytes = points::to_bytes(&ctx, "grains", &cloud(600), &options).unwrap();
        let read = survives(&folder, &bytes, count / 2);
        assert!(read < count as usize / 2, "no damage was seen");
    }
}
