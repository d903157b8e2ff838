use anyhow::{Context, Result, bail};
use fast_surface_nets::{SurfaceNetsBuffer, surface_nets};
use ndshape::{RuntimeShape, Shape};
use sdf_bake::lattice_around;
use sdf_core::grid::Lattice;
use sdf_core::nalgebra::Vector3;
use sdf_core::{Aabb, Sdf};
use sdf_formats::field_file::{self, Field};
use sdf_formats::mesh::{self, MeshFormat};
use serde_json::json;

use crate::args::SurfaceArgs;
use crate::mesh_input::at;
use crate::report::Report;
use crate::{memory, output};

/// For shapes in closed form, which have no cells of their own.
const DEFAULT_RES: u32 = 128;

pub fn run(args: &SurfaceArgs) -> Result<()> {
    let format = MeshFormat::of(&args.output).context("--output has no ending that is known")?;
    output::require(&args.output, &[&args.sdf])?;
    let surface = match field_file::read(&args.sdf)? {
        Field::Grid { grid, .. } => {
            let own = *grid.lattice();
            let lattice = match args.res {
                Some(res) => lattice(args, &own.bounds(), res)?,
                None => own,
            };
            extract(args, &grid, &lattice)?
        }
        Field::Analytic(node) => {
            let bounds = node.bounds(args.level);
            if !bounds.extents().iter().all(|extent| extent.is_finite()) {
                bail!("{}: the field has no end: intersect it with a box", args.sdf.display());
            }
            extract(args, &node, &lattice(args, &bounds, args.res.unwrap_or(DEFAULT_RES))?)?
        }
    };
    if surface.triangles.is_empty() {
        bail!("{}: the distance is nowhere {}", args.sdf.display(), args.level);
    }
    at(&args.output, mesh::write(&args.output, format, &surface.points, &surface.triangles))?;
    let [points, triangles] = [surface.points.len(), surface.triangles.len()];
    Report {
        rows: vec![
            ("surface", format!("{points} points, {triangles} triangles")),
            ("file", args.output.display().to_string()),
        ],
        json: json!({
            "schema": "sdftool.surface/1",
            "points": points,
            "triangles": triangles,
            "output": args.output.display().to_string(),
        }),
    }
    .print(args.json)
}

/// Two cells of padding, so that the surface closes.
fn lattice(args: &SurfaceArgs, bounds: &Aabb, res: u32) -> Result<Lattice> {
    let spacing = bounds.longest_side() / f64::from(res);
    let nodes = bounds.extents().map(|extent| (extent / spacing).ceil() + 5.0);
    require_memory(nodes.iter().product(), &format!("--res {res}"))?;
    lattice_around(bounds, spacing, 2).with_context(|| format!("{}: the box is no grid", args.sdf.display()))
}

/// For a sample of each node, and the number of the point near it.
fn require_memory(nodes: f64, what: &str) -> Result<()> {
    memory::require(nodes * (size_of::<f32>() + size_of::<u32>()) as f64, what, "take a smaller --res")
}

struct Surface {
    points: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

/// Naive surface nets over the lattice's samples.
fn extract<F: Sdf>(args: &SurfaceArgs, field: &F, lattice: &Lattice) -> Result<Surface> {
    let nodes = lattice.nodes();
    require_memory(lattice.node_count() as f64, "the grid's surface")?;
    // The crate counts nodes in u32.
    if lattice.node_count() >= u32::MAX as usize {
        bail!("{}: {} nodes are too many: take a --res of 1500 or less", args.sdf.display(), lattice.node_count());
    }
    let mut samples = Vec::with_capacity(lattice.node_count());
    for z in 0..nodes[2] {
        for y in 0..nodes[1] {
            samples.extend((0..nodes[0]).map(|x| {
                let value: f64 = field.value(Vector3::from(lattice.node([x, y, z])));
                (value - args.level) as f32
            }));
        }
    }
    let shape = RuntimeShape::<u32, 3>::new(nodes);
    debug_assert_eq!(shape.linearize([1, 0, 0]), 1);
    let mut buffer = SurfaceNetsBuffer::default();
    surface_nets(&samples, &shape, [0; 3], lattice.cells(), &mut buffer);
    let origin = lattice.origin();
    let in_space =
        |steps: &[f32; 3]| std::array::from_fn(|axis| origin[axis] + lattice.spacing() * f64::from(steps[axis]));
    Ok(Surface {
        points: buffer.positions.iter().map(in_space).collect(),
        triangles: buffer.indices.as_chunks::<3>().0.to_vec(),
    })
}
