//! Classifies portals as doors and windows: by the author's openings, or by the leaf or pane there.
//!
//! An opening is a vertical slab (horizontal for a skylight) along its wall, so that the result does not depend on the model's rotation. A
//! portal belongs to the nearest opening that is parallel and overlaps it by half of the smaller.

use crate::cells::complex::polygon::convex_hull;
use crate::cells::complex::{lift, to_plan};
use crate::cells::doors::leaves::leaves;
use crate::cells::scale::HumanScale;
use crate::cells::{Portal, PortalKind};
use crate::math::box_tree::BoxTree;
use crate::math::geom::{Aabb, middle, newell};
use crate::scene::{OpeningHint, OpeningKind, Role, Scene};
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;

/// A portal is vertical if its normal's cosine with the vertical is below this (45 degrees).
const STEEP: f64 = 0.7;

/// Largest distance of a leaf, also of one that stands open in a deep reveal, from its portal, metres.
const LEAF_AWAY: f64 = 0.5;
/// Largest distance of a portal beyond the sides of its wall, metres.
const BEYOND: f64 = 0.1;
/// A portal is parallel to an opening if the cosine of their angle is at least this.
const ALONG_OPENING_COSINE: f64 = 0.8;
/// Largest thickness of a shut leaf or pane, metres; an open leaf is thicker.
const THICK: f64 = 0.6;

/// A box along its wall.
struct Slab<'s> {
    kind: PortalKind,
    id: &'s str,
    centre: DVec3,
    /// Unit vectors through the wall, along it and up it.
    axes: [DVec3; 3],
    /// Half of its size along each, metres.
    half: [f64; 3],
    /// Largest distance of its portal, metres.
    reach: f64,
}

/// Sets kind and id of portals without a name that are doors or windows.
pub(in crate::cells) fn name_openings(scene: &Scene, portals: &mut [Portal], human: HumanScale) {
    let mut slabs: Vec<Slab<'_>> = scene.hints.openings.iter().filter_map(|o| Slab::drawn(o, human)).collect();
    let mut hung: BTreeMap<(&str, bool), Vec<[DVec3; 3]>> = BTreeMap::new();
    for o in &scene.objects {
        if let Role::Door | Role::Window = o.role {
            let corners = o.triangles.clone().map(|t| scene.corners(t as usize));
            hung.entry((o.node.as_str(), o.role == Role::Door)).or_default().extend(corners);
        }
    }
    // An authored opening takes precedence.
    let drawn: std::collections::BTreeSet<&str> = slabs.iter().map(|s| s.id).collect();
    hung.retain(|(id, _), _| !drawn.contains(id));
    let mut ajar: Vec<(&str, Aabb)> = Vec::new();
    for (&(id, is_door), triangles) in &hung {
        let boxes: Vec<Aabb> = triangles.iter().map(|t| Aabb::of(*t)).collect();
        for leaf in leaves(&boxes, human.metre) {
            let corners: Vec<DVec3> = leaf.iter().flat_map(|&t| triangles[t]).collect();
            match Slab::hung(id, is_door, &corners, human) {
                Some(slab) => slabs.push(slab),
                None if is_door => ajar.push((id, Aabb::of(corners))),
                None => {}
            }
        }
    }
    // 1. The nearest slab around each portal.
    let mut taken = vec![false; slabs.len()];
    let tree = BoxTree::over(&slabs.iter().map(Slab::zone).collect::<Vec<_>>());
    for portal in portals.iter_mut() {
        // Its bounding box in any rotation.
        let centre = middle(&portal.winding);
        let radius = portal.winding.iter().map(|p| p.distance(centre)).fold(0.0, f64::max);
        let mut costs: Vec<(f64, usize)> = Vec::new();
        tree.in_box(&Aabb { min: centre, max: centre }.inflated(1.75 * radius), &mut |i| {
            costs.extend(slabs[i as usize].cost(portal).map(|cost| (cost, i as usize)));
        });
        if let Some((_, i)) = costs.into_iter().min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))) {
            // The author's own name of the portal takes precedence.
            if portal.source.is_none() {
                (portal.kind, portal.source) = (slabs[i].kind, Some(slabs[i].id.to_owned()));
            }
            taken[i] = true;
        }
    }
    // 2. Open doors, and doors whose portal is not parallel to the leaf: the vertical portal beside them.
    let shut = slabs.iter().zip(&taken).filter(|(s, taken)| s.kind == PortalKind::Door && !**taken);
    ajar.extend(shut.map(|(s, _)| (s.id, s.bounds())));
    let bounds: Vec<Aabb> = portals.iter().map(|p| Aabb::of(p.winding.iter().copied())).collect();
    let tree = BoxTree::over(&bounds);
    for (id, leaf) in ajar {
        let away = (LEAF_AWAY + 0.2) * human.metre;
        let mut near: Vec<(f64, usize)> = Vec::new();
        // A little more, because of rounding.
        tree.in_box(&leaf.inflated(1.01 * away), &mut |i| near.push((leaf.gap(&bounds[i as usize]), i as usize)));
        near.retain(|&(gap, i)| gap <= away && portals[i].plane.n.y.abs() < STEEP && portals[i].source.is_none());
        if let Some((_, i)) = near.into_iter().min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1))) {
            (portals[i].kind, portals[i].source) = (PortalKind::Door, Some(id.to_owned()));
        }
    }
}

impl<'s> Slab<'s> {
    /// An author's opening; `None` for a virtual one.
    fn drawn(opening: &'s OpeningHint, human: HumanScale) -> Option<Self> {
        let kind = match opening.kind {
            OpeningKind::Door => PortalKind::Door,
            OpeningKind::Window => PortalKind::Window,
            OpeningKind::Opening => PortalKind::Opening,
            OpeningKind::Virtual => return None,
        };
        let centre = middle(&opening.winding);
        let local: Vec<DVec3> = opening.winding.iter().map(|&p| p - centre).collect();
        let through = newell(&local).try_normalize()?;
        let along = through.cross(DVec3::Y).try_normalize().unwrap_or(DVec3::X);
        let reach = (0.5 * opening.thickness + BEYOND * human.metre).max(0.0);
        Some(Self::of(kind, &opening.id, [through, along, through.cross(along)], &opening.winding, reach))
    }

    /// A leaf or a pane; `None` if it stands open.
    fn hung(id: &'s str, is_door: bool, corners: &[DVec3], human: HumanScale) -> Option<Self> {
        let kind = if is_door { PortalKind::Door } else { PortalKind::Window };
        let reach = LEAF_AWAY * human.metre;
        let hull = convex_hull(corners.iter().map(|&p| to_plan(p)).collect());
        let flat = Aabb::of(corners.iter().copied()).size();
        let across = |n: DVec2| {
            let along = hull.iter().map(|p| n.dot(*p));
            along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
        };
        let sides = (0..hull.len()).map(|i| (hull[(i + 1) % hull.len()] - hull[i]).perp().normalize_or_zero());
        let thin = sides.filter(|n| *n != DVec2::ZERO).map(|n| (across(n), n)).min_by(|a, b| a.0.total_cmp(&b.0));
        let (thickness, normal) = thin.unwrap_or((0.0, (*hull.last()? - hull[0]).perp().try_normalize()?));
        if flat.y < thickness && !is_door {
            return Some(Self::of(kind, id, [DVec3::Y, DVec3::X, DVec3::Z], corners, reach));
        }
        let through = lift(normal, 0.0);
        let upright = [through, through.cross(DVec3::Y), DVec3::Y];
        (thickness <= THICK * human.metre).then(|| Self::of(kind, id, upright, corners, reach))
    }

    fn of(kind: PortalKind, id: &'s str, axes: [DVec3; 3], corners: &[DVec3], reach: f64) -> Self {
        let ranges = axes.map(|axis| range(corners, axis));
        let centre = (0..3).map(|i| axes[i] * (0.5 * (ranges[i].0 + ranges[i].1))).sum();
        Self { kind, id, centre, axes, half: ranges.map(|r| 0.5 * (r.1 - r.0)), reach }
    }

    fn bounds(&self) -> Aabb {
        let reach: DVec3 = (0..3).map(|i| self.axes[i].abs() * self.half[i]).sum();
        Aabb { min: self.centre - reach, max: self.centre + reach }
    }

    /// The box of the slab and its portals.
    fn zone(&self) -> Aabb {
        self.bounds().inflated(self.reach)
    }

    /// Distance of a portal from the centre of the slab; `None` if it is not in it.
    fn cost(&self, portal: &Portal) -> Option<f64> {
        let [through, along, up] = self.axes;
        let off = (middle(&portal.winding) - self.centre).dot(through).abs();
        if off > self.half[0] + self.reach || portal.plane.n.dot(through).abs() < ALONG_OPENING_COSINE {
            return None;
        }
        let overlaps = |axis: DVec3, half: f64| {
            let (low, high) = range(&portal.winding, axis);
            let centre = axis.dot(self.centre);
            high.min(centre + half) - low.max(centre - half) >= 0.5 * (high - low).min(2.0 * half)
        };
        let inside = overlaps(along, self.half[1]) && overlaps(up, self.half[2]);
        inside.then(|| off + 0.1 * middle(&portal.winding).distance(self.centre))
    }
}

fn range(points: &[DVec3], axis: DVec3) -> (f64, f64) {
    let at = points.iter().map(|p| axis.dot(*p));
    (at.clone().fold(f64::INFINITY, f64::min), at.fold(f64::NEG_INFINITY, f64::max))
}
