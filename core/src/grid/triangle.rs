//! The least value of a trilinear interpolant on a triangle, without a search.
//!
//! The faces of the cells cut the triangle into polygons, on each of which the field is one polynomial. The least value is at
//! a corner of the triangle, on one of its edges, where a face of a cell crosses it (along all these lines the field is a
//! cubic in each cell: see `segment`), or inside of a polygon where the polynomial is level along the triangle.
//!
//! How fast φ can change along a way in the triangle is bounded in each cell by the derivative at the middle of the part of
//! the cell that the triangle's box meets, and by how that varies over it. Where some way is downhill in all cells, no least
//! value is inside, nor on an edge from which that way leads inwards (0 is in the generalized gradient of a minimum: Clarke
//! 1983, "Optimization and Nonsmooth Analysis", prop. 2.3.2). That settles most triangles but for a corner or an edge.
//!
//! Within one cell the polynomial has no second derivative along any axis. So along most planes it is a saddle somewhere:
//! where it curves downwards along some way in the triangle, the least of a polygon is on its boundary. Where it curves by
//! c at most along a way whose longest chord is l, none is lower than on the boundary by more than c l² / 8.

use core::array::from_fn;

use nalgebra::Vector3;

use super::polynomial::{Bends, Polynomial};
use super::{Grid, Lattice, Storage};
use crate::Aabb;
use crate::real::{Float, Real};
use crate::simplex::corner_weights;
use crate::survey::{bounds, mean, reach, rounding};
use crate::vector::{lift, norm};

/// Where on a triangle a field is least.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleMinimum<R> {
    /// Barycentric.
    pub weights: [R; 3],
    /// φ there, but for rounding.
    pub value: R,
    /// No value on the triangle is below this, but for rounding.
    pub least: R,
    /// How many points and cells were looked at.
    pub looks: u32,
}

/// A triangle whose box meets more cells is not looked at as a whole: cut in two, most of it is dropped at once.
const MOST_CELLS: u32 = 512;

/// Parts of a cell that wait to be looked at. The last is always cut first, so it is one for each cut of the smallest.
const MOST_PARTS: usize = 24;

/// How many parts of a cell are looked at.
const MOST_CUTS: u32 = 96;

/// Steps of Newton's method inside of a cell: a cubic that is curved upwards is nearly a parabola there.
const STEPS: u32 = 4;

/// A triangle, counted in cells from the grid's first node.
struct Face<R: Real> {
    corners: [Vector3<R>; 3],
    normal: Vector3<R>,
    outline: Outline<R>,
    /// Of its box, with what rounding may add.
    low: Vector3<R>,
    high: Vector3<R>,
    /// The first and the last cells that it meets.
    first: [u32; 3],
    last: [u32; 3],
}

impl<R: Float> Face<R> {
    fn new(lattice: &Lattice, corners: [Vector3<R>; 3]) -> Option<Self> {
        let bounds = lattice.bounds();
        let farthest = bounds.min.iter().chain(&bounds.max).fold(0.0, |farthest: f64, x| farthest.max(x.abs()));
        let slack = R::lift(16.0 * R::EPSILON * farthest * lattice.per_spacing());
        let [a, b, c] = corners;
        let low = a.zip_zip_map(&b, &c, |a, b, c| Real::min(a, Real::min(b, c)) - slack);
        let high = a.zip_zip_map(&b, &c, |a, b, c| Real::max(a, Real::max(b, c)) + slack);
        let most = lattice.cells().map(|cells| cells.wrapping_sub(1));
        // Below zero, that is the first one too.
        let cell = |at: Vector3<R>| -> [u32; 3] {
            let at = at.map(|x| Real::max(x, R::zero()).trunc().to_f64() as u32);
            [at.x.min(most[0]), at.y.min(most[1]), at.z.min(most[2])]
        };
        let (first, last) = (cell(low), cell(high));
        let along = |k: usize| last[k % 3].checked_sub(first[k % 3])?.checked_add(1);
        let count = along(0)?.checked_mul(along(1)?)?.checked_mul(along(2)?)?;
        if count > MOST_CELLS {
            return None;
        }
        let (u, v) = (b - a, c - a);
        let normal = u.cross(&v);
        let outline = Outline::new(&corners, normal, slack);
        Some(Self { corners, normal, outline, low, high, first, last })
    }

    /// From the first corner to the others.
    fn sides(&self) -> [Vector3<R>; 2] {
        let [a, b, c] = self.corners;
        [b - a, c - a]
    }

    fn point(&self, weights: [R; 3]) -> Vector3<R> {
        let [u, v] = self.sides();
        self.corners[0] + u * weights[1] + v * weights[2]
    }
}

/// A triangle's plane and the three planes through its edges across it, their normals pointing inwards.
struct Outline<R> {
    x: [R; 4],
    y: [R; 4],
    z: [R; 4],
    offset: [R; 4],
    /// More than what is off by rounding in how far a point of the triangle's box lies from a plane, times its normal's length.
    rounding: [R; 4],
}

impl<R: Float> Outline<R> {
    fn new(&[a, b, c]: &[Vector3<R>; 3], normal: Vector3<R>, slack: R) -> Self {
        let size = |of: Vector3<R>| of.x.abs() + of.y.abs() + of.z.abs();
        let (u, v, w) = (b - a, c - a, c - b);
        let normals = [normal, normal.cross(&u), normal.cross(&w), v.cross(&normal)];
        let at = [a, a, b, a];
        let (extent, square) = (size(u) + size(v), size(u) * size(v));
        let squares = [square, square * size(u), square * size(w), square * size(v)];
        let part = extent * R::lift(32.0 * R::EPSILON);
        Self {
            x: normals.map(|normal| normal.x),
            y: normals.map(|normal| normal.y),
            z: normals.map(|normal| normal.z),
            offset: from_fn(|k| normals[k].dot(&at[k])),
            rounding: from_fn(|k| size(normals[k]) * slack + squares[k] * part),
        }
    }

    /// Whether a box, no part of which is outside of the triangle's, certainly holds no point of the triangle.
    #[inline(always)]
    fn misses(&self, middle: Vector3<R>, half: Vector3<R>) -> bool {
        let mut inwards = [R::zero(); 4];
        let mut reach = [R::zero(); 4];
        for k in 0..4 {
            let (x, y, z) = (self.x[k], self.y[k], self.z[k]);
            inwards[k] = x * middle.x + y * middle.y + z * middle.z - self.offset[k];
            reach[k] = x.abs() * half.x + y.abs() * half.y + z.abs() * half.z + self.rounding[k];
        }
        let is_outside = |k: usize| inwards[k % 4] + reach[k % 4] < R::zero();
        reach[0] < inwards[0].abs() || is_outside(1) || is_outside(2) || is_outside(3)
    }
}

/// Ways along the triangle: from the first corner to the second and to the third, from the second to the third, and
/// uphill from the middle. Each axis for itself, so that a processor takes several at once.
struct Ways<R> {
    x: [R; 4],
    y: [R; 4],
    z: [R; 4],
    /// What a rise over each may be off by rounding.
    rounding: [R; 4],
}

impl<R: Float> Ways<R> {
    fn new(face: &Face<R>, gradient: Vector3<R>, slope_bound: R) -> Self {
        let [a, b, c] = face.corners;
        let (u, v, normal) = (b - a, c - a, face.normal);
        let square = normal.dot(&normal);
        // Of a sliver rounding alone may tell where it lies.
        let is_sound = u.dot(&u) * v.dot(&v) * R::lift(1e-6) < square;
        let uphill = if is_sound { gradient - normal * (normal.dot(&gradient) / square) } else { Vector3::zeros() };
        let along = [u, v, c - b, uphill];
        let part = slope_bound * R::lift(1024.0 * R::EPSILON);
        Self {
            x: along.map(|way| way.x),
            y: along.map(|way| way.y),
            z: along.map(|way| way.z),
            rounding: along.map(|way| (way.x.abs() + way.y.abs() + way.z.abs()) * part),
        }
    }
}

/// The least and the most that φ rises over each of the [`Ways`], as fast as it does anywhere in a part of the grid.
#[derive(Clone, Copy)]
struct Rises<R> {
    least: [R; 4],
    most: [R; 4],
}

impl<R: Float> Rises<R> {
    fn none() -> Self {
        Self { least: [R::lift(f64::INFINITY); 4], most: [R::lift(f64::NEG_INFINITY); 4] }
    }

    #[inline]
    fn include(&mut self, other: &Self) {
        self.least = from_fn(|way| Real::min(self.least[way], other.least[way]));
        self.most = from_fn(|way| Real::max(self.most[way], other.most[way]));
    }

    /// Whether φ is not level along some way.
    #[inline]
    fn is_steep(&self) -> bool {
        let of_way = |way: usize| R::zero() < self.least[way % 4] || self.most[way % 4] < R::zero();
        of_way(0) || of_way(1) || of_way(2) || of_way(3)
    }

    /// What no value on the way between two points of these values is below: the field falls no faster from either.
    fn least_between(&self, way: usize, [from, to]: [R; 2]) -> R {
        let (fall, rise) = (self.least[way % 4], self.most[way % 4]);
        let share = Real::clamp((to - from - rise) / (fall - rise), R::zero(), R::one());
        Real::min(from + fall * share, to - rise * (R::one() - share))
    }

    /// The most that φ falls from the mean of the corners, as a rise.
    fn fall(&self) -> R {
        let [[u, v, w, _], [most_u, most_v, most_w, _]] = [self.least, self.most];
        Real::min(-most_u - most_v, Real::min(u - most_w, v + w)) * R::lift(1.0 / 3.0)
    }
}

/// The part of a cell in the triangle's box.
#[derive(Clone, Copy)]
struct Cell<R: Float> {
    first: Vector3<R>,
    field: Polynomial<R>,
    /// Of the part, from the cell's first corner.
    middle: Vector3<R>,
    half: Vector3<R>,
}

impl<R: Float> Cell<R> {
    /// Of any point of the part, also where the triangle does not reach.
    #[inline(always)]
    fn rises(&self, ways: &Ways<R>) -> Rises<R> {
        let bends = self.field.bends(self.middle);
        let gradient = self.field.gradient(self.middle, &bends);
        let half = self.half;
        let twist = self.field.xyz.abs();
        let twists = [half.y * half.z * twist, half.z * half.x * twist, half.x * half.y * twist];
        let mut rises = Rises::none();
        for way in 0..4 {
            let (x, y, z) = (ways.x[way], ways.y[way], ways.z[way]);
            let rise = gradient.x * x + gradient.y * y + gradient.z * z;
            let spread = (bends.xy * y + bends.zx * z).abs() * half.x
                + (bends.xy * x + bends.yz * z).abs() * half.y
                + (bends.zx * x + bends.yz * y).abs() * half.z
                + (x.abs() * twists[0] + y.abs() * twists[1] + z.abs() * twists[2])
                + ways.rounding[way];
            rises.least[way] = rise - spread;
            rises.most[way] = rise + spread;
        }
        rises
    }

    /// In the middle, and how much more or less elsewhere.
    fn rise(&self, gradient: Vector3<R>, bends: &Bends<R>, way: Vector3<R>) -> (R, R) {
        let (by, half) = (bends.times(way), self.half);
        let twist = way.x.abs() * half.y * half.z + way.y.abs() * half.z * half.x + way.z.abs() * half.x * half.y;
        let spread = by.x.abs() * half.x + by.y.abs() * half.y + by.z.abs() * half.z;
        (gradient.dot(&way), spread + self.field.xyz.abs() * twist)
    }

    /// The most that the field curves upwards along a way, times the square of its longest chord in the part, if no longer
    /// than the way.
    fn bend(&self, bends: &Bends<R>, way: Vector3<R>) -> R {
        let curvature = bends.times(way).dot(&way) + self.more_bend(way, way);
        if curvature <= R::zero() {
            return R::zero();
        }
        let sides = way.iter().zip(&self.half);
        let chord = sides.fold(R::one(), |chord, (way, half)| {
            let (all, reached) = (way.abs(), *half * R::lift(2.0));
            if reached < all * chord { reached / all } else { chord }
        });
        curvature * chord * chord
    }

    /// How much more the second derivative by two ways can be anywhere in the part than in its middle.
    fn more_bend(&self, a: Vector3<R>, b: Vector3<R>) -> R {
        let (xy, yz, zx) = (a.x * b.y + a.y * b.x, a.y * b.z + a.z * b.y, a.z * b.x + a.x * b.z);
        let half = self.half;
        (xy.abs() * half.z + yz.abs() * half.x + zx.abs() * half.y) * self.field.xyz.abs()
    }

    fn holds(&self, at: Vector3<R>) -> bool {
        (at - self.middle).iter().zip(&self.half).all(|(off, half)| off.abs() <= *half)
    }
}

impl<S: Storage> Grid<S> {
    /// `None` where the triangle leaves the box or meets many cells, or a sample is no number.
    pub(super) fn least_in<R: Float>(
        &self,
        corners: [Vector3<R>; 3],
        [level, gap]: [R; 2],
    ) -> Option<TriangleMinimum<R>> {
        if !self.lattice.bounds().encloses(&bounds(&corners)) {
            return None;
        }
        let face = Face::new(&self.lattice, corners.map(|corner| self.in_cells(corner)))?;
        let (value, gradient) = self.at(mean(&face.corners));
        // Of the corners where they stand in the world, and of the first node, from which they are counted.
        let Aabb { min, max } = self.lattice.bounds();
        let farthest = min.iter().chain(&max).fold(0.0, |farthest: f64, x| farthest.max(x.abs()));
        let reach = Real::max(reach(corners[0], &corners), R::lift(farthest));
        let rounding = rounding(self.slope_bound, corners[0], reach, value);
        let ways = Ways::new(&face, gradient, R::lift(self.slope_bound * self.lattice.spacing()));
        let mut rises = Rises::none();
        let mut may_be_inside = false;
        self.each_cell(&face, |cell| {
            let of_cell = cell.rises(&ways);
            may_be_inside |= !of_cell.is_steep();
            rises.include(&of_cell);
        })?;
        let least = value + rises.fall() - rounding;
        let mut found = TriangleMinimum { weights: [R::lift(1.0 / 3.0); 3], value, least, looks: 1 };
        if level < least {
            return Some(found);
        }
        self.boundary(&face, &rises, &mut found)?;
        let mut deficit = R::zero();
        if !rises.is_steep() {
            self.creases(&face, &mut found)?;
            if may_be_inside {
                deficit = self.inside(&face, &ways, gap, &mut found)?;
            }
        }
        found.least = Real::max(least, found.value - deficit - rounding);
        Some(found)
    }

    /// The value at a point of the box that is counted in cells, and its derivative by them, but for rounding.
    fn at<R: Float>(&self, point: Vector3<R>) -> (R, Vector3<R>) {
        let last = lift::<R>(self.lattice.cells().map(f64::from));
        let cell = point.zip_map(&last, |x, last| Real::min(Real::max(x, R::zero()).trunc(), last - R::one()));
        let field = Polynomial::new(R::gather(cell.into(), |cell| self.storage.corners(cell)));
        let share = point - cell;
        let bends = field.bends(share);
        (field.value(share), field.gradient(share, &bends))
    }

    /// `None` where a sample is no number.
    #[inline(always)]
    fn each_cell<R: Float>(&self, face: &Face<R>, mut look: impl FnMut(&Cell<R>)) -> Option<()> {
        let part = |low: R, high: R, cell: R| {
            let [from, to] = [low, high].map(|end| Real::clamp(end - cell, R::zero(), R::one()));
            ((from + to) * R::lift(0.5), (to - from) * R::lift(0.5))
        };
        let [middle_row, half_row] = [face.high.x + face.low.x, face.high.x - face.low.x].map(|x| x * R::lift(0.5));
        for z in face.first[2]..=face.last[2] {
            let first_z = R::lift(f64::from(z));
            let (middle_z, half_z) = part(face.low.z, face.high.z, first_z);
            for y in face.first[1]..=face.last[1] {
                let first_y = R::lift(f64::from(y));
                let (middle_y, half_y) = part(face.low.y, face.high.y, first_y);
                let row = Vector3::new(middle_row, first_y + middle_y, first_z + middle_z);
                if face.outline.misses(row, Vector3::new(half_row, half_y, half_z)) {
                    continue;
                }
                for x in face.first[0]..=face.last[0] {
                    let first_x = R::lift(f64::from(x));
                    let (middle_x, half_x) = part(face.low.x, face.high.x, first_x);
                    let first = Vector3::new(first_x, first_y, first_z);
                    let middle = Vector3::new(middle_x, middle_y, middle_z);
                    let half = Vector3::new(half_x, half_y, half_z);
                    if face.outline.misses(first + middle, half) {
                        continue;
                    }
                    let samples = self.storage.corners([x, y, z]).map(|sample| R::lift(f64::from(sample)));
                    let field = Polynomial::new(samples);
                    if !field.xyz.is_finite() {
                        return None;
                    }
                    look(&Cell { first, field, middle, half });
                }
            }
        }
        Some(())
    }

    /// Corners and edges, but for those from which a way along the triangle leads downhill.
    fn boundary<R: Float>(&self, face: &Face<R>, rises: &Rises<R>, found: &mut TriangleMinimum<R>) -> Option<()> {
        let up = |way: usize| R::zero() < rises.least[way % 4];
        let down = |way: usize| rises.most[way % 4] < R::zero();
        let (u, v, w) = (0, 1, 2);
        let leads_down = [down(u) || down(v), up(u) || down(w), up(v) || up(w)];
        let mut values = [R::lift(f64::NEG_INFINITY); 3];
        for k in 0..3 {
            if !leads_down[k] {
                values[k] = self.at(face.corners[k]).0;
                found.looks = found.looks.saturating_add(1);
                if values[k] < found.value {
                    (found.weights, found.value) = (corner_weights(k), values[k]);
                }
            }
        }
        let edges = [
            (u, [0, 1], up(u) || down(u) || down(v) || down(w)),
            (v, [0, 2], up(v) || down(v) || down(u) || up(w)),
            (w, [1, 2], up(w) || down(w) || up(u) || up(v)),
        ];
        for (way, ends, leads_down) in edges {
            if !leads_down && rises.least_between(way, ends.map(|end| values[end % 3])) < found.value {
                let [from, to] = ends.map(|end| face.corners[end % 3]);
                self.along(ends.map(corner_weights), from, to - from, found)?;
            }
        }
        Some(())
    }

    /// Where faces of cells cross the triangle.
    fn creases<R: Float>(&self, face: &Face<R>, found: &mut TriangleMinimum<R>) -> Option<()> {
        for axis in 0..3 {
            for plane in face.first[axis % 3].wrapping_add(1)..=face.last[axis % 3] {
                let plane = R::lift(f64::from(plane));
                let heights = face.corners.map(|corner| corner[axis % 3] - plane);
                let [a, b, c] = heights.map(|height| R::zero() <= height);
                let (alone, others) = match () {
                    () if a == b && b == c => continue,
                    () if b == c => (0, [1, 2]),
                    () if a == c => (1, [2, 0]),
                    () => (2, [0, 1]),
                };
                let ends = others.map(|other| {
                    let share = heights[alone % 3] / (heights[alone % 3] - heights[other % 3]);
                    let (from, to): ([R; 3], [R; 3]) = (corner_weights(alone), corner_weights(other));
                    from_fn(|k| from[k] * (R::one() - share) + to[k] * share)
                });
                let [mut from, mut way] = [face.point(ends[0]), face.point(ends[1]) - face.point(ends[0])];
                (from[axis % 3], way[axis % 3]) = (plane, R::zero());
                self.along(ends, from, way, found)?;
            }
        }
        Some(())
    }

    /// A line between two points of the triangle.
    fn along<R: Float>(
        &self,
        ends: [[R; 3]; 2],
        from: Vector3<R>,
        way: Vector3<R>,
        found: &mut TriangleMinimum<R>,
    ) -> Option<()> {
        let least = self.follow(from, way, found.value)?;
        found.looks = found.looks.saturating_add(least.looks);
        if least.value < found.value {
            let share = least.share;
            found.weights = from_fn(|k| ends[0][k] * (R::one() - share) + ends[1][k] * share);
            found.value = least.value;
        }
        Some(())
    }

    /// Where the polynomial of a cell may be level. Answers by how much a value there may be less than what was found.
    fn inside<R: Float>(&self, face: &Face<R>, ways: &Ways<R>, gap: R, found: &mut TriangleMinimum<R>) -> Option<R> {
        let mut deficit = R::zero();
        self.each_cell(face, |cell| {
            if !cell.rises(ways).is_steep() {
                found.looks = found.looks.saturating_add(1);
                let of_cell = cell.least_inside(face, found);
                let is_near = of_cell <= gap;
                deficit = Real::max(deficit, if is_near { of_cell } else { cell.least_level(face, ways, gap, found) });
            }
        })?;
        Some(deficit)
    }
}

/// The second derivatives along the triangle, by the weights of its second and third corner.
struct Hessian<R> {
    uu: R,
    uv: R,
    vv: R,
}

impl<R: Float> Hessian<R> {
    fn new(bends: &Bends<R>, [u, v]: [Vector3<R>; 2]) -> Self {
        let (by_u, by_v) = (bends.times(u), bends.times(v));
        Self { uu: by_u.dot(&u), uv: by_u.dot(&v), vv: by_v.dot(&v) }
    }

    fn determinant(&self) -> R {
        self.uu * self.vv - self.uv * self.uv
    }

    fn is_bowl(&self) -> bool {
        R::zero() < self.uu && R::zero() < self.determinant()
    }

    /// Where a function with these slopes is level, as steps by the weights.
    fn step(&self, [u, v]: [R; 2]) -> [R; 2] {
        let determinant = self.determinant();
        [(self.uv * v - self.vv * u) / determinant, (self.uv * u - self.uu * v) / determinant]
    }
}

impl<R: Float> Cell<R> {
    /// By how much a value inside of the polygon may be less than what was found, or is on its boundary.
    fn least_inside(&self, face: &Face<R>, found: &mut TriangleMinimum<R>) -> R {
        let bends = self.field.bends(self.middle);
        let [u, v] = face.sides();
        let hessian = Hessian::new(&bends, [u, v]);
        // Of a saddle the way along which it curves downwards the most, over one of the edges.
        let other = match () {
            () if !(R::zero() < hessian.uu && R::zero() < hessian.vv) => u,
            () if hessian.vv < hessian.uu => v - u * (hessian.uv / hessian.uu),
            () => u - v * (hessian.uv / hessian.vv),
        };
        let bend = [u, v, v - u, other]
            .into_iter()
            .fold(R::lift(f64::INFINITY), |least, way| Real::min(least, self.bend(&bends, way)));
        let deficit = bend * R::lift(0.125);
        if deficit <= R::zero() || !hessian.is_bowl() {
            return deficit;
        }
        let gradient = self.field.gradient(self.middle, &bends);
        let step = hessian.step([gradient.dot(&u), gradient.dot(&v)]);
        let downhill = u * step[0] + v * step[1];
        let (rise, spread) = self.rise(gradient, &bends, downhill);
        let rounding = norm(gradient) * norm(downhill) * R::lift(1024.0 * R::EPSILON);
        if rise + spread + rounding < R::zero() {
            return R::zero();
        }
        let off = self.newton(face, found);
        let least_hessian = Hessian {
            uu: hessian.uu - self.more_bend(u, u),
            uv: hessian.uv.abs() + self.more_bend(u, v),
            vv: hessian.vv - self.more_bend(v, v),
        };
        if least_hessian.is_bowl() { Real::min(deficit, off) } else { deficit }
    }

    /// From what was found to where the field is level. Of a bowl that is all of the part, it answers how much the least may
    /// be below what was found.
    fn newton(&self, face: &Face<R>, found: &mut TriangleMinimum<R>) -> R {
        let [u, v] = face.sides();
        let unknown = R::lift(f64::INFINITY);
        let [_, mut s, mut t] = found.weights;
        let mut off = unknown;
        for step in 0..=STEPS {
            let at = face.point([R::zero(), s, t]) - self.first;
            let bends = self.field.bends(at);
            let gradient = self.field.gradient(at, &bends);
            let slopes = [gradient.dot(&u), gradient.dot(&v)];
            off = slopes[0].abs() + slopes[1].abs();
            let hessian = Hessian::new(&bends, [u, v]);
            if step == STEPS {
                break;
            }
            if !hessian.is_bowl() {
                return unknown;
            }
            let by = hessian.step(slopes);
            (s, t) = (s + by[0], t + by[1]);
        }
        let at = face.point([R::zero(), s, t]) - self.first;
        if !self.holds(at) {
            return unknown;
        }
        let weights = [R::one() - s - t, s, t];
        if !weights.iter().all(|weight| R::zero() <= *weight) {
            // The least of the bowl is outside of the triangle, and so that of the polygon is on its boundary.
            return off * (R::one() + s.abs() + t.abs());
        }
        let value = self.field.value(at);
        if value < found.value {
            (found.weights, found.value) = (weights, value);
        }
        off
    }

    /// By how much a value where the field is level along the triangle may be less than what was found: part by part, each
    /// cut in two until it holds no such point, or is so small that the field cannot have fallen by much on the way to it.
    fn least_level(&self, face: &Face<R>, ways: &Ways<R>, gap: R, found: &mut TriangleMinimum<R>) -> R {
        let mut parts = [(self.middle, self.half); MOST_PARTS];
        let (mut count, mut deficit) = (1_usize, R::zero());
        for _ in 0..MOST_CUTS {
            let Some(last) = count.checked_sub(1) else { return deficit };
            count = last;
            let Some((middle, half)) = parts.get(last).copied() else { break };
            let part = Self { middle, half, ..*self };
            if face.outline.misses(part.first + part.middle, part.half) || part.rises(ways).is_steep() {
                continue;
            }
            let below = part.fall_to_level(face, found);
            if below <= gap {
                deficit = Real::max(deficit, below);
                continue;
            }
            let Some([a, b, ..]) = parts.get_mut(last..) else { break };
            [*a, *b] = part.halves();
            count = count.saturating_add(2);
        }
        R::lift(f64::INFINITY)
    }

    /// Where the field is level its value is less than at another point by no more than half of what it curves by over the way
    /// between: here from where the middle meets the triangle's plane.
    fn fall_to_level(&self, face: &Face<R>, found: &TriangleMinimum<R>) -> R {
        let square = face.normal.dot(&face.normal);
        let height = face.normal.dot(&(self.first + self.middle - face.corners[0]));
        let off = if R::zero() < square { face.normal * (height / square) } else { Vector3::zeros() };
        let bends = self.field.bends(self.middle);
        let radius_sq = self.half.dot(&self.half);
        // The length of the matrix bounds how much it stretches.
        let [xy, yz, zx] = [bends.xy, bends.yz, bends.zx];
        let bend = Real::sqrt((xy * xy + yz * yz + zx * zx) * R::lift(2.0))
            + self.field.xyz.abs() * Real::sqrt(radius_sq * R::lift(2.0));
        found.value - self.field.value(self.middle - off) + bend * radius_sq * R::lift(0.5)
    }

    /// In two across its longest side.
    fn halves(&self) -> [(Vector3<R>, Vector3<R>); 2] {
        let half = self.half;
        let axis = if half.x < half.y {
            if half.y < half.z { 2 } else { 1 }
        } else if half.x < half.z {
            2
        } else {
            0
        };
        let quarter = Vector3::from_fn(|k, _| if k == axis { half[k % 3] * R::lift(0.5) } else { R::zero() });
        [quarter, -quarter].map(|to| (self.middle + to, half - quarter))
    }
}
