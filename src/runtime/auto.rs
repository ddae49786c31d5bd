//! The method that costs the least, cell by cell, as frames turn out.
//!
//! What culling saves depends on the scene, on the place in it and on the machine, so nothing is taken for granted here: the caller says what
//! each frame cost, and the least dear method that is known in the eye's cell is taken. Now and then another is tried, if it may be worth
//! it. Of the methods that ask nothing it is known beforehand what they would draw: one that would draw much more isn't tried, so no
//! frame is much dearer than the others for the sake of finding out. The first frame is by a method that asks, if one may be chosen: in a
//! sparse scene it takes a sixth longer than the frustum, in a dense one a tenth of its time. What trials cost beyond the best stays within
//! [`SHARE`] of all that was spent, plus one trial.
//!
//! Every method's picture is the same. Which one is taken depends on the clock, so the sets may differ from run to run.

use super::{FrameMode, Mode};
use crate::CellId;

/// Of what frames cost, what trials may cost beyond it. Higher: changes are found sooner. Lower: they cost less.
const SHARE: f64 = 0.01;
/// What is expected to be so many times as dear as the best isn't tried. Higher: single frames take long. Lower: a wrong guess keeps the
/// better method out.
const DEAREST: f64 = 2.0;
/// Frames of a trial of a method that asks: in the first it knows nothing, in the second what it learned from that; the next counts.
const WARM_UP: u32 = 2;
/// Frames in a cell until a method that lost is thought of again there, at first and at most; doubled each time.
const WAITS: [u32; 2] = [16, 256];
/// Of a new cost, what moves the estimate. Higher: one slow frame changes the method. Lower: changes of the scene are seen late.
const WEIGHT: f64 = 0.25;
/// A method is left for one that won so many trials in a row, or one where it cost less than this share. Frames of one method differ by more
/// than methods do. More: gains come later. Fewer: a quick frame of the wrong method is believed.
const WINS: u8 = 3;
const CLEARLY: f64 = 0.5;
/// A method has won that is known to cost this share of the other. Higher: back and forth between equals. Lower: gains are left.
const BETTER: f64 = 0.98;
/// The same of one that asks, against one that doesn't. Higher: a sparse scene pays where frames differ by chance. Lower: gains are left.
const BETTER_ASKED: f64 = 0.85;
/// All methods: those that ask; then the others, of which one draws no more than those behind it, but for portals and rows.
const METHODS: [FrameMode; 7] = [
    FrameMode::Chc,
    FrameMode::ChcPlus,
    FrameMode::Both,
    FrameMode::Portals,
    FrameMode::Pvs,
    FrameMode::Frustum,
    FrameMode::None,
];
/// What a method that asks is expected to cost before it was tried anywhere, in times of the best: worth a trial before others are.
const UNTRIED: f64 = 0.9;

/// What is known of a method in a cell.
#[derive(Clone, Copy, Debug, Default)]
struct Known {
    cost: Option<f64>,
    /// Of the cell's frames, the one from which on it may be tried.
    due: u32,
    wait: u32,
    /// Trials that it won, one after the other.
    wins: u8,
}

impl Known {
    /// Not in the next frames.
    fn leave(&mut self, frame: u32) {
        self.due = frame.saturating_add(WAITS[0]);
    }

    /// It lost, or would: not again soon.
    fn put_off(&mut self, frame: u32) {
        self.wins = 0;
        self.wait = (self.wait * 2).clamp(WAITS[0], WAITS[1]);
        self.due = frame.saturating_add(self.wait);
    }
}

/// What is known of a cell.
#[derive(Clone, Debug, Default)]
struct Place {
    known: [Known; METHODS.len()],
    frames: u32,
    current: usize,
}

/// Chooses methods; one for each camera.
#[derive(Clone, Debug)]
pub struct Auto {
    /// By cell; the last is outside of all.
    places: Vec<Place>,
    /// What a method costs in the mean over cells, the last ones most.
    means: [Option<f64>; METHODS.len()],
    /// Those that may be chosen.
    among: [bool; METHODS.len()],
    /// What trials may still cost.
    credit: f64,
    /// What a triangle costs, of methods that ask nothing and of those that ask: these draw fewer, and each dearer.
    per_triangle: [Option<f64>; 2],
    /// The frame under way, or the last one: where and how; for how many frames it has been that method.
    at: usize,
    method: usize,
    run: u32,
}

impl Auto {
    /// Chooses among these methods (one or more), of which nothing is known yet, in so many cells.
    pub fn new(cells: usize, methods: &[FrameMode]) -> Self {
        let among = METHODS.map(|m| methods.contains(&m));
        let current = among.iter().position(|&a| a).expect("a method to choose");
        let place = Place { current, ..Place::default() };
        let (means, places) = ([None; METHODS.len()], vec![place; cells + 1]);
        Self { places, means, among, credit: 0.0, per_triangle: [None; 2], at: 0, method: current, run: 0 }
    }

    /// The method for the next frame, with the eye in `home`, or in no cell. `triangles` says how many a method that asks nothing would draw
    /// in it; it is called for few frames.
    pub fn choose(&mut self, home: Option<CellId>, triangles: impl FnMut(Mode) -> u64) -> FrameMode {
        let at = home.map_or(self.places.len() - 1, CellId::index);
        // A trial goes on wherever the eye goes.
        let in_trial = self.run > 0 && self.method != self.places[self.at].current && !self.is_warm();
        if !in_trial {
            let next = self.next(at, triangles);
            self.run = if next == self.method { self.run } else { 0 };
            self.method = next;
        }
        self.at = at;
        METHODS[self.method]
    }

    /// What the frame cost that the last [`Self::choose`] was for, and the triangles that it drew. Costs are seconds, or in any unit that
    /// all frames have; 0 or more.
    pub fn learn(&mut self, cost: f64, triangles: u64) {
        self.credit += SHARE * cost;
        self.run = self.run.saturating_add(1);
        let warm = self.is_warm();
        if triangles > 0 && warm {
            average(&mut self.per_triangle[usize::from(METHODS[self.method].has_queries())], cost / triangles as f64);
        }
        if warm {
            average(&mut self.means[self.method], cost);
        }
        let place = &mut self.places[self.at];
        place.frames = place.frames.saturating_add(1);
        let best = place.known[place.current].cost;
        let asks_more = METHODS[self.method].has_queries() && !METHODS[place.current].has_queries();
        let known = &mut place.known[self.method];
        if self.method == place.current {
            if warm {
                average(&mut known.cost, cost);
            }
            return;
        }
        // 1. A trial is paid for.
        self.credit -= best.map_or(0.0, |best| (cost - best).max(0.0));
        if !warm {
            return;
        }
        // 2. It is judged by its last frame alone.
        known.cost = Some(cost);
        let better = if asks_more { BETTER_ASKED } else { BETTER };
        let won = best.filter(|best| cost < better * best);
        known.wins += u8::from(won.is_some());
        if won.is_some_and(|best| cost < CLEARLY * best || known.wins >= WINS) {
            // What was the best may be so again.
            place.known[place.current].put_off(place.frames);
            place.current = self.method;
            place.known[self.method].wait = 0;
            place.known[self.method].wins = 0;
        } else if won.is_none() {
            known.put_off(place.frames);
        }
    }

    /// Whether the last frame says what the method costs.
    fn is_warm(&self) -> bool {
        self.run > WARM_UP || !METHODS[self.method].has_queries()
    }

    fn next(&mut self, at: usize, mut triangles: impl FnMut(Mode) -> u64) -> usize {
        let warming_up = self.run > 0 && !self.is_warm();
        let place = &mut self.places[at];
        let best = place.known[place.current].cost;
        let is_settled = if best.is_some() { self.credit <= 0.0 } else { warming_up && self.method == place.current };
        if is_settled {
            return place.current;
        }
        // Where nothing is known yet, whatever is expected to be the best; later, a trial of what might be as good.
        let most = best.map_or(f64::INFINITY, |best| DEAREST * best);
        let per_triangle = self.per_triangle[0].or(self.per_triangle[1]);
        let plain = (0..METHODS.len()).filter(|&m| self.among[m]).find_map(|m| METHODS[m].without_queries());
        let mut least = None::<(f64, usize)>;
        // Of methods that ask nothing the first draws the fewest triangles, and one that draws more is dearer as well. To count them takes
        // as long as to cull: where nothing is known, the first is enough.
        let mut fewest = None;
        for m in (0..METHODS.len()).filter(|&m| self.among[m]) {
            let known = &mut place.known[m];
            if best.is_some() && (known.due > place.frames || m == place.current) {
                continue;
            }
            let expected = match METHODS[m].without_queries() {
                Some(_) if best.is_none() && fewest.is_some() => {
                    known.leave(place.frames);
                    continue;
                }
                Some(mode) => {
                    let fewest = *fewest.get_or_insert_with(|| triangles(plain.unwrap_or(mode)));
                    let drawn = if plain == Some(mode) { fewest } else { triangles(mode) };
                    if drawn > fewest {
                        known.leave(place.frames);
                        continue;
                    }
                    per_triangle.map(|each| each * drawn as f64)
                }
                None => known.cost.or(self.means[m]).or(best.map(|best| UNTRIED * best)),
            };
            match expected {
                Some(cost) if cost > most => known.put_off(place.frames),
                Some(cost) if least.is_none_or(|l| cost < l.0) => least = Some((cost, m)),
                _ => {}
            }
        }
        let next = least.map_or(place.current, |l| l.1);
        if best.is_none() {
            place.current = next;
        }
        next
    }
}

/// Moves an estimate towards a new value.
fn average(estimate: &mut Option<f64>, new: f64) {
    *estimate = Some(estimate.map_or(new, |old| old + WEIGHT * (new - old)));
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs frames of known costs, of 100 triangles each unit for the methods that ask nothing, of 80 for the others; returns what they
    /// cost in all, and the dearest.
    fn run(auto: &mut Auto, frames: usize, cost: impl Fn(usize, FrameMode) -> (Option<CellId>, f64)) -> (f64, f64) {
        let (mut sum, mut most) = (0.0, 0.0f64);
        for frame in 0..frames {
            let home = cost(frame, FrameMode::Chc).0;
            let method = auto.choose(home, |mode| (cost(frame, mode.into()).1 * 100.0) as u64);
            let spent = cost(frame, method).1;
            auto.learn(spent, (spent * if method.has_queries() { 80.0 } else { 100.0 }) as u64);
            sum += spent;
            most = most.max(spent);
        }
        (sum, most)
    }

    fn sparse(method: FrameMode) -> f64 {
        match method {
            FrameMode::None => 10.4,
            FrameMode::Frustum => 10.0,
            FrameMode::Chc => 11.7,
            FrameMode::ChcPlus => 11.2,
            _ => 10.1,
        }
    }

    fn dense(method: FrameMode) -> f64 {
        match method {
            FrameMode::None => 300.0,
            FrameMode::Chc => 10.0,
            FrameMode::ChcPlus => 10.5,
            _ => 140.0,
        }
    }

    #[test]
    fn a_sparse_scene_hardly_pays_and_a_dense_one_gains_nearly_all() {
        let frames = 3000;
        let (spent, most) = run(&mut Auto::new(0, &METHODS), frames, |_, method| (None, sparse(method)));
        assert!(spent <= 1.015 * 10.0 * frames as f64 && most < 12.0, "{spent}");
        let (spent, most) = run(&mut Auto::new(0, &METHODS), frames, |_, method| (None, dense(method)));
        assert!(spent <= 1.015 * 10.0 * frames as f64 && most == 10.5, "{spent}, at most {most}");
    }

    /// From -1 to 1.
    fn noise(frame: usize) -> f64 {
        let mixed = ((frame as u32).wrapping_mul(0x9e37_79b9) ^ 0x5bd1_e995).wrapping_mul(0x85eb_ca6b) >> 8;
        2.0 * f64::from(mixed) / f64::from(1 << 24) - 1.0
    }

    /// Two frames in each cell, too few for a trial there. What asks draws hardly fewer triangles and costs half: pixels are dear.
    #[test]
    fn a_walk_through_many_cells_goes_by_what_others_cost() {
        let (mut auto, mut spent, mut best) = (Auto::new(1000, &METHODS), 0.0, 0.0);
        let triangles = |mode| match mode {
            Mode::Both | Mode::Portals => 57_000,
            Mode::Pvs => 60_000,
            Mode::Frustum => 67_000,
            Mode::None => 105_000,
        };
        for frame in 0..2000 {
            let method = auto.choose(Some(CellId((frame / 2) as u32)), triangles);
            let even = 1.0 + 0.3 * noise(frame);
            let (cost, triangles) = match method.without_queries() {
                Some(mode @ (Mode::Both | Mode::Portals)) => (20.0 * even, triangles(mode)),
                Some(mode) => panic!("{mode:?} can't be better"),
                None => (9.0 * even, 54_000),
            };
            auto.learn(cost, triangles);
            spent += cost;
            best += 9.0 * even;
        }
        assert!(spent < 1.05 * best, "{spent} for {best}");
    }

    /// Frames of one method differ by a third either way.
    #[test]
    fn frames_that_differ_by_more_than_methods_do_not_lead_astray() {
        let of = |frame: usize, method: FrameMode| sparse(method) * (1.0 + 0.3 * noise(frame));
        for frames in [240, 3000] {
            let best: f64 = (0..frames).map(|frame| of(frame, FrameMode::Frustum)).sum();
            let (spent, _) = run(&mut Auto::new(0, &METHODS), frames, |frame, method| (None, of(frame, method)));
            assert!(spent <= 1.03 * best, "{frames}: {spent} for {best}");
        }
    }

    #[test]
    fn each_cell_has_its_own_method_and_learns_from_the_others() {
        let mut auto = Auto::new(100, &METHODS);
        // Thirty frames in each of a hundred cells, the even ones dense.
        let cell = |frame: usize| CellId((frame / 30 % 100) as u32);
        let cost =
            |frame: usize, m: FrameMode| (Some(cell(frame)), if cell(frame).0 % 2 == 0 { dense(m) } else { sparse(m) });
        let (first, second) = (run(&mut auto, 3000, cost).0, run(&mut auto, 3000, cost).0);
        assert!(first <= 1.15 * 30000.0 && second <= 1.03 * 30000.0, "{first}, then {second}");
    }

    #[test]
    fn a_change_of_the_scene_is_followed() {
        let mut auto = Auto::new(0, &METHODS);
        run(&mut auto, 1000, |_, method| (None, dense(method)));
        assert_eq!(METHODS[auto.places[0].current], FrameMode::Chc);
        // Out of the city: what draws everything in sight is seen to draw little, and tried.
        let (spent, _) = run(&mut auto, 1000, |_, method| (None, sparse(method)));
        assert!(!METHODS[auto.places[0].current].has_queries());
        assert!(spent <= 1.05 * 10.0 * 1000.0, "{spent}");
        // And back: the method that asks nothing gets dear, and is left as soon as another is thought of.
        let (spent, _) = run(&mut auto, 1000, |_, method| (None, dense(method)));
        assert_eq!(METHODS[auto.places[0].current], FrameMode::Chc);
        assert!(spent <= 10.0 * 1000.0 + 140.0 * f64::from(WAITS[1]), "{spent}");
    }

    /// To count what a method would draw takes as long as to cull by it.
    #[test]
    fn little_is_counted() {
        for frames_a_cell in [3, 30, 3000] {
            let (mut auto, mut counted) = (Auto::new(1000, &METHODS), 0);
            for frame in 0..3000 {
                let method = auto.choose(Some(CellId((frame / frames_a_cell) as u32)), |mode| {
                    counted += 1;
                    (sparse(mode.into()) * 100.0) as u64
                });
                auto.learn(sparse(method), 1000);
            }
            // One in each new cell, and now and then what might be tried there.
            let most = 3000 / frames_a_cell + 3000 * 5 / WAITS[0] as usize;
            assert!(counted <= most, "{frames_a_cell} frames a cell: {counted}");
        }
    }

    #[test]
    fn what_is_not_offered_is_not_chosen() {
        let offered = [FrameMode::Frustum, FrameMode::ChcPlus];
        let mut auto = Auto::new(3, &offered);
        for frame in 0..500u32 {
            let method = auto.choose(Some(CellId(frame / 7 % 3)), |_| 1000);
            assert!(offered.contains(&method));
            auto.learn(dense(method), 500);
        }
    }

    #[test]
    fn costs_of_nothing_are_survived() {
        let mut auto = Auto::new(1, &METHODS);
        assert_eq!(run(&mut auto, 100, |frame, _| (Some(CellId(0)).filter(|_| frame % 2 == 0), 0.0)).0, 0.0);
    }
}
