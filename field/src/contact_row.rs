//! A contact as a plain row: one layout for numpy's records, for C's struct and for whatever else reads memory.

use sdf_core::contact::{Contact, ContactStatus, ElementKind, Feature};
use sdf_formats::contact_file::Label;

/// A contact in 176 bytes, in the layout of C. Columns, codes and placeholders are those of contact files (docs/contacts.md).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C)]
pub struct ContactRow {
    /// Barycentric, in the order of the element's vertices; zero beyond its last one.
    pub weights: [f64; 3],
    /// The point of the element with the lowest distance.
    pub point: [f64; 3],
    /// Point near the surface.
    pub surface_point: [f64; 3],
    /// Unit vector out of the field, or zero where there is none.
    pub normal: [f64; 3],
    /// φ at the point, negative inside.
    pub distance: f64,
    /// Lower bound of φ on the whole element.
    pub lower_bound: f64,
    /// Length of the gradient that the normal was made from.
    pub slope: f64,
    /// Bound of |φ − distance to the baked mesh| at the point; infinite where nothing is known.
    pub error_bound: f64,
    /// Lower bound of the distance to the baked mesh on the element.
    pub shape_lower_bound: f64,
    /// Element and feature, the same from frame to frame: [`Contact::key`].
    pub key: u64,
    /// Index among the elements of its kind.
    pub id: u32,
    /// Number of evaluations of the field.
    pub evaluations: u32,
    /// The mesh's vertices at the element's corners; 4294967295 beyond the last one.
    pub vertices: [u32; 3],
    /// The vertex, the edge's two vertices, or the face's id; else 4294967295.
    pub feature_id: [u32; 2],
    /// Code of the element's kind: 0 vertex, 1 edge, 2 face.
    pub element: u8,
    /// Code of the kind of the part that the point lies on.
    pub feature: u8,
    /// Code of the status, an index into [`STATUS_NAMES`](Self::STATUS_NAMES).
    pub status: u8,
    /// Zero.
    pub padding: u8,
}

impl ContactRow {
    /// Names of the codes of elements and features.
    pub const ELEMENT_NAMES: &[&str] = ElementKind::NAMES;

    /// Names of the codes of statuses.
    pub const STATUS_NAMES: &[&str] = ContactStatus::NAMES;

    /// The name of a status.
    pub fn status_name(status: ContactStatus) -> &'static str {
        status.name()
    }

    /// The contact of a row; `None` of codes that mean nothing.
    pub fn to_contact(&self) -> Option<Contact<f64>> {
        Some(Contact {
            kind: ElementKind::from_code(self.element)?,
            element: self.id,
            vertices: self.vertices,
            rank: (self.key >> Contact::<f64>::RANK_SHIFT) as u32,
            feature: match (ElementKind::from_code(self.feature)?, self.feature_id) {
                (ElementKind::Vertex, [vertex, _]) => Feature::Vertex(vertex),
                (ElementKind::Edge, vertices) => Feature::Edge(vertices),
                (ElementKind::Face, [face, _]) => Feature::Face(face),
            },
            weights: self.weights,
            point: self.point.into(),
            surface_point: self.surface_point.into(),
            normal: self.normal.into(),
            slope: self.slope,
            distance: self.distance,
            lower_bound: self.lower_bound,
            error_bound: self.error_bound,
            shape_lower_bound: self.shape_lower_bound,
            evaluations: self.evaluations,
            status: ContactStatus::from_code(self.status)?,
        })
    }
}

impl From<&Contact<f64>> for ContactRow {
    fn from(contact: &Contact<f64>) -> Self {
        let (feature, feature_id) = match contact.feature {
            Feature::Vertex(vertex) => (ElementKind::Vertex, [vertex, u32::MAX]),
            Feature::Edge(vertices) => (ElementKind::Edge, vertices),
            Feature::Face(face) => (ElementKind::Face, [face, u32::MAX]),
        };
        Self {
            weights: contact.weights,
            point: contact.point.into(),
            surface_point: contact.surface_point.into(),
            normal: contact.normal.into(),
            distance: contact.distance,
            lower_bound: contact.lower_bound,
            slope: contact.slope,
            error_bound: contact.error_bound,
            shape_lower_bound: contact.shape_lower_bound,
            key: contact.key(),
            id: contact.element,
            evaluations: contact.evaluations,
            vertices: contact.vertices,
            feature_id,
            element: contact.kind.code(),
            feature: feature.code(),
            status: contact.status.code(),
            padding: 0,
        }
    }
}
