//! Meshes in the card's memory: what is kept from frame to frame?
//!
//! Points, elements, and one buffer for each stage of a query, large enough for every element.

use cudarc::driver::CudaSlice;

use crate::abi::{ContactRecord, HIT_BYTES, SURVIVOR_BYTES, counter};
use crate::{Gpu, GpuError};

/// Elements of a mesh, by the indices of their vertices.
#[derive(Clone, Copy, Debug)]
pub enum Elements<'a> {
    /// Every point by itself.
    Vertices,
    /// Pairs of points.
    Edges(&'a [[u32; 2]]),
    /// Triangles.
    Faces(&'a [[u32; 3]]),
}

impl Elements<'_> {
    /// As the names of kernels have it.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Vertices => "vertices",
            Self::Edges(_) => "edges",
            Self::Faces(_) => "faces",
        }
    }
}

/// A mesh in the card's memory, and the buffers of its queries: made once, kept from frame to frame.
#[derive(Debug)]
pub struct GpuMesh {
    /// In the world.
    pub(crate) points: CudaSlice<f32>,
    /// In the field's frame, once the field had a pose.
    pub(crate) local_points: Option<CudaSlice<f32>>,
    pub(crate) elements: CudaSlice<u32>,
    pub(crate) kind: &'static str,
    pub(crate) element_count: u32,
    pub(crate) survivors: CudaSlice<u64>,
    pub(crate) unsettled: CudaSlice<u64>,
    pub(crate) hits: CudaSlice<u64>,
    pub(crate) contacts: CudaSlice<ContactRecord>,
    pub(crate) counters: CudaSlice<u32>,
}

impl GpuMesh {
    /// Copies points and elements to the card.
    pub fn new(gpu: &Gpu, points: &[[f32; 3]], elements: Elements) -> Result<Self, GpuError> {
        let (indices, corners): (&[u32], usize) = match elements {
            Elements::Vertices => (&[], 1),
            Elements::Edges(edges) => (edges.as_flattened(), 2),
            Elements::Faces(faces) => (faces.as_flattened(), 3),
        };
        if let Some(place) = indices.iter().position(|vertex| *vertex as usize >= points.len()) {
            return Err(GpuError::NoVertex { element: place / corners, vertex: indices[place], count: points.len() });
        }
        let count = if corners == 1 { points.len() } else { indices.len() / corners };
        let words = |bytes: usize| count.max(1) * bytes.div_ceil(8);
        // SAFETY: a stage reads only what the one before it wrote.
        let (survivors, unsettled, hits, contacts) = unsafe {
            let stream = &gpu.stream;
            let (survivors, unsettled) = (stream.alloc(words(SURVIVOR_BYTES))?, stream.alloc(words(SURVIVOR_BYTES))?);
            (survivors, unsettled, stream.alloc(words(HIT_BYTES))?, stream.alloc(count.max(1))?)
        };
        Ok(Self {
            points: gpu.upload(points.as_flattened())?,
            elements: gpu.upload(indices)?,
            kind: elements.name(),
            element_count: count as u32,
            local_points: None,
            survivors,
            unsettled,
            hits,
            contacts,
            counters: gpu.stream.alloc_zeros(counter::UNSETTLED as usize + 1)?,
        })
    }

    pub(crate) fn set_points(&mut self, gpu: &Gpu, points: &[[f32; 3]]) -> Result<(), GpuError> {
        // An empty mesh has a list of one number.
        if points.len() != self.points.len() / 3 {
            return Err(GpuError::PointCount { points: points.len(), expected: self.points.len() / 3 });
        }
        if points.is_empty() {
            return Ok(());
        }
        Ok(gpu.stream.memcpy_htod(points.as_flattened(), &mut self.points)?)
    }
}
