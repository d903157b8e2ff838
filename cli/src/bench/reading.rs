//! An OBJ file that the system has in its memory already, into points and triangles.

use std::fmt::Write;
use std::hint::black_box;
use std::time::Instant;

use anyhow::{Context, Result};
use sdf_formats::mesh;

use super::bodies::{self, POT};
use super::limits::Limits;
use super::processes::Folder;
use super::row::Row;
use super::turns::{Done, Turns, Work};
use crate::mesh_input::MeshInput;

pub fn measure(quick: bool, limits: Option<&Limits>, turns: &mut Turns) -> Result<()> {
    let folder = Folder::new()?;
    let counts: &[usize] = if quick { &[10_000] } else { &[10_000, 100_000, 1_000_000, 3_000_000] };
    let mut works = vec![];
    for count in counts {
        let input = bodies::body(POT, *count);
        let file = folder.file(&format!("{count}.obj"));
        let text = obj(&input);
        std::fs::write(&file, &text).with_context(|| file.display().to_string())?;
        let row = Row {
            group: "reading",
            work: "read OBJ".to_owned(),
            triangles: input.mesh.triangles.len(),
            threads: 1,
            units: text.len() as f64,
            unit: "bytes",
            ..Row::default()
        };
        let floor = limits.map(|limits| limits.of_copied(text.len() as f64));
        let run = move || {
            let started = Instant::now();
            black_box(mesh::read(&file)?);
            Ok(Done { floor, ..Done::in_seconds(started.elapsed().as_secs_f64()) })
        };
        works.push(Work { size: row.units, row, run: Box::new(run) });
    }
    turns.take(works)
}

/// In six decimals, as most programs write.
pub fn obj(input: &MeshInput) -> String {
    let mut text = String::new();
    // Writing to a String does not fail.
    for [x, y, z] in &input.mesh.points {
        let _ = writeln!(text, "v {x:.6} {y:.6} {z:.6}");
    }
    for [a, b, c] in input.mesh.triangles.iter().map(|corners| corners.map(|index| index + 1)) {
        let _ = writeln!(text, "f {a} {b} {c}");
    }
    text
}
