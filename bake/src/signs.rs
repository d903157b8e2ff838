use sdf_core::nalgebra::Vector3;

use crate::MeshDistance;
use crate::winding::WINDING_ERROR;

/// Negates the distances of all nodes inside, in a block of nodes of a regular grid, x fastest, by winding number.
///
/// Between two neighbours whose distances sum to more than a spacing there is no triangle, and the winding number changes
/// as slowly as the mesh's rim allows. So a node takes the side of a neighbour that is sure enough of its own, and the
/// winding number is asked where none is.
pub(crate) fn sign_block(
    mesh: &MeshDistance,
    spacing: f64,
    counts: [usize; 3],
    position: impl Fn([usize; 3]) -> Vector3<f64>,
    distances: &mut [f32],
) {
    let [row, rows, _] = counts;
    let layer = row * rows;
    let free_way = (spacing * (1.0 + 1e-6)) as f32;
    let loss = Cubes::new(counts, |[first, last]| {
        let [low, high] = [first, last].map(&position);
        let radius = 0.5 * (high - low).norm() + spacing;
        spacing * mesh.winding_slope((low + high) * 0.5, radius)
    });
    // How much a node's winding number may yet change without a change of side.
    let mut sureness = vec![0.0_f64; distances.len()];
    for index in 0..distances.len() {
        let [x, y, z] = [index % row, index / row % rows, index / layer];
        let loss = loss.at([x, y, z]);
        let mut surest = (0.0, 0);
        for (is_there, step) in [(x > 0, 1), (y > 0, row), (z > 0, layer)] {
            if is_there && distances[index].abs() + distances[index - step].abs() > free_way {
                let remaining = sureness[index - step] - loss;
                if remaining > surest.0 {
                    surest = (remaining, index - step);
                }
            }
        }
        let is_inside = if surest.0 > 0.0 {
            sureness[index] = surest.0;
            distances[surest.1].is_sign_negative()
        } else {
            let winding = mesh.winding_number(position([x, y, z]).into()).abs();
            sureness[index] = (winding - 0.5).abs() - WINDING_ERROR;
            winding >= 0.5
        };
        if is_inside {
            distances[index] = -distances[index];
        }
    }
}

/// A number for each cube of nodes of a block.
struct Cubes {
    counts: [usize; 3],
    values: Vec<f64>,
}

impl Cubes {
    /// Nodes along each side of a cube.
    const SIDE: usize = 8;

    /// `value` is given the first and the last node of each cube.
    fn new(nodes: [usize; 3], value: impl Fn([[usize; 3]; 2]) -> f64) -> Self {
        let counts = nodes.map(|n| n.div_ceil(Self::SIDE));
        let of_cube = |cube: usize| {
            let first = [cube % counts[0], cube / counts[0] % counts[1], cube / counts[0] / counts[1]]
                .map(|cube| cube * Self::SIDE);
            value([first, std::array::from_fn(|axis| (first[axis] + Self::SIDE).min(nodes[axis]) - 1)])
        };
        Self { counts, values: (0..counts.iter().product()).map(of_cube).collect() }
    }

    fn at(&self, node: [usize; 3]) -> f64 {
        let [x, y, z] = node.map(|n| n / Self::SIDE);
        self.values[(z * self.counts[1] + y) * self.counts[0] + x]
    }
}
