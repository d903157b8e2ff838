//! Bakes in memory, with the defaults of `sdftool bake`.

use anyhow::{Context, Result, ensure};
use sdf_bake::sparse::{Plan, Quantize};
use sdf_bake::{DenseGrid, MeshDistance, SparseGrid, TriangleMesh, dense, lattice_around};
use sdf_core::grid::sparse::{BRICK, Sparse};
use sdf_core::grid::{Dense, Grid, Lattice, WithBlockBounds};
use sdf_formats::grid_file::{OwnedBricks, OwnedGrid, OwnedSamples};
use sdf_procedural::Mesh;
use serde::{Deserialize, Serialize};

use crate::machine;

/// Layout of a grid's samples.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Layout {
    /// All samples, as f32.
    Dense,
    /// Bricks near the surface, as u16, and a coarse grid.
    Sparse,
}

impl Layout {
    /// The word for it on the command line of `sdftool bake`.
    pub fn word(self) -> &'static str {
        match self {
            Self::Dense => "dense",
            Self::Sparse => "sparse",
        }
    }
}

/// Cells added on each side of the mesh's box.
const PADDING: u32 = 4;

/// Distance from the surface within which a sparse grid is exact, in cells.
const BAND: f64 = 3.0;

/// A grid as the baker returns it.
pub struct Baked {
    lattice: Lattice,
    samples: Samples,
}

enum Samples {
    Dense(DenseGrid),
    Sparse(SparseGrid<u16>),
}

/// Bakes with `resolution` cells along the longest side of the body's box.
pub fn bake(body: &Mesh, resolution: u32, layout: Layout) -> Result<Baked> {
    let mesh = TriangleMesh::new(&body.points, &body.triangles)?;
    let distance = MeshDistance::new(&mesh, None);
    let spacing = mesh.bounds().longest_side() / f64::from(resolution);
    let lattice = lattice_around(&mesh.bounds(), spacing, PADDING)
        .with_context(|| format!("a grid of {resolution} cells is too large"))?;
    let samples = match layout {
        Layout::Dense => {
            require_memory(lattice.node_count() * size_of::<f32>())?;
            Samples::Dense(dense::bake(&distance, &lattice, &|_| ()))
        }
        Layout::Sparse => {
            let plan = Plan::new(&distance, &lattice, BAND * spacing);
            require_memory(plan.most_bytes::<u16>())?;
            Samples::Sparse(plan.bake(&|_| ()))
        }
    };
    Ok(Baked { lattice, samples })
}

fn require_memory(bytes: usize) -> Result<()> {
    let free = machine::free_bytes().unwrap_or(usize::MAX);
    ensure!(bytes <= free, "the grid needs {} MB of memory, {} MB are free", bytes / 1_000_000, free / 1_000_000);
    Ok(())
}

impl Baked {
    /// Number of nodes with a sample of their own.
    pub fn stored_node_count(&self) -> usize {
        match &self.samples {
            Samples::Dense(_) => self.lattice.node_count(),
            Samples::Sparse(sparse) => {
                let nodes = self.lattice.nodes();
                let in_brick = |brick: &[u32; 3]| -> usize {
                    (0..3).map(|axis| (nodes[axis] - brick[axis] * BRICK).min(BRICK) as usize).product()
                };
                sparse.places.iter().map(in_brick).sum()
            }
        }
    }

    /// The grid as a field.
    pub fn into_grid(self) -> Result<OwnedGrid> {
        let grid = match self.samples {
            Samples::Dense(baked) => dense_grid(self.lattice, baked),
            Samples::Sparse(baked) => sparse_grid(self.lattice, baked),
        };
        grid.context("a grid that does not fit its lattice")
    }
}

fn dense_grid(lattice: Lattice, baked: DenseGrid) -> Option<OwnedGrid> {
    let samples = WithBlockBounds::new(&lattice, Dense::new(&lattice, baked.distances)?, baked.bounds)?;
    Grid::new(lattice, OwnedSamples::Dense(samples), baked.slope_bound)
}

fn sparse_grid(lattice: Lattice, baked: SparseGrid<u16>) -> Option<OwnedGrid> {
    fn bricks<C: Quantize>(baked: SparseGrid<C>) -> OwnedBricks<C> {
        let SparseGrid { table, places, scales, samples, bounds, errors, coarse, .. } = baked;
        OwnedBricks { table, places, scales, samples, bounds, errors, coarse }
    }
    let slope_bound = baked.slope_bound;
    let samples = Sparse::new(&lattice, bricks(baked))?;
    Grid::new(lattice, OwnedSamples::SparseU16(samples), slope_bound)
}
