//! Output of a command on standard output: rows or JSON, and how numbers look in rows.

use std::fmt::Display;
use std::io::{self, Write, stderr};
use std::path::Path;

use anyhow::{Context, Result};
use sdf_core::Aabb;
pub use sdf_field::page::{counts, number};
use serde::Serialize;

use crate::args::Json;
use crate::failure::on_one_line;
use crate::standard_output::{is_standard_output, to_stdout};

/// The output of a command: rows for a person, one JSON object for a program.
pub struct Report<J> {
    pub rows: Vec<(&'static str, String)>,
    pub json: J,
}

impl<J: Serialize> Report<J> {
    pub fn print(&self, json: Json) -> Result<()> {
        if json.wanted {
            return print_json(&self.json);
        }
        to_stdout(|out| self.print_rows(out))
    }

    /// Prints where the command's file does not go: to standard error, if `file` is standard output.
    pub fn print_beside(&self, file: Option<&Path>, json: Json) -> Result<()> {
        if file.is_some_and(is_standard_output) {
            return self.print_rows(&mut stderr().lock()).context("standard error");
        }
        self.print(json)
    }

    fn print_rows(&self, out: &mut impl Write) -> io::Result<()> {
        let widest = self.rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
        for (name, value) in &self.rows {
            // A value may be text from a file.
            writeln!(out, "{name:>widest$}  {}", on_one_line(value))?;
        }
        Ok(())
    }
}

/// A coordinate with the digits that tell places so far apart from each other: as [`number`] writes it where that has them.
pub fn place(x: f64, resolution: f64) -> String {
    // Half of the last digit of `number`.
    let rounding = if (1e-3..1e6).contains(&x.abs()) { 5e-7 } else { 5e-5 * x.abs() };
    if rounding <= resolution {
        return number(x);
    }
    // From there on f64 has no decimals.
    if x.abs() >= 1e15 {
        return format!("{x:?}");
    }
    let decimals = (-resolution.log10()).ceil().clamp(0.0, 12.0) as usize;
    format!("{x:.decimals$}")
}

/// The corners of a box, to a thousandth of its longest side.
pub fn corners_of(bounds: &Aabb) -> String {
    let corner = |corner: [f64; 3]| corner.map(|x| place(x, 1e-3 * bounds.longest_side())).join(", ");
    format!("({}) to ({})", corner(bounds.min), corner(bounds.max))
}

/// A point at a distance from a surface, to a thousandth of that, or to six decimals.
pub fn point_at(point: [f64; 3], distance: f64) -> String {
    format!("({})", point.map(|x| place(x, (1e-3 * distance.abs()).max(1e-6))).join(", "))
}

/// Prints a line on standard error that a person should see, whatever is on standard output.
pub fn warn(sentence: &str) {
    complain(&format!("warning: {sentence}"));
}

/// Prints a line on standard error, if that can be written to.
pub fn complain(sentence: &str) {
    let _ = writeln!(stderr(), "sdftool: {sentence}");
}

/// A count with its noun, which takes an s: "1 triangle", "2 triangles".
pub fn counted<N: Display + PartialEq + From<u8>>(count: N, noun: &str) -> String {
    format!("{count} {noun}{}", if count == N::from(1) { "" } else { "s" })
}

/// A count of any size; in exponential form from 10¹⁵ on.
pub fn many(count: f64) -> String {
    if count < 1e15 { format!("{count:.0}") } else { format!("{count:.1e}") }
}

/// Prints one object on one line.
pub fn print_json(json: &impl Serialize) -> Result<()> {
    to_stdout(|out| line_of_json(json, out))
}

/// One object on one line.
pub fn line_of_json(json: &impl Serialize, out: &mut dyn Write) -> io::Result<()> {
    // An io::Error keeps the kind, which tells main about a broken pipe.
    serde_json::to_writer(&mut *out, json).map_err(io::Error::from)?;
    writeln!(out)
}

pub fn seconds(seconds: f64) -> String {
    if seconds < 1.0 { format!("{:.1} ms", seconds * 1e3) } else { format!("{seconds:.2} s") }
}
