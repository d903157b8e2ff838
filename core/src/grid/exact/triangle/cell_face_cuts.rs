use nalgebra::Vector3;

use super::cells::LANES;
use super::face::Face;
use crate::grid::exact::segment::Line;
use crate::number::{Float, Real};

/// Where faces of cells cross a triangle, axis by axis, reckoned several side by side.
pub(super) struct CellFaceCuts<'a, R: Real> {
    face: &'a Face<R>,
    /// Of the lines, the next, counted over all axes.
    next: u32,
    count: u32,
    lines: Lines<R>,
}

/// Each by axis or corner.
struct Lines<R> {
    from: [[R; LANES]; 3],
    way: [[R; LANES]; 3],
    ends: [[[R; LANES]; 3]; 2],
    /// 1 where there is no line, for all corners are on one side, else 0.
    is_apart: [R; LANES],
}

impl<'a, R: Float> CellFaceCuts<'a, R> {
    /// All of them, or none.
    #[inline(always)]
    pub fn new(face: &'a Face<R>, all: bool) -> Self {
        let [x, y, z] = face.planes();
        Self { face, next: 0, count: if all { x.saturating_add(y).saturating_add(z) } else { 0 }, lines: Lines::none() }
    }

    /// The next several.
    #[cfg_attr(feature = "std", inline(always))]
    fn cross(&mut self) {
        let number = |number: u32| R::from_f64(f64::from(number));
        let (next, planes, first) = (number(self.next), self.face.planes().map(number), self.face.first.map(number));
        let [a, b, c] = self.face.corners;
        let lines = &mut self.lines;
        for lane in 0..LANES {
            let (plane, [y, z]) = (next + R::from_f64(lane as f64), [planes[0], planes[0] + planes[1]]);
            let (is_z, is_yz) = (z <= plane, y <= plane);
            let pick = |x: R, y: R, z: R| R::select(is_z, z, R::select(is_yz, y, x));
            let axis = pick(R::zero(), R::one(), R::from_f64(2.0));
            let at = pick(first[0] + plane, first[1] + (plane - y), first[2] + (plane - z)) + R::one();
            let corners = [pick(a.x, a.y, a.z), pick(b.x, b.y, b.z), pick(c.x, c.y, c.z)];
            let (ends, is_apart) = ends(corners.map(|corner| corner - at));
            let points = ends.map(|weights| self.face.point(weights));
            for k in 0..3 {
                let is_across = axis == R::from_f64(k as f64);
                lines.from[k][lane] = R::select(is_across, at, points[0][k]);
                lines.way[k][lane] = R::select(is_across, R::zero(), points[1][k] - points[0][k]);
                (lines.ends[0][k][lane], lines.ends[1][k][lane]) = (ends[0][k], ends[1][k]);
            }
            lines.is_apart[lane] = R::select(is_apart, R::one(), R::zero());
        }
    }
}

impl<R: Float> Lines<R> {
    #[inline(always)]
    fn none() -> Self {
        Self {
            from: [[R::zero(); LANES]; 3],
            way: [[R::zero(); LANES]; 3],
            ends: [[[R::zero(); LANES]; 3]; 2],
            is_apart: [R::zero(); LANES],
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
                self.cross();
            }
            self.next = self.next.saturating_add(1);
            let lines = &self.lines;
            if lines.is_apart[lane] <= R::zero() {
                let of = |axes: &[[R; LANES]; 3]| [axes[0][lane], axes[1][lane], axes[2][lane]];
                let [from, way] = [&lines.from, &lines.way].map(|axes| Vector3::from(of(axes)));
                let ends = [of(&lines.ends[0]), of(&lines.ends[1])];
                return Some(Line { from, way, ends, bound: R::from_f64(f64::NEG_INFINITY) });
            }
        }
        None
    }
}

/// The weights of where a plane with the triangle's corners at these heights crosses two of its edges, and whether it does not:
/// of the edges between the corner that is alone on its side and the one after it, and the one before it.
#[cfg_attr(feature = "std", inline(always))]
fn ends<R: Float>([a, b, c]: [R; 3]) -> ([[R; 3]; 2], bool) {
    let (zero, one) = (R::zero(), R::one());
    let (is_a, is_b) = ((zero <= b) == (zero <= c), (zero <= a) == (zero <= c));
    let pick = |of_a: R, of_b: R, of_c: R| R::select(is_a, of_a, R::select(is_b, of_b, of_c));
    let alone = [pick(one, zero, zero), pick(zero, one, zero), pick(zero, zero, one)];
    let [first, second, third] = alone;
    let height = pick(a, b, c);
    let end = |other: R, of_other: [R; 3]| {
        let share = height / (height - other);
        [0, 1, 2].map(|k: usize| alone[k % 3] * (one - share) + of_other[k % 3] * share)
    };
    ([end(pick(b, c, a), [third, first, second]), end(pick(c, a, b), [second, third, first])], is_a & is_b)
}
