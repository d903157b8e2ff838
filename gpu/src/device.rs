//! The card: is a driver there, do the kernels load, and how are lists copied?
//!
//! All work goes to one stream, so that kernels and copies run in the order in which they are started.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use cudarc::driver::{CudaContext, CudaFunction, CudaModule, CudaSlice, CudaStream, DriverError, LaunchConfig};
use cudarc::driver::{DeviceRepr, PushKernelArg, sys};
use cudarc::nvrtc::Ptx;

use crate::abi::VERSION;

/// An NVIDIA GPU with the kernels loaded.
///
/// Copies of it are the same card. Fields, meshes and queries belong to the `Gpu` that made them, and to its copies.
///
/// Every call makes the card's primary context the current one of its thread, as CUDA's runtime does, and leaves it so. A program with
/// a context of its own makes that current again.
#[derive(Clone, Debug)]
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
    #[error("libcuda.so is not a whole CUDA driver, it has no {0}: install NVIDIA's driver, or query on the CPU")]
    IncompleteDriver(&'static str),
    #[error("{0}: the kernels do not load ({1}); build them by .ci/gpu.sh")]
    Kernels(PathBuf, DriverError),
    #[error("no NVIDIA GPU: the driver finds no card on this machine; query on the CPU")]
    NoCard,
    #[error("{0}: the kernels are those of another version of this program; build them again by .ci/gpu.sh")]
    KernelVersion(PathBuf),
    #[error("CUDA: {0}")]
    Driver(#[from] DriverError),
    #[error("{0}: not a field that the GPU kernels know; query it on the CPU")]
    Unsupported(&'static str),
    #[error("element {element}: vertex {vertex} of {count} does not exist")]
    NoVertex { element: usize, vertex: u32, count: usize },
    #[error("{0}")]
    Lent(&'static str),
    #[error("{0}")]
    Options(&'static str),
    #[error("the {0} was made by another Gpu: make field, mesh and query by one Gpu or by copies of it")]
    OtherGpu(&'static str),
    #[error("{points} points given for a mesh of {expected}")]
    PointCount { points: usize, expected: usize },
}

impl GpuError {
    /// Did the card lack memory?
    pub fn is_out_of_memory(&self) -> bool {
        matches!(self, Self::Driver(DriverError(sys::CUresult::CUDA_ERROR_OUT_OF_MEMORY)))
    }
}

impl Gpu {
    /// Generation of the first card: major and minor number of its compute capability.
    pub fn capability() -> Result<(i32, i32), GpuError> {
        Ok(context()?.compute_capability()?)
    }

    /// The first card, with the kernels in a file of PTX or machine code (`.cubin`).
    pub fn new(kernels: &Path) -> Result<Self, GpuError> {
        let context = context()?;
        // SAFETY: all work runs on one stream, in order.
        unsafe { context.disable_event_tracking() };
        let stream = context.new_stream()?;
        let refused = |error| GpuError::Kernels(kernels.to_owned(), error);
        // The driver takes no other names.
        let name = kernels.to_str().filter(|name| !name.contains('\0'));
        name.ok_or_else(|| refused(DriverError(sys::CUresult::CUDA_ERROR_FILE_NOT_FOUND)))?;
        let module = context.load_module(Ptx::from_file(kernels)).map_err(refused)?;
        let mut gpu = Self { context, stream, module, sizes: [0; 3] };
        let other_version = || GpuError::KernelVersion(kernels.to_owned());
        let mut sizes = gpu.stream.alloc_zeros::<u32>(4)?;
        let kernel = gpu.find_kernel("sizes")?.ok_or_else(other_version)?;
        // SAFETY: the kernel writes four numbers.
        unsafe { gpu.stream.launch_builder(&kernel).arg(&mut sizes).launch(blocks(1))? };
        let sizes = gpu.stream.clone_dtoh(&sizes)?;
        gpu.sizes.copy_from_slice(&sizes[..3]);
        if sizes[3] == VERSION { Ok(gpu) } else { Err(other_version()) }
    }

    /// The card's name.
    pub fn name(&self) -> Result<String, GpuError> {
        Ok(self.context.name()?)
    }

    pub(crate) fn kernel(&self, name: &str) -> Result<CudaFunction, GpuError> {
        Ok(self.find_kernel(name)?.ok_or(DriverError(sys::CUresult::CUDA_ERROR_NOT_FOUND))?)
    }

    /// The kernel of this name; `None` if the file has none.
    pub(crate) fn find_kernel(&self, name: &str) -> Result<Option<CudaFunction>, GpuError> {
        self.context.bind_to_thread()?;
        match self.module.load_function(name) {
            Err(DriverError(sys::CUresult::CUDA_ERROR_NOT_FOUND)) => Ok(None),
            kernel => Ok(Some(kernel?)),
        }
    }

    /// Refuses what another `Gpu` made: its work is on another stream, and its kernels may be others.
    pub(crate) fn check_owner(&self, stream: &Arc<CudaStream>, what: &'static str) -> Result<(), GpuError> {
        if Arc::ptr_eq(&self.stream, stream) { Ok(()) } else { Err(GpuError::OtherGpu(what)) }
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

fn context() -> Result<Arc<CudaContext>, GpuError> {
    // SAFETY: opens and closes a library of that name, as every call of the driver will.
    if !unsafe { sys::is_culib_present() } {
        return Err(GpuError::NoDriver);
    }
    // SAFETY: the library stays open, and nothing is called here.
    let has = |name: &&str| unsafe { sys::culib().get::<*const ()>(name.as_bytes()).is_ok() };
    if let Some(missing) = FUNCTIONS.iter().find(|name| !has(name)) {
        return Err(GpuError::IncompleteDriver(missing));
    }
    let is_no_card = |error: &DriverError| {
        matches!(error.0, sys::CUresult::CUDA_ERROR_NO_DEVICE | sys::CUresult::CUDA_ERROR_INVALID_DEVICE)
    };
    match CudaContext::new(0) {
        Err(error) if is_no_card(&error) => Err(GpuError::NoCard),
        context => Ok(context?),
    }
}

/// Functions of the driver that cudarc calls for this crate, and panics without.
const FUNCTIONS: [&str; 35] = [
    "cuInit",
    "cuDeviceGet",
    "cuDeviceGetAttribute",
    "cuDeviceGetName",
    "cuDevicePrimaryCtxRetain",
    "cuDevicePrimaryCtxRelease_v2",
    "cuCtxGetCurrent",
    "cuCtxSetCurrent",
    "cuCtxSynchronize",
    "cuGetErrorString",
    "cuStreamCreate",
    "cuStreamDestroy_v2",
    "cuStreamSynchronize",
    "cuMemAlloc_v2",
    "cuMemFree_v2",
    "cuMemsetD8Async",
    "cuMemcpyHtoDAsync_v2",
    "cuMemcpyDtoDAsync_v2",
    "cuPointerGetAttribute",
    "cuMemcpyDtoHAsync_v2",
    "cuModuleLoad",
    "cuModuleUnload",
    "cuModuleGetFunction",
    "cuLaunchKernel",
    "cuStreamBeginCapture_v2",
    "cuStreamEndCapture",
    "cuGraphInstantiateWithFlags",
    "cuGraphLaunch",
    "cuGraphDestroy",
    "cuGraphExecDestroy",
    "cuEventCreate",
    "cuEventRecord",
    "cuEventSynchronize",
    "cuEventElapsedTime",
    "cuEventDestroy_v2",
];

/// Threads per block: the smallest number that lets a multiprocessor hold all its threads.
const BLOCK: u32 = 64;

/// Threads per block of a launch that leaves most of a card idle. A warp of eight waits for fewer of its threads, and for fewer lines of
/// the cache at once.
const SMALL_BLOCK: u32 = 8;

/// Largest number of threads in small blocks. 132 multiprocessors hold 4,224 blocks; with 2,500 their launch takes longer than they gain.
const FEW_THREADS: u32 = 8192;

/// Blocks for so many threads, at least one.
pub(crate) fn blocks(threads: u32) -> LaunchConfig {
    let block = if threads <= FEW_THREADS { SMALL_BLOCK } else { BLOCK };
    LaunchConfig { grid_dim: (threads.div_ceil(block).max(1), 1, 1), block_dim: (block, 1, 1), shared_mem_bytes: 0 }
}
