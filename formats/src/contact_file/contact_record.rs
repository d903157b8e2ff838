//! Contacts of a mesh with a field, as entries of each format.

use sdf_core::contact::{Contact, ContactStatus, ElementKind, Feature};
use serde::Serialize;

use super::columns::Column;
use super::csv::number;
use super::label::{self, Label};
use super::{OrientedPoint, Record};

/// A contact as files hold it: `Contact` of the core, and the polygon of a face.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ContactRecord {
    /// Vertex, edge or face.
    #[serde(serialize_with = "label::serialize")]
    pub element: ElementKind,
    /// Counts elements of this kind in file order.
    pub id: u32,
    /// For a face: the polygon of the mesh file that it is part of.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polygon: Option<u32>,
    /// The mesh's vertices at the element's corners.
    pub vertices: Vec<u32>,
    /// Kind of the element's part that the point lies on.
    #[serde(serialize_with = "label::serialize")]
    pub feature: ElementKind,
    /// The vertex, the edge's two vertices, or the face's id.
    pub feature_id: Vec<u32>,
    /// Barycentric; one for each vertex of the element.
    pub weights: Vec<f64>,
    /// The point of the element with the lowest distance that was found.
    pub point: [f64; 3],
    /// Point near the surface: point − φ ∇φ / |∇φ|², exact for a true distance.
    pub surface_point: [f64; 3],
    /// Unit vector out of the field, or zero where there is none.
    pub normal: [f64; 3],
    /// Length of the gradient that the normal was made from.
    pub slope: f64,
    /// Signed distance at [`Self::point`].
    pub distance: f64,
    /// Lower bound of the signed distance on the whole element.
    pub lower_bound: f64,
    /// Bound of |φ − distance to the baked mesh| at the point; infinite where nothing is known.
    pub error_bound: f64,
    /// Lower bound of the distance to the baked mesh on the element.
    pub shape_lower_bound: f64,
    /// Number of evaluations of the field.
    pub evaluations: u32,
    /// How far the numbers can be trusted.
    #[serde(serialize_with = "label::serialize")]
    pub status: ContactStatus,
    /// `Contact::key` of the core: names element and feature, the same from frame to frame.
    pub key: u64,
}

impl From<&Contact<f64>> for ContactRecord {
    fn from(contact: &Contact<f64>) -> Self {
        let (feature, feature_id) = match contact.feature {
            Feature::Vertex(vertex) => (ElementKind::Vertex, vec![vertex]),
            Feature::Edge(vertices) => (ElementKind::Edge, vertices.to_vec()),
            Feature::Face(face) => (ElementKind::Face, vec![face]),
        };
        Self {
            element: contact.kind,
            id: contact.element,
            polygon: None,
            vertices: contact.corner_vertices().to_vec(),
            feature,
            feature_id,
            weights: contact.corner_weights().to_vec(),
            point: contact.point.into(),
            surface_point: contact.surface_point.into(),
            normal: contact.normal.into(),
            slope: contact.slope,
            distance: contact.distance,
            lower_bound: contact.lower_bound,
            error_bound: contact.error_bound,
            shape_lower_bound: contact.shape_lower_bound,
            evaluations: contact.evaluations,
            status: contact.status,
            key: contact.key(),
        }
    }
}

impl Record for ContactRecord {
    const CSV_HEADER: &'static str = "element,id,polygon,feature,feature_id,w0,w1,w2,x,y,z,\
        surface_x,surface_y,surface_z,normal_x,normal_y,normal_z,distance,lower_bound,evaluations,status,key,\
        v0,v1,v2,slope,error_bound,shape_lower_bound\n";
    const PLY_COMMENT: &'static str = "contacts";
    const PLY_PROPERTY: &'static str = "uint element";

    /// Missing weights and polygons are empty; the vertices of an edge are separated by a space.
    fn csv_line(&self) -> String {
        let ids: Vec<String> = self.feature_id.iter().map(u32::to_string).collect();
        let polygon = self.polygon.map(|polygon| polygon.to_string()).unwrap_or_default();
        let [w0, w1, w2] = [0, 1, 2].map(|corner| self.weights.get(corner).map(number).unwrap_or_default());
        let vertex = |corner: usize| self.vertices.get(corner).map(u32::to_string).unwrap_or_default();
        let [v0, v1, v2] = [0, 1, 2].map(vertex);
        let vectors = [self.point, self.surface_point, self.normal];
        let numbers: Vec<String> = vectors.iter().flatten().map(number).collect();
        format!(
            "{},{},{polygon},{},{},{w0},{w1},{w2},{},{},{},{},{},{},{v0},{v1},{v2},{},{},{}",
            self.element.name(),
            self.id,
            self.feature.name(),
            ids.join(" "),
            numbers.join(","),
            number(&self.distance),
            number(&self.lower_bound),
            self.evaluations,
            self.status.name(),
            self.key,
            number(&self.slope),
            number(&self.error_bound),
            number(&self.shape_lower_bound),
        )
    }

    fn oriented_point(&self) -> OrientedPoint {
        OrientedPoint { point: self.point, normal: self.normal, distance: self.distance }
    }

    fn ply_property(&self) -> Vec<u8> {
        self.id.to_le_bytes().to_vec()
    }

    const GROUP: &'static str = "contacts";

    fn texts() -> Vec<(&'static str, String)> {
        vec![
            ("schema", "sdftool.contacts/2".to_owned()),
            ("kind_names", ElementKind::NAMES.join(" ")),
            ("status_names", ContactStatus::NAMES.join(" ")),
        ]
    }

    fn columns() -> Vec<Column<Self>> {
        let vertex = |ids: &[u32], index: usize| ids.get(index).copied().unwrap_or(u32::MAX);
        let weight = |contact: &Self, corner: usize| contact.weights.get(corner).copied().unwrap_or(0.0);
        vec![
            Column::new("element", |contact: &Self| [contact.element.code()]),
            Column::new("id", |contact: &Self| [contact.id]),
            Column::new("polygon", |contact: &Self| [contact.polygon.unwrap_or(0)]),
            Column::new("feature", |contact: &Self| [contact.feature.code()]),
            Column::new("feature_id", move |contact: &Self| [0, 1].map(|index| vertex(&contact.feature_id, index))),
            Column::new("weights", move |contact: &Self| [0, 1, 2].map(|corner| weight(contact, corner))),
            Column::new("point", |contact: &Self| contact.point),
            Column::new("surface_point", |contact: &Self| contact.surface_point),
            Column::new("normal", |contact: &Self| contact.normal),
            Column::new("distance", |contact: &Self| [contact.distance]),
            Column::new("lower_bound", |contact: &Self| [contact.lower_bound]),
            Column::new("evaluations", |contact: &Self| [contact.evaluations]),
            Column::new("status", |contact: &Self| [contact.status.code()]),
            Column::new("key", |contact: &Self| [contact.key]),
            Column::new("vertices", move |contact: &Self| [0, 1, 2].map(|corner| vertex(&contact.vertices, corner))),
            Column::new("slope", |contact: &Self| [contact.slope]),
            Column::new("error_bound", |contact: &Self| [contact.error_bound]),
            Column::new("shape_lower_bound", |contact: &Self| [contact.shape_lower_bound]),
        ]
    }
}
