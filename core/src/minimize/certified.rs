use core::array::from_fn;

use super::{FrankWolfe, Minimizer, Minimum};
use crate::real::{Float, Real};
use crate::simplex::corner_weights;
use crate::survey::rounding;
use crate::vector::norm;
use crate::{Sdf, Simplex};

/// Branch and bound (Land and Doig 1960; Hansen and Walster 2003, "Global Optimization Using Interval Analysis"): the
/// simplex is cut in two again and again, always the piece whose lower bound ([`Sdf::survey`]) is least, until no piece
/// can hold a value much below the best one seen. What it answers is the least value of the whole simplex, however many
/// minima there are, to within the gap between value and lower bound.
///
/// It converged if that gap is within the tolerance. If not, the gap still holds: the budget ran out first.
///
/// It begins where a few steps of [`FrankWolfe`] end: the lower the value to beat, the fewer the pieces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Certified {
    /// How many times the field is asked at most, but for the local steps and the whole simplex, which always are.
    pub evaluations: u32,
    /// Done when the least value is known to within this share of longest edge · slope bound.
    pub tolerance: f64,
    /// Of 0, 8, 16 and 32 such steps 8 and 16 took the fewest evaluations in all, on shapes and on grids.
    pub local: FrankWolfe,
}

impl Default for Certified {
    fn default() -> Self {
        let local = FrankWolfe { iterations: 12, ..FrankWolfe::default() };
        Self { evaluations: 1024, tolerance: 1e-3, local }
    }
}

/// Of fields within each other, and one more.
const MOST_ROUNDINGS: f64 = 8.0;

/// Pieces that wait at a time: 5 KB of triangles in f64.
const MOST_PIECES: usize = 64;

/// With less room than this, the smallest piece is cut and not the most promising: that one is done with after as many
/// cuts, two for each halving of its size, and needs room for no more.
const ROOM_TO_FINISH: usize = 40;

impl<const N: usize> Minimizer<N> for Certified {
    /// Lane by lane, for each has pieces of its own.
    fn minimize<R: Real, F: Sdf>(&self, field: &F, simplex: &Simplex<R, N>) -> Minimum<R, N> {
        let first = self.minimum(field, &simplex.lane(0));
        let mut minimum = Minimum::splat(first);
        for lane in 1..R::LANES {
            minimum.set_lane(lane, self.minimum(field, &simplex.lane(lane)));
        }
        minimum
    }
}

impl Certified {
    fn minimum<R: Float, F: Sdf, const N: usize>(&self, field: &F, simplex: &Simplex<R, N>) -> Minimum<R, N> {
        if let Some(minimum) = of_segment(field, simplex) {
            return minimum;
        }
        let mut search = Search::from(field, simplex, &self.local.minimize(field, simplex));
        let longest_edge = simplex.longest_edge();
        let slope_bound = field.slope_bound();
        // Each field within a field allows for rounding once more; one is in the value that a bound is compared with.
        let rounding = rounding(slope_bound, simplex.corners[0], longest_edge, search.best.value);
        let gap = longest_edge * R::lift(slope_bound * self.tolerance) + rounding * R::lift(MOST_ROUNDINGS);
        let whole = from_fn(corner_weights);
        search.look_at(Piece { corners: whole, least: R::lift(f64::NEG_INFINITY), cuts: 0 }, gap);
        let mut converged = true;
        while let Some(piece) = search.waiting.pop() {
            if search.best.value - gap <= piece.least {
                search.settle(piece.least);
                continue;
            }
            let Some(halves) = piece.cut(simplex) else {
                converged = false;
                search.settle(piece.least);
                continue;
            };
            if search.evaluations >= self.evaluations {
                converged = false;
                search.settle(piece.least);
                break;
            }
            halves.into_iter().for_each(|half| search.look_at(half, gap));
        }
        search.finish(converged)
    }
}

/// Where a field knows the least of a segment by itself.
fn of_segment<R: Float, F: Sdf, const N: usize>(field: &F, simplex: &Simplex<R, N>) -> Option<Minimum<R, N>> {
    let &[a, b] = simplex.corners.as_slice() else { return None };
    let least = field.least_on_segment([a, b])?;
    let mut weights = [R::zero(); N];
    weights.iter_mut().zip([R::one() - least.share, least.share]).for_each(|(weight, share)| *weight = share);
    let point = simplex.point(weights);
    let sample = field.evaluate(point);
    let rounding = rounding(field.slope_bound(), point, simplex.longest_edge(), sample.value);
    Some(Minimum {
        weights,
        point,
        sample,
        lower_bound: Real::min(least.value, sample.value) - rounding,
        evaluations: R::lift(f64::from(least.looks.saturating_add(1))),
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
    waiting: Waiting<R, N>,
    /// No piece that is done with holds a value below this.
    settled: R,
    evaluations: u32,
}

impl<'a, R: Float, F: Sdf, const N: usize> Search<'a, R, F, N> {
    fn from(field: &'a F, simplex: &'a Simplex<R, N>, local: &Minimum<R, N>) -> Self {
        let best = Seen { weights: local.weights, value: local.sample.value };
        let evaluations = local.evaluations.to_f64() as u32;
        let settled = R::lift(f64::INFINITY);
        Self { field, simplex, best, waiting: Waiting::new(), settled, evaluations }
    }

    /// Bounds a piece, whose bound so far is that of the one it was cut from, and lets it wait, unless it cannot hold a
    /// value below the best by more than the gap.
    fn look_at(&mut self, piece: Piece<R, N>, gap: R) {
        let corners = piece.corners;
        let survey = self.field.survey(&corners.map(|weights| self.simplex.point(weights)));
        self.evaluations = self.evaluations.saturating_add(1);
        if survey.value < self.best.value {
            let share = R::lift(1.0 / N as f64);
            let mut weights = [R::zero(); N];
            for corner in &corners {
                weights.iter_mut().zip(corner).for_each(|(weight, of_corner)| *weight += *of_corner * share);
            }
            // What is answered is the value at the point of the weights, and rounding may make that another one.
            let value = self.field.value(self.simplex.point(weights));
            self.evaluations = self.evaluations.saturating_add(1);
            if value < self.best.value {
                self.best = Seen { weights, value };
            }
        }
        // Where the field is no number, nothing is certain.
        let is_known = survey.least <= survey.value;
        let least = if is_known { Real::max(survey.least, piece.least) } else { R::lift(f64::NEG_INFINITY) };
        if least < self.best.value - gap {
            let given_up = self.waiting.push(Piece { least, ..piece });
            self.settle(given_up);
        } else {
            self.settle(least);
        }
    }

    fn settle(&mut self, least: R) {
        self.settled = Real::min(self.settled, least);
    }

    fn finish(self, converged: bool) -> Minimum<R, N> {
        let Seen { weights, value } = self.best;
        let point = self.simplex.point(weights);
        let lower_bound = Real::min(value, Real::min(self.settled, self.waiting.least()));
        Minimum {
            weights,
            point,
            sample: self.field.evaluate(point),
            lower_bound,
            evaluations: R::lift(f64::from(self.evaluations.saturating_add(1))),
            converged,
        }
    }
}

/// A part of the simplex, by its corners' weights.
#[derive(Clone, Copy)]
struct Piece<R, const N: usize> {
    corners: [[R; N]; N],
    least: R,
    /// How many cuts made it.
    cuts: u32,
}

impl<R: Float, const N: usize> Piece<R, N> {
    /// In two, at the middle of the longest edge; `None` if that is no longer than rounding.
    fn cut(&self, simplex: &Simplex<R, N>) -> Option<[Self; 2]> {
        let mut longest = (R::zero(), 0, 0);
        let (mut from, mut to) = (self.corners[0], self.corners[0]);
        for (a, at_a) in self.corners.iter().enumerate() {
            for (b, at_b) in self.corners.iter().enumerate() {
                let length = norm(simplex.point(*at_b) - simplex.point(*at_a));
                if longest.0 < length {
                    longest = (length, a, b);
                    (from, to) = (*at_a, *at_b);
                }
            }
        }
        let (_, a, b) = longest;
        let mut middle = from;
        middle.iter_mut().zip(to).for_each(|(weight, other)| *weight = (*weight + other) * R::lift(0.5));
        let without = |end: usize| {
            let mut corners = self.corners;
            corners
                .iter_mut()
                .enumerate()
                .filter(|(corner, _)| *corner == end)
                .for_each(|(_, weights)| *weights = middle);
            Self { corners, cuts: self.cuts.saturating_add(1), ..*self }
        };
        (middle != from && middle != to).then(|| [without(a), without(b)])
    }
}

/// Pieces in a heap, the one with the least bound on top.
struct Waiting<R, const N: usize> {
    pieces: [Piece<R, N>; MOST_PIECES],
    count: usize,
}

impl<R: Float, const N: usize> Waiting<R, N> {
    fn new() -> Self {
        Self { pieces: [Piece { corners: [[R::zero(); N]; N], least: R::zero(), cuts: 0 }; MOST_PIECES], count: 0 }
    }

    /// The least bound of all.
    fn least(&self) -> R {
        if self.count == 0 { R::lift(f64::INFINITY) } else { self.pieces[0].least }
    }

    /// Returns the bound of the piece that found no room, or infinity.
    fn push(&mut self, piece: Piece<R, N>) -> R {
        if self.count < MOST_PIECES {
            self.place(self.count, piece);
            self.count = self.count.saturating_add(1);
            return R::lift(f64::INFINITY);
        }
        // The greatest bound is among those with none below them.
        let leaves = self.pieces.iter().enumerate().skip(MOST_PIECES / 2);
        let greatest =
            leaves.fold(
                (0, piece.least),
                |(at, most), (leaf, waiting)| {
                    if most < waiting.least { (leaf, waiting.least) } else { (at, most) }
                },
            );
        if piece.least < greatest.1 {
            self.place(greatest.0, piece);
        }
        greatest.1
    }

    /// The one with the least bound, or, where room is short, the smallest.
    fn pop(&mut self) -> Option<Piece<R, N>> {
        let mut at = 0;
        if self.count > MOST_PIECES - ROOM_TO_FINISH {
            for other in 1..self.count {
                at = if self.at(at).cuts < self.at(other).cuts { other } else { at };
            }
        }
        let taken = *self.at(at);
        self.count = self.count.checked_sub(1)?;
        let last = *self.at(self.count);
        loop {
            let below = [1, 2]
                .map(|side| at.saturating_mul(2).saturating_add(side))
                .into_iter()
                .filter(|child| *child < self.count);
            let lower = |a: usize, b: usize| if self.at(b).least < self.at(a).least { b } else { a };
            let Some(least) = below.reduce(lower).filter(|child| self.at(*child).least < last.least) else { break };
            *self.at_mut(at) = *self.at(least);
            at = least;
        }
        self.place(at, last);
        Some(taken)
    }

    /// At a place that is free, or up from there as far as its bound is the lower.
    fn place(&mut self, free: usize, piece: Piece<R, N>) {
        let mut at = free;
        while at > 0 && piece.least < self.at((at - 1) / 2).least {
            *self.at_mut(at) = *self.at((at - 1) / 2);
            at = (at - 1) / 2;
        }
        *self.at_mut(at) = piece;
    }

    /// All indices are below the number of places; said so that no check of it can panic.
    #[inline]
    fn at(&self, index: usize) -> &Piece<R, N> {
        &self.pieces[index % MOST_PIECES]
    }

    #[inline]
    fn at_mut(&mut self, index: usize) -> &mut Piece<R, N> {
        &mut self.pieces[index % MOST_PIECES]
    }
}
