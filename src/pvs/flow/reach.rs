//! Reach: the portals that lines through one portal can reach, by narrowing windows.
//!
//! Based on: separating planes of portal flow (`separators`). Deviation: chains, of which there may be exponentially many, are not followed
//! one by one. A portal keeps at most a few windows, and beyond that counts as entirely open. So each portal is visited a few times for
//! each source, and the cost is proportional to the reachable portals, not to all.

use super::bundle::Bundle;
use super::net::Net;
use super::separators::{Separators, Way};
use super::window::Window;
use crate::math::geom::Plane;
use crate::math::simd::dispatch;
use pulp::Simd;
use std::collections::VecDeque;

/// Most windows of a portal; with more, it counts as entirely open. Fewer: more is reached. More: portals are visited more often.
const WINDOWS: usize = 3;

/// The windows by which a portal was reached.
#[derive(Clone, Copy, Default)]
struct Arrival {
    /// The source; entries of other sources are invalid.
    source: u32,
    /// Whether it counts as entirely open.
    whole: bool,
    /// Windows, by number.
    windows: [u32; WINDOWS],
    count: usize,
}

/// Scratch memory.
pub(super) struct Reach<'n> {
    net: &'n Net,
    separators: Separators,
    planes: Vec<Plane>,
    bundle: Bundle,
    source: Window,
    part: Window,
    spare: Window,
    come: Vec<Arrival>,
    sources: u32,
    /// Windows of this source; those from `used` on are free.
    windows: Vec<Window>,
    used: usize,
    /// Portals with windows to follow.
    queue: VecDeque<(u32, u32)>,
}

/// A search, compiled for several register widths.
struct Run<'r, 'n> {
    reach: &'r mut Reach<'n>,
    first: usize,
    most: usize,
    found: &'r mut Vec<u32>,
}

impl pulp::WithSimd for Run<'_, '_> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> bool {
        self.reach.follow(simd, self.first, self.most, self.found)
    }
}

impl<'n> Reach<'n> {
    pub fn new(net: &'n Net) -> Self {
        let (planes, bundle, source, part, spare, windows, queue) = Default::default();
        let (separators, come) = (Separators::new(net.rounding), vec![Arrival::default(); net.portals()]);
        Self { net, separators, planes, bundle, source, part, spare, come, sources: 0, windows, used: 0, queue }
    }

    /// Sets `found` to the portals that lines through `first` may cross later, in the order of discovery. False if that takes more than
    /// `most` visits: then `found` is invalid.
    pub fn from(&mut self, first: usize, most: usize, found: &mut Vec<u32>) -> bool {
        dispatch(Run { reach: self, first, most, found })
    }

    #[inline(always)]
    fn follow<S: Simd>(&mut self, simd: S, first: usize, most: usize, found: &mut Vec<u32>) -> bool {
        let net = self.net;
        found.clear();
        self.sources += 1;
        self.used = 0;
        self.queue.clear();
        for q in next(net, first) {
            self.part.assign(net.window(q));
            if self.cut_by(&[net.front(first, q)]) {
                self.arrive(first, q, found);
            }
        }
        for _ in 0..most {
            let Some((p, window)) = self.queue.pop_front() else { return true };
            let p = p as usize;
            self.source.assign(net.window(first));
            if net.behind(first, p).is_some_and(|plane| !self.source.cut(&plane, &net.slack, &mut self.spare)) {
                continue;
            }
            self.planes.clear();
            self.separators.list_all(simd, [&self.source, &self.windows[window as usize]], Way::Along, &mut self.planes);
            self.bundle.assign(&self.planes);
            for q in next(net, p) {
                let is_open = self.come[q].source == self.sources && self.come[q].whole;
                if is_open || !net.may_follow(first, q) {
                    continue;
                }
                self.part.assign(net.window(q));
                if self.cut_by(&[net.front(first, q), net.front(p, q)])
                    && self.bundle.cut(&mut self.part, net.bounds(q), &net.slack, &mut self.spare)
                {
                    self.arrive(first, q, found);
                }
            }
        }
        false
    }

    /// Clips the current window; false if no line is left.
    fn cut_by(&mut self, planes: &[Option<Plane>]) -> bool {
        planes.iter().flatten().all(|plane| self.part.cut(plane, &self.net.slack, &mut self.spare))
    }

    /// Lines reach the current window, of portal `q`.
    fn arrive(&mut self, first: usize, q: usize, found: &mut Vec<u32>) {
        let net = self.net;
        let come = &mut self.come[q];
        if come.source != self.sources {
            *come = Arrival { source: self.sources, ..Arrival::default() };
            found.push(q as u32);
        }
        let known = &come.windows[..come.count];
        if come.whole || known.iter().any(|&w| self.windows[w as usize].holds(&self.part)) {
            return;
        }
        if come.count == WINDOWS {
            come.whole = true;
            self.part.assign(net.window(q));
            if let Some(plane) = net.front(first, q)
                && !self.part.cut(&plane, &net.slack, &mut self.spare)
            {
                return;
            }
        }
        if self.used == self.windows.len() {
            self.windows.push(Window::default());
        }
        self.windows[self.used].assign(&self.part);
        if !come.whole {
            come.windows[come.count] = self.used as u32;
            come.count += 1;
        }
        self.queue.push_back((q as u32, self.used as u32));
        self.used += 1;
    }
}

/// Portals that may directly follow a portal.
fn next(net: &Net, portal: usize) -> impl Iterator<Item = usize> + '_ {
    net.next(portal).iter().flat_map(|&(word, mask)| {
        let left = std::iter::successors(Some(mask), |m| (*m != 0).then(|| m & (m - 1))).take_while(|&m| m != 0);
        left.map(move |m| word as usize * 64 + m.trailing_zeros() as usize)
    })
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::CellId;
    use crate::cells::{Portal, PortalKind, PortalState};
    use crate::math::geom::Plane;
    use crate::pvs::flow::net::NetPortal;
    use glam::DVec3;

    /// Deterministic numbers in `0..1`.
    pub struct Numbers(pub u64);

    impl Numbers {
        pub fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (self.0 >> 33) as f64 / (1u64 << 31) as f64
        }
    }

    const SIDE: usize = 7;

    /// Rooms of a metre in a square of `side`, with a rectangular hole in some of the walls between them.
    pub fn rooms(numbers: &mut Numbers, side: usize) -> Vec<Portal> {
        let mut portals = Vec::new();
        for axis in 0..2 {
            for cell in 0..side * side {
                let at = [cell % side, cell / side];
                if at[axis] + 1 == side || numbers.next() < 0.2 {
                    continue;
                }
                let (n, along) = if axis == 0 { (DVec3::X, DVec3::Y) } else { (DVec3::Y, -DVec3::X) };
                let corner =
                    DVec3::new(at[0] as f64, at[1] as f64, 0.0) + n + if axis == 0 { DVec3::ZERO } else { DVec3::X };
                let (width, height) = (0.1 + 0.8 * numbers.next(), 0.1 + 0.8 * numbers.next());
                let low = corner + along * ((1.0 - width) * numbers.next()) + DVec3::Z * ((1.0 - height) * numbers.next());
                let winding =
                    vec![low, low + along * width, low + along * width + DVec3::Z * height, low + DVec3::Z * height];
                let other = cell + if axis == 0 { 1 } else { side };
                portals.push(Portal {
                    cells: [CellId(cell as u32), CellId(other as u32)],
                    plane: Plane { n, d: n.dot(low) },
                    winding,
                    kind: PortalKind::Opening,
                    state: PortalState::of_kind(PortalKind::Opening),
                    source: None,
                });
            }
        }
        portals
    }

    /// Directed portals that a line from `from` crosses before it meets a wall.
    pub fn walk(net: &Net, side: usize, from: DVec3, direction: DVec3) -> Vec<usize> {
        let place = |p: DVec3| p.x.floor() as usize + side * p.y.floor() as usize;
        let (mut cell, mut crossed) = (place(from), Vec::new());
        loop {
            let hit = |&p: &usize| {
                let window = net.window(p);
                let plane = net.plane(p).expect("a flat portal");
                let speed = plane.n.dot(direction);
                let at = from - net.origin;
                let at = at - direction * (plane.distance(at) / speed);
                let edge = |i: usize| {
                    let a = window.corner(i);
                    window.normal.cross(window.corner((i + 1) % window.len()) - a).dot(at - a)
                };
                speed > 0.0 && (0..window.len()).all(|i| edge(i) > 1e-9)
            };
            let Some(next) = net.out(cell).find(hit) else { return crossed };
            crossed.push(next);
            cell = net.target[next] as usize;
        }
    }

    #[test]
    fn whatever_a_line_crosses_is_come_to_and_little_else() {
        let mut numbers = Numbers(7);
        let (mut lines, mut come, mut by_planes) = (0, 0, 0);
        for _ in 0..20 {
            let portals = rooms(&mut numbers, SIDE);
            let portals: Vec<NetPortal<'_>> = portals.iter().map(NetPortal::from).collect();
            let net = Net::new(SIDE * SIDE, &portals, 1e-6);
            let n = net.portals();
            let mut reach = Reach::new(&net);
            let mut rows = vec![Vec::new(); n];
            for (first, row) in rows.iter_mut().enumerate() {
                assert!(reach.from(first, usize::MAX, row));
                assert!(!reach.from(first, 0, &mut Vec::new()), "no look, no answer");
            }
            for _ in 0..2000 {
                let from = DVec3::new(numbers.next() * SIDE as f64, numbers.next() * SIDE as f64, numbers.next());
                let turn = std::f64::consts::TAU * numbers.next();
                let direction = DVec3::new(turn.cos(), turn.sin(), 0.1 * (numbers.next() - 0.5));
                let crossed = walk(&net, SIDE, from, direction);
                for (i, &a) in crossed.iter().enumerate() {
                    for &b in &crossed[i + 1..] {
                        lines += 1;
                        assert!(rows[a].contains(&(b as u32)), "a line crosses {a} and {b}");
                    }
                }
            }
            come += rows.iter().map(|row| row.len() as u64).sum::<u64>();
            by_planes += (0..n * n).filter(|&k| net.may_follow(k / n, k % n)).count() as u64;
        }
        assert!(lines > 1000, "{lines} pairs crossed");
        assert!(2 * come < by_planes, "{come} of {by_planes}");
    }

    #[test]
    fn a_window_holds_what_lies_in_it() {
        let square = |low: f64, high: f64| {
            let corners = [(low, low), (high, low), (high, high), (low, high)].map(|(x, y)| DVec3::new(x, y, 2.0));
            Window::new(&corners, DVec3::Z, true)
        };
        let segment = Window::new(&[DVec3::new(0.0, 0.5, 2.0), DVec3::new(1.0, 0.5, 2.0)], DVec3::Z, true);
        let nothing = Window::default();
        assert!(square(0.0, 1.0).holds(&square(0.25, 1.0)) && square(0.0, 1.0).holds(&segment));
        assert!(!square(0.25, 1.0).holds(&square(0.0, 1.0)) && !square(0.25, 1.0).holds(&segment));
        assert!(!segment.holds(&square(0.0, 1.0)) && segment.holds(&segment));
        assert!(!Window::new(&[DVec3::new(0.2, 0.5, 2.0), DVec3::new(1.0, 0.5, 2.0)], DVec3::Z, true).holds(&segment));
        assert!(nothing.holds(&segment) && !segment.holds(&nothing));
    }
}
