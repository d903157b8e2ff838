//! Curves on two logarithmic axes, as SVG.

use std::ops::Range;

use anyhow::Result;
use plotters::coord::combinators::{BindKeyPoints, LogCoord, WithKeyPoints};
use plotters::prelude::*;

use crate::study::plots::{Entry, LEGEND_HEIGHT, colour, draw, legend, of_plotter};

pub struct Curve {
    pub name: String,
    /// Both above zero.
    pub points: Vec<(f64, f64)>,
}

/// What the axes say.
#[derive(Clone, Copy)]
pub struct Names {
    pub title: &'static str,
    pub across: &'static str,
    pub up: &'static str,
    /// Whether what is across doubles from one point to the next.
    pub doubles: bool,
}

pub fn log_log(names: Names, curves: &[Curve]) -> Result<String> {
    let rows = curves.len().div_ceil(IN_A_ROW) as i32;
    draw((860, 460 + (LEGEND_HEIGHT * rows) as u32), |area| {
        let area = area.titled(names.title, ("sans-serif", 17)).map_err(of_plotter)?;
        let (top, below) = area.split_vertically(LEGEND_HEIGHT * rows);
        let entry = |(number, curve): (usize, &Curve)| Entry {
            name: curve.name.clone(),
            mark: mark(number).filled(),
            radius: 5,
        };
        let entries: Vec<Entry> = curves.iter().enumerate().map(entry).collect();
        for (row, entries) in entries.chunks(IN_A_ROW).enumerate() {
            legend(&top.margin(LEGEND_HEIGHT * row as i32, 0, 0, 0), entries)?;
        }
        let mut frame = ChartBuilder::on(&below);
        frame.margin(8).margin_right(28).x_label_area_size(42).y_label_area_size(70);
        let [across, up] = [range(curves, |point| point.0), range(curves, |point| point.1)];
        let across = axis(&across, if names.doubles { powers_of_two(&across) } else { round_numbers(&across) });
        let up = axis(&up, round_numbers(&up));
        let mut chart = frame.build_cartesian_2d(across, up).map_err(of_plotter)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .x_labels(MAX_TICKS)
            .y_labels(MAX_TICKS)
            .bold_line_style(BLACK.mix(0.12))
            .label_style(("sans-serif", 14))
            .x_label_formatter(&|x| shown(*x))
            .y_label_formatter(&|y| shown(*y))
            .x_desc(names.across)
            .y_desc(names.up)
            .draw()
            .map_err(of_plotter)?;
        for (number, curve) in curves.iter().enumerate() {
            let line = LineSeries::new(curve.points.iter().copied(), mark(number).stroke_width(2)).point_size(3);
            chart.draw_series(line).map_err(of_plotter)?;
        }
        Ok(())
    })
}

const IN_A_ROW: usize = 4;

/// Grey, the first colour, is that of a reference.
fn mark(number: usize) -> RGBColor {
    colour(number + 1)
}

/// From the least to the greatest, a little more on either side.
fn range(curves: &[Curve], number: fn(&(f64, f64)) -> f64) -> Range<f64> {
    let all = curves.iter().flat_map(|curve| &curve.points).map(number);
    let (least, greatest) = all.fold((f64::INFINITY, 0.0_f64), |(least, most), x| (least.min(x), most.max(x)));
    least * 0.8..greatest.max(2.0 * least) * 1.25
}

/// So many labels stand side by side, or one above the other, without touching.
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

/// As many as there is room for: of every decade its first alone, or 2 and 5 times it too, or more.
fn round_numbers(range: &Range<f64>) -> Vec<f64> {
    let in_each: [&[u32]; 4] =
        [&[10, 12, 15, 20, 25, 30, 40, 50, 60, 70, 80, 90], &[10, 15, 20, 30, 50, 70], &[10, 20, 50], &[10]];
    let decades = range.start.log10().floor() as i32..=range.end.log10().ceil() as i32;
    let ticks = |of_decade: &[u32]| -> Vec<f64> {
        // By way of text, for 10^-1 is no float and 0.1 is to be the nearest.
        let number = |decade: i32, tenths: u32| format!("{tenths}e{}", decade - 1).parse().unwrap_or(f64::NAN);
        let all = decades.clone().flat_map(|decade| of_decade.iter().map(move |tenths| number(decade, *tenths)));
        all.filter(|tick| range.contains(tick)).collect()
    };
    in_each.into_iter().map(ticks).find(|ticks| ticks.len() <= MAX_TICKS).unwrap_or_default()
}

fn shown(number: f64) -> String {
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
