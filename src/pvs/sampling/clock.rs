//! How long sampling may take.

use crate::job::Job;
use std::time::{Duration, Instant};

/// Runs from the start of sampling.
pub(in crate::pvs) struct Clock {
    begin: Instant,
    most: Option<Duration>,
}

impl Clock {
    /// Rings after `seconds`, or never.
    pub fn start(seconds: Option<f64>) -> Self {
        let most = seconds.map(|s| Duration::try_from_secs_f64(s).unwrap_or(Duration::MAX));
        Self { begin: Instant::now(), most }
    }

    /// True where time is over. A bake that goes on from a journal decides as the one before did.
    pub fn is_over(&self, work: &Job<'_>) -> bool {
        let Some(most) = self.most else { return false };
        let now = || Ok::<_, std::convert::Infallible>(self.begin.elapsed() >= most);
        let Ok(over) = work.once(now);
        over
    }
}
