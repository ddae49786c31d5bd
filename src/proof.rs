//! Proofs for single pairs of a baked file: why a cell sees an object or another cell, or does not. Proofs are in the file, or are found
//! again.

use crate::cells::CellGraph;
use crate::file::PvsFile;
use crate::math::geom::Aabb;
use crate::pvs::pair_proof::{Flowed, Fronts, PairFlow, Separation, is_occluded};
use crate::scene::Scene;
use crate::scene::rays::RayScene;
use crate::types::guarantee::Guarantee;
use crate::{BitMatrix, CellId, DirectedPortal, ObjectId};
use glam::DVec3;

/// The target of a query, as seen from a cell.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Goal {
    /// Another cell.
    Cell(CellId),
    /// An object.
    Object(ObjectId),
}

/// Why a pair is visible, hidden or neither.
#[derive(Clone, PartialEq, Debug)]
pub enum Why {
    /// A cell sees itself.
    Itself,
    /// They see each other: an unobstructed segment.
    Witnessed(Sight),
    /// They see each other, but the file has no segment between the two: a chain of portals that a line may pass, empty if none was found.
    Known(Vec<DirectedPortal>),
    /// No chain of portals connects the two.
    Apart,
    /// No line passes: each chain of portals from the cell ends in one of these. Empty: the planes of the portals already refute all
    /// chains.
    Separated(Vec<Separation>),
    /// Portals leave the pair open, but the cell is behind all visible triangles of the object.
    Behind,
    /// Portals leave the pair open, but triangles hide it.
    Occluded(Occlusion),
    /// No line passes: proven for each of the cells joined into this one, before they were joined. The number of these cells; the file does
    /// not keep them.
    Joined(u32),
    /// Neither is proven.
    Undecided(Doubt),
}

/// A segment with its cells and portals.
#[derive(Clone, PartialEq, Debug)]
pub struct Sight {
    /// A point in the cell, metres relative to the file's origin.
    pub from: DVec3,
    /// A point on the object, or in the other cell.
    pub to: DVec3,
    /// The cells along it, in order, including the first one.
    pub cells: Vec<CellId>,
    /// The portals between those.
    pub portals: Vec<DirectedPortal>,
    /// Whether it is unobstructed in the model; `None` without a model.
    pub clear: Option<bool>,
}

/// A pair that portals leave open, but triangles hide.
#[derive(Clone, PartialEq, Debug)]
pub struct Occlusion {
    /// Portals that a line may pass, in order; empty if the search ran out of steps.
    pub chain: Vec<DirectedPortal>,
    /// Whether the test of the model's triangles was repeated successfully; `None` without a model.
    pub confirmed: Option<bool>,
}

/// The reason why a pair is undecided.
#[derive(Clone, PartialEq, Debug)]
pub enum Doubt {
    /// The object is in the cell itself, so portals cannot decide; no ray has hit it.
    Inside,
    /// A line may pass these portals, in order, but no unobstructed one was found.
    Open(Vec<DirectedPortal>),
    /// The search ran out of steps.
    OutOfSteps,
    /// The single test with the file's portals finds that no line passes.
    Separated(Vec<Separation>),
}

/// Errors of a query.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum WhyError {
    /// There is no such cell.
    #[error("no cell {cell}: the file has {}", ids(*cells))]
    NoSuchCell {
        /// The requested id.
        cell: CellId,
        /// Number of cells.
        cells: usize,
    },
    /// There is no such object.
    #[error("no object {object}: the file has {}", ids(*objects))]
    NoSuchObject {
        /// The requested id.
        object: ObjectId,
        /// Number of objects.
        objects: usize,
    },
    /// The file has only one bound, which does not decide the pair.
    #[error("keeps only one bound, and the pair {}; bake it with --rows both", one_side(*guarantee))]
    OneSide {
        /// The bound of the rows.
        guarantee: Guarantee,
    },
    /// The model is different, or was imported differently.
    #[error("is not the file's model (hash {model:032x}, expected {file:032x}); give the file's model, or bake again")]
    OtherModel {
        /// The model's hash.
        model: u128,
        /// The hash in the file.
        file: u128,
    },
}

fn ids(n: usize) -> String {
    if n == 0 { "none".to_owned() } else { format!("0 to {}", n - 1) }
}

fn one_side(guarantee: Guarantee) -> &'static str {
    match guarantee {
        Guarantee::Conservative => "is in its rows, with visible and undecided pairs",
        Guarantee::Sampled => "isn't in its rows, like hidden and undecided pairs",
    }
}

/// A file laid out for queries of pairs.
pub struct Asker<'f> {
    file: &'f PvsFile,
    graph: CellGraph,
    flow: PairFlow,
    rays: Option<RayScene<'f>>,
    fronts: Option<Fronts>,
}

/// The state of a pair.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Side {
    Visible,
    Hidden,
    Undecided,
}

impl<'f> Asker<'f> {
    /// Lays out a file; `model`: its scene, for additional tests.
    ///
    /// # Errors
    ///
    /// [`WhyError::OtherModel`].
    pub fn new(file: &'f PvsFile, model: Option<&'f Scene>) -> Result<Self, WhyError> {
        if let Some(model) = model.map(Scene::hash).filter(|&hash| hash != file.model_hash) {
            return Err(WhyError::OtherModel { model, file: file.model_hash });
        }
        let graph = file.graph();
        let bounds: Vec<Aabb> = file.object_bounds().collect();
        let flow = PairFlow::new(&graph, &file.placement, file.placed.as_deref(), &bounds, file.tolerance().coplanar);
        let rays = model.map(|scene| RayScene::with_closed_holes(scene, &graph.closed_holes));
        let fronts = model.map(|scene| Fronts::new(scene, &graph));
        Ok(Self { file, graph, flow, rays, fronts })
    }

    /// Why `cell` sees `goal`, or does not.
    ///
    /// # Errors
    ///
    /// Those of [`WhyError`] except the last.
    pub fn why(&self, cell: CellId, goal: Goal) -> Result<Why, WhyError> {
        let (cells, objects) = (self.file.cells.len(), self.file.objects.len());
        let other = if let Goal::Cell(other) = goal { other } else { cell };
        if let Some(&cell) = [cell, other].iter().find(|c| c.index() >= cells) {
            return Err(WhyError::NoSuchCell { cell, cells });
        }
        match goal {
            Goal::Object(object) if object.index() >= objects => Err(WhyError::NoSuchObject { object, objects }),
            Goal::Object(object) => Ok(self.object(cell, object, self.side(cell, goal)?)),
            Goal::Cell(other) if other == cell => Ok(Why::Itself),
            Goal::Cell(other) => Ok(self.cell(cell, other, self.side(cell, goal)?)),
        }
    }

    /// Pairs of cells that flow left open, according to the file.
    fn cells_upper(&self) -> BitMatrix {
        if let Some(bounds) = &self.file.bounds {
            return bounds.cells_upper.clone();
        }
        let cells = self.file.cells.len() as u32;
        let mut upper = BitMatrix::new(cells as usize, cells as usize);
        for (a, b) in (0..cells).flat_map(|a| (0..cells).map(move |b| (a, b))) {
            if self.file.sees_cell(CellId(a), CellId(b)) {
                upper.set(a as usize, b as usize);
            }
        }
        upper
    }

    fn side(&self, cell: CellId, goal: Goal) -> Result<Side, WhyError> {
        let a = cell.index();
        let known = self.file.bounds.as_ref().map(|b| match goal {
            Goal::Cell(c) => (b.cells_lower.get(a, c.index()), b.cells_upper.get(a, c.index())),
            Goal::Object(o) => (b.objects_lower.get(a, o.index()), b.objects_upper.get(a, o.index())),
        });
        let in_rows = match goal {
            Goal::Cell(c) => self.file.sees_cell(cell, c),
            Goal::Object(o) => self.file.sees_object(cell, o),
        };
        match (known, self.file.guarantee) {
            (Some((true, _)), _) => Ok(Side::Visible),
            (Some((_, true)), _) => Ok(Side::Undecided),
            (Some(_), _) => Ok(Side::Hidden),
            (None, Guarantee::Conservative) if !in_rows => Ok(Side::Hidden),
            (None, guarantee) => Err(WhyError::OneSide { guarantee }),
        }
    }

    fn object(&self, cell: CellId, object: ObjectId, side: Side) -> Why {
        let flowed = || self.flow.object(cell, object, &self.file.placement);
        match side {
            Side::Visible => match self.witness(cell, object) {
                Some(sight) => Why::Witnessed(sight),
                None => Why::Known(Vec::new()),
            },
            Side::Hidden => {
                let reached = self.reached(cell);
                let placed = (0..reached.len()).filter(|&c| self.file.placement.get(c, object.index()));
                if !placed.into_iter().any(|c| reached[c]) {
                    return Why::Apart;
                }
                let chain = match flowed() {
                    Flowed::Separated(found) => return Why::Separated(found),
                    Flowed::Open(chain) => chain,
                    Flowed::OutOfSteps => Vec::new(),
                };
                let cells_upper = self.cells_upper();
                if self.fronts.as_ref().is_some_and(|fronts| fronts.is_behind(&self.graph, &cells_upper, cell, object)) {
                    return Why::Behind;
                }
                let (placement, pair) = (&self.file.placement, [cell.index(), object.index()]);
                let confirmed = self.rays.as_ref().map(|rays| is_occluded(rays, &self.graph, placement, &cells_upper, pair));
                match self.file.clusters.get(cell.index()) {
                    Some(&cells) if confirmed != Some(true) => Why::Joined(cells),
                    _ => Why::Occluded(Occlusion { chain, confirmed }),
                }
            }
            Side::Undecided if self.file.placement.get(cell.index(), object.index()) => Why::Undecided(Doubt::Inside),
            Side::Undecided => Why::Undecided(doubt(flowed())),
        }
    }

    fn cell(&self, a: CellId, b: CellId, side: Side) -> Why {
        match side {
            Side::Visible => match self.sight(a, b) {
                Some(sight) => Why::Witnessed(sight),
                None => match self.flow.cell(a, b) {
                    Flowed::Open(chain) => Why::Known(chain),
                    _ => Why::Known(Vec::new()),
                },
            },
            Side::Hidden if !self.reached(a)[b.index()] => Why::Apart,
            Side::Hidden => match self.flow.cell(a, b) {
                Flowed::Separated(found) => Why::Separated(found),
                open => match self.file.clusters.get(a.index()) {
                    Some(&cells) => Why::Joined(cells),
                    None => Why::Undecided(doubt(open)),
                },
            },
            Side::Undecided => Why::Undecided(doubt(self.flow.cell(a, b))),
        }
    }

    /// The witness of a pair.
    fn witness(&self, cell: CellId, object: ObjectId) -> Option<Sight> {
        let witnesses = &self.file.bounds.as_ref()?.witnesses;
        let at = witnesses.binary_search_by_key(&(cell, object), |w| (w.cell, w.object)).ok()?;
        let (from, to) = (witnesses[at].from, witnesses[at].to);
        let path = self.follow(cell, from, to);
        let clear = self.is_clear(from, to, Some(object));
        Some(Sight { from, to, cells: path.cells, portals: path.portals, clear })
    }

    /// A segment from one cell to another: for neighbours, a step through a portal; otherwise the part of a witness that passes both.
    fn sight(&self, a: CellId, b: CellId) -> Option<Sight> {
        let direct = self.graph.cells[a.index()].portals.iter().find(|&&p| self.graph.target(p) == b);
        if let Some(&portal) = direct {
            let middle = crate::math::geom::middle(&self.graph.portals[portal.portal().index()].winding);
            return Some(Sight { from: middle, to: middle, cells: vec![a, b], portals: vec![portal], clear: None });
        }
        let all = &self.file.bounds.as_ref()?.witnesses;
        // Witnesses of these two cells are more likely to pass both than others.
        let own = |c: CellId| all[all.partition_point(|w| w.cell < c)..all.partition_point(|w| w.cell <= c)].iter();
        own(a).chain(own(b)).chain(all).find_map(|w| {
            let path = self.follow(w.cell, w.from, w.to);
            let place = |c: CellId| path.cells.iter().position(|&d| d == c);
            let (i, k) = (place(a)?, place(b)?);
            let [first, last] = [i.min(k), i.max(k)];
            let mut cells = path.cells[first..=last].to_vec();
            let mut portals = path.portals[first..last].to_vec();
            // From the middle of one cell's stretch to that of the other's; the witness's own ends are in their cells, too.
            let mut ends = [first, last].map(|n| w.from.lerp(w.to, path.middle(n)));
            if i > k {
                cells.reverse();
                portals.reverse();
                portals.iter_mut().for_each(|p| *p = p.reversed());
                ends.reverse();
            }
            let clear = self.is_clear(ends[0], ends[1], None);
            Some(Sight { from: ends[0], to: ends[1], cells, portals, clear })
        })
    }

    /// Whether no opaque triangle, except the object's own, obstructs the segment.
    fn is_clear(&self, from: DVec3, to: DVec3, object: Option<ObjectId>) -> Option<bool> {
        let rays = self.rays.as_ref()?;
        Some(rays.is_clear(from, to, 0.5 * rays.tolerance().clearance, object))
    }

    /// The cells and portals along a clear segment from a point in `cell`.
    fn follow(&self, cell: CellId, from: DVec3, to: DVec3) -> Path {
        let length = from.distance(to);
        let direction = (to - from) / length.max(f64::MIN_POSITIVE);
        // A clear segment keeps more than this from the rims of openings; rounding moves windings by less.
        let eps = 0.5 * self.file.tolerance().clearance;
        let mut path = Path { cells: vec![cell], portals: Vec::new(), at: vec![0.0] };
        let (mut cell, mut t) = (cell, 0.0);
        // A line passes a portal at most once.
        for _ in 0..self.graph.portals.len() {
            let hits =
                self.graph.cells[cell.index()].portals.iter().filter(|p| !path.portals.contains(p)).filter_map(|&p| {
                    let plane = self.graph.plane(p);
                    let slope = plane.n.dot(direction);
                    let s = -plane.distance(from) / slope;
                    let beside = self.beside(p, from + direction * s);
                    (slope > 0.0 && s >= t - eps && s <= length + eps && beside <= eps).then_some((s, beside, p))
                });
            let hits: Vec<_> = hits.collect();
            let first = hits.iter().map(|h| h.0).fold(f64::INFINITY, f64::min);
            // If two windings meet there, the one that contains the point.
            let near = hits.iter().filter(|h| h.0 <= first + eps);
            let Some(&(s, _, portal)) = near.min_by(|a, b| a.1.total_cmp(&b.1).then(a.2.cmp(&b.2))) else { break };
            (cell, t) = (self.graph.target(portal), s.clamp(t, length));
            path.cells.push(cell);
            path.portals.push(portal);
            path.at.push(t / length.max(f64::MIN_POSITIVE));
        }
        path.at.push(1.0);
        path
    }

    /// Distance of a point in a portal's plane outside the winding, metres; negative inside.
    fn beside(&self, portal: DirectedPortal, p: DVec3) -> f64 {
        let portal = &self.graph.portals[portal.portal().index()];
        let edges = portal.winding.iter().zip(portal.winding.iter().cycle().skip(1));
        let off = edges.filter_map(|(&a, &b)| Some((b - a).cross(portal.plane.n).try_normalize()?.dot(p - a)));
        off.fold(f64::NEG_INFINITY, f64::max)
    }

    /// The cells reachable through portals.
    fn reached(&self, from: CellId) -> Vec<bool> {
        let mut reached = vec![false; self.graph.cells.len()];
        reached[from.index()] = true;
        let mut queue = vec![from];
        while let Some(cell) = queue.pop() {
            for next in self.graph.cells[cell.index()].portals.iter().map(|&p| self.graph.target(p)) {
                if !std::mem::replace(&mut reached[next.index()], true) {
                    queue.push(next);
                }
            }
        }
        reached
    }
}

fn doubt(flowed: Flowed) -> Doubt {
    match flowed {
        Flowed::Open(chain) => Doubt::Open(chain),
        Flowed::OutOfSteps => Doubt::OutOfSteps,
        Flowed::Separated(found) => Doubt::Separated(found),
    }
}

/// Cells and portals along a segment.
struct Path {
    cells: Vec<CellId>,
    portals: Vec<DirectedPortal>,
    /// Entry into each cell, as a fraction of the segment, and the end.
    at: Vec<f64>,
}

impl Path {
    /// The middle of the `n`-th cell's stretch.
    fn middle(&self, n: usize) -> f64 {
        0.5 * (self.at[n] + self.at[n + 1])
    }
}
