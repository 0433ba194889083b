//! The command line: one file per command.

mod check;
mod compare;
mod convert;
mod frame_results;
mod info;
mod jobs;
mod mesh;
mod new;
mod options;
mod output;
mod points;
mod preview;
mod session;
mod shell;
mod shot;
mod take;
#[cfg(feature = "vdb")]
mod vdb;

use clap::{Parser, Subcommand};
use session::{Failure, Globals, Session};
use std::process::ExitCode;

/// Volumetric effects on OpenVDB: deep snow with prints, detailed meshes that follow liquids, little liquids on terrain, swept volumes,
/// level sets, pictures.
///
/// Lengths are metres, frames are whole numbers, Y is up.
#[derive(Parser)]
#[command(name = "frazil", version, propagate_version = true, max_term_width = 110)]
#[command(
    after_help = "Example:\n  frazil snow walker.toml -o cache/ && frazil preview cache/base/base.0048.vdb -o print.png"
)]
struct Cli {
    #[command(flatten)]
    globals: Globals,
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    New(new::Args),
    Take(take::Args),
    Check(check::Args),
    Jobs(jobs::Args),
    #[cfg(feature = "vdb")]
    Snow(shot::snow::Args),
    #[cfg(feature = "vdb")]
    Surface(shot::surface::Args),
    Shallow(shot::shallow::Args),
    #[cfg(feature = "vdb")]
    Vdb(vdb::Args),
    Mesh(mesh::Args),
    Convert(convert::Args),
    Info(info::Args),
    Preview(preview::Args),
    Compare(compare::Args),
}

impl Command {
    fn run(self, session: &Session) -> Result<(), Failure> {
        match self {
            Self::New(args) => new::run(&args),
            Self::Take(args) => take::run(&args, session),
            Self::Check(args) => check::run(&args, session),
            Self::Jobs(args) => jobs::run(&args, session),
            #[cfg(feature = "vdb")]
            Self::Snow(args) => shot::snow::run(&args, session),
            #[cfg(feature = "vdb")]
            Self::Surface(args) => shot::surface::run(&args, session),
            Self::Shallow(args) => shot::shallow::run(&args, session),
            #[cfg(feature = "vdb")]
            Self::Vdb(args) => vdb::run(args, session),
            Self::Mesh(args) => mesh::run(&args, session),
            Self::Convert(args) => convert::run(&args, session),
            Self::Info(args) => info::run(args, session),
            Self::Preview(args) => preview::run(args, session),
            Self::Compare(args) => compare::run(&args, session),
        }
    }
}

/// Runs the program; no user input makes it panic or print a trace.
pub fn run() -> ExitCode {
    #[cfg(feature = "vdb")]
    if let Some(code) = frazil::vdb::reading::guard::serve(std::env::args_os().skip(1)) {
        return code.into();
    }
    session::exit::install_panic_hook();
    let ended = std::panic::catch_unwind(|| {
        let cli = match Cli::try_parse() {
            Ok(cli) => cli,
            Err(error) => return session::usage::report(&error),
        };
        match Session::start(cli.globals) {
            Ok(session) => {
                let result = cli.command.run(&session);
                session.finish(result)
            }
            Err(failure) => failure.report(),
        }
    });
    ended.unwrap_or(session::exit::FAILED).into()
}

/// The error for a file that needs a feature this program was built without.
#[cfg(not(feature = "vdb"))]
fn needs_openvdb<T>(path: &std::path::Path) -> frazil::Result<T> {
    Err(frazil::Error::file(path, "needs OpenVDB, which this frazil was built without"))
}
