//! The level set of a field as a mesh, by naive surface nets (Gibson 1998), block by block on all threads.

use std::collections::HashMap;

use anyhow::{Context, Result, bail};
use fast_surface_nets::{SurfaceNetsBuffer, surface_nets};
use ndshape::{RuntimeShape, Shape};
use rayon::prelude::*;
use sdf_bake::lattice_around;
use sdf_core::grid::Lattice;
use sdf_core::nalgebra::Vector3;
use sdf_core::{Aabb, EnclosedSdf, Sdf};
use sdf_formats::field_file::Field;
use sdf_formats::grid_file::StoredGrid;
use sdf_formats::mesh::{self, MeshFormat};
use serde_json::json;

use crate::args::SurfaceArgs;
use crate::mesh_input::at;
use crate::report::{Report, number};
use crate::{field_input, memory, output};

/// Default of --res for shapes in closed form, which have no cells of their own.
const DEFAULT_RES: u32 = 128;

pub fn run(args: &SurfaceArgs) -> Result<()> {
    let format =
        MeshFormat::from_extension(&args.output).context("--output: use a name that ends in .obj, .ply or .stl")?;
    output::require(&args.output, &[&args.sdf])?;
    let surface = match field_input::read(&args.sdf)? {
        Field::Grid(StoredGrid { grid, sparse, .. }) => {
            if let Some(band) = sparse.map(|sparse| sparse.band).filter(|band| args.level.abs() > *band) {
                bail!(
                    "{}: --level {} lies beyond the band of {} in which the grid has distances: bake with a larger --band",
                    args.sdf.display(),
                    number(args.level),
                    number(band)
                );
            }
            let own = *grid.lattice();
            let lattice = match args.res {
                Some(res) => lattice(args, &own.bounds(), res)?,
                None => own,
            };
            extract(args, &grid, &lattice)
        }
        Field::Analytic(node) => {
            let bounds = node.bounds(args.level);
            if !bounds.extents().iter().all(|extent| extent.is_finite()) {
                bail!("{}: the field is unbounded: intersect it with a box", args.sdf.display());
            }
            extract(args, &node, &lattice(args, &bounds, args.res.unwrap_or(DEFAULT_RES))?)
        }
    };
    if surface.triangles.is_empty() {
        bail!(
            "{}: the surface is empty: the distance is nowhere {}, use another --level",
            args.sdf.display(),
            number(args.level)
        );
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

/// The lattice to sample on, padded by two cells, so that the surface closes.
fn lattice(args: &SurfaceArgs, bounds: &Aabb, res: u32) -> Result<Lattice> {
    let spacing = bounds.longest_side() / f64::from(res);
    let [x, y, z] = bounds.extents().map(|extent| extent / spacing);
    let cells = 2.0 * (x * y + y * z + z * x);
    memory::require(
        cells * BYTES_OF_CELL,
        &format!("--res {res}: a surface of about {cells:.0} cells"),
        "use a smaller --res",
    )?;
    lattice_around(bounds, spacing, 2)
        .with_context(|| format!("{}: its box cannot be cut into cells: use another --res", args.sdf.display()))
}

struct Surface {
    points: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

/// Estimated memory per surface cell: a point and two triangles, and twice that while pieces are joined. The number of
/// surface cells is estimated by that of the cells on the faces of the box.
const BYTES_OF_CELL: f64 = 200.0;

/// Cells along the side of a block. Smaller blocks sample more nodes twice; larger ones sample more nodes far from the surface.
const BLOCK: u32 = 16;

/// Naive surface nets over the lattice. Only the samples of the current blocks are in memory. A block whose enclosure
/// excludes the level is not sampled.
fn extract<F: EnclosedSdf + Sync>(args: &SurfaceArgs, field: &F, lattice: &Lattice) -> Surface {
    let counts = lattice.cells().map(|cells| cells.div_ceil(BLOCK) as usize);
    let [along_x, along_y, along_z] = counts;
    let pieces: Vec<Piece> = (0..along_x * along_y * along_z)
        .into_par_iter()
        .filter_map(|index| {
            let block = [index % along_x, index / along_x % along_y, index / along_x / along_y];
            Piece::extract(field, args.level, lattice, block.map(|n| n as u32 * BLOCK))
        })
        .collect();
    let mut surface = Surface { points: vec![], triangles: vec![] };
    // Each cell has one point at most; blocks share cells at their borders.
    let mut point_of_cell = HashMap::new();
    for piece in pieces {
        let numbers: Vec<u32> = std::iter::zip(piece.cells, piece.points)
            .map(|(cell, point)| {
                *point_of_cell.entry(cell).or_insert_with(|| {
                    surface.points.push(point);
                    surface.points.len() as u32 - 1
                })
            })
            .collect();
        surface.triangles.extend(piece.triangles.iter().map(|corners| corners.map(|corner| numbers[corner as usize])));
    }
    surface
}

/// The surface in a block of cells and in the layer of cells before it, which shares edges with the block.
struct Piece {
    /// Cell of each point.
    cells: Vec<[u32; 3]>,
    points: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Piece {
    fn extract<F: EnclosedSdf>(field: &F, level: f64, lattice: &Lattice, block: [u32; 3]) -> Option<Self> {
        let first = block.map(|n| n.saturating_sub(1));
        let last: [u32; 3] = std::array::from_fn(|axis| (block[axis] + BLOCK).min(lattice.cells()[axis]));
        if !may_contain_level(field, level, &Aabb { min: lattice.node(first), max: lattice.node(last) }) {
            return None;
        }
        let nodes: [u32; 3] = std::array::from_fn(|axis| last[axis] - first[axis] + 1);
        let shape = RuntimeShape::<u32, 3>::new(nodes);
        let sample = |index: u32| {
            let offset = shape.delinearize(index);
            let node = std::array::from_fn(|axis| first[axis] + offset[axis]);
            let value: f64 = field.value(Vector3::from(lattice.node(node)));
            (value - level) as f32
        };
        let samples: Vec<f32> = (0..shape.size()).map(sample).collect();
        let mut net = SurfaceNetsBuffer::default();
        surface_nets(&samples, &shape, [0; 3], nodes.map(|n| n - 1), &mut net);
        let position = |steps: &[f32; 3]| {
            let from = lattice.node(first);
            std::array::from_fn(|axis| from[axis] + lattice.spacing() * f64::from(steps[axis]))
        };
        Some(Self {
            cells: net.surface_points.iter().map(|cell| std::array::from_fn(|axis| first[axis] + cell[axis])).collect(),
            points: net.positions.iter().map(position).collect(),
            triangles: net.indices.as_chunks::<3>().0.to_vec(),
        })
    }
}

/// May φ = level somewhere in the box? By the enclosure, and by |φ(x) − φ(m)| ≤ slope bound · half the diagonal.
fn may_contain_level<F: EnclosedSdf>(field: &F, level: f64, region: &Aabb) -> bool {
    let enclosure = field.enclose_box(region);
    let center = std::array::from_fn(|axis| 0.5 * (region.min[axis] + region.max[axis]));
    let value: f64 = field.value(Vector3::from(center));
    let radius = 0.5 * region.diagonal() * enclosure.slope_bound;
    let rounding = ROUNDING * (radius + level.abs());
    enclosure.range.lower.max(value - radius) - rounding <= level
        && level <= enclosure.range.upper.min(value + radius) + rounding
}

/// Relative rounding of samples and bounds: above that of f32, far below a cell.
const ROUNDING: f64 = 1e-6;
