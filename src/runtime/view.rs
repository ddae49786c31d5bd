//! A view: everything that one camera changes from frame to frame, in one object.
//!
//! A view holds its culler by `Arc`, so that both fit into one struct of an engine, a view goes to any thread, and no lifetime is named.

use super::around::{Around, Surroundings};
use super::camera::{Camera, Rect};
use super::culler::Culler;
use super::doors::Doors;
use super::mirrors::{Mirror, Reflection, Reflections, Seen};
use super::mode::Mode;
use super::movers::{Collected, How, MoverId, Movers};
use super::objects::Opened;
use super::online::OnlineCuller;
use super::relevance::Reach;
use super::scratch::Scratch;
use super::small::MinPixels;
use super::visible::{Lists, VisibleSet};
use crate::occlusion::hierarchy::Hierarchy;
use crate::occlusion::oracle::OcclusionOracle;
use crate::{CellId, ObjectId};
use glam::{Vec3, Vec4};
use std::sync::Arc;

/// One camera's culling. Views of one culler are independent of each other.
///
/// After the first call of each kind, nothing allocates; [`View::cull`] never does.
#[derive(Clone, Debug)]
pub struct View {
    culler: Arc<Culler>,
    /// The last frame.
    frame: Scratch,
    last: Option<Last>,
    lists: Lists,
    movers: Collected,
    /// Created by the first frame with queries.
    online: Option<OnlineCuller>,
    /// Created by the first question that is none about a frame.
    aside: Option<Box<Aside>>,
}

/// How the last frame was asked for.
#[derive(Clone, Copy, Debug)]
struct Last {
    camera: Camera,
    mode: Mode,
    /// Of a frame that an oracle has drawn: metres.
    near: Option<f64>,
}

/// Memory of questions beside the frame.
#[derive(Clone, Debug)]
struct Aside {
    scratch: Scratch,
    reflections: Reflections,
    around: Surroundings,
    movers: Collected,
    reach: Reach,
}

impl View {
    /// A view with all doors open and without a limit on small objects.
    pub fn new(culler: &Arc<Culler>) -> Self {
        let (frame, lists) = (Scratch::for_culler(culler), Lists::for_culler(culler));
        Self { culler: culler.clone(), frame, last: None, lists, movers: Collected::default(), online: None, aside: None }
    }

    /// Takes the states of the doors, for this frame and later ones.
    ///
    /// # Panics
    ///
    /// If they are of a culler with another number of portals.
    pub fn set_doors(&mut self, doors: &Doors) {
        self.frame.doors.assign(doors);
    }

    /// The states of its doors.
    pub fn doors(&self) -> &Doors {
        &self.frame.doors
    }

    /// Sets the limit below which objects are not drawn, in all modes except [`Mode::None`], and in mirrors, too.
    pub fn set_min_pixels(&mut self, limit: MinPixels) {
        self.frame.min_pixels = limit;
    }

    /// Culls a frame. Modes with queries give the result of portals and rows, for renderers with queries of their own.
    pub fn cull(&mut self, camera: &Camera, mode: Mode) -> VisibleSet<'_> {
        self.last = Some(Last { camera: *camera, mode, near: None });
        self.culler.cull(camera, mode, &mut self.frame);
        self.set(camera)
    }

    /// Culls a frame with an oracle. Modes with queries begin its frame, with a near plane at `near` metres, above 0, draw into it and return
    /// the drawn objects; other modes don't ask it. An orthographic camera asks nothing.
    pub fn cull_with(
        &mut self,
        camera: &Camera,
        mode: Mode,
        near: f64,
        mut oracle: &mut dyn OcclusionOracle,
    ) -> VisibleSet<'_> {
        let mode = self.choose(camera, mode);
        let asks = mode.has_queries() && !camera.is_orthographic();
        self.last = Some(Last { camera: *camera, mode, near: asks.then_some(near) });
        self.culler.cull(camera, mode, &mut self.frame);
        if asks {
            let online = self.online.get_or_insert_with(|| OnlineCuller::new(&self.culler));
            let view = camera.view(near);
            oracle.begin(&view);
            online.cull(&self.culler, &view, mode, &mut oracle, &mut self.frame);
        }
        self.set(camera)
    }

    /// The result of the last frame again; none before the first.
    pub fn visible(&mut self) -> Option<VisibleSet<'_>> {
        let camera = self.last?.camera;
        Some(self.set(&camera))
    }

    fn set(&mut self, camera: &Camera) -> VisibleSet<'_> {
        let Scratch { objects, cells, crossed, homes, stats, doors, .. } = &self.frame;
        let (culler, lists) = (&*self.culler, &mut self.lists);
        VisibleSet { objects, cells, portals: crossed, homes, stats: *stats, eye: camera.eye, culler, doors, lists }
    }

    /// The mode of a frame, with [`Mode::Auto`] resolved: queries pay if portals and rows leave much.
    pub fn choose(&self, camera: &Camera, mode: Mode) -> Mode {
        match mode {
            Mode::Auto => match self.culler.cell_of(camera.eye) {
                Some(cell) if !self.culler.is_open_cell(cell) => Mode::PortalsAndPvs,
                _ => Mode::Chc,
            },
            mode => mode,
        }
    }

    /// Allocates for occlusion queries now, instead of in the first frame with queries; with a client's tree ([`Hierarchy::of_tree`]) over
    /// the culler's objects, relative to the file's origin, if there is one.
    ///
    /// # Panics
    ///
    /// If the tree's number of objects differs.
    pub fn prepare_queries(&mut self, tree: Option<Hierarchy>) {
        self.online = Some(match tree {
            Some(tree) => OnlineCuller::with_tree(&self.culler, tree),
            None => OnlineCuller::new(&self.culler),
        });
    }

    /// Forgets what queries answered in earlier frames.
    pub fn restart(&mut self) {
        let tree = self.online.take().map(OnlineCuller::into_tree);
        self.online = tree.map(|tree| OnlineCuller::with_tree(&self.culler, tree));
    }

    /// Memory beside the frame, with its limits and doors.
    fn aside(&mut self) -> (&Culler, &Scratch, &mut Aside) {
        let culler = &*self.culler;
        let aside = self.aside.get_or_insert_with(|| {
            let (scratch, around) = (Scratch::for_culler(culler), Surroundings::for_culler(culler));
            let (reflections, movers) = Default::default();
            Box::new(Aside { scratch, reflections, around, movers, reach: Reach::for_culler(culler) })
        });
        aside.scratch.doors.assign(&self.frame.doors);
        aside.scratch.min_pixels = self.frame.min_pixels;
        (culler, &self.frame, aside)
    }

    /// The movers that the last frame may show, each once; none before the first. Limits on small objects are not for them.
    ///
    /// # Panics
    ///
    /// If they are of another culler.
    pub fn movers(&mut self, movers: &Movers) -> &[MoverId] {
        self.movers.ids.clear();
        let Some(Last { camera, mode, .. }) = self.last else { return &[] };
        let how = match How::of(mode.without_queries()) {
            How::All => How::All,
            how if camera.is_orthographic() || self.frame.homes.is_empty() && how != How::Screen => How::Screen,
            how => how,
        };
        let seen = Opened { culler: &self.culler, camera: &camera, front: None, open: &Rect::FULL, off: 0.0 };
        self.movers.add(movers, &self.culler, how, &seen, &mut self.frame);
        &self.movers.ids
    }

    /// The same without those that the oracle of the last frame ([`View::cull_with`]) sees nothing of, if the frame's mode asked queries. Call
    /// it before the oracle begins another frame.
    ///
    /// # Panics
    ///
    /// If they are of another culler.
    pub fn movers_with(&mut self, movers: &Movers, oracle: &mut dyn OcclusionOracle) -> &[MoverId] {
        self.movers(movers);
        if let Some(Last { camera, near: Some(near), .. }) = self.last {
            self.movers.ask(movers, &camera.view(near), oracle);
        }
        &self.movers.ids
    }

    /// The mirrors that the last frame shows, and what to draw in them, up to `depth` reflections (0: none): first those that the eye sees
    /// directly. In modes without portals, all mirrors on the screen count, with the row of their cell. None before the first frame.
    ///
    /// # Panics
    ///
    /// If there are movers, and they are of another culler.
    pub fn mirrors(
        &mut self,
        mirrors: &[Mirror],
        depth: u32,
        movers: Option<&Movers>,
    ) -> impl ExactSizeIterator<Item = Reflection<'_>> {
        let last = self.last;
        let (culler, frame, Aside { scratch, reflections, .. }) = self.aside();
        let seen = last.map(|Last { camera, mode, .. }| Seen { movers, camera, mode, scratch: frame });
        reflections.find(culler, seen, (mirrors, depth), scratch);
        reflections.iter()
    }

    /// The potentially visible objects around an eye (metres, relative to the file's origin) in all directions: those of the rows of its
    /// cells that are in cells reachable through open portals, or in the doorways of shut ones. All objects, if the eye is in no cell.
    pub fn around(&mut self, eye: Vec3) -> Around<'_> {
        let (culler, _, Aside { scratch, around, .. }) = self.aside();
        around.find(culler, eye, scratch);
        around.tell()
    }

    /// The movers around an eye, as [`View::around`]: those in cells reachable through open portals within the rows of the eye's cells, or in
    /// the doorways of shut ones. All movers, if the eye is in no cell.
    ///
    /// # Panics
    ///
    /// If they are of another culler.
    pub fn movers_around(&mut self, movers: &Movers, eye: Vec3) -> &[MoverId] {
        let (culler, _, Aside { scratch, around, movers: collected, .. }) = self.aside();
        around.find(culler, eye, scratch);
        collected.ids.clear();
        collected.add_around(movers, culler, around);
        &collected.ids
    }

    /// The cells reachable from `from` through at most `hops` open portals, independent of visibility: for sounds and for loading. Ordered
    /// by the number of portals, which is part of the result; `from` itself is first.
    pub fn within_hops(&mut self, from: CellId, hops: u32) -> &[(CellId, u32)] {
        let (culler, _, Aside { scratch, .. }) = self.aside();
        culler.hop(from, hops, scratch);
        &scratch.hops
    }

    /// The cells that a body may get into from anywhere in its box (metres, relative to the file's origin) within so many metres, through open
    /// portals: for servers that know where it was ([`Culler::may_see`]). Those that the box meets come first; none, if there are none.
    pub fn within_metres(&mut self, bounds: [Vec3; 2], metres: f64) -> &[CellId] {
        let (culler, _, Aside { scratch, reach, .. }) = self.aside();
        reach.of_box(culler, &scratch.doors, bounds, metres)
    }

    /// Objects whose box intersects a convex volume: `planes` are `(n, d)` with `n . p <= d` inside, metres relative to the file's origin,
    /// with normals of any length except zero. With cells in `from`, only objects of those cells' rows: a light's frustum extended to the
    /// camera's view contains all shadow casters, and objects hidden from the lit cells cast no visible shadow. Ascending.
    ///
    /// # Panics
    ///
    /// With more than [`MOST_PLANES`](super::MOST_PLANES) planes.
    pub fn in_volume(&mut self, planes: &[Vec4], from: &[CellId]) -> &[ObjectId] {
        let (culler, _, Aside { scratch, .. }) = self.aside();
        culler.take_volume(planes, from, scratch);
        &scratch.objects
    }

    /// Movers whose box intersects a convex volume, as [`View::in_volume`]: with cells in `from`, only those in cells of their rows, for
    /// shadows of what moves.
    ///
    /// # Panics
    ///
    /// With more than [`MOST_PLANES`](super::MOST_PLANES) planes, or with movers of another culler.
    pub fn movers_in_volume(&mut self, movers: &Movers, planes: &[Vec4], from: &[CellId]) -> &[MoverId] {
        let (culler, _, Aside { scratch, movers: collected, .. }) = self.aside();
        culler.collect_volume(planes, from, scratch, movers, collected);
        &collected.ids
    }
}
