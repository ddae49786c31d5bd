//! The shares of a bake's rays. Nothing else divides [`PvsOptions::ray_budget`](super::PvsOptions::ray_budget); `sampling/schedule.rs` shares out
//! `sampling` between cubes and guided rays.
//!
//! A ray, a segment and a 1,500th of a visibility cube count as one. Shafts against triangles are extra: at most one per five rays, which
//! take about as long.

/// The share of test rays.
const TESTS: f64 = 0.05;
/// The share for segments at pairs that flow leaves undecided.
const AIMED: f64 = 0.15;
/// The share of view cells, if there are any.
const VIEW_CELLS: f64 = 1.0 / 3.0;
/// The share of test rays among those of view cells. Each row is tested alone, so it is larger than that of cells.
const VIEW_CELL_TESTS: f64 = 0.2;
/// The share of rays for a single open cell, whose row contains everything anyway.
const ONE_OPEN_CELL: f64 = 0.02;
/// Rays that take about as long as a shaft.
const RAYS_PER_SHAFT: u64 = 5;
/// After an edit, sampling and tests get this share of theirs, and more for new cells. Larger: what was found before is found again at its
/// old cost. Smaller: a lower set that says little.
const AGAIN: f64 = 0.02;
/// If an accuracy goal (`--unseen`) costs more rays, the budgets of segments and shafts are based on this many.
const MOST_AFTER_GOAL: u64 = 20_000_000;

/// The budget of each step of a bake. Shares in rays add up to at most the given budget; shafts are extra.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, serde::Serialize)]
pub struct Budget {
    /// Cubes and guided rays from cells.
    pub sampling: u64,
    /// Rays that test the rows of cells.
    pub tests: u64,
    /// Segments at pairs that flow leaves undecided; they also get the rest of sampling and tests.
    pub aimed: u64,
    /// Cubes, segments and tests from view cells.
    pub view_cells: u64,
    /// Shafts against triangles, a number of shafts and not of rays.
    pub shafts: u64,
}

impl Budget {
    /// The shares of `rays` among cells alone.
    pub fn of_cells(rays: u64) -> Self {
        let share = |part: f64| (rays as f64 * part) as u64;
        let (tests, aimed) = (share(TESTS), share(AIMED));
        Self { sampling: rays - tests - aimed, tests, aimed, view_cells: 0, shafts: rays / RAYS_PER_SHAFT }
    }

    /// The shares of `rays` among cells and view cells.
    pub fn with_view_cells(rays: u64) -> Self {
        let view_cells = (rays as f64 * VIEW_CELLS) as u64;
        Self { view_cells, ..Self::of_cells(rays - view_cells) }
    }

    /// The shares of `rays` for a single open cell.
    pub fn of_one_open_cell(rays: u64) -> Self {
        Self::of_cells((rays as f64 * ONE_OPEN_CELL) as u64)
    }

    /// The rays of cells.
    pub fn cells(&self) -> u64 {
        self.sampling + self.tests + self.aimed
    }

    /// The shares after sampling towards a goal has spent `rays`: later steps get their share of that, and at most that without a goal.
    pub(super) fn after_goal(&self, rays: u64) -> Self {
        let all = (rays as f64 / (1.0 - AIMED)) as u64;
        Self { view_cells: self.view_cells, ..Self::of_cells(self.cells().min(all).min(MOST_AFTER_GOAL)) }
    }

    /// The shares of a bake after an edit, by which this share of the cells is new.
    pub(super) fn again(&self, new: f64) -> Self {
        let share = |rays: u64| (rays as f64 * (AGAIN + (1.0 - AGAIN) * new)) as u64;
        Self { sampling: share(self.sampling), tests: share(self.tests), ..*self }
    }

    /// The test rays among `rays` for view cells.
    pub(super) fn view_cell_tests(rays: u64) -> u64 {
        (rays as f64 * VIEW_CELL_TESTS) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_add_up_to_what_was_asked_for() {
        for rays in [0, 1, 7, 1000, 20_000_000, 1_000_000_000] {
            let (cells, both) = (Budget::of_cells(rays), Budget::with_view_cells(rays));
            assert_eq!((cells.cells(), cells.view_cells), (rays, 0));
            assert_eq!(both.cells() + both.view_cells, rays);
            assert!(Budget::of_one_open_cell(rays).cells() <= rays / 50 && both.shafts <= rays / 5);
        }
        let default = Budget::of_cells(20_000_000);
        assert_eq!(
            [default.sampling, default.tests, default.aimed, default.shafts],
            [16_000_000, 1_000_000, 3_000_000, 4_000_000]
        );
    }
}
