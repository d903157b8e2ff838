//! Axis-aligned boxes, in f64.

use nalgebra::Vector3;

use crate::number::Float;

/// An axis-aligned box. Unbounded where a coordinate is infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Lowest x, y and z.
    pub min: [f64; 3],
    /// Highest x, y and z.
    pub max: [f64; 3],
}

impl Aabb {
    /// The whole space.
    pub const EVERYWHERE: Self = Self { min: [f64::NEG_INFINITY; 3], max: [f64::INFINITY; 3] };

    /// The box centered at the origin.
    #[inline]
    pub fn centered(half_extents: [f64; 3]) -> Self {
        Self { min: half_extents.map(|h| -h), max: half_extents }
    }

    /// The smallest box that holds all `points`; `None` if there are none.
    pub fn from_points(points: impl IntoIterator<Item = [f64; 3]>) -> Option<Self> {
        points.into_iter().map(|p| Self { min: p, max: p }).reduce(|a, b| a.union(&b))
    }

    /// The smallest box that holds all `points`; inverted (min = ∞, max = −∞) if there are none. NaN coordinates are
    /// ignored.
    #[inline(always)]
    pub(crate) fn from_corners<R: Float>(points: &[Vector3<R>]) -> Self {
        let mut bounds = Self { min: [f64::INFINITY; 3], max: [f64::NEG_INFINITY; 3] };
        for point in points {
            let point: [R; 3] = (*point).into();
            for k in 0..3 {
                let x = point[k].to_f64();
                bounds.min[k] = if x < bounds.min[k] { x } else { bounds.min[k] };
                bounds.max[k] = if bounds.max[k] < x { x } else { bounds.max[k] };
            }
        }
        bounds
    }

    /// The smallest box that holds both.
    #[inline]
    pub fn union(&self, other: &Self) -> Self {
        Self {
            min: core::array::from_fn(|k| self.min[k].min(other.min[k])),
            max: core::array::from_fn(|k| self.max[k].max(other.max[k])),
        }
    }

    /// The common part; `None` if the boxes are disjoint.
    pub fn intersection(&self, other: &Self) -> Option<Self> {
        let min = core::array::from_fn(|k| self.min[k].max(other.min[k]));
        let max = core::array::from_fn(|k| self.max[k].min(other.max[k]));
        (0..3).all(|k| min[k] <= max[k]).then_some(Self { min, max })
    }

    /// Does the whole of `other` lie in this box?
    #[inline]
    pub fn encloses(&self, other: &Self) -> bool {
        (0..3).all(|k| self.min[k] <= other.min[k] && other.max[k] <= self.max[k])
    }

    /// The box grown by `distance` on all sides, or shrunk if that is negative.
    #[inline]
    pub fn inflate(&self, distance: f64) -> Self {
        Self { min: self.min.map(|x| x - distance), max: self.max.map(|x| x + distance) }
    }

    /// Largest |coordinate| of the corners, infinite ones left out; 0 if all are infinite.
    pub(crate) fn largest_finite_coordinate(&self) -> f64 {
        let finite = self.min.iter().chain(&self.max).map(|x| x.abs()).filter(|x| x.is_finite());
        finite.fold(0.0, f64::max)
    }

    /// Side lengths.
    #[inline]
    pub fn extents(&self) -> [f64; 3] {
        core::array::from_fn(|k| self.max[k] - self.min[k])
    }

    /// The middle.
    pub fn center(&self) -> [f64; 3] {
        [0, 1, 2].map(|axis| 0.5 * self.min[axis] + 0.5 * self.max[axis])
    }

    /// Length of the longest side.
    pub fn longest_side(&self) -> f64 {
        self.extents().into_iter().fold(0.0, f64::max)
    }

    /// Length of the diagonal.
    pub fn diagonal(&self) -> f64 {
        let [x, y, z] = self.extents();
        libm::sqrt(x * x + y * y + z * z)
    }
}
