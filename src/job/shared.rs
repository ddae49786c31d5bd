//! A map that several workers share.

use super::folder::{Arrival, Folder};
use super::order::Order;
use crate::math::parallel;
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::sync::{Mutex, PoisonError};

/// A map over numbers below `items`.
pub(super) struct SharedMap<'a, R> {
    pub folder: &'a Folder,
    pub map: u32,
    pub items: usize,
    pub work: &'a (dyn Fn(usize) -> R + Sync),
    /// Called with the number of available results.
    pub done: &'a (dyn Fn(usize) + Sync),
    pub is_stopped: &'a (dyn Fn() -> bool + Sync),
}

/// The state of the map.
struct State<R> {
    order: Order,
    results: Vec<Option<R>>,
    count: usize,
    /// Whether the worker's own list is finished.
    is_idle: bool,
}

impl<R: Serialize + DeserializeOwned + Send> SharedMap<'_, R> {
    /// All results, from any worker; `None` if it was stopped.
    pub fn run(&self) -> Option<Vec<R>> {
        let [worker, workers] = self.folder.place();
        let mut results = Vec::new();
        results.resize_with(self.items, || None);
        let order = Order::new(self.items, worker, workers);
        let state = Mutex::new(State { order, results, count: 0, is_idle: false });
        parallel::each(parallel::threads().min(self.items), &|_| self.thread(&state));
        // For slower workers.
        self.folder.flush();
        let state = state.into_inner().unwrap_or_else(PoisonError::into_inner);
        if (self.is_stopped)() { None } else { state.results.into_iter().collect() }
    }

    fn thread(&self, state: &Mutex<State<R>>) {
        let lock = || state.lock().unwrap_or_else(PoisonError::into_inner);
        loop {
            let is_idle = lock().is_idle;
            for arrival in self.folder.receive(self.map, is_idle) {
                self.take(arrival, state);
            }
            if (self.is_stopped)() {
                return;
            }
            let Some((item, is_own)) = lock().order.next_item() else { return };
            if !is_own && !std::mem::replace(&mut lock().is_idle, true) {
                // Others may wait for our last results, and theirs may save work here.
                self.folder.flush();
                for arrival in self.folder.receive(self.map, true) {
                    self.take(arrival, state);
                }
            }
            if lock().results[item].is_some() {
                continue;
            }
            let result = (self.work)(item);
            // A result computed during a stop may be incomplete.
            if (self.is_stopped)() {
                return;
            }
            self.folder.keep(self.map, item, &result);
            if !is_own {
                self.folder.flush();
            }
            self.put(item, result, state);
        }
    }

    /// Stores a received result; recomputes invalid ones, and compares one in many.
    fn take(&self, arrival: Arrival, state: &Mutex<State<R>>) {
        let item = arrival.item as usize;
        let is_known = |item: usize| state.lock().unwrap_or_else(PoisonError::into_inner).results[item].is_some();
        if item < self.items && is_known(item) {
            return;
        }
        let Some(result) = postcard::from_bytes::<R>(&arrival.bytes).ok().filter(|_| item < self.items) else {
            return self.folder.is_misshapen(&arrival);
        };
        if !self.folder.is_own(&arrival) && self.folder.is_checked(self.map, &arrival) {
            let again = postcard::to_allocvec(&(self.work)(item));
            if (self.is_stopped)() {
                return;
            }
            if again.is_ok_and(|again| *again != *arrival.bytes) {
                return self.folder.disagree(self.map, &arrival);
            }
        }
        self.put(item, result, state);
    }

    fn put(&self, item: usize, result: R, state: &Mutex<State<R>>) {
        let mut state = state.lock().unwrap_or_else(PoisonError::into_inner);
        if state.results[item].is_none() {
            state.results[item] = Some(result);
            state.order.close(item);
            state.count += 1;
            let count = state.count;
            drop(state);
            (self.done)(count);
        }
    }
}
