//! Shapes in closed form, each in its own frame; [`placed`](crate::placed) puts them into the world. Axes of
//! revolution run along z. Constructors return `None` if a parameter is not finite or does not make a shape.
//!
//! The formulas are those of Hart 1996, "Sphere Tracing: A Geometric Method for the Antialiased Ray Tracing of
//! Implicit Surfaces", appendix A, and of Quilez, "Distance functions" (iquilezles.org), here with gradients. With ρ
//! = √(x² + y²):
//!
//! | shape | φ | exact |
//! |---|---|---|
//! | [`Sphere`] | \|x\| − r | yes |
//! | [`HalfSpace`] | n·x − d | yes |
//! | [`Capsule`] | \|x − a − t (b − a)\| − r, t ∈ \[0, 1\] | yes |
//! | [`Cuboid`], [`RoundedBox`] | corner(\|x\| − h), minus r | yes |
//! | [`Cylinder`] | corner(ρ − r, \|z\| − h) | yes |
//! | [`Torus`] | \|(ρ − R, z)\| − r | yes |
//! | [`Cone`] | largest of side and base, or distance to apex or rim | yes |
//! | [`Octahedron`] | \|min(\|x\|, τ)\| | yes |
//! | [`Bowl`] | \|\|x\| − r\| − w/2, or distance to the rim − w/2 | outside |
//! | [`Horseshoe`] | a bent bar in the plane, extruded | yes |
//! | [`Ellipsoid`] | r (\|x / radii\| − 1) | lower bound of the distance |
//!
//! Where φ has no derivative, the gradient is one of its one-sided limits and
//! [`degenerate_gradient`](crate::Status::degenerate_gradient) is set. The shapes say where, under "Degenerate".

mod bowl;
mod capsule;
mod cone;
mod cuboid;
mod cylinder;
mod ellipsoid;
mod half_space;
mod horseshoe;
mod mirror;
mod nearest;
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

/// Is it finite and positive?
fn is_length(x: f64) -> bool {
    x.is_finite() && x > 0.0
}
