//! A bowl: a hollow sphere, cut open (Quilez, "sdCutHollowSphere").
//!
//! In the half-plane (ρ, z), with r the radius, c the cut height and w = √(r² − c²) the radius of the rim, the middle
//! of the wall is an arc that ends at (w, c). The ray from the centre through that end divides the half-plane:
//!
//! ```text
//! c ρ < w z  (above the cut):   φ = |(ρ − w, z − c)| − thickness/2
//! else:                         φ = ||(ρ, z)| − r|   − thickness/2
//! ```

use nalgebra::Vector3;

use super::is_length;
use super::profile::{Profile, revolve};
use crate::number::{Float, Real};
use crate::relaxation::AffineBounds;
use crate::{Aabb, EnclosedSdf, Enclosure, Relaxation, Sample, Sdf};

/// A hollow sphere around the origin, cut open above z = `cut_height`. The rim is rounded, and reaches `thickness`/2 above the cut.
///
/// Exact outside. Exact inside where half the thickness is at most the rim's radius √(r² − c²), or r for a cut below the middle: the way
/// out from the middle of the wall, of length `thickness`/2, meets neither the axis above the cut nor the centre. In a thicker wall the
/// magnitude is at most the distance.
///
/// Degenerate: the middle of the wall, the centre and, above the cut, the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bowl {
    radius: f64,
    cut_height: f64,
    thickness: f64,
    rim_radius: f64,
}

impl Bowl {
    /// `radius` is that of the middle of the wall. −`radius` < `cut_height` < `radius`.
    pub fn new(radius: f64, cut_height: f64, thickness: f64) -> Option<Self> {
        let rim_radius = libm::sqrt(radius * radius - cut_height * cut_height);
        let is_valid = [radius, thickness, rim_radius].into_iter().all(is_length) && cut_height.is_finite();
        is_valid.then_some(Self { radius, cut_height, thickness, rim_radius })
    }

    /// Radius of the middle of the wall.
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// The height above which the sphere is cut open.
    pub fn cut_height(&self) -> f64 {
        self.cut_height
    }

    /// Thickness of the wall.
    pub fn thickness(&self) -> f64 {
        self.thickness
    }
}

impl Sdf for Bowl {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        let (rim_radius, cut_height) = (R::from_f64(self.rim_radius), R::from_f64(self.cut_height));
        revolve(point, |[rho, z]| {
            let outward = Profile::norm([rho, z]);
            // At the centre all of the wall is equally near; its lowest point exists for every cut.
            let downward = Profile { gradient: [R::zero(), -R::one()], ..outward };
            let center = Profile::select(outward.is_degenerate, downward, outward);
            let offset = center.value - R::from_f64(self.radius);
            let wall = Profile {
                value: offset.abs(),
                gradient: center.gradient.map(|derivative| derivative * offset.sign()),
                is_degenerate: center.is_degenerate | offset.is_zero(),
            };
            let rim = Profile::norm([rho - rim_radius, z - cut_height]);
            let is_above_cut = (cut_height * rho).lt(rim_radius * z);
            let middle = Profile::select(is_above_cut, rim, wall);
            Profile { value: middle.value - R::from_f64(0.5 * self.thickness), ..middle }
        })
    }

    fn bounds(&self, level: f64) -> Aabb {
        let widest = if self.cut_height < 0.0 { self.rim_radius } else { self.radius };
        Aabb { min: [-widest, -widest, -self.radius], max: [widest, widest, self.cut_height] }
            .inflate(0.5 * self.thickness + level.max(0.0))
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }

    /// |x| − r rounds at the size of r, also near the centre of a thick wall.
    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        R::from_f64(self.radius)
    }
}

/// Bounds from two distances (see `relaxation`): ||x| − r| to the whole sphere is a lower bound of the distance to the arc,
/// |(ρ − w, z − c)| to its end an upper bound. Each is attained on its side of the ray. On the ray both have the same value
/// and gradient, so that a hull which meets it is bounded by both with an error of second order.
impl EnclosedSdf for Bowl {
    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        self.relaxation(about, corners).enclosure
    }

    fn relaxation<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R> {
        let (rim_radius, cut_height) = (R::from_f64(self.rim_radius), R::from_f64(self.cut_height));
        let [x, y, z] = AffineBounds::coordinates(about, corners);
        let rho = AffineBounds::norm([x, y]);
        let wall = AffineBounds::norm([x, y, z]).shift(R::from_f64(-self.radius)).abs();
        let rim = AffineBounds::norm([rho.shift(-rim_radius), z.shift(-cut_height)]);
        // Negative above the cut.
        let side = rho.scale(cut_height).add(z.scale(-rim_radius));
        let middle = match () {
            () if side.max_value() < R::zero() => rim,
            () if R::zero() <= side.min_value() => wall,
            () => AffineBounds { upper: rim.upper, ..wall },
        };
        let bowl = middle.shift(R::from_f64(-0.5 * self.thickness));
        Relaxation::from_affine(self, bowl, self.radius + self.thickness, about, corners)
    }
}
