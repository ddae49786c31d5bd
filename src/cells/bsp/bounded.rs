//! A tree of bounded size: where the walls of a scene cut space, and one another, into more leaves than there may be, those of the least
//! planes part nothing.
//!
//! Everything after the tree takes time and memory by the leaf. In rubble, foliage or terrain each wall cuts many others, so that there are
//! more leaves to a triangle the more triangles there are, and none of them hides much. The graph stays sound: what parts nothing may
//! stand in a cell.

use super::planes::Shell;
use super::tree::{self, Bsp, Limits, Tiling};
use crate::cells::BOUND;
use crate::geom::Aabb;
use crate::job::{Job, Stopped};
use crate::types::note::Note;
use glam::DVec3;

/// Leaves that a scene may have, and so many more for each of its triangles. Buildings and levels have up to 13,000, or 3 a triangle; soups of thin
/// triangles 30. More: time and memory go into leaves that hide nothing. Less: small scenes of large walls that cross lose some.
const LEAVES: usize = 20_000;
const LEAVES_A_TRIANGLE: usize = 4;
/// What a large scene may have, and one more for so many of its triangles. More: soups of a hundred thousand triangles take more than a gigabyte.
/// Less: large buildings are coarser than they need be.
const LEAVES_OF_MANY: usize = 200_000;
const TRIANGLES_A_LEAF_OF_MANY: usize = 16;
/// What a leaf takes, with all that is made of it until the graph is there, bytes. More: large scenes are coarser than they need be.
/// Less: a split takes more memory than it may.
const LEAF_BYTES: u64 = 5 << 10;

/// The limits for a scene of so many triangles, in `memory` bytes.
pub fn limits<'w>(triangles: usize, memory: u64, work: &'w Job<'w>) -> Limits<'w> {
    let affordable = usize::try_from(memory / LEAF_BYTES).unwrap_or(usize::MAX).max(LEAVES);
    let few = LEAVES.saturating_add(LEAVES_A_TRIANGLE.saturating_mul(triangles));
    let many = LEAVES_OF_MANY + triangles / TRIANGLES_A_LEAF_OF_MANY;
    Limits { leaves: few.min(many).min(affordable), work }
}

/// The tree of the shell, from which as many planes are taken as it takes to fit. Other arguments as for [`tree::bsp`].
pub fn tree(
    shell: &mut Shell,
    domain: Aabb,
    axes: [DVec3; 3],
    coplanar: f64,
    mut tiling: Option<Tiling<'_>>,
    limits: &Limits<'_>,
) -> Result<Bsp, Stopped> {
    loop {
        let found = tree::bsp(shell, domain, axes, coplanar, tiling, limits);
        limits.work.go_on()?;
        match found {
            Some(bsp) => return Ok(bsp),
            // Tiles alone are too many.
            None if shell.triangles.is_empty() => tiling = None,
            None => shell.keep_larger_half(),
        }
    }
}

/// What users should know where planes were left out of a shell.
pub fn note(shell: &Shell, limits: &Limits<'_>) -> Option<Note> {
    let (left_out, kept, most) = (shell.left_out, shell.triangles.len(), limits.leaves);
    let says = || {
        Note::cost(format!(
            "{BOUND}walls would cut space into more than {most} leaves; the {left_out} triangles of the smallest planes part nothing, \
             {kept} do; cells are coarser for it"
        ))
    };
    (left_out > 0).then(says)
}
