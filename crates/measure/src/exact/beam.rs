//! Traces beams through the hierarchy from near to far and splits those that it cannot decide.

use super::clip::{Behind, Cutter, Point, Rest, SLIVER, middle};
use super::frame::{Cell, Frame, Triangle, value};
use super::tree::Tree;
use super::{Seen, Witness};
use glam::DVec3;

/// A beam with this many triangles is split while it has unopened nodes. More: deciding takes longer. Fewer: more beams.
const ROOM: usize = 24;
/// A beam with at most this many triangles and no nodes is decided. More and fewer: as [`ROOM`].
const FEW: usize = 24;
/// A beam with more triangles than this stays undecided. More: a million needles in one place take for ever. Fewer: fans about
/// one corner stay undecided.
const MOST: usize = 512;
/// Maximum number of parts of a beam. More: crossing slivers take for ever. Fewer: more of a simple scene stays undecided.
const MOST_PARTS: usize = 1 << 22;
/// Flag of an item that is a triangle.
const TRIANGLE: u32 = 1 << 31;
const NONE: u32 = u32::MAX;

/// A node, or a triangle by its number in [`Beams::triangles`], that may lie in a beam.
#[derive(Clone, Copy)]
struct Item {
    id: u32,
    /// Bounds of a node.
    rect: [f64; 4],
    /// Upper limit of its `1/w`.
    near: f64,
}

/// Triangles that together cover a beam: a range of [`Beams::blockers`], and their least `1/w`.
#[derive(Clone, Copy)]
struct Blocked {
    from: usize,
    to: usize,
    far: f64,
}

const OPEN: Blocked = Blocked { from: 0, to: 0, far: 0.0 };

/// State of a triangle.
#[derive(Clone, Copy, PartialEq, Eq)]
enum State {
    Unseen,
    Undecided,
    Visible,
}

/// A part of a beam.
#[derive(Clone, Copy)]
struct Part {
    cell: Cell,
    /// How many further splits are allowed.
    splits: u32,
    /// Limit of triangles while nodes are left.
    room: usize,
}

/// See [`super::Judge`].
pub(super) struct Beams<'t> {
    tree: &'t Tree,
    frame: Frame,
    triangles: Vec<Triangle>,
    /// For each place of the tree: its number in `triangles`.
    numbers: Vec<u32>,
    items: Vec<Item>,
    blockers: Vec<u32>,
    states: Vec<State>,
    visible: Vec<Witness>,
    undecided: Vec<u32>,
    /// Nodes whose triangles are all undecided.
    given_up: Vec<u32>,
    /// Parts of the current beam so far.
    parts: usize,
    cutter: Cutter,
    /// Triangles of the part that is being decided, and the occluders among them.
    sorted: Vec<(f64, u32)>,
    hiding: Vec<u32>,
    picture: Vec<Point>,
}

impl<'t> Beams<'t> {
    pub fn new(tree: &'t Tree) -> Self {
        let count = tree.triangles.len();
        Self {
            tree,
            frame: Frame::new(DVec3::ZERO, DVec3::AXES),
            triangles: Vec::new(),
            numbers: vec![NONE; count],
            items: Vec::new(),
            blockers: Vec::new(),
            states: vec![State::Unseen; count],
            visible: Vec::new(),
            undecided: Vec::new(),
            given_up: Vec::new(),
            parts: 0,
            cutter: Cutter::default(),
            sorted: Vec::new(),
            hiding: Vec::new(),
            picture: Vec::new(),
        }
    }

    /// Adds the visible triangles of a beam to the result.
    pub fn look(&mut self, frame: Frame, splits: u32) {
        self.frame = frame;
        self.parts = 0;
        if !self.tree.nodes.is_empty() {
            self.push_node(0, &Cell::ALL, &OPEN);
            self.part(Part { cell: Cell::ALL, splits, room: ROOM }, 0, OPEN);
        }
        self.items.clear();
        self.blockers.clear();
        for triangle in self.triangles.drain(..) {
            self.numbers[triangle.place as usize] = NONE;
        }
    }

    /// Returns the result and clears it.
    pub fn seen(&mut self) -> Seen {
        let mut is_open = vec![false; if self.given_up.is_empty() { 0 } else { self.tree.nodes.len() }];
        while let Some(n) = self.given_up.pop() {
            if std::mem::replace(&mut is_open[n as usize], true) {
                continue;
            }
            let node = &self.tree.nodes[n as usize];
            if node.count == 0 {
                self.given_up.extend([node.first, node.first + 1]);
            } else {
                (node.first..node.first + node.count).for_each(|place| self.keep(place));
            }
        }
        let mut seen = Seen { visible: std::mem::take(&mut self.visible), undecided: Vec::new() };
        for place in self.undecided.drain(..) {
            if self.states[place as usize] == State::Undecided {
                seen.undecided.push(self.tree.triangles[place as usize]);
            }
            self.states[place as usize] = State::Unseen;
        }
        for witness in &mut seen.visible {
            self.states[witness.triangle as usize] = State::Unseen;
            witness.triangle = self.tree.triangles[witness.triangle as usize];
        }
        seen.visible.sort_unstable_by_key(|w| w.triangle);
        seen.undecided.sort_unstable();
        seen
    }

    fn keep(&mut self, place: u32) {
        if self.states[place as usize] == State::Unseen {
            self.states[place as usize] = State::Undecided;
            self.undecided.push(place);
        }
    }

    /// Adds a node to the list if it may be visible in a cell.
    fn push_node(&mut self, node: u32, cell: &Cell, blocked: &Blocked) {
        if let Some((rect, near)) = self.frame.bounds(&self.tree.nodes[node as usize]) {
            let item = Item { id: node, rect, near };
            if cell.meets(&rect) && !self.is_hidden(&item, blocked) {
                self.items.push(item);
            }
        }
    }

    /// Adds a triangle to the list if it may be visible in a cell. It becomes the blocker if it is nearer than the present one.
    fn push_triangle(&mut self, place: u32, cell: &Cell, blocked: &mut Blocked) {
        let place_number = &mut self.numbers[place as usize];
        if *place_number == NONE {
            let (corners, opaque) = (&self.tree.corners[place as usize], self.tree.opaque[place as usize]);
            let Some(triangle) = self.frame.triangle(corners, place, opaque) else { return };
            *place_number = self.triangles.len() as u32;
            self.triangles.push(triangle);
        }
        let number = *place_number;
        let triangle = &self.triangles[number as usize];
        if !triangle.touches(cell) {
            return;
        }
        let item = Item { id: TRIANGLE | number, rect: [0.0; 4], near: triangle.nearest(cell) };
        if self.is_hidden(&item, blocked) {
            return;
        }
        self.items.push(item);
        self.block(number, cell, blocked);
    }

    /// Makes a triangle the blocker if it covers the cell and is nearer.
    fn block(&mut self, number: u32, cell: &Cell, blocked: &mut Blocked) {
        let triangle = &self.triangles[number as usize];
        if triangle.covers(cell) {
            let far = triangle.farthest(cell);
            if far > blocked.far {
                *blocked = Blocked { from: self.blockers.len(), to: self.blockers.len() + 1, far };
                self.blockers.push(number);
            }
        }
    }

    /// Whether the blockers of a cell hide all of an item there.
    fn is_hidden(&self, item: &Item, blocked: &Blocked) -> bool {
        let blockers = &self.blockers[blocked.from..blocked.to];
        if blockers.is_empty() {
            return false;
        }
        if item.id & TRIANGLE == 0 {
            let node = &self.tree.nodes[item.id as usize];
            return self.is_farther(item.near, blocked)
                || blockers.iter().all(|&b| self.frame.is_behind(node, &self.triangles[b as usize]));
        }
        let triangle = &self.triangles[(item.id & !TRIANGLE) as usize];
        self.is_farther(item.near + triangle.error_at(item.near), blocked)
            || blockers.iter().all(|&b| triangle.is_behind(&self.triangles[b as usize]))
    }

    fn is_farther(&self, near: f64, blocked: &Blocked) -> bool {
        let error = |&b: &u32| self.triangles[b as usize].error_at(blocked.far);
        let blockers = &self.blockers[blocked.from..blocked.to];
        near < blocked.far && near < blocked.far - blockers.iter().map(error).fold(0.0, f64::max)
    }

    /// Drops hidden items from `start` on.
    fn drop_hidden(&mut self, start: usize, blocked: &Blocked) {
        let mut kept = start;
        for i in start..self.items.len() {
            let item = self.items[i];
            if !self.is_hidden(&item, blocked) {
                self.items[kept] = item;
                kept += 1;
            }
        }
        self.items.truncate(kept);
    }

    /// Counts the triangles from `start` on and finds the nearest node.
    fn survey(&self, start: usize) -> (usize, Option<usize>) {
        let (mut triangles, mut nearest) = (0, None);
        let mut near = f64::NEG_INFINITY;
        for (i, item) in self.items.iter().enumerate().skip(start) {
            if item.id & TRIANGLE != 0 {
                triangles += 1;
            } else if item.near > near {
                (near, nearest) = (item.near, Some(i));
            }
        }
        (triangles, nearest)
    }

    /// Decides a part of a beam; its items begin at `start`.
    fn part(&mut self, part: Part, start: usize, mut blocked: Blocked) {
        let cell = &part.cell;
        let mut tested = 0;
        loop {
            let (count, nearest) = self.survey(start);
            let Some(nearest) = nearest else {
                return self.without_nodes(part, start, count, blocked);
            };
            if count < part.room {
                let before = blocked.far;
                self.open(nearest, cell, &mut blocked);
                if blocked.far > before {
                    self.drop_hidden(start, &blocked);
                }
                continue;
            }
            if count > tested && self.close(start, cell, &mut blocked) {
                self.drop_hidden(start, &blocked);
                tested = count;
                continue;
            }
            return self.split(part, start, count, blocked);
        }
    }

    /// Replaces a node with its children or triangles.
    fn open(&mut self, item: usize, cell: &Cell, blocked: &mut Blocked) {
        let node = &self.tree.nodes[self.items.swap_remove(item).id as usize];
        let (first, count) = (node.first, node.count);
        if count == 0 {
            self.push_node(first, cell, blocked);
            self.push_node(first + 1, cell, blocked);
        } else {
            (first..first + count).for_each(|place| self.push_triangle(place, cell, blocked));
        }
    }

    fn without_nodes(&mut self, part: Part, start: usize, count: usize, blocked: Blocked) {
        let is_known = |item: &Item| {
            let place = self.triangles[(item.id & !TRIANGLE) as usize].place;
            self.states[place as usize] == State::Visible
        };
        if self.items[start..].iter().all(is_known) {
            return;
        }
        if count <= FEW.max(part.room / 2) || part.splits == 0 {
            self.decide(part, start);
        } else {
            self.split(part, start, count, blocked);
        }
    }

    /// Splits a part of a beam, or gives it up at a limit.
    fn split(&mut self, part: Part, start: usize, count: usize, blocked: Blocked) {
        if part.splits == 0 || part.room > MOST || self.parts > MOST_PARTS {
            return self.give_up(start);
        }
        self.parts += 4;
        let end = self.items.len();
        let blockers = self.blockers.len();
        for cell in part.cell.quarters() {
            let mut blocked = blocked;
            if blocked.to == blocked.from + 1 {
                blocked.far = self.triangles[self.blockers[blocked.from] as usize].farthest(&cell);
            }
            let before = blocked.far;
            let mut triangles = 0;
            for i in start..end {
                let item = self.items[i];
                if item.id & TRIANGLE == 0 {
                    if cell.meets(&item.rect) {
                        self.items.push(item);
                    }
                    continue;
                }
                let number = item.id & !TRIANGLE;
                let triangle = &self.triangles[number as usize];
                if triangle.touches(&cell) {
                    triangles += 1;
                    self.items.push(Item { near: triangle.nearest(&cell), ..item });
                    self.block(number, &cell, &mut blocked);
                }
            }
            if blocked.to > blocked.from && (blocked.far > before || triangles > 0) {
                self.drop_hidden(end, &blocked);
            }
            // If many triangles meet in one point, splitting does not separate them.
            let room = if triangles * 8 > count * 7 { part.room * 2 } else { part.room };
            self.part(Part { cell, splits: part.splits - 1, room }, end, blocked);
            self.items.truncate(end);
            self.blockers.truncate(blockers);
        }
    }

    /// Leaves all items from `start` on undecided.
    fn give_up(&mut self, start: usize) {
        for i in start..self.items.len() {
            let id = self.items[i].id;
            if id & TRIANGLE == 0 {
                self.given_up.push(id);
            } else {
                self.keep(self.triangles[(id & !TRIANGLE) as usize].place);
            }
        }
    }

    /// Lists the triangles from `start` on, near ones first, and the occluders among them.
    fn list(&mut self, start: usize) {
        self.sorted.clear();
        for item in self.items[start..].iter().filter(|item| item.id & TRIANGLE != 0) {
            self.sorted.push((item.near, item.id & !TRIANGLE));
        }
        self.sorted.sort_unstable_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        self.hiding.clear();
        let hides = |&&(_, number): &&(f64, u32)| self.triangles[number as usize].hides();
        self.hiding.extend(self.sorted.iter().filter(hides).map(|l| l.1));
    }

    /// Finds triangles that together cover a cell.
    fn close(&mut self, start: usize, cell: &Cell, blocked: &mut Blocked) -> bool {
        self.list(start);
        let from = self.blockers.len();
        let mut far = f64::INFINITY;
        let Self { cutter, triangles, blockers, hiding, .. } = self;
        let on_hidden = |number: u32, polygon: &[Point]| {
            if !blockers[from..].contains(&number) {
                blockers.push(number);
            }
            let inverse = &triangles[number as usize].inverse;
            far = polygon.iter().map(|&p| value(inverse, p)).fold(far, f64::min);
        };
        let rest = cutter.cut(&cell.corners(), triangles, hiding, Behind::Anything, on_hidden, |_| true);
        if rest != Rest::Nothing || far <= blocked.far {
            self.blockers.truncate(from);
            return false;
        }
        *blocked = Blocked { from, to: self.blockers.len(), far };
        true
    }

    /// Decides the triangles from `start` on. The part has no other items.
    fn decide(&mut self, part: Part, start: usize) {
        self.list(start);
        if self.sorted.len() > MOST {
            return self.give_up(start);
        }
        for i in 0..self.sorted.len() {
            let number = self.sorted[i].1;
            let triangle = &self.triangles[number as usize];
            if self.states[triangle.place as usize] == State::Visible {
                continue;
            }
            if triangle.thin {
                self.decide_thin(number, &part.cell);
                continue;
            }
            let mut picture = std::mem::take(&mut self.picture);
            self.cutter.picture(&part.cell, triangle, &mut picture);
            if !picture.is_empty() && !self.shows(number, middle(&picture)) {
                self.decide_one(number, &picture);
            }
            self.picture = picture;
        }
    }

    /// Decides a triangle, given its unoccluded picture.
    fn decide_one(&mut self, number: u32, picture: &[Point]) {
        let mut cutter = std::mem::take(&mut self.cutter);
        let hiding = std::mem::take(&mut self.hiding);
        let triangles = std::mem::take(&mut self.triangles);
        let triangle = &triangles[number as usize];
        let behind = Behind::Triangle(triangle);
        let rest = cutter.cut(picture, &triangles, &hiding, behind, |_, _| {}, |at| self.witness(&triangles, number, at));
        if rest != Rest::Nothing {
            self.keep(triangle.place);
        }
        (self.cutter, self.hiding, self.triangles) = (cutter, hiding, triangles);
    }

    /// Decides a triangle whose edges are within rounding: it is hidden if everything around it is hidden.
    fn decide_thin(&mut self, number: u32, cell: &Cell) {
        let triangle = &self.triangles[number as usize];
        let [u0, u1, v0, v1] = triangle.outline();
        // Anything narrower than a sliver counts as closed.
        let [u0, u1, v0, v1] = [u0 - 4.0 * SLIVER, u1 + 4.0 * SLIVER, v0 - 4.0 * SLIVER, v1 + 4.0 * SLIVER];
        let around = Cell { u: [u0.max(cell.u[0]), u1.min(cell.u[1])], v: [v0.max(cell.v[0]), v1.min(cell.v[1])] };
        let behind = Behind::Thin(triangle, triangle.nearest(cell));
        let rest = self.cutter.cut(&around.corners(), &self.triangles, &self.hiding, behind, |_, _| {}, |_| true);
        if rest != Rest::Nothing {
            self.keep(triangle.place);
        }
    }

    fn shows(&mut self, number: u32, at: Point) -> bool {
        let triangles = std::mem::take(&mut self.triangles);
        let shows = self.witness(&triangles, number, at);
        self.triangles = triangles;
        shows
    }

    /// Whether triangle `number` is visible at a point. Marks it as visible, or the nearer one that hides it.
    fn witness(&mut self, triangles: &[Triangle], number: u32, at: Point) -> bool {
        let (mut nearest, mut near, mut error) = (NONE, 0.0, 0.0);
        for &(most, other) in &self.sorted {
            if most < near {
                break;
            }
            let triangle = &triangles[other as usize];
            let holds = |k: usize| value(&triangle.edges[k], at) >= -triangle.slack[k];
            if triangle.hides() && holds(0) && holds(1) && holds(2) {
                let inverse = value(&triangle.inverse, at);
                if inverse > near {
                    (nearest, near, error) = (other, inverse, triangle.error_at(inverse));
                }
            }
        }
        let mut meets = |number: u32| {
            let triangle = &triangles[number as usize];
            let inverse = value(&triangle.inverse, at);
            let holds = |k: usize| value(&triangle.edges[k], at) > triangle.slack[k];
            let shows = holds(0) && holds(1) && holds(2) && inverse >= near - error - triangle.error_at(inverse);
            let state = &mut self.states[triangle.place as usize];
            if shows && *state != State::Visible {
                *state = State::Visible;
                self.visible.push(Witness { triangle: triangle.place, direction: self.frame.direction(at) });
            }
            shows
        };
        if nearest != NONE && nearest != number {
            meets(nearest);
        }
        meets(number)
    }
}
