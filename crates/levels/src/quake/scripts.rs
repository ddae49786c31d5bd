//! Shader scripts of Quake 3 (`scripts/*.shader`): which shaders are looked through.
//!
//! A script is a list of names, each with directives in braces; braces within these are stages, drawn one over the other. A shader
//! is looked through if its first stage blends, if any stage has holes, if it has no stage (nothing is drawn), or if it moves its
//! vertices. `surfaceparm` also says so, but compilers write that into the level.

use super::game_files::GameFiles;
use std::collections::BTreeMap;

/// Most scripts of a level, and most bytes of all.
const MOST_SCRIPTS: usize = 1 << 10;
const MOST_BYTES: usize = 1 << 26;

/// Whether each shader of the scripts is looked through; by name, in lower case.
#[derive(Default)]
pub(super) struct Scripts(BTreeMap<String, bool>);

impl Scripts {
    /// The scripts beside a level.
    pub fn read(files: &mut GameFiles<'_>) -> Self {
        let mut scripts = Self::default();
        for script in files.read_all("scripts", "shader", MOST_SCRIPTS, MOST_BYTES) {
            scripts.add(&String::from_utf8_lossy(&script));
        }
        scripts
    }

    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether faces with a shader are looked through, as far as a script says.
    pub fn is_see_through(&self, name: &str) -> bool {
        self.0.get(name.strip_prefix("sky ").unwrap_or(name)).is_some_and(|clear| *clear && !name.starts_with("sky "))
    }

    /// Adds the shaders of a script. Of two with one name, one that is looked through counts.
    fn add(&mut self, text: &str) {
        let mut shader = String::new();
        let (mut depth, mut stages, mut is_clear) = (0, 0, false);
        for line in text.lines() {
            let line = line.split("//").next().unwrap_or_default().to_lowercase();
            for part in line.split_inclusive(['{', '}']) {
                let words: Vec<&str> = part.trim_end_matches(['{', '}']).split_whitespace().collect();
                match (depth, &words[..]) {
                    (0, [name, ..]) => (shader, stages, is_clear) = ((*name).to_owned(), 0, false),
                    (1, ["deformvertexes", ..]) | (2.., ["alphafunc", ..]) => is_clear = true,
                    (2.., ["blendfunc", how @ ..]) => is_clear |= stages == 1 && how != ["gl_one", "gl_zero"],
                    _ => {}
                }
                if part.ends_with('{') {
                    depth += 1;
                    stages += usize::from(depth == 2);
                } else if part.ends_with('}') {
                    depth = usize::saturating_sub(depth, 1);
                    if depth == 0 {
                        *self.0.entry(std::mem::take(&mut shader)).or_default() |= is_clear || stages == 0;
                    }
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shaders_are_looked_through_by_their_first_stage_holes_and_moves() {
        let mut scripts = Scripts::default();
        scripts.add(
            "// textures/no\n\
             textures/Base/Wall\n{\n\tqer_editorimage x.tga\n\t{\n\t\tmap $lightmap\n\t}\n\t{ map x.tga\n blendFunc filter }\n}\n\
             textures/base/glass {\n surfaceparm nomarks\n {\n map x.tga\n blendFunc GL_ONE GL_ONE // add\n }\n}\n\
             textures/base/solid {\n {\n map x.tga\n blendfunc gl_one gl_zero\n }\n}\n\
             textures/base/grate\n{\n {\n map $lightmap\n }\n {\n map x.tga\n alphaFunc GE128\n }\n}\n\
             textures/base/flag\n{\n deformVertexes wave 100 sin 0 3 0 .7\n {\n map x.tga\n }\n}\n\
             textures/base/fog\n{\n fogparms ( 1 1 1 ) 300\n}\n\
             textures/base/cut\n{\n {\n map",
        );
        let clear = ["glass", "grate", "flag", "fog", "wall", "solid", "cut", "unknown"]
            .map(|name| scripts.is_see_through(&format!("textures/base/{name}")));
        assert_eq!(clear, [true, true, true, true, false, false, false, false]);
        assert!(!scripts.is_see_through("sky textures/base/fog"));
        Scripts::default().add("}}}{{{\n{ } } a { b");
    }
}
