//! A long winding body with thin spines by formula: what a dragon is to a cloth.

use std::f64::consts::{PI, TAU};

use serde::Deserialize;

use crate::Mesh;

/// A closed tube of length 2 along x that winds sideways and up, thick in its middle, with rows of spines on its back and sides.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct Serpent {
    /// Rings along the body.
    pub rings: u32,
    /// Points on a ring.
    pub slices: u32,
    /// Length of a spine.
    pub spine: f64,
    /// Every so many rings carry spines.
    pub every: u32,
}

impl Serpent {
    pub fn mesh(&self) -> Mesh {
        let (rings, slices) = (self.rings.max(4), self.slices.max(4));
        let mut points = vec![center(0.0)];
        for ring in 1..rings {
            let t = f64::from(ring) / f64::from(rings);
            for slice in 0..slices {
                // Spines stand on the back and, between those, on both sides.
                let turn = f64::from(slice) / f64::from(slices);
                let row = [0, slices / 8, slices - slices / 8].iter().position(|place| *place == slice);
                let is_spine = row.is_some_and(|row| ring % self.every.max(2) == [0, 1, 1][row]);
                let inside = (PI * t).sin();
                let spine = if is_spine { self.spine * inside.sqrt() } else { 0.0 };
                let radius = 0.05 + 0.2 * inside * inside + spine;
                let [x, y, z] = center(t);
                let (sin, cos) = (TAU * turn).sin_cos();
                points.push([x, y + radius * sin, z + radius * cos]);
            }
        }
        points.push(center(1.0));
        let last = points.len() as u32 - 1;
        let on_ring = |ring: u32, slice: u32| 1 + ring * slices + slice % slices;
        let mut triangles = vec![];
        for slice in 0..slices {
            triangles.push([0, on_ring(0, slice), on_ring(0, slice + 1)]);
            for ring in 1..rings - 1 {
                let (a, b) = (on_ring(ring - 1, slice), on_ring(ring - 1, slice + 1));
                let (c, d) = (on_ring(ring, slice + 1), on_ring(ring, slice));
                triangles.extend([[a, c, b], [a, d, c]]);
            }
            triangles.push([on_ring(rings - 2, slice + 1), on_ring(rings - 2, slice), last]);
        }
        Mesh { points, triangles, segments: vec![] }
    }
}

/// The middle of the body at t in 0 … 1.
fn center(t: f64) -> [f64; 3] {
    [2.0 * t - 1.0, 0.22 * (TAU * t).sin(), 0.12 * (2.0 * TAU * t).cos()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_serpent_is_closed_and_its_faces_point_outward() {
        let Mesh { points, triangles, .. } = Serpent { rings: 40, slices: 24, spine: 0.2, every: 4 }.mesh();
        let mut edges: Vec<[u32; 2]> = triangles.iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]).collect();
        edges.sort_unstable();
        assert!(edges.iter().all(|[a, b]| edges.binary_search(&[*b, *a]).is_ok()));
        assert_eq!(edges.len(), {
            edges.dedup();
            edges.len()
        });
        let volume: f64 = triangles
            .iter()
            .map(|corners| {
                let [a, b, c] = corners.map(|corner| points[corner as usize]);
                let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
                (a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2]) / 6.0
            })
            .sum();
        assert!((0.05..0.3).contains(&volume), "{volume}");
    }
}
