//! What the culler must say about buildings whose answers are known, and about random ones by brute force.

mod tours;

use enfilade::BitMatrix;
use enfilade::cells::PortalKind;
use enfilade::file::{FileViewCell, PvsFile};
use enfilade::runtime::{Camera, Culler, Mode, Rect, View};
use enfilade::{CellId, ObjectId};
use glam::{DVec2, DVec3};
use std::sync::Arc;
use testing::boxes::{A, B, Building, CORRIDOR, OUTSIDE, block, flat, p};
use testing::maze::{Face, Grid};
use testing::random::Places;

/// What a set holds, sorted.
#[derive(Clone, PartialEq, Debug)]
struct Seen {
    cells: Vec<CellId>,
    objects: Vec<ObjectId>,
    home: Option<CellId>,
    capped: u64,
    portals: Vec<(u32, Rect)>,
}

impl Seen {
    fn has(&self, object: ObjectId) -> bool {
        self.objects.contains(&object)
    }
}

fn see(culler: &Arc<Culler>, camera: &Camera, mode: Mode) -> Seen {
    let mut view = View::new(culler);
    let set = view.cull(camera, mode);
    let (mut cells, mut objects) = (set.cells.to_vec(), set.objects.to_vec());
    cells.sort();
    objects.sort();
    assert_eq!(set.stats.objects, objects.len() as u64);
    let before = objects.len();
    objects.dedup();
    assert_eq!(objects.len(), before, "an object is in the set once");
    let portals = set.portals.iter().map(|c| (c.portal.0, c.rect)).collect();
    Seen { cells, objects, home: set.homes.first().copied(), capped: set.stats.capped, portals }
}

/// From `eye` towards `target`, in the model's coordinates, 75 degrees upwards.
fn look(file: &PvsFile, eye: DVec3, target: DVec3, mode: Mode) -> Seen {
    let camera = Camera::look_at(eye - file.origin, target - file.origin, 75f64.to_radians(), 16.0 / 9.0);
    see(&Culler::new(file), &camera, mode)
}

#[test]
fn a_room_is_seen_through_its_door_and_no_farther() {
    let (building, things) = flat();
    let (_, file) = building.finish();
    for mode in [Mode::Portals, Mode::PortalsAndPvs] {
        // Out of A's door. Into B there is no line: both doors are in one wall.
        let out = look(&file, p(1.5, 1.6, 2.0), p(1.5, 1.6, 9.0), mode);
        assert_eq!((out.home, out.cells.as_slice()), (Some(A), [A, CORRIDOR].as_slice()));
        assert!(out.has(things.in_corridor) && !out.has(things.in_b) && !out.has(things.tree) && !out.has(things.in_a));
        // Away from the door and from the window: A alone.
        let wall = look(&file, p(1.5, 1.6, 2.0), p(9.0, 1.6, 0.5), mode);
        assert_eq!(wall.cells, [A]);
        assert!(wall.has(things.in_a) && !wall.has(things.in_b) && wall.portals.is_empty());
        // Out of the window.
        let window = look(&file, p(0.9, 1.6, 2.0), p(-9.0, 1.6, 2.0), mode);
        assert_eq!(window.cells, [A, OUTSIDE]);
        assert!(window.has(things.tree) && window.has(things.glass) && !window.has(things.in_corridor));
        // Along the corridor: both doors are at the side, in view, and what is seen through them is their rooms.
        let along = look(&file, p(0.2, 1.6, 5.0), p(9.0, 1.6, 3.0), mode);
        assert_eq!((along.home, along.cells.as_slice()), (Some(CORRIDOR), [A, B, CORRIDOR].as_slice()));
    }
    // The frustum alone looks through walls.
    let through = look(&file, p(1.5, 1.6, 2.0), p(9.0, 1.6, 0.5), Mode::Frustum);
    assert!(through.has(things.in_b) && through.home.is_none());
    assert_eq!(look(&file, p(1.5, 1.6, 2.0), p(9.0, 1.6, 0.5), Mode::None).objects.len(), file.objects.len());
}

#[test]
fn from_outside_a_window_shows_its_room() {
    let (building, things) = flat();
    let (_, file) = building.finish();
    let inside = look(&file, p(-4.0, 1.6, 2.0), p(9.0, 1.4, 2.0), Mode::Portals);
    assert_eq!((inside.home, inside.cells.as_slice()), (Some(OUTSIDE), [A, OUTSIDE].as_slice()));
    assert!(inside.has(things.in_a) && !inside.has(things.in_b));
    // From behind the building there is no window to see.
    let behind = look(&file, p(14.0, 1.6, 2.0), p(0.0, 1.6, 2.0), Mode::Portals);
    assert_eq!(behind.cells, [OUTSIDE]);
    assert!(!behind.has(things.in_a) && !behind.has(things.in_b));
}

#[test]
fn an_eye_in_no_cell_sees_everything_in_the_frustum() {
    let (building, _) = flat();
    let (_, file) = building.finish();
    let (eye, target) = (p(5.0, 1.0, 2.0), p(9.0, 1.0, 2.0));
    let frustum = look(&file, eye, target, Mode::Frustum);
    assert!(!frustum.objects.is_empty());
    for mode in [Mode::Portals, Mode::Pvs, Mode::PortalsAndPvs] {
        let seen = look(&file, eye, target, mode);
        assert_eq!((seen.objects, seen.home), (frustum.objects.clone(), None));
    }
    let nan = Camera { eye: glam::Vec3::NAN, ..Camera::look_at(eye, target, 1.0, 1.0) };
    assert_eq!(see(&Culler::new(&file), &nan, Mode::PortalsAndPvs).objects.len(), file.objects.len());
}

/// On the portal, a micrometre to either side, at its edge, in its plane beside it: both rooms are seen wherever one is
/// looked at, and looking back through the portal shows what is behind.
#[test]
fn an_eye_on_a_portal_sees_both_sides() {
    let (building, things) = flat();
    let (_, file) = building.finish();
    let rho = Culler::new(&file).tolerance();
    assert!((1e-5..1e-3).contains(&rho), "a fraction of a millimetre in a building of 17 m: {rho}");
    let near = [0.5, 0.9, 1.1, 1.5, 1.9, 2.1, 3.0, 4.0, 6.0].into_iter().flat_map(|k| [-k * rho, k * rho]);
    for off in near.chain([-1e-3, -1e-6, 0.0, 1e-6, 1e-3]) {
        for x in [1.0, 1.0 + 1e-6, 1.5, 2.0] {
            for mode in [Mode::Portals, Mode::PortalsAndPvs, Mode::Pvs] {
                let eye = p(x, 1.6, 4.0 + off);
                let into_a = look(&file, eye, p(3.0, 0.5, 1.0), mode);
                assert!(into_a.has(things.in_a), "{x} {off} {mode}");
                let into_corridor = look(&file, eye, p(0.75, 0.75, 5.5), mode);
                assert!(into_corridor.has(things.in_corridor), "{x} {off} {mode}");
                // Along the wall: half of the picture is each side.
                let along = look(&file, eye, p(3.0, 1.6, 4.0), mode);
                assert!(along.home.is_some() && along.has(ObjectId(6)), "{x} {off} {mode}");
            }
        }
    }
    // In the plane of the doors but 5 m from B's: nothing of B is seen.
    let beside = look(&file, p(3.0, 1.6, 4.2), p(3.0, 1.6, 9.0), Mode::Portals);
    assert!(!beside.cells.contains(&B) && !beside.has(things.in_b));
}

/// An L around an inner room that has a door into each arm; a closet beyond the far arm, and an entry before the near one.
/// The line entry - L - inner room - L - closet enters the L twice.
#[test]
fn a_cell_that_is_not_convex_is_entered_twice() {
    let mut b = Building::default();
    let l = b.cell("L", vec![block(p(0., 0., 0.), p(2., 3., 6.)), block(p(2., 0., 0.), p(8., 3., 2.))]);
    let inner = b.cell("inner", vec![block(p(2., 0., 2.), p(8., 3., 6.))]);
    let entry = b.cell("entry", vec![block(p(-2., 0., 4.), p(0., 3., 6.))]);
    let closet = b.cell("closet", vec![block(p(4., 0., -2.), p(8., 3., 0.))]);
    let apart = b.cell("apart", vec![block(p(0., 0., -2.), p(4., 3., 0.))]);
    b.portal(entry, l, p(0., 0., 4.5), p(0., 2., 5.8), PortalKind::Door);
    b.portal(l, inner, p(2., 0., 3.5), p(2., 2., 4.9), PortalKind::Door);
    b.portal(l, inner, p(4., 0., 2.), p(6., 2., 2.), PortalKind::Door);
    b.portal(closet, l, p(5., 0., 0.), p(7.5, 2., 0.), PortalKind::Door);
    b.portal(apart, l, p(0.5, 0., 0.), p(1.5, 2., 0.), PortalKind::Door);
    let far = b.thing("in closet", p(7.6, 0.8, -0.4), p(7.8, 1.2, -0.2));
    let aside = b.thing("in apart", p(0.5, 0.8, -0.8), p(1.2, 1.2, -0.4));
    let (_, file) = b.finish();
    // The line z = 5.6 - 0.72 (x + 0.5): z is 5.24 at x = 0 and 3.8 at x = 2, x is 4.5 at z = 2, 7.28 at z = 0, 7.69 at -0.3.
    let eye = p(-0.5, 1.0, 5.6);
    let seen = look(&file, eye, p(4.5, 1.0, 2.0), Mode::Portals);
    assert_eq!(seen.home, Some(entry));
    assert!(seen.cells.contains(&inner) && seen.cells.contains(&closet) && seen.has(far));
    // Through the entry's door nothing is seen that is steeper than 1.1 in 0.5, so not the door to `apart`.
    assert!(!seen.cells.contains(&apart) && !seen.has(aside));
    assert_eq!(look(&file, eye, p(-9.0, 1.0, 5.6), Mode::Portals).cells, [entry]);
}

/// Two ways into a hall, one longer by a vestibule, and two wide openings in a row at its back: what is seen through all by
/// either way is in the set, and what neither shows is not.
#[test]
fn a_portal_opens_what_every_way_to_it_opens() {
    let mut b = Building::default();
    let west = b.cell("west", vec![block(p(-4., 0., 0.), p(0., 3., 10.))]);
    let around = [(0., 0., 5.5), (0.5, 5.5, 7.5), (0., 7.5, 10.)].map(|(x, z0, z1)| block(p(x, 0., z0), p(4., 3., z1)));
    let hall = b.cell("hall", around.to_vec());
    let vestibule = b.cell("vestibule", vec![block(p(0., 0., 5.5), p(0.5, 3., 7.5))]);
    let east = b.cell("east", vec![block(p(4., 0., 0.), p(8., 3., 10.))]);
    let far = b.cell("far", vec![block(p(8., 0., 0.), p(12., 3., 10.))]);
    b.portal(west, hall, p(0., 0., 3.), p(0., 2., 4.), PortalKind::Door);
    b.portal(west, vestibule, p(0., 0., 6.), p(0., 2., 7.), PortalKind::Door);
    b.portal(vestibule, hall, p(0.5, 0., 5.5), p(0.5, 3., 7.5), PortalKind::Opening);
    b.portal(hall, east, p(4., 0., 0.5), p(4., 2.5, 9.5), PortalKind::Opening);
    b.portal(east, far, p(8., 0., 0.5), p(8., 2.5, 9.5), PortalKind::Opening);
    // Just inside the inner edge of each door, from 3.9 m before them, at x = 4.1 and at x = 8.1.
    let eye = p(-3.9, 1., 5.);
    let mut things = Vec::new();
    for (x, ahead) in [(4.1, 8.0), (8.1, 12.0)] {
        for through in [-1.1, 1.1] {
            let z = 5.0 + through * ahead / 3.9;
            things.push(b.thing("seen", p(x - 0.01, 0.9, z - 0.05), p(x + 0.01, 1.1, z + 0.05)));
        }
    }
    // The outer edge of a door shows up to 4.1 m off the middle there.
    let beside = b.thing("beside", p(4.09, 0.9, 0.55), p(4.11, 1.1, 0.7));
    let (_, file) = b.finish();
    let seen = look(&file, eye, p(9.0, 1.0, 5.0), Mode::Portals);
    assert_eq!(seen.cells, [west, hall, vestibule, east, far]);
    assert!(things.iter().all(|&t| seen.has(t)) && !seen.has(beside) && seen.capped == 0, "{seen:?}");
}

/// A portal that is partly behind the plane of the one before it, in a cell that reaches back around the eye's: the part in
/// front is seen.
#[test]
fn a_portal_may_straddle_the_plane_of_the_one_before() {
    let mut b = Building::default();
    let a = b.cell("a", vec![block(p(-2., 0., 0.), p(0., 3., 4.))]);
    let around = b.cell("around", vec![block(p(0., 0., 0.), p(4., 3., 4.)), block(p(-2., 0., 4.), p(4., 3., 8.))]);
    let beyond = b.cell("beyond", vec![block(p(-2., 0., 8.), p(4., 3., 12.))]);
    b.portal(a, around, p(0., 0., 1.), p(0., 2., 3.), PortalKind::Door);
    b.portal(around, beyond, p(-1., 0., 8.), p(3., 2., 8.), PortalKind::Door);
    b.thing("", p(1., 0.1, 1.), p(2., 0.2, 2.));
    let (_, file) = b.finish();
    // From (-0.5, 1), the line through (0, 2.9) meets z = 8 at x = 1.34.
    let seen = look(&file, p(-0.5, 1., 1.), p(0., 1., 2.9), Mode::Portals);
    assert_eq!(seen.cells, [a, around, beyond]);
}

/// At 170 degrees the edge of the picture is 11.4 m aside a metre ahead, so a portal that is off the picture by its stored
/// edge comes into it if the wall is a hair farther away than stored: within the tolerance it is seen through.
#[test]
fn depths_within_the_tolerance_lose_nothing_at_the_edge_of_a_wide_picture() {
    let aside = 85f64.to_radians().tan();
    let mut b = Building::default();
    let west = b.cell("west", vec![block(p(-4., 0., -20.), p(0., 4., 20.))]);
    let east = b.cell("east", vec![block(p(0., 0., -20.), p(4., 4., 20.))]);
    b.portal(west, east, p(0., 1., aside), p(0., 3., aside + 3.0), PortalKind::Door);
    b.thing("", p(-4., 0., -20.), p(4., 0.1, 20.));
    let (_, file) = b.finish();
    let culler = Culler::new(&file);
    let sees = |off: f64| {
        let eye = p(-1.0 + off * culler.tolerance(), 2., 0.) - file.origin;
        let camera = Camera::look_at(eye, eye + DVec3::X, 170f64.to_radians(), 1.0);
        see(&culler, &camera, Mode::Portals).cells.contains(&east)
    };
    assert!(sees(-0.1) && sees(0.1) && sees(0.8) && !sees(3.0));
}

/// A building a kilometre from its origin, where `f32` steps are 0.06 mm: a camera whose whole picture is 5 micrometres wide,
/// just inside the edge of a door, sees through it. So does one that is off the stored edge by what the stored edge may be off
/// the true one; a little farther off, nothing is seen.
#[test]
fn rounded_windings_lose_nothing_at_their_edges() {
    let mut b = Building::default();
    let (z0, z1) = (700.123_456_789, 700.987_654_321);
    let west = b.cell("west", vec![block(p(-1000., -9., -1000.), p(777.7, 9., 1000.))]);
    let east = b.cell("east", vec![block(p(777.7, -9., -1000.), p(1000., 9., 1000.))]);
    b.portal(west, east, p(777.7, 0.1, z0), p(777.7, 2.1, z1), PortalKind::Door);
    b.thing("", p(-1000., -9., -1000.), p(-999., -8., -999.));
    b.thing("", p(999., 8., 999.), p(1000., 9., 1000.));
    let (_, file) = b.finish();
    let culler = Culler::new(&file);
    let mut random = Places::new(3);
    let sees = |eye: DVec3, target: DVec3| {
        // The eye as the culler gets it.
        let eye = (eye - file.origin).as_vec3().as_dvec3();
        let camera = Camera::look_at(eye, target - file.origin, 1e-3f64.to_radians(), 1.0);
        see(&culler, &camera, Mode::Portals).cells.contains(&east)
    };
    for _ in 0..500 {
        let eye = p(777.7 - 0.3 - random.unit() * 20.0, 1.0, 690.0 + random.unit() * 20.0);
        let y = 0.2 + random.unit() * 1.8;
        let (edge, out) = if random.unit() < 0.5 { (z0, -1.0) } else { (z1, 1.0) };
        assert!(sees(eye, p(777.7, y, edge - out * 2e-5)), "inside the edge, from {eye}");
        assert!(sees(eye, p(777.7, y, edge + out * 0.9 * culler.tolerance())), "within the tolerance, from {eye}");
    }
    assert!(!sees(p(776.7, 1.0, 700.5), p(777.7, 1.0, z1 + 3.0 * culler.tolerance())));
    assert_eq!(west, CellId(0));
}

/// Doors 2 cm wide and 2 m high, and very wide and low ones, at every opening angle: what lies behind on the line through the
/// middle is seen, also at a grazing angle.
#[test]
fn thin_portals_and_extreme_angles_lose_nothing() {
    for (width, height) in [(0.02, 2.0), (6.0, 0.02), (1e-3, 1e-3)] {
        let mut b = Building::default();
        let west = b.cell("west", vec![block(p(-30., -4., -4.), p(0., 4., 4.))]);
        let east = b.cell("east", vec![block(p(0., -4., -4.), p(30., 4., 4.))]);
        b.portal(west, east, p(0., -height * 0.5, -width * 0.5), p(0., height * 0.5, width * 0.5), PortalKind::Opening);
        // A grid of small things behind the wall.
        let mut things = Vec::new();
        for i in 0..20 {
            for j in 0..20 {
                let at = p(1.0 + f64::from(i) * 1.4, 0.0, -3.8 + f64::from(j) * 0.4);
                things.push((at, b.thing("thing", at - 1e-3, at + 1e-3)));
            }
        }
        let (_, file) = b.finish();
        let culler = Culler::new(&file);
        for (at, thing) in things {
            for distance in [1e-5, 1e-3, 0.5, 20.0] {
                // On the line from the thing through the middle of the portal.
                let eye = -at.normalize() * distance;
                if eye.z.abs() < 4.0 {
                    for fov in [1e-3f64, 1.0, 60.0, 175.0] {
                        let camera = Camera::look_at(eye - file.origin, at - file.origin, fov.to_radians(), 1.5);
                        for mode in [Mode::Portals, Mode::PortalsAndPvs] {
                            assert!(
                                see(&culler, &camera, mode).has(thing),
                                "{width} x {height}, {at}, {distance} m, {fov} degrees"
                            );
                        }
                    }
                }
            }
        }
    }
}

/// A box and an eye in it; or, if `on_door`, on a door of it, a little off it along its normal, or in its plane.
fn eye_in(grid: &Grid, random: &mut Places, on_door: bool) -> (usize, DVec3) {
    let i = random.below(grid.faces.len());
    let (low, high) = grid.bounds(i);
    let mut eye = random.between(low, high);
    let doors: Vec<_> =
        (0..3).filter_map(|a| if let Face::Door(x, y) = grid.faces[i][a] { Some((a, x, y)) } else { None }).collect();
    if on_door && !doors.is_empty() {
        let (axis, a, b) = doors[random.below(doors.len())];
        let off = [0.0, -1e-6, 1e-6, -1e-4, -1e-2][random.below(5)];
        eye = if random.unit() < 0.7 { random.between(a, b) } else { random.between(low, high) };
        eye[axis] = a[axis] + off;
    }
    (i, eye)
}

/// What each mode draws, and the cells that it reaches, sorted.
fn sets(camera: &Camera, views: &mut [View]) -> Vec<(Vec<ObjectId>, Vec<CellId>)> {
    let set = |(mode, view): (Mode, &mut View)| {
        let set = view.cull(camera, mode);
        assert_eq!(set.stats.capped, 0);
        let mut sorted = (set.objects.to_vec(), set.cells.to_vec());
        sorted.0.sort();
        sorted.1.sort();
        sorted
    };
    Mode::WITHOUT_QUERIES.into_iter().zip(views).map(set).collect()
}

/// On random buildings whose cells are not convex, with eyes anywhere, on portals and beside them: everything that a ray of
/// the camera reaches is in the set, and the modes nest.
#[test]
fn everything_that_a_ray_reaches_is_in_the_set() {
    let mut random = Places::new(11);
    let (mut rays, mut kept, mut all, mut found, mut through) = (0u64, 0u64, 0u64, 0u64, 0u64);
    for round in 0..60 {
        let grid = Grid::random(&mut random);
        let (_, file) = grid.building();
        let culler = Culler::new(&file);
        let mut views: Vec<View> = Mode::WITHOUT_QUERIES.iter().map(|_| View::new(&culler)).collect();
        for frame in 0..40 {
            let (mut i, eye) = eye_in(&grid, &mut random, frame % 2 == 0);
            // What the culler gets: rounded.
            let eye = (eye - file.origin).as_vec3().as_dvec3() + file.origin;
            let fov = [1e-3, 20.0, 75.0, 120.0, 175.0][random.below(5)];
            let target = eye + random.between(DVec3::NEG_ONE, DVec3::ONE);
            let camera = Camera::look_at(eye - file.origin, target - file.origin, f64::to_radians(fov), 1.6);
            let contains = |i: usize| {
                let (a, b) = grid.bounds(i);
                a.cmple(eye).all() && eye.cmple(b).all()
            };
            match (0..grid.faces.len()).find(|&j| contains(j)) {
                Some(j) if !contains(i) => i = j,
                Some(_) => {}
                None => continue,
            }
            let sets = sets(&camera, &mut views);
            let [none, frustum, portals, pvs, both] = &sets[..] else { unreachable!() };
            let within = |a: &[ObjectId], b: &[ObjectId]| a.iter().all(|o| b.binary_search(o).is_ok());
            assert!(within(&both.0, &portals.0) && within(&both.0, &pvs.0) && within(&portals.0, &frustum.0));
            assert!(within(&pvs.0, &frustum.0) && within(&frustum.0, &none.0));
            kept += portals.0.len() as u64;
            all += frustum.0.len() as u64;

            let (mut cells, mut things) = (Vec::new(), Vec::new());
            for _ in 0..150 {
                let ndc = DVec2::new(random.unit(), random.unit()) * 2.0 - 1.0;
                grid.walk(i, eye, camera.ray(ndc), 0, &mut |_, cell, thing| {
                    cells.push(cell);
                    things.extend(thing);
                });
                rays += 1;
            }
            cells.sort();
            cells.dedup();
            things.sort();
            things.dedup();
            found += things.len() as u64;
            through += cells.len() as u64 - 1;
            for set in [portals, both] {
                let missing: Vec<_> = things.iter().filter(|t| set.0.binary_search(t).is_err()).collect();
                assert!(missing.is_empty(), "round {round}, frame {frame}, fov {fov}: {missing:?} seen from {eye}");
                assert!(cells.iter().all(|c| set.1.binary_search(c).is_ok()), "round {round}, frame {frame}, fov {fov}");
            }
        }
    }
    // The test sees something, and the culler leaves something out.
    assert!(rays > 200_000 && found > 1_500 && through > 1_000, "{rays} rays, {found} things, {through} other cells");
    assert!(kept * 2 < all, "{kept} of {all} kept");
}

/// The rectangle of a door seen face on is the door's, to within a pixel of a large screen.
#[test]
fn a_portal_opens_its_rectangle() {
    let (building, _) = flat();
    let (_, file) = building.finish();
    let eye = p(1.5, 1.05, 2.0);
    let camera = Camera::look_at(eye - file.origin, p(1.5, 1.05, 4.0) - file.origin, 90f64.to_radians(), 1.0);
    let seen = see(&Culler::new(&file), &camera, Mode::Portals);
    let (portal, rect) = seen.portals[0];
    // 1 m wide and 2.1 m high, 2 m away, at 90 degrees.
    assert_eq!((seen.portals.len(), portal), (1, 0));
    assert!((rect.max - glam::Vec2::new(0.25, 0.525)).abs().max_element() < 1e-3, "{rect:?}");
    assert!((rect.min + glam::Vec2::new(0.25, 0.525)).abs().max_element() < 1e-3, "{rect:?}");
}

/// A file without rows: every cell sees everything, until its row comes. Then its frames are those of a file that had it from the start.
#[test]
fn rows_may_come_while_somebody_walks() {
    let (building, things) = flat();
    let (_, file) = building.finish_with(|cells, objects| {
        cells.clear(A.index(), B.index());
        cells.clear(B.index(), A.index());
        for (cell, hidden) in [(A, things.in_b), (B, things.in_a), (CORRIDOR, things.tree)] {
            objects.clear(cell.index(), hidden.index());
        }
    });
    let (object_rows, cell_rows) = (file.object_rows.clone().unwrap(), file.cell_rows.clone().unwrap());
    let (baked, learning) = (Culler::new(&file), {
        let mut bare = file.clone();
        (bare.object_rows, bare.cell_rows) = (None, None);
        Culler::new(&bare)
    });
    let eyes = [(A, p(1.5, 1.2, 3.0)), (B, p(7.0, 1.2, 2.0)), (CORRIDOR, p(5.0, 1.2, 5.0))];
    let sets = |culler: &Arc<Culler>, eye: DVec3| {
        let cameras = [DVec3::X, DVec3::NEG_X, DVec3::Z, DVec3::NEG_Z]
            .map(|to| Camera::look_at(eye - file.origin, eye + to - file.origin, 90f64.to_radians(), 1.5));
        cameras.map(|camera| [Mode::Frustum, Mode::Pvs, Mode::PortalsAndPvs].map(|mode| see(culler, &camera, mode).objects))
    };
    let mut fewer = 0;
    for (i, (cell, eye)) in eyes.into_iter().enumerate() {
        assert!(sets(&learning, eye).iter().all(|[frustum, pvs, _]| pvs == frustum), "nothing is known of {cell} yet");
        let learn = |objects| learning.learn_row(cell, objects, cell_rows.row(cell.index()));
        // The first row of a cell stays.
        assert_eq!([learn(object_rows.row(cell.index())), learn(&[0])], [true, false]);
        for &(cell, eye) in &eyes[..=i] {
            assert_eq!(sets(&learning, eye), sets(&baked, eye), "{cell}");
        }
        fewer += sets(&learning, eye).iter().filter(|[frustum, pvs, _]| pvs.len() < frustum.len()).count();
    }
    assert!(fewer > 0, "rows leave something out");
}

/// Within a view cell, rows draw what its row has of the cell's; on its boundary and beyond it, the cell's row holds alone.
#[test]
fn frames_in_a_view_cell_draw_its_row() {
    let (building, things) = flat();
    let (_, mut file) = building.finish();
    let (eye, chair) = (p(1.5, 1.2, 3.), p(3., 0.5, 1.));
    let draws_chair = |file: &PvsFile, off: f64, mode: Mode| look(file, eye + p(0., off, 0.), chair, mode).has(things.in_a);
    assert!(draws_chair(&file, 0.0, Mode::Pvs) && draws_chair(&file, 0.0, Mode::PortalsAndPvs));
    // 20 cm around the eye, and a row that says against the truth that the chair isn't seen: it must be believed there, and only there.
    let side = |axis: usize, sign: f64| {
        let n = DVec3::AXES[axis] * sign;
        n.extend(n.dot(eye - file.origin) + 0.1).as_vec4()
    };
    let planes = (0..3).flat_map(|axis| [side(axis, 1.0), side(axis, -1.0)]).collect();
    let mut rows = BitMatrix::new(1, file.objects.len());
    (0..file.objects.len()).filter(|&o| o != things.in_a.index()).for_each(|o| _ = rows.set(0, o));
    file.views.cells = vec![FileViewCell { id: "around the eye".into(), pieces: vec![planes] }];
    file.views.rows = Some(rows);
    for mode in [Mode::Pvs, Mode::PortalsAndPvs] {
        assert!(!draws_chair(&file, 0.0, mode), "{mode:?} in the view cell");
        assert!(draws_chair(&file, 0.1, mode), "{mode:?} on its boundary");
        assert!(draws_chair(&file, 0.2, mode), "{mode:?} beyond it");
    }
    assert!(draws_chair(&file, 0.0, Mode::Portals), "portals ask no row");
}

/// Indoors, portals and rows leave little to ask about; outdoors, and where nobody knows where the eye is, much.
#[test]
fn auto_asks_in_open_cells_only() {
    let (_, file) = flat().0.finish();
    let culler = Culler::new(&file);
    let frames = View::new(&culler);
    let chosen = |eye: DVec3, mode| {
        let eye = eye - file.origin;
        frames.choose(&Camera::look_at(eye, eye + DVec3::X, 1.2, 1.6), mode)
    };
    let mut counts = [0, 0];
    for (x, z) in (0..400).map(|i| (f64::from(i % 20) - 4.0, f64::from(i / 20) - 4.0)) {
        let eye = p(x + 0.31, 1.6, z + 0.17);
        let home = culler.cell_of((eye - file.origin).as_vec3());
        let is_closed = home.is_some_and(|cell| cell != OUTSIDE);
        counts[usize::from(is_closed)] += 1;
        assert_eq!(chosen(eye, Mode::Auto), if is_closed { Mode::PortalsAndPvs } else { Mode::Chc }, "{eye}");
    }
    assert!(counts.iter().all(|&count| count > 20), "{counts:?}: this tests nothing");
    assert_eq!(chosen(p(500.0, 1.6, 500.0), Mode::Auto), Mode::Chc);
    for mode in Mode::ALL.into_iter().filter(|&mode| mode != Mode::Auto) {
        assert_eq!(chosen(p(500.0, 1.6, 500.0), mode), mode);
    }
}
