//! The size of objects: smaller ones draw fewer triangles, in more draw calls.
//!
//! The cost of a size is measured like the benefit of portals ([`portal_benefit`]): by the triangles drawn from eyes over floors.

use super::choose_cells::choose;
use super::{BakeError, BakeOptions, portal_benefit};
use crate::cells::CellGraph;
use crate::job::{Job, Stopped};
use crate::runtime::Mode;
use crate::scene::rays::RayScene;
use crate::scene::{Scene, split_objects};
use crate::types::note::Note;
use serde::{Deserialize, Serialize};

/// Cost of a draw call, in triangles. Smaller: tiny objects that cost more to cull than to draw. Larger: large objects are drawn for a
/// visible corner.
pub const DRAW_CALL: f64 = 16.0;
/// The search starts with objects of at most this many triangles, or with smaller ones while there are at most `FIRST_OBJECTS` of them.
const FIRST: u32 = 256;
const FIRST_OBJECTS: usize = 256;
/// Smallest size in the search.
const LEAST: u32 = 16;
/// Largest size in the search, except whole objects.
const MOST: u32 = 4096;
/// Most objects, unless all sizes give more: rows have a bit for each.
const MOST_OBJECTS: usize = 1 << 16;

/// Objects are split only if the cost is at most this share of the original. Larger: the author's objects are split for little gain.
const PAYS: f64 = 0.95;

/// The cost with objects of one size.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
pub struct ObjectSize {
    /// Most triangles of an object; `None`: the author's objects.
    pub most_triangles: Option<u32>,
    /// Objects of the scene.
    pub objects: usize,
    /// Triangles drawn with portals, in the mean of cameras over floors.
    pub triangles: f64,
    /// Likewise draw calls, one per object.
    pub draw_calls: f64,
}

impl ObjectSize {
    /// The cost in triangles.
    pub fn cost(&self) -> f64 {
        self.triangles + DRAW_CALL * self.draw_calls
    }

    fn limit(&self) -> u32 {
        self.most_triangles.unwrap_or(u32::MAX)
    }
}

/// The compared sizes.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
pub struct ObjectSizes {
    /// The author's objects.
    pub whole: ObjectSize,
    /// The cheapest, if it is cheaper by a twentieth; otherwise equal to `whole`.
    pub best: ObjectSize,
}

/// Finds the cells of a scene with the author's objects, unless `options` give them, and splits its objects if that draws less. Cells and
/// size are then in `options`, ready for [`bake`](super::bake()). With `keep_whole`, objects stay, and a note states the saving of
/// splitting. After an edit, the size is that of the last bake, and none are tried, unless its file has little in common with the scene: then
/// `options` are without it.
///
/// # Errors
///
/// As [`find_cells`](super::find_cells).
pub fn size_objects(
    scene: Scene,
    options: &mut BakeOptions,
    keep_whole: bool,
    work: &Job<'_>,
) -> Result<(Scene, Option<ObjectSizes>), BakeError> {
    work.tell("cells", 0.0);
    if let Some(last) = &options.last {
        let limit = if keep_whole { u32::MAX } else { last.file().import.object_triangles };
        let split = split_objects(scene.clone(), limit);
        if last.has_in_common(&split) {
            options.import.object_triangles = limit;
            return Ok((split, None));
        }
        options.last = None;
    }
    let given = options.given.take();
    let (mut graph, sizes) = work.once(|| {
        // The benefit of walls is measurable only with small objects.
        let first = first(&scene);
        let usual = split_objects(scene.clone(), first);
        let rays = RayScene::new(&usual);
        let graph = given.map_or_else(|| choose(&rays, &options.split, work), Ok)?;
        let sizes = tried(&scene, (&rays, first), &graph, work)?;
        Ok::<_, BakeError>((graph, sizes))
    })?;
    graph.notes.extend(note(&sizes, keep_whole));
    let limit = if keep_whole { u32::MAX } else { sizes.best.limit() };
    options.import.object_triangles = limit;
    options.given = Some(graph);
    Ok((split_objects(scene, limit), Some(sizes)))
}

/// The first size: more objects give finer cells and take longer, so there should not be many more than the author's.
fn first(scene: &Scene) -> u32 {
    let objects = |limit: u32| scene.objects.iter().map(|o| o.triangles.len().div_ceil(limit as usize)).sum::<usize>();
    let mut limit = FIRST;
    while limit > LEAST && objects(limit / 2) <= FIRST_OBJECTS {
        limit /= 2;
    }
    limit
}

/// Measures the objects of `whole_scene`, and other sizes in powers of two from `first` (that of `rays`), down or up, until the cost no
/// longer falls.
fn tried(
    whole_scene: &Scene,
    (rays, first): (&RayScene<'_>, u32),
    graph: &CellGraph,
    work: &Job<'_>,
) -> Result<ObjectSizes, Stopped> {
    let cameras = portal_benefit::cameras(rays);
    let measure = |most_triangles: Option<u32>| {
        let is_new = most_triangles.filter(|&limit| limit != first);
        let split = is_new.map(|limit| split_objects(whole_scene.clone(), limit));
        let known = if most_triangles.is_none() { whole_scene } else { rays.scene() };
        let scene = split.as_ref().unwrap_or(known);
        let [sums] = portal_benefit::drawn(scene, graph, &cameras, [Mode::Portals], work)?;
        let [triangles, draw_calls] = sums.map(|sum| sum / cameras.len().max(1) as f64);
        Ok::<_, Stopped>(ObjectSize { most_triangles, objects: scene.objects.len(), triangles, draw_calls })
    };
    let whole = measure(None)?;
    let largest = whole_scene.objects.iter().map(|o| o.triangles.len()).max().unwrap_or(0);
    if cameras.is_empty() || largest <= LEAST as usize {
        return Ok(ObjectSizes { whole, best: whole });
    }
    let most = MOST_OBJECTS.max(whole.objects);
    let cost = |size: &ObjectSize| if size.objects > most { f64::INFINITY } else { size.cost() };
    let mut best = measure(Some(first))?;
    let ways: &[fn(u32) -> u32] = if cost(&best).is_finite() { &[|n| n / 2, |n| n * 2] } else { &[|n| n * 2] };
    for way in ways {
        let begin = best.limit();
        loop {
            let limit = way(best.limit());
            let is_of_use = (LEAST..=MOST).contains(&limit) && (limit as usize) < largest;
            let size = if is_of_use { measure(Some(limit))? } else { break };
            if cost(&best).is_finite() && cost(&size) >= cost(&best) {
                break;
            }
            best = size;
        }
        if best.limit() != begin {
            break;
        }
    }
    Ok(ObjectSizes { whole, best: if cost(&best) <= PAYS * cost(&whole) { best } else { whole } })
}

/// A note with the chosen size, or the one that would be chosen.
fn note(sizes: &ObjectSizes, keep_whole: bool) -> Option<Note> {
    let ObjectSizes { whole, best } = sizes;
    let limit = best.most_triangles?;
    let drawn = |verb: &str| {
        format!(
            "{:.0} instead of {:.0} triangles {verb} drawn a frame, in {:.0} instead of {:.0} draw calls",
            best.triangles, whole.triangles, best.draw_calls, whole.draw_calls
        )
    };
    Some(if keep_whole {
        let would = drawn("would be");
        Note::cost(format!(
            "objects stay whole; without --object-triangles whole they would have at most {limit} triangles, and {would}"
        ))
    } else {
        let are = drawn("are");
        Note::taken(format!(
            "objects are split to at most {limit} triangles: {are}; --object-triangles whole keeps them whole"
        ))
    })
}
