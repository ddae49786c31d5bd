//! Vertices in as few bytes as show no difference: positions on a grid, normals in 8 bits, texture coordinates in 16.

use crate::PackError;
use crate::model::{Attribute, Mesh};
use glam::{DAffine3, DVec3};
use meshoptimizer_rs::Workspace;
use meshoptimizer_rs::optimize_vertex_cache;
use std::collections::HashMap;

/// Components of accessors.
pub(crate) const I8: u32 = 5120;
pub(crate) const U8: u32 = 5121;
pub(crate) const U16: u32 = 5123;
pub(crate) const U32: u32 = 5125;
pub(crate) const F32: u32 = 5126;

/// How an attribute is written.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub(crate) struct Layout {
    pub(crate) name: String,
    pub(crate) component: u32,
    /// Components per vertex.
    pub(crate) width: usize,
    pub(crate) normalized: bool,
}

impl Layout {
    /// Bytes per vertex, a multiple of four.
    pub(crate) fn stride(&self) -> usize {
        let size = match self.component {
            I8 | U8 => 1,
            U16 => 2,
            _ => 4,
        };
        (size * self.width).next_multiple_of(4)
    }
}

/// A mesh with its positions on a grid.
pub(crate) struct Shape {
    /// Multiples of the grid's step.
    pub(crate) cells: Vec<[i64; 3]>,
    /// Attributes besides positions.
    pub(crate) layouts: Vec<Layout>,
    /// Their bytes, vertex by vertex.
    pub(crate) bytes: Vec<u8>,
    /// Triangles, ordered for the vertex cache; vertices in the order of first use.
    pub(crate) indices: Vec<u32>,
    pub(crate) material: Option<usize>,
}

/// Texture coordinates that wrap are multiples of this: a sixteenth of a pixel of 1,024. More: textures swim. Less: more bytes.
const TEXTURE_STEP: f32 = 1.0 / 16384.0;

impl Shape {
    /// A mesh under a transform, on a grid of this step.
    pub(crate) fn of(mesh: &Mesh, transform: &DAffine3, step: f64) -> Result<Self, PackError> {
        let on_grid = |p: &DVec3| (transform.transform_point3(*p) / step).round().to_array().map(|x| x as i64);
        let cells: Vec<[i64; 3]> = mesh.positions.iter().map(on_grid).collect();
        let layouts: Vec<Layout> = mesh.attributes.iter().map(layout).collect();
        let stride: usize = layouts.iter().map(Layout::stride).sum();
        let mut bytes = Vec::with_capacity(stride * cells.len());
        for vertex in 0..cells.len() {
            for (attribute, layout) in mesh.attributes.iter().zip(&layouts) {
                write(attribute, layout, vertex, transform, &mut bytes);
            }
        }
        let mut indices = mesh.indices.clone();
        if transform.matrix3.determinant() < 0.0 {
            indices.chunks_exact_mut(3).for_each(|triangle| triangle.swap(1, 2));
        }
        let shape = Self { cells, layouts, bytes, indices, material: mesh.material };
        shape.ordered(stride)
    }

    /// Equal vertices become one, and all are in the order of use.
    fn ordered(self, stride: usize) -> Result<Self, PackError> {
        let bytes_of = |vertex: usize| &self.bytes[vertex * stride..(vertex + 1) * stride];
        let mut known = HashMap::new();
        let merged: Vec<u32> = (0..self.cells.len())
            .map(|vertex| *known.entry((self.cells[vertex], bytes_of(vertex))).or_insert(vertex as u32))
            .collect();
        let indices: Vec<u32> = self.indices.iter().map(|&index| merged[index as usize]).collect();
        let indices = optimize_vertex_cache(&indices, self.cells.len(), &mut Workspace::default())?;
        let mut numbers = HashMap::new();
        let (mut cells, mut bytes) = (Vec::new(), Vec::new());
        let indices = indices
            .into_iter()
            .map(|index| {
                *numbers.entry(index).or_insert_with(|| {
                    cells.push(self.cells[index as usize]);
                    bytes.extend(bytes_of(index as usize));
                    cells.len() as u32 - 1
                })
            })
            .collect();
        Ok(Self { cells, bytes, indices, layouts: self.layouts, material: self.material })
    }

    /// Least and greatest multiples of the step.
    pub(crate) fn reach(&self) -> [[i64; 3]; 2] {
        let fold = |pick: fn(i64, i64) -> i64| {
            let all = self.cells.iter().copied().reduce(|a, b| std::array::from_fn(|k| pick(a[k], b[k])));
            all.unwrap_or_default()
        };
        [fold(i64::min), fold(i64::max)]
    }
}

fn layout(attribute: &Attribute) -> Layout {
    let within = attribute.values.iter().all(|value| (0.0..=1.0).contains(value));
    let (component, normalized) = match attribute.name.as_str() {
        "NORMAL" | "TANGENT" => (I8, true),
        name if name.starts_with("COLOR_") && attribute.is_bytes => (U8, true),
        _ if within => (U16, true),
        _ => (F32, false),
    };
    Layout { name: attribute.name.clone(), component, width: attribute.width, normalized }
}

/// Writes an attribute of a vertex, padded to four bytes.
fn write(attribute: &Attribute, layout: &Layout, vertex: usize, transform: &DAffine3, out: &mut Vec<u8>) {
    let mut values = [0.0f32; 4];
    let width = attribute.width.min(4);
    values[..width].copy_from_slice(&attribute.values[vertex * attribute.width..][..width]);
    match layout.name.as_str() {
        "NORMAL" => turn(&mut values, |n| normal(transform, n)),
        "TANGENT" => turn(&mut values, |t| transform.transform_vector3(t)),
        _ => {}
    }
    if layout.name == "TANGENT" && transform.matrix3.determinant() < 0.0 {
        values[3] = -values[3];
    }
    let begin = out.len();
    for value in &values[..width] {
        match layout.component {
            I8 => out.extend(((value * 127.0).round() as i8).to_le_bytes()),
            U8 => out.push((value * 255.0).round() as u8),
            U16 => out.extend(((value * 65535.0).round() as u16).to_le_bytes()),
            _ => out.extend(((value / TEXTURE_STEP).round() * TEXTURE_STEP).to_le_bytes()),
        }
    }
    out.resize(begin + layout.stride(), 0);
}

/// A normal under a transform; mirrored triangles have it on the same side.
fn normal(transform: &DAffine3, normal: DVec3) -> DVec3 {
    let [x, y, z] = [transform.matrix3.x_axis, transform.matrix3.y_axis, transform.matrix3.z_axis];
    // The cofactors: no inverse is needed, so flat scales do no harm.
    let turned = y.cross(z) * normal.x + z.cross(x) * normal.y + x.cross(y) * normal.z;
    turned * transform.matrix3.determinant().signum()
}

/// Turns the first three numbers, to unit length.
fn turn(values: &mut [f32; 4], by: impl Fn(DVec3) -> DVec3) {
    let turned = by(DVec3::new(f64::from(values[0]), f64::from(values[1]), f64::from(values[2]))).normalize_or_zero();
    values[..3].copy_from_slice(&turned.as_vec3().to_array());
}
