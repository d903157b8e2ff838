//! Fields in the card's memory: how do a grid's arrays and a shape's numbers get there?
//!
//! The host sends plain numbers (`abi`). A kernel of one thread makes a field of `sdf-core` of them, in the layout of its own
//! compiler; the host reads those bytes back and passes them to every other kernel by value, where they stand in constant memory.

use std::sync::Arc;

use cudarc::driver::{CudaSlice, CudaStream, DevicePtr, DeviceRepr, PushKernelArg};
use sdf_core::grid::BlockBounds;
use sdf_core::grid::owned::{OwnedBricks, OwnedGrid, OwnedStorage};
use sdf_core::grid::sparse::{Code, Sparse};
use sdf_core::{AnyField, Sdf};

use crate::abi::{FIELD_MARK, FieldBlob, GridParams, ShapeParams, Slice};
use crate::device::blocks;
use crate::shapes::shape_list;
use crate::{Gpu, GpuError};

/// A field in the card's memory. Copies of it are the same field.
#[derive(Clone, Debug)]
pub struct GpuField {
    /// As the names of kernels have it.
    pub(crate) kind: &'static str,
    pub(crate) blob: FieldBlob,
    /// Stream of the `Gpu` that made it.
    pub(crate) stream: Arc<CudaStream>,
    /// Kept for the kernels, which have their addresses.
    _arrays: Arc<[Array]>,
}

/// A list in the card's memory.
#[derive(Debug)]
#[expect(dead_code, reason = "held, not read")]
enum Array {
    F32(CudaSlice<f32>),
    U32(CudaSlice<u32>),
    U16(CudaSlice<u16>),
    Bytes(CudaSlice<u8>),
}

impl GpuField {
    /// Copies a field to the card: a grid, or a union of spheres, boxes, capsules, cylinders,
    /// cones and tori, each as it stands or placed.
    pub fn new(gpu: &Gpu, field: &AnyField) -> Result<Self, GpuError> {
        Self::with_origin(gpu, field, [0.0; 3])
    }

    /// Copies a field to the card, in coordinates from a point of its own frame: those of elements have to be from there, too. Far from
    /// the origin f32 has no room for positions; the differences are taken in f64.
    pub fn with_origin(gpu: &Gpu, field: &AnyField, origin: [f64; 3]) -> Result<Self, GpuError> {
        match field {
            AnyField::Grid(grid) => Self::from_grid(gpu, grid, origin),
            _ => Self::from_shapes(gpu, &shape_list(field, origin)?),
        }
    }

    fn from_grid(gpu: &Gpu, grid: &OwnedGrid, origin: [f64; 3]) -> Result<Self, GpuError> {
        let [x, y, z] = grid.lattice().nodes();
        let first = grid.lattice().origin();
        let mut upload = Upload { gpu, arrays: vec![] };
        let mut params = GridParams {
            origin: [0, 1, 2].map(|axis| first[axis] - origin[axis]),
            spacing: grid.lattice().spacing(),
            slope_bound: grid.slope_bound(),
            band: grid.band(),
            error_bound: grid.global_error_bound(),
            deep_error: grid.deep_error(),
            nodes: [x, y, z],
            inside_reaches_box: grid.inside_reaches_box().into(),
            ..GridParams::default()
        };
        let kind = match grid.storage() {
            OwnedStorage::Dense(dense) => {
                params.samples = upload.list(dense.storage().samples(), Array::F32)?;
                params.bounds = upload.bounds(dense.bounds())?;
                "dense"
            }
            OwnedStorage::SparseF32(sparse) => {
                params.samples = upload.list(&sparse.bricks().samples, Array::F32)?;
                upload.bricks(&mut params, sparse)?;
                "sparse_f32"
            }
            OwnedStorage::DenseU16(sparse) | OwnedStorage::SparseU16(sparse) => {
                params.samples = upload.list(&sparse.bricks().samples, Array::U16)?;
                upload.bricks(&mut params, sparse)?;
                "sparse_u16"
            }
            OwnedStorage::DenseU8(sparse) | OwnedStorage::SparseU8(sparse) => {
                // A sample is base + step · code, whatever the code's width.
                let codes: Vec<u16> = sparse.bricks().samples.iter().copied().map(u16::from).collect();
                params.samples = upload.list(&codes, Array::U16)?;
                upload.bricks(&mut params, sparse)?;
                "sparse_u16"
            }
        };
        let stream = &gpu.stream;
        let (params, mut blob) = (stream.clone_htod(&[params])?, stream.alloc_zeros::<FieldBlob>(1)?);
        let kernel = gpu.kernel(&format!("prepare_{kind}"))?;
        // SAFETY: the lists have the lengths in `params`; the kernel checks that they fit the lattice.
        unsafe { stream.launch_builder(&kernel).arg(&params).arg(&mut blob).launch(ONE_THREAD)? };
        let blob = stream.clone_dtoh(&blob)?[0];
        Self { kind, blob, stream: stream.clone(), _arrays: upload.arrays.into() }.checked("a grid of these numbers")
    }

    fn from_shapes(gpu: &Gpu, shapes: &[ShapeParams]) -> Result<Self, GpuError> {
        let stream = &gpu.stream;
        let (params, mut blob) = (stream.clone_htod(shapes)?, stream.alloc_zeros::<FieldBlob>(1)?);
        let mut parts = stream.alloc_zeros::<u8>(shapes.len() * gpu.sizes[0] as usize)?;
        let (kernel, count) = (gpu.kernel("prepare_shapes")?, shapes.len() as u32);
        let mut launch = stream.launch_builder(&kernel);
        launch.arg(&params).arg(&mut parts).arg(&count).arg(&mut blob);
        // SAFETY: there is room for as many parts as there are shapes.
        unsafe { launch.launch(ONE_THREAD)? };
        let blob = stream.clone_dtoh(&blob)?[0];
        let _arrays = [Array::Bytes(parts)].into();
        Self { kind: "shapes", blob, stream: stream.clone(), _arrays }.checked("a shape of these numbers")
    }

    /// The kernel marks a field that it made in the last word.
    fn checked(self, what: &'static str) -> Result<Self, GpuError> {
        if self.blob.0[FIELD_MARK] == 1 { Ok(self) } else { Err(GpuError::Unsupported(what)) }
    }
}

const ONE_THREAD: cudarc::driver::LaunchConfig =
    cudarc::driver::LaunchConfig { grid_dim: (1, 1, 1), block_dim: (1, 1, 1), shared_mem_bytes: 0 };

/// Copies the arrays of a grid.
struct Upload<'a> {
    gpu: &'a Gpu,
    arrays: Vec<Array>,
}

impl Upload<'_> {
    fn list<T: DeviceRepr>(&mut self, list: &[T], keep: fn(CudaSlice<T>) -> Array) -> Result<Slice, GpuError> {
        let array = self.gpu.upload(list)?;
        let slice = Slice { address: array.device_ptr(&self.gpu.stream).0, len: list.len() as u64 };
        self.arrays.push(keep(array));
        Ok(slice)
    }

    /// Numbers that a kernel brings into its own layout, of so many bytes each.
    fn converted<const N: usize>(&mut self, list: &[[f32; N]], kernel: &str, bytes: u32) -> Result<Slice, GpuError> {
        let stream = &self.gpu.stream;
        let from = self.gpu.upload(list.as_flattened())?;
        let mut to = stream.alloc_zeros::<u8>((list.len() * bytes as usize).max(1))?;
        let (kernel, count) = (self.gpu.kernel(kernel)?, list.len() as u32);
        // SAFETY: there is room for `count` items.
        unsafe { stream.launch_builder(&kernel).arg(&from).arg(&mut to).arg(&count).launch(blocks(count))? };
        let slice = Slice { address: to.device_ptr(stream).0, len: list.len() as u64 };
        self.arrays.push(Array::Bytes(to));
        Ok(slice)
    }

    fn bounds(&mut self, bounds: &[BlockBounds]) -> Result<Slice, GpuError> {
        let numbers: Vec<_> =
            bounds.iter().map(|block| [block.range.lower, block.range.upper, block.slope_bound]).collect();
        self.converted(&numbers, "prepare_bounds", self.gpu.sizes[1])
    }

    fn bricks<C: Code>(&mut self, params: &mut GridParams, sparse: &Sparse<OwnedBricks<C>>) -> Result<(), GpuError> {
        let bricks = sparse.bricks();
        let scales: Vec<_> = bricks.scales.iter().map(|scale| [scale.base, scale.step]).collect();
        params.scales = self.converted(&scales, "prepare_scales", self.gpu.sizes[2])?;
        params.bounds = self.bounds(&bricks.bounds)?;
        params.table = self.list(&bricks.table.to_vec(), Array::U32)?;
        params.coarse = self.list(&bricks.coarse.to_vec(), Array::F32)?;
        params.errors = self.list(&bricks.errors, Array::F32)?;
        Ok(())
    }
}
