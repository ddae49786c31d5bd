//! The model that a generator builds: meshes, nodes that place them, groups of nodes.

use super::solid::{Solid, turn};
use enfilade::scene::Role;
use glam::{DAffine3, DMat3, DVec3};
use std::collections::BTreeMap;

/// Material of a surface.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(super) enum Material {
    Plaster,
    Concrete,
    Stone,
    Roof,
    Wood,
    Metal,
    Fabric,
    Bronze,
    Leaf,
    Ground,
    Picture,
    Lamp,
    Glass,
}

impl Material {
    /// Its name in the file, and its colour (linear RGB and opacity).
    pub(super) fn look(self) -> (&'static str, [f64; 4]) {
        match self {
            Self::Plaster => ("plaster", [0.84, 0.82, 0.77, 1.0]),
            Self::Concrete => ("concrete", [0.52, 0.51, 0.49, 1.0]),
            Self::Stone => ("stone", [0.68, 0.64, 0.55, 1.0]),
            Self::Roof => ("roof", [0.45, 0.19, 0.12, 1.0]),
            Self::Wood => ("wood", [0.42, 0.26, 0.13, 1.0]),
            Self::Metal => ("metal", [0.23, 0.25, 0.28, 1.0]),
            Self::Fabric => ("fabric", [0.09, 0.17, 0.32, 1.0]),
            Self::Bronze => ("bronze", [0.30, 0.21, 0.09, 1.0]),
            Self::Leaf => ("leaf", [0.33, 0.12, 0.06, 1.0]),
            Self::Ground => ("ground", [0.19, 0.28, 0.11, 1.0]),
            Self::Picture => ("picture", [0.55, 0.12, 0.10, 1.0]),
            Self::Lamp => ("lamp", [0.95, 0.93, 0.86, 1.0]),
            Self::Glass => ("glass", [0.62, 0.78, 0.80, 0.25]),
        }
    }
}

/// Placement of a node's mesh: rotated about the y axis, then moved.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(super) struct Placement {
    /// Metres.
    pub(super) at: DVec3,
    /// Anticlockwise seen from above, in turns; 1/4 rotates +x to -z.
    pub(super) turns: f64,
}

impl From<Placement> for DAffine3 {
    fn from(Placement { at, turns }: Placement) -> Self {
        let (c, s) = turn(turns);
        Self::from_mat3_translation(DMat3::from_cols_array(&[c, 0.0, -s, 0.0, 1.0, 0.0, s, 0.0, c]), at)
    }
}

/// A line with a radius.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Pipe {
    /// Metres.
    pub(super) radius: f64,
    /// Whether the curve passes smoothly through the points.
    pub(super) smooth: bool,
    /// Metres.
    pub(super) points: Vec<DVec3>,
}

/// A placed mesh.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Node {
    pub(super) name: String,
    pub(super) role: Role,
    /// Index into [`Model::meshes`].
    pub(super) mesh: usize,
    /// `None`: the mesh is in the model's own coordinates.
    pub(super) placement: Option<DAffine3>,
    /// Index into [`Model::groups`]; `None`: a root.
    pub(super) group: Option<usize>,
}

/// A node without a mesh, in the model's own coordinates.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct Group {
    pub(super) name: String,
    /// The parent group; `None`: a root.
    pub(super) parent: Option<usize>,
}

/// Meshes, nodes and groups.
#[derive(Clone, PartialEq, Debug, Default)]
pub(super) struct Model {
    pub(super) meshes: Vec<(Solid, Material)>,
    pub(super) nodes: Vec<Node>,
    pub(super) groups: Vec<Group>,
    /// Pipes by mesh. A mesh without triangles is only a pipe.
    pub(super) pipes: BTreeMap<usize, Pipe>,
    /// The parent of new nodes and groups.
    open: Option<usize>,
    shared: BTreeMap<String, usize>,
}

impl Model {
    /// Adds a mesh in the model's own coordinates, with its node.
    pub(super) fn add(&mut self, name: impl Into<String>, role: Role, material: Material, solid: Solid) {
        self.meshes.push((solid, material));
        self.nodes.push(Node { name: name.into(), role, mesh: self.meshes.len() - 1, placement: None, group: self.open });
    }

    /// Places a mesh that nodes share under `key`; `make` builds it for the first of them.
    pub(super) fn place(
        &mut self,
        name: impl Into<String>,
        role: Role,
        placement: impl Into<DAffine3>,
        key: &str,
        material: Material,
        make: impl FnOnce() -> Solid,
    ) {
        let mesh = match self.shared.get(key) {
            Some(&mesh) => mesh,
            None => {
                self.meshes.push((make(), material));
                self.shared.insert(key.to_owned(), self.meshes.len() - 1);
                self.meshes.len() - 1
            }
        };
        self.nodes.push(Node { name: name.into(), role, mesh, placement: Some(placement.into()), group: self.open });
    }

    /// Marks the last node's mesh as a pipe.
    pub(super) fn last_is_pipe(&mut self, pipe: Pipe) {
        if let Some(node) = self.nodes.last() {
            self.pipes.entry(node.mesh).or_insert(pipe);
        }
    }

    /// Places a line with a radius.
    pub(super) fn pipe(&mut self, name: impl Into<String>, at: DVec3, material: Material, pipe: Pipe) {
        self.pipes.insert(self.meshes.len(), pipe);
        self.meshes.push((Solid::default(), material));
        let (mesh, placement) = (self.meshes.len() - 1, Some(Placement { at, turns: 0.0 }.into()));
        self.nodes.push(Node { name: name.into(), role: Role::Furnishing, mesh, placement, group: self.open });
    }

    /// Opens a group inside the open one; later nodes go there.
    pub(super) fn enter(&mut self, name: impl Into<String>) {
        self.groups.push(Group { name: name.into(), parent: self.open });
        self.open = Some(self.groups.len() - 1);
    }

    /// Closes the open group.
    pub(super) fn leave(&mut self) {
        self.open = self.open.and_then(|group| self.groups[group].parent);
    }

    /// Number of drawn triangles: a mesh counts once per node.
    pub(super) fn triangles(&self) -> usize {
        self.nodes.iter().map(|n| self.meshes[n.mesh].0.triangles.len()).sum()
    }
}
