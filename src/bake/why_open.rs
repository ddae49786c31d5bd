//! Why a model has no closed cell, so that portals hide nothing.

use crate::math::random::SplitMix;
use crate::scene::Scene;
use crate::scene::floors::Floors;
use crate::scene::rays::RayScene;
use glam::DVec3;
use std::f64::consts::TAU;

/// Eyes over floors, and horizontal directions per eye.
const EYES: usize = 256;
const DIRECTIONS: usize = 16;
/// Without a roof: fewer of the eyes are covered. Roofs count as floors, so a house has half or less.
const COVERED: f64 = 0.05;
/// Without walls: at least this share of horizontal rays from under a roof leaves the model. Rooms with wide windows have a tenth.
const OPEN: f64 = 0.4;

/// One clause: the missing part of the building, by rays from above the floors.
pub(super) fn why_open(scene: &Scene) -> String {
    let (rays, mut random) = (RayScene::new(scene), SplitMix::new(0));
    let eyes = Floors::of(scene).eyes(&rays, EYES, &mut random);
    let leaves = |eye: DVec3, direction: DVec3| rays.first_opaque(eye, direction, f64::INFINITY).is_none();
    let under: Vec<DVec3> = eyes.iter().copied().filter(|&eye| !leaves(eye, DVec3::Y)).collect();
    if eyes.is_empty() {
        return "it has no floors".into();
    }
    let covered = under.len() as f64 / eyes.len() as f64;
    if covered < COVERED {
        return format!(
            "only {:.0} % of the floors are covered: roofs are missing, or the model is outdoors",
            100.0 * covered
        );
    }
    let turn = random.unit() * TAU;
    let level = |k: usize| {
        let angle = turn + TAU * k as f64 / DIRECTIONS as f64;
        DVec3::new(angle.cos(), 0.0, angle.sin())
    };
    let looks = under.iter().flat_map(|&eye| (0..DIRECTIONS).map(move |k| (eye, level(k))));
    let out: Vec<(DVec3, DVec3)> = looks.filter(|&(eye, direction)| leaves(eye, direction)).collect();
    let share = out.len() as f64 / (under.len() * DIRECTIONS) as f64;
    match out.first() {
        Some(_) if share >= OPEN => {
            format!("{:.0} % of the horizontal rays from under a roof leave the model: walls are missing", 100.0 * share)
        }
        Some(&(eye, direction)) => {
            let (from, to) = (eye + scene.origin, eye + direction * scene.bounds().diagonal() + scene.origin);
            let point = |p: DVec3| format!("({:.2} {:.2} {:.2})", p.x, p.y, p.z);
            format!(
                "it has walls and roofs, but also openings: the outside is visible from {} towards {}",
                point(from),
                point(to)
            )
        }
        None => "walls and roofs hide the outside, but no walls separate its rooms".into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{ImportOptions, Mesh, Role, SceneBuilder, Source};

    /// A room of 6 x 3 x 4 m with these sides (x, y, z, the lower first), optionally with a gap in one.
    fn room(sides: [bool; 6], gap: bool) -> Scene {
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        let size = DVec3::new(6.0, 3.0, 4.0);
        for side in (0..6).filter(|&side| sides[side]) {
            let (k, u, v) = (side / 2, (side / 2 + 1) % 3, (side / 2 + 2) % 3);
            let at = if side % 2 == 0 { DVec3::ZERO } else { DVec3::AXES[k] * size[k] };
            let share = if gap && side == 0 { 0.8 } else { 1.0 };
            let (u, v) = (DVec3::AXES[u] * size[u] * share, DVec3::AXES[v] * size[v]);
            let positions = vec![at, at + u, at + u + v, at + v];
            let (node, role, triangles) = (format!("side {side}"), Role::Unknown, vec![[0, 1, 2], [0, 2, 3]]);
            builder.add(Mesh { node, role, opaque: true, positions, triangles }).unwrap();
        }
        builder.finish("room").unwrap()
    }

    #[test]
    fn what_is_missing_is_told() {
        let closed = [true; 6];
        assert!(why_open(&room(closed, false)).starts_with("walls and roofs hide the outside"));
        assert!(
            why_open(&room([true, true, true, false, true, true], false))
                .ends_with("roofs are missing, or the model is outdoors")
        );
        assert!(why_open(&room([false, false, true, true, false, true], false)).ends_with("walls are missing"));
        assert_eq!(why_open(&room([true, true, false, false, true, true], false)), "it has no floors");
        let way = why_open(&room(closed, true));
        assert!(
            way.starts_with("it has walls and roofs, but also openings: the outside is visible from (")
                && way.contains("towards (-"),
            "{way}"
        );
    }
}
