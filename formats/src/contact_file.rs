//! Lists of contacts on disk: CSV and JSON for people and scripts, PLY for viewers, HDF5 for everything else.

mod csv;
mod hdf5;
mod overlap_record;
mod ply;

use std::path::Path;

use rust_hdf5::{H5File, Hdf5Error};
use sdf_core::contact::{Contact, ContactStatus, ElementKind, Feature};
use serde::Serialize;

pub use overlap_record::{OverlapKind, OverlapRecord};

use crate::atomic_write::atomic_write;

/// A contact as files hold it. `Contact` of the core with its numbers widened.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ContactRecord {
    /// `vertex`, `edge` or `face`.
    pub element: &'static str,
    /// Counts elements of this kind in file order.
    pub id: u32,
    /// Of a face: the polygon of the mesh file that it is part of.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polygon: Option<u32>,
    /// `vertex`, `edge` or `face`: what of the element the point lies on.
    pub feature: &'static str,
    /// The vertex, the edge's two vertices, or the face's id.
    pub feature_id: Vec<u32>,
    /// Barycentric, as many as the element has vertices.
    pub weights: Vec<f64>,
    pub point: [f64; 3],
    pub surface_point: [f64; 3],
    pub normal: [f64; 3],
    pub distance: f64,
    pub lower_bound: f64,
    pub evaluations: u32,
    /// `converged`, `budget_spent`, `degenerate_gradient` or `outside_grid`.
    pub status: &'static str,
    pub key: u64,
}

impl From<&Contact<f64>> for ContactRecord {
    fn from(contact: &Contact<f64>) -> Self {
        let (feature, feature_id) = match contact.feature {
            Feature::Vertex(vertex) => ("vertex", vec![vertex]),
            Feature::Edge(vertices) => ("edge", vertices.to_vec()),
            Feature::Face(face) => ("face", vec![face]),
        };
        Self {
            element: kind_name(contact.kind),
            id: contact.element,
            polygon: None,
            feature,
            feature_id,
            weights: contact.corner_weights().to_vec(),
            point: contact.point.into(),
            surface_point: contact.surface_point.into(),
            normal: contact.normal.into(),
            distance: contact.distance,
            lower_bound: contact.lower_bound,
            evaluations: contact.evaluations,
            status: status_name(contact.status),
            key: contact.key(),
        }
    }
}

fn kind_name(kind: ElementKind) -> &'static str {
    match kind {
        ElementKind::Vertex => "vertex",
        ElementKind::Edge => "edge",
        ElementKind::Face => "face",
    }
}

fn status_name(status: ContactStatus) -> &'static str {
    match status {
        ContactStatus::DegenerateGradient => "degenerate_gradient",
        ContactStatus::OutsideGrid => "outside_grid",
        ContactStatus::BudgetSpent => "budget_spent",
        ContactStatus::Converged => "converged",
    }
}

/// What a contact file is written as.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ContactFormat {
    Csv,
    Json,
    Ply,
    Hdf5,
}

impl ContactFormat {
    /// By the name's end: csv, json, ply, h5.
    pub fn of(path: &Path) -> Option<Self> {
        match path.extension()?.to_str()?.to_ascii_lowercase().as_str() {
            "csv" => Some(Self::Csv),
            "json" => Some(Self::Json),
            "ply" => Some(Self::Ply),
            "h5" => Some(Self::Hdf5),
            _ => None,
        }
    }
}

/// What a list is made of: how one entry stands in each kind of file.
pub trait Record: Sized {
    /// The names of a CSV line, with an end of line.
    const CSV_NAMES: &'static str;
    /// What a PLY file says of itself.
    const PLY_COMMENT: &'static str;
    /// The last property of a PLY vertex, type and name.
    const PLY_LAST: &'static str;

    /// Without an end of line.
    fn csv_line(&self) -> String;

    /// Where the entry is, its normal and its distance.
    fn in_space(&self) -> InSpace;

    /// The bytes of the last property.
    fn ply_last(&self) -> Vec<u8>;

    /// Writes a group with one dataset a column.
    fn fill_hdf5(file: &H5File, records: &[Self]) -> Result<(), Hdf5Error>;
}

/// What every entry has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InSpace {
    pub point: [f64; 3],
    pub normal: [f64; 3],
    pub distance: f64,
}

/// Writes the file whole or not at all. `json` is the document that a JSON file holds.
pub fn write<T: Record>(
    path: &Path,
    format: ContactFormat,
    contacts: &[T],
    json: impl FnOnce() -> Vec<u8>,
) -> std::io::Result<()> {
    atomic_write(path, |temporary| match format {
        ContactFormat::Csv => std::fs::write(temporary, csv::text(contacts)),
        ContactFormat::Json => std::fs::write(temporary, json()),
        ContactFormat::Ply => std::fs::write(temporary, ply::bytes(contacts)),
        ContactFormat::Hdf5 => hdf5::write(temporary, contacts),
    })
}
