//! Shared by all commands: threads, signals, verbosity, the report of a run.

pub(in crate::cli) mod exit;
#[cfg(feature = "vdb")]
pub(in crate::cli) mod machine;
mod signals;
pub(in crate::cli) mod usage;

use super::output;
pub use exit::{Failure, OrFailure};
use frazil::context::{PhaseTime, Phases, peak_memory};
#[cfg(feature = "vdb")]
use frazil::vdb::reading::guard::{self, Guard};
use frazil::{Context, Pool};
use serde_json::{Map, Value, json};
use signals::Signals;
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::Instant;

/// Options of every command.
#[derive(clap::Args)]
pub struct Globals {
    /// Worker threads [default: one per core]; the output does not depend on it.
    #[arg(long, value_name = "N", global = true, value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,
    /// Refuse work that would need more memory, for example 8G, 512M or 50%.
    #[cfg(feature = "vdb")]
    #[arg(long, value_name = "SIZE", global = true, default_value = "80%")]
    max_memory: machine::Amount,
    /// Print nothing but errors.
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub quiet: bool,
    /// Print what is read and how long each phase takes; twice: everything.
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    pub verbose: u8,
    /// Write times, memory and results of this run as JSON.
    #[arg(long, value_name = "FILE", global = true)]
    pub report: Option<PathBuf>,
}

/// One run of the program.
pub struct Session {
    /// Threads, cancel flag, phase times.
    pub ctx: Context,
    /// All phases of the run.
    phases: Phases,
    globals: Globals,
    signals: Signals,
    start: Instant,
    results: Mutex<Map<String, Value>>,
}

impl Session {
    /// Starts threads and signal handlers, and does the checks that do not depend on the command.
    pub fn start(globals: Globals) -> Result<Self, Failure> {
        start_log(&globals);
        let pool = match globals.threads {
            Some(threads) => Pool::new(threads.into()),
            None => Pool::all_cores(),
        };
        let ctx = Context::new(pool.or_refuse()?);
        let phases = ctx.collect();
        let signals = Signals::install(ctx.cancel_flags())
            .map_err(|error| Failure::refused(format!("cannot install signal handlers: {error}")))?;
        let [cancel, _] = ctx.cancel_flags();
        frazil::io::files::source::stop_when(cancel.clone());
        #[cfg(feature = "vdb")]
        guard::install(Guard {
            // The running program, even if its file was replaced meanwhile.
            program: "/proc/self/exe".into(),
            memory: globals.max_memory.bytes(),
            threads: ctx.pool().threads(),
            cancel,
        });
        if let Some(path) = &globals.report {
            output::check_report(path).or_refuse()?;
        }
        Ok(Self { ctx, phases, globals, signals, start: Instant::now(), results: Mutex::default() })
    }

    /// Memory limit of the work (bytes).
    #[cfg(feature = "vdb")]
    pub fn max_memory(&self) -> u64 {
        self.globals.max_memory.bytes()
    }

    /// Memory limit of the work (bytes): four fifths of the machine's.
    #[cfg(not(feature = "vdb"))]
    pub fn max_memory(&self) -> u64 {
        frazil::context::machine_memory().map_or(u64::MAX, |bytes| bytes / 5 * 4)
    }

    /// Whether only errors are printed.
    pub fn is_quiet(&self) -> bool {
        self.globals.quiet
    }

    /// Adds a result to the report of this run.
    pub fn record(&self, key: &str, value: Value) {
        self.results.lock().expect("no panic holds this lock").insert(key.to_string(), value);
    }

    /// Writes the report, prints the error if there is one, and returns the exit code.
    pub fn finish(&self, result: Result<(), Failure>) -> u8 {
        let result = match (&self.globals.report, result) {
            (Some(path), Ok(())) => self.write_report(path).or_fail(),
            (_, result) => result,
        };
        match (result, self.signals.received()) {
            (Ok(()), _) => exit::DONE,
            (Err(_), Some(code)) => {
                exit::print_stopped(code);
                code
            }
            (Err(failure), None) => failure.report(),
        }
    }

    fn write_report(&self, path: &std::path::Path) -> frazil::Result<()> {
        let phases: Vec<Value> = self.phases.times().iter().map(phase_json).collect();
        let mut report = self.results.lock().expect("no panic holds this lock").clone();
        // A file's name need not be UTF-8.
        let readable = |argument: std::ffi::OsString| argument.to_string_lossy().into_owned();
        let arguments: Vec<String> = std::env::args_os().skip(1).map(readable).collect();
        report.insert("arguments".into(), json!(arguments));
        report.insert("version".into(), json!(env!("CARGO_PKG_VERSION")));
        report.insert("threads".into(), json!(self.ctx.pool().threads()));
        report.insert("seconds".into(), json!(self.start.elapsed().as_secs_f64()));
        report.insert("peak_memory_bytes".into(), json!(peak_memory()));
        if !phases.is_empty() {
            report.insert("phases".into(), json!(phases));
        }
        output::write_json(path, &Value::Object(report))
    }
}

fn phase_json(phase: &PhaseTime) -> Value {
    json!({ "name": phase.name, "seconds": phase.time.as_secs_f64(), "count": phase.count })
}

fn start_log(globals: &Globals) {
    let level = match (globals.quiet, globals.verbose) {
        (true, _) => log::LevelFilter::Error,
        (_, 0) => log::LevelFilter::Warn,
        (_, 1) => log::LevelFilter::Info,
        _ => log::LevelFilter::Trace,
    };
    env_logger::Builder::new()
        .filter_level(level)
        .format(|out, record| {
            use std::io::Write;
            let text = frazil::error::visible(&record.args().to_string()).replace('\n', " ");
            writeln!(out, "frazil: {}: {text}", record.level().as_str().to_lowercase())
        })
        .init();
}
