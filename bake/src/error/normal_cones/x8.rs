//! Cheap upper bounds of [`cone_error_bound`](super::cone_error_bound) for eight sets of normals at once.
//!
//! The axis of the first cap is the sum of the two normals farthest apart.
//! [`cone_error_bound`](super::cone_error_bound) takes another cap only if it is smaller, so (√3/2) sin θ of the first
//! one is an upper bound.

use sdf_core::nalgebra::Vector3;

use super::{MAX_ERROR, total_order_key};
use crate::rounding::NORMAL_SLACK;
use crate::simd::{LANES, Lanes, VectorX8, cross, dot, lane_of, max, min};

/// Normals per iteration. With fewer the compiler unrolls the loop over the lanes, and no longer vectorizes it.
const UNROLL: usize = 4;

/// Upper bounds of [`cone_error_bound`](super::cone_error_bound) of each set as one cone.
///
/// `sets`: ascending indices of normals. `memberships`: for each normal, 1 in the lanes of its sets, else 0.
pub(crate) fn cone_error_bounds_x8(
    arch: pulp::Arch,
    normals: &[Vector3<f64>],
    sets: [&[u32]; LANES],
    memberships: &[Lanes<u64>],
) -> Lanes<f64> {
    arch.dispatch(ConeErrorBoundsX8 { normals, sets, memberships })
}

struct ConeErrorBoundsX8<'a> {
    normals: &'a [Vector3<f64>],
    sets: [&'a [u32]; LANES],
    memberships: &'a [Lanes<u64>],
}

impl pulp::NullaryFnOnce for ConeErrorBoundsX8<'_> {
    type Output = Lanes<f64>;

    #[inline(always)]
    fn call(self) -> Lanes<f64> {
        let starts = self.sets.map(|set| set.first().map_or(0, |first| u64::from(*first)));
        if self.normals.is_empty() {
            return [MAX_ERROR; LANES];
        }
        let starts = self.gather(starts);
        let first = self.farthest_from(&starts);
        let second = self.farthest_from(&first);
        let mut axes = starts;
        for lane in 0..LANES {
            let sum = Vector3::from(lane_of(&first, lane)) + Vector3::from(lane_of(&second, lane));
            let axis = sum.try_normalize(NORMAL_SLACK).unwrap_or(lane_of(&starts, lane).into());
            (0..3).for_each(|component| axes[component][lane] = axis[component]);
        }
        let (min_cosine, max_sine_sq) = self.min_cosine_and_max_sine_sq(&axes);
        std::array::from_fn(|lane| {
            // An unknown normal is zero, and so is its dot product with the axis.
            if self.sets[lane].is_empty() || min_cosine[lane] <= 0.0 {
                return MAX_ERROR;
            }
            (MAX_ERROR * max_sine_sq[lane].sqrt().min(1.0) + NORMAL_SLACK).min(MAX_ERROR)
        })
    }
}

impl ConeErrorBoundsX8<'_> {
    #[inline(always)]
    fn gather(&self, indices: Lanes<u64>) -> VectorX8<f64> {
        let mut normals = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            let normal = self.normals[indices[lane] as usize];
            (0..3).for_each(|axis| normals[axis][lane] = normal[axis]);
        }
        normals
    }

    /// [`Normals::farthest_from`](super::Normals::farthest_from) of each set.
    #[inline(always)]
    fn farthest_from(&self, directions: &VectorX8<f64>) -> VectorX8<f64> {
        let (mut lowest, mut farthest) = ([i64::MAX; LANES], [0; LANES]);
        for (first, members) in self.members() {
            for lane in 0..LANES {
                for (index, Member { normal, membership }) in (first..).zip(&members) {
                    let cosine = dot(*normal, lane_of(directions, lane));
                    let key = if membership[lane] == 1 { total_order_key(cosine) } else { i64::MAX };
                    let is_lower = key < lowest[lane];
                    lowest[lane] = if is_lower { key } else { lowest[lane] };
                    farthest[lane] = if is_lower { index } else { farthest[lane] };
                }
            }
        }
        self.gather(farthest)
    }

    #[inline(always)]
    fn min_cosine_and_max_sine_sq(&self, axes: &VectorX8<f64>) -> (Lanes<f64>, Lanes<f64>) {
        let (mut min_cosine, mut max_sine_sq) = ([1.0; LANES], [0.0; LANES]);
        for (_, members) in self.members() {
            for lane in 0..LANES {
                let axis = lane_of(axes, lane);
                for Member { normal, membership } in &members {
                    let cosine = dot(*normal, axis);
                    let cross = cross(*normal, axis);
                    let sine_sq = dot(cross, cross);
                    min_cosine[lane] = min(if membership[lane] == 1 { cosine } else { 1.0 }, min_cosine[lane]);
                    max_sine_sq[lane] = max(if membership[lane] == 1 { sine_sq } else { 0.0 }, max_sine_sq[lane]);
                }
            }
        }
        (min_cosine, max_sine_sq)
    }

    /// [`UNROLL`] normals at a time, with the index of the first. The last is repeated, which changes no first minimum.
    #[inline(always)]
    fn members(&self) -> impl Iterator<Item = (u64, [Member; UNROLL])> {
        let member = |index: usize| {
            let index = index.min(self.normals.len() - 1);
            Member { normal: self.normals[index].into(), membership: self.memberships[index] }
        };
        let firsts = (0..self.normals.len()).step_by(UNROLL);
        firsts.map(move |first| (first as u64, std::array::from_fn(|offset| member(first + offset))))
    }
}

/// A normal, with 1 in the lanes of the sets that hold it, else 0.
struct Member {
    normal: [f64; 3],
    membership: Lanes<u64>,
}

#[cfg(test)]
mod tests;
