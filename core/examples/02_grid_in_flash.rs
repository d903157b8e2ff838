//! A grid in read-only memory, queried in f32 as firmware does: nothing is allocated, copied or computed at start-up.
//!
//! `tests/firmware` is such a program for a Cortex-M4F.

use sdf_core::Simplex;
use sdf_core::contact::{Contact, Element, Outcome, contact};
use sdf_core::grid::{Dense, Grid, Lattice};
use sdf_core::minimize::FrankWolfe;
use sdf_core::nalgebra::Vector3;

/// Nodes along each axis.
const NODES: usize = 17;
const SPACING: f64 = 0.125;
const ORIGIN: [f64; 3] = [-1.0; 3];
const RADIUS: f64 = 0.6;

/// The distances of all nodes to a ball, x fastest. A real program has a baked grid here, as a table or by `include_bytes!`.
static SAMPLES: [f32; NODES * NODES * NODES] = ball();

/// A distance changes by at most the spacing from node to node, so each partial derivative of the interpolant is at most
/// 1, and its gradient at most √3 long.
const SLOPE_BOUND: f64 = 1.7321;

/// The contact of a triangle with the grid; `None` if they do not touch.
fn touch(corners: [[f32; 3]; 3]) -> Option<Contact<f32>> {
    let lattice = Lattice::new(ORIGIN, SPACING, [NODES as u32; 3])?;
    // The samples are lent, not copied.
    let grid = Grid::new(lattice, Dense::new(&lattice, &SAMPLES)?, SLOPE_BOUND)?;
    let element = Element { id: 0, vertices: [0, 1, 2], simplex: Simplex { corners: corners.map(Vector3::from) } };
    match contact(&grid, &FrankWolfe::default(), 0.0, &element) {
        Outcome::Contact(contact) => Some(contact),
        Outcome::Separated(_) | Outcome::Culled | Outcome::NotFinite => None,
    }
}

const fn ball() -> [f32; NODES * NODES * NODES] {
    let mut samples = [0.0; NODES * NODES * NODES];
    let mut node = 0;
    while node < samples.len() {
        let x = ORIGIN[0] + SPACING * (node % NODES) as f64;
        let y = ORIGIN[1] + SPACING * (node / NODES % NODES) as f64;
        let z = ORIGIN[2] + SPACING * (node / (NODES * NODES)) as f64;
        samples[node] = (sqrt(x * x + y * y + z * z) - RADIUS) as f32;
        node += 1;
    }
    samples
}

/// Newton's method, because the compiler has no square root to offer.
const fn sqrt(square: f64) -> f64 {
    let mut root = 1.0 + square;
    let mut step = 0;
    while step < 32 {
        root = 0.5 * (root + square / root);
        step += 1;
    }
    root
}

pub fn main() {
    let flash = size_of_val(&SAMPLES);
    println!("{flash} bytes of samples, {} bytes for the grid itself", size_of::<Grid<Dense<&[f32]>>>());
    let found = touch([[0.9, 0.0, 0.5], [-0.7, 0.7, 0.5], [-0.7, -0.7, 0.5]]).expect("the triangle cuts the ball");
    println!("deepest: {:.4} at {:.3?}", found.distance, found.point.as_slice());
    println!("normal:  {:.3?}", found.normal.as_slice());
    // The top of the ball is 0.1 above the triangle. The interpolant is off by at most spacing² / radius or so.
    assert!((found.distance + 0.1).abs() < 0.02 && found.normal.z > 0.9);
    assert!(touch([[0.9, 0.0, 0.7], [-0.7, 0.7, 0.7], [-0.7, -0.7, 0.7]]).is_none());
}
