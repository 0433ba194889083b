//! The stages of a scene, and how they depend on each other.

use std::path::Path;
use std::sync::Arc;

use super::cache::Cache;
use super::done_frames::DoneFrames;
use super::pass::AnyStage;
use super::stage::Stage;
use crate::error::{Error, Result};
use crate::io::records::input_hashes::InputHashes;
use crate::scene::Scene;

/// A scene with its stages, upstream stages first.
pub struct Pipeline<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Hashes of its files when they were read.
    pub input_hashes: &'a Arc<InputHashes>,
    /// Its stages.
    pub stages: Vec<Box<dyn AnyStage + 'a>>,
}

impl Pipeline<'_> {
    /// The descriptions of the stages.
    pub fn stages(&self) -> impl Iterator<Item = &dyn Stage> {
        self.stages.iter().map(|stage| &**stage as &dyn Stage)
    }

    /// Names of all stages, upstream stages first.
    pub fn names(&self) -> Vec<&'static str> {
        self.stages().map(|stage| stage.name()).collect()
    }

    /// Indices of the stages with these names; of all stages if there are no names.
    pub(super) fn chosen(&self, only: &[String]) -> Result<Vec<usize>> {
        if let Some(unknown) = only.iter().find(|name| !self.names().contains(&&name[..])) {
            let names = self.names().join(", ");
            let what = format!("has no stage \"{unknown}\": its stages are {names}");
            return Err(Error::file(&self.scene.path, what));
        }
        let wanted = |name: &str| only.is_empty() || only.iter().any(|known| known == name);
        Ok((0..self.stages.len()).filter(|index| wanted(self.stages[*index].name())).collect())
    }

    /// Indices of the stages that depend on these, directly or indirectly.
    pub(super) fn downstream(&self, of: &[usize]) -> Vec<usize> {
        let mut names: Vec<&str> = of.iter().map(|index| self.stages[*index].name()).collect();
        let mut out = Vec::new();
        for (index, stage) in self.stages().enumerate() {
            if stage.upstream().iter().any(|upstream| names.contains(upstream)) {
                names.push(stage.name());
                out.push(index);
            }
        }
        out
    }

    /// Fails if the chosen stages read frames of other stages that were made with other settings or inputs than this scene's.
    pub(super) fn refuse_stale(&self, chosen: &[usize], folder: &Path) -> Result<()> {
        for reader in chosen.iter().map(|index| &self.stages[*index]) {
            let others = self.stages().enumerate().filter(|(index, _)| !chosen.contains(index));
            for (_, stage) in others.filter(|(_, stage)| reader.upstream().contains(&stage.name())) {
                let upstream = stage.upstream().iter().map(|name| DoneFrames::read(folder, name));
                let upstream: Vec<DoneFrames> = upstream.collect::<Result<_>>()?;
                Cache::refuse_stale(stage, self.input_hashes, folder, reader.name(), &upstream)?;
            }
        }
        Ok(())
    }

    /// How often the exact state of a stage is kept: after every Nth frame from the first; 0 = only after the last ones. After every frame if
    /// the stage requires it or another stage reads the states.
    pub(super) fn states_kept_every(&self, of: &dyn Stage) -> i32 {
        let reads =
            |stage: &dyn Stage| stage.upstream().contains(&of.name()) && stage.reads_state_of(of.name());
        if of.keeps_every_state() || self.stages().any(reads) { 1 } else { self.scene.output.keep_states }
    }
}
