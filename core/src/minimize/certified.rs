use core::array::from_fn;

use nalgebra::Vector3;

use super::sub_simplex::SubSimplex;
use super::{Minimizer, Minimum, Newton};
use crate::best_first::{BestFirstQueue, Node};
use crate::enclosure::PartVisitor;
use crate::number::kernel::LaneBundle;
use crate::number::{Float, Real};
use crate::rounding::rounding;
use crate::simplex::corner_weights;
use crate::vector::norm;
use crate::{EnclosedSdf, Goal, GradientBox, Sample, Simplex};

/// Branch and bound (Land and Doig 1960; Hansen and Walster 2003, "Global Optimization Using Interval Analysis"): the
/// simplex is cut in two again and again, always the piece whose lower bound ([`EnclosedSdf::enclosure`]) is least, until no piece
/// can hold a value much below the best one seen. What it answers is the least value of the whole simplex, however many
/// minima there are, to within the gap between value and lower bound.
///
/// It converged if that gap is within the tolerance. If not, the gap still holds: the budget ran out first.
///
/// A grid knows the least of a segment by itself, and of a triangle that meets some hundreds of cells at most
/// ([`EnclosedSdf::exact_minimum`]): such a one is not searched, and a larger one cut until its pieces are. Elsewhere it begins
/// where a few steps of [`Newton`] end: the lower the value to beat, the fewer the pieces.
///
/// Told of a level ([`Minimizer::minimize_below`]), it stops as soon as no value is at most that. Where the least is, it answers
/// the same as without.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Certified {
    /// How many times the field is asked at most, but for the local steps, the whole simplex, which always is, and what a grid
    /// looks at to tell the least of a piece by itself, which counts once.
    pub evaluations: u32,
    /// Done when the least value is known to within this share of longest edge · slope bound.
    pub tolerance: f64,
    /// Takes fewer evaluations in all than Frank-Wolfe or no local search, on shapes and on grids, and tells the point and
    /// not only the value well where the field is smooth.
    pub local: Newton,
}

impl Default for Certified {
    fn default() -> Self {
        // A value known to 1e-8 is a place known to 1e-4, where the field is smooth: no jitter.
        let local = Newton { iterations: 8, tolerance: 1e-8 };
        Self { evaluations: 1024, tolerance: 1e-3, local }
    }
}

/// Of fields within each other, and one more.
const MAX_ROUNDINGS: f64 = 8.0;

/// A point that was found among pieces is polished in this share of the simplex around it.
const PART_TO_POLISH: f64 = 0.125;

/// Pieces that wait at a time: 5 KB of triangles in f64.
const MAX_NODES: usize = 64;

/// With less room than this, the smallest piece is cut and not the most promising: that one is done with after as many
/// cuts, two for each halving of its size, and needs room for no more.
const ROOM_TO_FINISH: usize = 40;

impl<const N: usize> Minimizer<N> for Certified {
    const USES_SIMD: bool = true;

    /// Lane by lane, for each has pieces of its own.
    #[cfg_attr(feature = "std", inline(always))]
    fn minimize<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, N>) -> Minimum<R, N> {
        self.minimize_below(field, simplex, R::from_f64(f64::INFINITY))
    }

    #[cfg_attr(feature = "std", inline(always))]
    fn minimize_below<R: Real, F: EnclosedSdf>(&self, field: &F, simplex: &Simplex<R, N>, level: R) -> Minimum<R, N> {
        let mut minimum = Minimum::default();
        for lane in 0..R::LANES {
            let (simplex, level) = (simplex.lane(lane), level.lane(lane));
            let mut parts = PartsSearch {
                method: self,
                simplex: &simplex,
                level,
                best: None,
                open_bound: R::Lane::from_f64(f64::INFINITY),
                has_several: false,
            };
            field.visit_parts(&mut parts);
            minimum.set_lane(lane, parts.finish(field));
        }
        minimum
    }
}

impl Certified {
    #[cfg_attr(feature = "std", inline(always))]
    fn minimum<R: Float, F: EnclosedSdf, const N: usize>(
        &self,
        field: &F,
        simplex: &Simplex<R, N>,
        level: R,
    ) -> Minimum<R, N> {
        if let Some(minimum) = of_segment(field, simplex) {
            return minimum;
        }
        let longest = simplex.longest_edge();
        let in_cells = of_cells(field, simplex, Goal { level, gap: self.tolerance_on(field, longest) });
        if let Some(found) = in_cells {
            let [gap, rounding] = self.gap(field, simplex, longest, found.sample.value);
            let answer = found.answer(gap, rounding);
            if answer.converged || level < answer.lower_bound {
                return answer;
            }
        }
        self.search(field, simplex, level, in_cells)
    }

    #[inline(always)]
    fn tolerance_on<R: Float, F: EnclosedSdf>(&self, field: &F, longest_edge: R) -> R {
        longest_edge * R::from_f64(field.slope_bound() * self.tolerance)
    }

    /// Below a value by how much none is looked for, and how much it is off by rounding.
    #[inline(always)]
    fn gap<R: Float, F: EnclosedSdf, const N: usize>(
        &self,
        field: &F,
        simplex: &Simplex<R, N>,
        longest_edge: R,
        value: R,
    ) -> [R; 2] {
        // Each field within a field allows for rounding once more; one is in the value that a bound is compared with.
        let rounding = rounding(field.slope_bound(), simplex.corners[0], longest_edge, value);
        [self.tolerance_on(field, longest_edge) + rounding * R::from_f64(MAX_ROUNDINGS), rounding]
    }

    #[inline(never)]
    fn search<R: Float, F: EnclosedSdf, const N: usize>(
        &self,
        field: &F,
        simplex: &Simplex<R, N>,
        level: R,
        in_cells: Option<InCells<R, N>>,
    ) -> Minimum<R, N> {
        let boundary = if in_cells.is_some() { None } else { least_on_edges(field, simplex) };
        let mut search = match (in_cells, boundary) {
            (Some(found), _) => Search::from_cells(field, simplex, &found),
            (None, Some(boundary)) => Search::from_boundary(field, simplex, boundary),
            (None, None) => Search::from_local(field, simplex, &self.local),
        };
        let [gap, rounding] = self.gap(field, simplex, simplex.longest_edge(), search.best.value);
        if let Some(boundary) = boundary {
            search.queue.fathom(Real::min(boundary.value, search.best.value) - rounding);
        }
        let root = SimplexNode::root();
        match in_cells {
            Some(found) => search.enqueue(SimplexNode { lower_bound: found.least - rounding, ..root }, gap),
            None => search.look_at(root, search.best.weights, gap),
        }
        if boundary.is_some() && search.queue.count() > 0 {
            search.descend(&self.local, &SubSimplex::whole());
        }
        let mut converged = true;
        while let Some(node) = search.next_node() {
            if search.best.value - gap <= node.lower_bound {
                search.queue.fathom(node.lower_bound);
                continue;
            }
            if level < Real::min(node.lower_bound, search.lower_bound()) {
                search.queue.fathom(node.lower_bound);
                converged = false;
                break;
            }
            let Some(halves) = node.piece.cut(simplex) else {
                // No larger than rounding, which is all that its bound is off by, if there is one.
                converged &= node.lower_bound.is_finite();
                search.queue.fathom(node.lower_bound);
                continue;
            };
            if search.evaluations >= self.evaluations.saturating_add(search.within) {
                converged = false;
                search.queue.fathom(node.lower_bound);
                break;
            }
            let depth = node.depth.saturating_add(1);
            halves
                .into_iter()
                .for_each(|piece| search.look_at(SimplexNode { piece, depth, ..node }, piece.middle(), gap));
        }
        converged &= search.best.value - gap <= search.queue.overflow_bound();
        // A search that was stopped is not: polished, it might end lower than one that went on.
        if converged && search.is_rough {
            search.descend(&self.local, &SubSimplex::around(search.best.weights, R::from_f64(PART_TO_POLISH)));
        }
        search.finish(converged)
    }
}

/// The search of a union, part by part: the lowest of the parts' minima. A part whose bounds lie above the lowest so far is
/// not searched.
struct PartsSearch<'a, R: Float, const N: usize> {
    method: &'a Certified,
    simplex: &'a Simplex<R, N>,
    level: R,
    best: Option<Minimum<R, N>>,
    /// Lower bound of the parts whose search did not converge.
    open_bound: R,
    has_several: bool,
}

impl<R: Float, const N: usize> PartVisitor for PartsSearch<'_, R, N> {
    #[cfg_attr(feature = "std", inline(always))]
    fn visit<F: EnclosedSdf>(&mut self, part: &F) {
        let Some(best) = self.best else {
            let found = self.method.minimum(part, self.simplex, self.level);
            self.include(&found);
            self.best = Some(found);
            return;
        };
        self.has_several = true;
        let level = Real::min(self.level, best.sample.value);
        let longest = self.simplex.longest_edge();
        let rounding = rounding(part.slope_bound(), self.simplex.corners[0], longest, level);
        if level < R::from_f64(part.enclose_box(&self.simplex.bounds()).range.lower) - rounding {
            return;
        }
        let found = self.method.minimum(part, self.simplex, level);
        self.include(&found);
        let lowest = if found.sample.value < best.sample.value { found } else { best };
        self.best = Some(Minimum {
            lower_bound: Real::min(best.lower_bound, found.lower_bound),
            evaluations: best.evaluations + found.evaluations,
            ..lowest
        });
    }
}

impl<R: Float, const N: usize> PartsSearch<'_, R, N> {
    #[inline(always)]
    fn include(&mut self, found: &Minimum<R, N>) {
        if !found.converged {
            self.open_bound = Real::min(self.open_bound, found.lower_bound);
        }
    }

    /// The status at the minimum is that of the whole field, which has a kink where two parts meet.
    #[inline(always)]
    fn finish<F: EnclosedSdf>(self, field: &F) -> Minimum<R, N> {
        let Some(best) = self.best else { return Minimum::default() };
        if !self.has_several {
            return best;
        }
        let sample = field.evaluate(best.point);
        Minimum {
            sample,
            lower_bound: Real::min(best.lower_bound, sample.value),
            evaluations: best.evaluations + R::one(),
            converged: sample.value <= self.open_bound,
            ..best
        }
    }
}

/// What a field knows of a triangle by itself.
#[derive(Clone, Copy)]
struct InCells<R: Real, const N: usize> {
    weights: [R; N],
    point: Vector3<R>,
    sample: Sample<R>,
    /// But for rounding.
    least: R,
    looks: u32,
}

/// `None` where the field knows nothing, or this is no triangle.
#[cfg_attr(feature = "std", inline(always))]
fn of_cells<R: Float, F: EnclosedSdf, const N: usize>(
    field: &F,
    simplex: &Simplex<R, N>,
    goal: Goal<R>,
) -> Option<InCells<R, N>> {
    let &[a, b, c] = simplex.corners.as_slice() else { return None };
    let found = field.exact_minimum([a, b, c], goal)?;
    let mut weights = [R::zero(); N];
    weights.iter_mut().zip(found.weights).for_each(|(weight, of_corner)| *weight = of_corner);
    let point = simplex.point(weights);
    let sample = field.evaluate(point);
    let least = Real::min(found.lower_bound, sample.value);
    Some(InCells { weights, point, sample, least, looks: found.evaluations.saturating_add(1) })
}

impl<R: Float, const N: usize> InCells<R, N> {
    fn answer(&self, gap: R, rounding: R) -> Minimum<R, N> {
        let lower_bound = self.least - rounding;
        Minimum {
            weights: self.weights,
            point: self.point,
            sample: self.sample,
            lower_bound,
            evaluations: R::from_f64(f64::from(self.looks)),
            converged: self.sample.value - gap <= lower_bound,
        }
    }
}

/// The least value on the three edges of a triangle, where the field knows that by itself.
fn least_on_edges<R: Float, F: EnclosedSdf, const N: usize>(
    field: &F,
    simplex: &Simplex<R, N>,
) -> Option<Boundary<R, N>> {
    let &[a, b, c] = simplex.corners.as_slice() else { return None };
    let mut least = Boundary { weights: corner_weights(0), value: R::from_f64(f64::INFINITY), looks: 0 };
    for (ends, from, to) in [([a, b], 0, 1), ([b, c], 1, 2), ([c, a], 2, 0)] {
        let edge = field.exact_minimum(ends, Goal::exact())?;
        least.looks = least.looks.saturating_add(edge.evaluations);
        if edge.value < least.value {
            let (from, to): ([R; N], [R; N]) = (corner_weights(from), corner_weights(to));
            least.weights = from_fn(|k| from[k] * edge.weights[0] + to[k] * edge.weights[1]);
            least.value = edge.value;
        }
    }
    Some(least)
}

#[derive(Clone, Copy)]
struct Boundary<R, const N: usize> {
    weights: [R; N],
    value: R,
    looks: u32,
}

/// Where a field knows the least of a segment by itself.
#[cfg_attr(feature = "std", inline(always))]
fn of_segment<R: Float, F: EnclosedSdf, const N: usize>(field: &F, simplex: &Simplex<R, N>) -> Option<Minimum<R, N>> {
    let &[a, b] = simplex.corners.as_slice() else { return None };
    let least = field.exact_minimum([a, b], Goal::exact())?;
    let mut weights = [R::zero(); N];
    weights.iter_mut().zip(least.weights).for_each(|(weight, known)| *weight = known);
    let point = simplex.point(weights);
    let sample = field.evaluate(point);
    let rounding = rounding(field.slope_bound(), point, simplex.longest_edge(), sample.value);
    Some(Minimum {
        weights,
        point,
        sample,
        lower_bound: Real::min(least.value, sample.value) - rounding,
        evaluations: R::from_f64(f64::from(least.evaluations.saturating_add(1))),
        converged: true,
    })
}

/// Weights and the value there.
#[derive(Clone, Copy)]
struct Seen<R, const N: usize> {
    weights: [R; N],
    value: R,
}

struct Search<'a, R: Float, F, const N: usize> {
    field: &'a F,
    simplex: &'a Simplex<R, N>,
    best: Seen<R, N>,
    /// The best is the mean of some piece, and not where a local search ended.
    is_rough: bool,
    queue: BestFirstQueue<SimplexNode<R, N>, [SimplexNode<R, N>; MAX_NODES]>,
    evaluations: u32,
    /// Of these, those that were steps of a local search or in the cells of a grid along lines.
    within: u32,
    /// Where the least value of the boundary is known, so that only the inside is searched.
    plane: Option<Plane<R>>,
}

impl<'a, R: Float, F: EnclosedSdf, const N: usize> Search<'a, R, F, N> {
    fn from_local(field: &'a F, simplex: &'a Simplex<R, N>, local: &Newton) -> Self {
        let found = local.minimize(field, simplex);
        let best = Seen { weights: found.weights, value: found.sample.value };
        Self::from(field, simplex, best, found.evaluations.to_f64() as u32, None)
    }

    fn from_cells(field: &'a F, simplex: &'a Simplex<R, N>, found: &InCells<R, N>) -> Self {
        let best = Seen { weights: found.weights, value: found.sample.value };
        Self { within: found.looks, ..Self::from(field, simplex, best, found.looks, None) }
    }

    fn from_boundary(field: &'a F, simplex: &'a Simplex<R, N>, boundary: Boundary<R, N>) -> Self {
        let best = Seen { weights: boundary.weights, value: field.value(simplex.point(boundary.weights)) };
        let looks = boundary.looks.saturating_add(1);
        Self { within: boundary.looks, ..Self::from(field, simplex, best, looks, Some(Plane::of(simplex))) }
    }

    fn from(
        field: &'a F,
        simplex: &'a Simplex<R, N>,
        best: Seen<R, N>,
        evaluations: u32,
        plane: Option<Plane<R>>,
    ) -> Self {
        let queue = BestFirstQueue::new([SimplexNode::root(); MAX_NODES]);
        Self { field, simplex, best, is_rough: false, queue, evaluations, within: 0, plane }
    }

    /// Looks for a lower value in a piece.
    fn descend(&mut self, local: &Newton, piece: &SubSimplex<R, N>) {
        let found = local.minimize(self.field, &piece.of(self.simplex));
        self.evaluations = self.evaluations.saturating_add(found.evaluations.to_f64() as u32);
        // What is answered is the value at the point of the weights, and rounding may make that another one.
        let weights = piece.weights(found.weights);
        let value = self.field.value(self.simplex.point(weights));
        self.evaluations = self.evaluations.saturating_add(1);
        if value < self.best.value {
            self.best = Seen { weights, value };
        }
        self.is_rough = false;
    }

    /// Bounds a piece, whose bound so far is that of the one it was cut from, by a look at the point of these weights in it,
    /// and lets it wait, unless it cannot hold a value below the best by more than the gap.
    fn look_at(&mut self, node: SimplexNode<R, N>, weights: [R; N], gap: R) {
        let piece = node.piece.of(self.simplex);
        self.evaluations = self.evaluations.saturating_add(1);
        if let Some(found) = of_cells(self.field, &piece, Goal { level: self.best.value - gap, gap }) {
            return self.take(node, &found, gap);
        }
        let enclosure = self.field.enclosure(self.simplex.point(weights), &piece.corners);
        if enclosure.value < self.best.value {
            (self.best, self.is_rough) = (Seen { weights, value: enclosure.value }, true);
        }
        if self.plane.is_some_and(|plane| plane.is_crossed_downhill(&enclosure.gradients, self.field.slope_bound())) {
            return;
        }
        // Where the field is no number, nothing is certain.
        let is_known = enclosure.range.lower <= enclosure.value;
        let lower_bound =
            if is_known { Real::max(enclosure.range.lower, node.lower_bound) } else { R::from_f64(f64::NEG_INFINITY) };
        self.enqueue(SimplexNode { lower_bound, ..node }, gap);
    }

    /// What the field knows of a piece by itself.
    fn take(&mut self, node: SimplexNode<R, N>, found: &InCells<R, N>, gap: R) {
        self.evaluations = self.evaluations.saturating_add(found.looks);
        self.within = self.within.saturating_add(found.looks);
        let weights = node.piece.weights(found.weights);
        let point = self.simplex.point(weights);
        let value = self.field.value(point);
        let rounding = rounding(self.field.slope_bound(), point, self.simplex.longest_edge(), value);
        let lower_bound = Real::max(found.least - rounding, node.lower_bound);
        if value < self.best.value {
            (self.best, self.is_rough) = (Seen { weights, value }, lower_bound < value - gap);
        }
        self.enqueue(SimplexNode { lower_bound, ..node }, gap);
    }

    fn enqueue(&mut self, node: SimplexNode<R, N>, gap: R) {
        if node.lower_bound < self.best.value - gap {
            self.queue.push_evicting(node);
        } else {
            self.queue.fathom(node.lower_bound);
        }
    }

    /// The node with the lowest bound, or, where room is short, the smallest.
    fn next_node(&mut self) -> Option<SimplexNode<R, N>> {
        if self.queue.count() > MAX_NODES - ROOM_TO_FINISH {
            self.queue.pop_deepest(|node| node.depth)
        } else {
            self.queue.pop()
        }
    }

    /// What no value is below.
    fn lower_bound(&self) -> R {
        Real::min(self.best.value, self.queue.lower_bound())
    }

    fn finish(self, converged: bool) -> Minimum<R, N> {
        let weights = self.best.weights;
        let point = self.simplex.point(weights);
        let lower_bound = self.lower_bound();
        Minimum {
            weights,
            point,
            sample: self.field.evaluate(point),
            lower_bound,
            evaluations: R::from_f64(f64::from(self.evaluations.saturating_add(1))),
            converged,
        }
    }
}

/// The plane of a triangle, by two ways in it that are at right angles.
#[derive(Clone, Copy)]
struct Plane<R: Real> {
    ways: [Vector3<R>; 2],
}

impl<R: Float> Plane<R> {
    fn of<const N: usize>(simplex: &Simplex<R, N>) -> Self {
        let &[a, b, c] = simplex.corners.as_slice() else { return Self { ways: [Vector3::zeros(); 2] } };
        let (along, other) = (b - a, c - a);
        let across = other - part_along(along, other);
        // Of a sliver rounding alone may tell where it lies.
        let is_valid = norm(other) * R::from_f64(1e-3) < norm(across);
        Self { ways: [along, if is_valid { across } else { Vector3::zeros() }] }
    }

    /// Whether along some way in the plane the field falls for all these gradients: then no point of them, if not on the
    /// boundary, holds a least value (0 is in the generalized gradient there: Clarke 1983, "Optimization and Nonsmooth
    /// Analysis", prop. 2.3.2).
    fn is_crossed_downhill(&self, gradients: &GradientBox<R>, slope_bound: f64) -> bool {
        let middle = (gradients.lower + gradients.upper) * R::from_f64(0.5);
        let uphill = self.ways.iter().fold(Vector3::zeros(), |sum, way| sum + part_along(*way, middle));
        // More than what is off by rounding, and by how far the way leaves the plane.
        let rounding = norm(uphill) * R::from_f64(slope_bound * 1024.0 * R::EPSILON);
        rounding < gradients.change_along(uphill).lower
    }
}

/// The part of a vector along a way, zero if that is.
fn part_along<R: Float>(way: Vector3<R>, vector: Vector3<R>) -> Vector3<R> {
    let square = way.dot(&way);
    if R::zero() < square { way * (vector.dot(&way) / square) } else { Vector3::zeros() }
}

/// A part of the simplex that is still to be cut or dropped.
#[derive(Clone, Copy)]
struct SimplexNode<R, const N: usize> {
    piece: SubSimplex<R, N>,
    lower_bound: R,
    /// How many cuts made it.
    depth: u32,
}

impl<R: Float, const N: usize> SimplexNode<R, N> {
    fn root() -> Self {
        Self { piece: SubSimplex::whole(), lower_bound: R::from_f64(f64::NEG_INFINITY), depth: 0 }
    }
}

impl<R: Float, const N: usize> Node for SimplexNode<R, N> {
    type Bound = R;
    fn lower_bound(&self) -> R {
        self.lower_bound
    }
}
