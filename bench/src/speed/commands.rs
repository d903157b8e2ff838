//! Whole commands of sdftool, each a process of its own, with the numbers that it prints.

use std::ffi::OsString;
use std::path::Path;
use std::time::Instant;

use anyhow::Result;
use sdf_core::grid::owned::Layout;
use sdf_core::grid::sparse::BRICK_SAMPLES;
use sdf_formats::mesh::{self, MeshFormat};

use super::bodies::{self, POT};
use super::round_robin::{RoundRobin, RunResult, Work};
use super::row::Row;
use crate::program::sdftool;

pub fn measure(quick: bool, turns: &mut RoundRobin) -> Result<()> {
    let folder = tempfile::tempdir()?;
    let body = bodies::body(POT, if quick { 10_000 } else { 100_000 });
    let cloth = bodies::cloth();
    let paths = ["pot.obj", "cloth.obj", "dense.sdf.h5", "sparse.sdf.h5"].map(|name| folder.path().join(name));
    let [body_file, cloth_file, dense_file, sparse_file] = &paths;
    mesh::write(body_file, MeshFormat::Obj, &body.points, &body.triangles)?;
    mesh::write(cloth_file, MeshFormat::Obj, &cloth.points, &cloth.triangles)?;
    let [dense, sparse] = if quick { [32, 64] } else { [256, 512] };
    let bake = |layout: Layout, resolution: u32, file: &Path| {
        let options = ["--res", &resolution.to_string(), "--layout", layout.name()].map(OsString::from);
        let words = ["bake".into(), body_file.into(), "-o".into(), file.into()].into_iter().chain(options).collect();
        Command {
            timed_part: "bake",
            name: format!("bake {} pot", layout.name()),
            triangles: body.triangles.len(),
            resolution,
            words,
            mesh_bytes: (size_of_val(&body.points[..]) + size_of_val(&body.triangles[..])) as f64,
        }
        .work()
    };
    let contacts = |layout: Layout, resolution: u32, file: &Path| {
        let options = ["--method", "fw", "--margin", "0.01"].map(OsString::from);
        let words = ["contacts".into(), cloth_file.into(), file.into()].into_iter().chain(options).collect();
        Command {
            timed_part: "query",
            name: format!("contacts of sheet on {} pot by fw", layout.name()),
            triangles: cloth.triangles.len(),
            resolution,
            words,
            mesh_bytes: 0.0,
        }
        .work()
    };
    turns.measure(vec![bake(Layout::Dense, dense, dense_file), bake(Layout::Sparse, sparse, sparse_file)])?;
    turns.measure(vec![contacts(Layout::Dense, dense, dense_file)])?;
    turns.measure(vec![contacts(Layout::Sparse, sparse, sparse_file)])
}

/// A command on one thread.
struct Command {
    /// The part that is the work itself, as the printed `seconds` name it.
    timed_part: &'static str,
    name: String,
    triangles: usize,
    resolution: u32,
    words: Vec<OsString>,
    mesh_bytes: f64,
}

impl Command {
    fn work(mut self) -> Work<'static> {
        let row = Row {
            group: "commands",
            work: std::mem::take(&mut self.name),
            triangles: self.triangles,
            resolution: self.resolution,
            threads: 1,
            units: self.triangles as f64,
            unit: "faces",
            ..Row::default()
        };
        self.words.extend(["--threads", "1"].map(OsString::from));
        Work { row, size: 1.0, run: Box::new(move || self.run()) }
    }

    fn run(&self) -> Result<RunResult> {
        let started = Instant::now();
        let printed = sdftool(&self.words)?;
        let seconds = started.elapsed().as_secs_f64();
        let mib = |bytes: f64| bytes / f64::from(1 << 20);
        let sample_bytes = match printed["bricks"].as_f64() {
            Some(bricks) => bricks * (BRICK_SAMPLES * size_of::<u16>()) as f64,
            None => printed["nodes"].as_f64().unwrap_or(f64::NAN) * size_of::<f32>() as f64,
        };
        Ok(RunResult {
            floor_seconds: printed["seconds"][self.timed_part].as_f64(),
            peak_mib: printed["peak_memory_bytes"].as_f64().map(mib),
            result_mib: printed["nodes"].is_number().then(|| mib(sample_bytes + self.mesh_bytes)),
            ..RunResult::timed(seconds)
        })
    }
}
