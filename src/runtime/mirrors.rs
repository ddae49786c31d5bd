//! Mirrors: portals that lead back into their own cell, seen by a reflected eye.
//!
//! Based on: D. Luebke and C. Georges, *Portals and mirrors: simple, fast evaluation of potentially visible sets*, 1995: a mirror is a
//! portal whose far side is its own cell, reflected. A point seen in a mirror is on the same pixel for a camera reflected in the mirror's
//! plane, without the mirror. So each mirror needs one more traversal with the reflected camera, from the mirror's cell, clipped to the
//! mirror's rectangle on the screen. A mirror in a mirror repeats this.
//!
//! Rows: a reflected line starts in the mirror's cell, so that cell's row applies, not the eye's.

use super::camera::{Camera, Rect};
use super::culler::{Culler, directed_plane, target};
use super::mode::Mode;
use super::movers::{Collected, How, MoverId, Movers};
use super::objects::Opened;
use super::portals::{self, Eye, is_beyond};
use super::scratch::Scratch;
use super::visible::FrameStats;
use crate::math::geom::newell;
use crate::{CellId, ObjectId};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Most reflections of a frame. Two opposite mirrors add two per level of depth, a hall of mirrors exponentially many; further ones are
/// dropped, and the reflection that would show them counts one in [`FrameStats::capped`].
pub const MOST_REFLECTIONS: usize = 256;

/// A flat mirror.
#[derive(Clone, PartialEq, Debug)]
pub struct Mirror {
    cell: CellId,
    corners: Vec<Vec3>,
    /// `(n, d)`, the normal into the room.
    plane: (Vec3, f32),
}

impl Mirror {
    /// A mirror in `cell`: a convex polygon, metres relative to the file's origin, counter-clockwise seen from the room. `None` if the
    /// corners have no area or are not finite.
    pub fn new(cell: CellId, corners: &[Vec3]) -> Option<Self> {
        let first = corners.first()?.as_dvec3();
        let relative: Vec<DVec3> = corners.iter().map(|p| p.as_dvec3() - first).collect();
        let n = newell(&relative).try_normalize()?;
        let d = corners.iter().map(|p| n.dot(p.as_dvec3())).sum::<f64>() / corners.len() as f64;
        let plane = (n.as_vec3(), d as f32);
        d.is_finite().then(|| Self { cell, corners: corners.to_vec(), plane })
    }

    /// Its cell.
    pub fn cell(&self) -> CellId {
        self.cell
    }

    /// The reflected camera: it sees without the mirror what `camera` sees in it, on the same pixels. Its pictures have reversed winding,
    /// and need a clip plane at the mirror.
    pub fn reflect(&self, camera: &Camera) -> Camera {
        let n = self.plane.0.as_dvec3();
        let turned = |v: Vec3| (v.as_dvec3() - n * (2.0 * n.dot(v.as_dvec3()))).as_vec3();
        let eye = camera.eye.as_dvec3();
        let eye = eye - n * (2.0 * (n.dot(eye) - f64::from(self.plane.1)));
        Camera { eye: eye.as_vec3(), x: turned(camera.x), y: turned(camera.y), w: turned(camera.w) }
    }
}

/// The view in one mirror.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Reflection<'v> {
    /// Index of the mirror.
    pub mirror: usize,
    /// The number of the reflection that shows the mirror; `None` if the eye sees it directly.
    pub parent: Option<usize>,
    /// Number of reflections along a line; 1 or more.
    pub depth: u32,
    /// The reflected camera: see [`Mirror::reflect`].
    pub camera: Camera,
    /// Its rectangle on the screen.
    pub rect: Rect,
    /// The objects to draw in it, each once.
    pub objects: &'v [ObjectId],
    /// The movers to draw in it, each once.
    pub movers: &'v [MoverId],
    /// Counters.
    pub stats: FrameStats,
}

/// A reflection, with its range in the list of objects.
#[derive(Clone, Debug)]
struct Turned {
    mirror: usize,
    parent: Option<usize>,
    depth: u32,
    camera: Camera,
    rect: Rect,
    objects: Range<usize>,
    movers: Range<usize>,
    stats: FrameStats,
}

/// The reflections of a frame, in memory that grows to the maximum over frames.
#[derive(Clone, Debug, Default)]
pub(super) struct Reflections {
    turned: Vec<Turned>,
    objects: Vec<ObjectId>,
    movers: Collected,
}

/// A frame whose mirrors are looked into, and the movers in them.
pub(super) struct Seen<'f> {
    pub movers: Option<&'f Movers>,
    pub camera: Camera,
    pub mode: Mode,
    pub scratch: &'f Scratch,
}

impl Reflections {
    /// Computes the reflections of a frame, up to `depth` levels, in the memory of another frame.
    pub fn find(
        &mut self,
        culler: &Culler,
        frame: Option<Seen<'_>>,
        (mirrors, depth): (&[Mirror], u32),
        scratch: &mut Scratch,
    ) {
        self.turned.clear();
        self.objects.clear();
        self.movers.ids.clear();
        let Some(Seen { movers, camera, mode, scratch: seen }) = frame.filter(|_| depth > 0) else { return };
        let mode = mode.without_queries();
        let by_portals = matches!(mode, Mode::Portals | Mode::PortalsAndPvs);
        let eye = |camera: &Camera, front| Eye::new(camera, culler, front);
        let (open, parent) = (Rect::FULL, None);
        let root = Seeing { camera, eye: eye(&camera, None), through: None, open, parent, depth: 0, by_portals };
        self.add(culler, mirrors, &root, seen);
        let mut next = 0;
        while let Some(view) = self.turned.get(next) {
            let (mirror, camera, open, nested) = (&mirrors[view.mirror], view.camera, view.rect, view.depth);
            let eye = eye(&camera, Some(mirror.plane));
            scratch.begin();
            let with_rows = matches!(mode, Mode::Pvs | Mode::PortalsAndPvs);
            culler.join_rows(if with_rows { std::slice::from_ref(&mirror.cell) } else { &[] }, scratch);
            if by_portals {
                scratch.homes.push(mirror.cell);
                portals::traverse(culler, &camera, &eye, &[mirror.cell], &open, scratch);
            } else {
                culler.take_all(&camera, mode, scratch);
            }
            culler.leave_out_small(&camera, mode, scratch);
            scratch.finish(culler);
            let start = self.objects.len();
            self.objects.extend_from_slice(&scratch.objects);
            let turned = &mut self.turned[next];
            turned.objects = start..self.objects.len();
            turned.stats += scratch.stats;
            let start = self.movers.ids.len();
            if let Some(movers) = movers {
                let opened =
                    Opened { culler, camera: &camera, front: by_portals.then_some(mirror.plane), open: &open, off: 0.0 };
                self.movers.add(movers, culler, How::of(mode), &opened, scratch);
            }
            turned.movers = start..self.movers.ids.len();
            if nested < depth {
                let (through, parent) = (Some(mirror), Some(next));
                let seeing = Seeing { camera, eye, through, open, parent, depth: nested, by_portals };
                self.add(culler, mirrors, &seeing, scratch);
            }
            next += 1;
        }
    }

    /// Adds the mirrors visible in a frame, seen in reflection `parent` or by the eye.
    fn add(&mut self, culler: &Culler, mirrors: &[Mirror], eye: &Seeing<'_>, frame: &Scratch) {
        for (i, mirror) in mirrors.iter().enumerate() {
            let behind = eye.through.is_some_and(|through: &Mirror| {
                std::ptr::eq(through, mirror) || !is_beyond(culler, through.plane, &mirror.corners)
            });
            if behind {
                continue;
            }
            let rect = eye.seen_on(culler, mirror, frame);
            if rect.is_empty() {
                continue;
            }
            if self.turned.len() == MOST_REFLECTIONS {
                self.turned[eye.parent.unwrap_or(0)].stats.capped += 1;
                return;
            }
            let (none, stats) = (Range::default(), FrameStats::default());
            let (camera, depth) = (mirror.reflect(&eye.camera), eye.depth + 1);
            let (objects, movers, parent) = (none.clone(), none, eye.parent);
            self.turned.push(Turned { mirror: i, parent, depth, camera, rect, objects, movers, stats });
        }
    }

    /// The reflections, first those that the eye sees directly.
    pub fn iter(&self) -> impl ExactSizeIterator<Item = Reflection<'_>> {
        self.turned.iter().map(|turned| {
            let Turned { mirror, parent, depth, camera, rect, stats, .. } = *turned;
            let objects = &self.objects[turned.objects.clone()];
            let movers = &self.movers.ids[turned.movers.clone()];
            Reflection { mirror, parent, depth, camera, rect, objects, movers, stats }
        })
    }
}

/// The viewer of mirrors.
struct Seeing<'m> {
    camera: Camera,
    eye: Eye,
    /// The mirror that it looks into.
    through: Option<&'m Mirror>,
    /// The rectangle of that mirror.
    open: Rect,
    parent: Option<usize>,
    depth: u32,
    /// Whether portals restrict the view of a mirror.
    by_portals: bool,
}

impl Seeing<'_> {
    /// The rectangle of a mirror on the screen, in a frame.
    fn seen_on(&self, culler: &Culler, mirror: &Mirror, frame: &Scratch) -> Rect {
        let side = self.eye.distance_from(mirror.plane);
        // Lines of sight of an orthographic camera start anywhere.
        if side < -culler.tolerance && !self.camera.is_orthographic() {
            return Rect::EMPTY;
        }
        let own = self.eye.outline(&mirror.corners, side);
        // An eye in no cell sees everything in the frustum.
        let anywhere = !self.by_portals || frame.homes.is_empty();
        let at_home = anywhere || frame.homes.contains(&mirror.cell);
        let mut seen = if at_home { self.open.intersection(own) } else { Rect::EMPTY };
        for crossed in frame.crossed.iter().filter(|c| target(culler, c.portal) == mirror.cell) {
            let rect = crossed.rect.intersection(own);
            if !rect.is_empty() && is_beyond(culler, directed_plane(culler, crossed.portal), &mirror.corners) {
                seen = seen.union(rect);
            }
        }
        seen
    }
}
