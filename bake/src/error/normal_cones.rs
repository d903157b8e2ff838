//! How far apart the gradients of a distance can lie, and so by how much its trilinear interpolant can be off. The proof
//! stands in `docs/error-bounds.md`; the letters here are the same.

mod x8;

use sdf_core::nalgebra::Vector3;

use crate::rounding::NORMAL_SLACK;
use crate::simd::{LANES, Lanes, VectorX8, lane_of, max, min};
pub(crate) use x8::cone_error_bounds_x8;

/// Nothing is known of the gradients but that they are no longer than one: half a cell's diagonal over its side.
pub(crate) const MAX_ERROR: f64 = 0.866_025_403_784_438_7;

/// In wider caps a gradient's share across is bounded by the cap alone.
const MIN_COSINE: f64 = 0.1;

/// Unit normals of faces; a zero is one that is not known.
#[derive(Clone, Debug, Default)]
pub(crate) struct Normals {
    /// In the places after the last stands the first of the same eight once more.
    eights: Vec<VectorX8<f64>>,
    count: usize,
    is_any_unknown: bool,
}

impl Normals {
    pub fn clear(&mut self) {
        self.eights.clear();
        (self.count, self.is_any_unknown) = (0, false);
    }

    pub fn push(&mut self, normal: Vector3<f64>) {
        let lane = self.count % LANES;
        if lane == 0 {
            self.eights.push([0, 1, 2].map(|axis: usize| [normal[axis]; LANES]));
        } else if let Some(eight) = self.eights.last_mut() {
            (0..3).for_each(|axis| eight[axis][lane] = normal[axis]);
        }
        self.count += 1;
        self.is_any_unknown |= normal == Vector3::zeros();
    }

    /// Some of these, by their numbers.
    pub fn collect(&mut self, of: &[Vector3<f64>], numbers: &[u32]) {
        self.clear();
        numbers.iter().for_each(|number| self.push(of[*number as usize]));
    }

    #[inline(always)]
    fn first(&self) -> Vector3<f64> {
        lane_of(&self.eights[0], 0).into()
    }

    /// The first of those with the least share along a direction.
    #[inline(always)]
    fn farthest_along(&self, along: Vector3<f64>) -> Vector3<f64> {
        let (mut least, mut eights) = ([i64::MAX; LANES], [0_u64; LANES]);
        for (number, eight) in (0..).zip(&self.eights) {
            let shares = shares(eight, along);
            for lane in 0..LANES {
                let order = order(shares[lane]);
                let is_less = order < least[lane];
                least[lane] = if is_less { order } else { least[lane] };
                eights[lane] = if is_less { number } else { eights[lane] };
            }
        }
        let least_of_all = of_all(least, i64::min);
        let mut firsts = [u64::MAX; LANES];
        for lane in 0..LANES {
            let number = eights[lane] * LANES as u64 + lane as u64;
            firsts[lane] = if least[lane] == least_of_all { number } else { u64::MAX };
        }
        let first = of_all(firsts, u64::min) as usize;
        lane_of(&self.eights[first / LANES], first % LANES).into()
    }

    /// The least and the greatest share along a direction, no more than one and no less than minus one.
    #[inline(always)]
    fn range_along(&self, along: Vector3<f64>) -> [f64; 2] {
        let (mut least, mut greatest) = ([1.0; LANES], [-1.0; LANES]);
        for eight in &self.eights {
            let shares = shares(eight, along);
            for lane in 0..LANES {
                least[lane] = min(shares[lane], least[lane]);
                greatest[lane] = max(shares[lane], greatest[lane]);
            }
        }
        [of_all(least, |a, b| min(b, a)), of_all(greatest, |a, b| max(b, a))]
    }

    /// The square of the largest sine of an angle to a unit vector.
    #[inline(always)]
    fn largest_sine_sq(&self, axis: Vector3<f64>) -> f64 {
        let mut largest = [0.0; LANES];
        for [x, y, z] in &self.eights {
            for lane in 0..LANES {
                let across = Vector3::new(x[lane], y[lane], z[lane]).cross(&axis);
                largest[lane] = max(across.dot(&across), largest[lane]);
            }
        }
        of_all(largest, |a, b| max(b, a))
    }
}

/// In pairs, so that these too go side by side.
#[inline(always)]
fn of_all<T: Copy>(mut lanes: Lanes<T>, of_two: impl Fn(T, T) -> T) -> T {
    for half in [4, 2, 1] {
        for lane in 0..half {
            lanes[lane] = of_two(lanes[lane], lanes[lane + half]);
        }
    }
    lanes[0]
}

#[inline(always)]
fn shares([x, y, z]: &VectorX8<f64>, along: Vector3<f64>) -> Lanes<f64> {
    let mut shares = [0.0; LANES];
    for lane in 0..LANES {
        shares[lane] = x[lane] * along.x + y[lane] * along.y + z[lane] * along.z;
    }
    shares
}

/// A number that compares as [`f64::total_cmp`] does.
#[inline(always)]
fn order(x: f64) -> i64 {
    let bits = x.to_bits() as i64;
    bits ^ ((bits >> 63) as u64 >> 1) as i64
}

/// Unit normals, and a cap of the unit sphere around them: all directions u with u·axis ≥ cosine.
struct Cone<'a> {
    normals: &'a Normals,
    axis: Vector3<f64>,
    cosine: f64,
    sine: f64,
}

/// The most by which the interpolant of exact distances can be off, in spacings, where each gradient lies in one of these
/// cones. A cone is given by unit normals, of which it holds the nonnegative combinations.
pub(crate) fn cone_error_bound(cones: &[Normals]) -> f64 {
    if cones.is_empty() || cones.iter().any(|normals| normals.count == 0 || normals.is_any_unknown) {
        return MAX_ERROR;
    }
    pulp::Arch::new().dispatch(ErrorInCones(cones))
}

struct ErrorInCones<'a>(&'a [Normals]);

impl pulp::NullaryFnOnce for ErrorInCones<'_> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        if let [normals] = self.0 {
            return error_in(&[Cone::around(normals)]);
        }
        error_in(&self.0.iter().map(Cone::around).collect::<Vec<_>>())
    }
}

#[inline(always)]
fn error_in(cones: &[Cone]) -> f64 {
    let mut by_ranges = 0.0;
    for along in axes(cones) {
        by_ranges += 0.25 * range(cones, along);
    }
    (by_ball(cones).min(by_ranges) + NORMAL_SLACK).min(MAX_ERROR)
}

#[inline(always)]
fn by_ball(cones: &[Cone]) -> f64 {
    if let [cone] = cones {
        return MAX_ERROR * cone.sine;
    }
    let middle: Vector3<f64> = cones.iter().map(|cone| cone.axis).sum();
    let Some(middle) = middle.try_normalize(NORMAL_SLACK) else { return MAX_ERROR };
    let cosine = cones.iter().map(|cone| cone.range(middle)[0]).fold(1.0, f64::min);
    if cosine > 0.0 { MAX_ERROR * (1.0 - cosine * cosine).sqrt() } else { MAX_ERROR }
}

impl<'a> Cone<'a> {
    #[inline(always)]
    fn around(normals: &'a Normals) -> Self {
        let first = normals.farthest_along(normals.first());
        let second = normals.farthest_along(first);
        let mut boundary_cone = Self::with_axis(normals, first + second);
        if boundary_cone.cosine <= first.dot(&boundary_cone.axis) * (1.0 - NORMAL_SLACK) {
            // A third sticks out: the cap of all three, if it holds them in its smaller half.
            let third = normals.farthest_along(boundary_cone.axis);
            let around_three = (second - first).cross(&(third - first));
            for axis in [around_three, -around_three, first + second + third] {
                let other = Self::with_axis(normals, axis);
                if other.cosine > boundary_cone.cosine {
                    boundary_cone = other;
                }
            }
        }
        boundary_cone
    }

    #[inline(always)]
    fn with_axis(normals: &'a Normals, axis: Vector3<f64>) -> Self {
        let axis = axis.try_normalize(NORMAL_SLACK).unwrap_or(normals.first());
        let [least, _] = normals.range_along(axis);
        if least <= 0.0 {
            return Self { normals, axis, cosine: least.max(-1.0), sine: 1.0 };
        }
        // The sine has its digits where the cosine is near one.
        let sine = normals.largest_sine_sq(axis).sqrt().min(1.0);
        Self { normals, axis, cosine: (1.0 - sine * sine).sqrt(), sine }
    }

    /// The least and the greatest that a unit vector of the cone has along a direction.
    #[inline(always)]
    fn range(&self, along: Vector3<f64>) -> [f64; 2] {
        if self.cosine <= 0.0 {
            return [-1.0, 1.0];
        }
        let (height, across) = (self.axis.dot(&along), self.axis.cross(&along).norm());
        // cos(β ± θ), β the angle between axis and direction, but for where the cap holds the direction itself.
        let lowest = if -height >= self.cosine { -1.0 } else { height * self.cosine - across * self.sine };
        let highest = if height >= self.cosine { 1.0 } else { height * self.cosine + across * self.sine };
        if self.cosine < MIN_COSINE {
            return [lowest, highest];
        }
        let [least, greatest] = self.normals.range_along(along);
        // The weights of a combination sum to between 1 and 1/cosine.
        let least = if least < 0.0 { least / self.cosine } else { least };
        let greatest = if greatest > 0.0 { greatest / self.cosine } else { greatest };
        [lowest.max(least), highest.min(greatest)]
    }
}

/// Along a direction, from the least of all cones to the greatest.
#[inline(always)]
fn range(cones: &[Cone], along: Vector3<f64>) -> f64 {
    let [mut least, mut greatest] = [1.0_f64, -1.0_f64];
    for cone in cones {
        let [low, high] = cone.range(along);
        (least, greatest) = (least.min(low), greatest.max(high));
    }
    (greatest - least).max(0.0)
}

/// At right angles to each other, the first where the normals differ most.
#[inline(always)]
fn axes(cones: &[Cone]) -> [Vector3<f64>; 3] {
    let middle = cones[0].axis;
    let first = farthest_of(cones, middle);
    let second = farthest_of(cones, first);
    let flood = (second - first).try_normalize(NORMAL_SLACK).unwrap_or_else(|| any_across(middle));
    let next = middle - flood * middle.dot(&flood);
    let next = next.try_normalize(NORMAL_SLACK).unwrap_or_else(|| any_across(flood));
    [flood, next, flood.cross(&next)]
}

/// Of each cone the first of the normals with the least share along a direction; of all the first of these.
#[inline(always)]
fn farthest_of(cones: &[Cone], along: Vector3<f64>) -> Vector3<f64> {
    let mut farthest = cones[0].normals.farthest_along(along);
    for cone in &cones[1..] {
        let other = cone.normals.farthest_along(along);
        if order(other.dot(&along)) < order(farthest.dot(&along)) {
            farthest = other;
        }
    }
    farthest
}

fn any_across(direction: Vector3<f64>) -> Vector3<f64> {
    let least = direction.iamin();
    direction.cross(&Vector3::from_fn(|axis, _| if axis == least { 1.0 } else { 0.0 })).normalize()
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::testing::{random, random_vector};

    pub fn gathered(normals: &[Vector3<f64>]) -> Normals {
        let mut gathered = Normals::default();
        normals.iter().for_each(|normal| gathered.push(*normal));
        gathered
    }

    /// Whether a cone of these normals may hold a direction, as seen along some others.
    pub fn may_hold(normals: &Normals, direction: Vector3<f64>, state: &mut u64) -> bool {
        let cone = Cone::around(normals);
        (0..40).all(|_| {
            let along = random_vector(state).normalize();
            let [least, greatest] = cone.range(along);
            (least - 1e-9..=greatest + 1e-9).contains(&direction.dot(&along))
        })
    }

    #[test]
    fn what_is_found_in_lanes_is_what_is_found_one_by_one() {
        let mut state = 13;
        println!("seed {state}");
        for round in 0..3000 {
            // Some stand several times, and some have no share along an axis.
            let mut normals: Vec<_> = (0..1 + round % 30).map(|_| random_vector(&mut state).map(f64::round)).collect();
            normals.retain(|normal| *normal != Vector3::zeros());
            normals.push(random_vector(&mut state).normalize());
            let found = gathered(&normals);
            let along = if round % 2 == 0 { -Vector3::x() } else { random_vector(&mut state) };
            let share = |normal: &Vector3<f64>| normal.dot(&along);
            let farthest = normals.iter().min_by(|a, b| share(a).total_cmp(&share(b))).unwrap();
            assert_eq!(found.farthest_along(along), *farthest, "{normals:?} {along}");
            let shares = || normals.iter().map(share);
            let range = [shares().fold(1.0, f64::min), shares().fold(-1.0, f64::max)];
            assert_eq!(found.range_along(along), range, "{normals:?} {along}");
            let sines_sq = normals.iter().map(|normal| normal.cross(&along).norm_squared());
            assert_eq!(found.largest_sine_sq(along), sines_sq.fold(0.0, f64::max), "{normals:?} {along}");
        }
    }

    #[test]
    fn a_cone_holds_the_combinations_of_its_normals() {
        let mut state = 3;
        for round in 0..3000 {
            let middle = random_vector(&mut state).normalize();
            let flood = 1.5 * random(&mut state).abs();
            let count = 1 + round % 6;
            let normals: Vec<_> =
                (0..count).map(|_| (middle + random_vector(&mut state) * flood).normalize()).collect();
            for _ in 0..10 {
                // Cubes: often one or two weigh nearly all.
                let sum: Vector3<f64> = normals.iter().map(|normal| normal * random(&mut state).abs().powi(3)).sum();
                let Some(direction) = sum.try_normalize(1e-6) else { continue };
                assert!(may_hold(&gathered(&normals), direction, &mut state), "{direction} {normals:?}");
            }
        }
    }

    /// Σ wᵢ gᵢ·(xᵢ − x) with the gradient towards each corner the worst of them.
    #[test]
    fn no_choice_of_gradients_is_off_by_more() {
        let mut state = 5;
        let mut worst = 0.0_f64;
        for round in 0..3000 {
            let middle = random_vector(&mut state).normalize();
            let flood = random(&mut state).abs();
            let cones: Vec<Vec<_>> = (0..1 + round % 3)
                .map(|_| (0..3).map(|_| (middle + random_vector(&mut state) * flood).normalize()).collect())
                .collect();
            let bound = cone_error_bound(&cones.iter().map(|normals| gathered(normals)).collect::<Vec<_>>());
            for _ in 0..10 {
                let share = random_vector(&mut state).abs();
                let gradients: Vec<Vector3<f64>> = cones
                    .iter()
                    .map(|normals| normals.iter().map(|normal| normal * random(&mut state).abs()).sum::<Vector3<f64>>())
                    .filter_map(|sum| sum.try_normalize(1e-6))
                    .chain(cones.iter().flatten().copied())
                    .collect();
                let of_corner = |corner: usize| {
                    let at = Vector3::from_fn(|axis, _| (corner >> axis & 1) as f64);
                    let weight: f64 = (0..3).map(|axis| 1.0 - (at[axis] - share[axis]).abs()).product();
                    weight * gradients.iter().map(|gradient| gradient.dot(&(at - share))).fold(-2.0, f64::max)
                };
                let off: f64 = (0..8).map(of_corner).sum();
                assert!(off <= bound + 1e-12, "{off} > {bound}: {cones:?}");
                worst = worst.max(off / bound);
            }
        }
        assert!(worst > 0.8, "{worst}: the bound is wider than it need be");
    }
}
