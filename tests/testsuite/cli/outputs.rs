//! What commands write to: never over an input, straight into devices and pipes, patterns in file names only; and signals
//! that are answered whatever the program waits for.

use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::program::{CUBE, Folder, answer_to_sigterm, command, fails, works};

fn folder() -> Folder {
    let folder = Folder::empty();
    fs::write(folder.join("cube.obj"), CUBE).unwrap();
    let scene = "[shot]\nframes = \"1-2\"\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 0.5, 0.5]\ndepth = 0.3\ncell = 0.05\n\
                 [[object]]\nfile = \"cube.obj\"\n";
    fs::write(folder.join("shot.toml"), scene).unwrap();
    folder
}

#[test]
fn nothing_is_written_over_its_own_input() {
    let folder = folder();
    let at = |name: &str| folder.join(name);
    fs::create_dir(at("sub")).unwrap();
    std::os::unix::fs::symlink("cube.obj", at("link.obj")).unwrap();
    for output in ["cube.obj", "./sub/../cube.obj", "link.obj"] {
        fails(&folder, &format!("convert cube.obj {output} --scale 2"), 2, &[output, "input"]);
    }
    fails(&folder, "convert link.obj cube.obj --scale 2", 2, &["cube.obj", "input"]);
    assert_eq!(fs::read_to_string(at("cube.obj")).unwrap(), CUBE);
    for frame in 1..=3 {
        fs::write(at(&format!("body.{frame}.obj")), CUBE).unwrap();
    }
    fails(&folder, "convert body.%d.obj body.#.obj --frames 1-3 --scale 2", 2, &["body.1.obj", "input"]);
    assert_eq!(fs::read_to_string(at("body.1.obj")).unwrap(), CUBE);
    works(&folder, "vdb from-mesh cube.obj --cell 0.05 -o a.vdb");
    works(&folder, "vdb from-mesh cube.obj --cell 0.05 -o b.vdb");
    let before = fs::read(at("a.vdb")).unwrap();
    for line in [
        "vdb offset a.vdb --by 0.05 -o a.vdb",
        "vdb smooth a.vdb -o a.vdb",
        "vdb union b.vdb a.vdb -o a.vdb",
        "vdb displace a.vdb -o a.vdb",
    ] {
        fails(&folder, line, 2, &["a.vdb", "input"]);
        assert!(before == fs::read(at("a.vdb")).unwrap());
    }
    works(&folder, "snow shot.toml -o out -q");
    fails(&folder, "vdb rebuild out --frame 1-2 -o out/base/base.%04d.vdb", 2, &["cache's own"]);
}

#[test]
fn a_report_goes_straight_into_a_device_or_a_pipe_and_over_nothing_but_a_report() {
    let folder = folder();
    let run = |report: &str, out: Stdio| {
        let line = format!("convert cube.obj cube.stl --report {report}");
        let output = command(&folder, &line).stdout(out).output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8(output.stdout).unwrap()
    };
    // Links of the test's own: a program that replaced a device would harm the machine.
    let link = |name: &str, to: &str| std::os::unix::fs::symlink(to, folder.join(name)).unwrap();
    link("stdout", "/proc/self/fd/1");
    link("null", "/dev/null");
    assert!(run("/proc/self/fd/1", Stdio::piped()).contains("\"arguments\""));
    assert!(run("stdout", Stdio::piped()).contains("\"arguments\""));
    run("null", Stdio::piped());
    for name in ["stdout", "null"] {
        assert!(fs::symlink_metadata(folder.join(name)).unwrap().is_symlink(), "{name}");
    }
    // A file behind stdout keeps what it has.
    let behind = folder.join("behind");
    fs::write(&behind, "before\n").unwrap();
    run("stdout", fs::File::options().append(true).open(&behind).unwrap().into());
    let text = fs::read_to_string(&behind).unwrap();
    assert!(text.starts_with("before\n") && text.contains("\"arguments\""), "{text}");
    run("report.json", Stdio::piped());
    run("report.json", Stdio::piped());
    fails(&folder, "check shot.toml --report shot.toml", 2, &["shot.toml", "not the report"]);
    fails(&folder, "check shot.toml --report cube.obj", 2, &["cube.obj", "not the report"]);
    assert_eq!(fs::read_to_string(folder.join("cube.obj")).unwrap(), CUBE);
}

#[test]
fn numbers_are_looked_for_in_file_names_only() {
    for name in ["proj#3", "50%d x", "%04d", "$F4"] {
        let folder = Folder::empty();
        let inner = folder.join(name);
        fs::create_dir(&inner).unwrap();
        fs::write(inner.join("cube.obj"), CUBE).unwrap();
        fs::write(inner.join("take#3.obj"), CUBE).unwrap();
        let scene = "[shot]\nframes = \"1-2\"\n[snow]\nground = 0.0\narea = [-0.5, -0.5, 0.5, 0.5]\ndepth = 0.3\n\
                     cell = 0.05\n[[object]]\nfile = \"cube.obj\"\n[[object]]\nfile = \"take#3.obj\"\n";
        fs::write(inner.join("shot.toml"), scene).unwrap();
        let run = |arguments: &[&str]| {
            let mut command = Command::new(env!("CARGO_BIN_EXE_frazil"));
            let output = command.current_dir(folder.path()).args(arguments).output().unwrap();
            assert!(output.status.success(), "{name}: {}", String::from_utf8_lossy(&output.stderr));
        };
        let path = |file: &str| format!("{name}/{file}");
        run(&["snow", &path("shot.toml"), "-o", &path("out"), "-q"]);
        run(&["convert", &path("cube.obj"), &path("cube.stl")]);
        assert!(inner.join("cube.stl").is_file() && inner.join("out/base/base.0002.vdb").is_file());
        run(&["convert", &path("take#3.obj"), &path("b.%02d.ply")]);
        assert!(inner.join("b.01.ply").is_file());
    }
}

#[test]
fn a_number_of_a_hundred_thousand_digits_does_not_panic() {
    let folder = folder();
    for name in ["a.%99999d.obj", "a.%65535d.obj", "a.%2147483648d.obj", "a.$F99999.obj"] {
        let scene = fs::read_to_string(folder.join("shot.toml")).unwrap().replace("cube.obj", name);
        fs::write(folder.join("wide.toml"), scene).unwrap();
        fails(&folder, "snow wide.toml -o out", 2, &[name]);
        fails(&folder, &format!("convert {name} out.stl --frames 1-2"), 2, &[]);
        let sweep = format!("vdb sweep {name} --frames 1-2 --cell 0.1 -o out.vdb");
        fails(&folder, &sweep, 2, &[]);
    }
    works(&folder, "convert cube.obj wide.%99999d.stl");
    works(&folder, "snow shot.toml -o out -q");
    fails(&folder, "vdb rebuild out --frame 1-2 -o b.%99999d.vdb", 2, &["pattern"]);
}

/// Starts the program, sends SIGTERM once it is `ready`, and gives its exit code with the time that it took to answer.
fn terminate(folder: &Path, arguments: &str, ready: impl Fn() -> bool) -> (Option<i32>, Duration) {
    let mut child = command(folder, arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap();
    while !ready() {
        assert!(child.try_wait().unwrap().is_none(), "{arguments} ended by itself");
        std::thread::sleep(Duration::from_millis(5));
    }
    answer_to_sigterm(child)
}

/// The most that an answer may take (a second is promised; the machine may be busy).
const ANSWER: Duration = Duration::from_secs(3);

#[test]
fn a_signal_is_answered_while_the_program_waits_for_a_file() {
    let folder = folder();
    assert!(Command::new("mkfifo").arg(folder.join("pipe.obj")).status().unwrap().success());
    assert!(Command::new("mkfifo").arg(folder.join("pipe.toml")).status().unwrap().success());
    let scene = fs::read_to_string(folder.join("shot.toml")).unwrap().replace("cube.obj", "pipe.obj");
    fs::write(folder.join("waits.toml"), scene).unwrap();
    for line in ["snow waits.toml -o out", "check waits.toml", "convert pipe.obj a.stl", "check pipe.toml"] {
        // A reader of models may refuse a pipe at once.
        let mut child = command(&folder, line).stderr(Stdio::null()).spawn().unwrap();
        std::thread::sleep(Duration::from_millis(800));
        let ended = child.try_wait().unwrap();
        child.kill().unwrap();
        child.wait().unwrap();
        if ended.is_some_and(|ended| ended.code() == Some(2)) {
            continue;
        }
        let start = Instant::now();
        let (code, took) = terminate(&folder, line, || start.elapsed() > Duration::from_millis(800));
        assert_eq!(code, Some(143), "{line}");
        assert!(took < ANSWER, "{line}: {took:?}");
    }
}

#[test]
fn a_signal_in_the_middle_of_a_shot_leaves_whole_frames_and_nothing_begun() {
    let folder = folder();
    let fine = "--set snow.cell=0.003 --set shot.frames=1-400 --set object.1.keys=[{frame=1,at=[-0.4,0.1,0]},{frame=400,at=[0.4,0.1,0]}]";
    // A folder for each: a file of an earlier run would be taken for this one's, and the signal sent before anyone listens.
    for (out, file) in [("a", "state"), ("b", "base/base.0001.vdb"), ("c", "base/base.0004.vdb")] {
        let line = format!("snow shot.toml -o {out} -q {fine}");
        let out = folder.join(out);
        let (code, took) = terminate(&folder, &line, || out.join(file).exists());
        assert_eq!(code, Some(143), "{file}");
        assert!(took < ANSWER, "{file}: {took:?}");
        for kind in ["", "base", "removed", "state", "report"] {
            let Ok(entries) = fs::read_dir(out.join(kind)) else { continue };
            for name in entries.map(|entry| entry.unwrap().file_name()) {
                assert!(!name.to_string_lossy().ends_with(".part"), "{name:?}");
            }
        }
    }
}
