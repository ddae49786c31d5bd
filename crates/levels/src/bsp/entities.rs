//! The entities of a level: text in braces, with a quoted key and value per line.

use super::error::{BspError, entry};
use super::layout::Lump;

/// An entity: its keys and values, in order.
pub(crate) struct Entity(Vec<(String, String)>);

impl Entity {
    /// The last value of a key.
    pub fn get(&self, key: &str) -> Option<&str> {
        self.0.iter().rev().find(|(k, _)| k == key).map(|(_, value)| value.as_str())
    }
}

/// Reads the lump. The text ends at a zero byte; bytes that are not UTF-8 count as Latin-1.
pub(crate) fn entities(lump: &[u8]) -> Result<Vec<Entity>, BspError> {
    let text: String = lump.iter().take_while(|&&b| b != 0).map(|&b| char::from(b)).collect();
    let mut rest = text.as_str();
    let mut all = Vec::new();
    loop {
        rest = rest.trim_start();
        if rest.is_empty() {
            return Ok(all);
        }
        let fault = |what: &str| entry(Lump::Entities, all.len(), what);
        rest = rest.strip_prefix('{').ok_or_else(|| fault("doesn't begin with {"))?;
        let mut pairs = Vec::new();
        loop {
            rest = rest.trim_start();
            if let Some(after) = rest.strip_prefix('}') {
                rest = after;
                break;
            }
            let mut word = || {
                let (word, after) = rest.trim_start().strip_prefix('"')?.split_once('"')?;
                rest = after;
                Some(word.to_owned())
            };
            let pair = word().zip(word()).ok_or_else(|| fault("ends within a key or a value"))?;
            pairs.push(pair);
        }
        all.push(Entity(pairs));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_and_values_are_read_and_damage_is_named_by_entity() {
        let text = b"{\n\"classname\" \"worldspawn\"\n}\n{\n\"classname\" \"func_door\"\n\"model\" \"*1\"\n}\n\0junk";
        let all = entities(text).unwrap();
        assert_eq!((all.len(), all[1].get("model"), all[1].get("angle")), (2, Some("*1"), None));
        for (text, what) in [
            (&b"\"a\" \"b\""[..], "entry 0: doesn't begin with {"),
            (b"{}{\"a\"", "entry 1: ends within a key or a value"),
            (b"{\"a\" b}", "entry 0: ends within"),
            (b"{", "entry 0: ends within"),
        ] {
            let message = entities(text).err().expect(what).to_string();
            assert!(message.contains(what), "{message}");
        }
    }
}
