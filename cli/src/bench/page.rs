//! docs/performance.md from the numbers in docs/performance/, with the parts that a person wrote between them.

use std::path::Path;

use anyhow::{Context, Result};

use super::csv::Kept;
use super::plots::{Curve, Names, log_log};
use super::{Bench, csv, peers, targets};
use crate::mesh_input::at;
use crate::study::table::Table;

/// Of the numbers and pictures, beside the page.
pub const FOLDER: &str = "performance";
const OURS: &str = "bench.csv";
const LEFT_OUT: &str = "left-out.txt";

const INTRODUCTION: &str = include_str!("page/introduction.md");
const ABOUT_PEERS: &str = include_str!("page/peers.md");
const ABOUT_LIMITS: &str = include_str!("page/limits.md");
const ABOUT_ENTANGLED: &str = include_str!("page/entangled.md");
const NOT_REACHED: &str = include_str!("page/what_is_not_reached.md");

/// Puts new rows in place of those of the same groups.
pub fn keep(docs: &Path, bench: &Bench) -> Result<()> {
    let path = docs.join(FOLDER).join(OURS);
    let new = Kept::parse(&csv::text(bench));
    let kept =
        std::fs::read_to_string(&path).map_or_else(|_| new.clone(), |text| Kept::parse(&text).replaced(new.clone()));
    at(&path, std::fs::write(&path, kept.text()))?;
    let left_out = docs.join(FOLDER).join(LEFT_OUT);
    let measured = |line: &str| bench.rows.iter().any(|row| line.split(':').next() == Some(row.group));
    let before = std::fs::read_to_string(&left_out).unwrap_or_default();
    let lines = before.lines().filter(|line| !measured(line)).chain(bench.left_out.iter().map(String::as_str));
    let lines: String = lines.map(|line| format!("{line}\n")).collect();
    at(&left_out, std::fs::write(&left_out, lines))
}

pub fn write(docs: &Path) -> Result<()> {
    let folder = docs.join(FOLDER);
    let read = |name: &str| Kept::parse(&std::fs::read_to_string(folder.join(name)).unwrap_or_default());
    let (ours, peers, entangled) = (read(OURS), read("peers.csv"), read("entangled.csv"));
    let left_out = std::fs::read_to_string(folder.join(LEFT_OUT)).unwrap_or_default();
    let mut pictures = vec![];
    for Picture { name, names, curves } in drawn(&ours) {
        if curves.iter().any(|curve| curve.points.len() > 1) {
            let path = folder.join(format!("{name}.svg"));
            at(&path, std::fs::write(&path, log_log(names, &curves)?))?;
            pictures.push(format!("![{}]({FOLDER}/{name}.svg)\n", names.title));
        }
    }
    let page = text(&ours, &peers, &entangled, &left_out, &pictures.join("\n"));
    let path = docs.join("performance.md");
    std::fs::write(&path, page).with_context(|| path.display().to_string())
}

fn text(ours: &Kept, peers: &Kept, entangled: &Kept, left_out: &str, pictures: &str) -> String {
    let mut page = INTRODUCTION.replace("{ours}", &origin(ours)).replace("{peers}", &origin(peers));
    let mut add = |part: &str| {
        page.push_str(part);
        page.push('\n');
    };
    add("\n## Targets\n");
    add(&targets::table(peers, ours).markdown());
    add(NOT_REACHED);
    add(&format!("{ABOUT_PEERS}{}", peers::tables(peers)));
    add(ABOUT_ENTANGLED);
    add(&as_it_is(entangled).markdown());
    add("## Against resolution, triangles and threads\n");
    add(pictures);
    add(ABOUT_LIMITS);
    add(&limits(ours).markdown());
    add("## All works\n");
    add(&works(ours).markdown());
    if !left_out.is_empty() {
        let lines: String = left_out.lines().map(|line| format!("- {line}\n")).collect();
        add(&format!("Left out, and why:\n\n{lines}"));
    }
    add("## Whole commands and memory\n");
    add(&commands(ours).markdown());
    page.trim_end().to_owned() + "\n"
}

/// Where and when rows were measured.
fn origin(kept: &Kept) -> String {
    let dates = kept.words("date").join(", ");
    format!("{} ({dates})", kept.words("machine").join("; "))
}

fn as_it_is(kept: &Kept) -> Table {
    let head = vec!["body", "method", "cloths", "freed", "deepest left", "median left", "ms a round"];
    Table { head, rows: kept.rows.clone() }
}

fn limits(ours: &Kept) -> Table {
    let rows = ours.with(&[("group", "limits")]);
    let line = |row: &Vec<String>| {
        let rate = rows.number(row, "units").unwrap_or(f64::NAN) / rows.number(row, "seconds").unwrap_or(f64::NAN);
        let rate = match rows.cell(row, "unit") {
            "bytes" => format!("{:.1} GB/s", 1e-9 * rate),
            unit => format!("{:.0} M {unit}/s", 1e-6 * rate),
        };
        vec![rows.cell(row, "work").replace(';', ","), rate]
    };
    Table { head: vec!["limit, one thread", ""], rows: rows.rows.iter().map(line).collect() }
}

fn works(ours: &Kept) -> Table {
    let head =
        vec!["", "triangles", "cells", "threads", "time", "a unit", "times the first", "of the limit", "contacts"];
    let is_work = |row: &&Vec<String>| !["limits", "commands"].contains(&ours.cell(row, "group"));
    let line = |row: &Vec<String>| {
        let number = |name: &str| ours.number(row, name).unwrap_or(f64::NAN);
        let cells = ours.cell(row, "resolution");
        let share = ours
            .number(row, "floor_seconds")
            .map_or(String::new(), |floor| format!("{:.1} %", 100.0 * floor / number("seconds")));
        vec![
            ours.cell(row, "work").to_owned(),
            ours.cell(row, "triangles").to_owned(),
            if cells == "0" { String::new() } else { cells.to_owned() },
            ours.cell(row, "threads").to_owned(),
            peers::in_seconds(Some(number("seconds"))),
            format!(
                "{:.3} ns a {}",
                1e9 * number("seconds") / number("units"),
                ours.cell(row, "unit").trim_end_matches('s')
            ),
            format!("{:.2}", number("ratio")),
            share,
            ours.cell(row, "contacts").to_owned(),
        ]
    };
    Table { head, rows: ours.rows.iter().filter(is_work).map(line).collect() }
}

fn commands(ours: &Kept) -> Table {
    let rows = ours.with(&[("group", "commands")]);
    let head = vec![
        "command, one thread",
        "triangles",
        "cells",
        "whole",
        "of it the work itself",
        "peak MiB",
        "result and mesh, MiB",
    ];
    let line = |row: &Vec<String>| {
        let mib = |name: &str| rows.number(row, name).map_or(String::new(), |mib| format!("{mib:.0}"));
        vec![
            rows.cell(row, "work").to_owned(),
            rows.cell(row, "triangles").to_owned(),
            rows.cell(row, "resolution").to_owned(),
            peers::in_seconds(rows.number(row, "seconds")),
            peers::in_seconds(rows.number(row, "floor_seconds")),
            mib("peak_mib"),
            mib("result_mib"),
        ]
    };
    Table { head, rows: rows.rows.iter().map(line).collect() }
}

struct Picture {
    name: &'static str,
    names: Names,
    curves: Vec<Curve>,
}

fn drawn(ours: &Kept) -> Vec<Picture> {
    let picture = |name: &'static str, [title, across, up]: [&'static str; 3], curves| Picture {
        name,
        names: Names { title, across, up, doubles: name != "triangles" },
        curves,
    };
    let seconds = |kept: &Kept, row: &[String]| kept.number(row, "seconds");
    let share =
        |kept: &Kept, row: &[String]| Some(100.0 * kept.number(row, "floor_seconds")? / kept.number(row, "seconds")?);
    let faster = |kept: &Kept, row: &[String]| Some(1.0 / kept.number(row, "ratio")?);
    vec![
        picture(
            "resolution",
            ["Baking 100,000 triangles on one thread", "cells along the longest side", "seconds"],
            curves(&ours.with(&[("group", "resolution")]), "resolution", seconds),
        ),
        picture(
            "triangles",
            ["Baking on one thread: dense with 128 cells, sparse with 256", "triangles", "seconds"],
            curves(&ours.with(&[("group", "triangles")]), "triangles", seconds),
        ),
        picture(
            "threads",
            ["How many times as fast as on one thread", "threads", "times"],
            curves(&ours.with(&[("group", "threads")]), "threads", faster),
        ),
        picture(
            "share",
            ["Share of the machine's limit that a bake reaches", "cells along the longest side", "percent"],
            curves(&ours.with(&[("group", "resolution")]), "resolution", share),
        ),
    ]
}

/// One for each work.
fn curves(kept: &Kept, across: &str, up: impl Fn(&Kept, &[String]) -> Option<f64>) -> Vec<Curve> {
    let of_work = |work: String| {
        let rows = kept.with(&[("work", &work)]);
        let points = rows.rows.iter().filter_map(|row| Some((rows.number(row, across)?, up(&rows, row)?)));
        // "contacts of this on that by a method" is too long for a legend.
        let name = match (work.split_once(" of "), work.split_once(" by ")) {
            (Some((what, _)), Some((_, method))) => format!("{what} by {method}"),
            _ => work.clone(),
        };
        Curve { points: points.filter(|(x, y)| *x > 0.0 && *y > 0.0).collect(), name }
    };
    kept.words("work").into_iter().map(of_work).filter(|curve| !curve.points.is_empty()).collect()
}
