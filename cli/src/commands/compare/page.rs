//! The comparison as one HTML page: advice, a plot of error against time, a table. No scripts and no external files.

use std::fmt::Write;
use std::path::Path;

use anyhow::Result;
use sdf_field::compare::{Comparison, MethodReport};
use sdf_formats::atomic_write;

use super::{advice, by_device, name};
use crate::args::CompareArgs;
use crate::histogram::escaped;
use crate::mesh_input::with_path;
use crate::report::{number, seconds};

pub fn write(path: &Path, args: &CompareArgs, comparison: &Comparison) -> Result<()> {
    let page = page(args, comparison);
    with_path(path, atomic_write(path, |temporary| std::fs::write(temporary, &page)))
}

/// The methods by their names in the table, and whether one is recommended: those of a card never are.
fn named(comparison: &Comparison) -> impl Iterator<Item = (String, &MethodReport, bool)> + Clone {
    by_device(comparison).map(|(device, report)| {
        let is_recommended = device == "cpu" && report.method == comparison.recommended;
        (name(device, report), report, is_recommended)
    })
}

fn page(args: &CompareArgs, comparison: &Comparison) -> String {
    let title = format!("{} on {}", args.mesh.display(), args.sdf.display());
    let title = escaped(&title);
    let mut rows = String::new();
    for (name, report, is_recommended) in named(comparison) {
        let class = if is_recommended { " class=\"recommended\"" } else { "" };
        let _ = writeln!(
            rows,
            "<tr{class}><td>{name}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td></tr>",
            seconds(report.seconds),
            report.evaluations,
            report.contacts,
            report.missed,
            number(report.error_95),
            number(report.error_worst),
        );
    }
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><title>{title}</title><style>\n\
         body {{ font-family: sans-serif; max-width: 52em; margin: 2em auto; color: #222 }}\n\
         table {{ border-collapse: collapse }} td, th {{ padding: 0.2em 0.8em; text-align: right; border-bottom: 1px solid #ddd }}\n\
         .recommended {{ background: #e8f5e9; font-weight: bold }}\n</style></head><body>\n\
         <h1>{title}</h1>\n<p>{} elements, {} contacts by the certified search, {} of them proven; margin {}.</p>\n<p>{}</p>\n{}\n\
         <table><tr><th>method</th><th>time</th><th>evaluations</th><th>contacts</th><th>missed</th><th>error 95 %</th>\
         <th>worst error</th></tr>\n{rows}</table>\n\
         <p>Errors are distances above the certified minimum, in the unit of the mesh, over all contacts of the certified search. \
         Made by sdftool {}.</p>\n</body></html>\n",
        comparison.elements,
        comparison.contacts,
        comparison.proven,
        number(args.margin),
        escaped(&advice(comparison)),
        plot(comparison),
        env!("CARGO_PKG_VERSION"),
    )
}

const WIDTH: f64 = 720.0;
const HEIGHT: f64 = 340.0;
const LEFT: f64 = 80.0;
const RIGHT: f64 = 90.0;
const TOP: f64 = 20.0;
const BOTTOM: f64 = 50.0;

/// Range of a logarithmic axis around the numbers, in whole decades, at least one.
fn decades(numbers: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let lowest = numbers.clone().fold(f64::INFINITY, f64::min).log10().floor();
    let highest = numbers.fold(f64::NEG_INFINITY, f64::max).log10().ceil();
    if lowest.is_finite() && highest.is_finite() { (lowest, highest.max(lowest + 1.0)) } else { (-3.0, 0.0) }
}

/// Worst error against time, both logarithmic. An error of zero is drawn on the axis.
fn plot(comparison: &Comparison) -> String {
    let reports = by_device(comparison).map(|(_, report)| report);
    let errors = reports.clone().map(|report| report.error_worst).filter(|error| *error > 0.0);
    let (low_time, high_time) = decades(reports.map(|report| report.seconds.max(1e-9)));
    let (low_error, high_error) = decades(errors);
    let x =
        |seconds: f64| LEFT + (WIDTH - LEFT - RIGHT) * (seconds.max(1e-9).log10() - low_time) / (high_time - low_time);
    let y = |error: f64| {
        let fraction = if error > 0.0 { (error.log10() - low_error) / (high_error - low_error) } else { 0.0 };
        HEIGHT - BOTTOM - (HEIGHT - TOP - BOTTOM) * fraction
    };
    let mut svg = format!(
        "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" width=\"{WIDTH}\" font-size=\"12\" font-family=\"sans-serif\">\n\
         <text x=\"{}\" y=\"{}\" text-anchor=\"middle\">time of a query, s</text>\n\
         <text transform=\"translate(16 {}) rotate(-90)\" text-anchor=\"middle\">worst error, unit of the mesh</text>\n",
        0.5 * (LEFT + WIDTH - RIGHT),
        HEIGHT - 8.0,
        0.5 * (TOP + HEIGHT - BOTTOM),
    );
    for decade in low_time as i32..=high_time as i32 {
        let at = x(10.0_f64.powi(decade));
        let _ = writeln!(
            svg,
            "<line x1=\"{at:.1}\" y1=\"{TOP}\" x2=\"{at:.1}\" y2=\"{:.1}\" stroke=\"#ddd\"/>\
             <text x=\"{at:.1}\" y=\"{:.1}\" text-anchor=\"middle\">1e{decade}</text>",
            HEIGHT - BOTTOM,
            HEIGHT - BOTTOM + 16.0
        );
    }
    for decade in low_error as i32..=high_error as i32 {
        let at = y(10.0_f64.powi(decade));
        let _ = writeln!(
            svg,
            "<line x1=\"{LEFT}\" y1=\"{at:.1}\" x2=\"{:.1}\" y2=\"{at:.1}\" stroke=\"#ddd\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">1e{decade}</text>",
            WIDTH - RIGHT,
            LEFT - 6.0,
            at + 4.0
        );
    }
    for (name, report, is_recommended) in named(comparison) {
        point(&mut svg, &name, report, [x(report.seconds), y(report.error_worst)], is_recommended);
    }
    svg + "</svg>"
}

/// Draws a method as a disk: filled if it misses no contact.
fn point(svg: &mut String, name: &str, report: &MethodReport, [x, y]: [f64; 2], is_recommended: bool) {
    let fill = if report.missed == 0 { "#2e7d32" } else { "white" };
    let stroke = if report.missed == 0 { "#2e7d32" } else { "#c62828" };
    let weight = if is_recommended { "bold" } else { "normal" };
    let _ = writeln!(
        svg,
        "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"5\" fill=\"{fill}\" stroke=\"{stroke}\" stroke-width=\"2\"/>\
         <text x=\"{:.1}\" y=\"{:.1}\" font-weight=\"{weight}\">{name}</text>",
        x + 9.0,
        y + 4.0,
    );
}
