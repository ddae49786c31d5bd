//! Lines and faces over the scene: portals, narrowed frusta, picked objects.

use crate::culling::Decision;
use crate::draw::lines::{Overlay, Tint};
use crate::heat;
use crate::profile::Profile;
use enfilade::file::PvsFile;
use enfilade::runtime::{Camera, Rect};
use enfilade::{ObjectId, PortalId};
use enfilade_measure::walkthrough::plan::portal_colour;
use glam::{DVec2, DVec3, Vec3};

/// Of a line of sight.
pub const SIGHT: Tint = [40, 230, 80, 255];
/// How wide it is, as a part of its distance from the eye, and how large its ends are, metres.
const SIGHT_WIDTH: f32 = 0.006;
const SIGHT_END: f32 = 0.05;
const PICKED: Tint = [255, 220, 40, 255];
const FRUSTUM: Tint = [255, 255, 255, 255];
const NARROWED: Tint = [255, 160, 40, 200];
const SHUT: Tint = [220, 40, 40, 110];
/// How far below the eyes a path is drawn, metres: at them it would be a point.
const BELOW_EYES: f32 = 0.8;
/// How far frusta reach beyond their portal, metres.
const BEYOND: f32 = 6.0;
/// Most narrowed frusta that are drawn.
const MOST: usize = 400;

/// Portals by kind: those that are seen through bold and filled, others thin; shut ones red.
pub fn portals(overlay: &mut Overlay, file: &PvsFile, last: Option<&Decision>, shut: &[PortalId]) {
    let mut seen = vec![false; file.portals.len()];
    last.into_iter().flat_map(|d| &d.portals).for_each(|crossed| seen[crossed.portal.portal().index()] = true);
    for (i, portal) in file.portals.iter().enumerate() {
        let [r, g, b] = portal_colour(portal.kind);
        if shut.binary_search(&PortalId(i as u32)).is_ok() {
            overlay.face(&portal.winding, SHUT);
        } else if seen[i] {
            overlay.face(&portal.winding, [r, g, b, 60]);
        }
        overlay.outline(&portal.winding, [r, g, b, if seen[i] { 255 } else { 110 }]);
    }
}

/// The frozen frustum, and what portals narrowed it to.
pub fn frusta(overlay: &mut Overlay, file: &PvsFile, camera: &Camera, last: &Decision) {
    let reach = last.portals.iter().map(|c| distance(file, camera, c.portal.portal())).fold(BEYOND, f32::max);
    pyramid(overlay, camera, &Rect::FULL, 0.0, reach, FRUSTUM);
    for crossed in last.portals.iter().take(MOST) {
        let at = distance(file, camera, crossed.portal.portal());
        pyramid(overlay, camera, &crossed.rect, at, at + BEYOND, NARROWED);
    }
}

/// The edges of what is seen within a rectangle of the screen, from one depth to another.
fn pyramid(overlay: &mut Overlay, camera: &Camera, rect: &Rect, from: f32, to: f32, tint: Tint) {
    let ndc =
        [rect.min, Vec3::new(rect.max.x, rect.min.y, 0.0).truncate(), rect.max, glam::Vec2::new(rect.min.x, rect.max.y)];
    let rays = ndc.map(|p| camera.ray(DVec2::new(f64::from(p.x), f64::from(p.y))).as_vec3());
    let at = |depth: f32| rays.map(|ray| camera.eye + ray * depth);
    let (near, far) = (at(from), at(to));
    for i in 0..4 {
        // Through walls: what hides the frusta is what they were narrowed by.
        overlay.line_through(near[i], far[i], tint);
        if from > 0.0 {
            overlay.line_through(near[i], near[(i + 1) % 4], tint);
        }
    }
}

/// The depth of a portal's middle, metres.
fn distance(file: &PvsFile, camera: &Camera, portal: PortalId) -> f32 {
    let winding = &file.portals[portal.index()].winding;
    camera.w.dot(crate::doors::middle(winding) - camera.eye).max(0.05)
}

/// The box of a picked object.
pub fn object(overlay: &mut Overlay, file: &PvsFile, object: ObjectId) {
    overlay.boxed(file.objects[object.index()].bounds, PICKED);
}

/// The box of something that was found; it shows through walls.
pub fn selected(overlay: &mut Overlay, bounds: [Vec3; 2]) {
    overlay.boxed(bounds, PICKED);
}

/// A line of sight, with a box at either end; it shows through walls.
pub fn sight(overlay: &mut Overlay, eye: Vec3, from: Vec3, to: Vec3) {
    overlay.ribbon(from, to, eye, SIGHT_WIDTH, SIGHT);
    for end in [from, to] {
        overlay.boxed([end - SIGHT_END, end + SIGHT_END], SIGHT);
    }
}

/// A path, in colours of what its frames take.
pub fn path(overlay: &mut Overlay, profile: &Profile<'_>, origin: DVec3) {
    let most = profile.costs.iter().map(|cost| cost.ms).fold(0.0, f64::max);
    let at = |frame: usize| (profile.path.frames[frame].eye - origin).as_vec3() - Vec3::Y * BELOW_EYES;
    for (frame, cost) in profile.costs.iter().enumerate().skip(1) {
        let [r, g, b] = heat::colour(cost.ms / most);
        overlay.line(at(frame - 1), at(frame), [r, g, b, 255]);
    }
}
