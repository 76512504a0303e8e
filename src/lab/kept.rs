//! What is kept in memory of the nodes used last.

use std::sync::Arc;

/// What is kept of the nodes used last.
pub(super) struct Kept<T> {
    most: usize,
    list: Vec<(u32, Arc<T>)>,
}

impl<T> Kept<T> {
    /// Keeps so many at most.
    pub(super) fn new(most: usize) -> Self {
        Self { most, list: Vec::new() }
    }

    /// Of a node, which is the one used last now.
    pub(super) fn get(&mut self, id: u32) -> Option<Arc<T>> {
        let at = self.list.iter().position(|(own, _)| *own == id)?;
        let used = self.list.remove(at);
        let found = used.1.clone();
        self.list.push(used);
        Some(found)
    }

    /// Takes the place of the node used longest ago.
    pub(super) fn put(&mut self, id: u32, value: Arc<T>) {
        self.list.retain(|(own, _)| *own != id);
        self.list.push((id, value));
        if self.list.len() > self.most {
            self.list.remove(0);
        }
    }
}
