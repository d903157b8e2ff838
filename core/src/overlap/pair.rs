//! A pair of fields, and the box in which they can touch: the intersection of both fields' bounds at the margin. It shrinks
//! to those cubes of a lattice in which f = max(φ_A, φ_B) may be at most the margin.

use super::bounds::PairQuery;
use super::leaves::Leaves;
use crate::number::{Float, Real};
use crate::rounding::FIELD_BOUNDS;
use crate::{Aabb, EnclosedSdf};

/// Two fields and the margin within which they touch. Outside of `region`, f = max(φ_A, φ_B) is above the margin; the
/// fields are evaluated inside of it alone.
#[derive(Debug)]
pub struct Pair<'a, A, B> {
    pub(super) a: &'a A,
    pub(super) b: &'a B,
    pub(super) margin: f64,
    pub(super) region: Aabb,
}

/// Why a pair has no region to search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NoRegion {
    /// f = max(φ_A, φ_B) is proven to be above the margin everywhere.
    Separated,
    /// Both bodies are unbounded, or the margin is not finite.
    Unbounded,
    /// A bound is beyond [`Real::MAX_COORDINATE`] of f32.
    TooFar,
}

impl core::fmt::Display for NoRegion {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(match self {
            Self::Separated => "the fields are farther apart than the margin",
            Self::Unbounded => "the box in which the fields may touch is unbounded, or the margin is not finite",
            Self::TooFar => "coordinates exceed 1e18 where the fields may touch: scale them down",
        })
    }
}

impl core::error::Error for NoRegion {}

impl<'a, A: EnclosedSdf, B: EnclosedSdf> Pair<'a, A, B> {
    /// `margin` is the largest φ of either field at which they touch; a negative one asks for so much depth in both.
    pub fn new(a: &'a A, b: &'a B, margin: f64) -> Result<Self, NoRegion> {
        Self::within(a, b, margin, &Aabb::EVERYWHERE)
    }

    /// A pair whose search is restricted to a box: nothing is evaluated or found outside, and `Separated` is a statement about the box.
    /// Both fields may be unbounded if the box is not.
    pub fn within(a: &'a A, b: &'a B, margin: f64, limits: &Aabb) -> Result<Self, NoRegion> {
        if !margin.is_finite() {
            return Err(NoRegion::Unbounded);
        }
        let [bounds_a, bounds_b] = [a.bounds(margin), b.bounds(margin)].map(widen);
        let common = bounds_a.intersection(&bounds_b).and_then(|common| common.intersection(limits));
        let region = common.ok_or(NoRegion::Separated)?;
        let farthest = [region.min, region.max].iter().flatten().fold(0.0_f64, |farthest, x| farthest.max(x.abs()));
        if !farthest.is_finite() {
            return Err(NoRegion::Unbounded);
        }
        if farthest <= <f32 as Real>::MAX_COORDINATE {
            Ok(Self { a, b, margin, region })
        } else {
            Err(NoRegion::TooFar)
        }
    }

    /// Restricts the search to a box: nothing is evaluated or found outside.
    pub fn restrict(self, bounds: &Aabb) -> Result<Self, NoRegion> {
        let region = self.region.intersection(bounds).ok_or(NoRegion::Separated)?;
        Ok(Self { region, ..self })
    }

    /// The largest φ of either field at which they touch.
    pub fn margin(&self) -> f64 {
        self.margin
    }

    /// The box to search.
    pub fn region(&self) -> Aabb {
        self.region
    }

    /// Shrinks the region to the bounding box of the cubes in which the fields may touch, `cells` cubes along its
    /// longest side. Both fields are evaluated at the centre of each cube.
    pub fn shrink<R: Float>(&self, cells: u32) -> Result<Self, NoRegion> {
        let query = PairQuery::<R, A, B>::new(self);
        self.shrink_where(cells, |cube| query.bound(cube).may_touch())
    }

    /// [`shrink`](Self::shrink) that evaluates only the fields for which `may_evaluate` is true. A field whose samples
    /// are still to be read is bounded by [`EnclosedSdf::enclose_box`] alone.
    pub fn shrink_evaluating(&self, cells: u32, may_evaluate: [bool; 2]) -> Result<Self, NoRegion> {
        let query = PairQuery::<f64, A, B>::evaluating(self, may_evaluate);
        self.shrink_where(cells, |cube| query.may_touch_by_slope(cube, may_evaluate))
    }

    fn shrink_where(&self, cells: u32, may_touch: impl Fn(&Aabb) -> bool) -> Result<Self, NoRegion> {
        let mut leaves = Leaves::new(&self.region, self.region.longest_side() / f64::from(cells.max(1)));
        let mut bounds: Option<Aabb> = None;
        while let Some(block) = leaves.next_block() {
            let is_enclosed = bounds.is_some_and(|bounds| bounds.encloses(&block.region));
            if is_enclosed || !may_touch(&block.region) {
                continue;
            }
            if block.is_leaf() {
                bounds = Some(bounds.map_or(block.region, |bounds| bounds.union(&block.region)));
            } else {
                leaves.split(&block);
            }
        }
        bounds.map(|region| Self { a: self.a, b: self.b, margin: self.margin, region }).ok_or(NoRegion::Separated)
    }
}

/// The box with its rounding.
fn widen(bounds: Aabb) -> Aabb {
    let coordinates = [bounds.min, bounds.max];
    let largest = coordinates.iter().flatten().filter(|x| x.is_finite()).fold(0.0_f64, |max, x| max.max(x.abs()));
    bounds.inflate(largest * FIELD_BOUNDS * f64::EPSILON)
}
