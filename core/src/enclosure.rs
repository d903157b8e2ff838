use nalgebra::{Matrix3, Vector3};

use crate::number::{Float, Real};
use crate::vector::norm;
use crate::{Aabb, Sdf, Simplex};

/// What is certain of a field on the convex hull of one to four points, after one look at a point of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Enclosure<R: Real> {
    /// φ at the point that was looked at.
    pub value: R,
    /// No value on the hull is below this.
    pub least: R,
    /// No value on the hull is above this.
    pub greatest: R,
    pub gradients: GradientBox<R>,
}

/// A box of vectors that holds every gradient of a field on a hull, those of both sides where it has a kink.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GradientBox<R: Real> {
    pub least: Vector3<R>,
    pub greatest: Vector3<R>,
}

impl<R: Float> GradientBox<R> {
    /// Those that are no longer than a slope bound.
    pub fn within(slope_bound: f64) -> Self {
        let greatest = Vector3::repeat(R::from_f64(slope_bound));
        Self { least: -greatest, greatest }
    }

    /// Those of either.
    pub fn union(self, other: Self) -> Self {
        Self {
            least: self.least.zip_map(&other.least, Real::min),
            greatest: self.greatest.zip_map(&other.greatest, Real::max),
        }
    }

    /// Those of −φ.
    pub fn negate(self) -> Self {
        Self { least: -self.greatest, greatest: -self.least }
    }

    /// Of φ(`jacobian` · x) · `scale`, from those of φ.
    pub fn pull_back(self, jacobian: &Matrix3<R>, scale: R) -> Self {
        let axis = |k: usize| {
            let [least, greatest] = self.along(jacobian.column(k).into_owned());
            [least * scale, greatest * scale]
        };
        let [x, y, z] = [axis(0), axis(1), axis(2)];
        Self { least: Vector3::new(x[0], y[0], z[0]), greatest: Vector3::new(x[1], y[1], z[1]) }
    }

    /// [`Sdf::max_rise_to_corners`] where no gradient on the hull is another.
    pub fn max_rise_to_corners(&self, corners: &[Vector3<R>]) -> [R; 4] {
        let mut rises = [R::zero(); 4];
        for (rise, to) in rises.iter_mut().zip(corners) {
            // A way from within the hull is a mean of those from its corners.
            *rise = corners.iter().fold(R::zero(), |rise, from| Real::max(rise, self.along(to - from)[1]));
        }
        rises
    }

    /// The least and the most that φ can change over a way, a vector, if all of it lies in the hull.
    #[inline]
    pub fn along(&self, way: Vector3<R>) -> [R; 2] {
        let mut range = [R::zero(); 2];
        for ((least, greatest), way) in self.least.iter().zip(&self.greatest).zip(&way) {
            let (a, b) = (*least * *way, *greatest * *way);
            range = [range[0] + Real::min(a, b), range[1] + Real::max(a, b)];
        }
        range
    }
}

/// [`Sdf::max_rise_to_corners`] of a field that is a convex function: it rises fastest where a way ends.
pub(crate) fn max_rise_of_convex<R: Float, F: Sdf>(field: &F, corners: &[Vector3<R>]) -> [R; 4] {
    let mut gradients = [Vector3::zeros(); 4];
    gradients.iter_mut().zip(corners).for_each(|(gradient, corner)| *gradient = field.evaluate(*corner).gradient);
    let mut rises = [R::zero(); 4];
    for ((rise, gradient), to) in rises.iter_mut().zip(gradients).zip(corners) {
        *rise = corners.iter().fold(R::zero(), |rise, from| Real::max(rise, gradient.dot(&(to - from))));
    }
    rises
}

pub(crate) fn sum<R: Float>(a: [R; 4], b: [R; 4]) -> [R; 4] {
    core::array::from_fn(|k| a[k] + b[k])
}

impl<R: Float> Enclosure<R> {
    /// By how steep the field is in the box around the points, and what else is certain there.
    pub fn by_slope<F: Sdf>(field: &F, about: Vector3<R>, corners: &[Vector3<R>]) -> Self {
        let value = field.value(about);
        let reach = reach(about, corners);
        let local = field.enclose_box(&bounds(corners));
        let spread = reach * R::from_f64(local.slope_bound);
        let unrounded = Self {
            value,
            least: Real::max(value - spread, R::from_f64(local.least)),
            greatest: Real::min(value + spread, R::from_f64(local.greatest)),
            gradients: GradientBox::within(local.slope_bound),
        };
        unrounded.widen(rounding(field.slope_bound(), about, reach, value))
    }

    /// Of a field that is a convex function, which lies above its tangent planes. A gradient that is a choice must be a
    /// limit of gradients nearby.
    pub fn of_convex<F: Sdf>(field: &F, about: Vector3<R>, corners: &[Vector3<R>]) -> Self {
        let sample = field.evaluate(about);
        let reach = reach(about, corners);
        let falls = corners.iter().map(|corner| sample.gradient.dot(&(corner - about)));
        let unrounded = Self {
            value: sample.value,
            least: sample.value + falls.fold(R::zero(), Real::min),
            greatest: sample.value + reach * R::from_f64(field.slope_bound()),
            gradients: GradientBox::within(field.slope_bound()),
        };
        unrounded.widen(rounding(field.slope_bound(), about, reach, sample.value))
    }

    /// That of −φ.
    pub fn negate(self) -> Self {
        Self { value: -self.value, least: -self.greatest, greatest: -self.least, gradients: self.gradients.negate() }
    }

    /// That of the lower of two fields.
    pub fn lower(self, other: Self) -> Self {
        let gradients = match () {
            () if self.greatest < other.least => self.gradients,
            () if other.greatest < self.least => other.gradients,
            () => self.gradients.union(other.gradients),
        };
        Self {
            value: Real::min(self.value, other.value),
            least: Real::min(self.least, other.least),
            greatest: Real::min(self.greatest, other.greatest),
            gradients,
        }
    }

    /// [`Sdf::max_rise_to_corners`] of the lower of two fields, of which these are the surveys; of each field asked only where it matters.
    pub fn min_combine(
        self,
        other: Self,
        rises: impl FnOnce() -> [R; 4],
        other_rises: impl FnOnce() -> [R; 4],
    ) -> [R; 4] {
        match () {
            () if self.greatest < other.least => rises(),
            () if other.greatest < self.least => other_rises(),
            // Now along the one and now along the other.
            () => sum(rises(), other_rises()),
        }
    }

    /// That of φ + `distance`.
    pub fn raise(self, distance: R) -> Self {
        Self {
            value: self.value + distance,
            least: self.least + distance,
            greatest: self.greatest + distance,
            gradients: self.gradients,
        }
    }

    /// That of φ(`jacobian` · x) · `scale`.
    pub fn pull_back(self, jacobian: &Matrix3<R>, scale: R) -> Self {
        Self {
            value: self.value * scale,
            least: self.least * scale,
            greatest: self.greatest * scale,
            gradients: self.gradients.pull_back(jacobian, scale),
        }
    }

    /// With bounds that allow for values that are off by so much.
    pub fn widen(self, rounding: R) -> Self {
        Self { least: self.least - rounding, greatest: self.greatest + rounding, ..self }
    }
}

/// How many roundings of the largest number in it a bound may be off. An evaluation takes some thirty operations, few of
/// which round at the size of the coordinates.
const ROUNDINGS: f64 = 32.0;

/// More than `value` or another value of the field within `reach` of `point`, no larger in size, may be off by rounding.
#[inline(always)]
pub(crate) fn rounding<R: Real>(slope_bound: f64, point: Vector3<R>, reach: R, value: R) -> R {
    let length = reach.max(point.x.abs()).max(point.y.abs()).max(point.z.abs());
    (length * R::from_f64(slope_bound)).max(value.abs()) * R::from_f64(ROUNDINGS * R::EPSILON)
}

/// Summed over edges from the first, so that digits are not lost far from the origin.
#[inline(always)]
pub(crate) fn mean<R: Real>(points: &[Vector3<R>]) -> Vector3<R> {
    let Some(first) = points.first() else { return Vector3::zeros() };
    let share = R::from_f64(1.0 / points.len() as f64);
    points.iter().skip(1).fold(*first, |mean, point| mean + (point - first) * share)
}

#[inline(always)]
pub(crate) fn reach<R: Real>(from: Vector3<R>, points: &[Vector3<R>]) -> R {
    let mut reach = R::zero();
    for point in points {
        reach = reach.max(norm(point - from));
    }
    reach
}

/// The smallest box around the points.
#[inline(always)]
pub(crate) fn bounds<R: Float>(points: &[Vector3<R>]) -> Aabb {
    let mut bounds = Aabb { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };
    for point in points {
        let point: [R; 3] = (*point).into();
        for k in 0..3 {
            let x = point[k].to_f64();
            bounds.min[k] = if x < bounds.min[k] { x } else { bounds.min[k] };
            bounds.max[k] = if bounds.max[k] < x { x } else { bounds.max[k] };
        }
    }
    bounds
}

impl<R: Float, const N: usize> Simplex<R, N> {
    /// The smallest box around it.
    #[inline(always)]
    pub fn bounds(&self) -> Aabb {
        bounds(&self.corners)
    }
}
