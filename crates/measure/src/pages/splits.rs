//! View cells by cost: expected triangles against bytes of rows, split by split.

use super::chart::{Along, Chart, Curve, Point, Scale, Shape};
use super::html::thousands;
use serde::Serialize;
use std::fmt::Write;

/// Why splitting ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum SplitsEnd {
    /// The next split would have taken too many bytes.
    Bytes,
    /// The next split would have saved too little.
    Saving,
}

/// State after a split.
#[derive(Clone, Copy, PartialEq, Debug, Serialize)]
pub struct SplitPoint {
    /// View cells; none before the first split.
    pub view_cells: usize,
    /// Their expected bytes.
    pub bytes: u64,
    /// Expected visible triangles, mean over eyes.
    pub triangles: f64,
}

/// The splits of one bake.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Splits {
    /// Bytes that view cells may take.
    pub bytes_allowed: u64,
    /// Why splitting ended.
    pub ended_by: SplitsEnd,
    /// One a split, from 0 splits on.
    pub points: Vec<SplitPoint>,
}

impl Splits {
    /// From bytes and triangles after each split; the first has no view cells. `full`: the next split would have taken too many
    /// bytes.
    pub fn new(bytes_allowed: u64, full: bool, curve: &[(u64, f64)]) -> Self {
        // The first split makes two of one.
        let cells = |splits: usize| if splits == 0 { 0 } else { splits + 1 };
        let point =
            |(splits, &(bytes, triangles)): (usize, &(u64, f64))| SplitPoint { view_cells: cells(splits), bytes, triangles };
        let ended_by = if full { SplitsEnd::Bytes } else { SplitsEnd::Saving };
        Self { bytes_allowed, ended_by, points: curve.iter().enumerate().map(point).collect() }
    }

    /// Where and why splitting ended, in words.
    fn end(&self) -> String {
        let last = self.points.last().copied().unwrap_or(SplitPoint { view_cells: 0, bytes: 0, triangles: 0.0 });
        let why = match self.ended_by {
            SplitsEnd::Bytes => format!("the next would take more than {} bytes", thousands(self.bytes_allowed)),
            SplitsEnd::Saving => "the next would save too little".to_owned(),
        };
        format!(
            "stopped at {} view cells, {} bytes, {} triangles; {why}",
            thousands(last.view_cells as u64),
            thousands(last.bytes),
            thousands(last.triangles.round() as u64)
        )
    }

    /// The table: one line a split.
    pub fn csv(&self) -> String {
        let mut out = String::from("view_cells,bytes,triangles\n");
        for p in &self.points {
            let _ = writeln!(out, "{},{},{}", p.view_cells, p.bytes, p.triangles);
        }
        out
    }

    /// The section of a page.
    pub(super) fn html(&self) -> String {
        let point = |p: &SplitPoint| Point { x: p.bytes as f64, value: p.triangles, note: self.end() };
        let points = self.points.iter().map(point).collect();
        let curve = Curve { name: self.end(), class: "s0", shape: Shape::Stopped, points };
        let chart = Chart {
            title: "Expected triangles of a row against bytes of view cells, split by split",
            along: Along::Bytes,
            along_text: "bytes of view cells, expected",
            values: "expected visible triangles",
            scale: Scale::Linear,
            curves: vec![curve],
            band: None,
        };
        format!(
            "<h2>View cells by cost</h2>\n<p>Each split halves the space with the largest saving of triangles. The line \
             begins without view cells. The mark shows where the bake stopped. Figures are estimates: a byte for each \
             visible object of a view cell, and the mean of visible triangles over eyes.</p>\n<figure>\n{}</figure>\n",
            chart.html()
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_split_makes_two_view_cells_of_none() {
        let splits = Splits::new(500, true, &[(0, 90.0), (100, 50.5), (180, 40.0)]);
        let lines = ["view_cells,bytes,triangles", "0,0,90", "2,100,50.5", "3,180,40"];
        assert_eq!(splits.csv().lines().collect::<Vec<_>>(), lines);
        let html = splits.html();
        assert_eq!(html.matches("<circle").count(), 1);
        assert!(html.contains("stopped at 3 view cells, 180 bytes, 40 triangles; the next would take more than 500 bytes"));
        let few = Splits::new(500, false, &[(0, 90.0)]);
        assert_eq!(few.end(), "stopped at 0 view cells, 0 bytes, 90 triangles; the next would save too little");
    }
}
