//! The table of supported formats, used by the import, errors, help texts, the file dialog and the search beside a `.pvs`.
//!
//! A new format is a module with an `import`, a line here, and a line in docs/cli.md.

use crate::elements::Elements;
use crate::{geojson, gltf, indoorgml, obj, ply, stl};
use enfilade::scene::{ImportError, ImportOptions, Scene};
use std::path::Path;

/// Reader of a model.
type Read = fn(&Path, &ImportOptions) -> Result<Scene, ImportError>;
/// Reader of a model's elements.
type ReadElements = fn(&Path) -> Result<Elements, ImportError>;

/// A format of models.
pub struct Format {
    /// Its name.
    pub name: &'static str,
    /// Lower-case extensions of its files.
    pub extensions: &'static [&'static str],
    /// The cargo feature that reads it, if one is needed.
    pub feature: Option<&'static str>,
    /// Whether the format has no up axis.
    pub is_up_open: bool,
    /// `None` if this build lacks the feature.
    pub(crate) read: Option<Read>,
    pub(crate) read_elements: Option<ReadElements>,
}

impl Format {
    const fn new(name: &'static str, extensions: &'static [&'static str], read: Option<Read>) -> Self {
        Self { name, extensions, feature: None, is_up_open: false, read, read_elements: None }
    }

    const fn with_open_up(self) -> Self {
        Self { is_up_open: true, ..self }
    }

    const fn needs(self, feature: &'static str) -> Self {
        Self { feature: Some(feature), ..self }
    }

    /// Whether this build reads it.
    pub fn is_built(&self) -> bool {
        self.read.is_some()
    }
}

#[cfg(feature = "ifc")]
const IFC: Format = {
    let format = Format::new("IFC", &["ifc", "ifczip"], Some(crate::ifc::import));
    Format { read_elements: Some(crate::ifc::elements), ..format }
};
#[cfg(not(feature = "ifc"))]
const IFC: Format = Format::new("IFC", &["ifc", "ifczip"], None);

/// All formats; those that need a feature come last.
pub const FORMATS: [Format; 9] = [
    Format::new("glTF", &["glb", "gltf"], Some(gltf::import)).with_open_up(),
    Format::new("OBJ", &["obj"], Some(obj::import)).with_open_up(),
    Format::new("PLY", &["ply"], Some(ply::import)).with_open_up(),
    Format::new("STL", &["stl"], Some(stl::import)).with_open_up(),
    Format::new("IndoorGML", &["gml"], Some(indoorgml::import)),
    Format::new("GeoJSON", &["geojson"], Some(geojson::import)),
    Format::new("Quake level", &["bsp"], Some(enfilade_levels::quake::import)),
    Format::new("Quake map", &["map"], Some(enfilade_levels::quake::import_map)),
    IFC.needs("ifc"),
];

/// The format by a file's extension.
pub fn format_of(path: &Path) -> Option<&'static Format> {
    static ALL: [Format; FORMATS.len()] = FORMATS;
    let extension = path.extension()?.to_str()?.to_ascii_lowercase();
    ALL.iter().find(|format| format.extensions.contains(&extension.as_str()))
}

/// The lower-case extensions that this build reads.
pub fn extensions() -> impl Iterator<Item = &'static str> {
    FORMATS.into_iter().filter(Format::is_built).flat_map(|format| format.extensions.iter().copied())
}

/// All extensions, including those of missing features: `.glb, .gltf, ... or .map`.
pub fn all_extensions() -> String {
    let all: Vec<String> = FORMATS.iter().flat_map(|format| format.extensions).map(|e| format!(".{e}")).collect();
    let (last, others) = all.split_last().expect("there are formats");
    format!("{} or {last}", others.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn no_extension_stands_for_two_formats() {
        let all: Vec<&str> = FORMATS.iter().flat_map(|format| format.extensions.iter().copied()).collect();
        assert_eq!(all.iter().collect::<BTreeSet<_>>().len(), all.len());
        assert!(all.iter().all(|e| *e == e.to_ascii_lowercase()));
    }

    #[test]
    fn a_build_without_the_feature_says_which_one_reads_a_file() {
        for format in FORMATS.iter().filter(|format| !format.is_built()) {
            let file = format!("x.{}", format.extensions[0].to_uppercase());
            let error = crate::import(Path::new(&file), &ImportOptions::default()).unwrap_err();
            let (name, feature) = (format.name, format.feature.unwrap());
            assert_eq!(error.to_string(), format!("this binary reads no {name}; build it with `--features {feature}`"));
        }
        let error = crate::import(Path::new("x.doc"), &ImportOptions::default()).unwrap_err().to_string();
        assert!(error.starts_with("no importer for \".doc\"; give .glb, ") && error.ends_with(" or .ifczip"), "{error}");
    }
}
