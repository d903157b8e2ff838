use rust_hdf5::{H5File, Hdf5Error};
use sdf_core::overlap::{OverlapPoint, PatchPoint};
use serde::Serialize;

use super::csv::number;
use super::hdf5::Table;
use super::{InSpace, Record};

/// What a point between two fields is reported for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum OverlapKind {
    /// Nowhere near it is max(φ_A, φ_B) less.
    Deepest,
    /// It stands for a piece of the surface on which φ_A = φ_B.
    Patch,
}

impl OverlapKind {
    const NAMES: [&'static str; 2] = ["deepest", "patch"];

    fn name(self) -> &'static str {
        match self {
            Self::Deepest => Self::NAMES[0],
            Self::Patch => Self::NAMES[1],
        }
    }
}

/// A point at which two fields meet, as files hold it.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct OverlapRecord {
    pub kind: OverlapKind,
    pub point: [f64; 3],
    /// Out of the second field and into the first.
    pub normal: [f64; 3],
    /// The higher of both.
    pub distance: f64,
    pub distance_a: f64,
    pub distance_b: f64,
    /// The sum of both: of convex bodies the gap, or minus the depth.
    pub separation: f64,
    /// Of the piece of the patch; of a deepest point 0.
    pub area: f64,
    /// `good`, `degenerate_gradient` or `outside_grid`, whichever is true of either field.
    pub status: &'static str,
}

const STATUSES: [&str; 3] = ["good", "outside_grid", "degenerate_gradient"];

impl OverlapRecord {
    fn new(kind: OverlapKind, at: &OverlapPoint<f64>, area: f64) -> Self {
        let status = at.status();
        let is_degenerate = status.degenerate_gradient || at.normal.iter().all(|along| *along == 0.0);
        Self {
            kind,
            point: at.point.into(),
            normal: at.normal.into(),
            distance: at.value,
            distance_a: at.a.value,
            distance_b: at.b.value,
            separation: at.separation(),
            area,
            status: STATUSES[if is_degenerate { 2 } else { usize::from(status.outside_grid) }],
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
    const CSV_NAMES: &'static str =
        "kind,x,y,z,normal_x,normal_y,normal_z,distance,distance_a,distance_b,separation,area,status\n";
    const PLY_COMMENT: &'static str = "points at which two fields meet";
    const PLY_LAST: &'static str = "double area";

    fn csv_line(&self) -> String {
        let lengths = [self.distance, self.distance_a, self.distance_b, self.separation, self.area];
        let numbers: Vec<String> = self.point.iter().chain(&self.normal).chain(&lengths).map(number).collect();
        format!("{},{},{}", self.kind.name(), numbers.join(","), self.status)
    }

    fn in_space(&self) -> InSpace {
        InSpace { point: self.point, normal: self.normal, distance: self.distance }
    }

    fn ply_last(&self) -> Vec<u8> {
        self.area.to_le_bytes().to_vec()
    }

    /// A group `/overlap`; `kind` and `status` are numbered as the attributes `kind_names` and `status_names` list them.
    fn fill_hdf5(file: &H5File, records: &[Self]) -> Result<(), Hdf5Error> {
        let group = file.create_group("overlap")?;
        group.set_attr_numeric("count", &(records.len() as u64))?;
        group.set_attr_string("kind_names", &OverlapKind::NAMES.join(" "))?;
        group.set_attr_string("status_names", &STATUSES.join(" "))?;

        let table = Table { group: &group, rows: records };
        table.column("kind", |record| [record.kind as u8])?;
        table.column("point", |record| record.point)?;
        table.column("normal", |record| record.normal)?;
        table.column("distance", |record| [record.distance])?;
        table.column("distance_a", |record| [record.distance_a])?;
        table.column("distance_b", |record| [record.distance_b])?;
        table.column("separation", |record| [record.separation])?;
        table.column("area", |record| [record.area])?;
        table.column("status", |record| [STATUSES.iter().position(|name| *name == record.status).unwrap_or(0) as u8])
    }
}
