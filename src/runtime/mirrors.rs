//! Mirrors: portals that lead back into their own cell, seen by a reflected eye.
//!
//! Based on: D. Luebke and C. Georges, *Portals and mirrors: simple, fast evaluation of potentially visible sets*, 1995: a mirror is a
//! portal whose far side is its own cell, reflected. A point seen in a mirror is on the same pixel for a camera reflected in the mirror's
//! plane, without the mirror. So each mirror needs one more traversal with the reflected camera, from the mirror's cell, clipped to the
//! mirror's rectangle on the screen. A mirror in a mirror repeats this.
//!
//! Rows: a reflected line starts in the mirror's cell, so that cell's row applies, not the eye's.

use super::Mode;
use super::culler::Culler;
use super::culler::{directed_plane, target};
use super::frustum::{Camera, Rect};
use super::portals::{self, Eye, is_beyond};
use super::scratch::{FrameStats, Scratch};
use crate::math::geom::newell;
use crate::{CellId, ObjectId};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Most reflections of a frame. Two opposite mirrors add two per level of depth, a hall of mirrors exponentially many; further ones are
/// dropped and counted.
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
#[derive(Clone, PartialEq, Debug)]
pub struct Reflection {
    /// Index of the mirror.
    pub mirror: usize,
    /// The reflection that shows the mirror; `None` if the eye sees it directly.
    pub parent: Option<usize>,
    /// Number of reflections along a line; 1 or more.
    pub depth: u32,
    /// The reflected camera: see [`Mirror::reflect`].
    pub camera: Camera,
    /// Its rectangle on the screen.
    pub rect: Rect,
    objects: Range<usize>,
}

/// The reflections of a frame, in memory that grows to the maximum over frames.
#[derive(Clone, Debug)]
pub struct Reflections {
    scratch: Scratch,
    views: Vec<Reflection>,
    objects: Vec<ObjectId>,
    stats: FrameStats,
}

impl Reflections {
    /// Without reflections.
    pub fn for_culler(culler: &Culler) -> Self {
        Self { scratch: Scratch::for_culler(culler), views: Vec::new(), objects: Vec::new(), stats: FrameStats::default() }
    }

    /// The reflections, first those that the eye sees directly.
    pub fn views(&self) -> &[Reflection] {
        &self.views
    }

    /// The objects to draw in one of them, each once.
    pub fn objects(&self, view: usize) -> &[ObjectId] {
        &self.objects[self.views[view].objects.clone()]
    }

    /// Sums over all; `capped` counts reflections beyond [`MOST_REFLECTIONS`].
    pub fn stats(&self) -> FrameStats {
        self.stats
    }

    /// Adds the mirrors visible in a frame, seen in reflection `parent` or by the eye.
    fn add(&mut self, culler: &Culler, mirrors: &[Mirror], eye: &Seeing<'_>, frame: Option<&Scratch>) {
        let frame = frame.unwrap_or(&self.scratch);
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
            if self.views.len() == MOST_REFLECTIONS {
                self.stats.capped += 1;
                return;
            }
            let (camera, none) = (mirror.reflect(&eye.camera), Range::default());
            self.views.push(Reflection { mirror: i, parent: eye.parent, depth: eye.depth + 1, camera, rect, objects: none });
        }
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
        if side < -culler.tolerance {
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

impl Culler {
    /// Computes reflections, up to `depth` levels (0: none), for the frame in `scratch`: that of [`Culler::cull`] with this camera and
    /// mode, just before. In modes without portals, all mirrors on the screen count, with the row of their cell.
    pub fn reflect(
        &self,
        camera: &Camera,
        mode: Mode,
        mirrors: &[Mirror],
        depth: u32,
        scratch: &Scratch,
        out: &mut Reflections,
    ) {
        out.views.clear();
        out.objects.clear();
        out.stats = FrameStats::default();
        if depth == 0 {
            return;
        }
        let mode = mode.without_queries();
        let by_portals = matches!(mode, Mode::Portals | Mode::PortalsAndPvs);
        let eye = |camera: &Camera, front| Eye::new(camera, self, front);
        let (open, parent) = (Rect::FULL, None);
        let root = Seeing { camera: *camera, eye: eye(camera, None), through: None, open, parent, depth: 0, by_portals };
        out.add(self, mirrors, &root, Some(scratch));
        let mut next = 0;
        while let Some(view) = out.views.get(next) {
            let (mirror, camera, open, nested) = (&mirrors[view.mirror], view.camera, view.rect, view.depth);
            let eye = eye(&camera, Some(mirror.plane));
            out.scratch.begin(self);
            let with_rows = matches!(mode, Mode::Pvs | Mode::PortalsAndPvs);
            self.join_rows(if with_rows { std::slice::from_ref(&mirror.cell) } else { &[] }, &mut out.scratch);
            if by_portals {
                out.scratch.homes.push(mirror.cell);
                portals::traverse(self, &camera, &eye, &[mirror.cell], &open, &mut out.scratch);
            } else {
                self.take_all(&camera, mode, &mut out.scratch);
            }
            self.leave_out_small(&camera, mode, &mut out.scratch);
            let start = out.objects.len();
            out.objects.extend_from_slice(&out.scratch.objects);
            out.views[next].objects = start..out.objects.len();
            out.stats += out.scratch.finish(self, None).stats;
            if nested < depth {
                let (through, parent) = (Some(mirror), Some(next));
                let seeing = Seeing { camera, eye, through, open, parent, depth: nested, by_portals };
                out.add(self, mirrors, &seeing, None);
            }
            next += 1;
        }
    }
}
