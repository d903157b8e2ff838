//! Results as tables, rounded for a reader.

use sdf_core::grid::owned::Layout;

use super::advice::{Advice, Cost};
use super::curves::{CurvePoint, MethodCurve, SetReport};
use super::scene_file::Elements;
use super::scene_report::{SceneMethod, SceneReport, VERTICES};
use crate::table::Table;

/// One row for each method with its usual budgets: its results on one set, and the fraction of apexes that it finds.
pub fn summary(set: &SetReport, apexes: &SetReport) -> Table {
    let head =
        vec!["method", "median error", "95 %", "worst", "evaluations", "ns per element", "missed", "apexes found"];
    let rows = usual_points(set).map(|(curve, point)| {
        let apexes = apexes.curves.iter().find(|apexes| apexes.method == curve.method);
        let apexes = apexes.and_then(|apexes| apexes.points.iter().find(|found| found.budget == point.budget));
        let found = apexes.map_or("–".to_owned(), |found| percent(1.0 - found.missed));
        let [median, p95, worst] =
            [point.errors.median, point.errors.p95, point.errors.max].map(|error| error_text(error, set));
        vec![
            format!("{}, {} {}", curve.method, point.budget, curve.unit),
            median,
            p95,
            worst,
            format!("{:.1}", point.evaluations),
            format!("{:.0}", point.nanoseconds),
            percent(point.missed),
            found,
        ]
    });
    Table { head, rows: rows.collect() }
}

fn usual_points(set: &SetReport) -> impl Iterator<Item = (&MethodCurve, &CurvePoint)> {
    set.curves.iter().flat_map(|curve| {
        let is_usual = |point: &&CurvePoint| curve.usual_budgets.contains(&point.budget);
        curve.points.iter().filter(is_usual).map(move |point| (curve, point))
    })
}

/// Errors below the median gap of the references are not resolved.
fn error_text(error: f64, set: &SetReport) -> String {
    let floor = set.reference.gap.median.max(1e-9);
    if error <= floor { format!("≤ {floor:.0e}") } else { format!("{error:.1e}") }
}

fn percent(fraction: f64) -> String {
    match fraction {
        0.0 => "0 %".to_owned(),
        _ if fraction < 0.001 || (0.999..1.0).contains(&fraction) => format!("{:.2} %", 100.0 * fraction),
        _ => format!("{:.1} %", 100.0 * fraction),
    }
}

/// Quality of the references that errors are measured against.
pub fn references(sets: &[SetReport]) -> Table {
    let head = vec![
        "problems",
        "elements",
        "count",
        "drawn",
        "median gap",
        "95 %",
        "largest gap",
        "left out",
        "their largest gap",
        "smallest error",
    ];
    let rows = sets.iter().map(|set| {
        let quality = &set.reference;
        vec![
            set.about.to_owned(),
            set.elements.to_owned(),
            set.problems.to_string(),
            set.drawn.to_string(),
            format!("{:.1e}", quality.gap.median),
            format!("{:.1e}", quality.gap.p95),
            format!("{:.1e}", quality.gap.max),
            quality.not_converged.to_string(),
            if quality.not_converged > 0 { format!("{:.1e}", quality.largest_gap_left_out) } else { "–".to_owned() },
            format!("{:.1e}", quality.min_error),
        ]
    });
    Table { head, rows: rows.collect() }
}

/// One row for each set, one column for each limit of the cost.
pub fn advice(advice: &[Advice], cost: Cost) -> Table {
    let mut head = vec!["problems", "elements"];
    head.extend(match cost {
        Cost::Evaluations => ["4", "8", "16", "32", "64", "128", "256"],
        Cost::Nanoseconds => ["0.5 µs", "1 µs", "2 µs", "5 µs", "10 µs", "20 µs", "50 µs"],
    });
    let mut rows: Vec<Vec<String>> = vec![];
    let mut names = vec![];
    for advice in advice.iter().filter(|advice| advice.cost == cost) {
        if !names.contains(&(advice.set, advice.elements)) {
            names.push((advice.set, advice.elements));
        }
    }
    for (set, elements) in names {
        let mut row = vec![set.to_owned(), elements.to_owned()];
        row.extend(cost.limits().iter().map(|limit| {
            let found = advice.iter().find(|advice| {
                (advice.set, advice.elements, advice.cost, advice.limit) == (set, elements, cost, *limit)
            });
            found.map_or("–".to_owned(), |advice| {
                format!("{} {} ({:.0e}; {})", advice.method, advice.budget, advice.p95, percent(advice.missed))
            })
        }));
        rows.push(row);
    }
    Table { head, rows }
}

/// Table 1 and §8.3 of the paper: time of each method for a whole scene, and contacts missed.
pub fn scenes(scenes: &[SceneReport]) -> Table {
    let head = vec![
        "scene",
        "grid",
        "elements",
        "method",
        "µs, one thread",
        "evaluations",
        "contacts",
        "missed",
        "fraction missed",
        "the paper's GPU, µs",
    ];
    let rows = scenes.iter().flat_map(|scene| {
        scene.methods.iter().map(move |method| {
            vec![
                scene.scene.clone(),
                grid(scene),
                format!("{} {}", scene.elements, elements(scene)),
                format!("{} {}", method.method, method.budget),
                format!("{:.0}", method.microseconds),
                method.evaluations.to_string(),
                method.contacts.to_string(),
                method.missed.to_string(),
                percent(scene.missed_fraction(method.missed)),
                paper_time(scene, method).map_or(String::new(), |time| format!("{time:.0}")),
            ]
        })
    });
    Table { head, rows: rows.collect() }
}

fn elements(scene: &SceneReport) -> &'static str {
    match scene.element_kind {
        Elements::Faces => "faces",
        Elements::Edges => "edges",
    }
}

fn grid(scene: &SceneReport) -> String {
    match (scene.resolution, scene.layout) {
        (Some(resolution), Some(Layout::Dense)) => format!("{resolution}³ dense"),
        (Some(resolution), Some(Layout::Sparse)) => format!("{resolution}³ sparse u16"),
        _ => "none".to_owned(),
    }
}

fn paper_time(scene: &SceneReport, method: &SceneMethod) -> Option<f64> {
    let paper = scene.paper?;
    match method.method {
        VERTICES => Some(paper.simple),
        "projected gradient" => Some(paper.projected_gradient),
        "Frank-Wolfe" => Some(paper.frank_wolfe),
        "golden section" => paper.golden_section,
        _ => None,
    }
}

/// Fig. 13 of the paper: how many elements pass the cull.
pub fn culls(scenes: &[SceneReport]) -> Table {
    let head = vec!["scene", "what", "grid", "points", "elements", "passed the cull", "contacts", "undecided"];
    let rows = scenes.iter().map(|scene| {
        let counts = [scene.points, scene.elements, scene.passed_cull, scene.contacts, scene.undecided];
        let mut row = vec![scene.scene.clone(), scene.about.clone(), grid(scene)];
        row.extend(counts.map(|count| count.to_string()));
        row
    });
    Table { head, rows: rows.collect() }
}
