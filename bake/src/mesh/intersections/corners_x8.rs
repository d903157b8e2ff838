//! Boxes and planes of many pairs of triangles at once: which cannot be told apart by them?

use sdf_core::Aabb;

use super::{Corners, Plane};
use crate::rounding::{DETERMINANT_ROUNDING, FOLD_SINE, MIN_VOLUME};
use crate::simd::{LANES, Lanes, VectorX8, bits_of, dot, max, min};

/// Finds the triangles after one in the tree that are [not apart](CornersX8::not_apart) from it, without those
/// [apart by their own planes](CornersX8::apart_by_own_planes) and, with `ignores_apart`,
/// [around a corner](CornersX8::apart_around_corner), dispatched to the instruction set of the machine.
pub(super) struct FindNotApart<'a> {
    pub triangles: &'a [CornersX8],
    /// Slots of the triangles.
    pub slots: &'a [usize],
    pub bounds: &'a Aabb,
    pub plane: &'a Plane,
    pub triangle: Corners<'a>,
    pub slot: usize,
    pub ignores_apart: bool,
    /// Triangles within it are not apart.
    pub gap: f64,
    /// Slots of those found.
    pub found: &'a mut Vec<usize>,
}

impl pulp::NullaryFnOnce for FindNotApart<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        // Few of eight are left by box and plane: these are brought together.
        let mut left = Left { triangles: CornersX8::NONE, slots: [0; LANES], count: 0 };
        for (triangles, slots) in self.triangles.iter().zip(self.slots.chunks(LANES)) {
            let mut mask = triangles.not_apart(self.bounds, self.plane, self.triangle.0);
            while mask != 0 {
                let lane = mask.trailing_zeros() as usize;
                mask &= mask - 1;
                // Pairs are found from the first of both.
                if slots[lane] > self.slot {
                    left.push(triangles, lane, slots[lane]);
                }
                if left.count == LANES {
                    left.drain(self.triangle, self.ignores_apart, self.gap, self.found);
                }
            }
        }
        left.drain(self.triangle, self.ignores_apart, self.gap, self.found);
    }
}

/// Triangles that box and plane leave, side by side.
struct Left {
    triangles: CornersX8,
    slots: [usize; LANES],
    count: usize,
}

impl Left {
    #[inline(always)]
    fn push(&mut self, triangles: &CornersX8, lane: usize, slot: usize) {
        for corner in 0..3 {
            self.triangles.points[corner][self.count] = triangles.points[corner][lane];
            for axis in 0..3 {
                self.triangles.positions[corner][axis][self.count] = triangles.positions[corner][axis][lane];
            }
        }
        self.slots[self.count] = slot;
        self.count += 1;
    }

    /// Empties it into the slots of those that are not apart from a triangle by other planes either.
    #[inline(always)]
    fn drain(&mut self, triangle: Corners, ignores_apart: bool, gap: f64, found: &mut Vec<usize>) {
        let mut mask = (1 << self.count) - 1;
        if mask != 0 {
            mask &= !self.triangles.apart_by_own_planes(triangle, gap);
        }
        if ignores_apart && mask != 0 {
            mask &= !self.triangles.apart_around_corner(triangle);
        }
        while mask != 0 {
            found.push(self.slots[mask.trailing_zeros() as usize]);
            mask &= mask - 1;
        }
        self.count = 0;
    }
}

/// Eight triangles side by side. Lanes after the last hold NaN.
pub(super) struct CornersX8 {
    points: [Lanes<u64>; 3],
    positions: [VectorX8<f64>; 3],
}

impl CornersX8 {
    const NONE: Self = Self { points: [[0; LANES]; 3], positions: [[[f64::NAN; LANES]; 3]; 3] };

    pub fn new<'a>(slots: &[usize], corners: impl Fn(usize) -> Corners<'a>) -> Self {
        let mut all = Self::NONE;
        for (lane, slot) in slots.iter().enumerate() {
            let (points, positions) = corners(*slot);
            for corner in 0..3 {
                all.points[corner][lane] = points[corner].into();
                for axis in 0..3 {
                    all.positions[corner][axis][lane] = positions[corner][axis];
                }
            }
        }
        all
    }

    /// Bits of the triangles whose boxes meet a box, and whose corners, except for those of some points, a plane does not certainly have
    /// all on one side.
    #[inline(always)]
    fn not_apart(&self, bounds: &Aabb, plane: &Plane, points: &[u32; 3]) -> u32 {
        let points = points.map(u64::from);
        let mut is_kept = [false; LANES];
        for lane in 0..LANES {
            let mut meets = true;
            for axis in 0..3 {
                let [a, b, c] = [0, 1, 2].map(|corner: usize| self.positions[corner][axis][lane]);
                meets &= (bounds.min[axis] <= max(max(a, b), c)) & (min(min(a, b), c) <= bounds.max[axis]);
            }
            let (mut are_above, mut are_below, mut is_any) = (true, true, false);
            for corner in 0..3 {
                let point = self.points[corner][lane];
                let is_shared = (point == points[0]) | (point == points[1]) | (point == points[2]);
                let offset = [0, 1, 2].map(|axis: usize| self.positions[corner][axis][lane] - plane.origin[axis]);
                let side = dot(plane.normal.into(), offset);
                let rounding = dot(plane.rounding.into(), offset.map(f64::abs)) + plane.slack;
                are_above &= is_shared | (side > rounding);
                are_below &= is_shared | (side < -rounding);
                is_any |= !is_shared;
            }
            is_kept[lane] = meets & !(is_any & (are_above | are_below));
        }
        bits_of(&is_kept)
    }

    /// Bits of the triangles whose own planes certainly have all corners of another, except for those that both share, on one side.
    #[inline(always)]
    pub fn apart_by_own_planes(&self, (points, corners): Corners, gap: f64) -> u32 {
        let [first, second, third] = &self.positions;
        let (mut normal, mut rounding, mut slack) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3], [MIN_VOLUME; LANES]);
        // As in `Plane::new`.
        for axis in 0..3 {
            let (next, last) = ((axis + 1) % 3, (axis + 2) % 3);
            for lane in 0..LANES {
                let positive = (second[next][lane] - first[next][lane]) * (third[last][lane] - first[last][lane]);
                let negative = (second[last][lane] - first[last][lane]) * (third[next][lane] - first[next][lane]);
                normal[axis][lane] = positive - negative;
                rounding[axis][lane] = (positive.abs() + negative.abs()) * DETERMINANT_ROUNDING;
                slack[lane] += normal[axis][lane].abs() * gap;
            }
        }
        let (mut are_above, mut are_below, mut is_any) = ([true; LANES], [true; LANES], [false; LANES]);
        for (point, corner) in points.iter().zip(corners) {
            let point = u64::from(*point);
            for lane in 0..LANES {
                let is_shared =
                    (point == self.points[0][lane]) | (point == self.points[1][lane]) | (point == self.points[2][lane]);
                let x = corner.x - first[0][lane];
                let y = corner.y - first[1][lane];
                let z = corner.z - first[2][lane];
                let side = normal[0][lane] * x + normal[1][lane] * y + normal[2][lane] * z;
                let error = rounding[0][lane] * x.abs() + rounding[1][lane] * y.abs() + rounding[2][lane] * z.abs();
                are_above[lane] &= is_shared | (side > error + slack[lane]);
                are_below[lane] &= is_shared | (side < -(error + slack[lane]));
                is_any[lane] |= !is_shared;
            }
        }
        let mut is_apart = [false; LANES];
        for lane in 0..LANES {
            is_apart[lane] = is_any[lane] & (are_above[lane] | are_below[lane]);
        }
        bits_of(&is_apart)
    }

    /// Bits of the triangles that share one corner with another and are certainly apart from it but for that corner
    /// ([`are_apart_across_centroids`](super::are_apart_across_centroids)), by more than [`FOLD_SINE`].
    #[inline(always)]
    pub fn apart_around_corner(&self, (points, corners): Corners) -> u32 {
        let [p, q, r] = points.map(u64::from);
        let [a, b, c]: [[f64; 3]; 3] = [corners[0].into(), corners[1].into(), corners[2].into()];
        let own_sum = [a[0] + b[0] + c[0], a[1] + b[1] + c[1], a[2] + b[2] + c[2]];
        let mut is_apart = [false; LANES];
        let (mut origin, mut normal) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
        for lane in 0..LANES {
            let is_shared = |point: u64| {
                (point == self.points[0][lane]) | (point == self.points[1][lane]) | (point == self.points[2][lane])
            };
            let (is_p, is_q, is_r) = (is_shared(p), is_shared(q), is_shared(r));
            is_apart[lane] = u8::from(is_p) + u8::from(is_q) + u8::from(is_r) == 1;
            for axis in 0..3 {
                let q_or_r = if is_q { b[axis] } else { c[axis] };
                origin[axis][lane] = if is_p { a[axis] } else { q_or_r };
            }
        }
        // As in `midway`.
        for lane in 0..LANES {
            let offset = |axis: usize| own_sum[axis] - 3.0 * origin[axis][lane];
            let other_offset = |axis: usize| {
                let [first, second, third] = &self.positions;
                first[axis][lane] + second[axis][lane] + third[axis][lane] - 3.0 * origin[axis][lane]
            };
            let (x, y, z) = (offset(0), offset(1), offset(2));
            let (u, v, w) = (other_offset(0), other_offset(1), other_offset(2));
            let (own, other) = ((x * x + y * y + z * z).sqrt(), (u * u + v * v + w * w).sqrt());
            normal[0][lane] = u * own - x * other;
            normal[1][lane] = v * own - y * other;
            normal[2][lane] = w * own - z * other;
        }
        for (point, corner) in [(p, a), (q, b), (r, c)] {
            for lane in 0..LANES {
                let is_shared =
                    (point == self.points[0][lane]) | (point == self.points[1][lane]) | (point == self.points[2][lane]);
                let [side, rounding] = side_of([&normal, &origin], lane, corner);
                is_apart[lane] &= is_shared | (side < -rounding);
            }
        }
        for (points, positions) in self.points.iter().zip(&self.positions) {
            for lane in 0..LANES {
                let is_shared = (points[lane] == p) | (points[lane] == q) | (points[lane] == r);
                let [x, y, z] = positions;
                let [side, rounding] = side_of([&normal, &origin], lane, [x[lane], y[lane], z[lane]]);
                is_apart[lane] &= is_shared | (side > rounding);
            }
        }
        bits_of(&is_apart)
    }
}

/// normal · (point − origin) in one lane, and how much of it a point may have that is nearly in the plane.
#[inline(always)]
fn side_of([normal, origin]: [&VectorX8<f64>; 2], lane: usize, point: [f64; 3]) -> [f64; 2] {
    let x = normal[0][lane] * (point[0] - origin[0][lane]);
    let y = normal[1][lane] * (point[1] - origin[1][lane]);
    let z = normal[2][lane] * (point[2] - origin[2][lane]);
    [x + y + z, (x.abs() + y.abs() + z.abs()) * FOLD_SINE + MIN_VOLUME]
}
