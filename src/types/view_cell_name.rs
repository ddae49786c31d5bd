//! The id of a view cell.

use std::fmt;

/// A view cell's id: a number or a name. In JSON, `7` and `"7"` are different ids.
#[cfg_attr(feature = "bake", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "bake", serde(untagged))]
#[derive(Clone, PartialEq, Eq, Hash, Debug)]
pub enum ViewCellName {
    /// A whole number.
    Number(u64),
    /// Any text.
    Name(String),
}

/// Prefix of a name that would parse as a number, or that begins with this itself; as in a spreadsheet.
const APOSTROPHE: char = '\'';

impl ViewCellName {
    /// Its text in a `.pvs`: digits for a number; a name unchanged, except for an apostrophe before a name of digits alone.
    #[cfg(feature = "bake")]
    pub(crate) fn to_text(&self) -> String {
        match self {
            Self::Number(number) => number.to_string(),
            Self::Name(name) if name.starts_with(APOSTROPHE) || number(name).is_some() => format!("{APOSTROPHE}{name}"),
            Self::Name(name) => name.clone(),
        }
    }

    /// From the text in a `.pvs`.
    pub(crate) fn of_text(text: String) -> Self {
        match (text.strip_prefix(APOSTROPHE), number(&text)) {
            (Some(name), _) => Self::Name(name.to_owned()),
            (None, Some(number)) => Self::Number(number),
            (None, None) => Self::Name(text),
        }
    }
}

/// The number with exactly this spelling.
fn number(text: &str) -> Option<u64> {
    text.parse().ok().filter(|number: &u64| number.to_string() == text)
}

/// As in JSON.
impl fmt::Display for ViewCellName {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Name(name) => write!(f, "{name:?}"),
        }
    }
}

impl From<u64> for ViewCellName {
    fn from(number: u64) -> Self {
        Self::Number(number)
    }
}

impl From<&str> for ViewCellName {
    fn from(name: &str) -> Self {
        Self::Name(name.to_owned())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_keeps_numbers_and_names_apart() {
        let ids =
            [7.into(), "7".into(), u64::MAX.into(), "18446744073709551616".into(), "07".into(), "'7".into(), "".into()];
        let texts = ids.each_ref().map(ViewCellName::to_text);
        assert_eq!(texts, ["7", "'7", "18446744073709551615", "18446744073709551616", "07", "''7", ""]);
        assert_eq!(texts.map(ViewCellName::of_text), ids);
        assert_eq!(serde_json::to_string(&ids[..2]).unwrap(), r#"[7,"7"]"#);
    }
}
