//! Missing pictures of a model. A bake does not need them, since materials define transparency; a program that draws the model
//! does.

use enfilade::scene::builder::short_name;
use enfilade::scene::sidecar::Sidecars;
use enfilade::types::note::Note;
use std::collections::HashSet;

/// Maximum names in the note.
const NAMED: usize = 3;
/// Maximum names looked up. More: a hostile file keeps the disk busy.
const MOST_LOOKUPS: usize = 10_000;

/// One note for all missing pictures; `None` if none is missing, and for a model that was not read from a folder. `names` are
/// paths from the model's folder.
pub(super) fn note_of_missing(names: impl Iterator<Item = String>, beside: Sidecars<'_>) -> Option<Note> {
    beside.folder?;
    let mut seen = HashSet::new();
    let names = names.filter(|name| seen.insert(name.clone())).take(MOST_LOOKUPS);
    let (there, missing): (Vec<_>, Vec<_>) = names.partition(|name| beside.is_there(name));
    let count = missing.len();
    if count == 0 {
        return None;
    }
    let named: Vec<String> = missing.iter().take(NAMED).map(|name| format!("`{}`", short_name(name))).collect();
    let more = if count > NAMED { format!(" and {} more", count - NAMED) } else { String::new() };
    let named = named.join(", ") + &more;
    let all = there.len() + count;
    let why = "the bake does not need them: materials define transparency";
    Some(Note::detail(format!("{count} of {all} textures are missing: {named}; {why}")))
}
