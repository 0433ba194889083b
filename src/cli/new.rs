//! `frazil new`: a scene to start from.

use frazil::scene::{self, reference, template};

use super::output;
use super::session::{Failure, OrFailure};

/// Print a commented scene to start from.
#[derive(clap::Args)]
#[command(after_help = "Example:\n  frazil new snow > shot.toml")]
pub struct Args {
    /// The system that the scene is for.
    #[arg(value_enum)]
    system: System,
    /// Print a table of all keys in Markdown instead: values, defaults, meaning.
    #[arg(long)]
    keys: bool,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum System {
    /// Objects that press into snow.
    Snow,
    /// A detailed mesh that follows a liquid.
    Surface,
    /// A little liquid on a terrain.
    Shallow,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<(), Failure> {
    let system = match args.system {
        System::Snow => scene::System::Snow,
        System::Surface => scene::System::Surface,
        System::Shallow => scene::System::Shallow,
    };
    output::print(&if args.keys { reference(system) } else { template(system) }).or_fail()
}
