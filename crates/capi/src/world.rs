//! Worlds of modules: buildings in their places, joined at their portals, and what a camera sees of them.

use crate::building::{EnfBuilding, EnfRun};
use crate::doors::EnfDoors;
use crate::fault::{EnfStatus, Fault, handle, needed, status};
use crate::lists::Buffer;
use crate::movers::{EnfMover, EnfMovers};
use crate::shapes::EnfCamera;
use crate::view::{EnfMode, mode_of};
use runtime::PortalId;
use runtime::glam::DMat4;
use runtime::runtime::{ModuleId, NotRigid, Placement, VisibleSet, World, WorldError, WorldView};
use std::mem::MaybeUninit;

/// Buildings in their places, and their joins, for any number of views.
pub struct EnfWorld {
    world: World,
}

/// One camera's culling of a world.
pub struct EnfWorldView {
    view: WorldView,
}

/// A module. Slots are small numbers and used again, with another life.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct EnfModule {
    pub slot: u32,
    pub life: u32,
}

/// Where a module stands: a matrix by columns, from its coordinates to the world's, that turns and moves, and nothing else.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct EnfPlacement {
    pub matrix: [f64; 16],
}

impl From<ModuleId> for EnfModule {
    fn from(ModuleId { slot, life }: ModuleId) -> Self {
        Self { slot, life }
    }
}

impl From<EnfModule> for ModuleId {
    fn from(EnfModule { slot, life }: EnfModule) -> Self {
        Self { slot, life }
    }
}

impl From<WorldError> for Fault {
    fn from(error: WorldError) -> Self {
        Self::argument(error)
    }
}

impl From<NotRigid> for Fault {
    fn from(error: NotRigid) -> Self {
        Self::argument(error)
    }
}

impl EnfWorldView {
    fn last(&mut self, module: EnfModule) -> Result<VisibleSet<'_>, Fault> {
        self.view.visible(module.into()).ok_or_else(|| Fault::nothing("the last frame shows nothing of the module"))
    }
}

/// A world without modules.
#[unsafe(no_mangle)]
pub extern "C" fn enf_world_new() -> Option<Box<EnfWorld>> {
    handle(|| Ok(EnfWorld { world: World::new() }))
}

/// Frees a world, or nothing.
#[unsafe(no_mangle)]
pub extern "C" fn enf_world_free(world: Option<Box<EnfWorld>>) {
    drop(world);
}

/// Adds a building as a module, joined to none; a building may stand several times.
#[unsafe(no_mangle)]
pub extern "C" fn enf_world_place(
    world: Option<&mut EnfWorld>,
    building: Option<&EnfBuilding>,
    placement: Option<&EnfPlacement>,
    module: Option<&mut MaybeUninit<EnfModule>>,
) -> EnfStatus {
    status(|| {
        let (world, building) = (needed(world, "the world")?, needed(building, "the building")?);
        let (placement, module) = (needed(placement, "the placement")?, needed(module, "the module")?);
        let placement = Placement::from_matrix(&DMat4::from_cols_array(&placement.matrix))?;
        module.write(world.world.place(&building.culler, placement).into());
        Ok(())
    })
}

/// Parts all joins of a module, and removes it.
#[unsafe(no_mangle)]
pub extern "C" fn enf_world_remove(world: Option<&mut EnfWorld>, module: EnfModule) -> EnfStatus {
    status(|| Ok(needed(world, "the world")?.world.remove(module.into())?))
}

/// Joins two portals that lead outside and lie on each other (`enf_building_ways_in`): a view goes on in the other module.
#[unsafe(no_mangle)]
pub extern "C" fn enf_world_join(
    world: Option<&mut EnfWorld>,
    module: EnfModule,
    portal: u32,
    other: EnfModule,
    other_portal: u32,
) -> EnfStatus {
    status(|| {
        let world = &mut needed(world, "the world")?.world;
        Ok(world.join(module.into(), PortalId(portal), other.into(), PortalId(other_portal))?)
    })
}

/// Parts a portal that is joined: both lead outdoors again.
#[unsafe(no_mangle)]
pub extern "C" fn enf_world_part(world: Option<&mut EnfWorld>, module: EnfModule, portal: u32) -> EnfStatus {
    status(|| Ok(needed(world, "the world")?.world.part(module.into(), PortalId(portal))?))
}

/// The portals of a building that lead outside, ascending: those by which modules are joined.
///
/// # Safety
///
/// `buffer` has room for `capacity` portals.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_building_ways_in(
    building: Option<&EnfBuilding>,
    buffer: *mut u32,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let ways: Vec<u32> = needed(building, "the building")?.culler.ways_in().map(|portal| portal.0).collect();
        // SAFETY: what this function asks of its caller.
        unsafe { Buffer::new(buffer, capacity, count) }?.fill(ways.into_iter())
    })
}

/// A view of worlds, with all doors open.
#[unsafe(no_mangle)]
pub extern "C" fn enf_world_view_new() -> Option<Box<EnfWorldView>> {
    handle(|| Ok(EnfWorldView { view: WorldView::new() }))
}

/// Frees a view, or nothing.
#[unsafe(no_mangle)]
pub extern "C" fn enf_world_view_free(view: Option<Box<EnfWorldView>>) {
    drop(view);
}

/// Takes the states of a module's doors, for later frames.
#[unsafe(no_mangle)]
pub extern "C" fn enf_world_view_set_doors(
    view: Option<&mut EnfWorldView>,
    world: Option<&EnfWorld>,
    module: EnfModule,
    doors: Option<&EnfDoors>,
) -> EnfStatus {
    status(|| {
        let (view, world) = (needed(view, "the view")?, &needed(world, "the world")?.world);
        let doors = needed(doors, "the doors")?.of(world.culler(module.into())?)?;
        Ok(view.view.set_doors(world, module.into(), doors)?)
    })
}

/// Culls a frame. The camera is in the world's coordinates. Ask for the lists afterwards.
#[unsafe(no_mangle)]
pub extern "C" fn enf_world_view_cull(
    view: Option<&mut EnfWorldView>,
    world: Option<&EnfWorld>,
    camera: Option<&EnfCamera>,
    mode: EnfMode,
) -> EnfStatus {
    status(|| {
        let (view, world) = (needed(view, "the view")?, needed(world, "the world")?);
        view.view.cull(&world.world, &(*needed(camera, "the camera")?).into(), mode_of(mode)?);
        Ok(())
    })
}

/// The modules that the last frame may show, those of the eye first.
///
/// # Safety
///
/// `buffer` has room for `capacity` modules.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_world_view_modules(
    view: Option<&EnfWorldView>,
    buffer: *mut EnfModule,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let view = needed(view, "the view")?;
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        buffer.fill(view.view.modules().iter().map(|&module| module.into()))
    })
}

/// The objects of a module that the last frame may show, each once.
///
/// # Safety
///
/// `buffer` has room for `capacity` objects.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_world_view_objects(
    view: Option<&mut EnfWorldView>,
    module: EnfModule,
    buffer: *mut u32,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let view = needed(view, "the view")?;
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        buffer.fill(view.last(module)?.objects.iter().map(|object| object.0))
    })
}

/// The same as ranges of the module's index buffer, ascending, neighbours joined: one draw each.
///
/// # Safety
///
/// `buffer` has room for `capacity` runs.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_world_view_runs(
    view: Option<&mut EnfWorldView>,
    module: EnfModule,
    buffer: *mut EnfRun,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let view = needed(view, "the view")?;
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        buffer.fill(view.last(module)?.runs().iter().map(|run| EnfRun { first: run.start, end: run.end }))
    })
}

/// The movers of a module that the last frame may show, each once.
///
/// # Safety
///
/// `buffer` has room for `capacity` movers.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn enf_world_view_movers(
    view: Option<&mut EnfWorldView>,
    module: EnfModule,
    movers: Option<&EnfMovers>,
    buffer: *mut EnfMover,
    capacity: usize,
    count: Option<&mut MaybeUninit<usize>>,
) -> EnfStatus {
    status(|| {
        let (view, movers) = (needed(view, "the view")?, needed(movers, "the movers")?);
        // SAFETY: what this function asks of its caller.
        let buffer = unsafe { Buffer::new(buffer, capacity, count) }?;
        let culler = view.view.culler(module.into());
        let movers = movers.of(culler.ok_or_else(|| Fault::nothing("the last frame shows nothing of the module"))?)?;
        buffer.fill(view.view.movers(module.into(), movers).iter().map(|&mover| mover.into()))
    })
}
