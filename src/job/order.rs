//! Which item of a map a worker works out next, where several work on one map and none waits for another.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// The order in which one of some workers works through a map.
///
/// Item `i` is on the list of worker `i` modulo the number of workers. A worker goes down its own list; then it takes what
/// nobody has yet, from the far end of the list on which most is left: there the one whose list it is comes last. So the end
/// of a map comes early even where a worker is slow, late or lost, and what two work out is little.
pub struct Order {
    items: usize,
    /// Whose order this is, and of how many.
    worker: usize,
    workers: usize,
    /// Had by somebody, or taken by this worker.
    closed: Vec<bool>,
    /// By list, how many are open, and an item beyond which none is.
    open: Vec<usize>,
    far: Vec<usize>,
    next: usize,
    /// Lists by what was open on them when they were looked at last, which is no less than what is; ties by how far they are from the
    /// worker's own. Empty while that isn't done.
    longest: BinaryHeap<(usize, Reverse<usize>)>,
}

impl Order {
    /// For `worker` of `workers`, over so many items.
    pub fn new(items: usize, worker: usize, workers: usize) -> Self {
        let lists = workers.clamp(1, items.max(1));
        let open: Vec<usize> = (0..lists).map(|list| items.saturating_sub(list).div_ceil(workers.max(1))).collect();
        let far = (0..lists).map(|list| list + open[list].saturating_sub(1) * workers.max(1)).collect();
        Self {
            items,
            worker,
            workers: workers.max(1),
            closed: vec![false; items],
            open,
            far,
            next: worker,
            longest: BinaryHeap::new(),
        }
    }

    /// Somebody has the result of an item.
    pub fn close(&mut self, item: usize) {
        if !std::mem::replace(&mut self.closed[item], true) {
            self.open[item % self.workers] -= 1;
        }
    }

    /// The next item, and whether it is on the worker's own list; `None` where each is had or taken.
    pub fn next_item(&mut self) -> Option<(usize, bool)> {
        while self.next < self.items {
            let item = self.next;
            self.next += self.workers;
            if !self.closed[item] {
                self.close(item);
                return Some((item, true));
            }
        }
        // Workers look from different places on, so that not all of them take the same item.
        let lists = self.open.len();
        let list = |after: usize| (self.worker + after) % lists;
        if self.longest.is_empty() {
            self.longest = (0..lists).map(|after| (self.open[list(after)], Reverse(after))).collect();
        }
        let slowest = loop {
            let mut top = self.longest.peek_mut()?;
            let (open, Reverse(after)) = *top;
            let now = self.open[list(after)];
            if now == open {
                break list(after);
            }
            top.0 = now;
        };
        if self.open[slowest] == 0 {
            return None;
        }
        let mut item = self.far[slowest];
        while self.closed[item] {
            item -= self.workers;
        }
        self.far[slowest] = item;
        self.close(item);
        Some((item, false))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn own_items_come_first_and_then_the_far_end_of_the_longest_list() {
        // Ten items for three workers: 0 3 6 9, 1 4 7 and 2 5 8.
        let mut order = Order::new(10, 1, 3);
        assert_eq!([order.next_item(), order.next_item()], [Some((1, true)), Some((4, true))]);
        // Somebody has taken what was to come, and worker 2 is through with two of its own.
        [7, 2, 5].into_iter().for_each(|item| order.close(item));
        assert_eq!([order.next_item(), order.next_item(), order.next_item()], [9, 6, 3].map(|item| Some((item, false))));
        // One is left on each list: the one after this worker's first.
        assert_eq!([order.next_item(), order.next_item()], [8, 0].map(|item| Some((item, false))));
        assert_eq!(order.next_item(), None);
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
