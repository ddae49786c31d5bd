//! `why`, in a few words for the screen; `enfilade why` says more.

use crate::units::Units;
use enfilade::CellId;
use enfilade::file::PvsFile;
use enfilade::proof::{Asker, Doubt, Goal, Why};
use glam::DVec3;

/// An answer for the screen.
pub struct Explanation {
    /// The sentence.
    pub text: String,
    /// The witness, metres relative to the origin, where there is one.
    pub sight: Option<[DVec3; 2]>,
}

/// Asks, and says it in a sentence.
pub fn tell(asker: &Asker<'_>, file: &PvsFile, cell: CellId, goal: Goal, units: Units) -> Explanation {
    let name = |cell: CellId| match &file.cells[cell.index()] {
        named if named.source.is_some() => format!("cell {cell} ({})", named.name),
        _ => format!("cell {cell}"),
    };
    let what = match goal {
        Goal::Cell(other) if other.index() < file.cells.len() => name(other),
        Goal::Object(object) if object.index() < file.objects.len() => {
            format!("object {object} ({})", file.objects[object.index()].node)
        }
        _ => "what isn't there".to_owned(),
    };
    let why = match asker.why(cell, goal) {
        Ok(why) => why,
        Err(e) => return Explanation { text: format!("{what}: the file {e}"), sight: None },
    };
    let sight = if let Why::Witnessed(seen) = &why { Some([seen.from, seen.to]) } else { None };
    Explanation { text: sentence(&why, &name(cell), &what, units), sight }
}

/// Why a cell, `who`, sees `what` or not.
fn sentence(why: &Why, who: &str, what: &str, units: Units) -> String {
    match why {
        Why::Itself => format!("{who} sees itself."),
        Why::Witnessed(seen) => {
            let length = units.length(seen.from.distance(seen.to));
            let through = match seen.portals.len() {
                0 => "without a portal between".to_owned(),
                1 => "through one portal".to_owned(),
                n => format!("through {n} portals"),
            };
            format!("{who} sees {what}: an unobstructed line of {length}, {through}. It is drawn in green.")
        }
        Why::Known(chain) => {
            format!("{who} sees {what}, by {} portals; the file keeps no line between the two.", chain.len())
        }
        Why::Apart => format!("{who} can't see {what}: no way through portals leads there."),
        Why::Separated(ends) => format!(
            "{who} can't see {what}: no line passes any chain of portals ({} were followed to their end).",
            ends.len()
        ),
        Why::Occluded(occlusion) => {
            format!(
                "{who} can't see {what}: a line may pass {} portals, but the model's triangles shut every way.",
                occlusion.chain.len()
            )
        }
        Why::Behind => format!("{who} can't see {what}: all that it could see of it faces away."),
        Why::Joined(cells) => {
            format!(
                "{who} can't see {what}: proven for each of the {cells} cells that it was joined from; the file has them as one."
            )
        }
        Why::Undecided(doubt) => {
            format!("Whether {who} sees {what} is not decided: {}. It is drawn, to be safe.", reason(doubt))
        }
    }
}

fn reason(doubt: &Doubt) -> String {
    match doubt {
        Doubt::Inside => "it is in the cell, and no ray has met it".to_owned(),
        Doubt::Open(chain) => {
            format!("a line may pass {} portals, and none was found that nothing obstructs", chain.len())
        }
        Doubt::OutOfSteps => "the search ran out of steps".to_owned(),
        Doubt::Separated(_) => "asked for alone, no line passes".to_owned(),
    }
}
