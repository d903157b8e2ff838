//! Which processor searches.

use std::path::PathBuf;

use clap::{Parser, ValueEnum};

#[derive(Clone, Debug, Parser)]
pub struct DeviceArgs {
    /// Where to search. On a GPU, numbers have seven digits, and auto is Frank-Wolfe, followed by a certified search of what that leaves
    /// open, in f32, and on the CPU of what is open then.
    #[arg(long, value_enum, default_value_t = Device::Cpu)]
    pub device: Device,
    /// The kernels for --device cuda: PTX or machine code, made by .ci/gpu.sh --out [default: kernels.sm_80.cubin or the like, else
    /// kernels.ptx, in the program's folder].
    #[arg(long, value_name = "FILE")]
    pub kernels: Option<PathBuf>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Device {
    /// The processor, in f64.
    Cpu,
    /// An NVIDIA GPU, in f32.
    Cuda,
}
