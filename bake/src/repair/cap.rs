//! Triangles that fill a loop of points in space: of all triangulations without new points, the one with the least sum of areas
//! (Barequet and Sharir 1995, "Filling gaps in the boundary of a polyhedron"), by dynamic programming over chords:
//!
//! ```text
//! cost(i, k) = min over i < j < k of cost(i, j) + cost(j, k) + area(i, j, k) + λ (|ij|² + |jk|²),   λ = 10⁻⁶.
//! ```
//!
//! λ prefers short chords where areas are equal, as all are in a plane and in a crack without width. The time is cubic. So a long
//! loop is first filled as one of at most [`MAX_CORNERS`] of its points, and then each piece that its chords cut off.

use sdf_core::nalgebra::Vector3;

/// Most corners of a loop that is filled at once: 350,000 candidates.
const MAX_CORNERS: usize = 128;

/// Weight of a chord's squared length beside areas.
const CHORD_WEIGHT: f64 = 1e-6;

/// Scratch buffers: for each chord the least cost of what it cuts off, and the corner that takes it.
pub(super) struct Capping {
    costs: Vec<f64>,
    apexes: Vec<usize>,
}

impl Capping {
    pub fn new() -> Self {
        Self { costs: vec![0.0; MAX_CORNERS * MAX_CORNERS], apexes: vec![0; MAX_CORNERS * MAX_CORNERS] }
    }

    /// The n − 2 triangles of a loop of n points, in its orientation, as places in the loop.
    pub fn triangles(&mut self, points: &[Vector3<f64>]) -> Vec<[usize; 3]> {
        let mut triangles = vec![];
        let mut waiting: Vec<Vec<usize>> = vec![(0..points.len()).collect()];
        while let Some(corners) = waiting.pop() {
            let count = corners.len();
            if count < 3 {
                continue;
            }
            // Every so manieth point of a long loop.
            let pieces = count.min(MAX_CORNERS);
            let places: Vec<usize> = (0..pieces).map(|piece| piece * count / pieces).collect();
            let picked: Vec<usize> = places.iter().map(|place| corners[*place]).collect();
            self.fill(points, &picked, &mut triangles);
            if pieces < count {
                let ends = places[1..].iter().copied().chain([count]);
                let piece =
                    |(first, end): (&usize, usize)| (*first..=end).map(|place| corners[place % count]).collect();
                waiting.extend(places.iter().zip(ends).map(piece));
            }
        }
        triangles
    }

    fn fill(&mut self, points: &[Vector3<f64>], corners: &[usize], triangles: &mut Vec<[usize; 3]>) {
        let count = corners.len();
        let corner = |place: usize| points[corners[place]];
        let at = |from: usize, to: usize| from * MAX_CORNERS + to;
        for from in 0..count - 1 {
            self.costs[at(from, from + 1)] = 0.0;
        }
        for span in 2..count {
            for from in 0..count - span {
                let to = from + span;
                let (a, c) = (corner(from), corner(to));
                let (mut least, mut apex) = (f64::INFINITY, from + 1);
                for middle in from + 1..to {
                    let (ab, bc) = (corner(middle) - a, c - corner(middle));
                    let chords = ab.norm_squared() + bc.norm_squared();
                    let own = 0.5 * ab.cross(&bc).norm() + CHORD_WEIGHT * chords;
                    let cost = self.costs[at(from, middle)] + self.costs[at(middle, to)] + own;
                    if cost < least {
                        (least, apex) = (cost, middle);
                    }
                }
                self.costs[at(from, to)] = least;
                self.apexes[at(from, to)] = apex;
            }
        }
        let mut chords = vec![[0, count - 1]];
        while let Some([from, to]) = chords.pop() {
            if to - from < 2 {
                continue;
            }
            let apex = self.apexes[at(from, to)];
            triangles.push([from, apex, to].map(|place| corners[place]));
            chords.extend([[from, apex], [apex, to]]);
        }
    }
}
