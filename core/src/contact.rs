//! From an element of a mesh to its contact with a field.

pub mod batch;

use nalgebra::Vector3;

use crate::minimize::{AllMinima, Minimizer, Minimum, Place};
use crate::number::{Float, Real};
use crate::rounding::rounding;
use crate::vector::norm;
use crate::{Aabb, EnclosedSdf, Simplex};

/// What a simplex is in its mesh.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ElementKind {
    Vertex,
    Edge,
    Face,
}

impl ElementKind {
    /// The kind of an element with `corners` corners; a tetrahedron is none.
    fn of(corners: usize) -> Option<Self> {
        [Self::Vertex, Self::Edge, Self::Face].get(corners.wrapping_sub(1)).copied()
    }
}

/// A vertex, edge or face of a mesh, `N` corners.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Element<R: Real, const N: usize> {
    /// Counts elements of this kind.
    pub id: u32,
    /// The mesh's vertices at its corners.
    pub vertices: [u32; N],
    pub simplex: Simplex<R, N>,
}

/// The part of an element that a point lies on.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Feature {
    /// A vertex of the mesh.
    Vertex(u32),
    /// An edge, by its vertices, the lower first.
    Edge([u32; 2]),
    /// The inside of a face, by the face's id.
    Face(u32),
}

/// How far to trust a contact. Where several apply, the first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum ContactStatus {
    /// The field has no gradient at the point: the normal is a choice, or zero.
    DegenerateGradient,
    /// The point lies outside the grid: the distance is a lower bound.
    OutsideGrid,
    /// The minimizer stopped before its own condition was met.
    BudgetSpent,
    /// The minimizer's condition for a local minimum holds.
    Converged,
}

/// Where an element comes nearest to a surface, or deepest into it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contact<R: Float, const N: usize> {
    pub kind: ElementKind,
    pub element: u32,
    /// Which of the element's minima it is, the lowest 0.
    pub rank: u32,
    pub feature: Feature,
    /// Barycentric, in the order of the element's vertices.
    pub weights: [R; N],
    /// On the element.
    pub point: Vector3<R>,
    /// Near the surface: the point less φ ∇φ / |∇φ|², exact for a true distance, else a first step.
    pub surface_point: Vector3<R>,
    /// ∇φ / |∇φ|, out of the shape; zero where |∇φ| is below the reciprocal of [`Real::MAX_COORDINATE`] or not finite.
    pub normal: Vector3<R>,
    /// φ at the point, negative inside.
    pub distance: R,
    /// No point of the element is deeper than this.
    pub lower_bound: R,
    /// At how many points the field was asked, the cull included.
    pub evaluations: u32,
    pub status: ContactStatus,
}

impl<R: Float, const N: usize> Contact<R, N> {
    /// Names the contact among all of its mesh, the same from frame to frame as long as the mesh's connectivity is: bits
    /// 0 to 31 the element's id, 32 to 38 the corners that the feature spans, 40 to 41 the kind, 42 to 63 the rank.
    pub fn key(&self) -> u64 {
        let spanned = spanned_corners(self.weights);
        let mask = (0..N).fold(0, |mask, corner| mask | (u64::from(spanned[corner]) << corner));
        u64::from(self.rank) << 42 | (self.kind as u64) << 40 | mask << 32 | u64::from(self.element)
    }
}

/// What became of an element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Outcome<R: Float, const N: usize> {
    /// A corner, the margin or what the field answers is no number, or a corner beyond [`Real::MAX_COORDINATE`].
    NotFinite,
    /// No point of it can be within the margin: no search was made.
    Culled,
    /// The least value found is above the margin. That no other is within it is certain only where the minimum's lower bound
    /// is above the margin too: then the search may have stopped at once, and the minimum is only the least value seen so far.
    Separated(Minimum<R, N>),
    Contact(Contact<R, N>),
}

/// A weight of a corner below which a point counts as lying off it, on the opposite side. Frank-Wolfe never brings a
/// weight to zero, so smaller ones would call its edges faces; larger ones call a point near an edge one on it.
pub const FEATURE_WEIGHT: f64 = 1e-3;

/// The contact of one element with a field: culled, else minimized, then reported where φ ≤ `margin`.
///
/// An element with a value of at most `margin` anywhere is never culled: by what the field knows of the element's box
/// ([`EnclosedSdf::enclose_box`]) before it is asked, then as [`may_touch`] with the slope bound in that box.
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
    judge(margin, element, &minimizer.minimize_below(field, &element.simplex, margin), lower_bound)
}

/// What the least of an element that passed the cull makes of it.
fn judge<R: Float, const N: usize>(
    margin: R,
    element: &Element<R, N>,
    minimum: &Minimum<R, N>,
    lower_bound: R,
) -> Outcome<R, N> {
    if is_apart(margin, minimum) {
        return Outcome::Separated(*minimum);
    }
    report(element, minimum, lower_bound, 0).map_or(Outcome::NotFinite, Outcome::Contact)
}

/// As [`contact`] with the certified search of `search`, but with a contact of every isolated minimum with φ ≤ `margin`,
/// handed to `take` from the lowest on. What is returned is the first of them.
///
/// `places` and `minima` are room for the search, their contents of no account; where it was too small, or the budget, all have
/// the status [`BudgetSpent`](ContactStatus::BudgetSpent), and there may be more.
pub fn all_contacts<R, F, const N: usize>(
    field: &F,
    search: &AllMinima,
    margin: R,
    element: &Element<R, N>,
    places: &mut [Place<R, N>],
    minima: &mut [Minimum<R, N>],
    mut take: impl FnMut(&Contact<R, N>),
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
    if is_apart(margin, &found.least) && found.count == 0 {
        return Outcome::Separated(found.least);
    }
    // Given no room, the search has found one nevertheless.
    let alone = [Minimum { converged: false, ..found.least }];
    let minima = if found.count > 0 { minima.get(..found.count).unwrap_or(&alone) } else { &alone };
    let mut contacts = minima.iter().zip(0..).filter_map(|(minimum, rank)| report(element, minimum, lower_bound, rank));
    let Some(lowest) = contacts.next() else { return Outcome::NotFinite };
    take(&lowest);
    contacts.for_each(|contact| take(&contact));
    Outcome::Contact(lowest)
}

/// What no point of an element is below, or why there is nothing to search.
fn cull<R: Float, F: EnclosedSdf, const N: usize>(
    field: &F,
    margin: R,
    element: &Element<R, N>,
) -> Result<R, Outcome<R, N>> {
    let simplex = &element.simplex;
    if ElementKind::of(N).is_none() || !simplex.is_representable() {
        return Err(Outcome::NotFinite);
    }
    let of_box = bounds_in_box(field, margin, simplex);
    if margin < of_box.least {
        return Err(Outcome::Culled);
    }
    let centroid = simplex.centroid();
    let by_slope = simplex.lower_bound(field.slope_bound(), of_box.slope_bound, centroid, field.value(centroid));
    let lower_bound = Real::max(by_slope, of_box.least);
    if margin.lt(by_slope) {
        return Err(Outcome::Culled);
    }
    // Neither above nor within: one of the two is no number.
    if lower_bound.le(margin) { Ok(lower_bound) } else { Err(Outcome::NotFinite) }
}

/// What is certain of an element by its box alone.
#[derive(Clone, Copy)]
struct BoxBounds<R> {
    /// No value is below it, rounding included.
    least: R,
    slope_bound: R,
}

#[inline(always)]
fn bounds_in_box<R: Float, F: EnclosedSdf, const N: usize>(
    field: &F,
    margin: R,
    simplex: &Simplex<R, N>,
) -> BoxBounds<R> {
    BoxBounds::new(field, &simplex.bounds(), rounding_in_box(field.slope_bound(), margin, simplex))
}

/// More than a value of the field on the element, no larger than the margin in size, may be off by rounding.
#[inline(always)]
fn rounding_in_box<R: Real, const N: usize>(slope_bound: f64, margin: R, simplex: &Simplex<R, N>) -> R {
    let centroid = simplex.centroid();
    rounding(slope_bound, centroid, simplex.max_distance_from(centroid), margin)
}

impl<R: Float> BoxBounds<R> {
    #[inline(always)]
    fn new<F: EnclosedSdf>(field: &F, region: &Aabb, rounding: R) -> Self {
        let local = field.enclose_box(region);
        Self { least: R::from_f64(local.range.lower) - rounding, slope_bound: R::from_f64(local.slope_bound) }
    }
}

/// An infinite value tells nothing.
fn is_apart<R: Float, const N: usize>(margin: R, minimum: &Minimum<R, N>) -> bool {
    margin < minimum.sample.value && minimum.sample.value.is_finite()
}

/// `None` where the value is no number. `lower_bound` holds for all of the element; `rank` counts its minima.
fn report<R: Float, const N: usize>(
    element: &Element<R, N>,
    minimum: &Minimum<R, N>,
    lower_bound: R,
    rank: u32,
) -> Option<Contact<R, N>> {
    let kind = ElementKind::of(N).filter(|_| minimum.sample.value.is_finite())?;
    let gradient = minimum.sample.gradient;
    let length = norm(gradient);
    let way = minimum.sample.value / length;
    // The square of a gradient can over- or underflow where the gradient does not.
    let has_normal = !length.is_negligible() && length.is_finite() && way.is_finite();
    let normal = if has_normal { gradient / length } else { Vector3::zeros() };
    let to_surface = if has_normal { normal * way } else { Vector3::zeros() };
    let status = match () {
        () if minimum.sample.status.degenerate_gradient || !has_normal => ContactStatus::DegenerateGradient,
        () if minimum.sample.status.outside_grid => ContactStatus::OutsideGrid,
        () if !minimum.converged => ContactStatus::BudgetSpent,
        () => ContactStatus::Converged,
    };
    Some(Contact {
        kind,
        element: element.id,
        rank,
        feature: feature(element, minimum.weights),
        weights: minimum.weights,
        point: minimum.point,
        surface_point: minimum.point - to_surface,
        normal,
        distance: minimum.sample.value,
        lower_bound: Real::max(minimum.lower_bound, lower_bound),
        evaluations: (minimum.evaluations.to_f64() as u32).saturating_add(1),
        status,
    })
}

/// What one look at an element's centroid tells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cull<R: Real> {
    /// False only if no point of the element has a value of at most the margin; true where either is no number.
    pub may_touch: R::Mask,
    /// No point of the element has a value below this.
    pub lower_bound: R,
}

/// The honest cull. §3.3 of the paper rejects where φ(centroid) ≥ reach; a contact is made where φ ≤ margin and a field
/// may be steeper than one, so here it takes φ(centroid) > margin + slope bound · reach, rounding included.
///
/// That is the rounding of the element's own coordinates. A field whose numbers are far larger (a small element on a box
/// of a thousand times its size) rounds its values coarser, and a margin below their steps culls what is within them.
#[inline]
pub fn may_touch<R: Real, F: EnclosedSdf, const N: usize>(field: &F, simplex: &Simplex<R, N>, margin: R) -> Cull<R> {
    let centroid = simplex.centroid();
    let lower_bound =
        simplex.lower_bound(field.slope_bound(), R::from_f64(field.slope_bound()), centroid, field.value(centroid));
    Cull { may_touch: !margin.lt(lower_bound), lower_bound }
}

fn spanned_corners<R: Float, const N: usize>(weights: [R; N]) -> [bool; N] {
    weights.map(|weight| R::from_f64(FEATURE_WEIGHT) < weight)
}

fn feature<R: Float, const N: usize>(element: &Element<R, N>, weights: [R; N]) -> Feature {
    let spanned = spanned_corners(weights);
    let mut vertices = element.vertices.iter().zip(spanned).filter(|(_, spanned)| *spanned).map(|(vertex, _)| *vertex);
    match (vertices.next(), vertices.next(), vertices.next()) {
        (Some(vertex), None, _) => Feature::Vertex(vertex),
        (Some(a), Some(b), None) => Feature::Edge([a.min(b), a.max(b)]),
        _ => Feature::Face(element.id),
    }
}
