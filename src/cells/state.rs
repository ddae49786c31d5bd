//! What stands in a door or a window: a leaf that is shut or open, glass that shows what is behind.
//!
//! Rows don't depend on it: every bake takes doors as open and windows as clear, so a row stays right whatever the run time
//! opens and shuts. A state lets the run time cull more than a row does, behind doors that are shut.
//!
//! A leaf is what the model calls a door's or a window's ([`Role::Door`], [`Role::Window`]) and lies along the portal, near it:
//! triangles turned by more than about 25 degrees, or farther away than a third of their object's size, stand aside.

use super::complex::columns::counter_clockwise;
use super::complex::coverage::{Open, convex_hull, open_part, shape_area, shared_area};
use super::locate::BoxTree;
use super::{Portal, PortalKind};
use crate::geom::{Aabb, Plane, area, clip, middle};
use crate::scene::{Role, Scene};
use glam::{DVec2, DVec3};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

/// What stands in a portal.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default, Serialize, Deserialize)]
pub struct PortalState {
    /// A leaf or a pane covers it, as the model stands. Nothing is shut that isn't closable.
    pub shut: bool,
    /// One sees through it even where it is shut.
    pub see_through: bool,
    /// Something hangs in it that can shut it.
    pub closable: bool,
}

impl PortalState {
    /// What is assumed where nothing more is known: a door stands open and is solid, a window is shut and of glass, an opening
    /// has nothing in it.
    pub fn of_kind(kind: PortalKind) -> Self {
        match kind {
            PortalKind::Door => Self { shut: false, see_through: false, closable: true },
            PortalKind::Window => Self { shut: true, see_through: true, closable: true },
            PortalKind::Opening => Self::default(),
        }
    }
}

/// A leaf covers more than this share of its portal when it is shut. A frame alone covers 0.1 to 0.3, a leaf with gaps around it
/// and a letter-box 0.9.
const SHUT_SHARE: f64 = 0.5;
/// Cosine of the angle from which on a leaf stands aside.
const ALONG: f64 = 0.9;
/// A leaf hangs within this many times its half diagonal of the portal's plane: 0.4 m for a door of 0.9 x 2.1 m. A door is not
/// taken for smaller than its portal, nor for more than four times as large.
const NEAR: f64 = 0.35;
const MOST_TIMES: f64 = 4.0;

/// Gives every portal its state, by its kind and by what the model hangs in it.
pub(super) fn find_states(scene: &Scene, portals: &mut [Portal]) {
    let boxes: Vec<Aabb> = scene.objects.iter().map(|o| o.bounds).collect();
    let leaves = (0..boxes.len() as u32).filter(|&i| matches!(scene.objects[i as usize].role, Role::Door | Role::Window));
    let tree = BoxTree::new(&boxes, leaves.collect());
    portals.par_iter_mut().for_each(|portal| {
        portal.state = PortalState::of_kind(portal.kind);
        if portal.kind != PortalKind::Opening {
            let leaf = Leaf::new(scene, &tree, portal);
            portal.state.shut = leaf.covers > SHUT_SHARE;
            portal.state.see_through |= leaf.glass;
        }
    });
}

/// What hangs in a portal.
struct Leaf {
    /// Share of the portal that is covered.
    covers: f64,
    /// Whether any of that is glass.
    glass: bool,
}

impl Leaf {
    fn new(scene: &Scene, tree: &BoxTree, portal: &Portal) -> Self {
        let (n, centre) = (portal.plane.n, middle(&portal.winding));
        let (u, v) = n.any_orthonormal_pair();
        let flat = |p: DVec3| DVec2::new(u.dot(p - centre), v.dot(p - centre));
        let rim = convex_hull(portal.winding.iter().map(|&p| flat(p)).collect());
        let whole = area(&portal.winding);
        let around = Aabb::of(portal.winding.iter().copied()).inflated(NEAR * MOST_TIMES * whole.sqrt());
        let mut objects = Vec::new();
        tree.in_box(&around, &mut |i| objects.push(i as usize));
        objects.sort_unstable();
        let (mut triangles, mut glass) = (Vec::new(), false);
        for object in objects.into_iter().map(|i| &scene.objects[i]) {
            let size = (0.5 * object.bounds.diagonal()).clamp(whole.sqrt(), MOST_TIMES * whole.sqrt());
            let slab = [1.0, -1.0].map(|side| Plane { n: n * side, d: portal.plane.d * side + NEAR * size });
            for corners in object.triangles.clone().map(|t| scene.corners(t as usize)) {
                let across = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
                if across.dot(n).abs() < ALONG {
                    continue;
                }
                let near = slab.iter().fold(corners.to_vec(), |rest, plane| clip(&rest, plane, 0.0));
                for k in 2..near.len() {
                    let triangle = [near[0], near[k - 1], near[k]].map(flat);
                    glass |= object.glass && shared_area(counter_clockwise(triangle), &rim) > 0.0;
                    triangles.push(triangle);
                }
            }
        }
        let open = match open_part(&rim, &triangles, 1e-4 * whole.sqrt()) {
            Open::Whole => whole,
            Open::Parts(parts) => parts.iter().map(shape_area).sum(),
        };
        Self { covers: 1.0 - open / whole.max(f64::MIN_POSITIVE), glass }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CellId;
    use crate::scene::{ImportOptions, Mesh, SceneBuilder, Source};

    /// A doorway of 0.9 x 2.1 m in the plane x = 0, and a leaf of 0.86 x 2.06 x 0.04 m, hung at z = 0.02, turned by this many
    /// degrees and moved by this far along x.
    fn state(degrees: f64, aside: f64, glass: bool, role: Role) -> PortalState {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let hinge = |x: f64, y: f64, z: f64| DVec3::new(cos * x + sin * z + aside, y, cos * z - sin * x + 0.02);
        let corner = |i: usize| hinge([-0.02, 0.02][i & 1], [0.02, 2.08][i >> 1 & 1], [0.0, 0.86][i >> 2 & 1]);
        let quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
        let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
        let leaf = Mesh { node: "leaf".into(), role, opaque: false, positions: (0..8).map(corner).collect(), triangles };
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        if glass {
            builder.add_glass(leaf).unwrap()
        } else {
            builder.add(leaf).unwrap()
        }
        let scene = builder.finish("door").unwrap();
        let winding =
            [(0., 0.), (2.1, 0.), (2.1, 0.9), (0., 0.9)].map(|(y, z)| DVec3::new(0.0, y, z) - scene.origin).to_vec();
        let kind = PortalKind::Door;
        let plane = Plane::through(winding[0], DVec3::X);
        let state = PortalState::of_kind(kind);
        let mut portals = [Portal { cells: [CellId(0), CellId(1)], plane, winding, kind, state, source: None }];
        find_states(&scene, &mut portals);
        portals[0].state
    }

    #[test]
    fn a_leaf_in_its_frame_is_shut_and_one_swung_aside_is_open() {
        let open = PortalState::of_kind(PortalKind::Door);
        let shut = PortalState { shut: true, ..open };
        assert_eq!(state(0.0, 0.0, false, Role::Door), shut);
        assert_eq!(state(0.0, 0.2, false, Role::Door), shut, "in the middle of a thick wall, the portal on its face");
        assert_eq!(state(10.0, 0.0, false, Role::Door), shut, "ajar");
        for degrees in [45.0, 90.0, 120.0] {
            assert_eq!(state(degrees, 0.0, false, Role::Door), open, "{degrees} degrees");
        }
        assert_eq!(state(0.0, 1.0, false, Role::Door), open, "a leaf that leans on another wall");
        assert_eq!(state(0.0, 0.0, false, Role::Furnishing), open, "a board is no leaf");
    }

    #[test]
    fn a_leaf_of_glass_shows_what_is_behind_it() {
        let state = state(0.0, 0.0, true, Role::Door);
        assert_eq!(state, PortalState { shut: true, see_through: true, closable: true });
    }
}
