use cudarc::driver::{DeviceRepr, ValidAsZeroBits};
use sdf_core::contact::{Contact, ContactStatus, ElementKind, Feature};
use sdf_core::nalgebra::Vector3;

use crate::abi::{ContactRecord, FieldBlob, Frame, GridParams, PoseParams, SearchParams, ShapeParams};

// SAFETY: all are `repr(C)` and made of integers and floats.
unsafe impl DeviceRepr for ContactRecord {}
unsafe impl DeviceRepr for FieldBlob {}
unsafe impl DeviceRepr for Frame {}
unsafe impl DeviceRepr for GridParams {}
unsafe impl DeviceRepr for PoseParams {}
unsafe impl DeviceRepr for SearchParams {}
unsafe impl DeviceRepr for ShapeParams {}
unsafe impl ValidAsZeroBits for FieldBlob {}

/// In the order of the enum, which the kernels count by.
pub const STATUSES: [ContactStatus; 6] = [
    ContactStatus::Possible,
    ContactStatus::DegenerateGradient,
    ContactStatus::OutsideGrid,
    ContactStatus::BeyondBand,
    ContactStatus::BudgetSpent,
    ContactStatus::Converged,
];

/// The contact that a record holds; `None` of an element that was skipped.
pub fn contact(record: &ContactRecord) -> Option<Contact<f32>> {
    let kind = *[ElementKind::Vertex, ElementKind::Edge, ElementKind::Face].get(record.kind as usize)?;
    let [first, _] = record.feature;
    Some(Contact {
        kind,
        element: record.element,
        vertices: record.vertices,
        rank: record.rank,
        feature: match record.feature_kind {
            0 => Feature::Vertex(first),
            1 => Feature::Edge(record.feature),
            _ => Feature::Face(first),
        },
        weights: record.weights,
        point: Vector3::from(record.point),
        surface_point: Vector3::from(record.surface_point),
        normal: Vector3::from(record.normal),
        slope: record.slope,
        distance: record.distance,
        lower_bound: record.lower_bound,
        error_bound: record.error_bound,
        shape_lower_bound: record.shape_lower_bound,
        evaluations: record.evaluations,
        status: *STATUSES.get(record.status as usize)?,
    })
}

#[cfg(test)]
mod tests;
