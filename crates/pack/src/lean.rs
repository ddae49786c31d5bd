//! The `.pvs` file without what a walk never asks for.

use enfilade::file::{PvsFile, Views};
use enfilade::types::stats::PvsStats;

/// Without bounds, witnesses, counters and notes: it culls the same.
pub(crate) fn lean(file: &PvsFile) -> PvsFile {
    PvsFile {
        closed_holes: Vec::new(),
        clusters: Vec::new(),
        left_out: vec![LEFT_OUT.to_owned()],
        notes: Vec::new(),
        bounds: None,
        repairs: Vec::new(),
        stats: PvsStats::default(),
        unseen: None,
        gap: None,
        // It is no bake's result.
        bake: None,
        views: Views { bounds: None, ..file.views.clone() },
        ..file.clone()
    }
}

const LEFT_OUT: &str = "bounds, witnesses, counters and notes, which a walk doesn't need: the file that was packed has them";
