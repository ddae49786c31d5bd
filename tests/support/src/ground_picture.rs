//! Ground, drawn: patches as a depth buffer without roundings, to compare what is drawn with what would be.

use enfilade::runtime::Camera;
use enfilade_terrain::{Ground, Patch, drawn};
use glam::{DVec2, DVec3};

/// What patches look like.
pub struct Picture {
    size: [usize; 2],
    /// By pixel, row after row from above: 1 over the depth of what is nearest, and which patch that is; 0 where nothing is.
    pub pixels: Vec<(f64, usize)>,
}

impl Picture {
    /// Draws patches on `size` pixels, but what is nearer than `near` metres.
    pub fn new(ground: &Ground, camera: &Camera, size: [usize; 2], near: f64, patches: &[Patch]) -> Self {
        let mut picture = Self { size, pixels: vec![(0.0, usize::MAX); size[0] * size[1]] };
        let rows = [camera.x, camera.y, camera.w].map(|row| row.as_dvec3());
        let side = ground.header().grid.side();
        for (k, patch) in patches.iter().enumerate() {
            for triangle in patch.drawn_cells(side).flat_map(|[i, j]| drawn(i, j, side, patch.coarser)) {
                let corner = |at| place(ground, patch, at).map(|p| p - camera.eye.as_dvec3());
                if let [Some(a), Some(b), Some(c)] = triangle.map(corner) {
                    picture.draw([a, b, c].map(|p| DVec3::from(rows.map(|row| row.dot(p)))), near, k);
                }
            }
        }
        picture
    }

    /// Patches that show.
    pub fn shown(&self) -> std::collections::BTreeSet<usize> {
        self.pixels.iter().map(|p| p.1).filter(|&patch| patch != usize::MAX).collect()
    }

    /// Pixels through whose middle a box is in view, and those of them in which it is nearer than what is drawn.
    pub fn pixels_of_box(&self, camera: &Camera, near: f64, [low, high]: [DVec3; 2]) -> [usize; 2] {
        let (eye, unproject) = (camera.eye.as_dvec3(), camera.unproject());
        let size = DVec2::from(self.size.map(|pixels| pixels as f64));
        // Where its corners are, in pixels; anywhere, where one is not in front.
        let [mut first, mut last] = [size, DVec2::ZERO];
        for corner in 0..8 {
            let pick = |k: usize| if corner >> k & 1 == 0 { low[k] } else { high[k] };
            let p = DVec3::new(pick(0), pick(1), pick(2)) - eye;
            let [x, y, depth] = [camera.x, camera.y, camera.w].map(|row| row.as_dvec3().dot(p));
            if depth <= near {
                (first, last) = (DVec2::ZERO, size);
                break;
            }
            let at = (DVec2::new(x, -y) / depth + 1.0) / 2.0 * size;
            (first, last) = (first.min(at - 1.0), last.max(at + 1.0));
        }
        let range = |k: usize| first[k].max(0.0) as usize..(last[k].max(0.0).ceil() as usize).min(self.size[k]);
        let mut counts = [0; 2];
        for (row, column) in range(1).flat_map(|row| range(0).map(move |column| (row, column))) {
            let at = (DVec2::new(column as f64, row as f64) + 0.5) / size;
            // Of depth 1 by the camera's last row.
            let ray = unproject * DVec3::new(2.0 * at.x - 1.0, 1.0 - 2.0 * at.y, 1.0);
            let [a, b] = [(low - eye) / ray, (high - eye) / ray];
            let (from, to) = (a.min(b).max_element(), a.max(b).min_element());
            if from <= to && from > near {
                let is_nearer = 1.0 / from > self.pixels[row * self.size[0] + column].0 * (1.0 + 1e-6);
                counts = [counts[0] + 1, counts[1] + usize::from(is_nearer)];
            }
        }
        counts
    }

    /// A triangle in clip coordinates: to the right, up, and depth.
    fn draw(&mut self, corners: [DVec3; 3], near: f64, patch: usize) {
        let mut shape = Vec::with_capacity(4);
        for k in 0..3 {
            let (a, b) = (corners[k], corners[(k + 1) % 3]);
            if a.z >= near {
                shape.push(a);
            }
            if (a.z >= near) != (b.z >= near) {
                shape.push(a + (b - a) * ((near - a.z) / (b.z - a.z)));
            }
        }
        let half = DVec2::new(self.size[0] as f64, self.size[1] as f64) / 2.0;
        let on_screen = |p: &DVec3| ((DVec2::new(p.x, -p.y) / p.z + 1.0) * half).extend(1.0 / p.z);
        let shape: Vec<DVec3> = shape.iter().map(on_screen).collect();
        for k in 2..shape.len() {
            self.fill([shape[0], shape[k - 1], shape[k]], patch);
        }
    }

    fn fill(&mut self, [a, b, c]: [DVec3; 3], patch: usize) {
        let area = (b - a).truncate().perp_dot((c - a).truncate());
        let range = |k: usize| {
            let (low, high) = (a[k].min(b[k]).min(c[k]), a[k].max(b[k]).max(c[k]));
            (low - 0.5).ceil().max(0.0) as usize..((high + 0.5).floor().max(0.0) as usize).min(self.size[k])
        };
        for (y, x) in range(1).flat_map(|y| range(0).map(move |x| (y, x))) {
            let p = DVec2::new(x as f64, y as f64) + 0.5;
            let part = |u: DVec3, v: DVec3| (u.truncate() - p).perp_dot(v.truncate() - p) / area;
            let parts = [part(b, c), part(c, a), part(a, b)];
            let depth = parts[0] * a.z + parts[1] * b.z + parts[2] * c.z;
            let pixel = &mut self.pixels[y * self.size[0] + x];
            if parts.iter().all(|&part| part >= 0.0) && depth > pixel.0 {
                *pixel = (depth, patch);
            }
        }
    }
}

/// Where a patch's sample is, metres; `None` for a void.
fn place(ground: &Ground, patch: &Patch, [i, j]: [u32; 2]) -> Option<DVec3> {
    let header = ground.header();
    let [x, z] = header.plan(header.grid.column(patch.key, i), header.grid.row(patch.key, j));
    ground.sample(patch.tile, [i, j]).map(|height| DVec3::new(x, f64::from(height), z))
}
