//! The building that is walked through, as a resource and as an asset.

use crate::EnfiladeObject;
#[cfg(feature = "gizmos")]
use crate::gizmos::Outlines;
use bevy_asset::Asset;
use bevy_ecs::resource::Resource;
use bevy_reflect::TypePath;
use enfilade::file::PvsFile;
use enfilade::runtime::{Culler, Doors};
use enfilade::{DirectedPortal, ObjectId, PortalId};
use std::collections::HashMap;
use std::fmt;
use std::sync::Arc;

/// What can be seen from where, and which doors are open. Its model stands in the world where its own coordinates put it: metres, +Y up,
/// as in Bevy. Bevy's positions are `f32`: beyond some kilometres from the world's origin they are coarser than [`Culler::tolerance`], and an
/// eye beside a wall may be taken to be behind it.
///
/// Inserting another one replaces it. Without one, everything is visible. As an asset, it is inserted by [`LevelHandle`](crate::LevelHandle).
#[derive(Resource, Asset, TypePath, Clone)]
pub struct Building {
    culler: Arc<Culler>,
    doors: Doors,
    /// Of the file's coordinates in the model's own, metres.
    pub(crate) origin: [f64; 3],
    /// The first and the last object by node.
    nodes: Arc<HashMap<String, [ObjectId; 2]>>,
    #[cfg(feature = "gizmos")]
    pub(crate) outlines: Arc<Outlines>,
}

/// The building has no such portal.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct NoSuchPortal {
    /// Which.
    pub portal: PortalId,
    /// How many there are, from 0.
    pub portals: usize,
}

impl fmt::Display for NoSuchPortal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "no portal {}: the building has {}", self.portal, self.portals)
    }
}

impl std::error::Error for NoSuchPortal {}

impl Building {
    /// Lays out a file; every door is open.
    ///
    /// # Panics
    ///
    /// Where the file isn't consistent, which one that was loaded is.
    pub fn new(file: &PvsFile) -> Self {
        let mut nodes = HashMap::new();
        for (id, object) in (0u32..).map(ObjectId).zip(&file.objects) {
            nodes.entry(object.node.clone()).or_insert([id; 2])[1] = id;
        }
        let culler = Culler::new(file);
        Self {
            doors: Doors::open(&culler),
            culler,
            origin: file.origin.to_array(),
            nodes: Arc::new(nodes),
            #[cfg(feature = "gizmos")]
            outlines: Arc::new(Outlines::new(file)),
        }
    }

    /// The component for the mesh, or the meshes, of a node of the model, by its name; for IFC, its GlobalId. `None` where there is no such
    /// node. Where several nodes have the name, each shows when one of them, or an object between them, does.
    pub fn object(&self, node: &str) -> Option<EnfiladeObject> {
        self.nodes.get(node).map(|&[first, last]| EnfiladeObject { first, last, ..EnfiladeObject::new(first) })
    }

    /// What answers the questions of the plugin, for questions of one's own.
    pub fn culler(&self) -> &Arc<Culler> {
        &self.culler
    }

    /// The states of its doors.
    pub fn doors(&self) -> &Doors {
        &self.doors
    }

    /// Opens or shuts a portal, both ways.
    ///
    /// # Errors
    ///
    /// Where there is no such portal; nothing is changed then.
    pub fn set_open(&mut self, portal: PortalId, open: bool) -> Result<(), NoSuchPortal> {
        self.check(portal)?;
        self.doors.set_open(portal, open);
        Ok(())
    }

    /// Lets a portal be seen through in one direction, or not.
    ///
    /// # Errors
    ///
    /// Where there is no such portal; nothing is changed then.
    pub fn set_see_through(&mut self, portal: DirectedPortal, see_through: bool) -> Result<(), NoSuchPortal> {
        self.check(portal.portal())?;
        self.doors.set_see_through(portal, see_through);
        Ok(())
    }

    /// Shuts the portals in which the model has a solid leaf that is shut, and opens all others. Returns how many it shut.
    pub fn shut_as_found(&mut self) -> usize {
        self.doors = Doors::as_found(&self.culler);
        self.doors.shut().count()
    }

    /// Shuts the portals that are shut in another bake of the model, by their keys, and opens all others.
    pub(crate) fn take_doors(&mut self, other: &Self) {
        let mut doors = Doors::open(&self.culler);
        for portal in other.doors.shut() {
            if let Some(same) = self.culler.portal(other.culler.portal_key(portal)) {
                (0..2)
                    .for_each(|side| doors.set_see_through(same.directed(side), other.doors.is_open(portal.directed(side))));
            }
        }
        self.doors = doors;
    }

    fn check(&self, portal: PortalId) -> Result<(), NoSuchPortal> {
        let portals = self.culler.portal_count();
        if portal.index() < portals { Ok(()) } else { Err(NoSuchPortal { portal, portals }) }
    }
}
