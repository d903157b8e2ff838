//! The fields that random problems are posed on.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use anyhow::{Context, Result};
use sdf_bake::sparse::{self, Quantize};
use sdf_bake::{MeshDistance, SparseGrid, TriangleMesh, dense, lattice_around};
use sdf_core::combine::SmoothUnion;
use sdf_core::grid::{Dense, Grid, Lattice, WithBlockBounds, sparse::Sparse};
use sdf_core::shapes::{Capsule, Cone, Cuboid, Horseshoe, Sphere, Torus};
use sdf_formats::field_file::Node;
use sdf_formats::grid_file::{OwnedBricks, OwnedGrid, OwnedSamples};
use sdf_procedural::Mesh;
use serde::{Deserialize, Serialize};

/// That of the paper's Fig. 3, so deep that in the plane z = 0 only its outline is near.
pub fn horseshoe() -> Result<Node> {
    Horseshoe::new(0.6, 0.3, FRAC_PI_2, 0.6, 10.0).map(Node::Horseshoe).context("a horseshoe")
}

/// A sphere, a box, a capsule, a cone, a torus, and a smooth union of two.
pub fn shapes() -> Result<Vec<Node>> {
    let capsule = || Capsule::new([-0.5, 0.1, 0.0], [0.5, -0.1, 0.3], 0.25).map(Node::Capsule);
    let cuboid = || Cuboid::new([0.6, 0.4, 0.3]).map(Node::Cuboid);
    let blended = || SmoothUnion::new(capsule()?, cuboid()?, 0.2).map(|union| Node::SmoothUnion(Box::new(union)));
    let shapes = [
        Sphere::new(0.7).map(Node::Sphere),
        cuboid(),
        capsule(),
        Cone::new(20.0_f64.to_radians(), 1.4).map(Node::Cone),
        Torus::new(0.6, 0.2).map(Node::Torus),
        blended(),
    ];
    shapes.into_iter().collect::<Option<_>>().context("a shape")
}

/// How a body's samples are kept.
#[derive(Clone, Copy, Debug, Deserialize, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Layout {
    /// All of them, as f32.
    Dense,
    /// Bricks near the surface, as u16.
    Sparse,
}

/// Cells around a body's box, and of a sparse grid to either side of the surface.
const PADDING: u32 = 4;
const BAND: f64 = 3.0;

/// Bakes with `resolution` cells along the longest side.
pub fn bake(body: &Mesh, resolution: u32, layout: Layout) -> Result<Node> {
    let mesh = TriangleMesh::new(&body.points, &body.triangles)?;
    let distance = MeshDistance::new(&mesh, None);
    let spacing = mesh.bounds().longest_side() / f64::from(resolution);
    let lattice = lattice_around(&mesh.bounds(), spacing, PADDING).context("no grid of so many cells")?;
    let grid = match layout {
        Layout::Dense => of_dense(&lattice, dense::bake(&distance, &lattice, &|_| ())),
        Layout::Sparse => of_sparse(&lattice, sparse::bake(&distance, &lattice, BAND * spacing, &|_| ())),
    };
    Ok(Node::Grid(Arc::new(grid.context("a grid that does not fit its lattice")?)))
}

fn of_dense(lattice: &Lattice, baked: dense::DenseGrid) -> Option<OwnedGrid> {
    let samples = WithBlockBounds::new(lattice, Dense::new(lattice, baked.distances)?, baked.bounds)?;
    Grid::new(*lattice, OwnedSamples::Dense(samples), baked.slope_bound)
}

fn of_sparse(lattice: &Lattice, baked: SparseGrid<u16>) -> Option<OwnedGrid> {
    fn bricks<C: Quantize>(baked: SparseGrid<C>) -> OwnedBricks<C> {
        let SparseGrid { table, places, scales, samples, bounds, errors, coarse, .. } = baked;
        OwnedBricks { table, places, scales, samples, bounds, errors, coarse }
    }
    let slope_bound = baked.slope_bound;
    let samples = Sparse::new(lattice, bricks(baked))?;
    Grid::new(*lattice, OwnedSamples::SparseU16(samples), slope_bound)
}
