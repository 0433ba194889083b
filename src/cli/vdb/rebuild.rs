//! `frazil vdb rebuild`.

use std::path::PathBuf;

use super::{Packing, check_name};
use crate::cli::options::{frame_path, refuse_one_file};
use crate::cli::output;
use crate::cli::session::{Failure, OrFailure, Session};
use frazil::io::files::atomic;
use frazil::scene::run::DoneFrames;
use frazil::scene::{FrameChoice, Rebuild, RebuildGrains};
use frazil::vdb::MetaValue;
use frazil::vdb::file::{self, WriteOptions};
use serde_json::json;

/// Make whole frames of a snow cache that holds changes (base_mode or grains_mode = "delta")
#[derive(clap::Args)]
#[command(after_help = "\
Examples:
  frazil vdb rebuild cache/ --frame 48 -o base.0048.vdb
  frazil vdb rebuild cache/ --frame 1-48 -o base.%04d.vdb
  frazil vdb rebuild cache/ --stage grains --frame 48 -o grains.0048.vdb")]
pub struct Args {
    /// Output folder of `frazil snow`
    folder: PathBuf,
    /// Stage whose frames are made
    #[arg(long, value_enum, default_value = "base")]
    stage: RebuildStage,
    /// Frames to rebuild
    #[arg(long, value_name = "N|A-B|A-BxN", allow_hyphen_values = true)]
    frame: FrameChoice,
    /// File to write (.vdb); for several frames their pattern, base.%04d.vdb
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    packing: Packing,
}

/// The stages that can be rebuilt.
#[derive(Clone, Copy, PartialEq, clap::ValueEnum)]
enum RebuildStage {
    /// The layer of snow
    Base,
    /// Grains, as points
    Grains,
}

/// Runs the command.
pub fn run(args: &Args, session: &Session) -> Result<(), Failure> {
    check_name(&args.output, &["vdb"])?;
    output::check_writable(&args.output).or_refuse()?;
    refuse_one_file(&args.output, &args.frame, "base.%04d.vdb")?;
    if args.stage == RebuildStage::Grains && args.packing.half {
        return Err(Failure::refused("--half cannot be used with --stage grains: points keep 32 bits"));
    }
    match args.stage {
        RebuildStage::Base => {
            let mut cache = Rebuild::open(&args.folder).or_refuse()?;
            args.check(cache.stored())?;
            args.write(|frame| {
                let layer = cache.layer(&session.ctx, frame)?;
                session.ctx.check()?;
                let metadata = vec![("frazil:frame".to_string(), MetaValue::Int(frame.into()))];
                file::to_bytes(&layer.list(), &WriteOptions { metadata, ..args.packing.options() })
            })?;
        }
        RebuildStage::Grains => {
            let mut cache = RebuildGrains::open(&args.folder).or_refuse()?;
            args.check(cache.stored())?;
            args.write(|frame| cache.bytes(&session.ctx, frame, &args.packing.options()))?;
        }
    }
    session.record("frames", json!(args.frame.count()));
    Ok(())
}

impl Args {
    /// Refuses frames that a cache lacks, and an output among its own files.
    fn check(&self, stored: &DoneFrames) -> Result<(), Failure> {
        if let Some(missing) = self.frame.iter().find(|frame| !stored.is_done(*frame)) {
            return Err(Failure::of_file(&self.folder, format!("frame {missing} does not exist")));
        }
        let folders = ["base", "removed", "grains", "state"].map(|name| self.folder.join(name));
        let own_folders: Vec<PathBuf> =
            folders.iter().filter_map(|folder| std::fs::canonicalize(folder).ok()).collect();
        let target = match self.output.parent() {
            Some(folder) if !folder.as_os_str().is_empty() => std::fs::canonicalize(folder).ok(),
            _ => std::env::current_dir().ok(),
        };
        if target.is_some_and(|target| own_folders.contains(&target)) {
            return Err(Failure::of_file(&self.output, "would be written among the cache's own files"));
        }
        Ok(())
    }

    /// Writes the file of each frame.
    fn write(&self, mut bytes: impl FnMut(i32) -> frazil::Result<Vec<u8>>) -> Result<(), Failure> {
        self.frame.iter().try_for_each(|frame| {
            let written =
                bytes(frame).and_then(|bytes| atomic::write_bytes(&frame_path(&self.output, frame), &bytes));
            written.or_fail()
        })
    }
}
