//! How do millions of contacts fit into memory? As rows of 32-bit words, without what other fields already tell.
//!
//! A row takes 96 to 164 bytes, about 130 as a rule, where [`Contact`] takes 176. Nothing is lost, not a bit:
//!
//! | field | left out where |
//! |---|---|
//! | a weight | it is +0 |
//! | lower bound | it is the distance |
//! | surface point | it is point − normal · distance / max(slope, ½), to the bit |
//! | lower bound of the shape | it is lower bound − error bound, to the bit |
//! | feature, rank | the feature spans corners of the element; the rank is 0 |

use sdf_core::contact::{Contact, ContactStatus, ElementKind, Feature};
use sdf_core::nalgebra::Vector3;

use super::Label;

/// Words of a block of rows: 256 KiB, so that a list that grows is never copied.
const BLOCK: usize = 1 << 16;

/// Words of the longest row.
const MAX_ROW: usize = 42;

/// Bits of a row's first word. Bits 0 to 1 are the kind, 2 to 4 the status, 5 to 7 the weights that follow.
const KIND_BITS: u32 = 0;
const STATUS_BITS: u32 = 2;
const WEIGHT_BITS: u32 = 5;
const HAS_LOWER_BOUND: u32 = 1 << 8;
const HAS_SURFACE_POINT: u32 = 1 << 9;
const HAS_SHAPE_LOWER_BOUND: u32 = 1 << 10;
const HAS_RANK: u32 = 1 << 11;
/// Bits 12 to 13: the corners of the feature, 3 for a face; 14 to 17: their places among the element's vertices.
const FEATURE_BITS: u32 = 12;
const PLACE_BITS: u32 = 14;

/// Contacts in the order in which they were pushed, in about 130 bytes each.
///
/// ```
/// use sdf_core::{Simplex, contact::{Element, Outcome, contact}, minimize::FrankWolfe, nalgebra::Vector3, shapes::Sphere};
/// use sdf_formats::contact_file::ContactRows;
/// let simplex = Simplex { corners: [[0.0, 0.0, 0.9], [1.0, 0.0, 2.0], [0.0, 1.0, 2.0]].map(Vector3::from) };
/// let element = Element { id: 0, vertices: [0, 1, 2], simplex };
/// let outcome = contact(&Sphere::new(1.0).unwrap(), &FrankWolfe::default(), 0.0, &element);
/// let Outcome::Contact(contact) = outcome else { panic!() };
/// let mut rows = ContactRows::default();
/// rows.push(&contact);
/// assert_eq!(rows.iter().next(), Some(contact));
/// ```
#[derive(Clone, Debug, Default)]
pub struct ContactRows {
    blocks: Vec<Vec<u32>>,
    count: usize,
}

impl ContactRows {
    /// Number of contacts.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Is there no contact?
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Memory that the rows take, in bytes.
    pub fn bytes(&self) -> usize {
        self.blocks.iter().map(|block| block.capacity() * size_of::<u32>()).sum()
    }

    /// Appends a contact. Its feature must span corners of its own element, as those of the core do.
    pub fn push(&mut self, contact: &Contact<f64>) {
        let capacity = self.blocks.last().map_or(0, Vec::capacity);
        let is_full = self.blocks.last().is_none_or(|block| block.len() + MAX_ROW > capacity);
        if is_full && (1..BLOCK).contains(&capacity) {
            // A short list takes little, a long one grows block by block.
            self.blocks.iter_mut().for_each(|block| block.reserve_exact(capacity));
        } else if is_full {
            self.blocks.push(Vec::with_capacity(if capacity == 0 { BLOCK / 64 } else { BLOCK }));
        }
        if let Some(block) = self.blocks.last_mut() {
            push(block, contact);
            self.count += 1;
        }
    }

    /// The contacts, as they were pushed.
    pub fn iter(&self) -> ContactRowsIter<'_> {
        ContactRowsIter { blocks: &self.blocks, word: 0, left: self.count }
    }
}

impl<'a> IntoIterator for &'a ContactRows {
    type Item = Contact<f64>;
    type IntoIter = ContactRowsIter<'a>;

    fn into_iter(self) -> ContactRowsIter<'a> {
        self.iter()
    }
}

/// The contacts of [`ContactRows`].
#[derive(Clone, Debug)]
pub struct ContactRowsIter<'a> {
    blocks: &'a [Vec<u32>],
    word: usize,
    left: usize,
}

impl Iterator for ContactRowsIter<'_> {
    type Item = Contact<f64>;

    fn next(&mut self) -> Option<Contact<f64>> {
        while self.word == self.blocks.first()?.len() {
            (self.blocks, self.word) = (&self.blocks[1..], 0);
        }
        let mut words = Words(&self.blocks[0][self.word..]);
        let contact = words.contact();
        self.word = self.blocks[0].len() - words.0.len();
        self.left -= 1;
        Some(contact)
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        (self.left, Some(self.left))
    }
}

impl ExactSizeIterator for ContactRowsIter<'_> {}

fn push(block: &mut Vec<u32>, contact: &Contact<f64>) {
    let head = block.len();
    block.push(0);
    block.extend([contact.element, contact.evaluations]);
    block.extend(contact.corner_vertices());
    let mut number = |number: f64| block.extend([number.to_bits() as u32, (number.to_bits() >> 32) as u32]);
    let mut bits = u32::from(contact.kind.code()) << KIND_BITS | u32::from(contact.status.code()) << STATUS_BITS;
    for (corner, weight) in contact.weights.into_iter().enumerate().filter(|(_, weight)| weight.to_bits() != 0) {
        bits |= 1 << (WEIGHT_BITS + corner as u32);
        number(weight);
    }
    contact.point.iter().chain(&contact.normal).for_each(|x| number(*x));
    [contact.slope, contact.distance, contact.error_bound].into_iter().for_each(&mut number);
    if contact.lower_bound.to_bits() != contact.distance.to_bits() {
        bits |= HAS_LOWER_BOUND;
        number(contact.lower_bound);
    }
    if !is_same(contact.surface_point, likely_surface_point(contact)) {
        bits |= HAS_SURFACE_POINT;
        contact.surface_point.iter().for_each(|x| number(*x));
    }
    if contact.shape_lower_bound.to_bits() != (contact.lower_bound - contact.error_bound).to_bits() {
        bits |= HAS_SHAPE_LOWER_BOUND;
        number(contact.shape_lower_bound);
    }
    if contact.rank != 0 {
        bits |= HAS_RANK;
        block.push(contact.rank);
    }
    let place = |vertex: u32| contact.vertices.iter().position(|other| *other == vertex).unwrap_or(0) as u32;
    let (corners, places) = match contact.feature {
        Feature::Vertex(vertex) => (1, place(vertex)),
        Feature::Edge([a, b]) => (2, place(a) | place(b) << 2),
        Feature::Face(_) => (3, 0),
    };
    block[head] = bits | corners << FEATURE_BITS | places << PLACE_BITS;
}

/// The rest of a block, from a row on.
struct Words<'a>(&'a [u32]);

impl Words<'_> {
    fn word(&mut self) -> u32 {
        let (word, rest) = self.0.split_first().map_or((0, self.0), |(word, rest)| (*word, rest));
        self.0 = rest;
        word
    }

    fn number(&mut self) -> f64 {
        let [low, high] = [self.word(), self.word()].map(u64::from);
        f64::from_bits(low | high << 32)
    }

    fn vector(&mut self) -> Vector3<f64> {
        let [x, y, z] = [self.number(), self.number(), self.number()];
        Vector3::new(x, y, z)
    }

    fn contact(&mut self) -> Contact<f64> {
        let bits = self.word();
        let kind = ElementKind::ALL[(bits >> KIND_BITS & 3) as usize % ElementKind::ALL.len()];
        let [element, evaluations] = [self.word(), self.word()];
        let mut vertices = [sdf_core::contact::NO_VERTEX; 3];
        vertices.iter_mut().take(usize::from(kind.code()) + 1).for_each(|vertex| *vertex = self.word());
        let weights = [0, 1, 2].map(|corner| if bits >> (WEIGHT_BITS + corner) & 1 == 1 { self.number() } else { 0.0 });
        let [point, normal] = [self.vector(), self.vector()];
        let [slope, distance, error_bound] = [self.number(), self.number(), self.number()];
        let place = |index: u32| vertices[(bits >> (PLACE_BITS + 2 * index) & 3) as usize % 3];
        let feature = match bits >> FEATURE_BITS & 3 {
            1 => Feature::Vertex(place(0)),
            2 => Feature::Edge([place(0), place(1)]),
            _ => Feature::Face(element),
        };
        let status = ContactStatus::ALL[(bits >> STATUS_BITS & 7) as usize % ContactStatus::ALL.len()];
        let lower_bound = if bits & HAS_LOWER_BOUND != 0 { self.number() } else { distance };
        let mut contact = Contact {
            kind,
            element,
            vertices,
            rank: 0,
            feature,
            weights,
            point,
            surface_point: point,
            normal,
            slope,
            distance,
            lower_bound,
            error_bound,
            shape_lower_bound: lower_bound - error_bound,
            evaluations,
            status,
        };
        contact.surface_point =
            if bits & HAS_SURFACE_POINT != 0 { self.vector() } else { likely_surface_point(&contact) };
        if bits & HAS_SHAPE_LOWER_BOUND != 0 {
            contact.shape_lower_bound = self.number();
        }
        if bits & HAS_RANK != 0 {
            contact.rank = self.word();
        }
        contact
    }
}

/// The surface point of a field whose slope is 1 in most places: see [`Contact::surface_point`].
fn likely_surface_point(contact: &Contact<f64>) -> Vector3<f64> {
    contact.point - contact.normal * (contact.distance / contact.slope.max(0.5))
}

fn is_same(a: Vector3<f64>, b: Vector3<f64>) -> bool {
    a.iter().zip(&b).all(|(a, b)| a.to_bits() == b.to_bits())
}
