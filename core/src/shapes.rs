//! Shapes in closed form, each in its own frame; [`placed`](crate::placed) puts them into the world. Axes of revolution
//! run along z. Constructors answer `None` to a parameter that is not finite or makes no shape.

mod bowl;
mod capsule;
mod cone;
mod cuboid;
mod cylinder;
mod ellipsoid;
mod fold;
mod half_space;
mod horseshoe;
mod octahedron;
mod profile;
mod rounded_box;
mod sphere;
mod torus;

pub use bowl::Bowl;
pub use capsule::Capsule;
pub use cone::Cone;
pub use cuboid::Cuboid;
pub use cylinder::Cylinder;
pub use ellipsoid::Ellipsoid;
pub use half_space::HalfSpace;
pub use horseshoe::Horseshoe;
pub use octahedron::Octahedron;
pub use rounded_box::RoundedBox;
pub use sphere::Sphere;
pub use torus::Torus;

/// A length that can be the size of something.
fn is_length(x: f64) -> bool {
    x.is_finite() && x > 0.0
}
