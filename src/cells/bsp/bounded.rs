//! A tree of bounded size: if the walls give too many leaves, the planes with the least area do not split space.
//!
//! All later steps take time and memory per leaf. In rubble, foliage or terrain each wall cuts many others, so the number of leaves per
//! triangle grows with the number of triangles, and none hides much. The graph stays sound: triangles that do not split may stand in a
//! cell.

use super::planes::Shell;
use super::tree::{self, Bsp, Limits, Tiling};
use crate::cells::BOUND;
use crate::job::{Job, Stopped};
use crate::math::geom::Aabb;
use crate::types::note::Note;
use glam::DVec3;

/// Most leaves of a small scene: a base, plus a number per triangle. Buildings and levels have up to 13,000, or 3 per triangle; soups of
/// thin triangles have 30. More: time and memory go into leaves that hide nothing. Fewer: small scenes of large crossing walls lose some.
const LEAVES: usize = 20_000;
const LEAVES_A_TRIANGLE: usize = 4;
/// Most leaves of a large scene: a base, plus one for each group of triangles. More: soups of a hundred thousand triangles take more than a
/// gigabyte. Fewer: large buildings are unnecessarily coarse.
const LEAVES_OF_MANY: usize = 200_000;
const TRIANGLES_A_LEAF_OF_MANY: usize = 16;
/// Memory per leaf, with all data made from it, bytes. More: large scenes are unnecessarily coarse. Less: a split exceeds its memory limit.
const LEAF_BYTES: u64 = 5 << 10;

/// The limits for a scene of so many triangles, in `memory` bytes.
pub fn limits<'w>(triangles: usize, memory: u64, work: &'w Job<'w>) -> Limits<'w> {
    let affordable = usize::try_from(memory / LEAF_BYTES).unwrap_or(usize::MAX).max(LEAVES);
    let few = LEAVES.saturating_add(LEAVES_A_TRIANGLE.saturating_mul(triangles));
    let many = LEAVES_OF_MANY + triangles / TRIANGLES_A_LEAF_OF_MANY;
    Limits { leaves: few.min(many).min(affordable), work }
}

/// The tree of the shell, without as many planes as necessary to fit. Other arguments as for [`tree::bsp`].
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
            // The tiles alone are too many.
            None if shell.triangles.is_empty() => tiling = None,
            None => shell.keep_larger_half(),
        }
    }
}

/// A note if planes were left out of the shell.
pub fn note(shell: &Shell, limits: &Limits<'_>) -> Option<Note> {
    let (left_out, kept, most) = (shell.left_out, shell.triangles.len(), limits.leaves);
    let says = || {
        Note::cost(format!(
            "{BOUND}walls would cut space into more than {most} leaves; the {left_out} triangles of the smallest planes do not split space, \
             {kept} do, so cells are larger, and more is drawn"
        ))
    };
    (left_out > 0).then(says)
}
