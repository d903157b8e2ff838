//! By how much the trilinear interpolant of exact distances is off, cell by cell. The proof stands in
//! `docs/error-bounds.md`; the letters here are the same.

use sdf_core::nalgebra::Vector3;

use crate::MeshDistance;
use crate::gradient_spread::error_in_cones;
use crate::triangle::{NearestOnTriangle, nearest_on_triangle};

/// A cube.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Block {
    pub center: Vector3<f64>,
    pub half_side: f64,
}

/// A triangle of the tree, and what of it is nearest to a block's center.
pub(crate) type Candidate = (usize, NearestOnTriangle);

/// Nodes stand where f64 has room for them: their rounding is this much of a block at most.
const PLACE_ROUNDING: f64 = 1e-6;

/// What two sheets face to face come to, in spacings. Above it, it is worth the time to look at what meets at each corner of
/// the mesh by itself.
const OF_TWO_SHEETS: f64 = 0.5;

impl MeshDistance<'_> {
    /// The triangles that can be nearest to a point of a block. `distance` is that at the block's center.
    pub(crate) fn candidates(&self, block: Block, distance: f64) -> Vec<Candidate> {
        let most = distance + 2.0 * 3.0_f64.sqrt() * block.half_side * (1.0 + PLACE_ROUNDING);
        let mut found = vec![];
        self.tree().within(block.center, most * most, |slot, on_triangle| found.push((slot, on_triangle)));
        prune(block, found)
    }

    /// The most by which the interpolant of exact distances is off, in spacings, in cells where no other triangles than
    /// these can be nearest.
    pub(crate) fn error_among(&self, candidates: &[Candidate]) -> f64 {
        error_in_cones(&[&self.normals(candidates)])
    }

    /// The same in each of the eight cells of a block with these candidates, where fewer of them can be nearest, as far as
    /// the cells come `within` so much of the surface.
    pub(crate) fn error_in_cells(&self, block: Block, of_block: &[Candidate], within: f64) -> f64 {
        let half_side = 0.5 * block.half_side;
        let of_cell = |cell: usize| {
            let step = Vector3::from_fn(|axis, _| if cell >> axis & 1 == 0 { -half_side } else { half_side });
            let cell = Block { center: block.center + step, half_side };
            let measure = |(slot, _): &Candidate| (*slot, nearest_on_triangle(cell.center, self.tree().corners[*slot]));
            let candidates = prune(cell, of_block.iter().map(measure).collect());
            let nearest =
                candidates.iter().map(|(_, on_triangle)| on_triangle.distance_sq).fold(f64::INFINITY, f64::min);
            if nearest.sqrt() > within + 3.0_f64.sqrt() * half_side * (1.0 + PLACE_ROUNDING) {
                return 0.0;
            }
            let normals = self.normals(&candidates);
            let of_all = error_in_cones(&[&normals]);
            if of_all <= OF_TWO_SHEETS { of_all } else { of_all.min(self.error_by_corners(&candidates, &normals)) }
        };
        (0..8).map(of_cell).fold(0.0, f64::max)
    }

    /// Zero where a triangle has none that is sure.
    fn normals(&self, candidates: &[Candidate]) -> Vec<Vector3<f64>> {
        let normal = |slot: usize| {
            self.normals_of_one_solid()
                .map_or_else(Vector3::zeros, |normals| normals.inside(self.tree().triangles[slot]))
        };
        candidates.iter().map(|(slot, _)| normal(*slot)).collect()
    }

    /// Whatever is nearest, a face, an edge or a corner: the faces that meet there meet at one of its corners.
    fn error_by_corners(&self, candidates: &[Candidate], normals: &[Vector3<f64>]) -> f64 {
        let normals = self.by_corners(candidates, normals);
        let around_corners = normals.chunk_by(|a, b| a.0 == b.0);
        let cones: Vec<Vec<Vector3<f64>>> =
            around_corners.map(|around| around.iter().map(|(_, normal)| *normal).collect()).collect();
        error_in_cones(&cones.iter().map(|cone| &cone[..]).collect::<Vec<_>>())
    }

    /// Each normal once for each corner of its triangle, those of a corner together.
    fn by_corners(&self, candidates: &[Candidate], normals: &[Vector3<f64>]) -> Vec<(u32, Vector3<f64>)> {
        let corners =
            |((slot, _), normal): (&Candidate, &Vector3<f64>)| self.points_of(*slot).map(|point| (point, *normal));
        let mut by_corner: Vec<(u32, Vector3<f64>)> = candidates.iter().zip(normals).flat_map(corners).collect();
        by_corner.sort_by_key(|(corner, _)| *corner);
        by_corner
    }
}

/// Without those that cannot be nearest to any point of the block.
///
/// A point x = c + v of it, v·v ≤ ρ², is no farther from the triangle nearest to c, at D with direction e from there to c,
/// than √(D² + 2D v·e + ρ²) ≤ A + k v·e, where A = √(D² + ρ²) and k = D/A; and from any other, at d with direction f, it is at
/// least d + v·f away, as that lies behind the plane across f.
fn prune(block: Block, mut candidates: Vec<Candidate>) -> Vec<Candidate> {
    let nearest = candidates.iter().min_by(|a, b| a.1.distance_sq.total_cmp(&b.1.distance_sq));
    let Some((_, nearest)) = nearest.copied() else { return candidates };
    let toward = |of: &NearestOnTriangle| (block.center - of.point).try_normalize(0.0).unwrap_or_default();
    let half_side = block.half_side * (1.0 + PLACE_ROUNDING);
    let hypotenuse = (nearest.distance_sq + 3.0 * half_side * half_side).sqrt();
    let slope = toward(&nearest) * (nearest.distance_sq.sqrt() / hypotenuse);
    candidates.retain(|(_, on_triangle)| {
        let way = half_side * (slope - toward(on_triangle)).abs().sum();
        on_triangle.distance_sq.sqrt() <= (hypotenuse + way) * (1.0 + PLACE_ROUNDING)
    });
    candidates
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
                let candidates = distance.candidates(block, distance.nearest(center, 0).distance);
                let normals = distance.normals(&candidates);
                let by_corners = distance.by_corners(&candidates, &normals);
                for _ in 0..10 {
                    let point = center + random_vector(&mut state) * block.half_side;
                    let nearest = distance.tree().nearest(point, 0);
                    assert!(candidates.iter().any(|(slot, _)| *slot == nearest.slot), "{point} of {block:?}");
                    let outward = if distance.nearest(point, 0).is_inside { -1.0 } else { 1.0 };
                    let Some(way) = (point - nearest.on_triangle.point).try_normalize(1e-9) else { continue };
                    let mut cones = by_corners
                        .chunk_by(|a, b| a.0 == b.0)
                        .map(|around| around.iter().map(|(_, normal)| *normal).collect::<Vec<_>>());
                    let is_held = cones.any(|cone| may_hold(&cone, way * outward, &mut state));
                    assert!(is_held, "no corner's faces make the gradient {way} at {point}");
                }
            }
        }
    }
}
