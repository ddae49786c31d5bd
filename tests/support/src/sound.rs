//! What scenes and graphs promise, whatever they were made from.

use enfilade::cells::{CellGraph, validate};
use enfilade::scene::Scene;
use enfilade::scene::rays::RayScene;

/// Objects of so many triangles at most, one after the other, each within its box; hints about what is there.
#[track_caller]
pub fn assert_sound(scene: &Scene, object_triangles: u32) {
    let mut next = 0;
    for object in &scene.objects {
        assert!(object.triangles.start == next && object.triangles.end > next);
        assert!(object.triangles.len() <= object_triangles as usize);
        next = object.triangles.end;
        for corner in object.triangles.clone().flat_map(|t| scene.corners(t as usize)) {
            assert!(corner.is_finite() && object.bounds.contains(corner));
        }
    }
    assert_eq!(next as usize, scene.triangles.len());
    assert!(scene.origin.is_finite() && !scene.triangles.is_empty());
    assert!(scene.hints.rooms.iter().flat_map(|r| r.surface.iter().flatten()).all(|p| p.is_finite()));
    for opening in &scene.hints.openings {
        assert!(opening.winding.len() >= 3 && opening.winding.iter().all(|p| p.is_finite()));
        assert!(opening.rooms.iter().flatten().all(|&room| room < scene.hints.rooms.len()));
    }
}

/// A graph is whole, flat to so many times what counts as one plane, and left through portals only. Returns how many of `segments` were followed.
#[track_caller]
pub fn assert_sealed(graph: &CellGraph, scene: &Scene, times: f64, segments: u64) -> u64 {
    let faults = validate::structure(graph, (times * scene.tolerance().coplanar).max(1e-9));
    assert!(faults.is_empty(), "{faults:?}");
    let sealing = validate::sealing(graph, &RayScene::new(scene), segments, 1);
    assert!(sealing.segments > segments / 10, "only {} segments were followed", sealing.segments);
    let leaks: Vec<String> = sealing.leaks.iter().take(5).map(ToString::to_string).collect();
    assert!(leaks.is_empty(), "{leaks:?}");
    sealing.segments
}
