//! The `frazil` command: arguments to library calls to files.

mod cli;

fn main() -> std::process::ExitCode {
    cli::run()
}
