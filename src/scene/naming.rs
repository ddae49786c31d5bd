//! Roles by names of meshes and materials, for formats without types.
//!
//! A rules file takes precedence over the words of a name: `door`, `window`, `glass` and similar words set the role, unless a word means a
//! larger part (`wall with door`). Words end at non-letters, and between a small and a capital letter: `SM_FrontDoor.001` has the words sm,
//! front and door.

use crate::scene::{ImportError, Place, whole_file};
use crate::types::note::Note;
use crate::types::scene::Role;
use serde::Deserialize;
use std::path::Path;

/// The kind of a mesh by its name.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Unknown, whatever its words mean.
    Unknown,
    /// Walls, floors, roofs.
    Structure,
    /// Furniture and equipment.
    Furnishing,
    /// Stairs and ramps.
    Stair,
    /// A door's leaf or frame.
    Door,
    /// A window.
    Window,
    /// Any role, transparent.
    Glass,
    /// Any role, opaque, whatever its material is.
    Opaque,
    /// Not drawn by engines.
    Helper,
    /// The sky, or another backdrop.
    Sky,
}

impl Kind {
    /// The role, and whether it is glass, if known.
    pub fn role(self) -> (Role, Option<bool>) {
        match self {
            Self::Unknown => (Role::Unknown, None),
            Self::Structure => (Role::Structure, None),
            Self::Furnishing => (Role::Furnishing, None),
            Self::Stair => (Role::Stair, None),
            Self::Door => (Role::Door, None),
            Self::Window => (Role::Window, None),
            Self::Glass => (Role::Unknown, Some(true)),
            Self::Opaque => (Role::Unknown, Some(false)),
            Self::Helper => (Role::Helper, None),
            Self::Sky => (Role::Sky, None),
        }
    }
}

/// The kind of a mesh, and whether it is from a rules file.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Told {
    /// The kind.
    pub kind: Kind,
    /// Whether it is from a roles file, and not from its name.
    pub by_hand: bool,
}

/// A rule of a rules file: both patterns must match.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Rule {
    name: Option<String>,
    material: Option<String>,
    role: Kind,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct RulesFile {
    roles: Vec<Rule>,
}

/// Counts of doors and windows found by name.
#[derive(Clone, Copy, Debug, Default)]
pub struct ByName {
    doors: usize,
    windows: usize,
}

impl ByName {
    /// Counts a mesh of this role, if `by_name`.
    pub fn count(&mut self, role: Role, by_name: bool) {
        self.doors += usize::from(by_name && role == Role::Door);
        self.windows += usize::from(by_name && role == Role::Window);
    }

    /// A note, if there are any.
    pub fn note(self) -> Option<Note> {
        let Self { doors, windows } = self;
        (doors + windows > 0).then(|| {
            Note::taken(format!(
                "{doors} meshes are doors and {windows} windows by their names, and hide nothing; if one is a wall, give it the role \
                 structure in MODEL.roles.json"
            ))
        })
    }
}

/// The naming rules of one model.
#[derive(Clone, Debug, Default)]
pub struct Naming {
    rules: Vec<Rule>,
}

/// Words of English, German, French, Spanish, Italian, Dutch and Portuguese.
const DOORS: [&str; 15] = [
    "door", "doors", "tür", "tuer", "türen", "tor", "porte", "portes", "puerta", "puertas", "porta", "deur", "deuren",
    "gate", "gates",
];
const WINDOWS: [&str; 14] = [
    "window",
    "windows",
    "fenster",
    "fenêtre",
    "fenetre",
    "fenêtres",
    "ventana",
    "ventanas",
    "finestra",
    "finestre",
    "raam",
    "ramen",
    "janela",
    "janelas",
];
const GLASS: [&str; 8] = ["glass", "glazing", "glas", "verre", "vidrio", "vetro", "vidro", "pane"];
/// Words of larger parts than a leaf or a pane: such a mesh stays opaque structure.
const LARGER: [&str; 18] = [
    "wall", "walls", "wand", "mur", "muro", "floor", "roof", "ceiling", "slab", "building", "house", "room", "facade",
    "storey", "level", "map", "frame", "frames",
];

impl Naming {
    /// The rules of `NAME.roles.json` in the model's folder, if it is there.
    pub fn read(folder: Option<&Path>, name: &str) -> Result<Self, ImportError> {
        let beside = folder.map(|folder| folder.join(format!("{name}.roles.json"))).filter(|path| path.is_file());
        let Some(path) = beside else { return Ok(Self::default()) };
        let told = |what: String| ImportError::malformed(Place::File, format!("{}: {what}", path.display()));
        let bytes = whole_file::read(&path).map_err(|e| told(e.to_string()))?;
        let file: RulesFile = serde_json::from_slice(&bytes).map_err(|e| told(e.to_string()))?;
        if let Some(i) = file.roles.iter().position(|rule| rule.name.is_none() && rule.material.is_none()) {
            return Err(told(format!("roles[{i}]: give a name or a material")));
        }
        Ok(Self { rules: file.roles })
    }

    /// The kind of a mesh with this name and material; `None` if they do not match.
    pub fn of(&self, name: &str, material: &str) -> Option<Told> {
        let by_words = || by_words(name).or_else(|| by_words(material)).map(|kind| Told { kind, by_hand: false });
        self.by_rule(name, material).map(|kind| Told { kind, by_hand: true }).or_else(by_words)
    }

    fn by_rule(&self, name: &str, material: &str) -> Option<Kind> {
        let fits = |pattern: &Option<String>, text: &str| pattern.as_ref().is_none_or(|pattern| fits(pattern, text));
        self.rules.iter().find(|rule| fits(&rule.name, name) && fits(&rule.material, material)).map(|rule| rule.role)
    }
}

/// True if `text` matches the pattern, with `*` as a wildcard; case-insensitive.
fn fits(pattern: &str, text: &str) -> bool {
    let (pattern, text) = (pattern.to_lowercase(), text.to_lowercase());
    let mut parts = pattern.split('*');
    let first = parts.next().unwrap_or_default();
    let Some(mut rest) = text.strip_prefix(first) else { return false };
    let mut last = None;
    for part in parts {
        if let Some(part) = last.replace(part) {
            match rest.split_once(part) {
                Some((_, after)) => rest = after,
                None => return false,
            }
        }
    }
    last.map_or(rest.is_empty(), |last| rest.ends_with(last))
}

fn by_words(name: &str) -> Option<Kind> {
    let words = words(name);
    let has = |list: &[&str]| words.iter().any(|word| list.contains(&word.as_str()));
    if has(&LARGER) {
        None
    } else if has(&DOORS) {
        Some(Kind::Door)
    } else if has(&WINDOWS) {
        Some(Kind::Window)
    } else if has(&GLASS) {
        Some(Kind::Glass)
    } else {
        None
    }
}

/// The words of a name, in lower case.
pub fn words(name: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut was_small = false;
    for c in name.chars() {
        if !c.is_alphabetic() || (was_small && c.is_uppercase()) {
            words.push(String::new());
        }
        if c.is_alphabetic() {
            words.last_mut().expect("one at least").extend(c.to_lowercase());
        }
        was_small = c.is_lowercase();
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_tell_doors_windows_and_glass() {
        let of = |name: &str, material: &str| Naming::default().of(name, material).map(|told| told.kind);
        for name in ["door", "SM_FrontDoor.001", "IfcDoor/M_Single-Flush:1a2", "Doors_12", "Tür 3", "Haus-Tür", "gate"] {
            assert_eq!(of(name, ""), Some(Kind::Door), "{name}");
        }
        for name in
            ["outdoor_chair", "doorknob shelf", "Wall with door", "indoor", "door_frame", "Windows of the building", "storm"]
        {
            assert_eq!(of(name, ""), None, "{name}");
        }
        assert_eq!(
            (of("Fenster.2", ""), of("pane_3", "wood"), of("a", "M_Glass")),
            (Some(Kind::Window), Some(Kind::Glass), Some(Kind::Glass))
        );
        assert_eq!((of("window", "glass"), of("wall 3", "door paint")), (Some(Kind::Window), Some(Kind::Door)));
    }

    #[test]
    fn stars_stand_for_anything() {
        for (pattern, text, is) in [
            ("leaf*", "Leaf 12", true),
            ("leaf", "Leaf 12", false),
            ("*leaf", "oak leaf", true),
            ("a*b*c", "a1b2b3c", true),
            ("a*b*c", "acb", false),
            ("*", "", true),
            ("ab*ba", "aba", false),
            ("", "x", false),
        ] {
            assert_eq!(fits(pattern, text), is, "{pattern}, {text}");
        }
    }
}
