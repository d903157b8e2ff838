//! One polygon into triangles.
//!
//! The polygon is seen along the axis that its Newell normal leans to most: dropping that coordinate rounds nothing, so
//! the signs of the areas are exact (predicates by J. Shewchuk 1997, crate robust), and what is simple in its plane
//! stays simple.
//!
//! Why positive triangles are enough: fans and ears add up, as signed areas, to the winding number of the polygon at
//! every place. Where the polygon is simple that is 1 inside and 0 outside. Triangles that are all positive can then
//! neither overlap nor stick out. So a fan of positive triangles is right, convex or not, and the rest goes to ears.

use robust::{Coord, orient2d};
use std::collections::VecDeque;

/// Corners above which a concave polygon is not clipped: the work grows with their square, and this many take under a
/// second when all of them point inwards. Much less would catch the caps of machine parts.
const MAX_CORNERS: usize = 10_000;

/// Corner-in-ear tests that all polygons of a file may take together, some 4 s: a file of many hostile polygons just
/// under [`MAX_CORNERS`] would take hours. A file of honest ones takes less than a thousandth.
const MAX_TESTS: u64 = 1 << 32;

/// How a polygon was cut.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cut {
    /// A fan from the first corner, all its triangles positive.
    Fan,
    /// Ears clipped one by one.
    Ears,
    /// A fan that nothing vouches for: no area, edges that cross, or too much work.
    Blind,
}

/// What a corner must be to be clipped.
#[derive(Clone, Copy)]
enum Ear {
    /// Positive, with no corner in it or on its rim.
    Strict,
    /// Without area: a corner along a straight edge, a repeated one, a spike.
    Flat,
    /// Positive, with corners on its rim at most, as where a hole is joined to the outline.
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

/// The room that cutting needs, kept from one polygon to the next.
pub(super) struct Triangulator {
    plane: Vec<Coord<f64>>,
    /// The corners not yet clipped, as a ring; a clipped one is its own `next`.
    before: Vec<usize>,
    next: Vec<usize>,
    /// Whether the corner is not convex.
    reflex: Vec<bool>,
    /// Every corner that is reflex, and some that were.
    blockers: Vec<usize>,
    queue: VecDeque<usize>,
    tests_left: u64,
}

impl Triangulator {
    pub(super) fn new() -> Self {
        Self {
            plane: Vec::new(),
            before: Vec::new(),
            next: Vec::new(),
            reflex: Vec::new(),
            blockers: Vec::new(),
            queue: VecDeque::new(),
            tests_left: MAX_TESTS,
        }
    }

    /// Writes the n - 2 triangles of n corners, in the polygon's winding. The same corners give the same triangles,
    /// unless [`MAX_TESTS`] have run out.
    pub(super) fn cut(&mut self, points: &[[f64; 3]], corners: &[u32], triangles: &mut [[u32; 3]]) -> Cut {
        debug_assert!(corners.len() >= 3 && triangles.len() == corners.len() - 2);
        let seen = self.project(points, corners);
        let last = corners.len() - 1;
        if seen && (1..last).all(|i| self.area(0, i, i + 1) > 0.0) {
            fan(corners, triangles);
            return Cut::Fan;
        }
        if seen && corners.len() <= MAX_CORNERS && self.clip_ears(corners, triangles).is_some() {
            return Cut::Ears;
        }
        fan(corners, triangles);
        Cut::Blind
    }

    /// Fills `plane` such that a positive area is seen; false where there is none to speak of.
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

    /// Twice the area of a triangle of corners; its sign is exact.
    fn area(&self, a: usize, b: usize, c: usize) -> f64 {
        orient2d(self.plane[a], self.plane[b], self.plane[c])
    }

    /// `None` where no ear is left or the work is too much.
    fn clip_ears(&mut self, corners: &[u32], triangles: &mut [[u32; 3]]) -> Option<()> {
        let n = corners.len();
        self.link(n);
        self.queue.clear();
        let (mut written, mut ear, mut clipped) = (0, Ear::Strict, true);
        while written < n - 3 {
            let Some(tip) = self.queue.pop_front() else {
                // An ear less changes its two neighbours alone, unless corners touch: look at all that are left again.
                ear = if clipped { Ear::Strict } else { ear.weaker()? };
                clipped = false;
                self.queue.extend((0..n).filter(|&i| self.next[i] != i));
                continue;
            };
            if self.next[tip] == tip || !self.is_ear(tip, ear)? {
                continue;
            }
            let (a, b) = (self.before[tip], self.next[tip]);
            triangles[written] = [corners[a], corners[tip], corners[b]];
            written += 1;
            self.next[a] = b;
            self.before[b] = a;
            self.next[tip] = tip;
            self.judge(a);
            self.judge(b);
            let (next, reflex) = (&self.next, &self.reflex);
            self.blockers.retain(|&i| reflex[i] && next[i] != i);
            self.queue.extend([a, b]);
            clipped = true;
        }
        let tip = (0..n).find(|&i| self.next[i] != i)?;
        let (a, b) = (self.before[tip], self.next[tip]);
        triangles[written] = [corners[a], corners[tip], corners[b]];
        (self.area(a, tip, b) >= 0.0).then_some(())
    }

    fn link(&mut self, n: usize) {
        self.before.clear();
        self.before.extend((0..n).map(|i| if i == 0 { n - 1 } else { i - 1 }));
        self.next.clear();
        self.next.extend((0..n).map(|i| if i + 1 == n { 0 } else { i + 1 }));
        self.reflex.clear();
        self.reflex.resize(n, false);
        self.blockers.clear();
        (0..n).for_each(|i| self.judge(i));
    }

    fn judge(&mut self, corner: usize) {
        let reflex = self.area(self.before[corner], corner, self.next[corner]) <= 0.0;
        if reflex && !self.reflex[corner] {
            self.blockers.push(corner);
        }
        self.reflex[corner] = reflex;
    }

    fn is_ear(&mut self, tip: usize, ear: Ear) -> Option<bool> {
        let (a, b) = (self.before[tip], self.next[tip]);
        let area = self.area(a, tip, b);
        self.tests_left = self.tests_left.checked_sub(1)?;
        if matches!(ear, Ear::Flat) {
            return Some(area == 0.0);
        }
        if area <= 0.0 || area.is_nan() {
            return Some(false);
        }
        self.tests_left = self.tests_left.checked_sub(self.blockers.len() as u64)?;
        let [p, q, r] = [self.plane[a], self.plane[tip], self.plane[b]];
        let (left, right) = (p.x.min(q.x).min(r.x), p.x.max(q.x).max(r.x));
        let (low, high) = (p.y.min(q.y).min(r.y), p.y.max(q.y).max(r.y));
        Some(!self.blockers.iter().any(|&i| {
            let c = self.plane[i];
            if c.x < left || c.x > right || c.y < low || c.y > high || i == a || i == b {
                return false;
            }
            // A corner on one of the base's ends blocks nothing: what leads inwards from it cannot get out again
            // without a corner inside. One on the tip may, across the base.
            if c == p || c == r {
                return false;
            }
            let areas = [orient2d(p, q, c), orient2d(q, r, c), orient2d(r, p, c)];
            match ear {
                Ear::Touched => areas.iter().all(|&area| area > 0.0),
                _ => areas.iter().all(|&area| area >= 0.0),
            }
        }))
    }
}

/// A fan from the first corner.
pub(super) fn fan(corners: &[u32], triangles: &mut [[u32; 3]]) {
    for (triangle, edge) in triangles.iter_mut().zip(corners[1..].windows(2)) {
        *triangle = [corners[0], edge[0], edge[1]];
    }
}
