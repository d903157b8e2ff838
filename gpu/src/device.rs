//! The card: is a driver there, do the kernels load, and how are lists copied?
//!
//! All work goes to one stream, so that kernels and copies run in the order in which they are started.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use cudarc::driver::{CudaContext, CudaFunction, CudaModule, CudaSlice, CudaStream, DriverError, LaunchConfig};
use cudarc::driver::{DeviceRepr, PushKernelArg, sys};
use cudarc::nvrtc::Ptx;

/// An NVIDIA GPU with the kernels loaded.
#[derive(Debug)]
pub struct Gpu {
    pub(crate) context: Arc<CudaContext>,
    pub(crate) stream: Arc<CudaStream>,
    module: Arc<CudaModule>,
    /// Bytes of a part of a union, of block bounds and of a brick's scale, in the layout of the kernels.
    pub(crate) sizes: [u32; 3],
}

/// Why a query on the card fails.
#[derive(Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages say it")]
pub enum GpuError {
    #[error("no CUDA driver: libcuda.so is not on this machine; install NVIDIA's driver, or query on the CPU")]
    NoDriver,
    #[error("{0}: the kernels do not load ({1}); build them by .ci/gpu.sh")]
    Kernels(PathBuf, DriverError),
    #[error("CUDA: {0}")]
    Driver(#[from] DriverError),
    #[error("{0}: not a field that the GPU kernels know; query it on the CPU")]
    Unsupported(&'static str),
    #[error("element {element}: vertex {vertex} of {count} does not exist")]
    NoVertex { element: usize, vertex: u32, count: usize },
    #[error("{points} points given for a mesh of {expected}")]
    PointCount { points: usize, expected: usize },
}

impl Gpu {
    /// The first card, with the kernels in a file of PTX or machine code (`.cubin`).
    pub fn new(kernels: &Path) -> Result<Self, GpuError> {
        // SAFETY: opens and closes a library of that name, as every call of the driver will.
        if !unsafe { sys::is_culib_present() } {
            return Err(GpuError::NoDriver);
        }
        let context = CudaContext::new(0)?;
        // SAFETY: all work runs on one stream, in order.
        unsafe { context.disable_event_tracking() };
        let stream = context.new_stream()?;
        let module = context
            .load_module(Ptx::from_file(kernels))
            .map_err(|error| GpuError::Kernels(kernels.to_owned(), error))?;
        let mut gpu = Self { context, stream, module, sizes: [0; 3] };
        let mut sizes = gpu.stream.alloc_zeros::<u32>(3)?;
        let kernel = gpu.kernel("sizes")?;
        // SAFETY: the kernel writes three numbers.
        unsafe { gpu.stream.launch_builder(&kernel).arg(&mut sizes).launch(blocks(1))? };
        gpu.sizes.copy_from_slice(&gpu.stream.clone_dtoh(&sizes)?);
        Ok(gpu)
    }

    /// The card's name.
    pub fn name(&self) -> Result<String, GpuError> {
        Ok(self.context.name()?)
    }

    pub(crate) fn kernel(&self, name: &str) -> Result<CudaFunction, GpuError> {
        Ok(self.module.load_function(name)?)
    }

    /// Copies a list to the card.
    pub(crate) fn upload<T: DeviceRepr>(&self, list: &[T]) -> Result<CudaSlice<T>, GpuError> {
        // An allocation of nothing is an error.
        if list.is_empty() {
            // SAFETY: never read.
            return Ok(unsafe { self.stream.alloc(1)? });
        }
        Ok(self.stream.clone_htod(list)?)
    }
}

/// Threads per block: the smallest number that lets a multiprocessor hold all its threads.
const BLOCK: u32 = 64;

/// Blocks for so many threads, at least one.
pub(crate) fn blocks(threads: u32) -> LaunchConfig {
    LaunchConfig { grid_dim: (threads.div_ceil(BLOCK).max(1), 1, 1), block_dim: (BLOCK, 1, 1), shared_mem_bytes: 0 }
}
