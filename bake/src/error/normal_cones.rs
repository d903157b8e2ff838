//! Error of the interpolant where all gradients are combinations of known normals.
//!
//! Each gradient of the distance in a cell is a unit vector in one of some cones; a cone holds the combinations, with
//! weights ≥ 0, of its unit normals nⱼ (`docs/error-bounds.md`, "Gradients are combinations of nearby normals"). A
//! spherical cap of axis a and half angle θ < 90° around the normals holds each unit vector u of the cone, and along m
//!
//! ```text
//! cos(β + θ) ≤ u·m ≤ cos(β − θ),  β = ∠(a, m)         (1 for β ≤ θ, −1 for β + θ ≥ 180°)
//! min nⱼ·m / cos θ ≤ u·m ≤ max nⱼ·m / cos θ           (without the division where it would tighten)
//! ```
//!
//! The error, in voxels, is at most the smaller of ("Where the gradient is known to turn little")
//!
//! ```text
//! (√3/2) R             all gradients in a ball of radius R: sin θ for one cone
//! ½ (r₁ + r₂ + r₃)     along three axes at right angles, the gradients range over widths 2 rₖ
//! ```

mod x8;

use sdf_core::nalgebra::Vector3;

use crate::rounding::NORMAL_SLACK;
use crate::simd::{LANES, Lanes, VectorX8, lane_of, max, min};
pub(crate) use x8::cone_error_bounds_x8;

/// Error bound of any distance, in voxels: √3/2, as |I − φ| ≤ Σ wᵢ |xᵢ − x| (`docs/error-bounds.md`, "Any distance").
pub(crate) const MAX_ERROR: f64 = 0.866_025_403_784_438_7;

/// Smallest cos θ of a cap by which dot products with normals are divided.
const MIN_COSINE: f64 = 0.1;

/// Unit normals of faces; a zero vector is an unknown normal.
#[derive(Clone, Debug, Default)]
pub(crate) struct Normals {
    /// Unused lanes of the last item repeat its first normal.
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

    /// Replaces the contents by some of the given normals.
    pub fn collect(&mut self, normals: &[Vector3<f64>], indices: &[u32]) {
        self.clear();
        indices.iter().for_each(|index| self.push(normals[*index as usize]));
    }

    #[inline(always)]
    fn first(&self) -> Vector3<f64> {
        lane_of(&self.eights[0], 0).into()
    }

    /// The first of the normals at the largest angle to a direction.
    #[inline(always)]
    fn farthest_from(&self, direction: Vector3<f64>) -> Vector3<f64> {
        let (mut lowest, mut eights) = ([i64::MAX; LANES], [0_u64; LANES]);
        for (index, eight) in (0..).zip(&self.eights) {
            let dots = dot_products(eight, direction);
            for lane in 0..LANES {
                let key = total_order_key(dots[lane]);
                let is_lower = key < lowest[lane];
                lowest[lane] = if is_lower { key } else { lowest[lane] };
                eights[lane] = if is_lower { index } else { eights[lane] };
            }
        }
        let lowest_of_all = reduce(lowest, i64::min);
        let mut firsts = [u64::MAX; LANES];
        for lane in 0..LANES {
            let index = eights[lane] * LANES as u64 + lane as u64;
            firsts[lane] = if lowest[lane] == lowest_of_all { index } else { u64::MAX };
        }
        let first = reduce(firsts, u64::min) as usize;
        lane_of(&self.eights[first / LANES], first % LANES).into()
    }

    /// Smallest and largest dot product with a direction, clamped to −1 … 1.
    #[inline(always)]
    fn range_along(&self, direction: Vector3<f64>) -> [f64; 2] {
        let (mut lower, mut upper) = ([1.0; LANES], [-1.0; LANES]);
        for eight in &self.eights {
            let dots = dot_products(eight, direction);
            for lane in 0..LANES {
                lower[lane] = min(dots[lane], lower[lane]);
                upper[lane] = max(dots[lane], upper[lane]);
            }
        }
        [reduce(lower, |a, b| min(b, a)), reduce(upper, |a, b| max(b, a))]
    }

    /// Square of the largest sine of the angles to a unit vector.
    #[inline(always)]
    fn max_sine_sq(&self, axis: Vector3<f64>) -> f64 {
        let mut largest = [0.0; LANES];
        for [x, y, z] in &self.eights {
            for lane in 0..LANES {
                let cross = Vector3::new(x[lane], y[lane], z[lane]).cross(&axis);
                largest[lane] = max(cross.dot(&cross), largest[lane]);
            }
        }
        reduce(largest, |a, b| max(b, a))
    }
}

/// Combines all lanes pairwise, so that the combinations too run in lanes.
#[inline(always)]
fn reduce<T: Copy>(mut lanes: Lanes<T>, combine: impl Fn(T, T) -> T) -> T {
    for half in [4, 2, 1] {
        for lane in 0..half {
            lanes[lane] = combine(lanes[lane], lanes[lane + half]);
        }
    }
    lanes[0]
}

#[inline(always)]
fn dot_products([x, y, z]: &VectorX8<f64>, direction: Vector3<f64>) -> Lanes<f64> {
    let mut dots = [0.0; LANES];
    for lane in 0..LANES {
        dots[lane] = x[lane] * direction.x + y[lane] * direction.y + z[lane] * direction.z;
    }
    dots
}

/// An integer with the order of [`f64::total_cmp`].
#[inline(always)]
fn total_order_key(x: f64) -> i64 {
    let bits = x.to_bits() as i64;
    bits ^ ((bits >> 63) as u64 >> 1) as i64
}

/// Unit normals in a cap of the unit sphere: u·axis ≥ cosine for each.
struct Cone<'a> {
    normals: &'a Normals,
    axis: Vector3<f64>,
    cosine: f64,
    sine: f64,
}

/// Error bound, in voxels, if each gradient lies in one of these cones. [`MAX_ERROR`] if a normal is unknown.
pub(crate) fn cone_error_bound(cones: &[Normals]) -> f64 {
    if cones.is_empty() || cones.iter().any(|normals| normals.count == 0 || normals.is_any_unknown) {
        return MAX_ERROR;
    }
    pulp::Arch::new().dispatch(ConeErrorBound(cones))
}

struct ConeErrorBound<'a>(&'a [Normals]);

impl pulp::NullaryFnOnce for ConeErrorBound<'_> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        if let [normals] = self.0 {
            return error_bound(&[Cone::enclosing(normals)]);
        }
        error_bound(&self.0.iter().map(Cone::enclosing).collect::<Vec<_>>())
    }
}

#[inline(always)]
fn error_bound(cones: &[Cone]) -> f64 {
    let mut range_bound = 0.0;
    for axis in axes(cones) {
        range_bound += 0.25 * width_along(cones, axis);
    }
    (ball_bound(cones).min(range_bound) + NORMAL_SLACK).min(MAX_ERROR)
}

/// (√3/2) sin θ of a cap around all cones.
#[inline(always)]
fn ball_bound(cones: &[Cone]) -> f64 {
    if let [cone] = cones {
        return MAX_ERROR * cone.sine;
    }
    let axis: Vector3<f64> = cones.iter().map(|cone| cone.axis).sum();
    let Some(axis) = axis.try_normalize(NORMAL_SLACK) else { return MAX_ERROR };
    let cosine = cones.iter().map(|cone| cone.range_along(axis)[0]).fold(1.0, f64::min);
    if cosine > 0.0 { MAX_ERROR * (1.0 - cosine * cosine).sqrt() } else { MAX_ERROR }
}

impl<'a> Cone<'a> {
    /// A small cap, not always the smallest: around the two normals farthest apart, or around three.
    #[inline(always)]
    fn enclosing(normals: &'a Normals) -> Self {
        let first = normals.farthest_from(normals.first());
        let second = normals.farthest_from(first);
        let mut cone = Self::with_axis(normals, first + second);
        if cone.cosine <= first.dot(&cone.axis) * (1.0 - NORMAL_SLACK) {
            // A third normal is outside the cap of the two.
            let third = normals.farthest_from(cone.axis);
            let circumcenter = (second - first).cross(&(third - first));
            for axis in [circumcenter, -circumcenter, first + second + third] {
                let other = Self::with_axis(normals, axis);
                if other.cosine > cone.cosine {
                    cone = other;
                }
            }
        }
        cone
    }

    #[inline(always)]
    fn with_axis(normals: &'a Normals, axis: Vector3<f64>) -> Self {
        let axis = axis.try_normalize(NORMAL_SLACK).unwrap_or(normals.first());
        let [lower, _] = normals.range_along(axis);
        if lower <= 0.0 {
            return Self { normals, axis, cosine: lower.max(-1.0), sine: 1.0 };
        }
        // The sine keeps its digits where the cosine is near one.
        let sine = normals.max_sine_sq(axis).sqrt().min(1.0);
        Self { normals, axis, cosine: (1.0 - sine * sine).sqrt(), sine }
    }

    /// Bounds of u·direction over the unit vectors u of the cone.
    #[inline(always)]
    fn range_along(&self, direction: Vector3<f64>) -> [f64; 2] {
        if self.cosine <= 0.0 {
            return [-1.0, 1.0];
        }
        let (cos_beta, sin_beta) = (self.axis.dot(&direction), self.axis.cross(&direction).norm());
        let cap_lower = if -cos_beta >= self.cosine { -1.0 } else { cos_beta * self.cosine - sin_beta * self.sine };
        let cap_upper = if cos_beta >= self.cosine { 1.0 } else { cos_beta * self.cosine + sin_beta * self.sine };
        if self.cosine < MIN_COSINE {
            return [cap_lower, cap_upper];
        }
        let [lower, upper] = self.normals.range_along(direction);
        // The weights of a combination sum to between 1 and 1/cos θ.
        let lower = if lower < 0.0 { lower / self.cosine } else { lower };
        let upper = if upper > 0.0 { upper / self.cosine } else { upper };
        [cap_lower.max(lower), cap_upper.min(upper)]
    }
}

/// Width of the range of all cones along a direction.
#[inline(always)]
fn width_along(cones: &[Cone], direction: Vector3<f64>) -> f64 {
    let [mut lower, mut upper] = [1.0_f64, -1.0_f64];
    for cone in cones {
        let [cone_lower, cone_upper] = cone.range_along(direction);
        (lower, upper) = (lower.min(cone_lower), upper.max(cone_upper));
    }
    (upper - lower).max(0.0)
}

/// Three unit vectors at right angles, the first along the largest difference of normals.
#[inline(always)]
fn axes(cones: &[Cone]) -> [Vector3<f64>; 3] {
    let middle = cones[0].axis;
    let first = farthest_from(cones, middle);
    let second = farthest_from(cones, first);
    let spread = (second - first).try_normalize(NORMAL_SLACK).unwrap_or_else(|| any_perpendicular(middle));
    let next = middle - spread * middle.dot(&spread);
    let next = next.try_normalize(NORMAL_SLACK).unwrap_or_else(|| any_perpendicular(spread));
    [spread, next, spread.cross(&next)]
}

/// The normal of any cone at the largest angle to a direction, the first of several.
#[inline(always)]
fn farthest_from(cones: &[Cone], direction: Vector3<f64>) -> Vector3<f64> {
    let mut farthest = cones[0].normals.farthest_from(direction);
    for cone in &cones[1..] {
        let other = cone.normals.farthest_from(direction);
        if total_order_key(other.dot(&direction)) < total_order_key(farthest.dot(&direction)) {
            farthest = other;
        }
    }
    farthest
}

fn any_perpendicular(direction: Vector3<f64>) -> Vector3<f64> {
    let smallest = direction.iamin();
    direction.cross(&Vector3::from_fn(|axis, _| if axis == smallest { 1.0 } else { 0.0 })).normalize()
}

#[cfg(test)]
pub(crate) mod tests;
