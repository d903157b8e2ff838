//! Fig. 12 of the paper, and error and missed contacts against cost, for one set of problems.

use std::ops::Range;

use anyhow::Result;
use plotters::coord::ranged1d::{Ranged, ValueFormatter};
use plotters::prelude::*;

use crate::accuracy::curves::{CurvePoint, MethodCurve, SetReport};
use crate::accuracy::problems::MISS_DEPTH;
use crate::svg::{Area, LEGEND_HEIGHT, LegendEntry, colour, draw, legend, plot_error};

/// Smaller errors are drawn as this one.
const MIN_DRAWN: f64 = 1e-8;

/// Fig. 12 of the paper: errors against the budget, one panel for each method.
pub fn convergence(set: &SetReport) -> Result<String> {
    const COLUMNS: usize = 4;
    let rows = set.curves.len().div_ceil(COLUMNS);
    draw((1160, 40 + 250 * rows as u32), |area| {
        let title = format!("{}, {}: error of {} problems", set.about, set.elements, set.problems);
        let area = area.titled(&title, ("sans-serif", 17)).map_err(plot_error)?;
        let panels = area.split_evenly((rows, COLUMNS));
        panels.iter().zip(&set.curves).try_for_each(|(panel, curve)| convergence_panel(panel, set, curve))
    })
}

fn convergence_panel(panel: &Area, set: &SetReport, curve: &MethodCurve) -> Result<()> {
    let colour = colour(curve.index);
    let last = curve.points.last().map_or(2.0, |point| f64::from(point.budget)).max(2.0);
    let mut chart = frame(panel, curve.method)
        .build_cartesian_2d((1.0..last * 1.05).log_scale(), (MIN_DRAWN..10.0).log_scale())
        .map_err(plot_error)?;
    configure(&mut chart, [curve.unit, ERROR], &exponent)?;
    let line = |error: fn(&CurvePoint) -> f64| {
        curve.points.iter().map(move |point| (f64::from(point.budget), error(point).max(MIN_DRAWN)))
    };
    let [mut band, upper] =
        [line(|point| point.errors.q1).collect::<Vec<_>>(), line(|point| point.errors.q3).collect()];
    band.extend(upper.into_iter().rev());
    chart.draw_series([Polygon::new(band, colour.mix(0.25))]).map_err(plot_error)?;
    chart.draw_series(gap_line(set, 1.0..last)).map_err(plot_error)?;
    chart
        .draw_series(LineSeries::new(line(|point| point.errors.median), colour.stroke_width(3)))
        .map_err(plot_error)?;
    let dashed = DashedLineSeries::new(line(|point| point.errors.p95), 6, 4, colour.stroke_width(2));
    chart.draw_series(dashed).map_err(plot_error)?;
    let dotted = DashedLineSeries::new(line(|point| point.errors.max), 2, 4, colour.stroke_width(1));
    chart.draw_series(dotted).map_err(plot_error)?;
    Ok(())
}

/// Errors and missed contacts against evaluations and time: all methods in each panel.
pub fn against_cost(set: &SetReport) -> Result<String> {
    draw((1160, 790), |area| {
        let title = format!("{}, {}: all methods, {} problems", set.about, set.elements, set.problems);
        let area = area.titled(&title, ("sans-serif", 17)).map_err(plot_error)?;
        let (top, below) = area.split_vertically(LEGEND_HEIGHT);
        legend(&top, &entries(set))?;
        let panels = below.split_evenly((2, 3));
        for (row, cost) in [EVALUATIONS, NANOSECONDS].into_iter().enumerate() {
            let panel = |column: usize| &panels[3 * row + column];
            error_panel(panel(0), set, cost, Axis { name: "error: median", value: |point| point.errors.median })?;
            error_panel(panel(1), set, cost, Axis { name: "error: 95th percentile", value: |point| point.errors.p95 })?;
            fraction_panel(panel(2), set, cost, Axis { name: "missed contacts", value: |point| point.missed })?;
        }
        Ok(())
    })
}

/// Fraction of apexes that each method finds.
pub fn found(set: &SetReport) -> Result<String> {
    draw((860, 440), |area| {
        let title = format!("{}: found to {MISS_DEPTH} of an edge", set.about);
        let area = area.titled(&title, ("sans-serif", 17)).map_err(plot_error)?;
        let (top, below) = area.split_vertically(LEGEND_HEIGHT);
        legend(&top, &entries(set))?;
        fraction_panel(&below, set, EVALUATIONS, Axis { name: "apexes found", value: |point| 1.0 - point.missed })
    })
}

/// A number of each point, and its name.
#[derive(Clone, Copy)]
struct Axis {
    name: &'static str,
    value: fn(&CurvePoint) -> f64,
}

const EVALUATIONS: Axis = Axis { name: "evaluations of the field per element", value: |point| point.evaluations };
const NANOSECONDS: Axis = Axis { name: "nanoseconds per element", value: |point| point.nanoseconds };
const ERROR: &str = "error / edge";

fn entries(set: &SetReport) -> Vec<LegendEntry> {
    let entry = |curve: &MethodCurve| LegendEntry {
        name: curve.method.to_owned(),
        mark: colour(curve.index).filled(),
        radius: 5,
    };
    set.curves.iter().map(entry).collect()
}

/// Range of all points, widened by 10 %.
fn range(set: &SetReport, number: fn(&CurvePoint) -> f64) -> Range<f64> {
    let all = set.curves.iter().flat_map(|curve| &curve.points).map(number);
    let (lower, upper) = all.fold((f64::INFINITY, 0.0_f64), |(lower, upper), x| (lower.min(x), upper.max(x)));
    lower * 0.9..upper * 1.1
}

fn error_panel(panel: &Area, set: &SetReport, cost: Axis, error: Axis) -> Result<()> {
    let across = range(set, cost.value);
    let mut chart = frame(panel, error.name)
        .build_cartesian_2d(across.clone().log_scale(), (MIN_DRAWN..1.0).log_scale())
        .map_err(plot_error)?;
    configure(&mut chart, [cost.name, ERROR], &exponent)?;
    chart.draw_series(gap_line(set, across)).map_err(plot_error)?;
    for curve in &set.curves {
        let points = curve.points.iter().map(|point| ((cost.value)(point), (error.value)(point).clamp(MIN_DRAWN, 1.0)));
        let line = LineSeries::new(points, colour(curve.index).stroke_width(2)).point_size(2);
        chart.draw_series(line).map_err(plot_error)?;
    }
    Ok(())
}

fn fraction_panel(panel: &Area, set: &SetReport, cost: Axis, fraction: Axis) -> Result<()> {
    let mut chart = frame(panel, fraction.name)
        .build_cartesian_2d(range(set, cost.value).log_scale(), 0.0..1.0)
        .map_err(plot_error)?;
    configure(&mut chart, [cost.name, "fraction of elements"], &|y| format!("{:.0} %", 100.0 * y))?;
    for curve in &set.curves {
        let points = curve.points.iter().map(|point| ((cost.value)(point), (fraction.value)(point)));
        let line = LineSeries::new(points, colour(curve.index).stroke_width(2)).point_size(2);
        chart.draw_series(line).map_err(plot_error)?;
    }
    Ok(())
}

/// Median gap of the references: smaller errors are not resolved.
fn gap_line<'a>(set: &SetReport, across: Range<f64>) -> LineSeries<SVGBackend<'a>, (f64, f64)> {
    let gap = set.reference.gap.median.max(MIN_DRAWN);
    LineSeries::new([(across.start, gap), (across.end, gap)], BLACK.mix(0.35))
}

fn frame<'a, 'b>(panel: &'a Area<'b>, title: &str) -> ChartBuilder<'a, 'b, SVGBackend<'b>> {
    let mut frame = ChartBuilder::on(panel);
    frame.caption(title, ("sans-serif", 16)).margin(6).x_label_area_size(38).y_label_area_size(58);
    frame
}

fn configure<X, Y>(
    chart: &mut ChartContext<SVGBackend, Cartesian2d<X, Y>>,
    names: [&str; 2],
    y_label: &dyn Fn(&f64) -> String,
) -> Result<()>
where
    X: Ranged<ValueType = f64> + ValueFormatter<f64>,
    Y: Ranged<ValueType = f64> + ValueFormatter<f64>,
{
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .label_style(("sans-serif", 14))
        .x_labels(8)
        .y_labels(9)
        .x_label_formatter(&|x| if *x < 1e4 { format!("{x:.0}") } else { format!("{x:.0e}") })
        .y_label_formatter(y_label)
        .x_desc(names[0])
        .y_desc(names[1])
        .draw()
        .map_err(plot_error)
}

fn exponent(number: &f64) -> String {
    format!("{number:.0e}")
}
