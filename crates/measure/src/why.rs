//! The answer of `why` in one sentence, for the command line, reports and the viewer.

use enfilade::file::PvsFile;
use enfilade::proof::{Doubt, Goal, Why};
use enfilade::{CellId, DirectedPortal};
use glam::DVec3;

/// A pair of a file: a cell, and the target seen from it. Both must be in the file.
#[derive(Clone, Copy, Debug)]
pub struct Pair<'f> {
    /// The file.
    pub file: &'f PvsFile,
    /// The cell.
    pub from: CellId,
    /// The target.
    pub to: Goal,
}

impl Pair<'_> {
    /// The verdict and its reason, without a full stop.
    pub fn sentence(&self, why: &Why) -> String {
        let [a, b] = [self.cell_name(self.from), self.goal_name()];
        let point = |p: DVec3| format!("{:?}", (p + self.file.origin).to_array());
        match why {
            Why::Itself => format!("{a} sees itself"),
            Why::Witnessed(s) => format!("{}: the segment from {} to {}", self.visible(), point(s.from), point(s.to)),
            Why::Known(portals) => {
                format!("{}: proven by a segment through {}, which the file doesn't keep", self.visible(), way(portals))
            }
            Why::Apart => format!("{a} doesn't see {b}: no chain of portals connects them"),
            Why::Separated(found) => format!("{a} doesn't see {b}: {}", no_line_passes(found.len())),
            Why::Occluded(s) => {
                format!("{a} doesn't see {b}: lines pass {}, but triangles block all of them", way(&s.chain))
            }
            Why::Behind => format!("{a} doesn't see {b}: all its triangles visible through the portals face away"),
            Why::Joined(1) => format!("{a} doesn't see {b}: proven before cells were joined"),
            Why::Joined(cells) => format!("{a} doesn't see {b}: proven for each of the {cells} cells joined into {a}"),
            Why::Undecided(doubt) => format!("{a} and {b}: undecided; {}", reason(doubt)),
        }
    }

    /// The sentence for a table in which the first cell is known.
    pub fn remark(&self, why: &Why) -> String {
        match why {
            Why::Undecided(doubt) => format!("{}: {}", self.goal_name(), reason(doubt)),
            why => self.sentence(why),
        }
    }

    /// The verdict that the cell sees the target.
    pub fn visible(&self) -> String {
        format!("{} sees {}", self.cell_name(self.from), self.goal_name())
    }

    fn cell_name(&self, cell: CellId) -> String {
        match self.file.cells[cell.index()].name.as_str() {
            "" => format!("cell {cell}"),
            name if name == format!("cell {cell}") => name.to_owned(),
            name => format!("cell {cell} ({name})"),
        }
    }

    fn goal_name(&self) -> String {
        match self.to {
            Goal::Cell(cell) => self.cell_name(cell),
            Goal::Object(object) => format!("object {object} ({})", self.file.objects[object.index()].node),
        }
    }
}

fn reason(doubt: &Doubt) -> String {
    match doubt {
        Doubt::Inside => "it is in that cell, but no ray has hit it".to_owned(),
        Doubt::Open(portals) => format!("a line may pass {}, but no unobstructed one was found", way(portals)),
        Doubt::OutOfSteps => "the search ran out of steps".to_owned(),
        Doubt::Separated(found) => format!("searched alone, {}", no_line_passes(found.len())),
    }
}

/// The reason for a hidden pair with this number of chains of portals.
pub fn no_line_passes(chains: usize) -> String {
    match chains {
        0 => "the portals' planes exclude every chain".to_owned(),
        1 => "one chain of portals, and no line passes it".to_owned(),
        n => format!("{n} chains of portals, and no line passes any of them"),
    }
}

/// The portals of a chain, by number.
pub fn way(portals: &[DirectedPortal]) -> String {
    numbered(portals.iter().map(|p| p.portal().to_string()))
}

/// Portals by number.
pub fn numbered(portals: impl Iterator<Item = String>) -> String {
    let names: Vec<String> = portals.collect();
    match names.len() {
        0 => "no portal".to_owned(),
        1 => format!("portal {}", names[0]),
        _ => format!("portals {}", names.join(" ")),
    }
}
