//! From an element of a mesh to its contact with a field.
//!
//! | step | question | file |
//! |---|---|---|
//! | 1 | Can the element come within the margin at all? Bounds in its box, then one evaluation at its centroid | `cull` |
//! | 2 | Where on the element is φ least? | [`minimize`](crate::minimize) |
//! | 3 | Is that within the margin, and on which feature does it lie? | `classify` |
//!
//! [`contact`] does so for one element, [`all_contacts`] reports every isolated minimum of one, [`batch`] takes many elements
//! at a time. Macklin et al. 2020, §3.3 (the cull) and §5.1 (the features).

pub mod batch;
mod classify;
mod cull;
mod element;

use nalgebra::Vector3;

use classify::{classify, is_separated, report};
use cull::cull;
pub use cull::{CentroidBound, centroid_bound};
pub use element::{Element, ElementKind, FEATURE_WEIGHT, Feature};

use crate::EnclosedSdf;
use crate::minimize::{AllMinima, Minimizer, Minimum, SimplexCell};
use crate::number::Float;

/// How far to trust a contact. Where several apply, the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ContactStatus {
    /// The field has no gradient at the point: the normal is a choice, or zero.
    DegenerateGradient,
    /// The point lies outside the grid: the distance is a lower bound.
    OutsideGrid,
    /// The minimizer's budget ended before its own condition was met.
    BudgetSpent,
    /// The minimizer's condition for a minimum holds.
    Converged,
}

/// Where an element comes nearest to a surface, or deepest into it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact<R: Float> {
    /// Vertex, edge or face.
    pub kind: ElementKind,
    /// The element's id among those of its kind.
    pub element: u32,
    /// Which of the element's minima it is, the lowest 0.
    pub rank: u32,
    /// The part of the element that the point lies on.
    pub feature: Feature,
    /// Barycentric, in the order of the element's vertices; zero beyond its last one.
    pub weights: [R; 3],
    /// The point on the element.
    pub point: Vector3<R>,
    /// Near the surface: point − φ ∇φ / |∇φ|², exact for a true distance, else a first step.
    pub surface_point: Vector3<R>,
    /// ∇φ / |∇φ|, out of the shape; zero where |∇φ| is below 1/[`MAX_COORDINATE`](crate::Real::MAX_COORDINATE) or not finite.
    pub normal: Vector3<R>,
    /// φ at the point, negative inside.
    pub distance: R,
    /// Lower bound of φ on the whole element.
    pub lower_bound: R,
    /// Points at which the field was evaluated, the cull's included.
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

    /// Names the contact among all of its mesh, the same from frame to frame as long as the mesh's connectivity is: bits
    /// 0 to 31 the element's id, 32 to 38 the corners that the feature spans, 40 to 41 the kind, 42 to 63 the rank.
    pub fn key(&self) -> u64 {
        let spanned = element::spanned_corners(self.weights);
        let mask = (0..3).fold(0, |mask, corner| mask | (u64::from(spanned[corner]) << corner));
        u64::from(self.rank) << 42 | (self.kind as u64) << 40 | mask << 32 | u64::from(self.element)
    }
}

/// What became of an element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome<R: Float, const N: usize> {
    /// A corner, the margin or the field's answer is NaN or infinite, or a corner exceeds
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
    classify(margin, element, &minimizer.minimize_below(field, &element.simplex, margin), lower_bound)
}

/// [`contact`] with the certified search of `search`, and a contact for every isolated minimum with φ ≤ `margin`. `visit`
/// gets them from the lowest on; the first is returned.
///
/// `places` and `minima` are scratch buffers and are overwritten. If a buffer or the budget is exhausted, every contact is
/// [`BudgetSpent`](ContactStatus::BudgetSpent) and some minima may be missing.
pub fn all_contacts<R, F, const N: usize>(
    field: &F,
    search: &AllMinima,
    margin: R,
    element: &Element<R, N>,
    places: &mut [SimplexCell<R, N>],
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
    let found = search.minima(field, &element.simplex, margin, places, minima);
    if is_separated(margin, &found.global_minimum) && found.count == 0 {
        return Outcome::Separated(found.global_minimum);
    }
    // Given no buffer, the search has found one nevertheless.
    let alone = [Minimum { converged: false, ..found.global_minimum }];
    let minima = if found.count > 0 { minima.get(..found.count).unwrap_or(&alone) } else { &alone };
    let mut contacts = minima.iter().zip(0..).filter_map(|(minimum, rank)| report(element, minimum, lower_bound, rank));
    let Some(lowest) = contacts.next() else { return Outcome::NotFinite };
    visit(&lowest);
    contacts.for_each(|contact| visit(&contact));
    Outcome::Contact(lowest)
}
