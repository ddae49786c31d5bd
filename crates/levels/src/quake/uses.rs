//! What faces with a texture are used for, by its name, its flags and its shader.

use super::scripts::Scripts;
use super::textures::{is_see_through, is_undrawn};
use crate::bsp::faces::Faces;
use crate::bsp::layout::Flags;

/// How a face is used.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Use {
    /// Drawn, and hides what is behind it.
    Opaque,
    SeeThrough,
    /// Never drawn.
    Undrawn,
}

/// Folders of textures for tools in Source and Quake 3. Those that are drawn at all are mostly see-through.
const TOOLS: [&str; 2] = ["tools/", "textures/common/"];
/// Those that are opaque.
const OPAQUE_TOOLS: [&str; 2] = ["tools/toolsblack", "tools/toolsblack_noportal"];

/// By texture info.
pub(super) fn uses(faces: &Faces, of: Flags, scripts: &Scripts) -> Vec<Use> {
    let infos = &faces.infos;
    let use_of = |(name, &flags): (&String, &i64)| {
        let is_tool = TOOLS.iter().any(|folder| name.starts_with(folder)) && !OPAQUE_TOOLS.contains(&name.as_str());
        if is_undrawn(name) || flags & of.undrawn != 0 {
            Use::Undrawn
        } else if is_see_through(name) || is_tool || flags & of.see_through != 0 || scripts.is_see_through(name) {
            Use::SeeThrough
        } else {
            Use::Opaque
        }
    };
    infos.names.iter().zip(&infos.flags).map(use_of).collect()
}
