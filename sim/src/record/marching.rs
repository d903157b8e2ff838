//! Marching tetrahedra (Doi and Koide 1991): the level φ = 0 in a lattice whose cubes are cut into six tetrahedra.

use std::collections::BTreeMap;

use sdf_field::{Field, Threads};

use super::Outline;
use crate::V3;

/// Corners of the tetrahedra, as bits x, y, z of a cube's corner: paths along the diagonal.
const PATHS: [[usize; 4]; 6] = [[0, 1, 3, 7], [0, 1, 5, 7], [0, 2, 3, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 4, 6, 7]];

pub(super) fn tetrahedra(field: &Field, origin: &V3, step: f64, [columns, rows, layers]: [usize; 3]) -> Outline {
    let place = |index: usize| {
        let steps = [index % columns, index / columns % rows, index / columns / rows].map(|steps| steps as f64);
        origin + V3::from(steps) * step
    };
    let nodes: Vec<[f64; 3]> = (0..columns * rows * layers).map(|index| place(index).into()).collect();
    let values: Vec<f64> = field.sample(&nodes, Threads::ALL).iter().map(|sample| sample.value).collect();
    let (mut points, mut faces) = (vec![], vec![]);
    let mut cuts = BTreeMap::new();
    for index in 0..nodes.len() {
        let [x, y, z] = [index % columns, index / columns % rows, index / columns / rows];
        if x + 1 == columns || y + 1 == rows || z + 1 == layers {
            continue;
        }
        let corner = |bits: usize| index + (bits & 1) + columns * ((bits >> 1 & 1) + rows * (bits >> 2));
        for path in PATHS {
            let corners = path.map(corner);
            let (inside, outside): (Vec<_>, Vec<_>) = corners.into_iter().partition(|corner| values[*corner] < 0.0);
            let mut cut = |a: usize, b: usize| {
                *cuts.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    let t = values[a] / (values[a] - values[b]);
                    points.push((V3::from(nodes[a]).lerp(&V3::from(nodes[b]), t)).into());
                    points.len() as u32 - 1
                })
            };
            match (&inside[..], &outside[..]) {
                ([a], [b, c, d]) | ([b, c, d], [a]) => faces.push([cut(*a, *b), cut(*a, *c), cut(*a, *d)]),
                ([a, b], [c, d]) => {
                    let [p, q, r, s] = [cut(*a, *c), cut(*a, *d), cut(*b, *d), cut(*b, *c)];
                    faces.extend([[p, q, r], [p, r, s]]);
                }
                _ => {}
            }
        }
    }
    // Seen from where φ grows.
    for face in &mut faces {
        let [a, b, c] = face.map(|point: u32| V3::from(points[point as usize]));
        let normal = (b - a).cross(&(c - a));
        let middle: [f64; 3] = ((a + b + c) / 3.0).into();
        if normal.dot(&field.sample(&[middle], Threads::ONE)[0].gradient) < 0.0 {
            face.swap(1, 2);
        }
    }
    Outline { points, faces }
}
