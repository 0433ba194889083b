//! Particle caches of other programs: every encoding gives the same particles, and damage is one sentence.

use std::fs;
use std::path::Path;

use frazil::geometry::DVec3;
use frazil::geometry::points::{Column, Points, Values};
use frazil::io::particles::{self, ParticleData};

use crate::common::caches::{IDS, KINDS, POSITIONS, VELOCITIES, Vtu, bgeo, vtk, zipped};
use crate::program::Folder;

pub fn parse(name: &str, bytes: &[u8]) -> frazil::Result<ParticleData> {
    particles::parse(Path::new(name), bytes)
}

/// The four particles, whatever file they were in.
#[track_caller]
fn are_the_particles(cloud: &ParticleData, what: &str) {
    let positions = POSITIONS.map(|position| DVec3::from(position.map(f64::from)));
    assert_eq!(cloud.positions, positions, "{what}");
    assert_eq!(
        cloud.attribute("id"),
        Some(&Values::Long(Column::Each(IDS.map(i64::from).to_vec()))),
        "{what}"
    );
    assert_eq!(
        cloud.attribute("velocity"),
        Some(&Values::Vector(Column::Each(VELOCITIES.to_vec()))),
        "{what}"
    );
    assert_eq!(
        cloud.attribute("kind"),
        Some(&Values::Int(Column::Each(KINDS.map(i32::from).to_vec()))),
        "{what}"
    );
    assert_eq!(cloud.attribute("mass of each"), Some(&Values::Float(Column::Uniform(0.125))), "{what}");
    // A pair is nothing that points have.
    assert_eq!(cloud.attributes.len(), 4, "{what}");
}

#[test]
fn every_encoding_of_vtk_has_the_same_particles() {
    for binary in [false, true] {
        for version in ["3.0", "4.1", "5.1"] {
            for dataset in ["POLYDATA", "UNSTRUCTURED_GRID"] {
                let file = vtk(binary, version, dataset);
                are_the_particles(&parse("a.vtk", &file).unwrap(), &format!("{binary} {version} {dataset}"));
            }
        }
    }
    let grid = vtk(false, "3.0", "STRUCTURED_GRID");
    assert!(parse("a.vtk", &grid).unwrap_err().to_string().contains("STRUCTURED_GRID"));
    // Bits, texts, colours and tables, of which only the bits are data of points.
    let text = "# vtk DataFile Version 3.0\n\nascii\ndataset polydata\npoints 2 double\n0 0 0 1 1 1\n\
                point_data 2\nscalars active bit\nlookup_table default\n1 0\nlookup_table t 1\n0 1 0 1\n\
                color_scalars c 4\n0 0 0 1 0.5 1 1 1\nfield f 1\nname 1 2 string\na%20b\nc\nnormals n float\n0 1 0 0 1 0\n";
    let cloud = parse("a.vtk", text.as_bytes()).unwrap();
    assert_eq!(cloud.attribute("active"), Some(&Values::Bool(Column::Each(vec![true, false]))));
    assert_eq!(cloud.attribute("n"), Some(&Values::Vector(Column::Uniform([0.0, 1.0, 0.0]))));
    assert_eq!(cloud.attributes.len(), 2);
    let mut binary = b"# vtk DataFile Version 5.1\n\nBINARY\nDATASET POLYDATA\nPOINTS 1 float\n".to_vec();
    binary.extend([0; 12]);
    binary.extend(b"\nPOINT_DATA 1\nFIELD f 2\nname 1 1 string\n\xc2ab\nflag 1 1 bit\n\x80\n");
    assert_eq!(parse("a.vtk", &binary).unwrap().attribute("flag"), Some(&Values::Int(Column::Each(vec![1]))));
}

#[test]
fn every_encoding_of_vtu_has_the_same_particles() {
    for vtu in Vtu::all() {
        are_the_particles(&parse("a.vtu", &vtu.file()).unwrap(), &format!("{vtu:?}"));
    }
    let plain = Vtu { format: "binary", encoding: "", blocks: None, long: false, big: false, pieces: 1 };
    let text = String::from_utf8(plain.file()).unwrap();
    let refused = |from: &str, to: &str, what: &str| {
        let error = parse("a.vtu", text.replacen(from, to, 1).as_bytes()).unwrap_err().to_string();
        assert!(error.starts_with("a.vtu: ") && error.contains(what), "{error}");
    };
    refused("UnstructuredGrid\" ver", "ImageData\" ver", "ImageData");
    refused("byte_order", "compressor=\"vtkLZMADataCompressor\" byte_order", "LZMA");
    refused("NumberOfPoints=\"4\"", "NumberOfPoints=\"5\"", "\"Points\" has 48 bytes, not 60");
    refused("NumberOfPoints=\"4\"", "NumberOfPoints=\"4000000000000\"", "\"Points\" is too large");
    refused("<?xml version=\"1.0\"?>", "<!DOCTYPE a [<!ENTITY b \"c\">]>", "DTD");
    refused(
        "NumberOfComponents=\"3\" format=\"binary\"",
        "NumberOfComponents=\"x\" format=\"binary\"",
        "\"x\"",
    );
}

#[test]
fn bgeo_is_read_plain_and_in_gzip_and_houdinis_own_is_named() {
    let plain = bgeo();
    for (name, bytes) in [
        ("a.bgeo", plain.clone()),
        ("a.bgeo", zipped(&plain)),
        ("A.BGEO.GZ", zipped(&plain)),
        ("a.bhclassic", plain.clone()),
    ] {
        let cloud = parse(name, &bytes).unwrap();
        assert_eq!(cloud.positions, POSITIONS.map(|position| DVec3::from(position.map(f64::from))));
        assert_eq!(cloud.attribute("id"), Some(&Values::Long(Column::Each(vec![-1, 0, 1, 2]))));
        assert_eq!(cloud.attribute("velocity"), Some(&Values::Vector(Column::Each(VELOCITIES.to_vec()))));
        assert_eq!(cloud.attribute("pscale"), Some(&Values::Float(Column::Uniform(0.125))));
        assert_eq!(cloud.attributes.len(), 3);
    }
    let json = b"\x7fNSJb\x5b\x27\x0bfileversion".to_vec();
    for (name, bytes) in [
        ("a.bgeo", json.clone()),
        ("a.bgeo.gz", zipped(&json)),
        ("a.bgeo", b"[\"fileversion\",".to_vec()),
        ("a.bgeo.sc", vec![1, 2, 3]),
    ] {
        let error = parse(name, &bytes).unwrap_err().to_string();
        assert!(
            error.starts_with(&format!("{name}: is Houdini's own")) && error.contains(".bhclassic"),
            "{error}"
        );
    }
    let mut other = plain;
    other[8] = 4;
    assert!(parse("a.bgeo", &other).unwrap_err().to_string().contains("version 4"));
    assert!(parse("a.bgeo", b"\x1f\x8b, but no gzip").is_err());
}

#[test]
fn xyz_is_text_or_binary_and_never_both() {
    let positions = POSITIONS.map(|position| DVec3::from(position.map(f64::from)));
    let binary: Vec<u8> = POSITIONS.as_flattened().iter().flat_map(|part| part.to_le_bytes()).collect();
    assert_eq!(parse("a.xyz", &binary).unwrap().positions, positions);
    let text = "# particles\r\n0.1 -2.5 1e-7\n\n1,0,3\n4\t5 -6 0 1 0\n  0.25 .5 +0.75";
    let exact = [[0.1, -2.5, 1e-7], [1.0, 0.0, 3.0], [4.0, 5.0, -6.0], [0.25, 0.5, 0.75]].map(DVec3::from);
    assert_eq!(parse("a.xyz", text.as_bytes()).unwrap().positions, exact);
    for (bytes, what) in [
        (&binary[..47], "47 bytes"),
        (b"4\ncomment\n", "line 1"),
        (b"1 2 3\n1 2\n", "line 2"),
        (b"1 2 x", "\"x\""),
        (b"", "empty"),
    ] {
        let error = parse("a.xyz", bytes).unwrap_err().to_string();
        assert!(error.contains(what), "{error}");
    }
}

#[test]
fn points_pass_through_the_files_that_are_written() {
    let folder = Folder::empty();
    let mut points =
        Points::at(1.0, &POSITIONS.map(|position| DVec3::from(position.map(f64::from)))).unwrap();
    points.set("v", Values::Vector(Column::Each(VELOCITIES.to_vec())));
    points.set("id", Values::Long(Column::Each(vec![5, -7, 1, 2])));
    points.set("pscale", Values::Float(Column::Uniform(0.1)));
    points.set("active", Values::Bool(Column::Each(vec![true, false, true, true])));
    points.set("source_frame", Values::Int(Column::Each(vec![-1, 2, 3, 4])));
    let none = Points { voxel_size: 1.0, ..Points::default() };
    for name in ["a.bgeo", "a.bgeo.gz", "a.ply", "a.xyz"] {
        let path = folder.join(name);
        particles::write(&path, &none, true).unwrap();
        assert!(particles::read(&path).unwrap().positions.is_empty(), "{name}");
        particles::write(&path, &points, false).unwrap();
        let cloud = particles::read(&path).unwrap();
        assert_eq!(cloud.voxel_size, None);
        let back = cloud.into_points(Some(1.0)).unwrap();
        assert_eq!((&back.cells, &back.offsets), (&points.cells, &points.offsets), "{name}");
        assert!(back.attributes == points.attributes || name == "a.xyz", "{name}");
    }
    let same = fs::read(folder.join("a.bgeo")).unwrap();
    assert!(same == fs::read(folder.join("a.bgeo.gz")).unwrap());
    points.set("id", Values::Long(Column::Uniform(1 << 31)));
    let error = particles::write(&folder.join("b.bgeo"), &points, true).unwrap_err().to_string();
    assert!(
        error.contains("b.bgeo") && error.contains("\"id\"") && !folder.join("b.bgeo").exists(),
        "{error}"
    );
    assert!(particles::write(&folder.join("b.vtk"), &points, true).is_err());
}
