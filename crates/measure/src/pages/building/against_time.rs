//! Error against run time: charts and their table.

use super::BuildingReport;
use crate::pages::chart::{Along, Chart, Curve as Line, Point, Scale, Shape};
use crate::pages::curves::{Curve, CurvePoint};
use crate::pages::html::{duration, escape, share, thousands};
use std::fmt::Write;

/// Smaller shares of a view are drawn as 0: one pixel of some 2,000 views.
const LEAST_SHARE: f64 = 1e-7;
/// Classes of curves in the style sheet: solid and dashed.
const CLASSES: [[&str; 2]; 7] = [
    ["s0", "s0 dashed"],
    ["s1", "s1 dashed"],
    ["s2", "s2 dashed"],
    ["s3", "s3 dashed"],
    ["s4", "s4 dashed"],
    ["s5", "s5 dashed"],
    ["s6", "s6 dashed"],
];

impl BuildingReport<'_> {
    pub(super) fn against_time(&self, out: &mut String) {
        let upper = self.curves.iter().flat_map(|c| &c.points).filter_map(|p| p.upper_pairs).min();
        let Some(upper) = upper else { return };
        let _ = writeln!(
            out,
            "<p>Each mark is a separate run. {} held-out views of 96 &times; 54 pixels measure the share of a picture \
             that the witnessed pairs alone would miss. The rows of this file contain more pairs and miss nothing.</p>",
            thousands(self.views as u64)
        );
        for chart in charts(self.curves, upper) {
            let _ = writeln!(out, "<figure>\n{}</figure>", chart.html());
        }
        self.curves_table(out);
    }

    /// The points of all curves.
    fn curves_table(&self, out: &mut String) {
        out.push_str(
            "<div class=\"scroll\"><table><thead><tr><th>strategy</th><th>CPU seconds</th><th>rays</th><th>witnessed</th>\
             <th>not proven hidden</th><th>missing, mean</th><th>p95</th><th>max</th></tr></thead>\n<tbody>\n",
        );
        for (curve, p) in self.curves.iter().flat_map(|c| c.points.iter().map(move |p| (c, p))) {
            let [mean, p95, max] = p.false_pixels.map(share);
            let _ = writeln!(
                out,
                "<tr><td>{}</td><td>{:.2}</td><td>{}</td><td>{}</td><td>{}</td><td>{mean}</td><td>{p95}</td><td>{max}</td></tr>",
                escape(curve.strategy),
                p.cpu_seconds,
                thousands(p.rays),
                thousands(p.lower_pairs),
                p.upper_pairs.map_or(String::new(), thousands)
            );
        }
        out.push_str("</tbody></table></div>\n");
    }
}

/// The charts; `upper`: the fewest pairs that any point leaves not proven hidden.
fn charts(curves: &[Curve], upper: u64) -> [Chart<'static>; 3] {
    let chart = |title, values, scale, series: &[Series], text| Chart {
        title,
        along: Along::Time,
        along_text: "processor time of the visibility stages, all threads",
        values,
        scale,
        curves: lines(curves, series, upper, text),
        band: None,
    };
    let count = |v: f64| thousands(v as u64);
    [
        chart(
            "Witnessed pairs and pairs not proven hidden, against run time",
            "cell-object pairs",
            Scale::Linear,
            &[
                Series { what: "not proven hidden", broken: true, value: |p, _| p.upper_pairs.map(|u| u as f64) },
                Series { what: "witnessed", broken: false, value: |p, _| Some(p.lower_pairs as f64) },
            ],
            count,
        ),
        chart(
            "Pairs that may be visible but have no witness, against run time",
            "cell-object pairs (logarithmic)",
            Scale::Logarithmic,
            &[Series {
                what: "without a witness and not proven hidden in any run",
                broken: false,
                value: |p, upper| Some(upper.saturating_sub(p.lower_pairs) as f64),
            }],
            count,
        ),
        chart(
            "Share of a picture that the witnessed pairs alone would miss, against run time",
            "share of a view (logarithmic)",
            Scale::Shares { least: LEAST_SHARE },
            &[
                Series { what: "missing in the worst view", broken: true, value: |p, _| Some(p.false_pixels[2]) },
                Series { what: "missing on average", broken: false, value: |p, _| Some(p.false_pixels[0]) },
            ],
            share,
        ),
    ]
}

/// A series of values over the points of a curve.
struct Series {
    /// Its name.
    what: &'static str,
    /// Whether its line is dashed.
    broken: bool,
    /// The value, from a point and the fewest pairs that any point leaves not proven hidden.
    value: fn(&CurvePoint, u64) -> Option<f64>,
}

/// A line for each curve and series with values.
fn lines(curves: &[Curve], series: &[Series], upper: u64, text: fn(f64) -> String) -> Vec<Line> {
    let line = |k: usize, curve: &Curve, series: &Series| {
        let point = |p: &CurvePoint| {
            let value = (series.value)(p, upper)?;
            let (rays, time) = (thousands(p.rays), duration(p.cpu_seconds));
            let note = format!("{}, {rays} rays, {time}: {} {}", curve.strategy, text(value), series.what);
            Some(Point { x: p.cpu_seconds, value, note })
        };
        let points: Vec<Point> = curve.points.iter().filter_map(point).collect();
        let last = text(points.last()?.value);
        let class = CLASSES[k % CLASSES.len()][usize::from(series.broken)];
        let name = format!("{}: {}, at last {last}", curve.strategy, series.what);
        Some(Line { name, class, shape: Shape::Straight, points })
    };
    curves.iter().enumerate().flat_map(|(k, curve)| series.iter().filter_map(move |s| line(k, curve, s))).collect()
}
