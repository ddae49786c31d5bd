//! A simulated loader: one object after the other, with a bandwidth and a latency.

use enfilade::ObjectId;
use std::collections::VecDeque;

/// See the [module](self). Times are in seconds.
#[derive(Debug)]
pub(super) struct Loader {
    bandwidth: f64,
    latency: f64,
    /// When the last requested byte is sent.
    busy_until: f64,
    /// Objects under way and their times of arrival, in that order.
    under_way: VecDeque<(f64, ObjectId)>,
}

impl Loader {
    pub fn new(bandwidth: f64, latency: f64) -> Self {
        Self { bandwidth, latency, busy_until: 0.0, under_way: VecDeque::new() }
    }

    /// Whether it runs out of work before a time.
    pub fn is_idle_before(&self, time: f64) -> bool {
        self.busy_until < time
    }

    pub fn ask(&mut self, now: f64, object: ObjectId, bytes: u64) {
        self.busy_until = self.busy_until.max(now) + bytes as f64 / self.bandwidth;
        self.under_way.push_back((self.busy_until + self.latency, object));
    }

    /// The next object that has arrived by now.
    pub fn take(&mut self, now: f64) -> Option<ObjectId> {
        let &(comes, object) = self.under_way.front()?;
        (comes <= now).then(|| {
            self.under_way.pop_front();
            object
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_come_in_order_each_after_those_before_it() {
        let mut loader = Loader::new(100.0, 0.5);
        loader.ask(1.0, ObjectId(7), 50);
        loader.ask(1.0, ObjectId(3), 100);
        assert!(!loader.is_idle_before(2.5) && loader.is_idle_before(2.51));
        assert_eq!((loader.take(1.99), loader.take(2.0), loader.take(2.9)), (None, Some(ObjectId(7)), None));
        assert_eq!((loader.take(3.0), loader.take(9.0)), (Some(ObjectId(3)), None));
        // Without limits, objects arrive at once.
        let mut instant = Loader::new(f64::INFINITY, 0.0);
        instant.ask(4.0, ObjectId(1), u64::MAX);
        assert_eq!(instant.take(4.0), Some(ObjectId(1)));
    }
}
