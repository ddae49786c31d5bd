//! Leaves of doors on the device, where they are now. They are few, so that those which moved are laid out again.

use super::mesh::{Mesh, corners};
use super::pipelines::{Eye, Pair, Pipelines};
use super::surfaces::{self, of_triangle};
use crate::building::Building;
use crate::doors::pieces::Facet;
use crate::doors::{Door, Doors};
use enfilade::gpu::Gpu;
use glam::DVec3;
use std::ops::Range;
use wgpu::BufferUsages;

/// Corners of leaves.
pub struct Leaves {
    /// As [`Mesh::corners`] has them.
    pub corners: wgpu::Buffer,
    /// As [`surfaces::SURFACES`] has them.
    pub surfaces: wgpu::Buffer,
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
    pub ghosts: Vec<Range<u32>>,
}

impl Leaves {
    /// Makes room for all doors.
    pub fn new(gpu: &Gpu, doors: &Doors, mesh: &Mesh) -> Self {
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
        let buffer = |bytes| gpu.buffer(bytes * u64::from(end.max(1)), BufferUsages::VERTEX | BufferUsages::COPY_DST);
        Self { corners: buffer(16), surfaces: buffer(surfaces::BYTES), ranges, is_hidden: Vec::new(), made: mesh.made() }
    }

    /// Lays out what moved.
    pub fn update(&self, gpu: &Gpu, building: &Building, doors: &mut Doors) {
        for i in doors.take_moved() {
            let door = &doors.doors[i];
            let own = door.first_object().map_or(self.made, |object| object.0);
            let (mut places, mut looks) = (Vec::new(), Vec::new());
            for (triangle, facet) in in_order(door) {
                let of = facet.and_then(|f| f.of);
                places.extend(corners(triangle, of.map_or(own, |(object, _)| object.0)));
                looks.extend(of_triangle(&building.scene, &building.looks, of, triangle));
            }
            let start = u64::from(self.ranges[i][0].start);
            gpu.queue.write_buffer(&self.corners, 16 * start, bytemuck::cast_slice(&places));
            gpu.queue.write_buffer(&self.surfaces, surfaces::BYTES * start, bytemuck::cast_slice(&looks));
        }
    }

    /// Lists the leaves of some doors.
    pub fn list(&self, doors: &[usize], out: &mut Drawn) {
        out.solid.clear();
        out.ghosts.clear();
        let is_shown = |door: &&usize| !self.is_hidden.get(**door).is_some_and(|&hidden| hidden);
        for &door in doors.iter().filter(is_shown) {
            for (runs, range) in [&mut out.solid, &mut out.ghosts].into_iter().zip(&self.ranges[door]) {
                match runs.last_mut() {
                    Some(last) if last.end == range.start => last.end = range.end,
                    _ if range.is_empty() => {}
                    _ => runs.push(range.clone()),
                }
            }
        }
    }

    /// Draws them.
    pub fn draw(&self, pass: &mut wgpu::RenderPass<'_>, eye: &Eye, pair: &Pair, drawn: &Drawn) {
        self.bind(pass, eye);
        pair.draw(pass, &drawn.solid, &drawn.ghosts);
    }

    /// Binds the corners of leaves in place of the scene's.
    pub fn bind(&self, pass: &mut wgpu::RenderPass<'_>, eye: &Eye) {
        Pipelines::bind_corners(pass, eye, &self.corners);
    }
}

/// What is solid of a door, then what is glass.
fn in_order(door: &Door) -> impl Iterator<Item = ([DVec3; 3], Option<&Facet>)> {
    let of = |glass: bool| door.drawn().filter(move |(_, f)| f.is_some_and(|f| f.glass) == glass);
    of(false).chain(of(true))
}
