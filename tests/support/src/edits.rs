//! Edits of a model, as a designer makes them between two bakes.

use crate::meshes::{cuboid, soup};
use crate::random::Random;
use enfilade::math::geom::Aabb;
use enfilade::scene::{ImportOptions, Mesh, Role, Scene, SceneBuilder, Source};
use glam::dvec3;

/// The parts of a model, in its own coordinates. It has no moving parts, no tubes and no hints.
#[derive(Clone)]
pub struct Model {
    pub parts: Vec<Mesh>,
}

impl Model {
    /// The objects of a scene, a part each.
    pub fn of(scene: &Scene) -> Self {
        let part = |object: &enfilade::scene::Object| {
            let corners = object.triangles.clone().map(|t| scene.corners(t as usize).map(|p| p + scene.origin));
            soup(&object.node, object.role, object.opaque, &corners.collect::<Vec<_>>())
        };
        Self { parts: scene.objects.iter().map(part).collect() }
    }

    pub fn scene(&self) -> Scene {
        let options = ImportOptions { object_triangles: u32::MAX, ..ImportOptions::default() };
        let mut builder = SceneBuilder::new(&options, Source::default());
        self.parts.iter().for_each(|part| builder.add(part.clone()).expect("a part"));
        builder.finish("model").expect("a model")
    }

    fn bounds(&self, part: usize) -> Aabb {
        Aabb::of(self.parts[part].positions.iter().copied())
    }

    /// A part that is as large as furniture.
    fn furniture(&self, random: &mut Random) -> usize {
        let is_small = |&i: &usize| {
            let size = self.bounds(i).size();
            size.max_element() < 2.5 && size.min_element() > 0.02
        };
        let small: Vec<usize> = (0..self.parts.len()).filter(is_small).collect();
        small[random.below(small.len())]
    }

    /// Moves a piece of furniture by up to 15 centimetres.
    pub fn move_furniture(&mut self, random: &mut Random) {
        let part = self.furniture(random);
        let by = dvec3(0.15 * random.signed(), 0.0, 0.15 * random.signed());
        self.parts[part].positions.iter_mut().for_each(|p| *p += by);
    }

    /// Puts a wall of three metres beside a piece of furniture.
    pub fn add_wall(&mut self, random: &mut Random) {
        let by = self.furniture(random);
        let at = self.bounds(by);
        let low = dvec3(at.min.x - 0.5, at.min.y, at.max.z + 0.2);
        self.parts.push(soup("new wall", Role::Structure, true, &cuboid(low, low + dvec3(3.0, 2.6, 0.12))));
    }

    /// Repeats what has its middle between two heights, higher up.
    pub fn add_storey(&mut self, [low, high]: [f64; 2], up: f64) {
        let is_there = |&i: &usize| (low..high).contains(&self.bounds(i).centre().y);
        let there: Vec<usize> = (0..self.parts.len()).filter(is_there).collect();
        for i in there {
            let mut part = self.parts[i].clone();
            part.node += " above";
            part.positions.iter_mut().for_each(|p| p.y += up);
            self.parts.push(part);
        }
    }

    /// Takes a piece of furniture away.
    pub fn remove_furniture(&mut self, random: &mut Random) {
        let part = self.furniture(random);
        self.parts.remove(part);
    }
}

/// As an OBJ file, a group a part, each with a name of its own.
pub fn obj(model: &Model) -> String {
    use std::fmt::Write;
    let (mut out, mut first) = (String::new(), 1);
    let mut line = |text: std::fmt::Arguments<'_>| writeln!(out, "{text}").expect("a string grows");
    for (i, part) in model.parts.iter().enumerate() {
        line(format_args!("g {}_{i}", part.node.replace(' ', "_")));
        part.positions.iter().for_each(|p| line(format_args!("v {} {} {}", p.x, p.y, p.z)));
        part.triangles.iter().for_each(|t| {
            let [a, b, c] = t.map(|i| first + i);
            line(format_args!("f {a} {b} {c}"));
        });
        first += part.positions.len() as u32;
    }
    out
}
