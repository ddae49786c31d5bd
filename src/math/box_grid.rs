//! A grid of boxes: what touches a box or a point is found in the grid's cells there, without a way down a tree.

use super::geom::Aabb;
use super::sorting;
use glam::{DVec3, Vec4};

/// Cells for each box. More: memory, and large queries visit many. Fewer: each cell has more boxes.
const CELLS: f64 = 2.0;
/// Most places of boxes in cells, for each box; the largest boxes are left out. More: memory where sizes differ much. Fewer: more boxes for a
/// tree.
const PLACES: usize = 32;
/// Most cells along an axis.
const MOST_ALONG: f64 = 1024.0;

/// Boxes by the cells of a grid that they touch.
#[derive(Clone, Debug)]
pub struct BoxGrid {
    low: DVec3,
    /// Cells for each metre.
    scale: DVec3,
    counts: [u32; 3],
    /// By cell: its first box, and the end of the last.
    starts: Vec<u32>,
    places: Vec<Place>,
}

/// A box in a cell.
#[derive(Clone, Copy, Debug)]
struct Place {
    /// Rounded outwards; the last component is 0.
    low: Vec4,
    high: Vec4,
    item: u32,
    /// The first cell that it is in along each axis.
    first: [u16; 3],
}

impl BoxGrid {
    /// A grid of `items`, ascending indices into `boxes`, all of which must be finite; and those that are too large for it.
    pub fn new(boxes: &[Aabb], items: &[u32]) -> (Self, Vec<u32>) {
        let bounds = items.iter().fold(Aabb::EMPTY, |b, &i| b.union(boxes[i as usize]));
        let size = if bounds.is_empty() { DVec3::ZERO } else { bounds.size() };
        // Flat where all boxes are.
        let thick = size.max(DVec3::splat(size.max_element() * 1e-3)).max(DVec3::splat(f64::MIN_POSITIVE));
        // Cells have the shape of the boxes in the middle.
        let (mut by_size, mut spare) = (items.to_vec(), Vec::new());
        let usual = DVec3::from_array([0, 1, 2].map(|axis| {
            let size = |item: u32| boxes[item as usize].size()[axis];
            sorting::sort(&mut by_size, &mut spare, &|a, b| size(a).total_cmp(&size(b)).is_lt());
            by_size.get(items.len() / 2).map_or(0.0, |&item| size(item)).max(thick[axis] * 1e-3)
        }));
        let along = thick / usual;
        let share = (CELLS * items.len().max(1) as f64).cbrt() / (along.x.cbrt() * along.y.cbrt() * along.z.cbrt());
        let counts = (along * share).ceil().clamp(DVec3::ONE, DVec3::splat(MOST_ALONG));
        let mut grid = Self {
            low: if bounds.is_empty() { DVec3::ZERO } else { bounds.min },
            scale: counts / thick,
            counts: counts.to_array().map(|count| count as u32),
            starts: Vec::new(),
            places: Vec::new(),
        };
        let cells = |&item: &u32| {
            let [first, last] = grid.cells(&boxes[item as usize]);
            (0..3).map(|axis| last[axis] - first[axis] + 1).product::<u32>()
        };
        by_size.copy_from_slice(items);
        sorting::sort(&mut by_size, &mut spare, &|a, b| cells(&a) < cells(&b));
        let mut left = PLACES * items.len();
        let fits = |item: &&u32| left.checked_sub(cells(item) as usize).inspect(|&less| left = less).is_some();
        let fit = by_size.iter().take_while(fits).count();
        let large = by_size.split_off(fit);
        sorting::sort(&mut by_size, &mut spare, &|a, b| a < b);
        grid.place(boxes, &by_size);
        (grid, large)
    }

    /// Puts boxes into the cells that they touch, in the order of `items`.
    fn place(&mut self, boxes: &[Aabb], items: &[u32]) {
        // By cell: where its next box goes.
        let mut ends = vec![0; self.counts.iter().product::<u32>() as usize + 1];
        for &item in items {
            self.each(self.cells(&boxes[item as usize]), &mut |_, cell| ends[cell + 1] += 1);
        }
        for cell in 1..ends.len() {
            ends[cell] += ends[cell - 1];
        }
        self.starts = ends.clone();
        let mut places =
            vec![Place { low: Vec4::ZERO, high: Vec4::ZERO, item: 0, first: [0; 3] }; ends[ends.len() - 1] as usize];
        for &item in items {
            let bounds = &boxes[item as usize];
            let [first, last] = self.cells(bounds);
            let [low, high] = rounded(bounds);
            let place = Place { low, high, item, first: first.map(|at| at as u16) };
            self.each([first, last], &mut |_, cell| {
                places[ends[cell] as usize] = place;
                ends[cell] += 1;
            });
        }
        self.places = places;
    }

    /// Visits the items whose box touches `bounds`, each once, and a few that are just beside it.
    pub fn in_box(&self, bounds: &Aabb, visit: &mut impl FnMut(u32)) {
        let [low, high] = rounded(bounds);
        let [first, last] = self.cells(bounds);
        self.each([first, last], &mut |at, cell| {
            for place in &self.places[self.starts[cell] as usize..self.starts[cell + 1] as usize] {
                let touches = place.low.cmple(high) & low.cmple(place.high);
                // In the first cell of those that both are in.
                let is_first = || (0..3).all(|axis| at[axis] == first[axis].max(u32::from(place.first[axis])));
                if touches.all() && is_first() {
                    visit(place.item);
                }
            }
        });
    }

    /// The first and the last cells that a box touches along each axis; beyond the grid, those at its sides.
    fn cells(&self, bounds: &Aabb) -> [[u32; 3]; 2] {
        [bounds.min, bounds.max].map(|p| {
            let at = (p - self.low) * self.scale;
            // Saturates.
            [0, 1, 2].map(|axis| (at[axis] as i32).clamp(0, self.counts[axis] as i32 - 1) as u32)
        })
    }

    fn each(&self, [first, last]: [[u32; 3]; 2], visit: &mut impl FnMut([u32; 3], usize)) {
        for z in first[2]..=last[2] {
            for y in first[1]..=last[1] {
                for x in first[0]..=last[0] {
                    visit([x, y, z], ((z * self.counts[1] + y) * self.counts[0] + x) as usize);
                }
            }
        }
    }
}

fn rounded(bounds: &Aabb) -> [Vec4; 2] {
    [bounds.min.as_vec3().map(f32::next_down), bounds.max.as_vec3().map(f32::next_up)].map(|p| p.extend(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::random::Prng;

    /// Boxes of all sizes, some large, some flat, and queries within, across and beyond the grid.
    #[test]
    fn the_grid_finds_what_looking_at_every_box_finds() {
        let mut rng = Prng::new(3, 0);
        let (mut met, mut missed) = (0, 0);
        for round in 0..30 {
            let count = [0, 1, 5, 300][round % 4];
            let flat = if round % 3 == 0 { DVec3::new(1.0, 0.0, 1.0) } else { DVec3::ONE };
            let mut around = |reach: f64, size: f64| {
                let mut point =
                    |scale: f64| DVec3::new(rng.range(-1.0, 1.0), rng.range(-1.0, 1.0), rng.range(-1.0, 1.0)) * scale;
                let (middle, half) = (point(reach) + 30.0, point(size).abs());
                Aabb { min: (middle - half) * flat, max: (middle + half) * flat }
            };
            let boxes: Vec<Aabb> = (0..count).map(|k| around(50.0, [1.0, 4.0, 60.0][k % 3])).collect();
            let (grid, large) = BoxGrid::new(&boxes, &(0..count as u32).collect::<Vec<_>>());
            for k in 0..200 {
                let mut query = around([50.0, 200.0][k % 2], [0.0, 1.0, 80.0][k % 3]);
                if k == 0 {
                    query = Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY };
                }
                let mut found = large.clone();
                grid.in_box(&query, &mut |item| found.push(item));
                for (item, bounds) in (0..).zip(&boxes) {
                    let touches = bounds.touches(&query);
                    assert!(!touches || found.contains(&item), "round {round}: {item} touches {query:?}");
                    met += usize::from(touches);
                    missed += usize::from(!found.contains(&item));
                }
            }
        }
        assert!(met > 10_000 && missed > 100_000, "{met} {missed}");
    }
}
