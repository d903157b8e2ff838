//! Closed forms whose parameters change: how far is φ with the one set of parameters from φ with the other?
//!
//! The signed distance of a convex body is max over unit n of n·x − h(n), with h its support function. So two of them differ by no
//! more than max |h_a − h_b|, their Hausdorff distance (Schneider 2014, "Convex Bodies", §1.8).

use nalgebra::{Vector2, Vector3};

use crate::EnclosedSdf;
use crate::shapes::{Capsule, Cuboid, Cylinder, HalfSpace, RoundedBox, Sphere, Torus};

/// A closed form that bounds its own change with its parameters.
pub trait Animated: EnclosedSdf {
    /// Upper bound of |φ(x) − φ_later(x)| over all x, rounding aside. Infinite where there is none.
    fn max_difference(&self, later: &Self) -> f64;
}

impl Animated for Sphere {
    /// |Δr|.
    fn max_difference(&self, later: &Self) -> f64 {
        (later.radius() - self.radius()).abs()
    }
}

impl Animated for Torus {
    /// φ = |(|x_xy| − R, z)| − r: at most |ΔR| + |Δr|.
    fn max_difference(&self, later: &Self) -> f64 {
        (later.major_radius() - self.major_radius()).abs() + (later.minor_radius() - self.minor_radius()).abs()
    }
}

impl Animated for Capsule {
    /// h = max(a·n, b·n) + r: at most max(|Δa|, |Δb|) + |Δr|.
    fn max_difference(&self, later: &Self) -> f64 {
        let moved = |from: [f64; 3], to: [f64; 3]| (Vector3::from(to) - Vector3::from(from)).norm();
        moved(self.a(), later.a()).max(moved(self.b(), later.b())) + (later.radius() - self.radius()).abs()
    }
}

impl Animated for Cylinder {
    /// h = r |n_xy| + k |n_z|: at most |(Δr, Δk)|.
    fn max_difference(&self, later: &Self) -> f64 {
        Vector2::new(later.radius() - self.radius(), later.half_height() - self.half_height()).norm()
    }
}

impl Animated for Cuboid {
    /// h = Σ h_i |n_i|: at most |Δh|.
    fn max_difference(&self, later: &Self) -> f64 {
        (Vector3::from(later.half_extents()) - Vector3::from(self.half_extents())).norm()
    }
}

impl Animated for RoundedBox {
    /// |Δh| + |Δr|.
    fn max_difference(&self, later: &Self) -> f64 {
        let sides = (Vector3::from(later.half_extents()) - Vector3::from(self.half_extents())).norm();
        sides + (later.radius() - self.radius()).abs()
    }
}

impl Animated for HalfSpace {
    /// The offsets' difference; infinite where the normals differ.
    fn max_difference(&self, later: &Self) -> f64 {
        let is_parallel = self.given_normal() == later.given_normal();
        if is_parallel { (later.offset() - self.offset()).abs() } else { f64::INFINITY }
    }
}
