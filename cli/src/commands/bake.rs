use std::path::{Path, PathBuf};
use std::time::Instant;

use anyhow::{Context, Result, bail};
use sdf_bake::{DenseGrid, MeshDistance, MeshReport, SignMethod, TriangleMesh, dense, lattice_around};
use sdf_core::Aabb;
use sdf_core::grid::Lattice;
use sdf_formats::grid_file::{self, About, Source};
use sdf_formats::mesh::Mesh;
use serde_json::json;

use crate::args::{BakeArgs, Sign};
use crate::mesh_input::{self, MeshInput, at};
use crate::report::{Report, counts, many, number, seconds};
use crate::{memory, output, progress};

pub fn run(args: &BakeArgs) -> Result<()> {
    let started = Instant::now();
    let output = args.output.clone().unwrap_or_else(|| default_output(&args.mesh));
    output::require(&output, &[&args.mesh])?;
    let input = mesh_input::read(&args.mesh)?;
    let read = started.elapsed().as_secs_f64();
    let baked = progress::on_threads(args.threads, || bake(args, &input))??;
    let bake = started.elapsed().as_secs_f64() - read;
    let about = about(args, &input, &baked);
    grid_file::write(&output, &baked.lattice, &baked.grid.distances, &about)?;
    let write = started.elapsed().as_secs_f64() - read - bake;
    let bytes = std::fs::metadata(&output).map(|file| file.len()).unwrap_or(0);

    let [nodes, file] = [baked.grid.distances.len() as u64, bytes];
    let mesh = baked.mesh_report;
    // See `error_bound` of the baker: where the sign changes away from triangles, it may do so within a cell.
    let certainty = if baked.is_continuous { "by proof" } else { "but where the sign changes unseen within a cell" };
    Report {
        rows: vec![
            ("mesh", mesh_row(&input.mesh, &mesh)),
            ("sign", about.sign_verdict.clone()),
            ("grid", format!("{} nodes, spacing {}", counts(baked.lattice.nodes()), number(baked.lattice.spacing()))),
            ("error", format!("at most {} between the nodes, {certainty}", number(about.error_bound))),
            ("time", format!("{} to read, {} to bake, {} to write", seconds(read), seconds(bake), seconds(write))),
            ("file", format!("{}, {file} bytes", output.display())),
        ],
        json: json!({
            "schema": "sdftool.bake/1",
            "output": output.display().to_string(),
            "triangles": input.mesh.triangles.len(),
            "objects": input.mesh.objects,
            "polygons": input.mesh.polygon_counts.all,
            "polygons_cut_blindly": input.mesh.polygon_counts.blind,
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
            "sign_verdict": about.sign_verdict,
            "nodes": nodes,
            "counts": baked.lattice.nodes(),
            "origin": baked.lattice.origin(),
            "spacing": baked.lattice.spacing(),
            "slope_bound": about.slope_bound,
            "error_bound": about.error_bound,
            "file_bytes": file,
            "seconds": {"read": read, "bake": bake, "write": write},
        }),
    }
    .print(args.json)
}

/// What came of a bake.
pub struct Baked {
    pub lattice: Lattice,
    pub grid: DenseGrid,
    pub method: SignMethod,
    pub verdict: String,
    pub topology: sdf_bake::Topology,
    /// The error bound is proven.
    pub is_continuous: bool,
    pub mesh_report: MeshReport,
}

pub fn bake(args: &BakeArgs, input: &MeshInput) -> Result<Baked> {
    input.mesh.require_triangles(&args.mesh.display().to_string())?;
    let mesh = at(&args.mesh, TriangleMesh::new(&input.mesh.points, &input.mesh.triangles))?;
    let lattice = lattice(args, &mesh.bounds())?;
    let distance = MeshDistance::new(&mesh, method(args.sign));
    let bar = progress::bar("baking", lattice.node_count() as u64);
    let grid = dense::bake(&distance, &lattice, &|nodes| bar.inc(nodes as u64));
    bar.finish_and_clear();
    Ok(Baked {
        lattice,
        grid,
        method: distance.sign_method(),
        verdict: distance.verdict().to_owned(),
        topology: *distance.topology(),
        is_continuous: distance.is_continuous(),
        mesh_report: mesh.report(),
    })
}

fn lattice(args: &BakeArgs, bounds: &Aabb) -> Result<Lattice> {
    let (spacing, asked, smaller) = match (args.res, args.voxel_size) {
        (Some(res), _) => (bounds.longest_side() / f64::from(res), format!("--res {res}"), "take a smaller --res"),
        (None, Some(size)) => (size, format!("--voxel-size {size:?}"), "take a larger --voxel-size"),
        (None, None) => bail!("--res or --voxel-size is needed"),
    };
    let side = bounds.longest_side();
    if spacing > MOST_SIDES * side {
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
    memory::require(nodes.iter().product::<f64>() * size_of::<f32>() as f64, &what, smaller)?;
    lattice_around(bounds, spacing, args.padding).with_context(|| format!("{what} is no grid: {smaller}"))
}

/// A cell's side in those of the mesh's box, at most. One says nothing of the mesh already; from 1e16 on, its nodes are
/// so far away that all of the mesh is one point.
const MOST_SIDES: f64 = 1e3;

fn method(sign: Sign) -> Option<SignMethod> {
    match sign {
        Sign::Auto => None,
        Sign::PseudoNormal => Some(SignMethod::PseudoNormal),
        Sign::Winding => Some(SignMethod::Winding),
    }
}

pub fn about(args: &BakeArgs, input: &MeshInput, baked: &Baked) -> About {
    let size = match (args.res, args.voxel_size) {
        (Some(res), _) => format!("--res {res}"),
        (None, size) => format!("--voxel-size {}", size.unwrap_or_default()),
    };
    let sign = match args.sign {
        Sign::Auto => "auto",
        Sign::PseudoNormal => "pseudo-normal",
        Sign::Winding => "winding",
    };
    About {
        sign_method: baked.method.to_string(),
        sign_verdict: baked.verdict.clone(),
        slope_bound: baked.grid.slope_bound,
        error_bound: baked.grid.error_bound,
        source: Source { name: input.name.clone(), sha256: input.sha256, triangles: input.mesh.triangles.len() as u64 },
        tool: concat!("sdftool ", env!("CARGO_PKG_VERSION")).to_owned(),
        options: format!("{size} --padding {} --sign {sign}", args.padding),
    }
}

/// The mesh's stem with .sdf.h5, in the current folder.
fn default_output(mesh: &Path) -> PathBuf {
    let mut name = mesh.file_stem().unwrap_or_default().to_owned();
    name.push(".sdf.h5");
    name.into()
}

fn mesh_row(mesh: &Mesh, found: &MeshReport) -> String {
    let mut row = format!("{} points, {} triangles", mesh.points.len(), mesh.triangles.len());
    let objects = if mesh.objects > 1 { mesh.objects } else { 0 };
    let rest = [
        (objects, "object", "objects"),
        (found.welded_points, "point at the place of another", "points at the place of another"),
        (found.unreferenced_points, "point unused", "points unused"),
        (found.degenerate_triangles, "triangle without area", "triangles without area"),
        (found.repeated_triangles, "triangle repeated", "triangles repeated"),
        (mesh.polygon_counts.blind, "polygon cut blindly", "polygons cut blindly"),
    ];
    for (count, one, several) in rest.into_iter().filter(|(count, ..)| *count > 0) {
        row.push_str(&format!(", {count} {}", if count == 1 { one } else { several }));
    }
    row
}
