//! Maps of editors (`.map`; Quake, Hexen II and Quake 2, plain or Valve 220): brushes as a scene, and the leaves of a tree over
//! them as cells. A map that is not closed has no leaves and is an ordinary scene.
//!
//! The entity and the textures of a brush decide its kind, as in level compilers. Liquids (`*...`) and fences (`{...`) are
//! see-through and do not split space. `clip`, `trigger`, `hint` and `origin` are ignored. `func_detail...` is drawn but does not
//! split space, `func_illusionary` hides nothing; `func_group` and `func_illusionary_visblocker` belong to the world. A
//! `func_areaportal` is not drawn; the tree has a plane for each of its faces, and portals there can be shut. Other entities with
//! brushes are as in a compiled level: doors are doors, triggers are not drawn, the rest hides nothing, because it may move.

mod alignment;
mod brush;
mod build;
mod flood;
mod text;
mod union;

use super::texels::{Texture, Textures};
use super::textures::{is_see_through, is_undrawn, material};
use super::world::{half_spaces, leaves_of, turned};
use super::{ImportError, ImportOptions, Scene, malformed};
use crate::bsp::games::QUAKE_UNIT;
use crate::bsp::portals::{derive, sink};
use crate::bsp::tree::Tree;
use alignment::texture_coordinates;
use brush::{Brush, ON, Side, planes};
use enfilade::math::geom::{Aabb, middle};
use enfilade::scene::{LeakHint, Leaves, Mesh, Place, Role, SceneBuilder, Source};
use enfilade::types::level::LevelPortal;
use enfilade::types::note::Note;
use flood::{Inside, Leak, Origin, SMALLEST_HOLE, keep_inside};
use glam::DVec3;
use quake_map::{Entity, QuakeMap, TextParseError};
use std::collections::BTreeMap;
use std::path::Path;
use union::Part;

/// Maximum brushes. More: a hostile file takes hours.
const MOST_BRUSHES: usize = 1 << 16;

/// Corners within this distance are merged, in the map's units. Larger: the drawn shape is bent. Smaller: cuts leave needles.
const NEAR: f64 = 4.0 * ON;

/// Textures of brushes for the game or the compiler only.
const ABSENT: [&str; 5] = ["clip", "trigger", "hint", "hintskip", "origin"];

/// Contents of a brush in Quake 2, from the flags of its sides: windows, liquids, mist and translucent brushes; areaportals,
/// clips and origins; details.
const LOOKED_THROUGH: u32 = 0x2 | 0x8 | 0x10 | 0x20 | 0x40 | 0x1000_0000;
const NOT_THERE: u32 = 0x8000 | 0x1_0000 | 0x2_0000 | 0x100_0000;
const DETAIL: u32 = 0x800_0000;

/// Kind of a brush.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Kind {
    /// Splits space.
    Structure,
    /// Hides things, but does not split space.
    Detail,
    /// Is see-through.
    SeeThrough,
    /// Hides nothing, because it may move.
    Moving,
    /// Is an invisible door.
    AreaPortal,
    /// Is ignored.
    Absent,
}

/// The map as a scene; `path` is its file, if it has one.
pub(super) fn scene(bytes: &[u8], name: &str, path: Option<&Path>, options: &ImportOptions) -> Result<Scene, ImportError> {
    let map = parsed(bytes)?;
    let unit = options.metres_per_unit.unwrap_or(QUAKE_UNIT);
    let source = Source { format: "map".into(), metres_per_unit: unit, up: "+Z".into(), notes: Vec::new() };
    let mut builder = SceneBuilder::new(options, source);
    let Sorted { structure, other, area_portals, origins } = sorted(&map, &mut builder.source.notes)?;

    // 1. The tree and its inside.
    if structure.is_empty() {
        return Err(ImportError::Empty);
    }
    let fault = |what: String| ImportError::malformed(Place::File, what);
    let parts = union::surface(&structure).map_err(|what| fault(format!("the map {what}")))?;
    let bounds = Aabb::of(structure.iter().flat_map(|brush| [brush.bounds.min, brush.bounds.max]));
    let sides = area_portals.iter().flat_map(|(_, brush)| &brush.sides);
    let between: Vec<Part> =
        sides.map(|side| Part { plane: side.plane, side: [0; 2], winding: side.face.clone() }).collect();
    let mut tree = build::tree(&parts, &between, &structure, bounds).map_err(|what| fault(format!("the map {what}")))?;
    let is_closed = close(&mut tree, &origins, &mut builder);

    // 2. The visible faces of the world, by leaf and texture.
    let named = map.entities.first().and_then(|world| value(world, "wad")).unwrap_or_default();
    let textures = if builder.is_traced() { Textures::read(&[], path, &named, options) } else { Textures::default() };
    add_structure(&mut builder, &textures, &tree, &parts, &structure)?;

    // 3. Brushes that do not split space.
    for other in &other {
        add_other(&mut builder, &textures, other)?;
    }

    // 4. Leaves and portals, if the map is closed.
    if is_closed {
        let between = derive(&tree, true);
        if between.slivers > 0 {
            let what = format!("{} portals too narrow for a compiled level left out", between.slivers);
            builder.source.notes.push(Note::detail(what));
        }
        let shutters = shutters(&between.portals, &area_portals);
        let leaves = leaves_of(between, half_spaces(&tree).map_err(malformed)?, unit);
        builder.hints.leaves = Some(Leaves { shutters, ..leaves });
    }
    builder.finish(name)
}

/// Adds the visible faces of the world.
fn add_structure(
    builder: &mut SceneBuilder,
    textures: &Textures,
    tree: &Tree,
    parts: &[Part],
    structure: &[Brush],
) -> Result<(), ImportError> {
    let unit = builder.source.metres_per_unit;
    let mut groups: BTreeMap<(usize, &str), Vec<Facing<'_>>> = BTreeMap::new();
    for part in parts {
        let side = &structure[part.side[0]].sides[part.side[1]];
        let texture = side.texture.as_str();
        if !is_undrawn(texture) {
            for piece in sink(tree, tree.root, part.winding.clone(), &part.plane.flipped(), ON, false) {
                groups.entry((piece.leaf, texture)).or_default().push((piece.winding, side));
            }
        }
    }
    for ((leaf, texture), faces) in groups {
        let faces = fans_of(faces);
        look(builder, textures, texture, &faces);
        builder.add(fans(faces, format!("leaf {leaf}/{texture}"), Role::Structure, true, unit))?;
    }
    Ok(())
}

/// Adds brushes that do not split space, a mesh a texture.
fn add_other(builder: &mut SceneBuilder, textures: &Textures, other: &Other) -> Result<(), ImportError> {
    let unit = builder.source.metres_per_unit;
    let Other { node, role, kind, brushes } = other;
    for (texture, faces) in drawn(brushes) {
        let node = format!("{node}/{texture}");
        let faces = fans_of(faces);
        look(builder, textures, texture, &faces);
        let mesh = |opaque| fans(faces, node, *role, opaque, unit);
        match kind {
            Kind::Moving if !is_see_through(texture) => builder.add_moving(mesh(false))?,
            Kind::Detail if !is_see_through(texture) => builder.add(mesh(true))?,
            _ => builder.add_glass(mesh(false))?,
        }
    }
    Ok(())
}

/// Keeps only leaves inside open, and adds notes. Returns false if the map is open to the outside: then all leaves stay open.
fn close(tree: &mut Tree, origins: &[Origin], builder: &mut SceneBuilder) -> bool {
    let unit = builder.source.metres_per_unit;
    let hole = builder.smallest_hole().map_or(SMALLEST_HOLE, |metres| metres / unit);
    let notes = &mut builder.source.notes;
    match keep_inside(tree, origins, hole) {
        Inside::Closed { holes } => {
            if origins.is_empty() {
                notes.push(Note::taken("no point entities: all closed space counts as inside"));
            }
            if holes > 0 {
                let metres = hole * unit;
                notes.push(Note::taken(format!(
                    "{holes} portals no wider than {hole} units ({metres} m) lead outside and are closed (--smallest-hole): the outside is \
                     not visible through them"
                )));
            }
            true
        }
        Inside::None => {
            notes.push(Note::fault(format!("no point entities and no closed space: {OPEN}")));
            false
        }
        Inside::Leaks(Leak { from, way }) => {
            let leak = LeakHint { entity: from.class.clone(), from: from.at, way };
            notes.push(Note::fault(format!("{leak}: {OPEN}")));
            builder.hints.leak = Some(leak);
            false
        }
    }
}

/// Note about a map that is not closed.
const OPEN: &str = "the map is baked with all its faces, so also as seen from outside";

/// The portals on the faces of area portals. The tree has a plane for each face, so a portal is either on it or not.
fn shutters(portals: &[LevelPortal], area_portals: &[(String, Brush)]) -> Vec<(u32, String)> {
    let on_face = |portal: &LevelPortal, brush: &Brush| {
        let p = middle(&portal.winding);
        let is_on = |side: &Side| portal.winding.iter().all(|corner| side.plane.distance(*corner).abs() <= NEAR);
        brush.holds(p) && brush.sides.iter().any(is_on)
    };
    let shutter = |(i, portal): (usize, &LevelPortal)| {
        let found = area_portals.iter().find(|(_, brush)| on_face(portal, brush));
        found.map(|(name, _)| (i as u32, name.clone()))
    };
    portals.iter().enumerate().filter_map(shutter).collect()
}

/// Brushes that are drawn but do not split space.
struct Other {
    node: String,
    role: Role,
    kind: Kind,
    brushes: Vec<Brush>,
}

/// A map's brushes by kind.
struct Sorted {
    structure: Vec<Brush>,
    other: Vec<Other>,
    /// With the entity's name.
    area_portals: Vec<(String, Brush)>,
    origins: Vec<Origin>,
}

fn parsed(bytes: &[u8]) -> Result<QuakeMap, ImportError> {
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    for word in [&b"patchDef"[..], b"brushDef"] {
        if let Some(at) = text.windows(word.len()).position(|w| w == word) {
            let line = 1 + text[..at].iter().filter(|&&b| b == b'\n').count();
            let what = format!("line {line}: {} is of Quake 3 and not supported", String::from_utf8_lossy(word));
            return Err(ImportError::malformed(Place::File, what));
        }
    }
    let mut text = text.to_vec();
    text::settle(&mut text);
    let map = quake_map::parse(&mut &text[..]).map_err(|e| match e {
        TextParseError::Io(e) => ImportError::Io(e),
        e => ImportError::malformed(Place::File, e.to_string()),
    })?;
    let brushes: usize = map.entities.iter().map(|entity| entity.brushes.len()).sum();
    if brushes > MOST_BRUSHES {
        return Err(ImportError::malformed(Place::File, format!("{brushes} brushes, more than {MOST_BRUSHES}")));
    }
    Ok(map)
}

fn sorted(map: &QuakeMap, notes: &mut Vec<Note>) -> Result<Sorted, ImportError> {
    let (mut structure, mut other, mut area_portals, mut origins) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    // All planes first: they bound the brushes.
    let mut all = Vec::new();
    for (e, entity) in map.entities.iter().enumerate() {
        for (b, brush) in entity.brushes.iter().enumerate() {
            let fault = |what| ImportError::malformed(Place::File, format!("entity {e}, brush {b}, {what}"));
            all.push(planes(brush).map_err(fault)?);
        }
    }
    let points = map.entities.iter().flat_map(|e| &e.brushes).flatten().flat_map(|side| side.half_space.map(DVec3::from));
    let within = Aabb::of(points);
    let within = within.inflated(within.diagonal());
    let (mut planes, mut flat, mut absent) = (all.iter(), Vec::new(), 0);
    for (e, entity) in map.entities.iter().enumerate() {
        let class = value(entity, "classname").unwrap_or_else(|| "unnamed".into());
        if entity.brushes.is_empty() {
            origins.extend(origin(entity).map(|at| Origin { class: class.clone(), at }));
        }
        let mut by_kind: BTreeMap<Kind, Vec<Brush>> = BTreeMap::new();
        for (b, surfaces) in entity.brushes.iter().enumerate() {
            let Some(brush) = planes.next().and_then(|planes| Brush::new(surfaces, planes, &within)) else {
                flat.push(format!("entity {e} brush {b}"));
                continue;
            };
            match kind(entity, &class, &brush) {
                Kind::Structure => structure.push(brush),
                Kind::AreaPortal => area_portals.push((format!("{class} {e}"), brush)),
                Kind::Absent => absent += 1,
                kind => by_kind.entry(kind).or_default().push(brush),
            }
        }
        let role = match class.as_str() {
            _ if is_world(&class) => Role::Structure,
            _ if class.starts_with("func_door") => Role::Door,
            _ => Role::Furnishing,
        };
        let named = |(kind, brushes)| Other { node: format!("{class} {e}"), role, kind, brushes };
        other.extend(by_kind.into_iter().map(named));
    }
    if !flat.is_empty() {
        let first = flat.iter().take(3).cloned().collect::<Vec<_>>().join(", ");
        notes.push(Note::fault(format!("{} brushes without a volume left out: {first}", flat.len())));
    }
    if absent > 0 {
        notes.push(Note::detail(format!("{absent} brushes for triggers or the compiler are not drawn")));
    }
    Ok(Sorted { structure, other, area_portals, origins })
}

/// Whether a class's brushes belong to the world.
fn is_world(class: &str) -> bool {
    matches!(class, "worldspawn" | "func_group" | "func_illusionary_visblocker") || class.starts_with("func_detail")
}

/// Whether an entity is drawn half transparent; 0 counts as no value, as in engines.
fn is_half_transparent(entity: &Entity) -> bool {
    let alpha =
        ["alpha", "_alpha"].iter().find_map(|key| value(entity, key)).and_then(|text| text.trim().parse::<f64>().ok());
    alpha.is_some_and(|alpha| alpha > 0.0 && alpha < 1.0)
}

fn kind(entity: &Entity, class: &str, brush: &Brush) -> Kind {
    let any = |is: fn(&str) -> bool| brush.sides.iter().any(|side| is(&side.texture));
    let has = |flags: u32| brush.contents & flags != 0;
    match class {
        "func_areaportal" => Kind::AreaPortal,
        _ if class.starts_with("trigger") || any(|texture| ABSENT.contains(&texture)) || has(NOT_THERE) => Kind::Absent,
        "func_illusionary_visblocker" => Kind::Structure,
        "func_illusionary" | "func_detail_illusionary" | "func_detail_fence" => Kind::SeeThrough,
        _ if !is_world(class) => Kind::Moving,
        _ if any(is_see_through) || has(LOOKED_THROUGH) => Kind::SeeThrough,
        _ if class != "worldspawn" && is_half_transparent(entity) => Kind::SeeThrough,
        _ if class.starts_with("func_detail") || has(DETAIL) => Kind::Detail,
        _ => Kind::Structure,
    }
}

/// The last value of a key.
fn value(entity: &Entity, key: &str) -> Option<String> {
    let found = entity.edict.iter().rev().find(|(k, _)| k.to_bytes() == key.as_bytes());
    found.map(|(_, value)| value.to_string_lossy().into_owned())
}

/// The place of an entity.
fn origin(entity: &Entity) -> Option<DVec3> {
    let text = value(entity, "origin")?;
    let numbers: Vec<f64> = text.split_whitespace().map_while(|word| word.parse().ok()).collect();
    let at: [f64; 3] = numbers.try_into().ok()?;
    Some(DVec3::from(at)).filter(|p| p.is_finite())
}

/// The drawn faces of brushes, by texture.
fn drawn(brushes: &[Brush]) -> BTreeMap<&str, Vec<Facing<'_>>> {
    let mut faces: BTreeMap<&str, Vec<Facing<'_>>> = BTreeMap::new();
    for side in brushes.iter().flat_map(|brush| &brush.sides).filter(|side| !is_undrawn(&side.texture)) {
        faces.entry(&side.texture).or_default().push((side.face.clone(), side));
    }
    faces
}

/// A face or a part of one, and its side.
type Facing<'s> = (Vec<DVec3>, &'s Side);

/// Removes repeated corners, since rays would meet needles.
fn fans_of(mut faces: Vec<Facing<'_>>) -> Vec<Facing<'_>> {
    for (face, _) in &mut faces {
        face.dedup_by(|a, b| a.distance(*b) <= NEAR);
        if face.len() > 1 && face[0].distance(face[face.len() - 1]) <= NEAR {
            face.pop();
        }
    }
    faces
}

/// Sets the material of faces with one texture.
fn look(builder: &mut SceneBuilder, textures: &Textures, texture: &str, faces: &[Facing<'_>]) {
    let coordinates = |(face, side): &Facing<'_>, size: [u32; 2]| {
        let corners: Vec<[f32; 2]> = face.iter().map(|p| texture_coordinates(side, *p, size)).collect();
        (2..corners.len()).map(|k| [corners[0], corners[k - 1], corners[k]]).collect::<Vec<_>>()
    };
    let of = |found: &Texture| faces.iter().flat_map(|face| coordinates(face, found.size)).collect();
    builder.look(material(texture, textures), textures.get(texture).map(of).unwrap_or_default());
}

/// Faces as triangle fans.
fn fans(faces: Vec<Facing<'_>>, node: String, role: Role, opaque: bool, unit: f64) -> Mesh {
    let (mut positions, mut triangles) = (Vec::new(), Vec::new());
    for (face, _) in faces {
        let first = positions.len() as u32;
        triangles.extend((2..face.len() as u32).map(|k| [first, first + k - 1, first + k]));
        positions.extend(face.into_iter().map(|p| turned(p, unit)));
    }
    Mesh { node, role, opaque, positions, triangles }
}
