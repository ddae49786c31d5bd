//! How much is worked on between two looks at what is known. It follows the budget, so that a bake has some hundred maps
//! with any number of rays: each is a wait where several machines work on one bake. It depends on the input alone, and not
//! on threads.

/// The rays are given away in this many parts, or in fewer of this many rays.
const PARTS: u64 = 64;
const LEAST: u64 = 32_000;
/// A part is worked on in so many batches. More: what is found guides the next rays sooner. Fewer: less is waited for.
const BATCHES: u64 = 3;

/// Rays of a part of `whole`.
pub(super) fn part(whole: u64) -> u64 {
    (whole / PARTS).max(LEAST)
}

/// Rays of a batch of a part.
pub(super) fn batch(part: u64) -> u64 {
    part / BATCHES
}

/// Items of the next batch, where `left` rays of a part of `part` are left and an item costs `cost`: equal batches of at
/// least `least` items, but for a part that hasn't so many.
pub(super) fn next(left: u64, part: u64, cost: u64, least: usize) -> usize {
    let (items, size) = (left / cost, (batch(part) / cost).max(least as u64));
    items.div_ceil((items / size).max(1)) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_of_a_part_are_equal_and_few() {
        // A cube costs 1,500 rays: parts of 33, 166 and 8,333 of them.
        let batches = |part: u64| {
            let (mut left, mut all) = (part, Vec::new());
            while left >= 1_500 {
                let items = next(left, part, 1_500, 64);
                all.push(items);
                left -= 1_500 * items as u64;
            }
            all
        };
        assert_eq!(batches(super::part(3_200_000)), [33]);
        assert_eq!(batches(super::part(16_000_000)), [83, 83]);
        assert_eq!(batches(super::part(800_000_000)), [2778, 2778, 2777]);
        assert_eq!(batches(1_499), [0; 0]);
        assert_eq!((super::part(0), next(0, 32_000, 25, 256)), (32_000, 0));
    }
}
