//! Chunks: items that the same cells need, or nearly the same, so that few requests bring little too much.
//!
//! Items with equal columns begin as one cluster. Then, in rounds, pairs of clusters in one cell or behind one of its portals are joined, those
//! first that save most requests for the bytes that they bring too much. Agglomeration by column is the field's (van de Panne and Stewart,
//! *Effective compression techniques for precomputed visibility*, 1999); the limits in bytes are our own. A cluster is compared with a limited
//! number of those whose columns have about as many cells, so a round takes time in proportion to the clusters.

use crate::columns::{Item, both, common, count, needs, without};
use enfilade::math::bits::ones;
use rayon::prelude::*;
use std::collections::HashMap;

/// Limits of chunks.
#[derive(Clone, Copy)]
pub(crate) struct Limits {
    /// Share of the bytes that are fetched of a chunk which the cells that fetch it don't need, in all. More: a step into a room brings what
    /// is elsewhere. Less: each object is a request.
    pub(crate) waste: f64,
    /// Share of what a cell asks for that may come on top of it. More: rooms with little in them fetch several times that. Less: small
    /// objects stay alone.
    pub(crate) cell_waste: f64,
    /// Bytes of a chunk besides its items.
    pub(crate) fixed: u64,
    /// Bytes of a chunk. More: the first object of a chunk comes late. Less: more requests.
    pub(crate) most: u64,
}

/// About the bytes of a chunk besides its objects: what a request brings at any rate. More: rooms of small objects are one chunk, whoever sees
/// them. Less: each of them is a chunk that is mostly its own head.
pub(crate) const FIXED: u64 = 1000;
/// Those of `pack`.
pub(crate) const LIMITS: Limits = Limits { waste: 0.1, cell_waste: 0.4, fixed: FIXED, most: 1 << 20 };

/// Clusters with about as many cells that each is compared with, by cell.
const COMPARED: usize = 48;
/// Neighbours of a cell whose clusters are compared with those of the cell.
const NEIGHBOURS: usize = 24;

/// A chunk in the making.
#[derive(Default)]
struct Cluster {
    column: Vec<u64>,
    cells: u64,
    weight: u64,
    /// Over all cells, the bytes that they need of it.
    needed: u64,
    /// Ascending.
    items: Vec<u32>,
    /// The cells that its items are in, ascending.
    homes: Vec<usize>,
}

/// Divides items into chunks, each ascending, in the order of their first items.
pub(crate) fn chunks(items: &[Item], neighbours: &[Vec<usize>], limits: Limits) -> Vec<Vec<u32>> {
    let mut clusters = equal_columns(items);
    let mut cells = Cells::of(items, &clusters, neighbours.len());
    loop {
        let pairs = candidates(&clusters, neighbours, &cells.needs, limits);
        let joined = join(&mut clusters, &pairs, &mut cells, limits);
        if !joined {
            break;
        }
        clusters.retain(|cluster| !cluster.items.is_empty());
    }
    let mut chunks: Vec<Vec<u32>> =
        clusters.into_iter().flat_map(|cluster| split(cluster.items, items, limits.most)).collect();
    chunks.sort_unstable();
    chunks
}

/// One cluster for each column.
fn equal_columns(items: &[Item]) -> Vec<Cluster> {
    let mut known: HashMap<&[u64], usize> = HashMap::new();
    let mut clusters: Vec<Cluster> = Vec::new();
    for (number, item) in items.iter().enumerate() {
        let at = *known.entry(&item.column).or_insert(clusters.len());
        if at == clusters.len() {
            let (column, cells) = (item.column.clone(), count(&item.column));
            clusters.push(Cluster { column, cells, ..Cluster::default() });
        }
        let cluster = &mut clusters[at];
        cluster.weight += item.weight;
        cluster.needed += item.weight * cluster.cells;
        cluster.items.push(number as u32);
        cluster.homes.extend(item.home);
    }
    for cluster in &mut clusters {
        cluster.homes.sort_unstable();
        cluster.homes.dedup();
    }
    clusters
}

/// Pairs of clusters that may be joined, best first: bytes too many per request that is saved, and the two clusters.
fn candidates(clusters: &[Cluster], neighbours: &[Vec<usize>], needs: &[u64], limits: Limits) -> Vec<(f64, u32, u32)> {
    let mut in_cell: Vec<Vec<u32>> = vec![Vec::new(); neighbours.len()];
    let mut order: Vec<u32> = (0..clusters.len() as u32).collect();
    order.sort_unstable_by_key(|&c| (clusters[c as usize].cells, clusters[c as usize].items.first().copied()));
    let mut rank = vec![0; clusters.len()];
    for (place, &cluster) in order.iter().enumerate() {
        rank[cluster as usize] = place;
        clusters[cluster as usize].homes.iter().for_each(|&cell| in_cell[cell].push(cluster));
    }
    let of = |a: u32| {
        let mut others: Vec<u32> = Vec::new();
        for &home in &clusters[a as usize].homes {
            for &cell in std::iter::once(&home).chain(neighbours[home].iter().take(NEIGHBOURS)) {
                let list = &in_cell[cell];
                let from = list.partition_point(|&b| rank[b as usize] <= rank[a as usize]);
                others.extend(list[from..].iter().take(COMPARED));
            }
        }
        others.sort_unstable();
        others.dedup();
        let pair = |b: u32| {
            let score = score(&clusters[a as usize], &clusters[b as usize], needs, limits)?;
            Some((score, a.min(b), a.max(b)))
        };
        others.into_iter().filter_map(pair).collect::<Vec<_>>()
    };
    let mut pairs: Vec<(f64, u32, u32)> = (0..clusters.len() as u32).into_par_iter().flat_map_iter(of).collect();
    pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    pairs
}

/// The share of their needs that cells would get on top, all cells together, per request that is saved; `None` beyond the limits.
fn score(a: &Cluster, b: &Cluster, needs: &[u64], limits: Limits) -> Option<f64> {
    let weight = a.weight + b.weight;
    if weight > limits.most {
        return None;
    }
    let saved = common(&a.column, &b.column);
    let cells = a.cells + b.cells - saved;
    let wasted = (cells * weight - a.needed - b.needed) as f64;
    let is_wasteful = wasted > limits.waste * (cells * (weight + limits.fixed)) as f64;
    if saved == 0 || is_wasteful {
        return None;
    }
    let on_top = |of: &Cluster, other: &Cluster| -> f64 {
        without(&of.column, &other.column).map(|cell| other.weight as f64 / needs[cell] as f64).sum()
    };
    Some((on_top(a, b) + on_top(b, a)) / saved as f64)
}

/// Joins pairs in order, each cluster once, while no cell gets too much. Returns whether there was one. A joined cluster leaves an empty one
/// behind.
fn join(clusters: &mut [Cluster], pairs: &[(f64, u32, u32)], cells: &mut Cells, limits: Limits) -> bool {
    let mut is_joined = vec![false; clusters.len()];
    let mut any = false;
    for &(_, a, b) in pairs {
        let [a, b] = [a as usize, b as usize];
        if is_joined[a] || is_joined[b] || !cells.take(&clusters[a], &clusters[b], limits) {
            continue;
        }
        let second = std::mem::take(&mut clusters[b]);
        clusters[a].take_in(second);
        (is_joined[a], is_joined[b], any) = (true, true, true);
    }
    any
}

/// What each cell fetches.
struct Cells {
    /// Bytes of the items that it needs.
    needs: Vec<u64>,
    /// Bytes of items that it doesn't need.
    extra: Vec<u64>,
    /// Number of clusters.
    clusters: Vec<u64>,
}

impl Cells {
    fn of(items: &[Item], clusters: &[Cluster], cells: usize) -> Self {
        let mut all = Self { needs: needs(items, cells), extra: vec![0; cells], clusters: vec![0; cells] };
        clusters.iter().for_each(|cluster| ones(&cluster.column).for_each(|cell| all.clusters[cell] += 1));
        all
    }

    /// Counts two clusters as one, unless a cell would get too much.
    fn take(&mut self, a: &Cluster, b: &Cluster, limits: Limits) -> bool {
        let of_one = without(&a.column, &b.column).map(|cell| (cell, b.weight, 0));
        let of_other = without(&b.column, &a.column).map(|cell| (cell, a.weight, 0));
        let of_both = both(&a.column, &b.column).map(|cell| (cell, 0, 1));
        let changes: Vec<(usize, u64, u64)> = of_one.chain(of_other).chain(of_both).collect();
        let is_too_much = |&(cell, more, fewer): &(usize, u64, u64)| {
            let asked = self.needs[cell] + limits.fixed * (self.clusters[cell] - fewer);
            (self.extra[cell] + more) as f64 > limits.cell_waste * asked as f64
        };
        if changes.iter().any(is_too_much) {
            return false;
        }
        for (cell, more, fewer) in changes {
            self.extra[cell] += more;
            self.clusters[cell] -= fewer;
        }
        true
    }
}

impl Cluster {
    fn take_in(&mut self, other: Self) {
        self.column.iter_mut().zip(&other.column).for_each(|(a, b)| *a |= b);
        self.cells = count(&self.column);
        self.weight += other.weight;
        self.needed += other.needed;
        self.items.extend(other.items);
        self.items.sort_unstable();
        self.homes.extend(other.homes);
        self.homes.sort_unstable();
        self.homes.dedup();
    }
}

/// Cuts a chunk into those of at most so many bytes; an item that has more is alone.
fn split(chunk: Vec<u32>, items: &[Item], most: u64) -> Vec<Vec<u32>> {
    let mut parts: Vec<Vec<u32>> = Vec::new();
    let mut weight = 0;
    for number in chunk {
        let own = items[number as usize].weight;
        match parts.last_mut().filter(|_| weight + own <= most) {
            Some(part) => {
                part.push(number);
                weight += own;
            }
            None => {
                parts.push(vec![number]);
                weight = own;
            }
        }
    }
    parts
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers that look random, of xorshift (Marsaglia, 2003).
    fn numbers(seed: u64) -> impl FnMut(u64) -> u64 {
        let mut state = seed * 2 + 1;
        move |below| {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            state % below
        }
    }

    /// Rooms in a row, each with items that most of the rooms around see.
    fn row(cells: usize, seed: u64) -> (Vec<Item>, Vec<Vec<usize>>) {
        let mut number = numbers(seed);
        let item = |i: usize| {
            let home = i % cells;
            let mut column = vec![0; cells.div_ceil(64)];
            for cell in home.saturating_sub(number(3) as usize)..(home + 1 + number(3) as usize).min(cells) {
                column[cell / 64] |= 1 << (cell % 64);
            }
            Item { column, weight: 1 + number(3000), home: Some(home) }
        };
        let items = (0..cells * 12).map(item).collect();
        let neighbours =
            |cell: usize| (cell.saturating_sub(1)..(cell + 2).min(cells)).filter(|other| *other != cell).collect();
        (items, (0..cells).map(neighbours).collect())
    }

    #[test]
    fn chunks_keep_their_limits_by_brute_force() {
        for seed in 0..20 {
            let cells = 70;
            let (items, neighbours) = row(cells, seed);
            let limits = Limits { most: 40_000, ..LIMITS };
            let made = chunks(&items, &neighbours, limits);
            let mut all: Vec<u32> = made.concat();
            all.sort_unstable();
            assert!(all.iter().copied().eq(0..items.len() as u32), "each item once");
            assert!(made.len() * 3 < items.len() * 2, "{} chunks of {} items", made.len(), items.len());
            let sees = |cell: usize, item: u32| items[item as usize].column[cell / 64] >> (cell % 64) & 1 == 1;
            let weight = |list: &mut dyn Iterator<Item = u32>| list.map(|item| items[item as usize].weight).sum::<u64>();
            let (mut extra, mut asked) = (vec![0; cells], vec![0; cells]);
            for chunk in &made {
                let own = weight(&mut chunk.iter().copied());
                assert!(own <= limits.most || chunk.len() == 1);
                let (mut fetched, mut wasted) = (0, 0);
                for cell in (0..cells).filter(|&cell| chunk.iter().any(|&item| sees(cell, item))) {
                    let unseen = weight(&mut chunk.iter().copied().filter(|&item| !sees(cell, item)));
                    (fetched, wasted) = (fetched + own + limits.fixed, wasted + unseen);
                    (extra[cell], asked[cell]) = (extra[cell] + unseen, asked[cell] + own - unseen + limits.fixed);
                }
                assert!(wasted as f64 <= limits.waste * fetched as f64, "seed {seed}: {wasted} of {fetched}");
            }
            for cell in 0..cells {
                assert!(extra[cell] as f64 <= limits.cell_waste * asked[cell] as f64, "seed {seed}, cell {cell}");
            }
        }
    }

    #[test]
    fn equal_columns_are_one_chunk_up_to_its_size_and_strangers_are_not() {
        let item = |column: u64, weight| Item { column: vec![column], weight, home: Some(0) };
        let neighbours = vec![Vec::new(); 4];
        // Nobody sees the last one.
        let items = [item(0b11, 90_000), item(0b1100, 90_000), item(0b11, 90_000), item(0b1100, 9), item(0, 9)];
        assert_eq!(chunks(&items, &neighbours, LIMITS), [vec![0, 2], vec![1, 3], vec![4]]);
        assert_eq!(chunks(&items, &neighbours, Limits { most: 100_000, ..LIMITS }), [vec![0], vec![1, 3], vec![2], vec![4]]);
        // A hundredth of what the second cell needs.
        let items = [item(0b11, 100_000), item(0b01, 1_000)];
        assert_eq!(chunks(&items, &neighbours, LIMITS), [vec![0, 1]]);
        assert_eq!(chunks(&items, &neighbours, Limits { cell_waste: 0.005, ..LIMITS }), [vec![0], vec![1]]);
    }
}
