//! `bake` without reading the mesh and writing the file.

use anyhow::Result;
use clap::Parser;

use super::bodies::{self, BOWL, POT};
use super::limits::Limits;
use super::machine;
use super::row::Row;
use super::turns::{Done, Turns, Work, thread_counts, timed};
use crate::args::{BakeArgs, Layout};
use crate::commands::bake;
use crate::mesh_input::MeshInput;

/// A body and how it is baked.
#[derive(Clone, Copy)]
struct Bake<'a> {
    group: &'static str,
    input: &'a MeshInput,
    layout: Layout,
    resolution: u32,
    threads: usize,
}

pub fn against_resolution(quick: bool, limits: Option<&Limits>, turns: &mut Turns) -> Result<()> {
    let triangles = if quick { 10_000 } else { 100_000 };
    let resolutions: &[u32] = if quick { &[32, 64] } else { &[64, 128, 256, 512, 1024] };
    for name in [POT, BOWL] {
        let input = bodies::body(name, triangles);
        for layout in [Layout::Dense, Layout::Sparse] {
            let bake = |resolution: &u32| {
                Bake { group: "resolution", input: &input, layout, resolution: *resolution, threads: 1 }.work(limits)
            };
            turns.take(resolutions.iter().map(bake).collect())?;
        }
    }
    Ok(())
}

pub fn against_triangles(quick: bool, limits: Option<&Limits>, turns: &mut Turns) -> Result<()> {
    let counts: &[usize] = if quick { &[1_000, 10_000] } else { &[1_000, 10_000, 100_000, 1_000_000, 10_000_000] };
    let inputs: Vec<MeshInput> = counts.iter().map(|count| bodies::body(POT, *count)).collect();
    let [dense, sparse] = if quick { [32, 64] } else { [128, 256] };
    for (layout, resolution) in [(Layout::Dense, dense), (Layout::Sparse, sparse)] {
        let bake = |input| Bake { group: "triangles", input, layout, resolution, threads: 1 }.work(limits);
        turns.take(inputs.iter().map(bake).collect())?;
    }
    Ok(())
}

pub fn against_threads(quick: bool, limits: Option<&Limits>, turns: &mut Turns) -> Result<()> {
    let input = bodies::body(POT, if quick { 10_000 } else { 100_000 });
    let [dense, sparse] = if quick { [48, 64] } else { [256, 512] };
    for (layout, resolution) in [(Layout::Dense, dense), (Layout::Sparse, sparse)] {
        let bake = |threads| Bake { group: "threads", input: &input, layout, resolution, threads }.work(limits);
        turns.take(thread_counts(machine::cores()).into_iter().map(bake).collect())?;
    }
    Ok(())
}

impl<'a> Bake<'a> {
    fn work(self, limits: Option<&'a Limits>) -> Work<'a> {
        let layout = if self.layout == Layout::Dense { "dense" } else { "sparse" };
        let row = Row {
            group: self.group,
            work: format!("bake {layout} {}", self.input.facts.name),
            triangles: self.input.mesh.triangles.len(),
            resolution: self.resolution,
            threads: self.threads,
            unit: "nodes",
            ..Row::default()
        };
        let side = f64::from(self.resolution);
        // With so many triangles their tree takes as long as some nodes.
        let nodes = if self.layout == Layout::Dense { side.powi(3) } else { 40.0 * side * side };
        let size = (nodes + row.triangles as f64) / self.threads as f64;
        Work { row, size, run: Box::new(move || self.run(limits)) }
    }

    fn run(&self, limits: Option<&Limits>) -> Result<Done> {
        let resolution = self.resolution.to_string();
        let layout = if self.layout == Layout::Dense { "dense" } else { "sparse" };
        let args = BakeArgs::try_parse_from(["bake", "mesh", "--res", &resolution, "--layout", layout])?;
        let input = self.input.clone();
        let (baked, seconds) = timed(self.threads, || bake::bake(&args, input))?;
        let baked = baked?;
        let [nodes, _] = baked.grid.stored(&baked.lattice);
        Ok(Done {
            units: nodes as f64,
            floor: limits.map(|limits| limits.of_nodes(nodes as f64) / self.threads as f64),
            ..Done::in_seconds(seconds)
        })
    }
}
