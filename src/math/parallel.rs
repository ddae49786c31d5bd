//! Parallel loops with the feature `bake`, and sequential ones without: a game has its own threads.
//!
//! The compiler instantiates rayon's generic code for each loop body. So this file has only one rayon loop, `each`, which calls its body
//! through a pointer. The other loops run on blocks of items with it, and keep results in the order of items.

use std::ops::Range;
use std::sync::{Mutex, PoisonError};

/// Most blocks of a loop. More: tiny items cost more than in a plain loop. Fewer: threads wait for the last block of uneven items.
const BLOCKS: usize = 1024;

/// Threads that loops run on.
#[cfg(feature = "bake")]
pub fn threads() -> usize {
    rayon::current_num_threads()
}

/// Threads that loops run on.
#[cfg(not(feature = "bake"))]
fn threads() -> usize {
    1
}

/// Calls `run` with each number below `n`, the first ones first.
#[cfg(feature = "bake")]
pub(crate) fn each(n: usize, run: &(dyn Fn(usize) + Sync)) {
    use rayon::prelude::*;
    (0..n).into_par_iter().with_max_len(1).for_each(run);
}

/// Calls `run` with each number below `n`, the first ones first.
#[cfg(not(feature = "bake"))]
fn each(n: usize, run: &(dyn Fn(usize) + Sync)) {
    (0..n).for_each(run);
}

/// Deals jobs by turns to threads of the moment, one for each core, each with memory of its own: for what a game does once, with threads or without.
#[cfg(not(target_family = "wasm"))]
pub(crate) fn deal<T: Send, M>(
    jobs: impl Iterator<Item = T>,
    memory: &(impl Fn() -> M + Sync),
    work: &(impl Fn(T, &mut M) + Sync),
) {
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let mut parts: Vec<Vec<T>> = (0..threads).map(|_| Vec::new()).collect();
    jobs.enumerate().for_each(|(number, job)| parts[number % threads].push(job));
    std::thread::scope(|scope| {
        for part in parts.into_iter().filter(|part| !part.is_empty()) {
            scope.spawn(move || {
                let mut memory = memory();
                part.into_iter().for_each(|job| work(job, &mut memory));
            });
        }
    });
}

/// The same in a browser, which starts no threads.
#[cfg(target_family = "wasm")]
pub(crate) fn deal<T, M>(jobs: impl Iterator<Item = T>, memory: &impl Fn() -> M, work: &impl Fn(T, &mut M)) {
    let mut memory = memory();
    jobs.for_each(|job| work(job, &mut memory));
}

/// Size of a block of `n` items; the last block may have fewer.
fn block_size(n: usize) -> usize {
    let blocks = if threads() == 1 { 1 } else { BLOCKS };
    n.div_ceil(blocks).max(1)
}

/// Concatenated results of `fill` over parts of `range`, in order.
fn collect<R: Send>(range: Range<usize>, fill: &(dyn Fn(Range<usize>, &mut Vec<R>) + Sync)) -> Vec<R> {
    let size = block_size(range.len());
    let count = range.len().div_ceil(size);
    let mut blocks: Vec<Vec<R>> = Vec::new();
    blocks.resize_with(count, Vec::new);
    let blocks = Mutex::new(blocks);
    each(count, &|k| {
        let start = range.start + k * size;
        let mut block = Vec::new();
        fill(start..(start + size).min(range.end), &mut block);
        blocks.lock().unwrap_or_else(PoisonError::into_inner)[k] = block;
    });
    let mut blocks = blocks.into_inner().unwrap_or_else(PoisonError::into_inner);
    let mut all = Vec::new();
    if let [first, rest @ ..] = &mut blocks[..] {
        std::mem::swap(&mut all, first);
        all.reserve_exact(rest.iter().map(Vec::len).sum());
        for block in rest {
            all.append(&mut std::mem::take(block));
        }
    }
    all
}

/// The results of `f` for each item, in order.
pub fn map<T: Sync, R: Send>(items: &[T], f: impl Fn(&T) -> R + Sync) -> Vec<R> {
    collect(0..items.len(), &|range, out| {
        out.reserve_exact(range.len());
        for item in &items[range] {
            out.push(f(item));
        }
    })
}

/// The results of `f` for each number, in order.
#[cfg(feature = "bake")]
pub fn map_range<R: Send>(range: Range<usize>, f: impl Fn(usize) -> R + Sync) -> Vec<R> {
    collect(range, &|range, out| {
        out.reserve_exact(range.len());
        for i in range {
            out.push(f(i));
        }
    })
}

/// As [`map_range`] below `n`, with scratch memory, on which no result may depend.
#[cfg(feature = "bake")]
pub fn map_init<S: Send, R: Send>(
    n: usize,
    scratch: impl Fn() -> S + Sync,
    f: impl Fn(&mut S, usize) -> R + Sync,
) -> Vec<R> {
    let scratch = Scratch::new(&scratch);
    collect(0..n, &|range, out| {
        let mut memory = scratch.take();
        out.reserve_exact(range.len());
        for i in range {
            out.push(f(&mut memory, i));
        }
        scratch.put(memory);
    })
}

/// The concatenated results of `f` for each item, in order.
#[cfg(feature = "bake")]
pub(crate) fn flat_map<T: Sync, I: IntoIterator<Item: Send>>(items: &[T], f: impl Fn(&T) -> I + Sync) -> Vec<I::Item> {
    flat_map_range(0..items.len(), |i| f(&items[i]))
}

/// The concatenated results of `f` for each number, in order.
#[cfg(feature = "bake")]
pub fn flat_map_range<I: IntoIterator<Item: Send>>(range: Range<usize>, f: impl Fn(usize) -> I + Sync) -> Vec<I::Item> {
    collect(range, &|range, out| {
        for i in range {
            out.extend(f(i));
        }
    })
}

/// Calls `run` with the blocks of `items`, and the index of the first item of each.
#[cfg(feature = "bake")]
fn blocks_mut<T: Send>(items: &mut [T], run: &(dyn Fn(usize, &mut [T]) + Sync)) {
    let size = block_size(items.len());
    let count = items.len().div_ceil(size);
    let blocks = Mutex::new(items.chunks_mut(size).enumerate());
    each(count, &|_| {
        let next = blocks.lock().unwrap_or_else(PoisonError::into_inner).next();
        if let Some((k, block)) = next {
            run(k * size, block);
        }
    });
}

/// Calls `f` with each item and its index.
#[cfg(feature = "bake")]
pub fn for_each_mut<T: Send>(items: &mut [T], f: impl Fn(usize, &mut T) + Sync) {
    blocks_mut(items, &|first, block| {
        for (i, item) in block.iter_mut().enumerate() {
            f(first + i, item);
        }
    });
}

/// As [`for_each_mut`], with scratch memory, on which no result may depend.
#[cfg(feature = "bake")]
pub(crate) fn for_each_init<S: Send, T: Send>(
    items: &mut [T],
    scratch: impl Fn() -> S + Sync,
    f: impl Fn(&mut S, usize, &mut T) + Sync,
) {
    let scratch = Scratch::new(&scratch);
    blocks_mut(items, &|first, block| {
        let mut memory = scratch.take();
        for (i, item) in block.iter_mut().enumerate() {
            f(&mut memory, first + i, item);
        }
        scratch.put(memory);
    });
}

/// Calls `f` with each chunk of `size` items and its index; the last chunk may be shorter.
#[cfg(feature = "bake")]
pub fn for_each_chunk<T: Send>(items: &mut [T], size: usize, f: impl Fn(usize, &mut [T]) + Sync) {
    let mut chunks: Vec<&mut [T]> = items.chunks_mut(size).collect();
    for_each_mut(&mut chunks, |k, chunk| f(k, chunk));
}

/// Both results, computed in parallel if there are threads.
#[cfg(feature = "bake")]
pub(crate) fn join<A: Send, B: Send>(a: impl FnOnce() -> A + Send, b: impl FnOnce() -> B + Send) -> (A, B) {
    rayon::join(a, b)
}

/// Scratch memory, exclusive to one thread at a time.
#[cfg(feature = "bake")]
pub(crate) struct Scratch<'n, S> {
    new: &'n (dyn Fn() -> S + Sync),
    idle: Mutex<Vec<S>>,
}

#[cfg(feature = "bake")]
impl<'n, S> Scratch<'n, S> {
    /// Creates memory with `new` if none is idle.
    pub fn new(new: &'n (dyn Fn() -> S + Sync)) -> Self {
        Self { new, idle: Mutex::new(Vec::new()) }
    }

    /// Takes memory.
    pub fn take(&self) -> S {
        let idle = self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop();
        idle.unwrap_or_else(self.new)
    }

    /// Returns memory.
    pub fn put(&self, memory: S) {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(memory);
    }
}

#[cfg(all(test, feature = "bake"))]
mod tests {
    use super::*;

    /// None, one, few, as many as blocks, and blocks of several with a short one at the end.
    const COUNTS: [usize; 5] = [0, 1, 7, BLOCKS, 3 * BLOCKS + 5];

    /// Runs `test` with each number of items, on one thread and on several.
    fn on_threads(test: impl Fn(usize) + Sync) {
        for threads in [1, 4] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| COUNTS.iter().for_each(|&n| test(n)));
        }
    }

    /// Distinct items.
    fn items(n: usize) -> Vec<u64> {
        (0..n as u64).map(|i| i.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 7).collect()
    }

    #[test]
    fn maps_keep_the_order() {
        on_threads(|n| {
            let items = items(n);
            let expected: Vec<String> = items.iter().map(u64::to_string).collect();
            assert_eq!(map(&items, u64::to_string), expected);
            assert_eq!(map_range(0..n, |i| items[i].to_string()), expected);
            assert_eq!(map_init(n, || 0, |_, i| items[i].to_string()), expected);
            assert_eq!(map_range(5..5 + n, |i| 3 * i), (5..5 + n).map(|i| 3 * i).collect::<Vec<_>>());
        });
    }

    #[test]
    fn flat_maps_keep_the_order() {
        on_threads(|n| {
            let items = items(n);
            let several = |i: &u64| (0..i % 4).map(|k| i + k).collect::<Vec<u64>>();
            let some = |i: usize| items[i].is_multiple_of(3).then_some(i);
            assert_eq!(flat_map(&items, several), items.iter().flat_map(several).collect::<Vec<_>>());
            assert_eq!(flat_map_range(0..n, some), (0..n).filter_map(some).collect::<Vec<_>>());
        });
    }

    #[test]
    fn each_item_is_changed_once() {
        on_threads(|n| {
            let expected: Vec<u64> = items(n).iter().zip(0..).map(|(item, i)| 3 * item + i).collect();
            let mut changed = items(n);
            for_each_mut(&mut changed, |i, item| *item = 3 * *item + i as u64);
            assert_eq!(changed, expected);
            let mut changed = items(n);
            for_each_init(&mut changed, || (), |(), i, item| *item = 3 * *item + i as u64);
            assert_eq!(changed, expected);
            let mut changed = items(n);
            for_each_chunk(&mut changed, 3, |k, chunk| {
                chunk.iter_mut().zip(3 * k as u64..).for_each(|(item, i)| *item = 3 * *item + i);
            });
            assert_eq!(changed, expected);
        });
    }

    #[test]
    fn scratch_memory_is_used_again_and_never_shared() {
        on_threads(|n| {
            let made = Mutex::new(0);
            let scratch = || {
                *made.lock().unwrap() += 1;
                Mutex::new(())
            };
            map_init(n, scratch, |memory, _| assert!(memory.try_lock().is_ok()));
            assert!(*made.lock().unwrap() <= threads());
        });
    }

    #[test]
    fn both_sides_are_joined() {
        on_threads(|n| assert_eq!(join(|| n + 1, || n.to_string()), (n + 1, n.to_string())));
    }
}
