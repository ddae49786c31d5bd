//! The error and the cost of drawing tubes: a section of a page, and a table.

use super::chart::{Along, Chart, Curve, Point, Scale, Shape};
use super::html::{duration, thousands};
pub use super::tube_errors::{TubeErrors, TubeView, measure};
use enfilade::scene::TubeCount;
use serde::Serialize;
use std::fmt::Write;

/// Tubes of a scene.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct TubesFound {
    /// Their number and memory.
    #[serde(skip)] // the bake's report has it
    pub count: TubeCount,
    /// Views with measured errors.
    pub views: usize,
    /// By limit, ascending.
    pub errors: Vec<TubeErrors>,
}

impl TubesFound {
    /// The table: one line a limit.
    pub fn csv(&self) -> String {
        let mut out = "limit_px,segments,triangles,over,greatest_px,mean_px,samples,greatest_weight,mean_weight,thin_samples,microseconds\n".to_owned();
        for e in &self.errors {
            let _ = writeln!(
                out,
                "{},{:.1},{:.1},{:.1},{:.4},{:.5},{},{:.4},{:.5},{},{:.1}",
                e.limit_px,
                e.segments,
                e.triangles,
                e.over,
                e.greatest_px,
                e.mean_px,
                e.samples,
                e.greatest_weight,
                e.mean_weight,
                e.thin_samples,
                e.seconds * 1e6
            );
        }
        out
    }

    /// The section of a page.
    pub(super) fn html(&self) -> String {
        let mut out = format!(
            "<h2>Tubes</h2>\n<p>{}.</p>\n<p>A limit in pixels selects sections and sides of all tubes on the screen, from {} views along the \
             tour. Points of the exact surface, including hidden ones, are compared with the drawn one. <em>Over</em> counts \
             chords at the finest level that may exceed the limit. Tubes thinner than a pixel are drawn a pixel wide and blended by their \
             coverage; <em>weight</em> is the relative error of that coverage.</p>\n<figure>\n{}</figure>\n",
            self.count,
            self.views,
            self.chart().html()
        );
        self.table(&mut out);
        out
    }

    /// Errors against the time of selection.
    fn chart(&self) -> Chart<'static> {
        let curve = |name: &str, class, value: fn(&TubeErrors) -> f64| {
            let note = |e: &TubeErrors| {
                let triangles = thousands(e.triangles.round() as u64);
                format!("{} px: {:.3} px, {triangles} triangles, {}", e.limit_px, value(e), duration(e.seconds))
            };
            let mut points: Vec<Point> =
                self.errors.iter().map(|e| Point { x: e.seconds, value: value(e), note: note(e) }).collect();
            points.sort_by(|a, b| a.x.total_cmp(&b.x));
            Curve { name: name.to_owned(), class, shape: Shape::Straight, points }
        };
        Chart {
            title: "Error of tubes in pixels, against the time of selection",
            along: Along::Time,
            along_text: "mean time of selection per frame",
            values: "pixels (logarithmic)",
            scale: Scale::Logarithmic,
            curves: vec![
                curve("limit", "upper", |e| e.limit_px),
                curve("greatest", "lower", |e| e.greatest_px),
                curve("mean", "other", |e| e.mean_px),
            ],
            band: None,
        }
    }

    /// All numbers, one line a limit.
    fn table(&self, out: &mut String) {
        out.push_str("<div class=\"scroll\"><table><thead><tr>");
        for head in [
            "limit, px",
            "segments",
            "triangles",
            "over",
            "greatest, px",
            "mean, px",
            "points",
            "weight, worst",
            "mean",
            "thin points",
            "time",
        ] {
            let _ = write!(out, "<th>{head}</th>");
        }
        out.push_str("</tr></thead>\n<tbody>\n");
        for e in &self.errors {
            let whole = |x: f64| thousands(x.round() as u64);
            let _ = writeln!(
                out,
                "<tr><td>{}</td><td>{}</td><td>{}</td><td>{:.1}</td><td>{:.3}</td><td>{:.4}</td><td>{}</td>{}<td>{}</td></tr>",
                e.limit_px,
                whole(e.segments),
                whole(e.triangles),
                e.over,
                e.greatest_px,
                e.mean_px,
                thousands(e.samples),
                weights(e),
                duration(e.seconds)
            );
        }
        out.push_str("</tbody></table></div>\n");
    }
}

/// Table cells: the errors of weight in percent, if any.
fn weights(e: &TubeErrors) -> String {
    match e.thin_samples {
        0 => "<td>-</td><td>-</td><td>0</td>".to_owned(),
        thin => format!(
            "<td>{:+.1} %</td><td>{:.2} %</td><td>{}</td>",
            100.0 * e.greatest_weight,
            100.0 * e.mean_weight,
            thousands(thin)
        ),
    }
}
