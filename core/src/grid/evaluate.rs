//! Evaluation of a grid at a point: φ and ∇φ, inside the box and outside.
//!
//! Three kernels, which run lane by lane around one gather of samples:
//!
//! 1. [`Locate`]: clamp the point to the box and find the cell of the clamped point.
//! 2. [`Interpolate`]: trilinear interpolant and its gradient there (`trilinear`).
//! 3. [`Extrapolate`]: only if some lane lies outside the box. With P the clamped point, d = |x − P| and φ = φ(P):
//!
//! ```text
//! φ ≥ 0:  value = √(d² + φ²)     gradient = (x − P)/value + ∇φ‖ · φ/value
//! φ < 0:  value = φ + d          gradient = (x − P)/d + ∇φ‖
//! ```
//!
//! ∇φ‖ is ∇φ(P) without the components along which P does not move with x.

use nalgebra::Vector3;

use super::{Lattice, Storage, trilinear};
use crate::number::kernel::{LaneBundle, LaneKernel, run};
use crate::number::{Float, Gather, Mask, Real};
use crate::vector::norm;
use crate::{Sample, Status};

/// A point's position in the grid, after it was clamped to the box.
#[derive(Clone, Copy)]
struct CellPoint<R: Real> {
    /// Indices of the cell, as numbers.
    cell: Vector3<R>,
    /// Position in the cell, 0 to 1 along each axis.
    fraction: Vector3<R>,
    /// 1 along axes where the point was not clamped, else 0.
    inside: Vector3<R>,
}

/// φ and ∇φ at a point.
#[inline(always)]
pub(super) fn evaluate<R: Real, S: Storage>(lattice: &Lattice, storage: &S, point: Vector3<R>) -> Sample<R> {
    let located = run(&Locate(lattice), point);
    let corners = R::gather(located.cell.into(), &CornerTable(storage));
    let interpolated = run(&Interpolate(lattice), (located.fraction, corners));
    // Most points are inside, and extrapolation costs two square roots and four divisions.
    if (located.inside.x * located.inside.y * located.inside.z).lt(R::one()).any() {
        return run(&Extrapolate(lattice), (point, located, interpolated));
    }
    let ([value], gradient) = interpolated;
    Sample::new(value, gradient)
}

/// The cell in which a point lies; `None` outside the box.
#[inline(always)]
pub(super) fn cell_of<R: Float>(lattice: &Lattice, point: Vector3<R>) -> Option<[u32; 3]> {
    let located = run(&Locate(lattice), point);
    let is_inside = located.inside.x * located.inside.y * located.inside.z >= R::one();
    is_inside.then(|| core::array::from_fn(|axis| located.cell[axis].to_count()))
}

struct Locate<'a>(&'a Lattice);

impl Locate<'_> {
    /// Cell index, fraction and inside flag along one axis.
    #[inline(always)]
    fn locate_axis<R: Real>(&self, axis: usize, x: R) -> [R; 3] {
        let last = R::from_f64(f64::from(self.0.cells()[axis]));
        let (origin, _, inv_spacing) = self.0.in_numbers::<R>();
        let steps = (x - origin[axis]) * inv_spacing;
        let clamped = steps.max_number(R::zero()).min_number(last);
        let cell = clamped.trunc().min_number(last - R::one());
        let inside = R::select(steps.le(clamped) & clamped.le(steps), R::one(), R::zero());
        [cell, clamped - cell, inside]
    }
}

impl LaneKernel for Locate<'_> {
    type From<R: Real> = Vector3<R>;
    type To<R: Real> = CellPoint<R>;

    #[cfg_attr(feature = "std", inline(always))]
    fn apply<R: Real>(&self, point: Vector3<R>) -> CellPoint<R> {
        let [x, y, z] = [self.locate_axis(0, point.x), self.locate_axis(1, point.y), self.locate_axis(2, point.z)];
        let [cell, fraction, inside] = core::array::from_fn(|k| Vector3::new(x[k], y[k], z[k]));
        CellPoint { cell, fraction, inside }
    }
}

/// From the fraction and the corner samples of a cell: φ and ∇φ in world units.
struct Interpolate<'a>(&'a Lattice);

impl LaneKernel for Interpolate<'_> {
    type From<R: Real> = (Vector3<R>, [R; 8]);
    type To<R: Real> = ([R; 1], Vector3<R>);

    #[cfg_attr(feature = "std", inline(always))]
    fn apply<R: Real>(&self, (fraction, corners): Self::From<R>) -> Self::To<R> {
        let (value, by_fraction) = trilinear::interpolate(corners, fraction);
        let (_, _, inv_spacing) = self.0.in_numbers::<R>();
        ([value], by_fraction * inv_spacing)
    }
}

/// From a point, its clamped position and φ and ∇φ there: the sample at the point. The formulas stand in the module
/// header.
struct Extrapolate<'a>(&'a Lattice);

impl LaneKernel for Extrapolate<'_> {
    type From<R: Real> = (Vector3<R>, CellPoint<R>, ([R; 1], Vector3<R>));
    type To<R: Real> = Sample<R>;

    #[cfg_attr(feature = "std", inline(always))]
    fn apply<R: Real>(&self, (point, located, ([value], gradient)): Self::From<R>) -> Sample<R> {
        let CellPoint { cell, fraction, inside } = located;
        let (origin, spacing, _) = self.0.in_numbers::<R>();
        let nearest: Vector3<R> = Vector3::from(origin) + (cell + fraction) * spacing;
        let nearest =
            inside.zip_zip_map(&nearest, &point, |inside, nearest, x| R::select(inside.is_zero(), nearest, x));
        let from_box = point - nearest;
        let distance = norm(from_box);
        let is_outside = R::zero().lt(distance);
        let along_box = gradient.component_mul(&inside);
        let is_nonnegative = R::zero().le(value);
        let hypotenuse = (distance * distance + value * value).sqrt();
        let divisor = R::select(is_outside & is_nonnegative, hypotenuse, R::select(is_outside, distance, R::one()));
        // Not divided by it thrice: a GPU divides zero, which two of three components mostly are, in its slowest way.
        let factor = R::one() / divisor;
        let outside = Sample {
            value: R::select(is_nonnegative, hypotenuse, value + distance),
            gradient: from_box * factor + along_box * R::select(is_nonnegative, value * factor, R::one()),
            status: Status { outside_grid: is_outside, ..Status::GOOD },
        };
        Sample::select(is_outside, outside, Sample::new(value, gradient))
    }
}

/// A storage as a table of corner samples by cell.
struct CornerTable<'a, S>(&'a S);

impl<S: Storage> Gather for CornerTable<'_, S> {
    #[inline(always)]
    fn gather_one(&self, cell: [u32; 3]) -> [f32; 8] {
        self.0.corners(cell)
    }
    #[inline(always)]
    fn gather_lanes<T: Float, const N: usize>(&self, cells: [[T; N]; 3]) -> [[T; N]; 8] {
        self.0.corners_in_lanes(cells)
    }
}

impl<R: Real> LaneBundle<R> for CellPoint<R> {
    type Lane = CellPoint<R::Lane>;
    #[inline(always)]
    fn zero() -> Self {
        let zero: Vector3<R> = LaneBundle::zero();
        Self { cell: zero, fraction: zero, inside: zero }
    }
    #[inline(always)]
    fn lane(&self, lane: usize) -> Self::Lane {
        CellPoint { cell: self.cell.lane(lane), fraction: self.fraction.lane(lane), inside: self.inside.lane(lane) }
    }
    #[inline(always)]
    fn set_lane(&mut self, lane: usize, one: Self::Lane) {
        self.cell.set_lane(lane, one.cell);
        self.fraction.set_lane(lane, one.fraction);
        self.inside.set_lane(lane, one.inside);
    }
}
