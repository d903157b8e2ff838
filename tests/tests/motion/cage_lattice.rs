//! A cube of tetrahedra, for cages.

use nalgebra::Vector3;
use sdf_core::Aabb;
use sdf_core::cage::{TetFrame, TetLocator, sort_tets, tet_tree_size};
use sdf_core::contact::ClusterKey;

type Point = Vector3<f64>;

/// The cube |x|, |y|, |z| ≤ 1 in `side`³ cubes of six tetrahedra each (Kuhn 1960).
pub struct Lattice {
    pub points: Vec<[f64; 3]>,
    pub tets: Vec<[u32; 4]>,
}

impl Lattice {
    pub fn new(side: u32) -> Self {
        let along = side + 1;
        let node = |[x, y, z]: [u32; 3]| (z * along + y) * along + x;
        let at = |x: u32| 2.0 * f64::from(x) / f64::from(side) - 1.0;
        let cells =
            |count: u32| (0..count).flat_map(move |z| (0..count).flat_map(move |y| (0..count).map(move |x| [x, y, z])));
        let points = cells(along).map(|cell| cell.map(at)).collect();
        let mut tets = vec![];
        for cell in cells(side) {
            for order in [[0, 1, 2], [1, 2, 0], [2, 0, 1], [0, 2, 1], [2, 1, 0], [1, 0, 2]] {
                let mut corner = cell;
                let mut tet = vec![node(corner)];
                for axis in order {
                    corner[axis] += 1;
                    tet.push(node(corner));
                }
                tets.push([tet[0], tet[1], tet[2], tet[3]]);
            }
        }
        Self { points, tets }
    }

    pub fn moved(&self, map: impl Fn(Point) -> Point) -> Vec<[f64; 3]> {
        self.points.iter().map(|point| map(Vector3::from(*point)).into()).collect()
    }
}

/// Calls `run` with the locator of a mesh, sorted where the lattice rests.
pub fn with_locator<T>(lattice: &Lattice, points: &[[f64; 3]], run: impl FnOnce(TetLocator) -> T) -> T {
    let count = lattice.tets.len();
    let mut order = vec![0; count];
    assert!(sort_tets(&lattice.points, &lattice.tets, &mut vec![ClusterKey::default(); count], &mut order));
    let mut boxes = vec![Aabb::EVERYWHERE; tet_tree_size(count)];
    let mut frames = vec![TetFrame::ILL_CONDITIONED; count];
    run(TetLocator::new(points, &lattice.tets, &order, &mut boxes, &mut frames).unwrap())
}
