//! Fields between two moments: φ(x, t) for 0 ≤ t ≤ 1, its change ∂φ/∂t, and how fast the surface moves.
//!
//! | field | φ(x, t) | file |
//! |---|---|---|
//! | any [`EnclosedSdf`] | φ(x): it stands still | this one |
//! | [`Travelling`] | φ(Rᵀ(x − c), t), a rigid motion at constant velocity and spin | `travelling` |
//! | [`Morphing`] | (1 − t) φ_now(x) + t φ_later(x): animated parameters, or any two fields | `morphing` |
//!
//! A point of the surface keeps φ = 0, so along its normal the surface moves at v_n = −(∂φ/∂t) / |∇φ| (Osher and Sethian 1988,
//! "Fronts Propagating with Curvature-Dependent Speed"). The unit of time is the way from the one moment to the other: velocities
//! are lengths per frame, and are divided by the time step where a solver wants them per second.

mod animated;
mod morphing;
mod travelling;

use nalgebra::Vector3;

pub use animated::Animated;
pub use morphing::{Blend, Morphing};
pub use travelling::{RigidMotion, Travelling};

use crate::enclosure::PartVisitor;
use crate::number::Float;
use crate::vector::norm;
use crate::{Aabb, EnclosedSdf, Sdf};

/// A field that changes between the times 0 and 1. Every [`EnclosedSdf`] is one that stands still.
///
/// ```
/// use sdf_core::moving::{Morphing, MovingSdf};
/// use sdf_core::{Sdf, nalgebra::Vector3, shapes::Sphere};
/// let swelling = Morphing::animated(Sphere::new(1.0).unwrap(), Sphere::new(1.5).unwrap());
/// let point = Vector3::new(0.0, 0.0, 2.0);
/// assert_eq!(swelling.at(0.5).value(point), 0.75);
/// assert_eq!(swelling.time_derivative(point, 0.5), -0.5);
/// assert_eq!(swelling.surface_velocity(point, 0.5), Vector3::new(0.0, 0.0, 0.5));
/// ```
pub trait MovingSdf {
    /// The field at a moment.
    type Moment<'a>: EnclosedSdf
    where
        Self: 'a;

    /// The field at a time.
    fn at(&self, time: f64) -> Self::Moment<'_>;

    /// ∂φ/∂t at a point that stands still.
    fn time_derivative<R: Float>(&self, point: Vector3<R>, time: f64) -> R;

    /// Upper bound of −∂φ/∂t at the points of a box from one time to another, at least 0: how fast φ can fall there.
    fn fall_bound(&self, region: &Aabb, from: f64, until: f64) -> f64;

    /// Lipschitz constant of φ between points of a box, from one time to another.
    fn slope_bound_in(&self, region: &Aabb, from: f64, until: f64) -> f64;

    /// Upper bound of −dφ/dt at the points of an element that moves linearly, at least 0. `path` has for each corner where it is at
    /// the times 0 and 1.
    ///
    /// −dφ/dt = −∇φ·ẋ − ∂φ/∂t ≤ L max_k |ẋ_k| + `fall_bound`. A field that moves along with the element does better.
    fn approach_bound(&self, path: &[[Vector3<f64>; 2]], from: f64, until: f64) -> f64 {
        let region = swept_bounds(path, from, until);
        let speed = path.iter().fold(0.0_f64, |speed, [start, end]| speed.max(norm(end - start)));
        product(self.slope_bound_in(&region, from, until), speed) + self.fall_bound(&region, from, until)
    }

    /// The time, between two, until which φ > `level` at all points of an element that moves linearly, as the tangent plane at the middle
    /// of its way says, less how fast the field falls; `from` if it says nothing. `path` as in [`approach_bound`](Self::approach_bound).
    fn free_until(&self, path: &[[Vector3<f64>; 2]], from: f64, until: f64, level: f64) -> f64 {
        let region = swept_bounds(path, from, until);
        let fall = self.fall_bound(&region, from, until);
        let mut way = FreeWay { path, region, from, level, fall, free: until };
        self.at(from).visit_parts(&mut way);
        way.free
    }

    /// The velocity of the surface through a point: along the normal v_n ∇φ/|∇φ| = −(∂φ/∂t) ∇φ/|∇φ|², and where a motion is known
    /// its tangential part too. Zero where φ has no gradient.
    fn surface_velocity<R: Float>(&self, point: Vector3<R>, time: f64) -> Vector3<R> {
        let gradient = self.at(time).evaluate_smooth(point).gradient;
        let slope_sq = gradient.dot(&gradient);
        let velocity = gradient * (-self.time_derivative(point, time) / slope_sq);
        let is_valid = !norm(gradient).is_negligible() && velocity.iter().all(|x| x.is_finite());
        if is_valid { velocity } else { Vector3::zeros() }
    }
}

impl<F: EnclosedSdf> MovingSdf for F {
    type Moment<'a>
        = &'a F
    where
        F: 'a;

    fn at(&self, _time: f64) -> &F {
        self
    }
    fn time_derivative<R: Float>(&self, _point: Vector3<R>, _time: f64) -> R {
        R::zero()
    }
    fn fall_bound(&self, _region: &Aabb, _from: f64, _until: f64) -> f64 {
        0.0
    }
    fn slope_bound_in(&self, region: &Aabb, _from: f64, _until: f64) -> f64 {
        self.enclose_box(region).slope_bound.min(self.slope_bound())
    }
    fn surface_velocity<R: Float>(&self, _point: Vector3<R>, _time: f64) -> Vector3<R> {
        Vector3::zeros()
    }
}

/// The way of an element past the parts of a field.
struct FreeWay<'a> {
    path: &'a [[Vector3<f64>; 2]],
    /// The box around the way.
    region: Aabb,
    from: f64,
    level: f64,
    /// How fast the field falls.
    fall: f64,
    /// All parts that were visited are above the level until then.
    free: f64,
}

impl PartVisitor for FreeWay<'_> {
    fn visit<F: EnclosedSdf>(&mut self, part: &F) {
        if self.free > self.from {
            self.free = self.free_of(part).unwrap_or(self.from);
        }
    }
}

impl FreeWay<'_> {
    /// The time until which a part is above the level, at most that of the parts before; `None` if nothing says so.
    fn free_of<F: EnclosedSdf>(&self, part: &F) -> Option<f64> {
        let error = part.linearization_error(&self.region);
        let center = Vector3::from(self.region.center());
        let mut free = self.free;
        if !error.is_finite() {
            // A part that is far off needs no plane.
            let reach = product(part.slope_bound(), 0.5 * self.region.diagonal()) + self.fall * (free - self.from);
            return (part.value(center) - reach > self.level).then_some(free);
        }
        let plane = part.evaluate(center);
        for corner in self.path {
            let above = plane.value + plane.gradient.dot(&(position(corner, self.from) - center)) - error - self.level;
            let rise = plane.gradient.dot(&(corner[1] - corner[0])) - self.fall;
            if !(above > 0.0 && rise.is_finite()) {
                return None;
            }
            if rise < 0.0 {
                free = free.min(self.from - above / rise * (1.0 - 8.0 * f64::EPSILON));
            }
        }
        Some(free)
    }
}

/// The box that an element passes through which moves linearly: it is around the corners at the two times.
pub(crate) fn swept_bounds(path: &[[Vector3<f64>; 2]], from: f64, until: f64) -> Aabb {
    let ends = path.iter().flat_map(|corner| [position(corner, from), position(corner, until)]);
    Aabb::from_points(ends.map(Into::into)).unwrap_or(Aabb::EVERYWHERE)
}

/// Position of a corner at a time, exact at 0 and 1.
pub(crate) fn position<R: Float>([start, end]: &[Vector3<R>; 2], time: f64) -> Vector3<R> {
    match time {
        1.0 => *end,
        _ => start + (end - start) * R::from_f64(time),
    }
}

/// a · b of two numbers that are not negative, where 0 · ∞ = 0.
pub(crate) fn product(a: f64, b: f64) -> f64 {
    if a == 0.0 || b == 0.0 { 0.0 } else { a * b }
}
