//! The result of `vis` for a level as a page and as a table: both bounds against time.
//!
//! This module escapes all text; callers pass plain text. Apart from times, the same result gives the same bytes.

use super::chart::{Along, Chart, Curve, Point, Scale, Shape};
use super::html::{Remark, counts_table, duration, escape, number, page, percent, thousands};
use super::matrix::figure;
use enfilade::BitMatrix;
use std::fmt::Write;

/// Meaning of times.
const TIMES: &str = "wall-clock time since the level was read";

/// Both bounds at a moment. Pairs are ordered and include each cluster with itself.
#[derive(Clone, PartialEq, Debug)]
pub struct Moment {
    /// The stage that has ended: `might-see`, `lines`, `flow 3`.
    pub stage: String,
    /// Seconds since the level was read.
    pub seconds: f64,
    /// Flow steps so far.
    pub steps: u64,
    /// Pairs with a witness line.
    pub lower: u64,
    /// Pairs not proven hidden.
    pub upper: u64,
}

/// Result of random lines alone, in a separate run.
#[derive(Clone, PartialEq, Debug)]
pub struct LinesAlone {
    /// Random lines.
    pub lines: u64,
    /// Seconds since the level was read.
    pub seconds: f64,
    /// Pairs with a witness line.
    pub lower: u64,
}

/// Rows of another tool, to compare.
#[derive(Clone, PartialEq, Debug)]
pub struct Other {
    /// The name of their file.
    pub name: String,
    /// Pairs in their rows.
    pub pairs: u64,
    /// Lines of the table: description and number of pairs.
    pub counts: Vec<(String, u64)>,
}

/// All data of the page.
#[derive(Clone, PartialEq, Debug)]
pub struct LevelReport<'a> {
    /// The name of the level's file.
    pub level: &'a str,
    /// The command that makes this page again.
    pub command: &'a str,
    /// Clusters, portals and leaves, and the origin of portals.
    pub facts: &'a str,
    /// Pairs with a witness line.
    pub lower: &'a BitMatrix,
    /// Pairs not proven hidden.
    pub upper: &'a BitMatrix,
    /// By time; the last one is the result.
    pub moments: &'a [Moment],
    /// By time.
    pub lines_alone: &'a [LinesAlone],
    /// Seconds that reading the level took.
    pub read_seconds: f64,
    /// Threads.
    pub threads: usize,
    /// Peak memory of the search for both bounds, MiB, if the system reports it.
    pub peak_rss_mb: Option<f64>,
    /// Rows of another tool.
    pub other: Option<&'a Other>,
    /// Undecided pairs, each in one direction; those without text are only named.
    pub undecided: &'a [Remark],
    /// Data that the page, the rows or the level leave out, and why.
    pub left_out: &'a [String],
}

impl LevelReport<'_> {
    /// The page.
    pub fn html(&self) -> String {
        let mut body = String::new();
        self.head(&mut body);
        self.curves(&mut body);
        self.stages(&mut body);
        self.beside(&mut body);
        self.picture(&mut body);
        self.doubts(&mut body);
        self.end(&mut body);
        page(&format!("Visibility of {}", self.level), &body)
    }

    /// The table: `method,stage,lines,steps,seconds,lower_pairs,upper_pairs`. Random lines alone come first, without an upper
    /// bound, then both bounds. The last line is the result.
    pub fn csv(&self) -> String {
        let mut out = String::from("method,stage,lines,steps,seconds,lower_pairs,upper_pairs\n");
        for l in self.lines_alone {
            let _ = writeln!(out, "random lines,lines,{},,{:.6},{},", l.lines, l.seconds, l.lower);
        }
        for m in self.moments {
            let _ = writeln!(out, "two-sided,{},,{},{:.6},{},{}", m.stage, m.steps, m.seconds, m.lower, m.upper);
        }
        out
    }

    fn head(&self, out: &mut String) {
        let (lower, upper) = (self.lower.count_ones(), self.upper.count_ones());
        let n = self.upper.rows() as u64;
        let all = n * n;
        let _ = writeln!(
            out,
            "<h1>Visibility of {}</h1>\n<p class=\"soft\">{}. Pairs are ordered pairs of clusters and include each cluster \
             with itself: {} in all.</p>",
            escape(self.level),
            escape(self.facts),
            number(all)
        );
        out.push_str("<div class=\"tiles\">");
        let mut tile = |name: &str, value: String, note: String| {
            let _ = write!(out, "<div>{name}<b>{value}</b><span class=\"soft\">{note}</span></div>");
        };
        tile("Witnessed", number(lower), "each has a straight line as proof".into());
        tile(
            "In the rows",
            number(upper),
            format!("not proven hidden; {:.1} clusters per row", upper as f64 / n.max(1) as f64),
        );
        tile("Undecided", number(upper - lower), format!("{} of the rows", percent(upper - lower, upper)));
        tile("Proven hidden", number(all - upper), format!("{} of all pairs", percent(all - upper, all)));
        let seconds = self.moments.last().map_or(0.0, |m| m.seconds);
        let threads = if self.threads == 1 { "1 thread".to_owned() } else { format!("{} threads", self.threads) };
        let memory = self.peak_rss_mb.map_or(String::new(), |mb| format!(", {mb:.0} MiB"));
        tile("Time", duration(seconds), format!("{threads}{memory}"));
        out.push_str("</div>\n");
    }

    fn curves(&self, out: &mut String) {
        let Some(result) = self.moments.last() else { return };
        out.push_str("<h2>Both bounds against time</h2>\n<figure>\n");
        out.push_str(&self.bounds_chart(result).html());
        out.push_str(
            "<figcaption>The truth lies between the bounds. Pairs below the lower bound are proven visible by a line; pairs above \
             the upper bound are proven hidden. Each mark ends a stage or a round of searches.</figcaption>\n</figure>\n<figure>\n",
        );
        out.push_str(&self.gap_chart(result).html());
        out.push_str(
            "<figcaption>The gap between the bounds, and the visible pairs missed by random lines alone. Random lines \
             find easy pairs at once and hardly any others. They prove nothing hidden.</figcaption>\n</figure>\n",
        );
    }

    /// A curve over the moments.
    fn side(&self, name: String, class: &'static str, value: impl Fn(&Moment) -> u64) -> Curve {
        let point = |m: &Moment| Point {
            x: m.seconds,
            value: value(m) as f64,
            note: format!("{}, {}: {} pairs", m.stage, duration(m.seconds), thousands(value(m))),
        };
        Curve { name, class, shape: Shape::Steps, points: self.moments.iter().map(point).collect() }
    }

    /// A curve of random lines alone.
    fn alone(&self, name: String, value: impl Fn(&LinesAlone) -> u64) -> Curve {
        let point = |l: &LinesAlone| Point {
            x: l.seconds,
            value: value(l) as f64,
            note: format!("{} lines, {}: {} pairs", thousands(l.lines), duration(l.seconds), thousands(value(l))),
        };
        Curve { name, class: "lines", shape: Shape::Straight, points: self.lines_alone.iter().map(point).collect() }
    }

    /// Both bounds, beside other rows and random lines alone.
    fn bounds_chart(&self, result: &Moment) -> Chart<'static> {
        let mut curves = vec![
            self.side(format!("upper bound, at last {}", thousands(result.upper)), "upper", |m| m.upper),
            self.side(format!("lower bound, at last {}", thousands(result.lower)), "lower", |m| m.lower),
        ];
        if let Some(other) = self.other {
            let note = other.name.clone();
            let points = vec![Point { x: 0.0, value: other.pairs as f64, note }];
            let name = format!("rows of {}: {}", other.name, thousands(other.pairs));
            curves.push(Curve { name, class: "other", shape: Shape::Level, points });
        }
        if let Some(most) = self.lines_alone.last() {
            curves.push(self.alone(format!("random lines alone, at last {}", thousands(most.lower)), |l| l.lower));
        }
        Chart {
            title: "Witnessed pairs of clusters and pairs not proven hidden, against time",
            along: Along::Time,
            along_text: TIMES,
            values: "pairs of clusters",
            scale: Scale::Linear,
            curves,
            band: Some([0, 1]),
        }
    }

    /// Undecided pairs, and those that random lines alone missed.
    fn gap_chart(&self, result: &Moment) -> Chart<'static> {
        let name = format!("undecided, at last {}", thousands(result.upper - result.lower));
        let mut curves = vec![self.side(name, "upper", |m| m.upper - m.lower)];
        if let Some(most) = self.lines_alone.last() {
            let missing = |l: &LinesAlone| result.lower.saturating_sub(l.lower);
            let name = format!("visible pairs missed by random lines alone, at last {}", thousands(missing(most)));
            curves.push(self.alone(name, missing));
        }
        Chart {
            title: "Undecided pairs of clusters, against time",
            along: Along::Time,
            along_text: TIMES,
            values: "pairs of clusters (logarithmic)",
            scale: Scale::Logarithmic,
            curves,
            band: None,
        }
    }

    fn stages(&self, out: &mut String) {
        out.push_str(
            "<h2>Stages</h2>\n<div class=\"scroll\"><table><thead><tr><th>stage</th><th>seconds</th><th>done at</th><th>flow steps</th>\
             <th>witnessed</th><th>in the rows</th><th>undecided</th></tr></thead>\n<tbody>\n",
        );
        let _ = writeln!(
            out,
            "<tr><td>read</td><td>{:.3}</td><td></td><td></td><td></td><td></td><td></td></tr>",
            self.read_seconds
        );
        let (mut seconds, mut steps) = (0.0, 0);
        for m in self.moments {
            let _ = writeln!(
                out,
                "<tr><td>{}</td><td>{:.3}</td><td>{:.3}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
                escape(&m.stage),
                m.seconds - seconds,
                m.seconds,
                thousands(m.steps - steps),
                thousands(m.lower),
                thousands(m.upper),
                thousands(m.upper - m.lower)
            );
            (seconds, steps) = (m.seconds, m.steps);
        }
        out.push_str("</tbody></table></div>\n");
        if let Some(most) = self.lines_alone.last() {
            let _ = writeln!(
                out,
                "<p>{} random lines alone took {} and witnessed {} pairs, {} of the pairs known to be visible.</p>",
                thousands(most.lines),
                duration(most.seconds),
                thousands(most.lower),
                percent(most.lower, self.lower.count_ones())
            );
        }
    }

    fn beside(&self, out: &mut String) {
        let Some(other) = self.other else { return };
        let _ = writeln!(out, "<h2>Compared with {}</h2>", escape(&other.name));
        counts_table(out, &other.counts);
    }

    fn picture(&self, out: &mut String) {
        out.push_str("<h2>Visibility matrix</h2>\n");
        out.push_str(&figure(self.lower, self.upper, "clusters, in the level's order"));
    }

    fn doubts(&self, out: &mut String) {
        out.push_str("<h2>Undecided pairs</h2>\n");
        if self.undecided.is_empty() {
            out.push_str("<p>None: each pair has a witness line or is proven hidden.</p>\n");
            return;
        }
        out.push_str(
            "<div class=\"scroll\"><table><thead><tr><th>clusters</th><th class=\"text\">why</th></tr></thead>\n<tbody>\n",
        );
        let (told, named): (Vec<_>, Vec<_>) = self.undecided.iter().partition(|r| !r.text.is_empty());
        for remark in told {
            let _ =
                writeln!(out, "<tr><td>{}</td><td class=\"text\">{}</td></tr>", escape(&remark.about), escape(&remark.text));
        }
        out.push_str("</tbody></table></div>\n");
        if !named.is_empty() {
            let names: Vec<String> = named.iter().map(|r| escape(&r.about)).collect();
            let _ = writeln!(
                out,
                "<details><summary>and {} more</summary><p>{}</p></details>",
                thousands(named.len() as u64),
                names.join("; ")
            );
        }
    }

    fn end(&self, out: &mut String) {
        out.push_str("<h2>Left out</h2>\n<ul>\n");
        for line in self.left_out {
            let _ = writeln!(out, "<li>{}</li>", escape(line));
        }
        let _ = writeln!(out, "</ul>\n<h2>How to reproduce</h2>\n<p><code>{}</code></p>", escape(self.command));
        out.push_str(
            "<p class=\"soft\">Counts are the same on every run and for every number of threads; times are not.</p>\n",
        );
    }
}
