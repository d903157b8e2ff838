//! Points at which two fields overlap, as entries of each format.

use sdf_core::overlap::{OverlapPoint, PatchPoint};
use serde::Serialize;

use super::columns::Column;
use super::csv::number;
use super::label::{self, Label};
use super::{OrientedPoint, Record};

/// Why a point between two fields is reported.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OverlapKind {
    /// A local minimum of max(φ_A, φ_B).
    Deepest,
    /// A piece of the surface φ_A = φ_B.
    Patch,
}

impl Label for OverlapKind {
    const ALL: &'static [Self] = &[Self::Deepest, Self::Patch];

    const NAMES: &'static [&'static str] = &["deepest", "patch"];

    fn code(self) -> u8 {
        match self {
            Self::Deepest => 0,
            Self::Patch => 1,
        }
    }
}

/// Reliability of an overlap point: the worse of both fields.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OverlapStatus {
    /// Neither of the conditions below holds.
    Good,
    /// The point lies outside a grid: its value is a lower bound.
    OutsideGrid,
    /// A value is beyond the band of a sparse grid, and coarse.
    BeyondBand,
    /// A field has no gradient, or both have the same: the normal is a choice, or zero.
    DegenerateGradient,
}

impl Label for OverlapStatus {
    const ALL: &'static [Self] = &[Self::Good, Self::OutsideGrid, Self::DegenerateGradient, Self::BeyondBand];

    const NAMES: &'static [&'static str] = &["good", "outside_grid", "degenerate_gradient", "beyond_band"];

    fn code(self) -> u8 {
        match self {
            Self::Good => 0,
            Self::OutsideGrid => 1,
            Self::DegenerateGradient => 2,
            Self::BeyondBand => 3,
        }
    }
}

/// A point at which two fields overlap, as files hold it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OverlapRecord {
    /// Why the point is reported.
    #[serde(serialize_with = "label::serialize")]
    pub kind: OverlapKind,
    /// The point in world coordinates.
    pub point: [f64; 3],
    /// Points out of the second field and into the first.
    pub normal: [f64; 3],
    /// max(φ_A, φ_B).
    pub distance: f64,
    /// φ_A at the point.
    pub distance_a: f64,
    /// φ_B at the point.
    pub distance_b: f64,
    /// φ_A + φ_B: for convex bodies the gap, or minus the depth.
    pub separation: f64,
    /// Area of the piece of the patch; 0 for a deepest point.
    pub area: f64,
    /// Reliability of the numbers.
    #[serde(serialize_with = "label::serialize")]
    pub status: OverlapStatus,
}

impl OverlapRecord {
    fn new(kind: OverlapKind, at: &OverlapPoint<f64>, area: f64) -> Self {
        let status = at.status();
        let is_degenerate = status.degenerate_gradient || at.normal.iter().all(|coordinate| *coordinate == 0.0);
        Self {
            kind,
            point: at.point.into(),
            normal: at.normal.into(),
            distance: at.value,
            distance_a: at.a.value,
            distance_b: at.b.value,
            separation: at.separation(),
            area,
            status: match () {
                () if is_degenerate => OverlapStatus::DegenerateGradient,
                () if status.outside_grid => OverlapStatus::OutsideGrid,
                () if status.beyond_band => OverlapStatus::BeyondBand,
                () => OverlapStatus::Good,
            },
        }
    }
}

impl From<&OverlapPoint<f64>> for OverlapRecord {
    fn from(at: &OverlapPoint<f64>) -> Self {
        Self::new(OverlapKind::Deepest, at, 0.0)
    }
}

impl From<&PatchPoint<f64>> for OverlapRecord {
    fn from(piece: &PatchPoint<f64>) -> Self {
        Self::new(OverlapKind::Patch, &piece.point, piece.area)
    }
}

impl Record for OverlapRecord {
    const CSV_HEADER: &'static str =
        "kind,x,y,z,normal_x,normal_y,normal_z,distance,distance_a,distance_b,separation,area,status\n";
    const PLY_COMMENT: &'static str = "points at which two fields meet";
    const PLY_PROPERTY: &'static str = "double area";

    fn csv_line(&self) -> String {
        let lengths = [self.distance, self.distance_a, self.distance_b, self.separation, self.area];
        let numbers: Vec<String> = self.point.iter().chain(&self.normal).chain(&lengths).map(number).collect();
        format!("{},{},{}", self.kind.name(), numbers.join(","), self.status.name())
    }

    fn oriented_point(&self) -> OrientedPoint {
        OrientedPoint { point: self.point, normal: self.normal, distance: self.distance }
    }

    fn ply_property(&self) -> Vec<u8> {
        self.area.to_le_bytes().to_vec()
    }

    const GROUP: &'static str = "overlap";

    fn texts() -> Vec<(&'static str, String)> {
        vec![
            ("schema", "sdftool.overlap/1".to_owned()),
            ("kind_names", OverlapKind::NAMES.join(" ")),
            ("status_names", OverlapStatus::NAMES.join(" ")),
        ]
    }

    fn columns() -> Vec<Column<Self>> {
        vec![
            Column::new("kind", |record: &Self| [record.kind.code()]),
            Column::new("point", |record: &Self| record.point),
            Column::new("normal", |record: &Self| record.normal),
            Column::new("distance", |record: &Self| [record.distance]),
            Column::new("distance_a", |record: &Self| [record.distance_a]),
            Column::new("distance_b", |record: &Self| [record.distance_b]),
            Column::new("separation", |record: &Self| [record.separation]),
            Column::new("area", |record: &Self| [record.area]),
            Column::new("status", |record: &Self| [record.status.code()]),
        ]
    }
}
