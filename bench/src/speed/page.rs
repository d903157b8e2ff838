//! docs/performance.md, made of the numbers in docs/performance/ and of the texts in `page/`.

use std::path::Path;

use anyhow::{Context, Result};

use super::csv::CsvTable;
use super::plot::{Labels, PlotCurve, log_log};
use super::{SpeedReport, csv, peers};
use crate::duration_text;
use crate::table::Table;

/// Folder of the numbers and pictures, beside the page.
pub const FOLDER: &str = "performance";
const OURS: &str = "bench.csv";
const LEFT_OUT: &str = "left-out.txt";

const INTRODUCTION: &str = include_str!("page/introduction.md");
const ABOUT_PEERS: &str = include_str!("page/peers.md");
const ABOUT_GROWTH: &str = include_str!("page/growth.md");
const ABOUT_LIMITS: &str = include_str!("page/limits.md");
const ABOUT_ENTANGLED: &str = include_str!("page/entangled.md");
const PROFILE: &str = include_str!("page/profile.md");

/// Stores the rows of a report in place of the former rows of the same groups.
pub fn store(docs: &Path, report: &SpeedReport) -> Result<()> {
    let path = docs.join(FOLDER).join(OURS);
    let new = CsvTable::parse(&csv::text(report));
    let stored = match std::fs::read_to_string(&path) {
        Ok(text) => CsvTable::parse(&text).with_groups_replaced(new),
        Err(_) => new,
    };
    write_file(&path, &stored.text())?;
    let path = docs.join(FOLDER).join(LEFT_OUT);
    let is_measured = |line: &str| report.rows.iter().any(|row| line.split(':').next() == Some(row.group));
    let former = std::fs::read_to_string(&path).unwrap_or_default();
    let lines = former.lines().filter(|line| !is_measured(line)).chain(report.left_out.iter().map(String::as_str));
    write_file(&path, &lines.map(|line| format!("{line}\n")).collect::<String>())
}

fn write_file(path: &Path, text: &str) -> Result<()> {
    std::fs::write(path, text).with_context(|| path.display().to_string())
}

/// Writes the page and its pictures from the stored numbers.
pub fn write(docs: &Path) -> Result<()> {
    let folder = docs.join(FOLDER);
    let read = |name: &str| CsvTable::parse(&std::fs::read_to_string(folder.join(name)).unwrap_or_default());
    let (ours, peers, entangled) = (read(OURS), read("peers.csv"), read("entangled.csv"));
    let left_out = std::fs::read_to_string(folder.join(LEFT_OUT)).unwrap_or_default();
    let mut pictures = vec![];
    let growth = growth_table(&all_pictures(&ours));
    for Picture { name, labels, curves } in all_pictures(&ours) {
        if curves.iter().any(|curve| curve.points.len() > 1) {
            let path = folder.join(format!("{name}.svg"));
            write_file(&path, &log_log(labels, &curves)?)?;
            pictures.push(format!("![{}]({FOLDER}/{name}.svg)\n", labels.title));
        }
    }
    let pictures = format!("{}\n{ABOUT_GROWTH}\n{}", pictures.join("\n"), growth.markdown());
    let page = text(&ours, &peers, &entangled, &left_out, &pictures);
    write_file(&docs.join("performance.md"), &page)
}

fn text(ours: &CsvTable, peers: &CsvTable, entangled: &CsvTable, left_out: &str, pictures: &str) -> String {
    let mut page = INTRODUCTION.replace("{ours}", &origin(ours)).replace("{peers}", &origin(peers));
    let mut add = |part: &str| {
        page.push_str(part);
        page.push('\n');
    };
    add(&format!("\n{ABOUT_PEERS}{}", peers::tables(peers)));
    add(ABOUT_ENTANGLED);
    add(&entangled_table(entangled).markdown());
    add(PROFILE);
    add("## Against resolution, triangles, elements and threads\n");
    add(pictures);
    add(ABOUT_LIMITS);
    add(&limits_table(ours).markdown());
    add("## All works\n");
    add(&works_table(ours).markdown());
    if !left_out.is_empty() {
        let lines: String = left_out.lines().map(|line| format!("- {line}\n")).collect();
        add(&format!("Left out, with the reason:\n\n{lines}"));
    }
    add("## Whole commands and memory\n");
    add(&commands_table(ours).markdown());
    page.trim_end().to_owned() + "\n"
}

/// Machine and date of the rows.
fn origin(table: &CsvTable) -> String {
    let dates = table.distinct("date").join(", ");
    format!("{} ({dates})", table.distinct("machine").join("; "))
}

fn entangled_table(entangled: &CsvTable) -> Table {
    let head = vec!["body", "method", "cloths", "freed", "deepest left", "median left", "ms per round"];
    Table { head, rows: entangled.rows.clone() }
}

fn limits_table(ours: &CsvTable) -> Table {
    let rows = ours.filtered(&[("group", "limits")]);
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

fn works_table(ours: &CsvTable) -> Table {
    let head = vec![
        "",
        "triangles",
        "cells",
        "threads",
        "time",
        "per unit",
        "relative to the first",
        "of the limit",
        "contacts",
    ];
    let is_work = |row: &&Vec<String>| !["limits", "commands"].contains(&ours.cell(row, "group"));
    let line = |row: &Vec<String>| {
        let number = |name: &str| ours.number(row, name).unwrap_or(f64::NAN);
        let cells = ours.cell(row, "resolution");
        let of_limit = ours
            .number(row, "floor_seconds")
            .map_or(String::new(), |floor| format!("{:.1} %", 100.0 * floor / number("seconds")));
        vec![
            ours.cell(row, "work").to_owned(),
            ours.cell(row, "triangles").to_owned(),
            if cells == "0" { String::new() } else { cells.to_owned() },
            ours.cell(row, "threads").to_owned(),
            duration_text(number("seconds")),
            format!(
                "{:.3} ns per {}",
                1e9 * number("seconds") / number("units"),
                ours.cell(row, "unit").trim_end_matches('s')
            ),
            format!("{:.2}", number("ratio")),
            of_limit,
            ours.cell(row, "contacts").to_owned(),
        ]
    };
    Table { head, rows: ours.rows.iter().filter(is_work).map(line).collect() }
}

fn commands_table(ours: &CsvTable) -> Table {
    let rows = ours.filtered(&[("group", "commands")]);
    let head = vec![
        "command, one thread",
        "triangles",
        "cells",
        "whole",
        "the work itself",
        "writing",
        "relative to the work itself",
        "peak MiB",
        "result and mesh, MiB",
    ];
    let line = |row: &Vec<String>| {
        let mib = |name: &str| rows.number(row, name).map_or(String::new(), |mib| format!("{mib:.0}"));
        let [whole, work, write] = ["seconds", "floor_seconds", "write_seconds"].map(|name| rows.number(row, name));
        let text = |seconds: Option<f64>| seconds.map_or(String::new(), duration_text);
        let relative = write.zip(work).map_or(String::new(), |(write, work)| format!("{:.3}", write / work));
        vec![
            rows.cell(row, "work").to_owned(),
            rows.cell(row, "triangles").to_owned(),
            rows.cell(row, "resolution").to_owned(),
            text(whole),
            text(work),
            text(write),
            relative,
            mib("peak_mib"),
            mib("result_mib"),
        ]
    };
    Table { head, rows: rows.rows.iter().map(line).collect() }
}

struct Picture {
    name: &'static str,
    labels: Labels,
    curves: Vec<PlotCurve>,
}

fn all_pictures(ours: &CsvTable) -> Vec<Picture> {
    let picture = |name: &'static str, [title, x, y]: [&'static str; 3], curves| Picture {
        name,
        labels: Labels { title, x, y, powers_of_two: !["triangles", "elements"].contains(&name) },
        curves,
    };
    let seconds = |table: &CsvTable, row: &[String]| table.number(row, "seconds");
    let percent_of_limit = |table: &CsvTable, row: &[String]| {
        Some(100.0 * table.number(row, "floor_seconds")? / table.number(row, "seconds")?)
    };
    let speedup = |table: &CsvTable, row: &[String]| Some(1.0 / table.number(row, "ratio")?);
    vec![
        picture(
            "resolution",
            ["Baking 100,000 triangles on one thread", "cells along the longest side", "seconds"],
            curves(&ours.filtered(&[("group", "resolution")]), "resolution", seconds),
        ),
        picture(
            "triangles",
            ["Baking on one thread: dense with 128 cells, sparse with 256", "triangles", "seconds"],
            curves(&ours.filtered(&[("group", "triangles")]), "triangles", seconds),
        ),
        picture(
            "elements",
            ["Contacts of a cloth on a spiked ball in 256 cells, on one thread", "faces of the cloth", "seconds"],
            curves(&ours.filtered(&[("group", "elements")]), "triangles", seconds),
        ),
        picture(
            "threads",
            ["Speed relative to one thread", "threads", "times"],
            curves(&ours.filtered(&[("group", "threads")]), "threads", speedup),
        ),
        picture(
            "limit",
            ["Fraction of the machine's limit that a bake reaches", "cells along the longest side", "percent"],
            curves(&ours.filtered(&[("group", "resolution")]), "resolution", percent_of_limit),
        ),
    ]
}

/// The powers of cells, triangles or faces that the times grow with: slopes of the curves.
fn growth_table(pictures: &[Picture]) -> Table {
    let grow = |picture: &&Picture| ["resolution", "triangles", "elements"].contains(&picture.name);
    let line = |curve: &PlotCurve, against: &str| {
        let last = curve.points.len().saturating_sub(2);
        let [all, last] = [&curve.points[..], &curve.points[last..]].map(log_log_slope);
        let ends = [curve.points.first(), curve.points.last()].map(|end| end.map_or(0.0, |end| end.0));
        vec![
            curve.name.clone(),
            format!("{against}, {} to {}", ends[0], ends[1]),
            format!("{all:.2}"),
            format!("{last:.2}"),
        ]
    };
    let rows = pictures.iter().filter(grow).flat_map(|picture| {
        let long = picture.curves.iter().filter(|curve| curve.points.len() > 1);
        long.map(|curve| line(curve, picture.labels.x))
    });
    Table { head: vec!["on one thread", "against", "slope over all", "of the last step"], rows: rows.collect() }
}

/// Slope of the line of least squares through the logarithms of some points.
fn log_log_slope(points: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = points.iter().map(|(x, y)| (x.ln(), y.ln())).collect();
    let mean = |of: fn(&(f64, f64)) -> f64| logs.iter().map(of).sum::<f64>() / logs.len() as f64;
    let middle = (mean(|log| log.0), mean(|log| log.1));
    let product: f64 = logs.iter().map(|log| (log.0 - middle.0) * (log.1 - middle.1)).sum();
    product / logs.iter().map(|log| (log.0 - middle.0).powi(2)).sum::<f64>()
}

/// One curve for each work: `y` against the column `x`.
fn curves(table: &CsvTable, x: &str, y: impl Fn(&CsvTable, &[String]) -> Option<f64>) -> Vec<PlotCurve> {
    let curve = |work: String| {
        let rows = table.filtered(&[("work", &work)]);
        let points = rows.rows.iter().filter_map(|row| Some((rows.number(row, x)?, y(&rows, row)?)));
        // "contacts of this on that by a method" is too long for a legend.
        let name = match (work.split_once(" of "), work.split_once(" by ")) {
            (Some((what, _)), Some((_, method))) => format!("{what} by {method}"),
            _ => work.clone(),
        };
        PlotCurve { points: points.filter(|(x, y)| *x > 0.0 && *y > 0.0).collect(), name }
    };
    table.distinct("work").into_iter().map(curve).filter(|curve| !curve.points.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn writing_is_shown_beside_the_bake_and_left_blank_where_it_was_not_measured() {
        let stored = CsvTable::parse(
            "group,work,seconds,floor_seconds,write_seconds\ncommands,bake,3,2,0.5\ncommands,contacts,1,0.5,\n",
        );
        let shown = commands_table(&stored).markdown();
        assert!(shown.contains("| bake |  |  | 3.00 s | 2.00 s | 0.50 s | 0.250 |"), "{shown}");
        assert!(shown.contains("| contacts |  |  | 1.00 s | 0.50 s |  |  |"), "{shown}");
    }

    /// So that nobody mends the page alone, where the next run of the bench would undo it.
    #[test]
    fn the_page_and_its_pictures_are_what_the_stored_numbers_give() {
        let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
        let read = |path: &Path| std::fs::read_to_string(path).unwrap();
        let written = tempfile::tempdir().unwrap();
        std::fs::create_dir(written.path().join(FOLDER)).unwrap();
        for entry in std::fs::read_dir(docs.join(FOLDER)).unwrap() {
            let path = entry.unwrap().path();
            if path.extension().is_none_or(|extension| extension != "svg") {
                std::fs::copy(&path, written.path().join(FOLDER).join(path.file_name().unwrap())).unwrap();
            }
        }
        write(written.path()).unwrap();
        let page = |folder: &Path| read(&folder.join("performance.md"));
        assert!(page(written.path()) == page(&docs), "write the page: speed --docs docs --rewrite");
        let pictures = std::fs::read_dir(written.path().join(FOLDER)).unwrap().map(|entry| entry.unwrap().path());
        for picture in pictures.filter(|path| path.extension().is_some_and(|extension| extension == "svg")) {
            assert!(read(&picture) == read(&docs.join(FOLDER).join(picture.file_name().unwrap())), "{picture:?}");
        }
    }
}
