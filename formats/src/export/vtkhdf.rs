//! VTKHDF files, which ParaView and VTK open: image data of a grid, and polygonal data of a mesh that moves.
//!
//! The layout is that of "VTKHDF file format", version 2 (Kitware, docs.vtk.org).

use std::io;
use std::path::Path;

use sdf_core::grid::Lattice;

use crate::grid_file::Chunks;
use crate::hdf5::{self, Compression, Element, Group};

/// A VTKHDF file of image data with the point data `distance`, which ParaView and VTK open.
pub fn vtkhdf(lattice: &Lattice, samples: &[f32]) -> Vec<u8> {
    let mut chunks = Chunks { compression: Compression::Deflate, checksums: Vec::new() };
    let written = hdf5::to_bytes(|root| chunks.write_vtkhdf(&root.group("VTKHDF"), lattice, samples));
    written.expect("memory takes what is written, and no attribute is long")
}

/// A mesh whose points move from frame to frame. Faces and lines stay.
#[derive(Clone, Copy, Debug)]
pub struct MovingMesh<'a> {
    /// Time of each frame, ascending.
    pub times: &'a [f64],
    /// Points of each frame, in the same number.
    pub frames: &'a [Vec<[f32; 3]>],
    /// Pairs of indices of points.
    pub lines: &'a [[u32; 2]],
    /// Triangles, as indices of points.
    pub faces: &'a [[u32; 3]],
    /// The body of each line, then of each face: cell data `body`.
    pub bodies: &'a [u32],
}

/// Rows of a chunk of points or indices: 192 KiB of points.
const CHUNK_ROWS: usize = 16_384;

/// Writes a VTKHDF file of polygonal data that changes with time ("Steps"), which ParaView and VTK open. Faces and lines stand there
/// once; every step points at them. A mesh of one frame has no steps.
///
/// Errors: the disk's, and counts that do not match.
pub fn write_moving_vtkhdf(path: &Path, mesh: &MovingMesh) -> io::Result<()> {
    let MovingMesh { times, frames, lines, faces, bodies } = mesh;
    let point_count = frames.first().map_or(0, Vec::len);
    let indices = lines.as_flattened().iter().chain(faces.as_flattened());
    let is_whole = times.len() == frames.len()
        && !frames.is_empty()
        && frames.iter().all(|points| points.len() == point_count)
        && bodies.len() == lines.len() + faces.len()
        && indices.max().is_none_or(|last| (*last as usize) < point_count);
    if !is_whole {
        return Err(io::Error::new(io::ErrorKind::InvalidInput, "times, points and cells of the mesh do not match"));
    }
    let points: Vec<f32> = frames.iter().flat_map(|points| points.as_flattened()).copied().collect();
    hdf5::create(path, |root| {
        let group = root.group("VTKHDF");
        group.set_numbers("Version", &[2_i64, 0]);
        group.set_ascii("Type", "PolyData");
        put(&group, "NumberOfPoints", &[point_count as i64], 1)?;
        put(&group, "Points", &points, 3)?;
        put_cells::<1>(&group, "Vertices", &[])?;
        put_cells(&group, "Lines", lines)?;
        put_cells(&group, "Polygons", faces)?;
        put_cells::<1>(&group, "Strips", &[])?;
        put(&group.group("CellData"), "body", bodies, 1)?;
        if frames.len() > 1 {
            put_steps(&group.group("Steps"), times, point_count)?;
        }
        Ok(())
    })
}

/// One kind of cells: how many, where each begins, and the indices of their points.
fn put_cells<const N: usize>(group: &Group, name: &str, cells: &[[u32; N]]) -> io::Result<()> {
    let group = group.group(name);
    let widened = |numbers: &mut dyn Iterator<Item = usize>| numbers.map(|number| number as i64).collect::<Vec<_>>();
    put(&group, "NumberOfCells", &[cells.len() as i64], 1)?;
    put(&group, "NumberOfConnectivityIds", &[(N * cells.len()) as i64], 1)?;
    put(&group, "Offsets", &widened(&mut (0..=cells.len()).map(|cell| N * cell)), 1)?;
    put(&group, "Connectivity", &widened(&mut cells.as_flattened().iter().map(|index| *index as usize)), 1)
}

/// Where each step begins in the other datasets: at its own points, and at the cells of the first.
fn put_steps(group: &Group, times: &[f64], point_count: usize) -> io::Result<()> {
    let count = times.len();
    let firsts: Vec<i64> = (0..count).map(|step| (step * point_count) as i64).collect();
    group.set_number("NSteps", count as i64);
    put(group, "Values", times, 1)?;
    put(group, "NumberOfParts", &vec![1_i64; count], 1)?;
    put(group, "PartOffsets", &vec![0_i64; count], 1)?;
    put(group, "PointOffsets", &firsts, 1)?;
    // Vertices, lines, polygons and strips.
    put(group, "CellOffsets", &vec![0_i64; 4 * count], 4)?;
    put(group, "ConnectivityIdOffsets", &vec![0_i64; 4 * count], 4)?;
    put(&group.group("CellDataOffsets"), "body", &vec![0_i64; count], 1)
}

/// Adds a dataset of rows with so many columns. One row of zeros stands for none, as a chunk cannot be empty.
fn put<T: Element>(group: &Group, name: &str, elements: &[T], columns: usize) -> io::Result<()> {
    let zeros = vec![T::default(); columns];
    let elements = if elements.is_empty() { &zeros } else { elements };
    let rows = elements.len() / columns;
    let (shape, chunk) = ([rows, columns], [rows.min(CHUNK_ROWS), columns]);
    let dimensions = if columns == 1 { 1 } else { 2 };
    let shapes = [&shape[..dimensions], &chunk[..dimensions]];
    group.chunked(name, shapes, Compression::Deflate, elements, |_| (), &mut Vec::new()).map(|_| ())
}
