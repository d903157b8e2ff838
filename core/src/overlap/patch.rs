use nalgebra::Vector3;

use super::bounds::Asked;
use super::leaves::Leaves;
use super::polygon::{Extent, Polygon};
use super::{OverlapPoint, Pair};
use crate::number::{Float, Real};
use crate::vector::{from_f64, norm};
use crate::{Aabb, EnclosedSdf};

/// A piece of the surface on which φ_A = φ_B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PatchPoint<R: Real> {
    /// On the middle surface, near the centre of the piece.
    pub at: OverlapPoint<R>,
    /// Of the piece: all of them together make the patch.
    pub area: R,
}

/// All that is known of a patch beside its points.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Patch<R> {
    pub points: u32,
    /// The sum over the points.
    pub area: R,
    /// The edge of a leaf: what was asked for, or more where that was too fine.
    pub resolution: f64,
    /// All of the patch lies in so many leaves. They are more than the points: those beside the surface cannot be told from
    /// those that it passes through by what is certain.
    pub leaves: u32,
    /// The box around those leaves: all of the patch lies in it. `None`: it is certain that there is none.
    pub bounds: Option<Aabb>,
    /// Leaves in which the fields have no number, or the same gradient, so that no surface can be told.
    pub unknown: u32,
    pub evaluations: u32,
    /// False if the budget was spent first: there may be more than all this.
    pub complete: bool,
}

impl<A: EnclosedSdf, B: EnclosedSdf> Pair<'_, A, B> {
    /// The points of the middle surface at which neither φ is above the margin, one from each cube with an edge of
    /// `resolution` that the surface passes through, as far as its linear part in the cube tells. No cube is passed over
    /// that may hold a point of it.
    ///
    /// Both fields are asked at most `evaluations` times, and a few more.
    pub fn patch<R: Float>(&self, resolution: f64, evaluations: u32, mut found: impl FnMut(PatchPoint<R>)) -> Patch<R> {
        let asked = Asked::<R, A, B>::of(self);
        let mut leaves = Leaves::of(&self.region, resolution);
        let mut patch = Patch {
            points: 0,
            area: R::zero(),
            resolution: leaves.edge,
            leaves: 0,
            bounds: None,
            unknown: 0,
            evaluations: 0,
            complete: true,
        };
        while let Some(block) = leaves.next_block() {
            if patch.evaluations >= evaluations {
                patch.complete = false;
                break;
            }
            let look = asked.look(&block.region);
            patch.evaluations = patch.evaluations.saturating_add(u32::from(look.seen.is_some()));
            let Some(seen) = look.seen.filter(|_| look.may_touch() && !look.off_middle) else { continue };
            if !block.is_leaf() {
                leaves.split(&block);
                continue;
            }
            patch.leaves = patch.leaves.saturating_add(1);
            patch.bounds = Some(patch.bounds.map_or(block.region, |bounds| bounds.union(&block.region)));
            let (piece, looks) = asked.piece(&block.region, &seen);
            patch.evaluations = patch.evaluations.saturating_add(looks);
            match piece {
                Passage::Through(point) => {
                    patch.points = patch.points.saturating_add(1);
                    patch.area += point.area;
                    found(point);
                }
                Passage::Beside => {}
                Passage::Unknown => patch.unknown = patch.unknown.saturating_add(1),
            }
        }
        patch
    }
}

/// How the middle surface and a leaf lie.
enum Passage<R: Real> {
    Through(PatchPoint<R>),
    Beside,
    Unknown,
}

/// A surface farther from the middle of a leaf than this, in half diagonals, is not cut with it: linear parts say little there.
const NEAR: f64 = 2.0;

/// A point counts as on the middle surface where φ_A and φ_B differ by no more than this share of a leaf's edge: at an edge
/// of a body that leads out of the leaf there may be none.
const OFF_MIDDLE: f64 = 0.05;

/// A point is looked for more closely where they differ by more than this share of half of a leaf's diagonal.
const ON_MIDDLE: f64 = 1e-3;

/// Leave 2⁻¹² of the segment.
const HALVINGS: u32 = 12;

impl<R: Float, A: EnclosedSdf, B: EnclosedSdf> Asked<'_, R, A, B> {
    /// With how often both fields were asked.
    fn piece(&self, leaf: &Aabb, middle: &OverlapPoint<R>) -> (Passage<R>, u32) {
        let Some(near) = middle.on_middle().filter(|_| middle.is_known()) else { return (Passage::Unknown, 0) };
        let half_diagonal = R::from_f64(0.5 * leaf.diagonal());
        if half_diagonal * R::from_f64(NEAR) < norm(near - middle.point) {
            return (Passage::Beside, 0);
        }
        let near = self.see(near);
        if !near.is_known() || near.on_middle().is_none() {
            return (Passage::Unknown, 1);
        }
        let Some(Extent { area, centroid }) = self.section(leaf, &near) else { return (Passage::Beside, 1) };
        let (at, looks) = self.near_middle(centroid, near.normal * half_diagonal);
        let looks = looks.saturating_add(1);
        let is_on_middle = (at.a.value - at.b.value).abs() <= R::from_f64(OFF_MIDDLE * leaf.longest_side());
        match at.is_known() {
            true if is_on_middle && at.value <= self.margin + self.rounding => {
                (Passage::Through(PatchPoint { at, area }), looks)
            }
            true => (Passage::Beside, looks),
            false => (Passage::Unknown, looks),
        }
    }

    /// By the linear parts, and where those end off the middle surface, at an edge of a body, by halving the segment that
    /// reaches `way` to either side.
    fn near_middle(&self, from: Vector3<R>, way: Vector3<R>) -> (OverlapPoint<R>, u32) {
        let apart = |at: &OverlapPoint<R>| at.a.value - at.b.value;
        let start = self.see(from);
        let step = start.on_middle().map_or(start, |point| self.see(point));
        let best = if apart(&step).abs() < apart(&start).abs() { step } else { start };
        if apart(&best).abs() <= norm(way) * R::from_f64(ON_MIDDLE) {
            return (best, 2);
        }
        let [mut low, mut high] = [from - way, from + way].map(|point| self.see(point));
        let changes = |a: R, b: R| (a < R::zero()) != (b < R::zero());
        if !changes(apart(&low), apart(&high)) {
            return (best, 4);
        }
        for _ in 0..HALVINGS {
            let middle = self.see((low.point + high.point) * R::from_f64(0.5));
            if changes(apart(&low), apart(&middle)) { high = middle } else { low = middle }
        }
        (if apart(&low).abs() < apart(&high).abs() { low } else { high }, 4 + HALVINGS)
    }

    /// What the leaf and the margin leave of the plane φ_A = φ_B, by the linear parts of both at a point near it.
    fn section(&self, leaf: &Aabb, near: &OverlapPoint<R>) -> Option<Extent<R>> {
        let origin = near.on_middle()?;
        let [min, max]: [Vector3<R>; 2] = [from_f64(leaf.min), from_f64(leaf.max)];
        let mut polygon = Polygon::square(near.normal, R::from_f64(4.0 * leaf.diagonal()));
        for unit in [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]] {
            let along = from_f64::<R>(unit);
            polygon = polygon.clip(along, along.dot(&(max - origin))).clip(-along, along.dot(&(origin - min)));
        }
        let half = R::from_f64(0.5);
        let slope = (near.a.gradient + near.b.gradient) * half;
        let value = (near.a.value + near.b.value) * half + slope.dot(&(origin - near.point));
        let Extent { area, centroid } = polygon.clip(slope, self.margin - value).extent()?;
        Some(Extent { area, centroid: origin + centroid })
    }
}
