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
mod hull;
mod looks;
mod meshopt;
mod motion;
pub(crate) mod pictures;
mod placement;
mod primitive;
mod tubes;

use super::helpers::{self, Helpers};
use super::lines::{Line, Lines};
use super::lod::{self, Level};
use super::textures;
use alpha::Alpha;
pub(super) use authored::flat_hull;
use authored::{Authored, Extras, Named, RoomName};
use bent::{Joints, Weights};
pub(crate) use cut::cut_file;
use data::{Buffers, broken, entry};
use document::{Document, Instancing, Node, Primitive};
use enfilade::geom::Aabb;
use enfilade::scene::builder::{Facts, short_name};
use enfilade::scene::naming::{ByName, Kind, Naming, Told};
use enfilade::scene::sidecar::Sidecars;
use enfilade::scene::sky::Backdrop;
use enfilade::scene::{ImportError, ImportOptions, Mesh, Role, Scene, SceneBuilder, Source, whole_file};
use enfilade::types::note::{Note, NoteKind};
use glam::{DAffine3, DMat3, DQuat, DVec3};
use looks::Looks;
use motion::Motion;
use placement::{Placement, transform};
use primitive::{LeftOut, Part};
use std::collections::{HashMap, HashSet};
use std::path::Path;
use std::rc::Rc;
use tubes::Tube;

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

/// A mesh drawn by a node.
#[derive(Clone, Copy)]
struct Place {
    node: usize,
    mesh: usize,
    instance: Option<Placement>,
    /// World transform of the mesh in the file's pose.
    world: DAffine3,
    /// Whether an animation moves the node or an ancestor.
    moves: bool,
}

/// A primitive in the world.
struct Placed {
    positions: Vec<DVec3>,
    /// Bounds of all poses; `None` if it has only one.
    reach: Option<Aabb>,
    /// Whether an animation or a skeleton may move or bend it.
    moves: bool,
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
        match (&named, extras.room) {
            (_, Some(RoomName::Name(room))) => visit.room = Some(self.authored.room_named(&name, &room, visit.outside)),
            (_, Some(RoomName::IsRoom(false))) => {}
            (Named::Room(room), _) => visit.room = Some(self.authored.room(&name, room, visit.outside)),
            (_, Some(RoomName::IsRoom(true))) => visit.room = Some(self.authored.room(&name, &name, visit.outside)),
            _ => {}
        }
        if let Named::Group { outside } = named {
            visit.outside |= outside;
        }
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

    /// Adds visible geometry.
    fn add(
        &mut self,
        name: &str,
        mesh: usize,
        visit: &Visit,
        instance: Option<Placement>,
        parts: &[Option<Part>],
        tube: Option<&Tube>,
    ) -> Result<(), ImportError> {
        if self.add_tubes(name, mesh, visit, instance, tube)? {
            return Ok(());
        }
        let world = instance.map_or(visit.parent, |instance| visit.parent * instance.transform());
        let mirrored = world.matrix3.determinant() < 0.0;
        let place = Place { node: visit.node, mesh, instance, world, moves: visit.moves || visit.is_body };
        for (i, (part, primitive)) in parts.iter().zip(&self.document.meshes[mesh].primitives).enumerate() {
            let Some(part) = part else { continue };
            let material = primitive.material.map(|m| entry(&self.document.materials, m, "material")).transpose()?;
            let mut visit = *visit;
            visit.is_named(self.naming.of(name, material.map_or("", |m| m.name())));
            self.by_name.count(visit.role, !visit.told);
            let has_name = |name: &str| self.names.contains(name);
            let of_material = helpers::Mesh { name, material: material.map(|m| m.name()), has_name: Some(&has_name) };
            let is_lower = visit.level.is_some_and(|level| !level.is_finest);
            if !visit.by_hand && (visit.helper || is_lower || helpers::is_helper(of_material)) {
                (visit.role, visit.glass) = (Role::Helper, Some(false));
            }
            if visit.role == Role::Helper && i == 0 {
                self.helpers.count(name);
            }
            let Placed { positions, reach, moves } = self.placed(&place, primitive, part)?;
            let may_move = (moves || visit.fades) && !visit.by_hand;
            if may_move && matches!(visit.role, Role::Structure | Role::Unknown) {
                visit.role = Role::Furnishing;
            }
            let by_physics = visit.is_body && !visit.moves && !visit.fades;
            *if by_physics { &mut self.bodies } else { &mut self.moved } += usize::from(may_move && i == 0);
            let hides = !may_move && !matches!(visit.role, Role::Door | Role::Window | Role::Helper | Role::Sky);
            let turned = |&triangle: &[u32; 3]| turned(triangle, mirrored);
            self.authored.furnish(visit.room, &positions);
            let has_alpha = || {
                primitive.attributes.colour.is_some()
                    || primitive.material.is_none_or(|m| !self.alpha.is_one(m) || self.motion.changes(m))
            };
            let shows = |m: &document::Material| m.transmits() || m.has_alpha_mode() && has_alpha();
            let glass = visit.glass.unwrap_or_else(|| material.is_some_and(shows));
            self.drawn.push(Drawn { node: visit.node, mesh, primitive: i, is_tube: false, instance });
            if let Some((look, coordinates)) = self.looks.as_ref().and_then(|l| l.of(&self.buffers, [mesh, i], part)) {
                let coordinates = coordinates.into_iter().map(|triangle| self::turned(triangle, mirrored));
                self.builder.look(look, coordinates.collect());
            }
            let mesh = Mesh {
                node: if parts.len() > 1 { format!("{name}/{i}") } else { name.to_owned() },
                role: visit.role,
                opaque: hides && !glass,
                positions,
                triangles: part.triangles.iter().map(turned).collect(),
            };
            self.builder.facts(Facts {
                reach: reach.filter(|_| may_move),
                group: visit.level.map(|level| level.group),
                unlit: material.is_some_and(document::Material::is_unlit),
                told: visit.by_hand,
                backdrop: Backdrop::named(name, material.map_or("", |m| m.name())),
            });
            if glass {
                self.builder.add_glass(mesh)?;
            } else if hides {
                self.builder.add(mesh)?;
            } else {
                self.builder.add_moving(mesh)?;
            }
        }
        Ok(())
    }

    /// The vertices of a primitive in the world, and the bounds of all poses.
    fn placed(&mut self, place: &Place, primitive: &Primitive, part: &Part) -> Result<Placed, ImportError> {
        let (document, root) = (self.document, self.root);
        let Place { node, mesh, instance, world, moves } = *place;
        let weights = document.node(node).weights.as_deref().unwrap_or(&document.meshes[mesh].weights);
        let ranges = self.motion.weights(node);
        let morphed = bent::morph(&self.buffers, primitive, part, weights, ranges, &mut self.morphs_read)?;
        let range = morphed.range.unwrap_or_default();
        if let Some(joints) = document.node(node).skin.map(|skin| self.joints_of(skin)).transpose()?
            && let Some(weights) = Weights::read(&self.buffers, primitive, part, joints.len())?
        {
            let positions = weights.bend(&joints, &morphed.positions);
            if !joints.moves && range.is_empty() {
                return Ok(Placed { positions, reach: None, moves: true });
            }
            let points = || morphed.positions.iter().map(|&p| [p, p]).collect();
            let range = if range.is_empty() { points() } else { range };
            let reach = weights.sweep(document, &self.motion, &joints, &range, root)?;
            return Ok(Placed { positions, reach: Some(reach), moves: true });
        }
        let positions: Vec<DVec3> = morphed.positions.iter().map(|&p| world.transform_point3(p)).collect();
        if !moves && range.is_empty() {
            return Ok(Placed { positions, reach: None, moves: false });
        }
        let within = if range.is_empty() { Aabb::of(finite(morphed.positions)) } else { Aabb::of(finite(range.concat())) };
        let instanced = |p: DVec3| instance.map_or(p, |instance| instance.transform().transform_point3(p));
        let reach = match within.is_empty() {
            true => None,
            false => Some(self.motion.sweep(document, node, &motion::corners(within).map(instanced), root)?),
        };
        Ok(Placed { positions, reach, moves: true })
    }

    /// The joints of a skin, read once.
    fn joints_of(&mut self, skin: usize) -> Result<Rc<Joints>, ImportError> {
        if let Some(joints) = self.joints.get(&skin) {
            return Ok(Rc::clone(joints));
        }
        let of = entry(&self.document.skins, skin, "skin")?;
        let joints = Rc::new(Joints::read(self.document, &self.buffers, of, &self.motion, self.root)?);
        self.joints.insert(skin, Rc::clone(&joints));
        Ok(joints)
    }

    /// Adds the tubes of a node with a mesh. Returns true if they replace the whole mesh.
    fn add_tubes(
        &mut self,
        name: &str,
        mesh: usize,
        visit: &Visit,
        instance: Option<Placement>,
        tube: Option<&Tube>,
    ) -> Result<bool, ImportError> {
        let world = instance.map_or(visit.parent, |instance| visit.parent * instance.transform());
        let stands_for_mesh = tube.is_some_and(|tube| !tube.points.is_empty());
        let default = self.tube_radius.map(|radius| Tube::of_radius(radius / tubes::scale(&world).unwrap_or(1.0)));
        let has_lines = self.document.meshes[mesh].primitives.iter().any(tubes::is_of_lines);
        let Some(given) = tube.or(default.as_ref()).filter(|_| stands_for_mesh || has_lines) else { return Ok(false) };
        let (place, tube) = (if tube.is_some() { "extras.enfilade.tube" } else { "its lines" }, given);
        let scale = match tubes::scale(&world) {
            Some(scale) => scale,
            None if stands_for_mesh || default.is_some() => return Ok(false),
            None => return Err(broken(format!("node {name}: a tube needs the same scale in all directions"))),
        };
        let shape = tube.shape(scale);
        if stands_for_mesh && self.builder.has_tubes() {
            let points: Vec<DVec3> = tube.points.iter().map(|&p| world.transform_point3(p.into())).collect();
            let line = Line { name, place: &format!("node {name}: {place}"), points: &points, ..tube.line(shape) };
            self.add_line(&line, [mesh, 0], visit, instance)?;
            return Ok(true);
        }
        let document = self.document;
        for (i, primitive) in document.meshes[mesh].primitives.iter().enumerate().filter(|_| !stands_for_mesh) {
            if tubes::is_of_lines(primitive) {
                self.lines_of_tubes.insert((mesh, i));
            }
            for points in tubes::polylines(&self.buffers, primitive)? {
                let points: Vec<DVec3> = points.iter().map(|&p| world.transform_point3(p)).collect();
                let closed = tube.closed || primitive.mode == Some(tubes::LOOP);
                let place = format!("node {name}: {place}");
                let line = Line { name, place: &place, points: &points, closed, ..tube.line(shape) };
                self.add_line(&line, [mesh, i], visit, instance)?;
            }
        }
        Ok(false)
    }

    fn add_line(
        &mut self,
        line: &Line<'_>,
        [mesh, primitive]: [usize; 2],
        visit: &Visit,
        instance: Option<Placement>,
    ) -> Result<(), ImportError> {
        let part = Part { positions: Vec::new(), vertices: Vec::new(), triangles: Vec::new() };
        if let Some((look, _)) = self.looks.as_ref().and_then(|l| l.of(&self.buffers, [mesh, primitive], &part)) {
            self.builder.look(look, Vec::new());
        }
        self.authored.furnish(visit.room, line.points);
        self.drawn.push(Drawn { node: visit.node, mesh, primitive, is_tube: true, instance });
        self.lines.add(&mut self.builder, line)
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
            Err(broken("a room's bound or a portal has a vertex that is not a finite number"))
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
const BODIES: &str = "meshes are physics bodies: they hide nothing; rows contain them in their first place only, so draw them always once they move";

/// Finite points only.
fn finite(points: Vec<DVec3>) -> impl Iterator<Item = DVec3> {
    points.into_iter().filter(|p| p.is_finite())
}

/// The corners of a triangle, reversed if its node is mirrored.
fn turned<T>([a, b, c]: [T; 3], mirrored: bool) -> [T; 3] {
    if mirrored { [a, c, b] } else { [a, b, c] }
}

/// The roots to show: of the default scene, else of the first, else every node without a parent. Checks the node graph: children
/// exist, no node has two parents, and none is its own ancestor.
fn roots(document: &Document) -> Result<Vec<usize>, ImportError> {
    let n = document.node_count();
    let mut has_parent = vec![false; n];
    for i in 0..n {
        for &child in &document.node(i).children {
            match has_parent.get_mut(child) {
                None => return Err(broken(format!("node {i} has child {child}, there are {n} nodes"))),
                Some(true) => return Err(broken(format!("node {child} has two parents"))),
                Some(has) => *has = true,
            }
        }
    }
    let orphans: Vec<usize> = (0..n).filter(|&i| !has_parent[i]).collect();
    // With at most one parent per node, every node not reached from an orphan is in or below a cycle.
    let mut reached = vec![false; n];
    let mut stack = orphans.clone();
    while let Some(node) = stack.pop() {
        reached[node] = true;
        stack.extend(&document.node(node).children);
    }
    if let Some(node) = reached.iter().position(|r| !r) {
        return Err(broken(format!("node {node} is in a cycle of nodes, or below one")));
    }
    let scene = match document.scene {
        Some(scene) => Some(entry(&document.scenes, scene, "scene")?),
        None => document.scenes.first(),
    };
    let Some(scene) = scene else { return Ok(orphans) };
    match scene.nodes.iter().find(|&&node| node >= n) {
        Some(node) => Err(broken(format!("the scene has node {node}, there are {n} nodes"))),
        None => Ok(scene.nodes.clone()),
    }
}

/// Lower-case names of all nodes with a mesh.
fn names(document: &Document) -> HashSet<String> {
    let nodes = (0..document.node_count()).map(|i| document.node(i)).filter(|node| node.mesh.is_some());
    nodes.filter_map(|node| node.name.as_deref()).map(str::to_lowercase).collect()
}

/// Levels of detail by node: from MSFT_lod, else from names.
fn levels(document: &Document) -> Vec<Option<Level>> {
    let count = document.node_count();
    let mut parents = vec![None; count];
    for i in 0..count {
        let children = document.node(i).children.iter().filter(|&&child| child < count);
        children.for_each(|&child| parents[child] = Some(i));
    }
    let name = |i: usize| {
        let node = document.node(i);
        let of_mesh = || document.meshes.get(node.mesh?)?.name.as_deref();
        node.name.as_deref().or_else(of_mesh).unwrap_or_default()
    };
    let nodes: Vec<(Option<usize>, &str)> = (0..count).map(|i| (parents[i], name(i))).collect();
    let mut levels = lod::levels(&nodes);
    let mut next = levels.iter().flatten().map(|level| level.group + 1).max().unwrap_or(0);
    for i in 0..count {
        let coarser = document.node(i).extensions().ok().and_then(|e| e.levels).map(|levels| levels.ids).unwrap_or_default();
        let coarser: Vec<usize> = coarser.into_iter().filter(|&id| id < count && id != i).collect();
        if !coarser.is_empty() {
            levels[i] = Some(Level { group: next, is_finest: true });
            coarser.into_iter().for_each(|id| levels[id] = Some(Level { group: next, is_finest: false }));
            next += 1;
        }
    }
    levels
}

/// Whether physics moves a node: by Godot's names or by an extension.
fn is_body(name: &str, extensions: &serde_json::Value) -> bool {
    let name = name.to_lowercase();
    let by_name = ["rigid", "vehicle", "wheel"].iter().any(|kind| {
        let name = name.trim_end_matches(|c: char| c.is_ascii_digit() || c == '.');
        name.strip_suffix(kind).is_some_and(|rest| rest.ends_with(['-', '$']))
    });
    let motions = [extensions.pointer("/KHR_physics_rigid_bodies/motion"), extensions.pointer("/OMI_physics_body/motion")];
    let is_static = |motion: &serde_json::Value| motion["type"] == "static";
    by_name || motions.into_iter().flatten().any(|motion| !is_static(motion))
}

/// The transforms of EXT_mesh_gpu_instancing.
fn instances(buffers: &Buffers, instancing: &Instancing) -> Result<Vec<Placement>, ImportError> {
    let open = |index: Option<usize>, kind| index.map(|i| buffers.accessor(i, &[kind])).transpose();
    let attributes = &instancing.attributes;
    let translations = open(attributes.translation, "VEC3")?;
    let rotations = open(attributes.rotation, "VEC4")?;
    let scales = open(attributes.scale, "VEC3")?;
    let mut counts = [&translations, &rotations, &scales].into_iter().flatten().map(|a| a.count());
    let count = counts.next().unwrap_or(0);
    if counts.any(|c| c != count) {
        return Err(broken("EXT_mesh_gpu_instancing: attributes of different counts"));
    }
    let instance = |i| {
        let get = |a: &Option<data::Accessor>, default| a.as_ref().and_then(|a| a.get(i)).unwrap_or(default);
        let [tx, ty, tz, _] = get(&translations, [0.0; 4]);
        let [sx, sy, sz, _] = get(&scales, [1.0; 4]);
        let rotation = DQuat::from_array(get(&rotations, [0.0, 0.0, 0.0, 1.0]));
        Placement::new(DVec3::new(sx, sy, sz), rotation, DVec3::new(tx, ty, tz))
    };
    Ok((0..count).map(instance).collect())
}
