//! Which key does what: the table of [`crate::commands`], with the changes of a person.

use crate::commands::{Action, Entry, HOLDS, Hold, TABLE, entry_of};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use serde_json::Value;
use std::collections::BTreeMap;
use winit::keyboard::KeyCode;

/// An action or a movement, which has a key.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Bound {
    /// Does something once.
    Act(Action),
    /// Does something while it is held.
    Hold(Hold),
}

/// Keys that nothing else may be done by: they let go of the mouse and grab it.
const RESERVED: [(KeyCode, &str); 2] = [(KeyCode::Escape, "Esc"), (KeyCode::Tab, "Tab")];
/// So many entries that can't be read are told by name; of more, the number.
const TOLD: usize = 4;
/// Letters of a name from a file that are told.
const LETTERS: usize = 24;

/// Which key does what.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct KeyMap {
    /// Keys that differ from the table.
    changed: Vec<(Bound, KeyCode)>,
    /// Entries of the settings that mean nothing, and why.
    ignored: Vec<String>,
}

/// All that a key may be for: what, the usual key, its name, and a label.
pub fn all() -> impl Iterator<Item = (Bound, KeyCode, &'static str, &'static str)> {
    let held = HOLDS.iter().map(|held| (Bound::Hold(held.hold), held.key.0, held.key.1, held.label));
    held.chain(TABLE.iter().map(|entry| (Bound::Act(entry.action), entry.key.0, entry.key.1, entry.label)))
}

impl KeyMap {
    /// Its key; `None` for what has none in the table.
    pub fn key(&self, bound: Bound) -> Option<KeyCode> {
        let changed = self.changed.iter().find(|(of, _)| *of == bound).map(|(_, code)| *code);
        changed.or_else(|| all().find(|(of, ..)| *of == bound).map(|(_, code, ..)| code))
    }

    /// Whether a key is held that does this.
    pub fn is_held(&self, hold: Hold, is_down: impl Fn(KeyCode) -> bool) -> bool {
        self.key(Bound::Hold(hold)).is_some_and(is_down)
    }

    /// The action of a key, with Ctrl or Shift held.
    pub fn action(&self, code: KeyCode, [ctrl, shift]: [bool; 2]) -> Option<Action> {
        let chord = |entry: &&Entry| entry.chord.is_some_and(|(of, _)| ctrl && of == code);
        if let Some(entry) = TABLE.iter().find(chord) {
            return Some(entry.action);
        }
        let Some((Bound::Act(action), _)) = self.of(code) else { return None };
        let shifted = entry_of(action).and_then(|entry| entry.shifted);
        Some(shifted.filter(|_| shift).unwrap_or(action))
    }

    /// Its key in words, for the list and the buttons.
    pub fn name(&self, bound: Bound) -> String {
        let usual = all().find(|(of, ..)| *of == bound);
        match (usual, self.key(bound)) {
            (Some((_, code, name, _)), Some(key)) if key == code => name.to_owned(),
            (_, Some(key)) => {
                let entry = TABLE.iter().find(|entry| bound == Bound::Act(entry.action));
                let chord = entry.and_then(|entry| entry.chord);
                name_of(key) + &chord.map_or_else(String::new, |(_, chord)| format!(", {chord}"))
            }
            _ => String::new(),
        }
    }

    /// The key of an action in words.
    pub fn name_of(&self, action: Action) -> String {
        self.name(Bound::Act(action))
    }

    /// Gives something another key.
    ///
    /// # Errors
    ///
    /// One line: the key does something else.
    pub fn give(&mut self, bound: Bound, code: KeyCode) -> Result<(), String> {
        if let Some((_, name)) = RESERVED.iter().find(|(of, _)| *of == code) {
            return Err(format!("{name} stays as it is"));
        }
        if let Some((_, label)) = self.of(code).filter(|(of, _)| *of != bound) {
            return Err(format!("{} is for {label} already", name_of(code)));
        }
        self.changed.retain(|(of, _)| *of != bound);
        if self.key(bound) != Some(code) {
            self.changed.push((bound, code));
        }
        Ok(())
    }

    /// Whether everything has its usual key.
    pub fn is_usual(&self) -> bool {
        self.changed.is_empty()
    }

    /// A line on what the settings have that means nothing.
    pub fn ignored(&self) -> Option<String> {
        let more = self.ignored.len().saturating_sub(TOLD);
        let mut told = self.ignored.iter().take(TOLD).cloned().collect::<Vec<_>>().join(", ");
        if more > 0 {
            told += &format!(", and {more} more");
        }
        (!told.is_empty()).then(|| format!("ignored keys of the settings: {told}"))
    }

    /// The action or movement of a key, and its label.
    fn of(&self, code: KeyCode) -> Option<(Bound, &'static str)> {
        all().find(|(bound, ..)| self.key(*bound) == Some(code)).map(|(bound, _, _, label)| (bound, label))
    }

    /// Reads labels with their keys. What means nothing is ignored.
    fn read(kept: &Value) -> Self {
        let mut map = Self::default();
        let Value::Object(kept) = kept else {
            map.ignored.push("an invalid list of keys".to_owned());
            return map;
        };
        for (label, value) in kept {
            let bound = all().find(|(.., of)| of == label).map(|(bound, ..)| bound);
            let code = KeyCode::deserialize(value).ok().filter(|code| RESERVED.iter().all(|(of, _)| of != code));
            match (bound, code) {
                (Some(bound), Some(code)) => map.changed.push((bound, code)),
                (None, _) => map.ignored.push(format!("{} (no such action)", quoted(label))),
                (_, None) => map.ignored.push(format!("{} (no such key)", quoted(label))),
            }
        }
        // A key for two: what was changed is as usual again, until each has its own.
        while let Some(at) = map.changed.iter().position(|(bound, code)| map.is_shared(*bound, *code)) {
            let (bound, _) = map.changed.remove(at);
            let label = all().find(|(of, ..)| *of == bound).map_or("", |(.., label)| label);
            map.ignored.push(format!("{} (its key is another's)", quoted(label)));
        }
        map
    }

    fn is_shared(&self, bound: Bound, code: KeyCode) -> bool {
        all().any(|(other, ..)| other != bound && self.key(other) == Some(code))
    }
}

/// As it may be told: short, and in one line.
fn quoted(label: &str) -> String {
    format!("{:?}", label.chars().take(LETTERS).collect::<String>())
}

impl Serialize for KeyMap {
    fn serialize<S: Serializer>(&self, to: S) -> Result<S::Ok, S::Error> {
        let changed = all().filter_map(|(bound, _, _, label)| {
            let code = self.changed.iter().find(|(of, _)| *of == bound)?.1;
            Some((label, code))
        });
        changed.collect::<BTreeMap<_, _>>().serialize(to)
    }
}

impl<'d> Deserialize<'d> for KeyMap {
    fn deserialize<D: Deserializer<'d>>(from: D) -> Result<Self, D::Error> {
        Value::deserialize(from).map(|kept| Self::read(&kept))
    }
}

/// A key in words.
pub fn name_of(code: KeyCode) -> String {
    // The name in the table, if that is one key.
    if let Some((_, _, name, _)) = all().find(|(_, of, name, _)| *of == code && !name.contains(['+', ','])) {
        return name.to_owned();
    }
    let signs = [
        (KeyCode::Slash, "/"),
        (KeyCode::Backslash, "\\"),
        (KeyCode::Comma, ","),
        (KeyCode::Period, "."),
        (KeyCode::Semicolon, ";"),
        (KeyCode::Quote, "'"),
        (KeyCode::Backquote, "`"),
        (KeyCode::Minus, "-"),
        (KeyCode::Equal, "="),
        (KeyCode::BracketLeft, "["),
        (KeyCode::BracketRight, "]"),
    ];
    if let Some((_, sign)) = signs.iter().find(|(of, _)| *of == code) {
        return (*sign).to_owned();
    }
    // `KeyQ`, `Digit1` and `NumpadAdd` are their own names, with room before capitals.
    let name = format!("{code:?}");
    let name = ["Key", "Digit"].iter().find_map(|start| name.strip_prefix(start)).unwrap_or(&name);
    let mut words = String::new();
    for (i, letter) in name.char_indices() {
        if i > 0 && letter.is_ascii_uppercase() {
            words.push(' ');
        }
        words.push(letter);
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    const FLY: Bound = Bound::Act(Action::Fly);
    const AHEAD: Bound = Bound::Hold(Hold::Forward);

    #[test]
    fn every_action_and_every_held_key_can_have_another_key() {
        let bounds: Vec<Bound> = all().map(|(bound, ..)| bound).collect();
        assert_eq!(bounds.len(), TABLE.len() + HOLDS.len());
        for bound in bounds {
            let mut map = KeyMap::default();
            let before = map.key(bound).unwrap();
            map.give(bound, KeyCode::F20).unwrap();
            assert_eq!(map.key(bound), Some(KeyCode::F20));
            let does = |code| match bound {
                Bound::Act(action) => map.action(code, [false; 2]) == Some(action),
                Bound::Hold(hold) => map.is_held(hold, |down| down == code),
            };
            assert!(does(KeyCode::F20) && !does(before), "{bound:?}");
            assert!(map.name(bound).starts_with("F20"), "{bound:?}: {}", map.name(bound));
            // And back.
            map.give(bound, before).unwrap();
            assert!(map.is_usual() && map == KeyMap::default());
        }
    }

    #[test]
    fn a_key_that_is_taken_is_told_and_nothing_changes() {
        let mut map = KeyMap::default();
        assert_eq!(map.give(FLY, KeyCode::KeyF), Err("F is for Freeze already".to_owned()));
        assert_eq!(map.give(AHEAD, KeyCode::Escape), Err("Esc stays as it is".to_owned()));
        assert!(map.is_usual());
        // A key that no action has is free.
        map.give(Bound::Act(Action::Freeze), KeyCode::F20).unwrap();
        map.give(FLY, KeyCode::KeyF).unwrap();
        assert_eq!(map.action(KeyCode::KeyF, [false; 2]), Some(Action::Fly));
        assert_eq!(map.action(KeyCode::KeyV, [false; 2]), None);
        // Ctrl+F is what it was, and what hides shows all with Shift.
        assert_eq!(map.action(KeyCode::KeyF, [true, false]), Some(Action::Find));
        map.give(Bound::Act(Action::Hide), KeyCode::F19).unwrap();
        assert_eq!(map.action(KeyCode::F19, [false, true]), Some(Action::ShowAll));
        map.give(Bound::Act(Action::Find), KeyCode::F9).unwrap();
        assert_eq!(map.name_of(Action::Find), "F9, Ctrl+F");
    }

    #[test]
    fn what_is_kept_is_read_again_and_swapped_keys_are_too() {
        let mut map = KeyMap::default();
        for (bound, code) in [(FLY, KeyCode::F20), (AHEAD, KeyCode::KeyV), (FLY, KeyCode::KeyW)] {
            map.give(bound, code).unwrap();
        }
        let text = serde_json::to_string(&map).unwrap();
        assert_eq!(text, r#"{"Fly":"KeyW","forward":"KeyV"}"#);
        let read: KeyMap = serde_json::from_str(&text).unwrap();
        assert_eq!((read.key(FLY), read.key(AHEAD), read.ignored()), (Some(KeyCode::KeyW), Some(KeyCode::KeyV), None));
    }

    #[test]
    fn what_means_nothing_is_ignored_with_one_line() {
        let text = r#"{"Fly": "KeyQQ", "Jump": "F19", "Freeze": 7, "Door": "F19", "Pick": "F19", "Menu": "Escape",
            "forward": "KeyA", "a\nb": null}"#;
        let map: KeyMap = serde_json::from_str(text).unwrap();
        // `Door` and `Pick` have one key between them: one of the two gives way, and the other is free then.
        assert_eq!(map.changed.len(), 1);
        let line = map.ignored().unwrap();
        assert!(line.contains(r#""Fly" (no such key)"#) && line.contains("and 3 more"), "{line}");
        assert_eq!(line.lines().count(), 1);
        for text in ["7", "null", "[]", r#""F""#] {
            let map: KeyMap = serde_json::from_str(text).unwrap();
            assert!(map.is_usual() && map.ignored().is_some(), "{text}");
        }
        assert_eq!(serde_json::from_str::<KeyMap>("{}").unwrap(), KeyMap::default());
    }

    #[test]
    fn keys_have_names() {
        let names = [
            (KeyCode::KeyQ, "Q"),
            (KeyCode::Digit0, "0"),
            (KeyCode::NumpadAdd, "Numpad Add"),
            (KeyCode::Slash, "/"),
            (KeyCode::PageUp, "Page Up"),
            (KeyCode::ShiftLeft, "Shift"),
            (KeyCode::F9, "F9"),
        ];
        for (code, name) in names {
            assert_eq!(name_of(code), name);
        }
    }
}
