//! Options of imports.

#[cfg(feature = "bake")]
use glam::DVec3;
use std::path::PathBuf;

/// Options of an import.
#[derive(Clone, PartialEq, Debug)]
#[cfg_attr(feature = "bake", derive(serde::Serialize))]
pub struct ImportOptions {
    /// Most triangles of an object before its mesh is split into clusters; 1 or more. `u32::MAX` keeps objects whole.
    pub object_triangles: u32,
    /// Metres per unit of the source; `None`: the format's own (glTF and OBJ: 1; IFC: its unit).
    pub metres_per_unit: Option<f64>,
    /// Whether the source's +Z is up, in glTF and OBJ, whose default is +Y. Other formats define their up axis.
    pub z_up: bool,
    /// Radius of tubes along lines without a radius, metres, above 0; `None`: such lines are left out (OBJ, glTF), or their file is
    /// rejected (GeoJSON).
    pub tube_radius: Option<f64>,
    /// Whether pipes become tubes, if there are many; otherwise they are meshes.
    pub tubes: bool,
    /// Holes of a map (`.map`) up to this width count as closed, metres, above 0; `None`: 0.2 of its units, as in level compilers.
    pub smallest_hole: Option<f64>,
    /// Most triangles of a scene, whatever a file states.
    pub max_triangles: usize,
    /// Folder of sidecar files, including subfolders; `None`: the model's own folder.
    #[cfg_attr(feature = "bake", serde(skip))] // a path need not be text; the scene has the content
    pub files_under: Option<PathBuf>,
    /// Whether the scene records the origin of its triangles ([`Scene::trace`](super::scene::Scene::trace)).
    #[cfg_attr(feature = "bake", serde(skip))] // visibility does not depend on it
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
    /// Most triangles of a part of a tube: the default if objects stay whole.
    pub(crate) fn triangles_of_tubes(&self) -> u32 {
        if self.object_triangles == u32::MAX { Self::default().object_triangles } else { self.object_triangles }
    }

    /// Converts a point of a source with this up axis ([`Self::z_up`]) to +Y up.
    pub fn upright(&self, p: DVec3) -> DVec3 {
        if self.z_up { DVec3::new(p.x, p.z, -p.y) } else { p }
    }

    /// The inverse of [`Self::upright`].
    pub fn as_in_source(&self, p: DVec3) -> DVec3 {
        if self.z_up { DVec3::new(p.x, -p.z, p.y) } else { p }
    }

    /// The up axis of such a source.
    pub fn up(&self) -> String {
        if self.z_up { "+Z".into() } else { "+Y".into() }
    }
}
