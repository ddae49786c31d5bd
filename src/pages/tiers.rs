//! Which rows to ship: conservative ones, and sampled ones to several bounds, in the same views.

use super::html::{share, thousands};
use crate::types::bounds::SamplingEnd;
use crate::types::drawn::DrawnOfFile;
use crate::types::guarantee::Guarantee;
use serde::Serialize;
use std::fmt::Write;

/// How a tier came about.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// Conservative rows: nothing had to be reached.
    Proven,
    /// Its bound was reached.
    Reached,
    /// The tier before has reached this bound, too: the rows are the same.
    AsBefore,
    /// Not reached: all rays were cast.
    Rays,
    /// Not reached: time was over.
    Time,
    /// Not reached: there was no memory for the proofs.
    Memory,
}

impl Outcome {
    /// Of sampling that ended by `end`. `reached`: all bounds that were asked for are met.
    pub fn of(end: SamplingEnd, reached: bool) -> Self {
        match end {
            _ if reached => Self::Reached,
            // Cells met it; view cells didn't, with all their rays.
            SamplingEnd::Rays | SamplingEnd::Unseen => Self::Rays,
            SamplingEnd::Time => Self::Time,
            SamplingEnd::Memory => Self::Memory,
        }
    }

    /// As in JSON.
    fn key(self) -> &'static str {
        match self {
            Self::Proven => "proven",
            Self::Reached => "reached",
            Self::AsBefore => "as_before",
            Self::Rays => "rays",
            Self::Time => "time",
            Self::Memory => "memory",
        }
    }

    /// In words.
    pub fn in_words(self) -> &'static str {
        match self {
            Self::Proven => "nothing had to be reached, since rows leave out only what is proven hidden",
            Self::Reached => "reached",
            Self::AsBefore => "nothing more was needed, since the tier above has reached this bound",
            Self::Rays => "not reached, since all rays were cast (--rays)",
            Self::Time => "not reached, since time was over (--time)",
            Self::Memory => "not reached, since memory for proofs was full",
        }
    }
}

/// Rows that can be shipped.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct Tier {
    /// The side that the rows take.
    pub ship: Guarantee,
    /// The bound that was asked for, a fraction; conservative rows have none.
    pub unseen_asked: Option<f64>,
    /// How it came about.
    pub outcome: Outcome,
    /// Length of the file.
    pub file_bytes: u64,
    /// Processor time of the bake without cells, all threads, seconds.
    pub cpu_seconds: f64,
    /// Rays cast, those of view cells included.
    pub rays: u64,
    /// What the rows lack of what there is to see, at most, in the mean over cells or over view cells, whichever is more: a
    /// bound with [`CONFIDENCE`](crate::file::CONFIDENCE). `None` for conservative rows, or where no rays were cast to tell.
    pub unseen: Option<f64>,
    /// What it draws and misses.
    #[serde(flatten)]
    pub drawn: DrawnOfFile,
}

impl Tier {
    /// `conservative`, `sampled 0.01 %`.
    pub fn name(&self) -> String {
        name(self.unseen_asked)
    }
}

/// The name of a tier with this bound.
pub fn name(unseen_asked: Option<f64>) -> String {
    unseen_asked.map_or_else(|| "conservative".to_owned(), |asked| format!("sampled {}", share(asked)))
}

/// Tiers in the same views.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Tiers {
    /// Views.
    pub views: usize,
    /// Their seed.
    pub views_seed: u64,
    /// Width and height of a view, pixels.
    pub size: [usize; 2],
    /// Mean triangles of the objects that really show.
    pub exact_triangles_mean: f64,
    /// Conservative first, then by falling bounds.
    pub rows: Vec<Tier>,
}

impl Tiers {
    /// A table: a line a tier.
    pub fn csv(&self) -> String {
        let mut out = String::from(
            "tier,outcome,file_bytes,cpu_seconds,rays,unseen_asked,unseen,pvs_triangles_mean,both_triangles_mean,\
             exact_triangles_mean,pvs_missed_pixels,both_missed_pixels,pvs_crack_pixels,both_crack_pixels\n",
        );
        let number = |n: Option<f64>| n.map_or(String::new(), |n| n.to_string());
        for t in &self.rows {
            let DrawnOfFile { pvs, both } = t.drawn;
            let _ = writeln!(
                out,
                "{},{},{},{:.3},{},{},{},{},{},{},{},{},{},{}",
                t.name(),
                t.outcome.key(),
                t.file_bytes,
                t.cpu_seconds,
                t.rays,
                number(t.unseen_asked),
                number(t.unseen),
                pvs.triangles_mean,
                both.triangles_mean,
                self.exact_triangles_mean,
                pvs.missed_pixels,
                both.missed_pixels,
                pvs.crack_pixels,
                both.crack_pixels
            );
        }
        out
    }

    /// The section of a page.
    pub(super) fn html(&self) -> String {
        let [width, height] = self.size;
        let pixels = (self.views * width * height) as f64;
        let mut out = format!(
            "<h2>Which rows to ship</h2>\n<p>Conservative rows keep all that is not proven hidden. Sampled rows keep what is \
             witnessed. Of what there is to see they lack at most the part that is called unseen, with 95&nbsp;% confidence. A \
             smaller part takes more rays and misses fewer pixels. Triangles and missed pixels are of {} random views, {width} &times; \
             {height} pixels each, that nothing was sampled from: by rows (<code>pvs</code>), and by portals and rows \
             (<code>both</code>, of which the missed pixels are). In the mean, {} triangles really show.</p>\n<div class=\"scroll\"><table><thead><tr><th>tier</th>\
             <th>bytes</th><th>CPU seconds</th><th>rays</th><th>unseen</th><th>triangles, pvs</th><th>triangles, both</th>\
             <th>missed pixels</th></tr></thead>\n<tbody>\n",
            thousands(self.views as u64),
            whole(self.exact_triangles_mean),
        );
        for t in &self.rows {
            let DrawnOfFile { pvs, both } = t.drawn;
            let missed = both.missed_pixels;
            let part = if missed > 0 { format!(" ({})", share(missed as f64 / pixels)) } else { String::new() };
            let _ = writeln!(
                out,
                "<tr><td>{}</td><td>{}</td><td>{:.2}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}{part}</td></tr>",
                t.name(),
                thousands(t.file_bytes),
                t.cpu_seconds,
                thousands(t.rays),
                t.unseen.map_or_else(|| if t.unseen_asked.is_some() { "not tested" } else { "" }.to_owned(), share),
                whole(pvs.triangles_mean),
                whole(both.triangles_mean),
                thousands(missed),
            );
        }
        out.push_str("</tbody></table></div>\n<ul>\n");
        for t in &self.rows {
            let _ = writeln!(out, "<li>{}: {}</li>", t.name(), t.outcome.in_words());
        }
        out.push_str("</ul>\n");
        if let Some(advice) = self.advice() {
            let _ = writeln!(out, "<p>{advice}</p>");
        }
        out
    }

    /// What the smallest bound that was reached saves.
    fn advice(&self) -> Option<String> {
        let [all, drawn] =
            [self.rows.first()?, self.rows.iter().rfind(|t| matches!(t.outcome, Outcome::Reached | Outcome::AsBefore))?];
        let [of_all, of_drawn] = [all, drawn].map(|t| t.drawn.both.triangles_mean);
        let part = if of_all > 0.0 { share(of_drawn / of_all) } else { share(1.0) };
        Some(format!("By portals and rows, {} rows draw {part} of the triangles of conservative ones.", drawn.name()))
    }
}

fn whole(mean: f64) -> String {
    thousands(mean.round() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::types::drawn::Drawn;

    fn tier(unseen_asked: Option<f64>, outcome: Outcome, triangles_mean: f64) -> Tier {
        let both = Drawn { triangles_mean, missed_pixels: 0, crack_pixels: 0 };
        let ship = if unseen_asked.is_some() { Guarantee::Sampled } else { Guarantee::Conservative };
        let drawn = DrawnOfFile { pvs: both, both };
        Tier { ship, unseen_asked, outcome, file_bytes: 7, cpu_seconds: 1.0, rays: 5, unseen: unseen_asked, drawn }
    }

    #[test]
    fn words_say_why_a_bound_was_not_reached() {
        let ends = [SamplingEnd::Rays, SamplingEnd::Unseen, SamplingEnd::Time, SamplingEnd::Memory];
        let words = ends.map(|end| Outcome::of(end, false).in_words());
        for (words, why) in words.into_iter().zip(["rays", "rays", "time", "memory"]) {
            assert!(words.starts_with("not reached, since ") && words.contains(why), "{words}");
        }
        assert!(ends.iter().all(|&end| Outcome::of(end, true) == Outcome::Reached));
    }

    #[test]
    fn the_smallest_bound_that_was_reached_is_held_against_conservative_rows() {
        let rows = vec![
            tier(None, Outcome::Proven, 200.0),
            tier(Some(1e-3), Outcome::Reached, 40.0),
            tier(Some(1e-4), Outcome::Reached, 50.0),
            tier(Some(1e-5), Outcome::Rays, 60.0),
        ];
        let tiers = Tiers { views: 10, views_seed: 1, size: [4, 2], exact_triangles_mean: 30.4, rows };
        let html = tiers.html();
        assert!(html.contains("sampled 0.01 % rows draw 25 % of the triangles of conservative ones"));
        assert!(html.contains("30 triangles really show") && html.contains("not reached, since all rays were cast"));
        let none = Tiers { rows: vec![tiers.rows[0], tiers.rows[3]], ..tiers };
        assert_eq!(none.advice(), None);
    }
}
