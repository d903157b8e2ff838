//! A pointer to a field is a field: a reference, and with the feature `alloc` a `Box` and an `Arc`. So is a [`DynSdf`] that threads share.

#[cfg(feature = "alloc")]
use alloc::{boxed::Box, sync::Arc};

use nalgebra::Vector3;

use super::{DynSdf, Sample, Sdf};
use crate::number::{Float, Real};
use crate::{
    Aabb, BoxEnclosure, EnclosedSdf, Enclosure, ErrorBound, ExactMinimum, Goal, NearParts, PartVisitor, Relaxation,
};

/// All calls go to the field behind the pointer. The attribute is that of exact minima, whose search takes kilobytes of stack: through a pointer
/// that owns its field it is a call, so that combinations nested many deep need it once, and not at each level.
macro_rules! forward {
    (#[$inline:meta] $pointer:ty => $field:ty $(, $generic:ident)?) => {
        impl<$($generic: Sdf + ?Sized)?> Sdf for $pointer {
            const IS_SMOOTH_AS_IT_IS: bool = <$field>::IS_SMOOTH_AS_IT_IS;
            #[inline(always)]
            fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
                let field: &$field = self;
                field.evaluate(point)
            }
            fn bounds(&self, level: f64) -> Aabb {
                let field: &$field = self;
                field.bounds(level)
            }
            fn slope_bound(&self) -> f64 {
                let field: &$field = self;
                field.slope_bound()
            }
            #[inline(always)]
            fn slope_bound_as<R: Real>(&self) -> R {
                let field: &$field = self;
                field.slope_bound_as()
            }
            #[inline(always)]
            fn magnitude<R: Real>(&self) -> R {
                let field: &$field = self;
                field.magnitude()
            }
            #[inline(always)]
            fn extent<R: Real>(&self) -> R {
                let field: &$field = self;
                field.extent()
            }
            #[inline(always)]
            fn value<R: Real>(&self, point: Vector3<R>) -> R {
                let field: &$field = self;
                field.value(point)
            }
            #[inline(always)]
            fn lowest_about<R: Real>(&self, point: Vector3<R>) -> R {
                let field: &$field = self;
                field.lowest_about(point)
            }
            #[inline(always)]
            fn evaluate_smooth<R: Float>(&self, point: Vector3<R>) -> Sample<R> {
                let field: &$field = self;
                field.evaluate_smooth(point)
            }
        }

        impl<$($generic: EnclosedSdf + ?Sized)?> EnclosedSdf for $pointer {
            const IS_CONVEX: bool = <$field>::IS_CONVEX;
            const SLOPES_TAKE_LONG: bool = <$field>::SLOPES_TAKE_LONG;
            #[inline(always)]
            fn enclose_box(&self, region: &Aabb) -> BoxEnclosure {
                let field: &$field = self;
                field.enclose_box(region)
            }
            #[inline(always)]
            fn lowest_in_box(&self, region: &Aabb) -> f64 {
                let field: &$field = self;
                field.lowest_in_box(region)
            }
            fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
                let field: &$field = self;
                field.enclosure(about, corners)
            }
            fn relaxation<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R> {
                let field: &$field = self;
                field.relaxation(about, corners)
            }
            fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
                let field: &$field = self;
                field.is_convex_on(corners)
            }
            fn max_rise_to_corners<R: Float>(&self, corners: &[Vector3<R>]) -> [R; 4] {
                let field: &$field = self;
                field.max_rise_to_corners(corners)
            }
            fn error_bound(&self, region: &Aabb) -> ErrorBound {
                let field: &$field = self;
                field.error_bound(region)
            }
            #[$inline]
            fn exact_minimum<R: Float, const N: usize>(
                &self,
                corners: [Vector3<R>; N],
                goal: Goal<R>,
            ) -> Option<ExactMinimum<R, N>> {
                let field: &$field = self;
                field.exact_minimum(corners, goal)
            }
            fn linearization_error(&self, region: &Aabb) -> f64 {
                let field: &$field = self;
                field.linearization_error(region)
            }
            #[inline(always)]
            fn evaluate_near<R: Real>(&self, point: Vector3<R>, near: &NearParts<R>) -> Sample<R> {
                let field: &$field = self;
                field.evaluate_near(point, near)
            }
            #[inline(always)]
            fn narrow<R: Real>(&self, point: Vector3<R>, radius: R, near: &mut NearParts<R>) -> Sample<R> {
                let field: &$field = self;
                field.narrow(point, radius, near)
            }
            #[inline(always)]
            fn visit_parts<V: PartVisitor>(&self, visitor: &mut V) {
                let field: &$field = self;
                field.visit_parts(visitor);
            }
        }
    };
}

forward!(#[inline(always)] &F => F, F);
#[cfg(feature = "alloc")]
forward!(#[inline(never)] Box<F> => F, F);
#[cfg(feature = "alloc")]
forward!(#[inline(never)] Arc<F> => F, F);
forward!(#[inline(always)] dyn DynSdf + Send + Sync + '_ => dyn DynSdf + '_);

#[cfg(all(test, feature = "alloc"))]
mod tests {
    use std::{format, string::String};

    use super::*;
    use crate::minimize::{Certified, Minimizer};
    use crate::shapes::Torus;
    use crate::{Lanes, Simplex};

    fn answers<F: EnclosedSdf>(field: &F) -> String {
        let corners = [[-1.5, -0.5, 0.5], [1.5, -0.4, -0.1], [0.2, 1.6, 0.3]].map(Vector3::<f64>::from);
        let (region, lanes) = (Aabb::from_corners(&corners), corners[0].map(Lanes::<f32, 8>::from_f64));
        let answers = (
            (field.sample(corners[0]), field.evaluate_smooth(corners[1]), field.value(lanes), field.bounds(0.1)),
            (field.slope_bound(), field.magnitude::<f32>(), field.enclose_box(&region), field.error_bound(&region)),
            (field.enclosure(corners[0], &corners), field.max_rise_to_corners(&corners)),
            Certified::default().minimize(field, &Simplex { corners }),
        );
        format!("{answers:?}")
    }

    #[test]
    fn a_pointer_to_a_field_answers_as_the_field() {
        let torus = Torus::new(1.0, 0.25).unwrap();
        let (shared, boxed): (Arc<dyn DynSdf + Send + Sync>, Box<dyn DynSdf>) = (Arc::new(torus), Box::new(torus));
        let expected = answers(&torus);
        assert_eq!(
            [answers(&&torus), answers(&Box::new(torus)), answers(&Arc::new(torus))],
            std::array::from_fn(|_| expected.clone())
        );
        assert_eq!([answers(&shared), answers(&boxed)], [expected.clone(), expected]);
    }
}
