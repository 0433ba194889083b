//! `frazil jobs`: the tasks of a shot for a farm.

mod openjd;
mod slurm;

use std::path::{Path, PathBuf};

use frazil::scene::run::Pipeline;
use frazil::scene::{Override, Scene, System, shallow};

use super::output;
use super::session::{Failure, OrFailure, Session};
use super::shell::quoted;

/// Print the tasks of a shot for a farm: one that prepares the folder, one for each stage that goes from frame to frame, chunks of the
/// stages whose frames do not depend on each other, and one that finishes.
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  frazil jobs walker.toml -o cache/ --for slurm --chunk 12 > submit.sh
  frazil jobs walker.toml -o cache/ --for openjd > walker.json")]
pub struct Args {
    /// Scene file (TOML).
    scene: PathBuf,
    /// Folder for the output, under the same path on all machines.
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// The farm.
    #[arg(long = "for", value_name = "FARM", value_enum, default_value = "list")]
    farm: Farm,
    /// Frames of a chunk.
    #[arg(long, value_name = "N", default_value = "24", value_parser = clap::value_parser!(u16).range(1..))]
    chunk: u16,
    /// Path of frazil on the machines of the farm.
    #[arg(long, value_name = "PATH", default_value = "frazil")]
    program: String,
    /// Override a setting of the scene, for instance snow.noise.seed=2 or object.1.file=hero.glb.
    #[arg(long, value_name = "KEY=VALUE")]
    set: Vec<Override>,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum Farm {
    /// For people and other farms, a line for each task: its name, the tasks that it depends on (a,b or -), and its command.
    List,
    /// A shell script that submits to Slurm.
    Slurm,
    /// A job template of Open Job Description, for Deadline Cloud and others.
    Openjd,
}

/// A task of a job.
struct Task {
    name: String,
    /// The tasks that it depends on.
    after: Vec<String>,
    /// Program and arguments; those of a chunk without its frames.
    command: Vec<String>,
    /// First and last frames of its chunks; none if it is one command.
    chunks: Vec<[i32; 2]>,
}

/// How long a task waits (s) for another that still writes into the folder, for instance one that the farm believes dead.
const WAIT: &str = "600";

/// Runs the command.
pub fn run(args: &Args, session: &Session) -> Result<(), Failure> {
    let scene = Scene::read_with(&args.scene, &args.set).or_refuse()?;
    let tasks = args.tasks(session, &scene)?;
    let name = args.scene.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let text = match args.farm {
        Farm::List => tasks.iter().map(listed).collect(),
        Farm::Slurm => slurm::script(&name, &tasks),
        Farm::Openjd => openjd::template(&name, &tasks).map_err(Failure::refused)?,
    };
    output::print(&text).or_fail()
}

impl Args {
    fn tasks(&self, session: &Session, scene: &Scene) -> Result<Vec<Task>, Failure> {
        match scene.system() {
            System::Shallow => {
                let inputs = shallow::Inputs::load(&session.ctx, scene).or_refuse()?;
                let pipeline = shallow::pipeline(&session.ctx, scene, &inputs).or_refuse()?;
                self.tasks_of("shallow", &pipeline, scene)
            }
            #[cfg(feature = "vdb")]
            System::Snow => {
                let inputs = frazil::scene::Inputs::load(scene).or_refuse()?;
                self.tasks_of("snow", &frazil::scene::snow::pipeline(scene, &inputs), scene)
            }
            #[cfg(feature = "vdb")]
            System::Surface => {
                use frazil::scene::surface;
                let inputs = surface::Inputs::load(&session.ctx, scene).or_refuse()?;
                self.tasks_of("surface", &surface::pipeline(scene, &inputs).or_refuse()?, scene)
            }
            #[cfg(not(feature = "vdb"))]
            _ => super::needs_openvdb(&self.scene).or_refuse(),
        }
    }

    /// The tasks of a pipeline, in an order in which they can be run one by one.
    fn tasks_of(&self, system: &str, pipeline: &Pipeline<'_>, scene: &Scene) -> Result<Vec<Task>, Failure> {
        let command = self.command(system)?;
        let with =
            |more: &[&str]| command.iter().cloned().chain(more.iter().map(|part| part.to_string())).collect();
        let stages: Vec<(&str, bool)> =
            pipeline.stages().map(|stage| (stage.name(), stage.has_memory())).collect();
        let of_stage =
            |stage: &str| if stages.len() > 1 { vec!["--stage".to_string(), stage.into()] } else { vec![] };
        let task = |name: &str, after: &[String], command: Vec<String>| Task {
            name: name.into(),
            after: after.to_vec(),
            command,
            chunks: Vec::new(),
        };
        let mut tasks = vec![task("prepare", &[], with(&["--prepare", "--wait", WAIT]))];
        let mut before = vec!["prepare".to_string()];
        // These hold the folder alone, one after another.
        for (stage, _) in stages.iter().filter(|(_, has_memory)| *has_memory) {
            let mut command = with(&["--wait", WAIT]);
            command.extend(of_stage(stage));
            tasks.push(task(stage, &before, command));
            before = vec![stage.to_string()];
        }
        let shot = scene.shot().frames;
        let starts = (shot.first..=shot.last).step_by(self.chunk.into());
        let chunks: Vec<[i32; 2]> =
            starts.map(|first| [first, shot.last.min(first + i32::from(self.chunk) - 1)]).collect();
        let mut last = before.clone();
        for (stage, _) in stages.iter().filter(|(_, has_memory)| !has_memory) {
            let mut command = with(&["--chunk", "--wait", WAIT, "--stage"]);
            command.extend([stage.to_string(), "--frames".into()]);
            tasks.push(Task { chunks: chunks.clone(), ..task(stage, &before, command) });
            last.push(stage.to_string());
        }
        // The chunks depend on it already.
        if last.len() > 1 {
            last.retain(|name| !before.contains(name));
        }
        tasks.push(task("finish", &last, with(&["--finish", "--wait", WAIT])));
        Ok(tasks)
    }

    /// The command of a run, with paths that do not depend on the folder it is started in.
    fn command(&self, system: &str) -> Result<Vec<String>, Failure> {
        let absolute = |path: &Path| -> Result<String, Failure> {
            let absolute = std::path::absolute(path).map_err(|error| Failure::of_file(path, error))?;
            let text = absolute.to_str().map(String::from);
            text.ok_or_else(|| Failure::of_file(path, "its name is not UTF-8, which a farm cannot hold"))
        };
        let (scene, output) = (absolute(&self.scene)?, absolute(&self.output)?);
        let mut command = vec![self.program.clone(), system.into(), scene, "-o".into(), output];
        for setting in &self.set {
            command.extend(["--set".to_string(), setting.to_string()]);
        }
        Ok(command)
    }
}

impl Task {
    /// Its commands: one for each chunk.
    fn commands(&self) -> Vec<Vec<String>> {
        let of_chunk = |[first, last]: &[i32; 2]| {
            self.command.iter().cloned().chain([format!("{first}-{last}")]).collect()
        };
        match self.chunks.is_empty() {
            true => vec![self.command.clone()],
            false => self.chunks.iter().map(of_chunk).collect(),
        }
    }
}

/// The lines of a task.
fn listed(task: &Task) -> String {
    let line = |command: Vec<String>| {
        let words: Vec<String> = command.iter().map(|word| quoted(word)).collect();
        let after = if task.after.is_empty() { "-".into() } else { task.after.join(",") };
        format!("{} {after} {}\n", task.name, words.join(" "))
    };
    task.commands().into_iter().map(line).collect()
}
