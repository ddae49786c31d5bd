//! Free space against solid matter: what is reached from outside or from an author's room, and what is sealed but looks like a room.

use crate::cells::complex::faces::Face;
use crate::cells::disjoint_sets::DisjointSets;
use crate::cells::plan::options::PlanOptions;
use crate::cells::plan::space::{Input, Pieces};

/// Which pieces are free: those that open faces join to the rim or to an author's room, and sealed ones whose walls look inward
/// (or, where the model is wound both ways, that are as large as a room), the cavities of walls apart. A wrong answer costs
/// culling, not correctness: no line leaves a sealed piece.
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

/// Adds up what looks into each region.
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

/// Pieces that open faces join.
#[derive(Clone, Copy, Default)]
struct Part {
    /// Reached from the rim or an author's room; from the rim.
    known: bool,
    rim: bool,
    /// Of its widest piece, metres.
    width: f64,
    /// Cubic metres.
    volume: f64,
    /// Area of opaque triangles whose front looks into it, and of those whose back does; square metres.
    looks: [f64; 2],
    /// The same of its boundary, no face counted twice.
    covered: [f64; 2],
    /// Area of its boundary, square metres.
    boundary: f64,
}

impl Part {
    fn turn(&mut self) {
        self.looks.reverse();
        self.covered.reverse();
    }

    /// Solid all around, whatever else stands against it, as a pier between two slabs.
    fn is_solid(&self, options: &PlanOptions) -> bool {
        self.covered[1] >= options.backs * self.boundary && self.covered[0] < options.fronts * self.boundary
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

/// True where the outside sees backs, and most of what is sealed does too: solids turned inside out. A level made of inner faces
/// alone shows its backs outside as well, but fronts within.
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
