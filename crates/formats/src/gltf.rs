//! glTF 2.0: `.glb`, and `.gltf` with `data:` uris or files beside it.
//!
//! Every node that the default scene shows becomes one object per mesh primitive, in metres, +Y up, under the node's world
//! transform (computed in `f64`; triangles of mirrored nodes are reversed). The importer reads triangle lists, strips and fans,
//! indexed or not, plain, quantised (KHR_mesh_quantization) or compressed (EXT_meshopt_compression and KHR_meshopt_compression
//! with the feature `meshopt`, KHR_draco_mesh_compression with `draco`), sparse accessors, EXT_mesh_gpu_instancing,
//! KHR_node_visibility and MSFT_lod. Skins and morph targets keep the pose of the file. Animated and skinned meshes hide nothing;
//! their objects have a [`reach`](enfilade::scene::Object::reach) around all poses. Points, and lines without a radius, are left
//! out with a note. An unknown required extension is an error. Names and extras mark helpers that engines do not draw and coarser
//! levels of detail (docs/undrawn.md).
//!
//! An object is named after its node, else its mesh, else `node N`; `/I` is added if the mesh has several primitives, and `@I`
//! for instances. Materials are see-through if they transmit light, or if they blend or are masked and have alpha.
//!
//! # Authored rooms and portals
//!
//! The partition into cells takes these as [`Hints`](enfilade::scene::Hints) only. Node names are those of Godot 3:
//!
//! | name | meaning |
//! | --- | --- |
//! | `kitchen-room` | a room, with everything below it |
//! | `x-bound` in a room | the room's surface, or its convex hull if it is open; not drawn. Default: the box around the room's meshes |
//! | `outside-roomgroup` | rooms below it are open air; other groups only group |
//! | `kitchen-portal`, `kitchen*1-portal` | a flat convex mesh: an opening from its room to `kitchen`; not drawn |
//! | `-portal` | the same, to whichever room is on its other side |
//!
//! Suffixes may be in capitals. An asterisk and the text after it, and Blender's `.001`, only make a name unique. The extras of a
//! node mean the same:
//!
//! ```json
//! { "extras": { "enfilade": { "role": "structure|furnishing|door|window|stair|helper|sky", "room": "kitchen", "portal": ["kitchen", "hall"] } } }
//! ```
//!
//! * `role` is the [`Role`] of the node's mesh and of everything below it without its own role. Doors and windows are see-through
//!   with any material.
//! * `room` is a name (nodes with one name form one room) or `true` (the node's own name); `false` cancels a `-room` name.
//! * `portal` makes the node's mesh an opening between two rooms; geometry decides a side with an empty name.
//! * `tube` makes the node's lines tubes of a `radius` (in the node's own unit): `{ "radius": 0.1, "inner": 0.09, "open": true,
//!   "closed": true, "smooth": true, "points": [[0, 0, 0], [1, 0, 0]] }`; all but the radius are optional. With `points`, the
//!   tube along them replaces the node's mesh, which other readers show.

mod alpha;
mod authored;
mod bent;
pub mod container;
mod cut;
mod data;
mod document;
mod draco;
mod drawn;
mod hull;
mod looks;
mod meshopt;
mod motion;
mod nodes;
pub(crate) mod pictures;
mod placement;
mod primitive;
mod tubes;

use super::helpers::{self, Helpers};
use super::lines::Lines;
use super::lod::Level;
use super::textures;
use alpha::Alpha;
pub(super) use authored::flat_hull;
use authored::{Authored, Extras, Named, RoomName};
use bent::Joints;
pub(crate) use cut::cut_file;
use data::{Buffers, broken, entry};
use document::{Document, Node};
use enfilade::scene::builder::short_name;
use enfilade::scene::naming::{ByName, Kind, Naming, Told};
use enfilade::scene::sidecar::Sidecars;
use enfilade::scene::{ImportError, ImportOptions, Role, Scene, SceneBuilder, Source, whole_file};
use enfilade::types::note::{Note, NoteKind};
use glam::{DAffine3, DMat3, DVec3};
use looks::Looks;
use motion::Motion;
use nodes::{instances, is_body, levels, names, roots};
use placement::{Placement, transform};
use primitive::{LeftOut, Part};
use std::collections::{HashMap, HashSet};
use std::path::Path;
use std::rc::Rc;

/// Reads a `.glb` or `.gltf` file; see [`self`].
pub fn import(path: &Path, options: &ImportOptions) -> Result<Scene, ImportError> {
    let bytes = whole_file::model(path)?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    from_slice(&bytes, &name, path.parent(), options)
}

/// Reads a model in memory. `folder` holds its buffers; without a folder, buffers in other files are an error.
pub fn from_slice(bytes: &[u8], name: &str, folder: Option<&Path>, options: &ImportOptions) -> Result<Scene, ImportError> {
    let (document, bin) = document::read(bytes)?;
    let json = if options.trace { Some(document::text(bytes)?.0) } else { None };
    Ok(read(&document, bin, json, name, folder, options)?.scene)
}

/// A document that was read, with the data for cutting it.
struct Reading<'a> {
    scene: Scene,
    buffers: Buffers<'a>,
    /// Drawn primitives, by mesh and primitive.
    parts: Vec<Option<Rc<Vec<Option<Part>>>>>,
    /// By mesh of the scene ([`Trace::meshes`](enfilade::scene::Trace::meshes)).
    drawn: Vec<Drawn>,
    /// Nodes whose meshes are surfaces of rooms or portals.
    undrawn: Vec<usize>,
}

/// A primitive drawn by a node.
#[derive(Clone, Copy)]
struct Drawn {
    node: usize,
    mesh: usize,
    primitive: usize,
    /// Whether its triangles are those of a tube, not of the primitive.
    is_tube: bool,
    /// For nodes with instances: the instance, within the node.
    instance: Option<Placement>,
}

/// Reads a document; `json` is its text, given if materials are needed.
fn read<'a>(
    document: &'a Document,
    bin: Option<&'a [u8]>,
    json: Option<&[u8]>,
    name: &str,
    folder: Option<&'a Path>,
    options: &'a ImportOptions,
) -> Result<Reading<'a>, ImportError> {
    let metres_per_unit = options.metres_per_unit.unwrap_or(1.0);
    let source = Source { format: "glTF".into(), metres_per_unit, up: options.up(), notes: Vec::new() };
    let beside = Sidecars { folder, under: options.files_under.as_deref() };
    let files = document.image_uris().filter(|uri| !uri.starts_with("data:")).map(|uri| data::percent_decoded(&uri));
    let missing = textures::note_of_missing(files, beside);
    let buffers = Buffers::new(document, bin, beside);
    let axes = DVec3::AXES.map(|axis| options.upright(axis) * metres_per_unit);
    let mut importer = Importer {
        document,
        root: DAffine3::from_mat3(DMat3::from_cols(axes[0], axes[1], axes[2])),
        naming: Naming::read(folder, name)?,
        by_name: ByName::default(),
        names: names(document),
        levels: levels(document),
        helpers: Helpers::default(),
        motion: Motion::read(document, &buffers),
        joints: HashMap::new(),
        morphs_read: 0,
        moved: 0,
        bodies: 0,
        alpha: Alpha::read(document, &buffers),
        looks: json.map(|json| Looks::read(json, &buffers)),
        buffers,
        builder: SceneBuilder::new(options, source),
        parts: document.meshes.iter().map(|_| None).collect(),
        authored: Authored::default(),
        left_out: LeftOut::default(),
        skinned: 0,
        tube_radius: options.tube_radius,
        lines: Lines::default(),
        lines_of_tubes: HashSet::new(),
        drawn: Vec::new(),
        undrawn: Vec::new(),
    };
    importer.walk()?;
    importer.builder.source.notes.extend(missing);
    importer.finish(name)
}

/// A node on the stack, with the properties that it inherits.
#[derive(Clone, Copy)]
struct Visit {
    node: usize,
    parent: DAffine3,
    role: Role,
    /// Whether its name says glass or opaque.
    glass: Option<bool>,
    /// Whether the author set the role, so that names are ignored.
    told: bool,
    /// Whether the author or a rules file set it, so that neither a table nor an animation overrides it.
    by_hand: bool,
    /// Whether engines do not draw it.
    helper: bool,
    /// Whether an animation moves it, or shows and hides it.
    moves: bool,
    fades: bool,
    /// Whether physics moves it.
    is_body: bool,
    level: Option<Level>,
    room: Option<usize>,
    outside: bool,
}

impl Visit {
    /// Applies the meaning of a name, unless the author set more.
    fn is_named(&mut self, told: Option<Told>) {
        let Some(Told { kind, by_hand }) = told.filter(|told| !self.told && (told.by_hand || !self.by_hand)) else { return };
        self.by_hand |= by_hand;
        match kind {
            Kind::Glass | Kind::Opaque => self.glass = kind.role().1,
            kind => (self.role, self.glass) = kind.role(),
        }
    }
}

struct Importer<'a> {
    document: &'a Document,
    /// World transform of the scene: its axes and its unit.
    root: DAffine3,
    /// Lower-case names of all nodes with a mesh.
    names: HashSet<String>,
    /// Levels of detail, by node.
    levels: Vec<Option<Level>>,
    helpers: Helpers,
    motion: Motion,
    /// Joints by skin.
    joints: HashMap<usize, Rc<Joints>>,
    /// Vertices of morph targets so far.
    morphs_read: usize,
    /// Meshes that animations move.
    moved: usize,
    /// Meshes that only physics moves.
    bodies: usize,
    naming: Naming,
    by_name: ByName,
    buffers: Buffers<'a>,
    alpha: Alpha,
    looks: Option<Looks>,
    builder: SceneBuilder,
    /// Primitives by mesh, read on first use.
    parts: Vec<Option<Rc<Vec<Option<Part>>>>>,
    authored: Authored,
    left_out: LeftOut,
    skinned: usize,
    /// Radius of tubes along lines without one, metres.
    tube_radius: Option<f64>,
    lines: Lines,
    /// Meshes and primitives of lines that became tubes.
    lines_of_tubes: HashSet<(usize, usize)>,
    /// See [`Reading`].
    drawn: Vec<Drawn>,
    undrawn: Vec<usize>,
}

impl<'a> Importer<'a> {
    fn walk(&mut self) -> Result<(), ImportError> {
        let mut seen = vec![false; self.document.node_count()];
        let mut stack = Vec::new();
        for root in roots(self.document)? {
            stack.push(Visit {
                node: root,
                parent: self.root,
                role: Role::Unknown,
                glass: None,
                told: false,
                by_hand: false,
                helper: false,
                moves: false,
                fades: false,
                is_body: false,
                level: None,
                room: None,
                outside: false,
            });
            while let Some(mut visit) = stack.pop() {
                if std::mem::replace(&mut seen[visit.node], true) {
                    return Err(broken(format!("node {} is in the scene twice", visit.node)));
                }
                let node = self.document.node(visit.node);
                visit.parent *= transform(node, visit.node)?;
                self.visit(node, &mut visit)?;
                stack.extend(node.children.iter().rev().map(|&child| Visit { node: child, ..visit }));
            }
        }
        Ok(())
    }

    /// Adds a node; `visit.parent` is its own world transform by now, and `visit` becomes the state that its children inherit.
    fn visit(&mut self, node: &Node, visit: &mut Visit) -> Result<(), ImportError> {
        let mesh = node.mesh.map(|mesh| entry(&self.document.meshes, mesh, "mesh")).transpose()?;
        let mesh_name = mesh.and_then(|m| m.name.as_deref());
        let name = match node.name.as_deref().or(mesh_name).filter(|name| !name.is_empty()) {
            Some(name) => short_name(name),
            None => format!("node {}", visit.node),
        };
        let extras = Extras::parse(node.extras.as_deref(), &name)?;
        let named = Named::parse(&name);
        match extras.role {
            Some(role) => (visit.role, visit.told, visit.by_hand) = (Role::from(role), true, true),
            None => visit.is_named(self.naming.of(&name, "")),
        }
        let unread = |e: serde_json::Error| broken(format!("node {name}: its extensions: {e}"));
        let extensions = node.extensions().map_err(unread)?;
        let written = node.written();
        visit.helper |= written.iter().any(helpers::is_hidden)
            || helpers::is_helper(helpers::Mesh { name: &name, material: Some(""), has_name: None });
        visit.moves |= self.motion.moves(visit.node);
        visit.is_body |= is_body(&name, &written[1]);
        visit.fades |= self.motion.shows(visit.node);
        visit.level = self.levels[visit.node].or(visit.level);
        self.enter_room(visit, &name, &named, extras.room);
        let Some(mesh) = node.mesh else { return Ok(()) };
        self.skinned += usize::from(node.skin.is_some());
        let parts = self.parts_of(mesh)?;
        let named = match named {
            Named::Portal(_) if extras.portal.is_none() && !self.may_be_portal(mesh, &parts) => {
                self.authored.drawn(&name);
                Named::Plain
            }
            named => named,
        };
        let is_drawn = extras.portal.is_none() && !matches!(named, Named::Portal(_) | Named::Bound);
        self.undrawn.extend((!is_drawn).then_some(visit.node));
        match (named, extras.portal) {
            (_, Some(rooms)) => self.portal(&name, visit, rooms, &parts),
            (Named::Portal(room), _) => self.portal(&name, visit, [String::new(), room], &parts),
            (Named::Bound, _) => {
                let triangles = self.world_triangles(&parts, visit.parent)?;
                self.authored.bound(&name, visit.room, triangles.into_iter());
                Ok(())
            }
            _ => match &extensions.instancing {
                None => self.add(&name, mesh, visit, None, &parts, extras.tube.as_ref()),
                Some(instancing) => {
                    for (i, instance) in instances(&self.buffers, instancing)?.into_iter().enumerate() {
                        self.add(&format!("{name}@{i}"), mesh, visit, Some(instance), &parts, extras.tube.as_ref())?;
                    }
                    Ok(())
                }
            },
        }
    }

    /// Enters the room that a node is, or the group of rooms.
    fn enter_room(&mut self, visit: &mut Visit, name: &str, named: &Named, room: Option<RoomName>) {
        match (named, room) {
            (_, Some(RoomName::Name(room))) => visit.room = Some(self.authored.room_named(name, &room, visit.outside)),
            (_, Some(RoomName::IsRoom(false))) => {}
            (Named::Room(room), _) => visit.room = Some(self.authored.room(name, room, visit.outside)),
            (_, Some(RoomName::IsRoom(true))) => visit.room = Some(self.authored.room(name, name, visit.outside)),
            _ => {}
        }
        if let Named::Group { outside } = *named {
            visit.outside |= outside;
        }
    }

    /// Whether a mesh can mark an opening: flat, and without a picture.
    fn may_be_portal(&self, mesh: usize, parts: &[Option<Part>]) -> bool {
        let materials =
            self.document.meshes[mesh].primitives.iter().filter_map(|p| self.document.materials.get(p.material?));
        let corners = |part: &Part| part.triangles.iter().map(|t| t.map(|i| part.positions[i as usize])).collect::<Vec<_>>();
        let triangles: Vec<[DVec3; 3]> = parts.iter().flatten().flat_map(corners).collect();
        !materials.into_iter().any(document::Material::has_picture) && authored::is_thin(&triangles)
    }

    /// The primitives of a mesh, read once.
    fn parts_of(&mut self, mesh: usize) -> Result<Rc<Vec<Option<Part>>>, ImportError> {
        if let Some(parts) = &self.parts[mesh] {
            return Ok(Rc::clone(parts));
        }
        let primitives = &self.document.meshes[mesh].primitives;
        let read = primitives.iter().map(|p| primitive::part(&self.buffers, p, &mut self.left_out));
        let parts = Rc::new(read.collect::<Result<Vec<_>, _>>()?);
        self.parts[mesh] = Some(Rc::clone(&parts));
        Ok(parts)
    }

    fn portal(&mut self, name: &str, visit: &Visit, rooms: [String; 2], parts: &[Option<Part>]) -> Result<(), ImportError> {
        let triangles = self.world_triangles(parts, visit.parent)?;
        self.authored.portal(name, visit.room, rooms, &triangles);
        Ok(())
    }

    /// All triangles of a mesh that is not drawn, in world coordinates.
    fn world_triangles(&mut self, parts: &[Option<Part>], world: DAffine3) -> Result<Vec<[DVec3; 3]>, ImportError> {
        let mirrored = world.matrix3.determinant() < 0.0;
        let mut out = Vec::new();
        for part in parts.iter().flatten() {
            self.builder.count(part.triangles.len())?;
            for &[a, b, c] in &part.triangles {
                let triangle = if mirrored { [a, c, b] } else { [a, b, c] };
                out.push(triangle.map(|i| world.transform_point3(part.positions[i as usize])));
            }
        }
        if out.iter().flatten().all(|p| p.is_finite()) {
            Ok(out)
        } else {
            Err(broken("a room's bound or a portal has a vertex that isn't finite"))
        }
    }

    fn finish(self, name: &str) -> Result<Reading<'a>, ImportError> {
        let Self { mut builder, buffers, parts, drawn, undrawn, .. } = self;
        let LeftOut { points_and_lines, without_positions, leftover_corners } = self.left_out;
        let moved = self.moved - self.skinned.min(self.moved);
        let notes = [
            (points_and_lines - self.lines_of_tubes.len(), NoteKind::Fault, "primitives of points or lines left out"),
            (without_positions, NoteKind::Detail, "primitives without positions left out"),
            (leftover_corners, NoteKind::Detail, "incomplete triangles at the end of triangle lists left out (corners)"),
            (self.motion.unread, NoteKind::Fault, "animations are not valid glTF; their nodes count as still"),
            (self.skinned, NoteKind::Taken, SKINNED),
            (moved, NoteKind::Taken, "meshes are animated: they hide nothing, and rows contain them in all poses"),
            (self.bodies, NoteKind::Taken, BODIES),
        ];
        builder.source.notes.extend(notes.into_iter().filter_map(|(count, kind, what)| Note::counted(kind, count, what)));
        builder.source.notes.extend(self.by_name.note());
        self.lines.finish(&mut builder)?;
        builder.source.notes.extend(self.helpers.note());
        builder.hints = self.authored.finish(&mut builder.source.notes);
        Ok(Reading { scene: builder.finish(name)?, buffers, parts, drawn, undrawn })
    }
}

/// Notes about skinned meshes and about bodies.
const SKINNED: &str = "skinned meshes hide nothing, and rows contain them in all poses of the file; draw them always if you play other animations";
const BODIES: &str = "meshes are physics bodies: they hide nothing; rows contain them only at their first position; draw them always once they move";
