//! The answer of `why` for the screen, in the words of `enfilade why`.

use crate::units::Units;
use enfilade::CellId;
use enfilade::file::PvsFile;
use enfilade::proof::{Asker, Goal, Why};
use enfilade_measure::why::{Pair, way};
use glam::DVec3;

/// An answer for the screen.
pub struct Explanation {
    /// The sentence.
    pub text: String,
    /// The segment that proves visibility, if there is one, metres relative to the origin.
    pub sight: Option<[DVec3; 2]>,
}

/// Explains a pair in a sentence.
pub fn tell(asker: &Asker<'_>, file: &PvsFile, cell: CellId, goal: Goal, units: Units) -> Explanation {
    let why = match asker.why(cell, goal) {
        Ok(why) => why,
        Err(e) => return Explanation { text: format!("No answer: the file {e}."), sight: None },
    };
    let pair = Pair { file, from: cell, to: goal };
    let (text, sight) = match &why {
        Why::Witnessed(seen) => {
            let length = units.length(seen.from.distance(seen.to));
            let line = format!("{}: the green segment, {length} long, through {}.", pair.visible(), way(&seen.portals));
            (line, Some([seen.from, seen.to]))
        }
        Why::Undecided(_) => (format!("{}. It is drawn, to be safe.", pair.sentence(&why)), None),
        why => (format!("{}.", pair.sentence(why)), None),
    };
    Explanation { text, sight }
}
