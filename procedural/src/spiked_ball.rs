//! A closed body with thin spikes by formula: an icosahedron, subdivided.

use serde::Deserialize;

use crate::Mesh;

/// A ball of facets, every fourth of which carries a spike whose tip is at distance 1 from the center.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq)]
#[serde(deny_unknown_fields)]
pub struct SpikedBall {
    /// Subdivisions of an icosahedron, each of a triangle into four: 20 · 4^(levels − 1) spikes.
    pub levels: u32,
    /// Radius of the ball; spikes are 1 − radius long.
    pub radius: f64,
}

impl SpikedBall {
    pub fn mesh(&self) -> Mesh {
        let ball = (0..self.levels).fold(icosahedron(), |ball, _| refine(&ball));
        let points = ball.points.iter().map(|p| p.map(|x| self.radius * x)).collect();
        let mut body = Mesh { points, ..Mesh::default() };
        for (number, corners) in ball.triangles.iter().enumerate() {
            let [a, b, c] = *corners;
            if number % 4 != 3 {
                body.triangles.push(*corners);
                continue;
            }
            let center: [f64; 3] =
                std::array::from_fn(|axis| corners.iter().map(|corner| ball.points[*corner as usize][axis]).sum());
            let length = center.iter().map(|x| x * x).sum::<f64>().sqrt();
            let tip = body.points.len() as u32;
            body.points.push(center.map(|x| x / length));
            body.triangles.extend([[a, b, tip], [b, c, tip], [c, a, tip]]);
        }
        body
    }
}

fn icosahedron() -> Mesh {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let length = (1.0 + golden * golden).sqrt();
    let mut points = Vec::new();
    for axis in 0..3 {
        for (short, long) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
            let mut point = [0.0; 3];
            (point[axis], point[(axis + 1) % 3]) = (short / length, long / length);
            points.push(point);
        }
    }
    // Neighbours are 2/√(1 + φ²) = 1.05 apart, all other points at least 1.7.
    let is_edge = |a: u32, b: u32| {
        let [a, b] = [a, b].map(|index| points[index as usize]);
        (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum::<f64>() < 1.2
    };
    let mut triangles = Vec::new();
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if is_edge(a, b) && is_edge(b, c) && is_edge(c, a) {
                    triangles.push(outward(&points, [a, b, c]));
                }
            }
        }
    }
    Mesh { points, triangles, segments: Vec::new() }
}

/// The triangle with its corners counterclockwise, seen from outside.
fn outward(points: &[[f64; 3]], [a, b, c]: [u32; 3]) -> [u32; 3] {
    let [p, q, r] = [a, b, c].map(|index| points[index as usize]);
    let determinant: f64 = (0..3)
        .map(|axis| {
            let [next, last] = [(axis + 1) % 3, (axis + 2) % 3];
            p[axis] * (q[next] * r[last] - q[last] * r[next])
        })
        .sum();
    if determinant < 0.0 { [a, c, b] } else { [a, b, c] }
}

/// Each triangle split into four, the new corners moved onto the unit sphere. The last of the four is the middle one.
fn refine(ball: &Mesh) -> Mesh {
    let mut points = ball.points.clone();
    let mut middles = std::collections::BTreeMap::new();
    let mut triangles = Vec::new();
    for [a, b, c] in &ball.triangles {
        let mut middle = |from: u32, to: u32| {
            *middles.entry([from.min(to), from.max(to)]).or_insert_with(|| {
                let [p, q] = [from, to].map(|index| points[index as usize]);
                let sum: [f64; 3] = std::array::from_fn(|axis| p[axis] + q[axis]);
                let length = sum.iter().map(|x| x * x).sum::<f64>().sqrt();
                points.push(sum.map(|x| x / length));
                points.len() as u32 - 1
            })
        };
        let [ab, bc, ca] = [middle(*a, *b), middle(*b, *c), middle(*c, *a)];
        triangles.extend([[*a, ab, ca], [*b, bc, ab], [*c, ca, bc], [ab, bc, ca]]);
    }
    Mesh { points, triangles, segments: Vec::new() }
}
