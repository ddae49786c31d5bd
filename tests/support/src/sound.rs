//! What a scene promises, whatever it was read from.

use enfilade::scene::Scene;

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
