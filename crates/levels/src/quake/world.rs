//! A level as a scene: the faces of the world and of brush models, and the leaves with their portals.
//!
//! The texture decides how a face is used, as in games ([`super::uses`]): by its name, `{...` and liquids (`*...`) are see-through,
//! `sky...` hides things behind it, `clip`, `skip`, `trigger`, `hint` and `origin` are not drawn; in later games by flags of its
//! surface. An object is the faces of one leaf with one texture, or a displacement. Doors (`func_door...`) are doors; other brush
//! models hide nothing, because they may move. Triggers are not drawn. Curved patches hide nothing, because engines choose their
//! triangles.

use super::game_files::GameFiles;
use super::malformed;
use super::scripts::Scripts;
use super::texels::Textures;
use super::uses::{Use, uses};
use crate::bsp::entities::{Entity, entities};
use crate::bsp::error::entry;
use crate::bsp::faces::{Faces, marked_faces};
use crate::bsp::file::LevelFile;
use crate::bsp::layout::{self, Lump};
use crate::bsp::portals::{Between, derive};
use crate::bsp::props::static_props;
use crate::bsp::tree::{Child, Tree};
use crate::bsp::{Bsp, BspError};
use enfilade::math::geom::Plane;
use enfilade::scene::{ImportError, ImportOptions, Role, Scene, SceneBuilder, Source};
use enfilade::types::hints::Leaves;
use enfilade::types::level::LevelPortal;
use enfilade::types::note::Note;
use glam::DVec3;
use std::borrow::Cow;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::Path;

/// Maximum depth of a tree, and maximum half-spaces of all leaves: 0.5 GB. Levels of 100,000 leaves have some sixty per leaf.
/// More: a hostile file of a few megabytes exceeds the memory. Fewer: large levels are refused.
const MOST_DEEP: usize = 1024;
const MOST_HALF_SPACES: usize = 1 << 24;

/// The textures of a level, and of files beside it.
fn textures(
    file: &LevelFile,
    faces: &Faces,
    path: Option<&Path>,
    options: &ImportOptions,
    notes: &mut Vec<Note>,
) -> Result<Textures, BspError> {
    if has_wals(file) {
        let found = Textures::read_wals(&faces.infos.names, &mut GameFiles::beside(path, options));
        if found.is_none() {
            let note =
                "textures have plain colours, because the palette of the .wal files, pics/colormap.pcx, isn't at hand";
            notes.push(Note::taken(note));
        }
        return Ok(found.unwrap_or_default());
    }
    let world = entities(&file.lump(Lump::Entities)?)?.into_iter().next();
    let named = world.as_ref().and_then(|world| world.get("wad")).unwrap_or_default();
    // Quake 3's lump has no texels.
    let own = if has_shaders(file) { Cow::default() } else { file.lump(Lump::Textures)? };
    Ok(Textures::read(&own, path, named, options))
}

/// Whether textures are files of their own, `.wal`.
fn has_wals(file: &LevelFile) -> bool {
    let is_named = |chain: &layout::Chain| matches!(chain.texture, layout::Texture::Named { .. });
    matches!(file.layout.faces, layout::Faces::Chains(versions) if versions.iter().any(|(_, chain)| is_named(chain)))
}

/// Whether textures are shaders, with scripts.
fn has_shaders(file: &LevelFile) -> bool {
    matches!(file.layout.faces, layout::Faces::Meshes(_))
}

/// What the faces with each texture are used for.
fn uses_of(
    file: &LevelFile,
    faces: &Faces,
    path: Option<&Path>,
    options: &ImportOptions,
    notes: &mut Vec<Note>,
) -> Vec<Use> {
    if !has_shaders(file) {
        return uses(faces, file.layout.flags, &Scripts::default());
    }
    let scripts = Scripts::read(&mut GameFiles::beside(path, options));
    let uses = uses(faces, file.layout.flags, &scripts);
    if scripts.is_empty() && uses.contains(&Use::Opaque) {
        let note = "shaders count as opaque unless the level says `trans`, because their scripts are not at hand; put scripts/ or the \
                    game's .pk3 beside the level, or allow the game's folder with --files-under";
        notes.push(Note::taken(note));
    }
    uses
}

/// The level as a scene; `path` is its file, if it has one. `walls`: faces that are opaque with any texture, ascending.
pub(super) fn scene(
    bsp: &Bsp,
    name: &str,
    path: Option<&Path>,
    options: &ImportOptions,
    walls: &[usize],
) -> Result<Scene, ImportError> {
    let file = &bsp.file;
    let unit = options.metres_per_unit.unwrap_or(file.layout.unit);
    let mut builder = SceneBuilder::new(
        options,
        Source { format: bsp.format().into(), metres_per_unit: unit, up: "+Z".into(), notes: Vec::new() },
    );
    let faces = Faces::read(file).map_err(malformed)?;
    let uses = uses_of(file, &faces, path, options, &mut builder.source.notes);
    let textures = match builder.is_traced() {
        true => textures(file, &faces, path, options, &mut builder.source.notes).map_err(malformed)?,
        false => Textures::default(),
    };
    let ranges = ranges(file, faces.faces.len()).map_err(malformed)?;
    let tree = bsp.tree.of_faces(file.layout.detail_is_wall);
    let half_spaces = half_spaces(&tree).map_err(malformed)?;

    // 1. The world; faces without a leaf come last. `Bsp::read` has checked that there is a world.
    let leaf_of = first_leaves(file, faces.faces.len()).map_err(malformed)?;
    let mut meshes = Meshes { faces: &faces, uses: &uses, textures: &textures, builder: &mut builder, unit };
    meshes.add_world(ranges[0].clone(), &leaf_of, walls)?;

    // 2. Brush models, and what is left out.
    let entities = entities(&file.lump(Lump::Entities).map_err(malformed)?).map_err(malformed)?;
    let (mut triggers, mut shown) = (0, 0);
    for (model, class) in brush_models(&entities, ranges.len()).map_err(malformed)? {
        if class.starts_with("trigger") {
            triggers += 1;
            continue;
        }
        meshes.add_model(&format!("{class} *{model}"), ranges[model].clone())?;
        shown += 1;
    }
    let unnamed = ranges.len().saturating_sub(1 + triggers + shown);
    if triggers + unnamed > 0 {
        let note = format!("{triggers} triggers and {unnamed} brush models without an entity are not drawn");
        builder.source.notes.push(Note::detail(note));
    }
    builder.source.notes.extend(note_of_props(file, &entities));
    if !walls.is_empty() {
        let count = walls.len();
        let note = format!("{count} faces with textures named {{... count as walls, as in the .prt beside the level");
        builder.source.notes.push(Note::taken(note));
    }

    // 3. Leaves and portals.
    let between = derive(&tree, true);
    if between.slivers > 0 {
        let note = format!("{} portals narrower than the rounding of the file's planes left out", between.slivers);
        builder.source.notes.push(Note::detail(note));
    }
    builder.hints.leaves = Some(leaves_of(between, half_spaces, unit));
    builder.finish(name)
}

/// What is not in a level of Source, because its models are other files.
fn note_of_props(file: &LevelFile, entities: &[Entity]) -> Option<Note> {
    file.layout.number(Lump::GameLumps)?;
    let is_prop = |entity: &&Entity| entity.get("classname").is_some_and(|class| class.starts_with("prop_"));
    let (fixed, moving) = (static_props(file).unwrap_or(0), entities.iter().filter(is_prop).count());
    let note = format!(
        "{fixed} static props and {moving} prop entities are left out, because their models are other files: they hide nothing; draw \
         each where its cell is drawn"
    );
    (fixed + moving > 0).then(|| Note::taken(note))
}

/// Adds faces to a scene.
struct Meshes<'m> {
    faces: &'m Faces,
    /// By texture info.
    uses: &'m [Use],
    textures: &'m Textures,
    builder: &'m mut SceneBuilder,
    unit: f64,
}

impl Meshes<'_> {
    /// The faces of the world, by leaf and texture. `walls` as in [`scene`].
    fn add_world(&mut self, world: Range<usize>, leaf_of: &[usize], walls: &[usize]) -> Result<(), ImportError> {
        let Self { faces, uses, textures, ref mut builder, unit } = *self;
        let mut groups: BTreeMap<(usize, Option<usize>, usize, bool), Vec<usize>> = BTreeMap::new();
        for number in world {
            let face = &faces.faces[number];
            let used = uses[face.texture];
            if used == Use::Undrawn {
                continue;
            }
            let hides = face.is_exact && (used == Use::Opaque || walls.binary_search(&number).is_ok());
            // Displacements are in no leaf, and large.
            let own = (leaf_of[number] == usize::MAX && face.corners().is_empty()).then_some(number);
            groups.entry((leaf_of[number], own, face.texture, hides)).or_default().push(number);
        }
        for ((leaf, own, texture, hides), group) in groups {
            let (name, used) = (&faces.infos.names[texture], uses[texture]);
            let node = match own {
                Some(face) => format!("face {face}/{name}"),
                None if leaf == usize::MAX => name.clone(),
                None => format!("leaf {leaf}/{name}"),
            };
            faces.look(builder, textures, &group, if hides { Use::Opaque } else { used });
            let mesh = faces.mesh(&group, node, Role::Structure, hides, &|p| turned(p, unit));
            // What hides nothing although it is opaque is no glass.
            if hides || used == Use::SeeThrough { builder.add(mesh)? } else { builder.add_moving(mesh)? }
        }
        Ok(())
    }

    /// The faces of a brush model, whose name begins with its class, by texture.
    fn add_model(&mut self, name: &str, range: Range<usize>) -> Result<(), ImportError> {
        let Self { faces, uses, textures, ref mut builder, unit } = *self;
        let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for face in range {
            groups.entry(faces.faces[face].texture).or_default().push(face);
        }
        let role = if name.starts_with("func_door") { Role::Door } else { Role::Furnishing };
        for (texture, group) in groups.into_iter().filter(|(texture, _)| uses[*texture] != Use::Undrawn) {
            let mesh = faces.mesh(&group, name.to_owned(), role, false, &|p| turned(p, unit));
            faces.look(builder, textures, &group, uses[texture]);
            if uses[texture] == Use::SeeThrough { builder.add_glass(mesh)? } else { builder.add_moving(mesh)? }
        }
        Ok(())
    }
}

/// A point of the level in the scene.
pub(super) fn turned(p: DVec3, unit: f64) -> DVec3 {
    unit * DVec3::new(p.x, p.z, -p.y)
}

/// Leaves, from the half-spaces of each, and the faces between them, in the scene.
pub(super) fn leaves_of(between: Between, half_spaces: Vec<Vec<Plane>>, unit: f64) -> Leaves {
    let all_turned = |winding: Vec<DVec3>| winding.into_iter().map(|p| turned(p, unit)).collect::<Vec<_>>();
    let portal = |p: LevelPortal| LevelPortal { winding: all_turned(p.winding), ..p };
    let walls = between.walls.into_iter().map(all_turned).collect();
    let turned_plane = |p: Plane| Plane { n: turned(p.n, 1.0), d: unit * p.d };
    let leaves = half_spaces.into_iter().map(|leaf| leaf.into_iter().map(turned_plane).collect()).collect();
    let portals = between.portals.into_iter().map(portal).collect();
    Leaves { leaves, portals, walls, shutters: Vec::new() }
}

/// The faces of each model; they do not overlap.
fn ranges(file: &LevelFile, faces: usize) -> Result<Vec<Range<usize>>, BspError> {
    let lump = file.lump(Lump::Models)?;
    let models = file.records(Lump::Models, &lump, file.layout.model.size)?;
    let mut all = 0usize;
    let range = |model| {
        let [first, count] = file.layout.model.faces.map(|field| models.index(model, field));
        all = all.saturating_add(count);
        match first.saturating_add(count).max(all) {
            end if end <= faces => Ok(first..first + count),
            end => Err(entry(Lump::Models, model, format!("its faces end at {end}, but there are {faces}"))),
        }
    };
    (0..models.len()).map(range).collect()
}

/// The first leaf of each face; `usize::MAX` for none.
fn first_leaves(file: &LevelFile, faces: usize) -> Result<Vec<usize>, BspError> {
    let mut first = vec![usize::MAX; faces];
    marked_faces(file, faces, |leaf, face| first[face] = first[face].min(leaf))?;
    Ok(first)
}

/// Brush models with the class of their first entity, in the order of entities.
fn brush_models(entities: &[Entity], models: usize) -> Result<Vec<(usize, String)>, BspError> {
    let (mut found, mut known) = (Vec::new(), BTreeSet::new());
    for (i, e) in entities.iter().enumerate() {
        let Some(number) = e.get("model").and_then(|m| m.strip_prefix('*')) else { continue };
        match number.parse() {
            Ok(model) if (1..models).contains(&model) => {
                if !known.insert(model) {
                    continue;
                }
                let class: String = e.get("classname").unwrap_or("unnamed").chars().take(64).collect();
                found.push((model, class));
            }
            _ => return Err(entry(Lump::Entities, i, format!("its model *{number:.32} doesn't exist"))),
        }
    }
    Ok(found)
}

/// Half-spaces of the world's leaves from 1 on, from the root down; empty for leaves that the tree does not reach.
pub(super) fn half_spaces(tree: &Tree) -> Result<Vec<Vec<Plane>>, BspError> {
    let (mut leaves, mut all) = (vec![Vec::new(); tree.cells], 0);
    let mut way: Vec<Plane> = Vec::new();
    let mut stack = vec![(tree.root, None, 0)];
    while let Some((child, half_space, depth)) = stack.pop() {
        way.truncate(depth);
        way.extend(half_space);
        match child {
            Child::Leaf(leaf) => {
                if let Some(cell) = tree.leaves[leaf].cell {
                    all += way.len();
                    leaves[cell as usize].clone_from(&way);
                }
            }
            Child::Node(n) => {
                let node = &tree.nodes[n];
                stack.push((node.children[1], Some(node.plane), way.len()));
                stack.push((node.children[0], Some(node.plane.flipped()), way.len()));
                if way.len() > MOST_DEEP {
                    return Err(entry(Lump::Nodes, n, format!("is more than {MOST_DEEP} deep in the tree")));
                }
                if all > MOST_HALF_SPACES {
                    return Err(entry(Lump::Nodes, n, format!("leaves before it have more than {MOST_HALF_SPACES} planes")));
                }
            }
        }
    }
    Ok(leaves)
}
