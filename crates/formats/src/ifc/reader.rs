//! The stages of an import.

use super::geometry::{self, Geometry, Shape};
use super::model::{Model, global_id};
use super::relations::Relations;
use super::roles::{holds_panes, role};
use super::styles::Styles;
use super::workers::{DeadlinePassed, Limits, Outcome, run_one};
use super::{boundaries, cuts, openings, spaces};
use enfilade::scene::{Hints, ImportError, ImportOptions, Material, Mesh, Place, Role, Scene, SceneBuilder, Source};
use enfilade::types::note::Note;
use ifc_lite_core::{EntityDecoder, IfcType};
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time for the geometry of one element, after which it is left out with a note. Real buildings of 4 MB take less than a second
/// in all; elements that take this long do not end.
const ELEMENT_LIMIT: Duration = Duration::from_secs(30);

/// Time for an import, plus [`LIMIT_PER_MEGABYTE`].
const TIME_LIMIT: Duration = Duration::from_secs(120);

/// Added to [`TIME_LIMIT`] for each megabyte: real files take 0.1 to 0.3 s a megabyte on two cores.
const LIMIT_PER_MEGABYTE: Duration = Duration::from_secs(4);

/// Maximum names in a note.
const NAMES: usize = 5;

/// Reads an IFC file's bytes; as [`super::import`]. `name` becomes [`Scene::name`].
pub fn import_bytes(bytes: Vec<u8>, name: &str, options: &ImportOptions) -> Result<Scene, ImportError> {
    let limit = time_limit(bytes.len());
    let deadline = Instant::now() + limit;
    // 1. Records, units, relations: linear in the file, but library code, so watched too.
    let metres = options.metres_per_unit;
    let (model, relations, styles) = watched(deadline, bytes, move |bytes| {
        let model = Model::read(bytes, metres)?;
        let mut decoder = model.decoder();
        let (relations, styles) = (Relations::read(&model, &mut decoder), Styles::read(&model, &mut decoder));
        drop(decoder);
        Ok::<_, ImportError>((Arc::new(model), Arc::new(relations), styles))
    })??;
    let mut builder = SceneBuilder::new(
        options,
        Source { format: model.schema.clone(), metres_per_unit: model.metres, up: "+Z".into(), notes: model.notes.clone() },
    );
    if model.offset != glam::DVec3::ZERO {
        let note =
            format!("far from its origin: read relative to {:?} (x east, y north, z up), metres", model.offset.to_array());
        builder.source.notes.push(Note::detail(note));
    }

    // 2. Triangles of everything that has a shape and a use: elements, spaces, openings.
    let wanted = |kind: &IfcType| {
        role(kind).is_some() || kind.is_subtype_of(IfcType::IfcSpace) || kind.is_subtype_of(IfcType::IfcOpeningElement)
    };
    let products: Vec<u32> = model.products.iter().filter(|p| p.shaped && wanted(&p.kind)).map(|p| p.id).collect();
    let limits = Limits { job: ELEMENT_LIMIT, deadline };
    let geometry = geometry::build(&model, &relations, Arc::new(styles), products.clone(), options.tubes, limits)
        .map_err(|late| too_slow(&model, limit, late.0.first().map(|&job| products[job])))?;
    let mut notes = notes_of(&geometry);

    // 3. Hints, with a time limit, too: a hostile file can make every opening meet every wall.
    let (model, geometry) = (model.clone(), Arc::new(geometry));
    let (hinted, built) = (model.clone(), geometry.clone());
    let (hints, cut, found) = watched(deadline, (), move |()| hints(&hinted, &relations, &built))?;
    builder.hints = hints;

    // 4. Meshes.
    let mut decoder = model.decoder();
    add_meshes(&model, &mut decoder, (&geometry, &cut), &mut builder, &mut notes)?;
    builder.source.notes.extend(notes);
    builder.source.notes.extend(found);
    builder.finish(name)
}

/// Notes about elements and pipes.
fn notes_of(geometry: &Geometry) -> Vec<Note> {
    let mut notes = Vec::new();
    note_list(&mut notes, Note::fault, "elements left out: their geometry cannot be read", &geometry.failed);
    if !geometry.unsupported.is_empty() {
        let kinds: Vec<_> = geometry.unsupported.iter().map(String::as_str).collect();
        let what = format!("representation items of unsupported kinds left out: {}", kinds.join(", "));
        notes.push(Note::fault(what));
    }
    match geometry.tubes() {
        0 => {}
        count => notes.push(Note::detail(format!("{count} round pipes became tubes"))),
    }
    let stay = geometry.stay();
    if !stay.is_empty() {
        let reasons: Vec<_> = stay.iter().map(|(stays, count)| format!("{count} {}", stays.in_words())).collect();
        let what = format!("{} round pipes stay meshes: {}", stay.values().sum::<usize>(), reasons.join(", "));
        notes.push(Note::detail(what));
    }
    notes
}

/// Time for the records of a file of this size.
pub(super) fn time_limit(bytes: usize) -> Duration {
    TIME_LIMIT + LIMIT_PER_MEGABYTE * (bytes >> 20) as u32
}

/// Shapes of elements with cut openings, see-through ones last.
type Opened = HashMap<u32, [Shape; 2]>;

/// The hints, the shapes of cut elements, and notes.
fn hints(model: &Model, relations: &Relations, geometry: &Geometry) -> (Hints, Opened, Vec<Note>) {
    let (mut decoder, router, mut notes, mut cuts) = (model.decoder(), model.router(), Vec::new(), Vec::new());
    let storeys = spaces::storeys(model, &mut decoder, &router);
    let rooms = spaces::rooms(model, &mut decoder, relations, geometry, &storeys, &mut notes);
    let mut openings = openings::openings(model, &mut decoder, relations, geometry, &rooms, (&mut notes, &mut cuts));
    openings.extend(boundaries::boundaries(model, &mut decoder, &router, relations, &rooms, &mut notes));
    let hints = Hints { storeys: storeys.hints, rooms: rooms.hints, openings, ..Hints::default() };
    (hints, cuts::cut(geometry, &cuts), notes)
}

/// One mesh per element, or two if parts of it are see-through.
fn add_meshes(
    model: &Model,
    decoder: &mut EntityDecoder<'_>,
    (geometry, opened): (&Geometry, &Opened),
    builder: &mut SceneBuilder,
    notes: &mut Vec<Note>,
) -> Result<(), ImportError> {
    let mut empty: BTreeMap<String, usize> = BTreeMap::new();
    let mut added = 0;
    for product in &model.products {
        let Some(role) = role(&product.kind) else { continue };
        let Some(built) = geometry.get(product.id) else { continue };
        let Ok(entity) = decoder.decode_by_id(product.id) else { continue };
        let node = global_id(&entity);
        if built.solid.triangles.is_empty() && built.clear.triangles.is_empty() && built.tubes.tubes.is_empty() {
            *empty.entry(product.kind.as_str().to_owned()).or_default() += 1;
            continue;
        }
        let mut add = |shape: &Shape, role: Role, opaque: bool, glass: bool| {
            if let Some(surface) = &built.surfaces[usize::from(glass)] {
                builder.look(Material::matt(&surface.name, surface.colour), Vec::new());
            }
            if shape.triangles.is_empty() {
                return Ok(());
            }
            let (positions, triangles) = (shape.positions.clone(), shape.triangles.clone());
            let mesh = Mesh { node: node.clone(), role, opaque, positions, triangles };
            if glass { builder.add_glass(mesh) } else { builder.add(mesh) }
        };
        // Leaves may open, and panes are see-through: neither hides anything.
        let [solid, clear] = opened.get(&product.id).map_or([&built.solid, &built.clear], <[Shape; 2]>::each_ref);
        add(solid, role, !matches!(role, Role::Door | Role::Window), false)?;
        add(clear, if holds_panes(&product.kind) { Role::Window } else { role }, false, true)?;
        if !built.tubes.tubes.is_empty() {
            if let Some(surface) = &built.surfaces[0] {
                builder.look(Material::matt(&surface.name, surface.colour), Vec::new());
            }
            builder.add_tubes(node.clone(), role, built.tubes.clone())?;
        }
        added += 1;
    }
    if !empty.is_empty() {
        let kinds: Vec<_> = empty.iter().map(|(kind, n)| format!("{n} {kind}")).collect();
        notes.push(Note::detail(format!("elements without triangles: {}", kinds.join(", "))));
    }
    if added == 0 {
        let what = match geometry.failed.first() {
            Some(first) => format!("no element's geometry can be read; the first is {first}"),
            None => "no element has geometry; export the model with its geometry".into(),
        };
        return Err(ImportError::malformed(Place::File, what));
    }
    Ok(())
}

/// Runs `f` with a deadline.
pub(super) fn watched<I: Send + 'static, T: Send + 'static>(
    deadline: Instant,
    input: I,
    f: impl Fn(I) -> T + Send + Sync + 'static,
) -> Result<T, ImportError> {
    let input = std::sync::Mutex::new(Some(input));
    let outcome = run_one(deadline, move || input.lock().ok().and_then(|mut i| i.take()).map(&f));
    match outcome {
        Ok(Outcome::Done(Some(value))) => Ok(value),
        Ok(_) => Err(ImportError::malformed(Place::File, "its records can't be read: the file is damaged")),
        Err(DeadlinePassed(_)) => Err(ImportError::malformed(Place::File, "reading its records took too long")),
    }
}

fn too_slow(model: &Model, limit: Duration, element: Option<u32>) -> ImportError {
    let mut decoder = model.decoder();
    let at = element
        .and_then(|id| decoder.decode_by_id(id).ok())
        .map_or_else(String::new, |e| format!(", last at {}", global_id(&e)));
    let what = format!("its geometry took longer than {} s{at}: simplify or split the model", limit.as_secs());
    ImportError::malformed(Place::File, what)
}

/// Adds a note with the first few names of a list.
pub(super) fn note_list(notes: &mut Vec<Note>, kind: fn(String) -> Note, what: &str, names: &[String]) {
    if names.is_empty() {
        return;
    }
    let more = if names.len() > NAMES { format!(" and {} more", names.len() - NAMES) } else { String::new() };
    notes.push(kind(format!("{what}: {}{more}", names[..names.len().min(NAMES)].join(", "))));
}
