//! A cloth or a net by formula: a sheet that hangs over the origin.

use serde::Deserialize;

use crate::Mesh;

/// A rectangular sheet over the origin, its sides hanging down to a floor: z = max(height − bend · (x² + y²), floor).
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Sheet {
    /// Number of cells along x and y, of two triangles each.
    pub cells: [u32; 2],
    pub size: [f64; 2],
    pub height: f64,
    pub bend: f64,
    pub floor: f64,
    /// Turns the sheet into a net.
    pub holes: Option<Holes>,
    /// Number of triangles to keep, the first ones; all if `None`.
    pub faces: Option<usize>,
}

/// Square holes on a square raster, in cells.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Holes {
    /// Distance from a hole to the next.
    pub period: u32,
    /// Width of the strand between two holes.
    pub strand: u32,
}

impl Sheet {
    pub fn mesh(&self) -> Mesh {
        let [columns, rows] = self.cells;
        let mut points = Vec::new();
        for row in 0..=rows {
            for column in 0..=columns {
                points.push(self.point([column, row]));
            }
        }
        let mut triangles = Vec::new();
        for row in 0..rows {
            for column in (0..columns).filter(|column| !self.is_hole([*column, row])) {
                let corner = row * (columns + 1) + column;
                let above = corner + columns + 1;
                triangles.extend([[corner, corner + 1, above + 1], [corner, above + 1, above]]);
            }
        }
        triangles.truncate(self.faces.unwrap_or(usize::MAX));
        Mesh { points, triangles, segments: Vec::new() }.without_unused_points()
    }

    fn point(&self, steps: [u32; 2]) -> [f64; 3] {
        let [x, y] = [0, 1]
            .map(|axis: usize| self.size[axis] * (f64::from(steps[axis]) / f64::from(self.cells[axis].max(1)) - 0.5));
        let from_axis = x.hypot(y);
        [x, y, (self.height - self.bend * from_axis * from_axis).max(self.floor)]
    }

    fn is_hole(&self, cell: [u32; 2]) -> bool {
        self.holes.is_some_and(|Holes { period, strand }| cell.iter().all(|index| index % period.max(1) >= strand))
    }
}
