//! Sixteen triangles side by side, and how they look from one point.

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

impl View {
    /// Squared distance and offset of one lane.
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> (f32, [f32; 3]) {
        (self.distances_sq[lane], [self.offsets[0][lane], self.offsets[1][lane], self.offsets[2][lane]])
    }

    /// Unit normals of the planes beyond which no triangle has a point, and the point's heights over them less `margin`.
    /// Both are zero where the triangle is nearer than `min_distance`.
    #[inline(always)]
    pub fn supporting_planes(&self, min_distance: f32, margin: f32) -> [Wide; 4] {
        let mut planes = [[0.0; WIDTH]; 4];
        for lane in 0..WIDTH {
            let distance = self.distances_sq[lane].sqrt();
            let inv = if distance > min_distance { 1.0 / distance } else { 0.0 };
            for axis in 0..3 {
                planes[axis][lane] = self.offsets[axis][lane] * inv;
            }
            planes[3][lane] = if distance > min_distance { distance - margin } else { -margin };
        }
        planes
    }
}

impl PackedTriangles {
    /// Takes sixteen triangles over, seen from the point at `offset` from the block's middle. Returns the sizes of their
    /// coordinates, to which rounding is relative.
    #[inline(always)]
    pub fn load(&mut self, triangles: &[TriangleFrame], indices: &[u32; WIDTH], offset: [f32; 3]) -> Wide {
        let mut rest = [[0.0; WIDTH]; 3];
        for lane in 0..WIDTH {
            let triangle = &triangles[indices[lane] as usize];
            for axis in 0..3 {
                self.middle[axis][lane] = triangle.middle[axis];
                rest[axis][lane] = triangle.middle_rest[axis];
                for coordinate in 0..3 {
                    self.axes[axis][coordinate][lane] = triangle.plane.axes[axis][coordinate];
                }
            }
            let Shape { b, c, inv_ac_sq, inv_bc_sq, bc_x } = triangle.plane.shape;
            for (field, value) in self.shape.iter_mut().zip([b, c[0], c[1], inv_ac_sq, inv_bc_sq, bc_x]) {
                field[lane] = value;
            }
            self.outward[lane] = triangle.plane.outward;
        }
        let mut sizes = self.shape[0];
        for axis in 0..3 {
            let mut moved = [0.0; WIDTH];
            for lane in 0..WIDTH {
                let along = |coordinate: usize| self.axes[axis][coordinate][lane];
                let by = offset[0]
                    .mul_add(along(0), offset[1].mul_add(along(1), offset[2].mul_add(along(2), rest[axis][lane])));
                moved[lane] = self.middle[axis][lane] + by;
            }
            for lane in 0..WIDTH {
                sizes[lane] += moved[lane].abs();
            }
            self.middle[axis] = moved;
        }
        sizes
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

    /// Squared distances of sixteen points to the triangle of one lane, and their heights over its plane, outward.
    #[inline(always)]
    pub fn measure(&self, lane: usize, points: &[Wide; 3]) -> (Wide, Wide) {
        let (shape, outward) = (self.shape(lane), self.outward[lane]);
        let (mut distances_sq, mut heights) = ([0.0; WIDTH], [0.0; WIDTH]);
        for point in 0..WIDTH {
            let at = [points[0][point], points[1][point], points[2][point]];
            let (u, v) = (self.coordinate(0, lane, at), self.coordinate(1, lane, at));
            let w = self.coordinate(2, lane, at);
            distances_sq[point] = w.mul_add(w, planar_distance_sq(u, v, &shape));
            heights[point] = w * outward;
        }
        (distances_sq, heights)
    }
}
