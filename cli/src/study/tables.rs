//! The numbers of a study as tables, rounded for a reader.

use super::advice::{Advice, Cost};
use super::contacts::{SceneMethod, SceneReport, VERTICES};
use super::curves::{Curve, Point, SetReport};
use super::fields::Layout;
use super::scene::Elements;
use super::table::Table;

/// One row a method with its usual budget, on one set of faces or edges, and the share of apexes it finds.
pub fn summary(set: &SetReport, apexes: &SetReport) -> Table {
    let head =
        vec!["method", "median error", "95 %", "worst", "evaluations", "ns an element", "missed", "apexes found"];
    let rows = usual(set).map(|(curve, point)| {
        let apexes = apexes.curves.iter().find(|apexes| apexes.method == curve.method);
        let apexes = apexes.and_then(|apexes| apexes.points.iter().find(|found| found.budget == point.budget));
        let found = apexes.map_or("–".to_owned(), |found| percent(1.0 - found.missed));
        let [median, p95, worst] =
            [point.errors.median, point.errors.p95, point.errors.worst].map(|error| error_text(error, set));
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

fn usual(set: &SetReport) -> impl Iterator<Item = (&Curve, &Point)> {
    set.curves.iter().flat_map(|curve| {
        let is_usual = |point: &&Point| curve.usual.contains(&point.budget);
        curve.points.iter().filter(is_usual).map(move |point| (curve, point))
    })
}

/// No error is known better than to its reference's gap, of which half are below the median.
fn error_text(error: f64, set: &SetReport) -> String {
    let floor = set.reference.gap.median.max(1e-9);
    if error <= floor { format!("≤ {floor:.0e}") } else { format!("{error:.1e}") }
}

pub fn percent(share: f64) -> String {
    match share {
        0.0 => "0 %".to_owned(),
        share if share < 0.001 || (0.999..1.0).contains(&share) => format!("{:.2} %", 100.0 * share),
        share => format!("{:.1} %", 100.0 * share),
    }
}

/// The sets' references: what all errors are measured against.
pub fn references(sets: &[SetReport]) -> Table {
    let head = vec![
        "problems",
        "elements",
        "how many",
        "of drawn",
        "median gap",
        "95 %",
        "largest gap",
        "left out",
        "their largest gap",
        "least error",
    ];
    let rows = sets.iter().map(|set| {
        let trust = &set.reference;
        vec![
            set.about.to_owned(),
            set.elements.to_owned(),
            set.problems.to_string(),
            set.drawn.to_string(),
            format!("{:.1e}", trust.gap.median),
            format!("{:.1e}", trust.gap.p95),
            format!("{:.1e}", trust.gap.worst),
            trust.not_converged.to_string(),
            if trust.not_converged > 0 { format!("{:.1e}", trust.largest_gap_left_out) } else { "–".to_owned() },
            format!("{:.1e}", trust.least_error),
        ]
    });
    Table { head, rows: rows.collect() }
}

/// A row a set, a column a limit of the cost.
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

/// Table 1 and §8.3 of the paper: what each method takes for a whole scene, and what it misses.
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
        "share missed",
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
                percent(scene.share(method.missed)),
                paper_time(scene, method).map_or(String::new(), |time| format!("{time:.0}")),
            ]
        })
    });
    Table { head, rows: rows.collect() }
}

fn elements(scene: &SceneReport) -> &'static str {
    match scene.elements_are {
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

/// Fig. 13 of the paper.
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
