//! By how much the trilinear interpolant of exact distances is off, cell by cell. The proof stands in
//! `docs/error-bounds.md`; the letters here are the same.

use std::ops::Range;

use sdf_core::nalgebra::Vector3;

use crate::MeshDistance;
use crate::gradient_spread::{MOST_ERROR, Normals, error_in_cones};
use crate::nearby::{Nearby, ToCenter};

/// A cube.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    pub center: Vector3<f64>,
    pub half_side: f64,
}

/// Nodes stand where f64 has room for them: their rounding is this much of a block at most.
pub(crate) const PLACE_ROUNDING: f64 = 1e-6;

/// What two sheets face to face come to, in spacings. Above it, it is worth the time to look at what meets at each corner of
/// the mesh by itself.
const OF_TWO_SHEETS: f64 = 0.5;

/// The blocks of one place, and the triangles around them.
pub(crate) struct Blocks<'a> {
    mesh: &'a MeshDistance<'a>,
    around: Nearby<'a>,
    in_block: Nearby<'a>,
    /// Triangles of the tree, of block after block.
    candidates: Vec<u32>,
    of_cell: Vec<u32>,
    normals: Normals,
}

/// A block, and where its candidates stand.
#[derive(Clone, Debug)]
pub(crate) struct Measured {
    pub block: Block,
    candidates: Range<usize>,
    to_center: Option<ToCenter>,
}

impl<'a> Blocks<'a> {
    /// For blocks with so long a half side and their centers in a cube. None of these is farther from the surface than
    /// `distance`.
    pub fn new(mesh: &'a MeshDistance<'a>, centers: Block, half_side: f64, distance: f64) -> Self {
        let [around, in_block] = [0, 1].map(|_| Nearby::new(mesh.tree()));
        let (candidates, of_cell, normals) = (vec![], vec![], Normals::default());
        let mut blocks = Self { mesh, around, in_block, candidates, of_cell, normals };
        let way = 3.0_f64.sqrt() * (centers.half_side + 2.0 * half_side);
        blocks.around.gather(centers.center, distance + way);
        blocks
    }

    /// Finds the triangles that can be nearest to a point of a block. `distance` is that at the block's center.
    pub fn measure(&mut self, block: Block, distance: f64) -> Measured {
        let from = self.candidates.len();
        let most = distance + 2.0 * 3.0_f64.sqrt() * block.half_side * (1.0 + PLACE_ROUNDING);
        let to_center = self.around.candidates(block, [distance, most], &mut self.candidates);
        Measured { block, candidates: from..self.candidates.len(), to_center }
    }

    /// The triangles that can be nearest.
    #[cfg(test)]
    pub fn candidates(&self, of: &Measured) -> &[u32] {
        &self.candidates[of.candidates.clone()]
    }

    /// The most by which the interpolant of exact distances is off, in spacings, in a block's cells.
    pub fn error(&mut self, of: &Measured) -> f64 {
        self.mesh.normals(&self.candidates[of.candidates.clone()], &mut self.normals);
        error_in_cones(std::slice::from_ref(&self.normals))
    }

    /// The same in each of the eight cells of a block, where fewer triangles can be nearest, as far as the cells come `within`
    /// so much of the surface.
    pub fn error_in_cells(&mut self, of: &Measured, within: f64) -> f64 {
        let Self { mesh, in_block, candidates, of_cell, normals, .. } = self;
        let Some(to_center) = of.to_center else { return MOST_ERROR };
        in_block.clear();
        candidates[of.candidates.clone()].iter().for_each(|slot| in_block.push(*slot as usize));
        in_block.group();
        let half_side = 0.5 * of.block.half_side;
        let mut most = 0.0_f64;
        for cell in 0..8 {
            let step = Vector3::from_fn(|axis, _| if cell >> axis & 1 == 0 { -half_side } else { half_side });
            let cell = Block { center: of.block.center + step, half_side };
            of_cell.clear();
            let distance = (to_center.way + step).norm();
            let Some(to_center) = in_block.candidates(cell, [distance, f64::INFINITY], of_cell) else { continue };
            if to_center.distance_sq.sqrt() > within + 3.0_f64.sqrt() * half_side * (1.0 + PLACE_ROUNDING) {
                continue;
            }
            mesh.normals(of_cell, normals);
            let of_all = error_in_cones(std::slice::from_ref(normals));
            let error = if of_all <= OF_TWO_SHEETS { of_all } else { of_all.min(mesh.error_by_corners(of_cell)) };
            most = most.max(error);
        }
        most
    }
}

impl MeshDistance<'_> {
    fn normals(&self, candidates: &[u32], normals: &mut Normals) {
        normals.clear();
        candidates.iter().for_each(|slot| normals.push(self.normal(*slot)));
    }

    /// Zero where a triangle has none that is sure.
    fn normal(&self, slot: u32) -> Vector3<f64> {
        let known = self.normals_of_one_solid();
        known.map_or_else(Vector3::zeros, |known| known.inside(self.tree().triangles[slot as usize]))
    }

    /// Whatever is nearest, a face, an edge or a corner: the faces that meet there meet at one of its corners.
    fn error_by_corners(&self, candidates: &[u32]) -> f64 {
        error_in_cones(&self.by_corners(candidates))
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
    use crate::gradient_spread::tests::{may_hold, random, random_vector};

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
                let to_center = distance.nearest(center, 0).distance;
                let mut blocks = Blocks::new(&distance, block, block.half_side, to_center);
                let measured = blocks.measure(block, to_center);
                let candidates = blocks.candidates(&measured);
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
}
