//! Work in the widest registers that pay.

/// Runs it with the widest registers that the processor has, of those that pay: 32 bytes.
pub(crate) fn vectorized<W: pulp::WithSimd>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    if let Some(simd) = pulp::x86::V3::try_new() {
        return pulp::Simd::vectorize(simd, work);
    }
    pulp::Arch::new().dispatch(work)
}
