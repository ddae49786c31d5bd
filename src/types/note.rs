//! Notes about a model for its author, and details about the work on demand.

use std::fmt;
use std::ops::Deref;

/// The kind of a note, in the order of output.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
pub enum NoteKind {
    /// A part of the model is missing or odd: the model, or a flag, should be fixed.
    Fault,
    /// Culling is less effective than possible.
    Cost,
    /// An assumption where the model is silent, or the effect of a flag.
    Taken,
    /// A figure of the method, or a harmless oddity: shown only on demand, and never stored in a file.
    Detail,
}

/// One line about a model. It dereferences to its text.
#[derive(Clone, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
pub struct Note {
    /// Its kind.
    pub kind: NoteKind,
    /// The finding, its effect on speed or correctness, and the remedy.
    pub text: String,
}

impl Note {
    /// A note of [`NoteKind::Fault`].
    pub fn fault(text: impl Into<String>) -> Self {
        Self { kind: NoteKind::Fault, text: text.into() }
    }

    /// A note of [`NoteKind::Cost`].
    pub fn cost(text: impl Into<String>) -> Self {
        Self { kind: NoteKind::Cost, text: text.into() }
    }

    /// A note of [`NoteKind::Taken`].
    pub fn taken(text: impl Into<String>) -> Self {
        Self { kind: NoteKind::Taken, text: text.into() }
    }

    /// A note of [`NoteKind::Detail`].
    pub fn detail(text: impl Into<String>) -> Self {
        Self { kind: NoteKind::Detail, text: text.into() }
    }

    /// A note with a count, if it is not 0.
    pub fn counted(kind: NoteKind, count: usize, what: &str) -> Option<Self> {
        (count > 0).then(|| Self { kind, text: format!("{count} {what}") })
    }
}

impl Deref for Note {
    type Target = str;

    fn deref(&self) -> &str {
        &self.text
    }
}

impl PartialEq<str> for Note {
    fn eq(&self, text: &str) -> bool {
        self.text == text
    }
}

impl PartialEq<&str> for Note {
    fn eq(&self, text: &&str) -> bool {
        self.text == *text
    }
}

impl PartialEq<String> for Note {
    fn eq(&self, text: &String) -> bool {
        self.text == *text
    }
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.text)
    }
}

/// The texts of notes without details, most important first.
pub fn plain<'n>(notes: impl IntoIterator<Item = &'n Note>) -> Vec<String> {
    let mut plain: Vec<&Note> = notes.into_iter().filter(|note| note.kind != NoteKind::Detail).collect();
    plain.sort_by_key(|note| note.kind);
    plain.into_iter().map(|note| note.text.clone()).collect()
}

/// The texts of the details, in order.
pub fn details<'n>(notes: impl IntoIterator<Item = &'n Note>) -> Vec<String> {
    notes.into_iter().filter(|note| note.kind == NoteKind::Detail).map(|note| note.text.clone()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_matters_most_comes_first_and_details_stand_apart() {
        let notes = [
            Note::detail("377 walls"),
            Note::taken("a door by its name"),
            Note::cost("coarser"),
            Note::fault("first fault"),
            Note::detail("26 sheets"),
            Note::fault("second fault"),
        ];
        assert_eq!(plain(&notes), ["first fault", "second fault", "coarser", "a door by its name"]);
        assert_eq!(details(&notes), ["377 walls", "26 sheets"]);
    }
}
