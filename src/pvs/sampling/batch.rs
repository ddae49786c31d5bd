//! How much is worked on between two looks at what is known: an eighth of what was worked on before, so that what is known
//! grows about evenly from look to look. A bake has some dozens of batches with any number of rays (each is a wait where several
//! machines work on one bake), and one of many rays begins as one of few does.

/// Rays of a batch, at least.
const LEAST: u64 = 32_000;
/// A batch is this part of all rays before it. More: what is found guides the next rays sooner. Less: less is waited for.
const PART: u64 = 8;

/// Rays of the next batch, after `spent` of them.
pub(super) fn after(spent: u64) -> u64 {
    (spent / PART).max(LEAST)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_are_few_with_any_number_of_rays() {
        let batches = |budget: u64| {
            let (mut spent, mut count) = (0, 0);
            while spent < budget {
                spent += after(spent).min(budget - spent);
                count += 1;
            }
            count
        };
        assert_eq!([0, 32_000, 256_000, 288_000].map(batches), [0, 1, 8, 9]);
        // A batch more for each 12.5 % of rays, so six more for twice as many.
        assert_eq!([20_000_000, 40_000_000, 1_000_000_000].map(batches), [46, 51, 79]);
    }
}
