//! Tubes: meshes against the exact surfaces of lines and arcs, edge by edge, and curves with known sections.

use enfilade_tubes::curve::{Arc, Odd, Piece, polyline};
use enfilade_tubes::{Counts, Mesh, Section, Shape, Tube, TubeError, Tubes, mesh, part, prism, sides, usual_error};
use glam::{DVec3, Vec3, dvec3};
use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use testing::plain::{nearest_of_segment, open_edges};
use testing::random::Random;

use super::{elbow, helix, stiff};

/// Metres: what single precision of places some metres from the origin may add.
const ROUNDING: f64 = 2e-6;

fn shape(radius: f64) -> Shape {
    Shape { radius, inner: 0.0, capped: true }
}

/// Whether points are corners of lines, or on a curve.
const WAYS: [&str; 2] = ["line", "through"];

fn made(way: &str, points: &[DVec3], closed: bool, radius: f64, error: f64) -> Tubes {
    let (mut tubes, mut counts) = (Tubes::default(), Counts::default());
    let add = if way == "line" { Tubes::line } else { Tubes::through };
    add(&mut tubes, points, closed, shape(radius), error, &mut counts).unwrap();
    tubes
}

/// Distance from a point to the curve of some pieces.
fn to_curve(pieces: &[Piece], p: DVec3) -> f64 {
    let of = |piece: &Piece| match piece {
        Piece::Line(line) => nearest_of_segment(*line, p).distance(p),
        Piece::Arc(arc) => {
            let (x, y) = ((p - arc.middle).dot(arc.x.normalize()), (p - arc.middle).dot(arc.y.normalize()));
            let angle = y.atan2(x).rem_euclid(TAU);
            let ends = [0.0, arc.angle].map(|t| arc.at(t).distance(p));
            if angle <= arc.angle { arc.at(angle).distance(p) } else { ends[0].min(ends[1]) }
        }
    };
    pieces.iter().map(of).fold(f64::INFINITY, f64::min)
}

fn at(mesh: &Mesh, triangle: [u32; 3]) -> [DVec3; 3] {
    triangle.map(|i| mesh.positions[i as usize].as_dvec3())
}

/// The volume that a closed mesh goes round, positive where it is counter-clockwise from outside.
fn volume(mesh: &Mesh) -> f64 {
    mesh.triangles.iter().map(|&t| at(mesh, t)).map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum()
}

/// Each edge is there once in each direction. Gives corners - edges + triangles.
fn is_closed(mesh: &Mesh, name: &str) -> i64 {
    let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
    for [a, b, c] in &mesh.triangles {
        [(a, b), (b, c), (c, a)].iter().for_each(|&(p, q)| *edges.entry((*p, *q)).or_default() += 1);
    }
    for (&(a, b), &count) in &edges {
        assert!(count == 1 && edges.get(&(b, a)) == Some(&1), "{name}: the edge {a} to {b} is open");
    }
    mesh.positions.len() as i64 - edges.len() as i64 / 2 + mesh.triangles.len() as i64
}

#[test]
fn a_straight_pipe_has_two_sections_and_the_area_of_a_prism() {
    let mut tubes = Tubes::default();
    let points: Vec<DVec3> = (0..10_000).map(|k| dvec3(1e-3 * f64::from(k), 2e-3 * f64::from(k), 0.0)).collect();
    tubes.line(&points, false, shape(0.1), 1e-4, &mut Counts::default()).unwrap();
    assert_eq!(tubes.sections.len(), 2, "a line of 10,000 points");
    let length = points[0].distance(points[9_999]);
    for count in [6, 12, 64] {
        let prism = mesh(&tubes, &tubes.tubes[0], count);
        assert_eq!(prism.triangles.len() as u32, 2 * count + 2 * (count - 2));
        assert_eq!(is_closed(&prism, "prism"), 2);
        let base = f64::from(count) / 2.0 * 0.01 * (TAU / f64::from(count)).sin();
        assert!((volume(&prism) / (base * length) - 1.0).abs() < 1e-3, "{count}: {}", volume(&prism));
    }
}

/// Corners stand on the surface; what lies between them is no farther from it than sections and sides may be together.
#[test]
fn an_elbow_is_as_near_to_its_surface_as_was_asked() {
    for (bend, radius) in [(0.3, 0.1), (0.5, 0.02), (2.0, 0.5), (0.11, 0.1)] {
        let pieces = elbow(bend);
        let mut before = 0;
        for error in [1e-2, 1e-3, 1e-4] {
            let mut tubes = Tubes::default();
            tubes.curve(&pieces, false, shape(radius), error, &mut Counts::default()).unwrap();
            let tube = &tubes.tubes[0];
            let sections = tubes.of(tube).len();
            assert!(sections > before, "{sections} after {before}");
            before = sections;
            let count = sides(radius, error);
            let of = mesh(&tubes, tube, count);
            assert_eq!(is_closed(&of, "elbow"), 2);
            // More than 64 sides there are not.
            let of_sides = error.max(radius * (1.0 - (PI / f64::from(count)).cos()));
            let rounding = ROUNDING + radius / 1e6;
            for (k, &triangle) in of.triangles.iter().enumerate() {
                if k + 2 * (count as usize - 2) >= of.triangles.len() {
                    break; // the caps
                }
                let [a, b, c] = at(&of, triangle);
                for corner in [a, b, c] {
                    let off = (to_curve(&pieces, corner) - radius).abs();
                    assert!(off <= rounding, "{bend} {radius} {error}: a corner is {off} m off");
                }
                for share in [(0.5, 0.5, 0.0), (0.5, 0.0, 0.5), (0.0, 0.5, 0.5), (0.4, 0.3, 0.3)] {
                    let off = (to_curve(&pieces, a * share.0 + b * share.1 + c * share.2) - radius).abs();
                    assert!(off <= error + of_sides + rounding, "{bend} {radius} {error}: {off} m off");
                }
            }
        }
        // An error of a hundredth takes ten times the sections.
        assert!((8..=400).contains(&before), "{before} sections");
    }
}

#[test]
fn rings_and_pipes_with_holes_are_closed() {
    let circle = Piece::Arc(Arc { middle: DVec3::ZERO, x: DVec3::X, y: DVec3::Y, angle: TAU });
    let mut tubes = Tubes::default();
    let mut counts = Counts::default();
    tubes.curve(&[circle], true, shape(0.25), 1e-3, &mut counts).unwrap();
    let torus = mesh(&tubes, &tubes.tubes[0], 48);
    assert_eq!(is_closed(&torus, "torus"), 0);
    assert!((volume(&torus) / (2.0 * PI * PI * 0.25 * 0.25) - 1.0).abs() < 0.02, "{}", volume(&torus));

    let pipe = Shape { radius: 0.2, inner: 0.15, capped: true };
    tubes.curve(&elbow(0.5), false, pipe, 1e-3, &mut counts).unwrap();
    let of = mesh(&tubes, &tubes.tubes[1], 48);
    assert_eq!(is_closed(&of, "pipe"), 0, "a pipe with a hole is a ring");
    let length = 2.0 + 0.5 * FRAC_PI_2 + 3.0;
    assert!((volume(&of) / (PI * (0.04 - 0.0225) * length) - 1.0).abs() < 0.01, "{}", volume(&of));
    let open = Shape { capped: false, ..shape(0.2) };
    tubes.curve(&elbow(0.5), false, open, 1e-3, &mut counts).unwrap();
    let sections = tubes.of(&tubes.tubes[2]).len();
    assert_eq!(mesh(&tubes, &tubes.tubes[2], 8).triangles.len(), 16 * (sections - 1));
    assert_eq!(counts, Counts::default());
}

/// A right angle becomes an arc of the tube's radius that touches both lines.
#[test]
fn corners_of_lines_become_arcs() {
    let mut odd = Odd::default();
    let corner = [DVec3::ZERO, dvec3(4.0, 0.0, 0.0), dvec3(4.0, 0.0, 4.0)];
    let curves = polyline(&corner, false, 0.5, &mut odd);
    let [pieces] = &curves[..] else { panic!("{curves:?}") };
    let [Piece::Line(first), Piece::Arc(arc), Piece::Line(last)] = pieces[..] else { panic!("{pieces:?}") };
    assert!((arc.radius() - 0.5).abs() < 1e-12 && (arc.angle - FRAC_PI_2).abs() < 1e-12);
    assert!(first[1].distance(dvec3(3.5, 0.0, 0.0)) < 1e-12 && last[0].distance(dvec3(4.0, 0.0, 0.5)) < 1e-12);
    assert!(arc.at(arc.angle).distance(last[0]) < 1e-12 && arc.middle.distance(dvec3(3.5, 0.0, 0.5)) < 1e-12);
    // Closed, each corner has one; lines that are too short are halved.
    let square = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 0.0, 1.0], [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]].map(DVec3::from);
    let [ring] = &polyline(&square, true, 10.0, &mut odd)[..] else { panic!("not one curve") };
    let radii: Vec<f64> =
        ring.iter().filter_map(|p| if let Piece::Arc(arc) = p { Some(arc.radius()) } else { None }).collect();
    assert!(radii.len() == 4 && radii.iter().all(|r| (r - 0.5).abs() < 1e-12), "{ring:?}");
    assert_eq!(odd, Odd::default());
}

#[test]
fn what_is_odd_is_counted_and_what_is_wrong_refused() {
    let mut tubes = Tubes::default();
    let mut counts = Counts::default();
    let there_and_back = [[0.0, 0.0, 0.0], [0.0; 3], [2.0, 0.0, 0.0], [1.0, 0.0, 0.0]].map(DVec3::from);
    tubes.line(&there_and_back, false, shape(0.1), 1e-3, &mut counts).unwrap();
    assert_eq!((counts.odd, tubes.tubes.len()), (Odd { twice: 1, back: 1 }, 2));
    tubes.curve(&elbow(0.05), false, shape(0.1), 1e-3, &mut counts).unwrap();
    assert_eq!(counts.tight, 1);
    let sections = tubes.sections.len();

    let line = [DVec3::ZERO, DVec3::X];
    for radius in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = tubes.line(&line, false, shape(radius), 1e-3, &mut counts);
        assert!(matches!(refused, Err(TubeError::Radius(_))), "{radius}");
    }
    let hole = Shape { inner: 0.1, ..shape(0.1) };
    assert!(matches!(tubes.line(&line, false, hole, 1e-3, &mut counts), Err(TubeError::Radius(_))));
    for points in [&[][..], &[DVec3::X], &[DVec3::X; 3]] {
        assert_eq!(tubes.line(points, false, shape(0.1), 1e-3, &mut counts), Err(TubeError::Points), "{points:?}");
        assert_eq!(tubes.through(points, false, shape(0.1), 1e-3, &mut counts), Err(TubeError::Points), "{points:?}");
    }
    for bad in [f64::NAN, f64::INFINITY, 2e12] {
        let refused = tubes.line(&[DVec3::ZERO, dvec3(0.0, bad, 0.0)], false, shape(0.1), 1e-3, &mut counts);
        assert_eq!(refused, Err(TubeError::Coordinate), "{bad}");
    }
    assert_eq!((tubes.sections.len(), tubes.tubes.len()), (sections, 3), "what is refused leaves nothing");
}

/// Whatever the numbers: finite corners, closed surfaces, and no panic.
#[test]
fn extreme_tubes() {
    for (name, points, radius, closed) in stiff() {
        for way in WAYS {
            let tubes = made(way, &points, closed, radius, radius * 1e-2);
            for tube in &tubes.tubes {
                let of = mesh(&tubes, tube, 8);
                let largest = of.positions.iter().map(|p| p.abs().max_element()).fold(0.0, f32::max);
                assert!(largest.is_finite() && f64::from(largest) < 2e4, "{name}, {way}: a corner at {largest} m");
                assert_eq!(is_closed(&of, name), if tube.closed { 0 } else { 2 }, "{name}, {way}");
            }
        }
    }
}

/// A helix of a million sections, on a cylinder of 1 m: all of them are near it, none is lost, and rings follow each other to the end.
#[test]
fn a_helix_of_a_million_sections() {
    const PITCH: f64 = 0.01;
    let points = helix(500_000, PITCH);
    let mut tubes = Tubes::default();
    tubes.through(&points, false, shape(0.01), 2e-4, &mut Counts::default()).unwrap();
    let (tube, sections) = (&tubes.tubes[0], &tubes.sections);
    assert!((900_000..2_000_000).contains(&sections.len()), "{} sections", sections.len());
    // Places are up to 500 m from the tube's origin, in single precision.
    const ROUNDING: f64 = 1e-4;
    // Between points, the curve is inside the circle by a sixteenth of the square of the step, in radians.
    const INSIDE: f64 = 0.1 * 0.1 / 16.0;
    for section in sections {
        let p = tube.origin + Vec3::from(section.place).as_dvec3();
        let off = (p.x.hypot(p.z) - 1.0).abs();
        assert!(off < INSIDE + ROUNDING, "{p} is {off} m off");
    }
    let last = tube.origin + Vec3::from(sections[sections.len() - 1].place).as_dvec3();
    assert!(last.distance(points[points.len() - 1]) < ROUNDING);
    let end = tube.segments().end;
    let rings = part(&tubes, tube, end - 1000..end, 8).positions;
    for (k, ring) in rings.windows(9).enumerate() {
        // Half a turn of the ring would be 2 cm beside the step.
        assert!(ring[8].distance(ring[0]) < 0.12, "corner {k}: {}", ring[8].distance(ring[0]));
    }
}

/// Sections of a helix lie along it, and rings do not turn: facing corners of neighbours are as far apart as the curve goes.
#[test]
fn rings_of_a_helix_follow_each_other() {
    let mut tubes = Tubes::default();
    let points: Vec<DVec3> = (0..400).map(|k| 0.05 * f64::from(k)).map(|t: f64| dvec3(t.cos(), 0.2 * t, t.sin())).collect();
    tubes.through(&points, false, shape(0.1), 1e-4, &mut Counts::default()).unwrap();
    let of: &[Section] = tubes.of(&tubes.tubes[0]);
    let rings = mesh(&tubes, &Tube { capped: false, ..tubes.tubes[0].clone() }, 16);
    for (ring, pair) in of.windows(2).enumerate() {
        let apart = Vec3::from(pair[0].place).distance(Vec3::from(pair[1].place));
        for k in 0..16 {
            let [a, b] = [ring, ring + 1].map(|r| rings.positions[16 * r + k]);
            assert!(a.distance(b) < 1.15 * apart + 1e-3, "ring {ring}: corner {k} goes {} of {apart} m", a.distance(b));
        }
    }
}

/// How many times a closed surface goes round a point, counter-clockwise from outside: by angles as seen from there.
fn winding(positions: &[DVec3], triangles: &[[u32; 3]], p: DVec3) -> f64 {
    let angle = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| positions[i as usize] - p);
        let lengths = [a.length(), b.length(), c.length()];
        let below = lengths.iter().product::<f64>() + a.dot(b) * lengths[2] + b.dot(c) * lengths[0] + c.dot(a) * lengths[1];
        2.0 * a.dot(b.cross(c)).atan2(below)
    };
    triangles.iter().map(angle).sum::<f64>() / (2.0 * TAU)
}

/// Tubes whose sections turn in all ways.
fn winding_tubes() -> Vec<(&'static str, Tubes)> {
    let points = |k: u32, f: &dyn Fn(f64) -> DVec3| (0..k).map(f64::from).map(f).collect::<Vec<_>>();
    let helix = points(300, &|t| dvec3((0.1 * t).cos(), 0.02 * t, (0.1 * t).sin()));
    let stairs = points(12, &|t| dvec3((t / 2.0).floor(), ((t + 1.0) / 2.0).floor(), 0.3 * t));
    let spikes = points(6, &|t| dvec3(t % 2.0, 0.05 * t, 0.0));
    let knot = points(90, &|t| {
        let a = TAU * t / 90.0;
        dvec3(a.sin() + 2.0 * (2.0 * a).sin(), a.cos() - 2.0 * (2.0 * a).cos(), -(3.0 * a).sin())
    });
    let back = vec![DVec3::ZERO, DVec3::X, dvec3(0.2, 1e-3, 0.0), dvec3(0.2, 1.0, 0.0)];
    let mut all = Vec::new();
    for (name, points, closed, radius) in [
        ("helix", helix, false, 0.05),
        ("stairs", stairs.clone(), false, 0.1),
        ("stairs, thick", stairs, false, 0.45),
        ("spikes", spikes, false, 0.08),
        ("knot", knot, true, 0.3),
        ("back", back, false, 0.1),
    ] {
        all.extend(WAYS.map(|way| (name, made(way, &points, closed, radius, usual_error(radius)))));
    }
    let mut elbows = Tubes::default();
    elbows.curve(&elbow(0.3), false, shape(0.1), 1e-3, &mut Counts::default()).unwrap();
    all.push(("elbow", elbows));
    all
}

/// What a bake sees of a tube holds all of it, wherever it is cut, and is closed.
#[test]
fn prisms_hold_their_tubes() {
    let mut random = Random::new(5);
    for (name, tubes) in winding_tubes() {
        for tube in &tubes.tubes {
            let all = tube.segments();
            for round in 0..3 {
                let [a, b] = [0, 1].map(|_| all.start + random.below(all.len()) as u32);
                let segments = if round == 0 { all.clone() } else { a.min(b)..a.max(b) + 1 };
                let of = prism(&tubes, tube, segments.clone());
                assert_eq!(open_edges(of.triangles.iter().copied()), 0, "{name}: open");
                let surface = part(&tubes, tube, segments.clone(), 24);
                for &t in surface.triangles.iter().step_by(13) {
                    let corners = at(&surface, t);
                    for p in [corners[0], (corners[0] + corners[1]) / 2.0, corners.iter().sum::<DVec3>() / 3.0] {
                        let turns = winding(&of.positions, &of.triangles, p);
                        assert!(turns > 0.9, "{name}: {p} of segments {segments:?} is outside: {turns}");
                    }
                }
                // Not much is added: a sphere of two radii around each corner is near a section.
                let radius = f64::from(tubes.of(tube)[0].radius());
                let places: Vec<DVec3> = tubes.of(tube).iter().map(|s| Vec3::from(s.place).as_dvec3()).collect();
                for &p in &of.positions {
                    let last = [places[places.len() - 1], places[0]];
                    let lines = places.windows(2).map(|pair| [pair[0], pair[1]]).chain(tube.closed.then_some(last));
                    let near = lines.map(|line| nearest_of_segment(line, p).distance(p)).fold(f64::INFINITY, f64::min);
                    assert!(near < 3.0 * radius, "{name}: a corner {near} m from the curve");
                }
            }
        }
    }
}

/// A whole pipe of 24 sides has four times the triangles of its prism, or more.
#[test]
fn prisms_have_a_quarter_of_the_triangles() {
    for (name, tubes) in winding_tubes().iter().filter(|(name, _)| ["helix", "elbow", "stairs"].contains(name)) {
        for tube in &tubes.tubes {
            let count = [prism(tubes, tube, tube.segments()).triangles.len(), mesh(tubes, tube, 24).triangles.len()];
            assert!(4 * count[0] <= count[1], "{name}: {count:?}");
        }
    }
}
