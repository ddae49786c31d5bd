//! Times of benches, and what a bench is told on its command line.

use std::time::{Duration, Instant};

/// Whether a flag is given.
pub fn is_told(flag: &str) -> bool {
    std::env::args().any(|word| word == flag)
}

/// Words that are no flags.
pub fn names() -> Vec<String> {
    std::env::args().skip(1).filter(|word| !word.starts_with("--")).collect()
}

/// What work gives, and its time.
pub fn timed<T>(work: impl FnOnce() -> T) -> (T, Duration) {
    let start = Instant::now();
    let out = work();
    (out, start.elapsed())
}

/// The least time of several.
pub fn least<T>(repeats: usize, mut work: impl FnMut() -> T) -> Duration {
    (0..repeats).map(|_| timed(|| std::hint::black_box(work())).1).min().unwrap_or_default()
}

/// Microseconds that so many percent of sorted times don't exceed.
pub fn us(sorted: &[Duration], percent: usize) -> f64 {
    sorted[(sorted.len() - 1) * percent / 100].as_secs_f64() * 1e6
}

/// The exponent of growth between two sizes and their times: 1 is linear. Nothing before the second.
pub fn growth(before: &mut Option<(f64, f64)>, count: f64, seconds: f64) -> String {
    let of = |(n, s): (f64, f64)| format!(", growth n^{:.2}", (seconds / s).ln() / (count / n).ln());
    before.replace((count, seconds)).map_or(String::new(), of)
}
