//! Loops on all threads where the builder is there, and on one where it isn't: a game has threads of its own.

/// What `f` makes of each item, in order.
#[cfg(feature = "bake")]
pub(crate) fn map<T: Sync, R: Send>(items: &[T], f: impl Fn(&T) -> R + Send + Sync) -> Vec<R> {
    use rayon::prelude::*;
    items.par_iter().map(f).collect()
}

/// What `f` makes of each item, in order.
#[cfg(not(feature = "bake"))]
pub(crate) fn map<T, R>(items: &[T], f: impl Fn(&T) -> R) -> Vec<R> {
    items.iter().map(f).collect()
}
