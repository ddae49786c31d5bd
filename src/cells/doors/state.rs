//! The state of a door or a window: shut or open, opaque or glass.
//!
//! Rows don't depend on it: every bake takes doors as open and windows as clear, so a row stays valid whatever the run time opens and
//! shuts. With states, the run time also culls behind shut doors.
//!
//! A leaf is an object of role [`Role::Door`] or [`Role::Window`] near the portal and parallel to it: triangles rotated by more than about
//! 25 degrees, or farther away than a third of their leaf's size, are ignored.

use crate::cells::complex::coverage::{Open, open_part};
use crate::cells::complex::polygon::{Shape, convex_hull, counter_clockwise, shape_area, shared_area};
use crate::cells::doors::gap::{Face, lets_through};
use crate::cells::doors::leaves::leaves;
use crate::cells::{Portal, PortalKind, PortalState};
use crate::math::box_tree::BoxTree;
use crate::math::geom::{Aabb, Plane, area, clip};
use crate::math::parallel;
use crate::scene::rays::RayScene;
use crate::scene::{Role, Scene};
use glam::{DVec2, DVec3};

/// A shut leaf covers more than this share of its portal. A frame alone covers 0.1 to 0.3, a leaf with gaps around it and a letter-box 0.9.
const SHUT_SHARE: f64 = 0.5;
/// A leaf is ignored if the cosine of its angle with the portal is below this.
const ALONG_PORTAL_COSINE: f64 = 0.9;
/// Largest distance of a leaf from the portal's plane, in half diagonals: 0.4 m for a door of 0.9 x 2.1 m. A door counts as at least as
/// large as its portal, and at most `MOST_TIMES` as large.
const LEAF_NEAR_SHARE: f64 = 0.35;
const MOST_TIMES: f64 = 4.0;

/// Largest uncovered share of an entirely covered portal. Larger: strips beside the leaf count as covered. Smaller: rounding of the leaf's
/// rim counts as a strip.
const WHOLLY: f64 = 1e-4;

/// Sets every portal's state, from its kind and its leaf. Between leaves of a level (`of_level`), a portal is often wider than its doorway,
/// and beside the door leaf a wall of another cell is visible: there, a door is ajar unless its leaf covers the entire portal. `metre`:
/// length of a metre.
pub(in crate::cells) fn find_states(rays: &RayScene<'_>, portals: &mut [Portal], metre: f64, of_level: bool) {
    let scene = rays.scene();
    let hung = Hung::all(scene, metre);
    let boxes: Vec<Aabb> = hung.iter().map(|h| h.bounds).collect();
    let tree = BoxTree::over(&boxes);
    parallel::for_each_mut(portals, |i, portal| {
        portal.state = PortalState::of_kind(portal.kind);
        if portal.kind != PortalKind::Opening {
            let face = Face::new(portal);
            let rim = convex_hull(portal.winding.iter().map(|&p| face.flat(p)).collect());
            let whole = area(&portal.winding);
            let leaf = Leaf::new(&hung, &tree, portal, &face, &rim);
            let open = leaf.open.iter().map(shape_area).sum::<f64>();
            portal.state.shut = open < (1.0 - SHUT_SHARE) * whole;
            portal.state.see_through |= leaf.glass;
            if portal.state.shut && !portal.state.see_through {
                portal.state.ajar =
                    of_level && open > WHOLLY * whole || lets_through(rays, &face, &rim, &leaf.open, i as u64);
            }
        }
    });
}

/// A leaf or a pane.
struct Hung {
    triangles: Vec<[DVec3; 3]>,
    bounds: Aabb,
    glass: bool,
}

impl Hung {
    fn all(scene: &Scene, metre: f64) -> Vec<Self> {
        let mut all = Vec::new();
        for object in scene.objects.iter().filter(|o| matches!(o.role, Role::Door | Role::Window)) {
            let triangles: Vec<[DVec3; 3]> = object.triangles.clone().map(|t| scene.corners(t as usize)).collect();
            let boxes: Vec<Aabb> = triangles.iter().map(|t| Aabb::of(*t)).collect();
            all.extend(leaves(&boxes, metre).into_iter().map(|leaf| {
                let bounds = leaf.iter().fold(Aabb::EMPTY, |b, &t| b.union(boxes[t]));
                Self { triangles: leaf.into_iter().map(|t| triangles[t]).collect(), bounds, glass: object.glass }
            }));
        }
        all
    }
}

/// The leaf in a portal.
struct Leaf {
    /// The uncovered part of the portal, in the coordinates of its [`Face`].
    open: Vec<Shape>,
    /// Whether a part of it is glass.
    glass: bool,
}

impl Leaf {
    fn new(hung: &[Hung], tree: &BoxTree, portal: &Portal, face: &Face, rim: &[DVec2]) -> Self {
        let (n, whole) = (portal.plane.n, area(&portal.winding));
        let around = Aabb::of(portal.winding.iter().copied()).inflated(LEAF_NEAR_SHARE * MOST_TIMES * whole.sqrt());
        let mut near = Vec::new();
        tree.in_box(&around, &mut |i| near.push(i as usize));
        near.sort_unstable();
        let (mut triangles, mut glass) = (Vec::new(), false);
        for leaf in near.into_iter().map(|i| &hung[i]) {
            let size = (0.5 * leaf.bounds.diagonal()).clamp(whole.sqrt(), MOST_TIMES * whole.sqrt());
            let slab = [1.0, -1.0].map(|side| Plane { n: n * side, d: portal.plane.d * side + LEAF_NEAR_SHARE * size });
            for corners in &leaf.triangles {
                let across = (corners[1] - corners[0]).cross(corners[2] - corners[0]).normalize_or_zero();
                if across.dot(n).abs() < ALONG_PORTAL_COSINE {
                    continue;
                }
                let near = slab.iter().fold(corners.to_vec(), |rest, plane| clip(&rest, plane, 0.0));
                for k in 2..near.len() {
                    let triangle = [near[0], near[k - 1], near[k]].map(|p| face.flat(p));
                    glass |= leaf.glass && shared_area(counter_clockwise(triangle), rim) > 0.0;
                    triangles.push(triangle);
                }
            }
        }
        let open = match open_part(rim, &triangles, 1e-4 * whole.sqrt()) {
            Open::Whole => vec![vec![rim.iter().map(|p| p.to_array()).collect()]],
            Open::Parts(parts) => parts,
        };
        Self { open, glass }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::CellId;
    use crate::scene::{ImportOptions, Mesh, SceneBuilder, Source};

    /// A doorway of 0.9 x 2.1 m in the plane x = 0 of a wall from x = -0.1 to 0.1, and a leaf of 0.04 m that ends `gap` metres from the
    /// doorway's rim, turned by this many degrees and moved by this far along x.
    fn state(degrees: f64, aside: f64, gap: f64, glass: bool, role: Role) -> PortalState {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let hinge = |p: DVec3| DVec3::new(cos * p.x + sin * (p.z - gap) + aside, p.y, cos * (p.z - gap) - sin * p.x + gap);
        let cuboid = |node: &str, role: Role, opaque: bool, min: DVec3, max: DVec3| {
            let corner = |i: usize| DVec3::new([min, max][i & 1].x, [min, max][i >> 1 & 1].y, [min, max][i >> 2 & 1].z);
            let quads = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]];
            let triangles = quads.iter().flat_map(|q| [[q[0], q[1], q[2]], [q[0], q[2], q[3]]]).collect();
            Mesh { node: node.into(), role, opaque, positions: (0..8).map(corner).collect(), triangles }
        };
        let p = DVec3::new;
        let mut leaf = cuboid("leaf", role, false, p(-0.02, gap, gap), p(0.02, 2.1 - gap, 0.9 - gap));
        leaf.positions.iter_mut().for_each(|p| *p = hinge(*p));
        let mut builder = SceneBuilder::new(&ImportOptions::default(), Source::default());
        let walls = [
            (p(-0.1, -1.0, -3.0), p(0.1, 5.0, 0.0)),
            (p(-0.1, -1.0, 0.9), p(0.1, 5.0, 4.0)),
            (p(-0.1, -1.0, 0.0), p(0.1, 0.0, 0.9)),
            (p(-0.1, 2.1, 0.0), p(0.1, 5.0, 0.9)),
        ];
        for (min, max) in walls {
            builder.add(cuboid("wall", Role::Structure, true, min, max)).unwrap();
        }
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
        find_states(&RayScene::new(&scene), &mut portals, 1.0, false);
        portals[0].state
    }

    #[test]
    fn a_leaf_in_its_frame_is_shut_and_one_swung_aside_is_open() {
        let open = PortalState::of_kind(PortalKind::Door);
        let ajar = PortalState { shut: true, ajar: true, ..open };
        assert_eq!(state(0.0, 0.0, 0.02, false, Role::Door), ajar);
        assert_eq!(state(0.0, 0.2, 0.02, false, Role::Door), ajar, "beside a wall, the portal in its middle");
        assert_eq!(state(10.0, 0.0, 0.02, false, Role::Door), ajar);
        for degrees in [45.0, 90.0, 120.0] {
            assert_eq!(state(degrees, 0.0, 0.02, false, Role::Door), open, "{degrees} degrees");
        }
        assert_eq!(state(0.0, 1.0, 0.02, false, Role::Door), open, "a leaf that leans on another wall");
        assert_eq!(state(0.0, 0.0, 0.02, false, Role::Furnishing), open, "a board is no leaf");
    }

    #[test]
    fn what_is_shut_is_ajar_where_a_line_passes_its_leaf() {
        for gap in [0.02, 0.01, 0.003, 0.001] {
            assert!(state(0.0, 0.0, gap, false, Role::Door).ajar, "{gap} m");
        }
        let shut = PortalState { shut: true, ..PortalState::of_kind(PortalKind::Door) };
        for gap in [0.0, -0.01, -0.1] {
            assert_eq!(state(0.0, 0.0, gap, false, Role::Door), shut, "{gap} m");
        }
        assert_eq!(state(0.0, 0.12, -0.1, false, Role::Door), shut, "flat on the wall's face, over the doorway's rim");
        assert!(state(0.0, 0.2, -0.1, false, Role::Door).ajar, "eight centimetres off the wall");
    }

    #[test]
    fn a_leaf_of_glass_shows_what_is_behind_it() {
        let state = state(0.0, 0.0, 0.02, true, Role::Door);
        assert_eq!(state, PortalState { shut: true, see_through: true, closable: true, ajar: false });
    }
}
