//! `.ground` files: what is opened is selected from and loaded, from anywhere.

use enfilade::runtime::{Camera, Motion, Rect};
use enfilade_terrain::{Ground, GroundScratch, GroundView, Limit};
use glam::{DVec3, Vec3};
use std::io::Cursor;

/// Limits: usual ones, and ones that nobody means.
const LIMITS: [Limit; 7] = [
    Limit::Pixels(1.0),
    Limit::Pixels(0.0),
    Limit::Pixels(f64::NAN),
    Limit::Distance(2.0),
    Limit::Triangles(0),
    Limit::Triangles(20_000),
    Limit::Triangles(u32::MAX),
];

pub fn file(bytes: &[u8]) -> bool {
    let open = |cache| Ground::read(Cursor::new(bytes.to_vec()), bytes.len() as u64, cache);
    match open(u64::MAX) {
        Ok(mut ground) => looked_at(&mut ground),
        Err(e) => {
            let line = e.to_string();
            assert!(!line.is_empty() && !line.contains('\n'), "{line}");
            return false;
        }
    }
    // With a cache of two tiles and a thread, where there are levels.
    looked_at(&mut open(0).expect("it was opened before"));
    true
}

fn cameras(ground: &Ground) -> Vec<Camera> {
    let header = ground.header();
    let [west, north] = header.plan(0, 0);
    let high = header.step * 1000.0;
    let look = |eye: DVec3, to: DVec3| Camera::look_at(eye, to, 1.0, 1.5);
    let above = look(DVec3::new(west, high, north), DVec3::ZERO);
    let within = look(DVec3::new(1.0, 1.0, 1.0), DVec3::new(west, 0.0, north));
    let nothing = Camera { eye: Vec3::ZERO, x: Vec3::ZERO, y: Vec3::ZERO, w: Vec3::ZERO };
    let far = Camera { eye: Vec3::splat(1e30), ..above };
    let nowhere = Camera { eye: Vec3::NAN, x: Vec3::INFINITY, ..above };
    vec![above, within, far, nothing, nowhere]
}

fn looked_at(ground: &mut Ground) {
    let (mut scratch, mut motion) = (GroundScratch::default(), Motion::default());
    let count = ground.tiles().len() as u32;
    for (k, camera) in cameras(ground).into_iter().enumerate() {
        for size in [[1920, 1080], [0, u32::MAX]] {
            let view = GroundView { camera, size, windows: &[Rect::FULL] };
            motion.see(&camera, k as f64);
            for limit in LIMITS {
                let patches = ground.select(&view, limit, &mut scratch).to_vec();
                for patch in &patches {
                    assert!(patch.tile < count && ground.header().grid.tile(patch.key) == Some(patch.tile));
                    let slot = ground.slot(patch.tile).expect("what is drawn is in memory");
                    assert!(!ground.words(slot).is_empty());
                    let last = ground.header().grid.side() - 1;
                    assert!(ground.sample(patch.tile, [last, 0]).is_none_or(f32::is_finite));
                }
                let loading = ground.load(&view, limit, &motion, 0.5, &patches);
                assert!(
                    loading.present <= loading.wanted && ground.changed().iter().all(|&s| (s as usize) < ground.slots())
                );
            }
        }
        for at in [0.0, camera.eye.x.into(), f64::MAX, f64::NAN] {
            assert!(ground.height_at(at, 0.0).is_none_or(f64::is_finite));
        }
    }
    for fault in ground.faults() {
        assert!(!fault.to_string().contains('\n'));
    }
}
