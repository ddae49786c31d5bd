//! Inner loops in the widest useful registers: the same source, compiled several times, and dispatched at run time.
//!
//! Loops are over lanes, which the compiler vectorizes; results are the same bits in any width. Without the feature `simd`, there is one
//! version, for the target's baseline processor.

/// Work compiled for several register widths.
pub(crate) trait Vectorize: Sized {
    /// The result type.
    type Output;

    /// Does the work; `#[inline(always)]`, like everything that it calls in its inner loops, at least with the feature `simd`.
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

/// Does the work with the widest useful registers of the processor: up to 32 bytes.
#[cfg(feature = "simd")]
pub(crate) fn vectorized<W: Vectorize>(work: W) -> W::Output {
    dispatch(Wide(work))
}

/// The same for work with explicit registers.
#[cfg(feature = "simd")]
pub(crate) fn dispatch<W: pulp::WithSimd>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = pulp::x86::V3::try_new() {
        return pulp::Simd::vectorize(simd, work);
    }
    pulp::Arch::new().dispatch(work)
}

/// Does the work with the target's baseline registers.
#[cfg(not(feature = "simd"))]
pub(crate) fn vectorized<W: Vectorize>(work: W) -> W::Output {
    work.work()
}
