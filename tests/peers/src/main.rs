//! Work done by other crates, and by ours where it must be timed in the same process: `peers WORK FILE…`.
//!
//! A worker reads its files and prints `ready`. For each input line `go` it does its work once and prints `{"seconds": …}`. The line
//! `save PATH` writes the distances of the last run as f32. So another program can make workers take turns.

#![forbid(unsafe_code)]

mod distances;
mod entangled;
mod pairs;
mod reading;

use std::io::{BufRead, Write};
use std::path::Path;
use std::time::Instant;

use anyhow::{Context, Result, bail};
use serde::Deserialize;
use serde_json::{Value, json};

/// Nodes of the distances, x fastest.
#[derive(Clone, Copy, Deserialize)]
pub struct Nodes {
    pub origin: [f64; 3],
    pub spacing: f64,
    pub counts: [usize; 3],
}

impl Nodes {
    pub fn at(&self, [x, y, z]: [usize; 3]) -> [f64; 3] {
        let step = |axis: usize, index: usize| self.origin[axis] + self.spacing * index as f64;
        [step(0, x), step(1, y), step(2, z)]
    }
}

/// The result of one run.
pub struct Answer {
    pub distances: Vec<f32>,
    /// Further results, for the report.
    pub facts: Value,
}

impl Answer {
    pub fn facts(facts: Value) -> Self {
        Self { distances: vec![], facts }
    }
}

type Work = Box<dyn FnMut() -> Result<Answer>>;

fn main() -> Result<()> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    match words[..] {
        ["write-obj", triangles, file] => return reading::write(triangles.parse()?, Path::new(file)),
        ["entangled", file] => return entangled::run(Path::new(file)),
        _ => {}
    }
    let work = match words[..] {
        ["parry3d", mesh, nodes] => distances::parry3d(Path::new(mesh), serde_json::from_str(nodes)?)?,
        ["mesh_to_sdf", mesh, nodes] => distances::mesh_to_sdf(Path::new(mesh), serde_json::from_str(nodes)?)?,
        ["parry3d-pairs", cloth, body, margin] => pairs::work(Path::new(cloth), Path::new(body), margin.parse()?)?,
        ["tobj", file] => reading::tobj(file.into()),
        ["sdf-formats", file] => reading::ours(file.into()),
        _ => bail!("peers: write-obj, entangled, parry3d, mesh_to_sdf, parry3d-pairs, tobj or sdf-formats"),
    };
    serve(work)
}

fn serve(mut work: Work) -> Result<()> {
    say(&json!("ready"))?;
    let mut last = vec![];
    for line in std::io::stdin().lock().lines() {
        let line = line?;
        match line.split_once(' ') {
            Some(("save", path)) => {
                let bytes: Vec<u8> = last.iter().flat_map(|x: &f32| x.to_le_bytes()).collect();
                std::fs::write(path, bytes).context(path.to_owned())?;
                say(&json!("saved"))?;
            }
            _ => {
                let started = Instant::now();
                let answer = work()?;
                let seconds = started.elapsed().as_secs_f64();
                last = answer.distances;
                say(&json!({"seconds": seconds, "facts": answer.facts}))?;
            }
        }
    }
    Ok(())
}

fn say(value: &Value) -> Result<()> {
    let mut out = std::io::stdout().lock();
    writeln!(out, "{value}")?;
    Ok(out.flush()?)
}
