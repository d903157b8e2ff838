//! docs/stability.md and the numbers behind it, from what the tests measure.

use std::fmt::Write;

use super::answer::Number;
use super::cases::{CASES, Case};
use super::jitter::{ALLOWED, Crossing, Jitter, jitters, quantile};
use super::problem::{BUDGET, ROUNDINGS, ROUNDINGS_OF_GAP, TOLERANCE};
use super::tally::{Tally, tallies};

/// Elements for each body in the table of jitter.
const JITTER_ROUNDS: usize = 200;

type Measured = (&'static Case, Vec<Tally>);

/// What the program writes.
pub struct Report {
    /// docs/stability.md
    pub text: String,
    /// docs/stability.csv
    pub numbers: String,
}

/// Runs every case. The same on every run.
pub fn report() -> Report {
    let cases: Vec<Measured> = CASES.iter().map(|case| (case, tallies(case))).collect();
    let mut text = introduction();
    text.push_str(&what_is_asked(&cases));
    text.push_str(&errors(&cases));
    text.push_str(&statuses(&cases));
    text.push_str(&jitter());
    text.push_str(WHAT_DOES_NOT_HOLD);
    Report { text, numbers: numbers(&cases) }
}

fn introduction() -> String {
    include_str!("report/introduction.md")
        .replace("{epsilon}", &format!("{:.2e}", Number::Single.epsilon()))
        .replace("{roundings}", &ROUNDINGS.to_string())
        .replace("{roundings_of_gap}", &ROUNDINGS_OF_GAP.to_string())
        .replace("{tolerance}", &TOLERANCE.to_string())
}

fn what_is_asked(cases: &[Measured]) -> String {
    let mut text = format!(
        "
## Cases

Every case is asked of vertices, edges and faces, in f32 and f64, by every method with {BUDGET} steps ({} evaluations certified):
for the least value, and with four margins at it and just above. \"Off\" is the most that a value in f32 was off, in
ε · max(L · S, |φ|), of {ROUNDINGS} allowed: at vertices against f64, else against the field in f64 at the same point.

| case | fields | queries | off | what |
|---|---|---|---|---|
",
        4 * BUDGET
    );
    for (case, tallies) in cases {
        let of_single = tallies.iter().filter(|tally| tally.number == Number::Single.name());
        let off = of_single.fold(0.0_f64, |worst, tally| worst.max(tally.worst_rounding));
        let queries: usize = tallies.iter().map(|tally| 2 * tally.searches + tally.queries).sum();
        let (name, fields, about) = (case.name, (case.bodies)().len(), case.about);
        writeln!(text, "| {name} | {fields} | {queries} | {off:.2} | {about} |").unwrap();
    }
    text
}

/// Methods in the order of the table.
fn methods_of(cases: &[Measured]) -> Vec<&str> {
    let of_first = cases[0].1.iter().filter(|tally| tally.number == Number::BOTH[0].name());
    of_first.map(|tally| tally.method.as_str()).collect()
}

fn find<'a>(tallies: &'a [Tally], method: &str, number: Number) -> &'a Tally {
    tallies.iter().find(|tally| tally.method == method && tally.number == number.name()).unwrap()
}

fn errors(cases: &[Measured]) -> String {
    let methods = methods_of(cases);
    let columns = |text: &mut String, first: &[&str]| {
        writeln!(text, "\n| {} | {} |", first.join(" | "), methods.join(" | ")).unwrap();
        writeln!(text, "|{}", "---|".repeat(first.len() + methods.len())).unwrap();
    };
    let lost: usize = cases.iter().flat_map(|(_, tallies)| tallies).map(|tally| tally.lost).sum();
    let broken: usize = cases.iter().flat_map(|(_, tallies)| tallies).map(|tally| tally.broken.len()).sum();
    let mut text = format!(
        "
## Errors

The most that an answer was above the truth, and the widest bound that one came with (promise 2), in longest edge · L, of
elements that are not as small as rounding. The truth is the least of a lattice, of ternary search on convex fields, and of all
methods. A local search can end in another minimum, or run out of steps: its error can be anything up to its bound.
A dash: every element of the case is that small. Contacts lost: {lost}. Promises broken: {broken}.
"
    );
    columns(&mut text, &["case", ""]);
    for (case, tallies) in cases {
        for number in Number::BOTH {
            let cells: Vec<String> = methods
                .iter()
                .map(|method| {
                    let tally = find(tallies, method, number);
                    match tally.bound {
                        0.0 => "–".to_owned(),
                        bound => format!("{:.0e} / {bound:.0e}", tally.worst_error),
                    }
                })
                .collect();
            writeln!(text, "| {} | {} | {} |", case.name, number.name(), cells.join(" | ")).unwrap();
        }
    }
    text.push_str(
        "
How far f32 was from f64 at most, over what promise 3 allows:
",
    );
    columns(&mut text, &["case"]);
    for (case, tallies) in cases {
        let cell = |method: &&str| format!("{:.3}", find(tallies, method, Number::Single).worst_difference);
        let cells: Vec<String> = methods.iter().map(cell).collect();
        writeln!(text, "| {} | {} |", case.name, cells.join(" | ")).unwrap();
    }
    text
}

fn statuses(cases: &[Measured]) -> String {
    let mut text = "
## Statuses

Every element here has a point within the margin: by 1.01 E, by twice the tolerance, or by a tenth of longest edge · L, a third
each. Shares of all queries, in percent. \"Left open\" is apart with a lower bound that does not rule a contact out.

| method | | converged | budget spent | degenerate gradient | outside the grid | left open | lost |
|---|---|---|---|---|---|---|---|
"
    .to_owned();
    for method in methods_of(cases) {
        for number in Number::BOTH {
            let all = || cases.iter().map(|(_, tallies)| find(tallies, method, number));
            let queries: usize = all().map(|tally| tally.queries).sum();
            let share = |count: fn(&Tally) -> usize| 100.0 * all().map(count).sum::<usize>() as f64 / queries as f64;
            let number = number.name();
            let (converged, spent) = (share(|tally| tally.converged), share(|tally| tally.budget_spent));
            let (degenerate, outside) = (share(|tally| tally.degenerate), share(|tally| tally.outside));
            let (open, lost) = (share(|tally| tally.undecided), share(|tally| tally.lost));
            writeln!(
                text,
                "| {method} | {number} | {converged:.1} | {spent:.1} | {degenerate:.1} | {outside:.1} | {open:.1} | {lost:.1} |"
            )
            .unwrap();
        }
    }
    text
}

fn jitter() -> String {
    let mut text = format!(
        "
## Jitter

A unit edge, alone or of a face that stands on it, lies across the edge of a box, of a rounded box and of a capsule, or of a
box in a dense and in a sparse grid (16 cells to an edge), at more than 30°, up to 0.05 above or below. There the true contact
moves as smoothly as the body does. \"Move\" is how far the contact moves, in edges, when the body moves by 1e-5 and turns by
half of that. \"Jump\" is the most that it moves at any such step of a way of 0.05, found by bisection: a method whose points
are fixed stands still at nearly every step and jumps at a few. What the paper claims (Fig. 2 and 4) is taken as {ALLOWED:.0e} at
most. {JITTER_ROUNDS} elements a body, {BUDGET} steps. \"Smooth\" are the ways without a larger jump.

| element | body | method | | move, median | 95 % | worst | jump, median | 95 % | worst | smooth |
|---|---|---|---|---|---|---|---|---|---|---|
"
    );
    for crossing in [Crossing::Edge, Crossing::Face] {
        for is_grid in [false, true] {
            let of = Number::BOTH.map(|number| jitters(is_grid, crossing, number, JITTER_ROUNDS, |_| true));
            let element = if crossing == Crossing::Edge { "edge" } else { "face" };
            let body = if is_grid { "grid" } else { "closed form" };
            for which in 0..of[0].len() {
                for (number, jitters) in Number::BOTH.iter().zip(&of) {
                    let Jitter { method, moves, jumps } = &jitters[which];
                    let quantiles =
                        |all: &[f64]| [0.5, 0.95, 1.0].map(|share| format!("{:.0e}", quantile(all, share))).join(" | ");
                    let smooth =
                        100.0 * jumps.iter().filter(|jump| **jump <= ALLOWED).count() as f64 / jumps.len() as f64;
                    let (number, moves, jumps) = (number.name(), quantiles(moves), quantiles(jumps));
                    writeln!(text, "| {element} | {body} | {method} | {number} | {moves} | {jumps} | {smooth:.0} % |")
                        .unwrap();
                }
            }
        }
    }
    text
}

/// What the tables show, said plainly.
const WHAT_DOES_NOT_HOLD: &str = include_str!("report/what_does_not_hold.md");

fn numbers(cases: &[Measured]) -> String {
    let mut text =
        "case,number,method,searches,worst_error,bound,error_of_bound,roundings,difference_of_bound,queries,converged,\
                    budget_spent,degenerate_gradient,outside_grid,left_open,lost\n"
            .to_owned();
    for (case, tallies) in cases {
        for tally in tallies {
            let Tally { method, number, searches, worst_error, bound, worst_of_bound, worst_rounding, .. } = tally;
            let Tally {
                worst_difference, queries, converged, budget_spent, degenerate, outside, undecided, lost, ..
            } = tally;
            writeln!(
                text,
                "{},{number},{method},{searches},{worst_error:.3e},{bound:.3e},{worst_of_bound:.3e},{worst_rounding:.3},\
                 {worst_difference:.3e},{queries},{converged},{budget_spent},{degenerate},{outside},{undecided},{lost}",
                case.name
            )
            .unwrap();
        }
    }
    text
}
