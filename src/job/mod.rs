//! Long work: progress, stopping, and stored results for resuming.
//!
//! All long work is a *map*: items computed in parallel, each only from itself and from results before the map. The steps between maps are
//! fast. So a stopped run needs to keep only the results of items: the next run makes the same maps in the same order, takes available
//! results from the [`Journal`], computes the others, and produces the same bytes, whatever the interruptions. For the same reason several
//! workers can share the items of a map through a [`Folder`].

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

use crate::math::parallel::{self, Scratch};
use serde::Serialize;
use serde::de::DeserializeOwned;
use shared::SharedMap;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, PoisonError};

/// Progress as a fraction of the named stage; called from any thread.
pub type Progress<'p> = &'p (dyn Fn(&str, f64) + Sync);

/// The work was stopped before it was done.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("stopped")]
pub struct Stopped;

/// The store of results.
#[derive(Clone, Copy)]
enum Kept<'w> {
    Nowhere,
    Journal(&'w Journal),
    Folder(&'w Folder),
}

/// The context of long work.
pub struct Job<'w> {
    progress: Progress<'w>,
    stop: Option<&'w AtomicBool>,
    kept: Kept<'w>,
    /// Maps so far.
    maps: AtomicU32,
}

impl<'w> Job<'w> {
    /// A job with progress, without stopping and storage.
    pub fn new(progress: Progress<'w>) -> Self {
        Self { progress, stop: None, kept: Kept::Nowhere, maps: AtomicU32::new(0) }
    }

    /// A job without progress.
    pub fn quiet() -> Job<'static> {
        Job::new(&|_, _| ())
    }

    /// Stops soon after `stop` is set; items in progress are lost.
    pub fn until(self, stop: &'w AtomicBool) -> Self {
        Self { stop: Some(stop), ..self }
    }

    /// Uses and extends the results of a journal. A journal belongs to one piece of work: the same input, options and program.
    pub fn kept_in(self, journal: &'w Journal) -> Self {
        Self { kept: Kept::Journal(journal), ..self }
    }

    /// Shares the work with all workers of a folder, which have the same input, options and program. The end of the work must not depend on
    /// a clock.
    pub fn shared_in(self, folder: &'w Folder) -> Self {
        Self { kept: Kept::Folder(folder), ..self }
    }

    /// A job for maps within an item: stopped with this one, without progress and storage.
    pub(crate) fn within(&self) -> Job<'w> {
        Job { stop: self.stop, ..Job::new(&|_, _| ()) }
    }

    /// Reports the progress of a stage.
    pub fn tell(&self, stage: &str, done: f64) {
        (self.progress)(stage, done);
    }

    /// True if the job is stopped, or further work is useless.
    pub fn is_stopped(&self) -> bool {
        let is_over = matches!(self.kept, Kept::Folder(folder) if folder.is_over());
        is_over || self.stop.is_some_and(|stop| stop.load(Relaxed))
    }

    /// Fails if the job is stopped, for steps between maps. Partial results of interrupted loops must not go beyond the next call.
    pub(crate) fn go_on(&self) -> Result<(), Stopped> {
        if self.is_stopped() { Err(Stopped) } else { Ok(()) }
    }

    /// Computes all items in parallel, the first ones first; results are in the order of items.
    ///
    /// Maps must run one after the other, in an order that depends only on the input, and never nested.
    pub(crate) fn map<T, R>(&self, items: &[T], work: impl Fn(&T) -> R + Sync) -> Result<Vec<R>, Stopped>
    where
        T: Sync,
        R: Serialize + DeserializeOwned + Send,
    {
        self.map_with(items, || (), |(), item| work(item), |_| ())
    }

    /// As [`Job::map`], with scratch memory per thread, on which no result may depend; reports the number of finished items.
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

    /// The results of `work` for each number below `n`, computed or stored: compiled once for each type of results, not of work.
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

    /// A map without other workers; `None` if it was stopped.
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
                // A result computed during a stop may be incomplete.
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

    /// Computes one result, unless it is stored; failures are not stored.
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
