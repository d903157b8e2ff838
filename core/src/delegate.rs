//! The macro [`delegate_sdf!`](crate::delegate_sdf), which implements the traits of fields for an enum of fields.

/// Makes an enum of fields a field: calls go to whatever field it holds. A scene then pays for its own list of shapes.
///
/// ```
/// use sdf_core::{Sdf, delegate_sdf, nalgebra::Vector3, shapes::{HalfSpace, Sphere}};
///
/// enum Obstacle {
///     Ball(Sphere),
///     Ground(HalfSpace),
/// }
///
/// delegate_sdf!(Obstacle { Ball, Ground });
///
/// let scene = [Obstacle::Ball(Sphere::new(1.0).unwrap()), Obstacle::Ground(HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap())];
/// assert_eq!(scene.map(|obstacle| obstacle.value(Vector3::new(0.0, 0.0, 3.0))), [2.0, 3.0]);
/// ```
///
/// Variants that are unions are named again, `delegate_sdf!(Scene { Ball, Ground, All } unions { All })`, so that a certified
/// search takes their parts one by one. It is compiled once for the enum, and not for every variant.
#[macro_export]
macro_rules! delegate_sdf {
    ($name:ident $(<$lifetime:lifetime>)? { $($variant:ident),+ $(,)? } $(unions { $($union:ident),+ $(,)? })?) => {
        impl $(<$lifetime>)? $crate::Sdf for $name $(<$lifetime>)? {
            fn evaluate<R: $crate::Real>(&self, point: $crate::nalgebra::Vector3<R>) -> $crate::Sample<R> {
                match self { $(Self::$variant(field) => field.evaluate(point)),+ }
            }
            fn value<R: $crate::Real>(&self, point: $crate::nalgebra::Vector3<R>) -> R {
                match self { $(Self::$variant(field) => field.value(point)),+ }
            }
            fn evaluate_smooth<R: $crate::Float>(&self, point: $crate::nalgebra::Vector3<R>) -> $crate::Sample<R> {
                match self { $(Self::$variant(field) => field.evaluate_smooth(point)),+ }
            }
            fn bounds(&self, level: f64) -> $crate::Aabb {
                match self { $(Self::$variant(field) => field.bounds(level)),+ }
            }
            fn slope_bound(&self) -> f64 {
                match self { $(Self::$variant(field) => field.slope_bound()),+ }
            }
            fn slope_bound_as<R: $crate::Real>(&self) -> R {
                match self { $(Self::$variant(field) => field.slope_bound_as()),+ }
            }
            fn magnitude<R: $crate::Real>(&self) -> R {
                match self { $(Self::$variant(field) => field.magnitude()),+ }
            }
            fn extent<R: $crate::Real>(&self) -> R {
                match self { $(Self::$variant(field) => field.extent()),+ }
            }
        }

        impl $(<$lifetime>)? $crate::EnclosedSdf for $name $(<$lifetime>)? {
            fn enclose_box(&self, region: &$crate::Aabb) -> $crate::BoxEnclosure {
                match self { $(Self::$variant(field) => field.enclose_box(region)),+ }
            }
            fn enclosure<R: $crate::Float>(
                &self,
                about: $crate::nalgebra::Vector3<R>,
                corners: &[$crate::nalgebra::Vector3<R>],
            ) -> $crate::Enclosure<R> {
                match self { $(Self::$variant(field) => field.enclosure(about, corners)),+ }
            }
            fn relaxation<R: $crate::Float>(
                &self,
                about: $crate::nalgebra::Vector3<R>,
                corners: &[$crate::nalgebra::Vector3<R>],
            ) -> $crate::Relaxation<R> {
                match self { $(Self::$variant(field) => field.relaxation(about, corners)),+ }
            }
            fn is_convex_on<R: $crate::Float>(&self, corners: &[$crate::nalgebra::Vector3<R>]) -> bool {
                match self { $(Self::$variant(field) => field.is_convex_on(corners)),+ }
            }
            fn max_rise_to_corners<R: $crate::Float>(&self, corners: &[$crate::nalgebra::Vector3<R>]) -> [R; 4] {
                match self { $(Self::$variant(field) => field.max_rise_to_corners(corners)),+ }
            }
            fn exact_minimum<R: $crate::Float, const N: usize>(
                &self,
                corners: [$crate::nalgebra::Vector3<R>; N],
                goal: $crate::Goal<R>,
            ) -> Option<$crate::ExactMinimum<R, N>> {
                match self { $(Self::$variant(field) => field.exact_minimum(corners, goal)),+ }
            }
            fn linearization_error(&self, region: &$crate::Aabb) -> f64 {
                match self { $(Self::$variant(field) => field.linearization_error(region)),+ }
            }
            fn evaluate_near<R: $crate::Real>(
                &self,
                point: $crate::nalgebra::Vector3<R>,
                near: &$crate::NearParts<R>,
            ) -> $crate::Sample<R> {
                match self { $(Self::$variant(field) => field.evaluate_near(point, near)),+ }
            }
            fn narrow<R: $crate::Real>(
                &self,
                point: $crate::nalgebra::Vector3<R>,
                radius: R,
                near: &mut $crate::NearParts<R>,
            ) -> $crate::Sample<R> {
                match self { $(Self::$variant(field) => field.narrow(point, radius, near)),+ }
            }
            fn error_bound(&self, region: &$crate::Aabb) -> $crate::ErrorBound {
                match self { $(Self::$variant(field) => field.error_bound(region)),+ }
            }
            fn visit_parts<V: $crate::PartVisitor>(&self, visitor: &mut V) {
                #[allow(unreachable_patterns, reason = "all variants may be unions")]
                match self {
                    $($(Self::$union(field) => field.visit_parts(visitor),)+)?
                    _ => visitor.visit(&self),
                }
            }
        }
    };
}
