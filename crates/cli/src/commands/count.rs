//! Counts on the command line: whole numbers, optionally with k, M or G.

/// Suffixes and their factors.
const SUFFIXES: [(char, u64); 3] = [('G', 1_000_000_000), ('M', 1_000_000), ('k', 1_000)];

/// Reads a count: `20000`, `20k`, `0.5M`.
pub fn parse(text: &str) -> Result<u64, String> {
    let wrong = || "takes a whole number, or a number with k, M or G, as in 500k or 20M".to_owned();
    let is = |suffix: char| text.ends_with([suffix, suffix.to_ascii_uppercase(), suffix.to_ascii_lowercase()]);
    let Some((_, unit)) = SUFFIXES.into_iter().find(|&(suffix, _)| is(suffix)) else {
        return text.parse().map_err(|_| wrong());
    };
    let number: f64 = text[..text.len() - 1].parse().map_err(|_| wrong())?;
    let count = (number * unit as f64).round();
    // Beyond 2^53, `f64` can't hold every whole number.
    let most = (1u64 << 53) as f64;
    if (0.0..=most).contains(&count) { Ok(count as u64) } else { Err(wrong()) }
}

/// The shortest text that [`parse`] reads as this count.
pub fn text(count: u64) -> String {
    let whole = SUFFIXES.into_iter().find(|&(_, unit)| count > 0 && count.is_multiple_of(unit));
    whole.map_or_else(|| count.to_string(), |(suffix, unit)| format!("{}{suffix}", count / unit))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_read_and_written() {
        for (text_of, count) in [("0", 0), ("999", 999), ("20k", 20_000), ("20M", 20_000_000), ("3G", 3_000_000_000)] {
            assert_eq!((parse(text_of), text(count).as_str()), (Ok(count), text_of));
        }
        assert_eq!([parse("0.5M"), parse("20K"), parse("2m")], [Ok(500_000), Ok(20_000), Ok(2_000_000)]);
        for bad in ["", "k", "0.5", "-1", "-1k", "1e99M", "NaNM", "infk", "20 M", "5é"] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
