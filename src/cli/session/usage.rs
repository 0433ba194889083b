//! Output of clap: help on stdout, an error as one sentence on stderr.

use super::exit;
use clap::error::{Error, ErrorKind};
use std::io::Write;

/// Prints help, version or the error; returns the exit code.
pub fn report(error: &Error) -> u8 {
    if matches!(error.kind(), ErrorKind::DisplayHelp | ErrorKind::DisplayVersion) {
        // A reader that closes the pipe early is not an error.
        let _ = write!(std::io::stdout(), "{}", error.render());
        return exit::DONE;
    }
    let text = error.render().to_string();
    if error.kind() == ErrorKind::DisplayHelpOnMissingArgumentOrSubcommand {
        exit::print_error("a command is missing; see `frazil --help`");
        return exit::REFUSED;
    }
    // clap prints a headline, maybe a list and a tip, then the usage; the first two describe the error.
    let message: Vec<&str> = text.lines().take_while(|line| !line.starts_with("Usage:")).collect();
    let message = message.join(" ");
    let message = message.strip_prefix("error:").unwrap_or(&message).trim();
    let message = message.split_once(" For more information").map_or(message, |parts| parts.0);
    let message =
        message.replace("tip:", ";").split_whitespace().collect::<Vec<_>>().join(" ").replace(" ;", ";");
    exit::print_error(&format!("{message}; see `frazil --help`"));
    exit::REFUSED
}
