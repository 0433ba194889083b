//! Scene files, records and states with random changes: 10,000 of each, and none may panic, hang or be taken for whole.

use crate::common::skip::skipped;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::time::{Duration, Instant};

use crate::common::bodies::Dice;
use crate::common::character;
use crate::program::{CUBE, Folder, fails, works};
use frazil::io::files::sequence::Pattern;
use frazil::io::records::checksummed;
use frazil::scene::run::Run;
use frazil::scene::run::verify::verify;
use frazil::scene::snow::{self, check};
use frazil::scene::{FrameChoice, Inputs, Rebuild, Scene, check_memory};
use frazil::{Context, Pool};
use serde_json::Value;

const ROUNDS: usize = 10_000;

/// Numbers and words that programs stumble over.
const ODD: [&str; 36] = [
    "0",
    "-0",
    "-1",
    "1e400",
    "1e308",
    "-1e308",
    "1e-320",
    "nan",
    "inf",
    "-inf",
    "2147483647",
    "-2147483648",
    "4294967296",
    "9223372036854775807",
    "9223372036854775808",
    "18446744073709551616",
    "0x7fffffff",
    "1_000_000_000",
    "true",
    "[]",
    "{}",
    "\"\"",
    "\"%99999d\"",
    "\"%65535d.obj\"",
    "\"a.%d\"",
    "\"####\"",
    "\"$F99\"",
    "\"\\u0000\"",
    "\"..\"",
    "\"/\"",
    "\"1--2147483648\"",
    "\"-1000000000-1000000000\"",
    "\"1-1\"",
    "1979-05-27",
    "\"\u{7f}\u{1b}[2J\"",
    "[[[[[[[[]]]]]]]]",
];

/// Numbers that are as good as others.
const PLAIN: [&str; 8] = ["0.05", "0.1", "1", "2", "3", "0.3", "-0.5", "0.02"];

/// A text with a few changes.
fn mutated(random: &mut Dice, text: &str) -> String {
    let mut bytes = text.as_bytes().to_vec();
    for _ in 0..=random.below(6) / 4 {
        let at = random.below(bytes.len());
        match random.below(9) {
            0 => bytes[at] ^= 1 << random.below(8),
            1 => bytes[at] = b"\"'[]{}=.,#\n\\%$-e0"[random.below(17)],
            2 => drop(bytes.drain(at..(at + 1 + random.below(30)).min(bytes.len()))),
            3 => {
                let part = bytes[at..(at + 1 + random.below(60)).min(bytes.len())].to_vec();
                let to = random.below(bytes.len());
                bytes.splice(to..to, part);
            }
            // A value of a key, or a number, becomes another.
            _ => {
                let is_start = |i: &usize| {
                    let digit = |byte: u8| byte.is_ascii_digit();
                    bytes[*i] == b'"' || (digit(bytes[*i]) && !digit(bytes[i.saturating_sub(1)]))
                };
                if let Some(start) = (at..bytes.len()).find(is_start) {
                    let ends = if bytes[start] == b'"' { &b"\"\n"[..] } else { &b" ,]}\"\n-"[..] };
                    let end =
                        (start + 1..bytes.len()).find(|i| ends.contains(&bytes[*i])).unwrap_or(bytes.len());
                    let end = end + usize::from(bytes.get(end) == Some(&b'"') && bytes[start] == b'"');
                    let value = if random.below(3) > 0 { random.one(&ODD) } else { random.one(&PLAIN) };
                    bytes.splice(start..end, value.bytes());
                }
            }
        }
        if bytes.is_empty() {
            break;
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Runs something that may refuse, but must neither panic nor take a long time.
#[track_caller]
fn survives<R>(what: &str, work: impl FnOnce() -> R) -> R {
    let start = Instant::now();
    match catch_unwind(AssertUnwindSafe(work)) {
        Ok(result) => {
            assert!(start.elapsed() < Duration::from_secs(10), "{:?} for\n{what}", start.elapsed());
            result
        }
        Err(_) => panic!("panicked on\n{what}"),
    }
}

const SCENES: [&str; 3] = [
    "[shot]\nframes = \"1-4\"\nfps = 25\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 0.5, 0.5]\ndepth = 0.2\ncell = 0.05\n\
     noise = { amplitude = 0.01, size = 0.4, octaves = 3, seed = 2 }\n[[object]]\nfile = \"cube.obj\"\nscale = 0.5\nup = \"z\"\n\
     offset = 0\nkeys = [{ frame = 1, at = [0, 0.1, 0] }, { frame = 4, at = [0.5, 0.1, 0], turn_deg = [0, 90, 0] }]\n\
     [output]\nbase = [\"vdb\"]\nbase_mode = \"delta\"\nobjects = [\"usd\", \"ply\"]\nhalf = false\nusd = true\n",
    "[shot]\nframes = \"1-3\"\n[snow]\nground = \"cube.obj\"\ndepth = 0.1\ncell = 0.05\n[[object]]\nfile = \"seq.%04d.obj\"\n\
     offset = 0.5\nrole = \"collide\"\nnoise = false\n[[object]]\nfile = \"cube.obj\"\nrole = \"static\"\nscale = 0.3\n",
    "[shot]\nframes = \"-2-2\"\n[snow]\nground = 0\narea = [0, 0, 1, 1]\ntop = \"cube.obj\"\ncell = 0.1\n\
     [output]\nremoved = []\n[[object]]\nfile = \"seq.##.obj\"\nrole = \"ignore\"\n",
];

/// Meshes that the scenes name.
fn write_meshes(folder: &Path) {
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    (0..=4).for_each(|frame| fs::write(folder.join(format!("seq.{frame:04}.obj")), CUBE).unwrap());
}

#[test]
fn ten_thousand_changed_scenes_are_read_or_refused() {
    let folder = Folder::empty();
    write_meshes(&folder);
    let path = folder.join("shot.toml");
    let ctx = Context::new(Pool::new(1).unwrap());
    let mut random = Dice(1);
    let (mut read, mut checked) = (0, 0);
    for round in 0..ROUNDS {
        let text = mutated(&mut random, SCENES[round % SCENES.len()]);
        survives(&text, || {
            let Ok(scene) = Scene::parse(&text, &path, &[]) else { return };
            read += 1;
            // What is written is read back as the same.
            let resolved = Scene::parse(&scene.to_toml(), &path, &[]).expect(&text);
            assert_eq!(resolved.to_toml(), scene.to_toml());
            // A shot of a million frames may take its time.
            if scene.shot().frames.count() > 100 {
                return;
            }
            let Ok(inputs) = Inputs::load(&scene) else { return };
            let _ = check_memory(&scene, &inputs, 1 << 28);
            checked += usize::from(check::check(&ctx, &scene, &inputs, None).is_ok());
        });
    }
    assert!(read > ROUNDS / 50 && checked > ROUNDS / 100, "{read} read, {checked} checked");
}

#[test]
fn scenes_that_panicked_are_refused() {
    for index in ["172", "602", "906"] {
        let Some(path) = character::data(&format!("broken/toml_{index}.toml")) else {
            skipped("no data");
            return;
        };
        let folder = Folder::empty();
        write_meshes(&folder);
        let text = fs::read_to_string(&path).unwrap();
        fs::write(folder.join("shot.toml"), &text).unwrap();
        fs::copy(folder.join("cube.obj"), folder.join("egg.obj")).unwrap();
        works(&folder, "vdb from-mesh cube.obj --cell 0.016 -o x.vdb");
        fails(&folder, "snow shot.toml -o out", 2, &["seq.%"]);
        fails(&folder, "check shot.toml", 2, &["seq.%"]);
    }
}

/// A value with one of its parts changed.
fn changed(random: &mut Dice, value: &mut Value) {
    match value {
        Value::Object(map) if !map.is_empty() && random.below(8) > 0 => {
            let at = random.below(map.len());
            changed(random, map.values_mut().nth(at).unwrap());
        }
        Value::Array(items) if !items.is_empty() && random.below(4) > 0 => match random.below(4) {
            0 => items.push(items[0].clone()),
            1 => drop(items.remove(random.below(items.len()))),
            _ => {
                let at = random.below(items.len());
                changed(random, &mut items[at]);
            }
        },
        Value::String(text) if random.below(2) == 0 && !text.is_empty() => *text = mutated(random, text),
        other => {
            let odd = random.one(&ODD);
            *other =
                serde_json::from_str(odd).unwrap_or_else(|_| Value::String(odd.trim_matches('"').into()));
        }
    }
}

#[test]
fn ten_thousand_changed_records_are_used_or_refused() {
    let folder = Folder::empty();
    write_meshes(&folder);
    let path = folder.join("shot.toml");
    fs::write(&path, SCENES[0]).unwrap();
    works(&folder, "snow shot.toml -o out -q --set output.half=true --set output.base_mode=full");
    let (scene, out) = (folder.join("out/scene.toml"), folder.join("out"));
    // Beside the first folder: the paths in it are relative.
    let half = folder.join("half");
    fs::create_dir(&half).unwrap();
    fs::copy(&scene, half.join("half.toml")).unwrap();
    let scene = Scene::read(&half.join("half.toml")).unwrap();
    let inputs = Inputs::load(&scene).unwrap();
    let ctx = Context::new(Pool::new(1).unwrap());
    let mut random = Dice(2);
    let names = ["base.json", "base.0003.json", "files.json", "base.0004.json"];
    let precious = folder.join("precious");
    fs::write(&precious, "mine").unwrap();
    let all: FrameChoice = scene.shot().frames.into();
    let some = FrameChoice::from("2-3".parse::<frazil::scene::Frames>().unwrap());
    let mut refused = 0;
    for round in 0..ROUNDS {
        let record = out.join("state").join(names[round % names.len()]);
        let whole = fs::read_to_string(&record).unwrap();
        // One in two is sealed again: somebody made it so on purpose.
        let text = if round % 8 < 4 {
            mutated(&mut random, &whole)
        } else {
            let mut content = serde_json::from_str::<Value>(&whole).unwrap()["content"].take();
            changed(&mut random, &mut content);
            checksummed::to_text(&content).unwrap()
        };
        fs::write(&record, &text).unwrap();
        survives(&text, || {
            refused += usize::from(Rebuild::open(&out).is_err());
            if round % 8 < 4 {
                let verified = verify(&ctx, &out);
                let is_named = |file: &str| record.ends_with(file);
                let named = verified
                    .map_or(true, |verified| verified.damaged.iter().any(|damage| is_named(&damage.file)));
                assert!(named || text == whole, "{text}");
                return;
            }
            // All that a run looks at before it changes anything; that takes its time.
            if round % 40 >= 8 {
                return;
            }
            let frames = if round % 3 == 0 { &some } else { &all };
            let from = [3, 4].get(random.below(40)).copied();
            drop(Run::prepare(&ctx, &snow::pipeline(&scene, &inputs), &out, &[], frames, from));
        });
        assert!(precious.exists());
        fs::write(&record, &whole).unwrap();
        if round % 500 == 0
            || !out.join("base/base.0004.vdb").exists()
            || !out.join("state/base.0004.vdb").exists()
        {
            // A run that could resume from a frame has removed what comes after it.
            let _ = fs::remove_dir_all(&out);
            works(&folder, "snow half/half.toml -o out -q");
        }
    }
    assert!(refused > ROUNDS / 8, "{refused}");
}

#[test]
fn ten_thousand_changed_states_are_refused() {
    let folder = Folder::empty();
    write_meshes(&folder);
    fs::write(folder.join("shot.toml"), SCENES[0]).unwrap();
    works(&folder, "snow shot.toml -o out -q --set output.half=true --set output.base_mode=full");
    let state = folder.join("out/state/base.0004.vdb");
    let whole = fs::read(&state).unwrap();
    let ctx = Context::new(Pool::new(1).unwrap());
    let mut random = Dice(3);
    let mut opened = Rebuild::open(&folder.join("out")).unwrap();
    for round in 0..ROUNDS {
        let mut bytes = whole.clone();
        let at = random.below(bytes.len());
        match round % 4 {
            0 => bytes.truncate(at),
            1 => bytes.extend_from_slice(&whole[at..]),
            _ => bytes[at] ^= 1 << random.below(8),
        }
        fs::write(&state, &bytes).unwrap();
        let error = survives("a state", || opened.layer(&ctx, 4).err().expect("refused").to_string());
        assert!(error.contains("base.0004.vdb"), "{error}");
    }
    fs::write(&state, &whole).unwrap();
    assert!(opened.layer(&ctx, 4).is_ok());
}

#[test]
fn ten_thousand_names_are_patterns_or_not() {
    let mut random = Dice(4);
    for _ in 0..ROUNDS {
        let name = mutated(&mut random, "proj#3/body.%04d.$F4.####.obj");
        survives(&name, || {
            let Some(pattern) = Pattern::parse(Path::new(&name)) else { return };
            for frame in [0, 1, -1, i32::MIN, i32::MAX] {
                let path = pattern.path(frame);
                assert_eq!(path.parent(), Path::new(&name).parent());
            }
        });
    }
}
