//! How soon an answer comes: to a signal while a body is prepared and while files are read, to a cancel while a decoder hangs.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

use crate::program::{CUBE, Folder, answer_to_sigterm, command, complains, works};
use crate::turn;
use frazil::geometry::{TriMesh, Vec3};
use frazil::vdb::reading::guard::Guard;

/// The most that an answer may take (a second is promised; the machine may be busy). Work that is left to notice the signal
/// by itself takes up to 2.3 s here.
const ANSWER: Duration = Duration::from_millis(1500);

/// Starts the program, sends SIGTERM after a while, and gives its exit code with the time that it took to answer; none when
/// it had ended.
fn terminate(folder: &Path, arguments: &str, after: Duration) -> Option<(Option<i32>, Duration)> {
    let mut child = command(folder, arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    std::thread::sleep(after);
    if child.try_wait().unwrap().is_some() {
        return None;
    }
    Some(answer_to_sigterm(child))
}

/// Sends SIGTERM at ever later times, until the program has ended by itself or a while has passed; how often it was sent.
fn terminate_all_along(folder: &Path, arguments: &str, step: Duration, most: u32) -> u32 {
    for number in 1..=most {
        let after = step * number;
        match terminate(folder, arguments, after) {
            None => return number - 1,
            // It ended by itself just then; one that is deaf to signals does so at the first.
            Some((Some(0), _)) => return number - 1,
            Some((code, took)) => {
                assert_eq!(code, Some(143), "{arguments} after {after:?}");
                assert!(took < ANSWER, "{arguments} after {after:?} answered in {took:?}");
            }
        }
    }
    most
}

/// A sheet of so many squares each way, all of it open at its rim.
fn sheet(n: u32) -> TriMesh {
    let position = |i: u32| {
        Vec3::new((i / (n + 1)) as f32, ((i * 7919) % 13) as f32 * 0.01, (i % (n + 1)) as f32) * 0.001
    };
    let square = |i: u32| {
        let a = i / n * (n + 1) + i % n;
        [[a, a + 1, a + n + 1], [a + 1, a + n + 2, a + n + 1]]
    };
    TriMesh {
        positions: (0..(n + 1) * (n + 1)).map(position).collect(),
        triangles: (0..n * n).flat_map(square).collect(),
    }
}

#[test]
fn a_signal_is_answered_while_a_body_is_prepared() {
    let _turn = turn();
    let folder = Folder::empty();
    frazil::io::mesh::write(&folder.join("sheet.ply"), &sheet(1200)).unwrap();
    let scene = "[shot]\nframes = \"1-2\"\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 0.5, 0.5]\ndepth = 0.3\n\
                 cell = 0.05\n[[object]]\nfile = \"sheet.ply\"\n";
    fs::write(folder.join("shot.toml"), scene).unwrap();
    let sent = terminate_all_along(&folder, "check shot.toml", Duration::from_millis(600), 5);
    assert!(sent >= 2, "the sheet was prepared before the signals came: {sent}");
}

#[test]
fn a_signal_is_answered_while_a_shot_reads_its_own_files() {
    let _turn = turn();
    let folder = Folder::empty();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    let scene = "[shot]\nframes = \"1-2\"\n[snow]\nground = 0.0\narea = [-4, -4, 4, 4]\ndepth = 0.3\ncell = 0.008\n\
                 [[object]]\nfile = \"cube.obj\"\n";
    fs::write(folder.join("shot.toml"), scene).unwrap();
    works(&folder, "snow shot.toml -o out -q --frames 1");
    // The second frame continues from the first one's file.
    let sent = terminate_all_along(&folder, "snow shot.toml -o out -q", Duration::from_millis(250), 6);
    assert!(sent >= 2, "the layer was read before the signals came: {sent}");
    works(&folder, "check out");
}

/// Starts the program, sends it SIGTERM after a while, and waits for it.
fn interrupted(folder: &Path, arguments: &str, after: Duration) -> (Output, Duration) {
    let mut command = command(folder, arguments);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    std::thread::sleep(after);
    let signal = Instant::now();
    Command::new("kill").args(["-TERM", &child.id().to_string()]).status().unwrap();
    (child.wait_with_output().unwrap(), signal.elapsed())
}

#[test]
fn a_signal_is_answered_while_a_file_is_read() {
    let _turn = turn();
    let folder = Folder::empty();
    let mut text = String::new();
    (0..6_000_000).for_each(|i| text += &format!("v {i} 0 0\n"));
    text += "f 1 2 3\n";
    fs::write(folder.join("large.obj"), text).unwrap();
    let (output, waited) = interrupted(&folder, "info large.obj", Duration::from_millis(400));
    assert!(waited < Duration::from_secs(1), "{waited:?}");
    complains(&output, 143, &["terminated"]);
}

#[test]
fn a_cancel_ends_a_decoder_that_hangs() {
    let _turn = turn();
    let folder = Folder::empty();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    works(&folder, "vdb from-mesh cube.obj --cell 0.02 -o cube.vdb");
    let program = folder.join("program");
    fs::write(&program, "#!/bin/sh\nexec sleep 100\n").unwrap();
    fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    let guard = Guard { program, memory: u64::MAX, threads: 2, cancel: Arc::default() };
    let cancel = guard.cancel.clone();
    let start = Instant::now();
    std::thread::spawn(move || {
        std::thread::sleep(Duration::from_millis(300));
        cancel.store(true, Ordering::Relaxed);
    });
    let path = folder.join("cube.vdb");
    assert!(matches!(guard.describe(&path), Err(frazil::Error::Cancelled)));
    assert!(start.elapsed() < Duration::from_secs(1), "{:?}", start.elapsed());
}
