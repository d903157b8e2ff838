//! Writes docs/stability.md and the numbers behind it, from the tallies that the tests check.

use std::fmt::Write;

use super::answer::Number;
use super::cases::{CASES, Case};
use super::jitter::{Crossing, Jitter, MAX_SMOOTH, STEP, jitters, quantile};
use super::normals::{SHIFT, smooth_bodies};
use super::problem::{BUDGET, ROUNDINGS, ROUNDINGS_OF_GAP, TOLERANCE, name};
use super::tally::{Tally, tallies};
use crate::methods::methods;

/// Triangles per body in the table of normals.
const NORMAL_ROUNDS: usize = 2000;

/// Elements per body in the table of jitter.
const JITTER_ROUNDS: usize = 200;

type CaseTallies = (&'static Case, Vec<Tally>);

/// The contents of both files.
pub struct Report {
    /// docs/stability.md
    pub text: String,
    /// docs/stability.csv
    pub numbers: String,
}

/// Runs every case. Equal on every run.
pub fn report() -> Report {
    let cases: Vec<CaseTallies> = CASES.iter().map(|case| (case, tallies(case))).collect();
    let mut text = introduction();
    text.push_str(&case_table(&cases));
    text.push_str(&error_tables(&cases));
    text.push_str(&status_table(&cases));
    text.push_str(&jitter_table());
    text.push_str(&normal_table());
    text.push_str(LIMITS);
    Report { text, numbers: numbers(&cases) }
}

fn introduction() -> String {
    include_str!("report/introduction.md")
        .replace("{epsilon}", &format!("{:.2e}", Number::Single.epsilon()))
        .replace("{roundings}", &ROUNDINGS.to_string())
        .replace("{roundings_of_gap}", &ROUNDINGS_OF_GAP.to_string())
        .replace("{tolerance}", &TOLERANCE.to_string())
}

fn case_table(cases: &[CaseTallies]) -> String {
    let mut text = format!(
        "
## Cases

Every case has queries with vertices, edges and faces, in f32 and f64, by every method with {BUDGET} steps ({} evaluations for a
certified search): for the minimum, and with four margins at the minimum and just above. \"Error\" is the largest error of a
value in f32, in ε · max(L · S, |φ|); {ROUNDINGS} are allowed. It is measured at vertices against the answer in f64, and elsewhere
against the field in f64 at the same point.

| case | fields | queries | error | description |
|---|---|---|---|---|
",
        4 * BUDGET
    );
    for (case, tallies) in cases {
        let in_f32 = tallies.iter().filter(|tally| tally.number == Number::Single.name());
        let error = in_f32.fold(0.0_f64, |worst, tally| worst.max(tally.worst_rounding));
        let queries: usize = tallies.iter().map(|tally| 2 * tally.searches + tally.queries).sum();
        let (name, fields, description) = (case.name, (case.bodies)().len(), case.description);
        writeln!(text, "| {name} | {fields} | {queries} | {error:.2} | {description} |").unwrap();
    }
    text
}

/// Method names in the order of the tables.
fn method_names(cases: &[CaseTallies]) -> Vec<&str> {
    let first = cases[0].1.iter().filter(|tally| tally.number == Number::BOTH[0].name());
    first.map(|tally| tally.method.as_str()).collect()
}

fn find<'a>(tallies: &'a [Tally], method: &str, number: Number) -> &'a Tally {
    tallies.iter().find(|tally| tally.method == method && tally.number == number.name()).unwrap()
}

fn error_tables(cases: &[CaseTallies]) -> String {
    let methods = method_names(cases);
    let columns = |text: &mut String, first: &[&str]| {
        writeln!(text, "\n| {} | {} |", first.join(" | "), methods.join(" | ")).unwrap();
        writeln!(text, "|{}", "---|".repeat(first.len() + methods.len())).unwrap();
    };
    let lost: usize = cases.iter().flat_map(|(_, tallies)| tallies).map(|tally| tally.lost).sum();
    let broken: usize = cases.iter().flat_map(|(_, tallies)| tallies).map(|tally| tally.broken.len()).sum();
    let mut text = format!(
        "
## Errors

The largest error of an answer, and the widest bound that came with one (promise 2), in longest edge · L, over elements that are
larger than rounding. The truth is the lowest value of a lattice, of ternary search on convex fields, and of all methods. A local
search can end in another local minimum, or run out of steps: its error can be anything up to its bound. A dash: every element
of the case is as small as rounding. Contacts lost: {lost}. Promises broken: {broken}.
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
The largest difference between f32 and f64, relative to what promise 3 allows:
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

fn status_table(cases: &[CaseTallies]) -> String {
    let mut text = "
## Statuses

Every element here has a point within the margin: by 1.01 E, by twice the tolerance, or by a tenth of longest edge · L, a third
each. Percent of all queries. \"Left open\" means separated, with a lower bound that does not rule a contact out.

| method | | converged | budget spent | degenerate gradient | outside the grid | left open | lost |
|---|---|---|---|---|---|---|---|
"
    .to_owned();
    for method in method_names(cases) {
        for number in Number::BOTH {
            let all = || cases.iter().map(|(_, tallies)| find(tallies, method, number));
            let queries: usize = all().map(|tally| tally.queries).sum();
            let percent = |count: fn(&Tally) -> usize| 100.0 * all().map(count).sum::<usize>() as f64 / queries as f64;
            let number = number.name();
            let (converged, spent) = (percent(|tally| tally.converged), percent(|tally| tally.budget_spent));
            let (degenerate, outside) = (percent(|tally| tally.degenerate), percent(|tally| tally.outside));
            let (open, lost) = (percent(|tally| tally.undecided), percent(|tally| tally.lost));
            writeln!(
                text,
                "| {method} | {number} | {converged:.1} | {spent:.1} | {degenerate:.1} | {outside:.1} | {open:.1} | {lost:.1} |"
            )
            .unwrap();
        }
    }
    text
}

fn jitter_table() -> String {
    let mut text = format!(
        "
## Jitter

A unit edge, alone or as the lowest edge of a face, crosses the edge of a box, of a rounded box and of a capsule, or of a box in a
dense and in a sparse grid (16 cells to an edge), at more than 30°, up to 0.05 above or below. There the true contact moves as
smoothly as the body. \"Move\" is how far the contact moves, in edges, when the body moves by {STEP:.0e} and rotates by half of
that. \"Jump\" is the farthest that it moves in any such step of a path of 0.05, found by bisection: a method with fixed sample
points stands still in nearly every step and jumps in a few. We read the paper's claim (Fig. 2 and 4) as at most
{MAX_SMOOTH:.0e}. {JITTER_ROUNDS} elements per body, {BUDGET} steps. \"Smooth\" is the percentage of paths without a larger jump.

| element | body | method | | move, median | 95 % | worst | jump, median | 95 % | worst | smooth |
|---|---|---|---|---|---|---|---|---|---|---|
"
    );
    for crossing in [Crossing::Edge, Crossing::Face] {
        for is_grid in [false, true] {
            let by_number = Number::BOTH.map(|number| jitters(is_grid, crossing, number, JITTER_ROUNDS, |_| true));
            let element = if crossing == Crossing::Edge { "edge" } else { "face" };
            let body = if is_grid { "grid" } else { "closed form" };
            for which in 0..by_number[0].len() {
                for (number, jitters) in Number::BOTH.iter().zip(&by_number) {
                    let Jitter { method, moves, jumps } = &jitters[which];
                    let quantiles = |all: &[f64]| {
                        [0.5, 0.95, 1.0].map(|fraction| format!("{:.0e}", quantile(all, fraction))).join(" | ")
                    };
                    let smooth =
                        100.0 * jumps.iter().filter(|jump| **jump <= MAX_SMOOTH).count() as f64 / jumps.len() as f64;
                    let (number, moves, jumps) = (number.name(), quantiles(moves), quantiles(jumps));
                    writeln!(text, "| {element} | {body} | {method} | {number} | {moves} | {jumps} | {smooth:.0} % |")
                        .unwrap();
                }
            }
        }
    }
    text
}

fn normal_table() -> String {
    let mut text = format!(
        "
## Normals

{NORMAL_ROUNDS} triangles touch a sphere, a torus and a rounded box, each a grid of 64 cells along a side: dense, or sparse in f32
with a band of three cells. \"Off\" is the angle between the reported normal and the body's own at the contact's point. \"Turn\" is
how far the normal turns when the body moves by {SHIFT:.1e}, a thousandth of a cell. Angles in degrees, points within three cells of
where the rounded box becomes flat left out. \"Jumps\" are contacts that became another minimum, a cell or more away, with a normal
that differs by more than 0.05°. A normal is as steady as the point that it belongs to: those of methods whose points jump turn with
them.

| body | grid | method | off, median | 99 % | worst | turn, median | 99 % | worst | jumps |
|---|---|---|---|---|---|---|---|---|---|
"
    );
    for body in smooth_bodies() {
        for (layout, grid) in &body.grids {
            for method in methods(3, BUDGET) {
                let errors = body.normal_errors(grid, &method, NORMAL_ROUNDS);
                let quantiles = |all: &[f64]| {
                    [0.5, 0.99, 1.0].map(|fraction| format!("{:.4}", quantile(all, fraction))).join(" | ")
                };
                let (method, off, turns) = (name(&method), quantiles(&errors.off), quantiles(&errors.turns));
                writeln!(text, "| {} | {layout} | {method} | {off} | {turns} | {} |", body.name, errors.jumps).unwrap();
            }
        }
    }
    text
}

/// The limits that the tables show, in prose.
const LIMITS: &str = include_str!("report/limits.md");

fn numbers(cases: &[CaseTallies]) -> String {
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
