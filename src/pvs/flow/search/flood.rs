//! The flood through portals inside the planes of a frame.

use super::{FEW, Search};
use crate::pvs::flow::might_see::set;

impl Search<'_> {
    /// Chooses the portals that the flood from `target` may look at: those that it and the frame at `depth` may reach; and if few goals are
    /// left, which begin at `start`, only those that lead to one.
    #[inline(always)]
    pub(super) fn allow(&mut self, depth: usize, target: usize, start: usize) {
        self.allowed.clear();
        let row = self.might_see.row(target);
        for (a, b) in self.frames[depth].live.iter().zip(row) {
            self.allowed.push(a & b);
        }
        if self.goals.len() - start <= FEW {
            // What leads to none of the goals that are left is no part of the way to them.
            self.leads.clear();
            self.leads.resize(row.len(), 0);
            for &goal in &self.goals[start..] {
                set(&mut self.leads, goal as usize);
                for (a, b) in self.leads.iter_mut().zip(self.might_see.before(goal as usize)) {
                    *a |= b;
                }
            }
            for (a, b) in self.allowed.iter_mut().zip(&self.leads) {
                *a &= b;
            }
        }
    }

    /// Floods inside the planes of the frame above `depth`. Gives the number of looks.
    #[inline(always)]
    pub(super) fn flood(&mut self, depth: usize, target: usize) -> usize {
        let net = self.net;
        let (below, above) = self.frames.split_at_mut(depth + 1);
        let (frame, child) = (&below[depth], &mut above[0]);
        child.live.clear();
        child.live.resize(frame.live.len(), 0);
        let mut looks = 0;
        self.queue.push(target as u32);
        while let Some(last) = self.queue.pop() {
            for &(word, mask) in net.next(last as usize) {
                let word = word as usize;
                let mut ways = self.allowed[word] & mask;
                self.allowed[word] &= !mask; // once is enough
                while ways != 0 {
                    let p = word * 64 + ways.trailing_zeros() as usize;
                    ways &= ways - 1;
                    looks += 1;
                    if !child.bundle.cuts_off(net.bounds(p), net.window(p)) {
                        set(&mut child.live, p);
                        self.queue.push(p as u32);
                    }
                }
            }
        }
        looks
    }
}
