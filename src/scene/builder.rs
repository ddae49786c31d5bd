//! Where every importer hands in its meshes: numbers checked, degenerate triangles dropped and counted, large meshes split.

use super::cluster::clusters;
use super::{Hints, ImportError, ImportOptions, Object, Role, Scene, Source, triangle_area};
use crate::geom::Aabb;
use glam::DVec3;

/// One mesh primitive in the model's own coordinates: metres, +Y up, `f64`.
#[derive(Clone, Debug)]
pub struct Mesh {
    /// Node name or GlobalId.
    pub node: String,
    /// What it is.
    pub role: Role,
    /// Whether it hides what is behind it.
    pub opaque: bool,
    /// Corners.
    pub positions: Vec<DVec3>,
    /// Indices into `positions`; checked by [`SceneBuilder::add`].
    pub triangles: Vec<[u32; 3]>,
}

/// Collects meshes and hints into a [`Scene`].
#[derive(Debug)]
pub struct SceneBuilder {
    options: ImportOptions,
    meshes: Vec<Mesh>,
    count: usize,
    degenerate: usize,
    /// In the model's own coordinates; moved to the origin by [`SceneBuilder::finish`].
    pub hints: Hints,
    /// Where the scene comes from.
    pub source: Source,
}

impl SceneBuilder {
    /// An empty scene.
    pub fn new(options: &ImportOptions, source: Source) -> Self {
        Self {
            options: options.clone(),
            meshes: Vec::new(),
            count: 0,
            degenerate: 0,
            hints: Hints::default(),
            source,
        }
    }

    /// Adds a mesh. Fails on indices out of range, numbers that aren't finite, and more triangles than the options allow.
    /// Triangles without area are dropped and counted.
    pub fn add(&mut self, mut mesh: Mesh) -> Result<(), ImportError> {
        self.count += mesh.triangles.len();
        if self.count > self.options.max_triangles {
            return Err(ImportError::TooLarge {
                limit: self.options.max_triangles,
            });
        }
        // Beyond 1e12 m, squares and their products leave the range in which a metre means anything.
        if mesh
            .positions
            .iter()
            .any(|p| !p.is_finite() || p.abs().max_element() > 1e12)
        {
            return Err(ImportError::NotFinite { node: mesh.node });
        }
        let n = mesh.positions.len();
        if let Some(bad) = mesh.triangles.iter().flatten().find(|&&i| i as usize >= n) {
            return Err(ImportError::malformed(
                super::Place::File,
                format!("{}: vertex index {bad} of {n} vertices", mesh.node),
            ));
        }
        let before = mesh.triangles.len();
        let positions = &mesh.positions;
        mesh.triangles
            .retain(|t| triangle_area(t.map(|i| positions[i as usize])) > 0.0);
        self.degenerate += before - mesh.triangles.len();
        if !mesh.triangles.is_empty() {
            self.meshes.push(mesh);
        }
        Ok(())
    }

    /// The scene: the origin is the middle of the bounding box, rounded to whole metres.
    pub fn finish(mut self, name: &str) -> Result<Scene, ImportError> {
        let used = |m: &Mesh| {
            Aabb::of(
                m.triangles
                    .iter()
                    .flatten()
                    .map(|&i| m.positions[i as usize]),
            )
        };
        let bounds = self
            .meshes
            .iter()
            .fold(Aabb::EMPTY, |b, m| b.union(used(m)));
        if bounds.is_empty() {
            return Err(ImportError::Empty);
        }
        let origin = bounds.centre().round();
        let (mut positions, mut triangles, mut objects) = (Vec::new(), Vec::new(), Vec::new());
        for mesh in self.meshes {
            for part in clusters(&mesh, self.options.object_triangles) {
                let mut renumbered = std::collections::HashMap::new();
                let start = triangles.len() as u32;
                let mut bounds = Aabb::EMPTY;
                for triangle in part {
                    triangles.push(mesh.triangles[triangle as usize].map(|i| {
                        *renumbered.entry(i).or_insert_with(|| {
                            let p = mesh.positions[i as usize] - origin;
                            bounds = bounds.with(p);
                            positions.push(p);
                            positions.len() as u32 - 1
                        })
                    }));
                }
                let triangles = start..triangles.len() as u32;
                objects.push(Object {
                    node: mesh.node.clone(),
                    role: mesh.role,
                    opaque: mesh.opaque,
                    triangles,
                    bounds,
                });
            }
        }
        if self.degenerate > 0 {
            self.source.notes.push(format!(
                "{} triangles without area dropped",
                self.degenerate
            ));
        }
        let mut hints = self.hints;
        for s in &mut hints.storeys {
            s.elevation -= origin.y;
        }
        for p in hints
            .rooms
            .iter_mut()
            .flat_map(|r| r.surface.iter_mut().flatten())
        {
            *p -= origin;
        }
        for p in hints.openings.iter_mut().flat_map(|o| o.winding.iter_mut()) {
            *p -= origin;
        }
        Ok(Scene {
            name: name.to_owned(),
            source: self.source,
            origin,
            positions,
            triangles,
            objects,
            hints,
        })
    }
}
