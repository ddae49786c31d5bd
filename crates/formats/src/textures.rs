//! Pictures that a model names and that did not come with it. A bake doesn't need them: materials say what is see-through. Who draws the
//! model does.

use enfilade::scene::builder::short_name;
use enfilade::scene::sidecar::Sidecars;
use enfilade::types::note::Note;
use std::collections::HashSet;

/// Names that the note tells.
const TOLD: usize = 3;
/// Names that are looked for. More: a file made to do so keeps the disk busy.
const LOOKED_FOR: usize = 10_000;

/// One note for all pictures that are missing; `None` where none is, and for a model that was not read from a folder. `names` are paths
/// from the model's folder, as they are on disk.
pub(super) fn note_of_missing(names: impl Iterator<Item = String>, beside: Sidecars<'_>) -> Option<Note> {
    beside.folder?;
    let mut seen = HashSet::new();
    let names = names.filter(|name| seen.insert(name.clone())).take(LOOKED_FOR);
    let (there, missing): (Vec<_>, Vec<_>) = names.partition(|name| beside.is_there(name));
    let count = missing.len();
    if count == 0 {
        return None;
    }
    let told: Vec<String> = missing.iter().take(TOLD).map(|name| format!("`{}`", short_name(name))).collect();
    let more = if count > TOLD { format!(" and {} more", count - TOLD) } else { String::new() };
    let told = told.join(", ") + &more;
    let all = there.len() + count;
    let says = "rows don't need them: materials say what is see-through";
    Some(Note::detail(format!("{count} of {all} textures are missing: {told}; {says}")))
}
