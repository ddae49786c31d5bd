//! Sight lines of a level, by its tree, against a bake of its faces; and the bake's witnesses, by the tree.

use crate::level_mesh::{metres, units};
use crate::random::Random;
use crate::truth::{Homes, Truth};
use enfilade::CellId;
use enfilade::file::{Bounds, PvsFile};
use enfilade::scene::rays::RayScene;
use glam::DVec3;

/// The mesh and the tree mean one surface where a line meets it within this many units: planes of the tree are in `f32`.
const SAME_PLACE: f64 = 0.1;

/// The share of lines for which mesh and tree may disagree on where a surface is. In dm4, e1m1, e1m3 and start no line in a
/// million does, so cracks at T-junctions don't count. In e2m2, 1.1 in a thousand do: a ledge (1192 to 1368, 32 to 48, 24 to 40)
/// is closed by faces, and the tree has air within it.
const MOST_ASTRAY: f64 = 2e-3;
/// The same of witnesses, which seek what is rarely seen: 3 of 956 in e2m2, 0 in the others.
const MOST_LEAKING: f64 = 5e-3;

/// What sight lines say of a bake.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Sights {
    /// Lines from points of leaves, any way.
    pub lines: u64,
    /// Lines that the mesh stops and the tree lets through.
    pub stopped: u64,
    /// Lines that the tree stops and the mesh lets through: by cracks between its triangles, or where it lacks a face.
    pub leaks: u64,
    /// Of the others: objects that are met and that the exact rows don't show from the leaf. None if the rows are right.
    pub denied: u64,
    /// Objects that are met along a line with the file's clearance and that the row of the line's cells doesn't have.
    pub missed_objects: u64,
    /// Cells on such lines that the cells of their start don't have in their rows.
    pub missed_cells: u64,
    /// Lines that miss either and come nearer than the clearance to something: the file promises nothing of them.
    pub grazing: u64,
}

/// What the tree says of a bake's witnesses.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Witnessed {
    /// Witnesses that start in an open leaf: others are of cells behind the faces.
    pub asked: u64,
    /// Those whose segment the tree stops: it passes a crack of the mesh.
    pub leaks: u64,
    /// Of the others, those of an object that the exact rows hide from the leaf. None if rows and witnesses are right.
    pub hidden: u64,
}

impl Sights {
    /// That rows lack nothing that a line shows, and that mesh and tree are of one level.
    pub fn assert_sound(&self, name: &str) {
        assert_eq!((self.denied, self.missed_objects, self.missed_cells), (0, 0, 0), "{name}: {self:?}");
        assert!((self.stopped + self.leaks) as f64 <= MOST_ASTRAY * self.lines as f64, "{name}: {self:?}");
    }
}

impl Witnessed {
    /// That no witness shows what is exactly hidden.
    pub fn assert_sound(&self, name: &str) {
        assert!(self.asked > 0 && self.hidden == 0, "{name}: {self:?}");
        assert!(self.leaks as f64 <= MOST_LEAKING * self.asked as f64, "{name}: {self:?}");
    }
}

impl Truth<'_> {
    /// Follows lines from random points of leaves in random directions, each to the first surface by the tree.
    pub fn sights(&self, file: &PvsFile, count: u64, seed: u64) -> Sights {
        let (mut random, mut homes, scene) = (Random::new(seed), Homes::new(file), &self.mesh.scene);
        let rays = RayScene::new(scene);
        let mut sights = Sights::default();
        for _ in 0..count {
            let (leaf, p) = self.points[random.below(self.points.len())];
            let direction = random.direction();
            let along = random.real(0.0, 1.0);
            let end = self.world.end_of_line(p, direction, f64::INFINITY).expect("a sealed level");
            sights.lines += 1;
            let [from, to] = [0.0, end.t].map(|t| metres(p + direction * t) - scene.origin);
            let hit = rays.first_opaque(from, to - from, f64::INFINITY).filter(|hit| (hit.t - 1.0) * end.t < SAME_PLACE);
            let Some(hit) = hit else {
                sights.leaks += 1;
                continue;
            };
            if (1.0 - hit.t) * end.t > SAME_PLACE {
                sights.stopped += 1;
                continue;
            }
            sights.denied += u64::from(!self.objects.get(leaf, hit.object.index()));
            // The row of the place that the line starts in, and of another place on it.
            let here = homes.cells(p);
            let there = p + direction * (end.t * along);
            let cells = homes.cells(there);
            let clear = |to: DVec3, target| rays.is_clear(from, to, file.clearance(), target);
            if !sees(file, &here, |cell| file.sees_object(cell, hit.object)) {
                let missed = if clear(to, Some(hit.object)) { &mut sights.missed_objects } else { &mut sights.grazing };
                *missed += 1;
            }
            let sees_there = |a: CellId| sees(file, &cells, |b| file.sees_cell(a, b));
            if !sees(file, &here, sees_there) {
                let there = metres(there) - scene.origin;
                let missed = if clear(there, None) { &mut sights.missed_cells } else { &mut sights.grazing };
                *missed += 1;
            }
        }
        sights
    }

    /// Asks the tree about the witnesses of a bake of the mesh.
    pub fn witnessed(&self, bounds: &Bounds) -> Witnessed {
        let mut found = Witnessed::default();
        for witness in &bounds.witnesses {
            let [from, to] = [witness.from, witness.to].map(|p| units(p + self.mesh.scene.origin));
            let leaf = self.world.leaf_at(from);
            if !self.world.leaves[leaf].open {
                continue;
            }
            found.asked += 1;
            let length = from.distance(to);
            let end = self.world.end_of_line(from, (to - from) / length, length - SAME_PLACE);
            if end.is_some() {
                found.leaks += 1;
            } else {
                found.hidden += u64::from(!self.objects.get(leaf - 1, witness.object.index()));
            }
        }
        found
    }
}

/// Whether something holds of one of these cells; it does where a point is in none.
fn sees(file: &PvsFile, cells: &[usize], holds: impl Fn(CellId) -> bool) -> bool {
    cells.iter().any(|&cell| cell == file.cells.len() || holds(CellId(cell as u32)))
}
