//! Witnesses: proofs that something is visible.
//!
//! A witness from a cell to a point `to` on an object is valid if both hold:
//!
//! * [`RayScene::is_clear`] from `from` to `to`, except for the object itself, and
//! * the segment up to just before `to` keeps full clearance from *every* opaque triangle ([`RayScene::keeps_clearance`]), and ends so near
//!   to the object that placement puts the object in every cell around that end.
//!
//! A tube's triangles are bounding prisms, so its witness continues to the tube itself.
//!
//! The first condition proves that the object is visible. The second makes the segment a test of the cell graph: it may go from cell to
//! cell through portals only, so otherwise a portal is missing ([`crate::pvs::repair`]).

use super::lines::Span;
use crate::cells::Locator;
use crate::scene::Scene;
use crate::scene::rays::{Hit, RayScene, meets_triangle};
use crate::types::note::Note;
use crate::types::proof::Witness;
use crate::{BitMatrix, CellId, ObjectId};
use enfilade_tubes::part;
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::collections::HashMap;

/// An object is placed in cells within this distance, in clearances.
pub(in crate::pvs) const PLACEMENT_MARGIN: f64 = 2.0;

/// Distance of the end of a witness's clear part from the target's plane, in clearances: more than 1, so that it is clear of the target,
/// and less than [`PLACEMENT_MARGIN`].
const STAND_OFF: f64 = 1.5;

/// Attempts at one pair in one batch of rays, and failed batches after which a pair gets only one attempt, then none.
const ATTEMPTS: u8 = 3;
const PATIENCE: u8 = 2;
const GIVE_UP: u8 = 12;

/// Sides of the tube mesh that witnesses must hit: it is within the tube, to its [`error`](enfilade_tubes::Tube::error). Fewer: grazing
/// lines are no witnesses. More: slower.
const SIDES_OF_WITNESSES: u32 = 16;

/// A clear segment between two cells.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub(in crate::pvs) struct Sight {
    /// The cells of its ends; the first is the lesser.
    pub cells: [CellId; 2],
    /// Its ends; every point of it keeps clearance.
    pub segment: [DVec3; 2],
}

/// Everything proven so far.
pub(in crate::pvs) struct Witnessed {
    /// Cells x cells, symmetric, the diagonal set.
    pub cells: BitMatrix,
    /// Cells x objects.
    pub objects: BitMatrix,
    /// One for each pair of `objects`.
    pub witnesses: Vec<Witness>,
    /// Where the clear part of each witness ends.
    pub ends: Vec<DVec3>,
    /// One for each two cells of `cells`.
    pub sights: Vec<Sight>,
    /// Cell-object pairs that rays reached without a proof, with the number of batches.
    pub failed: HashMap<(u32, u32), u8>,
    /// Rays cast, including the cost of cubes.
    pub rays: u64,
    /// Number of cubes.
    pub cubes: u64,
    /// Notes for the file about sampling.
    pub notes: Vec<Note>,
    /// Most witnesses.
    pub most_witnesses: usize,
    /// Proofs left out because of that.
    pub left_out: u64,
}

impl Witnessed {
    /// No proofs, except that a cell sees itself.
    pub fn new(cells: usize, objects: usize) -> Self {
        let mut diagonal = BitMatrix::new(cells, cells);
        (0..cells).for_each(|c| {
            diagonal.set(c, c);
        });
        Self {
            cells: diagonal,
            objects: BitMatrix::new(cells, objects),
            witnesses: Vec::new(),
            ends: Vec::new(),
            sights: Vec::new(),
            failed: HashMap::new(),
            rays: 0,
            cubes: 0,
            notes: Vec::new(),
            most_witnesses: usize::MAX,
            left_out: 0,
        }
    }

    /// Merges the results of a batch, and returns the number of new pairs. Batches must come in a fixed order.
    pub fn merge(&mut self, found: Found) -> usize {
        let before = self.witnesses.len();
        for (witness, end) in found.witnesses {
            if self.witnesses.len() >= self.most_witnesses {
                self.left_out += u64::from(!self.objects.get(witness.cell.index(), witness.object.index()));
            } else if self.objects.set(witness.cell.index(), witness.object.index()) {
                self.failed.remove(&(witness.cell.0, witness.object.0));
                self.witnesses.push(witness);
                self.ends.push(end);
            }
        }
        for sight in found.sights {
            let [a, b] = sight.cells.map(CellId::index);
            if self.cells.set(a, b) {
                self.cells.set(b, a);
                self.sights.push(sight);
            }
        }
        for pair in found.failed {
            if !self.objects.get(pair.0 as usize, pair.1 as usize) {
                let count = self.failed.entry(pair).or_default();
                *count = count.saturating_add(1);
            }
        }
        self.rays += found.rays;
        self.witnesses.len() - before
    }
}

/// The results of one batch of rays.
#[derive(Default, Serialize, Deserialize)]
pub(in crate::pvs) struct Found {
    /// Witnesses and where their clear parts end.
    pub witnesses: Vec<(Witness, DVec3)>,
    /// Clear segments between cells.
    pub sights: Vec<Sight>,
    /// Pairs tried without success, each once.
    pub failed: Vec<(u32, u32)>,
    /// Rays cast.
    pub rays: u64,
    #[serde(skip)]
    tried: HashMap<(Kind, u32, u32), u8>,
    /// Scratch: a bit for each cell that a line crosses.
    #[serde(skip)]
    crossed: Vec<u64>,
}

#[derive(Clone, Copy, PartialEq, Eq, Hash)]
enum Kind {
    Object,
    Cell,
}

impl Found {
    /// True if the pair may be tried again.
    fn may_try(&mut self, key: (Kind, u32, u32), limit: u8) -> bool {
        let tries = self.tried.entry(key).or_default();
        *tries = tries.saturating_add(1).min(u8::MAX - 1);
        *tries <= limit
    }

    /// Marks the pair as proven.
    fn settle(&mut self, key: (Kind, u32, u32)) {
        self.tried.insert(key, u8::MAX);
    }

    /// Closes the batch: lists the pairs without a proof.
    pub fn close(mut self) -> Self {
        let open = self.tried.drain().filter(|&((kind, ..), tries)| kind == Kind::Object && tries < u8::MAX);
        self.failed = open.map(|((_, cell, object), _)| (cell, object)).collect();
        self.failed.sort_unstable();
        self
    }
}

/// A maximal free line: position, cells along it, end hits, and see-through objects.
#[derive(Default)]
pub(in crate::pvs) struct Line {
    /// A point of it.
    pub origin: DVec3,
    /// Its direction, a unit vector.
    pub direction: DVec3,
    /// The cells along it, in order, by metres from the origin (negative behind).
    pub spans: Vec<Span>,
    /// The hits in front and behind; `t` as metres from the origin, negative behind.
    pub ends: [Option<Hit>; 2],
    /// The see-through objects that it passes.
    pub passes: Vec<Hit>,
}

impl Line {
    fn at(&self, s: f64) -> DVec3 {
        self.origin + self.direction * s
    }
}

/// Checks witnesses.
pub(in crate::pvs) struct Prover<'a> {
    /// The scene.
    pub rays: &'a RayScene<'a>,
    /// The cells.
    pub locator: &'a Locator<'a>,
    /// Metres.
    pub clearance: f64,
}

impl Prover<'_> {
    /// If the segment from `from` to the point `to` on a triangle is a witness: `to`, and the end of its clear part. If the line misses a
    /// tube, a line to its axis is tried.
    pub fn proves(&self, from: DVec3, to: DVec3, target: Hit) -> Option<[DVec3; 2]> {
        if !self.rays.scene().objects[target.object.index()].is_tube() {
            return self.clear_end(from, to, target).map(|end| [to, end]);
        }
        let reaches = |to: DVec3, target: Hit| {
            let on_tube = tube_before(self.rays.scene(), target.object, from, to)?;
            self.rays.is_clear(from, on_tube, self.clearance, Some(target.object)).then_some(())?;
            self.clear_end(from, to, target).map(|end| [to, end])
        };
        reaches(to, target).or_else(|| {
            let middle = middle_of_tube(self.rays.scene(), target.object, to)?;
            let met = self.rays.scene().objects[target.object.index()].triangles.clone();
            let met = met.filter_map(|triangle| self.rays.meets(from, middle - from, triangle));
            let first = met.min_by(|a, b| a.t.total_cmp(&b.t).then(a.triangle.cmp(&b.triangle)))?;
            reaches(from + (middle - from) * first.t, first)
        })
    }

    /// End of the clear part of a segment to a point on a triangle, if it is a witness apart from the condition on tubes.
    fn clear_end(&self, from: DVec3, to: DVec3, target: Hit) -> Option<DVec3> {
        let scene = self.rays.scene();
        let object = &scene.objects[target.object.index()];
        let direction = (to - from).try_normalize()?;
        let end = if object.opaque {
            let [a, b, c] = scene.corners(target.triangle as usize);
            let sine = (b - a).cross(c - a).try_normalize()?.dot(direction).abs();
            let back = STAND_OFF * self.clearance / sine;
            // Otherwise the segment would end before it begins.
            if back >= from.distance(to) || !back.is_finite() {
                return None;
            }
            to - direction * back
        } else {
            to
        };
        (self.rays.keeps_clearance(from, end, self.clearance)
            && self.rays.is_near(end, target.object, PLACEMENT_MARGIN * self.clearance * 0.999)
            && self.rays.is_clear(from, to, self.clearance, Some(target.object)))
        .then_some(end)
    }

    /// One aimed attempt at a pair; true if it succeeds.
    pub fn aim(&self, cell: CellId, from: DVec3, to: DVec3, target: Hit, found: &mut Found) -> bool {
        found.rays += 1;
        let Some([to, end]) = self.locator.holds(cell, from).then(|| self.proves(from, to, target)).flatten() else {
            return false;
        };
        found.witnesses.push((Witness { cell, object: target.object, from, to }, end));
        true
    }

    /// One attempt at two cells; true if it proves that they see each other.
    pub fn aim_sight(&self, cells: [CellId; 2], segment: [DVec3; 2], found: &mut Found) -> bool {
        found.rays += 1;
        let proven = (0..2).all(|i| self.locator.holds(cells[i], segment[i]))
            && self.rays.keeps_clearance(segment[0], segment[1], self.clearance);
        if proven {
            found.sights.push(Sight { cells, segment });
        }
        proven
    }

    /// Proves all new pairs of a line: to its ends, to see-through objects, and between its cells.
    pub fn line(&self, line: &Line, known: &Witnessed, found: &mut Found) {
        for hit in line.ends.iter().flatten().chain(&line.passes) {
            let passes = line.passes.iter().any(|p| p == hit);
            for forward in [true, false] {
                if passes || forward == (hit.t > 0.0) {
                    self.towards(line, *hit, forward, known, found);
                }
            }
        }
        // Most lines prove nothing new, which a test of whole words decides.
        let mut crossed = std::mem::take(&mut found.crossed);
        crossed.clear();
        crossed.resize(known.cells.columns().div_ceil(64), 0);
        line.spans.iter().for_each(|s| crossed[s.cell.index() / 64] |= 1 << (s.cell.index() % 64));
        for (i, a) in line.spans.iter().enumerate() {
            if crossed.iter().zip(known.cells.row(a.cell.index())).any(|(new, old)| new & !old != 0) {
                line.spans[i + 1..].iter().for_each(|b| self.sight(line, *a, *b, known, found));
            }
        }
        found.crossed = crossed;
    }

    /// Proves that the cells on one side of a hit see its object.
    fn towards(&self, line: &Line, hit: Hit, forward: bool, known: &Witnessed, found: &mut Found) {
        for span in &line.spans {
            let [mut low, mut high] = span.range;
            if forward {
                high = high.min(hit.t);
            } else {
                low = low.max(hit.t);
            }
            let pair = (span.cell.0, hit.object.0);
            if low >= high || known.objects.get(span.cell.index(), hit.object.index()) {
                continue;
            }
            let key = (Kind::Object, pair.0, pair.1);
            let limit = match known.failed.get(&pair) {
                Some(&n) if n >= GIVE_UP => 0,
                Some(&n) if n >= PATIENCE => 1,
                _ => ATTEMPTS,
            };
            if !found.may_try(key, limit) {
                continue;
            }
            // Starting points: where the line leaves the cell towards the object, which is shortest; the middle; and the line's origin,
            // which is in the cell even if a missing portal makes the span too long.
            let inset = (0.5 * (high - low)).min(4.0 * self.clearance);
            let middle = 0.5 * (low + high);
            let exit = if forward { high } else { low };
            let ahead = if exit == hit.t { middle } else { exit + if forward { -inset } else { inset } };
            let [ahead, middle, cast] = [ahead, middle, 0.0f64.max(low + inset).min(high - inset)].map(|s| line.at(s));
            let to = line.at(hit.t);
            let corners = self.rays.scene().corners(hit.triangle as usize);
            let centre = corners.iter().sum::<DVec3>() / 3.0;
            let variants =
                [(ahead, to), (cast, to), (middle, to), (ahead, to.lerp(centre, 0.3)), (cast, to.lerp(centre, 0.7))];
            let tries = if limit > 1 { variants.len() } else { 1 };
            let in_cell = variants.into_iter().filter(|&(from, _)| self.locator.holds(span.cell, from));
            for (from, to) in in_cell.take(tries) {
                if let Some([to, end]) = self.proves(from, to, hit) {
                    found.witnesses.push((Witness { cell: span.cell, object: hit.object, from, to }, end));
                    found.settle(key);
                    break;
                }
            }
        }
    }

    /// Proves that two cells see each other.
    fn sight(&self, line: &Line, a: Span, b: Span, known: &Witnessed, found: &mut Found) {
        let cells = [a.cell.min(b.cell), a.cell.max(b.cell)];
        let key = (Kind::Cell, cells[0].0, cells[1].0);
        if cells[0] == cells[1] || known.cells.get(a.cell.index(), b.cell.index()) || !found.may_try(key, ATTEMPTS) {
            return;
        }
        let inset = |span: Span| (0.5 * (span.range[1] - span.range[0])).min(4.0 * self.clearance);
        let (p, q) = (line.at(a.range[1] - inset(a)), line.at(b.range[0] + inset(b)));
        if self.locator.holds(a.cell, p) && self.locator.holds(b.cell, q) && self.rays.keeps_clearance(p, q, self.clearance)
        {
            let segment = if a.cell < b.cell { [p, q] } else { [q, p] };
            found.sights.push(Sight { cells, segment });
            found.settle(key);
        }
    }
}

/// First intersection of the line from one point through another with the tubes of an object.
fn tube_before(scene: &Scene, object: ObjectId, from: DVec3, through: DVec3) -> Option<DVec3> {
    let along = through - from;
    let mut first = f64::INFINITY;
    for (tube, segments) in scene.tubes.parts(scene.objects[object.index()].segments.clone()) {
        let mesh = part(&scene.tubes, tube, segments, SIDES_OF_WITNESSES);
        let corners = |t: &[u32; 3]| t.map(|i| tube.origin + mesh.positions[i as usize].as_dvec3());
        let met = mesh.triangles.iter().filter_map(|t| meets_triangle(from, along, &corners(t)));
        first = met.fold(first, f64::min);
    }
    first.is_finite().then_some(from + along * first)
}

/// The point on the axes of an object's tubes nearest to another point.
fn middle_of_tube(scene: &Scene, object: ObjectId, p: DVec3) -> Option<DVec3> {
    let parts = scene.tubes.parts(scene.objects[object.index()].segments.clone());
    let ends = parts.flat_map(|(tube, segments)| {
        let sections = scene.tubes.of(tube);
        let at = move |i: u32| {
            let section = sections[(i - tube.sections.start) as usize % sections.len()];
            tube.origin + Vec3::from(section.place).as_dvec3()
        };
        segments.map(move |i| [at(i), at(i + 1)])
    });
    let nearest = ends.map(|[a, b]| {
        let along = b - a;
        let length = along.length_squared();
        let share = if length > 0.0 { ((p - a).dot(along) / length).clamp(0.0, 1.0) } else { 0.0 };
        a + along * share
    });
    nearest.min_by(|a, b| a.distance_squared(p).total_cmp(&b.distance_squared(p)))
}
