//! Cells and portals of a file, for `check` alone: points in cells, and segments from cell to cell.

use super::triangles::Tree;
use enfilade::CellId;
use enfilade::file::PvsFile;
use enfilade::math::geom::{Aabb, Plane, clip};
use enfilade::math::random::Prng;
use glam::{DVec3, Vec4};
use std::collections::BTreeMap;

/// A line with a smaller slope against a plane lies within it.
const WITHIN: f64 = 1e-12;

/// A convex piece, clipped to the region.
pub(super) struct Piece {
    pub(super) cell: CellId,
    pub(super) planes: Vec<Plane>,
    /// The face of each plane, in order; then those of the region's six sides.
    pub(super) faces: Vec<Vec<DVec3>>,
    /// Tetrahedra that fill it, with the running sum of volumes, cubic metres.
    tetrahedra: Vec<([DVec3; 4], f64)>,
    pub(super) bounds: Aabb,
}

/// A portal.
pub(super) struct Portal {
    pub(super) plane: Plane,
    pub(super) winding: Vec<DVec3>,
}

/// Result of following a segment.
pub(super) struct Walk {
    /// Cells that it reached, and the middle of its stretch in each.
    pub(super) reached: Vec<(CellId, f64)>,
    /// If it ended early: the distance along it, the last cell, the cell beyond.
    pub(super) stuck: Option<(f64, CellId, Option<CellId>)>,
}

/// A stretch of a segment inside one cell.
struct Stretch {
    cell: CellId,
    from: f64,
    to: f64,
}

/// The file's cells and portals.
pub(super) struct Cells {
    pieces: Vec<Piece>,
    tree: Option<Tree>,
    /// The pieces of each cell, with the running sum of volumes.
    by_cell: Vec<Vec<(usize, f64)>>,
    portals: Vec<Portal>,
    /// Portals between two cells, the lesser one first.
    between: BTreeMap<(CellId, CellId), Vec<usize>>,
    of_cell: Vec<Vec<usize>>,
    region: Aabb,
    tolerance: f64,
    rounding: f64,
    open: Vec<CellId>,
    closed: Vec<CellId>,
}

impl Cells {
    /// `bounds` is the scene's; the region extends a tenth of its diagonal and two metres beyond it. `tolerance`: pieces and
    /// portals grow by this when segments are followed. `rounding`: points nearer than this to a piece's boundary are not safely
    /// inside. All in metres.
    pub(super) fn new(file: &PvsFile, bounds: Aabb, tolerance: f64, rounding: f64) -> Self {
        let region = bounds.inflated(2.0 + bounds.diagonal() * 0.1);
        let mut pieces = Vec::new();
        for (c, cell) in file.cells.iter().enumerate() {
            for planes in &cell.pieces {
                pieces.extend(Piece::new(CellId(c as u32), planes.iter().map(of_length_one).collect(), &region));
            }
        }
        let mut by_cell = vec![Vec::new(); file.cells.len()];
        for (i, piece) in pieces.iter().enumerate() {
            let of: &mut Vec<(usize, f64)> = &mut by_cell[piece.cell.index()];
            let sum = of.last().map_or(0.0, |l| l.1) + piece.volume();
            of.push((i, sum));
        }
        let (mut portals, mut between) = (Vec::new(), BTreeMap::<_, Vec<usize>>::new());
        let mut of_cell = vec![Vec::new(); file.cells.len()];
        for (i, portal) in file.portals.iter().enumerate() {
            let [a, b] = portal.cells;
            between.entry((a.min(b), a.max(b))).or_default().push(i);
            for cell in portal.cells {
                of_cell[cell.index()].push(i);
            }
            let winding = portal.winding.iter().map(|p| p.as_dvec3()).collect();
            portals.push(Portal { plane: of_length_one(&portal.plane), winding });
        }
        let tree = Tree::new(pieces.iter().map(|p| p.grown_bounds(tolerance, &region)), rounding);
        let with_volume = (0..file.cells.len()).filter(|&c| !by_cell[c].is_empty());
        let (open, closed): (Vec<usize>, Vec<usize>) = with_volume.partition(|&c| file.cells[c].open);
        let [open, closed] = [open, closed].map(|list| list.into_iter().map(|c| CellId(c as u32)).collect());
        Self { pieces, tree, by_cell, portals, between, of_cell, region, tolerance, rounding, open, closed }
    }

    pub(super) fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// Error of a corner in single precision, metres.
    pub(super) fn rounding(&self) -> f64 {
        self.rounding
    }

    pub(super) fn count(&self) -> usize {
        self.by_cell.len()
    }

    /// Cubic metres of a cell within the region.
    pub(super) fn volume(&self, cell: CellId) -> f64 {
        self.by_cell[cell.index()].last().map_or(0.0, |p| p.1)
    }

    /// Number of cells without volume.
    pub(super) fn empty_cells(&self) -> u32 {
        self.by_cell.iter().filter(|c| c.is_empty()).count() as u32
    }

    /// The tested space.
    pub(super) fn region(&self) -> &Aabb {
        &self.region
    }

    /// Every piece with a volume.
    pub(super) fn pieces(&self) -> &[Piece] {
        &self.pieces
    }

    /// A cell's pieces by number, with the running sum of volumes.
    pub(super) fn pieces_of(&self, cell: CellId) -> &[(usize, f64)] {
        &self.by_cell[cell.index()]
    }

    /// Pieces whose boxes meet that of a piece, ascending.
    pub(super) fn beside(&self, piece: usize) -> Vec<usize> {
        let mut found = Vec::new();
        if let Some(tree) = &self.tree {
            tree.in_box(&self.pieces[piece].bounds, |i| found.push(i));
        }
        found.sort_unstable();
        found.retain(|&i| i != piece);
        found
    }

    /// The piece that holds a point within the tolerance; of several, the deepest.
    pub(super) fn piece_at(&self, p: DVec3) -> Option<usize> {
        let mut best: Option<(f64, usize)> = None;
        self.tree.as_ref()?.at(p, |i| {
            let off = self.pieces[i].planes.iter().map(|plane| plane.distance(p)).fold(f64::NEG_INFINITY, f64::max);
            if off <= self.tolerance && best.is_none_or(|b| (off, i) < b) {
                best = Some((off, i));
            }
            true
        });
        best.map(|b| b.1)
    }

    /// The cell that holds a point within the tolerance.
    pub(super) fn near(&self, p: DVec3) -> Option<CellId> {
        self.piece_at(p).map(|i| self.pieces[i].cell)
    }

    /// Whether a cell holds a point within the tolerance.
    pub(super) fn near_cell(&self, cell: CellId, p: DVec3) -> bool {
        self.by_cell[cell.index()].iter().any(|&(i, _)| self.pieces[i].holds(p, self.tolerance))
    }

    /// Whether a cell with volume is open.
    pub(super) fn is_open(&self, cell: CellId) -> bool {
        self.open.binary_search(&cell).is_ok()
    }

    /// Closed cells with volume.
    pub(super) fn closed(&self) -> &[CellId] {
        &self.closed
    }

    /// Open cells with volume.
    pub(super) fn open(&self) -> &[CellId] {
        &self.open
    }

    pub(super) fn portals(&self) -> &[Portal] {
        &self.portals
    }

    /// The numbers of a cell's portals.
    pub(super) fn portals_of(&self, cell: CellId) -> &[usize] {
        &self.of_cell[cell.index()]
    }

    /// Distance at which a ray from inside the region leaves it; metres if `direction` has length 1.
    pub(super) fn exit(&self, origin: DVec3, direction: DVec3) -> f64 {
        let far = (self.region.max - origin) / direction;
        let near = (self.region.min - origin) / direction;
        near.max(far).min_element().max(0.0)
    }

    /// The cell that has a point safely inside.
    pub(super) fn locate(&self, p: DVec3) -> Option<CellId> {
        let mut found: Option<usize> = None;
        self.tree.as_ref()?.at(p, |i| {
            if self.pieces[i].holds(p, -self.rounding) {
                found = Some(found.map_or(i, |f| f.min(i)));
            }
            true
        });
        found.map(|i| self.pieces[i].cell)
    }

    /// Whether a point is inside a cell by more than the tolerance.
    pub(super) fn is_inside(&self, cell: CellId, p: DVec3) -> bool {
        self.by_cell[cell.index()].iter().any(|&(i, _)| self.pieces[i].holds(p, -self.tolerance))
    }

    /// A random point safely inside a cell, uniform over its volume; `None` if a few tries fail.
    pub(super) fn point(&self, cell: CellId, rng: &mut Prng) -> Option<DVec3> {
        let pieces = &self.by_cell[cell.index()];
        let total = pieces.last()?.1;
        (0..8).find_map(|_| {
            let at = rng.range(0.0, total);
            let piece = &self.pieces[pieces[pieces.partition_point(|p| p.1 <= at).min(pieces.len() - 1)].0];
            Some(piece.point(rng)).filter(|&p| piece.holds(p, -self.rounding))
        })
    }

    /// Follows a segment from a point in `cell`. Its stretches lie in pieces grown by the tolerance. It passes from one to the
    /// next if they overlap and it crosses a portal between their cells there.
    pub(super) fn walk(&self, cell: CellId, origin: DVec3, direction: DVec3, length: f64) -> Walk {
        let stretches = self.stretches(origin, direction, length);
        let mut seen = vec![false; stretches.len()];
        let mut queue: Vec<usize> =
            (0..stretches.len()).filter(|&i| stretches[i].cell == cell && stretches[i].from <= 0.0).collect();
        for &i in &queue {
            seen[i] = true;
        }
        let mut next = 0;
        while let Some(&i) = queue.get(next) {
            next += 1;
            for j in 0..stretches.len() {
                if !seen[j] && self.passes(&stretches[i], &stretches[j], origin, direction) {
                    seen[j] = true;
                    queue.push(j);
                }
            }
        }
        let reached: Vec<(CellId, f64)> =
            queue.iter().map(|&i| (stretches[i].cell, (stretches[i].from + stretches[i].to) / 2.0)).collect();
        let last = queue.iter().max_by(|&&a, &&b| stretches[a].to.total_cmp(&stretches[b].to));
        let stuck = match last {
            Some(&i) if stretches[i].to >= length - self.tolerance => None,
            _ => {
                let (end, from) = last.map_or((0.0, cell), |&i| (stretches[i].to, stretches[i].cell));
                let beyond = stretches.iter().filter(|s| s.from <= end + self.tolerance && s.to > end);
                let beyond = beyond.max_by(|a, b| a.to.total_cmp(&b.to));
                Some((end, from, beyond.map(|s| s.cell)))
            }
        };
        Walk { reached, stuck }
    }

    /// Stretches of a segment by cell, in the order of cells; those of one cell are joined if they overlap.
    fn stretches(&self, origin: DVec3, direction: DVec3, length: f64) -> Vec<Stretch> {
        let mut found = Vec::new();
        if let Some(tree) = &self.tree {
            tree.along(origin, direction, length, |i| {
                let piece = &self.pieces[i];
                if let Some((from, to)) = piece.cut(origin, direction, length, self.tolerance) {
                    found.push(Stretch { cell: piece.cell, from, to });
                }
                f64::INFINITY
            });
        }
        found.sort_by(|a, b| a.cell.cmp(&b.cell).then(a.from.total_cmp(&b.from)));
        found.dedup_by(|b, a| {
            let joined = a.cell == b.cell && b.from <= a.to;
            if joined {
                a.to = a.to.max(b.to);
            }
            joined
        });
        found
    }

    /// Whether the segment crosses a portal between the cells of two stretches where they overlap.
    fn passes(&self, a: &Stretch, b: &Stretch, origin: DVec3, direction: DVec3) -> bool {
        let (from, to) = (a.from.max(b.from) - self.tolerance, a.to.min(b.to) + self.tolerance);
        if from > to + self.tolerance || a.cell == b.cell {
            return false;
        }
        let portals = self.between.get(&(a.cell.min(b.cell), a.cell.max(b.cell)));
        portals.into_iter().flatten().any(|&p| self.portals[p].crossed(origin, direction, from, to, self.tolerance))
    }
}

/// A plane of a file, normalised. Its stored normal has length 1 only within rounding: a polygon of a hundred metres would leave
/// the plane by micrometres, and where nearly parallel planes meet, that shifts their line by metres.
fn of_length_one(plane: &Vec4) -> Plane {
    scaled(plane.truncate().as_dvec3(), f64::from(plane.w))
}

/// A plane from a normal of any length and its distance times that length.
fn scaled(n: DVec3, d: f64) -> Plane {
    let length = n.length();
    if length > 0.0 { Plane { n: n / length, d: d / length } } else { Plane { n, d } }
}

/// The faces of a convex polyhedron: a polygon for each plane, empty if the plane is redundant; then those of the region's sides.
pub(super) fn faces(planes: &[Plane], region: &Aabb) -> Vec<Vec<DVec3>> {
    let sides = (0..3).flat_map(|axis| {
        let n = DVec3::AXES[axis];
        [Plane { n, d: region.max[axis] }, Plane { n: -n, d: -region.min[axis] }]
    });
    let planes: Vec<Plane> = planes.iter().copied().chain(sides).collect();
    // Each face is a square on its plane, larger than the region, clipped by all other planes.
    let size = region.diagonal();
    let face = |(i, plane): (usize, &Plane)| {
        let middle = region.centre() - plane.n * plane.distance(region.centre());
        let (u, v) = plane.n.any_orthonormal_pair();
        let square = [u + v, v - u, -u - v, u - v].map(|corner| middle + corner * size).to_vec();
        let others = planes.iter().enumerate().filter(|&(j, _)| j != i);
        others.fold(square, |face, (_, other)| clip(&face, other, size * 1e-9))
    };
    planes.iter().enumerate().map(face).collect()
}

impl Piece {
    /// `None` without volume.
    fn new(cell: CellId, planes: Vec<Plane>, region: &Aabb) -> Option<Self> {
        let faces = faces(&planes, region);
        let bounds = Aabb::of(faces.iter().flatten().copied());
        if bounds.is_empty() {
            return None;
        }
        let corners: Vec<DVec3> = faces.iter().flatten().copied().collect();
        let middle = corners.iter().sum::<DVec3>() / corners.len() as f64;
        let (mut tetrahedra, mut sum) = (Vec::new(), 0.0);
        for face in &faces {
            for k in 2..face.len() {
                let (a, b, c) = (face[0], face[k - 1], face[k]);
                let volume = (a - middle).dot((b - middle).cross(c - middle)).abs() / 6.0;
                if volume > 0.0 {
                    sum += volume;
                    tetrahedra.push(([middle, a, b, c], sum));
                }
            }
        }
        (!tetrahedra.is_empty()).then_some(Self { cell, planes, faces, tetrahedra, bounds })
    }

    /// Bounds of the piece with each plane moved out by `by` metres. For nearly parallel planes these are far larger than its box
    /// grown by `by`: rounding decides where such a sliver ends, and the portals on both of its sides show how far it reached.
    fn grown_bounds(&self, by: f64, region: &Aabb) -> Aabb {
        let planes: Vec<Plane> = self.planes.iter().map(|p| Plane { n: p.n, d: p.d + by }).collect();
        let around = [self.bounds.min - by, self.bounds.max + by];
        Aabb::of(faces(&planes, region).into_iter().flatten().chain(around))
    }

    /// A point inside.
    pub(super) fn middle(&self) -> DVec3 {
        self.tetrahedra[0].0[0]
    }

    pub(super) fn volume(&self) -> f64 {
        self.tetrahedra.last().map_or(0.0, |t| t.1)
    }

    /// Whether a point is inside or within `by` metres; if `by` is negative, whether it is that deep inside.
    fn holds(&self, p: DVec3, by: f64) -> bool {
        self.planes.iter().all(|plane| plane.distance(p) <= by)
    }

    /// A random point, uniform over the volume.
    fn point(&self, rng: &mut Prng) -> DVec3 {
        let at = rng.range(0.0, self.volume());
        let i = self.tetrahedra.partition_point(|t| t.1 <= at).min(self.tetrahedra.len() - 1);
        let [a, b, c, d] = self.tetrahedra[i].0;
        // The gaps between three sorted numbers are uniform barycentric coordinates.
        let mut cuts = [rng.unit(), rng.unit(), rng.unit()];
        cuts.sort_by(f64::total_cmp);
        a * cuts[0] + b * (cuts[1] - cuts[0]) + c * (cuts[2] - cuts[1]) + d * (1.0 - cuts[2])
    }

    /// The part of a segment inside the piece grown by `by` metres.
    fn cut(&self, origin: DVec3, direction: DVec3, length: f64, by: f64) -> Option<(f64, f64)> {
        let (mut from, mut to) = (0.0f64, length);
        for plane in &self.planes {
            let (height, slope) = (plane.distance(origin) - by, plane.n.dot(direction));
            if slope > 0.0 {
                to = to.min(-height / slope);
            } else if slope < 0.0 {
                from = from.max(-height / slope);
            } else if height > 0.0 {
                return None;
            }
            if from > to {
                return None;
            }
        }
        Some((from, to))
    }
}

impl Portal {
    /// Whether a line, between two distances along it, comes within `by` metres of the portal.
    fn crossed(&self, origin: DVec3, direction: DVec3, from: f64, to: f64, by: f64) -> bool {
        let (mut from, mut to) = (from, to);
        // Keeps the part of the line inside of a plane or within `by` of it. Seen from the tip of the normal a winding is
        // counter-clockwise, so its inside is to the left of its edges.
        let mut keep = |plane: Plane| {
            let (off, slope) = (plane.distance(origin) - by, plane.n.dot(direction));
            if slope.abs() <= WITHIN {
                to = if off > 0.0 { f64::NEG_INFINITY } else { to };
            } else if slope > 0.0 {
                to = to.min(-off / slope);
            } else {
                from = from.max(-off / slope);
            }
        };
        [self.plane, self.plane.flipped()].into_iter().for_each(&mut keep);
        for (&a, &b) in self.winding.iter().zip(self.winding.iter().cycle().skip(1)) {
            if let Some(along) = (b - a).try_normalize() {
                keep(Plane::through(a, along.cross(self.plane.n)));
            }
        }
        from <= to
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_passes_a_grown_portal_wherever_it_comes_within_it() {
        let corners = [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)];
        let winding = corners.map(|(x, y)| DVec3::new(x, y, 0.0)).to_vec();
        let portal = Portal { plane: Plane { n: DVec3::Z, d: 0.0 }, winding };
        let crossed = |from: DVec3, to: DVec3, range: [f64; 2]| {
            let length = from.distance(to);
            portal.crossed(from, (to - from) / length, range[0], range[1].min(length), 0.004)
        };
        let p = DVec3::new;
        // Through the middle; past the rim by more than 4 mm, and by less; ending before it.
        assert!(crossed(p(0.5, 0.5, 1.0), p(0.5, 0.5, -1.0), [0.0, 9.0]));
        assert!(!crossed(p(1.005, 0.5, 1.0), p(1.005, 0.5, -1.0), [0.0, 9.0]));
        assert!(crossed(p(1.003, 0.5, 1.0), p(1.003, 0.5, -1.0), [0.0, 9.0]));
        assert!(!crossed(p(0.5, 0.5, 1.0), p(0.5, 0.5, -1.0), [0.0, 0.99]));
        // Nearly parallel to it: meets the plane 8 mm before the rim, 0.1 mm below the portal's edge; then 5 cm below.
        assert!(crossed(p(-1.0, 0.5, 0.0149), p(1.0, 0.5, -0.0151), [0.992, 9.0]));
        assert!(!crossed(p(-1.0, 0.5, 0.1), p(1.0, 0.5, -0.3), [0.0, 9.0]));
        // Parallel: within the plane, and 3 mm and 5 mm above it.
        for (z, passes) in [(0.0, true), (0.003, true), (0.005, false)] {
            assert_eq!(crossed(p(-1.0, 0.5, z), p(2.0, 0.5, z), [0.0, 9.0]), passes);
        }
    }

    /// Two planes at six micrometres per metre meet where the file's numbers say, although single precision shortens their
    /// normals by 1e-8. They bound a corridor from z = 10 to 30 m from below, one up to z = 20 m, the other beyond.
    #[test]
    fn faces_end_where_nearly_parallel_planes_meet() {
        let normals = [(0.992_278_6_f32, 0.124_028_94_f32), (0.992_277_86, 0.124_034_79)];
        // Through y = -2.5, z = 20.
        let below = normals.map(|(y, z)| {
            let (y, z) = (f64::from(y), f64::from(z));
            let length = y.hypot(z);
            assert!((length - 1.0).abs() > 1e-9, "{length}");
            (-DVec3::new(0.0, y, z), -(y * -2.5 + z * 20.0))
        });
        let sides = [(DVec3::X, 1.0), (-DVec3::X, 1.0), (DVec3::Y, 9.0), (DVec3::Z, 30.0), (-DVec3::Z, -10.0)];
        let planes: Vec<Plane> = below.into_iter().chain(sides).map(|(n, d)| scaled(n, d)).collect();
        let region = Aabb { min: DVec3::splat(-40.0), max: DVec3::splat(40.0) };
        let faces = faces(&planes, &region);
        let mut ends: Vec<f64> = faces[..2].iter().flatten().map(|p| p.z).collect();
        ends.sort_by(f64::total_cmp);
        let expected = [10.0, 10.0, 20.0, 20.0, 20.0, 20.0, 30.0, 30.0];
        assert!(ends.len() == 8 && ends.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-3), "{ends:?}");
    }

    /// Two planes at half a micrometre per metre form a wedge, which single precision starts 0.2 m later than portals do. A
    /// vertical line there still passes it.
    #[test]
    fn a_wedge_goes_as_far_as_its_planes_within_the_tolerance() {
        let (p, region) = (DVec3::new, Aabb { min: DVec3::splat(-2.0), max: DVec3::splat(2.0) });
        let plane = |n: DVec3, d: f64| Plane { n, d };
        let sides = [plane(DVec3::X, 1.0), plane(-DVec3::X, 0.0), plane(DVec3::Z, 1.0)];
        let wedge = sides.into_iter().chain([plane(DVec3::Y, 0.0), plane(p(0.0, -1.0, -5e-7), -1e-7)]).collect();
        let piece = Piece::new(CellId(0), wedge, &region).unwrap();
        assert!((piece.bounds.min.z - 0.2).abs() < 0.05, "{}", piece.bounds.min);
        let grown = piece.grown_bounds(3e-4, &region);
        assert!(grown.min.z <= -1.99 && grown.max.z <= 1.001, "{} {}", grown.min, grown.max);
        assert!(piece.cut(p(0.5, 0.1, 0.0), -DVec3::Y, 0.2, 3e-4).is_some());
    }
}
