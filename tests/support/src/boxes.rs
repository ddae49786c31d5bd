//! Buildings made of boxes, by hand: scenes and `.pvs` files with known answers.
use crate::files::pvs;
use crate::meshes::{flat_along, soup};
use enfilade::cells::{Cell, CellGraph, Piece, Portal, PortalKind, PortalState, Strategy};
use enfilade::file::PvsFile;
use enfilade::math::geom::{Aabb, Plane};
use enfilade::scene::{ImportOptions, Mesh, Role, Scene, SceneBuilder, Source};
use enfilade::{BitMatrix, CellId, ObjectId};
use glam::DVec3;

/// A point.
pub use glam::dvec3 as p;

pub fn block(min: DVec3, max: DVec3) -> Piece {
    let planes = (0..3).flat_map(|axis| {
        let n = DVec3::AXES[axis];
        [Plane { n, d: max[axis] }, Plane { n: -n, d: -min[axis] }]
    });
    Piece { planes: planes.collect(), bounds: Aabb { min, max } }
}

/// Cells, portals and meshes in the model's own coordinates.
#[derive(Default)]
pub struct Building {
    cells: Vec<Cell>,
    portals: Vec<Portal>,
    meshes: Vec<Mesh>,
}

impl Building {
    pub fn cell(&mut self, name: &str, pieces: Vec<Piece>) -> CellId {
        self.cells.push(Cell { name: name.into(), pieces, ..Cell::default() });
        CellId(self.cells.len() as u32 - 1)
    }

    /// The space around a box: six unbounded pieces.
    pub fn outside(&mut self, min: DVec3, max: DVec3) -> CellId {
        let mut pieces = Vec::new();
        let mut before: Vec<Plane> = Vec::new();
        for axis in 0..3 {
            let n = DVec3::AXES[axis];
            for (beyond, within) in [
                (Plane { n: -n, d: -max[axis] }, Plane { n, d: max[axis] }),
                (Plane { n, d: min[axis] }, Plane { n: -n, d: -min[axis] }),
            ] {
                let planes = before.iter().copied().chain([beyond]).collect();
                pieces.push(Piece { planes, bounds: Aabb { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY } });
                before.push(within);
            }
        }
        let id = self.cell("outside", pieces);
        self.cells[id.index()].open = true;
        id
    }

    /// A portal: the box from `min` to `max` must be flat along one axis; `low` is the cell on the lesser side of it.
    pub fn portal(&mut self, low: CellId, high: CellId, min: DVec3, max: DVec3, kind: PortalKind) {
        let axis = (0..3).find(|&a| min[a] == max[a]).expect("flat along an axis");
        let winding = flat_along(axis, min, max).to_vec();
        let plane = Plane { n: DVec3::AXES[axis], d: min[axis] };
        let state = PortalState::of_kind(kind);
        self.portals.push(Portal { cells: [low, high], plane, winding, kind, state, source: None });
    }

    pub fn mesh(&mut self, node: &str, role: Role, opaque: bool, triangles: Vec<[DVec3; 3]>) -> ObjectId {
        self.meshes.push(soup(node, role, opaque, &triangles));
        ObjectId(self.meshes.len() as u32 - 1)
    }

    /// A solid box.
    pub fn solid(&mut self, node: &str, role: Role, opaque: bool, min: DVec3, max: DVec3) -> ObjectId {
        let triangles = (0..3).flat_map(|axis| {
            [min[axis], max[axis]].into_iter().flat_map(move |at| {
                let (mut a, mut b) = (min, max);
                (a[axis], b[axis]) = (at, at);
                rectangle(a, b, &[])
            })
        });
        self.mesh(node, role, opaque, triangles.collect())
    }

    pub fn thing(&mut self, node: &str, min: DVec3, max: DVec3) -> ObjectId {
        self.solid(node, Role::Furnishing, true, min, max)
    }

    /// A flat wall with holes.
    pub fn wall(&mut self, node: &str, min: DVec3, max: DVec3, holes: &[(DVec3, DVec3)]) -> ObjectId {
        self.mesh(node, Role::Structure, true, rectangle(min, max, holes))
    }

    /// Every cell sees what it is joined to by any chain of portals; an object is in each cell whose pieces its box touches.
    pub fn finish(self) -> (Scene, PvsFile) {
        self.finish_with(|_, _| {})
    }

    /// As [`Building::finish`], with the last word on the rows: cells x cells, cells x objects.
    pub fn finish_with(self, rows: impl FnOnce(&mut BitMatrix, &mut BitMatrix)) -> (Scene, PvsFile) {
        let options = ImportOptions::default();
        let mut builder = SceneBuilder::new(&options, Source::default());
        self.meshes.into_iter().for_each(|mesh| builder.add(mesh).unwrap());
        let scene = builder.finish("building").unwrap();
        let graph = relative_graph(self.cells, self.portals, &scene);
        let placement = placement(&graph, &scene);
        let [mut cells, mut objects] = joined_rows(&graph, &placement);
        rows(&mut cells, &mut objects);
        let pvs = pvs(graph, [cells.clone(), cells], [objects.clone(), objects], placement);
        let file = PvsFile::from_bake(&scene, &options, &pvs, false);
        (scene, file)
    }
}

/// Cells and portals relative to the origin of a scene.
fn relative_graph(cells: Vec<Cell>, portals: Vec<Portal>, scene: &Scene) -> CellGraph {
    let shift = |plane: &mut Plane| plane.d -= plane.n.dot(scene.origin);
    let mut graph = CellGraph {
        strategy: Strategy::Given,
        reason: "by hand".into(),
        cells,
        portals,
        smallest_hole: scene.tolerance().smallest_hole(),
        closed_holes: Vec::new(),
        notes: Vec::new(),
    };
    for piece in graph.cells.iter_mut().flat_map(|c| &mut c.pieces) {
        piece.planes.iter_mut().for_each(shift);
        piece.bounds = Aabb { min: piece.bounds.min - scene.origin, max: piece.bounds.max - scene.origin };
    }
    for portal in &mut graph.portals {
        shift(&mut portal.plane);
        portal.winding.iter_mut().for_each(|p| *p -= scene.origin);
    }
    graph.link();
    graph
}

/// Objects of each cell: those whose boxes touch a piece.
fn placement(graph: &CellGraph, scene: &Scene) -> BitMatrix {
    let mut placement = BitMatrix::new(graph.cells.len(), scene.objects.len());
    for (c, cell) in graph.cells.iter().enumerate() {
        for (o, object) in scene.objects.iter().enumerate() {
            if cell.pieces.iter().any(|piece| touches(piece, &object.bounds.inflated(1e-3))) {
                placement.set(c, o);
            }
        }
    }
    placement
}

/// Rows of cells that a chain of portals joins, and of the objects in them.
fn joined_rows(graph: &CellGraph, placement: &BitMatrix) -> [BitMatrix; 2] {
    let (n, m) = (placement.rows(), placement.columns());
    let mut group: Vec<usize> = (0..n).collect();
    for portal in &graph.portals {
        let [to, from] = portal.cells.map(|c| group[c.index()]);
        group.iter_mut().filter(|g| **g == from).for_each(|g| *g = to);
    }
    let mut cells = BitMatrix::new(n, n);
    for a in 0..n {
        (0..n).filter(|&b| group[a] == group[b]).for_each(|b| {
            cells.set(a, b);
        });
    }
    let mut objects = BitMatrix::new(n, m);
    for c in 0..n {
        for seen in cells.ones(c).collect::<Vec<_>>() {
            placement.ones(seen).for_each(|o| {
                objects.set(c, o);
            });
        }
    }
    [cells, objects]
}

/// False only where a plane of the piece has the whole box outside.
fn touches(piece: &Piece, bounds: &Aabb) -> bool {
    piece.planes.iter().all(|plane| {
        let nearest = plane.n.map(|n| if n > 0.0 { 0.0 } else { 1.0 });
        plane.distance(bounds.min + bounds.size() * nearest) <= 0.0
    })
}

/// Two triangles for each part of a flat rectangle that is in no hole.
fn rectangle(min: DVec3, max: DVec3, holes: &[(DVec3, DVec3)]) -> Vec<[DVec3; 3]> {
    let axis = (0..3).find(|&a| min[a] == max[a]).expect("flat along an axis");
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let cuts = |k: usize| {
        let mut cuts: Vec<f64> = holes.iter().flat_map(|h| [h.0[k], h.1[k]]).chain([min[k], max[k]]).collect();
        cuts.retain(|&x| (min[k]..=max[k]).contains(&x));
        cuts.sort_by(f64::total_cmp);
        cuts.dedup();
        cuts
    };
    let mut out = Vec::new();
    for us in cuts(u).windows(2) {
        for vs in cuts(v).windows(2) {
            let at = |a: f64, b: f64| {
                let mut q = min;
                (q[u], q[v]) = (a, b);
                q
            };
            let middle = at((us[0] + us[1]) * 0.5, (vs[0] + vs[1]) * 0.5);
            let within = |h: &(DVec3, DVec3)| [u, v].into_iter().all(|k| h.0[k] < middle[k] && middle[k] < h.1[k]);
            if !holes.iter().any(within) {
                let [a, b, c, d] = [at(us[0], vs[0]), at(us[1], vs[0]), at(us[1], vs[1]), at(us[0], vs[1])];
                out.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    out
}

/// Cells of [`flat`].
pub const A: CellId = CellId(0);
pub const B: CellId = CellId(1);
pub const CORRIDOR: CellId = CellId(2);
pub const OUTSIDE: CellId = CellId(3);

/// Objects of [`flat`] that stand in one cell each.
pub struct Things {
    pub in_a: ObjectId,
    pub in_b: ObjectId,
    pub in_corridor: ObjectId,
    pub tree: ObjectId,
    pub glass: ObjectId,
}

/// Two rooms side by side (A: x 0..4, B: x 6..10, both z 0..4), a corridor before both (x 0..10, z 4..6), 3 m high, the space
/// x 4..6 between the rooms solid. Doors at z = 4: into A at x 1..2, into B at x 8..9. A window of A, glazed, at x = 0.
pub fn flat() -> (Building, Things) {
    let mut b = Building::default();
    b.cell("A", vec![block(p(0., 0., 0.), p(4., 3., 4.))]);
    b.cell("B", vec![block(p(6., 0., 0.), p(10., 3., 4.))]);
    b.cell("corridor", vec![block(p(0., 0., 4.), p(10., 3., 6.))]);
    b.outside(p(0., 0., 0.), p(10., 3., 6.));
    let (door_a, door_b) = ((p(1., 0., 4.), p(2., 2.1, 4.)), (p(8., 0., 4.), p(9., 2.1, 4.)));
    let window = (p(0., 1., 1.), p(0., 2., 3.));
    b.portal(A, CORRIDOR, door_a.0, door_a.1, PortalKind::Door);
    b.portal(B, CORRIDOR, door_b.0, door_b.1, PortalKind::Door);
    b.portal(OUTSIDE, A, window.0, window.1, PortalKind::Window);
    b.wall("floor", p(0., 0., 0.), p(10., 0., 6.), &[]);
    b.wall("ceiling", p(0., 3., 0.), p(10., 3., 6.), &[]);
    b.wall("north", p(0., 0., 0.), p(10., 3., 0.), &[]);
    b.wall("south", p(0., 0., 6.), p(10., 3., 6.), &[]);
    b.wall("west", p(0., 0., 0.), p(0., 3., 6.), &[window]);
    b.wall("east", p(10., 0., 0.), p(10., 3., 6.), &[]);
    b.wall("between", p(0., 0., 4.), p(10., 3., 4.), &[door_a, door_b]);
    b.wall("side of A", p(4., 0., 0.), p(4., 3., 4.), &[]);
    b.wall("side of B", p(6., 0., 0.), p(6., 3., 4.), &[]);
    let things = Things {
        in_a: b.thing("chair in A", p(2.5, 0.01, 0.5), p(3.5, 1., 1.5)),
        in_b: b.thing("chair in B", p(8., 0.01, 0.5), p(9., 1., 1.5)),
        in_corridor: b.thing("plant in corridor", p(0.5, 0.01, 5.2), p(1., 1.5, 5.7)),
        tree: b.thing("tree outside", p(-6., 0., 1.5), p(-5., 4., 2.5)),
        glass: b.solid("pane", Role::Window, false, p(-0.02, 1., 1.), p(0., 2., 3.)),
    };
    (b, things)
}
