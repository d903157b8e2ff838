//! A CUDA driver without a card: does the host code of `sdf-gpu` launch the right kernels, with the right lists?
//!
//! This library has those functions of `libcuda.so` that `sdf-gpu` calls. A launch runs the kernel of that name, compiled for the CPU
//! from the very files that are compiled to PTX, once for each thread of the card, in an order that changes from launch to launch. A
//! copy beyond the end of a list, a kernel that does not exist, and a kernel that writes past a list are errors.
//!
//! | file | holds |
//! |---|---|
//! | `memory` | lists, and what is wrong with their use |
//! | `threads` | the threads of the card |
//! | `work` | launches, copies, graphs and events |
//! | `ptx` | the kernels' PTX in place of their source, where a file of it is loaded, and a model of its time |
//! | `abi`, `fields`, `team`, `stages`, `kernels` | those of `gpu/src` and `gpu/kernels/src` |
//!
//! Memory of the card is memory of the process, so that a test can be another program of the same card: it allocates by `cuMemAlloc_v2`
//! and lends what it has. Copies on a stream of its own, or on the default one, are done when somebody waits for that stream, not before.
//!
//! Times mean nothing here, and what differs on a card stays unseen: its compiler, threads that run at once, its caches.
//! `SDF_STUB_CARDS=0` in the environment makes it a driver without a card, `SDF_STUB_LOCAL_MEMORY=0` one that has no room for the certified
//! kernel, `SDF_STUB_CODE_MEMORY=0` none for its code, and `SDF_STUB_MEMORY=N` one whose lists have N bytes at most.

#![allow(non_snake_case, reason = "names of CUDA")]

#[path = "../../src/abi.rs"]
mod abi;
#[path = "../../kernels/src/fields.rs"]
mod fields;
#[path = "../../kernels/src/kernels.rs"]
mod kernels;
mod memory;
pub mod ptx;
#[path = "../../kernels/src/stages.rs"]
mod stages;
#[path = "../../kernels/src/team.rs"]
mod team;
mod threads;
mod work;

use std::cell::Cell;
use std::ffi::{CStr, c_char, c_float, c_int, c_uint, c_void};

use ptx::Card;
use work::{Arguments, Graph, Source, Work, driver};

/// `CUresult`.
type Status = c_int;

const SUCCESS: Status = 0;
const INVALID_VALUE: Status = 1;
const OUT_OF_MEMORY: Status = 2;
const NO_DEVICE: Status = 100;
const INVALID_IMAGE: Status = 200;
const INVALID_CONTEXT: Status = 201;
const FILE_NOT_FOUND: Status = 301;
const NOT_FOUND: Status = 500;
const ILLEGAL_ADDRESS: Status = 700;
const CAPTURE_INVALIDATED: Status = 901;

// Attributes of an address, and their values.
const MEMORY_TYPE: c_uint = 2;
const DEVICE_MEMORY: c_uint = 2;
const IS_MANAGED: c_uint = 8;
const DEVICE_ORDINAL: c_uint = 9;
const RANGE_START: c_uint = 11;
const RANGE_SIZE: c_uint = 12;

/// Flag of the streams that `sdf-gpu` makes.
const NON_BLOCKING: c_uint = 1;

fn status(holds: bool, otherwise: Status) -> Status {
    if holds { SUCCESS } else { otherwise }
}

/// A handle that is not null and says nothing.
const HANDLE: *mut c_void = 16 as *mut c_void;

thread_local! {
    /// The current context of a thread: none before it sets one.
    static CONTEXT: Cell<*mut c_void> = const { Cell::new(std::ptr::null_mut()) };
}

/// Does the environment say that the card has no room for this?
fn has_no_room(variable: &str) -> bool {
    std::env::var_os(variable).is_some_and(|room| room == "0")
}

/// Milliseconds between two events.
///
/// # Safety
/// Both are events.
unsafe fn elapsed_ms(start: *const f64, end: *const f64) -> f32 {
    // SAFETY: the caller's.
    (1e-3 * unsafe { *end - *start }) as f32
}

/// Functions of the driver. Each gets what CUDA's documentation says; those are the conditions under which it is safe.
macro_rules! driver_functions {
    ($(fn $name:ident($($argument:ident: $type:ty),*) -> Status $body:block)+) => {$(
        /// As in CUDA's documentation.
        ///
        /// # Safety
        /// As there.
        #[unsafe(no_mangle)]
        #[allow(unused_unsafe, reason = "some read nothing")]
        pub unsafe extern "C" fn $name($($argument: $type),*) -> Status {
            // SAFETY: the caller's.
            unsafe { $body }
        }
    )+};
}

driver_functions! {
    fn cuInit(_flags: c_uint) -> Status {
        status(std::env::var_os("SDF_STUB_CARDS").is_none_or(|cards| cards != "0"), NO_DEVICE)
    }

    fn cuDeviceGet(device: *mut c_int, ordinal: c_int) -> Status {
        *device = ordinal;
        SUCCESS
    }

    // No memory pools, among others.
    fn cuDeviceGetAttribute(value: *mut c_int, _attribute: c_int, _device: c_int) -> Status {
        *value = 0;
        SUCCESS
    }

    fn cuDeviceGetName(name: *mut c_char, length: c_int, _device: c_int) -> Status {
        let text = c"stub on the CPU".to_bytes_with_nul();
        name.cast::<u8>().copy_from_nonoverlapping(text.as_ptr(), text.len().min(length as usize));
        SUCCESS
    }

    fn cuDevicePrimaryCtxRetain(context: *mut *mut c_void, _device: c_int) -> Status {
        *context = HANDLE;
        SUCCESS
    }

    fn cuDevicePrimaryCtxRelease_v2(_device: c_int) -> Status { SUCCESS }

    fn cuCtxGetCurrent(context: *mut *mut c_void) -> Status {
        *context = CONTEXT.get();
        SUCCESS
    }

    fn cuCtxSetCurrent(context: *mut c_void) -> Status {
        CONTEXT.set(context);
        SUCCESS
    }

    fn cuCtxSynchronize() -> Status {
        driver().wait_for(None);
        SUCCESS
    }

    fn cuGetErrorString(error: c_int, text: *mut *const c_char) -> Status {
        let words = match error {
            OUT_OF_MEMORY => c"out of memory",
            NO_DEVICE => c"no CUDA-capable device is detected",
            INVALID_IMAGE => c"device kernel image is invalid",
            INVALID_CONTEXT => c"invalid device context",
            FILE_NOT_FOUND => c"file not found",
            NOT_FOUND => c"named symbol not found",
            ILLEGAL_ADDRESS => c"an illegal memory access was encountered",
            CAPTURE_INVALIDATED => c"operation failed due to a previous error during capture",
            _ => c"invalid argument",
        };
        *text = words.as_ptr();
        SUCCESS
    }

    // Streams of other programs, which are made with other flags, have handles of their own.
    fn cuStreamCreate(stream: *mut *mut c_void, flags: c_uint) -> Status {
        *stream = if flags == NON_BLOCKING { HANDLE } else { driver().new_stream() as *mut c_void };
        SUCCESS
    }

    fn cuStreamDestroy_v2(_stream: *mut c_void) -> Status { SUCCESS }

    fn cuStreamSynchronize(stream: *mut c_void) -> Status {
        driver().wait_for(Some(stream as usize));
        SUCCESS
    }

    fn cuMemAlloc_v2(address: *mut u64, bytes: usize) -> Status {
        let memory = &mut driver().memory;
        let limit = std::env::var("SDF_STUB_MEMORY").ok().and_then(|limit| limit.parse().ok());
        if limit.is_some_and(|limit| memory.bytes() + bytes > limit) {
            return OUT_OF_MEMORY;
        }
        *address = memory.allocate(bytes);
        status(bytes > 0, INVALID_VALUE)
    }

    fn cuMemFree_v2(address: u64) -> Status {
        status(driver().memory.free(address), INVALID_VALUE)
    }

    fn cuMemsetD8Async(address: u64, byte: u8, bytes: usize, _stream: *mut c_void) -> Status {
        driver().take(Work::Fill { address, byte, bytes })
    }

    fn cuMemcpyHtoDAsync_v2(to: u64, from: *const c_void, bytes: usize, stream: *mut c_void) -> Status {
        let mut driver = driver();
        if !driver.memory.holds(to, bytes) {
            return INVALID_VALUE;
        }
        if stream == HANDLE {
            (to as *mut u8).copy_from_nonoverlapping(from.cast(), bytes);
        } else {
            let bytes = std::slice::from_raw_parts(from.cast::<u8>(), bytes).to_vec();
            driver.copy_later(stream as usize, to, Source::Host(bytes));
        }
        SUCCESS
    }

    fn cuMemcpyDtoDAsync_v2(to: u64, from: u64, bytes: usize, stream: *mut c_void) -> Status {
        let mut driver = driver();
        if !driver.memory.holds(to, bytes) || !driver.memory.holds(from, bytes) {
            return INVALID_VALUE;
        }
        if stream == HANDLE {
            (to as *mut u8).copy_from(from as *const u8, bytes);
        } else {
            driver.copy_later(stream as usize, to, Source::Card(from, bytes));
        }
        SUCCESS
    }

    // Of all memory that is not one of the lists nothing is known. Each begins and ends as it was allocated.
    fn cuPointerGetAttribute(value: *mut c_void, attribute: c_uint, address: u64) -> Status {
        let driver = driver();
        let list = driver.memory.list_at(address).filter(|(start, bytes)| address < start + *bytes as u64);
        let Some((start, bytes)) = list else { return INVALID_VALUE };
        match attribute {
            MEMORY_TYPE => value.cast::<c_uint>().write(DEVICE_MEMORY),
            IS_MANAGED => value.cast::<c_uint>().write(0),
            DEVICE_ORDINAL => value.cast::<c_int>().write(0),
            RANGE_START => value.cast::<u64>().write(start),
            RANGE_SIZE => value.cast::<usize>().write(bytes),
            _ => return INVALID_VALUE,
        }
        SUCCESS
    }

    fn cuMemcpyDtoHAsync_v2(to: *mut c_void, from: u64, bytes: usize, _stream: *mut c_void) -> Status {
        let driver = driver();
        if !driver.memory.holds(from, bytes) {
            return INVALID_VALUE;
        }
        to.cast::<u8>().copy_from_nonoverlapping(from as *const u8, bytes);
        SUCCESS
    }

    // A file that begins as one of PTX does.
    fn cuModuleLoad(module: *mut *mut c_void, path: *const c_char) -> Status {
        *module = HANDLE;
        match std::fs::read(CStr::from_ptr(path).to_string_lossy().as_ref()) {
            Ok(text) => {
                driver().card = std::str::from_utf8(&text).ok().filter(|text| text.contains(".entry")).map(Card::new);
                status(text.starts_with(b"//"), INVALID_IMAGE)
            }
            Err(_) => FILE_NOT_FOUND,
        }
    }

    fn cuModuleUnload(_module: *mut c_void) -> Status { SUCCESS }

    fn cuModuleGetFunction(function: *mut *const c_void, _module: *mut c_void, name: *const c_char) -> Status {
        if CONTEXT.get().is_null() {
            return INVALID_CONTEXT;
        }
        let kernel = CStr::from_ptr(name).to_str().ok().and_then(kernels::find);
        if kernel.is_some_and(|kernel| kernel.name.ends_with("certified")) && has_no_room("SDF_STUB_CODE_MEMORY") {
            return OUT_OF_MEMORY;
        }
        *function = kernel.map_or(std::ptr::null(), |kernel| (&raw const *kernel).cast());
        status(kernel.is_some(), NOT_FOUND)
    }

    fn cuLaunchKernel(
        function: *const c_void,
        blocks_x: c_uint, blocks_y: c_uint, blocks_z: c_uint,
        threads_x: c_uint, threads_y: c_uint, threads_z: c_uint,
        _shared_bytes: c_uint,
        _stream: *mut c_void,
        arguments: *mut *mut c_void,
        _extra: *mut *mut c_void
    ) -> Status {
        let kernel = &*function.cast::<kernels::Kernel>();
        let arguments = Arguments::copy(kernel, arguments);
        if kernel.name.ends_with("certified") && has_no_room("SDF_STUB_LOCAL_MEMORY") {
            // What was captured so far is lost.
            driver().captured = None;
            return OUT_OF_MEMORY;
        }
        if [blocks_y, blocks_z, threads_y, threads_z] != [1; 4] {
            return INVALID_VALUE;
        }
        driver().take(Work::Launch { kernel, arguments, blocks: blocks_x as usize, block: threads_x as usize })
    }

    fn cuStreamBeginCapture_v2(_stream: *mut c_void, _mode: c_int) -> Status {
        driver().captured = Some(vec![]);
        SUCCESS
    }

    fn cuStreamEndCapture(_stream: *mut c_void, graph: *mut *mut Graph) -> Status {
        let captured = driver().captured.take();
        let is_valid = captured.is_some();
        *graph = captured.map_or(std::ptr::null_mut(), |work| Box::into_raw(Box::new(work)));
        status(is_valid, CAPTURE_INVALIDATED)
    }

    // The graph and what is made of it are the same here; the latter is freed.
    fn cuGraphInstantiateWithFlags(executable: *mut *mut Graph, graph: *mut Graph, _flags: u64) -> Status {
        *executable = graph;
        SUCCESS
    }

    fn cuGraphLaunch(executable: *mut Graph, _stream: *mut c_void) -> Status {
        let driver = &mut *driver();
        let failed = (*executable).iter().map(|work| driver.run(work)).find(|status| *status != SUCCESS);
        failed.unwrap_or(SUCCESS)
    }

    fn cuGraphDestroy(_graph: *mut Graph) -> Status { SUCCESS }

    fn cuGraphExecDestroy(executable: *mut Graph) -> Status {
        drop(Box::from_raw(executable));
        SUCCESS
    }

    fn cuEventCreate(event: *mut *mut f64, _flags: c_uint) -> Status {
        *event = Box::into_raw(Box::new(0.0));
        SUCCESS
    }

    fn cuEventRecord(event: *mut f64, _stream: *mut c_void) -> Status {
        *event = driver().microseconds();
        SUCCESS
    }

    fn cuEventSynchronize(_event: *mut f64) -> Status { SUCCESS }

    fn cuEventElapsedTime(milliseconds: *mut c_float, start: *const f64, end: *const f64) -> Status {
        *milliseconds = elapsed_ms(start, end);
        SUCCESS
    }

    fn cuEventElapsedTime_v2(milliseconds: *mut c_float, start: *const f64, end: *const f64) -> Status {
        *milliseconds = elapsed_ms(start, end);
        SUCCESS
    }

    fn cuEventDestroy_v2(event: *mut f64) -> Status {
        drop(Box::from_raw(event));
        SUCCESS
    }
}
