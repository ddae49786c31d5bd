//! Finds meshes that engines do not draw, by name, material, extras and extensions: colliders, triggers, navigation meshes.
//!
//! Engines and exporters have different conventions; each row of the table is one. A matching mesh hides nothing and bounds no
//! room, but stays an object: an engine that draws it anyway loses no pixel. A role set by hand overrides the table.

use enfilade::scene::naming::words;
use enfilade::types::note::Note;
use serde_json::Value;

/// The place and the text that a row matches. All texts are lower case.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Sign {
    /// A word anywhere in the name, or two words in a row.
    Word(&'static str),
    /// The name begins with it and an underscore.
    Prefix(&'static str),
    /// The name ends with it, after `-`, `_`, `$` or a dot; trailing numbers are ignored.
    Suffix(&'static str),
    /// As [`Sign::Prefix`] and [`Sign::Suffix`], but some programs draw such a mesh. It is a helper if it has no material, or if
    /// a mesh has the rest of its name.
    MaybePrefix(&'static str),
    MaybeSuffix(&'static str),
    /// The material's name, or its part after the last slash.
    Material(&'static str),
    /// The same, if the name has a slash.
    MaterialPath(&'static str),
    /// A key of extras or extensions whose value is true.
    True(&'static str),
    /// A key whose value is false.
    False(&'static str),
    /// A key.
    Key(&'static str),
    /// A key and its value, or one of its values.
    Value(&'static str, &'static str),
}

/// A convention for meshes that are not drawn. docs/undrawn.md lists all rows.
#[cfg_attr(not(test), allow(dead_code))]
struct Row {
    sign: Sign,
    /// Programs that write it.
    by: &'static str,
    /// Its meaning.
    means: &'static str,
    /// The document that defines it.
    source: &'static str,
}

const GODOT: &str = "docs.godotengine.org: Node type customization using name suffixes";
const UNREAL: &str = "dev.epicgames.com: FBX Static Mesh Pipeline, Collision";
const DATASMITH: &str = "dev.epicgames.com: Datasmith, collision meshes and metadata";
const DECENTRALAND: &str = "adr.decentraland.org: ADR-215";
const UNITY: &str = "docs.unity3d.com: GameObject, tags (EditorOnly), Renderer.enabled";
const O3DE: &str = "docs.o3de.org: Scene settings, soft naming conventions";
const OMI: &str = "github.com/omigroup/gltf-extensions";
const KHRONOS: &str = "github.com/KhronosGroup/glTF: KHR_node_visibility, KHR_physics_rigid_bodies";
const USD: &str = "openusd.org: UsdGeomImageable, purpose and visibility";
const HUBS: &str = "github.com/MozillaReality/hubs-blender-exporter";
const SOURCE: &str = "developer.valvesoftware.com: Tool textures";
const QUAKE: &str = "ericw-tools: qbsp, special textures";
const COMMON: &str = "common practice";

const fn row(sign: Sign, by: &'static str, means: &'static str, source: &'static str) -> Row {
    Row { sign, by, means, source }
}

#[rustfmt::skip]
const TABLE: &[Row] = &[
    row(Sign::Word("collider"), "Decentraland, Unity", "collider", DECENTRALAND),
    row(Sign::Word("colliders"), "Decentraland, Unity", "collider", DECENTRALAND),
    row(Sign::Word("collision"), "many", "collider", COMMON),
    row(Sign::Word("collisions"), "many", "collider", COMMON),
    row(Sign::Word("hitbox"), "many", "collider", COMMON),
    row(Sign::Word("trigger"), "many", "trigger", COMMON),
    row(Sign::Word("triggers"), "many", "trigger", COMMON),
    row(Sign::Word("occluder"), "Unreal, Unity", "occluder", COMMON),
    row(Sign::Word("colonly"), "Godot", "collider", GODOT),
    row(Sign::Word("convcolonly"), "Godot", "collider", GODOT),
    row(Sign::Word("occonly"), "Godot", "occluder", GODOT),
    row(Sign::Word("navmesh"), "Godot, Hubs", "navigation mesh", GODOT),
    row(Sign::Suffix("noimp"), "Godot", "left out of the import", GODOT),
    row(Sign::MaybeSuffix("col"), "Godot", "collider, drawn by Godot alone", GODOT),
    row(Sign::MaybeSuffix("convcol"), "Godot", "collider, drawn by Godot alone", GODOT),
    row(Sign::MaybeSuffix("occ"), "Godot", "occluder, drawn by Godot alone", GODOT),
    row(Sign::Prefix("ucx"), "Unreal", "collider", UNREAL),
    row(Sign::Prefix("ubx"), "Unreal", "collider", UNREAL),
    row(Sign::Prefix("usp"), "Unreal", "collider", UNREAL),
    row(Sign::Prefix("ucp"), "Unreal", "collider", UNREAL),
    row(Sign::Prefix("mcdcx"), "Unreal", "collider", UNREAL),
    row(Sign::Suffix("ucx"), "Datasmith", "collider", DATASMITH),
    row(Sign::Suffix("ubx"), "Datasmith", "collider", DATASMITH),
    row(Sign::MaybePrefix("col"), "Unity, Blender", "collider", COMMON),
    row(Sign::Suffix("phys"), "O3DE, Second Life", "collider", O3DE),
    row(Sign::Suffix("physics"), "O3DE", "collider", O3DE),
    row(Sign::Word("physproxy"), "CryEngine, O3DE", "collider", O3DE),
    row(Sign::Word("physicsproxy"), "CryEngine, O3DE", "collider", O3DE),
    row(Sign::Word("nodraw"), "Source, Quake", "not drawn", SOURCE),
    row(Sign::Word("playerclip"), "Source, Quake", "collider", SOURCE),
    row(Sign::Material("nodraw"), "Source, Quake", "not drawn", SOURCE),
    row(Sign::Material("toolsnodraw"), "Source", "not drawn", SOURCE),
    row(Sign::Material("toolsclip"), "Source", "collider", SOURCE),
    row(Sign::Material("playerclip"), "Source, Quake", "collider", SOURCE),
    row(Sign::Material("toolsplayerclip"), "Source", "collider", SOURCE),
    row(Sign::Material("toolstrigger"), "Source", "trigger", SOURCE),
    row(Sign::Material("toolsinvisible"), "Source", "collider", SOURCE),
    row(Sign::Material("toolsareaportal"), "Source", "portal of the engine's", SOURCE),
    row(Sign::Material("toolsoccluder"), "Source", "occluder", SOURCE),
    row(Sign::Material("invisible"), "many", "not drawn", COMMON),
    row(Sign::Material("collision"), "many", "collider", COMMON),
    row(Sign::Material("collider"), "many", "collider", COMMON),
    row(Sign::MaterialPath("clip"), "Quake", "collider", QUAKE),
    row(Sign::MaterialPath("skip"), "Quake", "not drawn", QUAKE),
    row(Sign::MaterialPath("hint"), "Quake", "not drawn", QUAKE),
    row(Sign::MaterialPath("hintskip"), "Quake", "not drawn", QUAKE),
    row(Sign::MaterialPath("caulk"), "Quake 3", "not drawn", QUAKE),
    row(Sign::MaterialPath("origin"), "Quake", "not drawn", QUAKE),
    row(Sign::MaterialPath("trigger"), "Quake", "trigger", QUAKE),
    row(Sign::False("visible"), "KHR_node_visibility, Hubs, three.js", "hidden", KHRONOS),
    row(Sign::False("isvisible"), "Blender, many", "hidden", COMMON),
    row(Sign::False("visibility"), "Blender, USD", "hidden", USD),
    row(Sign::Value("visibility", "invisible"), "USD, Omniverse", "hidden", USD),
    row(Sign::Value("visibility", "hidden"), "many", "hidden", COMMON),
    row(Sign::False("renderable"), "Maya, many", "hidden", COMMON),
    row(Sign::False("rendered"), "many", "hidden", COMMON),
    row(Sign::False("rendererenabled"), "Unity", "hidden", UNITY),
    row(Sign::False("activeself"), "Unity, Needle", "hidden", UNITY),
    row(Sign::False("isactive"), "Unity", "hidden", UNITY),
    row(Sign::True("hidden"), "Unreal, many", "hidden", DATASMITH),
    row(Sign::True("hideingame"), "Unreal", "hidden", DATASMITH),
    row(Sign::True("hiddeningame"), "Unreal, Datasmith", "hidden", DATASMITH),
    row(Sign::True("actorhiddeningame"), "Unreal, Datasmith", "hidden", DATASMITH),
    row(Sign::True("iscollision"), "Datasmith", "collider", DATASMITH),
    row(Sign::True("iscollisionmesh"), "Datasmith", "collider", DATASMITH),
    row(Sign::True("invisible"), "many", "hidden", COMMON),
    row(Sign::True("nodraw"), "many", "hidden", COMMON),
    row(Sign::True("hiderender"), "Blender", "hidden", COMMON),
    row(Sign::True("editoronly"), "Unity", "not in the game", UNITY),
    row(Sign::Value("tag", "editoronly"), "Unity", "not in the game", UNITY),
    row(Sign::Value("tags", "editoronly"), "Unity, Datasmith", "not in the game", UNITY),
    row(Sign::True("iscollider"), "many", "collider", COMMON),
    row(Sign::True("collideronly"), "many", "collider", COMMON),
    row(Sign::True("collisiononly"), "many", "collider", COMMON),
    row(Sign::True("colonly"), "Godot", "collider", GODOT),
    row(Sign::True("istrigger"), "Unity, OMI", "trigger", OMI),
    row(Sign::True("collider"), "many", "collider", COMMON),
    row(Sign::True("collision"), "many", "collider", COMMON),
    row(Sign::True("trigger"), "many", "trigger", COMMON),
    row(Sign::True("navmesh"), "many", "navigation mesh", COMMON),
    row(Sign::Key("navmesh"), "Hubs (nav-mesh)", "navigation mesh", HUBS),
    row(Sign::Key("triggervolume"), "Hubs (trigger-volume)", "trigger", HUBS),
    row(Sign::Value("purpose", "guide"), "USD, Omniverse", "guide", USD),
    row(Sign::Value("purpose", "proxy"), "USD, Omniverse", "stand-in", USD),
    row(Sign::Value("layer", "collision"), "Unity, many", "collider", UNITY),
    row(Sign::Value("layer", "collider"), "Unity, many", "collider", UNITY),
    row(Sign::Value("layer", "trigger"), "Unity, many", "trigger", UNITY),
    row(Sign::Value("type", "collider"), "many", "collider", COMMON),
    row(Sign::Value("type", "collision"), "many", "collider", COMMON),
    row(Sign::Value("type", "collisionshape3d"), "Godot", "collider", GODOT),
    row(Sign::Value("type", "area3d"), "Godot", "trigger", GODOT),
    row(Sign::Value("type", "navigationregion3d"), "Godot", "navigation mesh", GODOT),
    row(Sign::Value("type", "occluderinstance3d"), "Godot", "occluder", GODOT),
    row(Sign::Value("type", "trigger"), "OMI_physics_body, many", "trigger", OMI),
    row(Sign::Value("type", "navmesh"), "many", "navigation mesh", COMMON),
    row(Sign::Key("trigger"), "KHR_physics_rigid_bodies, OMI_physics_body", "trigger", KHRONOS),
    row(Sign::Key("omicollider"), "OMI_collider, Godot", "collider", OMI),
    row(Sign::Key("omiphysicsshape"), "OMI_physics_shape, Godot", "collider", OMI),
];

/// Keys for the kind of a node.
const KINDS: [&str; 6] = ["type", "kind", "role", "class", "nodetype", "objecttype"];
/// Extras of tools are at most this deep; deeper ones are data.
const DEEPEST: usize = 4;

/// Names by which an engine may recognise a mesh.
#[derive(Clone, Copy, Default)]
pub(super) struct Mesh<'a> {
    pub name: &'a str,
    pub material: Option<&'a str>,
    /// Whether a mesh has this lower-case name.
    pub has_name: Option<&'a dyn Fn(&str) -> bool>,
}

/// Whether a name or a material marks the mesh as not drawn.
pub(super) fn is_helper(mesh: Mesh<'_>) -> bool {
    let name = mesh.name.to_lowercase();
    let stem = without_number(&name);
    let words = words(mesh.name);
    let pairs: Vec<String> = words.windows(2).map(|w| w.concat()).collect();
    let material = mesh.material.unwrap_or_default().to_lowercase();
    let (path, last) = material.rsplit_once(['/', '\\']).map_or(("", material.as_str()), |(path, last)| (path, last));
    let prefixed = |prefix: &str| name.strip_prefix(prefix).and_then(|rest| rest.strip_prefix('_'));
    let suffixed = |suffix: &str| {
        stem.strip_suffix(suffix).filter(|rest| rest.ends_with(['-', '_', '$', '.'])).map(|r| &r[..r.len() - 1])
    };
    let maybe =
        |rest: Option<&str>| rest.is_some_and(|rest| mesh.material.is_none() || mesh.has_name.is_some_and(|has| has(rest)));
    TABLE.iter().any(|row| match row.sign {
        Sign::Word(word) => words.iter().chain(&pairs).any(|w| w == word),
        Sign::Prefix(prefix) => prefixed(prefix).is_some(),
        Sign::Suffix(suffix) => suffixed(suffix).is_some(),
        Sign::MaybePrefix(prefix) => maybe(prefixed(prefix)),
        Sign::MaybeSuffix(suffix) => maybe(suffixed(suffix)),
        Sign::Material(material) => last == material,
        Sign::MaterialPath(material) => !path.is_empty() && last == material,
        Sign::True(_) | Sign::False(_) | Sign::Key(_) | Sign::Value(..) => false,
    })
}

/// Whether extras or extensions mark their owner as not drawn.
pub(super) fn is_hidden(value: &Value) -> bool {
    says_hidden(value, DEEPEST)
}

fn says_hidden(value: &Value, depth: usize) -> bool {
    let Value::Object(entries) = value else { return false };
    entries.iter().any(|(key, value)| {
        let key = squeezed(key);
        let key = if KINDS.contains(&key.as_str()) { "type" } else { key.as_str() };
        let fits = |row: &Row| match row.sign {
            Sign::True(wanted) => key == wanted && truth(value) == Some(true),
            Sign::False(wanted) => key == wanted && truth(value) == Some(false),
            Sign::Key(wanted) => key == wanted && truth(value) != Some(false) && !value.is_null(),
            Sign::Value(wanted, text) => key == wanted && has_text(value, text),
            _ => false,
        };
        TABLE.iter().any(fits) || depth > 0 && says_hidden(value, depth - 1)
    })
}

/// Lower-case letters and digits of a text, without the `b` of Unreal's booleans.
fn squeezed(text: &str) -> String {
    let mut chars = text.chars();
    let text = match (chars.next(), chars.next()) {
        (Some('b'), Some(second)) if second.is_uppercase() => &text[1..],
        _ => text,
    };
    text.chars().filter(|c| c.is_alphanumeric()).flat_map(char::to_lowercase).collect()
}

/// The value as a boolean, if it can be one.
fn truth(value: &Value) -> Option<bool> {
    match value {
        Value::Bool(truth) => Some(*truth),
        Value::Number(n) => n.as_f64().filter(|x| [0.0, 1.0].contains(x)).map(|x| x == 1.0),
        Value::String(text) => match text.to_ascii_lowercase().as_str() {
            "true" | "yes" | "1" => Some(true),
            "false" | "no" | "0" | "none" => Some(false),
            _ => None,
        },
        _ => None,
    }
}

fn has_text(value: &Value, wanted: &str) -> bool {
    match value {
        Value::String(text) => squeezed(text) == wanted,
        Value::Array(values) => values.iter().any(|value| has_text(value, wanted)),
        _ => false,
    }
}

/// A name without the number that makes it unique: `a.001`, `a_2`, `a3`.
fn without_number(name: &str) -> &str {
    name.trim_end_matches(|c: char| c.is_ascii_digit()).trim_end_matches(['.', '_', '-', ' '])
}

/// Meshes of a model that engines do not draw.
#[derive(Clone, Debug, Default)]
pub(super) struct Helpers {
    count: usize,
    first: Vec<String>,
}

impl Helpers {
    /// Maximum names in a note.
    const NAMED: usize = 3;

    pub fn count(&mut self, name: &str) {
        self.count += 1;
        if self.first.len() < Self::NAMED && !self.first.iter().any(|first| first == name) {
            self.first.push(name.to_owned());
        }
    }

    /// Note for the report, if there are any.
    pub fn note(&self) -> Option<Note> {
        let Self { count, first } = self;
        let and_more = if *count > first.len() { ", ..." } else { "" };
        let these = if *count == 1 { "1 mesh is".to_owned() } else { format!("{count} meshes are") };
        (*count > 0).then(|| {
            Note::taken(format!(
                "{these} not drawn by engines, by name or extras ({}{and_more}). They hide nothing and bound no room; if one is a wall, \
                 give it the role structure in MODEL.roles.json",
                first.join(", ")
            ))
        })
    }
}

/// The table as lines of Markdown, for docs/undrawn.md.
#[cfg(test)]
fn table() -> String {
    let sign = |sign: Sign| match sign {
        Sign::Word(word) => ("name has the word ", format!("`{word}`")),
        Sign::Prefix(prefix) => ("name begins with ", format!("`{prefix}_`")),
        Sign::Suffix(suffix) => ("name ends with ", format!("`-{suffix}`, `_{suffix}` or `${suffix}`")),
        Sign::MaybePrefix(prefix) => ("name begins with ", format!("`{prefix}_` (*)")),
        Sign::MaybeSuffix(suffix) => ("name ends with ", format!("`-{suffix}`, `_{suffix}` or `${suffix}` (*)")),
        Sign::Material(material) => ("material ", format!("`{material}`")),
        Sign::MaterialPath(material) => ("material ", format!("`.../{material}`")),
        Sign::True(key) => ("", format!("`{key}`: true")),
        Sign::False(key) => ("", format!("`{key}`: false")),
        Sign::Key(key) => ("", format!("`{key}`")),
        Sign::Value(key, value) => ("", format!("`{key}`: `{value}`")),
    };
    let mut groups: Vec<(&str, &Row, Vec<String>)> = Vec::new();
    for row in TABLE {
        let (lead, sign) = sign(row.sign);
        let of = |row: &Row| (row.by, row.means, row.source);
        match groups.iter_mut().find(|(other, first, _)| *other == lead && of(first) == of(row)) {
            Some((.., signs)) => signs.push(sign),
            None => groups.push((lead, row, vec![sign])),
        }
    }
    let line = |(lead, Row { by, means, source, .. }, signs): &(&str, &Row, Vec<String>)| {
        format!("| {lead}{} | {by} | {means} | {source} |\n", signs.join(", "))
    };
    let rows: String = groups.iter().map(line).collect();
    format!("| sign | written by | meaning | source |\n| --- | --- | --- | --- |\n{rows}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    #[test]
    fn names_of_many_programs_are_helpers() {
        let is = |name: &str, material: Option<&str>| is_helper(Mesh { name, material, has_name: None });
        for name in [
            "doorway0_collider",
            "Doorway_Collider.001",
            "blocker0-colonly",
            "x-convcolonly",
            "x$colonly",
            "floor-navmesh",
            "NavMesh_2",
            "UCX_Wall_01",
            "ucx_wall",
            "UBX_Wall",
            "USP_Ball",
            "UCP_Pill",
            "MCDCX_Rock",
            "Wall_UCX",
            "COL_Wall",
            "wall-col",
            "wall_col.003",
            "wall-convcol",
            "wall-occ",
            "TriggerVolume3",
            "door trigger",
            "wall_phys",
            "$physics_proxy",
            "BoxCollider",
            "x_collision_mesh",
            "wall-noimp",
            "OccluderMesh",
        ] {
            assert!(is(name, None), "{name}");
        }
        for name in [
            "wall",
            "column_3",
            "protocol",
            "colonnade",
            "collie",
            "colour",
            "physics book",
            "occasional table",
            "UCXWall",
            "scolder",
        ] {
            assert!(!is(name, None), "{name}");
        }
        // Godot draws a mesh ending with -col: with a material it is a wall, unless there is also a mesh of the wall.
        assert!(!is("wall-col", Some("bricks")) && is("wall_collider", Some("bricks")));
        let has = |name: &str| name == "wall";
        assert!(is_helper(Mesh { name: "Wall-col", material: Some("bricks"), has_name: Some(&has) }));
        assert!(!is_helper(Mesh { name: "COL_12", material: Some("concrete"), has_name: Some(&has) }), "a column");
        for material in ["tools/toolsnodraw", "special/clip", "common/caulk", "invisible", "TOOLS\\TOOLSTRIGGER"] {
            assert!(is("brush", Some(material)), "{material}");
        }
        assert!(!is("brush", Some("clip")) && !is("brush", Some("brick/wall")));
    }

    #[test]
    fn the_page_has_the_table() {
        let page = include_str!("../../../docs/undrawn.md");
        assert!(page.contains(&table()), "docs/undrawn.md should have:\n{}", table());
    }

    #[test]
    fn extras_and_extensions_of_many_programs_hide() {
        for value in [
            json!({"visible": false}),
            json!({"KHR_node_visibility": {"visible": false}}),
            json!({"userData": {"isCollider": true}}),
            json!({"bHidden": 1}),
            json!({"bHiddenInGame": "True"}),
            json!({"tag": "EditorOnly"}),
            json!({"unity": {"tags": ["Untagged", "EditorOnly"]}}),
            json!({"purpose": "guide"}),
            json!({"KHR_physics_rigid_bodies": {"trigger": {"geometry": {"shape": 0}}}}),
            json!({"OMI_physics_body": {"type": "trigger"}}),
            json!({"MOZ_hubs_components": {"nav-mesh": {}}}),
            json!({"MOZ_hubs_components": {"visible": {"visible": false}}}),
            json!({"NEEDLE_gameobject_data": {"activeSelf": false}}),
            json!({"node_type": "CollisionShape3D"}),
            json!({"OMI_collider": {"shape": 1}}),
        ] {
            assert!(is_hidden(&value), "{value}");
        }
        for value in [
            json!({"visible": true}),
            json!({"hidden": false}),
            json!({"collider": {"shape": "box"}}),
            json!({"type": "wall"}),
            json!({"KHR_physics_rigid_bodies": {"motion": {}}}),
            json!(null),
            json!([{"visible": false}]),
        ] {
            assert!(!is_hidden(&value), "{value}");
        }
    }
}
