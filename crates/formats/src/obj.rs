//! Wavefront OBJ: vertices, faces, `o`, `g` and `usemtl`, and the transparency of the material library.
//!
//! Based on: Wavefront Technologies, *Advanced Visualizer, appendix B1: object files (.obj)*, version 3.0. Its own reader names
//! the line of each error and checks every index. One unit is one metre unless the options differ; OBJ has no up axis, so +Y is
//! assumed.
//!
//! Each combination of `o`, `g` and `usemtl` is a mesh, in order of first use. It is named after its object, else its group
//! (`o/g` if both exist), with `/material` added if one of those has several materials, else after its material, else `mesh`.
//! Polygons are triangulated, concave ones by ear clipping. Points and free-form surfaces are left out with a note, and so are
//! lines, unless [`ImportOptions::tube_radius`] makes tubes of them. Normals are ignored, and so are texture coordinates without
//! [`ImportOptions::trace`].

mod materials;
pub(super) mod polygon;

use super::helpers::{self, Helpers};
use super::lines::{Line, Lines};
use super::lod;
use super::textures;
use enfilade::scene::builder::{Facts, short_name};
use enfilade::scene::naming::{ByName, Naming};
use enfilade::scene::sidecar::Sidecars;
use enfilade::scene::sky::Backdrop;
use enfilade::scene::{ImportError, ImportOptions, Mesh, Picture, Place, Role, Scene, SceneBuilder, Source, whole_file};
use enfilade::types::note::{Note, NoteKind};
use enfilade_tubes::Shape;
use glam::DVec3;
use materials::Material;
use std::collections::{HashMap, HashSet};
use std::path::Path;

/// Reads an `.obj` file; see [`self`].
pub fn import(path: &Path, options: &ImportOptions) -> Result<Scene, ImportError> {
    let bytes = whole_file::model(path)?;
    let name = path.file_stem().unwrap_or_default().to_string_lossy();
    from_slice(&bytes, &name, path.parent(), options)
}

/// Reads a model in memory. `folder` holds its material libraries; a library that cannot be read is only a note.
pub fn from_slice(bytes: &[u8], name: &str, folder: Option<&Path>, options: &ImportOptions) -> Result<Scene, ImportError> {
    let metres_per_unit = options.metres_per_unit.unwrap_or(1.0);
    let source = Source { format: "OBJ".into(), metres_per_unit, up: options.up(), notes: Vec::new() };
    let mut builder = SceneBuilder::new(options, source);
    let (is_traced, options) = (builder.is_traced(), options.clone());
    let mut reader = Reader { metres_per_unit, is_traced, tube_radius: options.tube_radius, options, ..Reader::default() };
    for (number, line) in lines(bytes.strip_prefix(whole_file::BYTE_ORDER_MARK).unwrap_or(bytes)) {
        reader.line(number, &line).map_err(|what| ImportError::malformed(Place::Line(number), what))?;
    }
    if reader.positions.is_empty() && reader.unknown > 0 {
        let what = format!("not an OBJ file: no vertices in it, and {}", whole_file::nature(bytes));
        return Err(ImportError::malformed(Place::File, what));
    }
    let naming = Naming::read(folder, name)?;
    reader.finish(folder, &naming, &mut builder)?;
    builder.finish(name)
}

/// Logical lines (a `\` at the end joins two) with the number of their first line, without comments.
fn lines(bytes: &[u8]) -> impl Iterator<Item = (usize, String)> {
    let mut physical = bytes.split(|&b| b == b'\n').enumerate();
    std::iter::from_fn(move || {
        let (number, first) = physical.next()?;
        let mut line = String::from_utf8_lossy(first).into_owned();
        while let Some(open) = line.trim_end().strip_suffix('\\').map(str::len) {
            let Some((_, next)) = physical.next() else { break };
            line.truncate(open);
            line.push(' ');
            line.push_str(&String::from_utf8_lossy(next));
        }
        if let Some(comment) = line.find('#') {
            line.truncate(comment);
        }
        Some((number + 1, line))
    })
}

/// The number of texture coordinates of a corner without them.
const NONE: u32 = u32::MAX;

/// A material for engines. `Kd` counts as sRGB, as in the programs that write it.
fn look(name: &str, material: Option<&Material>) -> enfilade::scene::Material {
    let linear = |x: f32| x.clamp(0.0, 1.0).powf(2.2);
    let [r, g, b] = material.and_then(|m| m.diffuse).map_or([0.6; 3], |kd| kd.map(linear));
    let opacity = material.map_or(1.0, Material::opacity).clamp(0.0, 1.0);
    let picture = material.and_then(|m| m.picture.clone());
    // The colour of a material with a picture is often left black.
    let is_black = picture.is_some() && [r, g, b] == [0.0; 3];
    let [r, g, b] = if is_black { [1.0; 3] } else { [r, g, b] };
    let name = if name.is_empty() { "none".to_owned() } else { short_name(name) };
    enfilade::scene::Material {
        texture: picture.map(Picture::Named),
        ..enfilade::scene::Material::matt(name, [r, g, b, opacity as f32])
    }
}

/// Identifies a mesh: indices into [`Reader::names`].
#[derive(Clone, Copy, PartialEq, Eq, Hash, Default)]
struct Key {
    object: Option<usize>,
    group: Option<usize>,
    material: Option<usize>,
}

/// The triangles of all meshes.
struct Cut {
    meshes: Vec<Vec<[u32; 3]>>,
    /// Texture coordinates of the triangles; empty unless needed.
    looks: Vec<Vec<[[f32; 2]; 3]>>,
    /// Numbers of polygons.
    concave: usize,
    fanned: usize,
}

/// A face: its corners in [`Reader::corners`], its mesh in [`Reader::keys`].
struct Face {
    line: usize,
    corners: std::ops::Range<usize>,
    mesh: usize,
}

#[derive(Default)]
struct Reader {
    options: ImportOptions,
    metres_per_unit: f64,
    /// Whether texture coordinates are needed.
    is_traced: bool,
    positions: Vec<DVec3>,
    texture_coordinates: Vec<[f32; 2]>,
    corners: Vec<u32>,
    /// Texture coordinates of each corner, or [`NONE`]; empty unless needed.
    textured: Vec<u32>,
    faces: Vec<Face>,
    names: Vec<String>,
    number_of_name: HashMap<String, usize>,
    keys: Vec<Key>,
    number_of_key: HashMap<Key, usize>,
    current: Key,
    libraries: Vec<String>,
    /// Radius of tubes along lines, metres.
    tube_radius: Option<f64>,
    /// Lines that become tubes: names, and vertices.
    polylines: Vec<(Option<usize>, Face)>,
    lines: usize,
    points: usize,
    free_form: usize,
    unknown: usize,
    first_unknown: Option<String>,
}

impl Reader {
    /// Reads one line. Errors are texts.
    fn line(&mut self, number: usize, line: &str) -> Result<(), String> {
        let line = line.trim();
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim();
        match keyword {
            "v" => self.vertex(rest)?,
            "vt" if self.is_traced => {
                let mut numbers = rest.split_ascii_whitespace().map(|n| n.parse().unwrap_or(0.0f32));
                let [u, v] = std::array::from_fn(|_| numbers.next().unwrap_or(0.0));
                // OBJ counts from the lower left of the picture, glTF from the upper left.
                self.texture_coordinates.push([u, 1.0 - v]);
            }
            "f" | "fo" => self.face(number, rest)?,
            "o" => self.current.object = self.name(rest),
            "g" => self.current.group = self.name(rest),
            "usemtl" => self.current.material = self.name(rest),
            "mtllib" if !rest.is_empty() => self.libraries.push(rest.to_owned()),
            "l" if self.tube_radius.is_some() => self.polyline(number, rest)?,
            "l" => self.lines += 1,
            "p" => self.points += 1,
            "curv" | "curv2" | "surf" => self.free_form += 1,
            "" | "vt" | "vn" | "vp" | "s" | "mtllib" | "mg" | "bevel" | "c_interp" | "d_interp" | "lod" | "usemap"
            | "maplib" | "shadow_obj" | "trace_obj" | "cstype" | "deg" | "bmat" | "step" | "parm" | "trim" | "hole"
            | "scrv" | "sp" | "end" | "con" | "ctech" | "stech" | "call" | "csh" => {}
            other => {
                self.unknown += 1;
                self.first_unknown.get_or_insert_with(|| format!("`{}` in line {number}", short_name(other)));
            }
        }
        Ok(())
    }

    fn vertex(&mut self, rest: &str) -> Result<(), String> {
        let mut numbers = rest.split_ascii_whitespace();
        let mut p = [0.0; 3];
        for x in &mut p {
            let text = numbers.next().ok_or("a vertex needs three numbers")?;
            *x = text.parse::<f64>().map_err(|_| format!("`{}` is not a number", short_name(text)))?;
        }
        self.positions.push(self.options.upright(DVec3::from(p)) * self.metres_per_unit);
        Ok(())
    }

    fn face(&mut self, line: usize, rest: &str) -> Result<(), String> {
        let start = self.corners.len();
        self.indices(rest)?;
        let count = self.corners.len() - start;
        if count < 3 {
            return Err(format!("a face needs three vertices or more, this one has {count}"));
        }
        let mesh = *self.number_of_key.entry(self.current).or_insert(self.keys.len());
        if mesh == self.keys.len() {
            self.keys.push(self.current);
        }
        self.faces.push(Face { line, corners: start..self.corners.len(), mesh });
        Ok(())
    }

    fn polyline(&mut self, line: usize, rest: &str) -> Result<(), String> {
        let start = self.corners.len();
        self.indices(rest)?;
        let Key { object, group, material } = self.current;
        self.polylines.push((object.or(group).or(material), Face { line, corners: start..self.corners.len(), mesh: 0 }));
        Ok(())
    }

    /// Adds vertices of a face or a line.
    fn indices(&mut self, rest: &str) -> Result<(), String> {
        for corner in rest.split_ascii_whitespace() {
            let mut parts = corner.split('/');
            let text = parts.next().unwrap_or_default();
            if self.is_traced {
                let index = parts.next().and_then(|text| text.parse().ok()).unwrap_or(0i64);
                let place = if index > 0 { index - 1 } else { self.texture_coordinates.len() as i64 + index };
                self.textured.push(u32::try_from(place).ok().filter(|_| index != 0).unwrap_or(NONE));
            }
            let index: i64 = text.parse().map_err(|_| format!("`{}` is not a vertex", short_name(corner)))?;
            // Counts from 1 up, or back from the last vertex. More vertices may follow: the range is checked at the end.
            let position = if index > 0 { index - 1 } else { self.positions.len() as i64 + index };
            let position = u32::try_from(position).ok().filter(|_| index != 0);
            let have = self.positions.len();
            self.corners.push(position.ok_or_else(|| format!("vertex {index} of {have} so far does not exist"))?);
        }
        Ok(())
    }

    /// The number of a name; `None` for the empty one.
    fn name(&mut self, name: &str) -> Option<usize> {
        if name.is_empty() {
            return None;
        }
        let number = *self.number_of_name.entry(name.to_owned()).or_insert(self.names.len());
        if number == self.names.len() {
            self.names.push(name.to_owned());
        }
        Some(number)
    }

    /// Cuts the faces of all meshes into triangles.
    fn cut(&self, builder: &mut SceneBuilder) -> Result<Cut, ImportError> {
        let (meshes, looks) = (vec![Vec::new(); self.keys.len()], vec![Vec::new(); self.keys.len()]);
        let mut all = Cut { meshes, looks, concave: 0, fanned: 0 };
        let mut cut = Vec::new();
        for face in &self.faces {
            let corners = &self.corners[face.corners.clone()];
            if let Some(&bad) = corners.iter().find(|&&i| i as usize >= self.positions.len()) {
                let what = format!("vertex {} of {} does not exist", u64::from(bad) + 1, self.positions.len());
                return Err(ImportError::malformed(Place::Line(face.line), what));
            }
            if corners.iter().any(|&i| !self.positions[i as usize].is_finite()) {
                builder.leave_out(&format!("line {}", face.line), corners.len() - 2);
                continue;
            }
            match polygon::triangulate(&self.positions, corners, &mut cut) {
                polygon::Shape::Convex => {}
                polygon::Shape::Concave => all.concave += 1,
                polygon::Shape::Fanned => all.fanned += 1,
            }
            if self.is_traced {
                let textured = &self.textured[face.corners.clone()];
                all.looks[face.mesh].extend(cut.iter().map(|t| t.map(|k| self.coordinates(textured[k]))));
            }
            all.meshes[face.mesh].extend(cut.drain(..).map(|t| t.map(|k| corners[k])));
        }
        Ok(all)
    }

    /// Passes all meshes to the builder.
    fn finish(self, folder: Option<&Path>, naming: &Naming, builder: &mut SceneBuilder) -> Result<(), ImportError> {
        let beside = Sidecars { folder, under: self.options.files_under.as_deref() };
        let materials = self.materials(beside, &mut builder.source.notes);
        let Cut { meshes, looks, concave, fanned } = self.cut(builder)?;
        self.add_notes([concave, fanned], &mut builder.source.notes);
        let lines = self.lines_of(builder)?;
        let (names, mut by_name, mut helpers) = (self.mesh_names(), ByName::default(), Helpers::default());
        let known: HashSet<String> = names.iter().map(|name| name.to_lowercase()).collect();
        let has_name = |name: &str| known.contains(name);
        let levels = lod::levels(&names.iter().map(|name| (None, name.as_str())).collect::<Vec<_>>());
        // Vertices are numbered in the whole file; a mesh takes those that it uses.
        for ((((key, node), triangles), coordinates), level) in
            self.keys.iter().zip(names).zip(meshes).zip(looks).zip(levels)
        {
            let mut numbers = HashMap::new();
            let mut positions = Vec::new();
            let mut renumber = |i: u32| {
                *numbers.entry(i).or_insert_with(|| {
                    positions.push(self.positions[i as usize]);
                    positions.len() as u32 - 1
                })
            };
            let triangles = triangles.into_iter().map(|t| t.map(&mut renumber)).collect();
            let name = key.material.map_or("", |m| &self.names[m]);
            let material = materials.get(name);
            let entry = naming.of(&node, name);
            let by_hand = entry.is_some_and(|entry| entry.by_hand);
            let (mut role, mut is_glass) = entry.map_or((Role::Unknown, None), |entry| entry.kind.role());
            let of_name = helpers::Mesh { name: &node, material: key.material.map(|_| name), has_name: Some(&has_name) };
            if !by_hand && (helpers::is_helper(of_name) || level.is_some_and(|level| !level.is_finest)) {
                (role, is_glass) = (Role::Helper, Some(false));
            }
            by_name.count(role, true);
            if role == Role::Helper {
                helpers.count(&node);
            }
            let glass = is_glass.unwrap_or_else(|| material.is_some_and(|m| m.is_see_through()));
            let opaque = !glass && !matches!(role, Role::Door | Role::Window | Role::Helper | Role::Sky);
            if self.is_traced {
                let has_any = coordinates.iter().flatten().any(|c| *c != [0.0; 2]);
                builder.look(look(name, material), if has_any { coordinates } else { Vec::new() });
            }
            let mesh = Mesh { node, role, opaque, positions, triangles };
            let backdrop = Backdrop::named(&mesh.node, name);
            builder.facts(Facts { group: level.map(|level| level.group), told: by_hand, backdrop, ..Facts::default() });
            if glass { builder.add_glass(mesh)? } else { builder.add(mesh)? }
        }
        builder.source.notes.extend(by_name.note());
        builder.source.notes.extend(helpers.note());
        lines.finish(builder)
    }

    /// Adds notes on cut polygons and on missing parts.
    fn add_notes(&self, [concave, fanned]: [usize; 2], notes: &mut Vec<Note>) {
        let counts = [
            (concave, NoteKind::Detail, "concave polygons cut into triangles"),
            (fanned, NoteKind::Detail, "polygons with self-intersections or too many corners cut into fans"),
            (self.lines, NoteKind::Fault, "lines left out; --tubes METRES makes them tubes"),
            (self.points, NoteKind::Detail, "points left out"),
            (self.free_form, NoteKind::Fault, "free-form curves and surfaces left out"),
        ];
        notes.extend(counts.into_iter().filter_map(|(count, kind, what)| Note::counted(kind, count, what)));
        if let Some(first) = &self.first_unknown {
            let what = format!("{} unknown statements skipped, the first is {first}", self.unknown);
            notes.push(Note::detail(what));
        }
    }

    /// Makes tubes of lines.
    fn lines_of(&self, builder: &mut SceneBuilder) -> Result<Lines, ImportError> {
        let mut lines = Lines::default();
        for (name, Face { line, corners, .. }) in &self.polylines {
            let corners = &self.corners[corners.clone()];
            let place = format!("line {line}");
            let name = name.map_or(&place, |name| &self.names[name]);
            let at = |&i: &u32| self.positions.get(i as usize).copied();
            let points = corners.iter().map(at).collect::<Option<Vec<_>>>().ok_or_else(|| {
                let what = format!("a vertex beyond the last of {}", self.positions.len());
                ImportError::malformed(Place::Line(*line), what)
            })?;
            let shape = Shape { radius: self.tube_radius.unwrap_or_default(), inner: 0.0, capped: true };
            let role = Role::Furnishing;
            lines.add(builder, &Line { name, place: &place, role, points: &points, closed: false, smooth: false, shape })?;
        }
        Ok(lines)
    }

    /// The texture coordinates of a number; zeros without them.
    fn coordinates(&self, number: u32) -> [f32; 2] {
        self.texture_coordinates.get(number as usize).copied().unwrap_or_default()
    }

    fn mesh_names(&self) -> Vec<String> {
        let mut materials: HashMap<_, usize> = HashMap::new();
        for key in &self.keys {
            *materials.entry((key.object, key.group)).or_default() += 1;
        }
        let name = |number: Option<usize>| number.map(|n| short_name(&self.names[n]));
        let named = |key: &Key| {
            let material = name(key.material);
            let place = match (name(key.object), name(key.group)) {
                (Some(object), Some(group)) if object != group => format!("{object}/{group}"),
                (Some(one), _) | (None, Some(one)) => one,
                (None, None) => return material.unwrap_or_else(|| "mesh".into()),
            };
            match material {
                Some(material) if materials[&(key.object, key.group)] > 1 => format!("{place}/{material}"),
                _ => place,
            }
        };
        self.keys.iter().map(named).collect()
    }

    /// The materials of all readable libraries, by name.
    fn materials(&self, beside: Sidecars<'_>, notes: &mut Vec<Note>) -> HashMap<String, Material> {
        let mut out = HashMap::new();
        let mut read: HashSet<&str> = HashSet::new();
        for line in &self.libraries {
            // One file name with spaces, or several.
            let whole = beside.read(line).map(|bytes| vec![(line.as_str(), Ok(bytes))]);
            let files = whole.unwrap_or_else(|_| {
                let names = line.split_ascii_whitespace();
                names.filter(|name| !read.contains(name)).map(|name| (name, beside.read(name))).collect()
            });
            for (name, file) in files {
                if read.insert(name) {
                    match file {
                        Ok(bytes) => materials::read(&bytes, &mut out),
                        Err(why) => notes.push(Note::fault(format!("materials count as opaque: {why}"))),
                    }
                }
            }
        }
        // In the order of first use in the model.
        let used = self.names.iter().filter_map(|name| out.get(name));
        notes.extend(textures::note_of_missing(used.flat_map(Material::files).map(str::to_owned), beside));
        out
    }
}
