//! Every problem of a case put to a method in a number type: what was promised is checked, and what came out is counted.

use sdf_core::Sdf;
use sdf_core::contact::ContactStatus;

use super::answer::{Fate, Found, Number, ask};
use super::cases::Case;
use super::problem::{BUDGET, Problem, ROUNDINGS, TOLERANCE, certifies, name};
use crate::methods::{Method, methods};

/// What came of the problems of one case by one method in one number type.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    pub method: String,
    pub number: &'static str,
    /// How often an element was asked for its least value.
    pub searches: usize,
    /// The same with a margin near its least value.
    pub queries: usize,
    pub converged: usize,
    pub budget_spent: usize,
    pub degenerate: usize,
    pub outside: usize,
    pub culled: usize,
    pub apart: usize,
    pub contacts: usize,
    /// Elements within the margin that were called apart, with a lower bound that leaves it open.
    pub undecided: usize,
    /// Elements within the margin that were culled, or called apart by a lower bound above it.
    pub lost: usize,
    /// The most that an answer was above the truth, in longest edge · slope bound, of elements where rounding is less than
    /// that.
    pub worst_error: f64,
    /// The most that an answer was above the truth, over what its own lower bound and rounding allow.
    pub worst_of_bound: f64,
    /// The most that the value differed from the field's own in f64 at the same point, and at vertices from the answer in f64,
    /// in ε · max(slope bound · largest length, value).
    pub worst_rounding: f64,
    /// The most that the answer differed from that in f64, over what both lower bounds and rounding allow.
    pub worst_difference: f64,
    /// The largest of the bounds on the error, in longest edge · slope bound.
    pub bound: f64,
    /// Promises that did not hold.
    pub broken: Vec<String>,
}

/// All methods in both number types, with elements of all kinds.
pub fn tallies(case: &Case) -> Vec<Tally> {
    let mut tallies: Vec<Tally> = vec![];
    for body in &(case.bodies)() {
        for triangle in &body.elements {
            for corners in 1..=3 {
                let problem = Problem::new(body, triangle, corners);
                for method in methods(corners, BUDGET) {
                    for number in Number::BOTH {
                        tally_of(&mut tallies, &method, number).put(&problem, &method, number);
                    }
                }
            }
        }
    }
    tallies
}

/// A new one at the first query of a method.
fn tally_of<'a>(tallies: &'a mut Vec<Tally>, method: &Method, number: Number) -> &'a mut Tally {
    let (method, number) = (name(method), number.name());
    let at = tallies.iter().position(|tally| tally.method == method && tally.number == number).unwrap_or(tallies.len());
    if at == tallies.len() {
        tallies.push(Tally { method, number, ..Tally::default() });
    }
    &mut tallies[at]
}

impl Tally {
    fn put(&mut self, problem: &Problem, method: &Method, number: Number) {
        let found = problem.least(method, number);
        self.searches += 1;
        self.is_valid(problem, number, &found);
        let bound = self.is_near_the_truth(problem, method, number, &found);
        self.is_near_double(problem, method, number, &found, bound);
        let rests = ask(&problem.body.field, method, found.value, &problem.corners, number);
        let is_contact = matches!(rests.fate, Fate::Contact(_));
        self.expect(is_contact, "what rests at the margin exactly is a contact", problem, &(found.value, &rests));
        let rounding = problem.rounding(number, problem.truth);
        for beyond in
            [1.01 * rounding, 2.0 * TOLERANCE * problem.range + 10.0 * rounding, 0.1 * problem.range + rounding]
        {
            self.query(problem, method, number, problem.truth + beyond);
        }
    }

    fn expect(&mut self, holds: bool, promise: &str, problem: &Problem, told: &dyn std::fmt::Debug) {
        if !holds {
            let Problem { body, corners, truth, floor, .. } = problem;
            self.broken.push(format!(
                "{promise}: {} in {} at {} on {corners:?}, truth {truth:e} (floor {floor:e}): {told:?}",
                self.method, self.number, body.name
            ));
        }
    }

    /// That what was found is a point of the element and what the field says there.
    fn is_valid(&mut self, problem: &Problem, number: Number, found: &Found) {
        self.expect(found.is_finite(), "nothing is NaN", problem, found);
        let sum: f64 = found.weights.iter().sum();
        let are_weights = found.weights.iter().all(|weight| *weight >= 0.0);
        let are_weights = are_weights && (sum - 1.0).abs() <= 256.0 * number.epsilon();
        self.expect(are_weights, "weights are barycentric", problem, found);
        let length = found.surface.map_or(0.0, |[normal, _]| normal.norm());
        let is_normal = length == 0.0 || (length - 1.0).abs() <= 64.0 * number.epsilon();
        self.expect(is_normal, "a normal is of length one", problem, found);

        let rounding = problem.rounding(number, found.value);
        let off = (found.value - problem.value(found.point)).abs();
        self.worst_rounding = self.worst_rounding.max(off / rounding * ROUNDINGS);
        self.expect(off <= rounding, "the value is the field's own", problem, found);
        let beside = (found.point - problem.point(&found.weights)).norm() * problem.body.field.slope_bound();
        self.expect(beside <= rounding, "the point is that of the weights", problem, found);
    }

    /// That the truth lies between what was found and what was proven. Answers the bound on the error.
    fn is_near_the_truth(&mut self, problem: &Problem, method: &Method, number: Number, found: &Found) -> f64 {
        let rounding = problem.rounding(number, found.value);
        let bound = (found.value - found.lower_bound).max(0.0) + rounding;
        let error = found.value - problem.truth;
        self.worst_of_bound = self.worst_of_bound.max(error / bound);
        self.expect(error <= bound, "the lower bound holds", problem, found);
        self.expect(found.value >= problem.floor - rounding, "the value is not below the truth", problem, found);
        let is_certified = found.converged && certifies(method);
        let is_near = !is_certified || error <= problem.gap(number, found.value);
        self.expect(is_near, "certified and converged means near the truth", problem, found);
        if rounding < TOLERANCE * problem.range {
            self.worst_error = self.worst_error.max(error / problem.range);
            self.bound = self.bound.max(bound / problem.range);
        }
        bound
    }

    /// That it is as near the answer in f64 as the bounds of both say.
    fn is_near_double(&mut self, problem: &Problem, method: &Method, number: Number, found: &Found, bound: f64) {
        let rounding = problem.rounding(number, found.value);
        let double = problem.least(method, Number::Double);
        let allowed = bound.max(double.value - double.lower_bound + rounding);
        let difference = (found.value - double.value).abs();
        self.worst_difference = self.worst_difference.max(difference / allowed);
        self.expect(difference <= allowed, "f32 is as near f64 as both bounds say", problem, &(found, &double));
        if problem.corners.len() == 1 {
            self.worst_rounding = self.worst_rounding.max(difference / rounding * ROUNDINGS);
            self.expect(difference <= rounding, "f32 at a vertex is off by rounding alone", problem, found);
        }
    }

    /// Of an element that has a point within the margin, by more than rounding.
    fn query(&mut self, problem: &Problem, method: &Method, number: Number, margin: f64) {
        let margin = number.round_up(margin);
        let answer = ask(&problem.body.field, method, margin, &problem.corners, number);
        self.queries += 1;
        let told = (margin, &answer);
        match (answer.fate, &answer.found) {
            (Fate::Contact(status), Some(found)) => {
                self.contacts += 1;
                *match status {
                    ContactStatus::Converged => &mut self.converged,
                    ContactStatus::BudgetSpent => &mut self.budget_spent,
                    ContactStatus::DegenerateGradient => &mut self.degenerate,
                    ContactStatus::OutsideGrid => &mut self.outside,
                } += 1;
                let is_within = found.is_finite() && found.value <= margin;
                self.expect(is_within, "a contact is finite and within the margin", problem, &told);
            }
            (Fate::Separated, Some(found)) => {
                self.apart += 1;
                let is_lost = found.lower_bound > margin;
                self.lost += usize::from(is_lost);
                self.undecided += usize::from(!is_lost);
                self.expect(!is_lost, "no contact is lost", problem, &told);
                // Within its tolerance a certified search cannot tell.
                let gap = problem.gap(number, found.value);
                let is_sure = certifies(method) && found.converged && margin - problem.truth > gap;
                self.expect(!is_sure, "a certified search that converged misses nothing", problem, &told);
            }
            (Fate::Culled, _) => {
                self.culled += 1;
                self.lost += 1;
                self.expect(false, "no contact is culled", problem, &told);
            }
            _ => self.expect(false, "what is finite is answered", problem, &told),
        }
    }
}
