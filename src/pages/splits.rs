//! View cells by cost: expected triangles against bytes of rows, while space is split.

use super::chart::{Along, Chart, Curve, Point, Scale, Shape};
use super::html::thousands;
use serde::Serialize;
use std::fmt::Write;

/// Classes of curves in the style sheet.
const CLASSES: [&str; 4] = ["s0", "s1", "s2", "s3"];

/// Why no more splits were made.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SplitsEnd {
    /// The next would have taken too many bytes.
    Bytes,
    /// The next would have saved too little.
    Saving,
}

/// After a split.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct SplitPoint {
    /// View cells; none before the first split.
    pub view_cells: usize,
    /// Bytes that they are expected to take.
    pub bytes: u64,
    /// Triangles of what is seen, in the mean over eyes, expected.
    pub triangles: f64,
}

/// The splits of one bake.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Splits {
    /// Which rows: `conservative`, `sampled 0.01 %`.
    pub tier: String,
    /// Bytes that view cells may take.
    pub bytes_allowed: u64,
    /// Why no more were made.
    pub ended_by: SplitsEnd,
    /// Split by split, from none on.
    pub points: Vec<SplitPoint>,
}

impl Splits {
    /// From bytes and triangles after each split; the first is without view cells. `full`: the next would have taken too many
    /// bytes.
    pub fn new(tier: String, bytes_allowed: u64, full: bool, curve: &[(u64, f64)]) -> Self {
        // The first split makes two of one.
        let cells = |splits: usize| if splits == 0 { 0 } else { splits + 1 };
        let point =
            |(splits, &(bytes, triangles)): (usize, &(u64, f64))| SplitPoint { view_cells: cells(splits), bytes, triangles };
        let ended_by = if full { SplitsEnd::Bytes } else { SplitsEnd::Saving };
        Self { tier, bytes_allowed, ended_by, points: curve.iter().enumerate().map(point).collect() }
    }

    /// Where they ended, in words.
    fn end(&self, tiers: &str) -> String {
        let last = self.points.last().copied().unwrap_or(SplitPoint { view_cells: 0, bytes: 0, triangles: 0.0 });
        let why = match self.ended_by {
            SplitsEnd::Bytes => format!("the next would take more than {} bytes", thousands(self.bytes_allowed)),
            SplitsEnd::Saving => "the next would save too little".to_owned(),
        };
        format!(
            "{tiers}: stopped at {} view cells, {} bytes, {} triangles; {why}",
            thousands(last.view_cells as u64),
            thousands(last.bytes),
            thousands(last.triangles.round() as u64)
        )
    }
}

/// A table: a line a split.
pub fn csv(splits: &[Splits]) -> String {
    let mut out = String::from("tier,view_cells,bytes,triangles\n");
    for (of, p) in splits.iter().flat_map(|s| s.points.iter().map(move |p| (s, p))) {
        let _ = writeln!(out, "{},{},{},{}", of.tier, p.view_cells, p.bytes, p.triangles);
    }
    out
}

/// The section of a page.
pub(super) fn html(splits: &[Splits]) -> String {
    // Splits that are the same have one line.
    let mut lines: Vec<(&Splits, String)> = Vec::new();
    for of in splits {
        match lines.iter_mut().find(|(same, _)| same.ended_by == of.ended_by && same.points == of.points) {
            Some((_, tiers)) => *tiers += &format!(", {}", of.tier),
            None => lines.push((of, of.tier.clone())),
        }
    }
    let curve = |(k, (of, tiers)): (usize, &(&Splits, String))| {
        let point = |p: &SplitPoint| Point { x: p.bytes as f64, value: p.triangles, note: of.end(tiers) };
        let points = of.points.iter().map(point).collect();
        Curve { name: of.end(tiers), class: CLASSES[k % CLASSES.len()], shape: Shape::Stopped, points }
    };
    let chart = Chart {
        title: "Expected triangles of a row against bytes of view cells, while space is split",
        along: Along::Bytes,
        along_text: "bytes of view cells, expected",
        values: "triangles of what an eye sees, expected",
        scale: Scale::Linear,
        curves: lines.iter().enumerate().map(curve).collect(),
        band: None,
    };
    format!(
        "<h2>View cells by cost</h2>\n<p>Space is halved where that saves most triangles. Each line begins without view cells. The \
         mark is where the bake stopped. Figures are expected ones: a byte for each object that eyes see from a view cell, and \
         triangles in the mean over eyes.</p>\n<figure>\n{}</figure>\n",
        chart.html()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_split_makes_two_view_cells_of_none() {
        let splits = Splits::new("sampled 0.1 %".into(), 500, true, &[(0, 90.0), (100, 50.5), (180, 40.0)]);
        let table = csv(std::slice::from_ref(&splits));
        let lines = [
            "tier,view_cells,bytes,triangles",
            "sampled 0.1 %,0,0,90",
            "sampled 0.1 %,2,100,50.5",
            "sampled 0.1 %,3,180,40",
        ];
        assert_eq!(table.lines().collect::<Vec<_>>(), lines);
        // Two bakes with the same splits share a line.
        let html = html(&[splits.clone(), Splits { tier: "sampled 0.01 %".into(), ..splits }]);
        assert_eq!(
            (html.matches("<circle").count(), html.matches("sampled 0.1 %, sampled 0.01 %: stopped").count()),
            (1, 2)
        );
        assert!(html.contains("stopped at 3 view cells, 180 bytes, 40 triangles; the next would take more than 500 bytes"));
        let few = Splits::new("conservative".into(), 500, false, &[(0, 90.0)]);
        assert_eq!(
            few.end("conservative"),
            "conservative: stopped at 0 view cells, 0 bytes, 90 triangles; the next would save too little"
        );
    }
}
