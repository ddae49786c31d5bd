//! Time and memory by stage.

use super::bake::peak_rss_mb;
use enfilade_measure::pages::building::Stage;
use std::time::Instant;

/// Time and memory of each stage, in order of the first entry.
#[derive(Default)]
pub struct Stages {
    /// Finished stages; times of a stage that was entered again are added up.
    pub done: Vec<Stage>,
    current: Option<(String, Instant)>,
}

impl Stages {
    /// Enters a stage; true if it is not the current one.
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

/// Processor time, or wall time on all threads if the system doesn't report it.
pub struct Clock {
    cpu: Option<f64>,
    wall: Instant,
}

impl Clock {
    /// Starts now.
    pub fn start() -> Self {
        Self { cpu: cpu_seconds(), wall: Instant::now() }
    }

    /// Seconds since the start.
    pub fn seconds(&self) -> f64 {
        match (self.cpu, cpu_seconds()) {
            (Some(from), Some(to)) => to - from,
            _ => self.wall.elapsed().as_secs_f64() * rayon::current_num_threads() as f64,
        }
    }
}

/// Processor time of this process's threads, seconds, if the system reports it.
fn cpu_seconds() -> Option<f64> {
    let tasks = std::fs::read_dir("/proc/self/task").ok()?;
    let mut nanoseconds = 0.0;
    for task in tasks {
        // A thread may end meanwhile.
        let Ok(text) = std::fs::read_to_string(task.ok()?.path().join("schedstat")) else { continue };
        nanoseconds += text.split_whitespace().next()?.parse::<f64>().ok()?;
    }
    (nanoseconds > 0.0).then_some(nanoseconds * 1e-9)
}
