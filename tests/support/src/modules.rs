//! A building cut at its portals into modules, each with a scene and cells of its own, and a world that joins them again.

use enfilade::cells::{Cell, CellGraph, Piece, Portal, place_objects};
use enfilade::file::{FileCell, FileObject, FilePortal, PvsFile};
use enfilade::math::geom::{Aabb, Plane};
use enfilade::runtime::{Culler, ModuleId, Placement, World};
use enfilade::scene::{ImportOptions, Mesh, Scene, SceneBuilder, Source};
use enfilade::{BitMatrix, CellId, PortalId};
use glam::{DQuat, DVec3};
use std::collections::VecDeque;
use std::sync::Arc;

/// One module.
pub struct Module {
    pub scene: Scene,
    /// Its cells, and one that is all that is around it.
    pub graph: CellGraph,
    /// By portal: that of the building.
    pub portals: Vec<PortalId>,
    /// By object: triangles of the building.
    pub triangles: Vec<Vec<u32>>,
    /// From its origin to the building's, metres.
    pub at: DVec3,
}

/// The cells of a file.
pub fn graph_of(file: &PvsFile) -> CellGraph {
    let piece = |planes: &Vec<glam::Vec4>| {
        let plane = |p: &glam::Vec4| Plane { n: p.truncate().as_dvec3(), d: p.w.into() };
        Piece::new(planes.iter().map(plane).collect(), 1e-6)
    };
    let cells = file.cells.iter().map(|cell| Cell {
        name: cell.name.clone(),
        open: cell.open,
        pieces: cell.pieces.iter().filter_map(piece).collect(),
        ..Cell::default()
    });
    let portals = file.portals.iter().map(|p| Portal {
        cells: p.cells,
        plane: Plane { n: p.plane.truncate().as_dvec3(), d: p.plane.w.into() },
        winding: p.winding.iter().map(|p| p.as_dvec3()).collect(),
        kind: p.kind,
        state: p.state,
        source: p.source.clone(),
    });
    let mut graph = CellGraph {
        strategy: file.strategy,
        reason: String::new(),
        cells: cells.collect(),
        portals: portals.collect(),
        smallest_hole: file.smallest_hole,
        closed_holes: Vec::new(),
        notes: Vec::new(),
    };
    graph.link();
    graph
}

/// Groups of neighbouring cells, as even as they grow from cells far from each other; what is open is a last group of its own.
pub fn groups(graph: &CellGraph, count: usize) -> Vec<usize> {
    let is_in = |cell: usize| !graph.cells[cell].open;
    let next = |cell: usize| graph.cells[cell].portals.iter().map(|&out| graph.target(out).index()).filter(|&c| is_in(c));
    let hops = |from: &[usize]| {
        let (mut hops, mut queue) = (vec![usize::MAX; graph.cells.len()], VecDeque::from(from.to_vec()));
        let mut first = vec![usize::MAX; graph.cells.len()];
        from.iter().enumerate().for_each(|(group, &cell)| (hops[cell], first[cell]) = (0, group));
        while let Some(cell) = queue.pop_front() {
            for to in next(cell) {
                if hops[to] == usize::MAX {
                    (hops[to], first[to]) = (hops[cell] + 1, first[cell]);
                    queue.push_back(to);
                }
            }
        }
        (hops, first)
    };
    let inside: Vec<usize> = (0..graph.cells.len()).filter(|&cell| is_in(cell)).collect();
    let mut seeds = vec![inside[0]];
    while seeds.len() < count.min(inside.len()) {
        let (hops, _) = hops(&seeds);
        seeds.push(*inside.iter().max_by_key(|&&cell| (hops[cell], std::cmp::Reverse(cell))).expect("a cell"));
    }
    let (_, first) = hops(&seeds);
    (0..graph.cells.len()).map(|cell| if is_in(cell) { first[cell].min(seeds.len() - 1) } else { seeds.len() }).collect()
}

/// The same scene with an object for each triangle.
pub fn single(scene: &Scene) -> Scene {
    let mut single = SceneBuilder::new(&ImportOptions::default(), Source::default());
    for object in &scene.objects {
        for t in object.triangles.clone() {
            let corners = scene.corners(t as usize).map(|p| p + scene.origin);
            single.add(mesh(object.opaque, object.role, "", &[corners])).expect("a triangle");
        }
    }
    let single = single.finish("triangles").expect("a scene");
    assert_eq!(single.objects.len(), scene.triangles.len(), "an object for each triangle");
    assert_eq!(single.origin, scene.origin, "the same coordinates");
    single
}

/// Cuts a building into the groups of its cells; `single`: with an object for each triangle. A module has the triangles that touch its cells.
pub fn cut(scene: &Scene, single: &Scene, graph: &CellGraph, groups: &[usize]) -> Vec<Module> {
    let places = place_objects(single, graph, 2.0 * scene.tolerance().clearance).matrix;
    let count = groups.iter().max().map_or(0, |last| last + 1);
    (0..count).map(|group| module(scene, graph, group, groups, |cell, t| places.get(cell, t))).collect()
}

fn mesh(opaque: bool, role: enfilade::scene::Role, node: &str, corners: &[[DVec3; 3]]) -> Mesh {
    Mesh { opaque, role, ..super::meshes::soup(node, role, opaque, corners) }
}

/// The same graph with all coordinates moved.
fn shifted(graph: &CellGraph, by: DVec3) -> CellGraph {
    let mut graph = graph.clone();
    let plane = |p: &mut Plane| p.d += p.n.dot(by);
    for piece in graph.cells.iter_mut().flat_map(|cell| &mut cell.pieces) {
        piece.planes.iter_mut().for_each(plane);
        piece.bounds = Aabb { min: piece.bounds.min + by, max: piece.bounds.max + by };
    }
    for portal in &mut graph.portals {
        plane(&mut portal.plane);
        portal.winding.iter_mut().for_each(|p| *p += by);
    }
    graph
}

fn module(scene: &Scene, graph: &CellGraph, group: usize, groups: &[usize], is_in: impl Fn(usize, usize) -> bool) -> Module {
    let own: Vec<usize> = (0..groups.len()).filter(|&cell| groups[cell] == group).collect();
    let (mut builder, mut triangles) = (SceneBuilder::new(&ImportOptions::default(), Source::default()), Vec::new());
    for (number, object) in scene.objects.iter().enumerate() {
        let touching: Vec<u32> =
            object.triangles.clone().filter(|&t| own.iter().any(|&cell| is_in(cell, t as usize))).collect();
        if !touching.is_empty() {
            let corners: Vec<_> = touching.iter().map(|&t| scene.corners(t as usize).map(|p| p + scene.origin)).collect();
            builder.add(mesh(object.opaque, object.role, &number.to_string(), &corners)).expect("triangles");
            triangles.push(touching);
        }
    }
    let part = builder.finish(&format!("module {group}")).expect("a scene");
    assert_eq!(part.objects.len(), triangles.len(), "an object for each of the building's");
    let graph = shifted(graph, scene.origin - part.origin);
    let new = |cell: CellId| CellId(own.binary_search(&cell.index()).unwrap_or(own.len()) as u32);
    let kept: Vec<usize> = (0..graph.portals.len())
        .filter(|&p| graph.portals[p].cells.iter().any(|cell| new(*cell).index() < own.len()))
        .filter(|_| own.iter().any(|&cell| !graph.cells[cell].open))
        .collect();
    let mut cells: Vec<Cell> = own.iter().map(|&cell| graph.cells[cell].clone()).collect();
    if own.iter().all(|&cell| !graph.cells[cell].open) {
        let others = (0..groups.len()).filter(|cell| groups[*cell] != group);
        let mut around: Vec<Piece> = others.flat_map(|cell| graph.cells[cell].pieces.clone()).collect();
        if around.iter().all(|piece| piece.bounds.min.is_finite() && piece.bounds.max.is_finite()) {
            let pieces = graph.cells.iter().flat_map(|cell| &cell.pieces);
            around.extend(beyond(pieces.fold(Aabb::EMPTY, |b, piece| b.union(piece.bounds))));
        }
        cells.push(Cell { name: "around".into(), open: true, pieces: around, ..Cell::default() });
    }
    let portals = kept.iter().map(|&p| {
        let portal = graph.portals[p].clone();
        Portal { cells: portal.cells.map(new), ..portal }
    });
    let mut graph = CellGraph { cells, portals: portals.collect(), ..graph.clone() };
    graph.link();
    let portals = kept.into_iter().map(|p| PortalId(p as u32)).collect();
    Module { at: part.origin - scene.origin, scene: part, graph, portals, triangles }
}

/// What is outside a box, in pieces that don't overlap.
fn beyond(b: Aabb) -> Vec<Piece> {
    let (mut planes, mut pieces) = (Vec::new(), Vec::new());
    for n in DVec3::AXES.into_iter().flat_map(|n| [n, -n]) {
        let d = n.dot(if n.max_element() > 0.0 { b.max } else { b.min }) + 1.0;
        let out = planes.iter().copied().chain([Plane { n: -n, d: -d }]).collect();
        pieces.extend(Piece::new(out, 1e-6));
        planes.push(Plane { n, d });
    }
    pieces
}

/// A world of modules, each in its place, joined where the building's portals are.
pub fn joined(modules: &[(&Module, Arc<Culler>)]) -> (World, Vec<ModuleId>) {
    let mut world = World::new();
    let place = |at| Placement::new(DQuat::IDENTITY, at).expect("a place");
    let ids: Vec<ModuleId> = modules.iter().map(|(module, culler)| world.place(culler, place(module.at))).collect();
    for (b, (module, culler)) in modules.iter().enumerate() {
        for (portal, of) in (0..).map(PortalId).zip(&module.portals) {
            let others = modules[..b].iter().enumerate();
            let mut found = others.filter_map(|(a, (other, _))| Some((a, other.portals.iter().position(|p| p == of)?)));
            if let Some((a, other)) = found.next_back().filter(|_| culler.way_in(portal).is_some()) {
                world.join(ids[a], PortalId(other as u32), ids[b], portal).expect("portals on each other");
            }
        }
    }
    (world, ids)
}

/// Two rooms that face each other through so many openings, not joined yet.
pub fn ladder(openings: u32) -> (World, [ModuleId; 2]) {
    let b = |min, max| super::rooms::box_piece(min, max, DVec3::ZERO);
    let length = f64::from(openings);
    let [west, east] = [[-4.0, 0.0], [0.0, 4.0]].map(|[low, high]| {
        let mut file = super::files::bare();
        let room = b([low, 0.0, 0.0], [high, 3.0, length]);
        let pieces = [vec![room], beyond(Aabb { min: DVec3::new(low, 0.0, 0.0), max: DVec3::new(high, 3.0, length) })];
        let cell = |pieces: &Vec<Piece>| {
            let plane = |p: &Plane| p.n.as_vec3().extend(p.d as f32);
            let pieces = pieces.iter().map(|piece| piece.planes.iter().map(plane).collect()).collect();
            FileCell { name: String::new(), source: None, open: false, pieces }
        };
        file.cells = pieces.iter().map(cell).collect();
        let object =
            FileObject { node: "room".into(), triangles: 12, bounds: [low, high].map(|x| glam::Vec3::splat(x as f32)) };
        file.objects = vec![object];
        file.placement = BitMatrix::new(2, 1);
        file.placement.set(0, 0);
        file.portals = (0..openings)
            .map(|i| {
                let z = f64::from(i);
                let cells = if low < 0.0 { [0, 1] } else { [1, 0] };
                let p = super::rooms::portal(cells, 0, [0.0, 0.0, z + 0.1], [0.0, 2.0, z + 0.9], DVec3::ZERO);
                FilePortal {
                    cells: p.cells,
                    plane: p.plane.n.as_vec3().extend(p.plane.d as f32),
                    winding: p.winding.iter().map(|p| p.as_vec3()).collect(),
                    kind: p.kind,
                    state: p.state,
                    source: None,
                }
            })
            .collect();
        Culler::new(&file)
    });
    let mut world = World::new();
    let ids = [west, east].map(|culler| world.place(&culler, Placement::IDENTITY));
    (world, ids)
}
