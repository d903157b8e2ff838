//! The lines along which the planes of cell faces cut the triangle, eight at a time.
//!
//! A plane x_k = p has the corners at heights a_k − p, b_k − p, c_k − p. If their signs differ, one corner is alone
//! on its side; call its height s and another one's r. The cut ends on the edge between them, at the fraction s / (s
//! − r) from the lone corner.

use nalgebra::Vector3;

use super::LANES;
use super::grid_triangle::GridTriangle;
use crate::grid::exact::segment::Line;
use crate::number::{Float, Real};

/// Iterator over the cuts: planes across x first, then y, then z.
pub(super) struct CellFaceCuts<'a, R: Real> {
    triangle: &'a GridTriangle<R>,
    /// Number of the next plane, counted over all axes.
    next: u32,
    count: u32,
    lanes: CutLanes<R>,
}

/// Eight cuts. Vectors are by axis, weights by corner, then by lane.
struct CutLanes<R> {
    start: [[R; LANES]; 3],
    direction: [[R; LANES]; 3],
    end_weights: [[[R; LANES]; 3]; 2],
    /// 1 if all corners are on one side of the plane, so that there is no cut, else 0.
    is_disjoint: [R; LANES],
}

impl<'a, R: Float> CellFaceCuts<'a, R> {
    /// All cuts, or none unless `is_needed`.
    #[inline(always)]
    pub fn new(triangle: &'a GridTriangle<R>, is_needed: bool) -> Self {
        let [x, y, z] = triangle.face_plane_counts();
        let count = if is_needed { x.saturating_add(y).saturating_add(z) } else { 0 };
        Self { triangle, next: 0, count, lanes: CutLanes::zero() }
    }

    /// Computes the cuts of the planes from `next` on, one in each lane.
    #[cfg_attr(feature = "std", inline(always))]
    fn fill_lanes(&mut self) {
        let to_float = |number: u32| R::from_f64(f64::from(number));
        let next = to_float(self.next);
        let (counts, first) = (self.triangle.face_plane_counts().map(to_float), self.triangle.first_cell.map(to_float));
        let [a, b, c] = self.triangle.corners;
        let lanes = &mut self.lanes;
        for lane in 0..LANES {
            let (number, [first_y, first_z]) = (next + R::from_f64(lane as f64), [counts[0], counts[0] + counts[1]]);
            let (is_z, is_yz) = (first_z <= number, first_y <= number);
            let pick = |x: R, y: R, z: R| R::select(is_z, z, R::select(is_yz, y, x));
            let axis = pick(R::zero(), R::one(), R::from_f64(2.0));
            let plane =
                pick(first[0] + number, first[1] + (number - first_y), first[2] + (number - first_z)) + R::one();
            let corners = [pick(a.x, a.y, a.z), pick(b.x, b.y, b.z), pick(c.x, c.y, c.z)];
            let (end_weights, is_disjoint) = cut(corners.map(|corner| corner - plane));
            let points = end_weights.map(|weights| self.triangle.point(weights));
            for k in 0..3 {
                let is_across = axis == R::from_f64(k as f64);
                lanes.start[k][lane] = R::select(is_across, plane, points[0][k]);
                lanes.direction[k][lane] = R::select(is_across, R::zero(), points[1][k] - points[0][k]);
                (lanes.end_weights[0][k][lane], lanes.end_weights[1][k][lane]) = (end_weights[0][k], end_weights[1][k]);
            }
            lanes.is_disjoint[lane] = R::select(is_disjoint, R::one(), R::zero());
        }
    }
}

impl<R: Float> CutLanes<R> {
    #[inline(always)]
    fn zero() -> Self {
        Self {
            start: [[R::zero(); LANES]; 3],
            direction: [[R::zero(); LANES]; 3],
            end_weights: [[[R::zero(); LANES]; 3]; 2],
            is_disjoint: [R::zero(); LANES],
        }
    }
}

impl<R: Float> Iterator for CellFaceCuts<'_, R> {
    type Item = Line<R>;

    #[inline(always)]
    fn next(&mut self) -> Option<Line<R>> {
        while self.next < self.count {
            let lane = self.next as usize % LANES;
            if lane == 0 {
                self.fill_lanes();
            }
            self.next = self.next.saturating_add(1);
            let lanes = &self.lanes;
            if lanes.is_disjoint[lane] <= R::zero() {
                let components = |axes: &[[R; LANES]; 3]| [axes[0][lane], axes[1][lane], axes[2][lane]];
                let [start, direction] = [&lanes.start, &lanes.direction].map(|axes| Vector3::from(components(axes)));
                let end_weights = [components(&lanes.end_weights[0]), components(&lanes.end_weights[1])];
                return Some(Line { start, direction, end_weights, lower_bound: R::from_f64(f64::NEG_INFINITY) });
            }
        }
        None
    }
}

/// Barycentric weights of the two ends of a cut, from the corners' heights over the plane, and whether there is no
/// cut. The first end lies on the edge from the lone corner to its successor, the second on that to its predecessor.
#[cfg_attr(feature = "std", inline(always))]
fn cut<R: Float>([a, b, c]: [R; 3]) -> ([[R; 3]; 2], bool) {
    let (zero, one) = (R::zero(), R::one());
    let (is_a, is_b) = ((zero <= b) == (zero <= c), (zero <= a) == (zero <= c));
    let pick = |if_a: R, if_b: R, if_c: R| R::select(is_a, if_a, R::select(is_b, if_b, if_c));
    let lone = [pick(one, zero, zero), pick(zero, one, zero), pick(zero, zero, one)];
    let [first, second, third] = lone;
    let height = pick(a, b, c);
    let end = |other_height: R, other: [R; 3]| {
        let fraction = height / (height - other_height);
        [0, 1, 2].map(|k: usize| lone[k % 3] * (one - fraction) + other[k % 3] * fraction)
    };
    ([end(pick(b, c, a), [third, first, second]), end(pick(c, a, b), [second, third, first])], is_a & is_b)
}
