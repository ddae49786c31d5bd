//! The order of a map's items for each of several workers, without waits.

use crate::math::random::Prng;

/// The order of items for one worker.
///
/// Items are dealt in rounds: in each round, worker `i` has item `i`. A worker first does its own list. Then it takes one more item of each
/// round, the last round first, if it is still open: its neighbour's item in one round, the next neighbour's in the next. So all others
/// share the items of a slow or lost worker, each takes different ones, and the slow worker would reach them last. Results become known
/// with a delay, in which many items may be done: with one common order, all workers would do the same items. The remaining items are taken
/// at random.
pub struct Order {
    items: usize,
    worker: usize,
    workers: usize,
    /// The next item of the worker's own list.
    next: usize,
    /// Number of finished rounds, from the last one.
    rounds: usize,
    /// Open items, in any order; and the place of each item in this list.
    open: Vec<u32>,
    places: Vec<u32>,
    random: Prng,
}

/// The place of an item that is not open.
const NONE: u32 = u32::MAX;

impl Order {
    /// The order for `worker` of `workers`, over fewer than 2^32 items.
    pub fn new(items: usize, worker: usize, workers: usize) -> Self {
        let open: Vec<u32> = (0..items as u32).collect();
        Self {
            items,
            worker,
            workers: workers.max(1),
            next: worker,
            rounds: 0,
            places: open.clone(),
            open,
            random: Prng::new(worker as u64, 0),
        }
    }

    /// Marks an item as done.
    pub fn close(&mut self, item: usize) {
        let place = std::mem::replace(&mut self.places[item], NONE);
        if place != NONE {
            self.open.swap_remove(place as usize);
            if let Some(&moved) = self.open.get(place as usize) {
                self.places[moved as usize] = place;
            }
        }
    }

    /// The next item, and whether it is on the worker's own list; `None` if all are done or taken.
    pub fn next_item(&mut self) -> Option<(usize, bool)> {
        while self.next < self.items {
            let item = self.next;
            self.next += self.workers;
            if self.take(item) {
                return Some((item, true));
            }
        }
        let rounds = self.items.div_ceil(self.workers);
        while self.workers > 1 && self.rounds < rounds {
            let list = (self.worker + 1 + self.rounds % (self.workers - 1)) % self.workers;
            self.rounds += 1;
            let item = (rounds - self.rounds) * self.workers + list;
            if item < self.items && self.take(item) {
                return Some((item, false));
            }
        }
        // For an empty list, `get` fails at place 0.
        let item = *self.open.get(self.random.below(self.open.len()))? as usize;
        self.close(item);
        Some((item, false))
    }

    /// Takes an item; false if it is not open.
    fn take(&mut self, item: usize) -> bool {
        let is_open = self.places[item] != NONE;
        self.close(item);
        is_open
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_items_come_first_and_then_one_of_each_round() {
        // Ten items for three workers: 0 3 6 9, 1 4 7 and 2 5 8.
        let mut order = Order::new(10, 1, 3);
        assert_eq!([order.next_item(), order.next_item()], [Some((1, true)), Some((4, true))]);
        // The next item is taken, and worker 2 has finished two of its own.
        [7, 2, 5].into_iter().for_each(|item| order.close(item));
        // Worker 2 has no item in the last round. Then follow worker 0's 6, worker 2's 5, which is done, and worker 0's 0.
        assert_eq!([order.next_item(), order.next_item()], [6, 0].map(|item| Some((item, false))));
        let rest = [order.next_item(), order.next_item(), order.next_item()].map(|next| next.map_or(0, |(item, _)| item));
        assert_eq!((rest.iter().sum::<usize>(), order.next_item()), (3 + 8 + 9, None));
    }

    #[test]
    fn what_a_lost_worker_leaves_is_shared_before_others_know_of_it() {
        // Worker 0 of ten is lost. The others do a ninth each of its items, all different, without communication.
        let mut done = std::collections::BTreeSet::new();
        for worker in 1..10 {
            let mut order = Order::new(900, worker, 10);
            (0..900).filter(|item| item % 10 != 0).for_each(|item| order.close(item));
            done.extend((0..10).filter_map(|_| order.next_item()));
        }
        assert_eq!(done, (0..900).step_by(10).map(|item| (item, false)).collect());
    }

    #[test]
    fn every_worker_would_do_all_of_it_alone() {
        for items in 0..9 {
            for workers in 1..12 {
                for worker in 0..workers + 2 {
                    let mut order = Order::new(items, worker, workers);
                    let mut taken: Vec<usize> = std::iter::from_fn(|| order.next_item()).map(|(item, _)| item).collect();
                    taken.sort_unstable();
                    assert!(taken.into_iter().eq(0..items), "{worker} of {workers}");
                }
            }
        }
    }
}
