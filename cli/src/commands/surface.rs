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
use crate::memory;
use crate::mesh_input::at;
use crate::report::Report;

/// For shapes in closed form, which have no cells of their own.
const DEFAULT_RES: u32 = 128;

pub fn run(args: &SurfaceArgs) -> Result<()> {
    let format = MeshFormat::of(&args.output)
        .with_context(|| format!("{}: take a name that ends in .obj, .ply or .stl", args.output.display()))?;
    let surface = match field_file::read(&args.sdf)? {
        Field::Grid { grid, .. } => {
            let own = *grid.lattice();
            let lattice = args.res.map_or(Ok(own), |res| lattice(args, &own.bounds(), res))?;
            extract(args, &grid, &lattice)
        }
        Field::Analytic(node) => {
            let bounds = node.bounds(args.level);
            if !bounds.extents().iter().all(|extent| extent.is_finite()) {
                bail!("{}: the field has no end: intersect it with a box", args.sdf.display());
            }
            extract(args, &node, &lattice(args, &bounds, args.res.unwrap_or(DEFAULT_RES))?)
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
    let bytes = nodes.iter().product::<f64>() * size_of::<f32>() as f64;
    memory::require(bytes, &format!("--res {res}"), "take a smaller --res")?;
    lattice_around(bounds, spacing, 2).with_context(|| format!("{}: the box is no grid", args.sdf.display()))
}

struct Surface {
    points: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

/// Naive surface nets over the lattice's samples.
fn extract<F: Sdf>(args: &SurfaceArgs, field: &F, lattice: &Lattice) -> Surface {
    let nodes = lattice.nodes();
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
    Surface {
        points: buffer.positions.iter().map(in_space).collect(),
        triangles: buffer.indices.as_chunks::<3>().0.to_vec(),
    }
}
