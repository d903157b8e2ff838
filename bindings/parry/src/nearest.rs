//! Which point of a field's surface is nearest to a point? Downhill onto the surface, then along it.
//!
//! | step | method |
//! |---|---|
//! | onto the surface | steps of φ / slope bound along ∇φ (Hart 1996): none passes the surface, not even where ∇φ is short, as outside of a grid's box and beyond the band of a sparse one |
//! | once more | from the point nearest to the surface, by φ, on the sphere of radius φ about the start: where ∇φ says little |
//! | along the surface | until the way from the start meets it at a right angle: projected gradient descent, with a shorter step where one led farther away |
//!
//! The point that it finds is a local minimum of the distance to the surface: never nearer than the nearest point, and seldom farther.

use sdf_core::nalgebra::Vector3;
use sdf_core::{AnyField, Sample, Sdf};

/// Steps onto the surface. One leaves 1 − |∇φ| / slope bound of the way: where that is 0.9, all leave a millionth.
const STEPS: u32 = 128;

/// Steps along the surface, and what is left of a step after one that led farther away.
const STEPS_ALONG: u32 = 48;
const SHORTER: f64 = 0.4;

/// A point is on the field's surface within this fraction of its distance from where the search began.
pub(crate) const AT_SURFACE: f64 = 1e-6;

pub(crate) struct NearestPoint<'a> {
    pub field: &'a AnyField,
    pub start: Vector3<f64>,
    /// φ is zero within this, and points nearer to each other are one.
    pub tolerance: f64,
}

impl NearestPoint<'_> {
    /// A point with φ = 0. Where no step got there, as on a field that is almost flat, the last one.
    pub fn find(&self) -> Vector3<f64> {
        let mut nearest = self.descend(self.start);
        let around = self.descend(self.lowest_around());
        if self.is_nearer(&around, &nearest) {
            nearest = around;
        }
        let mut step = 1.0;
        for _ in 0..STEPS_ALONG {
            let (point, sample) = nearest;
            let (way, normal) = (self.start - point, direction(&sample));
            let along = (way - normal * way.dot(&normal)) * step;
            if along.norm() <= self.tolerance {
                break;
            }
            let next = self.descend(point + along);
            if self.is_nearer(&next, &nearest) {
                (nearest, step) = (next, (step / SHORTER).min(1.0));
            } else {
                step *= SHORTER;
            }
        }
        nearest.0
    }

    /// The point of the surface to which ∇φ leads.
    fn descend(&self, from: Vector3<f64>) -> (Vector3<f64>, Sample<f64>) {
        let slope_bound = self.field.slope_bound().max(f64::MIN_POSITIVE);
        let (mut point, mut sample) = (from, self.field.sample(from));
        for _ in 0..STEPS {
            if self.is_on_surface(&sample) {
                break;
            }
            point -= direction(&sample) * (sample.value / slope_bound);
            sample = self.field.sample(point);
        }
        (point, sample)
    }

    /// The point of a sphere about the start that is nearest to the other side, of 26 points.
    fn lowest_around(&self) -> Vector3<f64> {
        let here = self.field.sample(self.start).value;
        let steps = || [-1.0, 0.0, 1.0].into_iter();
        let directions = steps().flat_map(|x| steps().flat_map(move |y| steps().map(move |z| Vector3::new(x, y, z))));
        let points = directions.filter_map(|step| Some(self.start + step.try_normalize(0.0)? * here.abs()));
        let on_side = |point: &Vector3<f64>| self.field.sample(*point).value * here.signum();
        points.min_by(|a, b| on_side(a).total_cmp(&on_side(b))).unwrap_or(self.start)
    }

    fn is_nearer(&self, (a, at_a): &(Vector3<f64>, Sample<f64>), (b, at_b): &(Vector3<f64>, Sample<f64>)) -> bool {
        let is_short = !self.is_on_surface(at_b);
        self.is_on_surface(at_a) && (is_short || (a - self.start).norm_squared() < (b - self.start).norm_squared())
    }

    fn is_on_surface(&self, sample: &Sample<f64>) -> bool {
        sample.value.abs() <= self.tolerance
    }
}

/// ∇φ/|∇φ|; any direction where it is zero, as in the middle of a ball, from where all lead to the surface.
fn direction(sample: &Sample<f64>) -> Vector3<f64> {
    sample.gradient.try_normalize(1e-6).unwrap_or(Vector3::x())
}
