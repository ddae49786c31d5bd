//! A building that is opened in the background: what there is of it so far, and how much is still to do.

use crate::args::Args;
use crate::building::{Building, EARLY};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, OnceLock, PoisonError};
use std::time::{Duration, Instant};

/// Stages of a bake in their order, by the beginnings of their names, and about how much of the whole each takes: for a bar that goes on
/// evenly. Seconds that are left are said once the bar has come so far.
const STAGES: [(&str, f64); 10] = [
    ("read", 0.01),
    ("pictures", 0.01),
    ("cells", 0.06),
    ("placement", 0.01),
    ("sampling", 0.45),
    ("unseen", 0.02),
    ("holes", 0.02),
    ("flow", 0.17),
    ("aimed rays", 0.18),
    ("occluders", 0.07),
];
const TOLD: f64 = 0.05;

/// News of the thread that opens a building.
#[derive(Default)]
pub struct Opening {
    early: [OnceLock<Building>; EARLY],
    whole: OnceLock<Result<Building, String>>,
    /// The stage, how much of it is done, and when the first one began.
    progress: Mutex<Option<(String, f64, Instant)>>,
    stop: AtomicBool,
}

/// How far it is.
#[derive(Clone, PartialEq, Debug)]
pub struct Share {
    /// The current stage.
    pub stage: String,
    /// Of all, 0 to 1.
    pub done: f64,
    /// How long the rest takes, if that can be said.
    pub left: Option<Duration>,
}

impl Opening {
    /// Opens what the command line names, if it names a file; on a thread of its own.
    pub fn run(&self, args: &Args) {
        let Some(file) = &args.file else { return };
        let tell = |stage: &str, done: f64| {
            let mut progress = self.progress.lock().unwrap_or_else(PoisonError::into_inner);
            let begun = progress.as_ref().map_or_else(Instant::now, |(_, _, begun)| *begun);
            *progress = Some((stage.to_owned(), done, begun));
        };
        // This thread alone sets them.
        let early = |number: usize, building: Building| drop(self.early[number].set(building));
        let whole = Building::open(file, args.model.as_deref(), &tell, &self.stop, Some(&early));
        drop(self.whole.set(whole));
    }

    /// Stops it soon.
    pub fn stop(&self) {
        self.stop.store(true, Ordering::Relaxed);
    }

    /// The best that there is by now, and its number; the whole has [`EARLY`].
    pub fn best(&self) -> Option<(usize, Result<&Building, &str>)> {
        if let Some(whole) = self.whole.get() {
            return Some((EARLY, whole.as_ref().map_err(String::as_str)));
        }
        let early = self.early.iter().enumerate().rev();
        early.filter_map(|(number, building)| Some((number, Ok(building.get()?)))).next()
    }

    /// How far it is; `None` once it is done.
    pub fn share(&self) -> Option<Share> {
        if self.whole.get().is_some() {
            return None;
        }
        let progress = self.progress.lock().unwrap_or_else(PoisonError::into_inner);
        progress.as_ref().map(|(stage, done, begun)| share(stage, *done, begun.elapsed()))
    }
}

/// See [`Opening::share`].
fn share(stage: &str, done: f64, since: Duration) -> Share {
    let at = STAGES.iter().position(|(name, _)| stage.starts_with(name)).unwrap_or(0);
    let before: f64 = STAGES[..at].iter().map(|(_, share)| share).sum();
    // Rounded sums end a little beyond all.
    let done = (before + STAGES[at].1 * done.clamp(0.0, 1.0)).min(1.0);
    let left = (done >= TOLD).then(|| since.mul_f64((1.0 - done) / done));
    Share { stage: stage.to_owned(), done, left }
}

impl Share {
    /// In a line.
    pub fn say(&self) -> String {
        let left = self.left.map_or_else(String::new, |left| format!(", about {} s left", left.as_secs().max(1)));
        format!("{}{left}", self.stage)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_grows_through_all_stages_and_what_is_left_follows() {
        let sum: f64 = STAGES.iter().map(|(_, share)| share).sum();
        assert!((sum - 1.0).abs() < 1e-9, "{sum}");
        let all =
            STAGES.iter().flat_map(|(name, _)| [0.0, 0.5, 1.0].map(|done| share(name, done, Duration::from_secs(60)).done));
        let all: Vec<f64> = all.collect();
        assert!(all.is_sorted() && all[0] == 0.0 && (all[all.len() - 1] - 1.0).abs() < 1e-9, "{all:?}");
        // Half is done after a minute: another one is left.
        let half =
            (0..=1000).map(|i| share("sampling", f64::from(i) / 1000.0, Duration::from_secs(60))).find(|s| s.done >= 0.5);
        assert!(half.unwrap().left.unwrap().as_secs_f64() > 59.0);
        assert_eq!(share("cells", 0.0, Duration::from_secs(1)).left, None);
    }
}
