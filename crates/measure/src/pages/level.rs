//! What `vis` found in a level, as a page and as a table: both sides of the truth against time.
//!
//! All text is made safe here; whoever calls hands over plain text. But for times, the same result gives the same bytes.

use super::chart::{Along, Chart, Curve, Point, Scale, Shape};
use super::html::{Remark, duration, escape, number, page, percent, thousands};
use super::matrix::figure;
use enfilade::BitMatrix;
use std::fmt::Write;

/// What times are.
const TIMES: &str = "wall-clock time since the level was read";

/// Both sides at some moment. Pairs are ordered, each cluster with itself among them.
#[derive(Clone, PartialEq, Debug)]
pub struct Moment {
    /// What is done by then: `might-see`, `lines`, `flow 3`.
    pub stage: String,
    /// Seconds since the level was read.
    pub seconds: f64,
    /// Flow steps so far.
    pub steps: u64,
    /// Pairs that a line proves.
    pub lower: u64,
    /// Pairs not proven hidden.
    pub upper: u64,
}

/// What random lines alone find, in a run of their own.
#[derive(Clone, PartialEq, Debug)]
pub struct LinesAlone {
    /// Random lines.
    pub lines: u64,
    /// Seconds since the level was read.
    pub seconds: f64,
    /// Pairs that a line proves.
    pub lower: u64,
}

/// Rows of another tool, beside.
#[derive(Clone, PartialEq, Debug)]
pub struct Other {
    /// The name of their file.
    pub name: String,
    /// Pairs in their rows.
    pub pairs: u64,
    /// A line of a table each: what it is, and how many pairs.
    pub counts: Vec<(String, u64)>,
}

/// All that the page tells.
#[derive(Clone, PartialEq, Debug)]
pub struct LevelReport<'a> {
    /// The name of the level's file.
    pub level: &'a str,
    /// The command that makes this page again.
    pub command: &'a str,
    /// Clusters, portals and leaves, and where portals are from.
    pub facts: &'a str,
    /// Pairs that a line proves.
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
    /// Most memory held by the search for both sides, MiB, where the system says so.
    pub peak_rss_mb: Option<f64>,
    /// Rows of another tool.
    pub other: Option<&'a Other>,
    /// Undecided pairs, the first of each two ways; those without text are only named.
    pub undecided: &'a [Remark],
    /// What isn't on the page, in the rows or in the level, and why.
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

    /// The table: `method,stage,lines,steps,seconds,lower_pairs,upper_pairs`, first the random lines alone, which have no upper
    /// bound, then both sides. The last line is the result.
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
            "<h1>Visibility of {}</h1>\n<p class=\"soft\">{}. Pairs are ordered pairs of clusters, each cluster with itself among \
             them: {} in all.</p>",
            escape(self.level),
            escape(self.facts),
            number(all)
        );
        out.push_str("<div class=\"tiles\">");
        let mut tile = |name: &str, value: String, note: String| {
            let _ = write!(out, "<div>{name}<b>{value}</b><span class=\"soft\">{note}</span></div>");
        };
        tile("Witnessed", number(lower), "a straight line proves each".into());
        tile(
            "In the rows",
            number(upper),
            format!("not proven hidden; {:.1} clusters a row", upper as f64 / n.max(1) as f64),
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
        let side = |name: String, class, value: &dyn Fn(&Moment) -> u64| {
            let point = |m: &Moment| Point {
                x: m.seconds,
                value: value(m) as f64,
                note: format!("{}, {}: {} pairs", m.stage, duration(m.seconds), thousands(value(m))),
            };
            Curve { name, class, shape: Shape::Steps, points: self.moments.iter().map(point).collect() }
        };
        let alone = |name: String, value: &dyn Fn(&LinesAlone) -> u64| {
            let point = |l: &LinesAlone| Point {
                x: l.seconds,
                value: value(l) as f64,
                note: format!("{} lines, {}: {} pairs", thousands(l.lines), duration(l.seconds), thousands(value(l))),
            };
            Curve { name, class: "lines", shape: Shape::Straight, points: self.lines_alone.iter().map(point).collect() }
        };
        let most = self.lines_alone.last();
        out.push_str("<h2>Both bounds against time</h2>\n<figure>\n");
        let mut curves = vec![
            side(format!("upper bound, at last {}", thousands(result.upper)), "upper", &|m| m.upper),
            side(format!("lower bound, at last {}", thousands(result.lower)), "lower", &|m| m.lower),
        ];
        if let Some(other) = self.other {
            let note = other.name.clone();
            let points = vec![Point { x: 0.0, value: other.pairs as f64, note }];
            let name = format!("rows of {}: {}", other.name, thousands(other.pairs));
            curves.push(Curve { name, class: "other", shape: Shape::Level, points });
        }
        if let Some(most) = most {
            curves.push(alone(format!("random lines alone, at last {}", thousands(most.lower)), &|l| l.lower));
        }
        let chart = Chart {
            title: "Pairs of clusters that are witnessed, and that are not proven hidden, against time",
            along: Along::Time,
            along_text: TIMES,
            values: "pairs of clusters",
            scale: Scale::Linear,
            curves,
            band: Some([0, 1]),
        };
        out.push_str(&chart.html());
        out.push_str(
            "<figcaption>The truth lies between the bounds: below the lower one is what a line proves visible, above the upper one \
             what is proven hidden. Each mark is a stage or a round of searches that has ended.</figcaption>\n</figure>\n<figure>\n",
        );
        let mut curves =
            vec![side(format!("undecided, at last {}", thousands(result.upper - result.lower)), "upper", &|m| {
                m.upper - m.lower
            })];
        if let Some(most) = most {
            let missing = |l: &LinesAlone| result.lower.saturating_sub(l.lower);
            let name = format!("visible pairs that random lines alone haven't found, at last {}", thousands(missing(most)));
            curves.push(alone(name, &missing));
        }
        let chart = Chart {
            title: "Pairs of clusters that are undecided, against time",
            along: Along::Time,
            along_text: TIMES,
            values: "pairs of clusters (logarithmic)",
            scale: Scale::Logarithmic,
            curves,
            band: None,
        };
        out.push_str(&chart.html());
        out.push_str(
            "<figcaption>The gap between the bounds, and how far random lines get without searches: they find what is easily seen \
             at once, and the rest hardly ever; and they never say what is hidden.</figcaption>\n</figure>\n",
        );
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
                "<p>For comparison, {} random lines alone took {} and witnessed {} pairs, {} of what is known to be visible.</p>",
                thousands(most.lines),
                duration(most.seconds),
                thousands(most.lower),
                percent(most.lower, self.lower.count_ones())
            );
        }
    }

    fn beside(&self, out: &mut String) {
        let Some(other) = self.other else { return };
        let _ = writeln!(
            out,
            "<h2>Beside {}</h2>\n<div class=\"scroll\"><table><thead><tr><th>what</th><th>pairs</th></tr></thead>\n<tbody>",
            escape(&other.name)
        );
        for (what, pairs) in &other.counts {
            let _ = writeln!(out, "<tr><td>{}</td><td>{}</td></tr>", escape(what), number(*pairs));
        }
        out.push_str("</tbody></table></div>\n");
    }

    fn picture(&self, out: &mut String) {
        out.push_str("<h2>Who sees whom</h2>\n");
        out.push_str(&figure(self.lower, self.upper, "clusters, in the level's order"));
    }

    fn doubts(&self, out: &mut String) {
        out.push_str("<h2>Undecided pairs</h2>\n");
        if self.undecided.is_empty() {
            out.push_str("<p>None: each pair is on a line, or proven hidden.</p>\n");
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
        out.push_str("<h2>What was left out</h2>\n<ul>\n");
        for line in self.left_out {
            let _ = writeln!(out, "<li>{}</li>", escape(line));
        }
        let _ = writeln!(out, "</ul>\n<h2>Again</h2>\n<p><code>{}</code></p>", escape(self.command));
        out.push_str(
            "<p class=\"soft\">Counts are the same on every run and for every number of threads; times are not.</p>\n",
        );
    }
}
