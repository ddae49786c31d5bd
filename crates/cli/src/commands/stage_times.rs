//! Time and memory by stage.

use super::bake::peak_rss_mb;
use enfilade_measure::pages::building::Stage;
use std::time::Instant;

/// What each stage took, in the order in which they were first entered.
#[derive(Default)]
pub struct Stages {
    /// Those that were left; one that was entered again has its times added up.
    pub done: Vec<Stage>,
    current: Option<(String, Instant)>,
}

impl Stages {
    /// True where this is another stage than before.
    pub fn enter(&mut self, stage: &str) -> bool {
        let is_new = self.current.as_ref().is_none_or(|(name, _)| name != stage);
        if is_new {
            self.leave();
            self.current = Some((stage.to_owned(), Instant::now()));
        }
        is_new
    }

    /// Ends the last stage.
    pub fn leave(&mut self) {
        let Some((name, since)) = self.current.take() else { return };
        let (seconds, peak_rss_mb) = (since.elapsed().as_secs_f64(), peak_rss_mb());
        match self.done.iter_mut().find(|s| s.name == name) {
            Some(stage) => {
                stage.seconds += seconds;
                stage.peak_rss_mb = peak_rss_mb;
            }
            None => self.done.push(Stage { name, seconds, peak_rss_mb }),
        }
    }
}

/// Processor time; where the system doesn't tell, wall clock on all threads.
pub struct Clock {
    cpu: Option<f64>,
    wall: Instant,
}

impl Clock {
    /// From now on.
    pub fn start() -> Self {
        Self { cpu: cpu_seconds(), wall: Instant::now() }
    }

    /// Since it was started.
    pub fn seconds(&self) -> f64 {
        match (self.cpu, cpu_seconds()) {
            (Some(from), Some(to)) => to - from,
            _ => self.wall.elapsed().as_secs_f64() * rayon::current_num_threads() as f64,
        }
    }
}

/// Processor time that the threads of this process have had, seconds, where the system says so.
fn cpu_seconds() -> Option<f64> {
    let tasks = std::fs::read_dir("/proc/self/task").ok()?;
    let mut nanoseconds = 0.0;
    for task in tasks {
        // A thread may end in between.
        let Ok(text) = std::fs::read_to_string(task.ok()?.path().join("schedstat")) else { continue };
        nanoseconds += text.split_whitespace().next()?.parse::<f64>().ok()?;
    }
    (nanoseconds > 0.0).then_some(nanoseconds * 1e-9)
}
