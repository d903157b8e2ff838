//! Results as tables of full precision, for programs.

use super::Study;
use super::advice::{Advice, Cost};
use super::scene_report::SceneReport;
use crate::table::Table;

/// Every point of every curve.
pub fn curves(study: &Study) -> Table {
    let head = vec![
        "set",
        "elements",
        "method",
        "budget",
        "unit",
        "q1",
        "median",
        "q3",
        "p95",
        "worst",
        "evaluations",
        "missed",
        "nanoseconds",
    ];
    let rows = study.sets.iter().chain([&study.apexes]).flat_map(|set| {
        set.curves.iter().flat_map(move |curve| {
            curve.points.iter().map(move |point| {
                let errors = &point.errors;
                let mut row = vec![set.set.to_owned(), set.elements.to_owned(), curve.method.to_owned()];
                row.extend([point.budget.to_string(), curve.unit.to_owned()]);
                let numbers = [errors.q1, errors.median, errors.q3, errors.p95, errors.max];
                row.extend(numbers.map(|error| error.to_string()));
                row.extend([point.evaluations, point.missed, point.nanoseconds].map(|number| number.to_string()));
                row
            })
        })
    });
    Table { head, rows: rows.collect() }
}

/// Every method in every scene.
pub fn scenes(scenes: &[SceneReport]) -> Table {
    let head = vec![
        "scene",
        "resolution",
        "points",
        "elements",
        "passed_cull",
        "contacts",
        "undecided",
        "method",
        "budget",
        "unit",
        "contacts_found",
        "missed",
        "evaluations",
        "microseconds",
    ];
    let rows = scenes.iter().flat_map(|scene| {
        scene.methods.iter().map(move |method| {
            let counts = [scene.points, scene.elements, scene.passed_cull, scene.contacts, scene.undecided];
            let mut row = vec![scene.scene.replace([',', '"', '\n'], " ")];
            row.push(scene.resolution.map_or(String::new(), |cells| cells.to_string()));
            row.extend(counts.map(|count| count.to_string()));
            row.extend([method.method.to_owned(), method.budget.to_string(), method.unit.to_owned()]);
            row.extend([method.contacts.to_string(), method.missed.to_string(), method.evaluations.to_string()]);
            row.push(method.microseconds.to_string());
            row
        })
    });
    Table { head, rows: rows.collect() }
}

/// The best method for each budget.
pub fn advice(advice: &[Advice]) -> Table {
    let head = vec!["set", "elements", "cost", "limit", "method", "budget", "unit", "p95", "missed"];
    let rows = advice.iter().map(|advice| {
        let cost = if advice.cost == Cost::Evaluations { "evaluations" } else { "nanoseconds" };
        let mut row =
            vec![advice.set.to_owned(), advice.elements.to_owned(), cost.to_owned(), advice.limit.to_string()];
        row.extend([advice.method.to_owned(), advice.budget.to_string(), advice.unit.to_owned()]);
        row.extend([advice.p95.to_string(), advice.missed.to_string()]);
        row
    });
    Table { head, rows: rows.collect() }
}
