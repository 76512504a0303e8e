//! Which block a node adjusts: that of its root, or of the nearest step above it that mends.

use super::change::Change;
use super::node::Absent;
use super::setup::Source;
use super::state::{Lab, locked};
use crate::block::Block;
use crate::block::mended::mended;
use crate::io::block::read_block;
use crate::model::Datum;
use anyhow::{Result, anyhow};
use std::path::PathBuf;
use std::sync::Arc;

impl Lab {
    /// The nearest node from `id` upwards that has a block of its own.
    ///
    /// # Errors
    /// A node that is not there.
    fn holder(&self, mut id: u32) -> Result<u32, Absent> {
        let nodes = locked(&self.nodes);
        loop {
            let node = nodes.get(&id).ok_or(Absent::NoNode(id))?;
            match node.parent {
                Some(parent) if !node.change.has_block() => id = parent,
                _ => return Ok(id),
            }
        }
    }

    /// The block that a node adjusts.
    ///
    /// # Errors
    /// A node whose block is not known yet; a block that was measured here and cannot be read any more.
    pub fn source(&self, id: u32) -> Result<Arc<Source>> {
        let holder = self.holder(id)?;
        if let Some(source) = locked(&self.sources).get(&holder) {
            return Ok(source.clone());
        }
        let saved = self.saved(holder)?;
        let (path, recorded) = match saved.parent {
            Some(parent) => {
                let above = self.source(parent)?;
                let edits: Vec<_> = saved.undone.iter().flat_map(|mistake| mistake.mend.clone()).collect();
                let recorded = mended(&above.recorded, &edits)
                    .map_err(|edit| anyhow!("step {holder}: the block cannot be edited as {edit:?} says"))?;
                (above.path.clone(), Arc::new(recorded))
            }
            None => self.recorded(holder)?,
        };
        let source = Source::screened(path, recorded, saved.mistakes).with_undone(saved.undone);
        Ok(self.hold(holder, source))
    }

    /// Keeps the block of a root, or of a step that mends.
    pub(super) fn hold(&self, id: u32, source: Source) -> Arc<Source> {
        let source = Arc::new(source);
        locked(&self.sources).insert(id, source.clone());
        source
    }

    /// Forgets the block of a step that failed.
    pub(super) fn release(&self, id: u32) {
        locked(&self.sources).remove(&id);
    }

    /// The block of a root as it was recorded, and its folder.
    ///
    /// # Errors
    /// A block that was measured here and cannot be read any more.
    pub(super) fn recorded(&self, root: u32) -> Result<(PathBuf, Arc<Block>)> {
        let simulated =
            matches!(locked(&self.nodes).get(&root).map(|node| &node.change), Some(Change::Simulate { .. }));
        if !simulated {
            return Ok((self.setup.source.clone(), Arc::new(self.setup.block.clone())));
        }
        let path = self.setup.folder.measured(root);
        let block = read_block(&path)?.block.about_its_centre();
        Ok((path, Arc::new(block)))
    }

    /// The kinds that each step from the root to a node undid; none in a list: all.
    ///
    /// # Errors
    /// A node that is not there.
    pub(super) fn mends(&self, id: u32) -> Result<Vec<Vec<String>>, Absent> {
        let path = self.path(id)?;
        let nodes = locked(&self.nodes);
        let of_change = |id: &u32| match &nodes.get(id)?.change {
            Change::Mend { only } => Some(only.clone()),
            _ => None,
        };
        Ok(path.iter().filter_map(of_change).collect())
    }

    /// The datum that somebody chose for a node, whatever of it is recorded wrongly.
    ///
    /// # Errors
    /// A node that is not there.
    pub(super) fn chosen_datum(&self, id: u32) -> Result<Datum, Absent> {
        let path = self.path(id)?;
        let nodes = locked(&self.nodes);
        let of_change = |id: &u32| match &nodes.get(id)?.change {
            Change::Datum { datum } => Some(*datum),
            _ => None,
        };
        Ok(path.iter().rev().find_map(of_change).unwrap_or(self.setup.model.datum))
    }
}
