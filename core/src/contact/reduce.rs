//! Which few contacts hold a rigid body as all of them do? A proven answer: [`Reduction`].
//!
//! A small motion of the body, v at a point c and ω about it, changes the gap of a contact with point p and normal n by
//!
//! ```text
//! row · (v, ω)        row = (n, (p − c) × n), the wrench of a push at the contact
//! ```
//!
//! Let those kept be held: gap_j + row_j · (v, ω) ≥ 0. If row_i = Σ λ_j row_j + r with λ_j ≥ 0, the gap of another contact is then
//!
//! ```text
//! gap_i + row_i · (v, ω) ≥ gap_i − Σ λ_j gap_j + r · (v, ω)
//! ```
//!
//! How far that can be below zero is its shortfall.
//!
//! | step | question | file |
//! |---|---|---|
//! | 1 | The deepest contact is kept. How far is each other one, its row and gap, from all such sums? Non-negative least squares | `cone` |
//! | 2 | The farthest is kept, and so on | here |
//! | 3 | What is the largest shortfall? | here |
//!
//! A distance only falls as others are kept. So most are not asked again in step 2.

mod cone;

use nalgebra::Vector3;

use super::Contact;
use crate::number::{Float, Real};
use crate::vector::norm;
use cone::{Cone, WrenchRow};

/// Most contacts that a reduction keeps.
pub const MAX_REDUCED: usize = 64;

/// No more contacts are kept once the rows of all others are within this of sums of those kept. A row counts shifts, turns at the arm L, and gaps
/// in movements.
const ENOUGH: f64 = 0.01;

/// Few contacts of a rigid body in place of many.
///
/// ```
/// use sdf_core::contact::{Contact, Element, Outcome, Reduction, contact};
/// use sdf_core::{Simplex, minimize::FrankWolfe, nalgebra::Vector3, shapes::HalfSpace};
/// // The bottom of a box, cut into 100 vertices, rests on the ground.
/// let ground = HalfSpace::new([0.0, 0.0, 1.0], 0.0).unwrap();
/// let vertex = |id: u32| Vector3::new(f64::from(id % 10), f64::from(id / 10), 0.0);
/// let mut contacts: Vec<Contact<f64>> = (0..100).filter_map(|id| {
///     let element = Element { id, vertices: [id], simplex: Simplex { corners: [vertex(id)] } };
///     match contact(&ground, &FrankWolfe::default(), 0.01, &element) {
///         Outcome::Contact(contact) => Some(contact),
///         _ => None,
///     }
/// }).collect();
/// let reduced = Reduction { count: 16, movement: 0.01, thickness: 0.0 }.apply(&mut contacts, &mut [0.0; 100]).unwrap();
/// // Its four corners hold it.
/// assert_eq!((reduced.count, reduced.shortfall < 1e-12), (4, true));
/// assert_eq!(contacts[..4].iter().map(|contact| contact.element).collect::<Vec<_>>(), [0, 9, 90, 99]);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reduction<R> {
    /// Most contacts that are kept: 1 to [`MAX_REDUCED`].
    pub count: usize,
    /// How far the body moves until its contacts are found again: |v| + |ω| · L, with v the way of the center of the box around all
    /// contacts' points, ω the turn in radians, and L half of the box's diagonal. No contact's point moves farther.
    pub movement: R,
    /// The distance from the surface at which a solver holds those that are kept.
    pub thickness: R,
}

/// Result of a reduction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reduced<R> {
    /// The contacts that are kept.
    pub count: usize,
    /// Where these are held, no other with a normal comes nearer to the surface than the thickness by more than this, to first order in the
    /// turn.
    pub shortfall: R,
}

impl<R: Float> Reduction<R> {
    /// Moves the contacts that are kept to the front, in the order of elements. The rest of the slice holds the others, in unspecified
    /// order. The deepest is kept.
    ///
    /// The choice does not depend on the order of the contacts. A contact without a normal holds nothing and is not kept. `scratch`
    /// is overwritten.
    ///
    /// `None` if `scratch` has another length than `contacts`, the count is not from 1 to [`MAX_REDUCED`], the movement is not positive
    /// and finite, or a gap over the movement is not finite.
    pub fn apply(&self, contacts: &mut [Contact<R>], scratch: &mut [R]) -> Option<Reduced<R>> {
        let is_positive = R::zero() < self.movement && self.movement.is_finite();
        if !is_positive || !(1..=MAX_REDUCED).contains(&self.count) || contacts.len() != scratch.len() {
            return None;
        }
        contacts.sort_unstable_by_key(Contact::place);
        let wrenches = Wrenches::new(contacts, self);
        for (contact, distance) in contacts.iter().zip(scratch.iter_mut()) {
            // Before any is kept, none is near.
            *distance = if contact.has_normal() { R::from_f64(f64::INFINITY) } else { R::zero() };
            if !wrenches.row(contact).iter().all(|x| x.is_finite()) {
                return None;
            }
        }
        let mut cone = Cone::new();
        let mut worst = Worst { index: deepest(contacts), distance: R::zero() };
        while let Some(index) = worst.index
            && let (Some(contact), Some(distance)) = (contacts.get(index), scratch.get_mut(index))
        {
            cone.add(wrenches.row(contact));
            *distance = R::from_f64(KEPT);
            worst = Worst::of(&cone, &wrenches, contacts, scratch);
            if cone.count() == self.count || worst.distance <= R::from_f64(ENOUGH) {
                break;
            }
        }
        let mut shortfall = R::zero();
        for (contact, distance) in contacts.iter().zip(scratch.iter()) {
            // A rest has a shortfall of 1/√2 to √2 times its length: that of the shortest is at most twice the least of all.
            if shortfall < *distance * R::from_f64(core::f64::consts::SQRT_2) {
                shortfall = Real::max(shortfall, cone.shortfall(&wrenches.row(contact), shortfall));
            }
        }
        let mut count = 0;
        for (index, distance) in scratch.iter().enumerate() {
            if *distance < R::zero() {
                contacts.swap(count, index);
                count += 1;
            }
        }
        Some(Reduced { count, shortfall: shortfall * self.movement })
    }
}

/// Stands in place of the distance of those that are kept.
const KEPT: f64 = -1.0;

/// The first of the deepest.
fn deepest<R: Float>(contacts: &[Contact<R>]) -> Option<usize> {
    let mut lowest: Option<(usize, R)> = None;
    for (index, contact) in contacts.iter().enumerate().filter(|(_, contact)| contact.has_normal()) {
        if lowest.is_none_or(|(_, distance)| contact.distance < distance) {
            lowest = Some((index, contact.distance));
        }
    }
    lowest.map(|(index, _)| index)
}

/// The contact whose row is farthest from the cone, and how far.
struct Worst<R> {
    index: Option<usize>,
    distance: R,
}

impl<R: Float> Worst<R> {
    /// Asks those anew that were farther away than the worst so far, when they were last asked. The first is the one that was farthest
    /// away: then few others are.
    fn of(cone: &Cone<R>, wrenches: &Wrenches<R>, contacts: &[Contact<R>], scratch: &mut [R]) -> Self {
        let mut farthest = (0, R::zero());
        for (index, distance) in scratch.iter().enumerate() {
            if farthest.1 < *distance {
                farthest = (index, *distance);
            }
        }
        let mut worst = Self { index: None, distance: R::zero() };
        let first = farthest.0..farthest.0 + 1;
        for index in first.chain(0..contacts.len()) {
            if let (Some(contact), Some(distance)) = (contacts.get(index), scratch.get_mut(index))
                && worst.distance < *distance
            {
                *distance = Real::min(*distance, cone.distance(&wrenches.row(contact), worst.distance));
                if worst.distance < *distance {
                    worst = Self { index: Some(index), distance: *distance };
                }
            }
        }
        worst
    }
}

/// How contacts become rows without units.
struct Wrenches<R: Float> {
    center: Vector3<R>,
    /// L; 1 where all points are one.
    arm: R,
    movement: R,
    thickness: R,
}

impl<R: Float> Wrenches<R> {
    fn new(contacts: &[Contact<R>], reduction: &Reduction<R>) -> Self {
        let infinity = R::from_f64(f64::INFINITY);
        let (mut min, mut max) = (Vector3::repeat(infinity), Vector3::repeat(-infinity));
        for contact in contacts {
            min = min.zip_map(&contact.point, Real::min);
            max = max.zip_map(&contact.point, Real::max);
        }
        let half = (max - min) * R::from_f64(0.5);
        // Squares of small lengths have no digits.
        let longest = half.x.max(half.y).max(half.z);
        let arm = if R::zero() < longest { norm(half / longest) * longest } else { R::one() };
        let Reduction { movement, thickness, .. } = *reduction;
        Self { center: min + half, arm, movement, thickness }
    }

    /// n, (p − c)/L × n, and the gap in movements.
    fn row(&self, contact: &Contact<R>) -> WrenchRow<R> {
        let normal = contact.normal;
        let turn = ((contact.point - self.center) / self.arm).cross(&normal);
        let gap = contact.gap() - self.thickness;
        [normal.x, normal.y, normal.z, turn.x, turn.y, turn.z, gap / self.movement]
    }
}
