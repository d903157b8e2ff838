//! Bakes in memory, with the defaults of `sdftool bake`.

use anyhow::Result;
use sdf_core::grid::owned::{Layout, OwnedGrid};
use sdf_core::grid::sparse::BRICK;
use sdf_field::{BakeOptions, Field, GridSize, MeshView};
use sdf_procedural::Mesh;

/// Bakes with `resolution` cells along the longest side of the body's box.
pub fn bake(body: &Mesh, resolution: u32, layout: Layout) -> Result<Field> {
    let options = BakeOptions { size: GridSize::Cells(resolution), layout, ..BakeOptions::default() };
    Ok(Field::bake(MeshView { points: &body.points, faces: &body.triangles }, &options)?.field)
}

/// Number of nodes with a sample of their own.
pub fn stored_node_count(grid: &OwnedGrid) -> usize {
    let nodes = grid.lattice().nodes();
    let in_brick = |slot: &[u32; 3]| -> usize {
        (0..3).map(|axis| (nodes[axis] - slot[axis] * BRICK).min(BRICK) as usize).product()
    };
    match grid.storage().layout() {
        Layout::Dense => grid.lattice().node_count(),
        Layout::Sparse => grid.storage().slots().iter().map(in_brick).sum(),
    }
}
