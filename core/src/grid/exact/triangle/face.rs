use nalgebra::Vector3;

use super::separating_planes::SeparatingPlanes;
use crate::grid::Lattice;
use crate::number::{Float, Real};
use crate::rounding::CELL_COORDINATE;

/// A triangle whose box meets more cells is not looked at as a whole: cut in two, most of it is dropped at once.
pub(super) const MAX_CELLS: u32 = 512;

/// A triangle, counted in cells from the grid's first node.
pub(super) struct Face<R: Real> {
    pub corners: [Vector3<R>; 3],
    pub normal: Vector3<R>,
    pub separating_planes: SeparatingPlanes<R>,
    /// Of its box, with what rounding may add.
    pub low: Vector3<R>,
    pub high: Vector3<R>,
    /// The first and the last cells that it meets.
    pub first: [u32; 3],
    pub last: [u32; 3],
}

impl<R: Float> Face<R> {
    #[cfg_attr(feature = "std", inline(always))]
    pub fn new(lattice: &Lattice, corners: [Vector3<R>; 3]) -> Option<Self> {
        let bounds = lattice.bounds();
        let farthest = bounds.min.iter().chain(&bounds.max).fold(0.0, |farthest: f64, x| farthest.max(x.abs()));
        let slack = R::from_f64(CELL_COORDINATE * R::EPSILON * farthest * lattice.inv_spacing());
        let [a, b, c] = corners;
        let low = a.zip_zip_map(&b, &c, |a, b, c| Real::min(a, Real::min(b, c)) - slack);
        let high = a.zip_zip_map(&b, &c, |a, b, c| Real::max(a, Real::max(b, c)) + slack);
        let most = lattice.cells().map(|cells| cells.wrapping_sub(1));
        // Below zero, that is the first one too.
        let cell = |at: Vector3<R>| -> [u32; 3] {
            let at = at.map(|x| Real::max(x, R::zero()).trunc().to_f64() as u32);
            [at.x.min(most[0]), at.y.min(most[1]), at.z.min(most[2])]
        };
        let (first, last) = (cell(low), cell(high));
        let along = |k: usize| last[k % 3].checked_sub(first[k % 3])?.checked_add(1);
        let count = along(0)?.checked_mul(along(1)?)?.checked_mul(along(2)?)?;
        if count > MAX_CELLS {
            return None;
        }
        let (u, v) = (b - a, c - a);
        let normal = u.cross(&v);
        let separating_planes = SeparatingPlanes::new(&corners, normal, slack);
        Some(Self { corners, normal, separating_planes, low, high, first, last })
    }

    /// How many faces of cells, along each axis, may cross it.
    #[inline(always)]
    pub fn planes(&self) -> [u32; 3] {
        let along = |axis: usize| self.last[axis % 3].wrapping_sub(self.first[axis % 3]);
        [along(0), along(1), along(2)]
    }

    /// From the first corner to the others.
    #[inline(always)]
    pub fn sides(&self) -> [Vector3<R>; 2] {
        let [a, b, c] = self.corners;
        [b - a, c - a]
    }

    #[inline(always)]
    pub fn point(&self, weights: [R; 3]) -> Vector3<R> {
        let [u, v] = self.sides();
        self.corners[0] + u * weights[1] + v * weights[2]
    }
}
