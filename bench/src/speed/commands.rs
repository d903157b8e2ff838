//! Whole commands of sdftool, each a process of its own, with the numbers that it prints.

use std::ffi::OsString;
use std::path::PathBuf;
use std::time::Instant;

use anyhow::Result;
use sdf_core::grid::owned::Layout;
use sdf_core::grid::sparse::BRICK_SAMPLES;
use sdf_formats::grid_file::Compression;
use sdf_formats::mesh::{self, MeshFormat};

use super::bodies::{self, POT};
use super::round_robin::{RoundRobin, RunResult, Work};
use super::row::Row;
use crate::program::sdftool;

pub fn measure(quick: bool, turns: &mut RoundRobin) -> Result<()> {
    let folder = tempfile::tempdir()?;
    let body = bodies::body(POT, if quick { 10_000 } else { 100_000 });
    let cloth = bodies::cloth();
    let [body_file, cloth_file] = &["pot.obj", "cloth.obj"].map(|name| folder.path().join(name));
    mesh::write(body_file, MeshFormat::Obj, &body.points, &body.triangles)?;
    mesh::write(cloth_file, MeshFormat::Obj, &cloth.points, &cloth.triangles)?;
    let bake = |grid: &GridFile| {
        let GridFile { layout, resolution, compression, .. } = *grid;
        let options = ["--res", &resolution.to_string(), "--layout", layout.name(), "--compress", compression.name()];
        let words = ["bake".into(), body_file.into(), "-o".into(), (&grid.path).into()];
        Command {
            timed_part: "bake",
            name: format!("bake {}", grid.name()),
            triangles: body.triangles.len(),
            resolution,
            words: words.into_iter().chain(options.map(OsString::from)).collect(),
            mesh_bytes: (size_of_val(&body.points[..]) + size_of_val(&body.triangles[..])) as f64,
        }
    };
    let contacts = |grid: &GridFile| {
        let options = ["--method", "fw", "--margin", "0.01"].map(OsString::from);
        let words = ["contacts".into(), cloth_file.into(), (&grid.path).into()];
        Command {
            timed_part: "query",
            name: format!("contacts of sheet on {} by fw", grid.name()),
            triangles: cloth.triangles.len(),
            resolution: grid.resolution,
            words: words.into_iter().chain(options).collect(),
            mesh_bytes: 0.0,
        }
    };
    let [dense, sparse] = if quick { [32, 64] } else { [256, 512] };
    for (layout, resolution) in [(Layout::Dense, dense), (Layout::Sparse, sparse)] {
        let grids = Compression::ALL.map(|compression| {
            let path = folder.path().join(format!("{}-{}.sdf.h5", layout.name(), compression.name()));
            GridFile { layout, resolution, compression, path }
        });
        turns.measure(grids.iter().map(|grid| bake(grid).work()).collect())?;
        turns.measure(grids.iter().map(|grid| contacts(grid).work()).collect())?;
    }
    Ok(())
}

/// A grid of the pot.
struct GridFile {
    layout: Layout,
    resolution: u32,
    compression: Compression,
    path: PathBuf,
}

impl GridFile {
    /// The grid in words, with the option of its bake unless that is the default.
    fn name(&self) -> String {
        let option = if self.compression == Compression::None { " --compress none" } else { "" };
        format!("{} pot{option}", self.layout.name())
    }
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
            write_seconds: printed["seconds"]["write"].as_f64(),
            peak_mib: printed["peak_memory_bytes"].as_f64().map(mib),
            result_mib: printed["nodes"].is_number().then(|| mib(sample_bytes + self.mesh_bytes)),
            ..RunResult::timed(seconds)
        })
    }
}
