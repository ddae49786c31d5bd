//! A level as a scene: the faces of the world and of brush models, and the leaves with their portals.
//!
//! What a face is follows from its texture's name, as games have it: `{...` and liquids (`*...`) are see-through, `sky...` hides what is
//! behind, `clip`, `skip`, `trigger`, `hint` and `origin` aren't drawn. An object is the faces of one leaf with one texture. Doors
//! (`func_door...`) are doors; every other brush model hides nothing, because it may move. Triggers aren't drawn.

use super::entities::entities;
use super::layout::*;
use super::portals::Between;
use super::tree::{Child, Tree, marked_faces, point, texture_name, texture_size};
use super::{Bsp, malformed};
use crate::geom::Plane;
use crate::scene::{ImportError, ImportOptions, Material, Mesh, Role, Scene, SceneBuilder, Source as SceneSource};
use crate::types::hints::Leaves;
use crate::types::level::{FARTHEST, LevelPortal};
use glam::DVec3;
use qbsp::data::texture::PlanarTextureProjection;
use qbsp::data::{BspEdge, BspFace, BspModel, BspTexInfo};
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::ops::Range;

/// Metres of a unit: players are 56 units tall.
pub(super) const UNIT: f64 = 1.0 / 32.0;

/// Deepest tree, and most half-spaces of all leaves together: 0.5 GB. Levels of 100,000 leaves have some sixty a leaf. More: what a file
/// of a few megabytes asks for doesn't fit the memory. Fewer: large levels are refused.
const MOST_DEEP: usize = 1024;
const MOST_HALF_SPACES: usize = 1 << 24;

/// Textures of faces that games never draw.
const UNDRAWN: [&str; 6] = ["clip", "skip", "trigger", "hint", "hintskip", "origin"];

/// A convex face.
struct Face {
    /// Indices of vertices, counter-clockwise from where it is seen.
    corners: Vec<u32>,
    texture: usize,
}

/// The faces of a level.
struct Faces {
    vertices: Vec<DVec3>,
    faces: Vec<Face>,
    /// Names in lower case.
    textures: Vec<String>,
    /// Of each of them, and its width and height, texels.
    projections: Vec<(PlanarTextureProjection, [f64; 2])>,
}

/// Width and height of a texture that the file doesn't have, texels.
const USUAL_SIZE: u32 = 64;

/// The level as a scene.
pub(super) fn scene(bsp: &Bsp, name: &str, options: &ImportOptions) -> Result<Scene, ImportError> {
    let source = bsp.source();
    let unit = options.metres_per_unit.unwrap_or(UNIT);
    let turned = |p: DVec3| turned(p, unit);
    let mut builder = SceneBuilder::new(
        options,
        SceneSource { format: bsp.format().into(), metres_per_unit: unit, up: "+Z".into(), notes: Vec::new() },
    );
    let faces = Faces::read(&source).map_err(malformed)?;
    let models: Vec<BspModel> = source.entries(MODELS).map_err(malformed)?;
    let ranges = ranges(&models, faces.faces.len()).map_err(malformed)?;
    let half_spaces = half_spaces(&bsp.tree).map_err(malformed)?;

    // 1. The world, by leaf and texture; faces that no leaf names come last.
    let leaf_of = first_leaves(&source, faces.faces.len()).map_err(malformed)?;
    let mut groups: BTreeMap<(usize, usize), Vec<usize>> = BTreeMap::new();
    // `Bsp::read` has seen that there is a world.
    for face in ranges[0].clone() {
        let texture = faces.faces[face].texture;
        if !is_undrawn(&faces.textures[texture]) {
            groups.entry((leaf_of[face], texture)).or_default().push(face);
        }
    }
    for ((leaf, texture), group) in groups {
        let texture = &faces.textures[texture];
        let node = if leaf == usize::MAX { texture.clone() } else { format!("leaf {leaf}/{texture}") };
        faces.look(&mut builder, &group);
        builder.add(faces.mesh(&group, node, Role::Structure, !is_see_through(texture), &turned))?;
    }

    // 2. Brush models.
    let (mut triggers, mut shown) = (0, 0);
    for (model, class) in brush_models(source.lump(ENTITIES), models.len()).map_err(malformed)? {
        if class.starts_with("trigger") {
            triggers += 1;
            continue;
        }
        let mut groups: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for face in ranges[model].clone() {
            groups.entry(faces.faces[face].texture).or_default().push(face);
        }
        let role = if class.starts_with("func_door") { Role::Door } else { Role::Furnishing };
        for (texture, group) in groups.into_iter().filter(|(texture, _)| !is_undrawn(&faces.textures[*texture])) {
            let mesh = faces.mesh(&group, format!("{class} *{model}"), role, false, &turned);
            faces.look(&mut builder, &group);
            if is_see_through(&faces.textures[texture]) { builder.add_glass(mesh)? } else { builder.add_moving(mesh)? }
        }
        shown += 1;
    }
    let unnamed = models.len().saturating_sub(1 + triggers + shown);
    if triggers + unnamed > 0 {
        let note = format!("{triggers} triggers and {unnamed} brush models without an entity aren't drawn");
        builder.source.notes.push(note);
    }

    // 3. Leaves and portals.
    let between = bsp.between(true).map_err(malformed)?;
    if between.slivers > 0 {
        let note = format!("{} portals narrower than the rounding of the file's planes left out", between.slivers);
        builder.source.notes.push(note);
    }
    builder.hints.leaves = Some(leaves_of(between, half_spaces, unit));
    builder.finish(name)
}

/// A point of the level in the scene.
pub(super) fn turned(p: DVec3, unit: f64) -> DVec3 {
    unit * DVec3::new(p.x, p.z, -p.y)
}

/// Leaves, given by the half-spaces of each, and what lies between them, in the scene.
pub(super) fn leaves_of(between: Between, half_spaces: Vec<Vec<Plane>>, unit: f64) -> Leaves {
    let all_turned = |winding: Vec<DVec3>| winding.into_iter().map(|p| turned(p, unit)).collect::<Vec<_>>();
    let portal = |p: LevelPortal| LevelPortal { winding: all_turned(p.winding), ..p };
    let walls = between.walls.into_iter().map(all_turned).collect();
    let turned_plane = |p: Plane| Plane { n: turned(p.n, 1.0), d: unit * p.d };
    let leaves = half_spaces.into_iter().map(|leaf| leaf.into_iter().map(turned_plane).collect()).collect();
    let portals = between.portals.into_iter().map(portal).collect();
    Leaves { leaves, portals, walls, shutters: Vec::new() }
}

/// What engines know of a texture by its name.
pub(super) fn material(texture: &str) -> Material {
    let opacity = if is_see_through(texture) { 0.5 } else { 1.0 };
    Material { name: texture.to_owned(), colour: [0.6, 0.6, 0.6, opacity], texture: None }
}

pub(super) fn is_undrawn(texture: &str) -> bool {
    UNDRAWN.contains(&texture)
}

pub(super) fn is_see_through(texture: &str) -> bool {
    texture.starts_with(['{', '*'])
}

impl Faces {
    fn read(source: &Source<'_>) -> Result<Self, BspError> {
        let vertices: Vec<DVec3> = source.entries(VERTICES)?.into_iter().map(point).collect();
        let is_near = |p: &DVec3| p.abs().cmple(DVec3::splat(FARTHEST)).all();
        if let Some(i) = vertices.iter().position(|p| !is_near(p)) {
            return Err(entry(VERTICES, i, format!("is not within {FARTHEST:e} of the origin")));
        }
        let edges: Vec<BspEdge> = source.entries(EDGES)?;
        let surface_edges: Vec<i32> = source.entries(SURFACE_EDGES)?;
        let infos: Vec<BspTexInfo> = source.entries(TEXTURE_INFOS)?;
        let (mut textures, mut projections) = (Vec::new(), Vec::new());
        for (i, info) in infos.iter().enumerate() {
            let texture = info.texture_idx.0.unwrap_or(u32::MAX);
            let count = source.lump(TEXTURES).first_chunk().map_or(0, |&b| u32::from_le_bytes(b));
            if texture >= count {
                return Err(entry(TEXTURE_INFOS, i, format!("its texture {texture} doesn't exist")));
            }
            // A file without its textures has no names, either.
            textures.push(texture_name(source, texture).unwrap_or_else(|| format!("texture {texture}")));
            let size = texture_size(source, texture).unwrap_or([USUAL_SIZE; 2]);
            projections.push((info.projection, size.map(f64::from)));
        }
        let corner = |face: usize, at: usize| -> Result<u32, BspError> {
            let missing = |what: String| entry(FACES, face, what);
            let edge = *surface_edges.get(at).ok_or_else(|| missing(format!("its surface edge {at} doesn't exist")))?;
            let index = edge.unsigned_abs() as usize;
            let ends = edges.get(index).ok_or_else(|| missing(format!("its edge {index} doesn't exist")))?;
            let vertex = if edge < 0 { ends.b.0 } else { ends.a.0 };
            match (vertex as usize) < vertices.len() {
                true => Ok(vertex),
                false => Err(missing(format!("its vertex {vertex} doesn't exist"))),
            }
        };
        let (mut faces, mut corners_of_all) = (Vec::new(), 0usize);
        for (i, face) in source.entries::<BspFace>(FACES)?.into_iter().enumerate() {
            let first = face.first_edge as usize;
            let last = first.saturating_add(face.num_edges.0 as usize);
            let texture = face.texture_info_idx.0 as usize;
            if texture >= textures.len() {
                return Err(entry(FACES, i, format!("its texture info {texture} doesn't exist")));
            }
            corners_of_all = corners_of_all.saturating_add(face.num_edges.0 as usize);
            if corners_of_all > surface_edges.len() {
                let what = format!("ends beyond the {} surface edges, of which each is one face's", surface_edges.len());
                return Err(entry(FACES, i, what));
            }
            // Clockwise in the file.
            let corners = (first..last).rev().map(|at| corner(i, at)).collect::<Result<Vec<_>, _>>()?;
            faces.push(Face { corners, texture });
        }
        Ok(Self { vertices, faces, textures, projections })
    }

    /// Says how the mesh of faces with one texture looks.
    fn look(&self, builder: &mut SceneBuilder, faces: &[usize]) {
        if !builder.is_traced() {
            return;
        }
        let coordinates = |face: &Face, vertex: u32| {
            let (projection, size) = &self.projections[face.texture];
            let p = self.vertices[vertex as usize];
            let along = |axis, offset: f32| point(axis).dot(p) + f64::from(offset);
            let texels = [along(projection.u_axis, projection.u_offset), along(projection.v_axis, projection.v_offset)];
            [0, 1].map(|k| (texels[k] / size[k]) as f32)
        };
        let all = faces.iter().map(|&face| &self.faces[face]);
        let triangles = all.clone().flat_map(|face| fan(&face.corners).map(|t| t.map(|vertex| coordinates(face, vertex))));
        let texture = all.map(|face| self.textures[face.texture].as_str()).next().unwrap_or_default();
        builder.look(material(texture), triangles.collect());
    }

    /// Faces as fans.
    fn mesh(&self, faces: &[usize], node: String, role: Role, opaque: bool, turned: &dyn Fn(DVec3) -> DVec3) -> Mesh {
        let (mut positions, mut triangles, mut known) = (Vec::new(), Vec::new(), HashMap::new());
        for &face in faces {
            let corners: Vec<u32> = self.faces[face]
                .corners
                .iter()
                .map(|&vertex| {
                    *known.entry(vertex).or_insert_with(|| {
                        positions.push(turned(self.vertices[vertex as usize]));
                        positions.len() as u32 - 1
                    })
                })
                .collect();
            triangles.extend(fan(&corners));
        }
        Mesh { node, role, opaque, positions, triangles }
    }
}

/// The triangles of a convex polygon.
fn fan(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    (2..corners.len()).map(|k| [corners[0], corners[k - 1], corners[k]])
}

/// The faces of each model; none is of two.
fn ranges(models: &[BspModel], faces: usize) -> Result<Vec<Range<usize>>, BspError> {
    let mut all = 0usize;
    let range = |(i, model): (usize, &BspModel)| {
        let (first, count) = (model.first_face as usize, model.num_faces as usize);
        all = all.saturating_add(count);
        match first.saturating_add(count).max(all) {
            end if end <= faces => Ok(first..first + count),
            end => Err(entry(MODELS, i, format!("its faces go to {end}, of which there are {faces}"))),
        }
    };
    models.iter().enumerate().map(range).collect()
}

/// The first leaf that names each face; `usize::MAX` for none.
fn first_leaves(source: &Source<'_>, faces: usize) -> Result<Vec<usize>, BspError> {
    let mut first = vec![usize::MAX; faces];
    marked_faces(source, faces, |leaf, face| first[face] = first[face].min(leaf))?;
    Ok(first)
}

/// Brush models with the class of their first entity, in the entities' order.
fn brush_models(lump: &[u8], models: usize) -> Result<Vec<(usize, String)>, BspError> {
    let (mut found, mut known) = (Vec::new(), BTreeSet::new());
    for (i, e) in entities(lump)?.iter().enumerate() {
        let Some(number) = e.get("model").and_then(|m| m.strip_prefix('*')) else { continue };
        match number.parse() {
            Ok(model) if (1..models).contains(&model) => {
                if !known.insert(model) {
                    continue;
                }
                let class: String = e.get("classname").unwrap_or("unnamed").chars().take(64).collect();
                found.push((model, class));
            }
            _ => return Err(entry(ENTITIES, i, format!("its model *{number:.32} doesn't exist"))),
        }
    }
    Ok(found)
}

/// Half-spaces of the world's leaves from 1 on, from the root down; none for leaves that the tree doesn't reach.
pub(super) fn half_spaces(tree: &Tree) -> Result<Vec<Vec<Plane>>, BspError> {
    let (mut leaves, mut all) = (vec![Vec::new(); tree.vis_leaves], 0);
    let mut way: Vec<Plane> = Vec::new();
    let mut stack = vec![(tree.root, None, 0)];
    while let Some((child, half_space, depth)) = stack.pop() {
        way.truncate(depth);
        way.extend(half_space);
        match child {
            Child::Leaf(leaf) if tree.leaves[leaf].open => {
                all += way.len();
                leaves[leaf - 1].clone_from(&way);
            }
            Child::Leaf(_) => {}
            Child::Node(n) => {
                let node = &tree.nodes[n];
                stack.push((node.children[1], Some(node.plane), way.len()));
                stack.push((node.children[0], Some(node.plane.flipped()), way.len()));
                if way.len() > MOST_DEEP {
                    return Err(entry(NODES, n, format!("is more than {MOST_DEEP} deep in the tree")));
                }
                if all > MOST_HALF_SPACES {
                    return Err(entry(NODES, n, format!("leaves before it have more than {MOST_HALF_SPACES} planes")));
                }
            }
        }
    }
    Ok(leaves)
}
