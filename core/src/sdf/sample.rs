//! The result of an evaluation, [`Sample`]: value, gradient and [`Status`], in one number or in lanes.

use nalgebra::Vector3;

use crate::number::kernel::LaneBundle;
use crate::number::{Mask, Real};
use crate::vector::select;

/// Value, gradient and status of a field at a point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample<R: Real> {
    /// Signed distance: negative inside, zero on the surface, positive outside.
    pub value: R,
    /// The derivative of the value along x, y and z. It points outward and is not normalized.
    pub gradient: Vector3<R>,
    /// Conditions under which value or gradient are not to be trusted.
    pub status: Status<R::Mask>,
}

impl<R: Real> Sample<R> {
    #[inline(always)]
    /// A sample in good status.
    pub fn new(value: R, gradient: Vector3<R>) -> Self {
        Self { value, gradient, status: Status::GOOD }
    }

    /// With a gradient that is a choice where `degenerate` holds.
    #[inline]
    pub fn with_degenerate(value: R, gradient: Vector3<R>, degenerate: R::Mask) -> Self {
        Self { value, gradient, status: Status { degenerate_gradient: degenerate, ..Status::GOOD } }
    }

    #[inline(always)]
    /// In each lane `yes` where the mask holds, else `no`.
    pub fn select(mask: R::Mask, yes: Self, no: Self) -> Self {
        Self {
            value: R::select(mask, yes.value, no.value),
            gradient: select(mask, yes.gradient, no.gradient),
            status: Status::select(mask, yes.status, no.status),
        }
    }

    /// The sample of −φ.
    #[inline]
    pub fn negate(self) -> Self {
        Self { value: -self.value, gradient: -self.gradient, ..self }
    }
}

impl<R: Real> LaneBundle<R> for Sample<R> {
    type Lane = Sample<R::Lane>;
    #[inline(always)]
    fn zero() -> Self {
        Self { value: R::zero(), gradient: LaneBundle::zero(), status: Status::GOOD }
    }
    #[inline(always)]
    fn lane(&self, lane: usize) -> Self::Lane {
        let Status { degenerate_gradient, outside_grid, beyond_band, not_finite } = self.status;
        let status = Status {
            degenerate_gradient: degenerate_gradient.lane(lane),
            outside_grid: outside_grid.lane(lane),
            beyond_band: beyond_band.lane(lane),
            not_finite: not_finite.lane(lane),
        };
        Sample { value: self.value.lane(lane), gradient: self.gradient.lane(lane), status }
    }
    #[inline(always)]
    fn set_lane(&mut self, lane: usize, one: Self::Lane) {
        self.value.set_lane(lane, one.value);
        self.gradient.set_lane(lane, one.gradient);
        let Status { degenerate_gradient, outside_grid, beyond_band, not_finite } = one.status;
        self.status.degenerate_gradient.set_lane(lane, degenerate_gradient);
        self.status.outside_grid.set_lane(lane, outside_grid);
        self.status.beyond_band.set_lane(lane, beyond_band);
        self.status.not_finite.set_lane(lane, not_finite);
    }
}

/// Conditions under which a sample needs care. All are false for an ordinary sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Status<M> {
    /// φ has no derivative here (a centre, an axis, an edge, a medial surface): the gradient is one of its one-sided
    /// limits.
    pub degenerate_gradient: M,
    /// The point lies outside the grid: the value is a lower bound of the distance, not the distance.
    pub outside_grid: M,
    /// The value is as large as the band of a sparse grid or larger: it is coarse, and farther from the truth than the grid's
    /// error bound within the band.
    pub beyond_band: M,
    /// The point was not finite, or beyond [`Real::MAX_COORDINATE`], or the answer was: value and gradient say nothing.
    pub not_finite: M,
}

impl<M: Mask> Status<M> {
    /// No condition holds.
    pub const GOOD: Self =
        Self { degenerate_gradient: M::NONE, outside_grid: M::NONE, beyond_band: M::NONE, not_finite: M::NONE };

    #[inline(always)]
    pub(crate) fn select(mask: M, yes: Self, no: Self) -> Self {
        let pick = |yes: M, no: M| (mask & yes) | (!mask & no);
        Self {
            degenerate_gradient: pick(yes.degenerate_gradient, no.degenerate_gradient),
            outside_grid: pick(yes.outside_grid, no.outside_grid),
            beyond_band: pick(yes.beyond_band, no.beyond_band),
            not_finite: pick(yes.not_finite, no.not_finite),
        }
    }

    /// No condition holds in any lane.
    #[inline(always)]
    pub(crate) fn is_good(self) -> bool {
        !(self.degenerate_gradient | self.outside_grid | self.beyond_band | self.not_finite).any()
    }

    /// The conditions of both.
    #[inline(always)]
    pub fn merge(self, other: Self) -> Self {
        Self {
            degenerate_gradient: self.degenerate_gradient | other.degenerate_gradient,
            outside_grid: self.outside_grid | other.outside_grid,
            beyond_band: self.beyond_band | other.beyond_band,
            not_finite: self.not_finite | other.not_finite,
        }
    }
}
