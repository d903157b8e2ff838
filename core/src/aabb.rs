use nalgebra::Vector3;

use crate::number::Float;

/// An axis-aligned box; empty never, unbounded where a coordinate is infinite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    pub min: [f64; 3],
    pub max: [f64; 3],
}

impl Aabb {
    /// The whole space.
    pub const EVERYWHERE: Self = Self { min: [f64::NEG_INFINITY; 3], max: [f64::INFINITY; 3] };

    /// The box around the origin that reaches `half_extents` to either side.
    #[inline]
    pub fn centered(half_extents: [f64; 3]) -> Self {
        Self { min: half_extents.map(|h| -h), max: half_extents }
    }

    /// The smallest box around all `points`; `None` where there are none.
    pub fn around(points: impl IntoIterator<Item = [f64; 3]>) -> Option<Self> {
        points.into_iter().map(|p| Self { min: p, max: p }).reduce(|a, b| a.union(&b))
    }

    /// The smallest box around the points; inverted (min = ∞, max = −∞) where there are none. A NaN is passed over.
    #[inline(always)]
    pub(crate) fn around_corners<R: Float>(points: &[Vector3<R>]) -> Self {
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

    /// The smallest box around both.
    #[inline]
    pub fn union(&self, other: &Self) -> Self {
        Self {
            min: core::array::from_fn(|k| self.min[k].min(other.min[k])),
            max: core::array::from_fn(|k| self.max[k].max(other.max[k])),
        }
    }

    /// The intersection; `None` where it is empty.
    pub fn intersection(&self, other: &Self) -> Option<Self> {
        let min = core::array::from_fn(|k| self.min[k].max(other.min[k]));
        let max = core::array::from_fn(|k| self.max[k].min(other.max[k]));
        (0..3).all(|k| min[k] <= max[k]).then_some(Self { min, max })
    }

    /// Whether all of the other lies in this.
    #[inline]
    pub fn encloses(&self, other: &Self) -> bool {
        let mut axes = core::iter::zip(self.min, other.min).chain(core::iter::zip(other.max, self.max));
        axes.all(|(low, high)| low <= high)
    }

    /// The box moved outward (inward where negative) by `distance` on all sides.
    #[inline]
    pub fn inflate(&self, distance: f64) -> Self {
        Self { min: self.min.map(|x| x - distance), max: self.max.map(|x| x + distance) }
    }

    #[inline]
    pub fn extents(&self) -> [f64; 3] {
        core::array::from_fn(|k| self.max[k] - self.min[k])
    }

    /// The length of the longest side.
    pub fn longest_side(&self) -> f64 {
        self.extents().into_iter().fold(0.0, f64::max)
    }

    /// The length of the diagonal.
    pub fn diagonal(&self) -> f64 {
        let [x, y, z] = self.extents();
        libm::sqrt(x * x + y * y + z * z)
    }
}
