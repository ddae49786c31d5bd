//! Disjoint sets, by path halving (Tarjan, van Leeuwen, *Worst-case analysis of set union algorithms*, 1984).

/// Disjoint sets; the lowest number represents a set.
pub struct DisjointSets {
    parent: Vec<u32>,
}

impl DisjointSets {
    /// Each element in a set of its own.
    pub fn new(n: usize) -> Self {
        Self { parent: (0..n as u32).collect() }
    }

    /// The representative of the set of `i`.
    pub fn find(&mut self, mut i: u32) -> u32 {
        while self.parent[i as usize] != i {
            self.parent[i as usize] = self.parent[self.parent[i as usize] as usize];
            i = self.parent[i as usize];
        }
        i
    }

    /// Joins two sets.
    pub fn join(&mut self, a: u32, b: u32) -> u32 {
        let (a, b) = (self.find(a), self.find(b));
        self.parent[a.max(b) as usize] = a.min(b);
        a.min(b)
    }
}
