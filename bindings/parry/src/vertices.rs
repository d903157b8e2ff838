//! Which vertices of a field's own mesh touch the other shape? A body that stands on a wide triangle touches it at one lowest point by
//! the search of triangles, which is not enough to stand on: its own corners are.
//!
//! A vertex lies on the field's surface, and the nearest point of the other shape tells how far that is. Of a shape without an inside, such
//! as a floor of two triangles, the side is told by a point inside of the field: what lies on the far side has gone through.

use parry3d::bounding_volume::BoundingVolume;
use parry3d::math::Pose;
use parry3d::shape::{PackedFeatureId, Shape, TypedShape};
use sdf_core::nalgebra::Vector3;

use crate::convert::{to_core, to_parry};
use crate::surface::Surface;
use crate::touch::Touch;

/// Vertices of the field's mesh begin here in the numbers of features, so that they are not those of the other shape.
const FIRST_CODE: u32 = 1 << 29;

/// A vertex that is nearer than this to the other shape, in sizes of its mesh, says nothing of a normal.
const AT_SURFACE: f64 = 1e-7;

/// Cosine of the least angle between a shape without an inside and the way to the field's inside: below it, the side is open.
const MIN_COSINE: f64 = 0.05;

/// Touches of the mesh of a field with the other shape, within the margin. `inner` is a point inside of the field, and `pose` takes the
/// other shape into the field's frame.
pub(crate) fn touches(mesh: &Surface, inner: Vector3<f64>, other: &dyn Shape, pose: &Pose, margin: f64) -> Vec<Touch> {
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
            let to_inner = (inner - point).try_normalize(0.0)?.dot(&line);
            if to_inner.abs() < MIN_COSINE {
                return None;
            }
            to_inner > 0.0
        };
        let normal = if is_through { -line } else { line };
        let gap = way.dot(&normal);
        let feature = PackedFeatureId::vertex(code & (2 * FIRST_CODE - 1));
        let touch = Touch { point, field_point: at, normal, gap, value: gap, is_measured: false, border: 0.0, feature };
        (gap <= margin).then_some(touch)
    };
    vertices.filter_map(touch).collect()
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
