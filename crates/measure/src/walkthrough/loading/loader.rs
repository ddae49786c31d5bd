//! What loads objects in a simulation: one after the other, at so many bytes a second, each a while after it was asked for.

use enfilade::ObjectId;
use std::collections::VecDeque;

/// See the [module](self). Times are in seconds.
#[derive(Debug)]
pub(super) struct Loader {
    bandwidth: f64,
    latency: f64,
    /// When the last byte that was asked for is sent.
    busy_until: f64,
    /// What is under way and when it comes, in that order.
    under_way: VecDeque<(f64, ObjectId)>,
}

impl Loader {
    pub fn new(bandwidth: f64, latency: f64) -> Self {
        Self { bandwidth, latency, busy_until: 0.0, under_way: VecDeque::new() }
    }

    /// Whether it would have nothing to do before a time.
    pub fn is_idle_before(&self, time: f64) -> bool {
        self.busy_until < time
    }

    pub fn ask(&mut self, now: f64, object: ObjectId, bytes: u64) {
        self.busy_until = self.busy_until.max(now) + bytes as f64 / self.bandwidth;
        self.under_way.push_back((self.busy_until + self.latency, object));
    }

    /// An object that has come by now.
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
        // Without limits: at once.
        let mut instant = Loader::new(f64::INFINITY, 0.0);
        instant.ask(4.0, ObjectId(1), u64::MAX);
        assert_eq!(instant.take(4.0), Some(ObjectId(1)));
    }
}
