//! Fig. 13 and §8.3 of the paper: elements that pass the cull, and contacts missed, scene by scene.

use anyhow::Result;
use plotters::prelude::*;

use crate::accuracy::scene_report::{SceneMethod, SceneReport};
use crate::svg::{Area, LEGEND_HEIGHT, LegendEntry, colour, draw, legend, plot_error};

/// Fig. 13 of the paper: elements of each scene, elements that pass the cull, contacts.
pub fn culls(scenes: &[SceneReport]) -> Result<String> {
    draw((760, 60 + 62 * scenes.len() as u32), |area| {
        let mut chart = ChartBuilder::on(area)
            .caption("Elements, passed the cull, contacts", ("sans-serif", 17))
            .margin(8)
            .margin_right(28)
            .x_label_area_size(38)
            .build_cartesian_2d(NAMES..1.0, 0.0..scenes.len() as f64)
            .map_err(plot_error)?;
        chart
            .configure_mesh()
            .disable_mesh()
            .disable_y_axis()
            .label_style(("sans-serif", 14))
            .x_label_formatter(&|x| if *x < 0.0 { String::new() } else { format!("{:.0} %", 100.0 * x) })
            .x_desc("fraction of the scene's elements")
            .draw()
            .map_err(plot_error)?;
        for (row, scene) in scenes.iter().rev().enumerate() {
            let row = row as f64;
            let name = Text::new(scene.scene.clone(), (NAMES, row + 0.6), ("sans-serif", 15).into_font());
            chart.draw_series([name]).map_err(plot_error)?;
            for (index, bar) in bars(scene).into_iter().enumerate() {
                let top = row + 0.9 - 0.27 * index as f64;
                let fraction = bar.count as f64 / scene.elements.max(1) as f64;
                let corners = [(0.0, top), (fraction, top - 0.24)];
                chart.draw_series([Rectangle::new(corners, bar.colour.filled())]).map_err(plot_error)?;
                let beside = (if index == 0 { 0.01 } else { fraction.min(0.7) + 0.01 }, top - 0.03);
                let text = Text::new(format!("{} {}", bar.count, bar.what), beside, ("sans-serif", 14).into_font());
                chart.draw_series([text]).map_err(plot_error)?;
            }
        }
        Ok(())
    })
}

/// Left end of the names, in units of the bars.
const NAMES: f64 = -0.14;

struct Bar {
    count: usize,
    what: &'static str,
    colour: RGBColor,
}

fn bars(scene: &SceneReport) -> [Bar; 3] {
    [
        Bar { count: scene.elements, what: "elements", colour: RGBColor(190, 190, 190) },
        Bar { count: scene.passed_cull, what: "passed the cull", colour: RGBColor(86, 180, 233) },
        Bar { count: scene.contacts, what: "contacts", colour: RGBColor(213, 94, 0) },
    ]
}

/// §8.3 of the paper: fraction of each scene's contacts that a method misses.
pub fn misses(scenes: &[SceneReport]) -> Result<String> {
    let series = series(scenes);
    draw((1160, 460), |area| {
        let area = area.titled("Missed contacts", ("sans-serif", 17)).map_err(plot_error)?;
        let (above, below) = area.split_vertically(2 * LEGEND_HEIGHT);
        let rows = above.split_evenly((2, 1));
        for (row, series) in rows.iter().zip(series.chunks(series.len().div_ceil(2).max(1))) {
            legend(row, &series.iter().map(Series::legend_entry).collect::<Vec<_>>())?;
        }
        missed_dots(&below, scenes, &series)
    })
}

fn missed_dots(area: &Area, scenes: &[SceneReport], series: &[Series]) -> Result<()> {
    let fractions =
        scenes.iter().flat_map(|scene| scene.methods.iter().map(|method| scene.missed_fraction(method.missed)));
    let mut chart = ChartBuilder::on(area)
        .margin(8)
        .x_label_area_size(34)
        .y_label_area_size(70)
        .build_cartesian_2d(-0.5..scenes.len() as f64 - 0.5, 0.0..fractions.fold(0.01, f64::max) * 1.05)
        .map_err(plot_error)?;
    let name = |x: &f64| {
        let scene = (x.fract() == 0.0 && *x >= 0.0).then(|| scenes.get(*x as usize)).flatten();
        scene.map_or(String::new(), |scene| scene.scene.clone())
    };
    chart
        .configure_mesh()
        .disable_x_mesh()
        .light_line_style(TRANSPARENT)
        .bold_line_style(BLACK.mix(0.12))
        .label_style(("sans-serif", 15))
        .x_labels(2 * scenes.len() + 4)
        .x_label_formatter(&name)
        .y_label_formatter(&|y| format!("{:.1} %", 100.0 * y))
        .y_desc("fraction of the scene's contacts")
        .draw()
        .map_err(plot_error)?;
    for (index, one) in series.iter().enumerate() {
        let shift = 0.8 * ((index as f64 + 0.5) / series.len() as f64 - 0.5);
        let dots = scenes.iter().enumerate().filter_map(|(column, scene)| {
            let found = scene.methods.iter().find(|found| one.contains(found))?;
            let position = (column as f64 + shift, scene.missed_fraction(found.missed));
            Some(Circle::new(position, one.radius(), one.mark()))
        });
        chart.draw_series(dots.collect::<Vec<_>>()).map_err(plot_error)?;
    }
    Ok(())
}

/// A method with one budget, in all scenes.
struct Series {
    method: &'static str,
    index: usize,
    budget: u32,
    /// Number of series of the same colour before this one.
    same_before: usize,
}

impl Series {
    /// Disk, ring, then both again, smaller.
    fn mark(&self) -> ShapeStyle {
        let colour = colour(self.index);
        if self.same_before.is_multiple_of(2) { colour.filled() } else { colour.stroke_width(2) }
    }

    fn radius(&self) -> i32 {
        if self.same_before < 2 { 5 } else { 3 }
    }

    fn legend_entry(&self) -> LegendEntry {
        LegendEntry { name: format!("{} {}", self.method, self.budget), mark: self.mark(), radius: self.radius() }
    }

    fn contains(&self, found: &SceneMethod) -> bool {
        (self.method, self.budget) == (found.method, found.budget)
    }
}

fn series(scenes: &[SceneReport]) -> Vec<Series> {
    let mut all: Vec<Series> = vec![];
    for found in scenes.iter().flat_map(|scene| &scene.methods) {
        if !all.iter().any(|series| series.contains(found)) {
            let &SceneMethod { method, index, budget, .. } = found;
            let same_before = all.iter().filter(|series| series.index == index).count();
            all.push(Series { method, index, budget, same_before });
        }
    }
    all
}
