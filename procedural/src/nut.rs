//! A hex nut as a CAD program exports it face by face: along part of two edges the faces on both sides have vertices of their own,
//! which do not quite meet.

use std::f64::consts::{FRAC_PI_6, TAU};

use crate::Mesh;

/// A hex nut about the z axis: width 2 across its corners, a hole of radius 0.55, height 0.8. Each of its edges, all around, is a ring
/// of `6 · cells` points. Along part of the upper outer ring and of the lower inner one there is a crack: a boundary loop of twice as
/// many edges as that part has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CrackedNut {
    /// Cells along a side of the hexagon.
    pub cells: u32,
    /// Edges on one side of the upper and of the lower crack: fewer than `6 · cells`. Zero or one makes no crack.
    pub cracks: [u32; 2],
    /// Largest distance between the sides of a crack.
    pub gap: f64,
}

/// The four rings of points: outer and upper, outer and lower, inner and lower, inner and upper.
const RINGS: usize = 4;

impl CrackedNut {
    pub fn mesh(&self) -> Mesh {
        let count = 6 * self.cells;
        let mut points: Vec<[f64; 3]> =
            (0..RINGS).flat_map(|ring| (0..count).map(move |step| point(ring, step, count))).collect();
        // For each ring the points of the faces above it, where those are their own.
        let mut own: Vec<Vec<u32>> =
            (0..RINGS as u32).map(|ring| (0..count).map(|step| ring * count + step).collect()).collect();
        for (ring, edges) in [0, 2].into_iter().zip(self.cracks) {
            for step in 1..edges.min(count) {
                own[ring][step as usize] = points.len() as u32;
                let [x, y, z] = point(ring, step, count);
                // Wider and narrower along the crack, and nowhere closed.
                let gap = self.gap * (0.6 + 0.4 * (7.0 * f64::from(step)).sin());
                points.push([x, y, if ring == 0 { z + gap } else { z - gap }]);
            }
        }
        let mut triangles = Vec::new();
        for ring in 0..RINGS {
            let next = (ring + 1) % RINGS;
            for step in 0..count {
                let beside = (step + 1) % count;
                // The wall below the upper ring, and the one above the lower ring, have the rings' first points.
                let at = |ring: usize, step: u32, is_own: bool| {
                    if is_own { own[ring][step as usize] } else { ring as u32 * count + step }
                };
                let (from_own, to_own) = (false, next == 0 || next == 2);
                let [a, b] = [step, beside].map(|step| at(ring, step, from_own));
                let [c, d] = [step, beside].map(|step| at(next, step, to_own));
                triangles.extend([[a, c, d], [a, d, b]]);
            }
        }
        Mesh { points, triangles, segments: Vec::new() }
    }
}

fn point(ring: usize, step: u32, count: u32) -> [f64; 3] {
    let angle = TAU * f64::from(step) / f64::from(count);
    // Distance of the hexagon's side in this direction.
    let side = FRAC_PI_6.cos() / ((angle % (2.0 * FRAC_PI_6)) - FRAC_PI_6).cos();
    let radius = if ring < 2 { side } else { 0.55 };
    let z = if ring == 0 || ring == 3 { 0.4 } else { -0.4 };
    [radius * angle.cos(), radius * angle.sin(), z]
}
