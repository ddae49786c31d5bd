//! How long work is done: what it tells meanwhile, how it is stopped, and what it keeps to go on from.
//!
//! Whatever takes long in here is a *map*: items worked out side by side, each from nothing but itself and what was known before
//! the map; what comes between maps is quick. So the results of items are all that a stopped run need keep: the next one asks
//! for the same maps in the same order, takes the results that there are from the [`Journal`], works out the others, and comes by
//! the same bytes, however often and wherever it was cut off.

mod journal;

pub use journal::{Journal, JournalError, of_this_build};

use crate::parallel::{self, Scratch};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::sync::atomic::{AtomicBool, AtomicU32, AtomicUsize, Ordering::Relaxed};
use std::sync::{Mutex, PoisonError};

/// Progress as a fraction of the stage that is named; called from any thread.
pub type Progress<'p> = &'p (dyn Fn(&str, f64) + Sync);

/// The work was stopped before it was done.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("stopped")]
pub struct Stopped;

/// Who does the work.
pub struct Job<'w> {
    progress: Progress<'w>,
    stop: Option<&'w AtomicBool>,
    journal: Option<&'w Journal>,
    /// Maps so far.
    maps: AtomicU32,
}

impl<'w> Job<'w> {
    /// Tells of its progress; can't be stopped, keeps nothing.
    pub fn new(progress: Progress<'w>) -> Self {
        Self { progress, stop: None, journal: None, maps: AtomicU32::new(0) }
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
        Self { journal: Some(journal), ..self }
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
        self.stop.is_some_and(|stop| stop.load(Relaxed))
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

    /// What `work` makes of each number below `n`, or the journal kept of it: compiled once for each type of results, not of work.
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
        let count = AtomicUsize::new(0);
        let mut results: Vec<Option<R>> = Vec::new();
        results.resize_with(n, || None);
        let results = Mutex::new(results);
        parallel::each(n, &|i| {
            if self.is_stopped() {
                return;
            }
            let key = (map, i as u32);
            let kept = self.journal.and_then(|journal| journal.take(key));
            let result = kept.unwrap_or_else(|| {
                let result = work(i);
                // What was worked out while it was stopped may be cut short.
                if let Some(journal) = self.journal.filter(|_| !self.is_stopped()) {
                    journal.keep(key, &result);
                }
                result
            });
            done(1 + count.fetch_add(1, Relaxed));
            results.lock().unwrap_or_else(PoisonError::into_inner)[i] = Some(result);
        });
        let results = results.into_inner().unwrap_or_else(PoisonError::into_inner);
        if self.is_stopped() { Err(Stopped) } else { results.into_iter().collect::<Option<_>>().ok_or(Stopped) }
    }

    /// Works out one thing; what fails isn't kept.
    pub(crate) fn once<R, E>(&self, work: impl FnOnce() -> Result<R, E>) -> Result<R, E>
    where
        R: Serialize + DeserializeOwned,
    {
        let key = (self.maps.fetch_add(1, Relaxed), 0);
        if let Some(kept) = self.journal.and_then(|journal| journal.take(key)) {
            return Ok(kept);
        }
        let result = work()?;
        if let Some(journal) = self.journal {
            journal.keep(key, &result);
        }
        Ok(result)
    }
}
