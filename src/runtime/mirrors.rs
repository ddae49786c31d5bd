//! Mirrors: portals that lead back into the room that they hang in, seen by an eye behind them.
//!
//! Based on: D. Luebke and C. Georges, *Portals and mirrors: simple, fast evaluation of potentially visible sets*, 1995: a mirror is a
//! portal whose far side is its own cell, reflected. A point seen in a mirror is seen on the same pixel by a camera that is reflected
//! in the mirror's plane, without the mirror; so what a mirror shows is one more traversal, from the mirror's cell, cut to the
//! rectangle by which the mirror itself is seen, with the reflected camera. A mirror in a mirror is the same once more.
//!
//! Rows: a line that a mirror turns goes on from the mirror's cell, so it is that cell's row that holds, not the eye's.

use super::Mode;
use super::culler::Culler;
use super::culler::{directed_plane, target};
use super::frustum::{Camera, Rect};
use super::portals::{self, Eye, is_beyond};
use super::scratch::{FrameStats, Scratch};
use crate::geom::newell;
use crate::{CellId, ObjectId};
use glam::{DVec3, Vec3};
use std::ops::Range;

/// Most pictures of a frame in mirrors. Two mirrors that face each other show two more with each step of depth, a hall of mirrors as many
/// as it has ways; what is beyond it isn't shown, and is counted.
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
    /// A mirror that hangs in `cell`: a convex polygon, metres relative to the file's origin, counter-clockwise seen from the room.
    /// `None` where the corners have no area or aren't numbers.
    pub fn new(cell: CellId, corners: &[Vec3]) -> Option<Self> {
        let first = corners.first()?.as_dvec3();
        let relative: Vec<DVec3> = corners.iter().map(|p| p.as_dvec3() - first).collect();
        let n = newell(&relative).try_normalize()?;
        let d = corners.iter().map(|p| n.dot(p.as_dvec3())).sum::<f64>() / corners.len() as f64;
        let plane = (n.as_vec3(), d as f32);
        d.is_finite().then(|| Self { cell, corners: corners.to_vec(), plane })
    }

    /// The cell that it hangs in.
    pub fn cell(&self) -> CellId {
        self.cell
    }

    /// The camera that sees without the mirror what `camera` sees in it, on the same pixels. Pictures taken with it are turned inside out
    /// (clockwise is counter-clockwise), and what is behind the mirror's plane has to be cut off.
    pub fn reflect(&self, camera: &Camera) -> Camera {
        let n = self.plane.0.as_dvec3();
        let turned = |v: Vec3| (v.as_dvec3() - n * (2.0 * n.dot(v.as_dvec3()))).as_vec3();
        let eye = camera.eye.as_dvec3();
        let eye = eye - n * (2.0 * (n.dot(eye) - f64::from(self.plane.1)));
        Camera { eye: eye.as_vec3(), x: turned(camera.x), y: turned(camera.y), w: turned(camera.w) }
    }
}

/// What one mirror shows.
#[derive(Clone, PartialEq, Debug)]
pub struct Reflection {
    /// Which of the mirrors.
    pub mirror: usize,
    /// The reflection that the mirror is seen in; `None` where the eye sees it.
    pub parent: Option<usize>,
    /// How many mirrors turn the lines; 1 or more.
    pub depth: u32,
    /// The camera that sees it without mirrors: see [`Mirror::reflect`].
    pub camera: Camera,
    /// The part of the screen that it can be on.
    pub rect: Rect,
    objects: Range<usize>,
}

/// What the mirrors of a frame show, and the memory for it, which grows to what the dearest frame needs.
#[derive(Clone, Debug)]
pub struct Reflections {
    scratch: Scratch,
    views: Vec<Reflection>,
    objects: Vec<ObjectId>,
    stats: FrameStats,
}

impl Reflections {
    /// None yet.
    pub fn for_culler(culler: &Culler) -> Self {
        Self { scratch: Scratch::for_culler(culler), views: Vec::new(), objects: Vec::new(), stats: FrameStats::default() }
    }

    /// What is seen in mirrors, those that the eye sees first.
    pub fn views(&self) -> &[Reflection] {
        &self.views
    }

    /// What to draw in one of them: each object once.
    pub fn objects(&self, view: usize) -> &[ObjectId] {
        &self.objects[self.views[view].objects.clone()]
    }

    /// Sums over all; reflections beyond [`MOST_REFLECTIONS`] are counted in `capped`.
    pub fn stats(&self) -> FrameStats {
        self.stats
    }

    /// The mirrors that a frame shows, as `scratch` has it, are seen in reflection `parent`, or by the eye.
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

/// Who looks at mirrors.
struct Seeing<'m> {
    camera: Camera,
    eye: Eye,
    /// What it looks through already.
    through: Option<&'m Mirror>,
    /// Where that is seen.
    open: Rect,
    parent: Option<usize>,
    depth: u32,
    /// Portals tell where a mirror is seen.
    by_portals: bool,
}

impl Seeing<'_> {
    /// The part of the screen that a mirror is seen on, in a frame.
    fn seen_on(&self, culler: &Culler, mirror: &Mirror, frame: &Scratch) -> Rect {
        let side = self.eye.distance_from(mirror.plane);
        if side < -culler.tolerance {
            return Rect::EMPTY;
        }
        let own = self.eye.outline(&mirror.corners, side);
        // An eye that is in no cell sees whatever is in the frustum.
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
    /// What mirrors show, each in `depth` others at most (0: none), in the frame of this camera that `scratch` holds: of
    /// [`Culler::cull`] in the same mode, just before. In modes without portals, mirrors are seen wherever they are, and show the row of
    /// their cell.
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
