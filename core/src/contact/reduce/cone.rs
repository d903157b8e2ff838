//! How near is a row to the cone of others? Non-negative least squares (Lawson and Hanson 1974, "Solving Least Squares Problems",
//! chapter 23), by orthogonalization of at most seven rows.

use super::MAX_REDUCED;
use crate::number::{Float, Real};

const DIMENSIONS: usize = 7;

/// Three numbers of a shift, three of a turn, and a gap.
pub(super) type WrenchRow<R> = [R; DIMENSIONS];

/// Rows are exchanged at most so often; at most seven are at work at a time, so that more is seldom needed.
const MAX_EXCHANGES: usize = 4 * DIMENSIONS;

/// All sums of the rows that are held, with weights that are not negative.
pub(super) struct Cone<R> {
    /// Rows of length one. The first says that a gap may be wider.
    rows: [WrenchRow<R>; MAX_REDUCED + 1],
    count: usize,
}

impl<R: Float> Cone<R> {
    pub(super) fn new() -> Self {
        let mut rows = [[R::zero(); DIMENSIONS]; MAX_REDUCED + 1];
        rows[0][DIMENSIONS - 1] = R::one();
        Self { rows, count: 0 }
    }

    /// Number of rows that were added.
    pub(super) fn count(&self) -> usize {
        self.count
    }

    /// Adds a row, if there is room.
    pub(super) fn add(&mut self, row: WrenchRow<R>) {
        if let Some(free) = self.rows.get_mut(self.count + 1) {
            let length = dot(&row, &row).sqrt();
            *free = row.map(|x| x / length);
            self.count += 1;
        }
    }

    /// The distance of a row from the cone, or an upper bound of it that is at most the limit. The distance is a convex function, so that the
    /// farthest of many rows is a corner of their convex hull: of a flat face, one of its corners.
    pub(super) fn distance(&self, row: &WrenchRow<R>, limit: R) -> R {
        let rest = self.rest(row, |rest| dot(rest, rest) <= limit * limit);
        dot(&rest, &rest).sqrt()
    }

    /// How far a contact can sink in a movement of length one while those of the cone are held, or an upper bound of that which is at most the
    /// limit.
    pub(super) fn shortfall(&self, row: &WrenchRow<R>, limit: R) -> R {
        shortfall_of(&self.rest(row, |rest| shortfall_of(rest) <= limit))
    }

    /// The row less a sum of those of the cone: the least such rest, or one that is enough.
    fn rest(&self, row: &WrenchRow<R>, is_enough: impl Fn(&WrenchRow<R>) -> bool) -> WrenchRow<R> {
        let mut sum = Sum::empty();
        let mut rest = *row;
        // A gap may be wider.
        rest[DIMENSIONS - 1] = Real::min(rest[DIMENSIONS - 1], R::zero());
        for _ in 0..MAX_EXCHANGES {
            if is_enough(&rest) || !self.steepest(&rest).is_some_and(|steepest| sum.enter(steepest, row)) {
                break;
            }
            rest = sum.rest_of(row);
        }
        rest
    }

    /// The row that lowers the rest fastest; `None` if none does.
    fn steepest(&self, rest: &WrenchRow<R>) -> Option<WrenchRow<R>> {
        let mut steepest = (None, tolerance::<R>());
        for row in self.rows.iter().take(self.count + 1) {
            let slope = dot(row, rest);
            if steepest.1 < slope {
                steepest = (Some(*row), slope);
            }
        }
        steepest.0
    }
}

/// Independent rows with positive weights.
struct Sum<R> {
    rows: [WrenchRow<R>; DIMENSIONS],
    weights: [R; DIMENSIONS],
    count: usize,
}

impl<R: Float> Sum<R> {
    fn empty() -> Self {
        Self { rows: [[R::zero(); DIMENSIONS]; DIMENSIONS], weights: [R::zero(); DIMENSIONS], count: 0 }
    }

    /// The target less the sum.
    fn rest_of(&self, target: &WrenchRow<R>) -> WrenchRow<R> {
        let mut rest = *target;
        for (row, weight) in self.rows.iter().zip(self.weights).take(self.count) {
            subtract(&mut rest, row, weight);
        }
        rest
    }

    /// Takes one row more, and the weights that bring the sum nearest to the target. Rows whose weights would be negative leave. `false`,
    /// and nothing changes, if the row is a sum of the others.
    fn enter(&mut self, row: WrenchRow<R>, target: &WrenchRow<R>) -> bool {
        let Some(free) = self.rows.get_mut(self.count) else { return false };
        *free = row;
        self.weights[self.count % DIMENSIONS] = R::zero();
        self.count += 1;
        let Some(mut best) = self.best_weights(target) else {
            self.count -= 1;
            return false;
        };
        while best.iter().take(self.count).any(|weight| *weight <= R::zero()) {
            self.go_toward(&best);
            match self.best_weights(target) {
                Some(weights) => best = weights,
                None => return true,
            }
        }
        self.weights = best;
        true
    }

    /// Moves the weights toward others until the first of them is zero, and drops the rows that have none.
    fn go_toward(&mut self, best: &[R; DIMENSIONS]) {
        let (mut share, mut leaves) = (R::one(), 0);
        for (index, (weight, best)) in self.weights.iter().zip(best).take(self.count).enumerate() {
            let until_zero = *weight / (*weight - *best);
            if *best <= R::zero() && until_zero <= share {
                (share, leaves) = (until_zero, index);
            }
        }
        let mut kept = 0;
        for index in 0..self.count.min(DIMENSIONS) {
            let weight = self.weights[index] + (best[index] - self.weights[index]) * share;
            if index != leaves && R::zero() < weight {
                (self.rows[kept], self.weights[kept]) = (self.rows[index], weight);
                kept += 1;
            }
        }
        self.count = kept;
    }

    /// The weights, of any sign, with which the rows come nearest to the target: modified Gram-Schmidt. `None` if they are not
    /// independent.
    fn best_weights(&self, target: &WrenchRow<R>) -> Option<[R; DIMENSIONS]> {
        let count = self.count.min(DIMENSIONS);
        let mut axes = self.rows;
        let mut shares = [[R::zero(); DIMENSIONS]; DIMENSIONS];
        let mut weights = [R::zero(); DIMENSIONS];
        for j in 0..count {
            let mut axis = axes[j];
            let before = dot(&axis, &axis).sqrt();
            for i in 0..j {
                shares[i][j] = dot(&axes[i], &axis);
                subtract(&mut axis, &axes[i], shares[i][j]);
            }
            let length = dot(&axis, &axis).sqrt();
            let is_independent = before * tolerance::<R>() < length;
            if !is_independent {
                return None;
            }
            shares[j][j] = length;
            axes[j] = axis.map(|x| x / length);
            weights[j] = dot(&axes[j], target);
        }
        for j in (0..count).rev() {
            for k in j + 1..count {
                weights[j] -= shares[j][k] * weights[k];
            }
            weights[j] /= shares[j][j];
        }
        Some(weights)
    }
}

/// How far a contact can sink whose row is a sum of others and this rest.
fn shortfall_of<R: Float>(&[x, y, z, turn_x, turn_y, turn_z, gap]: &WrenchRow<R>) -> R {
    let way = (x * x + y * y + z * z).sqrt();
    let turn = (turn_x * turn_x + turn_y * turn_y + turn_z * turn_z).sqrt();
    Real::max(way, turn) + Real::max(-gap, R::zero())
}

/// Rows that differ by less are one, and slopes below are none: the root of what rounding leaves.
fn tolerance<R: Float>() -> R {
    R::from_f64(R::EPSILON).sqrt()
}

fn dot<R: Float>(a: &WrenchRow<R>, b: &WrenchRow<R>) -> R {
    a.iter().zip(b).fold(R::zero(), |sum, (a, b)| sum + *a * *b)
}

/// Subtracts a multiple of a row.
fn subtract<R: Float>(from: &mut WrenchRow<R>, row: &WrenchRow<R>, weight: R) {
    for (x, y) in from.iter_mut().zip(row) {
        *x -= *y * weight;
    }
}
