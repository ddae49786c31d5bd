//! Files of objects, and files of meshes that objects of several chunks share.

use crate::PackError;
use crate::document::{Document, Part, exact, is_short};
use crate::geometry::Shape;
use crate::looks::{Looks, Pictures};
use crate::model::Model;
use glam::{DAffine3, DMat3, DQuat, DVec3};
use serde_json::{Value, json};

/// An object of a chunk.
pub(crate) enum Thing {
    /// Its own triangles, relative to the origin.
    Own(u32, Shape),
    /// Of a shared mesh: the number of the mesh, and the node's transform.
    Shared(u32, u32, Value),
}

/// The bytes of a file, and its pictures, ascending.
pub(crate) struct Written {
    pub(crate) bytes: Vec<u8>,
    pub(crate) pictures: Vec<usize>,
}

/// Writes a chunk of objects; `step`: that of the grid.
pub(crate) fn objects(model: &Model, pictures: &Pictures, things: &[Thing], step: f64) -> Result<Written, PackError> {
    let own = || {
        things.iter().filter_map(|thing| match thing {
            Thing::Own(id, shape) => Some((*id, shape)),
            Thing::Shared(..) => None,
        })
    };
    let reach = own()
        .map(|(_, shape)| shape.reach())
        .reduce(|[a, b], [c, d]| [std::array::from_fn(|k| a[k].min(c[k])), std::array::from_fn(|k| b[k].max(d[k]))]);
    let [base, _] = reach.unwrap_or_default();
    let is_short = reach.is_some_and(is_short);
    let parts: Vec<Part<'_>> = own().map(|(_, shape)| Part { shape, base, is_short, step }).collect();
    let mut document = Document::new();
    let mut looks = Looks::default();
    let meshes = meshes(model, pictures, &mut document, &parts, &mut looks)?;
    let (mut nodes, mut shown) = (Vec::new(), Vec::new());
    for (mesh, (id, _)) in own().enumerate() {
        nodes.push(json!({ "mesh": mesh, "extras": { "enfilade": id } }));
    }
    if !nodes.is_empty() {
        shown.push(nodes.len());
        let mut grid = grid(base, step, is_short);
        grid["children"] = (0..nodes.len()).collect();
        nodes.push(grid);
    }
    for thing in things {
        if let Thing::Shared(id, mesh, placement) = thing {
            let mut node = placement.clone();
            node["extras"] = json!({ "enfilade": id, "mesh": mesh });
            shown.push(nodes.len());
            nodes.push(node);
        }
    }
    let pictures = looks.pictures.iter().copied().collect();
    Ok(Written { bytes: document.finish(meshes, nodes, shown, looks)?, pictures })
}

/// Writes a file of shared meshes: their numbers, ascending without gaps, with the steps of their grids.
pub(crate) fn shared(model: &Model, pictures: &Pictures, shapes: &[(u32, Shape, f64)]) -> Result<Written, PackError> {
    let parts: Vec<Part<'_>> = shapes
        .iter()
        .map(|(_, shape, step)| Part { shape, base: shape.reach()[0], is_short: is_short(shape.reach()), step: *step })
        .collect();
    let mut document = Document::new();
    let mut looks = Looks::default();
    let meshes = meshes(model, pictures, &mut document, &parts, &mut looks)?;
    let node = |((mesh, part), (number, ..)): ((usize, &Part<'_>), &(u32, Shape, f64))| {
        let mut node = grid(part.base, part.step, part.is_short);
        node["mesh"] = mesh.into();
        node["extras"] = json!({ "mesh": number });
        node
    };
    let nodes: Vec<Value> = parts.iter().enumerate().zip(shapes).map(node).collect();
    let shown = (0..nodes.len()).collect();
    let pictures = looks.pictures.iter().copied().collect();
    Ok(Written { bytes: document.finish(meshes, nodes, shown, looks)?, pictures })
}

/// A mesh for each part.
fn meshes(
    model: &Model,
    pictures: &Pictures,
    document: &mut Document,
    parts: &[Part<'_>],
    looks: &mut Looks,
) -> Result<Vec<Value>, PackError> {
    let mut primitives = document.primitives(parts)?;
    for (primitive, part) in primitives.iter_mut().zip(parts) {
        if let Some(material) = part.shape.material {
            primitive["material"] = looks.number(model, pictures, material).into();
        }
    }
    Ok(primitives.into_iter().map(|primitive| json!({ "primitives": [primitive] })).collect())
}

/// A node that takes multiples of the step to metres.
fn grid(base: [i64; 3], step: f64, is_short: bool) -> Value {
    let mut node = json!({ "translation": base.map(|x| exact(x as f64 * step)) });
    if is_short {
        node["scale"] = json!([step, step, step]);
    }
    node
}

/// A node's transform in few digits, which moves no point of a mesh with these corners by more than half of `most`: scale, rotation and
/// translation, or else a matrix.
pub(crate) fn placement(transform: &DAffine3, corners: [DVec3; 2], most: f64) -> Value {
    // Half a unit in each of three axes is less than the unit.
    let digits = (-(most / 4.0).log10()).ceil().max(0.0) as i32;
    let unit = 10f64.powi(digits);
    let rounded = |x: f64, unit: f64| exact((x * unit).round() / unit);
    let centre = (corners[0] + corners[1]) / 2.0;
    let (scale, rotation, _) = transform.to_scale_rotation_translation();
    let [scale, rotation] =
        [[scale.x, scale.y, scale.z, 1.0], rotation.to_array()].map(|all| all.map(|x| (x * TURNS).round() / TURNS));
    let turned =
        DMat3::from_quat(DQuat::from_array(rotation).normalize()) * DMat3::from_diagonal(DVec3::from_slice(&scale[..3]));
    let translation = transform.transform_point3(centre) - turned * centre;
    let half = (corners[1] - corners[0]) / 2.0;
    let off = (0..8).map(|corner| {
        let at = DVec3::from_array(std::array::from_fn(|k| if corner >> k & 1 == 0 { -half[k] } else { half[k] }));
        (transform.transform_vector3(at) - turned * at).length()
    });
    // A sheared mesh, or one without a scale that can be inverted.
    if !off.fold(0.0, f64::max).le(&(most / 4.0)) || !scale.iter().chain(&rotation).all(|x| x.is_finite()) {
        let columns = transform.matrix3.to_cols_array_2d().map(|[x, y, z]| [x, y, z, 0.0]);
        let last = translation_of(transform, unit);
        let matrix: Vec<Value> = columns.concat().into_iter().map(exact).chain(last).collect();
        return json!({ "matrix": matrix });
    }
    let mut node = json!({ "translation": translation.to_array().map(|x| rounded(x, unit)) });
    if rotation != [0.0, 0.0, 0.0, 1.0] {
        node["rotation"] = json!(rotation.map(exact));
    }
    if scale[..3] != [1.0; 3] {
        node["scale"] = json!(scale[..3].iter().map(|x| exact(*x)).collect::<Vec<_>>());
    }
    node
}

/// The last column of a matrix.
fn translation_of(transform: &DAffine3, unit: f64) -> [Value; 4] {
    let [x, y, z] = transform.translation.to_array().map(|x| exact((x * unit).round() / unit));
    [x, y, z, 1.into()]
}

/// Digits of rotations and scales: those of `f32`.
const TURNS: f64 = 1e7;
