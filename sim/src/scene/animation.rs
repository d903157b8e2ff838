//! Closed forms whose parameters swing between two sets (Macklin et al. 2020, Fig. 10): which shape is there at a time, and how fast
//! does its surface move? Every parameter p goes from p₀ to p₁ and back: p(t) = p₀ + s (p₁ − p₀), s = ½ (1 − cos 2πt/T).

use std::f64::consts::PI;

use sdf_core::AnyField;
use sdf_core::moving::Animated;
use sdf_core::placed::Placement;
use sdf_core::shapes::{Capsule, Cuboid, Cylinder, RoundedBox, Sphere, Torus};
use sdf_field::Field;

/// A closed form that changes with time.
#[derive(Clone, Debug)]
pub struct Animation {
    from: AnyField,
    to: AnyField,
    period: f64,
}

impl Animation {
    /// `None` where the two are not the same shape, or not one of sphere, torus, cylinder, capsule, box and rounded box, each placed
    /// alike or not at all.
    pub fn new(from: AnyField, to: AnyField, period: f64) -> Option<Self> {
        between(&from, &to, 0.5)?;
        Some(Self { from, to, period })
    }

    /// The shape at a time.
    pub fn at(&self, time: f64) -> Field {
        let share = 0.5 * (1.0 - (2.0 * PI * time / self.period).cos());
        // The ends have a shape in between, by `new`.
        Field::new(between(&self.from, &self.to, share).unwrap_or_else(|| self.from.clone()))
    }

    /// The largest speed of the surface: that of s is π / T.
    pub fn max_speed(&self) -> f64 {
        difference(&self.from, &self.to) * PI / self.period
    }
}

/// The shape whose parameters are a share of the way from one to the other.
fn between(from: &AnyField, to: &AnyField, share: f64) -> Option<AnyField> {
    let mix = |a: f64, b: f64| a + (b - a) * share;
    let mix_all = |a: [f64; 3], b: [f64; 3]| std::array::from_fn(|axis| mix(a[axis], b[axis]));
    Some(match (from, to) {
        (AnyField::Sphere(a), AnyField::Sphere(b)) => Sphere::new(mix(a.radius(), b.radius()))?.into(),
        (AnyField::Torus(a), AnyField::Torus(b)) => {
            Torus::new(mix(a.major_radius(), b.major_radius()), mix(a.minor_radius(), b.minor_radius()))?.into()
        }
        (AnyField::Cylinder(a), AnyField::Cylinder(b)) => {
            Cylinder::new(mix(a.radius(), b.radius()), mix(a.half_height(), b.half_height()))?.into()
        }
        (AnyField::Capsule(a), AnyField::Capsule(b)) => {
            Capsule::new(mix_all(a.a(), b.a()), mix_all(a.b(), b.b()), mix(a.radius(), b.radius()))?.into()
        }
        (AnyField::Cuboid(a), AnyField::Cuboid(b)) => Cuboid::new(mix_all(a.half_extents(), b.half_extents()))?.into(),
        (AnyField::RoundedBox(a), AnyField::RoundedBox(b)) => {
            let half = mix_all(a.half_extents(), b.half_extents());
            RoundedBox::new(half, mix(a.radius(), b.radius()))?.into()
        }
        (AnyField::Placed(a), AnyField::Placed(b)) if a.placement == b.placement => {
            AnyField::placed(between(&a.field, &b.field, share)?, a.placement)
        }
        _ => return None,
    })
}

/// Upper bound of |φ_to − φ_from|.
fn difference(from: &AnyField, to: &AnyField) -> f64 {
    match (from, to) {
        (AnyField::Sphere(a), AnyField::Sphere(b)) => a.max_difference(b),
        (AnyField::Torus(a), AnyField::Torus(b)) => a.max_difference(b),
        (AnyField::Cylinder(a), AnyField::Cylinder(b)) => a.max_difference(b),
        (AnyField::Capsule(a), AnyField::Capsule(b)) => a.max_difference(b),
        (AnyField::Cuboid(a), AnyField::Cuboid(b)) => a.max_difference(b),
        (AnyField::RoundedBox(a), AnyField::RoundedBox(b)) => a.max_difference(b),
        (AnyField::Placed(a), AnyField::Placed(b)) => a.placement.scale() * difference(&a.field, &b.field),
        _ => f64::INFINITY,
    }
}
