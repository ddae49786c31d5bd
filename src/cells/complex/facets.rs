//! The splitting planes: vertical ones (walls, as lines in plan) and all others (sheets: floors, ceilings, roofs, ramps).

use super::to_plan;
use crate::cells::scale::HumanScale;
use crate::math::geom::{Aabb, Plane, newell};
use crate::scene::bulk::bulk;
use crate::scene::{OpeningKind, Role, Scene};
use glam::{DVec2, DVec3};
use std::collections::{HashMap, HashSet};

/// A component of a unit normal below this is rounding.
const ROUNDING: f64 = 1e-9;

/// A triangle on a wall or a sheet.
#[derive(Clone, Copy, Debug)]
pub struct Facet {
    /// Corners.
    pub corners: [DVec3; 3],
    /// Index of its wall or sheet.
    pub owner: u32,
    /// Its effect on a face.
    pub matter: Matter,
    /// Whether its front faces the same way as the owner's normal.
    pub front: bool,
}

/// A triangle's effect on the faces it lies on.
#[derive(Clone, Copy, PartialEq, Eq, Hash, Debug)]
pub enum Matter {
    /// It closes the faces that it lies on.
    Opaque,
    /// A door leaf or a pane: its faces stay open, but rooms end there.
    Leaf,
    /// The side of an authored room: only a line in plan.
    Drawing,
}

/// A vertical plane, as a line in plan.
#[derive(Clone, Debug)]
pub struct Wall {
    /// Unit normal in plan.
    pub normal: DVec2,
    /// `normal . q = offset` on the line, metres.
    pub offset: f64,
    /// Spans along the line (`along . q`) with enough wall to cut, metres.
    pub spans: Vec<(f64, f64)>,
}

impl Wall {
    /// The direction of the line: the normal rotated right, so that the normal points left of it.
    pub fn along(&self) -> DVec2 {
        DVec2::new(self.normal.y, -self.normal.x)
    }

    /// The point at `u` metres along the line.
    pub fn at(&self, u: f64) -> DVec2 {
        self.along() * u + self.normal * self.offset
    }
}

/// A plane that isn't vertical; its normal points up.
#[derive(Clone, Debug)]
pub struct Sheet {
    /// `n.y > 0`.
    pub plane: Plane,
    /// The edges of its outline that cut the plan.
    pub outline: Vec<(DVec2, DVec2)>,
}

impl Sheet {
    /// Height above a point of the plan, metres.
    pub fn height(&self, q: DVec2) -> f64 {
        let n = self.plane.n;
        (self.plane.d - n.x * q.x + n.z * q.y) / n.y
    }
}

/// All splitting planes, and their triangles.
#[derive(Debug, Default)]
pub struct Facets {
    /// Vertical planes.
    pub walls: Vec<Wall>,
    /// Triangles on walls.
    pub wall_facets: Vec<Facet>,
    /// Other planes.
    pub sheets: Vec<Sheet>,
    /// Triangles on sheets.
    pub sheet_facets: Vec<Facet>,
}

/// Planes with a smaller `n.y` are neither walls nor sheets (steeper than about 87 degrees).
const STEEPEST_SHEET: f64 = 0.05;

/// Panes at least this high and wide separate rooms like walls, metres.
const PANE_HEIGHT: f64 = 2.0;
const PANE_WIDTH: f64 = 2.5;

/// A triangle, twice its area times its normal, its matter.
type Loose = ([DVec3; 3], DVec3, Matter);

/// Groups the triangles that bound rooms into planes, to within `coplanar` metres at every corner; larger triangles first, so that the
/// largest member defines the plane. A large ground counts only near walls. `scale`: factor on the smallest area that cuts.
pub fn facets(scene: &Scene, coplanar: f64, seal: f64, human: HumanScale, with_rooms: bool, scale: f64) -> Facets {
    let mut loose: Vec<Loose> = Vec::new();
    let mut add = |c: [DVec3; 3], matter: Matter| loose.push((c, newell(&c.map(|p| p - c[0])), matter));
    let part = bulk(scene);
    let is_near = |c: &[DVec3; 3]| part.is_none_or(|part| part.touches(&Aabb::of(*c)));
    for object in scene.objects.iter().filter(|o| matches!(o.role, Role::Structure | Role::Unknown)) {
        let matter = if object.opaque { Matter::Opaque } else { Matter::Leaf };
        object.triangles.clone().map(|t| scene.corners(t as usize)).filter(is_near).for_each(|c| add(c, matter));
    }
    // A pane as high as a door and wider may replace a wall, if the model has no window openings.
    let unsaid = !scene.hints.openings.iter().any(|o| o.kind == OpeningKind::Window);
    let glass = |size: DVec3| size.y >= human.metre * PANE_HEIGHT && size.x.max(size.z) >= human.metre * PANE_WIDTH;
    for object in scene.objects.iter().filter(|o| unsaid && o.role == Role::Window && !o.opaque && glass(o.bounds.size())) {
        object.triangles.clone().for_each(|t| add(scene.corners(t as usize), Matter::Leaf));
    }
    for opening in scene.hints.openings.iter().filter(|o| matches!(o.kind, OpeningKind::Door | OpeningKind::Window)) {
        let w = &opening.winding;
        (2..w.len()).for_each(|i| add([w[0], w[i - 1], w[i]], Matter::Leaf));
    }
    if with_rooms {
        scene.hints.rooms.iter().flat_map(|r| r.surface.iter()).for_each(|&c| add(c, Matter::Drawing));
    }
    loose.retain(|(_, n, _)| n.length_squared() > 0.0);
    loose.sort_by(|a, b| b.1.length_squared().total_cmp(&a.1.length_squared()));
    // Duplicate triangles count once: the area decides about cuts.
    let key = |c: &[DVec3; 3]| {
        let mut bits = c.map(|p| p.to_array().map(f64::to_bits));
        bits.sort_unstable();
        bits
    };
    let mut known = HashSet::new();
    loose.retain(|(corners, _, matter)| known.insert((key(corners), *matter)));
    let mut found = Facets::default();
    walls(&loose, coplanar, seal, human.least_wall() * scale, &mut found);
    sheets(&loose, coplanar, human.least_sheet() * scale, &mut found);
    found
}

/// Hash of planes by direction and offset, to find the planes near a point.
struct Index<K> {
    /// Largest distance of a point from the origin, metres.
    reach: f64,
    cell: f64,
    /// For each key, a direction, and the planes by their distance along it.
    shelves: HashMap<K, (DVec3, HashMap<i64, Vec<u32>>)>,
}

impl<K: std::hash::Hash + Eq> Index<K> {
    fn new(reach: f64, coplanar: f64) -> Self {
        // Normals of one key differ by at most 0.02, so a plane is in at most 50 cells, and usually in one.
        Self { reach, cell: (8.0 * coplanar).max(1e-3 * reach), shelves: HashMap::new() }
    }

    fn add(&mut self, key: K, normal: DVec3, offset: f64, plane: u32) {
        let (direction, cells) = self.shelves.entry(key).or_insert((normal, HashMap::new()));
        let cos = direction.dot(normal);
        // Not from the cosine, whose rounding error is a thousand times larger.
        let slip = self.reach * (normal - *direction * cos).length();
        let at = |x: f64| (x / self.cell).floor() as i64;
        for i in at(offset * cos - slip)..=at(offset * cos + slip) {
            cells.entry(i).or_default().push(plane);
        }
    }

    /// Planes of the given keys that may be within `coplanar` metres of a point.
    fn near(&self, keys: impl IntoIterator<Item = K>, p: DVec3, coplanar: f64) -> impl Iterator<Item = u32> {
        let shelves = keys.into_iter().filter_map(|key| self.shelves.get(&key));
        shelves.flat_map(move |(direction, cells)| {
            let (at, slack) = (direction.dot(p), 1.5 * coplanar);
            let range = ((at - slack) / self.cell).floor() as i64..=((at + slack) / self.cell).floor() as i64;
            range.filter_map(|i| cells.get(&i)).flatten().copied()
        })
    }
}

/// Largest distance of a corner from the origin, metres.
fn reach(loose: &[Loose]) -> f64 {
    loose.iter().flat_map(|l| l.0).map(DVec3::length).fold(0.0, f64::max)
}

fn walls(loose: &[Loose], coplanar: f64, seal: f64, least: f64, out: &mut Facets) {
    let mut lines: Vec<(DVec2, f64, Vec<Facet>)> = Vec::new();
    let mut index = Index::new(reach(loose), coplanar);
    for &(corners, newell, matter) in loose {
        let q = corners.map(to_plan);
        let longest = [(0, 1), (1, 2), (2, 0)]
            .map(|(i, j)| q[j] - q[i])
            .into_iter()
            .max_by(|a, b| a.length_squared().total_cmp(&b.length_squared()));
        let along = longest.unwrap_or(DVec2::X).normalize_or_zero();
        let mut normal = DVec2::new(-along.y, along.x);
        let offsets = q.map(|p| normal.dot(p));
        let spread = offsets.iter().fold(f64::MIN, |a, &b| a.max(b)) - offsets.iter().fold(f64::MAX, |a, &b| a.min(b));
        if along == DVec2::ZERO || spread > coplanar || newell.y.abs() > STEEPEST_SHEET * newell.length() {
            continue;
        }
        let mut offset = (offsets[0] + offsets[1] + offsets[2]) / 3.0;
        // One sign for both sides of a wall: the normal points to the upper half-plane.
        if normal.y < -ROUNDING || (normal.y.abs() <= ROUNDING && normal.x < 0.0) {
            (normal, offset) = (-normal, -offset);
        }
        let bucket = (normal.y.atan2(normal.x) / 0.01).floor() as i64;
        let fits = |&i: &u32| {
            let (n, d, _) = &lines[i as usize];
            q.iter().all(|p| (n.dot(*p) - d).abs() <= coplanar)
        };
        // The angle wraps at pi: the buckets at both ends are neighbours.
        let last = (std::f64::consts::PI / 0.01).floor() as i64;
        let near = [bucket - 1, bucket, bucket + 1, if bucket <= 0 { last } else { 0 }];
        let found = index.near(near, q[0].extend(0.0), coplanar).filter(fits).min();
        let owner = found.unwrap_or_else(|| {
            lines.push((normal, offset, Vec::new()));
            index.add(bucket, normal.extend(0.0), offset, lines.len() as u32 - 1);
            lines.len() as u32 - 1
        });
        let line = &mut lines[owner as usize];
        let front = line.0.dot(to_plan(newell)) > 0.0;
        line.2.push(Facet { corners, owner, matter, front });
    }
    for (normal, offset, mut members) in lines {
        let mut wall = Wall { normal, offset, spans: Vec::new() };
        members.sort_by(|a, b| wall.extent(a).0.total_cmp(&wall.extent(b).0));
        let (mut spans, mut i) = (Vec::new(), 0);
        while i < members.len() {
            let (from, to, area) = wall.run(&members, &mut i, 2.0 * seal);
            if area >= least {
                spans.push((from, to));
            }
        }
        // Triangles too small to cut still close faces on the same line.
        wall.spans = spans;
        if !wall.spans.is_empty() {
            out.wall_facets.extend(members.iter().map(|f| Facet { owner: out.walls.len() as u32, ..*f }));
            out.walls.push(wall);
        }
    }
}

impl Wall {
    /// From where to where a triangle is along the line, metres.
    fn extent(&self, f: &Facet) -> (f64, f64) {
        let u = f.corners.map(|p| self.along().dot(to_plan(p)));
        (u[0].min(u[1]).min(u[2]), u[0].max(u[1]).max(u[2]))
    }

    /// From where to where triangles from number `i` on go without a gap, metres, and their area; `i` becomes the next number.
    fn run(&self, members: &[Facet], i: &mut usize, gap: f64) -> (f64, f64, f64) {
        let (from, mut to) = self.extent(&members[*i]);
        let mut area = 0.0;
        while *i < members.len() && self.extent(&members[*i]).0 <= to + gap {
            to = to.max(self.extent(&members[*i]).1);
            area += crate::scene::triangle_area(members[*i].corners);
            *i += 1;
        }
        (from, to, area)
    }
}

fn sheets(loose: &[Loose], coplanar: f64, least: f64, out: &mut Facets) {
    let mut planes: Vec<(Plane, f64, Vec<Facet>)> = Vec::new();
    let mut index = Index::new(reach(loose), coplanar);
    for &(corners, newell, matter) in loose {
        let mut n = newell.normalize();
        if n.y.abs() < STEEPEST_SHEET {
            continue;
        }
        let front = n.y > 0.0;
        if !front {
            n = -n;
        }
        let cell = ((n.x / 0.01).round() as i64, (n.z / 0.01).round() as i64);
        let near = (-1..=1).flat_map(|i| (-1..=1).map(move |j| (cell.0 + i, cell.1 + j)));
        let fits = |&i: &u32| corners.iter().all(|&p| planes[i as usize].0.distance(p).abs() <= coplanar);
        let found = index.near(near, corners[0], coplanar).filter(fits).min();
        let owner = found.unwrap_or_else(|| {
            let plane = Plane::through((corners[0] + corners[1] + corners[2]) / 3.0, n);
            planes.push((plane, 0.0, Vec::new()));
            index.add(cell, n, plane.d, planes.len() as u32 - 1);
            planes.len() as u32 - 1
        });
        let plane = &mut planes[owner as usize];
        plane.1 += newell.length() * 0.5;
        plane.2.push(Facet { corners, owner, matter, front });
    }
    for (plane, area, members) in planes {
        if area < least {
            continue;
        }
        let owner = out.sheets.len() as u32;
        let outline = if area >= 2.0 * least { outline(&members, coplanar) } else { Vec::new() };
        out.sheets.push(Sheet { plane, outline });
        out.sheet_facets.extend(members.into_iter().map(|f| Facet { owner, ..f }));
    }
}

/// Boundary edges: those of only one triangle.
fn outline(members: &[Facet], coplanar: f64) -> Vec<(DVec2, DVec2)> {
    let key = |q: DVec2| ((q.x / coplanar).round() as i64, (q.y / coplanar).round() as i64);
    /// Number of triangles at the edge, its place in their order, its ends.
    type Edge = (u32, usize, (DVec2, DVec2));
    let mut edges: HashMap<[(i64, i64); 2], Edge> = HashMap::new();
    for (order, f) in members.iter().enumerate() {
        let q = f.corners.map(to_plan);
        for (i, j) in [(0, 1), (1, 2), (2, 0)] {
            let mut ends = [key(q[i]), key(q[j])];
            ends.sort_unstable();
            edges.entry(ends).or_insert((0, order * 3 + i, (q[i], q[j]))).0 += 1;
        }
    }
    let mut once: Vec<_> = edges.into_values().filter(|(count, ..)| *count == 1).collect();
    once.sort_unstable_by_key(|&(_, order, _)| order);
    once.into_iter().map(|(_, _, segment)| segment).collect()
}
