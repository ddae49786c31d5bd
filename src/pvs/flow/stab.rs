//! Stabbing test: whether a line passes a chain of windows, for chains that would decide a goal.
//!
//! Based on: the branch and bound of *two-sided flow* as measured for this project, on the windows of Teller, *Visibility computations in
//! densely occluded polyhedral environments*, 1992. The search narrows only the source and the last window of a chain, and so passes some
//! chains without a stabbing line. Here all windows are narrowed by all others, forwards and backwards; then the larger end is halved,
//! until every half is refuted, a line is found, or the pieces run out. The upper bound relies only on refutations; the caller may check a
//! line and keep it as a witness.

use super::separators::{Cut, Separators, Way};
use super::window::{Slack, Window};
use crate::math::geom::Plane;
use glam::DVec3;
use pulp::Simd;

/// Most pieces of one chain; with more it counts as passable. Larger: rare wrong chains cost more.
const PIECES: u32 = 24;

/// Least length of a window that is halved, in [`Slack::strict`].
const SMALLEST: f64 = 1024.0;

/// Passes of the search for a line, from alternating ends.
const TURNS: usize = 4;

/// The result.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum Passage {
    /// No line passes.
    Refuted,
    /// The line through these two points passes, and the caller accepted it.
    Line([DVec3; 2]),
    /// Unknown: counts as passable.
    Unknown,
}

/// Scratch memory.
#[derive(Default)]
pub(crate) struct Stab {
    pieces: Vec<Vec<Window>>,
    spare: Window,
    aim: Window,
}

/// The inputs of a test.
pub(crate) struct Question<'a> {
    /// Tolerances.
    pub slack: &'a Slack,
    /// Makes planes.
    pub separators: &'a mut Separators,
    /// Accepts or rejects a line, given by two points.
    pub accept: &'a mut dyn FnMut([DVec3; 2]) -> bool,
}

impl Stab {
    /// Tests whether a line passes the windows in order. Adds the work to `steps`.
    #[inline(always)]
    pub fn ask<S: Simd>(
        &mut self,
        simd: S,
        windows: impl Iterator<Item = Window>,
        question: &mut Question<'_>,
        steps: &mut u64,
    ) -> Passage {
        let windows: Vec<Window> = windows.collect();
        if windows.iter().any(|w| !w.flat) {
            return Passage::Unknown;
        }
        if let Some(line) = self.line(&windows, question) {
            return Passage::Line(line);
        }
        if windows.len() < 3 {
            return Passage::Unknown;
        }
        let slack = question.slack;
        self.pieces.clear();
        self.pieces.push(windows);
        let mut left = PIECES;
        while let Some(mut piece) = self.pieces.pop() {
            *steps += piece.len() as u64;
            if !self.narrow(simd, &mut piece, question) {
                continue;
            }
            if left == 0 {
                return Passage::Unknown;
            }
            if let Some(line) = self.line(&piece, question) {
                return Passage::Line(line);
            }
            left -= 1;
            let last = piece.len() - 1;
            let (first_length, last_length) = (longest(&piece[0]), longest(&piece[last]));
            let (end, [a, b]) =
                if distance(first_length) >= distance(last_length) { (0, first_length) } else { (last, last_length) };
            let (true, Some(along)) = (a.distance(b) > SMALLEST * slack.strict, (b - a).try_normalize()) else {
                return Passage::Unknown; // too small to halve without losing lines to rounding
            };
            let half = Plane::through(a.midpoint(b), along);
            for plane in [half, half.flipped()] {
                let mut part = piece.clone();
                if part[end].cut(&plane, slack, &mut self.spare) {
                    self.pieces.push(part);
                }
            }
        }
        Passage::Refuted
    }

    /// Narrows every window by the planes of those on both sides: backwards first, because the search has narrowed forwards. False if a
    /// window has no line left.
    #[inline(always)]
    fn narrow<S: Simd>(&mut self, simd: S, windows: &mut [Window], question: &mut Question<'_>) -> bool {
        let last = windows.len() - 1;
        let backwards = (0..=last - 2).rev().map(|k| ([last, k + 1, k], Way::Against));
        // A loop: a cut within a closure would not be compiled for the registers.
        for (three, way) in backwards.chain((2..=last).map(|k| ([0, k - 1, k], Way::Along))) {
            if !self.cut(simd, windows, three, way, question) {
                return false;
            }
        }
        true
    }

    /// Clips window `k` by the planes of two others that a line passes in this order before it (or after it).
    #[inline(always)]
    fn cut<S: Simd>(
        &mut self,
        simd: S,
        windows: &mut [Window],
        [first, second, k]: [usize; 3],
        way: Way,
        question: &mut Question<'_>,
    ) -> bool {
        let mut window = std::mem::take(&mut windows[k]);
        let mut cut = Cut { window: &mut window, passes: true, slack: question.slack, spare: &mut self.spare };
        question.separators.each(simd, [&windows[first], &windows[second]], way, &mut cut);
        let passes = cut.passes;
        windows[k] = window;
        passes
    }

    /// Searches for a line: from the centre of one end through all windows to the other end, and back from the rest.
    fn line(&mut self, windows: &[Window], question: &mut Question<'_>) -> Option<[DVec3; 2]> {
        let last = windows.len() - 1;
        let mut aim = std::mem::take(&mut self.aim);
        let mut eye = windows[0].middle();
        let mut found = None;
        for turn in 0..TURNS {
            let forwards = turn % 2 == 0;
            aim.assign(&windows[if forwards { last } else { 0 }]);
            let seen = (1..last)
                .all(|k| self.keep_seen(&mut aim, eye, &windows[if forwards { k } else { last - k }], question.slack));
            let to = aim.middle(); // of the last non-empty view
            let line = if forwards { [eye, to] } else { [to, eye] };
            if seen && (question.accept)(line) {
                found = Some(line);
                break;
            }
            eye = to;
        }
        self.aim = aim;
        found
    }

    /// Clips `aim` to the view from `eye` through a window. False if that is empty.
    fn keep_seen(&mut self, aim: &mut Window, eye: DVec3, window: &Window, slack: &Slack) -> bool {
        let centre = window.middle();
        let mut a = window.corner(window.len() - 1);
        (0..window.len()).all(|i| {
            let b = window.corner(i);
            let normal = (a - eye).cross(b - eye).try_normalize();
            a = b;
            let Some(mut n) = normal else { return true };
            if n.dot(centre - eye) > 0.0 {
                n = -n;
            }
            aim.cut(&Plane::through(eye, n), slack, &mut self.spare)
        })
    }
}

/// The two most distant corners.
fn longest(window: &Window) -> [DVec3; 2] {
    let n = window.len();
    let pairs = (0..n).flat_map(|i| (i..n).map(move |k| [window.corner(i), window.corner(k)]));
    pairs.max_by(|a, b| distance(*a).total_cmp(&distance(*b))).unwrap_or_default()
}

fn distance([a, b]: [DVec3; 2]) -> f64 {
    a.distance_squared(b)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SLACK: Slack = Slack { reach: 1e-14, strict: 1e-13, coplanar: 1e-6 };

    /// A window in the plane at `x`.
    fn window(x: f64, y: [f64; 2], z: [f64; 2]) -> Window {
        Window::new(&[(0, 0), (1, 0), (1, 1), (0, 1)].map(|(i, k)| DVec3::new(x, y[i], z[k])), DVec3::X, true)
    }

    fn may_pass(windows: &[Window]) -> (bool, u64) {
        let mut steps = 0;
        let mut question = Question { slack: &SLACK, separators: &mut Separators::new(1e-15), accept: &mut |_| true };
        (
            Stab::default().ask(pulp::Scalar::new(), windows.iter().cloned(), &mut question, &mut steps) != Passage::Refuted,
            steps,
        )
    }

    #[test]
    fn a_chain_is_refuted_where_no_line_passes_and_only_there() {
        let third = |low: f64| {
            [window(0., [0., 1.], [0., 0.1]), window(1., [0., 1.], [1., 1.1]), window(2., [0., 1.], [low, low + 0.1])]
        };
        assert!(may_pass(&third(2.0)).0 && may_pass(&third(2.1999)).0 && may_pass(&third(1.8001)).0);
        assert!(!may_pass(&third(2.2001)).0 && !may_pass(&third(1.7999)).0);
    }

    #[test]
    fn a_plain_view_takes_no_steps_and_unknown_windows_pass() {
        let row: Vec<Window> = (0..50).map(|x| window(f64::from(x), [0., 1.], [0., 1.])).collect();
        assert_eq!(may_pass(&row), (true, 0));
        let mut odd = [window(0., [0., 1.], [0., 1.]), window(1., [5., 6.], [0., 1.]), window(2., [0., 1.], [0., 1.])];
        assert!(!may_pass(&odd).0);
        odd[1].flat = false;
        assert!(may_pass(&odd).0);
    }

    #[test]
    fn windows_as_small_as_rounding_are_never_refuted_by_halving() {
        let tiny = |x: f64, z: f64| window(x, [0., 1e-13], [z, z + 1e-13]);
        assert!(may_pass(&[tiny(0., 0.), tiny(1., 0.), tiny(2., 0.)]).0);
        assert!(may_pass(&[tiny(0., 0.), tiny(0., 0.), tiny(0., 0.)]).0, "one on the other");
    }
}
