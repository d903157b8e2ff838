//! Which contacts stand for the features of a mesh? Neighbouring faces that touch with the edge or vertex they share report it
//! each; one contact is enough.
//!
//! Macklin et al. 2020, §5.1, assigns every vertex and edge to one face beforehand (Curtis et al. 2008) and drops contacts on
//! features that are not the face's own. So a feature can lose all of its contacts: its owner's search may end on another one. Here
//! a feature that is touched always keeps a contact: its owner's if there is one, else the deepest.

use core::cmp::Ordering;

use super::{Contact, ElementKind, Feature, NO_VERTEX};
use crate::number::Float;

/// Moves one contact of every touched feature to the front, in the order of elements, and returns how many there are: the
/// deepest, of equal ones that of the first element. The rest of the slice holds the others, in unspecified order.
///
/// The choice does not depend on the order of the contacts. A feature with several minima keeps one of them.
///
/// ```
/// use sdf_core::contact::{Contact, Element, Outcome, contact, one_per_feature};
/// use sdf_core::{Simplex, minimize::FrankWolfe, nalgebra::Vector3, shapes::Sphere};
/// // Two faces that rest on a sphere with their common edge.
/// let corner = |x: f64, y, z| Vector3::new(x, y, z);
/// let (a, b) = (corner(-1.0, 0.0, 1.0), corner(1.0, 0.0, 1.0));
/// let mut contacts: Vec<Contact<f64>> = [(1.0, 2), (-1.0, 3)].into_iter().zip(0..).filter_map(|((y, third), id)| {
///     let element = Element { id, vertices: [0, 1, third], simplex: Simplex { corners: [a, b, corner(0.0, y, 2.0)] } };
///     match contact(&Sphere::new(1.0).unwrap(), &FrankWolfe::default(), 0.1, &element) {
///         Outcome::Contact(contact) => Some(contact),
///         _ => None,
///     }
/// }).collect();
/// assert_eq!((contacts.len(), one_per_feature(&mut contacts)), (2, 1));
/// ```
pub fn one_per_feature<R: Float>(contacts: &mut [Contact<R>]) -> usize {
    keep_first_of_each_feature(contacts, |_| false)
}

/// Which face speaks for each vertex and edge: the first face that has it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeatureOwners<'a> {
    /// One byte for each face: bits 0 to 2 for its vertices, bits 3 to 5 for its edges, each in the place of the vertex opposite.
    bits: &'a [u8],
}

/// Scratch space of [`FeatureOwners::assign`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct FeatureUse {
    feature: [u32; 2],
    face: u32,
    bit: u8,
}

/// Vertices and edges of a face.
const FEATURES: usize = 6;

impl<'a> FeatureOwners<'a> {
    /// Writes one byte for each face into `bits`. `scratch` is overwritten. `None` unless `bits` has as many entries as there are
    /// faces, and `scratch` six times as many.
    pub fn assign(faces: &[[u32; 3]], scratch: &mut [FeatureUse], bits: &'a mut [u8]) -> Option<Self> {
        if bits.len() != faces.len() || Some(scratch.len()) != faces.len().checked_mul(FEATURES) {
            return None;
        }
        for ((uses, [a, b, c]), face) in scratch.chunks_exact_mut(FEATURES).zip(faces).zip(0..) {
            let features =
                [[*a, NO_VERTEX], [*b, NO_VERTEX], [*c, NO_VERTEX], edge(*b, *c), edge(*c, *a), edge(*a, *b)];
            for ((entry, feature), bit) in uses.iter_mut().zip(features).zip(0..) {
                *entry = FeatureUse { feature, face, bit };
            }
        }
        scratch.sort_unstable();
        bits.fill(0);
        let mut last = None;
        for FeatureUse { feature, face, bit } in scratch.iter() {
            if last != Some(*feature)
                && let Some(bits) = bits.get_mut(*face as usize)
            {
                *bits |= 1 << bit;
            }
            last = Some(*feature);
        }
        Some(Self { bits })
    }

    /// The owners that [`assign`](Self::assign) wrote once and the caller kept: they hold as long as the faces do.
    pub fn from_bits(bits: &'a [u8]) -> Self {
        Self { bits }
    }

    /// One byte for each face: bits 0 to 2 tell which of its vertices it owns, bits 3 to 5 which of its edges, each in the place of
    /// the vertex opposite.
    pub fn bits(&self) -> &[u8] {
        self.bits
    }

    /// Does the contact's element own the feature that it lies on? Every face owns its inside. Of other elements than faces: no.
    pub fn owns<R: Float>(&self, contact: &Contact<R>) -> bool {
        let Some(bits) = self.bits.get(contact.element as usize) else { return false };
        let corner = |is_wanted: &dyn Fn(u32) -> bool| contact.vertices.iter().position(|vertex| is_wanted(*vertex));
        let bit = match contact.feature {
            _ if contact.kind != ElementKind::Face => None,
            Feature::Face(_) => return true,
            Feature::Vertex(vertex) => corner(&|other| other == vertex),
            Feature::Edge([a, b]) => corner(&|other| other != a && other != b).map(|opposite| opposite + 3),
        };
        bit.is_some_and(|bit| bits >> bit & 1 == 1)
    }

    /// [`one_per_feature`], but a contact of the feature's owner comes before deeper ones. So the same face speaks for a feature
    /// from frame to frame, as long as it touches with it.
    pub fn one_per_feature<R: Float>(&self, contacts: &mut [Contact<R>]) -> usize {
        keep_first_of_each_feature(contacts, |contact| self.owns(contact))
    }
}

fn edge(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

fn keep_first_of_each_feature<R: Float>(contacts: &mut [Contact<R>], is_owned: impl Fn(&Contact<R>) -> bool) -> usize {
    contacts.sort_unstable_by(|a, b| {
        let by_owner = is_owned(b).cmp(&is_owned(a));
        let by_distance = a.distance.partial_cmp(&b.distance).unwrap_or(Ordering::Equal);
        a.feature.cmp(&b.feature).then(by_owner).then(by_distance).then_with(|| a.place().cmp(&b.place()))
    });
    let mut count = 0;
    let mut last = None;
    for index in 0..contacts.len() {
        let Some(feature) = contacts.get(index).map(|contact| contact.feature) else { break };
        if last != Some(feature) {
            last = Some(feature);
            contacts.swap(count, index);
            count += 1;
        }
    }
    if let Some(kept) = contacts.get_mut(..count) {
        kept.sort_unstable_by_key(Contact::place);
    }
    count
}
