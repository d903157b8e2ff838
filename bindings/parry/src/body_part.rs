//! Parts of a body that can be apart: those of a union. Each of them can be wholly inside of another shape.

use std::sync::Arc;

use sdf_core::nalgebra::Vector3;
use sdf_core::{Aabb, AnyField, Sdf};

use crate::nearest::NearestPoint;

/// A ray, or a point, is at the surface within this fraction of the box's diagonal.
const AT_SURFACE: f64 = 1e-6;

/// A field that is a part of a body, or all of it.
#[derive(Clone)]
pub(crate) struct BodyPart {
    pub field: Arc<AnyField>,
    /// The box around its inside.
    pub bounds: Aabb,
    /// A point with φ ≤ 0, or on the surface.
    pub inner_point: Vector3<f64>,
}

impl BodyPart {
    /// The parts of a field in which a point is found. `bounds` is the box around its inside.
    pub fn all(field: &Arc<AnyField>, bounds: &Aabb) -> Vec<Self> {
        let AnyField::Union(union) = &**field else {
            return inner_point(field, bounds)
                .map(|inner_point| Self { field: field.clone(), bounds: *bounds, inner_point })
                .into_iter()
                .collect();
        };
        union.parts().iter().flat_map(|part| Self::all(&Arc::new(part.clone()), &part.bounds(0.0))).collect()
    }
}

/// The middle of the box, or the point of the surface that is nearest to it.
fn inner_point(field: &AnyField, bounds: &Aabb) -> Option<Vector3<f64>> {
    let middle = Vector3::from(bounds.center());
    let tolerance = at_surface(bounds);
    let is_inner = |point: &Vector3<f64>| field.value(*point) <= tolerance;
    let nearest = || NearestPoint { field, start: middle, tolerance }.find();
    let point = if field.value(middle) <= 0.0 { middle } else { nearest() };
    Some(point).filter(is_inner)
}

/// How near to the surface a point is on it.
pub(crate) fn at_surface(bounds: &Aabb) -> f64 {
    AT_SURFACE * bounds.diagonal()
}
