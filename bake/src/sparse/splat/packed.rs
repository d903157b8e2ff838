//! Sixteen triangles side by side, and how they look from one point.

use sdf_core::nalgebra::Vector3;

use super::frame::{Shape, TriangleFrame, planar_distance_sq, planar_offset};

/// Numbers per register: sixteen `f32` fill 512 bits.
pub(super) const WIDTH: usize = 16;

pub(super) type Wide = [f32; WIDTH];

/// Triangles relative to one point, the middle of a brick. Lengths are in voxels.
#[derive(Clone, Copy, Default)]
pub(super) struct PackedTriangles {
    /// Coordinates of the point in the frame of each triangle.
    middle: [Wide; 3],
    /// u, v and n of each, by coordinate.
    axes: [[Wide; 3]; 3],
    shape: [Wide; 6],
    outward: Wide,
}

/// Squared distances to sixteen triangles from one point, and its offsets from their nearest points.
#[derive(Clone, Copy, Default)]
pub(super) struct View {
    pub distances_sq: Wide,
    pub offsets: [Wide; 3],
}

impl PackedTriangles {
    /// Places a triangle in a lane. Returns the size of its coordinates, to which rounding is relative.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, triangle: &TriangleFrame, middle: Vector3<f64>, inv_spacing: f64) -> f32 {
        let middle = triangle.coordinates(middle, inv_spacing);
        let Shape { b, c, inv_ac_sq, inv_bc_sq, bc_x } = triangle.shape;
        for axis in 0..3 {
            self.middle[axis][lane] = middle[axis] as f32;
            for coordinate in 0..3 {
                self.axes[axis][coordinate][lane] = triangle.axes[axis][coordinate] as f32;
            }
        }
        for (field, value) in self.shape.iter_mut().zip([b, c[0], c[1], inv_ac_sq, inv_bc_sq, bc_x]) {
            field[lane] = value;
        }
        self.outward[lane] = triangle.outward;
        middle.iter().map(|x| x.abs() as f32).sum::<f32>() + b
    }

    /// Copies one lane of another pack.
    #[inline(always)]
    pub fn copy(&mut self, lane: usize, from: &Self, from_lane: usize) {
        for axis in 0..3 {
            self.middle[axis][lane] = from.middle[axis][from_lane];
            for coordinate in 0..3 {
                self.axes[axis][coordinate][lane] = from.axes[axis][coordinate][from_lane];
            }
        }
        for (field, from) in self.shape.iter_mut().zip(&from.shape) {
            field[lane] = from[from_lane];
        }
        self.outward[lane] = from.outward[from_lane];
    }

    #[inline(always)]
    fn shape(&self, lane: usize) -> Shape {
        let [b, c_x, c_y, inv_ac_sq, inv_bc_sq, bc_x] = &self.shape;
        Shape {
            b: b[lane],
            c: [c_x[lane], c_y[lane]],
            inv_ac_sq: inv_ac_sq[lane],
            inv_bc_sq: inv_bc_sq[lane],
            bc_x: bc_x[lane],
        }
    }

    #[inline(always)]
    fn axis(&self, axis: usize, lane: usize) -> [f32; 3] {
        [self.axes[axis][0][lane], self.axes[axis][1][lane], self.axes[axis][2][lane]]
    }

    #[inline(always)]
    fn coordinate(&self, axis: usize, lane: usize, [x, y, z]: [f32; 3]) -> f32 {
        let [a, b, c] = self.axis(axis, lane);
        x.mul_add(a, y.mul_add(b, z.mul_add(c, self.middle[axis][lane])))
    }

    /// Unit normals out of the solid, of a lane; zero if unknown.
    #[inline(always)]
    pub fn normal(&self, lane: usize) -> [f32; 3] {
        self.axis(2, lane).map(|n| n * self.outward[lane])
    }

    /// Looks at all sixteen from a point relative to the brick's middle.
    #[inline(always)]
    pub fn view(&self, from: [f32; 3], view: &mut View) {
        let mut now = View::default();
        for lane in 0..WIDTH {
            let (u, v) = (self.coordinate(0, lane, from), self.coordinate(1, lane, from));
            let w = self.coordinate(2, lane, from);
            let [in_plane, du, dv] = planar_offset(u, v, &self.shape(lane));
            now.distances_sq[lane] = w.mul_add(w, in_plane);
            let (axis_u, axis_v, axis_n) = (self.axis(0, lane), self.axis(1, lane), self.axis(2, lane));
            for axis in 0..3 {
                now.offsets[axis][lane] = w.mul_add(axis_n[axis], du.mul_add(axis_u[axis], dv * axis_v[axis]));
            }
        }
        *view = now;
    }

    /// Squared distances of all sixteen from a point relative to the brick's middle.
    #[inline(always)]
    pub fn distances_sq_from(&self, from: [f32; 3]) -> Wide {
        let mut distances_sq = [0.0; WIDTH];
        for lane in 0..WIDTH {
            let (u, v) = (self.coordinate(0, lane, from), self.coordinate(1, lane, from));
            let w = self.coordinate(2, lane, from);
            distances_sq[lane] = w.mul_add(w, planar_distance_sq(u, v, &self.shape(lane)));
        }
        distances_sq
    }

    /// Squared distances of sixteen points to the triangle of one lane.
    #[inline(always)]
    pub fn distances_sq(&self, lane: usize, points: &[Wide; 3]) -> Wide {
        let shape = self.shape(lane);
        let mut distances_sq = [0.0; WIDTH];
        for point in 0..WIDTH {
            let at = [points[0][point], points[1][point], points[2][point]];
            let (u, v) = (self.coordinate(0, lane, at), self.coordinate(1, lane, at));
            let w = self.coordinate(2, lane, at);
            distances_sq[point] = w.mul_add(w, planar_distance_sq(u, v, &shape));
        }
        distances_sq
    }
}
