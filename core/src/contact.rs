//! From an element of a mesh to its contact with a field.
//!
//! | step | question | file |
//! |---|---|---|
//! | 1 | Can the element come within the margin at all? Bounds in its box, then one evaluation at its centroid | `cull` |
//! | 2 | Where on the element is φ least? | [`minimize`](crate::minimize) |
//! | 3 | Is that within the margin, and on which feature does it lie? | `classify` |
//! | 4 | Which contact stands for a feature that several elements share? | `features` |
//! | | Which elements of a mesh need no look? Clusters of neighbours, culled together | `cluster` |
//! | | Which were so far off in the last frame that they need none in this? | `memory` |
//! | | When does a moving element first touch? | `first_touch` |
//! | | Which few hold a rigid body as all of them do? | `reduce` |
//! | 5 | What does a solver make of it? A constraint between two sides | `row` |
//!
//! [`contact`] does so for one element, [`all_contacts`] reports every isolated minimum of one, [`batch`] takes many elements
//! at a time. Macklin et al. 2020, §3.3 (the cull) and §5.1 (the features).

pub mod batch;
mod classify;
mod cluster;
mod cull;
mod element;
mod features;
mod first_touch;
mod memory;
mod reduce;
mod row;

use nalgebra::Vector3;

pub use classify::{classify, with_error};
use classify::{describe, is_separated, report};
pub(crate) use cluster::sort_along_curve;
pub use cluster::{CLUSTER_SIZE, ClusterKey, Clusters, cluster_count, refit};
pub use cull::{CentroidBound, centroid_bound, cull, lean_cull};
pub use element::{Element, ElementKind, FEATURE_WEIGHT, Feature};
pub use features::{FeatureOwners, FeatureUse, one_per_feature};
pub use first_touch::{FirstTouch, MovingElement, Touch};
pub use memory::{ElementMemory, contact_again, speculative_margin};
pub use reduce::{MAX_REDUCED, Reduced, Reduction};
pub use row::{Row, RowSide, TetPoint};

use crate::EnclosedSdf;
use crate::minimize::{AllMinima, Minimizer, Minimum, SimplexCell};
use crate::number::Float;

/// How far to trust a contact. Where several apply, the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ContactStatus {
    /// The distance is above the margin, but the shape that the field was made from may come within it: the field's error, or a
    /// search that ended early, leaves it open. Only a complete search reports such elements.
    Possible,
    /// The field has no gradient at the point: the normal is a choice, or zero.
    DegenerateGradient,
    /// The point lies outside the grid: the distance is a lower bound.
    OutsideGrid,
    /// The point lies beyond the band of a sparse grid: the distance is coarse, and its error larger than within the band.
    BeyondBand,
    /// The minimizer's budget ended before its own condition was met.
    BudgetSpent,
    /// The minimizer's condition for a minimum holds.
    Converged,
}

/// Stands in [`Contact::vertices`] for a corner that the element does not have.
pub const NO_VERTEX: u32 = u32::MAX;

/// Where an element comes nearest to a surface, or deepest into it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact<R: Float> {
    /// Vertex, edge or face.
    pub kind: ElementKind,
    /// The element's id among those of its kind.
    pub element: u32,
    /// The mesh's vertices at the element's corners; [`NO_VERTEX`] beyond the last one.
    pub vertices: [u32; 3],
    /// Which of the element's minima it is, the lowest 0.
    pub rank: u32,
    /// The part of the element that the point lies on.
    pub feature: Feature,
    /// Barycentric, in the order of the element's vertices; zero beyond its last one.
    pub weights: [R; 3],
    /// The point on the element.
    pub point: Vector3<R>,
    /// Near the surface: point − φ g / |g|², exact for a true distance, else a first step. With s the slope bound, or 1 if that
    /// is less, it is at most 2 |φ| / s from the point: where |g| is less than s/2, as near a medial axis, s/2 stands for it.
    pub surface_point: Vector3<R>,
    /// g / |g|, out of the shape, with g the gradient of [`Sdf::evaluate_smooth`](crate::Sdf::evaluate_smooth), which does not
    /// jump at the faces between a grid's cells. Where |g| is below 1/[`MAX_COORDINATE`](crate::Real::MAX_COORDINATE) or not
    /// finite, ∇φ takes its place, and where that is no better, zero.
    pub normal: Vector3<R>,
    /// |g|, the length of that gradient: near 1 for a distance, near 0 at a medial axis.
    pub slope: R,
    /// φ at the point, negative inside.
    pub distance: R,
    /// Lower bound of φ on the whole element.
    pub lower_bound: R,
    /// Bound of |φ − d| at the point, with d the signed distance to the shape that the field was made from, such as a baked mesh:
    /// see [`EnclosedSdf::error_bound`]. Infinite where nothing is known.
    pub error_bound: R,
    /// Lower bound of d on the whole element.
    pub shape_lower_bound: R,
    /// Evaluations of the field by the search, as its budget counts them; not the cull's.
    pub evaluations: u32,
    /// How far to trust it.
    pub status: ContactStatus,
}

impl<R: Float> Contact<R> {
    /// The weights of the element's own corners: one of a vertex, two of an edge, three of a face.
    pub fn corner_weights(&self) -> &[R] {
        let count = match self.kind {
            ElementKind::Vertex => 1,
            ElementKind::Edge => 2,
            ElementKind::Face => 3,
        };
        self.weights.get(..count).unwrap_or(&self.weights)
    }

    /// The vertices at the element's own corners: one of a vertex, two of an edge, three of a face.
    pub fn corner_vertices(&self) -> &[u32] {
        self.vertices.get(..self.corner_weights().len()).unwrap_or(&self.vertices)
    }

    /// Is there a direction that separates?
    pub(crate) fn has_normal(&self) -> bool {
        R::from_f64(0.5) < self.normal.dot(&self.normal)
    }

    /// The way between point and surface point, along the normal.
    pub(crate) fn gap(&self) -> R {
        self.normal.dot(&(self.point - self.surface_point))
    }

    /// Place among the contacts of a mesh, which files and solvers get in this order.
    pub(crate) fn place(&self) -> (ElementKind, u32, u32) {
        (self.kind, self.element, self.rank)
    }

    /// The lowest bit of the rank in [`key`](Self::key).
    pub const RANK_SHIFT: u32 = 42;

    /// Names the contact among all of its mesh, the same from frame to frame as long as the mesh's connectivity is: bits
    /// 0 to 31 the element's id, 32 to 38 the corners that the feature spans, 40 to 41 the kind, 42 to 63 the rank.
    pub fn key(&self) -> u64 {
        let spanned = element::spanned_corners(self.weights);
        let mask = (0..3).fold(0, |mask, corner| mask | (u64::from(spanned[corner]) << corner));
        u64::from(self.rank) << Self::RANK_SHIFT | (self.kind as u64) << 40 | mask << 32 | u64::from(self.element)
    }
}

/// The result for an element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome<R: Float, const N: usize> {
    /// A corner or the field's answer is NaN or infinite, the margin is NaN, or a corner exceeds
    /// [`MAX_COORDINATE`](crate::Real::MAX_COORDINATE).
    NotFinite,
    /// No point of it can be within the margin: no search was made.
    Culled,
    /// The lowest value found is above the margin. No point is within the margin for certain only if the minimum's lower bound
    /// is above it too: then the search may have stopped early, and the minimum is only the lowest value so far.
    Separated(Minimum<R, N>),
    /// The lowest value found is within the margin.
    Contact(Contact<R>),
}

/// The contact of one element with a field: culled, else minimized, then reported where φ ≤ `margin`.
///
/// An element with a value of at most `margin` anywhere is never culled: neither by the bounds in its box
/// ([`EnclosedSdf::enclose_box`]), nor by [`centroid_bound`] with the slope bound in that box.
pub fn contact<R, F, M, const N: usize>(field: &F, minimizer: &M, margin: R, element: &Element<R, N>) -> Outcome<R, N>
where
    R: Float,
    F: EnclosedSdf,
    M: Minimizer<N>,
{
    let lower_bound = match cull(field, margin, element) {
        Ok(lower_bound) => lower_bound,
        Err(outcome) => return outcome,
    };
    classify(field, margin, element, &minimizer.minimize_below(field, &element.simplex, margin), lower_bound)
}

/// [`contact`] for processors without doubles: no number but of type `R` in it, and less code. Elements are culled by
/// [`centroid_bound`] alone, as in §3.3 of the paper, so that fewer are. The contact has the same bits except for `lower_bound`,
/// which may be lower, and `error_bound` and `shape_lower_bound`, of which nothing is known.
///
/// A grid of a [`Blob`](crate::grid::Blob) and the local methods of [`minimize`](crate::minimize) keep to f32, too.
pub fn lean_contact<R, F, M, const N: usize>(
    field: &F,
    minimizer: &M,
    margin: R,
    element: &Element<R, N>,
) -> Outcome<R, N>
where
    R: Float,
    F: EnclosedSdf,
    M: Minimizer<N>,
{
    let lower_bound = match lean_cull(field, margin, element) {
        Ok(lower_bound) => lower_bound,
        Err(outcome) => return outcome,
    };
    let minimum = minimizer.minimize_below(field, &element.simplex, margin);
    lean_contact_at(field, margin, element, &minimum, lower_bound)
}

/// The second half of [`lean_contact`]: the outcome of an element that [`lean_cull`] leaves, from its minimum and the lower
/// bound there.
pub fn lean_contact_at<R, F, const N: usize>(
    field: &F,
    margin: R,
    element: &Element<R, N>,
    minimum: &Minimum<R, N>,
    lower_bound: R,
) -> Outcome<R, N>
where
    R: Float,
    F: EnclosedSdf,
{
    if is_separated(margin, minimum) {
        return Outcome::Separated(*minimum);
    }
    let is_bounded = lower_bound <= margin;
    let contact = describe(field, element, minimum, lower_bound, 0).filter(|_| is_bounded);
    contact.map_or(Outcome::NotFinite, Outcome::Contact)
}

/// The contact at an element's minimum, whatever its distance; `None` where that is not finite. `lower_bound` is a lower bound of φ
/// on the element, beside the minimum's own.
pub fn contact_at<R, F, const N: usize>(
    field: &F,
    element: &Element<R, N>,
    minimum: &Minimum<R, N>,
    lower_bound: R,
) -> Option<Contact<R>>
where
    R: Float,
    F: EnclosedSdf,
{
    report(field, element, minimum, lower_bound, 0)
}

/// [`contact`] with the certified search of `search`, and a contact for every isolated minimum with φ ≤ `margin`. `visit`
/// gets them from the lowest on; the first is returned.
///
/// `cells` and `minima` are scratch buffers and are overwritten. If a buffer or the budget is exhausted, every contact is
/// [`BudgetSpent`](ContactStatus::BudgetSpent) and some minima may be missing.
pub fn all_contacts<R, F, const N: usize>(
    field: &F,
    search: &AllMinima,
    margin: R,
    element: &Element<R, N>,
    cells: &mut [SimplexCell<R, N>],
    minima: &mut [Minimum<R, N>],
    mut visit: impl FnMut(&Contact<R>),
) -> Outcome<R, N>
where
    R: Float,
    F: EnclosedSdf,
{
    let lower_bound = match cull(field, margin, element) {
        Ok(lower_bound) => lower_bound,
        Err(outcome) => return outcome,
    };
    let found = search.minima(field, &element.simplex, margin, cells, minima);
    if is_separated(margin, &found.global_minimum) && found.count == 0 {
        return Outcome::Separated(found.global_minimum);
    }
    // Given no buffer, the search has found one nevertheless.
    let alone = [Minimum { converged: false, ..found.global_minimum }];
    let minima = if found.count > 0 { minima.get(..found.count).unwrap_or(&alone) } else { &alone };
    let mut contacts =
        minima.iter().zip(0..).filter_map(|(minimum, rank)| report(field, element, minimum, lower_bound, rank));
    let Some(lowest) = contacts.next() else { return Outcome::NotFinite };
    visit(&lowest);
    contacts.for_each(|contact| visit(&contact));
    Outcome::Contact(lowest)
}
