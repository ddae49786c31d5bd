//! Size of a batch between two updates of the known pairs: an eighth of the previous rays, so that knowledge grows about evenly. A bake has
//! some dozens of batches for any number of rays (each is a wait if several machines share a bake), and the first batches do not depend on
//! the budget.

/// Least rays of a batch.
const LEAST: u64 = 32_000;
/// A batch is one in this many of all previous rays. Larger: results guide the next rays sooner. Smaller: fewer waits.
const PART: u64 = 8;

/// Rays of the next batch, after `spent` rays.
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
        // One more batch for each 12.5 % of rays, so six more for twice as many.
        assert_eq!([20_000_000, 40_000_000, 1_000_000_000].map(batches), [46, 51, 79]);
    }
}
