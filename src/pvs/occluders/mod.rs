//! Occluders: tests undecided pairs against triangles. A pair is hidden if surfaces close all shafts from the cell's portals to the object.
//!
//! Flow knows only portals, not the occluders within a cell. Here each undecided pair becomes shafts from a window of the cell to a part of
//! the object. Both ends are halved until a surface hides one from the other (`flood`), a segment is a witness, or the rest is too small or
//! too expensive. Groups of objects are tested together first: one wall hides a whole wing.
//!
//! Lines within the clearance of a surface are not guaranteed, except those through given portals that are too narrow for other lines
//! (`narrow_portals`).

mod flood;
mod mesh;
mod narrow_portals;
mod shaft;

use super::sampling::sampler::{Random, mix};
use super::sampling::witness::{Found, Prover, Witnessed};
use crate::cells::{CellGraph, Locator};
use crate::job::{Job, Stopped};
use crate::math::geom::{self, Aabb, Plane};
use crate::scene::Scene;
use crate::scene::rays::{Hit, RayScene};
use crate::{BitMatrix, CellId, DirectedPortal, ObjectId};
use flood::{Between, Failed, Flood};
use glam::DVec3;
use mesh::Mesh;
use serde::{Deserialize, Serialize};
use shaft::{End, Shaft};

/// Least length of a shaft with room for a clear line, in clearances.
const LONG: f64 = 4.0;

/// Least width of a polygon that is divided, as a share of its longest edge.
const POINT: f64 = 1e-3;

/// Most shafts per object and portal in each round; undecided pairs go to the next round. More rounds or shafts decide few more pairs: on a
/// real house, ten times the shafts decide a sixth of the rest.
const ROUNDS: [f64; 3] = [24.0, 192.0, 1536.0];
/// Surfaces tried in one shaft in each round: the largest on a segment, and the nearest. The largest decide more pairs for six tenths of the shafts;
/// but shafts are halved at the edge of the first one, and with the largest in all rounds 4 % more pairs of a furnished office stay undecided.
const SEEDS: [[usize; 2]; 3] = [[3, 0], [0, 6], [0, 6]];

/// The state of a pair.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Serialize, Deserialize)]
enum State {
    /// No line is known so far; if it stays so for all portals, the pair is hidden.
    Open,
    /// There is a witness.
    Seen,
    /// It exceeded its budget.
    OverBudget,
    /// It is undecided down to the tolerance.
    Narrow,
}

/// Decides pairs of a closed cell and an object in other cells. Pairs proven hidden are cleared from `objects_upper`; witnesses go to
/// `lower`, and pairs undecided down to the tolerance to `unresolved`. At most `shafts` shafts.
pub(super) fn decide(
    rays: &RayScene<'_>,
    graph: &CellGraph,
    (shafts, seed): (u64, u64),
    Bounds { placement, cells_upper, objects_upper, lower, unresolved, leave }: Bounds<'_>,
    work: &Job<'_>,
) -> Result<(), Stopped> {
    let scene = rays.scene();
    let clearance = rays.tolerance().clearance;
    let mesh = Mesh::new(scene, clearance);
    let locator = Locator::new(graph);
    let prover = Prover { rays, locator: &locator, clearance };
    let asker = Asker { scene, graph, mesh: &mesh, prover: &prover, seed };
    let left = shafts as f64;
    let mut pairs = Pairs { scene, placement, objects_upper, lower, unresolved, leave, left };
    let kept = pairs.ask_narrow(&asker, cells_upper, work)?;
    for round in 0..ROUNDS.len() {
        if !pairs.ask_round(&asker, round, &kept, work)? {
            break;
        }
    }
    Ok(())
}

/// The current bounds of pairs.
pub(super) struct Bounds<'b> {
    /// Cells x objects: the objects in each cell.
    pub placement: &'b BitMatrix,
    /// Pairs of cells, and of cells and objects, that flow did not refute.
    pub cells_upper: &'b BitMatrix,
    pub objects_upper: &'b mut BitMatrix,
    /// Pairs with a witness.
    pub lower: &'b mut Witnessed,
    /// Cells x objects: pairs undecided down to the tolerance.
    pub unresolved: &'b mut BitMatrix,
    /// Cells x objects: pairs that are not asked about.
    pub leave: Option<&'b BitMatrix>,
}

/// Pairs of cells and objects, and the remaining budget.
struct Pairs<'p> {
    scene: &'p Scene,
    placement: &'p BitMatrix,
    objects_upper: &'p mut BitMatrix,
    lower: &'p mut Witnessed,
    unresolved: &'p mut BitMatrix,
    leave: Option<&'p BitMatrix>,
    /// Remaining shafts.
    left: f64,
}

impl Pairs<'_> {
    /// Computes which pairs narrow portals may connect, and returns them: flow's result stands for these.
    fn ask_narrow(&mut self, asker: &Asker<'_>, cells_upper: &BitMatrix, work: &Job<'_>) -> Result<BitMatrix, Stopped> {
        let graph = asker.graph;
        let open = self.undecided(graph);
        let sides = narrow_portals::sides(graph, &open, [cells_upper, &*self.objects_upper], asker.mesh);
        let most = budget(ROUNDS[1], self.left, sides.iter().map(|s| s.objects.len()).sum());
        let ask = |(): &mut (), side: &narrow_portals::Side| {
            let cell = graph.portals[side.portal.portal().index()].cells[side.portal.side()];
            let random = Random::new(mix(mix(asker.seed, 0x4e), u64::from(side.portal.0)));
            let mut task = asker.task(cell, &side.objects, most, random);
            task.count_grazing_lines = true;
            if side.can_be_asked {
                task.through(side.portal);
            } else {
                task.state.fill(State::OverBudget);
            }
            (task.state, task.found.close(), task.shafts)
        };
        let tell = |done: usize| work.tell("narrow portals", done as f64 / sides.len() as f64);
        let found = work.map_with(&sides, || (), ask, tell)?;
        let mut kept = BitMatrix::new(self.placement.rows(), self.placement.columns());
        for (side, (state, found, shafts)) in sides.iter().zip(found) {
            self.pay(shafts, found);
            for (&o, _) in side.objects.iter().zip(&state).filter(|(_, state)| **state != State::Open) {
                for &c in side.cells.iter().filter(|&&c| open.get(c as usize, o as usize)) {
                    kept.set(c as usize, o as usize);
                    self.unresolved.set(c as usize, o as usize);
                }
            }
        }
        Ok(kept)
    }

    /// Tests undecided pairs, except `kept`. False if no pair or no budget is left.
    fn ask_round(&mut self, asker: &Asker<'_>, round: usize, kept: &BitMatrix, work: &Job<'_>) -> Result<bool, Stopped> {
        let graph = asker.graph;
        let open = self.undecided(graph);
        let todo: Vec<(usize, Vec<u32>)> = (0..graph.cells.len())
            .map(|c| {
                (c, open.ones(c).filter(|&o| !kept.get(c, o) && !self.is_left(c, o)).map(|o| o as u32).collect::<Vec<_>>())
            })
            .filter(|(_, objects)| !objects.is_empty())
            .collect();
        // Those to leave count: after an edit, a pair gets what it would get in a bake of all.
        let count = (0..graph.cells.len()).map(|c| graph.cells[c].portals.len() * open.ones(c).count()).sum();
        let budget = budget(ROUNDS[round], self.left, count);
        if todo.is_empty() || budget < 2.0 {
            return Ok(false);
        }
        let ask = |(): &mut (), (c, objects): &(usize, Vec<u32>)| {
            let random = Random::new(mix(mix(asker.seed, 0x5e + round as u64), *c as u64));
            let mut task = asker.task(CellId(*c as u32), objects, budget, random);
            (task.seeds, task.one_by_one) = (SEEDS[round], round + 1 == ROUNDS.len());
            for &portal in &graph.cells[*c].portals {
                task.through(portal);
            }
            (task.state, task.found.close(), task.shafts)
        };
        let share = |done: usize| (round as f64 + done as f64 / todo.len() as f64) / ROUNDS.len() as f64;
        let found = work.map_with(&todo, || (), ask, |done| work.tell("occluders", share(done)))?;
        for ((c, objects), (state, found, shafts)) in todo.iter().zip(found) {
            for (&o, state) in objects.iter().zip(&state) {
                match state {
                    State::Open => self.objects_upper.clear(*c, o as usize),
                    State::Narrow => _ = self.unresolved.set(*c, o as usize),
                    State::OverBudget => self.unresolved.clear(*c, o as usize),
                    State::Seen => (),
                }
            }
            self.pay(shafts, found);
        }
        Ok(true)
    }

    fn is_left(&self, cell: usize, object: usize) -> bool {
        self.leave.is_some_and(|leave| leave.get(cell, object))
    }

    /// Merges a task's results, and subtracts its cost.
    fn pay(&mut self, shafts: u64, mut found: Found) {
        self.left -= shafts as f64;
        // Included in the cost of shafts.
        found.rays = 0;
        self.lower.merge(found);
    }

    /// Pairs of closed cells and objects in other cells that are neither witnessed nor proven hidden. Moving objects are left out, because
    /// their triangles have no fixed place.
    fn undecided(&self, graph: &CellGraph) -> BitMatrix {
        let mut open = BitMatrix::new(self.placement.rows(), self.placement.columns());
        let is_known =
            |c, o| self.lower.objects.get(c, o) || self.placement.get(c, o) || self.scene.objects[o].reach.is_some();
        for c in (0..graph.cells.len()).filter(|&c| !graph.cells[c].open) {
            for o in self.objects_upper.ones(c).filter(|&o| !is_known(c, o)) {
                open.set(c, o);
            }
        }
        open
    }
}

/// Budget of shafts for an object through one portal: at most `most`, or a share of `left` among `pairs`.
fn budget(most: f64, left: f64, pairs: usize) -> f64 {
    // Most pairs cost far less than their budget.
    most.min(4.0 * left / pairs.max(1) as f64)
}

/// The common inputs of all tasks.
struct Asker<'a> {
    scene: &'a Scene,
    graph: &'a CellGraph,
    mesh: &'a Mesh,
    prover: &'a Prover<'a>,
    seed: u64,
}

impl<'a> Asker<'a> {
    fn task(&'a self, cell: CellId, objects: &'a [u32], budget: f64, random: Random) -> Task<'a> {
        Task {
            scene: self.scene,
            graph: self.graph,
            mesh: self.mesh,
            prover: self.prover,
            cell,
            seed: self.seed,
            objects,
            state: vec![State::Open; objects.len()],
            spent: vec![0.0; objects.len()],
            budget,
            count_grazing_lines: false,
            one_by_one: false,
            seeds: SEEDS[1],
            random,
            flood: Flood::default(),
            crossed: Vec::new(),
            planes: Vec::new(),
            found: Found::default(),
            shafts: 0,
            grown: 1.5 * self.prover.rays.tolerance().seal,
        }
    }
}

/// The far end of segments.
#[derive(Clone)]
enum Target {
    /// Objects, by their index in the task's list.
    Objects(Vec<u32>),
    /// Parts of one object: polygons, each with its triangle.
    Parts(u32, Vec<(u32, Vec<DVec3>)>),
}

/// The end of a shaft to halve, and the direction across it.
enum Halving {
    Far(DVec3),
    Near(DVec3),
    /// Both are too small.
    Neither,
}

/// The open pairs of one cell.
struct Task<'a> {
    scene: &'a Scene,
    graph: &'a CellGraph,
    mesh: &'a Mesh,
    prover: &'a Prover<'a>,
    cell: CellId,
    seed: u64,
    /// The objects, ascending, with the state of each, and its shafts so far from this portal.
    objects: &'a [u32],
    state: Vec<State>,
    spent: Vec<f64>,
    /// Most shafts.
    budget: f64,
    /// Whether lines that graze surfaces count, too, except those at the ends of a slit.
    count_grazing_lines: bool,
    /// Whether objects are not tested in groups, and each by a random sequence of its own: then a proof is found again whatever else changes.
    one_by_one: bool,
    /// One of [`SEEDS`].
    seeds: [usize; 2],
    /// Growth of portals over their rims, metres.
    grown: f64,
    random: Random,
    found: Found,
    /// Shafts so far.
    shafts: u64,
    // Memory.
    flood: Flood,
    crossed: Vec<(f64, u32)>,
    planes: Vec<Plane>,
}

impl Task<'_> {
    /// Tests all objects through one portal of the cell.
    fn through(&mut self, portal: DirectedPortal) {
        let plane = self.graph.plane(portal);
        let mut winding = self.graph.portals[portal.portal().index()].winding.clone();
        if portal.side() == 1 {
            winding.reverse();
        }
        self.spent.fill(0.0);
        let margin = 4.0 * self.mesh.gap;
        let ahead = |&k: &u32| {
            let b = self.scene.objects[self.objects[k as usize] as usize].bounds;
            let reach = plane.n.abs().dot(b.size() * 0.5);
            self.state[k as usize] == State::Open && plane.distance(b.centre()) + reach > -margin
        };
        let all: Vec<u32> = (0..self.objects.len() as u32).filter(ahead).collect();
        // Lines at a rim with a wall or floor along it are within the clearance of that.
        let least = if self.count_grazing_lines { 2.0 * self.mesh.clearance } else { 0.0 };
        let window = self.mesh.inset(&winding, plane.n, [self.grown, 0.8 * self.mesh.clearance], least);
        if window.is_empty() {
            return;
        }
        let window = End::polygon(&window, plane);
        if !self.one_by_one {
            return self.close(window, Target::Objects(all), &plane);
        }
        for k in all {
            let object = &self.scene.objects[self.objects[k as usize] as usize];
            self.random = Random::new(mix(mix(self.seed, key(window.bounds.centre())), key(object.bounds.centre())));
            self.close(window.clone(), Target::Objects(vec![k]), &plane);
        }
    }

    /// Divides the shaft from a window to a target until each part is decided.
    fn close(&mut self, window: End, target: Target, plane: &Plane) {
        let mut stack = vec![(window, target)];
        while let Some((from, mut target)) = stack.pop() {
            if !self.charge(&mut target) {
                continue;
            }
            // A surface that hides it, or a segment that is a witness.
            let to = self.end(&target);
            let Some(contour) = self.ask(&from, &to, &target, plane) else { continue };
            match self.halving(&from, &to, &target, &contour) {
                Halving::Far(across) => {
                    stack.extend(self.halves(target, plane, across).into_iter().map(|half| (from.clone(), half)));
                }
                Halving::Near(across) => {
                    let halves = split(&from.points, across).into_iter();
                    stack.extend(halves.map(|half| (End::polygon(&half, *plane), target.clone())));
                }
                Halving::Neither => {
                    if let Target::Parts(k, _) = target
                        && (self.count_grazing_lines || !self.is_narrow(&from, &to, k))
                    {
                        self.state[k as usize] = State::Narrow;
                    }
                }
            }
        }
    }

    /// Charges a shaft to the open objects of a target; false if there are none.
    fn charge(&mut self, target: &mut Target) -> bool {
        match target {
            Target::Objects(list) => {
                list.retain(|&k| self.state[k as usize] == State::Open);
                for &k in list.iter() {
                    self.charge_object(k as usize, 1.0 / list.len() as f64);
                }
                !list.is_empty()
            }
            Target::Parts(k, parts) => {
                let k = *k as usize;
                let is_open = self.state[k] == State::Open;
                if is_open {
                    self.charge_object(k, 1.0);
                }
                is_open && !parts.is_empty()
            }
        }
    }

    fn charge_object(&mut self, k: usize, shafts: f64) {
        self.spent[k] += shafts;
        if self.spent[k] > self.budget {
            self.state[k] = State::OverBudget;
        }
    }

    /// Halves the end that contributes most to the shaft's width at the surfaces' edge, across it.
    fn halving(&self, from: &End, to: &End, target: &Target, contour: &Failed) -> Halving {
        let [near, far] = [from, to].map(|e| e.bounds.centre().distance(contour.at));
        let f = near / (near + far).max(1e-300);
        let (wide, deep) = ((1.0 - f) * from.size(contour.across), f * to.size(contour.across));
        let least = 0.25 * self.mesh.clearance;
        let is_group = !matches!(target, Target::Parts(_, parts) if parts.len() <= 1);
        let mut across = contour.across;
        let (mut small, mut flat) = (from.size(across) < least, to.size(across) < least);
        if small && flat && !is_group {
            across = DVec3::ZERO;
            (small, flat) = (from.size(across) < least, to.size(across) < least);
        }
        if (is_group || !flat) && (deep >= wide || small) {
            Halving::Far(across)
        } else if !small {
            Halving::Near(across)
        } else {
            Halving::Neither
        }
    }

    /// The hull of a target.
    fn end(&self, target: &Target) -> End {
        match target {
            Target::Objects(list) => {
                let bounds = |&k: &u32| self.scene.objects[self.objects[k as usize] as usize].bounds;
                End::cuboid(list.iter().map(bounds).fold(Aabb::EMPTY, Aabb::union))
            }
            Target::Parts(_, parts) => match parts.as_slice() {
                [(tri, points)] => {
                    let [a, b, c] = self.scene.corners(*tri as usize);
                    match (b - a).cross(c - a).try_normalize() {
                        Some(n) => End::polygon(points, Plane::through(a, n)),
                        None => End::cuboid(Aabb::of(points.iter().copied())),
                    }
                }
                _ => End::cuboid(Aabb::of(parts.iter().flat_map(|(_, p)| p.iter().copied()))),
            },
        }
    }

    /// `None` if the target is decided; otherwise, where the tested surfaces end.
    fn ask(&mut self, from: &End, to: &End, target: &Target, plane: &Plane) -> Option<Failed> {
        self.shafts += 1;
        // A segment to a random point of the target.
        let (k, tri, goal) = match target {
            Target::Objects(list) => {
                let k = list[(self.random.bits() % list.len() as u64) as usize];
                let range = &self.scene.objects[self.objects[k as usize] as usize].triangles;
                let tri = range.start + (self.random.bits() % u64::from(range.end - range.start)) as u32;
                (k, tri, within(&self.scene.corners(tri as usize), &mut self.random))
            }
            Target::Parts(k, parts) => {
                let (tri, points) = &parts[(self.random.bits() % parts.len() as u64) as usize];
                (*k, *tri, within(points, &mut self.random))
            }
        };
        let start = within(&from.points, &mut self.random);
        let mut crossed = std::mem::take(&mut self.crossed);
        let first = self.mesh.crossed(start, goal, self.seeds, &mut crossed);
        // Its first hit may be a witness, too.
        if plane.distance(goal) > 0.0 {
            let first = first.map(|(s, i)| (start.lerp(goal, s), self.mesh.tris[i as usize].id));
            let (at, tri) = first.unwrap_or((goal, tri));
            let object = self.scene.object_of(tri as usize);
            if let Ok(k) = self.objects.binary_search(&object.0)
                && self.state[k] == State::Open
            {
                self.try_witness(
                    k,
                    start - plane.n * (2.0 * self.mesh.clearance),
                    at,
                    Hit { t: 1.0, triangle: tri, object },
                );
            }
        }
        let mut contour = Failed { at: goal, across: DVec3::ZERO };
        let mut shut = false;
        if !crossed.is_empty() && self.state[k as usize] == State::Open {
            let shaft = Shaft::new(from, to, 0.25 * self.mesh.gap, std::mem::take(&mut self.planes));
            let mut tried: Option<Failed> = None;
            let object = if let Target::Parts(k, _) = target { Some(self.objects[*k as usize]) } else { None };
            let between = Between { ends: [from, to], shaft: &shaft, object, count_grazing_lines: self.count_grazing_lines };
            for &(_, seed) in &crossed {
                match self.flood.closes(self.mesh, &between, seed) {
                    Ok(()) => {
                        shut = true;
                        break;
                    }
                    Err(at) => tried = tried.or(Some(at)),
                }
            }
            contour = tried.unwrap_or(contour);
            self.planes = shaft.into_planes();
        }
        self.crossed = crossed;
        (!shut).then_some(contour)
    }

    /// True if the shaft is smaller than the clearance and all its lines are within the clearance of a surface.
    fn is_narrow(&self, from: &End, to: &End, k: u32) -> bool {
        let [a, b] = [from, to].map(|e| geom::middle(&e.points));
        let clearance = self.mesh.clearance;
        let width = from.size(DVec3::ZERO).max(to.size(DVec3::ZERO));
        let Some(direction) = (b - a).try_normalize() else { return false };
        let object = ObjectId(self.objects[k as usize]);
        width < 0.45 * clearance
            && a.distance(b) > LONG * clearance
            && !self.prover.rays.is_clear(a, b - direction * (2.5 * clearance), 0.95 * clearance - width, Some(object))
    }

    fn try_witness(&mut self, k: usize, from: DVec3, to: DVec3, hit: Hit) {
        let object = ObjectId(self.objects[k]);
        if self.prover.aim(self.cell, from, to, Hit { object, ..hit }, &mut self.found) {
            self.state[k] = State::Seen;
        }
    }

    /// Two halves of a target, or its parts.
    fn halves(&self, target: Target, plane: &Plane, across: DVec3) -> Vec<Target> {
        match target {
            Target::Objects(list) if list.len() > 1 => {
                let centre = |k: &u32| self.scene.objects[self.objects[*k as usize] as usize].bounds.centre();
                let (a, b) = median(list, centre);
                vec![Target::Objects(a), Target::Objects(b)]
            }
            Target::Objects(list) => {
                let k = list[0];
                // Segments lead out of the cell: parts behind the portal belong to other portals.
                let behind = Plane { n: -plane.n, d: -plane.d - 0.1 * self.mesh.gap };
                let part = |t: u32| {
                    let part = geom::clip(&self.scene.corners(t as usize), &behind, 0.0);
                    (!part.is_empty()).then_some((t, part))
                };
                let parts =
                    self.scene.objects[self.objects[k as usize] as usize].triangles.clone().filter_map(part).collect();
                vec![Target::Parts(k, parts)]
            }
            Target::Parts(k, parts) if parts.len() > 1 => {
                let (a, b) = median(parts, |p| geom::middle(&p.1));
                vec![Target::Parts(k, a), Target::Parts(k, b)]
            }
            Target::Parts(k, parts) => {
                let (tri, points) = &parts[0];
                split(points, across).into_iter().map(|half| Target::Parts(k, vec![(*tri, half)])).collect()
            }
        }
    }
}

/// A number for a place, to within a millimetre or so.
fn key(p: DVec3) -> u64 {
    p.to_array().into_iter().fold(0, |key, x| mix(key, (1024.0 * x).round() as i64 as u64))
}

/// Divides a list at the median of its longest axis.
fn median<T>(mut list: Vec<T>, centre: impl Fn(&T) -> DVec3) -> (Vec<T>, Vec<T>) {
    let size = Aabb::of(list.iter().map(&centre)).size();
    let axis = if size.x >= size.y && size.x >= size.z {
        0
    } else if size.z >= size.y {
        2
    } else {
        1
    };
    list.sort_by(|a, b| centre(a)[axis].total_cmp(&centre(b)[axis]));
    let rest = list.split_off(list.len() / 2);
    (list, rest)
}

/// Halves a convex polygon across `along`, projected into its plane, or across its longest direction.
fn split(points: &[DVec3], along: DVec3) -> Vec<Vec<DVec3>> {
    let mut longest = (0.0, DVec3::X);
    for (i, &a) in points.iter().enumerate() {
        for &b in &points[i + 1..] {
            if a.distance_squared(b) > longest.0 {
                longest = (a.distance_squared(b), b - a);
            }
        }
    }
    let ends = |n: DVec3| {
        let at = points.iter().map(|p| n.dot(*p));
        at.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
    };
    let (mut n, mut reach) = (along, ends(along));
    if reach.1 - reach.0 <= POINT * longest.0.sqrt() {
        n = longest.1.normalize_or(DVec3::X);
        reach = ends(n);
    }
    let plane = Plane { n, d: 0.5 * (reach.0 + reach.1) };
    [plane, plane.flipped()].map(|p| geom::clip(points, &p, 0.0)).into_iter().filter(|h| !h.is_empty()).collect()
}

/// A random point of a convex polygon.
fn within(points: &[DVec3], random: &mut Random) -> DVec3 {
    let weights: Vec<f64> = points.iter().map(|_| -(1.0 - random.unit()).ln() + 1e-3).collect();
    let total: f64 = weights.iter().sum();
    points.iter().zip(&weights).map(|(&p, w)| p * (w / total)).sum()
}
