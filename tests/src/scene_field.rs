//! A field behind a pointer, so that one table holds fields of every type and one loop runs over them.
//!
//! [`DynSdf`] answers in f32, f64 and eight lanes of either. Tests also evaluate in four lanes and in dual numbers, which it
//! would evaluate lane by lane, without derivatives: [`SceneField`] adds methods for these.

use std::any::Any;
use std::rc::Rc;

use nalgebra::Vector3;
use sdf_core::{
    Aabb, BoxEnclosure, DynSdf, EnclosedSdf, Enclosure, ErrorBound, ExactMinimum, Float, Goal, Lanes, Real, Relaxation,
    Sample, Sdf,
};

use crate::dual::Dual;

/// [`Sdf::evaluate`] in one number type.
trait EvaluateAs<R: Real> {
    fn evaluate_as(&self, point: Vector3<R>) -> Sample<R>;
    fn value_as(&self, point: Vector3<R>) -> R;
}

impl<R: Real, F: Sdf> EvaluateAs<R> for F {
    fn evaluate_as(&self, point: Vector3<R>) -> Sample<R> {
        self.evaluate(point)
    }
    fn value_as(&self, point: Vector3<R>) -> R {
        self.value(point)
    }
}

macro_rules! scene_field {
    ($($number:ty),*) => {
        trait TestSdf: DynSdf $(+ EvaluateAs<$number>)* {}
        impl<F: EnclosedSdf> TestSdf for F {}

        /// A field of any type. A clone shares the field.
        #[derive(Clone)]
        pub struct SceneField(Rc<dyn TestSdf>);

        impl Sdf for SceneField {
            fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
                $(if let Some(point) = same_type::<_, Vector3<$number>>(point) {
                    let sample: Sample<$number> = self.0.evaluate_as(point);
                    return same_type(sample).unwrap();
                })*
                self.as_dyn().evaluate(point)
            }

            fn value<R: Real>(&self, point: Vector3<R>) -> R {
                $(if let Some(point) = same_type::<_, Vector3<$number>>(point) {
                    let value: $number = self.0.value_as(point);
                    return same_type(value).unwrap();
                })*
                self.as_dyn().value(point)
            }

            fn evaluate_smooth<R: Float>(&self, point: Vector3<R>) -> Sample<R> {
                self.as_dyn().evaluate_smooth(point)
            }

            fn bounds(&self, level: f64) -> Aabb {
                self.as_dyn().bounds(level)
            }

            fn slope_bound(&self) -> f64 {
                self.as_dyn().slope_bound()
            }

            fn magnitude<R: Real>(&self) -> R {
                self.as_dyn().magnitude()
            }

            fn extent<R: Real>(&self) -> R {
                self.as_dyn().extent()
            }
        }
    };
}

scene_field!(Lanes<f64, 4>, Dual<f32>, Dual<f64>);

impl EnclosedSdf for SceneField {
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        self.as_dyn().enclose_box(region)
    }

    fn error_bound(&self, region: &Aabb) -> ErrorBound {
        self.as_dyn().error_bound(region)
    }

    fn linearization_error(&self, region: &Aabb) -> f64 {
        self.as_dyn().linearization_error(region)
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        self.as_dyn().enclosure(about, corners)
    }

    fn relaxation<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R> {
        self.as_dyn().relaxation(about, corners)
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        self.as_dyn().is_convex_on(corners)
    }

    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        self.as_dyn().max_rise_to_corners(corners)
    }

    fn exact_minimum<R: Float, const N: usize>(
        &self,
        corners: [Vector3<R>; N],
        goal: Goal<R>,
    ) -> Option<ExactMinimum<R, N>> {
        self.as_dyn().exact_minimum(corners, goal)
    }
}

impl SceneField {
    pub fn new(field: impl EnclosedSdf + 'static) -> Self {
        Self(Rc::new(field))
    }

    fn as_dyn(&self) -> &dyn DynSdf {
        &*self.0
    }
}

/// `a` as a `B`, if `A` and `B` are the same type.
pub fn same_type<A: Copy + 'static, B: Copy + 'static>(a: A) -> Option<B> {
    (&a as &dyn Any).downcast_ref::<B>().copied()
}
