//! The `frazil` command.

mod cli;

fn main() -> std::process::ExitCode {
    frazil::context::return_large_arrays();
    cli::run()
}
