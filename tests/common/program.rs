//! The program as a user runs it.

use std::ops::Deref;
use std::path::Path;
use std::process::{Child, Command, Output};
use std::time::{Duration, Instant};

/// A folder that goes with the value.
pub struct Folder(tempfile::TempDir);

impl Folder {
    pub fn empty() -> Self {
        Self(tempfile::tempdir().expect("a folder"))
    }

    pub fn path(&self) -> &Path {
        self.0.path()
    }
}

impl Deref for Folder {
    type Target = Path;

    fn deref(&self) -> &Path {
        self.path()
    }
}

impl AsRef<Path> for Folder {
    fn as_ref(&self) -> &Path {
        self.path()
    }
}

/// A cube of 0.4 m that stands on the ground, as an .obj file.
pub const CUBE: &str = "v -.2 0 -.2\nv .2 0 -.2\nv .2 .4 -.2\nv -.2 .4 -.2\nv -.2 0 .2\nv .2 0 .2\nv .2 .4 .2\nv -.2 .4 .2\n\
f 1 4 3 2\nf 5 6 7 8\nf 1 2 6 5\nf 3 4 8 7\nf 1 5 8 4\nf 2 3 7 6\n";

/// A few grains with velocities, as a .ply file that any program could have written.
pub const GRAINS: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
property float vx\nproperty float vy\nproperty float vz\nproperty int id\nend_header\n\
0 0 0 1 0 0 7\n0.5 0 0 0 2 0 8\n0 0.5 0.25 0 0 0 9\n";

/// The program in a folder, with arguments that have no spaces.
pub fn command(folder: &Path, arguments: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_frazil"));
    command.current_dir(folder).args(arguments.split_whitespace());
    command
}

/// Runs it.
pub fn frazil(folder: &Path, arguments: &str) -> Output {
    command(folder, arguments).output().unwrap()
}

/// Runs it, which must go well; what it says on stdout, then on stderr.
#[track_caller]
pub fn works(folder: &Path, arguments: &str) -> String {
    let output = frazil(folder, arguments);
    let stderr = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{arguments}: {stderr}");
    String::from_utf8(output.stdout).unwrap() + &stderr
}

/// One sentence on stderr besides warnings, with these words, and this exit code.
#[track_caller]
pub fn complains(output: &Output, code: i32, words: &[&str]) {
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(code), "{stderr}");
    let sentences: Vec<&str> = stderr
        .lines()
        .filter(|line| line.starts_with("frazil: ") && !line.starts_with("frazil: warn: "))
        .collect();
    assert_eq!(sentences.len(), 1, "{stderr}");
    words.iter().for_each(|word| assert!(sentences[0].contains(word), "no {word:?} in {stderr}"));
}

/// Runs it, which must end with this exit code and one sentence with these words.
#[track_caller]
pub fn fails(folder: &Path, arguments: &str, code: i32, words: &[&str]) {
    complains(&frazil(folder, arguments), code, words);
}

/// Sends SIGTERM to a program that runs, and gives its exit code with the time that it took to answer.
pub fn answer_to_sigterm(mut child: Child) -> (Option<i32>, Duration) {
    let sent = Instant::now();
    assert!(Command::new("kill").arg(child.id().to_string()).status().unwrap().success());
    while child.try_wait().unwrap().is_none() && sent.elapsed() < Duration::from_secs(20) {
        std::thread::sleep(Duration::from_millis(5));
    }
    let took = sent.elapsed();
    // One that does not hear must not hold up the tests.
    let _ = child.kill();
    (child.wait().unwrap().code(), took)
}

/// Starts a run and kills it when a file appears: it must not have ended by itself.
#[track_caller]
pub fn kill_at(folder: &Path, arguments: &str, file: &str) {
    let mut child = command(folder, arguments).stderr(std::process::Stdio::null()).spawn().unwrap();
    while !folder.join(file).exists() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(std::time::Duration::from_millis(1));
    }
    let _ = child.kill();
    let status = child.wait().unwrap();
    // What a signal ends has no exit code.
    assert!(status.code().is_none(), "{arguments} was not killed at {file}, but ended by itself: {status}");
}
