//! Frame of every picture: a white page, the colour of each method, a legend.

use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::prelude::*;

pub type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Colours that colour-blind readers can distinguish (Okabe and Ito 2008), without yellow, which is faint on white.
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

/// Colour of a method or curve, the same in every picture.
pub fn colour(index: usize) -> RGBColor {
    COLOURS[index % COLOURS.len()]
}

/// Draws on a white page and returns the SVG.
pub fn draw(size: (u32, u32), draw: impl FnOnce(&Area) -> Result<()>) -> Result<String> {
    let mut svg = String::new();
    {
        let area = SVGBackend::with_string(&mut svg, size).into_drawing_area();
        area.fill(&WHITE).map_err(plot_error)?;
        draw(&area)?;
        area.present().map_err(plot_error)?;
    }
    Ok(svg)
}

/// Wraps an error of plotters.
pub fn plot_error(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow!("a plot: {error}")
}

/// A mark and its name.
pub struct LegendEntry {
    pub name: String,
    pub mark: ShapeStyle,
    pub radius: i32,
}

pub const LEGEND_HEIGHT: i32 = 26;

/// Draws marks and names on one line.
pub fn legend(area: &Area, entries: &[LegendEntry]) -> Result<()> {
    /// Average width of a letter in pixels.
    const LETTER: i32 = 8;
    let mut x = 24;
    for LegendEntry { name, mark, radius } in entries {
        area.draw(&Circle::new((x, 12), *radius, *mark)).map_err(plot_error)?;
        area.draw(&Text::new(name.clone(), (x + 10, 5), ("sans-serif", 16).into_font())).map_err(plot_error)?;
        x += 34 + LETTER * name.chars().count() as i32;
    }
    Ok(())
}
