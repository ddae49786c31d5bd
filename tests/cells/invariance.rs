//! A building is the same building wherever it stands, in whatever unit it comes and however its triangles are ordered: the
//! plan strategy finds the same rooms and the same doors and windows.

use enfilade::CellId;
use enfilade::cells::{CellGraph, Locator, PortalKind, SplitOptions, Strategy, split};
use enfilade::math::geom::middle;
use enfilade::scene::{ImportOptions, Mesh, Role, Scene, SceneBuilder};
#[cfg(feature = "ifc")]
use enfilade_formats::import;
use enfilade_scenes::Kind;
use glam::{DMat3, DVec3};
use std::collections::{BTreeMap, BTreeSet};
use testing::bakes;
#[cfg(feature = "ifc")]
use testing::data;

/// What is done to a model.
#[derive(Clone, Copy)]
struct Change {
    name: &'static str,
    turn: f64,
    scale: f64,
    shift: DVec3,
    shuffled: bool,
    doubled: bool,
}

const AS_IT_IS: Change =
    Change { name: "as it is", turn: 0.0, scale: 1.0, shift: DVec3::ZERO, shuffled: false, doubled: false };

/// The list: 1,000 km away, in other units, turned by an odd angle, triangles shuffled, walls doubled; and all at once.
fn changes() -> [Change; 7] {
    let far = DVec3::new(600_000.0, 30.0, -800_000.0);
    let turn = 0.7345;
    [
        Change { name: "moved 1,000 km", shift: far, ..AS_IT_IS },
        Change { name: "a thousandth", scale: 0.001, ..AS_IT_IS },
        Change { name: "a thousand times", scale: 1000.0, ..AS_IT_IS },
        Change { name: "turned", turn, ..AS_IT_IS },
        Change { name: "shuffled", shuffled: true, ..AS_IT_IS },
        Change { name: "doubled", doubled: true, ..AS_IT_IS },
        Change { name: "all of it", turn, scale: 1000.0, shift: far, shuffled: true, doubled: true },
    ]
}

impl Change {
    /// A point of the model after the change.
    fn of(&self, p: DVec3) -> DVec3 {
        DMat3::from_rotation_y(self.turn) * p * self.scale + self.shift
    }

    fn apply(&self, scene: &Scene) -> Scene {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), scene.source.clone());
        let at = |p: DVec3| self.of(p + scene.origin);
        let mut hints = scene.hints.clone();
        hints.storeys.iter_mut().for_each(|s| s.elevation = at(DVec3::Y * s.elevation).y);
        hints.rooms.iter_mut().flat_map(|r| r.surface.iter_mut().flatten()).for_each(|p| *p = at(*p));
        for opening in &mut hints.openings {
            opening.winding.iter_mut().for_each(|p| *p = at(*p));
            opening.thickness *= self.scale;
        }
        builder.hints = hints;
        let mut objects: Vec<usize> = (0..scene.objects.len()).collect();
        if self.shuffled {
            // A step that shares no factor with most counts.
            objects.sort_by_key(|i| (i * 7919) % 104_729);
        }
        for i in objects {
            let object = &scene.objects[i];
            let mut triangles: Vec<u32> = object.triangles.clone().collect();
            if self.shuffled {
                triangles.sort_by_key(|t| (t * 31) % 1009);
            }
            let turns = usize::from(self.shuffled);
            let corners = |t: &u32| {
                let c = scene.corners(*t as usize);
                [0, 1, 2].map(|k| at(c[(k + turns) % 3]))
            };
            let positions: Vec<DVec3> = triangles.iter().flat_map(corners).collect();
            let mesh = Mesh {
                node: object.node.clone(),
                role: object.role,
                opaque: object.opaque,
                triangles: (0..triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
                positions,
            };
            for _ in 0..if self.doubled && object.role == Role::Structure { 2 } else { 1 } {
                builder.add(mesh.clone()).unwrap();
            }
        }
        builder.finish(&scene.name).unwrap()
    }
}

/// A door or window.
#[derive(Debug)]
struct Opening {
    kind: PortalKind,
    at: DVec3,
    cells: [CellId; 2],
}

/// Of a doorway's two ends one is as good as the other: a wall's thickness, metres.
const NEAR: f64 = 0.6;

fn openings(graph: &CellGraph) -> Vec<Opening> {
    let portals = graph.portals.iter().filter(|p| p.kind != PortalKind::Opening);
    portals.map(|p| Opening { kind: p.kind, at: middle(&p.winding), cells: p.cells }).collect()
}

/// The same rooms: middles of large pieces go to one cell of the other graph, another for every cell. The same doors: each has one
/// of its kind in its place, between those cells, and there are no others.
fn assert_same(test: &str, change: &Change, base: (&Scene, &CellGraph), changed: (&Scene, &CellGraph)) {
    let what = format!("{test}, {}", change.name);
    let there = |p: DVec3| change.of(p + base.0.origin) - changed.0.origin;
    let locator = Locator::new(changed.1);
    let mut of: BTreeMap<CellId, CellId> = BTreeMap::new();
    for (c, cell) in (0u32..).zip(&base.1.cells) {
        let bounded = cell.pieces.iter().filter(|p| p.bounds.min.is_finite() && p.bounds.max.is_finite());
        let roomy = bounded.filter(|p| p.bounds.size().min_element() > 0.5 && p.contains(p.bounds.centre(), -0.05));
        let found: BTreeSet<Option<CellId>> =
            roomy.map(|p| locator.locate(there(p.bounds.centre())).map(|(cell, _)| cell)).collect();
        assert!(found.len() <= 1, "{what}: cell {c} ({}) becomes {found:?}", cell.name);
        if let Some(&Some(cell)) = found.first() {
            of.insert(CellId(c), cell);
        }
    }
    let images: BTreeSet<CellId> = of.values().copied().collect();
    assert_eq!(images.len(), of.len(), "{what}: cells that become one");
    assert!(of.len() * 10 >= base.1.cells.len() * 9, "{what}: most cells are rooms");
    assert_eq!(base.1.cells.len(), changed.1.cells.len(), "{what}: cells");
    let alike = |a: &Opening, b: &Opening| {
        let sides = [b.cells, [b.cells[1], b.cells[0]]];
        let cells = a.cells.map(|c| of.get(&c));
        let right = sides.iter().any(|[p, q]| cells[0].is_none_or(|c| c == p) && cells[1].is_none_or(|c| c == q));
        a.kind == b.kind && there(a.at).distance(b.at) <= NEAR * change.scale && right
    };
    let (before, after) = (openings(base.1), openings(changed.1));
    for a in &before {
        assert!(after.iter().any(|b| alike(a, b)), "{what}: lost {a:?}");
    }
    for b in &after {
        assert!(before.iter().any(|a| alike(a, b)), "{what}: new {b:?}");
    }
}

fn check(test: &str, scene: &Scene) {
    let options = SplitOptions { strategy: Some(Strategy::Plan), ..SplitOptions::default() };
    let base = AS_IT_IS.apply(scene);
    let graph = split(&base, &options).unwrap();
    assert!(graph.cells.len() > 3 && !openings(&graph).is_empty(), "{test}: {} cells", graph.cells.len());
    for change in changes() {
        let changed = change.apply(scene);
        let again = split(&changed, &options).unwrap();
        assert_same(test, &change, (&base, &graph), (&changed, &again));
    }
}

fn generated(test: &str, kind: Kind) {
    check(test, &bakes::generated(kind, 3).1);
}

#[test]
#[cfg_attr(not(feature = "full"), ignore = "long; `just test-full` runs it")]
fn an_office() {
    generated("an_office", Kind::Office { rooms: 24, storeys: Some(2), furnished: true });
}

#[test]
fn a_gallery() {
    generated("a_gallery", Kind::Gallery { rooms: 12 });
}

#[cfg(feature = "ifc")]
#[test]
#[cfg_attr(not(feature = "full"), ignore = "needs the models of $ENFILADE_DATA; `just test-full` runs it")]
fn real_buildings() {
    for model in ["duplex/Duplex_A_20110907.ifc", "webifc-mpl/AC20-FZK-Haus.ifc", "bimwhale-mit/LargeBuilding.ifc"] {
        check(model, &import(&data::data().join(model), &ImportOptions::default()).unwrap());
    }
}
