//! Foreign .vdb files are decoded by another process: OpenVDB does not survive every kind of damage.
//!
//! A program that calls [`install`] is started again for each file that is not its own, with limits of memory and time. The child decodes
//! and passes the grids in shared memory; the parent copies each leaf once. A crash, an infinite loop or excessive memory use of the child
//! becomes one error message. This protects against damage, not against an attacker who controls the child.

use std::fs::File;
use std::io::Read;
use std::os::fd::OwnedFd;
use std::os::unix::process::ExitStatusExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, OnceLock};
use std::time::{Duration, Instant};

use rustix::fs::{MemfdFlags, memfd_create};

pub use super::child::serve;
use super::child::{COMMAND, Limits, PROTOCOL, Wanted};
use super::decode;
use super::mapping::Mapping;
use super::parcel::{Contents, unpack};
use crate::error::{Error, Result, one_line};
use crate::geometry::Points;
use crate::io::records::manifest;
use crate::vdb::grid::FloatGrid;
use crate::vdb::grid_info::GridInfo;
use crate::vdb::point_arrays;
use crate::vdb::vectors::AnyGrid;

/// Memory limit of a child: for any file (bytes), and for each byte of the file. Nodes above the leaves need the most memory per byte
/// (260 kB for at least 8 kB), then leaves (2.2 kB for at least 129 bytes).
const FIXED_MEMORY: u64 = 384 << 20;
const MEMORY_PER_BYTE: u64 = 64;
/// CPU time (s) of a child: for any file, and for each MB.
const FIXED_SECONDS: f64 = 2.0;
const SECONDS_PER_MB: f64 = 0.5;
/// Wall-clock limit relative to the CPU limit: a child may wait for a disk or for other work.
const WALL_PER_CPU: f64 = 8.0;
/// Polling interval of a child: at first, and later.
const POLL_INTERVALS: [Duration; 2] = [Duration::from_micros(500), Duration::from_millis(5)];
/// Maximum number of bytes kept of a child's stderr.
const MAX_STDERR: u64 = 1 << 14;

/// The guard installed in this process.
static INSTALLED: OnceLock<Guard> = OnceLock::new();

/// The program that decodes foreign files, and its limits.
#[derive(Debug, Clone)]
pub struct Guard {
    /// A program that calls [`serve`] before anything else: the `frazil` command.
    pub program: PathBuf,
    /// Memory limit for decoding a file (bytes).
    pub memory: u64,
    /// Threads that build grids from the decoded data.
    pub threads: usize,
    /// Set to stop: the child is killed, and the call returns [`Error::Cancelled`].
    pub cancel: Arc<AtomicBool>,
}

/// From now on [`crate::vdb::file`] decodes foreign files through this guard, in the whole process: for programs. Only the first call has
/// an effect.
pub fn install(guard: Guard) {
    let _ = INSTALLED.set(guard);
}

/// The guard for a file: none if no guard is installed, or if the file is our own, known by the hash in its shot's record.
pub(in crate::vdb) fn of(path: &Path) -> Option<&'static Guard> {
    INSTALLED.get().filter(|_| !manifest::is_recorded(path))
}

impl Guard {
    /// As [`crate::vdb::file::describe`].
    ///
    /// # Errors
    /// As [`crate::vdb::file::describe`]; [`Error::Cancelled`]; a program that cannot be started.
    pub fn describe(&self, path: &Path) -> Result<Vec<GridInfo>> {
        match self.decode_in_child(path, Wanted::Infos)? {
            Contents::Infos(infos) => Ok(infos),
            _ => Err(unexpected(path)),
        }
    }

    /// As [`crate::vdb::file::read`].
    ///
    /// # Errors
    /// As [`Guard::describe`].
    pub fn read(&self, path: &Path) -> Result<Vec<FloatGrid>> {
        self.grids(path, Wanted::All)?.into_iter().map(|grid| floats(path, grid)).collect()
    }

    /// As [`crate::vdb::file::read_named`].
    ///
    /// # Errors
    /// As [`Guard::describe`].
    pub fn read_named(&self, path: &Path, name: Option<&str>) -> Result<FloatGrid> {
        floats(path, self.one(path, Wanted::Floats(name))?)
    }

    /// As [`crate::vdb::file::read_nth`].
    ///
    /// # Errors
    /// As [`Guard::describe`].
    pub fn read_nth(&self, path: &Path, index: usize) -> Result<FloatGrid> {
        floats(path, self.one(path, Wanted::Nth(index))?)
    }

    /// As [`crate::vdb::file::read_any`].
    ///
    /// # Errors
    /// As [`Guard::describe`].
    pub fn read_any(&self, path: &Path, name: Option<&str>) -> Result<AnyGrid> {
        self.one(path, Wanted::Any(name))
    }

    /// As [`crate::vdb::points::read`].
    ///
    /// # Errors
    /// As [`Guard::describe`].
    pub fn read_points(&self, path: &Path, name: Option<&str>) -> Result<Points> {
        match self.decode_in_child(path, Wanted::Points(name))? {
            Contents::Points(points, skipped) => {
                point_arrays::warn_of_skipped(path, &skipped);
                Ok(points)
            }
            _ => Err(unexpected(path)),
        }
    }

    fn one(&self, path: &Path, wanted: Wanted<'_>) -> Result<AnyGrid> {
        self.grids(path, wanted)?.into_iter().next().ok_or_else(|| unexpected(path))
    }

    fn grids(&self, path: &Path, wanted: Wanted<'_>) -> Result<Vec<AnyGrid>> {
        match self.decode_in_child(path, wanted)? {
            Contents::Grids(grids) => Ok(grids),
            _ => Err(unexpected(path)),
        }
    }

    /// Decodes a file in a child.
    fn decode_in_child(&self, path: &Path, wanted: Wanted<'_>) -> Result<Contents> {
        // Errors that can be found without OpenVDB need no child.
        decode::check(path)?;
        let length = std::fs::metadata(path).map_err(|error| Error::io(path, "read", error))?.len();
        let memory = FIXED_MEMORY.saturating_add(length.saturating_mul(MEMORY_PER_BYTE)).min(self.memory);
        let seconds = FIXED_SECONDS + length as f64 * 1e-6 * SECONDS_PER_MB;
        let limits = Limits { memory, seconds: seconds.ceil() as u64 };
        let shared = memfd_create("frazil-vdb", MemfdFlags::CLOEXEC)
            .map_err(|error| Error::io(path, "share memory to read", error.into()))?;
        let (status, stderr_text) = self.run(path, wanted, limits, &shared)?;
        let file = File::from(shared);
        // SAFETY: the child has ended, and nobody else can access the file.
        let parcel = unsafe { Mapping::new(&file) }.ok();
        let contents = parcel.as_ref().and_then(|parcel| unpack(parcel, self.threads));
        let warnings = || stderr_text.lines().map(one_line).filter(|line| !line.is_empty());
        match contents {
            Some(Contents::Refusal(what)) => Err(Error::file(path, what)),
            Some(contents) => {
                warnings().for_each(|line| log::warn!("{}: {line}", path.display()));
                Ok(contents)
            }
            None => {
                warnings().for_each(|line| log::info!("{}: {line}", path.display()));
                Err(self.failure(path, status, &stderr_text, limits))
            }
        }
    }

    /// Runs a child to its end; returns its exit status and output.
    fn run(
        &self,
        path: &Path,
        wanted: Wanted<'_>,
        limits: Limits,
        shared: &OwnedFd,
    ) -> Result<(Option<ExitStatus>, String)> {
        let input = shared.try_clone().map_err(|error| Error::io(path, "share memory to read", error))?;
        let mut child = Command::new(&self.program)
            .args([COMMAND, PROTOCOL, &limits.memory.to_string(), &limits.seconds.to_string()])
            .args(wanted.arguments())
            .arg(path)
            // Each malloc arena, one for each thread, takes 64 MB of address space.
            .env("MALLOC_ARENA_MAX", "1")
            .stdin(Stdio::from(input))
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .map_err(|error| Error::io(&self.program, "start", error))?;
        let stderr = child.stderr.take();
        let stderr_text = std::thread::spawn(move || stderr.map(first_bytes).unwrap_or_default());
        let ended = self.wait(&mut child, limits);
        let stderr_text = stderr_text.join().unwrap_or_default();
        Ok((ended?, stderr_text))
    }

    /// Waits for a child; kills it if it takes too long or the flag is set. None if other code in this process has already collected its
    /// status.
    fn wait(&self, child: &mut Child, limits: Limits) -> Result<Option<ExitStatus>> {
        let start = Instant::now();
        let kill = |child: &mut Child| {
            let _ = child.kill();
            child.wait().ok()
        };
        loop {
            match child.try_wait() {
                Ok(None) => {}
                Ok(status) => return Ok(status),
                Err(_) => return Ok(None),
            }
            if self.cancel.load(Ordering::Relaxed) {
                kill(child);
                return Err(Error::Cancelled);
            }
            let waited = start.elapsed();
            if waited.as_secs_f64() > limits.seconds as f64 * WALL_PER_CPU {
                return Ok(kill(child));
            }
            std::thread::sleep(POLL_INTERVALS[usize::from(waited > Duration::from_millis(200))]);
        }
    }

    /// The error for a child that left no parcel (its result, `parcel.rs`).
    fn failure(&self, path: &Path, status: Option<ExitStatus>, stderr_text: &str, limits: Limits) -> Error {
        const TERMINATED: [i32; 3] = [1, 2, 15];
        const KILLED: i32 = 9;
        const CPU_TIME: i32 = 24;
        const FILE_SIZE: i32 = 25;
        let memory = ["bad_alloc", "memory allocation of", "Cannot allocate memory", "No space left"];
        if memory.iter().any(|text| stderr_text.contains(text)) {
            let what = format!(
                "the .vdb file is damaged, or needs more memory than the {} MB that decoding it may take",
                limits.memory / 1_000_000
            );
            return Error::file(path, what);
        }
        let signal = status.and_then(|status| status.signal());
        // Ctrl-C reaches every process of a terminal.
        if signal.is_some_and(|signal| TERMINATED.contains(&signal)) {
            return Error::Cancelled;
        }
        Error::file(
            path,
            match signal {
                Some(CPU_TIME | KILLED) => {
                    format!("the .vdb file is damaged: decoding it does not end within {} s", limits.seconds)
                }
                Some(FILE_SIZE) => "decoding it takes larger files than `ulimit -f` allows".to_string(),
                Some(_) => "the .vdb file is damaged: decoding it makes OpenVDB crash".to_string(),
                None => format!(
                    "cannot be decoded by {}, which is not frazil of version {}",
                    self.program.display(),
                    env!("CARGO_PKG_VERSION")
                ),
            },
        )
    }
}

/// The first bytes from a pipe; the rest is read and discarded, so that the writer never blocks.
fn first_bytes(mut pipe: impl Read) -> String {
    let mut kept = Vec::new();
    let _ = pipe.by_ref().take(MAX_STDERR).read_to_end(&mut kept);
    let _ = std::io::copy(&mut pipe, &mut std::io::sink());
    String::from_utf8_lossy(&kept).into_owned()
}

/// Rejects a grid that is not of floats.
fn floats(path: &Path, grid: AnyGrid) -> Result<FloatGrid> {
    grid.floats().ok_or_else(|| unexpected(path))
}

/// The error for a parcel that is complete but has other contents than requested.
fn unexpected(path: &Path) -> Error {
    Error::file(path, "the .vdb file is damaged: decoding it gave no usable result")
}
