//! The process that decodes a foreign file: it limits itself, reads the file and leaves a parcel in the file that is its input.

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
pub(in crate::vdb) const PROTOCOL: &str = concat!("4-", env!("CARGO_PKG_VERSION"));

/// What to read from a file.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::vdb) enum Wanted<'a> {
    Infos,
    All,
    /// Of floats.
    First,
    /// Of floats.
    Named(&'a str),
    /// Of floats, by its index.
    Nth(&'a str),
    /// Of floats or vectors.
    FirstAny,
    /// Of floats or vectors.
    NamedAny(&'a str),
    FirstPoints,
    NamedPoints(&'a str),
}

impl Wanted<'_> {
    /// Encoded as two arguments.
    pub(in crate::vdb) fn arguments(&self) -> [&str; 2] {
        match self {
            Self::Infos => ["infos", ""],
            Self::All => ["all", ""],
            Self::First => ["first", ""],
            Self::Named(name) => ["named", name],
            Self::Nth(index) => ["nth", index],
            Self::FirstAny => ["first-any", ""],
            Self::NamedAny(name) => ["named-any", name],
            Self::FirstPoints => ["first-points", ""],
            Self::NamedPoints(name) => ["named-points", name],
        }
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
    let wanted = match kind {
        "infos" => Wanted::Infos,
        "all" => Wanted::All,
        "first" => Wanted::First,
        "named" => Wanted::Named(name),
        "nth" => Wanted::Nth(name),
        "first-any" => Wanted::FirstAny,
        "named-any" => Wanted::NamedAny(name),
        "first-points" => Wanted::FirstPoints,
        "named-points" => Wanted::NamedPoints(name),
        _ => return Some(2),
    };
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
const SPACE_OF_A_THREAD: u64 = 16 << 20;

fn limit(limits: Limits) -> std::io::Result<()> {
    // No decoding process outlives the one that started it.
    set_parent_process_death_signal(Some(Signal::KILL))?;
    let own = std::fs::read_to_string("/proc/self/statm")?;
    let pages: u64 = own.split(' ').next().and_then(|pages| pages.parse().ok()).unwrap_or(0);
    let threads = std::thread::available_parallelism().map_or(1, |count| count.get() as u64);
    let own = pages * rustix::param::page_size() as u64 + threads * SPACE_OF_A_THREAD;
    let space = own.saturating_add(limits.memory);
    for (resource, most) in [(Resource::As, space), (Resource::Cpu, limits.seconds), (Resource::Core, 0)] {
        let there = getrlimit(resource).maximum;
        let most = Some(there.map_or(most, |there| there.min(most)));
        setrlimit(resource, Rlimit { current: most, maximum: there })?;
    }
    Ok(())
}

fn contents(path: &Path, wanted: Wanted<'_>) -> Result<Contents> {
    let points =
        |name| decode::read_points(path, name).map(|(points, skipped)| Contents::Points(points, skipped));
    Ok(match wanted {
        Wanted::FirstPoints => points(None)?,
        Wanted::NamedPoints(name) => points(Some(name))?,
        Wanted::Infos => Contents::Infos(decode::describe(path)?),
        Wanted::All => Contents::Grids(decode::read(path)?.into_iter().map(AnyGrid::Floats).collect()),
        Wanted::First => Contents::Grids(vec![AnyGrid::Floats(decode::read_named(path, None)?)]),
        Wanted::Named(name) => Contents::Grids(vec![AnyGrid::Floats(decode::read_named(path, Some(name))?)]),
        Wanted::Nth(index) => {
            let index = index.parse().map_err(|_| Error::Bytes("is no index of a grid".into()))?;
            Contents::Grids(vec![AnyGrid::Floats(decode::read_nth(path, index)?)])
        }
        Wanted::FirstAny => Contents::Grids(vec![decode::read_any(path, None)?]),
        Wanted::NamedAny(name) => Contents::Grids(vec![decode::read_any(path, Some(name))?]),
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
