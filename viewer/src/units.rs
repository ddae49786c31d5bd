//! Lengths, areas and speeds in words: in metres, or in feet and inches.

use serde::{Deserialize, Serialize};

/// Metres of a foot, and of an inch.
const FOOT: f64 = 0.3048;
const INCH: f64 = 0.0254;
/// Parts of an inch that are written. A foot has twelve inches.
const TENTHS: f64 = 10.0;
const FOOT_IN_TENTHS: f64 = 12.0 * TENTHS;

/// Units of lengths.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Units {
    /// Metres and square metres.
    #[default]
    Metres,
    /// Feet and inches, and square feet.
    Feet,
}

impl Units {
    /// A length: `2.45 m`, or `8' 0.5"`. Hundredths of a metre, or tenths of an inch.
    pub fn length(self, metres: f64) -> String {
        match self {
            Self::Metres => format!("{} m", rounded(metres, 2)),
            Self::Feet if !metres.is_finite() => format!("{metres} ft"),
            Self::Feet => {
                // Rounded first: what is nearly twelve inches is a foot.
                let tenths = (metres.abs() / INCH * TENTHS).round();
                let sign = if metres < 0.0 && tenths > 0.0 { "-" } else { "" };
                let feet = (tenths / FOOT_IN_TENTHS).floor();
                format!("{sign}{feet:.0}' {}\"", (tenths - feet * FOOT_IN_TENTHS) / TENTHS)
            }
        }
    }

    /// An area, to a tenth: `18.4 m²`, or `198.1 ft²`.
    pub fn area(self, square_metres: f64) -> String {
        match self {
            Self::Metres => format!("{} m²", rounded(square_metres, 1)),
            Self::Feet => format!("{} ft²", rounded(square_metres / (FOOT * FOOT), 1)),
        }
    }

    /// A speed, to a tenth: `2.4 m/s`, or `7.9 ft/s`.
    pub fn speed(self, metres_a_second: f64) -> String {
        match self {
            Self::Metres => format!("{} m/s", rounded(metres_a_second, 1)),
            Self::Feet => format!("{} ft/s", rounded(metres_a_second / FOOT, 1)),
        }
    }
}

/// A number in few digits.
pub fn number(x: f64) -> String {
    match x {
        _ if x >= 1e6 => format!("{:.2} M", x / 1e6),
        _ if x >= 10_000.0 => format!("{:.1} k", x / 1e3),
        _ if x.fract() == 0.0 => format!("{x}"),
        _ => format!("{x:.2}"),
    }
}

/// A number with a number of digits after the point; -0 is written as 0.
fn rounded(number: f64, digits: usize) -> String {
    let text = format!("{number:.digits$}");
    match text.strip_prefix('-') {
        Some(rest) if !rest.contains(|digit: char| digit != '0' && digit != '.') => rest.to_owned(),
        _ => text,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_are_rounded_and_twelve_inches_are_a_foot() {
        let metres = [(2.4449, "2.44 m"), (2.4451, "2.45 m"), (0.0, "0.00 m"), (-0.001, "0.00 m"), (-1.5, "-1.50 m")];
        for (length, words) in metres {
            assert_eq!(Units::Metres.length(length), words);
        }
        // 11.96 inches are 12.0, and so a foot.
        let inches = [
            (11.96, "1' 0\""),
            (11.94, "0' 11.9\""),
            (23.96, "2' 0\""),
            (12.0, "1' 0\""),
            (96.5, "8' 0.5\""),
            (0.0, "0' 0\""),
            (0.04, "0' 0\""),
            (-0.04, "0' 0\""),
            (-30.25, "-2' 6.3\""),
            (1201.0, "100' 1\""),
        ];
        for (length, words) in inches {
            assert_eq!(Units::Feet.length(length * 0.0254), words, "{length} inches");
        }
        assert_eq!(Units::Feet.length(1.0), "3' 3.4\"");
    }

    #[test]
    fn areas_and_speeds_are_told_in_the_same_units() {
        assert_eq!([Units::Metres.area(18.44), Units::Feet.area(18.44)], ["18.4 m²", "198.5 ft²"]);
        assert_eq!([Units::Metres.area(-0.01), Units::Feet.area(0.0)], ["0.0 m²", "0.0 ft²"]);
        assert_eq!([Units::Metres.speed(2.4), Units::Feet.speed(2.4)], ["2.4 m/s", "7.9 ft/s"]);
    }

    #[test]
    fn what_is_no_number_is_told_too() {
        for units in [Units::Metres, Units::Feet] {
            for number in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, f64::MAX, f64::MIN_POSITIVE] {
                assert!(!units.length(number).is_empty() && !units.area(number).is_empty());
            }
            assert!(units.length(f64::INFINITY).contains("inf") && units.length(f64::NAN).contains("NaN"));
        }
    }
}
