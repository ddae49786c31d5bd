//! Triangles of products, made by ifc-lite on several threads.

use super::endless::has_endless_curve;
use super::model::{Model, Voids, global_id, y_up};
use super::relations::Relations;
use super::roles::role;
use super::styles::{Styles, Surface};
use super::tubes::{self, Stays};
use super::workers::{self, DeadlinePassed, Limits, Outcome};
use enfilade::parallel;
use enfilade::scene::Role;
use enfilade::scene::pipes::FEWEST_SEGMENTS;
use enfilade_tubes::Tubes;
use glam::DVec3;
use ifc_lite_core::{DecodedEntity, EntityDecoder};
use ifc_lite_geometry::GeometryRouter;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::sync::Arc;

/// Metres beyond which a coordinate is taken for damage: farther from any national grid's origin than the Earth is wide.
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

    /// Takes over another shape's triangles.
    pub(super) fn append(&mut self, other: &Self) {
        let start = self.positions.len() as u32;
        self.positions.extend(&other.positions);
        self.triangles.extend(other.triangles.iter().map(|t| t.map(|i| i + start)));
    }
}

/// What a product looks like.
#[derive(Debug, Default)]
pub(super) struct Built {
    /// What hides things.
    pub(super) solid: Shape,
    /// What is see-through by its style.
    pub(super) clear: Shape,
    /// The first surface of each of the two.
    pub(super) surfaces: [Option<Arc<Surface>>; 2],
    /// Tubes, where all of it is such; then it has no triangles.
    pub(super) tubes: Tubes,
    /// Why it isn't such, where something of it is round.
    stays: Option<Stays>,
}

impl Built {
    /// Segments of its tubes.
    fn segments(&self) -> usize {
        self.tubes.sections.len() - self.tubes.tubes.len()
    }

    /// All of it.
    pub(super) fn whole(&self) -> Shape {
        let mut whole = self.solid.clone();
        whole.append(&self.clear);
        whole
    }
}

/// What the geometry of a model came to.
#[derive(Debug, Default)]
pub(super) struct Geometry {
    built: HashMap<u32, Built>,
    /// GlobalIds and reasons of products left out, in file order.
    pub(super) failed: Vec<String>,
    /// Classes of representation items that ifc-lite doesn't read.
    pub(super) unsupported: BTreeSet<String>,
}

impl Geometry {
    /// How many products are tubes.
    pub(super) fn tubes(&self) -> usize {
        self.built.values().filter(|built| built.segments() > 0).count()
    }

    /// How many products stay meshes though something in them is round, by reason. Nothing where these and tubes are few.
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

/// Makes the triangles of `products` (record numbers), each cut by its openings; tubes of pipes if `with_tubes`, where there are many: a few
/// are as the reader has them.
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
    /// Does a task.
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
    /// Whether pipes are tubes.
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
            return Err("along a curve of too many parts".into());
        }
        let items = self.styles.of(&entity, &self.relations, decoder);
        let mut built = Built { surfaces: [items.solid.clone(), items.clear.clone()], ..Built::default() };
        // Round columns are walls to the plan, which knows the reader's corners.
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
            // Part by part only where parts differ: the other way is cheaper.
            true => {
                for part in &parts_by_item(router, &entity, decoder, &self.model.voids)?.sub_meshes {
                    let shape = if items.is_clear(part.geometry_id) { &mut built.clear } else { &mut built.solid };
                    self.append(shape, &part.mesh)?;
                }
            }
        }
        Ok(built)
    }

    /// Adds a mesh, back in the model's coordinates.
    fn append(&self, shape: &mut Shape, mesh: &ifc_lite_geometry::Mesh) -> Result<(), String> {
        let start = shape.positions.len() as u32;
        let origin = self.model.offset + DVec3::from(mesh.origin);
        for p in mesh.positions.as_chunks::<3>().0 {
            let p = y_up(origin + DVec3::from(p.map(f64::from)));
            if !(p.is_finite() && p.abs().max_element() < FARTHEST) {
                return Err(
                    "a corner lies beyond the Earth: --unit gives metres per unit, if the file says it wrongly or not"
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

/// One mesh a representation item, cut by the product's openings.
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
