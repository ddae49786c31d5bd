//! What is told of a model: notes for the person whose model it is, and details for who asks how the work went.

use std::fmt;
use std::ops::Deref;

/// What a note is about; the order is that in which notes are told.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
pub enum NoteKind {
    /// Something of the model is missing or odd: the model, or a flag, should be mended.
    Fault,
    /// Less is culled than could be.
    Cost,
    /// How something was taken that the model does not say, or what a flag has done.
    Taken,
    /// A figure of the method, or an oddity that changes nothing: told only on demand, and never kept in a file.
    Detail,
}

/// A line about a model. It reads as its text.
#[derive(Clone, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
pub struct Note {
    /// What it is about.
    pub kind: NoteKind,
    /// What was found, what it means for speed or correctness, and what to do.
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

    /// So many of something, where there are any.
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

/// The texts of notes that are no details, what matters most first.
pub fn plain<'n>(notes: impl IntoIterator<Item = &'n Note>) -> Vec<String> {
    let mut plain: Vec<&Note> = notes.into_iter().filter(|note| note.kind != NoteKind::Detail).collect();
    plain.sort_by_key(|note| note.kind);
    plain.into_iter().map(|note| note.text.clone()).collect()
}

/// The texts of the details, as they come.
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
