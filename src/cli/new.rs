//! `frazil new`: a scene to start from.

use frazil::scene::{self, keys_json, reference, template};

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
    /// With `--keys`: print JSON, for programs that build an interface from the keys.
    #[arg(long, requires = "keys")]
    json: bool,
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
    if args.json {
        return output::print(&format!("{:#}\n", keys_json(system))).or_fail();
    }
    output::print(&if args.keys { reference(system) } else { template(system) }).or_fail()
}
