//! What to say of a level whose portal file is missing or older than it is, as where its map leaks.

use super::lost::of_compilers;
use std::path::{Path, PathBuf};
use std::time::{SystemTime, UNIX_EPOCH};

/// Seconds between two files of one run of a compiler, which writes them in any order.
const SAME_RUN: u64 = 600;

/// What to say of the portal file beside a level, or of its lack.
pub fn note(level: &Path, prt: &Path) -> Option<String> {
    let trace = trace(level);
    let trace = trace.as_deref().map(Path::display);
    let written = time(level)?;
    let Some(of_prt) = time(prt) else {
        let trace = trace?;
        return Some(format!(
            "{} is missing, and {trace} traces a leak: the map leaks, so its compiler wrote no portals, and they come from the \
             level's tree, which the outside belongs to. Load {trace} in your map editor, close the hole, run the compiler anew, \
             and then vis",
            prt.display()
        ));
    };
    let is_older = written.duration_since(of_prt).is_ok_and(|age| age.as_secs() > SAME_RUN);
    is_older.then(|| {
        let leak = match trace {
            Some(trace) => format!("as the map leaks ({trace} traces the leak). Load that in your map editor, close the hole"),
            None => "as where a map leaks. Close a leak that it told of".to_owned(),
        };
        format!(
            "{} is of {}, the level of {}: the compiler wrote no portals when it made this level, and these may be those of an \
             older one, {leak}, run the compiler anew, and then vis",
            prt.display(),
            date(of_prt),
            date(written)
        )
    })
}

/// The compiler's trace of a leak, if it isn't from before the level.
fn trace(level: &Path) -> Option<PathBuf> {
    let written = time(level)?;
    let is_new = |path: &PathBuf| {
        time(path).is_some_and(|time| written.duration_since(time).map_or(0, |age| age.as_secs()) <= SAME_RUN)
    };
    of_compilers(level).into_iter().find(is_new)
}

/// When a file was last written.
fn time(path: &Path) -> Option<SystemTime> {
    std::fs::metadata(path).and_then(|data| data.modified()).ok()
}

/// A time to the minute, in UTC.
fn date(time: SystemTime) -> String {
    let minutes = time.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs() / 60);
    let [year, month, day] = calendar(minutes / (24 * 60));
    format!("{year}-{month:02}-{day:02} {:02}:{:02} UTC", minutes / 60 % 24, minutes % 60)
}

/// Year, month and day of the Gregorian calendar, `days` after 1970-01-01.
fn calendar(mut days: u64) -> [u64; 3] {
    let is_leap = |year: u64| year.is_multiple_of(4) && !year.is_multiple_of(100) || year.is_multiple_of(400);
    let mut year = 1970;
    while days >= 365 + u64::from(is_leap(year)) {
        days -= 365 + u64::from(is_leap(year));
        year += 1;
    }
    let february = 28 + u64::from(is_leap(year));
    let mut month = 1;
    for length in [31, february, 31, 30, 31, 30, 31, 31, 30, 31, 30, 31] {
        if days < length {
            break;
        }
        days -= length;
        month += 1;
    }
    [year, month, days + 1]
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn dates_are_those_of_the_calendar() {
        // As `date -u -d @SECONDS` has them.
        for (seconds, text) in [
            (0, "1970-01-01 00:00 UTC"),
            (951_782_399, "2000-02-28 23:59 UTC"),
            (951_825_600, "2000-02-29 12:00 UTC"),
            (1_735_689_599, "2024-12-31 23:59 UTC"),
            (4_107_542_400, "2100-03-01 00:00 UTC"),
        ] {
            assert_eq!(date(UNIX_EPOCH + Duration::from_secs(seconds)), text);
        }
    }
}
