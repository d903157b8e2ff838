//! Bakes in memory, and the set-up of their meshes alone: neither the mesh's file nor the grid's is counted.

use std::hint::black_box;
use std::time::Instant;

use anyhow::Result;
use sdf_bake::{MeshDistance, TriangleMesh};
use sdf_core::grid::owned::Layout;
use sdf_procedural::Mesh;

use super::bodies::{self, BOWL, POT};
use super::limits::MachineLimits;
use super::round_robin::{RoundRobin, RunResult, Work, thread_counts, timed};
use super::row::Row;

use crate::bake::{bake, stored_node_count};
use crate::{machine, on_threads};

/// A body and the options of its bake.
#[derive(Clone, Copy)]
struct BakeJob<'a> {
    group: &'static str,
    name: &'static str,
    body: &'a Mesh,
    layout: Layout,
    resolution: u32,
    threads: usize,
}

pub fn against_resolution(quick: bool, limits: Option<&MachineLimits>, turns: &mut RoundRobin) -> Result<()> {
    let triangles = if quick { 10_000 } else { 100_000 };
    let resolutions: &[u32] = if quick { &[32, 64] } else { &[64, 128, 256, 512, 1024, 2048] };
    for name in [POT, BOWL] {
        let body = &bodies::body(name, triangles);
        for layout in [Layout::Dense, Layout::Sparse] {
            let work = |resolution: &u32| {
                BakeJob { group: "resolution", name, body, layout, resolution: *resolution, threads: 1 }.work(limits)
            };
            turns.measure(resolutions.iter().map(work).collect())?;
        }
    }
    Ok(())
}

pub fn against_triangles(quick: bool, limits: Option<&MachineLimits>, turns: &mut RoundRobin) -> Result<()> {
    let counts: &[usize] = if quick { &[1_000, 10_000] } else { &[1_000, 10_000, 100_000, 1_000_000, 10_000_000] };
    let bodies: Vec<Mesh> = counts.iter().map(|count| bodies::body(POT, *count)).collect();
    let [dense, sparse] = if quick { [32, 64] } else { [128, 256] };
    for (layout, resolution) in [(Layout::Dense, dense), (Layout::Sparse, sparse)] {
        let work = |body| BakeJob { group: "triangles", name: POT, body, layout, resolution, threads: 1 }.work(limits);
        turns.measure(bodies.iter().map(work).collect())?;
    }
    Ok(())
}

pub fn against_threads(quick: bool, limits: Option<&MachineLimits>, turns: &mut RoundRobin) -> Result<()> {
    let body = &bodies::body(POT, if quick { 10_000 } else { 100_000 });
    let [dense, sparse] = if quick { [48, 64] } else { [256, 512] };
    for (layout, resolution) in [(Layout::Dense, dense), (Layout::Sparse, sparse)] {
        let work = |threads| BakeJob { group: "threads", name: POT, body, layout, resolution, threads }.work(limits);
        turns.measure(thread_counts(machine::cores()).into_iter().map(work).collect())?;
    }
    Ok(())
}

/// The set-up of meshes: what a bake does before its first node, with the defaults of `sdftool bake`.
pub fn set_up(quick: bool, turns: &mut RoundRobin) -> Result<()> {
    let counts = if quick { [1_000, 10_000] } else { [100_000, 1_000_000] };
    for name in [POT, BOWL] {
        turns.measure(counts.map(|count| set_up_work(name, bodies::body(name, count))).into())?;
    }
    Ok(())
}

fn set_up_work(name: &str, body: Mesh) -> Work<'static> {
    let row = Row {
        group: "set-up",
        work: format!("set up {name}"),
        triangles: body.triangles.len(),
        threads: 1,
        units: body.triangles.len() as f64,
        unit: "triangles",
        ..Row::default()
    };
    let set_up = move || {
        let started = Instant::now();
        let mesh = TriangleMesh::new(&body.points, &body.triangles)?.without_inner_faces();
        let distance = black_box(MeshDistance::new(&mesh, None));
        // Before either is freed.
        let seconds = started.elapsed().as_secs_f64();
        drop(distance);
        Ok(RunResult::timed(seconds))
    };
    Work { size: row.units, row, run: Box::new(move || on_threads(1, &set_up)?) }
}

impl<'a> BakeJob<'a> {
    fn work(self, limits: Option<&'a MachineLimits>) -> Work<'a> {
        let row = Row {
            group: self.group,
            work: format!("bake {} {}", self.layout.name(), self.name),
            triangles: self.body.triangles.len(),
            resolution: self.resolution,
            threads: self.threads,
            unit: "nodes",
            ..Row::default()
        };
        let side = f64::from(self.resolution);
        // The tree takes about as long per triangle as the distances per node.
        let nodes = if self.layout == Layout::Dense { side.powi(3) } else { 40.0 * side * side };
        let size = (nodes + row.triangles as f64) / self.threads as f64;
        Work { row, size, run: Box::new(move || self.run(limits)) }
    }

    fn run(&self, limits: Option<&MachineLimits>) -> Result<RunResult> {
        let (baked, seconds) = timed(self.threads, || bake(self.body, self.resolution, self.layout))?;
        let nodes = baked?.grid().map_or(0, |grid| stored_node_count(grid)) as f64;
        Ok(RunResult {
            units: nodes,
            floor_seconds: limits.map(|limits| limits.bake_seconds(nodes) / self.threads as f64),
            ..RunResult::timed(seconds)
        })
    }
}
