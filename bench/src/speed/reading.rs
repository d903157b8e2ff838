//! An OBJ file in the system's cache, read into points and triangles.

use std::fmt::Write;
use std::hint::black_box;
use std::time::Instant;

use anyhow::{Context, Result};
use sdf_formats::mesh;
use sdf_procedural::Mesh;

use super::bodies::{self, POT};
use super::limits::MachineLimits;
use super::round_robin::{RoundRobin, RunResult, Work};
use super::row::Row;

pub fn measure(quick: bool, limits: Option<&MachineLimits>, turns: &mut RoundRobin) -> Result<()> {
    let folder = tempfile::tempdir()?;
    let counts: &[usize] = if quick { &[10_000] } else { &[10_000, 100_000, 1_000_000, 3_000_000] };
    let mut works = vec![];
    for count in counts {
        let body = bodies::body(POT, *count);
        let file = folder.path().join(format!("{count}.obj"));
        let text = obj_text(&body);
        std::fs::write(&file, &text).with_context(|| file.display().to_string())?;
        let row = Row {
            group: "reading",
            work: "read OBJ".to_owned(),
            triangles: body.triangles.len(),
            threads: 1,
            units: text.len() as f64,
            unit: "bytes",
            ..Row::default()
        };
        let floor_seconds = limits.map(|limits| limits.copy_seconds(text.len() as f64));
        let run = move || {
            let started = Instant::now();
            black_box(mesh::read(&file)?);
            Ok(RunResult { floor_seconds, ..RunResult::timed(started.elapsed().as_secs_f64()) })
        };
        works.push(Work { size: row.units, row, run: Box::new(run) });
    }
    turns.measure(works)
}

/// OBJ with six decimals, as most programs write it.
pub fn obj_text(mesh: &Mesh) -> String {
    let mut text = String::new();
    // Writing to a String does not fail.
    for [x, y, z] in &mesh.points {
        let _ = writeln!(text, "v {x:.6} {y:.6} {z:.6}");
    }
    for [a, b, c] in mesh.triangles.iter().map(|corners| corners.map(|index| index + 1)) {
        let _ = writeln!(text, "f {a} {b} {c}");
    }
    text
}
