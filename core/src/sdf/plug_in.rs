//! Fields behind a pointer: [`DynSdf`], for plug-ins and for lists whose types are known only at run time.

use core::any::Any;

use nalgebra::Vector3;

use super::{Sample, Sdf};
use crate::enclosure::{BoxEnclosure, EnclosedSdf, Enclosure, ExactMinimum, Goal};
use crate::number::kernel::LaneBundle;
use crate::number::lanes::Lanes;
use crate::number::{Float, Real};
use crate::{Aabb, ErrorBound, Relaxation, Simplex};

/// The object-safe form of [`EnclosedSdf`], which every such field has. `dyn DynSdf` is a field itself: it answers in `f32`,
/// `f64` and eight lanes of either through one virtual call, in any other number lane by lane, a lane of another type in `f64`. A dual
/// number loses its derivative.
///
/// ```
/// use sdf_core::{DynSdf, Sdf, nalgebra::Vector3, shapes::{Sphere, Torus}};
/// let (sphere, torus) = (Sphere::new(0.5).unwrap(), Torus::new(1.0, 0.25).unwrap());
/// let scene: [&dyn DynSdf; 2] = [&sphere, &torus];
/// assert_eq!(scene.map(|field| field.value(Vector3::new(2.0, 0.0, 0.0))), [1.5, 0.75]);
/// ```
///
/// With the feature `alloc`, a `Box` and an `Arc` of a field is one too, and takes part in combinations and placements. Threads share
/// a `dyn DynSdf + Send + Sync`:
///
/// ```
/// # #[cfg(feature = "alloc")] {
/// use std::sync::Arc;
/// use sdf_core::{DynSdf, Sdf, combine::Offset, nalgebra::Vector3, shapes::Sphere};
/// let plug_in: Arc<dyn DynSdf + Send + Sync> = Arc::new(Sphere::new(0.5).unwrap());
/// let grown = Offset::new(plug_in.clone(), 0.25).unwrap();
/// let value = std::thread::spawn(move || grown.value(Vector3::new(2.0, 0.0, 0.0))).join().unwrap();
/// assert_eq!(value, plug_in.value(Vector3::new(2.0, 0.0, 0.0)) - 0.25);
/// # }
/// ```
pub trait DynSdf:
    EvaluateIn<f32>
    + EvaluateIn<f64>
    + EvaluateIn<Lanes<f32, 8>>
    + EvaluateIn<Lanes<f64, 8>>
    + EncloseIn<f32>
    + EncloseIn<f64>
{
    /// [`Sdf::bounds`].
    fn dyn_bounds(&self, level: f64) -> Aabb;
    /// [`Sdf::slope_bound`].
    fn dyn_slope_bound(&self) -> f64;
    /// [`Sdf::magnitude`].
    fn dyn_magnitude(&self) -> f64;
    /// [`Sdf::extent`].
    fn dyn_extent(&self) -> f64;
    /// [`EnclosedSdf::enclose_box`].
    fn dyn_enclose_box(&self, region: &Aabb) -> BoxEnclosure;
    /// [`EnclosedSdf::linearization_error`].
    fn dyn_linearization_error(&self, region: &Aabb) -> f64;
    /// [`EnclosedSdf::error_bound`].
    fn dyn_error_bound(&self, region: &Aabb) -> ErrorBound;
}

impl<F: EnclosedSdf> DynSdf for F {
    fn dyn_bounds(&self, level: f64) -> Aabb {
        self.bounds(level)
    }
    fn dyn_slope_bound(&self) -> f64 {
        self.slope_bound()
    }
    fn dyn_magnitude(&self) -> f64 {
        self.magnitude()
    }
    fn dyn_extent(&self) -> f64 {
        self.extent()
    }
    fn dyn_enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        self.enclose_box(region)
    }
    fn dyn_linearization_error(&self, region: &Aabb) -> f64 {
        self.linearization_error(region)
    }
    fn dyn_error_bound(&self, region: &Aabb) -> ErrorBound {
        self.error_bound(region)
    }
}

/// [`Sdf::evaluate`] in one number type.
pub trait EvaluateIn<R: Real> {
    fn evaluate_in(&self, point: Vector3<R>) -> Sample<R>;
    fn value_in(&self, point: Vector3<R>) -> R;
}

impl<R: Real, F: Sdf> EvaluateIn<R> for F {
    fn evaluate_in(&self, point: Vector3<R>) -> Sample<R> {
        self.evaluate(point)
    }
    fn value_in(&self, point: Vector3<R>) -> R {
        self.value(point)
    }
}

/// [`Sdf::evaluate_smooth`] and the methods of [`EnclosedSdf`] in one number type.
pub trait EncloseIn<R: Float> {
    fn evaluate_smooth_in(&self, point: Vector3<R>) -> Sample<R>;
    fn enclosure_in(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R>;
    fn relaxation_in(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R>;
    fn is_convex_in(&self, corners: &[Vector3<R>]) -> bool;
    fn max_rise_in(&self, corners: &[Vector3<R>]) -> [R; 4];
    fn minimum_on_segment(&self, corners: [Vector3<R>; 2], goal: Goal<R>) -> Option<ExactMinimum<R, 2>>;
    fn minimum_on_triangle(&self, corners: [Vector3<R>; 3], goal: Goal<R>) -> Option<ExactMinimum<R, 3>>;
}

impl<R: Float, F: EnclosedSdf> EncloseIn<R> for F {
    fn evaluate_smooth_in(&self, point: Vector3<R>) -> Sample<R> {
        self.evaluate_smooth(point)
    }
    fn enclosure_in(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        self.enclosure(about, corners)
    }
    fn relaxation_in(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R> {
        self.relaxation(about, corners)
    }
    fn is_convex_in(&self, corners: &[Vector3<R>]) -> bool {
        self.is_convex_on(corners)
    }
    fn max_rise_in(&self, corners: &[Vector3<R>]) -> [R; 4] {
        self.max_rise_to_corners(corners)
    }
    fn minimum_on_segment(&self, corners: [Vector3<R>; 2], goal: Goal<R>) -> Option<ExactMinimum<R, 2>> {
        self.exact_minimum(corners, goal)
    }
    fn minimum_on_triangle(&self, corners: [Vector3<R>; 3], goal: Goal<R>) -> Option<ExactMinimum<R, 3>> {
        self.exact_minimum(corners, goal)
    }
}

/// The same value, if `A` and `B` are one type.
#[inline(always)]
fn cast<A: Copy + 'static, B: Copy + 'static>(a: A) -> Option<B> {
    (&a as &dyn Any).downcast_ref::<B>().copied()
}

/// Returns from the function if `$from` is of the type `$as`.
macro_rules! try_in {
    ($($from:ident: $as:ty => $call:expr);* $(;)?) => {
        $(if let Some($from) = cast::<_, $as>($from) && let Some(answer) = cast($call) {
            return answer;
        })*
    };
}

impl Sdf for dyn DynSdf + '_ {
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        try_in! {
            point: Vector3<f32> => self.evaluate_in(point);
            point: Vector3<f64> => self.evaluate_in(point);
            point: Vector3<Lanes<f32, 8>> => self.evaluate_in(point);
            point: Vector3<Lanes<f64, 8>> => self.evaluate_in(point);
        }
        let mut sample = Sample::<R>::zero();
        for lane in 0..R::LANES {
            sample.set_lane(lane, evaluate_lane(self, LaneBundle::lane(&point, lane)));
        }
        sample
    }

    fn value<R: Real>(&self, point: Vector3<R>) -> R {
        try_in! {
            point: Vector3<f32> => self.value_in(point);
            point: Vector3<f64> => self.value_in(point);
            point: Vector3<Lanes<f32, 8>> => self.value_in(point);
            point: Vector3<Lanes<f64, 8>> => self.value_in(point);
        }
        self.evaluate(point).value
    }

    fn evaluate_smooth<R: Float>(&self, point: Vector3<R>) -> Sample<R> {
        try_in! {
            point: Vector3<f32> => self.evaluate_smooth_in(point);
            point: Vector3<f64> => self.evaluate_smooth_in(point);
        }
        from_f64(self.evaluate_smooth_in(point.map(Float::to_f64)))
    }

    fn bounds(&self, level: f64) -> Aabb {
        self.dyn_bounds(level)
    }

    fn slope_bound(&self) -> f64 {
        self.dyn_slope_bound()
    }

    fn magnitude<R: Real>(&self) -> R {
        R::from_f64(self.dyn_magnitude())
    }

    fn extent<R: Real>(&self) -> R {
        R::from_f64(self.dyn_extent())
    }
}

impl EnclosedSdf for dyn DynSdf + '_ {
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        self.dyn_enclose_box(region)
    }

    fn linearization_error(&self, region: &Aabb) -> f64 {
        self.dyn_linearization_error(region)
    }

    fn error_bound(&self, region: &Aabb) -> ErrorBound {
        self.dyn_error_bound(region)
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        let (count, padded) = padded(corners);
        let query = (about, padded);
        try_in! {
            query: Query<f32> => self.enclosure_in(query.0, first(&query.1, count));
            query: Query<f64> => self.enclosure_in(query.0, first(&query.1, count));
        }
        Enclosure::from_slope(self, about, corners)
    }

    fn relaxation<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R> {
        let (count, padded) = padded(corners);
        let query = (about, padded);
        try_in! {
            query: Query<f32> => self.relaxation_in(query.0, first(&query.1, count));
            query: Query<f64> => self.relaxation_in(query.0, first(&query.1, count));
        }
        Relaxation::from_enclosure(self, self.enclosure(about, corners), about, corners)
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        let (count, padded) = padded(corners);
        try_in! {
            padded: [Vector3<f32>; 4] => self.is_convex_in(first(&padded, count));
            padded: [Vector3<f64>; 4] => self.is_convex_in(first(&padded, count));
        }
        false
    }

    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        let (count, padded) = padded(corners);
        try_in! {
            padded: [Vector3<f32>; 4] => self.max_rise_in(first(&padded, count));
            padded: [Vector3<f64>; 4] => self.max_rise_in(first(&padded, count));
        }
        self.enclosure(Simplex { corners: padded }.centroid(), corners).gradients.max_rise_to_corners(corners)
    }

    fn exact_minimum<R: Float, const N: usize>(
        &self,
        corners: [Vector3<R>; N],
        goal: Goal<R>,
    ) -> Option<ExactMinimum<R, N>> {
        let query = (corners, goal);
        try_in! {
            query: ([Vector3<f32>; 2], Goal<f32>) => self.minimum_on_segment(query.0, query.1);
            query: ([Vector3<f64>; 2], Goal<f64>) => self.minimum_on_segment(query.0, query.1);
            query: ([Vector3<f32>; 3], Goal<f32>) => self.minimum_on_triangle(query.0, query.1);
            query: ([Vector3<f64>; 3], Goal<f64>) => self.minimum_on_triangle(query.0, query.1);
        }
        None
    }
}

/// The sample at a point in one lane: in `f64`, if the lane is neither `f32` nor `f64`.
fn evaluate_lane<R: Float>(field: &(impl DynSdf + ?Sized), point: Vector3<R>) -> Sample<R> {
    try_in! {
        point: Vector3<f32> => field.evaluate_in(point);
        point: Vector3<f64> => field.evaluate_in(point);
    }
    from_f64(field.evaluate_in(point.map(Float::to_f64)))
}

fn from_f64<R: Float>(sample: Sample<f64>) -> Sample<R> {
    let Sample { value, gradient, status } = sample;
    Sample { value: R::from_f64(value), gradient: gradient.map(R::from_f64), status }
}

/// A point and up to four corners.
type Query<R> = (Vector3<R>, [Vector3<R>; 4]);

/// The number of corners, at most four, and an array of them padded with the first.
fn padded<R: Real>(corners: &[Vector3<R>]) -> (usize, [Vector3<R>; 4]) {
    let padding = corners.first().copied().unwrap_or_else(Vector3::zeros);
    let mut padded = [padding; 4];
    padded.iter_mut().zip(corners).for_each(|(padded, corner)| *padded = *corner);
    (corners.len().min(4), padded)
}

fn first<R: Real>(padded: &[Vector3<R>; 4], count: usize) -> &[Vector3<R>] {
    padded.get(..count).unwrap_or(padded)
}
