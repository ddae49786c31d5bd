//! Lines of samples, which raise the columns of a picture.

use super::picture::column;

/// A line of samples across a picture, at one depth.
pub(super) struct Line<'a> {
    /// Metres, above 0.
    pub(super) depth: f64,
    /// Metres to the side, by sample, ascending.
    pub(super) along: &'a [f64],
    /// Metres above the eye, by sample.
    pub(super) heights: &'a [f64],
}

impl Line<'_> {
    /// Raises the columns that it crosses entirely to its lowest point in each. Where it begins or ends within a column, the line
    /// of the neighbouring patch may continue it.
    pub(super) fn raise(&self, slopes: &mut [f32], seams: &mut [Seam], is_closed: &[bool]) {
        let over = 1.0 / self.depth;
        let at = |m: usize| [column(self.along[m] * over), self.heights[m] * over];
        // 1. The first column border on the line, and the sample after it.
        let [begin, height] = at(0);
        let first = begin.ceil().max(0.0);
        let start = self.along.partition_point(|&a| column(a * over) < first).max(1);
        if first > slopes.len() as f64 || start >= self.along.len() {
            return;
        }
        // 2. From border to border.
        let (mut next, mut least, mut before) = (first as usize, f64::INFINITY, at(start - 1));
        if begin >= 0.0 {
            least = (1..start).map(|m| at(m)[1]).fold(height, f64::min);
        }
        for m in start..self.along.len() {
            let after = at(m);
            if next as f64 <= after[0] {
                let rise = (after[1] - before[1]) / (after[0] - before[0]);
                while next as f64 <= after[0] {
                    let border = before[1] + rise * (next as f64 - before[0]);
                    if let Some(done) = next.checked_sub(1).filter(|&done| !is_closed[done]) {
                        let slope = least.min(border) as f32;
                        let is_first = next as f64 == first;
                        let known = if is_first { seams[done].from(begin, slope) } else { slope };
                        slopes[done] = slopes[done].max(known);
                    }
                    if next == slopes.len() {
                        return;
                    }
                    (least, next) = (border, next + 1);
                }
            }
            least = least.min(after[1]);
            before = after;
        }
        // 3. The rest in the last column.
        if let Some(done) = next.checked_sub(1).filter(|&done| !is_closed[done]) {
            slopes[done] = slopes[done].max(seams[done].until(before[0], least as f32));
        }
    }
}

/// The highest line that ends in a column, and the highest that begins there, with their places in columns.
#[derive(Clone, Copy)]
pub(super) struct Seam {
    until: (f64, f32),
    from: (f64, f32),
}

impl Seam {
    pub(super) const NONE: Self = Self { until: (0.0, f32::NEG_INFINITY), from: (0.0, f32::NEG_INFINITY) };

    /// The known slope of the column between two places.
    pub(super) fn between(&self, [from, to]: [f64; 2]) -> f32 {
        let left = if self.until.0 >= to { self.until.1 } else { f32::NEG_INFINITY };
        let right = if self.from.0 <= from { self.from.1 } else { f32::NEG_INFINITY };
        left.max(right)
    }

    /// Adds a line over the left part of the column, up to a place. Returns the slope known for the whole column.
    fn until(&mut self, at: f64, slope: f32) -> f32 {
        if slope > self.until.1 {
            self.until = (at, slope);
        }
        if self.from.0 <= at { slope.min(self.from.1) } else { f32::NEG_INFINITY }
    }

    /// Adds a line over the right part of the column, from a place on.
    fn from(&mut self, at: f64, slope: f32) -> f32 {
        if slope > self.from.1 {
            self.from = (at, slope);
        }
        if self.until.0 >= at { slope.min(self.until.1) } else { f32::NEG_INFINITY }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::horizon::holes::NOWHERE;
    use crate::horizon::picture::COLUMNS;

    /// A covered column gets the line's lowest slope there, whichever way it leans and wherever it has a notch.
    #[test]
    fn a_line_raises_a_column_to_its_lowest_place_there() {
        let mut horizon = Raised::new();
        horizon.line(&[(10.0, 4.0), (14.0, 8.0), (16.0, 2.0), (16.5, 1.0), (18.0, 7.0)]);
        assert_eq!(horizon.slopes[9..19], [LOW, 4.0, 5.0, 6.0, 7.0, 5.0, 2.0, 1.0, 3.0, LOW]);
        // A lower line changes nothing, and one with a void changes nothing beside it.
        horizon.line(&[(10.0, 1.0), (18.0, 1.0)]);
        assert_eq!(horizon.slopes[10], 4.0);
        horizon.line(&[(10.0, 9.0), (12.0, 9.0), (13.0, NOWHERE), (14.0, 9.0), (15.0, 9.0)]);
        assert_eq!(horizon.slopes[10..14], [9.0, 9.0, 6.0, 7.0]);
        horizon.is_closed[11] = true;
        horizon.line(&[(10.0, 20.0), (13.0, 20.0)]);
        assert_eq!(horizon.slopes[10..13], [20.0, 9.0, 20.0]);
    }

    /// Two lines that meet within a column count as one; otherwise a gap remains.
    #[test]
    fn lines_go_on_where_others_end() {
        for (from, is_whole) in [(20.25, true), (20.125, true), (20.5, false)] {
            for turned in [false, true] {
                let mut horizon = Raised::new();
                let mut lines = [[(18.0, 3.0), (20.25, 3.0)], [(from, 2.0), (22.0, 2.0)]];
                if turned {
                    lines.reverse();
                }
                lines.iter().for_each(|line| horizon.line(line));
                assert_eq!(horizon.slopes[19..22], [3.0, if is_whole { 2.0 } else { LOW }, 2.0], "{from}, {turned}");
            }
        }
    }

    /// A line over a part of a column gives the slope of that part only.
    #[test]
    fn parts_of_columns_are_known_where_a_line_covers_them() {
        let mut horizon = Raised::new();
        horizon.line(&[(18.5, 3.0), (20.25, 4.0)]);
        horizon.line(&[(20.75, 2.0), (22.0, 2.0)]);
        let known = |column: usize, places| horizon.seams[column].between(places);
        assert_eq!([known(18, [18.5, 19.0]), known(18, [18.4, 19.0])], [3.0, LOW]);
        assert_eq!(known(20, [20.75, 21.0]), 2.0);
        assert!(known(20, [20.0, 20.25]) > 3.0);
        assert_eq!([[20.0, 20.3], [20.7, 21.0], [20.3, 20.7], [20.0, 21.0]].map(|places| known(20, places)), [LOW; 4]);
    }

    const LOW: f32 = f32::NEG_INFINITY;

    /// One picture.
    struct Raised {
        slopes: Vec<f32>,
        seams: Vec<Seam>,
        is_closed: Vec<bool>,
    }

    impl Raised {
        fn new() -> Self {
            Self { slopes: vec![LOW; COLUMNS], seams: vec![Seam::NONE; COLUMNS], is_closed: vec![false; COLUMNS] }
        }

        /// A line through places in columns, with slopes.
        fn line(&mut self, of: &[(f64, f64)]) {
            let along: Vec<f64> = of.iter().map(|(at, _)| at / (COLUMNS / 2) as f64 - 1.0).collect();
            let heights: Vec<f64> = of.iter().map(|(_, slope)| *slope).collect();
            Line { depth: 1.0, along: &along, heights: &heights }.raise(&mut self.slopes, &mut self.seams, &self.is_closed);
        }
    }
}
