//! Lines with a radius, of whatever format: each becomes a tube.

use super::builder::short_name;
use super::{ImportError, Place, Role, SceneBuilder};
use crate::tubes::{Counts, Shape, Tubes, usual_error};
use glam::DVec3;

/// A line, in the model's own coordinates: metres, +Y up.
pub(super) struct Line<'a> {
    pub name: &'a str,
    /// Where it stands in the file, for errors.
    pub place: &'a str,
    pub role: Role,
    pub points: &'a [DVec3],
    /// The last point is followed by the first one.
    pub closed: bool,
    /// The tube only touches the points, and goes smoothly between them.
    pub smooth: bool,
    pub shape: Shape,
}

/// What the lines of a file came to.
#[derive(Default)]
pub(super) struct Lines {
    counts: Counts,
    lines: u64,
    sections: usize,
}

impl Lines {
    /// Adds a line's tube.
    pub fn add(&mut self, builder: &mut SceneBuilder, line: &Line<'_>) -> Result<(), ImportError> {
        let (mut tubes, error) = (Tubes::default(), usual_error(line.shape.radius));
        let Line { points, closed, shape, .. } = *line;
        let made = match line.smooth {
            true => tubes.through(points, closed, shape, error, &mut self.counts),
            false => tubes.line(points, closed, shape, error, &mut self.counts),
        };
        made.map_err(|e| ImportError::malformed(Place::File, format!("{}: {e}", line.place)))?;
        self.lines += 1;
        self.sections += tubes.sections.len();
        builder.add_tubes(short_name(line.name), line.role, tubes)
    }

    /// Tells what there was, and what was odd.
    pub fn note(&self, notes: &mut Vec<String>) {
        if self.lines > 0 {
            notes.push(format!("{} lines became tubes of {} sections", self.lines, self.sections));
        }
        let odd = [
            (self.counts.odd.twice, "points stand where the one before them does"),
            (self.counts.odd.back, "turns back, where a tube ends and another begins"),
            (self.counts.tight, "bends tighter than the tube's radius"),
        ];
        notes.extend(odd.into_iter().filter(|(count, _)| *count > 0).map(|(count, what)| format!("{count} {what}")));
    }
}
