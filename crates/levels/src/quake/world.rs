//! A level as a scene: the faces of the world and of brush models, and the leaves with their portals.
//!
//! The texture's name decides how a face is used, as in games: `{...` and liquids (`*...`) are see-through, `sky...` hides things
//! behind it, `clip`, `skip`, `trigger`, `hint` and `origin` are not drawn. An object is the faces of one leaf with one texture.
//! Doors (`func_door...`) are doors; other brush models hide nothing, because they may move. Triggers are not drawn.

use super::malformed;
use super::texels::Textures;
use super::textures::{is_see_through, is_undrawn};
use crate::bsp::entities::entities;
use crate::bsp::error::entry;
use crate::bsp::faces::marked_faces;
use crate::bsp::faces::{Faces, SEE_THROUGH, UNDRAWN};
use crate::bsp::file::LevelFile;
use crate::bsp::layout::Lump;
use crate::bsp::portals::{Between, derive};
use crate::bsp::tree::{Child, Tree};
use crate::bsp::{Bsp, BspError};
use enfilade::math::geom::Plane;
use enfilade::scene::{ImportError, ImportOptions, Role, Scene, SceneBuilder, Source};
use enfilade::types::hints::Leaves;
use enfilade::types::level::LevelPortal;
use enfilade::types::note::Note;
use glam::DVec3;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::Range;
use std::path::Path;

/// Metres per unit: players are 56 units tall.
pub(super) const UNIT: f64 = 1.0 / 32.0;

/// Maximum depth of a tree, and maximum half-spaces of all leaves: 0.5 GB. Levels of 100,000 leaves have some sixty per leaf.
/// More: a hostile file of a few megabytes exceeds the memory. Fewer: large levels are refused.
const MOST_DEEP: usize = 1024;
const MOST_HALF_SPACES: usize = 1 << 24;

/// The textures of a level and of its WADs.
fn textures(file: &LevelFile, path: Option<&Path>, options: &ImportOptions) -> Result<Textures, BspError> {
    let world = entities(&file.lump(Lump::Entities)?)?.into_iter().next();
    let named = world.as_ref().and_then(|world| world.get("wad")).unwrap_or_default();
    Ok(Textures::read(&file.lump(Lump::Textures)?, path, named, options))
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
    let unit = options.metres_per_unit.unwrap_or(UNIT);
    let mut builder = SceneBuilder::new(
        options,
        Source { format: bsp.format().into(), metres_per_unit: unit, up: "+Z".into(), notes: Vec::new() },
    );
    let faces = Faces::read(file).map_err(malformed)?;
    let textures = if builder.is_traced() { textures(file, path, options).map_err(malformed)? } else { Textures::default() };
    let ranges = ranges(file, faces.faces.len()).map_err(malformed)?;
    let tree = bsp.tree.of_faces();
    let half_spaces = half_spaces(&tree).map_err(malformed)?;

    // 1. The world; faces without a leaf come last. `Bsp::read` has checked that there is a world.
    let leaf_of = first_leaves(file, faces.faces.len()).map_err(malformed)?;
    let mut meshes = Meshes { faces: &faces, textures: &textures, builder: &mut builder, unit };
    meshes.add_world(ranges[0].clone(), &leaf_of, walls)?;

    // 2. Brush models.
    let (mut triggers, mut shown) = (0, 0);
    for (model, class) in brush_models(file, ranges.len()).map_err(malformed)? {
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

/// Adds faces to a scene.
struct Meshes<'m> {
    faces: &'m Faces,
    textures: &'m Textures,
    builder: &'m mut SceneBuilder,
    unit: f64,
}

impl Meshes<'_> {
    /// The faces of the world, by leaf and texture. `walls` as in [`scene`].
    fn add_world(&mut self, world: Range<usize>, leaf_of: &[usize], walls: &[usize]) -> Result<(), ImportError> {
        let Self { faces, textures, ref mut builder, unit } = *self;
        let mut groups: BTreeMap<(usize, usize, bool), Vec<usize>> = BTreeMap::new();
        for face in world {
            let texture = faces.faces[face].texture;
            if is_drawn(faces, texture) {
                let hides = !is_looked_through(faces, texture) || walls.binary_search(&face).is_ok();
                groups.entry((leaf_of[face], texture, hides)).or_default().push(face);
            }
        }
        for ((leaf, texture, hides), group) in groups {
            let texture = &faces.textures[texture];
            let node = if leaf == usize::MAX { texture.clone() } else { format!("leaf {leaf}/{texture}") };
            faces.look(builder, textures, &group);
            builder.add(faces.mesh(&group, node, Role::Structure, hides, &|p| turned(p, unit)))?;
        }
        Ok(())
    }

    /// The faces of a brush model, whose name begins with its class, by texture.
    fn add_model(&mut self, name: &str, range: Range<usize>) -> Result<(), ImportError> {
        let Self { faces, textures, ref mut builder, unit } = *self;
        let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for face in range {
            groups.entry(faces.faces[face].texture).or_default().push(face);
        }
        let role = if name.starts_with("func_door") { Role::Door } else { Role::Furnishing };
        for (texture, group) in groups.into_iter().filter(|(texture, _)| is_drawn(faces, *texture)) {
            let mesh = faces.mesh(&group, name.to_owned(), role, false, &|p| turned(p, unit));
            faces.look(builder, textures, &group);
            if is_looked_through(faces, texture) { builder.add_glass(mesh)? } else { builder.add_moving(mesh)? }
        }
        Ok(())
    }
}

/// By texture info: what its name or its flags say.
fn is_drawn(faces: &Faces, texture: usize) -> bool {
    !is_undrawn(&faces.textures[texture]) && faces.flags[texture] & UNDRAWN == 0
}

fn is_looked_through(faces: &Faces, texture: usize) -> bool {
    is_see_through(&faces.textures[texture]) || faces.flags[texture] & SEE_THROUGH != 0
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
fn brush_models(file: &LevelFile, models: usize) -> Result<Vec<(usize, String)>, BspError> {
    let (mut found, mut known) = (Vec::new(), BTreeSet::new());
    for (i, e) in entities(&file.lump(Lump::Entities)?)?.iter().enumerate() {
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
