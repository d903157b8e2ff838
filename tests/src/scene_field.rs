//! A field behind a pointer, so that one table holds fields of every type and one loop runs over them.
//!
//! [`Sdf`] is generic over the number type and hence not object-safe. Here each number type that a test uses gets
//! object-safe methods of its own, and [`SceneField`] picks among them by the type of its argument at run time.

use std::any::Any;
use std::rc::Rc;

use nalgebra::Vector3;
use sdf_core::{
    Aabb, BoxEnclosure, EnclosedSdf, Enclosure, ExactMinimum, Float, Goal, Lanes, Real, Relaxation, Sample, Sdf,
};

use crate::dual::Dual;

/// Evaluation in one number type.
trait SdfIn<R: Real> {
    fn evaluate_in(&self, point: Vector3<R>) -> Sample<R>;
    fn value_in(&self, point: Vector3<R>) -> R;
}

impl<R: Real, F: Sdf> SdfIn<R> for F {
    fn evaluate_in(&self, point: Vector3<R>) -> Sample<R> {
        self.evaluate(point)
    }
    fn value_in(&self, point: Vector3<R>) -> R {
        self.value(point)
    }
}

/// Enclosures in one number type.
trait EnclosedSdfIn<R: Float> {
    fn evaluate_smooth_in(&self, point: Vector3<R>) -> Sample<R>;
    fn enclosure_in(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R>;
    fn relaxation_in(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R>;
    fn is_convex_in(&self, corners: &[Vector3<R>]) -> bool;
    fn max_rise_in(&self, corners: &[Vector3<R>]) -> [R; 4];
    fn minimum_on_segment(&self, ends: [Vector3<R>; 2], goal: Goal<R>) -> Option<ExactMinimum<R, 2>>;
    fn minimum_on_triangle(&self, corners: [Vector3<R>; 3], goal: Goal<R>) -> Option<ExactMinimum<R, 3>>;
}

impl<R: Float, F: EnclosedSdf> EnclosedSdfIn<R> for F {
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
    fn minimum_on_segment(&self, ends: [Vector3<R>; 2], goal: Goal<R>) -> Option<ExactMinimum<R, 2>> {
        self.exact_minimum(ends, goal)
    }
    fn minimum_on_triangle(&self, corners: [Vector3<R>; 3], goal: Goal<R>) -> Option<ExactMinimum<R, 3>> {
        self.exact_minimum(corners, goal)
    }
}

/// Bounds that are f64 whatever the number type of a query.
trait F64Bounds {
    fn bounds_f64(&self, level: f64) -> Aabb;
    fn slope_bound_f64(&self) -> f64;
    fn enclose_box_f64(&self, region: &Aabb) -> BoxEnclosure;
    fn linearization_error_f64(&self, region: &Aabb) -> f64;
}

impl<F: EnclosedSdf> F64Bounds for F {
    fn bounds_f64(&self, level: f64) -> Aabb {
        self.bounds(level)
    }
    fn slope_bound_f64(&self) -> f64 {
        self.slope_bound()
    }
    fn enclose_box_f64(&self, region: &Aabb) -> BoxEnclosure {
        self.enclose_box(region)
    }
    fn linearization_error_f64(&self, region: &Aabb) -> f64 {
        self.linearization_error(region)
    }
}

macro_rules! scene_field {
    ($($number:ty),*) => {
        trait ObjectSafeSdf: F64Bounds + EnclosedSdfIn<f32> + EnclosedSdfIn<f64> $(+ SdfIn<$number>)* {}
        impl<F: EnclosedSdf> ObjectSafeSdf for F {}

        /// A field of any type. A clone shares the field. Panics in a number type that no test uses.
        #[derive(Clone)]
        pub struct SceneField(Rc<dyn ObjectSafeSdf>);

        impl Sdf for SceneField {
            fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
                $(if let Some(point) = same_type::<_, Vector3<$number>>(point) {
                    let sample: Sample<$number> = self.0.evaluate_in(point);
                    return same_type(sample).unwrap();
                })*
                panic!("a SceneField evaluates in {}", stringify!($($number),*))
            }

            fn value<R: Real>(&self, point: Vector3<R>) -> R {
                $(if let Some(point) = same_type::<_, Vector3<$number>>(point) {
                    let value: $number = self.0.value_in(point);
                    return same_type(value).unwrap();
                })*
                panic!("a SceneField evaluates in {}", stringify!($($number),*))
            }

            fn evaluate_smooth<R: Float>(&self, point: Vector3<R>) -> Sample<R> {
                if let Some(point) = same_type::<_, Vector3<f32>>(point) {
                    return same_type(self.0.evaluate_smooth_in(point)).unwrap();
                }
                same_type(self.0.evaluate_smooth_in(same_type::<_, Vector3<f64>>(point).unwrap())).unwrap()
            }

            fn bounds(&self, level: f64) -> Aabb {
                self.0.bounds_f64(level)
            }

            fn slope_bound(&self) -> f64 {
                self.0.slope_bound_f64()
            }
        }
    };
}

scene_field!(f32, f64, Lanes<f32, 8>, Lanes<f64, 4>, Dual<f32>, Dual<f64>);

/// Four corners, of which the first `corners.len()` count: one size for all simplices, so that [`same_type`] applies.
fn padded<R: Float>(corners: &[Vector3<R>]) -> [Vector3<R>; 4] {
    let mut padded = [Vector3::zeros(); 4];
    padded[..corners.len()].copy_from_slice(corners);
    padded
}

impl EnclosedSdf for SceneField {
    fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
        self.0.enclose_box_f64(region)
    }

    fn linearization_error(&self, region: &Aabb) -> f64 {
        self.0.linearization_error_f64(region)
    }

    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        let (count, query) = (corners.len(), (about, padded(corners)));
        if let Some((about, corners)) = same_type::<_, (Vector3<f32>, [Vector3<f32>; 4])>(query) {
            return same_type(self.0.enclosure_in(about, &corners[..count])).unwrap();
        }
        let (about, corners) = same_type::<_, (Vector3<f64>, [Vector3<f64>; 4])>(query).unwrap();
        same_type(self.0.enclosure_in(about, &corners[..count])).unwrap()
    }

    fn relaxation<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R> {
        let (count, query) = (corners.len(), (about, padded(corners)));
        if let Some((about, corners)) = same_type::<_, (Vector3<f32>, [Vector3<f32>; 4])>(query) {
            return same_type(self.0.relaxation_in(about, &corners[..count])).unwrap();
        }
        let (about, corners) = same_type::<_, (Vector3<f64>, [Vector3<f64>; 4])>(query).unwrap();
        same_type(self.0.relaxation_in(about, &corners[..count])).unwrap()
    }

    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        let (count, corners) = (corners.len(), padded(corners));
        if let Some(corners) = same_type::<_, [Vector3<f32>; 4]>(corners) {
            return self.0.is_convex_in(&corners[..count]);
        }
        self.0.is_convex_in(&same_type::<_, [Vector3<f64>; 4]>(corners).unwrap()[..count])
    }

    fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
        let (count, corners) = (corners.len(), padded(corners));
        if let Some(corners) = same_type::<_, [Vector3<f32>; 4]>(corners) {
            return same_type(self.0.max_rise_in(&corners[..count])).unwrap();
        }
        same_type(self.0.max_rise_in(&same_type::<_, [Vector3<f64>; 4]>(corners).unwrap()[..count])).unwrap()
    }

    fn exact_minimum<R: Float, const N: usize>(
        &self,
        corners: [Vector3<R>; N],
        goal: Goal<R>,
    ) -> Option<ExactMinimum<R, N>> {
        let query = (corners, goal);
        if let Some((ends, goal)) = same_type::<_, ([Vector3<f32>; 2], Goal<f32>)>(query) {
            return same_type(self.0.minimum_on_segment(ends, goal)).unwrap();
        }
        if let Some((ends, goal)) = same_type::<_, ([Vector3<f64>; 2], Goal<f64>)>(query) {
            return same_type(self.0.minimum_on_segment(ends, goal)).unwrap();
        }
        if let Some((corners, goal)) = same_type::<_, ([Vector3<f32>; 3], Goal<f32>)>(query) {
            return same_type(self.0.minimum_on_triangle(corners, goal)).unwrap();
        }
        let (corners, goal) = same_type::<_, ([Vector3<f64>; 3], Goal<f64>)>(query).unwrap();
        same_type(self.0.minimum_on_triangle(corners, goal)).unwrap()
    }
}

impl SceneField {
    pub fn new(field: impl EnclosedSdf + 'static) -> Self {
        Self(Rc::new(field))
    }
}

/// `a` as a `B`, if `A` and `B` are the same type.
pub fn same_type<A: Copy + 'static, B: Copy + 'static>(a: A) -> Option<B> {
    (&a as &dyn Any).downcast_ref::<B>().copied()
}
