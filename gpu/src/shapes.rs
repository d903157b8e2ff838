use sdf_core::AnyField;
use sdf_core::placed::{Placement, Similarity};

use crate::GpuError;
use crate::abi::{ShapeParams, shape};

/// The parts of a union, or the one shape that the field is, in coordinates from an origin.
pub fn shape_list(field: &AnyField, origin: [f64; 3]) -> Result<Vec<ShapeParams>, GpuError> {
    match field {
        AnyField::Union(parts) => parts.parts().iter().map(|part| known_shape(part, origin)).collect(),
        _ => Ok(vec![known_shape(field, origin)?]),
    }
}

/// A shape that the kernels know, placed or not.
fn known_shape(field: &AnyField, origin: [f64; 3]) -> Result<ShapeParams, GpuError> {
    let from_origin = |point: [f64; 3]| [0, 1, 2].map(|axis| point[axis] - origin[axis]);
    let placed = |translation, rotation, scale, shape| ShapeParams {
        is_placed: 1,
        translation: from_origin(translation),
        rotation,
        scale,
        ..shape
    };
    match field {
        AnyField::Placed(part) => {
            let place: &Similarity = &part.placement;
            Ok(placed(place.translation(), place.rotation(), place.scale(), plain_shape(&part.field)?))
        }
        // Its ends say where it is.
        AnyField::Capsule(capsule) => {
            Ok(capsule_params(from_origin(capsule.a()), from_origin(capsule.b()), capsule.radius()))
        }
        _ if origin == [0.0; 3] => plain_shape(field),
        _ => Ok(placed([0.0; 3], [0.0, 0.0, 0.0, 1.0], 1.0, plain_shape(field)?)),
    }
}

/// A shape by its kind and the arguments of its constructor.
fn plain_shape(field: &AnyField) -> Result<ShapeParams, GpuError> {
    let (kind, numbers): (u32, &[f64]) = match field {
        AnyField::Sphere(sphere) => (shape::SPHERE, &[sphere.radius()]),
        AnyField::Cuboid(cuboid) => (shape::CUBOID, &cuboid.half_extents()),
        AnyField::Capsule(capsule) => return Ok(capsule_params(capsule.a(), capsule.b(), capsule.radius())),
        AnyField::Cylinder(cylinder) => (shape::CYLINDER, &[cylinder.radius(), cylinder.half_height()]),
        AnyField::Cone(cone) => (shape::CONE, &[cone.half_angle(), cone.height()]),
        AnyField::Torus(torus) => (shape::TORUS, &[torus.major_radius(), torus.minor_radius()]),
        _ => return Err(GpuError::Unsupported("this shape or combination")),
    };
    Ok(params(kind, numbers))
}

fn capsule_params([ax, ay, az]: [f64; 3], [bx, by, bz]: [f64; 3], radius: f64) -> ShapeParams {
    params(shape::CAPSULE, &[ax, ay, az, bx, by, bz, radius])
}

fn params(kind: u32, numbers: &[f64]) -> ShapeParams {
    let mut params = ShapeParams { kind, ..ShapeParams::default() };
    params.numbers[..numbers.len()].copy_from_slice(numbers);
    params
}

#[cfg(test)]
mod tests;
