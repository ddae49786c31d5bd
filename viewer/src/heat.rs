//! Numbers as colours from cold to hot.

use crate::colours::Tints;
use crate::profile::Profile;

/// From nothing to most: dark blue, green, yellow, red. A thing that is never so is grey.
const SCALE: [[u8; 3]; 5] = [[44, 62, 140], [40, 140, 160], [110, 190, 90], [240, 200, 60], [214, 50, 40]];
/// Of what is never so.
pub const NEVER: [u8; 3] = [150, 150, 155];

/// The colour of a share of the most, 0 to 1; what is less or more is as the end.
pub fn colour(share: f64) -> [u8; 3] {
    let last = SCALE.len() - 1;
    let at = if share.is_nan() { 0.0 } else { share.clamp(0.0, 1.0) } * last as f64;
    let step = (at as usize).min(last - 1);
    let part = at - step as f64;
    [0, 1, 2].map(|k| {
        let [a, b] = [SCALE[step][k], SCALE[step + 1][k]].map(f64::from);
        (a + (b - a) * part).round() as u8
    })
}

/// By object, and last of leaves that were made: how often each is seen, or what it costs in vain.
pub fn of_objects(profile: &Profile<'_>, tints: Tints) -> Vec<[u8; 3]> {
    let values: Vec<f64> = match tints {
        Tints::InVain => profile.in_vain.iter().map(|&n| n as f64).collect(),
        _ => profile.seen.iter().map(|&n| f64::from(n)).collect(),
    };
    let most = values.iter().copied().fold(0.0, f64::max);
    // Costs in vain differ by powers of ten: half of the scale is a hundredth of the most.
    let share = |value: f64| match tints {
        Tints::InVain => (1.0 + 99.0 * value / most).log10() / 2.0,
        _ => value / most,
    };
    let colours = values.iter().map(|&value| if value > 0.0 { colour(share(value)) } else { NEVER });
    colours.chain([NEVER]).collect()
}

/// Labels at both ends of the scale.
pub fn ends(profile: &Profile<'_>, tints: Tints) -> [String; 2] {
    let frames = profile.costs.len().max(1);
    match tints {
        Tints::InVain => {
            let most = profile.in_vain.iter().max().copied().unwrap_or(0);
            ["few".to_owned(), format!("{:.0} triangles a frame", most as f64 / frames as f64)]
        }
        _ => {
            let most = profile.seen.iter().max().copied().unwrap_or(0);
            ["one frame".to_owned(), format!("{most} of {frames} frames")]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_scale_goes_from_its_first_colour_to_its_last() {
        assert_eq!([colour(-1.0), colour(0.0), colour(f64::NAN)], [SCALE[0]; 3]);
        assert_eq!([colour(1.0), colour(9.0)], [SCALE[4]; 2]);
        assert_eq!([colour(0.25), colour(0.5)], [SCALE[1], SCALE[2]]);
        // Half way between two of them.
        assert_eq!(colour(0.125), [42, 101, 150]);
    }
}
