//! Laws of motion: fields that move or are deformed, and contacts from frame to frame.

mod affine;
mod cage;
mod cage_edges;
mod cage_lattice;
mod cage_tree;
mod clusters;
mod edge_cases;
mod first_touch;
mod grazing;
mod memory;
mod moving;

use nalgebra::Vector3;
use sdf_core::Simplex;
use sdf_core::contact::Element;
use sdf_core::placed::Rigid;
use sdf_tests::random::Random;

fn random_pose(random: &mut Random, half: f64) -> Rigid {
    Rigid::new(random.point_in_cube(half), [0; 4].map(|_| random.between(-1.0, 1.0))).unwrap()
}

/// Weights of a random point of a simplex; each is zero at times.
fn random_weights<const N: usize>(random: &mut Random) -> [f64; N] {
    loop {
        let weights = [0; N].map(|_| random.between(-0.3, 1.0).max(0.0));
        let sum: f64 = weights.iter().sum();
        if sum > 0.0 {
            return weights.map(|weight| weight / sum);
        }
    }
}

/// An element of up to `size` across, somewhere in the cube of `half`.
fn random_element<const N: usize>(random: &mut Random, id: u32, half: f64, size: f64) -> Element<f64, N> {
    let centre = random.in_cube(half);
    let corners: [Vector3<f64>; N] = [0; N].map(|_| centre + random.in_cube(0.5 * size));
    Element { id, vertices: std::array::from_fn(|k| id * N as u32 + k as u32), simplex: Simplex { corners } }
}
