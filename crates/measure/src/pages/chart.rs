//! A chart as SVG: an axis of times, counts or bytes, and curves with steps or straight segments.

use super::html::{duration, escape, share, thousands};
use std::fmt::Write;

/// Seconds below which a mark is in milliseconds.
const SECOND: f64 = 0.9;

/// Seconds below which a mark is in microseconds.
const MILLISECOND: f64 = 0.9e-3;

/// Values from here on use a larger unit.
const FIVE_DIGITS: f64 = 1e4;

/// An axis over more powers of ten than this is marked at powers only.
const DECADES: f64 = 3.0;

const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 400.0;
/// Margins: left, right, top, bottom.
const MARGIN: [f64; 4] = [92.0, 22.0, 14.0, 54.0];
/// Smaller values are drawn here: a clock does not resolve such times.
const LEAST: f64 = 1e-6;
/// An axis of bytes extends beyond its last point by this share.
const AIR: f64 = 0.04;

/// A point of a curve.
#[derive(Clone, PartialEq, Debug)]
pub struct Point {
    /// Seconds or a count, above 0; or bytes.
    pub x: f64,
    /// Value, 0 or more.
    pub value: f64,
    /// Tooltip.
    pub note: String,
}

/// How a curve joins its points.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Shape {
    /// A value holds until the next point; the last one holds to the end of the axis.
    Steps,
    /// Straight from each point to the next.
    Straight,
    /// As [`Self::Straight`], with a large mark at the last point only: the search stopped there.
    Stopped,
    /// One constant value: that of the first point.
    Level,
}

/// A curve.
#[derive(Clone, PartialEq, Debug)]
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// Class in the style sheet: `lower`, `upper`, `other`, `lines`, `s0` to `s6`; `dashed` beside it.
    pub class: &'static str,
    /// How it is drawn.
    pub shape: Shape,
    /// By ascending `x`.
    pub points: Vec<Point>,
}

/// The scale of values.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Scale {
    /// From 0.
    Linear,
    /// Logarithm of the value plus one, so that 0 has a place.
    Logarithmic,
    /// Logarithm of a share; values below `least` (above 0) are drawn there and labelled 0.
    Shares {
        /// The least share that differs from 0 on the axis.
        least: f64,
    },
}

/// The quantity along the axis.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Along {
    /// Seconds, logarithmic.
    Time,
    /// A count, logarithmic.
    Count,
    /// Bytes, from 0.
    Bytes,
}

impl Along {
    /// Position on the axis before scaling to pixels.
    fn scaled(self, x: f64) -> f64 {
        match self {
            Self::Time | Self::Count => x.max(LEAST).log10(),
            Self::Bytes => x,
        }
    }
}

/// A chart.
#[derive(Clone, PartialEq, Debug)]
pub struct Chart<'a> {
    /// Text for screen readers.
    pub title: &'a str,
    /// The quantity along the axis.
    pub along: Along,
    /// Its label.
    pub along_text: &'a str,
    /// Label of the values.
    pub values: &'a str,
    /// Their scale.
    pub scale: Scale,
    /// Curves; later ones are drawn over earlier ones.
    pub curves: Vec<Curve>,
    /// Two curves of [`Shape::Steps`] with the same times; the area between them is filled.
    pub band: Option<[usize; 2]>,
}

impl Chart<'_> {
    /// The legend and the picture.
    pub fn html(&self) -> String {
        let mut out = String::from("<ul class=\"legend\">");
        for curve in &self.curves {
            let _ = write!(
                out,
                "<li><svg viewBox=\"0 0 32 12\" aria-hidden=\"true\"><path class=\"curve {}\" d=\"M1 6H31\"/></svg>{}</li>",
                curve.class,
                escape(&curve.name)
            );
        }
        out.push_str("</ul>\n<div class=\"scroll\">");
        self.draw(&mut out);
        out.push_str("</div>\n");
        out
    }

    fn draw(&self, out: &mut String) {
        let frame = self.frame();
        let title = escape(self.title);
        let _ = writeln!(out, "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{title}\">");
        frame.axes(self, out);
        if let Some([a, b]) = self.band.map(|band| band.map(|i| &self.curves[i])) {
            let back: Vec<[f64; 2]> = frame.corners(b).into_iter().rev().collect();
            let _ = writeln!(out, "<path class=\"band\" d=\"{}\"/>", path(frame.corners(a).into_iter().chain(back)));
        }
        for curve in &self.curves {
            let _ = writeln!(out, "<path class=\"curve {}\" d=\"{}\"/>", curve.class, path(frame.corners(curve)));
        }
        for curve in self.curves.iter().filter(|c| c.shape != Shape::Level) {
            let stopped = curve.shape == Shape::Stopped;
            let (marked, radius) = if stopped { (curve.points.len().saturating_sub(1), 6.0) } else { (0, 3.2) };
            for p in &curve.points[marked..] {
                let [x, y] = frame.at(p);
                let note = escape(&p.note);
                let _ = writeln!(
                    out,
                    "<circle class=\"dot {}\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\"><title>{note}</title></circle>",
                    curve.class
                );
            }
        }
        out.push_str("</svg>\n");
    }

    fn frame(&self) -> Frame {
        let timed = self.curves.iter().filter(|c| c.shape != Shape::Level).flat_map(|c| &c.points);
        let [mut first, mut last] = [f64::INFINITY, 0f64];
        for p in timed {
            let t = p.x.max(LEAST);
            (first, last) = (first.min(t), last.max(t));
        }
        if first > last {
            (first, last) = (0.1, 1.0);
        }
        // Margins at both ends, so that the range is never empty.
        let air = 0.05 + 0.04 * (last / first).log10();
        let ends = match self.along {
            Along::Time | Along::Count => [first.log10() - air, last.log10() + air],
            Along::Bytes => [0.0, (1.0 + AIR) * last.max(1.0)],
        };
        let top = self.curves.iter().flat_map(|c| &c.points).map(|p| p.value).fold(0.0, f64::max);
        let top = match self.scale {
            Scale::Shares { least } => 10f64.powf(top.max(10.0 * least).log10().ceil()),
            _ => top.max(1.0),
        };
        Frame { ends, top, scale: self.scale, along: self.along }
    }
}

/// Maps values to the picture.
struct Frame {
    /// Both ends of the axis, [scaled](Along::scaled).
    ends: [f64; 2],
    /// The greatest value.
    top: f64,
    scale: Scale,
    along: Along,
}

impl Frame {
    fn x(&self, along: f64) -> f64 {
        let [from, to] = self.ends;
        let share = (self.along.scaled(along) - from) / (to - from);
        MARGIN[0] + share * (WIDTH - MARGIN[0] - MARGIN[1])
    }

    fn y(&self, value: f64) -> f64 {
        let scaled = |v: f64| match self.scale {
            Scale::Linear => v,
            Scale::Logarithmic => (1.0 + v).log10(),
            Scale::Shares { least } => (v.max(least) / least).log10(),
        };
        HEIGHT - MARGIN[3] - scaled(value) / (scaled(self.top) * 1.04) * (HEIGHT - MARGIN[2] - MARGIN[3])
    }

    fn at(&self, p: &Point) -> [f64; 2] {
        [self.x(p.x), self.y(p.value)]
    }

    /// The corners of a curve.
    fn corners(&self, curve: &Curve) -> Vec<[f64; 2]> {
        let (left, right) = (MARGIN[0], WIDTH - MARGIN[1]);
        let points: Vec<[f64; 2]> = curve.points.iter().map(|p| self.at(p)).collect();
        let (Some(&first), Some(&last)) = (points.first(), points.last()) else { return Vec::new() };
        match curve.shape {
            Shape::Straight | Shape::Stopped => points,
            Shape::Level => vec![[left, first[1]], [right, first[1]]],
            Shape::Steps => {
                let steps = points.windows(2).flat_map(|p| [p[0], [p[1][0], p[0][1]]]);
                steps.chain([last, [right, last[1]]]).collect()
            }
        }
    }

    fn axes(&self, chart: &Chart<'_>, out: &mut String) {
        let [left, right] = [MARGIN[0], WIDTH - MARGIN[1]];
        let [top, bottom] = [MARGIN[2], HEIGHT - MARGIN[3]];
        for value in self.values() {
            let y = self.y(value);
            let _ = writeln!(
                out,
                "<path class=\"grid\" d=\"M{left} {y:.1}H{right}\"/><text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                left - 8.0,
                y + 4.5,
                self.label(value)
            );
        }
        for seconds in self.ticks() {
            let x = self.x(seconds);
            let _ = writeln!(
                out,
                "<path class=\"grid\" d=\"M{x:.1} {top}V{bottom}\"/><text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
                bottom + 19.0,
                match self.along {
                    Along::Time => tick(seconds),
                    Along::Count | Along::Bytes => thousands(seconds as u64),
                }
            );
        }
        let _ = writeln!(out, "<path class=\"axis\" d=\"M{left} {top}V{bottom}H{right}\"/>");
        let (x, y) = ((left + right) / 2.0, (top + bottom) / 2.0);
        let _ = writeln!(
            out,
            "<text x=\"{x:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}{}</text>\
             <text transform=\"translate(15 {y:.1}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            HEIGHT - 10.0,
            escape(chart.along_text),
            if self.along == Along::Bytes { "" } else { " (logarithmic)" },
            escape(chart.values)
        );
    }

    fn label(&self, value: f64) -> String {
        match self.scale {
            Scale::Shares { least } if value < least => "0".to_owned(),
            Scale::Shares { .. } => share(value),
            _ => thousands(value as u64),
        }
    }

    /// Labelled values.
    fn values(&self) -> Vec<f64> {
        let top = self.top as u64;
        match self.scale {
            Scale::Linear => round_steps(top),
            Scale::Logarithmic => {
                let powers = (1..=top.ilog10()).map(|k| 10u64.pow(k) as f64);
                [0.0].into_iter().chain(powers).collect()
            }
            Scale::Shares { least } => {
                let decades = (self.top / least).log10().round() as i32;
                let powers = (1..=decades).map(|k| self.top * 10f64.powi(k - decades));
                [0.0].into_iter().chain(powers).collect()
            }
        }
    }

    /// Labelled places along the axis: powers of ten, with 2 and 5 times those if there is room; for bytes, round steps.
    fn ticks(&self) -> Vec<f64> {
        let [from, to] = self.ends;
        if self.along == Along::Bytes {
            return round_steps(to as u64);
        }
        let between: &[f64] = if to - from > DECADES { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let powers = from.floor() as i32..=to.floor() as i32;
        let all = powers.flat_map(|k| between.iter().map(move |b| b * 10f64.powi(k)));
        all.filter(|t| (from..=to).contains(&t.log10())).collect()
    }
}

/// From 0 to `top`: 1, 2 or 5 times a power of ten, four to eight of them.
fn round_steps(top: u64) -> Vec<f64> {
    let least = top.div_ceil(8).max(1);
    let ten = 10u64.pow(least.ilog10());
    let step = [1, 2, 5, 10].map(|k| k * ten).into_iter().find(|&s| s >= least).unwrap_or(least);
    (0..=top / step).map(|k| (k * step) as f64).collect()
}

/// Label of a time: one digit and a unit.
fn tick(seconds: f64) -> String {
    let (value, unit) = match seconds {
        s if s < MILLISECOND => (s * 1e6, "µs"),
        s if s < SECOND => (s * 1e3, "ms"),
        s => (s, "s"),
    };
    if value < FIVE_DIGITS { format!("{value:.0} {unit}") } else { duration(seconds) }
}

fn path(corners: impl IntoIterator<Item = [f64; 2]>) -> String {
    let mut out = String::new();
    for [x, y] in corners {
        let _ = write!(out, "{}{x:.1} {y:.1}", if out.is_empty() { 'M' } else { 'L' });
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn chart(scale: Scale, points: &[(f64, f64)]) -> Chart<'static> {
        let point = |&(seconds, value): &(f64, f64)| Point { x: seconds, value, note: "<note>".into() };
        let points = points.iter().map(point).collect();
        let curve = Curve { name: "a & b".into(), class: "lower", shape: Shape::Steps, points };
        Chart { title: "t", along: Along::Time, along_text: "time", values: "v", scale, curves: vec![curve], band: None }
    }

    #[test]
    fn ten_times_later_is_as_far_anywhere() {
        let frame = chart(Scale::Linear, &[(0.001, 0.0), (10.0, 50.0)]).frame();
        let x = [0.001, 0.01, 0.1, 1.0, 10.0].map(|t| frame.x(t));
        x.windows(3).for_each(|w| assert!((w[2] - w[1] - (w[1] - w[0])).abs() < 1e-9 && w[1] > w[0]));
        assert!(x[0] > MARGIN[0] && x[4] < WIDTH - MARGIN[1]);
        // Greater values are higher.
        assert!(frame.y(0.0) == HEIGHT - MARGIN[3] && frame.y(50.0) < frame.y(25.0) && frame.y(50.0) > MARGIN[2]);
    }

    #[test]
    fn a_value_holds_until_it_changes() {
        let chart = chart(Scale::Linear, &[(0.1, 4.0), (1.0, 8.0)]);
        let frame = chart.frame();
        let corners = frame.corners(&chart.curves[0]);
        let ([x0, x1], [y0, y1]) = ([0.1, 1.0].map(|t| frame.x(t)), [4.0, 8.0].map(|v| frame.y(v)));
        assert_eq!(corners, [[x0, y0], [x1, y0], [x1, y1], [WIDTH - MARGIN[1], y1]]);
    }

    #[test]
    fn labels_are_round_and_have_room() {
        for (top, values) in
            [(1.0, vec![0, 1]), (7.0, (0..8).collect()), (128_338.0, (0..7).map(|k| k * 20_000).collect::<Vec<_>>())]
        {
            let values: Vec<f64> = values.into_iter().map(f64::from).collect();
            assert_eq!(chart(Scale::Linear, &[(1.0, top)]).frame().values(), values, "{top}");
        }
        assert_eq!(chart(Scale::Logarithmic, &[(1.0, 2500.0)]).frame().values(), [0.0, 10.0, 100.0, 1000.0]);
        let shares = chart(Scale::Shares { least: 1e-4 }, &[(1.0, 0.03), (2.0, 0.0)]).frame();
        let labels: Vec<String> = shares.values().into_iter().map(|v| shares.label(v)).collect();
        assert_eq!(labels, ["0", "0.1 %", "1 %", "10 %"]);
        assert_eq!((shares.y(0.0), shares.y(1e-5)), (shares.y(1e-4), shares.y(1e-4)));
        for times in [[1e-4, 1e2], [0.02, 0.03], [0.5, 0.5], [0.01, 9.0]] {
            let frame = chart(Scale::Linear, &times.map(|t| (t, 1.0))).frame();
            let x: Vec<f64> = frame.ticks().into_iter().map(|t| frame.x(t)).collect();
            assert!(x.windows(2).all(|w| w[1] - w[0] > 55.0), "{times:?}: {x:?}");
        }
        assert_eq!([1e-5, 2e-3, 0.5, 1.0, 2000.0, 1e5].map(tick), ["10 µs", "2 ms", "500 ms", "1 s", "2000 s", "1667 min"]);
    }

    #[test]
    fn bytes_begin_at_0_and_only_where_it_was_stopped_there_is_a_mark() {
        let mut chart = chart(Scale::Linear, &[(0.0, 90.0), (250.0, 60.0), (1000.0, 50.0)]);
        (chart.along, chart.curves[0].shape) = (Along::Bytes, Shape::Stopped);
        let frame = chart.frame();
        let x = [0.0, 250.0, 500.0, 1000.0].map(|bytes| frame.x(bytes));
        assert!(x[0] == MARGIN[0] && x[1] - x[0] == x[2] - x[1] && x[3] < WIDTH - MARGIN[1], "{x:?}");
        assert_eq!(frame.ticks(), [0.0, 200.0, 400.0, 600.0, 800.0, 1000.0]);
        let html = chart.html();
        let (mark, ends) = (html.matches("<circle").count(), format!("cx=\"{:.1}\" cy=\"{:.1}\"", x[3], frame.y(50.0)));
        assert!(mark == 1 && html.contains(&ends) && !html.contains("logarithmic"));
    }

    #[test]
    fn text_is_safe_and_an_empty_chart_is_one() {
        let html = chart(Scale::Logarithmic, &[(0.0, 0.0)]).html();
        assert!(
            html.contains("a &amp; b") && html.contains("&lt;note&gt;") && !html.contains("NaN") && !html.contains("inf")
        );
        assert!(!chart(Scale::Linear, &[]).html().contains("NaN"));
    }
}
