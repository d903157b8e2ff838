//! Which closed forms are there? One function each. Axes of revolution lie along z.

use pyo3::prelude::*;
use sdf_field::Field;
use sdf_field::core::AnyField;
use sdf_field::core::shapes::{
    Bowl, Capsule, Cone, Cuboid, Cylinder, Ellipsoid, HalfSpace, Horseshoe, Octahedron, RoundedBox, Sphere, Torus,
};

use crate::arrays;
use crate::errors::value_error;
use crate::sdf::Sdf;

fn shape(made: Option<impl Into<AnyField>>, wanted: &str) -> PyResult<Sdf> {
    made.map(|shape| Sdf(Field::new(shape))).ok_or_else(|| value_error(wanted))
}

/// A sphere about the origin, negative inside.
#[pyfunction]
fn sphere(#[pyo3(from_py_with = arrays::number)] radius: f64) -> PyResult<Sdf> {
    shape(Sphere::new(radius), "sphere: radius must be positive and finite")
}

/// The points with normal . x <= offset, negative inside. The normal points out and is made a unit vector.
#[pyfunction]
#[pyo3(signature = (normal=[0.0, 0.0, 1.0], offset=0.0))]
fn half_space(
    #[pyo3(from_py_with = arrays::vector)] normal: [f64; 3],
    #[pyo3(from_py_with = arrays::number)] offset: f64,
) -> PyResult<Sdf> {
    shape(HalfSpace::new(normal, offset), "half_space: normal must not be zero, and all numbers finite")
}

/// A box about the origin with these half extents (x, y, z), negative inside.
#[pyfunction]
fn cuboid(#[pyo3(from_py_with = arrays::vector)] half_extents: [f64; 3]) -> PyResult<Sdf> {
    shape(Cuboid::new(half_extents), "cuboid: half_extents must be positive and finite")
}

/// A box with a radius added around it, negative inside.
#[pyfunction]
fn rounded_box(
    #[pyo3(from_py_with = arrays::vector)] half_extents: [f64; 3],
    #[pyo3(from_py_with = arrays::number)] radius: f64,
) -> PyResult<Sdf> {
    let wanted = "rounded_box: half_extents must be positive, radius 0 or more, and all numbers finite";
    shape(RoundedBox::new(half_extents, radius), wanted)
}

/// The points within radius of the segment from a to b, negative inside.
#[pyfunction]
fn capsule(
    #[pyo3(from_py_with = arrays::vector)] a: [f64; 3],
    #[pyo3(from_py_with = arrays::vector)] b: [f64; 3],
    #[pyo3(from_py_with = arrays::number)] radius: f64,
) -> PyResult<Sdf> {
    shape(Capsule::new(a, b, radius), "capsule: radius must be positive, and all numbers and the length finite")
}

/// A cylinder about the origin along z, negative inside.
#[pyfunction]
fn cylinder(
    #[pyo3(from_py_with = arrays::number)] radius: f64,
    #[pyo3(from_py_with = arrays::number)] half_height: f64,
) -> PyResult<Sdf> {
    shape(Cylinder::new(radius, half_height), "cylinder: radius and half_height must be positive and finite")
}

/// A cone with its apex at the origin, opening towards -z, negative inside. half_angle in radians.
#[pyfunction]
fn cone(
    #[pyo3(from_py_with = arrays::number)] half_angle: f64,
    #[pyo3(from_py_with = arrays::number)] height: f64,
) -> PyResult<Sdf> {
    shape(
        Cone::new(half_angle, height),
        "cone: half_angle must be between 0 and pi/2 (radians), height positive and finite",
    )
}

/// A torus about the z axis, negative inside.
#[pyfunction]
fn torus(
    #[pyo3(from_py_with = arrays::number)] major_radius: f64,
    #[pyo3(from_py_with = arrays::number)] minor_radius: f64,
) -> PyResult<Sdf> {
    let wanted = "torus: minor_radius must be positive, major_radius no less than that, and both finite";
    shape(Torus::new(major_radius, minor_radius), wanted)
}

/// The octahedron |x| + |y| + |z| <= size, negative inside.
#[pyfunction]
fn octahedron(#[pyo3(from_py_with = arrays::number)] size: f64) -> PyResult<Sdf> {
    shape(Octahedron::new(size), "octahedron: size must be positive and finite")
}

/// An ellipsoid about the origin with these radii (x, y, z), negative inside: a bound of the distance, not the distance.
#[pyfunction]
fn ellipsoid(#[pyo3(from_py_with = arrays::vector)] radii: [f64; 3]) -> PyResult<Sdf> {
    shape(Ellipsoid::new(radii), "ellipsoid: radii must be positive and finite")
}

/// A hollow sphere of this thickness, open above a height, negative inside. Its rounded rim reaches half the thickness higher.
#[pyfunction]
fn bowl(
    #[pyo3(from_py_with = arrays::number)] radius: f64,
    #[pyo3(from_py_with = arrays::number)] cut_height: f64,
    #[pyo3(from_py_with = arrays::number)] thickness: f64,
) -> PyResult<Sdf> {
    let wanted = "bowl: radius and thickness must be positive, cut_height between -radius and radius, and all finite";
    shape(Bowl::new(radius, cut_height, thickness), wanted)
}

/// A horseshoe: an arc bent by this angle (radians), with two legs, negative inside.
#[pyfunction]
fn horseshoe(
    #[pyo3(from_py_with = arrays::number)] radius: f64,
    #[pyo3(from_py_with = arrays::number)] thickness: f64,
    #[pyo3(from_py_with = arrays::number)] bend: f64,
    #[pyo3(from_py_with = arrays::number)] leg: f64,
    #[pyo3(from_py_with = arrays::number)] half_depth: f64,
) -> PyResult<Sdf> {
    let wanted = "horseshoe: radius, thickness and half_depth must be positive, bend between 0 and pi, leg 0 or more, thickness \
        less than twice the radius, and the legs must not meet";
    shape(Horseshoe::new(radius, thickness, bend, leg, half_depth), wanted)
}

/// The points of any of several fields: the least of their values, negative inside. A search takes the parts one by one.
#[pyfunction]
fn union(fields: Vec<Bound<Sdf>>) -> PyResult<Sdf> {
    let parts: Vec<Field> = fields.iter().map(|field| field.get().0.clone()).collect();
    Field::union(&parts).map(Sdf).map_err(value_error)
}

pub fn add(module: &Bound<PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(sphere, module)?)?;
    module.add_function(wrap_pyfunction!(half_space, module)?)?;
    module.add_function(wrap_pyfunction!(cuboid, module)?)?;
    module.add_function(wrap_pyfunction!(rounded_box, module)?)?;
    module.add_function(wrap_pyfunction!(capsule, module)?)?;
    module.add_function(wrap_pyfunction!(cylinder, module)?)?;
    module.add_function(wrap_pyfunction!(cone, module)?)?;
    module.add_function(wrap_pyfunction!(torus, module)?)?;
    module.add_function(wrap_pyfunction!(octahedron, module)?)?;
    module.add_function(wrap_pyfunction!(ellipsoid, module)?)?;
    module.add_function(wrap_pyfunction!(bowl, module)?)?;
    module.add_function(wrap_pyfunction!(horseshoe, module)?)?;
    module.add_function(wrap_pyfunction!(union, module)?)
}
