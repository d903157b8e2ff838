//! Curves on two logarithmic axes, as SVG.

use std::ops::Range;

use anyhow::Result;
use plotters::coord::combinators::{BindKeyPoints, LogCoord, WithKeyPoints};
use plotters::prelude::*;

use crate::svg::{LEGEND_HEIGHT, LegendEntry, colour, draw, legend, plot_error};

pub struct PlotCurve {
    pub name: String,
    /// Positive coordinates.
    pub points: Vec<(f64, f64)>,
}

/// Title and axes of a plot.
#[derive(Clone, Copy)]
pub struct Labels {
    pub title: &'static str,
    pub x: &'static str,
    pub y: &'static str,
    /// Puts the ticks of the x axis at powers of two.
    pub powers_of_two: bool,
}

pub fn log_log(labels: Labels, curves: &[PlotCurve]) -> Result<String> {
    let rows = curves.len().div_ceil(LEGEND_COLUMNS) as i32;
    draw((860, 460 + (LEGEND_HEIGHT * rows) as u32), |area| {
        let area = area.titled(labels.title, ("sans-serif", 17)).map_err(plot_error)?;
        let (top, below) = area.split_vertically(LEGEND_HEIGHT * rows);
        let entry = |(index, curve): (usize, &PlotCurve)| LegendEntry {
            name: curve.name.clone(),
            mark: mark(index).filled(),
            radius: 5,
        };
        let entries: Vec<LegendEntry> = curves.iter().enumerate().map(entry).collect();
        for (row, entries) in entries.chunks(LEGEND_COLUMNS).enumerate() {
            legend(&top.margin(LEGEND_HEIGHT * row as i32, 0, 0, 0), entries)?;
        }
        let mut frame = ChartBuilder::on(&below);
        frame.margin(8).margin_right(28).x_label_area_size(42).y_label_area_size(70);
        let [x, y] = [range(curves, |point| point.0), range(curves, |point| point.1)];
        let x = axis(&x, if labels.powers_of_two { powers_of_two(&x) } else { round_numbers(&x) });
        let y = axis(&y, round_numbers(&y));
        let mut chart = frame.build_cartesian_2d(x, y).map_err(plot_error)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .x_labels(MAX_TICKS)
            .y_labels(MAX_TICKS)
            .bold_line_style(BLACK.mix(0.12))
            .label_style(("sans-serif", 14))
            .x_label_formatter(&|x| tick_text(*x))
            .y_label_formatter(&|y| tick_text(*y))
            .x_desc(labels.x)
            .y_desc(labels.y)
            .draw()
            .map_err(plot_error)?;
        for (index, curve) in curves.iter().enumerate() {
            let line = LineSeries::new(curve.points.iter().copied(), mark(index).stroke_width(2)).point_size(3);
            chart.draw_series(line).map_err(plot_error)?;
        }
        Ok(())
    })
}

/// Legend entries per line.
const LEGEND_COLUMNS: usize = 4;

/// Skips grey, the first colour.
fn mark(index: usize) -> RGBColor {
    colour(index + 1)
}

/// Range of all points, widened by a quarter.
fn range(curves: &[PlotCurve], number: fn(&(f64, f64)) -> f64) -> Range<f64> {
    let all = curves.iter().flat_map(|curve| &curve.points).map(number);
    let (lower, upper) = all.fold((f64::INFINITY, 0.0_f64), |(lower, upper), x| (lower.min(x), upper.max(x)));
    lower * 0.8..upper.max(2.0 * lower) * 1.25
}

/// Largest number of labels that fit along an axis.
const MAX_TICKS: usize = 16;

fn axis(range: &Range<f64>, ticks: Vec<f64>) -> WithKeyPoints<LogCoord<f64>> {
    LogCoord::from(range.clone().log_scale()).with_key_points(ticks)
}

fn powers_of_two(range: &Range<f64>) -> Vec<f64> {
    std::iter::successors(Some(1.0), |power| Some(2.0 * power))
        .skip_while(|power| *power < range.start)
        .take_while(|power| *power <= range.end)
        .collect()
}

/// Round numbers in the range, as many as fit: powers of ten alone, or with more numbers between.
fn round_numbers(range: &Range<f64>) -> Vec<f64> {
    let tenths_per_decade: [&[u32]; 4] =
        [&[10, 12, 15, 20, 25, 30, 40, 50, 60, 70, 80, 90], &[10, 15, 20, 30, 50, 70], &[10, 20, 50], &[10]];
    let decades = range.start.log10().floor() as i32..=range.end.log10().ceil() as i32;
    let ticks = |decade_tenths: &[u32]| -> Vec<f64> {
        // Parsed, so that 0.1 is the nearest float.
        let number = |decade: i32, tenths: u32| format!("{tenths}e{}", decade - 1).parse().unwrap_or(f64::NAN);
        let all = decades.clone().flat_map(|decade| decade_tenths.iter().map(move |tenths| number(decade, *tenths)));
        all.filter(|tick| range.contains(tick)).collect()
    };
    tenths_per_decade.into_iter().map(ticks).find(|ticks| ticks.len() <= MAX_TICKS).unwrap_or_default()
}

fn tick_text(number: f64) -> String {
    match number {
        _ if number >= 1e5 => format!("{number:.0e}"),
        _ if number >= 10.0 => format!("{number:.0}"),
        _ if number >= 1e-3 => format!("{number:.3}").trim_end_matches('0').trim_end_matches('.').to_owned(),
        _ => format!("{number:.0e}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_axis_has_ticks_enough_to_read_numbers_off_and_room_for_their_labels() {
        for (start, decades) in (-40..40).flat_map(|start| (1..90).map(move |tenths| (start, f64::from(tenths) / 10.0)))
        {
            let start = 10_f64.powf(f64::from(start) / 10.0);
            let range = start..start * 10_f64.powf(decades);
            let ticks = round_numbers(&range);
            assert!(
                ticks.len() <= MAX_TICKS && ticks.is_sorted() && ticks.iter().all(|tick| range.contains(tick)),
                "{range:?}"
            );
            assert!(decades < 0.3 || ticks.len() >= 3, "{range:?}: {ticks:?}");
            assert!(!(1.0..5.0).contains(&decades) || ticks.len() >= 5, "{range:?}: {ticks:?}");
        }
        assert_eq!(powers_of_two(&(51.2..1280.0)), [64.0, 128.0, 256.0, 512.0, 1024.0]);
        assert_eq!(round_numbers(&(0.05..150.0)), [0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0]);
    }
}
