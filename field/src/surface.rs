//! The level set of a field as a mesh, by naive surface nets (Gibson 1998), block by block on all threads.

use std::collections::HashMap;

use fast_surface_nets::{SurfaceNetsBuffer, surface_nets};
use ndshape::{RuntimeShape, Shape};
use sdf_core::grid::Lattice;
use sdf_core::nalgebra::Vector3;
use sdf_core::{Aabb, AnyField, EnclosedSdf, Interval, Sdf};

use crate::{Field, Threads};

/// A surface that was extracted.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SurfaceMesh {
    /// Coordinates of the vertices.
    pub points: Vec<[f64; 3]>,
    /// For each triangle its vertices, counterclockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl SurfaceMesh {
    /// Estimated number of cells with a point of the surface, in a box of so many cells along each axis: those on the faces of the box.
    pub fn estimated_cells([x, y, z]: [f64; 3]) -> f64 {
        2.0 * (x * y + y * z + z * x)
    }

    /// Estimated memory of the surface in such a box, in bytes: for each of those cells a point and two triangles, and twice that while
    /// pieces are joined.
    pub fn estimated_bytes(cells: [f64; 3]) -> f64 {
        200.0 * Self::estimated_cells(cells)
    }
}

impl Field {
    /// The surface φ = level within the box of a lattice, of whose cells each has one vertex at most: where two sheets cross the face
    /// between two cells, an edge has four triangles. Blocks of cells whose enclosure excludes the level are not sampled.
    pub fn surface(&self, level: f64, lattice: &Lattice, threads: Threads) -> SurfaceMesh {
        threads.install(|| extract(self.as_any(), level, lattice))
    }

    /// Least and greatest φ at the nodes on the faces of a lattice's box. The [`surface`](Self::surface) of a level above the least, and
    /// no greater than the greatest, leaves the box, and is open there; all others are closed.
    pub fn range_on_faces(&self, lattice: &Lattice, threads: Threads) -> Interval<f64> {
        let [along_x, along_y, along_z] = lattice.nodes();
        let range_of_row = |row: usize| {
            let [y, z] = [row as u32 % along_y, row as u32 / along_y];
            let is_on_face = y == 0 || y + 1 == along_y || z == 0 || z + 1 == along_z;
            // Of other rows the ends alone.
            let step = if is_on_face { 1 } else { along_x as usize - 1 };
            let values =
                (0..along_x).step_by(step).map(|x| self.as_any().value(Vector3::from(lattice.node([x, y, z]))));
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[lower, upper], value: f64| {
                [lower.min(value), upper.max(value)]
            })
        };
        let ranges = threads.install(|| sdf_parallel::map(along_y as usize * along_z as usize, range_of_row));
        let join = |[a, b]: [f64; 2], [lower, upper]: [f64; 2]| [a.min(lower), b.max(upper)];
        let [lower, upper] = ranges.into_iter().fold([f64::INFINITY, f64::NEG_INFINITY], join);
        Interval { lower, upper }
    }
}

/// Cells along the side of a block. Smaller blocks sample more nodes twice; larger ones sample more nodes far from the surface.
const BLOCK: u32 = 16;

/// Naive surface nets over the lattice. Only the samples of the current blocks are in memory.
fn extract(field: &AnyField, level: f64, lattice: &Lattice) -> SurfaceMesh {
    let counts = lattice.cells().map(|cells| cells.div_ceil(BLOCK) as usize);
    let [along_x, along_y, along_z] = counts;
    let pieces = sdf_parallel::map(along_x * along_y * along_z, |index| {
        let block = [index % along_x, index / along_x % along_y, index / along_x / along_y];
        Piece::extract(field, level, lattice, block.map(|n| n as u32 * BLOCK))
    });
    let mut surface = SurfaceMesh::default();
    // Each cell has one point at most; blocks share cells at their borders.
    let mut point_of_cell = HashMap::new();
    for piece in pieces.into_iter().flatten() {
        let numbers: Vec<u32> = std::iter::zip(piece.cells, piece.points)
            .map(|(cell, point)| {
                if !is_in(lattice, &cell) {
                    return NO_POINT;
                }
                *point_of_cell.entry(cell).or_insert_with(|| {
                    surface.points.push(point);
                    surface.points.len() as u32 - 1
                })
            })
            .collect();
        let triangles = piece.triangles.iter().map(|corners| corners.map(|corner| numbers[corner as usize]));
        surface.triangles.extend(triangles.filter(|corners| !corners.contains(&NO_POINT)));
    }
    surface
}

/// Number of a point beyond the lattice.
const NO_POINT: u32 = u32::MAX;

fn is_in(lattice: &Lattice, cell: &[u32; 3]) -> bool {
    (0..3).all(|axis| cell[axis] < lattice.cells()[axis])
}

/// The surface in a block of cells and in the layer of cells before it, which shares edges with the block.
struct Piece {
    /// Cell of each point.
    cells: Vec<[u32; 3]>,
    points: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
}

impl Piece {
    fn extract(field: &AnyField, level: f64, lattice: &Lattice, block: [u32; 3]) -> Option<Self> {
        let first = block.map(|n| n.saturating_sub(1));
        let end = lattice.cells();
        // The last layer of cells is joined by the next block; at the end of the lattice by one that repeats the last nodes.
        let last: [u32; 3] = std::array::from_fn(|axis| match block[axis] + BLOCK {
            last if last < end[axis] => last,
            _ => end[axis] + 1,
        });
        let node = |node: [u32; 3]| lattice.node(std::array::from_fn(|axis| node[axis].min(end[axis])));
        if !may_contain_level(field, level, &Aabb { min: lattice.node(first), max: node(last) }) {
            return None;
        }
        let nodes: [u32; 3] = std::array::from_fn(|axis| last[axis] - first[axis] + 1);
        let shape = RuntimeShape::<u32, 3>::new(nodes);
        let to_voxels = power_of_two_per(lattice.spacing());
        let sample = |index: u32| {
            let offset = shape.delinearize(index);
            let value: f64 = field.value(Vector3::from(node(std::array::from_fn(|axis| first[axis] + offset[axis]))));
            ((value - level) * to_voxels) as f32
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

/// A power of two that makes a length about 1. Samples that it scales keep their digits in f32, however large or small the field is.
fn power_of_two_per(length: f64) -> f64 {
    2.0_f64.powi(-(length.log2().clamp(-1000.0, 1000.0) as i32))
}

/// May φ = level somewhere in the box? By the enclosure, and by |φ(x) − φ(m)| ≤ slope bound · half the diagonal.
fn may_contain_level(field: &AnyField, level: f64, region: &Aabb) -> bool {
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
