//! Files of grains: whole ones, changes from which whole ones are made again, and the stage in USD.

use std::fs;
use std::path::{Path, PathBuf};

use frazil::geometry::DVec3;
use frazil::geometry::points::{Column, Points, Values};
use frazil::io::records::manifest::{Manifest, Written};
use frazil::scene::RebuildGrains;
use frazil::vdb::file::{self, WriteOptions};
use frazil::vdb::{MetaValue, points};
use frazil::{Context, Pool};

use super::shot_grains::{folder, grains};
use crate::common::bodies::Dice;
use crate::common::character;
use crate::common::usda;
use crate::program::{Folder, fails, frazil, works};

/// The bytes of a file of grains apart from settings, all paths from folder `at`.
fn apart_from_settings(at: &Path, file: &str, out: &str, frame: i32) -> Vec<u8> {
    character::apart_from_settings(&at.join(file), &at.join(out), frame)
}

#[test]
fn whole_files_of_grains_are_made_from_changes_byte_by_byte() {
    for (table, frames) in
        [("compression = 0.4", 36), ("compression = 0.4\nlifetime = 0.25\nradius = 0.004", 12)]
    {
        let at = &folder(table, "");
        let run = format!("snow shot.toml -q --set shot.frames=1-{frames}");
        works(at, &format!("{run} -o full"));
        works(at, &format!("{run} -o delta --set output.grains_mode=delta"));
        works(at, &format!("vdb rebuild delta --stage grains --frame 1-{frames} -o whole.%04d.vdb"));
        let mut sizes = [0; 2];
        for frame in 1..=frames {
            let [of_full, of_delta] =
                ["full", "delta"].map(|out| format!("{out}/grains/grains.{frame:04}.vdb"));
            let whole = apart_from_settings(at, &format!("whole.{frame:04}.vdb"), "delta", frame);
            assert!(whole == apart_from_settings(at, &of_full, "full", frame), "frame {frame} of {table}");
            if frame % 24 == 1 {
                assert!(
                    whole == apart_from_settings(at, &of_delta, "delta", frame),
                    "frame {frame} is whole"
                );
            }
            if frame == frames {
                sizes = [of_full, of_delta].map(|path| fs::metadata(at.join(path)).unwrap().len());
            }
        }
        // Where most rests there is little to write; where grains live for a few frames only, some are always gone.
        if frames == 36 {
            assert!(2 * sizes[1] < sizes[0], "{sizes:?}");
        } else {
            let gone = fs::read(at.join("delta/grains/grains.0012.vdb")).unwrap();
            let key = b"frazil:gone";
            let start = gone.windows(key.len()).position(|window| window == key).unwrap() + key.len();
            assert!(gone[start + 14].is_ascii_digit(), "some are gone");
        }
        // One frame alone; what runs resume from is the same.
        works(at, "vdb rebuild delta --stage grains --frame 7 -o seven.vdb");
        assert!(fs::read(at.join("seven.vdb")).unwrap() == fs::read(at.join("whole.0007.vdb")).unwrap());
        let state = |out: &str| fs::read(at.join(format!("{out}/state/grains.{frames:04}.grains"))).unwrap();
        assert!(state("full") == state("delta"));
    }
}

#[test]
fn changes_are_made_again_as_they_were_and_for_other_settings_anew() {
    let at = &folder("compression = 0.4", "grains_mode = \"delta\"");
    works(at, "snow shot.toml -o out -q");
    let first = grains(at, "out");
    // From the state before the first frame, and from that of the frame before.
    for frame in [4, 10] {
        fs::remove_file(at.join(format!("out/grains/grains.{frame:04}.vdb"))).unwrap();
        works(at, "snow shot.toml -o out -q");
        assert!(grains(at, "out") == first, "frame {frame}");
    }
    fails(
        at,
        "snow shot.toml -o out -q --set output.grains_mode=full",
        2,
        &["output.grains_mode was \"delta\""],
    );
    works(at, "snow shot.toml -o out -q --stage grains --from 10 --set output.grains_mode=full");
    works(at, "snow shot.toml -o full -q --set output.grains_mode=full");
    works(at, "vdb rebuild out --stage grains --frame 9,10 -o whole.%04d.vdb");
    for (frame, out) in [(9, "out"), (10, "out")] {
        let whole = apart_from_settings(at, &format!("whole.{frame:04}.vdb"), out, frame);
        assert!(
            whole == apart_from_settings(at, &format!("full/grains/grains.{frame:04}.vdb"), "full", frame)
        );
    }
    fails(at, "snow shot.toml -o some -q --frames 5-7", 2, &["grains_mode", "frame 1"]);
    works(at, "snow shot.toml -o some -q --stage base");
    fails(at, "snow shot.toml -o some -q --stage grains --frames 5-7", 2, &["grains_mode", "frame 1"]);
}

#[test]
fn changes_are_the_same_from_any_threads_stops_and_starts() {
    // Some grains are always gone, and frame 25 is whole.
    let at = &folder("compression = 0.4\nlifetime = 0.3\nradius = 0.005", "grains_mode = \"delta\"");
    let run = "snow shot.toml -q --set shot.frames=1-28";
    works(at, &format!("{run} -o once --threads 2"));
    let once = grains(at, "once");
    assert_eq!(once.len(), 28);
    works(at, &format!("{run} -o alone --threads 1"));
    assert!(grains(at, "alone") == once);
    // Stopped after changes, before a whole frame and after one; the base is there or not.
    for (stops, stage) in [(&[7, 8, 24][..], ""), (&[25], ""), (&[1, 26], " --stage grains")] {
        let out = format!("stopped{}", stops[0]);
        if !stage.is_empty() {
            works(at, &format!("{run} -o {out} --stage base"));
        }
        for stop in stops {
            works(at, &format!("{run}{stage} -o {out} --frames 1-{stop}"));
        }
        works(at, &format!("{run}{stage} -o {out}"));
        assert!(grains(at, &out) == once, "{stops:?}");
    }
    // Made again from a frame on: one of changes, a whole one, and all. What is kept before counts as an input then.
    let apart = |out: &str| -> Vec<Vec<u8>> {
        let file = |frame: i32| format!("{out}/grains/grains.{frame:04}.vdb");
        (1..=28).map(|frame| apart_from_settings(at, &file(frame), out, frame)).collect()
    };
    let once_apart = apart("once");
    for (end, from) in [(9, 9), (25, 25), (26, 26), (28, 28), (28, 1)] {
        let out = format!("from{end}-{from}");
        works(at, &format!("{run} -o {out} --stage base"));
        works(at, &format!("{run} -o {out} --stage grains --frames 1-{end}"));
        works(at, &format!("{run} -o {out} --stage grains --from {from}"));
        assert!(apart(&out) == once_apart, "from {from} of {end}");
    }
    let rebuilt = |out: &str| {
        works(at, &format!("vdb rebuild {out} --stage grains --frame 1-28 -o {out}.%04d.vdb"));
        (1..=28).map(|frame| fs::read(at.join(format!("{out}.{frame:04}.vdb"))).unwrap()).collect::<Vec<_>>()
    };
    assert!(rebuilt("once") == rebuilt("alone"));
}

/// Bytes that are cut, longer, or have other bits.
fn damaged(random: &mut Dice, whole: &[u8]) -> Vec<u8> {
    let mut bytes = whole.to_vec();
    match random.below(4) {
        0 => bytes.truncate(random.below(whole.len())),
        1 => bytes.extend_from_slice(&whole[random.below(whole.len() - 1)..]),
        _ => {
            // More often among the first, where lengths and counts are.
            let end = [whole.len(), 1500.min(whole.len())][random.below(2)];
            for _ in 0..=random.below(4) {
                bytes[random.below(end)] ^= 1 << random.below(8);
            }
        }
    }
    bytes
}

/// How many damaged files are tried: as `FRAZIL_FUZZ` says, 10,000 when this was made.
fn rounds(usual: usize) -> usize {
    std::env::var("FRAZIL_FUZZ").ok().and_then(|text| text.parse().ok()).unwrap_or(usual)
}

#[test]
fn damaged_changes_are_one_error_that_names_the_file() {
    let at = &folder("compression = 0.4", "grains_mode = \"delta\"");
    works(at, "snow shot.toml -o out -q");
    works(at, "snow shot.toml -o other -q --set grains.seed=1");
    let (ctx, options) = (Context::new(Pool::new(1).unwrap()), WriteOptions::default());
    let name = "grains/grains.0008.vdb";
    let path = at.join("out").join(name);
    let whole = fs::read(&path).unwrap();
    let mut cache = RebuildGrains::open(&at.join("out")).unwrap();
    let right = cache.bytes(&ctx, 9, &options).unwrap();
    let mut random = Dice(5);
    for round in 0..rounds(2000) {
        let bytes = damaged(&mut random, &whole);
        if bytes == whole {
            continue;
        }
        fs::write(&path, &bytes).unwrap();
        let mut opened = RebuildGrains::open(&at.join("out"));
        // A file of another length is none of a frame that is done.
        let frame = 8 + (round % 2) as i32;
        for cache in [Some(&mut cache), opened.as_mut().ok()].into_iter().flatten() {
            let error = cache.bytes(&ctx, frame, &options).expect_err("refused").to_string();
            assert!(
                error.contains("grains.0008.vdb") || error.contains("frame 8 has no .vdb file"),
                "{error}"
            );
        }
        // A whole file of a later frame helps nobody; those before are there.
        if round % 100 == 0 {
            cache.bytes(&ctx, 7, &options).unwrap();
        }
    }
    fs::write(&path, &whole).unwrap();
    assert!(cache.bytes(&ctx, 9, &options).unwrap() == right);

    // One that is gone, one of another scene, and one of the same length.
    let rebuild = |frame: i32| format!("vdb rebuild out --stage grains --frame {frame} -o x.vdb");
    fs::remove_file(&path).unwrap();
    fails(at, &rebuild(8), 2, &["out", "frame 8 does not exist"]);
    fails(at, &rebuild(9), 1, &["out", "frame 8 has no .vdb file in grains/"]);
    works(at, &rebuild(7));
    works(at, &rebuild(7).replace("x.vdb", "seven.vdb"));
    let foreign = fs::read(at.join("other").join(name)).unwrap();
    assert!(foreign != whole);
    fs::write(&path, &foreign).unwrap();
    for frame in [8, 9] {
        let output = frazil(at, &rebuild(frame));
        assert!(matches!(output.status.code(), Some(1 | 2)), "{output:?}");
        let said = String::from_utf8(output.stderr).unwrap();
        assert_eq!(said.matches("frazil: ").count(), 1, "{said}");
    }
    // With its record, too: changes of other grains.
    let record = "state/grains.0008.json";
    fs::copy(at.join("other").join(record), at.join("out").join(record)).unwrap();
    for frame in [8, 9] {
        fails(at, &rebuild(frame), 1, &["frame 8 of grains", "other grains"]);
    }
    assert!(!fs::read_dir(at.join("out/grains")).unwrap().any(|entry| entry.unwrap().path().ends_with("x")));
    let said = works(at, "info other/grains/grains.0008.vdb");
    assert!(said.contains("since frame 7"), "{said}");
}

#[test]
fn damaged_changes_are_one_error_of_every_command() {
    let at = &folder("compression = 0.4\nradius = 0.005", "grains_mode = \"delta\"");
    works(at, "snow shot.toml -o out -q --frames 1-3");
    let whole = fs::read(at.join("out/grains/grains.0003.vdb")).unwrap();
    let mut random = Dice(6);
    let commands = ["convert a.vdb a.ply", "info a.vdb", "preview a.vdb -o a.png --size 16x16"];
    for round in 0..rounds(150) {
        fs::write(at.join("a.vdb"), damaged(&mut random, &whole)).unwrap();
        let command = commands[[0, 0, 0, 1, 2][round % 5]];
        let output = frazil(at, command);
        let said = String::from_utf8_lossy(&output.stderr);
        let errors =
            said.lines().filter(|line| line.starts_with("frazil: ") && !line.starts_with("frazil: warn: "));
        let errors = errors.count();
        match output.status.code() {
            Some(0) => assert!(errors == 0 && !said.contains("panicked"), "{said}"),
            Some(1 | 2) => assert!(errors == 1 && said.contains("a.vdb"), "round {round}: {said}"),
            other => panic!("{command} ended with {other:?}: {said}"),
        }
    }
}

/// A cache of one whole frame and one of changes, whose contents somebody made up: `changes` and the metadata of its file.
fn made_up(at: &Path, changes: &Points, metadata: Vec<(String, MetaValue)>) -> PathBuf {
    let ctx = Context::new(Pool::new(1).unwrap());
    let out = at.join("made");
    for kind in ["grains", "state"] {
        fs::create_dir_all(out.join(kind)).unwrap();
    }
    for (frame, points, metadata) in [(1, &grains_of(&[1, 2, 3, 5, 8]), Vec::new()), (2, changes, metadata)] {
        let options = WriteOptions { metadata, ..WriteOptions::default() };
        let bytes = points::to_bytes(&ctx, "grains", points, &options).unwrap();
        let path = format!("grains/grains.{frame:04}.vdb");
        fs::write(out.join(&path), &bytes).unwrap();
        let file = Written::new(path, &bytes);
        let mut manifest = serde_json::json!({"frame": frame, "inputs": "", "keeps": "whole", "files": []});
        manifest["files"] = serde_json::json!([file]);
        let manifest: Manifest = serde_json::from_value(manifest).unwrap();
        manifest.write(&out, "grains").unwrap();
    }
    out
}

/// Grains of these identities.
fn grains_of(ids: &[i64]) -> Points {
    let positions: Vec<DVec3> = ids.iter().map(|id| DVec3::new(0.1, 0.1 * *id as f64, 0.0)).collect();
    let mut points = Points::at(0.1, &positions).unwrap();
    points.voxel_size = 0.1;
    points.set("id", Values::Long(Column::Each(ids.to_vec())));
    points.set("trapped", Values::Bool(Column::Uniform(false)));
    points
}

#[test]
fn changes_that_do_not_fit_are_refused() {
    let folder = Folder::empty();
    let ctx = Context::new(Pool::new(1).unwrap());
    let rebuilt = |held: &Points, since: i64, gone: Option<&str>| {
        let mut metadata = vec![("frazil:changes_since".into(), MetaValue::Int(since))];
        metadata.extend(gone.map(|gone| ("frazil:gone".into(), MetaValue::Text(gone.into()))));
        let out = made_up(&folder, held, metadata);
        let mut cache = RebuildGrains::open(&out).unwrap();
        cache.bytes(&ctx, 2, &WriteOptions::default()).map_err(|error| error.to_string())
    };
    let held = grains_of(&[2, 9]);
    let bytes = rebuilt(&held, 1, Some("3,8")).unwrap();
    let path = folder.join("whole.vdb");
    fs::write(&path, bytes).unwrap();
    let whole = points::read_own(&path, None).unwrap();
    let Some(Values::Long(ids)) = whole.attribute("id") else { panic!("{whole:?}") };
    let mut ids: Vec<i64> = (0..whole.count()).map(|point| ids.get(point)).collect();
    ids.sort_unstable();
    assert_eq!(ids, [1, 2, 5, 9]);
    assert!(file::metadata(&path).unwrap().iter().all(|(key, _)| !key.starts_with("frazil:")));
    // Many more than there can be are no reason to make room for them.
    for gone in ["4", "1-4", "0-4294967295", "2-3", "1-2", "9", "5-8", "8-5", "1,1", "-", "1-", "x"] {
        let error = rebuilt(&held, 1, Some(gone)).expect_err(gone);
        assert!(error.contains("frame 2 of grains"), "{gone}: {error}");
    }
    for (held, since, gone) in [(&held, 0, Some("")), (&held, 2, Some("")), (&held, 1, None)] {
        let error = rebuilt(held, since, gone).unwrap_err();
        assert!(error.contains("frame 2 of grains"), "{error}");
    }
    let mut nameless = held.clone();
    nameless.attributes.clear();
    for held in [grains_of(&[2, 2]), nameless] {
        let error = rebuilt(&held, 1, Some("")).unwrap_err();
        assert!(error.contains("grains.0002.vdb") && error.contains("identity"), "{error}");
    }
    let mut random = Dice(7);
    for _ in 0..rounds(2000) {
        let held: Vec<i64> = (0..12).filter(|_| random.below(3) == 0).collect();
        let gone: String = (0..random.below(8)).map(|_| char::from(b"0123589,-"[random.below(9)])).collect();
        if let Err(error) = rebuilt(&grains_of(&held), 1, Some(&gone)) {
            assert!(error.contains("frame 2 of grains"), "{gone}: {error}");
        }
    }
}

#[test]
fn what_holds_changes_says_so() {
    let folder = folder("compression = 0.4", "grains_mode = \"delta\"");
    let at = folder.path();
    works(at, "snow shot.toml -o out -q");
    let file = "out/grains/grains.0008.vdb";
    assert!(works(at, &format!("info {file}")).contains("since frame 7"));
    assert!(!works(at, "info out/grains/grains.0001.vdb").contains("partial"));
    assert!(works(at, &format!("preview {file} -o a.png")).contains("since frame 7"));
    fails(at, &format!("convert {file} b.ply"), 2, &[file, "since frame 7", "vdb rebuild"]);
    fails(at, &format!("vdb from-particles {file} --mesh b.ply"), 2, &[file, "since frame 7", "vdb rebuild"]);
    let scene = fs::read_to_string(at.join("shot.toml")).unwrap();
    fs::write(at.join("drift.toml"), scene.replace("[grains]", &format!("[grains]\ninitial = \"{file}\"")))
        .unwrap();
    fails(at, "snow drift.toml -o drift -q", 2, &[file, "since frame 7"]);
    // A whole one is what it says.
    works(at, "vdb rebuild out --stage grains --frame 8 -o whole.vdb");
    assert!(!works(at, "info whole.vdb").contains("partial"));
    works(at, "convert whole.vdb b.ply");

    fails(at, "vdb rebuild out --stage grains --frame 8 -o out/grains/x.vdb", 2, &["own files"]);
    fails(at, "vdb rebuild out --stage grains --frame 11 -o x.vdb", 2, &["frame 11"]);
    fails(at, "vdb rebuild out --stage grains --frame 8 --half -o x.vdb", 2, &["--half"]);
    fails(at, "vdb rebuild out --stage mist --frame 8 -o x.vdb", 2, &["mist"]);
    let mut bytes = fs::read(at.join(file)).unwrap();
    let last = bytes.len() - 9;
    bytes[last] ^= 1;
    fs::write(at.join(file), &bytes).unwrap();
    fails(at, "vdb rebuild out --stage grains --frame 9 -o x.vdb", 1, &["grains.0008.vdb"]);
    works(at, "vdb rebuild out --stage grains --frame 7 -o x.vdb");

    for (written, words) in [
        ("grains_mode = \"some\"", "grains_mode"),
        ("grains_mode = \"delta\"\ngrains = [\"ply\"]", "grains_mode"),
        ("grains_mode = \"delta\"\ngrains = []", "grains_mode"),
    ] {
        let folder = super::shot_grains::folder("", written);
        fails(&folder, "snow shot.toml -o out -q", 2, &["shot.toml", words]);
    }
}

#[test]
fn shot_usda_has_the_grains_that_have_usd_files() {
    let at = &folder("compression = 0.4", "objects = [\"usd\"]\ngrains = [\"vdb\", \"usd\"]");
    works(at, "snow shot.toml -o out -q");
    let stage = fs::read_to_string(at.join("out/shot.usda")).unwrap();
    let assets: Vec<&str> = stage.split('@').skip(1).step_by(2).collect();
    for kind in ["grains", "objects"] {
        let files = assets.iter().filter(|asset| asset.starts_with(&format!("./{kind}/"))).count();
        assert_eq!(files, 11, "{kind} in {stage}");
    }
    assets.iter().for_each(|asset| assert!(at.join("out").join(asset).is_file(), "{asset}"));
    for words in [
        "def Points \"grains\" (",
        "string primPath = \"/grains\"",
        "uniform token purpose = \"render\"",
        "int64[] ids\n",
        "vector3f[] velocities\n",
        "float[] widths (\n            interpolation = \"vertex\"",
        "bool[] primvars:trapped (\n            interpolation = \"vertex\"",
    ] {
        assert!(stage.contains(words), "no {words:?} in {stage}");
    }
    // All that a frame has is declared, and each frame has it in the same way.
    let manifest = fs::read_to_string(at.join("out/grains/grains.manifest.usda")).unwrap();
    for frame in [1, 10] {
        let text = usda::text(&at.join(format!("out/grains/grains.{frame:04}.usdc")));
        let names = usda::sampled(&text);
        assert_eq!(names.len(), 10, "{text}");
        names.iter().for_each(|name| assert!(manifest.contains(name), "no {name} in {manifest}"));
        assert_eq!(text.matches("\"constant\"").count(), 0, "frame {frame}");
    }
    assert!(works(at, "check out").contains("all of them are as they were written"));
    // Volumes hold no points.
    works(at, "snow shot.toml -o plain -q --set output.grains=[\"vdb\"]");
    assert!(!fs::read_to_string(at.join("plain/shot.usda")).unwrap().contains("grains"));
}
