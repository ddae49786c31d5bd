//! Tubes on a device: their pixels against triangles that are worked out here, thin ones against what they cover, and no mode misses one.

use crate::common::{self, needs_device, path, shipped};
use enfilade::bake::BakeOptions;
use enfilade::runtime::{Camera, Mode};
use enfilade::scene::{ImportOptions, Role, Scene, SceneBuilder, Source};
use enfilade_formats::import;
use enfilade_measure::walkthrough::picture::Picture;
use enfilade_tubes::{Counts, SIDES, Shape, Tubes, usual_error};
use enfilade_viewer::building::Building;
use enfilade_viewer::commands::Action;
use enfilade_viewer::culling::Oracle;
use enfilade_viewer::draw::frame::FrameRequest;
use enfilade_viewer::draw::renderer::Renderer;
use enfilade_viewer::draw::targets::{Canvas, PICTURE};
use enfilade_viewer::draw::tubes::Thin;
use enfilade_viewer::headless::{Walk, device};
use enfilade_viewer::looks::{Detail, Looks};
use enfilade_viewer::mode::ViewMode;
use glam::{DVec2, DVec3, dvec3};
use std::collections::{HashMap, HashSet};
use std::sync::OnceLock;
use testing::bakes;
use testing::meshes::{corners, soup};

const SIZE: [u32; 2] = [320, 180];

fn building(scene: Scene) -> Building {
    let file = bakes::baked(&scene, BakeOptions { keep_bounds: true, ..bakes::with_rays(0) });
    let scene = scene.meshed(|_| 6);
    let looks = Looks::read(&scene, &shipped("villa_rotonda", "glb"), &ImportOptions::default(), &|_| {});
    Building::new(scene, file, looks)
}

fn line(tubes: &mut Tubes, points: &[DVec3], radius: f64) {
    let shape = Shape { radius, inner: 0.0, capped: true };
    tubes.line(points, false, shape, usual_error(radius), &mut Counts::default()).unwrap();
}

/// The villa with pipes through its rooms: thick and thin, straight and with bends.
fn villa() -> &'static Building {
    static VILLA: OnceLock<Building> = OnceLock::new();
    VILLA.get_or_init(|| {
        let villa = import(&shipped("villa_rotonda", "glb"), &ImportOptions::default()).unwrap();
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        for object in &villa.objects {
            builder.add(soup(&object.node, object.role, object.opaque, &corners(&villa, object))).unwrap();
        }
        let bounds = villa.bounds();
        let [least, most] = [bounds.min + villa.origin, bounds.max + villa.origin];
        for k in 0..12 {
            let share = (k as f64 + 0.5) / 12.0;
            let radius = [0.08, 0.02, 0.003][k % 3];
            let mut tubes = Tubes::default();
            let y = least.y + 2.4 + 0.05 * (k % 5) as f64;
            let at =
                |s: f64, t: f64, up: f64| dvec3(least.x + s * (most.x - least.x), y + up, least.z + t * (most.z - least.z));
            line(
                &mut tubes,
                &[at(0.05, share, 0.0), at(0.5, share, 0.0), at(0.5, share, 0.7), at(0.95, share, 0.7)],
                radius,
            );
            line(&mut tubes, &[at(share, 0.05, -0.3), at(share, 0.95, -0.3)], radius);
            builder.add_tubes(format!("pipe {k}"), Role::Furnishing, tubes).unwrap();
        }
        building(builder.finish("piped").unwrap())
    })
}

/// Nothing but tubes: these, and so many metres below them so many more that they don't become meshes.
fn alone(tubes: &Tubes, below: f64) -> Building {
    let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
    builder.add_tubes("pipe".into(), Role::Furnishing, tubes.clone()).unwrap();
    let mut more = Tubes::default();
    (0..64).map(f64::from).for_each(|k| line(&mut more, &[dvec3(k, -below, 0.0), dvec3(k, -below, 1.0)], 0.1));
    builder.add_tubes("more".into(), Role::Furnishing, more).unwrap();
    building(builder.finish("pipes").unwrap())
}

fn picture(walk: &mut Walk<'_, '_>, camera: Camera, mode: Mode) -> Picture {
    walk.draw(FrameRequest::new(camera, mode)).unwrap();
    walk.picture().unwrap()
}

#[test]
fn no_mode_misses_a_pixel_of_tubes_in_rooms() {
    needs_device!();
    let (villa, path) = (villa(), path("villa_rotonda"));
    let software = ViewMode::ALL.into_iter().map(|mode| (mode, Oracle::Software));
    let mut drawn = HashMap::new();
    for (mode, oracle) in software.chain([(Mode::Chc.into(), Oracle::Device)]) {
        for thin in [Thin::Off, Thin::Weighed] {
            let mut walk = Walk::new(villa, &path, Some(oracle), SIZE).unwrap();
            walk.renderer.tubes.as_mut().unwrap().look.thin = thin;
            if mode == Mode::PortalsAndPvs.into() {
                walk.renderer.set_detail(Detail::Full).unwrap();
            }
            for frame in (0..path.frames.len()).step_by(9) {
                let missed = walk.missed(walk.camera(frame), mode).unwrap().expect("counted");
                assert_eq!(missed.pixels, 0, "{mode} by {oracle:?}, {thin:?}, frame {frame}: {missed:?}");
                let pipes = walk.renderer.tubes.as_ref().unwrap();
                drawn.insert((mode.name(), frame), pipes.drawn.chosen().segments);
                assert!(pipes.drawn.chosen().segments <= pipes.all.chosen().segments);
            }
        }
    }
    for mode in [Mode::Pvs, Mode::PortalsAndPvs, Mode::Chc].map(Mode::name) {
        let fewer = |frame: &usize| drawn[&(mode, *frame)] < drawn[&(Mode::Frustum.name(), *frame)];
        assert!((0..path.frames.len()).step_by(9).any(|frame| fewer(&frame)), "{mode} culls no tube that the frustum has");
    }
}

#[test]
fn pictures_are_the_same_with_and_without_culling() {
    needs_device!();
    let (villa, path) = (villa(), path("villa_rotonda"));
    let mut walk = Walk::new(villa, &path, Some(Oracle::Software), SIZE).unwrap();
    for detail in [Detail::Plain, Detail::Full] {
        walk.renderer.set_detail(detail).unwrap();
        for frame in (0..path.frames.len()).step_by(11) {
            let camera = walk.camera(frame);
            let whole = picture(&mut walk, camera, Mode::None);
            for mode in [Mode::Pvs, Mode::PortalsAndPvs] {
                let culled = picture(&mut walk, camera, mode);
                let different = whole.pixels().iter().zip(culled.pixels()).filter(|(a, b)| a != b).count();
                assert_eq!(different, 0, "{detail:?}, {mode}, frame {frame}");
            }
        }
    }
}

/// An alarm that can't ring proves nothing: an object of tubes is taken out of the row.
#[test]
fn the_alarm_sees_tubes_that_are_missing() {
    needs_device!();
    let (sound, path) = (villa(), path("villa_rotonda"));
    let mut walk = Walk::new(sound, &path, None, SIZE).unwrap();
    let is_tube = |o: &enfilade::ObjectId| sound.scene.objects[o.index()].is_tube();
    let mut rang = 0;
    for frame in (0..path.frames.len()).step_by(5) {
        let camera = walk.camera(frame);
        assert_eq!(walk.missed(camera, Mode::Frustum).unwrap().expect("counted").pixels, 0);
        // What was decided stays; the frame is drawn by a camera that has turned away from it.
        let turned = Camera { x: -camera.x, w: -camera.w, ..camera };
        walk.draw(FrameRequest { culled_by: None, alarm: true, ..FrameRequest::new(turned, Mode::Frustum) }).unwrap();
        walk.renderer.settle().unwrap();
        let missed = walk.renderer.readback.missed.clone().expect("counted");
        rang += u32::from(missed.objects.iter().any(|(o, pixels)| is_tube(o) && *pixels > 0));
    }
    assert!(rang > 0, "no tube was missed");
}

/// Where a point is on the screen, pixels from the top left.
fn pixel(camera: &Camera, p: DVec3) -> DVec2 {
    let away = p - camera.eye.as_dvec3();
    let [x, y, w] = [camera.x, camera.y, camera.w].map(|row| away.dot(row.as_dvec3()));
    DVec2::new((x / w + 1.0) / 2.0 * f64::from(SIZE[0]), (1.0 - y / w) / 2.0 * f64::from(SIZE[1]))
}

/// A building of tubes, painted black, before the sky.
fn black<'b>(building: &'b Building, thin: Thin) -> (Canvas, Renderer<'b>) {
    let gpu = device().unwrap();
    let canvas = Canvas::new(&gpu, SIZE);
    let mut renderer = Renderer::new(gpu, building, Oracle::Software, SIZE, PICTURE).unwrap();
    renderer.paint(vec![[0; 3]; building.scene.objects.len()]);
    renderer.tubes.as_mut().unwrap().look.thin = thin;
    (canvas, renderer)
}

fn shot(renderer: &mut Renderer<'_>, canvas: &Canvas, camera: Camera) -> Picture {
    renderer.frame(FrameRequest::new(camera, Mode::None), &canvas.view, None).unwrap();
    canvas.read(&renderer.gpu).unwrap()
}

/// How much of a pixel is black.
fn weight(colour: [u8; 3]) -> f64 {
    1.0 - f64::from(colour[0]) / (0.80 * 255.0)
}

/// What is drawn is what the library says: pixels whose middle is in a triangle of the bands are black, others are not, but for those at edges.
#[test]
fn pixels_are_those_of_the_bands() {
    needs_device!();
    let building = alone(&bends(), 100.0);
    let (canvas, mut renderer) = black(&building, Thin::Off);
    let origin = building.file.origin;
    let mut covered = 0;
    for (eye, limit, angle) in [
        (dvec3(6.0, 4.0, 5.0), 0.5, 1.0),
        (dvec3(-4.0, 1.0, -3.0), 0.25, 1.0),
        (dvec3(20.0, 9.0, 1.0), 1.0, 1.0),
        (dvec3(5.0, 1.0, 0.2), 4.0, 1.0),
        // So large that rings between sections are drawn.
        (dvec3(6.0, 4.0, 5.0), 0.2, 0.05),
    ] {
        let camera = Camera::look_at(eye - origin, dvec3(0.0, 1.2, 0.0) - origin, angle, 320.0 / 180.0);
        renderer.tubes.as_mut().unwrap().look.limit = limit;
        let seen = shot(&mut renderer, &canvas, camera);
        let scene = &building.scene;
        let selection = &renderer.tubes.as_ref().unwrap().drawn.selection;
        let mut triangles = Vec::new();
        let is_within = |band: &enfilade_tubes::Band| band.ends().iter().any(|at| at.fract() > 0.0);
        if angle < 1.0 {
            assert!((0..SIDES.len()).flat_map(|sides| selection.bands(sides)).any(is_within), "from {eye}");
        }
        for band in (0..SIDES.len()).flat_map(|sides| selection.bands(sides)) {
            let of = scene.tubes.tubes[band.tube() as usize].origin;
            triangles.extend(band.triangles(&scene.tubes).map(|t| t.map(|p| pixel(&camera, p.as_dvec3() + of))));
        }
        let [inside, edge] = pixels_of(&triangles);
        let mut wrong = 0;
        for (i, colour) in (0u32..).zip(seen.pixels()) {
            let at = (i % SIZE[0], i / SIZE[0]);
            // At an edge between two triangles, the pixel is in either.
            let is_black = weight(*colour) > 0.5;
            wrong += u32::from(is_black != inside.contains(&at) && !edge.contains(&at));
            covered += u32::from(is_black);
        }
        assert_eq!(wrong, 0, "from {eye}");
    }
    assert!(covered > 10_000, "{covered} pixels are covered");
}

/// A helix, a pipe with corners, and a ring.
fn bends() -> Tubes {
    let mut tubes = Tubes::default();
    let helix: Vec<DVec3> = (0..200).map(|k| 0.1 * f64::from(k)).map(|t| dvec3(t.cos(), 0.15 * t, t.sin())).collect();
    let shape = Shape { radius: 0.2, inner: 0.15, capped: true };
    tubes.through(&helix, false, shape, 1e-3, &mut Counts::default()).unwrap();
    line(&mut tubes, &[dvec3(-2.0, 0.0, 0.0), dvec3(-2.0, 2.0, 0.0), dvec3(-2.0, 2.0, 2.0), dvec3(2.0, 2.5, 3.0)], 0.15);
    let ring: Vec<DVec3> =
        (0..24).map(|k| 0.2618 * f64::from(k)).map(|t| dvec3(2.5 * t.cos(), 1.0, 2.5 * t.sin())).collect();
    let whole = Shape { radius: 0.1, inner: 0.0, capped: true };
    tubes.through(&ring, true, whole, 1e-3, &mut Counts::default()).unwrap();
    tubes
}

/// Pixels whose middle is in a triangle, and pixels whose middle is near to an edge.
fn pixels_of(triangles: &[[DVec2; 3]]) -> [HashSet<(u32, u32)>; 2] {
    let (mut inside, mut edge) = (HashSet::new(), HashSet::new());
    for &[a, b, c] in triangles {
        let [low, high] = [a.min(b).min(c) - 1.0, a.max(b).max(c) + 1.0];
        for y in low.y.max(0.0) as u32..high.y.clamp(0.0, f64::from(SIZE[1])) as u32 {
            for x in low.x.max(0.0) as u32..high.x.clamp(0.0, f64::from(SIZE[0])) as u32 {
                let p = DVec2::new(f64::from(x) + 0.5, f64::from(y) + 0.5);
                let off = [(a, b), (b, c), (c, a)].map(|(u, v)| (v - u).perp_dot(p - u) / (v - u).length().max(1e-9));
                let is_in = off.iter().all(|o| *o >= 0.0) || off.iter().all(|o| *o <= 0.0);
                let near = [(a, b), (b, c), (c, a)].iter().any(|(u, v)| {
                    let t = ((p - u).dot(v - u) / (v - u).length_squared().max(1e-12)).clamp(0.0, 1.0);
                    u.lerp(*v, t).distance(p) < 0.02
                });
                if near {
                    edge.insert((x, y));
                } else if is_in {
                    inside.insert((x, y));
                }
            }
        }
    }
    [inside, edge]
}

/// Pixels that a straight pipe covers which is so many pixels wide: by 16 x 16 samples a pixel.
fn sampled([a, b]: [DVec2; 2], wide: f64) -> f64 {
    let (along, length) = ((b - a).normalize(), a.distance(b));
    let samples = (0..16 * SIZE[1]).flat_map(|y| (0..16 * SIZE[0]).map(move |x| DVec2::new(f64::from(x), f64::from(y))));
    let covered = samples
        .map(|p| (p + 0.5) / 16.0 - a)
        .filter(|p| (0.0..=length).contains(&p.dot(along)) && p.perp_dot(along).abs() <= wide / 2.0);
    covered.count() as f64 / 256.0
}

/// Straight pipes across the view, far away: what is drawn weighs as much as they cover, and no pixel of the middle line is empty.
#[test]
fn thin_pipes_weigh_what_they_cover() {
    needs_device!();
    let radius = 0.05;
    for wide in [0.1, 0.2, 0.4, 0.8] {
        // Pixels wide, at this distance, and 250 pixels long.
        let focal = f64::from(SIZE[1]) / 2.0 / 0.5f64.tan();
        let away = 2.0 * radius * focal / wide;
        let half = away / focal * dvec3(120.0, 37.0, 0.0);
        let mut tubes = Tubes::default();
        line(&mut tubes, &[-half, half], radius);
        let building = alone(&tubes, 1e4);
        let ends = [-half, half].map(|p| p - building.file.origin);
        let eye = (ends[0] + ends[1]) / 2.0 + dvec3(0.3, 0.2, away);
        let camera = Camera::look_at(eye, eye - DVec3::Z, 1.0, 320.0 / 180.0);
        let [a, b] = ends.map(|p| pixel(&camera, p));
        let true_weight = sampled([a, b], wide);
        assert!((true_weight / (a.distance(b) * wide) - 1.0).abs() < 0.02, "{true_weight} by samples");
        let columns: Vec<u32> = (0..SIZE[0]).filter(|x| (a.x + 1.0..b.x - 1.0).contains(&(f64::from(*x) + 0.5))).collect();
        let row = |x: u32| a.y + (f64::from(x) + 0.5 - a.x) / (b.x - a.x) * (b.y - a.y);
        let of = |thin: Thin| {
            let (canvas, mut renderer) = black(&building, thin);
            let seen = shot(&mut renderer, &canvas, camera);
            let sum: f64 = seen.pixels().iter().map(|colour| weight(*colour).max(0.0)).sum();
            let at = |x: u32| weight(seen.pixels()[(row(x) as u32 * SIZE[0] + x) as usize]) > 0.02;
            (sum / true_weight, columns.iter().filter(|x| at(**x)).count() as f64 / columns.len() as f64)
        };
        let [plain, ours, study] = [Thin::Off, Thin::Weighed, Thin::Wide].map(of);
        println!("{wide} px: weight and coverage: as it is {plain:.3?}, ours {ours:.3?}, the study's {study:.3?}");
        assert!(columns.len() > 20, "{} columns at {wide} px", columns.len());
        assert!((ours.0 - 1.0).abs() < 0.05, "{wide} px: {} of the weight", ours.0);
        assert!(ours.1 >= 0.999, "{wide} px: {} of the middle line", ours.1);
        assert!(study.0 > 1.5 && plain.1 < 0.999, "{wide} px: {study:?}, {plain:?}");
    }
}

/// A straight pipe that leads away, 5 to 60 m from the eye, and is two chords at most: all along it, it weighs what it covers.
#[test]
fn pipes_that_lead_away_weigh_what_they_cover() {
    needs_device!();
    let focal = f64::from(SIZE[1]) / 2.0 / 0.5f64.tan();
    let [near, far] = [5.0, 60.0];
    // Half a pixel wide where it is nearest.
    let radius = 0.25 * near / focal;
    let aside = dvec3(120.0, 37.0, 0.0);
    let ends = [-aside * near / focal - near * DVec3::Z, aside * far / focal - far * DVec3::Z];
    let mut tubes = Tubes::default();
    line(&mut tubes, &ends, radius);
    let building = alone(&tubes, 1e4);
    let eye = -building.file.origin;
    let camera = Camera::look_at(eye, eye - DVec3::Z, 1.0, 320.0 / 180.0);
    // Its outline is across the plane of the eye and the pipe, which is level with the picture.
    let at = |t: f64| ends[0].lerp(ends[1], t);
    let on_screen = |p: DVec3| p.truncate() * focal / -p.z;
    const PARTS: usize = 100_000;
    let area_of = |k: usize| {
        let [a, m, b] = [0.0, 0.5, 1.0].map(|part| at((k as f64 + part) / PARTS as f64));
        2.0 * radius * focal / -m.z * on_screen(a).distance(on_screen(b))
    };
    let area: f64 = (0..PARTS).map(area_of).sum();
    let (canvas, mut renderer) = black(&building, Thin::Weighed);
    let seen = shot(&mut renderer, &canvas, camera);
    let sum: f64 = seen.pixels().iter().map(|colour| weight(*colour).max(0.0)).sum();
    assert!(renderer.tubes.as_ref().unwrap().drawn.chosen().segments <= 2);
    assert!((sum / area - 1.0).abs() < 0.05, "{sum} of {area} pixels");
}

/// The study counts 13,270 MB for 184.3 million triangles: three corners of 24 bytes each. The viewer's are 48 bytes.
#[test]
fn sections_take_far_fewer_bytes_than_meshes() {
    needs_device!();
    let mut tubes = Tubes::default();
    for k in 0..20 {
        let helix = (0..500).map(|t| 0.1 * f64::from(t)).map(|t| dvec3(t.cos() + 3.0 * f64::from(k), 0.1 * t, t.sin()));
        let shape = Shape { radius: 0.1, inner: 0.0, capped: true };
        tubes.through(&helix.collect::<Vec<_>>(), false, shape, 1e-3, &mut Counts::default()).unwrap();
    }
    let building = alone(&tubes, 1e4);
    let (_, renderer) = black(&building, Thin::Off);
    let pipes = renderer.tubes.as_ref().unwrap();
    let segments: u64 = building.scene.tubes.tubes.iter().map(|tube| tube.segments().len() as u64).sum();
    let triangles = 36 * segments;
    assert!(72 * pipes.bytes <= 72 * triangles, "{} bytes for {triangles} triangles of 72", pipes.bytes);
    assert!(72 * pipes.bytes <= 48 * triangles, "{} bytes for {triangles} triangles of 48", pipes.bytes);
    // An indexed mesh shares its corners: 18 a section of 24 bytes, and three numbers a triangle.
    assert!(36 * pipes.bytes <= 12 * triangles + 18 * 24 * segments, "{} bytes for {segments} segments", pipes.bytes);
    assert_eq!(renderer.mesh.triangles, 0, "tubes are no triangles");
}

#[test]
fn sides_are_shown_where_there_are_tubes() {
    needs_device!();
    let (villa, path) = (villa(), path("villa_rotonda"));
    let (canvas, mut session) = common::visit(villa, Oracle::Software, SIZE);
    session.stand(&path, path.frames.len() / 2);
    assert!(!session.is_on(Action::Tubes));
    session.act(Action::Tubes);
    assert!(session.is_on(Action::Tubes));
    session.draw(&canvas.view, egui::RawInput::default(), 0.02).unwrap();
    session.act(Action::Tubes);
    assert!(!session.is_on(Action::Tubes));
    // A building without any.
    let plain = common::building("villa_rotonda");
    let (_, mut session) = common::visit(&plain, Oracle::Software, SIZE);
    assert!(session.renderer.tubes.is_none());
    session.act(Action::Tubes);
    assert!(!session.is_on(Action::Tubes));
}
