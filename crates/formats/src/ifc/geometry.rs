//! Triangles of products, made by ifc-lite on several threads.

use super::endless::has_endless_curve;
use super::model::{Model, Voids, global_id, y_up};
use super::relations::Relations;
use super::roles::role;
use super::styles::{Styles, Surface};
use super::tubes::{self, Stays};
use super::workers::{self, DeadlinePassed, Limits, Outcome};
use enfilade::math::parallel;
use enfilade::scene::Role;
use enfilade::scene::pipes::FEWEST_SEGMENTS;
use enfilade_tubes::Tubes;
use glam::DVec3;
use ifc_lite_core::{DecodedEntity, EntityDecoder};
use ifc_lite_geometry::GeometryRouter;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

/// Greatest valid coordinate, metres: farther from any national grid's origin than the Earth is wide.
const FARTHEST: f64 = 2e7;

/// A shape in the model's coordinates: metres, +Y up.
#[derive(Clone, Debug, Default)]
pub(super) struct Shape {
    /// Corners.
    pub(super) positions: Vec<DVec3>,
    /// Indices into `positions`, checked.
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Shape {
    /// The corners of every triangle.
    pub(super) fn corners(&self) -> impl Iterator<Item = [DVec3; 3]> + '_ {
        self.triangles.iter().map(|t| t.map(|i| self.positions[i as usize]))
    }

    /// Appends another shape's triangles.
    pub(super) fn append(&mut self, other: &Self) {
        let start = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + start)));
    }
}

/// The geometry of a product.
#[derive(Debug, Default)]
pub(super) struct Built {
    /// Its opaque part.
    pub(super) solid: Shape,
    /// Its see-through part, by style.
    pub(super) clear: Shape,
    /// The first surface of each part.
    pub(super) surfaces: [Option<Arc<Surface>>; 2],
    /// Tubes, if all of it is tubes; then it has no triangles.
    pub(super) tubes: Tubes,
    /// Why it stays a mesh although parts are round.
    stays: Option<Stays>,
}

impl Built {
    /// Segments of its tubes.
    fn segments(&self) -> usize {
        self.tubes.sections.len() - self.tubes.tubes.len()
    }

    /// Both parts.
    pub(super) fn whole(&self) -> Shape {
        let mut whole = self.solid.clone();
        whole.append(&self.clear);
        whole
    }
}

/// The geometry of a model.
#[derive(Debug, Default)]
pub(super) struct Geometry {
    built: HashMap<u32, Built>,
    /// GlobalIds and reasons of products left out, in file order.
    pub(super) failed: Vec<String>,
    /// Classes of representation items that ifc-lite does not support.
    pub(super) unsupported: BTreeSet<String>,
}

impl Geometry {
    /// Number of products that are tubes.
    pub(super) fn tubes(&self) -> usize {
        self.built.values().filter(|built| built.segments() > 0).count()
    }

    /// Number of products with round parts that stay meshes, by reason. Empty if these and tubes are few.
    pub(super) fn stay(&self) -> BTreeMap<Stays, usize> {
        let mut counts = BTreeMap::new();
        for stays in self.built.values().filter_map(|built| built.stays) {
            *counts.entry(stays).or_default() += 1;
        }
        let are_many = self.tubes() > 0 || counts.values().sum::<usize>() >= FEWEST_SEGMENTS;
        if are_many { counts } else { BTreeMap::new() }
    }

    /// A product's shape, if it has one.
    pub(super) fn get(&self, product: u32) -> Option<&Built> {
        self.built.get(&product)
    }
}

/// Makes the triangles of `products` (record numbers), cut by their openings. With `with_tubes`, pipes become tubes if there are
/// many; otherwise they stay as the reader made them.
pub(super) fn build(
    model: &Arc<Model>,
    relations: &Arc<Relations>,
    styles: Arc<Styles>,
    products: Vec<u32>,
    with_tubes: bool,
    limits: Limits,
) -> Result<Geometry, DeadlinePassed> {
    let mut task = Arc::new(Task { model: model.clone(), relations: relations.clone(), styles, products, with_tubes });
    let mut geometry = Geometry::default();
    geometry.run(&task, limits)?;
    let few = |segments: usize| segments > 0 && segments < FEWEST_SEGMENTS;
    if few(geometry.built.values().map(Built::segments).sum()) {
        let is_tubes = |product: &&u32| geometry.built.get(product).is_some_and(|built| built.segments() > 0);
        let products = task.products.iter().filter(is_tubes).copied().collect();
        let Task { model, relations, styles, .. } = &*task;
        let (model, relations, styles) = (model.clone(), relations.clone(), styles.clone());
        task = Arc::new(Task { model, relations, styles, products, with_tubes: false });
        geometry.run(&task, limits)?;
    }
    Ok(geometry)
}

impl Geometry {
    /// Runs a task.
    fn run(&mut self, task: &Arc<Task>, limits: Limits) -> Result<(), DeadlinePassed> {
        let outcomes = workers::run(task, parallel::threads(), limits)?;
        let mut decoder = task.model.decoder();
        for (outcome, &product) in outcomes.into_iter().zip(&task.products) {
            let reason = match outcome {
                Outcome::Done(done) => {
                    self.unsupported.extend(done.unsupported);
                    match done.built {
                        Ok(built) => {
                            self.built.insert(product, built);
                            continue;
                        }
                        Err(reason) => reason,
                    }
                }
                Outcome::Panicked => "the geometry reader failed on it".into(),
                Outcome::TimedOut => format!("it took longer than {} s", limits.job.as_secs()),
            };
            let id = decoder.decode_by_id(product).map_or_else(|_| format!("#{product}"), |e| global_id(&e));
            self.failed.push(format!("{id} ({reason})"));
        }
        Ok(())
    }
}

struct Task {
    model: Arc<Model>,
    relations: Arc<Relations>,
    styles: Arc<Styles>,
    products: Vec<u32>,
    /// Whether pipes become tubes.
    with_tubes: bool,
}

struct Done {
    built: Result<Built, String>,
    unsupported: Vec<String>,
}

impl workers::Task for Task {
    type Output = Done;

    fn jobs(&self) -> usize {
        self.products.len()
    }

    fn work(&self, next: &mut dyn FnMut() -> Option<usize>, done: &mut dyn FnMut(usize, Done)) {
        let (mut decoder, router) = (self.model.decoder(), self.model.router());
        while let Some(job) = next() {
            let built = self.build(self.products[job], &mut decoder, &router);
            let unsupported = router.take_unsupported_items().into_keys().collect();
            done(job, Done { built, unsupported });
        }
    }
}

impl Task {
    fn build(&self, product: u32, decoder: &mut EntityDecoder<'_>, router: &GeometryRouter) -> Result<Built, String> {
        let entity = decoder.decode_by_id(product).map_err(one_line)?;
        if has_endless_curve(&entity, decoder) {
            return Err("swept along a curve with too many parts".into());
        }
        let items = self.styles.of(&entity, &self.relations, decoder);
        let mut built = Built { surfaces: [items.solid.clone(), items.clear.clone()], ..Built::default() };
        // The plan treats round columns as walls and needs the reader's corners.
        let may_be_tubes = self.with_tubes && !items.have_clear() && role(&entity.ifc_type) == Some(Role::Furnishing);
        if may_be_tubes {
            match tubes::of_product(&self.model, &entity, decoder, router) {
                Ok(tubes) => return Ok(Built { tubes, ..built }),
                Err(stays) => built.stays = stays,
            }
        }
        match items.have_clear() {
            false => {
                let parts =
                    router.process_element_with_voids_parts(&entity, decoder, &self.model.voids).map_err(one_line)?;
                for mesh in &parts {
                    self.append(&mut built.solid, mesh)?;
                }
            }
            // Item by item only if items differ: the other way is cheaper.
            true => {
                for part in &parts_by_item(router, &entity, decoder, &self.model.voids)?.sub_meshes {
                    let shape = if items.is_clear(part.geometry_id) { &mut built.clear } else { &mut built.solid };
                    self.append(shape, &part.mesh)?;
                }
            }
        }
        Ok(built)
    }

    /// Adds a mesh in the model's coordinates.
    fn append(&self, shape: &mut Shape, mesh: &ifc_lite_geometry::Mesh) -> Result<(), String> {
        let start = shape.positions.len() as u32;
        let origin = self.model.offset + DVec3::from(mesh.origin);
        for p in mesh.positions.as_chunks::<3>().0 {
            let p = y_up(origin + DVec3::from(p.map(f64::from)));
            if !(p.is_finite() && p.abs().max_element() < FARTHEST) {
                return Err(
                    "a corner lies beyond the Earth; give metres per unit with --unit if the file's unit is wrong or missing"
                        .into(),
                );
            }
            shape.positions.push(p);
        }
        let count = shape.positions.len() as u32;
        for t in mesh.indices.as_chunks::<3>().0 {
            let t = t.map(|i| i.saturating_add(start));
            if t.iter().any(|&i| i >= count) {
                return Err("a triangle without corners".into());
            }
            shape.triangles.push(t);
        }
        Ok(())
    }
}

/// One mesh per representation item, cut by the product's openings.
fn parts_by_item(
    router: &GeometryRouter,
    entity: &DecodedEntity,
    decoder: &mut EntityDecoder<'_>,
    voids: &Voids,
) -> Result<ifc_lite_geometry::SubMeshCollection, String> {
    if voids.contains_key(&entity.id) {
        let parts = router.process_element_with_submeshes_and_voids(entity, decoder, voids).map_err(one_line)?;
        if !parts.is_empty() {
            return Ok(parts);
        }
    }
    router.process_element_with_submeshes(entity, decoder).map_err(one_line)
}

fn one_line(error: impl std::fmt::Display) -> String {
    error.to_string().split_whitespace().collect::<Vec<_>>().join(" ")
}
