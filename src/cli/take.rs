//! `frazil take`: a copy of a scene with settings, in a folder beside it.

use std::path::{Component, Path, PathBuf};

use frazil::io::files::atomic;
use frazil::scene::{Override, Take};
use frazil::{Error, Result};

use super::output;
use super::session::{Failure, OrFailure, Session};
use super::shell::quoted;

/// Copy a scene with settings into a folder beside it.
///
/// Writes NAME/SCENE beside the scene: each setting replaces the value that it overrides, and all comments stay. The copy makes the same
/// output as SCENE with these settings: relative paths are changed so that they name the same files. Prints the command that runs it.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  frazil take walker.toml deep --set snow.depth=0.4 --set object.1.file=box.obj
  frazil take walker.toml seed2 --set snow.noise.seed=2 && frazil snow seed2/walker.toml -o seed2/cache")]
pub struct Args {
    /// Scene file (TOML).
    scene: PathBuf,
    /// Name of the new folder; one that exists must be empty.
    name: String,
    /// A setting of the copy, for instance snow.noise.seed=2 or object.1.file=hero.glb; files are relative to the current folder.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<Override>,
}

/// Runs the command.
pub fn run(args: &Args, session: &Session) -> std::result::Result<(), Failure> {
    refuse_paths(&args.name)?;
    let take = Take::of(&args.scene, &args.name, &args.set).or_refuse()?;
    let (path, system) = (take.scene.path(), take.scene.system().name());
    let folder = args.scene.with_file_name(&args.name);
    let is_new = prepare(&folder).or_refuse()?;
    let written = atomic::write_bytes(path, take.text.as_bytes());
    if written.is_err() && is_new {
        // The error of the file counts, not one of the cleanup.
        let _ = std::fs::remove_dir(&folder);
    }
    written.or_fail()?;
    session.record("scene", path.display().to_string().into());
    let settings: Vec<String> = args.set.iter().map(Override::to_string).collect();
    let with = if settings.is_empty() { String::new() } else { format!(" with {}", settings.join(", ")) };
    let [scene, cache] = [path, &folder.join("cache")].map(|path| quoted(&path.to_string_lossy()));
    let made = format!("{}: {}{with}\n", path.display(), args.scene.display());
    output::print(&format!("{made}frazil {system} {scene} -o {cache}\n")).or_fail()
}

/// Refuses names that are not those of a folder beside the scene.
fn refuse_paths(name: &str) -> std::result::Result<(), Failure> {
    let mut parts = Path::new(name).components();
    let is_plain =
        matches!((parts.next(), parts.next()), (Some(Component::Normal(part)), None) if part == name);
    match is_plain && !name.contains(|c: char| c == '\\' || c.is_control()) {
        true => Ok(()),
        false => Err(Failure::refused(format!(
            "\"{name}\" is not the name of a folder beside the scene, such as take_2"
        ))),
    }
}

/// Makes a folder, or accepts an empty one; returns whether it is new.
fn prepare(folder: &Path) -> Result<bool> {
    let io = |action| move |error| Error::io(folder, action, error);
    match std::fs::symlink_metadata(folder) {
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            std::fs::create_dir(folder).map_err(io("create the folder"))?;
            Ok(true)
        }
        Err(error) => Err(io("read")(error)),
        // `..` in front of a path would lead beside a link's target, not to the scene.
        Ok(metadata) if !metadata.is_dir() => {
            Err(Error::file(folder, "exists and is not a folder: choose another name"))
        }
        Ok(_) => match std::fs::read_dir(folder).map_err(io("read"))?.next() {
            Some(_) => Err(Error::file(folder, "exists and is not empty: choose another name")),
            None => Ok(false),
        },
    }
}
