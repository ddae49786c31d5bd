//! Materials, as far as their opacity and their colour go.

use serde::Deserialize;
use serde::de::IgnoredAny;

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub(in super::super) struct Material {
    /// A string in valid documents.
    name: Option<serde_json::Value>,
    pub alpha_mode: Option<String>,
    /// Includes the base colour.
    pbr_metallic_roughness: Option<serde_json::Value>,
    #[serde(default)]
    pub extensions: MaterialExtensions,
}

#[derive(Deserialize, Default)]
pub struct MaterialExtensions {
    #[serde(rename = "KHR_materials_transmission")]
    pub transmission: Option<Transmission>,
    #[serde(rename = "KHR_materials_unlit")]
    unlit: Option<IgnoredAny>,
    /// Has its own base colour.
    #[serde(rename = "KHR_materials_pbrSpecularGlossiness")]
    older: Option<IgnoredAny>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Transmission {
    #[serde(default)]
    pub transmission_factor: f64,
}

impl Material {
    /// Its name; empty where it has none.
    pub fn name(&self) -> &str {
        self.name.as_ref().and_then(|name| name.as_str()).unwrap_or_default()
    }

    /// Whether it has a picture of its colour.
    pub fn has_picture(&self) -> bool {
        self.pbr_metallic_roughness.as_ref().is_some_and(|base| !base["baseColorTexture"].is_null())
    }

    /// Whether no light changes it.
    pub fn is_unlit(&self) -> bool {
        self.extensions.unlit.is_some()
    }

    /// Whether it blends or is masked.
    pub fn has_alpha_mode(&self) -> bool {
        self.alpha_mode.as_deref().is_some_and(|mode| mode != "OPAQUE")
    }

    /// Whether it lets light through whatever its alpha is.
    pub fn transmits(&self) -> bool {
        self.extensions.transmission.as_ref().is_some_and(|t| t.transmission_factor > 0.0)
    }

    /// The object with its base colour; `None` if an extension replaces it.
    pub fn base(&self) -> Option<&serde_json::Value> {
        static NOTHING: serde_json::Value = serde_json::Value::Null;
        self.extensions.older.is_none().then(|| self.pbr_metallic_roughness.as_ref().unwrap_or(&NOTHING))
    }
}
