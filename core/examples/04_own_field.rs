//! A field of your own: three methods make it a field that every minimizer takes, and one line more makes the certified
//! search fast.

use sdf_core::minimize::{Certified, FrankWolfe, Minimizer, Newton};
use sdf_core::nalgebra::Vector3;
use sdf_core::{Aabb, EnclosedSdf, Real, Sample, Sdf, Simplex};

/// A ball of the 4-norm, between a ball and a cube: φ = (x⁴ + y⁴ + z⁴)^¼ − radius. Sign and surface are exact, and |φ| is
/// at most the distance, because |∇φ| ≤ 1.
struct Superball {
    radius: f64,
}

impl Sdf for Superball {
    // Generic over the number type: f32, f64, and SIMD lanes, which take both sides of a condition by `select`.
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        // Divided by the largest coordinate first, so that no power overflows or underflows.
        let largest = point.x.abs().max(point.y.abs()).max(point.z.abs());
        let is_center = largest.is_zero();
        let scaled = point / R::select(is_center, R::one(), largest);
        let fourth_powers = scaled.map(|x| x * x * x * x);
        let norm = (fourth_powers.x + fourth_powers.y + fourth_powers.z).sqrt().sqrt();
        // ∂φ/∂x = (x / norm)³. The centre has no gradient: take the limit along x, and say so.
        let gradient = scaled.map(|x| x / norm).map(|x| x * x * x);
        let gradient = gradient.zip_map(&Vector3::x(), |slope, choice| R::select(is_center, choice, slope));
        let value = R::select(is_center, R::zero(), largest * norm) - R::from_f64(self.radius);
        Sample::with_degenerate(value, gradient, is_center)
    }

    // A box that holds every point with φ ≤ level: searches cull by it.
    fn bounds(&self, level: f64) -> Aabb {
        Aabb::centered([self.radius + level.max(0.0); 3])
    }

    // Lipschitz constant: Σ u⁶ ≤ Σ u⁴ = 1 for the components u of x / norm.
    fn slope_bound(&self) -> f64 {
        1.0
    }
}

// Every method has a default, so `{}` would do. A norm is convex, and a search that knows it needs fewer evaluations.
impl EnclosedSdf for Superball {
    const IS_CONVEX: bool = true;
}

pub fn main() {
    let ball = Superball { radius: 1.0 };
    let corners = [[2.0, -1.0, 0.4], [-0.5, 1.8, 0.9], [0.3, 0.1, 2.5]].map(Vector3::<f64>::from);
    let triangle = Simplex { corners };

    let local = FrankWolfe::default().minimize(&ball, &triangle);
    let newton = Newton::default().minimize(&ball, &triangle);
    let certified = Certified::default().minimize(&ball, &triangle);
    for (name, found) in [("Frank-Wolfe", local), ("Newton", newton), ("certified", certified)] {
        let (value, bound, count) = (found.sample.value, found.lower_bound, found.evaluations);
        println!("{name:12} φ = {value:.6}, no less than {bound:.6}, {count} evaluations");
    }

    // Compared with a lattice of 20,000 points of the triangle.
    let mut lowest = f64::INFINITY;
    for i in 0..=200_u32 {
        for j in 0..=200 - i {
            let [u, v] = [i, j].map(|step| f64::from(step) / 200.0);
            lowest = lowest.min(ball.value(triangle.point([1.0 - u - v, u, v])));
        }
    }
    println!("lattice      φ = {lowest:.6}");
    let gap = 1e-3 * triangle.longest_edge();
    assert!(certified.converged && certified.sample.value <= lowest + gap && certified.lower_bound <= lowest);
    assert!(certified.sample.value - certified.lower_bound <= 2.0 * gap);
}
