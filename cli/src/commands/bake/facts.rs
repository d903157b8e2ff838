//! The report of a bake, on a grid in memory or in its file: rows for a person, a document for a program.

use std::path::Path;

use anyhow::{Result, bail};
use sdf_core::grid::Lattice;
use sdf_core::grid::owned::{Blocks, Layout, Precision};
use sdf_core::grid::sparse::{BRICK, brick_counts};
use sdf_field::{Baked, BakedFile, ErrorRegions, GridInfo, MeshReport, Topology};
use serde_json::json;

use crate::args::BakeArgs;
use crate::error_regions;
use crate::mesh_input::MeshFacts;
use crate::report::{counted, counts, number, seconds};

/// Facts that a bake found out.
pub struct GridFacts<'a> {
    pub lattice: Lattice,
    pub info: &'a GridInfo,
    pub precision: Precision,
    /// Slot of each brick; `None` of a dense grid.
    pub slots: Option<&'a [[u32; 3]]>,
    /// Error bound of each brick.
    errors: &'a [f32],
    slope_bound: f64,
    mesh: &'a MeshReport,
    topology: &'a Topology,
    is_sign_continuous: bool,
    thin_voxel: Option<f64>,
    /// Regions of the error of an open mesh.
    regions: Option<&'a ErrorRegions>,
}

impl<'a> GridFacts<'a> {
    pub fn of_baked(baked: &'a Baked) -> Result<Self> {
        let (Some(grid), Some(info)) = (baked.field.grid(), baked.field.info()) else {
            bail!("a bake made no grid: please report this");
        };
        let storage = grid.storage();
        Ok(Self {
            lattice: *grid.lattice(),
            info,
            precision: storage.precision(),
            slots: storage.brick_count().map(|_| storage.slots()),
            errors: storage.brick_errors(),
            slope_bound: baked.field.slope_bound(),
            mesh: &baked.mesh,
            topology: &baked.topology,
            is_sign_continuous: baked.is_sign_continuous,
            thin_voxel: baked.thin_voxel(),
            regions: baked.regions.as_ref(),
        })
    }

    pub fn of_file(BakedFile { grid, mesh, topology, .. }: &'a BakedFile) -> Self {
        Self {
            lattice: grid.lattice,
            info: &grid.info,
            precision: grid.precision,
            slots: Some(&grid.slots),
            errors: &grid.errors,
            slope_bound: grid.slope_bound,
            mesh,
            topology,
            is_sign_continuous: grid.is_sign_continuous,
            thin_voxel: grid.thin_voxel(),
            regions: grid.info.error_regions.as_ref(),
        }
    }

    fn warning(&self) -> Option<String> {
        warning(self.thin_voxel)
    }

    fn layout(&self) -> Layout {
        if self.slots.is_some() { Layout::Sparse } else { Layout::Dense }
    }
}

/// Says of a closed mesh that its solid has no node inside.
pub fn warning(thin_voxel: Option<f64>) -> Option<String> {
    let voxel = number(thin_voxel?);
    Some(format!("no node is inside the solid: it is thinner than a voxel of {voxel}: bake with smaller voxels"))
}

type Rows = Vec<(&'static str, String)>;

pub fn rows(args: &BakeArgs, facts: &GridFacts, input: &MeshFacts, times: [f64; 3], file: &str) -> Rows {
    let GridFacts { lattice, info, .. } = facts;
    let median =
        median_error(facts.errors).map_or(String::new(), |error| format!(", {} in half of the bricks", number(error)));
    let [read, bake, write] = times.map(seconds);
    let mut rows = vec![
        ("mesh", mesh_row(args, input, facts.mesh)),
        ("sign", info.sign_reason.clone()),
        ("grid", format!("{} nodes, spacing {}", counts(lattice.nodes()), number(lattice.spacing()))),
    ];
    if args.max_error.is_some() {
        rows.push(("picked", format!("a voxel of {}, a band of {} voxels", number(lattice.spacing()), args.band())));
    }
    if let (Some(slots), Some(band)) = (facts.slots, info.band) {
        let (bricks, precision) = (slots.len(), facts.precision.name());
        rows.push(("bricks", format!("{bricks} in {precision}, with distances within {}", number(band))));
    } else if facts.precision != Precision::F32 {
        rows.push(("samples", format!("{}, with a scale for each block of 8 × 8 × 8", facts.precision.name())));
    }
    rows.push(("error", error_regions::bound_row(info.error_bound, &median, facts.is_sign_continuous)));
    rows.extend(facts.warning().map(|warning| ("warning", warning)));
    rows.extend(facts.regions.map(|regions| ("regions", error_regions::row(regions))));
    rows.extend([("time", format!("{read} to read, {bake} to bake, {write} to write")), ("file", file.to_owned())]);
    rows
}

pub fn document(
    facts: &GridFacts,
    input: &MeshFacts,
    [read, bake, write]: [f64; 3],
    output: &Path,
    file: u64,
) -> serde_json::Value {
    let GridFacts { lattice, info, mesh, topology, .. } = facts;
    let [stored_nodes, stored_cells] = stored(facts);
    json!({
        "schema": "sdftool.bake/1",
        "output": output.display().to_string(),
        "triangles": input.triangles,
        "objects": input.objects,
        "polygons": input.polygon_counts.total,
        "polygons_cut_blindly": input.polygon_counts.unverified,
        "degenerate_triangles": mesh.degenerate_triangles,
        "repeated_triangles": mesh.repeated_triangles,
        "inner_shells": mesh.inner_shells,
        "inner_triangles": mesh.inner_triangles,
        "entangled_shells": mesh.entangled_shells,
        "crossing_triangles": mesh.crossing_triangles,
        "kept_pieces": mesh.kept_pieces,
        "dropped_pieces": mesh.dropped_pieces,
        "uncertain_pieces": mesh.uncertain_pieces,
        "merged_points": mesh.merged_points,
        "capped_loops": mesh.capped_loops,
        "cap_triangles": mesh.cap_triangles,
        "open_loops": mesh.open_loops,
        "unreferenced_points": mesh.unreferenced_points,
        "welded_points": mesh.welded_points,
        "boundary_edges": topology.boundary_edges,
        "non_manifold_edges": topology.non_manifold_edges,
        "wrongly_wound": topology.wrongly_wound,
        "shells": topology.shells,
        "intersecting_pairs": topology.intersecting_pairs,
        "sign_method": info.sign_method.name(),
        "sign_verdict": info.sign_reason,
        "layout": facts.layout().name(),
        "precision": facts.precision.name(),
        "nodes": lattice.node_count(),
        "counts": lattice.nodes(),
        "origin": lattice.origin(),
        "spacing": lattice.spacing(),
        "padding": info.padding,
        "band": info.band,
        "bricks": facts.slots.map(<[_]>::len),
        "stored_nodes": stored_nodes,
        "stored_cells": stored_cells,
        "slope_bound": facts.slope_bound,
        "error_bound": info.error_bound,
        "median_error_bound": median_error(facts.errors),
        "error_regions": facts.regions.map(error_regions::document),
        "warning": facts.warning(),
        "file_bytes": file,
        "peak_memory_bytes": sdf_field::memory::peak_bytes(),
        "seconds": {"read": read, "bake": bake, "write": write},
    })
}

/// Median of the bricks' error bounds; `None` for a dense grid.
fn median_error(errors: &[f32]) -> Option<f64> {
    let mut errors = errors.to_vec();
    let middle = errors.len() / 2;
    (!errors.is_empty()).then(|| f64::from(*errors.select_nth_unstable_by(middle, f32::total_cmp).1))
}

/// Nodes that have a sample, and cells with all corners among them.
fn stored(facts: &GridFacts) -> [usize; 2] {
    let lattice = &facts.lattice;
    match facts.slots {
        None => [lattice.node_count(), lattice.cells().iter().fold(1, |count: usize, n| count * *n as usize)],
        Some(slots) => stored_in_bricks(lattice, slots),
    }
}

/// Counts for each brick the cells whose first corner it has. Their other corners are in the same brick or in the next ones.
fn stored_in_bricks(lattice: &Lattice, slots: &[[u32; 3]]) -> [usize; 2] {
    let nodes = lattice.nodes();
    let counts = brick_counts(lattice);
    let mut with_brick = Blocks::new(counts, false).expect("a grid's slots can be numbered");
    slots.iter().for_each(|slot| with_brick.set(*slot, true));
    let mut stored = [0, 0];
    for slot in slots {
        let sides: [u32; 3] = std::array::from_fn(|axis| (nodes[axis] - slot[axis] * BRICK).min(BRICK));
        stored[0] += sides.iter().map(|n| *n as usize).product::<usize>();
        for next in 0..8_u32 {
            let step: [u32; 3] = std::array::from_fn(|axis| next >> axis & 1);
            // Corners of these cells are in all bricks on the way.
            let has_brick = |on_way: u32| {
                let slot: [u32; 3] = std::array::from_fn(|axis| slot[axis] + (on_way >> axis & 1));
                (0..3).all(|axis| slot[axis] < counts[axis]) && with_brick.get(slot) == Some(true)
            };
            if (0..8).filter(|on_way| on_way & next == *on_way).all(has_brick) {
                // Along axes with a step: one layer of cells, which need the next brick; along the others all but that layer.
                let cells = |axis: usize| if step[axis] == 1 { 1 } else { sides[axis] as usize - 1 };
                stored[1] += cells(0) * cells(1) * cells(2);
            }
        }
    }
    stored
}

/// Counts of the mesh and of its repairs. A repair that was asked for and found nothing to do is named too.
pub fn mesh_row(args: &BakeArgs, mesh: &MeshFacts, report: &MeshReport) -> String {
    let mut row = format!("{}, {}", counted(mesh.points, "point"), counted(mesh.triangles, "triangle"));
    let objects = if mesh.objects > 1 { mesh.objects } else { 0 };
    let rest = [
        (objects, "object", "objects"),
        (report.welded_points, "duplicate point", "duplicate points"),
        (report.merged_points, "point welded", "points welded"),
        (report.cap_triangles, "triangle added by caps", "triangles added by caps"),
        (report.unreferenced_points, "unused point", "unused points"),
        (report.degenerate_triangles, "triangle without area dropped", "triangles without area dropped"),
        (report.repeated_triangles, "repeated triangle", "repeated triangles"),
        (report.inner_triangles, "triangle inside of the solid dropped", "triangles inside of the solid dropped"),
        (report.crossing_triangles, "triangle cut where others meet it", "triangles cut where others meet them"),
        (mesh.polygon_counts.unverified, "polygon cut unverified", "polygons cut unverified"),
    ];
    for (count, one, several) in rest.into_iter().filter(|(count, ..)| *count > 0) {
        row.push_str(&format!(", {count} {}", if count == 1 { one } else { several }));
    }
    let in_vain = [
        (args.weld.is_some() && report.merged_points == 0, ", no points to weld within --weld"),
        (args.close.is_some() && report.cap_triangles == 0, ", no loop to cap within --close"),
    ];
    in_vain.into_iter().filter(|(is_in_vain, _)| *is_in_vain).for_each(|(_, words)| row.push_str(words));
    row
}
