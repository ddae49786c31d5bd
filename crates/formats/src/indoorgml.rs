//! IndoorGML 1.0 and 1.1 (OGC 14-005): a building as cell spaces and the transitions between them.
//!
//! [`read`] reads the document. [`import`] makes a scene of it for a building without another mesh: the surface of every cell
//! space becomes an object, without the surfaces of transitions. [`read_indoorgml`] reads the graph itself.
//!
//! Supported: cell spaces (also extensions of `CellSpace`) with a solid of polygons, cell space boundaries with a polygon, states
//! and transitions, and the links between them, in one file. Of several space layers the first with transitions is used. Lengths
//! are metres unless [`ImportOptions::metres_per_unit`] is set; +Z up becomes +Y up: `(x, y, z)` becomes `(x, z, -y)`. Document
//! types, and so entities other than XML's own, are errors.

mod cells;
mod surfaces;

pub use cells::read_indoorgml;
use enfilade::math::polygon::Polygon;
use enfilade::scene::builder::short_name;
use enfilade::scene::{
    Hints, ImportError, ImportOptions, OpeningHint, OpeningKind, Place, RoomHint, Scene, SceneBuilder, Source, whole_file,
};
use enfilade::types::note::Note;
use glam::DVec3;
use roxmltree::{Document, Node};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use surfaces::{Skin, hull, skin, triangles};

/// Ratio of the areas of a portal's hull and the portal above which a note is printed.
const CONVEX: f64 = 1.05;

const GML: [&str; 2] = ["http://www.opengis.net/gml/3.2", "http://www.opengis.net/gml"];
const CORE: &str = "http://www.opengis.net/indoorgml/1.";
const XLINK: &str = "http://www.w3.org/1999/xlink";
/// Greatest valid coordinate, as in [`SceneBuilder`].
const FARTHEST: f64 = 1e12;
/// Distance of corners from a polygon's plane, as a share of its extent, above which a note is printed.
const FLAT: f64 = 1e-3;

/// A cell space: a room, a corridor, a stair.
#[derive(Clone, PartialEq, Debug)]
pub struct CellSpace {
    /// Its `gml:id`.
    pub id: String,
    /// Its `gml:name`, else its id.
    pub name: String,
    /// The polygons of its solid, facing either way.
    pub(crate) surface: Vec<Polygon>,
}

/// A connection from one cell space to another.
#[derive(Clone, PartialEq, Debug)]
pub struct Transition {
    /// Its `gml:id`; of several between two cells through one place, the first.
    pub id: String,
    /// Indices of its cell spaces.
    pub cells: [usize; 2],
    /// Its surface, if the file has one.
    pub boundary: Option<Boundary>,
}

/// A cell space boundary: the surface between two cell spaces, or the door in it.
#[derive(Clone, PartialEq, Debug)]
pub struct Boundary {
    /// Its `gml:id`.
    pub id: String,
    /// Whether it is a connection or an anchor: a door.
    pub door: bool,
    /// Its outline: planar and convex, if necessary its hull.
    pub winding: Vec<DVec3>,
}

/// A document.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct IndoorGml {
    /// Cell spaces with a solid, in file order.
    pub spaces: Vec<CellSpace>,
    /// Transitions in file order, each once, in either direction.
    pub transitions: Vec<Transition>,
    /// Problems and repairs, one line each.
    pub notes: Vec<Note>,
}

impl IndoorGml {
    /// Tolerance for comparing coordinates, metres: as [`enfilade::math::tolerance::Tolerance::coplanar`].
    pub(crate) fn coplanar(&self) -> f64 {
        let corners = self.spaces.iter().flat_map(|s| &s.surface).flat_map(|p| p.rings.iter().flatten().copied());
        enfilade::math::tolerance::Tolerance::for_extent(enfilade::math::geom::Aabb::of(corners).diagonal()).coplanar
    }
}

/// Reads a document; coordinates become metres (by `metres_per_unit`), +Y up.
pub fn read(text: &str, metres_per_unit: f64) -> Result<IndoorGml, ImportError> {
    let document = Document::parse(text).map_err(|e| {
        let what = match &e {
            roxmltree::Error::DtdDetected => "document types are not supported; delete the <!DOCTYPE>".to_owned(),
            // Without its own place, which precedes the message.
            e => e.to_string().rsplit_once(" at ").map_or_else(|| e.to_string(), |(what, _)| what.to_owned()),
        };
        ImportError::malformed(Place::Line(e.pos().row as usize), format!("not well-formed XML: {what}"))
    })?;
    let root = document.root_element();
    if !is_core(&root, "IndoorFeatures") {
        let name = root.tag_name();
        let what = format!(
            "not IndoorGML 1: the root is <{}> of namespace `{}`, not IndoorFeatures of {CORE}0/core",
            short_name(name.name()),
            short_name(name.namespace().unwrap_or_default()),
        );
        return Err(ImportError::malformed(line(&root), what));
    }
    let mut reader = Reader { scale: metres_per_unit, ids: HashMap::new(), notes: Vec::new() };
    for node in root.descendants().filter(Node::is_element) {
        if let Some(id) = id_of(&node)
            && let Some(first) = reader.ids.insert(id, node)
        {
            let Place::Line(first) = line(&first) else { continue };
            let what = format!("gml:id `{}` occurs twice; first in line {first}", short_name(id));
            return Err(ImportError::malformed(line(&node), what));
        }
    }
    let mut model = reader.document(&root)?;
    // Polygons that are not flat become their triangles.
    let eps = model.coplanar();
    for space in &mut model.spaces {
        let surface = std::mem::take(&mut space.surface).into_iter();
        let flattened = surface.flat_map(|polygon| match polygon.off_plane() <= eps {
            true => vec![polygon],
            false => triangles(&polygon, &[], eps).into_iter().filter_map(|t| Polygon::new(vec![t.to_vec()])).collect(),
        });
        space.surface = flattened.collect();
    }
    Ok(model)
}

/// Reads a `.gml` file into a scene; see [`self`].
pub fn import(path: &Path, options: &ImportOptions) -> Result<Scene, ImportError> {
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    let bytes = whole_file::model(path)?;
    let text = std::str::from_utf8(&bytes).map_err(|e| ImportError::malformed(Place::Byte(e.valid_up_to()), "not UTF-8"))?;
    from_str(text, &name, options)
}

/// Reads a document in memory into a scene.
pub fn from_str(text: &str, name: &str, options: &ImportOptions) -> Result<Scene, ImportError> {
    let metres_per_unit = options.metres_per_unit.unwrap_or(1.0);
    let model = read(text, metres_per_unit)?;
    let notes = model.notes.clone();
    let source = Source { format: "IndoorGML".into(), metres_per_unit, up: "+Z".into(), notes };
    let mut builder = SceneBuilder::new(options, source);
    let mut hints = Hints::default();
    for (space, Skin { mesh, surface }) in model.spaces.iter().zip(skin(&model)) {
        builder.count(surface.len())?;
        builder.add(mesh)?;
        hints.rooms.push(RoomHint {
            id: space.id.clone(),
            name: space.name.clone(),
            storey: None,
            surface,
            outside: false,
            drawn: true,
        });
    }
    for transition in &model.transitions {
        let Some(boundary) = &transition.boundary else { continue };
        hints.openings.push(OpeningHint {
            id: boundary.id.clone(),
            kind: if boundary.door { OpeningKind::Door } else { OpeningKind::Opening },
            winding: boundary.winding.clone(),
            thickness: 0.0,
            rooms: transition.cells.map(Some),
        });
    }
    builder.hints = hints;
    builder.finish(name)
}

fn is_core(node: &Node<'_, '_>, name: &str) -> bool {
    let tag = node.tag_name();
    node.is_element() && tag.name() == name && tag.namespace().is_some_and(|n| n.starts_with(CORE))
}

fn is_gml(node: &Node<'_, '_>, name: &str) -> bool {
    let tag = node.tag_name();
    node.is_element() && tag.name() == name && tag.namespace().is_some_and(|n| GML.contains(&n))
}

fn id_of<'a>(node: &Node<'a, '_>) -> Option<&'a str> {
    GML.iter().find_map(|&namespace| node.attribute((namespace, "id")))
}

fn line(node: &Node<'_, '_>) -> Place {
    Place::Line(node.document().text_pos_at(node.range().start).row as usize)
}

fn broken<T>(node: &Node<'_, '_>, what: impl Into<String>) -> Result<T, ImportError> {
    Err(ImportError::malformed(line(node), what))
}

/// The element in a member such as `cellSpaceMember`.
fn member<'a, 'i>(node: &Node<'a, 'i>) -> Option<Node<'a, 'i>> {
    node.children().find(Node::is_element)
}

/// The elements with a name below a node.
fn named<'a, 'i>(below: &Node<'a, 'i>, name: &'static str) -> impl Iterator<Item = Node<'a, 'i>> {
    below.descendants().filter(move |n| is_core(n, name))
}

/// The elements in the members with a name below a node.
fn members<'a, 'i>(below: &Node<'a, 'i>, name: &'static str) -> impl Iterator<Item = Node<'a, 'i>> {
    named(below, name).filter_map(|n| member(&n))
}

/// Geometry of the elements of the graph.
struct Duality<'a, 'i> {
    /// Space by state.
    space_of: HashMap<Node<'a, 'i>, Node<'a, 'i>>,
    /// Boundary by transition, from links of boundaries.
    boundary_of: HashMap<Node<'a, 'i>, Node<'a, 'i>>,
}

struct Reader<'a, 'i> {
    scale: f64,
    ids: HashMap<&'a str, Node<'a, 'i>>,
    notes: Vec<Note>,
}

impl<'a, 'i> Reader<'a, 'i> {
    fn document(mut self, root: &Node<'a, 'i>) -> Result<IndoorGml, ImportError> {
        let layers: Vec<Node> = named(root, "SpaceLayer").collect();
        let with_edges = |l: &&Node| l.descendants().any(|n| is_core(&n, "transitionMember"));
        let layer = layers.iter().find(with_edges).or(layers.first()).copied().unwrap_or(*root);
        if layers.len() > 1 {
            let id = short_name(id_of(&layer).unwrap_or("without an id"));
            self.notes.push(Note::taken(format!("{} space layers; only {id} is read", layers.len())));
        }
        let dual = self.duality(root, &layer)?;
        let mut model = IndoorGml::default();
        let (place, flat) = self.spaces(root, &dual, layers.len() < 2, &mut model)?;
        if model.spaces.is_empty() {
            return broken(root, "no cell space has a solid; export the model in three dimensions");
        }
        self.transitions(&layer, &dual, &place, &mut model)?;
        if flat > 0 {
            self.notes.push(Note::fault(format!("{flat} cell spaces without a solid left out")));
        }
        model.notes = self.notes;
        Ok(model)
    }

    /// Links may be on either side or on both.
    fn duality(&self, root: &Node<'a, 'i>, layer: &Node<'a, 'i>) -> Result<Duality<'a, 'i>, ImportError> {
        let mut dual = Duality { space_of: HashMap::new(), boundary_of: HashMap::new() };
        for state in members(layer, "stateMember") {
            if let Some(space) = self.linked(&state, "duality")?.first() {
                dual.space_of.insert(state, *space);
            }
        }
        for space in members(root, "cellSpaceMember") {
            for state in self.linked(&space, "duality")? {
                dual.space_of.entry(state).or_insert(space);
            }
        }
        for boundary in members(root, "cellSpaceBoundaryMember") {
            for transition in self.linked(&boundary, "duality")? {
                dual.boundary_of.entry(transition).or_insert(boundary);
            }
        }
        Ok(dual)
    }

    /// Adds cell spaces with a solid: all, or those with a state in the layer. Returns the index of each in the model, and the
    /// number without a solid.
    fn spaces(
        &mut self,
        root: &Node<'a, 'i>,
        dual: &Duality<'a, 'i>,
        all: bool,
        model: &mut IndoorGml,
    ) -> Result<(HashMap<Node<'a, 'i>, usize>, usize), ImportError> {
        let mut place = HashMap::new();
        let mut flat = 0;
        for space in members(root, "cellSpaceMember") {
            let in_layer = all || dual.space_of.values().any(|s| *s == space);
            if !in_layer {
                continue;
            }
            let surface = self.solid(&space)?;
            if surface.is_empty() {
                flat += 1;
                continue;
            }
            place.insert(space, model.spaces.len());
            let id = id_of(&space).map_or_else(|| format!("cell space {}", model.spaces.len()), short_name);
            let named = space.children().find(|n| is_gml(n, "name")).and_then(|n| n.text()).map(str::trim);
            let name = named.filter(|n| !n.is_empty()).map_or_else(|| id.clone(), short_name);
            model.spaces.push(CellSpace { id, name, surface });
        }
        Ok((place, flat))
    }

    /// Adds transitions; most occur twice, once in each direction.
    fn transitions(
        &mut self,
        layer: &Node<'a, 'i>,
        dual: &Duality<'a, 'i>,
        place: &HashMap<Node<'a, 'i>, usize>,
        model: &mut IndoorGml,
    ) -> Result<(), ImportError> {
        let mut seen: BTreeMap<[usize; 2], Vec<usize>> = BTreeMap::new();
        for node in members(layer, "transitionMember") {
            let states = self.linked(&node, "connects")?;
            let &[a, b] = states.as_slice() else {
                return broken(&node, format!("a transition connects two states, this one {}", states.len()));
            };
            let cells = [a, b].map(|s| dual.space_of.get(&s).and_then(|space| place.get(space)).copied());
            let [Some(a), Some(b)] = cells else { continue };
            if a == b {
                let id = short_name(id_of(&node).unwrap_or("a transition"));
                self.notes.push(Note::fault(format!("{id} leads from a cell space into itself; left out")));
                continue;
            }
            let boundary = match self.linked(&node, "duality")?.first().or(dual.boundary_of.get(&node)) {
                Some(boundary) => self.boundary(boundary)?,
                None => None,
            };
            let same = seen.entry([a.min(b), a.max(b)]).or_default();
            let known = same.iter().copied().find(|&i| is_same(&model.transitions[i].boundary, &boundary));
            if known.is_none() {
                same.push(model.transitions.len());
                let id = id_of(&node).map_or_else(|| format!("transition {}", model.transitions.len()), short_name);
                model.transitions.push(Transition { id, cells: [a, b], boundary });
            }
        }
        Ok(())
    }

    /// The targets of a node's children with this name.
    fn linked(&self, node: &Node<'a, 'i>, name: &str) -> Result<Vec<Node<'a, 'i>>, ImportError> {
        let mut found = Vec::new();
        for child in node.children().filter(|n| is_core(n, name)) {
            match child.attribute((XLINK, "href")) {
                Some(href) => found.push(self.target(&child, href)?),
                None => found.extend(member(&child)),
            }
        }
        Ok(found)
    }

    fn target(&self, from: &Node<'a, 'i>, href: &str) -> Result<Node<'a, 'i>, ImportError> {
        let Some(id) = href.strip_prefix('#') else {
            return broken(from, format!("`{}` is in another file; put it into this one", short_name(href)));
        };
        match self.ids.get(id) {
            Some(node) => Ok(*node),
            None => broken(from, format!("`{}`: no element has this gml:id; correct the link", short_name(href))),
        }
    }

    /// The polygons of a cell space's solid.
    fn solid(&mut self, space: &Node<'a, 'i>) -> Result<Vec<Polygon>, ImportError> {
        let geometry = space.children().filter(|n| is_core(n, "cellSpaceGeometry"));
        let Some(solid) = geometry.flat_map(|n| n.descendants()).find(|n| is_gml(n, "Solid")) else { return Ok(Vec::new()) };
        let mut polygons = Vec::new();
        for node in solid.descendants() {
            if is_surface(&node) {
                polygons.extend(self.polygon(&node)?);
            } else if is_gml(&node, "surfaceMember")
                && let Some(href) = node.attribute((XLINK, "href"))
            {
                for shared in self.target(&node, href)?.descendants().filter(is_surface) {
                    polygons.extend(self.polygon(&shared)?);
                }
            }
        }
        Ok(polygons)
    }

    fn boundary(&mut self, node: &Node<'a, 'i>) -> Result<Option<Boundary>, ImportError> {
        let Some(surface) = node.descendants().find(is_surface) else { return Ok(None) };
        let Some(polygon) = self.polygon(&surface)? else { return Ok(None) };
        let door = matches!(node.tag_name().name(), "ConnectionBoundary" | "AnchorBoundary");
        let id = short_name(id_of(node).unwrap_or("a boundary"));
        let winding = hull(&polygon);
        if enfilade::math::geom::area(&winding) > CONVEX * enfilade::math::geom::area(&polygon.rings[0]) {
            self.notes.push(Note::taken(format!("{id}: not convex; its convex hull is used")));
        }
        Ok(Some(Boundary { id, door, winding }))
    }

    /// `None` without area.
    fn polygon(&mut self, node: &Node<'a, 'i>) -> Result<Option<Polygon>, ImportError> {
        let mut rings = Vec::new();
        for side in ["exterior", "interior"] {
            for ring in node.children().filter(|n| is_gml(n, side)) {
                rings.extend(loops(self.ring(&ring)?));
            }
        }
        let polygon = Polygon::new(rings);
        if let Some(polygon) = &polygon {
            let extent = enfilade::math::geom::Aabb::of(polygon.rings[0].iter().copied()).diagonal();
            let off = polygon.off_plane();
            if off > FLAT * extent {
                let id = id_of(node).map_or_else(|| line(node).to_string(), |id| format!("{}: ", short_name(id)));
                self.notes.push(Note::detail(format!("{id}a polygon that is not flat (by {off:.3} m)")));
            }
        }
        Ok(polygon)
    }

    /// The corners of a ring, without the repeated last one.
    fn ring(&self, node: &Node<'a, 'i>) -> Result<Vec<DVec3>, ImportError> {
        let mut corners: Vec<DVec3> = Vec::new();
        for list in node.descendants().filter(|n| is_gml(n, "pos") || is_gml(n, "posList")) {
            let mut numbers = Vec::new();
            for word in list.text().unwrap_or_default().split_ascii_whitespace() {
                match word.parse::<f64>() {
                    Ok(x) if (x * self.scale).abs() <= FARTHEST => numbers.push(x * self.scale),
                    _ => return broken(&list, format!("`{}` is not a coordinate", short_name(word))),
                }
            }
            if numbers.len() % 3 != 0 || numbers.is_empty() {
                return broken(&list, format!("{} numbers; a corner needs three", numbers.len()));
            }
            // 0 - y, because -y would turn 0 into -0.
            corners.extend(numbers.chunks_exact(3).map(|p| DVec3::new(p[0], p[2], 0.0 - p[1])));
        }
        corners.dedup();
        if corners.len() > 1 && corners.first() == corners.last() {
            corners.pop();
        }
        Ok(corners)
    }
}

/// Splits a ring at repeated corners into simple loops, the largest first: some exporters write an outline and its holes as one
/// ring; edges that only connect loops bound nothing.
fn loops(ring: Vec<DVec3>) -> Vec<Vec<DVec3>> {
    let key = |p: DVec3| p.to_array().map(f64::to_bits);
    let mut found = Vec::new();
    // The path so far, and whether a loop was closed at each corner.
    let mut way: Vec<(DVec3, bool)> = Vec::with_capacity(ring.len());
    let mut place: HashMap<[u64; 3], usize> = HashMap::new();
    for p in ring {
        match place.get(&key(p)).copied() {
            Some(first) => {
                let closed: Vec<DVec3> = way.drain(first + 1..).map(|(q, _)| q).collect();
                for &q in &closed {
                    place.remove(&key(q));
                }
                way[first].1 = true;
                found.push(std::iter::once(p).chain(closed).collect());
            }
            None => {
                place.insert(key(p), way.len());
                way.push((p, false));
            }
        }
    }
    if way.iter().any(|(_, closes)| !closes) {
        found.push(way.into_iter().map(|(p, _)| p).collect());
    }
    found.retain(|ring: &Vec<DVec3>| ring.len() > 2);
    found.sort_by(|a, b| enfilade::math::geom::area(b).total_cmp(&enfilade::math::geom::area(a)));
    found
}

fn is_surface(node: &Node<'_, '_>) -> bool {
    ["Polygon", "PolygonPatch", "Triangle", "Rectangle"].iter().any(|name| is_gml(node, name))
}

/// Whether two transitions between the same cells are at the same place.
fn is_same(a: &Option<Boundary>, b: &Option<Boundary>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => {
            let near = enfilade::math::geom::Aabb::of(b.winding.iter().copied()).inflated(1e-2);
            a.id == b.id || a.winding.iter().all(|&p| near.contains(p))
        }
        (None, None) => true,
        _ => false,
    }
}
