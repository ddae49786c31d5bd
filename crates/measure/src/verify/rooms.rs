//! Scores cells and portals against rooms and doors that a model's author annotated (`check --rooms`).
//!
//! A cell finds a room if their volumes have an intersection over union (Jaccard 1901) of at least a half. Rooms separated only
//! by virtual boundaries may be one cell or several, so a cell is also compared with the union of those rooms of such a group of
//! which it holds the larger half. Shared volumes are counted on a regular grid in each room; volumes of cells are exact. Rooms
//! under the open sky belong to the outside and are not scored.

use super::cells::Cells;
use enfilade::CellId;
use enfilade::file::PvsFile;
use enfilade::math::geom::Aabb;
use enfilade::math::parallel;
use glam::{DVec2, DVec3};
use serde::{Deserialize, Serialize};
use std::collections::{BTreeMap, BTreeSet};

/// The same share for the rooms listed of a wrong cell.
const SMALL_PART: f64 = 0.05;

/// A cell and a room overlap from this share of the volume of either.
const PART: f64 = 0.1;

/// Annotated rooms and doors: metres, +Y up, in the model's own coordinates.
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub struct RoomsFile {
    /// Rooms.
    pub rooms: Vec<Room>,
    /// Doors, windows, passages.
    #[serde(default)]
    pub doors: Vec<Door>,
    /// Openings in slabs, and horizontal boundaries without a slab.
    #[serde(default)]
    pub voids: Vec<Void>,
}

/// A room: an upright prism or a closed mesh.
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub struct Room {
    /// Its id.
    pub id: String,
    /// Its name.
    #[serde(default)]
    pub name: String,
    /// Height of its floor.
    pub floor_y: f64,
    /// Height of its ceiling.
    pub ceiling_y: f64,
    /// Polygons of rings of `[x, z]`; the first ring of each is its outline, the others are holes.
    pub footprint: Vec<Vec<Vec<[f64; 2]>>>,
    /// Share of it that has a ceiling: below 0.5 it is open air.
    #[serde(default = "one")]
    pub covered: f64,
    /// Its surface, unless it is a prism.
    #[serde(default)]
    pub solid: Option<Solid>,
}

/// A closed mesh.
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub struct Solid {
    /// Corners.
    pub v: Vec<[f64; 3]>,
    /// Triangles.
    pub t: Vec<[usize; 3]>,
}

/// A door, window or passage.
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub struct Door {
    /// Its id.
    pub id: String,
    /// `door`, `window`, `opening` or `virtual`.
    pub kind: String,
    /// The middle of the opening.
    pub centre: [f64; 3],
    /// Its rooms: on the side of the normal, and on the other side; none for the outside or an unlisted space.
    pub rooms: [Option<String>; 2],
}

/// An opening in a slab, or a horizontal boundary.
#[derive(Clone, PartialEq, Debug, Deserialize)]
pub struct Void {
    /// `slab_opening`, `stair` or `virtual_boundary`.
    pub kind: String,
    /// `x y z` of the least corner, then of the greatest.
    pub bbox: [f64; 6],
}

fn one() -> f64 {
    1.0
}

/// How well cells fit rooms.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct RoomScore {
    /// Rooms that have a roof.
    pub rooms: usize,
    /// Rooms that a cell finds.
    pub rooms_found: usize,
    /// `rooms_found / rooms`.
    pub recall: f64,
    /// Closed cells of which at least a tenth lies in rooms.
    pub cells: usize,
    /// Cells that find a room.
    pub cells_right: usize,
    /// `cells_right / cells`; 0 if there are rooms and no cell lies in any.
    pub precision: f64,
    /// Closed cells in no annotated room: shafts, attics, plenums, rooms that the author left out.
    pub unlisted: usize,
    /// Mean over the rooms of the best intersection over union, found or not.
    pub mean_iou: f64,
    /// Rooms that no cell finds and several cells share.
    pub over_segmented: usize,
    /// Cells that hold the larger half of several rooms separated by walls.
    pub under_segmented: usize,
    /// Doors, apart from those within one cell.
    pub doors: OpeningScore,
    /// Windows.
    pub windows: OpeningScore,
    /// Rooms that no cell finds.
    pub lost: Vec<Lost>,
    /// Cells in rooms that find none.
    pub wrong: Vec<Wrong>,
}

/// Doors or windows.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct OpeningScore {
    /// Number of annotated openings.
    pub count: usize,
    /// Openings with the middle of a portal within 0.6 m of their own.
    pub located: usize,
    /// Openings for which such a portal joins the cells of their rooms.
    pub joining: usize,
    /// `located / count`; 1 if there are none.
    pub located_share: f64,
    /// `joining / count`; 1 if there are none.
    pub joining_share: f64,
    /// Ids of openings that are not joined, with the portals found there.
    pub lost: Vec<String>,
}

/// A room that no cell finds.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Lost {
    /// Its id.
    pub id: String,
    /// Its name.
    pub name: String,
    /// Its best intersection over union with a cell.
    pub iou: f64,
    /// The cell of that intersection.
    pub cell: Option<CellId>,
}

/// A cell that finds no room.
#[derive(Clone, PartialEq, Debug, Serialize)]
pub struct Wrong {
    /// The cell.
    pub cell: CellId,
    /// Its volume, cubic metres.
    pub volume: f64,
    /// Rooms that it overlaps: name, share of the room.
    pub rooms: Vec<(String, f64)>,
}

/// Least intersection over union with which a cell finds a room.
const FOUND: f64 = 0.5;
/// Greatest distance between the middles of a door and its portal, metres.
const LOCATED: f64 = 0.6;
/// Approximate number of points per room.
const POINTS: f64 = 20_000.0;

/// Scores a file's cells and portals against rooms and doors.
pub(super) fn score(file: &PvsFile, cells: &Cells, written: &RoomsFile) -> RoomScore {
    let mut comparison = Comparison::new(file, cells, written);
    let mut score = RoomScore {
        rooms: written.rooms.iter().filter(|r| has_roof(r)).count(),
        rooms_found: 0,
        recall: 1.0,
        cells: 0,
        cells_right: 0,
        precision: 1.0,
        unlisted: 0,
        mean_iou: 0.0,
        over_segmented: 0,
        under_segmented: 0,
        doors: OpeningScore::new(),
        windows: OpeningScore::new(),
        lost: Vec::new(),
        wrong: Vec::new(),
    };
    for (c, cell) in file.cells.iter().enumerate().filter(|(_, c)| !c.open) {
        comparison.score_cell(CellId(c as u32), !cell.pieces.is_empty(), &mut score);
    }
    comparison.score_rooms(&mut score);
    comparison.score_openings(file, &mut score);
    score
}

/// Whether a room is scored: most of it has a ceiling.
fn has_roof(room: &Room) -> bool {
    room.covered >= 0.5
}

/// Shared volumes of rooms and cells.
struct Comparison<'c> {
    written: &'c RoomsFile,
    cells: &'c Cells,
    /// By room: its volume, and the volume shared with each cell, cubic metres.
    measured: Vec<(f64, BTreeMap<CellId, f64>)>,
    /// By cell: the rooms that it overlaps.
    of_cell: BTreeMap<CellId, Vec<usize>>,
    /// By room: the number of its group, joined by virtual boundaries.
    group: Vec<usize>,
    /// By room: the best intersection over union so far, and its cell.
    best: Vec<(f64, Option<CellId>)>,
}

impl<'c> Comparison<'c> {
    fn new(file: &PvsFile, cells: &'c Cells, written: &'c RoomsFile) -> Self {
        let shapes: Vec<Shape> = written.rooms.iter().map(|r| Shape::new(r, file.origin)).collect();
        let measured: Vec<(f64, BTreeMap<CellId, f64>)> = parallel::map(&shapes, |s| s.measure(cells));
        let mut of_cell: BTreeMap<CellId, Vec<usize>> = BTreeMap::new();
        for (room, (_, cells)) in measured.iter().enumerate() {
            for &cell in cells.keys() {
                of_cell.entry(cell).or_default().push(room);
            }
        }
        let group = groups(written, &shapes, file.origin);
        Self { written, cells, measured, of_cell, group, best: vec![(0.0, None); shapes.len()] }
    }

    fn volume(&self, room: usize) -> f64 {
        self.measured[room].0
    }

    fn shared(&self, room: usize, cell: CellId) -> f64 {
        self.measured[room].1.get(&cell).copied().unwrap_or_default()
    }

    /// The volume that a cell shares with some rooms, cubic metres.
    fn inside(&self, cell: CellId, rooms: &[usize]) -> f64 {
        rooms.iter().map(|&r| self.shared(r, cell)).sum()
    }

    /// Intersection over union of a cell with some rooms.
    fn iou(&self, cell: CellId, rooms: &[usize]) -> f64 {
        let inside = self.inside(cell, rooms);
        let union = self.cells.volume(cell) + rooms.iter().map(|&r| self.volume(r)).sum::<f64>() - inside;
        inside / union.max(f64::MIN_POSITIVE)
    }

    /// Compares a closed cell with its rooms, one by one and group by group.
    fn score_cell(&mut self, id: CellId, has_pieces: bool, score: &mut RoomScore) {
        let rooms = self.of_cell.get(&id).cloned().unwrap_or_default();
        let mut finds = false;
        let mut held: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for &room in &rooms {
            let alone = self.iou(id, &[room]);
            finds |= self.finds(id, alone, &[room]);
            if self.shared(room, id) >= 0.5 * self.volume(room) {
                held.entry(self.group[room]).or_default().push(room);
            }
        }
        for rooms in held.values() {
            let together = self.iou(id, rooms);
            finds |= self.finds(id, together, rooms);
        }
        if finds {
            score.cells += 1;
            score.cells_right += 1;
        } else if self.inside(id, &rooms) >= PART * self.cells.volume(id) {
            score.cells += 1;
            let rooms = rooms.iter().filter(|&&r| self.shared(r, id) >= SMALL_PART * self.volume(r));
            let name = |&r: &usize| (self.written.rooms[r].name.clone(), rounded(self.shared(r, id) / self.volume(r)));
            let rooms = rooms.map(name).collect();
            score.wrong.push(Wrong { cell: id, volume: rounded(self.cells.volume(id)), rooms });
        } else if has_pieces {
            score.unlisted += 1;
        }
        score.under_segmented += usize::from(held.len() > 1);
    }

    /// Whether a cell with this intersection over union finds some rooms; records it if it is the best.
    fn finds(&mut self, cell: CellId, iou: f64, rooms: &[usize]) -> bool {
        for &room in rooms {
            if iou > self.best[room].0 {
                self.best[room] = (iou, Some(cell));
            }
        }
        iou >= FOUND
    }

    /// Counts found rooms and computes recall and precision.
    fn score_rooms(&self, score: &mut RoomScore) {
        let rooms = self.written.rooms.iter().zip(&self.best).enumerate();
        for (room, (Room { id, name, .. }, &(found, cell))) in rooms.filter(|(_, (r, _))| has_roof(r)) {
            score.mean_iou += found / score.rooms.max(1) as f64;
            if found >= FOUND {
                score.rooms_found += 1;
                continue;
            }
            let large = self.measured[room].1.values().filter(|&&v| v >= PART * self.volume(room)).count();
            score.over_segmented += usize::from(large > 1);
            score.lost.push(Lost { id: id.clone(), name: name.clone(), iou: rounded(found), cell });
        }
        score.recall = share(score.rooms_found, score.rooms);
        // If no cell lies in a room, none is right.
        score.precision = if score.cells == 0 && score.rooms > 0 { 0.0 } else { share(score.cells_right, score.cells) };
    }

    /// Doors and windows, by the cell that holds most of each room.
    fn score_openings(&self, file: &PvsFile, score: &mut RoomScore) {
        let most = |room: usize| {
            let by_share = self.measured[room].1.iter().max_by(|a, b| a.1.total_cmp(b.1).then(b.0.cmp(a.0)));
            by_share.map(|(&cell, _)| cell)
        };
        let number: BTreeMap<&str, usize> = self.written.rooms.iter().enumerate().map(|(i, r)| (r.id.as_str(), i)).collect();
        for door in &self.written.doors {
            let rooms = door.rooms.each_ref().map(|r| r.as_deref().and_then(|id| number.get(id).copied()));
            let cells = rooms.map(|r| r.and_then(most));
            let of_group = rooms.map(|r| r.map(|r| self.group[r]));
            let one = cells[0].is_some() && cells[0] == cells[1] && of_group[0] == of_group[1];
            match door.kind.as_str() {
                // A door in the middle of one cell that stands for both rooms needs no portal.
                "door" | "opening" if !one => score.doors.add(file, door, cells),
                "window" if !one && rooms != [None, None] => score.windows.add(file, door, cells),
                _ => {}
            }
        }
        score.doors.finish();
        score.windows.finish();
    }
}

/// The number of each room's group.
fn groups(written: &RoomsFile, shapes: &[Shape], origin: DVec3) -> Vec<usize> {
    let mut parent: Vec<usize> = (0..shapes.len()).collect();
    fn find(parent: &[usize], mut i: usize) -> usize {
        while parent[i] != i {
            i = parent[i];
        }
        i
    }
    let mut join = |a: usize, b: usize| {
        let (a, b) = (find(&parent, a), find(&parent, b));
        parent[a.max(b)] = a.min(b);
    };
    for door in written.doors.iter().filter(|d| d.kind == "virtual") {
        let [a, b] = door.rooms.each_ref().map(|id| written.rooms.iter().position(|r| Some(&r.id) == id.as_ref()));
        if let (Some(a), Some(b)) = (a, b) {
            join(a, b);
        }
    }
    // A horizontal boundary joins the rooms directly above and below it.
    for void in written.voids.iter().filter(|v| v.kind == "virtual_boundary") {
        let [x0, y0, z0, x1, y1, z1] = void.bbox;
        let slab = Aabb { min: DVec3::new(x0, y0, z0) - origin, max: DVec3::new(x1, y1, z1) - origin };
        let middle = slab.centre();
        let touches = |s: &Shape| {
            let reach = Aabb { min: s.bounds.min - DVec3::Y * 0.35, max: s.bounds.max + DVec3::Y * 0.35 };
            reach.contains(middle) && s.covers(DVec2::new(middle.x, middle.z))
        };
        let near: Vec<usize> = (0..shapes.len()).filter(|&r| touches(&shapes[r])).collect();
        near.windows(2).for_each(|pair| join(pair[0], pair[1]));
    }
    (0..shapes.len()).map(|r| find(&parent, r)).collect()
}

impl OpeningScore {
    fn new() -> Self {
        Self { count: 0, located: 0, joining: 0, located_share: 1.0, joining_share: 1.0, lost: Vec::new() }
    }

    fn add(&mut self, file: &PvsFile, door: &Door, cells: [Option<CellId>; 2]) {
        self.count += 1;
        let centre = DVec3::from_array(door.centre) - file.origin;
        let middle = |w: &[glam::Vec3]| Aabb::of(w.iter().map(|p| p.as_dvec3())).centre();
        let near: Vec<[CellId; 2]> =
            file.portals.iter().filter(|p| middle(&p.winding).distance(centre) <= LOCATED).map(|p| p.cells).collect();
        self.located += usize::from(!near.is_empty());
        // A side without a room may be any cell but the other side's.
        let joins = |&[p, q]: &[CellId; 2]| match cells {
            [Some(a), Some(b)] => (p, q) == (a, b) || (p, q) == (b, a),
            [Some(a), None] | [None, Some(a)] => p == a || q == a,
            [None, None] => true,
        };
        if near.iter().any(joins) {
            self.joining += 1;
        } else {
            let there: BTreeSet<String> = near.iter().map(|[p, q]| format!("{p}-{q}")).collect();
            let name = |c: Option<CellId>| c.map_or("-".to_owned(), |c| c.to_string());
            let there: Vec<String> = there.into_iter().collect();
            self.lost.push(format!("{}: joins {} and {}, found {there:?}", door.id, name(cells[0]), name(cells[1])));
        }
    }

    fn finish(&mut self) {
        self.located_share = share(self.located, self.count);
        self.joining_share = share(self.joining, self.count);
    }
}

fn share(part: usize, whole: usize) -> f64 {
    if whole == 0 { 1.0 } else { part as f64 / whole as f64 }
}

fn rounded(x: f64) -> f64 {
    (x * 1000.0).round() / 1000.0
}

/// A room's volume, relative to the file's origin.
struct Shape {
    rings: Vec<Vec<DVec2>>,
    solid: Vec<[DVec3; 3]>,
    bounds: Aabb,
}

impl Shape {
    fn new(room: &Room, origin: DVec3) -> Self {
        let flat = DVec2::new(origin.x, origin.z);
        let rings: Vec<Vec<DVec2>> =
            room.footprint.iter().flatten().map(|r| r.iter().map(|&p| DVec2::from_array(p) - flat).collect()).collect();
        let corner = |s: &Solid, i: usize| s.v.get(i).map(|&p| DVec3::from_array(p) - origin);
        let triangle = |s: &Solid, t: &[usize; 3]| Some([corner(s, t[0])?, corner(s, t[1])?, corner(s, t[2])?]);
        let solid: Vec<[DVec3; 3]> = room.solid.iter().flat_map(|s| s.t.iter().filter_map(|t| triangle(s, t))).collect();
        let (low, high) = (room.floor_y - origin.y, room.ceiling_y - origin.y);
        let prism = rings.iter().flatten().flat_map(|p| [low, high].map(|y| DVec3::new(p.x, y, p.y)));
        let bounds = if solid.is_empty() { Aabb::of(prism) } else { Aabb::of(solid.iter().flatten().copied()) };
        Self { rings, solid, bounds }
    }

    /// Whether the footprint covers a point of the plan (even-odd).
    fn covers(&self, p: DVec2) -> bool {
        let crosses = |ring: &Vec<DVec2>| {
            let edges = ring.iter().zip(ring.iter().cycle().skip(1));
            edges.filter(|(a, b)| (a.y > p.y) != (b.y > p.y) && p.x < a.x + (b.x - a.x) * (p.y - a.y) / (b.y - a.y)).count()
        };
        self.rings.iter().map(crosses).sum::<usize>() % 2 == 1
    }

    fn holds(&self, p: DVec3) -> bool {
        if self.solid.is_empty() {
            return self.covers(DVec2::new(p.x, p.z));
        }
        let above = |t: &&[DVec3; 3]| {
            let n = (t[1] - t[0]).cross(t[2] - t[0]);
            let side = |a: DVec3, b: DVec3| (b.x - a.x) * (p.z - a.z) - (b.z - a.z) * (p.x - a.x) > 0.0;
            let s = [side(t[0], t[1]), side(t[1], t[2]), side(t[2], t[0])];
            s[0] == s[1] && s[1] == s[2] && n.y != 0.0 && p.y < t[0].y - (n.x * (p.x - t[0].x) + n.z * (p.z - t[0].z)) / n.y
        };
        self.solid.iter().filter(above).count() % 2 == 1
    }

    /// Its volume and the part shared with each cell, cubic metres, counted on a grid that avoids round coordinates.
    fn measure(&self, cells: &Cells) -> (f64, BTreeMap<CellId, f64>) {
        let size = self.bounds.size();
        if !size.is_finite() || size.min_element() <= 0.0 {
            return (0.0, BTreeMap::new());
        }
        let step = (size.element_product() / POINTS).cbrt();
        let n = (size / step).ceil().max(DVec3::splat(2.0)).min(DVec3::splat(2_000.0));
        let (mut all, mut shared) = (0u64, BTreeMap::new());
        for i in 0..n.x as u64 {
            for j in 0..n.y as u64 {
                for k in 0..n.z as u64 {
                    let at = (DVec3::new(i as f64, j as f64, k as f64) + DVec3::new(0.4951, 0.5073, 0.5028)) / n;
                    let p = self.bounds.min + size * at;
                    if self.holds(p) {
                        all += 1;
                        if let Some(cell) = cells.locate(p) {
                            *shared.entry(cell).or_insert(0u64) += 1;
                        }
                    }
                }
            }
        }
        let each = size.element_product() / n.element_product();
        (all as f64 * each, shared.into_iter().map(|(cell, count)| (cell, count as f64 * each)).collect())
    }
}
