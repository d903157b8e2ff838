//! Pictures of the numbers, as SVG that stands alone.

mod scenes;
mod sets;

use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::prelude::*;

pub use scenes::{culls, misses};
pub use sets::{against_cost, convergence, found};

pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Of Okabe and Ito 2008, which colour-blind readers tell apart, without their yellow, which a white page swallows.
const COLOURS: [RGBColor; 8] = [
    RGBColor(128, 128, 128),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(0, 114, 178),
    RGBColor(0, 0, 0),
    RGBColor(213, 94, 0),
];

/// Of a method by its number, the same in every picture.
pub fn colour(method: usize) -> RGBColor {
    COLOURS[method % COLOURS.len()]
}

/// Draws on white.
pub fn draw(size: (u32, u32), draw: impl FnOnce(&Area) -> Result<()>) -> Result<String> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        area.fill(&WHITE).map_err(of_plotter)?;
        draw(&area)?;
        area.present().map_err(of_plotter)?;
    }
    Ok(svg)
}

pub fn of_plotter(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow!("a plot: {error}")
}

/// What a colour stands for.
pub struct Entry {
    pub name: String,
    pub mark: ShapeStyle,
    pub radius: i32,
}

pub const LEGEND_HEIGHT: i32 = 26;

/// One line of marks and names.
pub fn legend(area: &Area, entries: &[Entry]) -> Result<()> {
    /// About as wide as a letter of the legend's is on average.
    const LETTER: i32 = 8;
    let mut x = 24;
    for Entry { name, mark, radius } in entries {
        area.draw(&Circle::new((x, 12), *radius, *mark)).map_err(of_plotter)?;
        area.draw(&Text::new(name.clone(), (x + 10, 5), ("sans-serif", 16).into_font())).map_err(of_plotter)?;
        x += 34 + LETTER * name.chars().count() as i32;
    }
    Ok(())
}
