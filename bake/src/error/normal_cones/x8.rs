//! Of eight sets of normals at once, what [`cone_error_bound`](super::error_in_cones) cannot exceed.

use sdf_core::nalgebra::Vector3;

use super::{MAX_ERROR, order};
use crate::rounding::NORMAL_SLACK;
use crate::simd::{LANES, Lanes, VectorX8, cross, dot, lane_of, max, min};

/// Normals that are looked at in one turn of a loop. With fewer, a loop over the lanes is unrolled and falls to pieces.
const TOGETHER: usize = 4;

/// For each of eight sets of normals, no less than [`cone_error_bound`](super::error_in_cones) says of it as one cone. `sets`: by the numbers of the
/// normals, ascending; and `holds`: of each normal 1 for the sets that it belongs to, else 0.
pub(crate) fn cone_error_bounds_x8(
    arch: pulp::Arch,
    normals: &[Vector3<f64>],
    sets: [&[u32]; LANES],
    holds: &[[u64; LANES]],
) -> Lanes<f64> {
    arch.dispatch(MostErrors { normals, sets, holds })
}

struct MostErrors<'a> {
    normals: &'a [Vector3<f64>],
    sets: [&'a [u32]; LANES],
    holds: &'a [[u64; LANES]],
}

impl pulp::NullaryFnOnce for MostErrors<'_> {
    type Output = Lanes<f64>;

    /// By the ball of the first cap that is tried around one cone, for no wider one is taken.
    #[inline(always)]
    fn call(self) -> Lanes<f64> {
        let starts = self.sets.map(|set| set.first().map_or(0, |first| u64::from(*first)));
        if self.normals.is_empty() {
            return [MAX_ERROR; LANES];
        }
        let starts = self.of_numbers(starts);
        let first = self.farthest_along(&starts);
        let second = self.farthest_along(&first);
        let mut axes = starts;
        for lane in 0..LANES {
            let sum = Vector3::from(lane_of(&first, lane)) + Vector3::from(lane_of(&second, lane));
            let axis = sum.try_normalize(NORMAL_SLACK).unwrap_or(lane_of(&starts, lane).into());
            (0..3).for_each(|of| axes[of][lane] = axis[of]);
        }
        let (least, sine_sq) = self.least_share_and_largest_sine_sq(&axes);
        std::array::from_fn(|lane| {
            // One that is not known has no share along any axis.
            if self.sets[lane].is_empty() || least[lane] <= 0.0 {
                return MAX_ERROR;
            }
            (MAX_ERROR * sine_sq[lane].sqrt().min(1.0) + NORMAL_SLACK).min(MAX_ERROR)
        })
    }
}

impl MostErrors<'_> {
    #[inline(always)]
    fn of_numbers(&self, numbers: [u64; LANES]) -> VectorX8<f64> {
        let mut normals = [[0.0; LANES]; 3];
        for lane in 0..LANES {
            let normal = self.normals[numbers[lane] as usize];
            (0..3).for_each(|axis| normals[axis][lane] = normal[axis]);
        }
        normals
    }

    /// As [`Normals::farthest_along`](super::Normals::farthest_along) of each set.
    #[inline(always)]
    fn farthest_along(&self, along: &VectorX8<f64>) -> VectorX8<f64> {
        let (mut least, mut farthest) = ([i64::MAX; LANES], [0; LANES]);
        for (first, some) in self.some() {
            for lane in 0..LANES {
                for (number, Held { normal, holds }) in (first..).zip(&some) {
                    let share = dot(*normal, lane_of(along, lane));
                    let order = if holds[lane] == 1 { order(share) } else { i64::MAX };
                    let is_less = order < least[lane];
                    least[lane] = if is_less { order } else { least[lane] };
                    farthest[lane] = if is_less { number } else { farthest[lane] };
                }
            }
        }
        self.of_numbers(farthest)
    }

    #[inline(always)]
    fn least_share_and_largest_sine_sq(&self, axes: &VectorX8<f64>) -> (Lanes<f64>, Lanes<f64>) {
        let (mut least, mut largest) = ([1.0; LANES], [0.0; LANES]);
        for (_, some) in self.some() {
            for lane in 0..LANES {
                let axis = lane_of(axes, lane);
                for Held { normal, holds } in &some {
                    let share = dot(*normal, axis);
                    let across = cross(*normal, axis);
                    let sine_sq = dot(across, across);
                    least[lane] = min(if holds[lane] == 1 { share } else { 1.0 }, least[lane]);
                    largest[lane] = max(if holds[lane] == 1 { sine_sq } else { 0.0 }, largest[lane]);
                }
            }
        }
        (least, largest)
    }

    /// Some at a time, and the number of the first. The last stands several times where there are fewer, but only once as the first
    /// of its like.
    #[inline(always)]
    fn some(&self) -> impl Iterator<Item = (u64, [Held; TOGETHER])> {
        let held = |number: usize| {
            let number = number.min(self.normals.len() - 1);
            Held { normal: self.normals[number].into(), holds: self.holds[number] }
        };
        let firsts = (0..self.normals.len()).step_by(TOGETHER);
        firsts.map(move |first| (first as u64, std::array::from_fn(|number| held(first + number))))
    }
}

/// A normal, and 1 for the sets that it belongs to, else 0.
struct Held {
    normal: [f64; 3],
    holds: [u64; LANES],
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::normal_cones::cone_error_bound;
    use crate::error::normal_cones::tests::gathered;
    use crate::testing::{instruction_sets, random, random_vector};

    #[test]
    fn what_is_said_of_eight_sets_at_once_is_no_less_than_of_each_by_itself() {
        let mut state = 19;
        println!("seed {state}");
        let mut tight = 0;
        for (round, arch) in (0..3000).zip(instruction_sets().into_iter().cycle()) {
            let flood = [1.5, 0.3, 1e-3, 0.0][round % 4] * random(&mut state).abs();
            let middle = random_vector(&mut state).normalize();
            let mut normal = || (middle + random_vector(&mut state) * flood).normalize();
            let mut normals: Vec<_> = (0..round % 23).map(|_| normal()).collect();
            if round % 5 == 0 {
                // On several an axis has the same share, be it zero of either sign.
                normals
                    .iter_mut()
                    .for_each(|normal| *normal = normal.map(f64::round).try_normalize(0.5).unwrap_or(middle));
            }
            if round % 7 == 0 && !normals.is_empty() {
                normals[round % 11 % (round % 23)] = Vector3::zeros();
            }
            let is_in = |state: &mut u64| u64::from(random(state) > [0.5, -0.5, -1.1][round % 3]);
            let holds: Vec<[u64; LANES]> = normals.iter().map(|_| std::array::from_fn(|_| is_in(&mut state))).collect();
            let sets: [Vec<u32>; LANES] = std::array::from_fn(|set| {
                (0..normals.len() as u32).filter(|number| holds[*number as usize][set] == 1).collect()
            });
            let most = cone_error_bounds_x8(arch, &normals, std::array::from_fn(|set| &sets[set][..]), &holds);
            for (set, most) in sets.iter().zip(most) {
                let of_set: Vec<_> = set.iter().map(|number| normals[*number as usize]).collect();
                let error = cone_error_bound(&[gathered(&of_set)]);
                assert!(error <= most && most <= MAX_ERROR, "{error} {most} {of_set:?} by {arch:?}");
                tight += usize::from(error == most && error < MAX_ERROR);
            }
        }
        assert!(tight > 3000, "{tight}");
    }
}
