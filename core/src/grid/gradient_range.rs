use nalgebra::Vector3;

use super::trilinear::mix;
use super::{Grid, Storage};
use crate::Aabb;
use crate::enclosure::GradientBox;
use crate::number::interval::Interval;
use crate::number::{Float, Real};
use crate::vector::from_f64;

/// More cells say less of each and take longer to look at. Of 8, 27 and 64 the last took the fewest evaluations on triangles of
/// 20 voxels, and no more time on those of two.
const MAX_CELLS: u32 = 64;

/// What the interpolant and its gradients stay within in a box.
pub(super) struct GradientRange<R: Real> {
    pub range: Interval<R>,
    pub gradients: GradientBox<R>,
}

impl<S: Storage> Grid<S> {
    /// Cell by cell. `None` where the box reaches out of the grid or meets many cells, or a sample is no number.
    pub(super) fn gradient_range<R: Float>(&self, region: &Aabb) -> Option<GradientRange<R>> {
        if !self.lattice.bounds().encloses(region) {
            return None;
        }
        // A point on a face of a cell has the gradients of both sides, and rounding may put it on either.
        let reached = region.inflate(rounding::<R>(&[*region, self.lattice.bounds()]));
        let [first, last] = self.lattice.nodes_around(&reached)?;
        let count = (0..3).try_fold(1_u32, |n, axis| n.checked_mul(last[axis].checked_sub(first[axis])?));
        if count.is_none_or(|count| count > MAX_CELLS) {
            return None;
        }
        let in_cells =
            |point: [f64; 3]| (Vector3::from(point) - from_f64(self.lattice.origin())) * self.lattice.inv_spacing();
        let (low, high) = (in_cells(reached.min), in_cells(reached.max));
        let everything = R::from_f64(f64::INFINITY);
        let mut range = GradientRange {
            range: Interval { lower: everything, upper: -everything },
            gradients: GradientBox { lower: Vector3::repeat(everything), upper: Vector3::repeat(-everything) },
        };
        for z in first[2]..last[2] {
            for y in first[1]..last[1] {
                for x in first[0]..last[0] {
                    let corners = self.storage.corners([x, y, z]);
                    if !corners.iter().all(|sample| sample.is_finite()) {
                        return None;
                    }
                    let cell = Vector3::new(x, y, z).map(f64::from);
                    let part = [low, high].map(|end| (end - cell).map(|share| R::from_f64(share.clamp(0.0, 1.0))));
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

/// More than a coordinate may be off by rounding that is reckoned with in these boxes.
fn rounding<R: Real>(boxes: &[Aabb]) -> f64 {
    let coordinates = boxes.iter().flat_map(|of| of.min.iter().chain(&of.max));
    8.0 * R::EPSILON * coordinates.fold(0.0, |largest, x| largest.max(x.abs()))
}

impl<R: Float> GradientRange<R> {
    /// Part of a cell, from one share of its sides to another.
    fn include(&mut self, c: [R; 8], [from, to]: [Vector3<R>; 2]) {
        let along_x = [c[1] - c[0], c[3] - c[2], c[5] - c[4], c[7] - c[6]];
        let along_y = [c[2] - c[0], c[3] - c[1], c[6] - c[4], c[7] - c[5]];
        let along_z = [c[4] - c[0], c[5] - c[1], c[6] - c[2], c[7] - c[3]];
        let x = bilinear_range(along_x, [from.y, to.y], [from.z, to.z]);
        let y = bilinear_range(along_y, [from.x, to.x], [from.z, to.z]);
        let z = bilinear_range(along_z, [from.x, to.x], [from.y, to.y]);
        let slopes = |end: usize| Vector3::new(x[end], y[end], z[end]);
        self.gradients = self.gradients.hull(GradientBox { lower: slopes(0), upper: slopes(1) });
        for sample in c {
            self.range = self.range.hull(Interval { lower: sample, upper: sample });
        }
    }
}

/// The least and the greatest of what four corners of a square interpolate to in a part of it: at a corner of the part, for
/// it is linear along either side. The derivative of a trilinear interpolant along one axis is of this kind along the other two.
fn bilinear_range<R: Float>([c00, c10, c01, c11]: [R; 4], across: [R; 2], up: [R; 2]) -> [R; 2] {
    let mut range = [R::from_f64(f64::INFINITY), R::from_f64(f64::NEG_INFINITY)];
    for share in across {
        let (low, high) = (mix(c00, c10, share), mix(c01, c11, share));
        for share in up {
            let slope = mix(low, high, share);
            range = [Real::min(range[0], slope), Real::max(range[1], slope)];
        }
    }
    range
}
