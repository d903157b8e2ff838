//! By how much the trilinear interpolant of exact distances is off, cell by cell. The proof stands in
//! `docs/error-bounds.md`; the letters here are the same.

pub mod candidates;
pub mod local_triangles;
pub mod node_bounds;
pub mod normal_cones;

use std::ops::Range;

use sdf_core::nalgebra::Vector3;

use crate::MeshDistance;
use crate::error::candidates::{Blocks, Candidates};
use crate::error::local_triangles::LocalTriangles;
use crate::error::normal_cones::{MAX_ERROR, Normals, cone_error_bound, cone_error_bounds_x8};
use crate::rounding::SINGLE_SLACK;
use crate::simd::LANES;

/// A cube.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    pub center: Vector3<f64>,
    pub half_side: f64,
}

/// What two sheets face to face come to, in spacings. Above it, it is worth the time to look at what meets at each corner of
/// the mesh by itself.
const OF_TWO_SHEETS: f64 = 0.5;

/// The blocks of one place, and the triangles around them.
pub(crate) struct BlocksOfPlace<'a> {
    mesh: &'a MeshDistance<'a>,
    around: LocalTriangles<'a>,
    in_block: Candidates<'a>,
    /// Of block after block the candidates, triangles of the tree.
    candidates: Vec<u32>,
    /// Of those of one block, or of those that were picked for eight.
    normals: Vec<Vector3<f64>>,
    of_one: Normals,
}

/// A block, the distance at its center, and a triangle of the tree that is nearest to it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Query {
    pub block: Block,
    pub distance: f64,
    pub slot: usize,
}

/// A block, and where its candidates stand.
#[derive(Clone, Debug)]
pub(crate) struct Measured {
    block: Block,
    candidates: Range<usize>,
    /// No less than [`BlocksOfPlace::error`].
    pub most_error: f64,
}

impl<'a> BlocksOfPlace<'a> {
    /// For blocks with so long a half side and their centers in a cube. None of these is farther from the surface than
    /// `distance`.
    pub fn new(mesh: &'a MeshDistance<'a>, centers: Block, half_side: f64, distance: f64) -> Self {
        let way = 3.0_f64.sqrt() * (centers.half_side + 2.0 * half_side);
        let around = LocalTriangles::gather(mesh.tree(), centers.center, distance + way, half_side);
        let (in_block, of_one) = (Candidates::new(mesh.tree()), Normals::default());
        Self { mesh, around, in_block, candidates: vec![], normals: vec![], of_one }
    }

    /// Finds the triangles that can be nearest to a point of each of up to eight blocks.
    pub fn measure(&mut self, asked: &[Query]) -> Vec<Measured> {
        let Self { mesh, around, normals, .. } = self;
        around.find(asked);
        normals.clear();
        normals.extend(around.picked.iter().map(|slot| mesh.normal(*slot)));
        let cone_error_bounds_x8 =
            cone_error_bounds_x8(mesh.tree().arch, normals, around.found.of_each(), around.found.holds());
        (0..asked.len())
            .map(|number| self.measured(number, asked[number].block, cone_error_bounds_x8[number]))
            .collect()
    }

    fn measured(&mut self, number: usize, block: Block, most_error: f64) -> Measured {
        let from = self.candidates.len();
        let numbers = self.around.found.of(number).iter();
        self.candidates.extend(numbers.map(|number| self.around.picked[*number as usize]));
        Measured { block, candidates: from..self.candidates.len(), most_error }
    }

    /// The most by which the interpolant of exact distances is off, in spacings, in a block's cells.
    pub fn error(&mut self, of: &Measured) -> f64 {
        self.of_one.clear();
        self.candidates[of.candidates.clone()].iter().for_each(|slot| self.of_one.push(self.mesh.normal(*slot)));
        cone_error_bound(std::slice::from_ref(&self.of_one))
    }

    /// The triangles that can be nearest.
    #[cfg(test)]
    pub fn candidates(&self, of: &Measured) -> &[u32] {
        &self.candidates[of.candidates.clone()]
    }

    /// The same in each of the eight cells of a block, where fewer triangles can be nearest, as far as the cells come `within`
    /// so much of the surface; or `least` where it is no more than that.
    pub fn error_in_cells(&mut self, of: &Measured, within: f64, least: f64) -> f64 {
        let Self { mesh, in_block, normals, of_one, candidates, .. } = self;
        let candidates = &candidates[of.candidates.clone()];
        normals.clear();
        normals.extend(candidates.iter().map(|slot| mesh.normal(*slot)));
        let half_side = 0.5 * of.block.half_side;
        let cell = |cell: usize| {
            let step = Vector3::from_fn(|axis, _| if cell >> axis & 1 == 0 { -half_side } else { half_side });
            (Block { center: of.block.center + step, half_side }, f64::INFINITY)
        };
        in_block.find(candidates, &Blocks::new(LANES, cell));
        let cone_error_bounds_x8 =
            cone_error_bounds_x8(mesh.tree().arch, normals, in_block.of_each(), in_block.holds());
        let mut most = least;
        for cell in 0..LANES {
            let Some(nearest) = in_block.nearest(cell) else { return MAX_ERROR };
            let is_beyond = nearest.distance_sq.sqrt() > within + 3.0_f64.sqrt() * half_side * (1.0 + SINGLE_SLACK);
            if is_beyond || cone_error_bounds_x8[cell] <= most {
                continue;
            }
            of_one.collect(normals, in_block.of(cell));
            let of_all = cone_error_bound(std::slice::from_ref(of_one));
            let by_corners = || {
                let of_cell: Vec<u32> = in_block.of(cell).iter().map(|number| candidates[*number as usize]).collect();
                mesh.error_by_corners(&of_cell)
            };
            most = most.max(if of_all <= OF_TWO_SHEETS { of_all } else { of_all.min(by_corners()) });
        }
        most
    }
}

impl MeshDistance<'_> {
    /// Zero where a triangle has none that is sure.
    fn normal(&self, slot: u32) -> Vector3<f64> {
        let known = self.normals_of_one_solid();
        known.map_or_else(Vector3::zeros, |known| known.face(self.tree().triangles[slot as usize]))
    }

    /// Whatever is nearest, a face, an edge or a corner: the faces that meet there meet at one of its corners.
    fn error_by_corners(&self, candidates: &[u32]) -> f64 {
        cone_error_bound(&self.by_corners(candidates))
    }

    /// Each normal once for each corner of its triangle, those of a corner together.
    fn by_corners(&self, candidates: &[u32]) -> Vec<Normals> {
        let corners = |slot: &u32| self.points_of(*slot as usize).map(|point| (point, self.normal(*slot)));
        let mut by_corner: Vec<(u32, Vector3<f64>)> = candidates.iter().flat_map(corners).collect();
        by_corner.sort_by_key(|(corner, _)| *corner);
        let around_corner = |around: &[(u32, Vector3<f64>)]| {
            let mut normals = Normals::default();
            around.iter().for_each(|(_, normal)| normals.push(*normal));
            normals
        };
        by_corner.chunk_by(|a, b| a.0 == b.0).map(around_corner).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TriangleMesh;
    use crate::error::normal_cones::tests::may_hold;
    use crate::testing::{random, random_vector};

    /// Two pyramids base to base.
    fn bipyramid(sides: u32, top: f64, bottom: f64) -> TriangleMesh {
        let mut points = vec![[0.1, 0.0, top], [0.0, 0.05, -bottom]];
        let mut triangles = vec![];
        for side in 0..sides {
            let angle = std::f64::consts::TAU * f64::from(side) / f64::from(sides);
            points.push([angle.cos(), angle.sin(), 0.0]);
            let [here, next] = [side + 2, (side + 1) % sides + 2];
            triangles.extend([[0, here, next], [1, next, here]]);
        }
        TriangleMesh::new(&points, &triangles).unwrap()
    }

    #[test]
    fn the_gradient_at_a_point_of_a_block_is_of_candidates_around_one_corner() {
        let mut state = 9;
        for (sides, top, bottom) in [(3, 1.0, 0.5), (4, 0.05, 0.05), (5, 2.0, -0.2), (9, 0.1, -0.05), (40, 0.7, 0.2)] {
            let mesh = bipyramid(sides, top, bottom);
            let distance = MeshDistance::new(&mesh, None);
            assert!(distance.normals_of_one_solid().is_some());
            for _ in 0..300 {
                let center = random_vector(&mut state) * 1.3;
                let block = Block { center, half_side: 0.3 * random(&mut state).abs() };
                let to_center = distance.nearest(center, 0);
                let mut blocks = BlocksOfPlace::new(&distance, block, block.half_side, to_center.distance);
                let asked = Query { block, distance: to_center.distance, slot: to_center.guess };
                let measured = blocks.measure(&[asked]);
                let candidates = blocks.candidates(&measured[0]);
                let cones = distance.by_corners(candidates);
                for _ in 0..10 {
                    let point = center + random_vector(&mut state) * block.half_side;
                    let nearest = distance.tree().nearest(point, 0);
                    assert!(candidates.iter().any(|slot| *slot as usize == nearest.slot), "{point} of {block:?}");
                    let outward = if distance.nearest(point, 0).is_inside { -1.0 } else { 1.0 };
                    let Some(way) = (point - nearest.on_triangle.point).try_normalize(1e-9) else { continue };
                    let is_held = cones.iter().any(|cone| may_hold(cone, way * outward, &mut state));
                    assert!(is_held, "no corner's faces make the gradient {way} at {point}");
                }
            }
        }
    }

    #[test]
    fn where_there_is_no_candidate_nothing_better_is_stated_than_what_holds_of_any_distance() {
        let mesh = bipyramid(5, 1.0, 0.5);
        let distance = MeshDistance::new(&mesh, None);
        let block = Block { center: Vector3::zeros(), half_side: 0.1 };
        let mut blocks = BlocksOfPlace::new(&distance, block, block.half_side, 1.0);
        let none = Measured { block, candidates: 0..0, most_error: MAX_ERROR };
        assert_eq!(blocks.error(&none), MAX_ERROR);
        assert_eq!(blocks.error_in_cells(&none, 1.0, 0.0), MAX_ERROR);
    }

    #[test]
    fn where_coordinates_are_rounded_far_out_a_cell_around_a_corner_states_as_much_as_near_the_origin() {
        let mut state = 21;
        println!("seed {state}");
        let points = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(Vector3::from);
        for far in [0.0, 1e6, 1e8, 1e9] {
            let points = points.map(|point| <[f64; 3]>::from(point + Vector3::new(far, 0.7 * far, -0.3 * far)));
            let mesh = TriangleMesh::new(&points, &[[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]).unwrap();
            let distance = MeshDistance::new(&mesh, None);
            for _ in 0..300 {
                let half_side = 0.004 + 0.004 * random(&mut state).abs();
                // The corner of three right angles is the middle of the last cell, but for rounding. No other is in the band.
                let rounding = random_vector(&mut state) * (4e-16 * far);
                let center = Vector3::from(points[0]).add_scalar(-0.5 * half_side) + rounding;
                let block = Block { center, half_side };
                let nearest = distance.nearest(block.center, 0);
                let mut blocks = BlocksOfPlace::new(&distance, block, half_side, nearest.distance);
                let asked = Query { block, distance: nearest.distance, slot: nearest.guess };
                let measured = blocks.measure(&[asked]);
                let error = blocks.error_in_cells(&measured[0], 0.05 * half_side, 0.0);
                assert!(error > 0.6, "{error} at {far}");
            }
        }
    }
}
