//! Curves on two logarithmic axes, as SVG.

use std::ops::Range;

use anyhow::Result;
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
        let mut chart = frame
            .build_cartesian_2d(range(curves, |point| point.0).log_scale(), range(curves, |point| point.1).log_scale())
            .map_err(of_plotter)?;
        chart
            .configure_mesh()
            .light_line_style(TRANSPARENT)
            .x_labels(6)
            .y_labels(8)
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

fn shown(number: f64) -> String {
    match number {
        _ if number >= 1e5 => format!("{number:.0e}"),
        _ if number >= 10.0 => format!("{number:.0}"),
        _ if number >= 1e-3 => format!("{number:.3}").trim_end_matches('0').trim_end_matches('.').to_owned(),
        _ => format!("{number:.0e}"),
    }
}
