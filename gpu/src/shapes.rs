use sdf_core::AnyField;
use sdf_core::placed::{Placement, Similarity};

use crate::GpuError;
use crate::abi::{ShapeParams, shape};

/// The parts of a union, or the one shape that the field is.
pub fn shape_list(field: &AnyField) -> Result<Vec<ShapeParams>, GpuError> {
    match field {
        AnyField::Union(parts) => parts.parts().iter().map(placed_shape).collect(),
        _ => Ok(vec![placed_shape(field)?]),
    }
}

fn placed_shape(field: &AnyField) -> Result<ShapeParams, GpuError> {
    let AnyField::Placed(placed) = field else { return plain_shape(field) };
    let place: &Similarity = &placed.placement;
    Ok(ShapeParams {
        is_placed: 1,
        translation: place.translation(),
        rotation: place.rotation(),
        scale: place.scale(),
        ..plain_shape(&placed.field)?
    })
}

/// A shape by its kind and the arguments of its constructor.
fn plain_shape(field: &AnyField) -> Result<ShapeParams, GpuError> {
    let (kind, numbers): (u32, &[f64]) = match field {
        AnyField::Sphere(sphere) => (shape::SPHERE, &[sphere.radius()]),
        AnyField::Cuboid(cuboid) => (shape::CUBOID, &cuboid.half_extents()),
        AnyField::Capsule(capsule) => {
            let ([ax, ay, az], [bx, by, bz]) = (capsule.a(), capsule.b());
            (shape::CAPSULE, &[ax, ay, az, bx, by, bz, capsule.radius()])
        }
        AnyField::Cylinder(cylinder) => (shape::CYLINDER, &[cylinder.radius(), cylinder.half_height()]),
        AnyField::Cone(cone) => (shape::CONE, &[cone.half_angle(), cone.height()]),
        AnyField::Torus(torus) => (shape::TORUS, &[torus.major_radius(), torus.minor_radius()]),
        _ => return Err(GpuError::Unsupported("this shape or combination")),
    };
    let mut params = ShapeParams { kind, ..ShapeParams::default() };
    params.numbers[..numbers.len()].copy_from_slice(numbers);
    Ok(params)
}

#[cfg(test)]
mod tests;
