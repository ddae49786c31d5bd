//! Chunks: items that the same cells need, or nearly the same, so that few requests bring little too much.
//!
//! Items with equal columns begin as one cluster. Then, in rounds, pairs of clusters in one cell or behind one of its portals are joined, those
//! first that bring the fewest bytes too much for each request that they save, until cells get as much too much as they may in the mean.
//! Agglomeration by column is the field's (van de Panne and Stewart, *Effective compression techniques for precomputed visibility*, 1999); the
//! limits in bytes are our own. A cluster is compared with a limited number of those whose columns have about as many cells, so a round takes time
//! in proportion to the clusters.

use crate::columns::{Item, both, common, count, without};
use enfilade::math::bits::ones;
use rayon::prelude::*;
use std::collections::HashMap;

/// Limits of chunks.
#[derive(Clone, Copy)]
pub(crate) struct Limits {
    /// Share of what a cell asks for that comes on top of it, in the mean of all cells. More: a step into a room brings what is elsewhere. Less:
    /// small objects are a request each, and the line is idle between them.
    pub(crate) waste: f64,
    /// Bytes of a chunk. More: the first object of a chunk comes late. Less: more requests.
    pub(crate) most: u64,
}

/// Those of chunks of objects.
pub(crate) const OBJECTS: Limits = Limits { waste: 0.12, most: 1 << 18 };
/// Those of files of shared meshes: what both bring too much adds up.
pub(crate) const MESHES: Limits = Limits { waste: 0.03, ..OBJECTS };
/// As [`Limits::waste`], for each cell; and bytes that are little for any. More: a niche loads the hall that it looks into. Less: for one niche, all
/// that it sees a part of stays in pieces.
const CELL_WASTE: f64 = 0.4;
const LITTLE: u64 = 2048;
/// About the bytes of a chunk besides its items.
pub(crate) const FIXED: u64 = 450;
/// Bytes too much for a request that is saved: pairs of up to the first price are joined first, then those of up to twice as much, and so on. A
/// request is worth no more than the last: 4 kB take 0.7 ms at 50 Mbit/s. Less at first: more rounds. More: dear pairs are taken before cheap ones
/// that only arise from others.
const PRICES: [f64; 2] = [32.0, 4096.0];

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
    /// Ascending.
    items: Vec<u32>,
    /// The cells that its items are in, ascending.
    homes: Vec<usize>,
}

/// Divides items into chunks, each ascending, in the order of their first items. `asked`: for each cell the bytes of all that it needs, items or
/// not.
pub(crate) fn chunks(items: &[Item], neighbours: &[Vec<usize>], asked: &[u64], limits: Limits) -> Vec<Vec<u32>> {
    let mut clusters = equal_columns(items);
    let mut cells = Cells::of(&clusters, asked, limits.waste);
    let [mut price, last] = PRICES;
    while price <= last {
        let pairs = candidates(&clusters, neighbours, limits.most, price);
        if !join(&mut clusters, &pairs, &mut cells) {
            price *= 2.0;
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
        cluster.items.push(number as u32);
        cluster.homes.extend(item.home);
    }
    for cluster in &mut clusters {
        cluster.homes.sort_unstable();
        cluster.homes.dedup();
    }
    clusters
}

/// Pairs of clusters of at most so many bytes together, best first: their [`score`], up to a price, and the two clusters.
fn candidates(clusters: &[Cluster], neighbours: &[Vec<usize>], most: u64, price: f64) -> Vec<(f64, u32, u32)> {
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
            let [one, other] = [a, b].map(|cluster| &clusters[cluster as usize]);
            let score = (one.weight + other.weight <= most).then(|| score(one, other))?;
            (score <= price).then_some((score, a.min(b), a.max(b)))
        };
        others.into_iter().filter_map(pair).collect::<Vec<_>>()
    };
    let mut pairs: Vec<(f64, u32, u32)> = (0..clusters.len() as u32).into_par_iter().flat_map_iter(of).collect();
    pairs.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    pairs
}

/// Bytes that are fetched too much, over all cells, per request that is saved; infinite where none is.
fn score(a: &Cluster, b: &Cluster) -> f64 {
    let saved = common(&a.column, &b.column);
    if saved == 0 {
        return f64::INFINITY;
    }
    ((a.cells - saved) * b.weight + (b.cells - saved) * a.weight) as f64 / saved as f64
}

/// Joins pairs in order, each cluster once, while no cell gets too much. Returns whether there was one. A joined cluster leaves an empty one
/// behind.
fn join(clusters: &mut [Cluster], pairs: &[(f64, u32, u32)], cells: &mut Cells<'_>) -> bool {
    let mut is_joined = vec![false; clusters.len()];
    let mut any = false;
    for &(_, a, b) in pairs {
        let [a, b] = [a as usize, b as usize];
        if is_joined[a] || is_joined[b] || !cells.take(&clusters[a], &clusters[b]) {
            continue;
        }
        let second = std::mem::take(&mut clusters[b]);
        clusters[a].take_in(second);
        (is_joined[a], is_joined[b], any) = (true, true, true);
    }
    any
}

/// What each cell fetches.
struct Cells<'a> {
    /// Bytes that it needs.
    needed: &'a [u64],
    /// Bytes of items that it doesn't need.
    extra: Vec<u64>,
    /// Number of clusters.
    clusters: Vec<u64>,
    /// The sum over cells of what comes on top, as a share of what they ask for.
    shares: f64,
    most: f64,
}

impl<'a> Cells<'a> {
    fn of(clusters: &[Cluster], needed: &'a [u64], waste: f64) -> Self {
        let cells = needed.len();
        let mut all =
            Self { needed, extra: vec![0; cells], clusters: vec![0; cells], shares: 0.0, most: waste * cells as f64 };
        clusters.iter().for_each(|cluster| ones(&cluster.column).for_each(|cell| all.clusters[cell] += 1));
        all
    }

    /// What comes on top of what a cell asks for with so many clusters.
    fn share(&self, cell: usize, extra: u64, clusters: u64) -> f64 {
        extra as f64 / (self.needed[cell] + FIXED * clusters).max(1) as f64
    }

    /// Counts two clusters as one, unless a cell or all of them would get too much.
    fn take(&mut self, a: &Cluster, b: &Cluster) -> bool {
        let of_one = without(&a.column, &b.column).map(|cell| (cell, b.weight, 0));
        let of_other = without(&b.column, &a.column).map(|cell| (cell, a.weight, 0));
        let changes: Vec<(usize, u64, u64)> =
            of_one.chain(of_other).chain(both(&a.column, &b.column).map(|cell| (cell, 0, 1))).collect();
        let after = |&(cell, more, fewer): &(usize, u64, u64)| {
            let (extra, clusters) = (self.extra[cell] + more, self.clusters[cell] - fewer);
            (cell, extra, clusters, self.share(cell, extra, clusters))
        };
        let before = |&(cell, ..): &(usize, u64, u64)| self.share(cell, self.extra[cell], self.clusters[cell]);
        let shares = self.shares + changes.iter().map(|change| after(change).3 - before(change)).sum::<f64>();
        let is_too_much = |change| {
            let (_, extra, _, share) = after(change);
            extra > LITTLE && share > CELL_WASTE
        };
        if shares > self.most || changes.iter().any(is_too_much) {
            return false;
        }
        self.shares = shares;
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
    use crate::columns::needs;

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
            let limits = Limits { most: 40_000, ..OBJECTS };
            let made = chunks(&items, &neighbours, &needs(&items, cells), limits);
            let mut all: Vec<u32> = made.concat();
            all.sort_unstable();
            assert!(all.iter().copied().eq(0..items.len() as u32), "each item once");
            assert!(made.len() * 3 < items.len() * 2, "{} chunks of {} items", made.len(), items.len());
            let sees = |cell: usize, item: u32| items[item as usize].column[cell / 64] >> (cell % 64) & 1 == 1;
            let weight = |list: &mut dyn Iterator<Item = u32>| list.map(|item| items[item as usize].weight).sum::<u64>();
            for chunk in &made {
                assert!(weight(&mut chunk.iter().copied()) <= limits.most || chunk.len() == 1);
            }
            let mut shares = 0.0;
            for cell in 0..cells {
                let fetched: Vec<&Vec<u32>> =
                    made.iter().filter(|chunk| chunk.iter().any(|&item| sees(cell, item))).collect();
                let asked = weight(&mut (0..items.len() as u32).filter(|&item| sees(cell, item)));
                let extra = weight(&mut fetched.iter().copied().flatten().copied()) - asked;
                let share = extra as f64 / (asked + FIXED * fetched.len() as u64) as f64;
                assert!(extra <= LITTLE || share <= CELL_WASTE, "seed {seed}, cell {cell}: {extra} on {asked}");
                shares += share;
            }
            assert!(shares <= limits.waste * cells as f64, "seed {seed}: {shares}");
        }
    }

    #[test]
    fn equal_columns_are_one_chunk_up_to_its_size_and_strangers_are_not() {
        let item = |column: u64, weight| Item { column: vec![column], weight, home: Some(0) };
        let neighbours = vec![Vec::new(); 4];
        let chunks = |items: &[Item], limits| chunks(items, &neighbours, &needs(items, 4), limits);
        // Nobody sees the last one.
        let items = [item(0b11, 90_000), item(0b1100, 90_000), item(0b11, 90_000), item(0b1100, 9), item(0, 9)];
        assert_eq!(chunks(&items, OBJECTS), [vec![0, 2], vec![1, 3], vec![4]]);
        assert_eq!(chunks(&items, Limits { most: 100_000, ..OBJECTS }), [vec![0], vec![1, 3], vec![2], vec![4]]);
        // A hundredth of what the second cell needs.
        let items = [item(0b11, 100_000), item(0b01, 1_000)];
        assert_eq!(chunks(&items, OBJECTS), [vec![0, 1]]);
        assert_eq!(chunks(&items, Limits { waste: 0.001, ..OBJECTS }), [vec![0], vec![1]]);
    }

    /// A cell that also asks for much else takes more on top.
    #[test]
    fn what_a_cell_asks_for_besides_counts() {
        let items =
            [(0b11, 1_000), (0b01, 500)].map(|(column, weight)| Item { column: vec![column], weight, home: Some(0) });
        let neighbours = vec![Vec::new(); 2];
        assert_eq!(chunks(&items, &neighbours, &[1_500, 1_000], OBJECTS), [vec![0], vec![1]]);
        assert_eq!(chunks(&items, &neighbours, &[1_500, 10_000], OBJECTS), [vec![0, 1]]);
    }
}
