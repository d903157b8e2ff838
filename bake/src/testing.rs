//! Helpers of the unit tests.

use sdf_core::nalgebra::Vector3;
use sdf_procedural::random::next_bits;

/// Uniform from −1 to 1.
pub(crate) fn random(state: &mut u64) -> f64 {
    (next_bits(state) >> 11) as f64 * 0.5_f64.powi(52) - 1.0
}

pub(crate) fn random_vector(state: &mut u64) -> Vector3<f64> {
    Vector3::from_fn(|_, _| random(state))
}

/// The instruction sets of this machine that `pulp` can dispatch to.
pub(crate) fn instruction_sets() -> Vec<pulp::Arch> {
    #[cfg(target_arch = "x86_64")]
    let known = [
        Some(pulp::Arch::Scalar),
        pulp::x86::V3::try_new().map(pulp::Arch::V3),
        pulp::x86::V4::try_new().map(pulp::Arch::V4),
    ];
    #[cfg(not(target_arch = "x86_64"))]
    let known = [Some(pulp::Arch::new())];
    known.into_iter().flatten().collect()
}
