//! What a person sees.

use std::io::Write;

use anyhow::Result;

use super::Bench;
use super::row::Row;
use crate::report::{seconds, to_stdout};

pub fn print(bench: &Bench) -> Result<()> {
    to_stdout(|out| {
        writeln!(out, "{}; {}; sdftool {}", bench.machine.in_words(), bench.machine.date, bench.machine.version)?;
        let mut group = "";
        for row in &bench.rows {
            if row.group != group {
                group = row.group;
                writeln!(out, "\n{group}")?;
            }
            writeln!(out, "  {}", line(row))?;
        }
        if !bench.left_out.is_empty() {
            writeln!(out, "\nleft out, as --limit says")?;
        }
        bench.left_out.iter().try_for_each(|what| writeln!(out, "  {what}"))
    })
}

fn line(row: &Row) -> String {
    let mut line = format!("{:<48}", row.work);
    let size = [(row.triangles, "triangles"), (row.resolution as usize, "cells")];
    for (count, what) in size {
        let shown = if count > 0 { format!("{count} {what}") } else { String::new() };
        line += &format!("{shown:>19}");
    }
    let threads = if row.threads == 1 { "thread" } else { "threads" };
    line += &format!("  {} {threads:<7} {:>10} {:>8.2}x  {}", row.threads, seconds(row.seconds), row.ratio, pace(row));
    if let Some(share) = row.share() {
        let what = if row.group == "commands" { "the work itself" } else { "of the limit" };
        line += &format!("  {:.1} % {what}", 100.0 * share);
    }
    if let Some(found) = row.found {
        line += &format!("  {found} contacts");
    }
    if let Some(peak) = row.peak_mib {
        line += &format!("  {peak:.0} MiB at most");
    }
    line
}

/// Per second where many are done, else per unit.
fn pace(row: &Row) -> String {
    if row.unit == "bytes" {
        return format!("{:.2} GB/s", 1e-9 * row.units / row.seconds);
    }
    let unit = row.unit.trim_end_matches('s');
    match row.nanoseconds_a_unit() {
        nanoseconds if nanoseconds < 100.0 => format!("{:.1} M {}/s", 1e3 / nanoseconds, row.unit),
        nanoseconds => format!("{:.3} µs a {unit}", 1e-3 * nanoseconds),
    }
}
