//! How long work is done: what it tells meanwhile, how it is stopped, and what it keeps to go on from.
//!
//! Whatever takes long in here is a *map*: items worked out side by side, each from nothing but itself and what was known
//! before the map; what comes between maps is quick. So the results of items are all that a stopped run need keep: the next
//! one asks for the same maps in the same order, takes the results that there are from the [`Journal`], works out the
//! others, and comes by the same bytes, however often and wherever it was cut off. For the same reason several workers can
//! share the items of a map by way of a [`Folder`].

mod block;
mod digest;
mod done;
mod folder;
mod host;
mod journal;
mod order;
mod reader;
mod shared;

pub use digest::{Difference, Digest};
pub use folder::{Folder, FolderError};
pub use journal::{Journal, JournalError};
pub use order::Order;

use crate::parallel::{self, Scratch};
use serde::Serialize;
use serde::de::DeserializeOwned;
use shared::SharedMap;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, PoisonError};

/// Progress as a fraction of the stage that is named; called from any thread.
pub type Progress<'p> = &'p (dyn Fn(&str, f64) + Sync);

/// The work was stopped before it was done.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("stopped")]
pub struct Stopped;

/// Where results are kept.
#[derive(Clone, Copy)]
enum Kept<'w> {
    Nowhere,
    Journal(&'w Journal),
    Folder(&'w Folder),
}

/// Who does the work.
pub struct Job<'w> {
    progress: Progress<'w>,
    stop: Option<&'w AtomicBool>,
    kept: Kept<'w>,
    /// Maps so far.
    maps: AtomicU32,
}

impl<'w> Job<'w> {
    /// Tells of its progress; can't be stopped, keeps nothing.
    pub fn new(progress: Progress<'w>) -> Self {
        Self { progress, stop: None, kept: Kept::Nowhere, maps: AtomicU32::new(0) }
    }

    /// Tells nobody.
    pub fn quiet() -> Job<'static> {
        Job::new(&|_, _| ())
    }

    /// Stops soon after `stop` is set; what is under way then is lost.
    pub fn until(self, stop: &'w AtomicBool) -> Self {
        Self { stop: Some(stop), ..self }
    }

    /// Takes over what a journal holds, and adds to it. One journal goes with one piece of work: the same input, options and program.
    pub fn kept_in(self, journal: &'w Journal) -> Self {
        Self { kept: Kept::Journal(journal), ..self }
    }

    /// Shares the work with all who work in a folder: on the same input, with the same options and program. Nothing
    /// may end the work by a clock.
    pub fn shared_in(self, folder: &'w Folder) -> Self {
        Self { kept: Kept::Folder(folder), ..self }
    }

    /// For maps within an item of a map of this: stopped with this, tells nobody, keeps nothing.
    pub(crate) fn within(&self) -> Job<'w> {
        Job { stop: self.stop, ..Job::new(&|_, _| ()) }
    }

    /// Says how far a stage is.
    pub fn tell(&self, stage: &str, done: f64) {
        (self.progress)(stage, done);
    }

    /// True where the rest is in vain.
    pub fn is_stopped(&self) -> bool {
        let is_over = matches!(self.kept, Kept::Folder(folder) if folder.is_over());
        is_over || self.stop.is_some_and(|stop| stop.load(Relaxed))
    }

    /// Ends a step between maps where the rest is in vain. What loops cut short once this was stopped must not go beyond the next call.
    pub(crate) fn go_on(&self) -> Result<(), Stopped> {
        if self.is_stopped() { Err(Stopped) } else { Ok(()) }
    }

    /// Works out all items side by side, the first ones first; results are in their order.
    ///
    /// Maps must be asked for one after the other, in an order that depends on nothing but the input, and never within one another.
    pub(crate) fn map<T, R>(&self, items: &[T], work: impl Fn(&T) -> R + Sync) -> Result<Vec<R>, Stopped>
    where
        T: Sync,
        R: Serialize + DeserializeOwned + Send,
    {
        self.map_with(items, || (), |(), item| work(item), |_| ())
    }

    /// As [`Job::map`], with scratch memory, of which no two threads have the same, and on which no result may depend; and tells the
    /// number of items that are done.
    pub(crate) fn map_with<S, T, R>(
        &self,
        items: &[T],
        scratch: impl Fn() -> S + Sync,
        work: impl Fn(&mut S, &T) -> R + Sync,
        done: impl Fn(usize) + Sync,
    ) -> Result<Vec<R>, Stopped>
    where
        S: Send,
        T: Sync,
        R: Serialize + DeserializeOwned + Send,
    {
        let scratch = Scratch::new(&scratch);
        let one = |i: usize| {
            let mut memory = scratch.take();
            let result = work(&mut memory, &items[i]);
            scratch.put(memory);
            result
        };
        self.map_numbers(items.len(), &one, &done)
    }

    /// What `work` makes of each number below `n`, or somebody has made of it: compiled once for each type of results, not
    /// of work.
    fn map_numbers<R>(
        &self,
        n: usize,
        work: &(dyn Fn(usize) -> R + Sync),
        done: &(dyn Fn(usize) + Sync),
    ) -> Result<Vec<R>, Stopped>
    where
        R: Serialize + DeserializeOwned + Send,
    {
        let map = self.maps.fetch_add(1, Relaxed);
        let results = match self.kept {
            Kept::Nowhere => self.map_alone(map, n, None, work, done),
            Kept::Journal(journal) => self.map_alone(map, n, Some(journal), work, done),
            Kept::Folder(folder) => SharedMap { folder, map, items: n, work, done, is_stopped: &|| self.is_stopped() }.run(),
        };
        results.ok_or(Stopped)
    }

    /// A map that nobody else works on; `None` where it was stopped.
    fn map_alone<R>(
        &self,
        map: u32,
        n: usize,
        journal: Option<&Journal>,
        work: &(dyn Fn(usize) -> R + Sync),
        done: &(dyn Fn(usize) + Sync),
    ) -> Option<Vec<R>>
    where
        R: Serialize + DeserializeOwned + Send,
    {
        let count = AtomicUsize::new(0);
        let mut results: Vec<Option<R>> = Vec::new();
        results.resize_with(n, || None);
        let results = Mutex::new(results);
        parallel::each(n, &|i| {
            if self.is_stopped() {
                return;
            }
            let key = (map, i as u32);
            let kept = journal.and_then(|journal| journal.take(key));
            let result = kept.unwrap_or_else(|| {
                let result = work(i);
                // What was worked out while it was stopped may be cut short.
                if let Some(journal) = journal.filter(|_| !self.is_stopped()) {
                    journal.keep(key, &result);
                }
                result
            });
            done(1 + count.fetch_add(1, Relaxed));
            results.lock().unwrap_or_else(PoisonError::into_inner)[i] = Some(result);
        });
        let results = results.into_inner().unwrap_or_else(PoisonError::into_inner);
        if self.is_stopped() { None } else { results.into_iter().collect() }
    }

    /// Works out one thing, where nobody has; what fails isn't kept.
    pub(crate) fn once<R, E>(&self, work: impl FnOnce() -> Result<R, E>) -> Result<R, E>
    where
        R: Serialize + DeserializeOwned,
    {
        let map = self.maps.fetch_add(1, Relaxed);
        let kept = match self.kept {
            Kept::Nowhere => None,
            Kept::Journal(journal) => journal.take((map, 0)),
            Kept::Folder(folder) => {
                let arrivals = folder.receive(map, true);
                arrivals.iter().find_map(|arrival| postcard::from_bytes(&arrival.bytes).ok())
            }
        };
        if let Some(kept) = kept {
            return Ok(kept);
        }
        let result = work()?;
        match self.kept {
            Kept::Nowhere => (),
            Kept::Journal(journal) => journal.keep((map, 0), &result),
            Kept::Folder(folder) => {
                folder.keep(map, 0, &result);
                folder.flush();
            }
        }
        Ok(result)
    }
}
