//! A field behind a pointer, so that one table can hold fields of every type and one loop run over them.

use std::any::Any;
use std::rc::Rc;

use nalgebra::Vector3;
use sdf_core::{Aabb, BoxEnclosure, EnclosedSdf, Enclosure, ExactMinimum, Float, Goal, Lanes, Real, Sample, Sdf};

use crate::dual::Dual;

/// Answers in one number type.
pub trait Answers<R: Real> {
    fn answer(&self, point: Vector3<R>) -> Sample<R>;
    fn answer_value(&self, point: Vector3<R>) -> R;
}

impl<R: Real, F: Sdf> Answers<R> for F {
    fn answer(&self, point: Vector3<R>) -> Sample<R> {
        self.evaluate(point)
    }
    fn answer_value(&self, point: Vector3<R>) -> R {
        self.value(point)
    }
}

/// Surveys in one number type.
pub trait Surveys<R: Float> {
    fn survey_of(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R>;
    fn is_convex_there(&self, corners: &[Vector3<R>]) -> bool;
    fn rises_to(&self, corners: &[Vector3<R>]) -> [R; 4];
    fn least_between(&self, ends: [Vector3<R>; 2], goal: Goal<R>) -> Option<ExactMinimum<R, 2>>;
    fn least_among(&self, corners: [Vector3<R>; 3], goal: Goal<R>) -> Option<ExactMinimum<R, 3>>;
}

impl<R: Float, F: EnclosedSdf> Surveys<R> for F {
    fn survey_of(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        self.enclosure(about, corners)
    }
    fn is_convex_there(&self, corners: &[Vector3<R>]) -> bool {
        self.is_convex_on(corners)
    }
    fn rises_to(&self, corners: &[Vector3<R>]) -> [R; 4] {
        self.max_rise_to_corners(corners)
    }
    fn least_between(&self, ends: [Vector3<R>; 2], goal: Goal<R>) -> Option<ExactMinimum<R, 2>> {
        self.exact_minimum(ends, goal)
    }
    fn least_among(&self, corners: [Vector3<R>; 3], goal: Goal<R>) -> Option<ExactMinimum<R, 3>> {
        self.exact_minimum(corners, goal)
    }
}

/// What a field knows whatever it is asked in.
pub trait Limits {
    fn bounds_at(&self, level: f64) -> Aabb;
    fn steepest(&self) -> f64;
    fn limits_in(&self, region: &Aabb) -> BoxEnclosure;
    fn below_linear(&self, region: &Aabb) -> f64;
}

impl<F: EnclosedSdf> Limits for F {
    fn bounds_at(&self, level: f64) -> Aabb {
        self.bounds(level)
    }
    fn steepest(&self) -> f64 {
        self.slope_bound()
    }
    fn limits_in(&self, region: &Aabb) -> BoxEnclosure {
        self.enclose_box(region)
    }
    fn below_linear(&self, region: &Aabb) -> f64 {
        self.linearization_error(region)
    }
}

macro_rules! any_field {
    ($($number:ty),*) => {
        trait Inner: Limits + Surveys<f32> + Surveys<f64> $(+ Answers<$number>)* {}
        impl<F: EnclosedSdf> Inner for F {}

        /// A field of any type. It panics when asked in a number type that no test uses. A clone is the same field.
        #[derive(Clone)]
        pub struct AnyField(Rc<dyn Inner>);

        impl Sdf for AnyField {
            fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
                $(if let Some(point) = same::<_, Vector3<$number>>(point) {
                    let sample: Sample<$number> = self.0.answer(point);
                    return same(sample).unwrap();
                })*
                panic!("AnyField answers in {}", stringify!($($number),*))
            }

            fn value<R: Real>(&self, point: Vector3<R>) -> R {
                $(if let Some(point) = same::<_, Vector3<$number>>(point) {
                    let value: $number = self.0.answer_value(point);
                    return same(value).unwrap();
                })*
                panic!("AnyField answers in {}", stringify!($($number),*))
            }

            fn bounds(&self, level: f64) -> Aabb {
                self.0.bounds_at(level)
            }

            fn slope_bound(&self) -> f64 {
                self.0.steepest()
            }
        }

        impl EnclosedSdf for AnyField {
            fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
                self.0.limits_in(region)
            }

            fn linearization_error(&self, region: &Aabb) -> f64 {
                self.0.below_linear(region)
            }

            fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
                let mut held = [Vector3::zeros(); 4];
                held[..corners.len()].copy_from_slice(corners);
                if let Some((about, held)) = same::<_, (Vector3<f32>, [Vector3<f32>; 4])>((about, held)) {
                    return same(self.0.survey_of(about, &held[..corners.len()])).unwrap();
                }
                if let Some((about, held)) = same::<_, (Vector3<f64>, [Vector3<f64>; 4])>((about, held)) {
                    return same(self.0.survey_of(about, &held[..corners.len()])).unwrap();
                }
                panic!("AnyField surveys in f32 and f64")
            }

            fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
                let mut held = [Vector3::zeros(); 4];
                held[..corners.len()].copy_from_slice(corners);
                if let Some(held) = same::<_, [Vector3<f32>; 4]>(held) {
                    return self.0.is_convex_there(&held[..corners.len()]);
                }
                let held = same::<_, [Vector3<f64>; 4]>(held).unwrap();
                self.0.is_convex_there(&held[..corners.len()])
            }

            fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
                let mut held = [Vector3::zeros(); 4];
                held[..corners.len()].copy_from_slice(corners);
                if let Some(held) = same::<_, [Vector3<f32>; 4]>(held) {
                    return same(self.0.rises_to(&held[..corners.len()])).unwrap();
                }
                let held = same::<_, [Vector3<f64>; 4]>(held).unwrap();
                same(self.0.rises_to(&held[..corners.len()])).unwrap()
            }

            fn exact_minimum<R: Float, const N: usize>(
                &self,
                corners: [Vector3<R>; N],
                goal: Goal<R>,
            ) -> Option<ExactMinimum<R, N>> {
                let query = (corners, goal);
                if let Some((ends, goal)) = same::<_, ([Vector3<f32>; 2], Goal<f32>)>(query) {
                    return same(self.0.least_between(ends, goal)).unwrap();
                }
                if let Some((ends, goal)) = same::<_, ([Vector3<f64>; 2], Goal<f64>)>(query) {
                    return same(self.0.least_between(ends, goal)).unwrap();
                }
                if let Some((corners, goal)) = same::<_, ([Vector3<f32>; 3], Goal<f32>)>(query) {
                    return same(self.0.least_among(corners, goal)).unwrap();
                }
                let (corners, goal) = same::<_, ([Vector3<f64>; 3], Goal<f64>)>(query).unwrap();
                same(self.0.least_among(corners, goal)).unwrap()
            }
        }
    };
}

any_field!(f32, f64, Lanes<f32, 8>, Lanes<f64, 4>, Dual<f32>, Dual<f64>);

impl AnyField {
    pub fn new(field: impl EnclosedSdf + 'static) -> Self {
        Self(Rc::new(field))
    }
}

/// The same value, if its type is the one that is asked for.
pub fn same<A: Copy + 'static, B: Copy + 'static>(a: A) -> Option<B> {
    (&a as &dyn Any).downcast_ref::<B>().copied()
}
