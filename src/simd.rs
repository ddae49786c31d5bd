//! Inner loops in the widest registers that pay: the same source, compiled more than once, and chosen when the program runs.
//!
//! Loops are written over lanes, and the compiler puts these into registers; results are the same bits in any width. Without the feature
//! `simd`, there is one version, for the least processor of the target.

/// Work that is compiled for several widths.
pub(crate) trait Vectorize: Sized {
    /// What comes out.
    type Output;

    /// Does it; `#[inline(always)]`, as must be all that it calls in its inner loops.
    fn work(self) -> Self::Output;
}

#[cfg(feature = "simd")]
struct Wide<W>(W);

#[cfg(feature = "simd")]
impl<W: Vectorize> pulp::WithSimd for Wide<W> {
    type Output = W::Output;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> W::Output {
        self.0.work()
    }
}

/// Does the work with the widest registers that the processor has, of those that pay: 32 bytes.
#[cfg(feature = "simd")]
pub(crate) fn vectorized<W: Vectorize>(work: W) -> W::Output {
    dispatch(Wide(work))
}

/// The same for work that names its registers.
#[cfg(feature = "simd")]
pub(crate) fn dispatch<W: pulp::WithSimd>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = pulp::x86::V3::try_new() {
        return pulp::Simd::vectorize(simd, work);
    }
    pulp::Arch::new().dispatch(work)
}

/// Does the work with the registers that every processor of the target has.
#[cfg(not(feature = "simd"))]
pub(crate) fn vectorized<W: Vectorize>(work: W) -> W::Output {
    work.work()
}
