//! A polygon cut into triangles: a fan if all its triangles are positive, else ear clipping (Meisters 1975).
//!
//! The polygon is projected along the largest axis of its Newell normal (Sutherland et al. 1974). Dropping a coordinate
//! does not round, so the signs of areas are exact (predicates of Shewchuk 1997, crate robust), and a polygon that is
//! simple in its plane stays simple.
//!
//! Positive triangles suffice: the signed indicator functions of a fan, or of ears, add up to the winding number of the
//! polygon at every point. For a simple polygon that is 1 inside and 0 outside. So triangles that are all positive
//! neither overlap nor stick out, whether the polygon is convex or not. A fan may be positive on a polygon that winds
//! about its first corner, which is not simple: it is told by that.
//!
//! Only reflex corners can lie in an ear. They stand in a grid of square cells, about one for each, so that an ear is
//! compared with those near it (`reflex_grid`), and a polygon of ordinary shape takes time in proportion to its corners.

use robust::{Coord, orient2d};
use std::collections::VecDeque;

use super::reflex_grid::ReflexGrid;

/// Most cells and corners that are looked at for the ears of all polygons of a file, about 0.3 s. Where edges cross, the
/// work can grow with the square of the corners; ordinary files need less than a thousandth.
const MAX_TESTS: u64 = 1 << 28;

/// Cells and corners that the exact predicates of one corner count for.
const PREDICATE_TESTS: u64 = 8;

/// Way in which a polygon was cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cut {
    /// A fan from the first corner, all its triangles positive.
    Fan,
    /// Ears clipped one by one.
    Ears,
    /// A fan that may overlap: the polygon has no area, its edges cross, or it needs too much work.
    Unverified,
}

/// Condition for clipping a corner, from strict to weak.
#[derive(Clone, Copy)]
enum Ear {
    /// Positive, without a corner inside or on the boundary.
    Strict,
    /// Without area: a corner along a straight edge, a repeated one, a spike.
    Flat,
    /// Positive, without a corner inside; corners on the boundary are allowed, as where a hole is joined to the
    /// outline.
    Touched,
}

impl Ear {
    fn weaker(self) -> Option<Self> {
        match self {
            Self::Strict => Some(Self::Flat),
            Self::Flat => Some(Self::Touched),
            Self::Touched => None,
        }
    }
}

/// Scratch buffers, reused from one polygon to the next.
pub(super) struct Triangulator {
    plane: Vec<Coord<f64>>,
    /// Ring of the corners not yet clipped; a clipped corner is its own `next`.
    previous: Vec<usize>,
    next: Vec<usize>,
    /// `true` for corners that are not convex.
    is_reflex: Vec<bool>,
    /// All reflex corners, and some that were reflex before.
    blockers: ReflexGrid,
    queue: VecDeque<usize>,
    tests_left: u64,
}

impl Triangulator {
    pub(super) fn new() -> Self {
        Self {
            plane: Vec::new(),
            previous: Vec::new(),
            next: Vec::new(),
            is_reflex: Vec::new(),
            blockers: ReflexGrid::default(),
            queue: VecDeque::new(),
            tests_left: MAX_TESTS,
        }
    }

    /// Writes the n - 2 triangles of n corners, in the polygon's orientation. The same corners give the same triangles,
    /// unless [`MAX_TESTS`] is spent.
    pub(super) fn cut(&mut self, points: &[[f64; 3]], corners: &[u32], triangles: &mut [[u32; 3]]) -> Cut {
        debug_assert!(corners.len() >= 3 && triangles.len() == corners.len() - 2);
        let has_area = self.project(points, corners);
        let last = corners.len() - 1;
        if has_area && (1..last).all(|i| self.area(0, i, i + 1) > 0.0) {
            fan(corners, triangles);
            return if self.winds_about_first(last) { Cut::Unverified } else { Cut::Fan };
        }
        if has_area && self.clip_ears(corners, triangles).is_some() {
            return Cut::Ears;
        }
        fan(corners, triangles);
        Cut::Unverified
    }

    /// Does a fan whose triangles are all positive turn about the first corner by 360° or more? Each turns by less than 180°, so that it
    /// comes past its first side again only from behind it.
    fn winds_about_first(&self, last: usize) -> bool {
        let mut was_behind = false;
        (2..=last).any(|i| {
            let is_behind = self.area(0, 1, i) < 0.0;
            was_behind |= is_behind;
            was_behind && !is_behind
        })
    }

    /// Fills `plane` so that the polygon's area is positive; `false` if the area is zero or not finite.
    fn project(&mut self, points: &[[f64; 3]], corners: &[u32]) -> bool {
        let point = |i: usize| points[corners[i] as usize];
        let origin = point(0);
        let arm = |i: usize| {
            let p = point(i);
            [p[0] - origin[0], p[1] - origin[1], p[2] - origin[2]]
        };
        let mut normal = [0.0f64; 3];
        let mut a = arm(1);
        for i in 2..corners.len() {
            let b = arm(i);
            normal[0] += a[1] * b[2] - a[2] * b[1];
            normal[1] += a[2] * b[0] - a[0] * b[2];
            normal[2] += a[0] * b[1] - a[1] * b[0];
            a = b;
        }
        let size = normal.map(f64::abs);
        let axis = if size[2] >= size[0] && size[2] >= size[1] { 2 } else { usize::from(size[1] >= size[0]) };
        let (mut u, mut v) = ((axis + 1) % 3, (axis + 2) % 3);
        if normal[axis] < 0.0 {
            (u, v) = (v, u);
        }
        self.plane.clear();
        self.plane.extend((0..corners.len()).map(|i| Coord { x: point(i)[u], y: point(i)[v] }));
        normal.iter().all(|n| n.is_finite()) && normal[axis] != 0.0
    }

    /// Twice the signed area of a triangle of corners; the sign is exact.
    fn area(&self, a: usize, b: usize, c: usize) -> f64 {
        orient2d(self.plane[a], self.plane[b], self.plane[c])
    }

    /// `None` if no ear is left or the budget of tests is spent.
    fn clip_ears(&mut self, corners: &[u32], triangles: &mut [[u32; 3]]) -> Option<()> {
        let n = corners.len();
        self.link(n);
        self.queue.clear();
        let (mut written, mut ear, mut has_clipped) = (0, Ear::Strict, true);
        while written < n - 3 {
            let Some(tip) = self.queue.pop_front() else {
                // Clipping changes only the two neighbours, unless corners touch: then all must be tested again.
                ear = if has_clipped { Ear::Strict } else { ear.weaker()? };
                has_clipped = false;
                self.queue.extend((0..n).filter(|&i| self.next[i] != i));
                continue;
            };
            if self.next[tip] == tip || !self.is_ear(tip, ear)? {
                continue;
            }
            let (a, b) = (self.previous[tip], self.next[tip]);
            triangles[written] = [corners[a], corners[tip], corners[b]];
            written += 1;
            self.next[a] = b;
            self.previous[b] = a;
            self.next[tip] = tip;
            self.classify(a);
            self.classify(b);
            self.queue.extend([a, b]);
            has_clipped = true;
        }
        let tip = (0..n).find(|&i| self.next[i] != i)?;
        let (a, b) = (self.previous[tip], self.next[tip]);
        triangles[written] = [corners[a], corners[tip], corners[b]];
        (self.area(a, tip, b) >= 0.0).then_some(())
    }

    fn link(&mut self, n: usize) {
        self.previous.clear();
        self.previous.extend((0..n).map(|i| if i == 0 { n - 1 } else { i - 1 }));
        self.next.clear();
        self.next.extend((0..n).map(|i| if i + 1 == n { 0 } else { i + 1 }));
        self.is_reflex.clear();
        self.is_reflex.resize(n, false);
        self.blockers.lay_out(&self.plane);
        (0..n).for_each(|i| self.classify(i));
    }

    fn classify(&mut self, corner: usize) {
        let is_reflex = self.area(self.previous[corner], corner, self.next[corner]) <= 0.0;
        if is_reflex && !self.is_reflex[corner] {
            self.blockers.insert(corner, self.plane[corner]);
        }
        self.is_reflex[corner] = is_reflex;
    }

    fn is_ear(&mut self, tip: usize, ear: Ear) -> Option<bool> {
        let (a, b) = (self.previous[tip], self.next[tip]);
        let area = self.area(a, tip, b);
        self.tests_left = self.tests_left.checked_sub(1)?;
        if matches!(ear, Ear::Flat) {
            return Some(area == 0.0);
        }
        if area <= 0.0 || area.is_nan() {
            return Some(false);
        }
        let [p, q, r] = [self.plane[a], self.plane[tip], self.plane[b]];
        let (low, high) = (
            Coord { x: p.x.min(q.x).min(r.x), y: p.y.min(q.y).min(r.y) },
            Coord { x: p.x.max(q.x).max(r.x), y: p.y.max(q.y).max(r.y) },
        );
        let Self { plane, next, is_reflex, blockers, tests_left, .. } = self;
        let mut predicates = 0;
        let (blocker, looked_at) = blockers.find(low, high, |i| {
            let c = plane[i];
            let is_past = !is_reflex[i] || next[i] == i;
            if is_past || c.x < low.x || c.x > high.x || c.y < low.y || c.y > high.y || i == a || i == b {
                return false;
            }
            // A corner at an end of the base blocks nothing: an edge that leads inwards from it cannot leave without a
            // corner inside. An edge from a corner at the tip may leave through the base.
            if c == p || c == r {
                return false;
            }
            predicates += PREDICATE_TESTS;
            let areas = [orient2d(p, q, c), orient2d(q, r, c), orient2d(r, p, c)];
            match ear {
                Ear::Touched => areas.iter().all(|&area| area > 0.0),
                _ => areas.iter().all(|&area| area >= 0.0),
            }
        });
        *tests_left = tests_left.checked_sub(looked_at + predicates)?;
        Some(!blocker)
    }
}

/// A fan from the first corner.
pub(super) fn fan(corners: &[u32], triangles: &mut [[u32; 3]]) {
    for (triangle, edge) in triangles.iter_mut().zip(corners[1..].windows(2)) {
        *triangle = [corners[0], edge[0], edge[1]];
    }
}
