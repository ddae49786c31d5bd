//! A stable merge sort of numbers, for lists that no frame sorts at length. The standard library's sorts are faster on long lists, and each use of
//! one is a copy of several kilobytes, of which a browser has to load every one.

/// Longest run that is sorted in place.
const RUN: usize = 12;

/// Sorts by `is_before`; what is before neither keeps its order. `spare` holds as many afterwards, of no meaning.
pub fn sort(items: &mut [u32], spare: &mut Vec<u32>, is_before: &dyn Fn(u32, u32) -> bool) {
    items.chunks_mut(RUN).for_each(|run| sort_few(run, is_before));
    let mut sorted = RUN;
    while sorted < items.len() {
        spare.clear();
        for pair in items.chunks(2 * sorted) {
            let (mut left, mut right) = pair.split_at(sorted.min(pair.len()));
            while let (&[first, ..], &[second, ..]) = (left, right) {
                let from = if is_before(second, first) { &mut right } else { &mut left };
                spare.push(from[0]);
                *from = &from[1..];
            }
            spare.extend_from_slice(left);
            spare.extend_from_slice(right);
        }
        items.copy_from_slice(spare);
        sorted *= 2;
    }
}

/// Sorts a few items: the work grows with the square of their number.
pub fn sort_few<T: Copy>(items: &mut [T], is_before: &dyn Fn(T, T) -> bool) {
    for end in 1..items.len() {
        let (item, mut place) = (items[end], end);
        while place > 0 && is_before(item, items[place - 1]) {
            items[place] = items[place - 1];
            place -= 1;
        }
        items[place] = item;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Prng;

    /// Keys of many and of few values, so that the order of equal ones counts.
    #[test]
    fn the_order_is_that_of_the_standard_librarys_stable_sort() {
        let mut rng = Prng::new(5, 0);
        let mut spare = Vec::new();
        for count in (0..60).chain([100, 1000, 1023, 1025]) {
            for values in [1, 3, 1000] {
                let keys: Vec<usize> = (0..count).map(|_| rng.below(values)).collect();
                let mut found: Vec<u32> = (0..count as u32).collect();
                let mut expected = found.clone();
                sort(&mut found, &mut spare, &|a, b| keys[a as usize] < keys[b as usize]);
                expected.sort_by_key(|&item| keys[item as usize]);
                assert_eq!(found, expected);
            }
        }
    }
}
