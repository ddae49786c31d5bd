//! Adapts the text of a map to its reader. Extensions of some editors and games are changed in place, so that line numbers stay
//! valid.
//!
//! * A quotation mark within quotes, written as `\"`, becomes an apostrophe. Windows paths may end in a backslash, so before the
//!   last quotation mark of a line or an entity it is an ordinary letter.
//! * Hexen II has one more number per side than Quake: it is removed.

/// Numbers after the texture of a side in Quake, without the axes of Valve 220 and with them.
const NUMBERS: [usize; 2] = [5, 3];

/// Removes parts of a map's text that its reader does not know.
pub(super) fn settle(text: &mut [u8]) {
    let (mut at, mut side) = (0, Side::default());
    while at < text.len() {
        let end = match text[at] {
            b if b.is_ascii_whitespace() => at + 1,
            b'"' => {
                let end = quoted(text, at);
                side.read(text, [at, end]);
                end
            }
            b'/' if text.get(at + 1) == Some(&b'/') => until(text, at, |b| matches!(b, b'\n' | b'\r')),
            _ => {
                let end = until(text, at, |b| b.is_ascii_whitespace());
                side.read(text, [at, end]);
                end
            }
        };
        at = end;
    }
}

/// The first place from `from` on with a matching byte, or the end.
fn until(text: &[u8], from: usize, is: impl Fn(u8) -> bool) -> usize {
    text[from..].iter().position(|&b| is(b)).map_or(text.len(), |more| from + more)
}

/// The end of the quoted text that begins at `from`, with its quotation marks; inner ones become apostrophes.
fn quoted(text: &mut [u8], from: usize) -> usize {
    let mut at = from + 1;
    while at < text.len() && text[at] != b'"' {
        if text[at] == b'\\' && text.get(at + 1) == Some(&b'\\') {
            at += 1;
        } else if text[at] == b'\\' && text.get(at + 1) == Some(&b'"') {
            if matches!(text.get(at + 2), None | Some(b'\n' | b'\r' | b'}')) {
                return at + 2;
            }
            text[at + 1] = b'\'';
        }
        at += 1;
    }
    (at + 1).min(text.len())
}

/// State of reading a side of a brush.
#[derive(Default)]
struct Side {
    /// Completed points.
    points: usize,
    /// Words after the points: a texture, axes, numbers.
    words: usize,
    /// Whether there were axes, and the numbers after them or after the texture.
    has_axes: bool,
    numbers: usize,
    last: [usize; 2],
}

impl Side {
    /// Reads the next word.
    fn read(&mut self, text: &mut [u8], place: [usize; 2]) {
        match &text[place[0]..place[1]] {
            b"(" | b"}" | b"{" if self.points >= 3 => {
                if self.numbers == NUMBERS[usize::from(self.has_axes)] + 1 {
                    text[self.last[0]..self.last[1]].fill(b' ');
                }
                *self = Self::default();
            }
            b"}" | b"{" => *self = Self::default(),
            b")" if self.points < 3 => self.points += 1,
            b"]" => (self.has_axes, self.numbers) = (true, 0),
            _ if self.points == 3 => {
                self.numbers += usize::from(self.words > 0);
                (self.words, self.last) = (self.words + 1, place);
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn settled(text: &str) -> String {
        let mut bytes = text.as_bytes().to_vec();
        settle(&mut bytes);
        String::from_utf8(bytes).unwrap()
    }

    #[test]
    fn quotation_marks_within_quotes_become_apostrophes() {
        for (text, becomes) in [
            (r#""message" "say \"hello\" now""#, r#""message" "say \'hello\' now""#),
            (r#""message" "\"hello\"""#, r#""message" "\'hello\'""#),
            ("\"wad\" \"C:\\quake\\\"\n\"a\" \"b\"\n", "\"wad\" \"C:\\quake\\\"\n\"a\" \"b\"\n"),
            (r#"{ "wad" "C:\\" }"#, r#"{ "wad" "C:\\" }"#),
            ("// it's \"\n\"a\" \"\\\"b\"", "// it's \"\n\"a\" \"\\'b\""),
            ("\"never ends", "\"never ends"),
            ("\"\\", "\"\\"),
        ] {
            assert_eq!(settled(text), becomes);
        }
    }

    #[test]
    fn the_number_that_only_hexen_ii_has_is_left_out() {
        let points = "( 0 0 0 ) ( 0 1 0 ) ( 0 0 1 )";
        let axes = "[ 1 0 0 0 ] [ 0 -1 0 0 ]";
        for (tail, becomes) in [
            ("wall 0 0 0 1 1", "wall 0 0 0 1 1"),
            ("wall 0 0 0 1 1 -1", "wall 0 0 0 1 1   "),
            ("\"a wall\" 0 0 0 1 1 64 // light", "\"a wall\" 0 0 0 1 1    // light"),
            ("wall 0 0 0 1 1 0 9 0", "wall 0 0 0 1 1 0 9 0"),
            (&format!("wall {axes} 0 1 1"), &format!("wall {axes} 0 1 1")),
            (&format!("wall {axes} 0 1 1 5"), &format!("wall {axes} 0 1 1  ")),
            (&format!("wall {axes} 0 1 1 0 9 0"), &format!("wall {axes} 0 1 1 0 9 0")),
        ] {
            let of = |tail: &str| format!("{{\n{{\n{points} {tail}\n{points} {tail}\n}}\n}}\n");
            assert_eq!(settled(&of(tail)), of(becomes));
        }
    }
}
