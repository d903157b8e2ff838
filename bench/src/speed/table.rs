//! The table on the terminal.

use std::io::Write;

use anyhow::Result;

use super::SpeedReport;
use super::row::Row;
use crate::duration_text;

pub fn print(report: &SpeedReport, out: &mut impl Write) -> Result<()> {
    let machine = &report.machine;
    writeln!(out, "{}; {}; sdftool {}", machine.description(), machine.date, machine.version)?;
    let mut group = "";
    for row in &report.rows {
        if row.group != group {
            group = row.group;
            writeln!(out, "\n{group}")?;
        }
        writeln!(out, "  {}", line(row))?;
    }
    if !report.left_out.is_empty() {
        writeln!(out, "\nleft out")?;
    }
    report.left_out.iter().try_for_each(|work| Ok(writeln!(out, "  {work}")?))
}

fn line(row: &Row) -> String {
    let mut line = format!("{:<57}", row.work);
    let size = [(row.triangles, "triangles"), (row.resolution as usize, "cells")];
    for (count, what) in size {
        let shown = if count > 0 { format!("{count} {what}") } else { String::new() };
        line += &format!("{shown:>19}");
    }
    let threads = if row.threads == 1 { "thread" } else { "threads" };
    line += &format!(
        "  {} {threads:<7} {:>10} {:>8.2}x  {}",
        row.threads,
        duration_text(row.seconds),
        row.ratio,
        rate(row)
    );
    if let Some(fraction) = row.fraction_of_limit() {
        let what = if row.group == "commands" { "the work itself" } else { "of the limit" };
        line += &format!("  {:.1} % {what}", 100.0 * fraction);
    }
    if let Some(contacts) = row.contacts {
        line += &format!("  {contacts} contacts");
    }
    if let Some(write) = row.write_seconds {
        line += &format!("  {} to write", duration_text(write));
    }
    if let Some(peak) = row.peak_mib {
        line += &format!("  {peak:.0} MiB peak");
    }
    line
}

/// Units per second if they are fast, time per unit otherwise.
fn rate(row: &Row) -> String {
    if row.unit == "bytes" {
        return format!("{:.2} GB/s", 1e-9 * row.units / row.seconds);
    }
    let unit = row.unit.trim_end_matches('s');
    match row.nanoseconds_per_unit() {
        nanoseconds if nanoseconds < 100.0 => format!("{:.1} M {}/s", 1e3 / nanoseconds, row.unit),
        nanoseconds => format!("{:.3} µs per {unit}", 1e-3 * nanoseconds),
    }
}
