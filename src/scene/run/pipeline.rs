//! The stages of a scene, and what they have in common.

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
    /// Contents of its files when they were read.
    pub input_hashes: &'a Arc<InputHashes>,
    /// Its stages.
    pub stages: Vec<Box<dyn AnyStage + 'a>>,
}

impl Pipeline<'_> {
    /// The stages, as descriptions.
    pub fn stages(&self) -> impl Iterator<Item = &dyn Stage> {
        self.stages.iter().map(|stage| &**stage as &dyn Stage)
    }

    /// Names of all stages, in their order.
    pub fn names(&self) -> Vec<&'static str> {
        self.stages().map(|stage| stage.name()).collect()
    }

    /// The stages with these names, by index; all if there are no names.
    pub(super) fn chosen(&self, only: &[String]) -> Result<Vec<usize>> {
        if let Some(unknown) = only.iter().find(|name| !self.names().contains(&&name[..])) {
            let names = self.names().join(", ");
            let what = format!("has no stage \"{unknown}\": its stages are {names}");
            return Err(Error::file(&self.scene.path, what));
        }
        let wanted = |name: &str| only.is_empty() || only.iter().any(|known| known == name);
        Ok((0..self.stages.len()).filter(|position| wanted(self.stages[*position].name())).collect())
    }

    /// The stages that depend on these, directly or indirectly, by index.
    pub(super) fn downstream(&self, of: &[usize]) -> Vec<usize> {
        let mut names: Vec<&str> = of.iter().map(|position| self.stages[*position].name()).collect();
        let mut out = Vec::new();
        for (position, stage) in self.stages().enumerate() {
            if stage.upstream().iter().any(|upstream| names.contains(upstream)) {
                names.push(stage.name());
                out.push(position);
            }
        }
        out
    }

    /// Refuses frames that the chosen stages read from other stages, if this scene would not make them as they are.
    pub(super) fn refuse_stale(&self, chosen: &[usize], folder: &Path) -> Result<()> {
        for reader in chosen.iter().map(|position| &self.stages[*position]) {
            let others = self.stages().enumerate().filter(|(position, _)| !chosen.contains(position));
            for (_, stage) in others.filter(|(_, stage)| reader.upstream().contains(&stage.name())) {
                let upstream = stage.upstream().iter().map(|name| DoneFrames::read(folder, name));
                let upstream: Vec<DoneFrames> = upstream.collect::<Result<_>>()?;
                Cache::refuse_stale(stage, self.input_hashes, folder, reader.name(), &upstream)?;
            }
        }
        Ok(())
    }

    /// Whether the exact states of all frames of a stage are kept: the stage itself, or another one, reads them.
    pub(super) fn keeps_states_of(&self, of: &dyn Stage) -> bool {
        let reads =
            |stage: &dyn Stage| stage.upstream().contains(&of.name()) && stage.reads_state_of(of.name());
        of.keeps_every_state() || self.stages().any(reads)
    }
}
