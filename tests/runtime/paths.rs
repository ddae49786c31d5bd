//! Ways: hand-made buildings with known answers, and random ones against every sequence of portals.

use enfilade::file::PvsFile;
use enfilade::runtime::{Culler, Doors, Pathfinder};
use enfilade::{CellId, DirectedPortal, PortalId};
use glam::{DVec3, Vec3};
use testing::boxes::{A, B, Building, CORRIDOR, block, flat, p};
use testing::maze::Grid;
use testing::random::Places;

use enfilade::cells::PortalKind::{Door, Opening};

/// Steps in stored single precision, and the share of a length, that ways may differ by.
const NEAR: f64 = 2e-4;

fn at(file: &PvsFile, x: f64, y: f64, z: f64) -> Vec3 {
    (p(x, y, z) - file.origin).as_vec3()
}

fn door_of(file: &PvsFile, cell: CellId) -> PortalId {
    let found = file.portals.iter().position(|q| q.cells.contains(&cell) && q.cells.contains(&CORRIDOR));
    PortalId(found.unwrap() as u32)
}

#[test]
fn a_way_is_taut_about_the_posts_of_doors() {
    let (_, file) = flat().0.finish();
    let culler = Culler::new(&file);
    let mut doors = Doors::passable(&culler);
    let mut ways = Pathfinder::new(&culler, &doors);
    // From the middle of A to the middle of B: about the post at x = 2, along the wall, about the post at x = 8.
    let (from, to) = (at(&file, 1.5, 1.6, 2.0), at(&file, 8.5, 1.6, 2.0));
    let way = ways.find(&doors, from, to).unwrap();
    assert!((way.metres - (2.0 * 4.25f64.sqrt() + 6.0)).abs() < NEAR, "{way:?}");
    assert!(way.at_least <= way.metres && way.at_least > way.metres - NEAR);
    assert_eq!(way.portals.iter().map(|q| q.portal()).collect::<Vec<_>>(), [door_of(&file, A), door_of(&file, B)]);
    let expected = [from, at(&file, 2.0, 1.6, 4.0), at(&file, 8.0, 1.6, 4.0), to];
    assert_eq!(way.points.len(), 4);
    assert!(way.points.iter().zip(expected).all(|(a, b)| a.distance(b) < 0.02), "{:?}", way.points);
    // From above the lintel it goes down under it.
    let above = ways.find(&doors, at(&file, 1.5, 2.9, 3.9), at(&file, 1.5, 2.9, 4.1)).unwrap();
    assert!((above.metres - 2.0 * (0.01f64 + 0.64).sqrt()).abs() < NEAR, "{above:?}");
    // Within a cell it is straight and passes nothing.
    let within = ways.find(&doors, from, at(&file, 2.5, 1.6, 2.0)).unwrap();
    assert!((within.metres - 1.0).abs() < 1e-6 && within.portals.is_empty() && within.points.len() == 2);
    // A shut door; a window; a wall.
    assert_eq!(ways.find(&doors, from, at(&file, -3.0, 1.0, 2.0)), None);
    let all = Doors::open(&culler);
    assert!(Pathfinder::new(&culler, &all).find(&all, from, at(&file, -3.0, 1.0, 2.0)).is_some());
    assert_eq!(ways.find(&all, from, at(&file, -3.0, 1.0, 2.0)), None);
    assert_eq!(ways.find(&doors, from, at(&file, 5.0, 1.6, 2.0)), None, "in no cell");
    assert_eq!(ways.find(&doors, Vec3::NAN, to), None);
    doors.set_open(door_of(&file, B), false);
    assert_eq!(ways.find(&doors, from, to), None);
    // Open one way.
    let into_b = door_of(&file, B).directed(u32::from(file.portals[door_of(&file, B).index()].cells[0] == B));
    doors.set_see_through(into_b, true);
    assert!(ways.find(&doors, from, to).is_some() && ways.find(&doors, to, from).is_none());
}

/// A line of rooms whose openings share a corner: pulled one point at a time, a line about that corner gets stuck.
#[test]
fn a_way_about_a_corner_that_openings_share_is_the_shortest() {
    let mut b = Building::default();
    // A column at x 2..2.0, and openings that fan out from its edge at (2, 2), from room to room.
    let rooms = [(p(0., 0., 0.), p(2., 3., 2.)), (p(2., 0., 0.), p(4., 3., 2.)), (p(2., 0., 2.), p(4., 3., 4.))];
    let cells: Vec<CellId> = rooms.iter().map(|(low, high)| b.cell("", vec![block(*low, *high)])).collect();
    b.portal(cells[0], cells[1], p(2., 0., 0.), p(2., 3., 2.), Opening);
    b.portal(cells[1], cells[2], p(2., 0., 2.), p(4., 3., 2.), Opening);
    b.thing("thing", p(0.1, 0.1, 0.1), p(0.2, 0.2, 0.2));
    let (_, file) = b.finish();
    let culler = Culler::new(&file);
    let doors = Doors::open(&culler);
    let mut ways = Pathfinder::new(&culler, &doors);
    let way = ways.find(&doors, at(&file, 1.0, 0.5, 1.9), at(&file, 2.1, 2.5, 3.0)).unwrap();
    // Unfolded about the edge: both ends at their distances from it, and the climb.
    let (from, to) = ((1.0f64 + 0.01).sqrt(), (0.01f64 + 1.0).sqrt());
    let metres = ((from + to).powi(2) + 4.0).sqrt();
    assert!((way.metres - metres).abs() < NEAR && way.at_least > metres - NEAR, "{way:?} for {metres}");
}

/// Four corridors around a block, and three rooms one behind the other off one of them: ways into the last and out of it, both ways around.
#[test]
fn ways_lead_into_rooms_behind_rooms() {
    let mut b = Building::default();
    let mut room = |x: [f64; 2], z: [f64; 2]| b.cell("", vec![block(p(x[0], 0., z[0]), p(x[1], 3., z[1]))]);
    let [south, north] = [room([0., 10.], [0., 2.]), room([0., 10.], [8., 10.])];
    let [west, east] = [room([0., 2.], [2., 8.]), room([8., 10.], [2., 8.])];
    let rooms = [-2., -4., -6.].map(|z| room([4., 6.], [z, z + 2.]));
    for (z, cell) in [(2., south), (8., north)] {
        b.portal(cell, west, p(0., 0., z), p(2., 3., z), Opening);
        b.portal(cell, east, p(8., 0., z), p(10., 3., z), Opening);
    }
    for (z, from, to) in [(0., south, rooms[0]), (-2., rooms[0], rooms[1]), (-4., rooms[1], rooms[2])] {
        b.portal(from, to, p(4.5, 0., z), p(5.5, 3., z), Door);
    }
    b.thing("thing", p(0.1, 0.1, 0.1), p(0.2, 0.2, 0.2));
    let (_, file) = b.finish();
    let culler = Culler::new(&file);
    let mut doors = Doors::open(&culler);
    let mut ways = Pathfinder::new(&culler, &doors);
    // About the block's corners at (2, 8) and (2, 2), and the post at (4.5, 0).
    let metres = 10f64.sqrt() + 6.0 + (2.5f64.powi(2) + 4.0).sqrt() + (0.25f64 + 25.0).sqrt();
    let [behind, within] = [at(&file, 5.0, 1.5, -5.0), at(&file, 5.0, 1.5, 9.0)];
    for [from, to] in [[behind, within], [within, behind]] {
        let way = ways.find(&doors, from, to).unwrap();
        assert!((way.metres - metres).abs() < NEAR && way.at_least > metres - NEAR, "{way:?} for {metres}");
        assert_eq!((way.portals.len(), way.at_least <= way.metres), (5, true));
    }
    // One way around is left, then none.
    doors.set_open(PortalId(0), false);
    assert!((ways.find(&doors, within, behind).unwrap().metres - metres).abs() < NEAR);
    doors.set_open(PortalId(1), false);
    assert_eq!(ways.find(&doors, within, behind), None);
    // From room to room, and from the first to the corridor: straight.
    for (z, portals) in [(-3.0, 1), (-1.0, 2), (1.0, 3)] {
        let way = ways.find(&doors, behind, at(&file, 5.0, 1.5, z)).unwrap();
        assert!((way.metres - (z + 5.0)).abs() < NEAR && way.portals.len() == portals, "{way:?}");
    }
}

/// Every sequence of portals that enters no cell twice, each pulled tight along one coordinate after the other.
struct BruteForce<'f> {
    file: &'f PvsFile,
    ends: [DVec3; 2],
    best: Option<f64>,
}

impl BruteForce<'_> {
    fn follow(&mut self, cell: CellId, goal: CellId, entered: &mut Vec<CellId>, passed: &mut Vec<usize>) {
        if cell == goal {
            let metres = self.tight(passed);
            self.best = Some(self.best.map_or(metres, |best| best.min(metres)));
            return;
        }
        for (q, portal) in self.file.portals.iter().enumerate() {
            let Some(side) = portal.cells.iter().position(|&c| c == cell) else { continue };
            let next = portal.cells[1 - side];
            if !entered.contains(&next) {
                entered.push(next);
                passed.push(q);
                if self.best.is_none_or(|best| self.least(passed) < best) {
                    self.follow(next, goal, entered, passed);
                }
                passed.pop();
                entered.pop();
            }
        }
    }

    fn bounds(&self, portal: usize) -> [DVec3; 2] {
        let corners = self.file.portals[portal].winding.iter().map(|q| q.as_dvec3());
        corners.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], q| [low.min(q), high.max(q)])
    }

    /// From box to box.
    fn least(&self, passed: &[usize]) -> f64 {
        let boxes: Vec<[DVec3; 2]> = passed.iter().map(|&q| self.bounds(q)).collect();
        let all = [&[[self.ends[0]; 2]][..], &boxes, &[[self.ends[1]; 2]]].concat();
        all.windows(2).map(|pair| (pair[0][0] - pair[1][1]).max(pair[1][0] - pair[0][1]).max(DVec3::ZERO).length()).sum()
    }

    fn tight(&self, passed: &[usize]) -> f64 {
        let boxes: Vec<[DVec3; 2]> = passed.iter().map(|&q| self.bounds(q)).collect();
        let mut points: Vec<DVec3> = boxes.iter().map(|[low, high]| (low + high) * 0.5).collect();
        points.insert(0, self.ends[0]);
        points.push(self.ends[1]);
        let metres = |points: &[DVec3]| points.windows(2).map(|pair| pair[0].distance(pair[1])).sum::<f64>();
        let mut before = f64::INFINITY;
        for _ in 0..200 {
            if before - metres(&points) < 1e-7 {
                break;
            }
            before = metres(&points);
            for i in 1..points.len() - 1 {
                let beside = [points[i - 1], points[i + 1]];
                for axis in 0..3 {
                    let at = |t: f64| {
                        let mut q = points[i];
                        q[axis] = t;
                        beside[0].distance(q) + q.distance(beside[1])
                    };
                    let [mut low, mut high] = boxes[i - 1].map(|corner| corner[axis]);
                    while high - low > 1e-7 {
                        let thirds = [(2.0 * low + high) / 3.0, (low + 2.0 * high) / 3.0];
                        if at(thirds[0]) < at(thirds[1]) { high = thirds[1] } else { low = thirds[0] }
                    }
                    points[i][axis] = 0.5 * (low + high);
                }
            }
        }
        metres(&points)
    }
}

#[test]
fn ways_through_random_buildings_are_the_shortest_of_all_sequences() {
    let mut random = Places::new(11);
    let (mut found, mut none, mut longest) = (0, 0, 0);
    for round in 0..400 {
        let grid = Grid::random(&mut random);
        let (_, file) = grid.building();
        // All sequences of more are too many.
        if file.portals.len() > 12 {
            continue;
        }
        let culler = Culler::new(&file);
        let doors = Doors::open(&culler);
        let mut ways = Pathfinder::new(&culler, &doors);
        for _ in 0..6 {
            let places = [0, 1].map(|_| {
                let i = random.below(grid.faces.len());
                let (low, high) = grid.bounds(i);
                let q = random.between(low.lerp(high, 0.01), high.lerp(low, 0.01)) - file.origin;
                (q.as_vec3(), grid.cell_of[i])
            });
            let [(from, start), (to, goal)] = places;
            let mut all = BruteForce { file: &file, ends: [from.as_dvec3(), to.as_dvec3()], best: None };
            all.follow(start, goal, &mut vec![start], &mut Vec::new());
            let way = ways.find(&doors, from, to);
            assert_eq!(way.is_some(), all.best.is_some(), "round {round}");
            let (Some(way), Some(best)) = (way, all.best) else {
                none += 1;
                continue;
            };
            assert!((way.metres - best).abs() < NEAR + 1e-5 * best, "round {round}: {} for {best}", way.metres);
            assert!(way.at_least <= best + 1e-6 && way.at_least > best - NEAR - 1e-5 * best, "round {round}: {way:?}");
            assert_way(&file, &way, [from, to], start, goal);
            longest = longest.max(way.portals.len());
            found += 1;
            let (metres, back) = (way.metres, ways.find(&doors, to, from).unwrap());
            assert!((back.metres - metres).abs() < NEAR + 1e-5 * metres);
        }
    }
    assert!(found > 200 && none > 20 && longest > 3, "{found} ways, {none} without, {longest} portals at most");
}

/// A way passes from cell to cell through its portals, at points of theirs, and is as long as it says.
fn assert_way(file: &PvsFile, way: &enfilade::runtime::Path<'_>, ends: [Vec3; 2], start: CellId, goal: CellId) {
    assert_eq!((way.points[0], way.points[way.points.len() - 1]), (ends[0], ends[1]));
    assert_eq!(way.points.len(), way.portals.len() + 2);
    let metres: f64 = way.points.windows(2).map(|pair| f64::from(pair[0].distance(pair[1]))).sum();
    assert!((metres - way.metres).abs() < NEAR);
    let mut cell = start;
    for (directed, point) in way.portals.iter().zip(&way.points[1..]) {
        let portal = &file.portals[directed.portal().index()];
        assert_eq!(portal.cells[directed.side()], cell);
        cell = portal.cells[1 - directed.side()];
        let corners = portal.winding.iter();
        let [low, high] = corners.fold([Vec3::INFINITY, Vec3::NEG_INFINITY], |[l, h], q| [l.min(*q), h.max(*q)]);
        assert!(point.cmpge(low - 1e-4).all() && point.cmple(high + 1e-4).all(), "{point} in {low}..{high}");
    }
    assert_eq!(cell, goal);
}

/// What a shut door adds, and that no way is longer than one by a third place.
#[test]
fn doors_that_shut_never_make_a_way_shorter() {
    let mut random = Places::new(5);
    let (mut longer, mut gone) = (0, 0);
    for _ in 0..60 {
        let grid = Grid::random(&mut random);
        let (_, file) = grid.building();
        let culler = Culler::new(&file);
        let mut doors = Doors::open(&culler);
        let mut ways = Pathfinder::new(&culler, &doors);
        let mut place = || {
            let (low, high) = grid.bounds(random.below(grid.faces.len()));
            (random.between(low, high) - file.origin).as_vec3()
        };
        let places = [place(), place(), place()];
        let mut metres = |doors: &Doors, i: usize, j: usize| {
            ways.find(doors, places[i], places[j]).map(|way| (way.metres, way.portals.first().copied()))
        };
        let sums = [metres(&doors, 0, 2), metres(&doors, 0, 1), metres(&doors, 1, 2)].map(|way| way.map(|(m, _)| m));
        if let [Some(all), Some(first), Some(second)] = sums {
            assert!(all <= first + second + 2.0 * NEAR);
        }
        if let Some((before, Some(first))) = metres(&doors, 0, 2) {
            let _: DirectedPortal = first;
            doors.set_open(first.portal(), false);
            match metres(&doors, 0, 2) {
                Some((after, _)) => {
                    assert!(after >= before - NEAR);
                    longer += usize::from(after > before + NEAR);
                }
                None => gone += 1,
            }
        }
    }
    assert!(longer > 5 && gone > 5, "{longer} longer, {gone} gone");
    // A door that a building has twice: the other one is taken.
    let mut b = Building::default();
    let (left, right) =
        (b.cell("", vec![block(p(0., 0., 0.), p(4., 3., 4.))]), b.cell("", vec![block(p(4., 0., 0.), p(8., 3., 4.))]));
    b.portal(left, right, p(4., 0., 0.), p(4., 2., 1.), Door);
    b.portal(left, right, p(4., 0., 3.), p(4., 2., 4.), Door);
    b.thing("thing", p(0.1, 0.1, 0.1), p(0.2, 0.2, 0.2));
    let (_, file) = b.finish();
    let culler = Culler::new(&file);
    let mut doors = Doors::passable(&culler);
    let mut ways = Pathfinder::new(&culler, &doors);
    let (from, to) = (at(&file, 3.0, 1.0, 0.5), at(&file, 5.0, 1.0, 0.5));
    assert!((ways.find(&doors, from, to).unwrap().metres - 2.0).abs() < NEAR);
    doors.set_open(PortalId(0), false);
    assert!((ways.find(&doors, from, to).unwrap().metres - 2.0 * (1.0f64 + 6.25).sqrt()).abs() < NEAR);
}
