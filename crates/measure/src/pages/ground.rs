//! The error and the cost of drawing a ground, as a page and as a table.
//!
//! This module escapes all text; callers pass plain text. Apart from times, the same ground gives the same bytes.

use super::chart::{Along, Chart, Curve, Point, Scale, Shape};
use super::html::{duration, escape, page, thousands};
use enfilade_terrain::{Limit, Measured};
use std::fmt::Write;

/// A flight and its measurements.
#[derive(Clone, PartialEq, Debug)]
pub struct Flight {
    /// Metres above the ground.
    pub above: f64,
    /// By limit: first pixels, then triangles, both ascending.
    pub found: Vec<Measured>,
}

/// All data of the page.
#[derive(Clone, PartialEq, Debug)]
pub struct GroundReport<'a> {
    /// The name of the file.
    pub ground: &'a str,
    /// The command that makes this page again.
    pub command: &'a str,
    /// Samples, spacing, heights, tiles.
    pub facts: &'a [String],
    /// Pixels of the screen, across and down.
    pub size: [u32; 2],
    /// Frames of a flight.
    pub frames: usize,
    /// By height above the ground.
    pub flights: &'a [Flight],
}

impl GroundReport<'_> {
    /// The page.
    pub fn html(&self) -> String {
        let mut out = format!("<h1>{}</h1>\n<ul>\n", escape(self.ground));
        for fact in self.facts {
            let _ = writeln!(out, "<li>{}</li>", escape(fact));
        }
        let [across, down] = self.size;
        let _ = writeln!(out, "<li>{} frames a flight, {across} x {down} pixels, 60 degrees</li>\n</ul>", self.frames);
        for flight in self.flights {
            self.flight(flight, &mut out);
        }
        let _ = writeln!(out, "<h2>How to reproduce</h2>\n<p><code>{}</code></p>", escape(self.command));
        out.push_str(
            "<p class=\"soft\">Errors compare 2,000 random samples of the raster per frame with their drawn positions. \
             <em>Promised</em> is the bound that the selection guarantees. Times are for the selection; triangles show the cost of drawing.</p>\n",
        );
        page(self.ground, &out)
    }

    fn flight(&self, flight: &Flight, out: &mut String) {
        let _ = writeln!(out, "<h2>{} m above the ground</h2>\n<figure>", flight.above);
        let pixels: Vec<&Measured> = flight.found.iter().filter(|m| matches!(m.limit, Limit::Pixels(_))).collect();
        let budgets: Vec<&Measured> = flight.found.iter().filter(|m| matches!(m.limit, Limit::Triangles(_))).collect();
        let curve = |name: &str, class, of: &[&Measured], value: &dyn Fn(&Measured) -> f64| {
            let point = |m: &&Measured| Point {
                x: m.triangles.max(1.0),
                value: value(m),
                note: format!(
                    "{}: {:.3} px, {} triangles, {}",
                    limit(m.limit),
                    value(m),
                    thousands(m.triangles as u64),
                    duration(m.seconds)
                ),
            };
            let mut points: Vec<Point> = of.iter().map(point).collect();
            points.sort_by(|a, b| a.x.total_cmp(&b.x));
            Curve { name: name.to_owned(), class, shape: Shape::Straight, points }
        };
        let chart = Chart {
            title: "Error of samples in pixels, against triangles a frame",
            along: Along::Count,
            along_text: "triangles a frame, in the mean",
            values: "pixels (logarithmic)",
            scale: Scale::Logarithmic,
            curves: vec![
                curve("promised, by pixels", "upper", &pixels, &|m| m.told),
                curve("greatest, by pixels", "lower", &pixels, &|m| m.greatest),
                curve("mean, by pixels", "other", &pixels, &|m| m.mean),
                curve("greatest, by triangles", "lines", &budgets, &|m| m.greatest),
            ],
            band: None,
        };
        out.push_str(&chart.html());
        out.push_str("</figure>\n<div class=\"scroll\"><table><thead><tr>");
        for head in ["limit", "triangles", "time", "promised, px", "greatest, px", "mean, px"] {
            let _ = write!(out, "<th>{head}</th>");
        }
        out.push_str("</tr></thead>\n<tbody>\n");
        for m in &flight.found {
            let _ = writeln!(
                out,
                "<tr><td>{}</td><td>{}</td><td>{}</td><td>{:.3}</td><td>{:.3}</td><td>{:.4}</td></tr>",
                limit(m.limit),
                thousands(m.triangles as u64),
                duration(m.seconds),
                m.told,
                m.greatest,
                m.mean
            );
        }
        out.push_str("</tbody></table></div>\n");
    }

    /// The table.
    pub fn csv(&self) -> String {
        let mut out = "above_m,limit,triangles,microseconds,told_px,greatest_px,mean_px,samples\n".to_owned();
        for flight in self.flights {
            for m in &flight.found {
                let _ = writeln!(
                    out,
                    "{},{},{:.0},{:.1},{:.4},{:.4},{:.5},{}",
                    flight.above,
                    limit(m.limit),
                    m.triangles,
                    m.seconds * 1e6,
                    m.told,
                    m.greatest,
                    m.mean,
                    m.samples
                );
            }
        }
        out
    }
}

fn limit(limit: Limit) -> String {
    match limit {
        Limit::Pixels(pixels) => format!("{pixels} px"),
        Limit::Distance(pixels) => format!("{pixels} px over distance"),
        Limit::Triangles(most) => format!("{most} triangles"),
    }
}
