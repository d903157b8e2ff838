//! Fields that random problems are posed on.

use std::f64::consts::FRAC_PI_2;

use anyhow::{Context, Result};
use sdf_core::AnyField;
use sdf_core::combine::SmoothUnion;
use sdf_core::grid::owned::Layout;
use sdf_core::shapes::{Capsule, Cone, Cuboid, Horseshoe, Sphere, Torus};
use sdf_procedural::Mesh;

use crate::bake;

/// The horseshoe of the paper's Fig. 3. It is so deep that in the plane z = 0 only its outline is near.
pub fn horseshoe() -> Result<AnyField> {
    Horseshoe::new(0.6, 0.3, FRAC_PI_2, 0.6, 10.0).map(AnyField::Horseshoe).context("a horseshoe")
}

/// A sphere, a box, a capsule, a cone, a torus, and a smooth union of two.
pub fn shapes() -> Result<Vec<AnyField>> {
    let capsule = || Capsule::new([-0.5, 0.1, 0.0], [0.5, -0.1, 0.3], 0.25).map(AnyField::Capsule);
    let cuboid = || Cuboid::new([0.6, 0.4, 0.3]).map(AnyField::Cuboid);
    let blended = || SmoothUnion::new(capsule()?, cuboid()?, 0.2).map(|union| AnyField::SmoothUnion(Box::new(union)));
    let shapes = [
        Sphere::new(0.7).map(AnyField::Sphere),
        cuboid(),
        capsule(),
        Cone::new(20.0_f64.to_radians(), 1.4).map(AnyField::Cone),
        Torus::new(0.6, 0.2).map(AnyField::Torus),
        blended(),
    ];
    shapes.into_iter().collect::<Option<_>>().context("a shape")
}

/// Bakes with `resolution` cells along the longest side.
pub fn bake(body: &Mesh, resolution: u32, layout: Layout) -> Result<AnyField> {
    Ok(bake::bake(body, resolution, layout)?.into_any())
}
