//! Whole commands, each a process of its own, with what it says of itself.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use sdf_core::grid::sparse::BRICK_SAMPLES;
use sdf_formats::mesh::{self, MeshFormat};
use serde_json::Value;

use super::bodies::{self, POT};
use super::row::Row;
use super::turns::{Done, Turns, Work};

/// A folder in the system's place for such, which goes away with it.
pub struct Folder {
    path: PathBuf,
}

impl Folder {
    pub fn new() -> Result<Self> {
        use std::sync::atomic::{AtomicU32, Ordering};
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("sdftool-bench-{}-{number}", std::process::id()));
        std::fs::create_dir(&path).with_context(|| path.display().to_string())?;
        Ok(Self { path })
    }

    pub fn file(&self, name: &str) -> PathBuf {
        self.path.join(name)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // What cannot be removed stays where such files do.
        let _ = std::fs::remove_dir_all(&self.path);
    }
}

pub fn measure(quick: bool, turns: &mut Turns) -> Result<()> {
    let folder = Folder::new()?;
    let input = bodies::body(POT, if quick { 10_000 } else { 100_000 });
    let cloth = bodies::cloth();
    let paths = ["pot.obj", "cloth.obj", "dense.sdf.h5", "sparse.sdf.h5"].map(|name| folder.file(name));
    let [body_file, cloth_file, dense_file, sparse_file] = &paths;
    mesh::write(body_file, MeshFormat::Obj, &input.mesh.points, &input.mesh.triangles)?;
    mesh::write(cloth_file, MeshFormat::Obj, &cloth.points, &cloth.triangles)?;
    let triangles = input.mesh.triangles.len();
    let [dense, sparse] = if quick { [32, 64] } else { [256, 512] };
    let of_mesh = size_of_val(&input.mesh.points[..]) + size_of_val(&input.mesh.triangles[..]);
    let bake = |layout: &str, resolution: u32, file: &Path| {
        let resolution_word = resolution.to_string();
        let words = ["--res", &resolution_word, "--layout", layout].map(OsString::from);
        let command = ["bake".into(), body_file.into(), "-o".into(), file.into()].into_iter().chain(words).collect();
        whole("bake", format!("bake {layout} pot"), triangles, resolution, command, of_mesh as f64)
    };
    let contacts = |layout: &str, resolution: u32, file: &Path| {
        let words = ["--method", "fw", "--margin", "0.01"].map(OsString::from);
        let command = ["contacts".into(), cloth_file.into(), file.into()].into_iter().chain(words).collect();
        whole(
            "query",
            format!("contacts of sheet on {layout} pot by fw"),
            cloth.triangles.len(),
            resolution,
            command,
            0.0,
        )
    };
    turns.take(vec![bake("dense", dense, dense_file), bake("sparse", sparse, sparse_file)])?;
    turns.take(vec![contacts("dense", dense, dense_file)])?;
    turns.take(vec![contacts("sparse", sparse, sparse_file)])
}

/// A command on one thread. The floor of its row is the part of the work itself, as the command tells under `part`.
fn whole(
    part: &'static str,
    work: String,
    triangles: usize,
    resolution: u32,
    command: Vec<OsString>,
    of_mesh: f64,
) -> Work<'static> {
    let row = Row {
        group: "commands",
        work,
        triangles,
        resolution,
        threads: 1,
        units: triangles as f64,
        unit: "faces",
        ..Row::default()
    };
    let run = move || {
        let started = Instant::now();
        let said = sdftool(&command)?;
        let seconds = started.elapsed().as_secs_f64();
        let mib = |bytes: f64| bytes / f64::from(1 << 20);
        let samples = match said["bricks"].as_f64() {
            Some(bricks) => bricks * (BRICK_SAMPLES * size_of::<u16>()) as f64,
            None => said["nodes"].as_f64().unwrap_or(f64::NAN) * size_of::<f32>() as f64,
        };
        let result = said["nodes"].is_number().then(|| mib(samples + of_mesh));
        Ok(Done {
            floor: said["seconds"][part].as_f64(),
            peak_mib: said["peak_memory_bytes"].as_f64().map(mib),
            result_mib: result,
            ..Done::in_seconds(seconds)
        })
    };
    Work { row, size: 1.0, run: Box::new(run) }
}

/// What the program says on one thread.
fn sdftool(words: &[OsString]) -> Result<Value> {
    let program = std::env::current_exe().context("the program itself")?;
    let mut command = Command::new(program);
    command.args(words).args(["--threads", "1", "--json"]).stdin(Stdio::null());
    let output = command.output().context("sdftool")?;
    if !output.status.success() {
        bail!("{command:?}: {}", String::from_utf8_lossy(&output.stderr).trim());
    }
    Ok(serde_json::from_slice(&output.stdout)?)
}
