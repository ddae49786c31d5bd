//! Joining modules where two portals lie on each other, and parting them.

use super::super::culler::{Culler, directed_plane};
use super::super::portals::distance;
use super::{Module, ModuleId, World};
use crate::{DirectedPortal, PortalId};
use std::fmt;

/// A portal's other side.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Join {
    pub module: ModuleId,
    /// The way in there.
    pub portal: DirectedPortal,
}

/// An error of a [`World`]; nothing is changed then.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum WorldError {
    /// The module was removed, or never was.
    Removed(ModuleId),
    /// The module has no such portal.
    NoPortal(ModuleId, PortalId),
    /// The portal does not lead outside: neither of its cells is without an end, or both are.
    Within(ModuleId, PortalId),
    /// The portal is joined.
    Joined(ModuleId, PortalId),
    /// The portal is not joined.
    Open(ModuleId, PortalId),
    /// The portals do not lie on each other.
    Apart {
        /// The largest distance of a corner of one from the other, metres.
        metres: f64,
        /// The largest that there may be, metres.
        most: f64,
    },
    /// The portals lie on each other, and both modules are on the same side.
    SameSide,
}

impl fmt::Display for WorldError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Removed(module) => write!(f, "module {module} is removed"),
            Self::NoPortal(module, portal) => write!(f, "module {module} has no portal {portal}"),
            Self::Within(module, portal) => write!(f, "portal {portal} of module {module} does not lead outside"),
            Self::Joined(module, portal) => write!(f, "portal {portal} of module {module} is joined"),
            Self::Open(module, portal) => write!(f, "portal {portal} of module {module} is not joined"),
            Self::Apart { metres, most } => {
                write!(f, "the portals are {metres:.6} m apart; joined ones lie within {most:.6} m of each other")
            }
            Self::SameSide => f.write_str("both modules are on the same side of the portals"),
        }
    }
}

impl std::error::Error for WorldError {}

/// One end of a join.
#[derive(Clone, Copy)]
struct End<'w> {
    module: &'w Module,
    id: ModuleId,
    way_in: DirectedPortal,
}

impl End<'_> {
    fn culler(&self) -> &Culler {
        &self.module.culler
    }

    /// The largest distance of this portal's corners from another portal, metres.
    fn off(&self, other: &Self) -> f64 {
        let corners = |end: &Self| end.module.culler.portal_corners.range(end.way_in.portal().index());
        let (mine, others) = (&self.culler().portal_corners.items()[corners(self)], corners(other));
        let to_other = |p| other.module.placement.to_module(self.module.placement.to_world(p));
        let others = &other.culler().portal_corners.items()[others];
        mine.iter().map(|p| distance(to_other(p.as_dvec3()), others)).fold(0.0, f64::max)
    }
}

impl World {
    /// Joins two ways in of modules that lie on each other and lead in from opposite sides. Both keep their door: the view goes on where both
    /// are open.
    ///
    /// # Errors
    ///
    /// If they don't lie within the sum of both [tolerances](Culler::tolerance) of each other, one is joined already, or one leads nowhere
    /// outside.
    pub fn join(&mut self, a: ModuleId, portal: PortalId, b: ModuleId, other: PortalId) -> Result<(), WorldError> {
        let ends = [self.end(a, portal)?, self.end(b, other)?];
        for end in ends {
            if end.module.joins[end.way_in.portal().index()].is_some() {
                return Err(WorldError::Joined(end.id, end.way_in.portal()));
            }
        }
        let [one, two] = ends;
        let metres = one.off(&two).max(two.off(&one));
        let most = one.culler().tolerance + two.culler().tolerance;
        if metres > most {
            return Err(WorldError::Apart { metres, most });
        }
        let [n, other_n] = ends.map(|end| end.module.placement.turn(directed_plane(end.culler(), end.way_in).0.as_dvec3()));
        if n.dot(other_n) >= 0.0 {
            return Err(WorldError::SameSide);
        }
        let [one, two] = [(a, one.way_in), (b, two.way_in)];
        self.link(one, Some(two));
        self.link(two, Some(one));
        Ok(())
    }

    /// Parts a joined portal: it leads outdoors again, and so does the other.
    ///
    /// # Errors
    ///
    /// If it is not joined.
    pub fn part(&mut self, module: ModuleId, portal: PortalId) -> Result<(), WorldError> {
        let end = self.end(module, portal)?;
        let (way_in, join) = (end.way_in, end.module.joins[portal.index()]);
        let Join { module: other, portal: other_way_in } = join.ok_or(WorldError::Open(module, portal))?;
        self.link((module, way_in), None);
        self.link((other, other_way_in), None);
        Ok(())
    }

    /// The module and the portal that a portal is joined to.
    ///
    /// # Errors
    ///
    /// If there is no such module.
    pub fn joined(&self, module: ModuleId, portal: PortalId) -> Result<Option<(ModuleId, PortalId)>, WorldError> {
        let joins = &self.module(module)?.joins;
        Ok(joins.get(portal.index()).copied().flatten().map(|join| (join.module, join.portal.portal())))
    }

    pub(super) fn part_all(&mut self, module: ModuleId) -> Result<(), WorldError> {
        for portal in (0..self.module(module)?.joins.len() as u32).map(PortalId) {
            if self.module(module)?.joins[portal.index()].is_some() {
                self.part(module, portal)?;
            }
        }
        Ok(())
    }

    fn end(&self, id: ModuleId, portal: PortalId) -> Result<End<'_>, WorldError> {
        let module = self.module(id)?;
        if portal.index() >= module.culler.portal_count() {
            return Err(WorldError::NoPortal(id, portal));
        }
        let way_in = module.culler.way_in(portal).ok_or(WorldError::Within(id, portal))?;
        Ok(End { module, id, way_in })
    }

    fn link(&mut self, (id, way_in): (ModuleId, DirectedPortal), other: Option<(ModuleId, DirectedPortal)>) {
        let Ok(module) = self.module_mut(id) else { return };
        module.joins[way_in.portal().index()] = other.map(|(module, portal)| Join { module, portal });
        let out = way_in.reversed();
        let (word, bit) = (&mut module.joined[out.0 as usize / 64], 1 << (out.0 % 64));
        *word = if other.is_some() { *word | bit } else { *word & !bit };
    }
}
