//! Where does an element touch a field in a deformed cage? Its parts in each tetrahedron are mapped to material space, where they
//! are plain segments and triangles, and searched there like any other: the map is affine in each, so that weights stay. What has no
//! φ_m within the margin in its whole tetrahedron is not even cut.
//!
//! The point found goes to the surface in material space, and that point back to the world by the tetrahedron it lies in (McAdams et
//! al. 2011, "Efficient elasticity for character skinning with contact and collisions", §7).

use nalgebra::Vector3;

use super::clip::{Part, share};
use super::{Cage, TetStatus};
use crate::contact::{Contact, ContactStatus, Element, Row, RowSide, TetPoint, contact_at};
use crate::minimize::{Minimizer, Minimum};
use crate::number::Real;
use crate::rounding::{BARYCENTRIC, FieldScale, NESTED_FIELDS, rounding};
use crate::simplex::{max_distance, mean};
use crate::vector::norm;
use crate::{Aabb, EnclosedSdf, ErrorBound, Simplex};

/// The map that an element is searched with.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum CageMap {
    /// One map for all of it, that of the tetrahedron which holds its centroid (§5.3 of the paper): one search. An element whose
    /// centroid is outside of the cage is searched piece by piece; the paper drops it.
    Frozen,
    /// Piece by piece, each by its own tetrahedron.
    #[default]
    Exact,
}

/// A contact with a field in a cage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CageContact {
    /// The contact in the world, but for `distance`, `lower_bound` and the error's bounds, which are those of material space. `slope` is
    /// |Gᵀ ∇φ_m|: distance / slope is the way in the world, to first order.
    pub contact: Contact<f64>,
    /// The point of the cage that carries the contact's surface point.
    pub surface: TetPoint<f64>,
}

impl CageContact {
    /// Distance in the world: along the normal to the surface point, or that of material space where there is no normal.
    pub fn world_distance(&self) -> f64 {
        let Contact { normal, point, surface_point, distance, .. } = self.contact;
        if normal == Vector3::zeros() { distance } else { normal.dot(&(point - surface_point)) }
    }

    /// The row of the contact, its surface carried by the cage. `None` where the contact has no normal.
    pub fn row(&self, thickness: f64) -> Option<Row<f64>> {
        Row::from_contact(&self.contact, thickness).map(|row| row.with_field(RowSide::Tet(self.surface)))
    }
}

/// The result for an element in a cage.
#[derive(Clone, Copy, Debug, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "without an allocator a contact cannot be boxed")]
pub enum CageOutcome {
    /// A corner, the margin or the field's answer is NaN or infinite.
    NotFinite,
    /// No value of at most the margin was found, as far as the element is in the cage.
    Separated,
    /// The lowest value found is within the margin.
    Contact(CageContact),
}

/// The answer for an element, and how much of it was searched.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CageSearch {
    /// The result in good tetrahedra.
    pub outcome: CageOutcome,
    /// Part of the element lies in no good tetrahedron: outside of the cage, where the field is not defined, or in one of
    /// `bad_tets`. A guess where the cage overlaps itself, for parts count where their middles are found. With [`CageMap::Frozen`] of the
    /// centroid alone.
    pub is_uncovered: bool,
    /// Inverted or ill-conditioned tetrahedra near the element, which were passed over.
    pub bad_tets: u32,
}

/// Share of an element that counts as all of it.
const COVERED: f64 = 1.0 - 1e-6;

/// The minimum in one tetrahedron.
struct Found<const N: usize> {
    tet: u32,
    /// Weights of the element at the corners of the part.
    part: [[f64; N]; N],
    material: Element<f64, N>,
    minimum: Minimum<f64, N>,
}

/// Facts of all parts of an element, in material space.
struct AllParts {
    /// Lower bound of φ.
    lower_bound: f64,
    /// The least lower bound of a search that did not converge.
    lowest_spent: f64,
    /// Box around them.
    region: Option<Aabb>,
}

impl AllParts {
    fn add(&mut self, lower_bound: f64, converged: bool, region: &Aabb) {
        self.lower_bound = self.lower_bound.min(lower_bound);
        self.lowest_spent = if converged { self.lowest_spent } else { self.lowest_spent.min(lower_bound) };
        self.region = Some(self.region.map_or(*region, |all| all.union(region)));
    }

    /// A contact of one of the parts, with bounds and status of all.
    fn bound<F: EnclosedSdf>(&self, field: &F, contact: Contact<f64>) -> Contact<f64> {
        let lower_bound = self.lower_bound.min(contact.lower_bound);
        let error = self.region.map_or(ErrorBound::UNKNOWN, |region| field.error_bound(&region));
        let is_spent = contact.status == ContactStatus::Converged && self.lowest_spent < contact.distance;
        let status = if is_spent { ContactStatus::BudgetSpent } else { contact.status };
        Contact { lower_bound, shape_lower_bound: error.lowest_distance(lower_bound), status, ..contact }
    }
}

/// Weights of the middle of a part.
fn part_middle<const N: usize>(part: &[[f64; N]; N]) -> [f64; N] {
    core::array::from_fn(|k| part.iter().map(|corner| corner[k]).sum::<f64>() / N as f64)
}

/// Lower bound of φ on the hull of four points, by the box around them and from the middle.
pub(super) fn lower_bound<F: EnclosedSdf>(field: &F, corners: &[Vector3<f64>; 4]) -> f64 {
    let region = Aabb::from_corners(corners);
    let local = field.enclose_box(&region);
    let middle = mean(corners);
    let (radius, value) = (max_distance(middle, corners), field.value(middle));
    let slack = rounding(FieldScale::new(field), middle, radius, value) * NESTED_FIELDS;
    let from_slope = value - radius * local.slope_bound;
    // `max` passes over NaN.
    local.range.lower.max(from_slope) - slack
}

impl Cage<'_> {
    /// The contact of an element of the world with a field in material space: where φ_d ≤ `margin`, and where on it that is lowest.
    ///
    /// `lower_bounds` are those of [`bound_tets`](super::bound_tets) for this field, or empty. `margin` is a length of material space:
    /// for one of the world, w, take w · the field's slope bound · [`slope_factor`](Self::slope_factor).
    pub fn contact<F: EnclosedSdf, M: Minimizer<N>, const N: usize>(
        &self,
        field: &F,
        minimizer: &M,
        margin: f64,
        element: &Element<f64, N>,
        lower_bounds: &[f64],
        map: CageMap,
    ) -> CageSearch {
        self.contact_within(field, minimizer, [margin, f64::INFINITY], element, lower_bounds, map)
    }

    /// [`contact`](Self::contact) with a margin of material space and one of the world: where [`CageContact::world_distance`] is more than the
    /// latter, the next lowest is taken, of another tetrahedron.
    pub fn contact_within<F: EnclosedSdf, M: Minimizer<N>, const N: usize>(
        &self,
        field: &F,
        minimizer: &M,
        [margin, world_margin]: [f64; 2],
        element: &Element<f64, N>,
        lower_bounds: &[f64],
        map: CageMap,
    ) -> CageSearch {
        if !element.simplex.is_representable() || !margin.is_finite() || !(1..=3).contains(&N) {
            return CageSearch { outcome: CageOutcome::NotFinite, is_uncovered: true, bad_tets: 0 };
        }
        let (mut best, mut is_finite) = (None::<CageContact>, true);
        let mut all = AllParts { lower_bound: f64::INFINITY, lowest_spent: f64::INFINITY, region: None };
        let (mut covered, mut bad_tets) = (0.0, 0_u32);
        let mut search = |tet: u32, part: [[f64; N]; N], all: &mut AllParts| {
            let Some(material) = self.material_part(tet, element, &part) else { return };
            let minimum = minimizer.minimize_below(field, &material.simplex, margin);
            all.add(minimum.lower_bound, minimum.converged, &material.simplex.bounds());
            let value = minimum.sample.value;
            is_finite &= value.is_finite();
            if value > margin || best.is_some_and(|best| best.contact.distance <= value) {
                return;
            }
            match self.report(field, element, &Found { tet, part, material, minimum }) {
                None => is_finite = false,
                Some(found) if found.world_distance() <= world_margin => best = Some(found),
                Some(_) => {}
            }
        };
        let frozen = match map {
            CageMap::Frozen => self.frozen_at(element.simplex.centroid()),
            CageMap::Exact => None,
        };
        if let Some(frozen) = frozen {
            covered = 1.0;
            let whole = core::array::from_fn(|k| core::array::from_fn(|i| if i == k { 1.0 } else { 0.0 }));
            search(frozen.tet(), whole, &mut all);
        } else {
            self.now().visit_near(&element.simplex.bounds(), |tet| {
                if self.status(tet) != TetStatus::Good {
                    bad_tets = bad_tets.saturating_add(1);
                    return;
                }
                let mut weights = [[0.0; 4]; N];
                for (weights, corner) in weights.iter_mut().zip(element.simplex.corners) {
                    let Some(found) = self.now().weights(tet, corner) else { return };
                    *weights = found;
                }
                // A point between tetrahedra lies in both by this much.
                let part = Part::inside(&weights, -BARYCENTRIC);
                let far = lower_bounds.get(tet as usize).copied().filter(|lower| margin < *lower);
                let whole: f64 = part.simplices().map(|simplex| share(&simplex)).sum();
                if let Some((lower, corners)) = far.zip(self.rest().corners(tet)).filter(|_| whole > 0.0) {
                    all.add(lower, true, &Aabb::from_corners(&corners));
                }
                for simplex in part.simplices() {
                    // A part in a face is a part of the neighbour, too, and one where the cage overlaps itself of several: it counts
                    // where its middle is found.
                    let middle = || element.simplex.point(part_middle(&simplex));
                    if whole >= COVERED || self.pull(middle()).is_some_and(|(_, at)| at.tet == tet) {
                        covered += share(&simplex);
                    }
                    if far.is_none() {
                        search(tet, simplex, &mut all);
                    }
                }
            });
        }
        let outcome = match best {
            _ if !is_finite => CageOutcome::NotFinite,
            Some(best) => CageOutcome::Contact(CageContact { contact: all.bound(field, best.contact), ..best }),
            None => CageOutcome::Separated,
        };
        CageSearch { outcome, is_uncovered: covered < COVERED, bad_tets }
    }

    /// A part of an element, as it is in material space.
    fn material_part<const N: usize>(
        &self,
        tet: u32,
        element: &Element<f64, N>,
        part: &[[f64; N]; N],
    ) -> Option<Element<f64, N>> {
        let mut corners = element.simplex.corners;
        for (corner, weights) in corners.iter_mut().zip(part) {
            let weights = self.now().weights(tet, element.simplex.point(*weights))?;
            *corner = self.rest().point(&TetPoint { tet, weights })?;
        }
        Some(Element { simplex: Simplex { corners }, ..*element })
    }

    /// The contact at a minimum in material space, brought to the world.
    fn report<F: EnclosedSdf, const N: usize>(
        &self,
        field: &F,
        element: &Element<f64, N>,
        found: &Found<N>,
    ) -> Option<CageContact> {
        let material = contact_at(field, &found.material, &found.minimum, f64::NEG_INFINITY)?;
        let weights: [f64; N] = core::array::from_fn(|k| {
            let shares = found.part.iter().zip(found.minimum.weights);
            // By rounding a little below zero.
            shares.map(|(corner, weight)| corner[k] * weight).sum::<f64>().max(0.0)
        });
        let mut all_weights = [0.0; 3];
        all_weights.iter_mut().zip(weights).for_each(|(kept, weight)| *kept = weight);
        let point = element.simplex.point(weights);
        let (surface_point, surface) = self.surface(found.tet, material.surface_point)?;
        let gradient = self.jacobian(found.tet)?.tr_mul(&(material.normal * material.slope));
        let slope = norm(gradient);
        let normal = if slope.is_negligible() || !slope.is_finite() { Vector3::zeros() } else { gradient / slope };
        let contact = Contact {
            weights: all_weights,
            feature: element.feature(weights),
            point,
            surface_point,
            normal,
            slope,
            ..material
        };
        Some(CageContact { contact, surface })
    }

    /// The world's point of a point of material space, and who carries it. Outside of the cage at rest the map of `tet` goes on.
    fn surface(&self, tet: u32, material: Vector3<f64>) -> Option<(Vector3<f64>, TetPoint<f64>)> {
        let inside = self.push(material).filter(|(_, at)| self.status(at.tet) == TetStatus::Good);
        inside.or_else(|| {
            let at = TetPoint { tet, weights: self.rest().weights(tet, material)? };
            Some((self.now().point(&at)?, at))
        })
    }
}
