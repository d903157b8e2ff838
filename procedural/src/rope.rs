use std::f64::consts::TAU;

use serde::Deserialize;

use crate::Mesh;

/// Strands twisted around the x axis into a bundle that hangs like a sheet: z = height − bend · x².
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Rope {
    pub strands: u32,
    /// Edges per strand.
    pub edges: u32,
    pub length: f64,
    /// Radius of the bundle, whose disk the strands fill evenly.
    pub radius: f64,
    pub turns: f64,
    pub height: f64,
    pub bend: f64,
}

impl Rope {
    pub fn mesh(&self) -> Mesh {
        let mut rope = Mesh::default();
        for strand in 0..self.strands {
            // Vogel 1979: evenly over a disk.
            let golden_angle = TAU * 0.381_966_011_250_105;
            let radius = self.radius * ((f64::from(strand) + 0.5) / f64::from(self.strands)).sqrt();
            let angle = golden_angle * f64::from(strand);
            for step in 0..=self.edges {
                let t = f64::from(step) / f64::from(self.edges.max(1));
                let x = self.length * (t - 0.5);
                let (sin, cos) = (angle + TAU * self.turns * t).sin_cos();
                if step > 0 {
                    let end = rope.points.len() as u32;
                    rope.segments.push([end - 1, end]);
                }
                rope.points.push([x, radius * cos, radius * sin + self.height - self.bend * x * x]);
            }
        }
        rope
    }
}
