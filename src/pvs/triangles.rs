//! The drawing cost of a row: the triangles of its objects.

use crate::scene::Scene;

/// The triangles of each object.
pub(super) struct Triangles(Vec<u64>);

impl Triangles {
    pub fn of(scene: &Scene) -> Self {
        Self(scene.objects.iter().map(|o| o.triangles.len() as u64).collect())
    }

    pub fn objects(&self) -> usize {
        self.0.len()
    }

    /// Sum over the objects set in a row's words.
    pub fn in_row(&self, words: impl Iterator<Item = u64>) -> u64 {
        let mut sum = 0;
        for (i, mut word) in words.enumerate() {
            while word != 0 {
                sum += self.0[64 * i + word.trailing_zeros() as usize];
                word &= word - 1;
            }
        }
        sum
    }
}
