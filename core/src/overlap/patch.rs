//! The contact patch: points with areas on the middle surface φ_A = φ_B, where neither φ is above the margin.
//!
//! 1. Visit the cubes (`leaves`) that the bounds of both fields (`bounds`) do not exclude.
//! 2. In each, take the plane on which the tangents of both fields are equal. Clip it to the cube, and to the
//!    half-space in which their mean is at most the margin (`polygon`). This gives area and centroid.
//! 3. Move the centroid to the middle surface: by the tangents, and where those fail, at an edge of a body, by
//!    bisection along the normal.

use nalgebra::Vector3;

use super::bounds::PairQuery;
use super::leaves::Leaves;
use super::polygon::{Extent, Polygon};
use super::{OverlapPoint, Pair};
use crate::number::{Float, Real};
use crate::vector::{from_f64, norm};
use crate::{Aabb, EnclosedSdf};

/// One piece of the patch.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchPoint<R: Real> {
    /// A point of the middle surface, near the centroid of the piece.
    pub point: OverlapPoint<R>,
    /// Area of the piece.
    pub area: R,
}

/// Result of [`Pair::patch`] beside the points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch<R> {
    /// Number of points.
    pub point_count: u32,
    /// Sum of the areas of all pieces.
    pub area: R,
    /// Edge of a cube: the requested one, or a longer one if that was too short.
    pub resolution: f64,
    /// Number of cubes that may meet the patch, which lies in them. They are more than the points: bounds do not
    /// exclude every cube beside the surface.
    pub leaf_count: u32,
    /// Bounding box of those cubes; `None` proves that the patch is empty, if it is complete.
    pub bounds: Option<Aabb>,
    /// Number of cubes in which the fields are not finite or have equal gradients, so that no surface is defined.
    pub undefined_count: u32,
    /// Number of evaluations of both fields.
    pub evaluations: u32,
    /// False if the budget ran out: there may be more.
    pub is_complete: bool,
}

impl<A: EnclosedSdf, B: EnclosedSdf> Pair<'_, A, B> {
    /// Visits the points of the patch. There is one in each cube that the middle surface crosses, judged by the
    /// tangents of both fields in the cube, whose edge is `resolution`. A cube is left out only if it is proven not to
    /// meet the patch.
    ///
    /// Both fields are evaluated at most `evaluations` times, and a few more.
    pub fn patch<R: Float>(&self, resolution: f64, evaluations: u32, mut visit: impl FnMut(PatchPoint<R>)) -> Patch<R> {
        let query = PairQuery::<R, A, B>::new(self);
        let mut leaves = Leaves::new(&self.region, resolution);
        let mut patch = Patch {
            point_count: 0,
            area: R::zero(),
            resolution: leaves.edge,
            leaf_count: 0,
            bounds: None,
            undefined_count: 0,
            evaluations: 0,
            is_complete: true,
        };
        while let Some(block) = leaves.next_block() {
            if patch.evaluations >= evaluations {
                patch.is_complete = false;
                break;
            }
            let bound = query.bound(&block.region);
            patch.evaluations = patch.evaluations.saturating_add(u32::from(bound.center.is_some()));
            let Some(center) = bound.center.filter(|_| bound.may_touch() && !bound.excludes_middle) else { continue };
            if !block.is_leaf() {
                leaves.split(&block);
                continue;
            }
            patch.leaf_count = patch.leaf_count.saturating_add(1);
            patch.bounds = Some(patch.bounds.map_or(block.region, |bounds| bounds.union(&block.region)));
            let (section, evaluations) = query.cube_section(&block.region, &center);
            patch.evaluations = patch.evaluations.saturating_add(evaluations);
            match section {
                CubeSection::Crossed(point) => {
                    patch.point_count = patch.point_count.saturating_add(1);
                    patch.area += point.area;
                    visit(point);
                }
                CubeSection::Empty => {}
                CubeSection::Undefined => patch.undefined_count = patch.undefined_count.saturating_add(1),
            }
        }
        patch
    }
}

/// The part of the patch in a cube.
enum CubeSection<R: Real> {
    Crossed(PatchPoint<R>),
    Empty,
    Undefined,
}

/// A plane farther from the centre of a cube than this, in half diagonals, is not cut with it: tangents are inaccurate
/// there.
const MAX_DISTANCE: f64 = 2.0;

/// A point counts as one of the middle surface if φ_A and φ_B differ by at most this fraction of a cube's edge. Where
/// the surface ends at an edge of a body inside the cube there may be no such point.
const MAX_DIFFERENCE: f64 = 0.05;

/// A point is improved by bisection if φ_A and φ_B differ by more than this fraction of half of a cube's diagonal.
const TARGET_DIFFERENCE: f64 = 1e-3;

/// Bisections, which leave 2⁻¹² of the segment.
const BISECTIONS: u32 = 12;

impl<R: Float, A: EnclosedSdf, B: EnclosedSdf> PairQuery<'_, R, A, B> {
    /// The piece of the patch in a cube, and the number of evaluations.
    fn cube_section(&self, cube: &Aabb, center: &OverlapPoint<R>) -> (CubeSection<R>, u32) {
        let Some(near) = center.middle_point().filter(|_| center.is_finite()) else {
            return (CubeSection::Undefined, 0);
        };
        let half_diagonal = R::from_f64(0.5 * cube.diagonal());
        if half_diagonal * R::from_f64(MAX_DISTANCE) < norm(near - center.point) {
            return (CubeSection::Empty, 0);
        }
        let near = self.evaluate(near);
        if !near.is_finite() || near.middle_point().is_none() {
            return (CubeSection::Undefined, 1);
        }
        let Some(Extent { area, centroid }) = self.plane_section(cube, &near) else { return (CubeSection::Empty, 1) };
        let (point, evaluations) = self.find_middle(centroid, near.normal * half_diagonal);
        let evaluations = evaluations.saturating_add(1);
        let is_on_middle = (point.a.value - point.b.value).abs() <= R::from_f64(MAX_DIFFERENCE * cube.longest_side());
        match point.is_finite() {
            true if is_on_middle && point.value <= self.margin + self.rounding => {
                (CubeSection::Crossed(PatchPoint { point, area }), evaluations)
            }
            true => (CubeSection::Empty, evaluations),
            false => (CubeSection::Undefined, evaluations),
        }
    }

    /// A point of the middle surface near another one, and the number of evaluations: by the tangents, or by bisection
    /// of the segment from `start − half` to `start + half`.
    fn find_middle(&self, start: Vector3<R>, half: Vector3<R>) -> (OverlapPoint<R>, u32) {
        let difference = |point: &OverlapPoint<R>| point.a.value - point.b.value;
        let first = self.evaluate(start);
        let second = first.middle_point().map_or(first, |point| self.evaluate(point));
        let best = if difference(&second).abs() < difference(&first).abs() { second } else { first };
        if difference(&best).abs() <= norm(half) * R::from_f64(TARGET_DIFFERENCE) {
            return (best, 2);
        }
        let [mut low, mut high] = [start - half, start + half].map(|point| self.evaluate(point));
        let changes_sign = |a: R, b: R| (a < R::zero()) != (b < R::zero());
        if !changes_sign(difference(&low), difference(&high)) {
            return (best, 4);
        }
        for _ in 0..BISECTIONS {
            let middle = self.evaluate((low.point + high.point) * R::from_f64(0.5));
            if changes_sign(difference(&low), difference(&middle)) { high = middle } else { low = middle }
        }
        (if difference(&low).abs() < difference(&high).abs() { low } else { high }, 4 + BISECTIONS)
    }

    /// The plane φ_A = φ_B of the tangents at a point near it, cut with the cube and the half-space ½ (φ_A + φ_B) ≤
    /// margin.
    fn plane_section(&self, cube: &Aabb, near: &OverlapPoint<R>) -> Option<Extent<R>> {
        let origin = near.middle_point()?;
        let [min, max]: [Vector3<R>; 2] = [from_f64(cube.min), from_f64(cube.max)];
        let mut polygon = Polygon::square(near.normal, R::from_f64(4.0 * cube.diagonal()));
        for unit in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
            let axis = from_f64::<R>(unit);
            polygon = polygon.clip(axis, axis.dot(&(max - origin))).clip(-axis, axis.dot(&(origin - min)));
        }
        let half = R::from_f64(0.5);
        let gradient = (near.a.gradient + near.b.gradient) * half;
        let value = (near.a.value + near.b.value) * half + gradient.dot(&(origin - near.point));
        let Extent { area, centroid } = polygon.clip(gradient, self.margin - value).extent()?;
        Some(Extent { area, centroid: origin + centroid })
    }
}
