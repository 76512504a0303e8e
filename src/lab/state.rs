//! The laboratory as it stands: its nodes, what is kept in memory of them, and who is told what happens.

use super::change::Change;
use super::events::Event;
use super::job::Job;
use super::kept::Kept;
use super::live::Live;
use super::longest::Longest;
use super::node::{Absent, Node, State};
use super::setup::{Setup, Source};
use super::tree::{Figures, Saved};
use super::view::View;
use crate::adjust::{Options, Stop};
use crate::diagnose::settings::Settings;
use crate::effects;
use crate::model::EffectRef;
use crate::report::pictures::RunFolder;
use anyhow::{Result, bail};
use std::collections::{BTreeMap, HashMap};
use std::sync::mpsc::Sender;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tokio::sync::broadcast;

/// Nodes of which columns are kept in memory.
const VIEWS: usize = 8;
/// Nodes of which fit and null model are kept in memory.
const LIVES: usize = 3;
/// Events that a slow listener may be behind.
const EVENTS: usize = 1024;

/// The laboratory.
pub struct Lab {
    /// What it was opened with.
    pub setup: Setup,
    pub(super) nodes: Mutex<BTreeMap<u32, Node>>,
    pub(super) sources: Mutex<HashMap<u32, Arc<Source>>>,
    views: Mutex<Kept<View>>,
    pub(super) longest: Mutex<HashMap<u32, Longest>>,
    reading: Mutex<()>,
    lives: Mutex<Kept<Live>>,
    jobs: Mutex<Sender<Job>>,
    events: broadcast::Sender<Event>,
}

/// Whoever panicked while it held the lock left whole values behind: each is changed by a single assignment.
pub(super) fn locked<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Lab {
    /// Reads the steps that are there.
    ///
    /// # Errors
    /// A step that cannot be read.
    pub fn new(setup: Setup, jobs: Sender<Job>) -> Result<Self> {
        let node = |saved: Saved| Node {
            parent: saved.parent,
            change: saved.change.clone(),
            figures: Some(saved.figures.clone()),
            state: State::Done(Box::new(saved)),
            stop: Stop::default(),
        };
        let nodes = setup.folder.steps()?.into_iter().map(|(id, saved)| (id, node(saved))).collect();
        Ok(Self {
            setup,
            nodes: Mutex::new(nodes),
            sources: Mutex::default(),
            views: Mutex::new(Kept::new(VIEWS)),
            longest: Mutex::default(),
            reading: Mutex::default(),
            lives: Mutex::new(Kept::new(LIVES)),
            jobs: Mutex::new(jobs),
            events: broadcast::channel(EVENTS).0,
        })
    }

    /// Every node, by number.
    pub fn nodes(&self) -> BTreeMap<u32, Node> {
        locked(&self.nodes).clone()
    }

    /// What a node is, where it is done.
    ///
    /// # Errors
    /// A node that is not there, or not done.
    pub fn saved(&self, id: u32) -> Result<Saved, Absent> {
        match locked(&self.nodes).get(&id).map(|node| &node.state) {
            Some(State::Done(saved)) => Ok((**saved).clone()),
            Some(_) => Err(Absent::NotDone(id)),
            None => Err(Absent::NoNode(id)),
        }
    }

    /// Changes the state of a node, and tells that the tree changed.
    pub(super) fn set(&self, id: u32, state: State) {
        if let Some(node) = locked(&self.nodes).get_mut(&id) {
            node.state = state;
        }
        self.tell(Event::Tree {});
    }

    /// Takes a node without a folder out of the tree.
    pub(super) fn forget(&self, id: u32) {
        let mut nodes = locked(&self.nodes);
        if nodes.get(&id).is_some_and(|node| !matches!(node.state, State::Done(_))) {
            nodes.remove(&id);
        }
        drop(nodes);
        self.tell(Event::Tree {});
    }

    /// Takes a step that failed or was cancelled out of the tree.
    ///
    /// # Errors
    /// A node that is not there, or one that did not fail.
    pub fn dismiss(&self, id: u32) -> Result<()> {
        match locked(&self.nodes).get(&id).map(|node| &node.state) {
            Some(State::Failed(_) | State::Cancelled) => {}
            Some(_) => bail!("step {id} neither failed nor was it cancelled: it cannot be dismissed"),
            None => return Err(Absent::NoNode(id).into()),
        }
        if locked(&self.nodes).len() == 1 {
            bail!("step {id} is the only one: it cannot be dismissed");
        }
        self.forget(id);
        Ok(())
    }

    /// Says what the solvers found before what is left was tested.
    pub(super) fn solved(&self, id: u32, figures: Figures) {
        if let Some(node) = locked(&self.nodes).get_mut(&id) {
            node.figures = Some(figures);
        }
        self.tell(Event::Tree {});
    }

    /// Says what a node changes, once that is known.
    pub(super) fn rename(&self, id: u32, change: Change) {
        if let Some(node) = locked(&self.nodes).get_mut(&id) {
            node.change = change;
        }
    }

    /// A new node in state `state`.
    pub(super) fn insert(&self, parent: Option<u32>, change: Change, state: State, stop: Stop) -> u32 {
        let mut nodes = locked(&self.nodes);
        let id = nodes.keys().next_back().map_or(1, |last| last + 1);
        nodes.insert(id, Node { parent, change, state, figures: None, stop });
        drop(nodes);
        self.tell(Event::Tree {});
        id
    }

    /// Puts a step into the queue; gives its number.
    ///
    /// # Errors
    /// A parent that is not there, or not done.
    pub fn post(&self, parent: Option<u32>, change: Change) -> Result<u32, Absent> {
        if let Some(parent) = parent {
            self.saved(parent)?;
        }
        let stop = Stop::default();
        let id = self.insert(parent, change.clone(), State::Waiting, stop.clone());
        // The worker lives as long as the laboratory does.
        let _ = locked(&self.jobs).send(Job { id, parent, change, stop });
        Ok(id)
    }

    /// Ends a step at its next iteration.
    ///
    /// # Errors
    /// A node that is not there.
    pub fn cancel(&self, id: u32) -> Result<(), Absent> {
        let nodes = locked(&self.nodes);
        nodes.get(&id).ok_or(Absent::NoNode(id))?.stop.raise();
        Ok(())
    }

    /// Tells whoever listens.
    pub fn tell(&self, event: Event) {
        // Nobody may listen.
        let _ = self.events.send(event);
    }

    /// Listens from now on.
    pub fn listen(&self) -> broadcast::Receiver<Event> {
        self.events.subscribe()
    }

    /// The root of a node.
    pub fn root(&self, mut id: u32) -> Result<u32, Absent> {
        let nodes = locked(&self.nodes);
        while let Some(parent) = nodes.get(&id).ok_or(Absent::NoNode(id))?.parent {
            id = parent;
        }
        Ok(id)
    }

    /// The nodes from the root to this one.
    pub fn path(&self, id: u32) -> Result<Vec<u32>, Absent> {
        let nodes = locked(&self.nodes);
        let mut path = vec![id];
        while let Some(parent) = nodes.get(&path[0]).ok_or(Absent::NoNode(path[0]))?.parent {
            path.insert(0, parent);
        }
        Ok(path)
    }

    /// A node as it is shown.
    ///
    /// # Errors
    /// A node that is not done; a folder that cannot be read.
    pub fn view(&self, id: u32) -> Result<Arc<View>> {
        if let Some(view) = locked(&self.views).get(id) {
            return Ok(view);
        }
        self.saved(id)?;
        // One reads, the other figures of the page wait for it: each by itself would take as long as all together.
        let _reads = locked(&self.reading);
        if let Some(view) = locked(&self.views).get(id) {
            return Ok(view);
        }
        let view = Arc::new(View::read(&self.setup.folder.step(id), &self.source(id)?.block)?);
        locked(&self.views).put(id, view.clone());
        Ok(view)
    }

    /// What is kept in memory of a node with its fit.
    pub(super) fn kept(&self, id: u32) -> Option<Arc<Live>> {
        locked(&self.lives).get(id)
    }

    /// The longest arrows of all steps that are done. Each is read once: a step never changes.
    ///
    /// # Errors
    /// A folder that cannot be read.
    pub fn longest_of_steps(&self) -> Result<Longest> {
        let cameras: Vec<&str> = self.setup.block.cameras.iter().map(|camera| camera.id.as_str()).collect();
        let mut all = Longest { sensor: vec![0.0; cameras.len()], ..Longest::default() };
        for (id, _) in self.nodes().iter().filter(|(_, node)| matches!(node.state, State::Done(_))) {
            let known = locked(&self.longest).get(id).cloned();
            let own = match known {
                Some(own) => own,
                None => {
                    let own = Longest::of_run(&RunFolder::read(&self.setup.folder.step(*id))?, &cameras);
                    locked(&self.longest).insert(*id, own.clone());
                    own
                }
            };
            all = all.or_longer(&own);
        }
        Ok(all)
    }

    /// Keeps what a step computed.
    pub(super) fn keep(&self, id: u32, live: Arc<Live>) {
        locked(&self.lives).put(id, live);
    }

    /// Settings of a diagnosis that can be ended.
    pub fn settings<'a>(&'a self, stop: &Stop, snoop: bool, tell: &'a (dyn Fn(&str) + Sync)) -> Settings<'a> {
        let options = Options { threads: self.setup.threads, stop: stop.clone(), ..Options::default() };
        Settings { plugins: &self.setup.plugins, options, significance: self.setup.significance, snoop, tell }
    }

    /// The effect of an id.
    pub fn effect(&self, id: &str) -> Option<EffectRef> {
        let plugged = || self.setup.plugins.iter().find(|effect| effect.descriptor().id == id).cloned();
        effects::find(id).map(EffectRef::Builtin).or_else(plugged)
    }

    /// Begins with the base model where nothing is there yet.
    pub fn begin(&self) -> Result<()> {
        if locked(&self.nodes).is_empty() {
            match &self.setup.simulated {
                Some(simulated) => self.post(None, simulated.first())?,
                None => self.post(None, Change::Base)?,
            };
        }
        if let Some(simulated) = &self.setup.simulated
            && simulated.truth.images.is_empty()
        {
            bail!("the simulated block has no images");
        }
        Ok(())
    }
}
