use std::io::{Write, stdout};

use anyhow::Result;
use serde::Serialize;

use crate::args::Json;

/// What a command has to say: rows for a person, one object for a program.
pub struct Report<J> {
    pub rows: Vec<(&'static str, String)>,
    pub json: J,
}

impl<J: Serialize> Report<J> {
    pub fn print(&self, json: Json) -> Result<()> {
        let mut out = stdout().lock();
        if json.wanted {
            serde_json::to_writer(&mut out, &self.json)?;
            writeln!(out)?;
            return Ok(());
        }
        let widest = self.rows.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0);
        for (name, value) in &self.rows {
            writeln!(out, "{name:>widest$}  {value}")?;
        }
        Ok(())
    }
}

pub fn counts(counts: [u32; 3]) -> String {
    let [x, y, z] = counts;
    format!("{x} × {y} × {z}")
}

/// As many digits as tell it apart, few zeros.
pub fn number(x: f64) -> String {
    if x != 0.0 && !(1e-3..1e6).contains(&x.abs()) { format!("{x:.4e}") } else { format!("{x:.6}") }
}

pub fn seconds(seconds: f64) -> String {
    if seconds < 1.0 { format!("{:.1} ms", seconds * 1e3) } else { format!("{seconds:.2} s") }
}

pub fn count(count: usize, what: &str) -> String {
    format!("{count} {what}")
}
