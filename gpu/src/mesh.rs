//! Meshes in the card's memory: what is kept from frame to frame?
//!
//! Points, elements, and one buffer for each stage of a query, large enough for every element.

use cudarc::driver::{CudaSlice, DevicePtr};

use crate::abi::{ContactRecord, HIT_BYTES, SURVIVOR_BYTES, counter};
use crate::{Gpu, GpuError, LentRows};

/// Elements of a mesh, by the indices of their vertices.
#[derive(Clone, Copy, Debug)]
pub enum Elements<'a> {
    /// Every point by itself.
    Vertices,
    /// Pairs of points.
    Edges(&'a [[u32; 2]]),
    /// Triangles.
    Faces(&'a [[u32; 3]]),
    /// Triangles that are on the card already: they are copied there, and read once to check their indices.
    LentFaces(LentRows),
}

impl Elements<'_> {
    /// As the names of kernels have it.
    pub(crate) fn name(&self) -> &'static str {
        match self {
            Self::Vertices => "vertices",
            Self::Edges(_) => "edges",
            Self::Faces(_) | Self::LentFaces(_) => "faces",
        }
    }
}

/// Points of a mesh in the card's memory, in the world.
#[derive(Debug)]
pub(crate) enum Points {
    Own(CudaSlice<f32>),
    Lent(LentRows),
}

impl Points {
    pub(crate) fn upload(gpu: &Gpu, points: &[[f32; 3]]) -> Result<Self, GpuError> {
        Ok(Self::Own(gpu.upload(points.as_flattened())?))
    }

    pub(crate) fn address(&self, gpu: &Gpu) -> u64 {
        match self {
            Self::Own(list) => list.device_ptr(&gpu.stream).0,
            Self::Lent(lent) => lent.address,
        }
    }

    pub(crate) fn count(&self) -> usize {
        match self {
            // An empty mesh has a list of one number.
            Self::Own(list) => list.len() / 3,
            Self::Lent(lent) => lent.rows,
        }
    }
}

/// A mesh in the card's memory, and the buffers of its queries: made once, kept from frame to frame.
#[derive(Debug)]
pub struct GpuMesh {
    pub(crate) points: Points,
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
        Self::of(gpu, Points::upload(gpu, points)?, elements)
    }

    /// A mesh whose points are on the card already, and are read where they are.
    pub fn of_lent(gpu: &Gpu, points: LentRows, elements: Elements) -> Result<Self, GpuError> {
        Self::of(gpu, Points::Lent(points), elements)
    }

    fn of(gpu: &Gpu, points: Points, elements: Elements) -> Result<Self, GpuError> {
        let mut lent = None;
        let read;
        let (indices, corners): (&[u32], usize) = match elements {
            Elements::Vertices => (&[], 1),
            Elements::Edges(edges) => (edges.as_flattened(), 2),
            Elements::Faces(faces) => (faces.as_flattened(), 3),
            Elements::LentFaces(faces) => {
                let copy = lent.insert(gpu.copy_lent(&faces)?);
                read = if faces.rows == 0 { vec![] } else { gpu.stream.clone_dtoh(copy)? };
                (&read, 3)
            }
        };
        let point_count = points.count();
        if let Some(place) = indices.iter().position(|vertex| *vertex as usize >= point_count) {
            return Err(GpuError::NoVertex { element: place / corners, vertex: indices[place], count: point_count });
        }
        let count = if corners == 1 { point_count } else { indices.len() / corners };
        let words = |bytes: usize| count.max(1) * bytes.div_ceil(8);
        // SAFETY: a stage reads only what the one before it wrote.
        let (survivors, unsettled, hits, contacts) = unsafe {
            let stream = &gpu.stream;
            let (survivors, unsettled) = (stream.alloc(words(SURVIVOR_BYTES))?, stream.alloc(words(SURVIVOR_BYTES))?);
            (survivors, unsettled, stream.alloc(words(HIT_BYTES))?, stream.alloc(count.max(1))?)
        };
        Ok(Self {
            points,
            elements: lent.map_or_else(|| gpu.upload(indices), Ok)?,
            kind: elements.name(),
            element_count: count as u32,
            local_points: None,
            survivors,
            unsettled,
            hits,
            contacts,
            counters: gpu.stream.alloc_zeros(counter::OPEN as usize + 1)?,
        })
    }

    pub(crate) fn set_points(&mut self, gpu: &Gpu, points: &[[f32; 3]]) -> Result<(), GpuError> {
        self.check_count(points.len())?;
        match &mut self.points {
            _ if points.is_empty() => {}
            Points::Own(list) => gpu.stream.memcpy_htod(points.as_flattened(), list)?,
            Points::Lent(_) => self.points = Points::upload(gpu, points)?,
        }
        Ok(())
    }

    pub(crate) fn lend_points(&mut self, points: LentRows) -> Result<(), GpuError> {
        self.check_count(points.rows)?;
        self.points = Points::Lent(points);
        Ok(())
    }

    /// Vertices of all elements; none where each is a point by itself.
    pub(crate) fn index_count(&self) -> usize {
        let corners = match self.kind {
            "faces" => 3,
            "edges" => 2,
            _ => 0,
        };
        corners * self.element_count as usize
    }

    fn check_count(&self, points: usize) -> Result<(), GpuError> {
        let expected = self.points.count();
        if points == expected { Ok(()) } else { Err(GpuError::PointCount { points, expected }) }
    }

    /// The points as they are on the card.
    pub(crate) fn read_points(&self, gpu: &Gpu) -> Result<Vec<[f32; 3]>, GpuError> {
        match &self.points {
            Points::Own(list) => {
                let mut points = gpu.stream.clone_dtoh(list)?.as_chunks().0.to_vec();
                points.truncate(self.points.count());
                Ok(points)
            }
            Points::Lent(lent) => gpu.read_lent(lent),
        }
    }
}
