//! Leaves of doors on the device, where they are now. They are few, so that those which moved are laid out again.

use super::geometry::Geometry;
use super::mesh::{Mesh, word};
use super::pipelines::{CameraBinding, Pair, Pipelines};
use super::surfaces::of_triangle;
use crate::building::Building;
use crate::doors::pieces::Facet;
use crate::doors::{Door, Doors};
use enfilade::gpu::Gpu;
use glam::DVec3;
use std::ops::Range;
use wgpu::BufferUsages;

/// Triangles of leaves; each has places of its own.
pub struct Leaves {
    geometry: Geometry,
    triangles: wgpu::BindGroup,
    /// By door: what nothing is seen through, and what is glass.
    ranges: Vec<[Range<u32>; 2]>,
    /// By door: whether its leaves aren't drawn; empty: all are.
    pub is_hidden: Vec<bool>,
    /// The number of what no object of the model is.
    made: u32,
}

/// Leaves to draw.
#[derive(Default)]
pub struct Drawn {
    /// Of what nothing is seen through.
    pub solid: Vec<Range<u32>>,
    /// Of glass.
    pub transparent: Vec<Range<u32>>,
}

impl Leaves {
    /// Makes room for all doors.
    pub fn new(gpu: &Gpu, pipelines: &Pipelines, doors: &Doors, mesh: &Mesh) -> Self {
        let mut end = 0;
        let ranges = doors.doors.iter().map(|door| {
            let [solid, glass] =
                [false, true].map(|g| door.drawn().filter(|(_, f)| f.is_some_and(|f| f.glass) == g).count() as u32);
            let start = end;
            end = start + 3 * (solid + glass);
            [start..start + 3 * solid, start + 3 * solid..end]
        });
        let ranges = ranges.collect();
        // A buffer of nothing can't be bound.
        let count = end.max(3) as usize;
        let [corners, triangles]: [Vec<u32>; 2] = [(0..count as u32).collect(), vec![0; count / 3]];
        let filled = |words: &[u32]| gpu.filled(words, BufferUsages::STORAGE);
        let geometry = Geometry {
            made_of: filled(&triangles),
            coordinates: filled(&vec![0; count]),
            // Every corner has coordinates.
            first_coordinates: filled(&vec![0; mesh.ranges.len() + 1]),
            ..Geometry::new(gpu, &vec![[0; 3]; count], &corners, &triangles)
        };
        let triangles = geometry.group(gpu, &pipelines.geometry_layout);
        Self { geometry, triangles, ranges, is_hidden: Vec::new(), made: mesh.made() }
    }

    /// Lays out what moved.
    pub fn update(&self, gpu: &Gpu, building: &Building, doors: &mut Doors) {
        for i in doors.take_moved() {
            let door = &doors.doors[i];
            let own = door.first_object().map_or(self.made, |object| object.0);
            let (mut places, mut words) = (Vec::new(), Vec::new());
            let (mut made_of, mut coordinates) = (Vec::new(), Vec::new());
            for (triangle, facet) in in_order(door) {
                let of = facet.and_then(|f| f.of);
                places.extend(triangle.iter().flat_map(|p| p.as_vec3().to_array()));
                words.push(word(triangle, of.map_or(own, |(object, _)| object.0)));
                let (made, at) = of_triangle(&building.scene, &building.looks, of, triangle);
                made_of.push(made);
                coordinates.extend(at);
            }
            let start = u64::from(self.ranges[i][0].start);
            let Geometry { places: to, words: to_words, made_of: to_made, coordinates: to_coordinates, .. } = &self.geometry;
            gpu.queue.write_buffer(to, 12 * start, bytemuck::cast_slice::<f32, u8>(&places));
            for (buffer, words, at) in
                [(to_words, &words, start / 3), (to_made, &made_of, start / 3), (to_coordinates, &coordinates, start)]
            {
                gpu.queue.write_buffer(buffer, 4 * at, bytemuck::cast_slice(words));
            }
        }
    }

    /// Lists the leaves of some doors.
    pub fn list(&self, doors: &[usize], out: &mut Drawn) {
        out.solid.clear();
        out.transparent.clear();
        let is_shown = |door: &&usize| !self.is_hidden.get(**door).is_some_and(|&hidden| hidden);
        for &door in doors.iter().filter(is_shown) {
            for (runs, range) in [&mut out.solid, &mut out.transparent].into_iter().zip(&self.ranges[door]) {
                match runs.last_mut() {
                    Some(last) if last.end == range.start => last.end = range.end,
                    _ if range.is_empty() => {}
                    _ => runs.push(range.clone()),
                }
            }
        }
    }

    /// Draws them.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, eye: &CameraBinding, pair: &Pair, drawn: &Drawn) {
        self.bind(pass, eye);
        pair.draw(pass, &drawn.solid, &drawn.transparent);
    }

    /// Binds the triangles of leaves in place of the scene's.
    pub fn bind(&self, pass: &mut wgpu::RenderPass<'_>, eye: &CameraBinding) {
        pass.set_bind_group(0, &eye.group, &[]);
        self.bind_triangles(pass);
    }

    /// Binds them without a camera.
    pub fn bind_triangles(&self, pass: &mut wgpu::RenderPass<'_>) {
        pass.set_bind_group(2, &self.triangles, &[]);
    }
}

/// Opaque triangles of a door, then glass.
fn in_order(door: &Door) -> impl Iterator<Item = ([DVec3; 3], Option<&Facet>)> {
    let of = |glass: bool| door.drawn().filter(move |(_, f)| f.is_some_and(|f| f.glass) == glass);
    of(false).chain(of(true))
}
