//! How often does each size of error occur? A histogram as SVG.

use std::fmt::Write;
use std::path::Path;

use anyhow::Result;
use sdf_formats::atomic_write;

use crate::mesh_input::with_path;

/// Histogram of errors as SVG, with a logarithmic axis of counts.
pub struct Histogram<'a> {
    pub title: String,
    /// The unit of the errors, such as `in voxels`.
    pub unit: &'static str,
    /// Errors of zero or more.
    pub errors: &'a [f64],
    /// The certified error bound, drawn as a line.
    pub bound: Option<f64>,
}

const BARS: usize = 60;
const WIDTH: f64 = 600.0;
const HEIGHT: f64 = 260.0;
const LEFT: f64 = 70.0;
const TOP: f64 = 40.0;

impl Histogram<'_> {
    pub fn write(&self, path: &Path) -> Result<()> {
        let svg = self.svg();
        with_path(path, atomic_write(path, |temporary| std::fs::write(temporary, &svg)))
    }

    fn svg(&self) -> String {
        let bound = self.bound.filter(|bound| bound.is_finite());
        let largest = self.errors.iter().copied().fold(bound.unwrap_or(0.0), f64::max);
        let end = if largest > 0.0 { largest * 1.05 } else { 1.0 };
        let mut counts = [0_usize; BARS];
        for error in self.errors {
            counts[((error / end * BARS as f64) as usize).min(BARS - 1)] += 1;
        }
        let highest = counts.iter().copied().max().unwrap_or(0).max(1) as f64;
        // The axis begins at a count of 0.1, so that a single point shows.
        let height = |count: f64| HEIGHT * (count.log10() + 1.0) / (highest.log10() + 1.0);
        let across = |error: f64| LEFT + WIDTH * error / end;
        let mut svg = format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" font-family=\"sans-serif\" font-size=\"12\">\n\
             <rect width=\"100%\" height=\"100%\" fill=\"white\"/>\n<text x=\"{LEFT}\" y=\"24\" font-size=\"14\">{}</text>\n",
            LEFT + WIDTH + 30.0,
            TOP + HEIGHT + 60.0,
            escaped(&self.title)
        );
        let bottom = TOP + HEIGHT;
        for (bar, count) in counts.iter().enumerate().filter(|(_, count)| **count > 0) {
            let tall = height(*count as f64);
            let (x, wide) = (across(end * bar as f64 / BARS as f64), WIDTH / BARS as f64 - 1.0);
            let y = bottom - tall;
            let _ = writeln!(
                svg,
                "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{wide:.1}\" height=\"{tall:.1}\" fill=\"#2d5c98\"/>"
            );
        }
        let mut count = 1.0;
        while count <= highest {
            let y = bottom - height(count);
            let _ = writeln!(
                svg,
                "<line x1=\"{LEFT}\" x2=\"{}\" y1=\"{y:.1}\" y2=\"{y:.1}\" stroke=\"#0003\"/>\
                 <text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{count}</text>",
                LEFT + WIDTH,
                LEFT - 6.0,
                y + 4.0
            );
            count *= 10.0;
        }
        for tick in 0..=6 {
            let error = end * f64::from(tick) / 6.0;
            let x = across(error);
            let _ =
                writeln!(svg, "<text x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\">{error:.3}</text>", bottom + 18.0);
        }
        let _ = writeln!(
            svg,
            "<line x1=\"{LEFT}\" x2=\"{0}\" y1=\"{bottom}\" y2=\"{bottom}\" stroke=\"black\"/>\
             <text x=\"{1}\" y=\"{2}\" text-anchor=\"middle\">error {3}, of {4} points</text>",
            LEFT + WIDTH,
            LEFT + 0.5 * WIDTH,
            bottom + 42.0,
            self.unit,
            self.errors.len()
        );
        if let Some(bound) = bound {
            let x = across(bound);
            let _ = writeln!(
                svg,
                "<line x1=\"{x:.1}\" x2=\"{x:.1}\" y1=\"{TOP}\" y2=\"{bottom}\" stroke=\"#d67628\" stroke-width=\"2\"/>\
                 <text x=\"{:.1}\" y=\"{}\" text-anchor=\"end\" fill=\"#a04d08\">certified</text>",
                x - 6.0,
                TOP + 12.0
            );
        }
        svg + "</svg>\n"
    }
}

/// Escapes a text for XML.
pub fn escaped(text: &str) -> String {
    let escape = |c: char| match c {
        '&' => "&amp;".to_owned(),
        '<' => "&lt;".to_owned(),
        '>' => "&gt;".to_owned(),
        c if c.is_control() => char::REPLACEMENT_CHARACTER.to_string(),
        c => c.to_string(),
    };
    text.chars().map(escape).collect()
}
