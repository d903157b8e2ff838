//! Intervals of φ and ∇φ over a box of a grid, from the samples of the few cells that it meets.
//!
//! In a cell ∂φ/∂x is the bilinear interpolant, in y and z, of the differences along the cell's four edges in x. A
//! bilinear function on a rectangle takes its extreme values at the corners, because it is linear along each side. So
//! the interval of ∂φ/∂x over a part of a cell is spanned by four values; likewise ∂φ/∂y and ∂φ/∂z. φ itself lies
//! between the lowest and the highest corner of the whole cell.

use nalgebra::Vector3;

use super::trilinear::mix;
use super::{Grid, Storage};
use crate::Aabb;
use crate::enclosure::GradientBox;
use crate::number::interval::Interval;
use crate::number::{Float, Real};
use crate::rounding::BOX_COORDINATE;
use crate::vector::from_f64;

/// Most cells per query. More cells take longer and give wider intervals. Of 8, 27 and 64, the last took the fewest
/// evaluations on triangles of 20 voxels, and no more time on those of two.
const MAX_CELLS: u32 = 64;

/// Intervals that hold every value and every gradient in a box.
pub(super) struct GradientRange<R: Real> {
    pub range: Interval<R>,
    pub gradients: GradientBox<R>,
}

impl<S: Storage> Grid<S> {
    /// `None` if the box leaves the grid or meets more than [`MAX_CELLS`] cells, or a sample is not finite.
    pub(super) fn gradient_range<R: Float>(&self, region: &Aabb) -> Option<GradientRange<R>> {
        if !self.lattice.bounds().encloses(region) {
            return None;
        }
        // A point on a face of a cell has the gradients of both sides, and rounding may put it on either.
        let region = region.inflate(coordinate_rounding::<R>(&[*region, self.lattice.bounds()]));
        let [first, last] = self.lattice.nodes_around(&region)?;
        let count = (0..3).try_fold(1_u32, |n, axis| n.checked_mul(last[axis].checked_sub(first[axis])?));
        if count.is_none_or(|count| count > MAX_CELLS) {
            return None;
        }
        let cell_coordinates =
            |point: [f64; 3]| (Vector3::from(point) - from_f64(self.lattice.origin())) * self.lattice.inv_spacing();
        let (lower, upper) = (cell_coordinates(region.min), cell_coordinates(region.max));
        let infinity = R::from_f64(f64::INFINITY);
        let mut range = GradientRange {
            range: Interval { lower: infinity, upper: -infinity },
            gradients: GradientBox { lower: Vector3::repeat(infinity), upper: Vector3::repeat(-infinity) },
        };
        for z in first[2]..last[2] {
            for y in first[1]..last[1] {
                for x in first[0]..last[0] {
                    let corners = self.storage.corners([x, y, z]);
                    if !corners.iter().all(|sample| sample.is_finite()) {
                        return None;
                    }
                    let cell = Vector3::new(x, y, z).map(f64::from);
                    let part = [lower, upper].map(|end| (end - cell).map(|x| R::from_f64(x.clamp(0.0, 1.0))));
                    range.include(corners.map(|sample| R::from_f64(f64::from(sample))), part);
                }
            }
        }
        let inv_spacing = R::from_f64(self.lattice.inv_spacing());
        range.gradients.lower *= inv_spacing;
        range.gradients.upper *= inv_spacing;
        Some(range)
    }
}

/// Bound of the rounding of a coordinate of these boxes.
fn coordinate_rounding<R: Real>(boxes: &[Aabb]) -> f64 {
    let coordinates = boxes.iter().flat_map(|bounds| bounds.min.iter().chain(&bounds.max));
    BOX_COORDINATE * R::EPSILON * coordinates.fold(0.0, |largest, x| largest.max(x.abs()))
}

impl<R: Float> GradientRange<R> {
    /// Extends the intervals by a part of a cell, from `lower` to `upper` as fractions of its sides.
    fn include(&mut self, c: [R; 8], [lower, upper]: [Vector3<R>; 2]) {
        let along_x = [c[1] - c[0], c[3] - c[2], c[5] - c[4], c[7] - c[6]];
        let along_y = [c[2] - c[0], c[3] - c[1], c[6] - c[4], c[7] - c[5]];
        let along_z = [c[4] - c[0], c[5] - c[1], c[6] - c[2], c[7] - c[3]];
        let x = bilinear_range(along_x, [lower.y, upper.y], [lower.z, upper.z]);
        let y = bilinear_range(along_y, [lower.x, upper.x], [lower.z, upper.z]);
        let z = bilinear_range(along_z, [lower.x, upper.x], [lower.y, upper.y]);
        let gradient = |end: usize| Vector3::new(x[end], y[end], z[end]);
        self.gradients = self.gradients.hull(GradientBox { lower: gradient(0), upper: gradient(1) });
        for sample in c {
            self.range = self.range.hull(Interval { lower: sample, upper: sample });
        }
    }
}

/// \[lower, upper\] of the bilinear interpolant of four corners over the rectangle `xs` × `ys`.
fn bilinear_range<R: Float>([c00, c10, c01, c11]: [R; 4], xs: [R; 2], ys: [R; 2]) -> [R; 2] {
    let mut range = [R::from_f64(f64::INFINITY), R::from_f64(f64::NEG_INFINITY)];
    for x in xs {
        let (low, high) = (mix(c00, c10, x), mix(c01, c11, x));
        for y in ys {
            let value = mix(low, high, y);
            range = [Real::min(range[0], value), Real::max(range[1], value)];
        }
    }
    range
}
