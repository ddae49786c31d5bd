//! Lines with a radius, of any format: each becomes a tube.

use enfilade::scene::builder::short_name;
use enfilade::scene::{ImportError, Place, Role, SceneBuilder};
use enfilade::types::note::{Note, NoteKind};
use enfilade_tubes::{Counts, Shape, TubeError, Tubes, usual_error};
use glam::DVec3;

/// A line, in the model's own coordinates: metres, +Y up.
pub(super) struct Line<'a> {
    pub name: &'a str,
    /// Its place in the file, for errors.
    pub place: &'a str,
    pub role: Role,
    pub points: &'a [DVec3],
    /// Whether the last point connects to the first.
    pub closed: bool,
    /// Whether the tube passes smoothly through the points.
    pub smooth: bool,
    pub shape: Shape,
}

/// Results of a file's lines.
#[derive(Default)]
pub(super) struct Lines {
    counts: Counts,
    lines: u64,
    sections: usize,
    /// Lines without two different points.
    empty: u64,
    /// Place of the first of them.
    first_empty: Option<String>,
}

impl Lines {
    /// Adds a line's tube. A line without two distinct points is added without one.
    pub fn add(&mut self, builder: &mut SceneBuilder, line: &Line<'_>) -> Result<(), ImportError> {
        let (mut tubes, mut counts, error) = (Tubes::default(), self.counts, usual_error(line.shape.radius));
        let Line { points, closed, shape, .. } = *line;
        let made = match line.smooth {
            true => tubes.through(points, closed, shape, error, &mut counts),
            false => tubes.line(points, closed, shape, error, &mut counts),
        };
        match made {
            Ok(()) => {
                self.counts = counts;
                self.lines += 1;
                self.sections += tubes.sections.len();
            }
            Err(TubeError::Points) => {
                self.empty += 1;
                self.first_empty.get_or_insert_with(|| line.place.to_owned());
                tubes = Tubes::default();
            }
            Err(e) => return Err(malformed(line.place, e)),
        }
        builder.add_tubes(short_name(line.name), line.role, tubes)
    }

    /// Adds notes on the lines and irregularities. Fails if a model has only lines, none with two distinct points.
    pub fn finish(&self, builder: &mut SceneBuilder) -> Result<(), ImportError> {
        if let Some(place) = self.first_empty.as_ref().filter(|_| builder.is_empty()) {
            return Err(malformed(place, TubeError::Points));
        }
        let notes = &mut builder.source.notes;
        if self.lines > 0 {
            notes.push(Note::detail(format!("{} lines became tubes of {} sections", self.lines, self.sections)));
        }
        let odd = [
            (self.empty, "lines without two distinct points left out"),
            (self.counts.odd.twice, "points repeat the one before them"),
            (self.counts.odd.back, "reversals: a tube ends there and another begins"),
            (self.counts.tight, "bends tighter than the tube's radius"),
        ];
        let odd = odd.into_iter().map(|(count, what)| Note::counted(NoteKind::Detail, count as usize, what));
        notes.extend(odd.flatten());
        Ok(())
    }
}

fn malformed(place: &str, error: TubeError) -> ImportError {
    ImportError::malformed(Place::File, format!("{place}: {error}"))
}
