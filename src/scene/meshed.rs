//! Scenes for drawing: meshes of tubes replace their bounding prisms.

use super::{Object, Scene};
use enfilade_tubes::part;

impl Scene {
    /// The scene with triangle meshes of tubes: `sides` gives the number of sides for a radius in metres, at least 3. Objects stay the
    /// same. The hash changes.
    pub fn meshed(self, sides: impl Fn(f64) -> u32) -> Self {
        if self.tubes.tubes.is_empty() {
            return self;
        }
        let mut new = Self { positions: Vec::new(), triangles: Vec::new(), objects: Vec::new(), ..self };
        let mut numbers = new.trace.as_mut().map(|trace| std::mem::take(&mut trace.triangles));
        let mut meshed = Vec::new();
        for object in &self.objects {
            let (first, range) = (new.triangles.len(), object.triangles.start as usize..object.triangles.end as usize);
            if object.is_tube() {
                for (tube, segments) in new.tubes.parts(object.segments.clone()) {
                    let radius = f64::from(new.tubes.sections[segments.start as usize].radius());
                    let mesh = part(&new.tubes, tube, segments, sides(radius));
                    let base = new.positions.len() as u32;
                    new.positions.extend(mesh.positions.iter().map(|p| tube.origin + p.as_dvec3()));
                    new.triangles.extend(mesh.triangles.iter().map(|t| t.map(|i| i + base)));
                }
                meshed.extend(0..(new.triangles.len() - first) as u32);
            } else {
                // An object's corners are contiguous.
                let corners = self.triangles[range.clone()].as_flattened();
                let start = corners.iter().min().copied().unwrap_or(0);
                let end = corners.iter().max().map_or(start, |last| last + 1);
                let base = new.positions.len() as u32;
                new.positions.extend(&self.positions[start as usize..end as usize]);
                new.triangles.extend(self.triangles[range.clone()].iter().map(|t| t.map(|i| i - start + base)));
                meshed.extend(numbers.iter().flat_map(|numbers| &numbers[range.clone()]));
            }
            let triangles = first as u32..new.triangles.len() as u32;
            new.objects.push(Object { triangles, ..object.clone() });
        }
        if let (Some(trace), Some(_)) = (&mut new.trace, numbers.take()) {
            trace.triangles = meshed;
        }
        new
    }
}
