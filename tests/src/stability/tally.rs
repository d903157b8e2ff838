//! Puts every problem of a case to every method in every number type, checks what is promised, and counts the outcomes.

use sdf_core::Sdf;
use sdf_core::contact::ContactStatus;

use super::answer::{Fate, FoundMinimum, Number, query};
use super::cases::Case;
use super::problem::{Problem, ROUNDINGS, TOLERANCE, certifies, name};
use crate::methods::Method;

/// The outcomes of one case by one method in one number type.
#[derive(Clone, Debug, Default)]
pub struct Tally {
    pub method: String,
    pub number: &'static str,
    /// Elements whose minimum was searched for.
    pub searches: usize,
    /// Queries with a margin near the minimum.
    pub queries: usize,
    pub converged: usize,
    pub budget_spent: usize,
    pub degenerate: usize,
    pub outside: usize,
    pub beyond: usize,
    pub culled: usize,
    pub separated: usize,
    pub contacts: usize,
    /// Elements within the margin that were called separated, with a lower bound that leaves it open.
    pub undecided: usize,
    /// Elements within the margin that were culled, or called separated with a lower bound above it.
    pub lost: usize,
    /// The largest error of an answer, in longest edge · slope bound, over elements where rounding is smaller than that.
    pub worst_error: f64,
    /// The largest error of an answer, relative to what its own lower bound and rounding allow.
    pub worst_of_bound: f64,
    /// The largest difference between the value and the field's own in f64 at the same point, and at vertices between the
    /// value and the answer in f64, in ε · max(slope bound · largest length, |value|).
    pub worst_rounding: f64,
    /// The largest difference between the answer and that in f64, relative to what both lower bounds and rounding allow.
    pub worst_difference: f64,
    /// The largest bound on the error, in longest edge · slope bound.
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
                for (method, in_f64) in problem.methods_in_f64() {
                    for number in Number::BOTH {
                        tally_of(&mut tallies, &method, number).add(&problem, &method, number, in_f64);
                    }
                }
            }
        }
    }
    tallies
}

/// The tally of this method and number type, new at its first query.
fn tally_of<'a>(tallies: &'a mut Vec<Tally>, method: &Method, number: Number) -> &'a mut Tally {
    let (method, number) = (name(method), number.name());
    let index =
        tallies.iter().position(|tally| tally.method == method && tally.number == number).unwrap_or(tallies.len());
    if index == tallies.len() {
        tallies.push(Tally { method, number, ..Tally::default() });
    }
    &mut tallies[index]
}

impl Tally {
    fn add(&mut self, problem: &Problem, method: &Method, number: Number, in_f64: &FoundMinimum) {
        let found = match number {
            Number::Single => problem.minimum(method, number),
            Number::Double => in_f64.clone(),
        };
        self.searches += 1;
        self.check_point(problem, number, &found);
        let bound = self.check_truth(problem, method, number, &found);
        self.check_against_f64(problem, number, &found, bound, in_f64);
        let resting = query(&problem.body.field, method, found.value, &problem.corners, number);
        let is_contact = matches!(resting.fate, Fate::Contact(_));
        self.expect(is_contact, "what rests at the margin exactly is a contact", problem, &(found.value, &resting));
        let rounding = problem.rounding(number, problem.truth);
        for excess in
            [1.01 * rounding, 2.0 * TOLERANCE * problem.range + 10.0 * rounding, 0.1 * problem.range + rounding]
        {
            self.check_contact(problem, method, number, problem.truth + excess);
        }
    }

    fn expect(&mut self, holds: bool, promise: &str, problem: &Problem, details: &dyn std::fmt::Debug) {
        if !holds {
            let Problem { body, corners, truth, floor, .. } = problem;
            self.broken.push(format!(
                "{promise}: {} in {} at {} on {corners:?}, truth {truth:e} (floor {floor:e}): {details:?}",
                self.method, self.number, body.name
            ));
        }
    }

    /// Checks that the minimum is at a point of the element, with the field's value there.
    fn check_point(&mut self, problem: &Problem, number: Number, found: &FoundMinimum) {
        self.expect(found.is_finite(), "nothing is NaN", problem, found);
        let sum: f64 = found.weights.iter().sum();
        let are_weights = found.weights.iter().all(|weight| *weight >= 0.0);
        let are_weights = are_weights && (sum - 1.0).abs() <= 256.0 * number.epsilon();
        self.expect(are_weights, "weights are barycentric", problem, found);
        let length = found.surface.map_or(0.0, |[normal, _]| normal.norm());
        let is_normal = length == 0.0 || (length - 1.0).abs() <= 64.0 * number.epsilon();
        self.expect(is_normal, "a normal is of length one", problem, found);

        let rounding = problem.rounding(number, found.value);
        let error = (found.value - problem.value(found.point)).abs();
        self.worst_rounding = self.worst_rounding.max(error / rounding * ROUNDINGS);
        self.expect(error <= rounding, "the value is the field's own", problem, found);
        let shift = (found.point - problem.point(&found.weights)).norm() * problem.body.field.slope_bound();
        self.expect(shift <= rounding, "the point is that of the weights", problem, found);
    }

    /// Checks that the truth lies between the lower bound and the value. Returns the bound on the error.
    fn check_truth(&mut self, problem: &Problem, method: &Method, number: Number, found: &FoundMinimum) -> f64 {
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

    /// Checks that the answer differs from that in f64 by no more than the bounds of both.
    fn check_against_f64(
        &mut self,
        problem: &Problem,
        number: Number,
        found: &FoundMinimum,
        bound: f64,
        in_f64: &FoundMinimum,
    ) {
        let rounding = problem.rounding(number, found.value);
        let allowed = bound.max(in_f64.value - in_f64.lower_bound + rounding);
        let difference = (found.value - in_f64.value).abs();
        self.worst_difference = self.worst_difference.max(difference / allowed);
        self.expect(difference <= allowed, "f32 is as near f64 as both bounds say", problem, &(found, in_f64));
        if problem.corners.len() == 1 {
            self.worst_rounding = self.worst_rounding.max(difference / rounding * ROUNDINGS);
            self.expect(difference <= rounding, "f32 at a vertex is off by rounding alone", problem, found);
        }
    }

    /// Checks that an element with a point within the margin, by more than rounding, is not lost.
    fn check_contact(&mut self, problem: &Problem, method: &Method, number: Number, margin: f64) {
        let margin = number.round_up(margin);
        let answer = query(&problem.body.field, method, margin, &problem.corners, number);
        self.queries += 1;
        let details = (margin, &answer);
        match (answer.fate, &answer.minimum) {
            (Fate::Contact(status), Some(found)) => {
                self.contacts += 1;
                *match status {
                    ContactStatus::Converged => &mut self.converged,
                    ContactStatus::BudgetSpent => &mut self.budget_spent,
                    ContactStatus::DegenerateGradient => &mut self.degenerate,
                    ContactStatus::OutsideGrid => &mut self.outside,
                    ContactStatus::BeyondBand => &mut self.beyond,
                    ContactStatus::Possible => panic!("only a complete search reports what is possible"),
                } += 1;
                let is_within = found.is_finite() && found.value <= margin;
                self.expect(is_within, "a contact is finite and within the margin", problem, &details);
            }
            (Fate::Separated, Some(found)) => {
                self.separated += 1;
                let is_lost = found.lower_bound > margin;
                self.lost += usize::from(is_lost);
                self.undecided += usize::from(!is_lost);
                self.expect(!is_lost, "no contact is lost", problem, &details);
                // Within its tolerance a certified search may end on either side of the margin.
                let gap = problem.gap(number, found.value);
                let is_certain = certifies(method) && found.converged && margin - problem.truth > gap;
                self.expect(!is_certain, "a certified search that converged misses nothing", problem, &details);
            }
            (Fate::Culled, _) => {
                self.culled += 1;
                self.lost += 1;
                self.expect(false, "no contact is culled", problem, &details);
            }
            _ => self.expect(false, "what is finite is answered", problem, &details),
        }
    }
}
