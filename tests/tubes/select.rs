//! Tubes as they are drawn, by pixels: against exact surfaces of lines and arcs, edge by edge, and counted.

use enfilade::runtime::Camera;
use enfilade_tubes::curve::Piece;
use enfilade_tubes::{Band, Counts, Runs, SIDES, Selection, Shape, Tubes, View, usual_error};
use glam::{DVec3, Vec3, dvec3};
use std::f64::consts::TAU;
use std::ops::Range;
use testing::plain::{nearest, nearest_of_segment, open_edges};
use testing::random::Random;

use super::{elbow, helix, stiff};

const NEAR: f64 = 1e-3;
const SIZE: [f64; 2] = [960.0, 540.0];
const LIMITS: [f64; 3] = [0.25, 0.5, 1.0];
/// Metres: what single precision of places some metres from the origin may add.
const ROUNDING: f64 = 4e-6;

fn camera(eye: DVec3, target: DVec3, degrees: f64) -> Camera {
    Camera::look_at(eye, target, degrees.to_radians(), SIZE[0] / SIZE[1])
}

fn view(camera: &Camera, limit: f64) -> View {
    View::new(camera.eye.as_dvec3(), [camera.x, camera.y, camera.w].map(Vec3::as_dvec3), NEAR, SIZE, limit)
}

/// Where a point is on the screen, pixels; `None` where it isn't on it.
fn pixel(camera: &Camera, p: DVec3) -> Option<[f64; 2]> {
    let away = p - camera.eye.as_dvec3();
    let [x, y, w] = [camera.x, camera.y, camera.w].map(|row| away.dot(row.as_dvec3()));
    (w >= NEAR && x.abs() <= w && y.abs() <= w).then(|| [x / w * SIZE[0] / 2.0, y / w * SIZE[1] / 2.0])
}

/// A point of the exact surface: of a piece, at a share of it, at an angle.
fn surface(piece: &Piece, share: f64, angle: f64, radius: f64) -> DVec3 {
    let (at, x, y) = match piece {
        Piece::Line([a, b]) => {
            let x = (*b - *a).normalize().any_orthonormal_vector();
            (a.lerp(*b, share), x, (*b - *a).normalize().cross(x))
        }
        Piece::Arc(arc) => {
            let at = arc.at(share * arc.angle);
            (at, (at - arc.middle).normalize(), arc.x.cross(arc.y).normalize())
        }
    };
    at + radius * (angle.cos() * x + angle.sin() * y)
}

fn bands(selection: &Selection) -> impl Iterator<Item = Band> + '_ {
    (0..SIDES.len()).flat_map(|sides| selection.bands(sides).iter().copied())
}

fn triangles(tubes: &Tubes, selection: &Selection) -> Vec<[DVec3; 3]> {
    bands(selection).flat_map(|band| of_band(tubes, band)).collect()
}

fn of_band(tubes: &Tubes, band: Band) -> Vec<[DVec3; 3]> {
    let origin = tubes.tubes[band.tube() as usize].origin;
    band.triangles(tubes).map(|t| t.map(|p| origin + p.as_dvec3())).collect()
}

/// All segments, cut into objects of so many.
fn objects(tubes: &Tubes, most: usize) -> Vec<Range<u32>> {
    let of = |tube: &enfilade_tubes::Tube| {
        let Range { start, end } = tube.segments();
        (start..end).step_by(most).map(|k| k..end.min(k + most as u32)).collect::<Vec<_>>()
    };
    tubes.tubes.iter().flat_map(of).collect()
}

fn select(tubes: &Tubes, objects: &[Range<u32>], view: &View) -> Selection {
    let runs = Runs::new(tubes, objects.iter().cloned());
    let mut selection = Selection::default();
    selection.select(tubes, &runs, view, (0..).zip(objects.iter().cloned()));
    selection
}

/// What is drawn, band by band: the line between the middles of its rings, and its triangles.
struct Drawn(Vec<([DVec3; 2], Vec<[DVec3; 3]>)>);

impl Drawn {
    fn new(tubes: &Tubes, selection: &Selection) -> Self {
        let of = |band| {
            let triangles = of_band(tubes, band);
            // Of two triangles of a side, the first has two corners of the first ring, the second two of the other.
            let middle = |first: usize, corner: usize| {
                let corners = triangles.iter().skip(first).step_by(2).map(|t| t[corner]);
                corners.sum::<DVec3>() / (triangles.len() / 2) as f64
            };
            ([middle(0, 0), middle(1, 0)], triangles)
        };
        Self(bands(selection).map(of).collect())
    }

    /// The point that is nearest to another one, of the bands along the nearest lines: of all, one may be nearer still.
    fn nearest(&self, p: DVec3) -> DVec3 {
        let away = |line: [DVec3; 2]| nearest_of_segment(line, p).distance_squared(p);
        let mut order: Vec<(f64, usize)> = self.0.iter().enumerate().map(|(k, band)| (away(band.0), k)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let close = order.iter().take(8).flat_map(|(_, k)| &self.0[*k].1).map(|&t| nearest(t, p));
        close.min_by(|a, b| a.distance_squared(p).total_cmp(&b.distance_squared(p))).expect("something is drawn")
    }
}

/// How far points of the exact surface are from what is drawn, pixels, at most; and from how many points that is.
fn farthest(pieces: &[Piece], radius: f64, camera: &Camera, drawn: &Drawn) -> (f64, u32) {
    let mut random = Random::new(7);
    let (mut worst, mut count) = (0.0f64, 0);
    for k in 0..250 {
        let piece = &pieces[k % pieces.len()];
        let p = surface(piece, random.real(0.0, 1.0), TAU * random.real(0.0, 1.0), radius);
        let Some(at) = pixel(camera, p) else { continue };
        let away = drawn.nearest(p) - camera.eye.as_dvec3();
        let [x, y, w] = [camera.x, camera.y, camera.w].map(|row| away.dot(row.as_dvec3()));
        let off = (x / w * SIZE[0] / 2.0 - at[0]).hypot(y / w * SIZE[1] / 2.0 - at[1]);
        // Single precision moves corners, which isn't what is tested.
        let rounding = ROUNDING * SIZE[0] / (p - camera.eye.as_dvec3()).dot(camera.w.as_dvec3());
        worst = worst.max(off - rounding);
        count += 1;
    }
    (worst, count)
}

/// Eyes around an elbow, near and far, beside it, before its ends, in it and on its axis.
fn eyes(radius: f64) -> Vec<(DVec3, DVec3, f64)> {
    let middle = dvec3(1.8, 0.0, -0.5);
    let mut eyes = vec![
        (dvec3(0.5, 0.0, 0.0), dvec3(1.5, 0.0, 0.0), 60.0),
        (dvec3(0.5, 0.3 * radius, 0.0), dvec3(1.5, 0.0, 0.0), 90.0),
        (dvec3(-1.0, 0.0, 0.0), dvec3(1.0, 0.0, 0.0), 60.0),
        (dvec3(1.0, 1.5 * radius, 0.0), dvec3(2.0, 1.5 * radius, 0.0), 60.0),
        (dvec3(1.0, 1.5 * radius, 0.0), dvec3(2.0, 0.0, 0.0), 179.9),
        (dvec3(30.0, 20.0, 10.0), middle, 1e-5),
        (dvec3(3000.0, 2000.0, 1000.0), middle, 60.0),
    ];
    let mut random = Random::new(3);
    for away in [0.6, 1.0, 3.0, 10.0, 40.0, 300.0] {
        let way = dvec3(random.real(0.0, 1.0) - 0.5, random.real(0.0, 1.0) - 0.5, random.real(0.0, 1.0) - 0.5).normalize();
        eyes.push((middle + away * way, middle, 60.0));
    }
    eyes
}

/// Near, far, beside, within, on the axis: in every picture. Sections are those of importers, 0.4 mm to 1 mm from the arc. Through a view of 1e-5
/// degrees, a pixel is 12 nm, which single precision doesn't have.
#[test]
fn nothing_of_the_surface_is_farther_off_than_the_limit() {
    let (mut points, mut closest, mut met) = (0, 0.0f64, 0);
    for (bend, radius, inner) in [(0.3, 0.1, 0.0), (0.5, 0.02, 0.0), (2.0, 0.5, 0.4), (0.11, 0.1, 0.0)] {
        let pieces = elbow(bend);
        let mut tubes = Tubes::default();
        let shape = Shape { radius, inner, capped: true };
        tubes.curve(&pieces, false, shape, usual_error(radius), &mut Counts::default()).unwrap();
        let objects = objects(&tubes, 3);
        for (eye, target, degrees) in eyes(radius) {
            for limit in LIMITS {
                let camera = camera(eye, target, degrees);
                let selection = select(&tubes, &objects, &view(&camera, limit));
                if degrees < 1.0 && selection.chosen().over > 0 {
                    continue;
                }
                assert_eq!(selection.chosen().over, 0, "{bend} {radius} from {eye}, {degrees} degrees, {limit} px");
                met += 1;
                let drawn = Drawn::new(&tubes, &selection);
                for radius in [radius, inner].into_iter().filter(|radius| *radius > 0.0) {
                    let (off, count) = farthest(&pieces, radius, &camera, &drawn);
                    let from = format!("{bend} {radius} from {eye}, {degrees} degrees");
                    assert!(off <= limit, "{from}: {off} px, and {limit} are the limit");
                    points += count;
                    closest = closest.max(off / limit);
                }
            }
        }
    }
    assert!(points > 30_000 && met >= 144, "{points} points in {met} pictures");
    // The bound isn't so safe that sides are wasted.
    assert!(closest > 0.3, "never more than {closest} of the limit");
}

/// Corners of triangles as bits, by which they are the same or not.
fn bits(p: Vec3) -> [u32; 3] {
    (p + Vec3::ZERO).to_array().map(f32::to_bits)
}

/// Edges of a tube that no other triangle shares in the other direction.
fn unmatched(tubes: &Tubes, selection: &Selection) -> usize {
    open_edges(bands(selection).flat_map(|band| band.triangles(tubes).map(move |t| t.map(|p| (band.tube(), bits(p))))))
}

/// A pipe away from the eye, with turns, which is all seen: rings have all sides from 64 to 4.
#[test]
fn every_edge_is_shared_whatever_sides_meet() {
    for (inner, closed) in [(0.0, false), (0.07, false), (0.0, true)] {
        let mut tubes = Tubes::default();
        let mut points: Vec<DVec3> =
            (0..60).map(f64::from).map(|t| dvec3(0.4 * t.sin(), 0.3 * (1.7 * t).cos(), -1.5 - 0.05 * t * t)).collect();
        if closed {
            let back: Vec<DVec3> = points.iter().rev().map(|p| *p + dvec3(0.4, 0.5, 0.0)).collect();
            points.extend(back);
        }
        let shape = Shape { radius: 0.1, inner, capped: true };
        tubes.line(&points, closed, shape, 1e-4, &mut Counts::default()).unwrap();
        let camera = camera(dvec3(0.1, 0.2, 1.0), dvec3(0.1, 0.2, -9.0), 100.0);
        for most in [1, 7, 100_000] {
            let objects = objects(&tubes, most);
            for limit in [0.05, 0.25, 1.0] {
                let selection = select(&tubes, &objects, &view(&camera, limit));
                let kinds = (0..SIDES.len()).filter(|&sides| !selection.bands(sides).is_empty()).count();
                assert!(kinds >= 3, "rings of {kinds} kinds");
                assert!(bands(&selection).any(|band| band.sides()[0] != band.sides()[1]));
                assert_eq!(unmatched(&tubes, &selection), 0, "{inner} {closed} {most} {limit}");
            }
        }
    }
}

/// What is drawn of an object is the same, whatever else is drawn.
#[test]
fn an_object_is_drawn_alike_alone_and_among_others() {
    let mut tubes = Tubes::default();
    let points: Vec<DVec3> = (0..50).map(f64::from).map(|t| dvec3(t.sin(), 0.0, -t)).collect();
    let shape = Shape { radius: 0.1, inner: 0.0, capped: true };
    tubes.through(&points, false, shape, 1e-4, &mut Counts::default()).unwrap();
    let objects = objects(&tubes, 16);
    let view = view(&camera(dvec3(0.0, 0.5, 1.0), dvec3(0.0, 0.0, -9.0), 60.0), 0.5);
    let runs = Runs::new(&tubes, objects.iter().cloned());
    let mut selection = Selection::default();
    selection.select(&tubes, &runs, &view, (0..).zip(objects.iter().cloned()));
    let all: Vec<Band> = bands(&selection).collect();
    for (number, object) in (0..).zip(&objects) {
        selection.select(&tubes, &runs, &view, [(number, object.clone())].into_iter());
        let alone: Vec<Band> = bands(&selection).collect();
        let among: Vec<Band> = all.iter().copied().filter(|band| band.object() == number).collect();
        assert_eq!(alone, among, "object {number}");
    }
    assert!(all.len() > 20);
}

/// A plant's pipes from above: racks with elbows and risers, 36 sides everywhere against what is chosen.
#[test]
fn far_fewer_triangles_than_sides_that_are_the_same_everywhere() {
    let mut tubes = Tubes::default();
    for k in 0..100 {
        let (x, z) = (f64::from(k % 10) * 6.0, f64::from(k / 10) * 6.0);
        let radius = [0.05, 0.1, 0.2, 0.3][k as usize % 4];
        let points = [[0.0, 0.0, 0.0], [0.0, 3.0, 0.0], [5.0, 3.0, 0.0], [5.0, 3.0, 4.0], [5.0, 0.0, 4.0]];
        let points = points.map(|p| DVec3::from(p) + dvec3(x, 0.0, z));
        let shape = Shape { radius, inner: 0.0, capped: false };
        tubes.line(&points, false, shape, usual_error(radius), &mut Counts::default()).unwrap();
    }
    let segments: u64 = tubes.tubes.iter().map(|tube| tube.segments().len() as u64).sum();
    let camera = camera(dvec3(-20.0, 30.0, -20.0), dvec3(30.0, 0.0, 30.0), 60.0);
    let selection = select(&tubes, &objects(&tubes, 1000), &view(&camera, 0.5));
    let chosen = selection.chosen();
    assert_eq!(chosen.over, 0);
    assert!(5 * chosen.triangles <= 72 * segments, "{} of {} triangles", chosen.triangles, 72 * segments);
}

/// Whatever the numbers: finite corners, and no panic.
#[test]
fn stiff_tubes_and_views() {
    for (name, points, radius, closed) in stiff() {
        let mut tubes = Tubes::default();
        let shape = Shape { radius, inner: 0.5 * radius, capped: true };
        tubes.through(&points, closed, shape, radius * 1e-2, &mut Counts::default()).unwrap();
        let objects = objects(&tubes, 1000);
        let [first, last] = [points[0], points[points.len() - 1]];
        for (eye, target) in [
            (first, first + DVec3::X),
            (first - DVec3::X, first),
            (last + DVec3::Y, first),
            (first + 1e6 * dvec3(0.3, 1.0, 0.2), first),
        ] {
            for degrees in [1e-5, 60.0, 179.9] {
                let view = view(&camera(eye, target, degrees), 0.5);
                let selection = select(&tubes, &objects, &view);
                let chosen = selection.chosen();
                assert!(chosen.segments <= 64 * tubes.sections.len() as u64, "{name}");
                assert!(chosen.triangles <= 1 << 24, "{name}: {} triangles", chosen.triangles);
                let count: u64 = bands(&selection).map(|band| u64::from(band.corners()) / 3).sum();
                assert_eq!(count, chosen.triangles, "{name}");
                let mut corners = bands(&selection).step_by(17).flat_map(|band| [0, 7, 1 << 20].map(|k| (band, k)));
                assert!(corners.all(|(band, k)| band.corner(&tubes, k % band.corners()).is_finite()), "{name}");
            }
        }
    }
    // Far away, a helix of any number of sections is one chord or a few.
    let mut tubes = Tubes::default();
    let shape = Shape { radius: 0.1, inner: 0.0, capped: true };
    tubes.through(&helix(3000, 0.1), false, shape, 1e-3, &mut Counts::default()).unwrap();
    let view = view(&camera(dvec3(2e4, 10.0, 0.0), dvec3(0.0, 10.0, 0.0), 60.0), 0.5);
    let chosen = select(&tubes, &objects(&tubes, 1_000_000), &view).chosen();
    assert!(tubes.sections.len() > 3000 && chosen.segments < 100, "{chosen:?} of {}", tubes.sections.len());
}

/// Objects of several tubes may begin or end with the last section of one, which has no segment: wherever they are cut, the same is drawn.
#[test]
fn objects_of_several_tubes_may_be_cut_anywhere() {
    let mut tubes = Tubes::default();
    for k in 0..6 {
        let points = [dvec3(0.0, 0.0, f64::from(k)), dvec3(1.0, 0.0, f64::from(k)), dvec3(1.0, 1.0, f64::from(k))];
        let points = if k % 2 == 0 { &points[..2] } else { &points[..] };
        tubes.line(points, false, Shape { radius: 0.05, inner: 0.0, capped: true }, 1e-3, &mut Counts::default()).unwrap();
    }
    let view = view(&camera(dvec3(3.0, 2.0, 8.0), dvec3(0.5, 0.5, 3.0), 60.0), 0.5);
    let end = tubes.sections.len() as u32;
    let area = |objects: &[Range<u32>]| -> f64 {
        let all = triangles(&tubes, &select(&tubes, objects, &view));
        all.iter().map(|[a, b, c]| (*b - *a).cross(*c - *a).length() / 2.0).sum()
    };
    let expected = area(std::slice::from_ref(&(0..end)));
    // Lines of 1 m and bends: nine tubes' worth of a pipe of 5 cm, within the limit of half a pixel.
    assert!(
        (expected / (TAU * 0.05 * (3.0 + 3.0 * (1.95 - 0.05 + 0.25 * TAU * 0.05)) + 12.0 * TAU * 0.05 * 0.025) - 1.0).abs()
            < 0.2
    );
    for cut in 1..end {
        // A cut may leave shorter runs, so a little more of the surface.
        assert!((area(&[0..cut, cut..end]) / expected - 1.0).abs() < 0.02, "cut at section {cut}");
    }
}
