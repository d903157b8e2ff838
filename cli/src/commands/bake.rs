use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, anyhow, bail};
use clap::ValueEnum;
use sdf_bake::error_budget::{self, AnyGrid, Budget, ErrorBudgetError};
use sdf_bake::sparse::{self, Quantize};
use sdf_bake::{MeshDistance, MeshReport, SignMethod, SparseGrid, TriangleMesh, dense, lattice_around};
use sdf_core::Aabb;
use sdf_core::grid::Lattice;
use sdf_core::grid::sparse::BRICK_SAMPLES;
use sdf_formats::grid_file::{self, About, Source};
use serde_json::json;

use crate::args::{BakeArgs, Layout, Precision, Sign, Tolerance};
use crate::baked_grid::BakedGrid;
use crate::mesh_input::{self, MeshFacts, MeshInput, at};
use crate::report::{Report, counts, many, number, seconds};
use crate::{memory, output, progress};

pub fn run(args: &BakeArgs) -> Result<()> {
    let output = args.output.clone().unwrap_or_else(|| default_output(&args.mesh));
    output::require(&output, &[&args.mesh])?;
    progress::on_threads(args.threads, || bake_into(args, &output))?
}

fn bake_into(args: &BakeArgs, output: &Path) -> Result<()> {
    let started = Instant::now();
    let input = mesh_input::read(&args.mesh)?;
    let read = started.elapsed().as_secs_f64();
    let baked = bake(args, input)?;
    let bake = started.elapsed().as_secs_f64() - read;
    let about = about(args, &baked);
    baked.grid.write(output, &baked.lattice, baked.band, &about)?;
    let write = started.elapsed().as_secs_f64() - read - bake;
    let file = std::fs::metadata(output).map(|file| file.len()).unwrap_or(0);

    let mesh = baked.mesh_report;
    let [stored_nodes, stored_cells] = baked.grid.stored(&baked.lattice);
    let median = baked.grid.median_error();
    // See `error_bound` of the baker: where the sign changes away from triangles, it may do so within a cell.
    let certainty = if baked.is_continuous { "by proof" } else { "but where the sign changes unseen within a cell" };
    let least_half = median.map_or(String::new(), |median| format!(", {} in half of the bricks", number(median)));
    let mut rows = vec![
        ("mesh", mesh_row(&baked.input, &mesh)),
        ("sign", about.sign_reason.clone()),
        ("grid", format!("{} nodes, spacing {}", counts(baked.lattice.nodes()), number(baked.lattice.spacing()))),
    ];
    if let Some(picked) = &baked.picked {
        rows.push(("picked", picked.clone()));
    }
    if let Some(bricks) = baked.grid.bricks() {
        let band = number(baked.band);
        rows.push(("bricks", format!("{bricks} in {}, with distances within {band}", baked.grid.precision())));
    }
    rows.extend([
        ("error", format!("at most {}{least_half}, {certainty}", number(about.error_bound))),
        ("time", format!("{} to read, {} to bake, {} to write", seconds(read), seconds(bake), seconds(write))),
        ("file", format!("{}, {file} bytes", output.display())),
    ]);
    Report {
        rows,
        json: json!({
            "schema": "sdftool.bake/1",
            "output": output.display().to_string(),
            "triangles": baked.input.triangles,
            "objects": baked.input.objects,
            "polygons": baked.input.polygon_counts.total,
            "polygons_cut_blindly": baked.input.polygon_counts.unverified,
            "degenerate_triangles": mesh.degenerate_triangles,
            "repeated_triangles": mesh.repeated_triangles,
            "unreferenced_points": mesh.unreferenced_points,
            "welded_points": mesh.welded_points,
            "boundary_edges": baked.topology.boundary_edges,
            "non_manifold_edges": baked.topology.non_manifold_edges,
            "wrongly_wound": baked.topology.wrongly_wound,
            "shells": baked.topology.shells,
            "intersecting_pairs": baked.topology.intersecting_pairs,
            "sign_method": about.sign_method,
            "sign_verdict": about.sign_reason,
            "layout": baked.grid.layout(),
            "precision": baked.grid.precision(),
            "nodes": baked.lattice.node_count(),
            "counts": baked.lattice.nodes(),
            "origin": baked.lattice.origin(),
            "spacing": baked.lattice.spacing(),
            "padding": about.padding,
            "band": baked.grid.bricks().map(|_| baked.band),
            "bricks": baked.grid.bricks(),
            "stored_nodes": stored_nodes,
            "stored_cells": stored_cells,
            "slope_bound": about.slope_bound,
            "error_bound": about.error_bound,
            "median_error_bound": median,
            "file_bytes": file,
            "peak_memory_bytes": memory::peak(),
            "seconds": {"read": read, "bake": bake, "write": write},
        }),
    }
    .print(args.json)
}

/// What came of a bake.
pub struct Baked {
    pub input: MeshFacts,
    pub lattice: Lattice,
    pub grid: BakedGrid,
    /// Of a sparse grid.
    pub band: f64,
    /// What --max-error came to.
    pub picked: Option<String>,
    pub method: SignMethod,
    pub verdict: String,
    pub topology: sdf_bake::Topology,
    /// The error bound is proven.
    pub is_continuous: bool,
    pub mesh_report: MeshReport,
    mesh_bounds: Aabb,
}

/// The mesh as it was read makes room for the grid.
pub fn bake(args: &BakeArgs, input: MeshInput) -> Result<Baked> {
    let MeshInput { mesh, facts: input } = input;
    mesh.require_triangles(&args.mesh.display().to_string())?;
    let checked = at(&args.mesh, TriangleMesh::new(&mesh.points, &mesh.triangles))?;
    drop(mesh);
    let mesh = checked;
    let distance = MeshDistance::new(&mesh, method(args.sign));
    let (lattice, grid) = match args.max_error {
        Some(tolerance) => within(args, tolerance, &mesh, &distance)?,
        None => {
            let lattice = lattice(args, &mesh.bounds())?;
            let grid = of_lattice(args, &distance, &lattice)?;
            (lattice, grid)
        }
    };
    Ok(Baked {
        input,
        lattice,
        grid,
        band: f64::from(args.band()) * lattice.spacing(),
        picked: args.max_error.map(|_| picked(args, &lattice)),
        method: distance.sign_method(),
        verdict: distance.verdict().to_owned(),
        topology: *distance.topology(),
        is_continuous: distance.is_continuous(),
        mesh_report: mesh.report(),
        mesh_bounds: mesh.bounds(),
    })
}

fn of_lattice(args: &BakeArgs, distance: &MeshDistance, lattice: &Lattice) -> Result<BakedGrid> {
    Ok(match (args.layout(), args.precision.unwrap_or(Precision::U16)) {
        (Layout::Dense, _) => {
            let bar = progress::bar("baking", lattice.node_count() as u64);
            let grid = dense::bake(distance, lattice, &|nodes| bar.inc(nodes as u64));
            bar.finish_and_clear();
            BakedGrid::Dense(grid)
        }
        (Layout::Sparse, Precision::F32) => BakedGrid::F32(bake_sparse(args, distance, lattice)?),
        (Layout::Sparse, Precision::U16) => BakedGrid::U16(bake_sparse(args, distance, lattice)?),
        (Layout::Sparse, Precision::U8) => BakedGrid::U8(bake_sparse(args, distance, lattice)?),
    })
}

/// The grid of the largest voxels whose certified error is within the tolerance.
fn within(
    args: &BakeArgs,
    tolerance: Tolerance,
    mesh: &TriangleMesh,
    distance: &MeshDistance,
) -> Result<(Lattice, BakedGrid)> {
    let (asked, max_error) = match tolerance {
        Tolerance::Length(length) => (format!("--max-error {length}"), length),
        Tolerance::Share(share) => (format!("--max-error {}%", share * 100.0), share * mesh.bounds().diagonal()),
    };
    let most_bytes = memory::available().unwrap_or(memory::ASSUMED) as usize;
    let budget = Budget { max_error, band: f64::from(args.band()), padding: args.padding, most_bytes };
    let bar = progress::bar("baking", 0);
    let baked = budget.bake(distance, &|places| {
        // How many there are is known only when a size has been picked.
        bar.inc_length(places as u64);
        bar.inc(places as u64);
    });
    bar.finish_and_clear();
    let refused = |refusal: ErrorBudgetError| match refusal {
        ErrorBudgetError::SignJumps { .. } => "take --res or --voxel-size, or close the mesh",
        ErrorBudgetError::NoLength(_) | ErrorBudgetError::TooLarge { .. } => "take a larger --max-error",
    };
    let shown = args.mesh.display();
    let error_budget::Baked { lattice, grid } =
        baked.map_err(|refusal| anyhow!("{shown}: {asked}: {refusal}: {}", refused(refusal.clone())))?;
    Ok(match grid {
        AnyGrid::U16(grid) => (lattice, BakedGrid::U16(grid)),
        AnyGrid::U8(grid) => (lattice, BakedGrid::U8(grid)),
    })
}

fn picked(args: &BakeArgs, lattice: &Lattice) -> String {
    format!("a voxel of {}, a band of {} voxels", number(lattice.spacing()), args.band())
}

fn bake_sparse<C: Quantize>(args: &BakeArgs, distance: &MeshDistance, lattice: &Lattice) -> Result<SparseGrid<C>> {
    let plan = sparse::Plan::new(distance, lattice, f64::from(args.band()) * lattice.spacing());
    let what = format!("{}: {} bricks", args.mesh.display(), plan.most_bricks());
    let smaller = "take a smaller --res, a larger --voxel-size, a smaller --band or --precision u8";
    memory::require(plan.most_bytes::<C>() as f64, &what, smaller)?;
    let bar = progress::bar("baking", plan.places() as u64);
    let grid = plan.bake(&|places| bar.inc(places as u64));
    bar.finish_and_clear();
    Ok(grid)
}

fn lattice(args: &BakeArgs, bounds: &Aabb) -> Result<Lattice> {
    let (spacing, asked, smaller) = match (args.res, args.voxel_size) {
        (Some(res), _) => (bounds.longest_side() / f64::from(res), format!("--res {res}"), "take a smaller --res"),
        (None, Some(size)) => (size, format!("--voxel-size {size:?}"), "take a larger --voxel-size"),
        (None, None) => bail!("--res or --voxel-size is needed"),
    };
    let side = bounds.longest_side();
    if spacing > MAX_SIDES * side {
        bail!("{asked}: the whole mesh is {} long: take a smaller --voxel-size", number(side));
    }
    let padding = 2.0 * f64::from(args.padding);
    let nodes = bounds.extents().map(|extent| (extent / spacing).ceil() + padding + 1.0);
    let (smaller, asked) = if padding > side / spacing {
        ("take a smaller --padding", format!("{asked} --padding {}", args.padding))
    } else {
        (smaller, asked)
    };
    let what = format!("{asked}: a grid of {} nodes", nodes.map(many).join(" × "));
    // A sparse grid has a number of each place of 8 × 8 × 8 nodes, and while it is baked what is known of its middle.
    let bytes_a_node = match args.layout() {
        Layout::Dense => size_of::<f32>() as f64 + size_of::<&mut [f32]>() as f64 / nodes[0],
        Layout::Sparse => 72.0 / BRICK_SAMPLES as f64,
    };
    let smaller =
        if args.layout() == Layout::Dense { format!("{smaller}, or --layout sparse") } else { smaller.to_owned() };
    let bytes_of_signs = match (args.layout(), args.sign) {
        (Layout::Sparse, _) | (_, Sign::PseudoNormal) => 0.0,
        _ => rayon::current_num_threads() as f64 * dense::SIGN_BYTES as f64 * nodes[0],
    };
    memory::require(nodes.iter().product::<f64>() * bytes_a_node + bytes_of_signs, &what, &smaller)?;
    lattice_around(bounds, spacing, args.padding).with_context(|| format!("{what} is no grid: {smaller}"))
}

/// A cell's side in those of the mesh's box, at most. One says nothing of the mesh already; from 1e16 on, its nodes are
/// so far away that all of the mesh is one point.
const MAX_SIDES: f64 = 1e3;

fn method(sign: Sign) -> Option<SignMethod> {
    match sign {
        Sign::Auto => None,
        Sign::PseudoNormal => Some(SignMethod::PseudoNormal),
        Sign::Winding => Some(SignMethod::Winding),
    }
}

pub fn about(args: &BakeArgs, baked: &Baked) -> About {
    let input = &baked.input;
    let bounds = baked.lattice.bounds();
    let inside = |axis: usize| {
        let mesh = &baked.mesh_bounds;
        (mesh.min[axis] - bounds.min[axis]).min(bounds.max[axis] - mesh.max[axis])
    };
    About {
        sign_method: match baked.method {
            SignMethod::PseudoNormal => grid_file::SignMethod::PseudoNormal,
            SignMethod::Winding => grid_file::SignMethod::Winding,
        },
        sign_reason: baked.verdict.clone(),
        slope_bound: baked.grid.slope_bound(),
        error_bound: baked.grid.error_bound(),
        padding: (0..3).map(inside).fold(f64::INFINITY, f64::min).max(0.0),
        source: Source { name: input.name.clone(), sha256: input.sha256, triangles: input.triangles as u64 },
        tool: concat!("sdftool ", env!("CARGO_PKG_VERSION")).to_owned(),
        options: options(args),
    }
}

/// Those that shape the result.
fn options(args: &BakeArgs) -> String {
    let size = match (args.res, args.voxel_size, args.max_error) {
        (Some(res), ..) => format!("--res {res}"),
        (None, Some(size), _) => format!("--voxel-size {size}"),
        (None, None, Some(Tolerance::Share(share))) => format!("--max-error {}%", share * 100.0),
        (None, None, Some(Tolerance::Length(length))) => format!("--max-error {length}"),
        (None, None, None) => String::new(),
    };
    let sign = word(args.sign);
    let sparse = match (args.layout(), args.precision) {
        (Layout::Dense, _) => String::new(),
        (Layout::Sparse, None) => format!(" --layout sparse --band {}", args.band()),
        (Layout::Sparse, Some(precision)) => {
            format!(" --layout sparse --band {} --precision {}", args.band(), word(precision))
        }
    };
    format!("{size} --padding {} --sign {sign}{sparse}", args.padding)
}

/// The word that stands for it on the command line.
fn word(value: impl ValueEnum) -> String {
    value.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
}

/// The mesh's stem with .sdf.h5, in the current folder.
fn default_output(mesh: &Path) -> PathBuf {
    let mut name = mesh.file_stem().unwrap_or_default().to_owned();
    name.push(".sdf.h5");
    name.into()
}

fn mesh_row(mesh: &MeshFacts, found: &MeshReport) -> String {
    let mut row = format!("{} points, {} triangles", mesh.points, mesh.triangles);
    let objects = if mesh.objects > 1 { mesh.objects } else { 0 };
    let rest = [
        (objects, "object", "objects"),
        (found.welded_points, "point at the place of another", "points at the place of another"),
        (found.unreferenced_points, "point unused", "points unused"),
        (found.degenerate_triangles, "triangle without area", "triangles without area"),
        (found.repeated_triangles, "triangle repeated", "triangles repeated"),
        (mesh.polygon_counts.unverified, "polygon cut blindly", "polygons cut blindly"),
    ];
    for (count, one, several) in rest.into_iter().filter(|(count, ..)| *count > 0) {
        row.push_str(&format!(", {count} {}", if count == 1 { one } else { several }));
    }
    row
}
