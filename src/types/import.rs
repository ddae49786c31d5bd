//! How a model is read.

#[cfg(feature = "bake")]
use glam::DVec3;
use std::path::PathBuf;

/// How to import.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
pub struct ImportOptions {
    /// Most triangles an object may have before its mesh is split into clusters; 1 or more. `u32::MAX` keeps objects whole.
    pub object_triangles: u32,
    /// Metres per unit of the source; `None` takes the format's own (glTF and OBJ: 1; IFC: its unit).
    pub metres_per_unit: Option<f64>,
    /// Whether the source's +Z is up, in glTF and OBJ, whose +Y is otherwise. Other formats say themselves what is up.
    pub z_up: bool,
    /// Radius of tubes along lines that have none of their own, metres, above 0; `None`: such lines are left out (OBJ,
    /// glTF), or their file is refused (GeoJSON).
    pub tube_radius: Option<f64>,
    /// Whether pipes are tubes, where there are many. Else they are meshes.
    pub tubes: bool,
    /// Nothing gets out of a map (`.map`) through a hole that is no wider than this, metres, above 0; `None`: than 0.2 of its units, as for
    /// level compilers.
    pub smallest_hole: Option<f64>,
    /// Most triangles a scene may have: a file's word is never taken for more than this.
    pub max_triangles: usize,
    /// Where files that the model names may lie, with all below it; `None`: in the model's own folder.
    #[cfg_attr(feature = "bake", serde(skip))] // a path need not be text; what was read is in the scene
    pub files_under: Option<PathBuf>,
    /// Whether the scene says where its triangles come from ([`Scene::trace`](super::scene::Scene::trace)).
    #[cfg_attr(feature = "bake", serde(skip))] // visibility doesn't depend on it
    pub trace: bool,
}

impl Default for ImportOptions {
    fn default() -> Self {
        Self {
            object_triangles: 256,
            metres_per_unit: None,
            z_up: false,
            tube_radius: None,
            tubes: true,
            smallest_hole: None,
            max_triangles: 50_000_000,
            files_under: None,
            trace: false,
        }
    }
}

#[cfg(feature = "bake")]
impl ImportOptions {
    /// Most triangles of a part of a tube, which is no one's whole: as many as usual where objects stay whole.
    pub(crate) fn triangles_of_tubes(&self) -> u32 {
        if self.object_triangles == u32::MAX { Self::default().object_triangles } else { self.object_triangles }
    }

    /// A point of a source whose +Y is up unless [`Self::z_up`] is set, +Y up.
    pub fn upright(&self, p: DVec3) -> DVec3 {
        if self.z_up { DVec3::new(p.x, p.z, -p.y) } else { p }
    }

    /// What [`Self::upright`] takes to `p`.
    pub fn as_in_source(&self, p: DVec3) -> DVec3 {
        if self.z_up { DVec3::new(p.x, -p.z, p.y) } else { p }
    }

    /// The axis that is up in such a source.
    pub fn up(&self) -> String {
        if self.z_up { "+Z".into() } else { "+Y".into() }
    }
}
