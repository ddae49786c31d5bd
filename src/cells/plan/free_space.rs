//! Free space and solid matter: free is what is reachable from outside or from an author's room, and sealed space that looks like a room.

use crate::cells::complex::faces::Face;
use crate::cells::disjoint_sets::DisjointSets;
use crate::cells::plan::options::PlanOptions;
use crate::cells::plan::space::{Input, Pieces};

/// Which pieces are free: those connected by open faces to the rim or to an author's room, and sealed ones whose walls face inward (or,
/// with inconsistent winding, that are as large as a room), except cavities of walls. A wrong result costs culling, not correctness: no
/// line leaves a sealed piece.
pub(in crate::cells) fn free_space(input: &Input<'_>, pieces: &Pieces) -> Vec<bool> {
    let (faces, n) = (input.complex.faces, pieces.rim.len());
    let mut regions = DisjointSets::new(n);
    for f in faces.iter().filter(|f| f.open_area > 0.0) {
        regions.join(f.a, f.b);
    }
    let mut parts = vec![Part::default(); n];
    for p in 0..n {
        let part = &mut parts[regions.find(p as u32) as usize];
        part.known |= pieces.rim[p] || input.claims.rooms[p].is_some();
        part.rim |= pieces.rim[p];
        part.width = part.width.max(pieces.widths[p]);
        part.volume += pieces.volumes[p];
    }
    look(faces, &mut regions, &mut parts);
    if inside_out(&parts) {
        parts.iter_mut().for_each(Part::turn);
    }
    (0..n as u32).map(|p| parts[regions.find(p) as usize].is_free(input)).collect()
}

/// Adds up the areas that face into each region.
fn look(faces: &[Face], regions: &mut DisjointSets, parts: &mut [Part]) {
    for f in faces {
        let roots = [f.a, f.b].map(|p| regions.find(p) as usize);
        for (side, &root) in roots.iter().enumerate() {
            let looks = [f.fronts[side], f.fronts[1 - side]];
            let part = &mut parts[root];
            part.looks = [0, 1].map(|k| part.looks[k] + looks[k]);
            if roots[0] != roots[1] {
                part.covered = [0, 1].map(|k| part.covered[k] + looks[k].min(f.area));
                part.boundary += f.area;
            }
        }
    }
}

/// A connected component of pieces over open faces.
#[derive(Clone, Copy, Default)]
struct Part {
    /// Whether it is connected to the rim or an author's room; and to the rim.
    known: bool,
    rim: bool,
    /// Width of its widest piece, metres.
    width: f64,
    /// Cubic metres.
    volume: f64,
    /// Area of opaque triangles that face into it with their front, and with their back; square metres.
    looks: [f64; 2],
    /// The covered area of its boundary, likewise; no face counts twice.
    covered: [f64; 2],
    /// Area of its boundary, square metres.
    boundary: f64,
}

impl Part {
    fn turn(&mut self) {
        self.looks.reverse();
        self.covered.reverse();
    }

    /// Solid all around, even with other surfaces against it, as for a pier between two slabs.
    fn is_solid(&self, options: &PlanOptions) -> bool {
        self.covered[1] >= options.all * self.boundary && self.covered[0] < options.nearly_all * self.boundary
    }

    fn is_free(&self, input: &Input<'_>) -> bool {
        let options = input.options;
        let wide = |metres: f64| self.width >= input.human.metres(metres);
        let [inward, outward] = self.looks;
        let passable = inward > options.inward * outward && wide(options.least_width);
        let roomy = inward > options.mixed * outward && wide(options.mixed_width);
        self.known || !self.is_solid(options) && (passable || roomy)
    }
}

/// True if the outside and most sealed space see backs: solids turned inside out. A level of inner faces also shows its backs outside, but
/// fronts within.
fn inside_out(parts: &[Part]) -> bool {
    let mut outside = [0.0; 2];
    let mut sealed = [0.0; 2];
    for part in parts {
        if part.rim {
            outside = [0, 1].map(|k| outside[k] + part.looks[k]);
        } else if !part.known {
            sealed[usize::from(part.looks[1] > part.looks[0])] += part.volume;
        }
    }
    outside[1] > outside[0] && sealed[1] > sealed[0]
}
