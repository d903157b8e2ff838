//! Which tetrahedron holds a point, and with which weights? The tree of boxes finds those near it, and the inverse of each one's
//! edges, its frame, tells the weights. Both are made again whenever the cage has moved: in some hundred operations a tetrahedron.

use nalgebra::{Matrix3, Vector3};

use super::tree::{TetTree, meet};
use super::{tet_bounds, tet_corners};
use crate::Aabb;
use crate::contact::TetPoint;
use crate::number::Real;
use crate::placed::affine::inverse;
use crate::rounding::{BARYCENTRIC, TET_RESIDUAL};

/// Says if a tetrahedron has a map to material space that can be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum TetStatus {
    /// It has.
    Good,
    /// It is turned inside out, and lies over others.
    Inverted,
    /// It is so flat, at rest or deformed, that its inverse has lost all digits, or a corner is not finite.
    IllConditioned,
}

/// D⁻¹ of one tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TetFrame {
    /// Rows: the gradients of the weights of the corners 1, 2 and 3. Zero where it is ill-conditioned.
    pub(super) inverse: Matrix3<f64>,
    /// Its sign is that of the volume; 0 where the tetrahedron is ill-conditioned.
    pub(super) determinant: f64,
}

impl TetFrame {
    /// A tetrahedron without an inverse: fills buffers.
    pub const ILL_CONDITIONED: Self =
        Self { inverse: Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0), determinant: 0.0 };

    fn new([v0, v1, v2, v3]: &[Vector3<f64>; 4]) -> Self {
        let edges = Matrix3::from_columns(&[v1 - v0, v2 - v0, v3 - v0]);
        if let Some(frame) = Self::of_round(&edges) {
            return frame;
        }
        let Some(found) = inverse(&edges) else { return Self::ILL_CONDITIONED };
        // Weights are off by D⁻¹ D − 1 times themselves.
        let residual = (found * edges - Matrix3::identity()).amax();
        // Of the inverse over its largest entry: lengths cubed may be no numbers.
        let determinant = (found / found.amax()).determinant();
        let is_good = residual <= TET_RESIDUAL && determinant.is_finite();
        if is_good { Self { inverse: found, determinant } } else { Self::ILL_CONDITIONED }
    }

    /// The plain inverse by cross products: good to rounding where the tetrahedron is far from flat, as nearly all are. `None` of others,
    /// which need more care.
    fn of_round(edges: &Matrix3<f64>) -> Option<Self> {
        let [a, b, c] = [0, 1, 2].map(|column| Vector3::from(edges.column(column)));
        let (bc, ca, ab) = (b.cross(&c), c.cross(&a), a.cross(&b));
        let volume = a.dot(&bc);
        let longest = a.norm_squared().max(b.norm_squared()).max(c.norm_squared());
        // False of NaN. The cube of a length within these has not left the range of numbers.
        let is_round = volume * volume >= ROUND * (longest * longest * longest) && (1e-60..1e60).contains(&longest);
        is_round.then(|| {
            let determinant = 1.0 / volume;
            let rows = [bc * determinant, ca * determinant, ab * determinant].map(|row| row.transpose());
            Self { inverse: Matrix3::from_rows(&rows), determinant }
        })
    }
}

/// Least (6 volume)² over the longest edge's length to the sixth power of a tetrahedron whose plain inverse is taken: with
/// |det| ≥ 1e-3 l³ no product of it loses more than four of its sixteen digits.
const ROUND: f64 = 1e-6;

/// A mesh of tetrahedra in one shape, with what finds points in it.
#[derive(Clone, Copy, Debug)]
pub struct TetLocator<'a> {
    points: &'a [[f64; 3]],
    tets: &'a [[u32; 4]],
    frames: &'a [TetFrame],
    tree: TetTree<'a>,
}

impl<'a> TetLocator<'a> {
    /// Fits the tree's boxes, and fills `frames`, one for each tetrahedron. `order` is that of [`sort_tets`](super::sort_tets) for the
    /// cage at rest, and `boxes` has the length [`tet_tree_size`](super::tet_tree_size). Tetrahedra with points that are not finite or
    /// not there are left out. `None` if a length is another one.
    pub fn new(
        points: &'a [[f64; 3]],
        tets: &'a [[u32; 4]],
        order: &'a [u32],
        boxes: &'a mut [Aabb],
        frames: &'a mut [TetFrame],
    ) -> Option<Self> {
        if [order.len(), frames.len()] != [tets.len(); 2] {
            return None;
        }
        for (frame, corners) in frames.iter_mut().zip(tets) {
            *frame = tet_corners(points, corners).map_or(TetFrame::ILL_CONDITIONED, |corners| TetFrame::new(&corners));
        }
        Some(Self { points, tets, frames, tree: TetTree::fit(points, tets, order, boxes)? })
    }

    /// The box around all; inverted (min = ∞, max = −∞) without any.
    pub fn bounds(&self) -> Aabb {
        self.tree.bounds()
    }

    /// The corners of each tetrahedron.
    pub fn tets(&self) -> &'a [[u32; 4]] {
        self.tets
    }

    /// Positions of a tetrahedron's corners; `None` where one is not finite, or not there.
    pub fn corners(&self, tet: u32) -> Option<[Vector3<f64>; 4]> {
        tet_corners(self.points, self.tets.get(tet as usize)?)
    }

    pub(super) fn frame(&self, tet: u32) -> Option<&'a TetFrame> {
        self.frames.get(tet as usize)
    }

    /// The position of a point of a tetrahedron.
    pub fn point(&self, at: &TetPoint<f64>) -> Option<Vector3<f64>> {
        let [v0, v1, v2, v3] = self.corners(at.tet)?;
        let [_, w1, w2, w3] = at.weights;
        // Edges keep their digits far from the origin.
        Some(v0 + (v1 - v0) * w1 + (v2 - v0) * w2 + (v3 - v0) * w3)
    }

    /// Barycentric weights of any point in a tetrahedron, negative outside; `None` where it is ill-conditioned.
    pub fn weights(&self, tet: u32, point: Vector3<f64>) -> Option<[f64; 4]> {
        // The corners of a tetrahedron with a frame are there, and finite.
        let frame = self.frame(tet).filter(|frame| frame.determinant != 0.0)?;
        let [first, ..] = self.tets.get(tet as usize)?;
        let w = frame.inverse * (point - Vector3::from(*self.points.get(*first as usize)?));
        Some([1.0 - w.x - w.y - w.z, w.x, w.y, w.z])
    }

    /// The tetrahedron that holds a point, and its weights there. Of several the one that it is deepest in, then the first.
    pub fn locate(&self, point: Vector3<f64>) -> Option<TetPoint<f64>> {
        self.locate_where(point, |_| true)
    }

    /// [`locate`](Self::locate) among some of the tetrahedra.
    pub(super) fn locate_where(&self, point: Vector3<f64>, is_wanted: impl Fn(u32) -> bool) -> Option<TetPoint<f64>> {
        let at = Aabb { min: point.into(), max: point.into() };
        let mut best: Option<(f64, TetPoint<f64>)> = None;
        self.visit_near(&at, |tet| {
            let Some(weights) = self.weights(tet, point).filter(|_| is_wanted(tet)) else { return };
            let depth = weights.iter().fold(f64::INFINITY, |least, weight| least.min(*weight));
            let is_deeper = best.is_none_or(|(deepest, best)| depth > deepest || (depth == deepest && tet < best.tet));
            if depth >= -BARYCENTRIC && is_deeper {
                best = Some((depth, TetPoint { tet, weights }));
            }
        });
        best.map(|(_, at)| at)
    }

    /// Visits each tetrahedron once whose box may meet a box.
    pub(super) fn visit_near(&self, region: &Aabb, mut visit: impl FnMut(u32)) {
        if !region.min.iter().chain(&region.max).all(|x| x.is_representable()) {
            return;
        }
        // Weights may be negative by rounding.
        let region = region.inflate(BARYCENTRIC * self.tree.bounds().diagonal());
        self.tree.visit_near(&region, |tet| {
            if self.corners(tet).is_some_and(|corners| meet(&tet_bounds(&corners), &region)) {
                visit(tet);
            }
        });
    }
}
