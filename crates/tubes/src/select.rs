//! Level of detail of tubes in a frame, by pixels: chords that replace segments or parts of them, and sides of each ring.
//!
//! Sides belong to a ring, not to a segment: a ring has the most sides that one of its segments needs, of whichever object. So
//! neighbours share corners, and a segment's drawing doesn't depend on other objects, unless a frame exceeds its limit.

use super::between::{BITS, place_at, section};
use super::drawn::{Band, Wall};
use super::runs::{Part, Run, Runs};
use super::tube::Tubes;
use glam::{DMat3, DVec2, DVec3};
use std::f64::consts::PI;
use std::ops::Range;

/// Possible numbers of sides of a ring.
pub const SIDES: [u32; 11] = [4, 8, 16, 32, 64, 128, 256, 512, 1024, 2048, 4096];
/// Most triangles of a frame, beside eight for each segment or run: in a view of 179.9 degrees, a whole plant needs the finest
/// rings. Fewer: large plants are coarser than asked. More: such a view fills the memory.
const MOST_TRIANGLES: u64 = 1 << 23;
/// Factor by which the limit grows if a frame has more, and how often at most: a million times in all.
const COARSER: f64 = 4.0;
const COARSEST: u32 = 10;
/// Share of the limit for chords; the rest is for sides. More: more sides. Less: more segments.
const SHARE: f64 = 0.5;
/// Rounding of single precision, as a share of the radius.
const ROUNDING: f64 = 1.0 / 4_194_304.0;

/// A camera and the error limit of its picture.
#[derive(Clone, Copy, Debug)]
pub struct View {
    eye: DVec3,
    /// Unit vector of the view direction.
    along: DVec3,
    /// Unit normals of the view frustum's sides, inwards.
    sides: [DVec3; 4],
    /// Near plane, metres.
    near: f64,
    /// Largest speed of projected points at the screen's corners: pixels times depth per metre.
    rate: f64,
    /// Distance of the screen's corners relative to its centre.
    slant: f64,
    /// Largest error of a surface, pixels.
    limit: f64,
}

impl View {
    /// A view from `eye`, metres; clip-space x, y and w are dot products with three rows. `near`: distance of the near plane,
    /// metres; `size`: of the picture, pixels; `limit`: largest error of surfaces, pixels. All above 0.
    pub fn new(eye: DVec3, [x, y, w]: [DVec3; 3], near: f64, size: [f64; 2], limit: f64) -> Self {
        let scale = w.length();
        let [x, y, along] = [x, y, w].map(|row| row / scale);
        let rays = DMat3::from_cols(x, y, along).transpose().inverse();
        let half = DVec2::from(size) / 2.0;
        let (mut rate, mut slant) = (0.0f64, 1.0f64);
        for [a, b] in [[-1.0, -1.0], [-1.0, 1.0], [1.0, -1.0], [1.0, 1.0]] {
            // The largest singular value of the projection's derivative at a depth of 1.
            let [u, v] = [half.x * (x - a * along), half.y * (y - b * along)];
            let [uu, vv] = [u.length_squared(), v.length_squared()];
            rate = rate.max(((uu + vv) / 2.0 + ((uu - vv) / 2.0).hypot(u.dot(v))).sqrt());
            slant = slant.max((rays * DVec3::new(a, b, 1.0)).length());
        }
        let sides = [along + x, along - x, along + y, along - y].map(|n| n.normalize_or_zero());
        Self { eye, along, sides, near, rate, slant, limit }
    }

    /// Least visible depth, metres, of surfaces within `reach` of a line from `a` to `b` but no nearer to it than `hole`. `None`
    /// if they are off the screen.
    fn depth(&self, [a, b]: [DVec3; 2], reach: f64, hole: f64) -> Option<f64> {
        let [a, b] = [a - self.eye, b - self.eye];
        let (mut from, mut to) = (0.0f64, 1.0f64);
        let planes = self.sides.iter().map(|n| (*n, 0.0)).chain([(self.along, self.near)]);
        for (n, d) in planes {
            let [p, q] = [a, b].map(|p| p.dot(n) - d + reach);
            if p < 0.0 && q < 0.0 {
                return None;
            }
            if p < 0.0 {
                from = from.max(p / (p - q));
            } else if q < 0.0 {
                to = to.min(p / (p - q));
            }
        }
        if from > to {
            return None;
        }
        let [c, d] = [from, to].map(|t| a.lerp(b, t));
        let way = d - c;
        let t = (-c.dot(way) / way.length_squared()).clamp(0.0, 1.0);
        let away = if t.is_nan() { c.length() } else { c.lerp(d, t).length() };
        // Outside the surface, or in its hole.
        let surface = (away - reach).max(hole - away);
        let depth = c.dot(self.along).min(d.dot(self.along)) - reach;
        Some(depth.max(surface / self.slant).max(self.near))
    }

    /// Allowed error of a surface at a depth, metres.
    fn may_be_off(&self, depth: f64) -> f64 {
        self.limit * depth / (self.rate + self.limit)
    }
}

/// Counts of a selection.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Chosen {
    /// Drawn chords: for one segment, several, or a part of one.
    pub segments: u64,
    /// Their triangles, including those of zero area, of caps and of holes.
    pub triangles: u64,
    /// Chords whose error may exceed the limit: there are no finer ones, or too many.
    pub over: u64,
}

/// Selects levels of detail; keeps its memory between frames.
#[derive(Clone, Debug, Default)]
pub struct Selection {
    bands: [Vec<Band>; SIDES.len()],
    chosen: Chosen,
    /// Triangles that count against [`MOST_TRIANGLES`].
    spent: u64,
    drawn: Vec<Drawn>,
    open: Vec<Run>,
}

/// A drawn run and the index into [`SIDES`] that it needs.
#[derive(Clone, Copy, Debug)]
struct Drawn {
    run: Run,
    need: u8,
    is_over: bool,
}

/// Decision about a run.
enum Verdict {
    Unseen,
    Divided,
    Drawn(Drawn),
}

impl Selection {
    /// Selects the level of detail of objects, each with its number (below 2^24) and its segments, which `runs` must contain. If
    /// the result exceeds 8.4 million triangles beside eight per segment, the error limit is raised until it does not.
    pub fn select(
        &mut self,
        tubes: &Tubes,
        runs: &Runs,
        view: &View,
        objects: impl Iterator<Item = (u32, Range<u32>)> + Clone,
    ) {
        let mut view = *view;
        for coarser in 0..=COARSEST {
            if self.fits(&Judge { tubes, runs, view: &view }, objects.clone(), coarser == COARSEST) {
                if coarser > 0 {
                    self.chosen.over = self.chosen.segments;
                }
                return;
            }
            view.limit *= COARSER;
        }
    }

    /// Selects; false if the result is too large and `may_be_much` is unset.
    fn fits(&mut self, judge: &Judge<'_>, objects: impl Iterator<Item = (u32, Range<u32>)>, may_be_much: bool) -> bool {
        self.bands.iter_mut().for_each(Vec::clear);
        self.chosen = Chosen::default();
        self.spent = 0;
        for (object, segments) in objects {
            for part in judge.runs.of(segments) {
                judge.part(part, &mut self.open, &mut self.drawn);
                self.add(judge, part, object);
                if self.spent > MOST_TRIANGLES && !may_be_much {
                    return false;
                }
            }
        }
        true
    }

    /// Bands with the sides of this index into [`SIDES`].
    pub fn bands(&self, sides: usize) -> &[Band] {
        &self.bands[sides]
    }

    /// Counts of the last selection.
    pub fn chosen(&self) -> Chosen {
        self.chosen
    }

    /// Adds the bands of a part.
    fn add(&mut self, judge: &Judge<'_>, part: &Part, object: u32) {
        let tube = &judge.tubes.tubes[part.tube as usize];
        let drawn = std::mem::take(&mut self.drawn);
        let [start, end] = part.all();
        let [first, last] = [tube.sections.start, tube.sections.end - 1].map(|section| section << BITS);
        for (k, this) in drawn.iter().enumerate() {
            let [from, to] = part.ends(this.run);
            let beside = |other: Option<&Drawn>, end: usize, at: u32| {
                other.filter(|other| part.ends(other.run)[end] == at).map_or(0, |other| other.need)
            };
            let before =
                if from == start { judge.need_before(part) } else { beside(k.checked_sub(1).map(|k| &drawn[k]), 1, from) };
            let after = if to == end { judge.need_after(part) } else { beside(drawn.get(k + 1), 0, to) };
            let sides = [before, after].map(|need| need.max(this.need));
            // A closed tube's last run ends where its first one begins.
            let ends = [from, if to > last && to == end { section(tube, to >> BITS) << BITS } else { to }];
            let mut add = |wall: Wall, sides: [u8; 2]| {
                self.bands[usize::from(sides[0].max(sides[1]))].push(Band::new(ends, part.tube, object, wall, sides));
                let triangles = 2 * SIDES[usize::from(sides[0].max(sides[1]))];
                self.chosen.triangles += u64::from(triangles);
                let is_part = this.run.0 < BITS;
                self.spent += u64::from(if is_part { triangles } else { triangles - 2 * SIDES[0] });
            };
            add(Wall::Outer, sides);
            if tube.inner > 0.0 {
                add(Wall::Inner, [sides[1], sides[0]]);
            }
            if tube.capped && !tube.closed && from == first {
                add(Wall::First, [sides[0]; 2]);
            }
            if tube.capped && !tube.closed && to == last {
                add(Wall::Last, [sides[1]; 2]);
            }
            self.chosen.segments += 1;
            self.chosen.over += u64::from(this.is_over);
        }
        self.drawn = drawn;
    }
}

/// Decides about runs by the view alone.
struct Judge<'j> {
    tubes: &'j Tubes,
    runs: &'j Runs,
    view: &'j View,
}

impl Judge<'_> {
    /// Lists the drawn runs of a part, in order.
    fn part(&self, part: &Part, open: &mut Vec<Run>, drawn: &mut Vec<Drawn>) {
        drawn.clear();
        open.clear();
        open.push((part.top(), 0));
        while let Some(run) = open.pop() {
            match self.run(part, run) {
                Verdict::Unseen => {}
                Verdict::Drawn(this) => drawn.push(this),
                Verdict::Divided => {
                    let [first, last] = part.halves(run);
                    if last != first {
                        open.push(last);
                    }
                    open.push(first);
                }
            }
        }
    }

    fn run(&self, part: &Part, run: Run) -> Verdict {
        let tube = &self.tubes.tubes[part.tube as usize];
        let ends = part.ends(run);
        let sections = [ends[0] >> BITS, section(tube, ends[1].div_ceil(1 << BITS))];
        let radii = sections.map(|number| f64::from(tube.radius(&self.tubes.sections[number as usize])));
        let (radius, error) = (radii[0].max(radii[1]), self.runs.error(part, run));
        let hole = f64::from(tube.inner) * radii[0].min(radii[1]);
        let hole = if hole > 0.0 { hole } else { radii[0].min(radii[1]) };
        let line = ends.map(|number| place_at(self.tubes, tube, number) + tube.origin);
        // Rings at the ends tilt by no more than the chord's error.
        let reach = radius * (1.0 + ROUNDING) + error;
        let Some(depth) = self.view.depth(line, reach, hole - 2.0 * error) else { return Verdict::Unseen };
        let most = self.view.may_be_off(depth);
        let is_near = error <= SHARE * most;
        if !is_near && self.runs.is_divided(part, run) {
            return Verdict::Divided;
        }
        let left = most - error - radius * ROUNDING;
        // More sides don't help if the chord itself exceeds the limit.
        let of_sides = if left > 0.0 { left } else { (1.0 - SHARE) * most };
        let need = SIDES.iter().position(|&sides| radius * (1.0 - (PI / f64::from(sides)).cos()) <= of_sides);
        let last = SIDES.len() - 1;
        Verdict::Drawn(Drawn { run, need: need.unwrap_or(last) as u8, is_over: need.is_none() || left <= 0.0 })
    }

    /// Sides that the segment before a part needs, whichever object it belongs to.
    fn need_before(&self, part: &Part) -> u8 {
        let tube = &self.tubes.tubes[part.tube as usize];
        let is_first = part.segments.start == tube.sections.start;
        let end = if is_first { tube.segments().end } else { part.segments.start };
        let is_open = is_first && !tube.closed;
        self.runs.ending(end).filter(|_| !is_open).map_or(0, |part| self.need_at(part, 1))
    }

    /// Sides that the segment after a part needs.
    fn need_after(&self, part: &Part) -> u8 {
        let tube = &self.tubes.tubes[part.tube as usize];
        let is_last = part.segments.end == tube.segments().end;
        let start = if is_last { tube.sections.start } else { part.segments.end };
        let is_open = is_last && !tube.closed;
        self.runs.beginning(start).filter(|_| !is_open).map_or(0, |part| self.need_at(part, 0))
    }

    /// Sides that the first (0) or the last (1) drawn run of a part needs.
    fn need_at(&self, part: &Part, end: usize) -> u8 {
        let mut run = (part.top(), 0);
        loop {
            match self.run(part, run) {
                Verdict::Unseen => return 0,
                Verdict::Drawn(drawn) => return drawn.need,
                Verdict::Divided => run = part.halves(run)[end],
            }
        }
    }
}
