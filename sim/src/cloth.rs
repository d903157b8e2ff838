//! Sheets, nets and strings: a particle for each vertex, a distance for each edge, and a weaker one across each edge that two faces
//! share, which resists bending and shear.

use std::collections::HashMap;

use crate::V3;
use crate::surface::{Carrier, Surface};
use crate::world::{Stretch, World};

/// Mass and stiffness of a sheet or of strings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fabric {
    /// Mass of all of it, in equal parts.
    pub mass: f64,
    /// Compliance along edges: length / force.
    pub stretch: f64,
    /// Compliance across edges.
    pub bend: f64,
}

impl Default for Fabric {
    fn default() -> Self {
        Self { mass: 1.0, stretch: 0.0, bend: 1e-3 }
    }
}

/// Adds a sheet to the world. Its lengths at rest are those of the points. Panics where a face names a point that is not there.
pub fn add(world: &mut World, points: &[[f64; 3]], faces: &[[u32; 3]], fabric: &Fabric) -> Surface {
    let first = add_points(world, points, fabric);
    let surface = Surface::of_faces(faces.to_vec(), points.len(), Carrier::Particles { first });
    surface.edges.iter().for_each(|ends| tie(world, *ends, first, fabric.stretch));
    for ends in across(faces) {
        tie(world, ends, first, fabric.bend);
    }
    surface
}

/// Adds strings to the world: the edges between points, and for bending the way over each point where two edges meet.
/// Panics where an edge names a point that is not there.
pub fn add_strings(world: &mut World, points: &[[f64; 3]], edges: &[[u32; 2]], fabric: &Fabric) -> Surface {
    let first = add_points(world, points, fabric);
    edges.iter().for_each(|ends| tie(world, *ends, first, fabric.stretch));
    let mut neighbours = vec![vec![]; points.len()];
    for [a, b] in edges {
        neighbours[*a as usize].push(*b);
        neighbours[*b as usize].push(*a);
    }
    for around in &neighbours {
        if let [a, b] = around[..] {
            tie(world, [a, b], first, fabric.bend);
        }
    }
    Surface::of_edges(edges.to_vec(), points.len(), Carrier::Particles { first })
}

fn add_points(world: &mut World, points: &[[f64; 3]], fabric: &Fabric) -> u32 {
    let first = world.x.len() as u32;
    let inv_mass = points.len() as f64 / fabric.mass;
    points.iter().for_each(|point| _ = world.add_particle(V3::from(*point), inv_mass));
    first
}

fn tie(world: &mut World, ends: [u32; 2], first: u32, compliance: f64) {
    let ends = ends.map(|end| first + end);
    let [a, b] = ends.map(|end| world.x[end as usize]);
    world.stretches.push(Stretch { ends, rest: (b - a).norm(), compliance });
}

/// The two vertices opposite of each edge that two faces share, in the order of the faces.
fn across(faces: &[[u32; 3]]) -> Vec<[u32; 2]> {
    let mut opposite = HashMap::new();
    let mut pairs = vec![];
    for [a, b, c] in faces {
        for (from, to, over) in [(a, b, c), (b, c, a), (c, a, b)] {
            match opposite.remove(&[from.min(to), from.max(to)]) {
                Some(other) => pairs.push([other, *over]),
                None => _ = opposite.insert([from.min(to), from.max(to)], *over),
            }
        }
    }
    pairs
}
