//! Other programs that open what frazil writes, where they are installed: `make test-clients` installs them.

use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Runs a script and gives what it says of itself; its errors when it fails.
fn run(mut command: Command) -> Result<String, String> {
    let output = command.output().map_err(|error| error.to_string())?;
    let said = String::from_utf8_lossy(&output.stdout).into_owned();
    if output.status.success() {
        let line = said.lines().find_map(|line| line.strip_prefix("frazil: "));
        return line.map(str::to_string).ok_or(format!("it ended early: {said}"));
    }
    Err(format!("{said}\n{}", String::from_utf8_lossy(&output.stderr)))
}

/// Blender, if it is installed.
pub fn blender() -> Option<PathBuf> {
    let paths = std::env::var_os("PATH")?;
    std::env::split_paths(&paths).map(|folder| folder.join("blender")).find(|path| path.is_file())
}

/// Blender imports the base of a shot as one volume, meshes two of its frames and renders one.
pub fn blender_opens(blender: &Path, folder: &Path, first: i32, last: i32) -> Result<String, String> {
    let mut command = Command::new(blender);
    command.args(["-b", "--factory-startup", "-noaudio", "--python-exit-code", "7", "--python"]);
    command.arg(root().join("tests/clients/sequence.py")).arg("--").arg(folder);
    command.args([first.to_string(), last.to_string()]).arg(folder.join("blender.png"));
    run(command)
}

/// Blender renders a frame of a shot with the script that examples/blender has for users; says of what.
pub fn blender_renders(blender: &Path, folder: &Path, frame: i32, picture: &Path) -> Result<String, String> {
    let mut command = Command::new(blender);
    command.args(["-b", "--factory-startup", "-noaudio", "--python-exit-code", "7", "--python"]);
    command.arg(root().join("examples/blender/render_shot.py")).arg("--").arg(folder);
    command.arg(frame.to_string()).arg(picture).args(["--size", "192x108", "--samples", "8"]);
    run(command)
}

/// A Python that runs a line without an error, if there is one.
fn python_that_runs(line: &str) -> Option<PathBuf> {
    let runs = |python: &PathBuf| {
        let tried = Command::new(python).args(["-c", line]).output();
        tried.is_ok_and(|output| output.status.success())
    };
    [root().join("target/clients/bin/python"), "python3".into()].into_iter().find(runs)
}

/// A Python with usd-core, if there is one.
pub fn usd_python() -> Option<PathBuf> {
    python_that_runs("from pxr import Usd")
}

/// A Python with readers of particles, pysplashsurf and meshio, if there is one.
pub fn particles_python() -> Option<PathBuf> {
    python_that_runs("import meshio, pysplashsurf")
}

/// pysplashsurf and meshio read a file of particles and write down what they see: of each particle, in the file's order, its
/// identity (64-bit integer) and its position (three doubles).
pub fn reads_particles(python: &Path, file: &Path, records: &Path) -> Result<String, String> {
    let mut command = Command::new(python);
    command.arg(root().join("tests/clients/particles.py")).arg(file).arg(records);
    run(command)
}

/// As [`reads_particles`], of a .vdb file, with tests/ctest/full/particle_reader.cpp, in the order of the identities.
pub fn reads_vdb_particles(program: &Path, file: &Path, records: &Path) -> Result<String, String> {
    let mut command = Command::new(program);
    command.arg(file).arg(records);
    run(command)
}

/// usd-core composes a shot.
pub fn usd_composes(python: &Path, folder: &Path, first: i32, last: i32) -> Result<String, String> {
    let mut command = Command::new(python);
    command
        .arg(root().join("tests/clients/stage.py"))
        .arg(folder)
        .args([first.to_string(), last.to_string()]);
    run(command)
}

/// A Python with usd-core and the validators of NVIDIA, if there is one.
pub fn validators() -> Option<PathBuf> {
    python_that_runs("from pxr import UsdValidation; import usd_validation_nvidia")
}

/// usd-core and its validators, and NVIDIA's, find no error in a shot, and find in it all that the reports of its frames list.
pub fn usd_is_whole(python: &Path, folder: &Path) -> Result<String, String> {
    let mut command = Command::new(python);
    command.arg(root().join("tests/clients/contents.py")).arg(folder);
    run(command)
}

/// usd-core writes binary files of a mesh, of points, and of a mesh with a transform to a folder.
pub fn usd_writes(python: &Path, folder: &Path) -> Result<String, String> {
    let mut command = Command::new(python);
    command.arg(root().join("tests/clients/write_usd.py")).arg(folder);
    run(command)
}

/// usd-core reads the arrays of a mesh at a frame and finds those of a file that tests/clients/primvars.py describes.
pub fn usd_reads_arrays(
    python: &Path,
    file: &Path,
    prim: &str,
    frame: i32,
    wanted: &Path,
) -> Result<String, String> {
    let mut command = Command::new(python);
    command.arg(root().join("tests/clients/primvars.py")).arg(file).arg(prim);
    command.arg(frame.to_string()).arg(wanted);
    run(command)
}

/// usd-core reads the grains of a frame and finds the values of their records.
pub fn usd_reads_grains(python: &Path, file: &Path, records: &Path, frame: i32) -> Result<String, String> {
    let mut command = Command::new(python);
    command.arg(root().join("tests/clients/points.py")).arg(file).arg(records).arg(frame.to_string());
    run(command)
}

/// The Python in which Blender is a module, if there is one.
pub fn bpy_python() -> Option<PathBuf> {
    let python = root().join("target/clients-blender/bin/python");
    python.is_file().then_some(python)
}

/// Blender imports a shot and finds in it all that the reports of its frames list.
pub fn blender_is_whole(python: &Path, folder: &Path) -> Result<String, String> {
    let mut command = Command::new(python);
    command.arg(root().join("tests/clients/blender_contents.py")).arg(folder);
    run(command)
}

/// The script that compares a shot of OpenJD and Slurm with that of one process, if both are installed.
pub fn farm(program: &Path, folder: &Path) -> Option<Command> {
    let has_slurm = Path::new("/usr/sbin/slurmd").is_file();
    let has_openjd = root().join("target/clients/bin/openjd").is_file();
    let mut command = Command::new("/usr/bin/python3");
    command.arg(root().join("tests/clients/farm.py")).arg(program).arg(folder);
    (has_slurm && has_openjd).then_some(command)
}
