//! Which vertices of a field's own mesh touch the other shape? A body that stands on a wide triangle touches it at one lowest point by
//! the search of triangles, which is not enough to stand on: its own corners are.
//!
//! A vertex lies on the field's surface, and the nearest point of the other shape tells how far that is. Of a shape without an inside, such
//! as a floor of two triangles, the side is told by a point inside of the field: a vertex has gone through where the way to it from there
//! crosses the shape. One that hangs over an edge has not.

use parry3d::bounding_volume::BoundingVolume;
use parry3d::math::Pose;
use parry3d::query::Ray;
use parry3d::shape::{PackedFeatureId, Shape, TypedShape};
use sdf_core::nalgebra::Vector3;

use crate::body_part::BodyPart;
use crate::convert::{to_core, to_parry};
use crate::surface::Surface;
use crate::touch::Touch;

/// Vertices of the field's mesh begin here in the numbers of features, so that they are not those of the other shape.
const FIRST_CODE: u32 = 1 << 29;

/// A vertex that is nearer than this to the other shape, in sizes of its mesh, says nothing of a normal.
const AT_SURFACE: f64 = 1e-7;

/// Cosine of the least angle between a shape without an inside and the way to the field's inside: below it, the side is open.
const MIN_COSINE: f64 = 0.05;

/// The ways from the field's inside are longer by this fraction: rounding does not end one before the surface on which a vertex lies.
const FURTHER: f64 = 1e-4;

/// Cosine of the angle within which the triangle that such a way crosses is the one that is nearest to the vertex.
const SAME_PLANE: f32 = 0.9;

/// Touches of the mesh of a field with the other shape, within the margin. `pose` takes the other shape into the field's frame.
pub(crate) fn touches(mesh: &Surface, parts: &[BodyPart], other: &dyn Shape, pose: &Pose, margin: f64) -> Vec<Touch> {
    let near = other.compute_local_aabb().loosened(margin as f32);
    let least = AT_SURFACE * mesh.radius();
    let has_inside = has_inside(other);
    let vertices = mesh.parts.iter().flat_map(|part| &part.points).zip(FIRST_CODE..);
    let touch = |(vertex, code): (&[f64; 3], u32)| {
        let at = Vector3::from(*vertex);
        let local = pose.inverse_transform_point(to_parry(at));
        if !near.contains_local_point(local) {
            return None;
        }
        let there = other.project_local_point(local, false);
        let point = to_core(pose.transform_point(there.point));
        let way = point - at;
        let line = way.try_normalize(least)?;
        let is_through = if has_inside {
            there.is_inside
        } else {
            let inner = nearest_inner_point(parts, at)?;
            let to_inner = (inner - point).try_normalize(0.0)?.dot(&line);
            if to_inner.abs() < MIN_COSINE {
                return None;
            }
            let start = pose.inverse_transform_point(to_parry(inner));
            let way = (to_core(local) - to_core(start)) * (1.0 + FURTHER);
            let is_beyond = to_inner > 0.0;
            let crossed = other.cast_local_ray_and_get_normal(&Ray::new(start, to_parry(way)), 1.0, false);
            match crossed.filter(|_| is_beyond) {
                Some(crossed) => {
                    let line = pose.inverse_transform_vector(to_parry(line));
                    if crossed.normal.dot(line).abs() < SAME_PLANE {
                        return None;
                    }
                    true
                }
                None => false,
            }
        };
        let normal = if is_through { -line } else { line };
        let gap = way.dot(&normal);
        let feature = PackedFeatureId::vertex(code & (2 * FIRST_CODE - 1));
        let touch = Touch { point, field_point: at, normal, gap, value: gap, is_measured: false, border: 0.0, feature };
        (gap <= margin).then_some(touch)
    };
    vertices.filter_map(touch).collect()
}

/// The point inside of the body that is nearest to one of its vertices.
fn nearest_inner_point(parts: &[BodyPart], vertex: Vector3<f64>) -> Option<Vector3<f64>> {
    let points = parts.iter().map(|part| part.inner_point);
    points.min_by(|a, b| (a - vertex).norm_squared().total_cmp(&(b - vertex).norm_squared()))
}

/// Does parry tell whether a point is inside of it?
fn has_inside(shape: &dyn Shape) -> bool {
    match shape.as_typed_shape() {
        TypedShape::TriMesh(mesh) => mesh.pseudo_normals().is_some(),
        TypedShape::HeightField(_) | TypedShape::Polyline(_) | TypedShape::Segment(_) | TypedShape::Triangle(_) => {
            false
        }
        TypedShape::Compound(compound) => compound.shapes().iter().all(|(_, part)| has_inside(&**part)),
        _ => true,
    }
}
