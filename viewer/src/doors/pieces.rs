//! The doors of a model, in pieces: what hangs together by its edges. A door's frame and its leaf are often one mesh.

use enfilade::ObjectId;
use enfilade::math::geom::Aabb;
use enfilade::scene::{Role, Scene};
use glam::DVec3;
use std::collections::BTreeMap;

/// Corners nearer than about this are one, metres. Larger: a leaf is joined to the frame that it stands in. Smaller: rounding tears a leaf.
const SAME: f64 = 1e-4;
/// Faces whose normals have a larger cosine than this face one way.
const SAME_WAY: f64 = 0.98;
/// Directions that a piece is looked at from: a leaf has six, a turned handle more, and none of those is the piece's.
const MOST_DIRECTIONS: usize = 24;

/// A triangle of a leaf.
#[derive(Clone, Copy, Debug)]
pub struct Facet {
    /// As modelled, metres relative to the origin.
    pub corners: [DVec3; 3],
    /// Whose it is, and its number in the scene; `None` where the model has no leaf and one was made.
    pub of: Option<(ObjectId, u32)>,
    /// Whether one sees through it.
    pub glass: bool,
}

/// A connected component.
#[derive(Clone, Debug)]
pub struct Piece {
    /// Its object.
    pub object: ObjectId,
    /// Its triangles.
    pub facets: Vec<Facet>,
    /// Around them.
    pub bounds: Aabb,
}

/// All pieces of what the model calls doors.
pub fn pieces(scene: &Scene) -> Vec<Piece> {
    let doors = (0u32..).zip(&scene.objects).filter(|(_, o)| o.role == Role::Door);
    doors.flat_map(|(i, _)| of_object(scene, ObjectId(i))).collect()
}

fn of_object(scene: &Scene, object: ObjectId) -> Vec<Piece> {
    let (range, glass) = (scene.objects[object.index()].triangles.clone(), scene.objects[object.index()].glass);
    // 1. Which triangles lie at which edge.
    let mut edges: BTreeMap<[[i64; 3]; 2], Vec<usize>> = BTreeMap::new();
    for (i, triangle) in range.clone().enumerate() {
        let keys = scene.corners(triangle as usize).map(|p| (p / SAME).round().to_array().map(|x| x as i64));
        for side in 0..3 {
            let (a, b) = (keys[side], keys[(side + 1) % 3]);
            edges.entry([a.min(b), a.max(b)]).or_default().push(i);
        }
    }
    // 2. Two hang together. At an edge of more, solids touch: a leaf and its frame.
    let mut parents: Vec<usize> = (0..range.len()).collect();
    for triangles in edges.values().filter(|triangles| triangles.len() == 2) {
        let [a, b] = [0, 1].map(|i| root(&mut parents, triangles[i]));
        parents[b] = a;
    }
    // 3. A piece each.
    let mut places: BTreeMap<usize, usize> = BTreeMap::new();
    let mut pieces: Vec<Piece> = Vec::new();
    for (i, triangle) in range.enumerate() {
        let place = *places.entry(root(&mut parents, i)).or_insert_with(|| {
            pieces.push(Piece { object, facets: Vec::new(), bounds: Aabb::EMPTY });
            pieces.len() - 1
        });
        let corners = scene.corners(triangle as usize);
        pieces[place].bounds = corners.iter().fold(pieces[place].bounds, |b, p| b.with(*p));
        pieces[place].facets.push(Facet { corners, of: Some((object, triangle)), glass });
    }
    pieces
}

fn root(parents: &mut [usize], mut id: usize) -> usize {
    while parents[id] != id {
        parents[id] = parents[parents[id]];
        id = parents[id];
    }
    id
}

/// The direction that most of the area of some triangles faces, of the level ones; `None` where all lie level.
pub fn facing(facets: &[Facet]) -> Option<DVec3> {
    let mut ways: Vec<(DVec3, f64)> = Vec::new();
    for facet in facets {
        let [a, b, c] = facet.corners;
        let across = (b - a).cross(c - a);
        let Some(n) = across.with_y(0.0).try_normalize() else { continue };
        let area = across.with_y(0.0).length();
        match ways.iter().position(|(way, _)| way.dot(n).abs() > SAME_WAY) {
            Some(i) => ways[i].1 += area,
            None if ways.len() < MOST_DIRECTIONS => ways.push((n, area)),
            None => {}
        }
    }
    ways.into_iter().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(way, _)| way)
}

/// From where to where some triangles reach along a direction.
pub fn range<'f>(facets: impl IntoIterator<Item = &'f Facet>, axis: DVec3) -> [f64; 2] {
    let at = facets.into_iter().flat_map(|f| f.corners).map(|p| axis.dot(p));
    at.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
}
