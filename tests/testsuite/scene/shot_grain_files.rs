//! Files of grains: whole ones, changes from which whole ones are made again, and the stage in USD.

use std::fs;
use std::path::Path;

use super::shot_grains::{folder, grains};
use crate::program::{fails, works};

/// A file's bytes without what two runs with other settings have by themselves: the file's identifier, and the hash of what
/// frame `frame` of stage grains in folder `out` was made from.
fn apart_from_settings(at: &Path, file: &str, out: &str, frame: i32) -> Vec<u8> {
    let record = fs::read(at.join(format!("{out}/state/grains.{frame:04}.json"))).unwrap();
    let record: serde_json::Value = serde_json::from_slice(&record).unwrap();
    let hash = record["content"]["inputs"].as_str().unwrap().as_bytes().to_vec();
    let mut bytes = fs::read(at.join(file)).unwrap();
    bytes[21..57].fill(b'-');
    let found = bytes.windows(hash.len()).position(|window| window == hash).expect("the hash of its inputs");
    bytes[found..found + hash.len()].fill(b'-');
    bytes
}

#[test]
fn whole_files_of_grains_are_made_from_changes_byte_by_byte() {
    for (table, frames) in
        [("compression = 0.4", 36), ("compression = 0.4\nlifetime = 0.25\nradius = 0.004", 12)]
    {
        let folder = folder(table, "");
        let at = folder.path();
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
    let folder = folder("compression = 0.4", "grains_mode = \"delta\"");
    let at = folder.path();
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
fn what_holds_changes_says_so() {
    let folder = folder("compression = 0.4", "grains_mode = \"delta\"");
    let at = folder.path();
    works(at, "snow shot.toml -o out -q");
    let file = "out/grains/grains.0008.vdb";
    assert!(works(at, &format!("info {file}")).contains("since frame 7"));
    assert!(!works(at, "info out/grains/grains.0001.vdb").contains("partial"));
    assert!(works(at, &format!("preview {file} -o a.png")).contains("since frame 7"));
    fails(at, &format!("convert {file} b.ply"), 2, &[file, "since frame 7", "vdb rebuild"]);
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
        fails(folder.path(), "snow shot.toml -o out -q", 2, &["shot.toml", words]);
    }
}

#[test]
fn shot_usda_has_the_grains_that_have_usd_files() {
    let folder = folder("compression = 0.4", "objects = [\"usd\"]\ngrains = [\"vdb\", \"usd\"]");
    let at = folder.path();
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
        "float[] widths (\n            interpolation = \"constant\"",
        "bool[] primvars:trapped (\n            interpolation = \"vertex\"",
    ] {
        assert!(stage.contains(words), "no {words:?} in {stage}");
    }
    // All that a frame has is declared, and each frame has it in the same way.
    let manifest = fs::read_to_string(at.join("out/grains/grains.manifest.usda")).unwrap();
    for frame in [1, 10] {
        let text = fs::read_to_string(at.join(format!("out/grains/grains.{frame:04}.usda"))).unwrap();
        let names: Vec<&str> =
            text.lines().filter_map(|line| Some(line.split_once(".timeSamples")?.0)).collect();
        assert_eq!(names.len(), 9, "{text}");
        names.iter().for_each(|name| assert!(manifest.contains(name), "no {name} in {manifest}"));
        assert_eq!(text.matches("\"constant\"").count(), 1, "frame {frame}");
    }
    assert!(works(at, "check out").contains("all of them are what was written"));
    // Volumes hold no points.
    works(at, "snow shot.toml -o plain -q --set output.grains=[\"vdb\"]");
    assert!(!fs::read_to_string(at.join("plain/shot.usda")).unwrap().contains("grains"));
}
