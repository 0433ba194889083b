//! The process that decodes a foreign file: it limits its own resources, reads the file and writes a parcel into the file that is its
//! standard input.

use std::ffi::OsString;
use std::fs::File;
use std::os::fd::AsFd;
use std::path::{Path, PathBuf};

use rustix::process::{Resource, Rlimit, Signal, getrlimit, set_parent_process_death_signal, setrlimit};

use super::decode;
use super::parcel::{Contents, pack};
use crate::error::{Error, Result, one_line};
use crate::vdb::vectors::AnyGrid;

/// First argument of a program that is started to decode.
pub(in crate::vdb) const COMMAND: &str = "decode-vdb-for-another-process";
/// Version of the arguments and of parcels: it must be the same on both sides.
pub(in crate::vdb) const PROTOCOL: &str = concat!("5-", env!("CARGO_PKG_VERSION"));

/// What to read from a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::vdb) enum Wanted<'a> {
    Infos,
    All,
    /// The grid of floats of this name; none: the first.
    Floats(Option<&'a str>),
    /// The grid of floats with this index.
    Nth(usize),
    /// As `Floats`, but the grid may be of floats or vectors.
    Any(Option<&'a str>),
    Points(Option<&'a str>),
}

impl<'a> Wanted<'a> {
    /// As two arguments.
    pub(in crate::vdb) fn arguments(&self) -> [String; 2] {
        let (kind, name) = match self {
            Self::Infos => ("infos", None),
            Self::All => ("all", None),
            Self::Floats(name) => ("floats", *name),
            Self::Nth(index) => return ["nth".into(), index.to_string()],
            Self::Any(name) => ("any", *name),
            Self::Points(name) => ("points", *name),
        };
        [kind.into(), name.map(|name| format!("={name}")).unwrap_or_default()]
    }

    /// From two arguments.
    fn of(kind: &str, name: &'a str) -> Option<Self> {
        let named = name.strip_prefix('=');
        Some(match kind {
            "infos" => Self::Infos,
            "all" => Self::All,
            "floats" => Self::Floats(named),
            "nth" => Self::Nth(name.parse().ok()?),
            "any" => Self::Any(named),
            "points" => Self::Points(named),
            _ => return None,
        })
    }
}

/// Limits of the process.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::vdb) struct Limits {
    /// Address space beyond what the program uses at its start (bytes).
    pub memory: u64,
    /// CPU time (s).
    pub seconds: u64,
}

/// Decodes, if the program was started for this: call it before anything else, with the arguments after the program's name. Returns the
/// exit code with which the program must then end.
pub fn serve(arguments: impl Iterator<Item = OsString>) -> Option<u8> {
    let arguments: Vec<OsString> = arguments.take(7).collect();
    let (command, rest) = arguments.split_first()?;
    if command != COMMAND {
        return None;
    }
    let [protocol, memory, seconds, kind, name, path] = rest else { return Some(2) };
    let number = |text: &OsString| text.to_str()?.parse::<u64>().ok();
    let (Some(memory), Some(seconds), Some(kind), Some(name)) =
        (number(memory), number(seconds), kind.to_str(), name.to_str())
    else {
        return Some(2);
    };
    let Some(wanted) = Wanted::of(kind, name) else { return Some(2) };
    if protocol != PROTOCOL || limit(Limits { memory, seconds }).is_err() {
        return Some(2);
    }
    let contents = match contents(&PathBuf::from(path), wanted) {
        Ok(contents) => contents,
        Err(Error::File { what, .. }) => Contents::Refusal(what),
        Err(error) => Contents::Refusal(error.to_string()),
    };
    let packed = deliver(&contents);
    // The process ends anyway: no need to free the memory leaf by leaf.
    std::mem::forget(contents);
    Some(if packed.is_ok() { 0 } else { 1 })
}

/// Address space of a thread: its stack. OpenVDB's helpers start one thread per core.
const THREAD_STACK: u64 = 16 << 20;

fn limit(limits: Limits) -> std::io::Result<()> {
    // No decoding process outlives the one that started it.
    set_parent_process_death_signal(Some(Signal::KILL))?;
    let own = std::fs::read_to_string("/proc/self/statm")?;
    let pages: u64 = own.split(' ').next().and_then(|pages| pages.parse().ok()).unwrap_or(0);
    let threads = std::thread::available_parallelism().map_or(1, |count| count.get() as u64);
    let own = pages * rustix::param::page_size() as u64 + threads * THREAD_STACK;
    let space = own.saturating_add(limits.memory);
    for (resource, bound) in [(Resource::As, space), (Resource::Cpu, limits.seconds), (Resource::Core, 0)] {
        let hard_limit = getrlimit(resource).maximum;
        let bound = Some(hard_limit.map_or(bound, |hard_limit| hard_limit.min(bound)));
        setrlimit(resource, Rlimit { current: bound, maximum: hard_limit })?;
    }
    Ok(())
}

fn contents(path: &Path, wanted: Wanted<'_>) -> Result<Contents> {
    let floats = |grid| Contents::Grids(vec![AnyGrid::Floats(grid)]);
    Ok(match wanted {
        Wanted::Infos => Contents::Infos(decode::describe(path)?),
        Wanted::All => Contents::Grids(decode::read(path)?.into_iter().map(AnyGrid::Floats).collect()),
        Wanted::Floats(name) => floats(decode::read_named(path, name)?),
        Wanted::Nth(index) => floats(decode::read_nth(path, index)?),
        Wanted::Any(name) => Contents::Grids(vec![decode::read_any(path, name)?]),
        Wanted::Points(name) => {
            let (points, skipped) = decode::read_points(path, name)?;
            Contents::Points(points, skipped)
        }
    })
}

fn deliver(contents: &Contents) -> std::result::Result<(), String> {
    let input = std::io::stdin().as_fd().try_clone_to_owned().map_err(|error| error.to_string())?;
    let file = File::from(input);
    let packed = pack(&file, contents);
    if let Err(what) = &packed {
        eprint!("{}", one_line(what));
    }
    packed
}
