use serde::Deserialize;

use super::Model;

/// A rectangular sheet over the origin that hangs down to its sides: z = height − bend · (x² + y²), but not below the floor.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Sheet {
    /// Along x and y; two triangles each.
    pub cells: [u32; 2],
    pub size: [f64; 2],
    pub height: f64,
    pub bend: f64,
    pub floor: f64,
    /// Makes it a net.
    pub holes: Option<Holes>,
    /// Keeps only so many triangles, the first.
    pub faces: Option<usize>,
}

/// Square holes in a row and in rows, in cells.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Holes {
    /// From one hole's side to the next one's.
    pub period: u32,
    /// What is left between two.
    pub strand: u32,
}

impl Sheet {
    pub fn model(&self) -> Model {
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
        Model { points, triangles, segments: Vec::new() }.without_unused_points()
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
