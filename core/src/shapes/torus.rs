use nalgebra::Vector3;

use super::is_length;
use super::profile::{Profile, revolve};
use crate::number::{Float, Parameter, Real};
use crate::relaxation::AffineBounds;
use crate::rounding::EVALUATION;
use crate::simplex::mean;
use crate::{Aabb, EnclosedSdf, Enclosure, Relaxation, Sample, Sdf};

/// A ring around z in the plane z = 0: φ = |(ρ − R, z)| − r. Exact.
///
/// Degenerate: the core circle and the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Torus {
    major_radius: Parameter,
    minor_radius: Parameter,
}

impl Torus {
    /// `major_radius` R is that of the core circle, `minor_radius` r ≤ R that of the tube.
    pub fn new(major_radius: f64, minor_radius: f64) -> Option<Self> {
        let is_valid = is_length(major_radius) && is_length(minor_radius) && minor_radius <= major_radius;
        is_valid.then(|| Self { major_radius: major_radius.into(), minor_radius: minor_radius.into() })
    }

    /// Radius of the core circle.
    pub fn major_radius(&self) -> f64 {
        self.major_radius.double
    }

    /// Radius of the tube.
    pub fn minor_radius(&self) -> f64 {
        self.minor_radius.double
    }
}

impl Sdf for Torus {
    #[inline]
    fn evaluate<R: Real>(&self, point: Vector3<R>) -> Sample<R> {
        revolve(point, |[rho, z]| {
            let core = Profile::norm([rho - R::from_parameter(self.major_radius), z]);
            Profile { value: core.value - R::from_parameter(self.minor_radius), ..core }
        })
    }

    fn bounds(&self, level: f64) -> Aabb {
        let outer = self.major_radius() + self.minor_radius();
        Aabb::centered([outer, outer, self.minor_radius()]).inflate(level.max(0.0))
    }

    fn slope_bound(&self) -> f64 {
        1.0
    }

    /// ρ − R rounds at the size of R, also in the hole of a fat torus, and r ≤ R.
    #[inline(always)]
    fn magnitude<R: Real>(&self) -> R {
        R::from_parameter(self.major_radius)
    }
}

/// Bounds of φ = G(ρ − R, z) − r, where the norm G is convex (see `relaxation`). The bound of ρ is a tangent plane outside
/// the core circle, where ∂G/∂ρ ≥ 0, and its chord inside. φ ≥ −r.
impl EnclosedSdf for Torus {
    fn enclosure<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Enclosure<R> {
        self.relaxation(about, corners).enclosure
    }

    fn relaxation<R: Float>(&self, about: Vector3<R>, corners: &[Vector3<R>]) -> Relaxation<R> {
        let [x, y, z] = AffineBounds::coordinates(about, corners);
        let rho = AffineBounds::norm([x, y]);
        let core = AffineBounds::norm([rho.shift(-R::from_parameter(self.major_radius)), z]);
        let tube = core.shift(-R::from_parameter(self.minor_radius));
        Relaxation::from_affine(self, tube, self.major_radius() + self.minor_radius(), about, corners)
    }

    /// True where ρ > R: there φ increases with ρ, and both G and ρ are convex.
    fn is_convex_on<R: Float>(&self, corners: &[Vector3<R>]) -> bool {
        let [x, y, _] = AffineBounds::coordinates(mean(corners), corners);
        let min_rho = AffineBounds::norm([x, y]).min_value();
        R::from_f64(self.major_radius() * (1.0 + EVALUATION * R::EPSILON)) < min_rho
    }
}
