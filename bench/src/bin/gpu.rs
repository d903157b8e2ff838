//! The command line of the measurements on a GPU.

use std::process::ExitCode;

use clap::Parser;
use sdf_bench::{exit_code, gpu};

/// Compare contacts on an NVIDIA GPU with those of the CPU bit for bit, and measure them, on the scenes of the paper's table 1.
#[derive(Debug, Parser)]
#[command(version, max_term_width = 110)]
struct Args {
    #[command(flatten)]
    options: gpu::GpuOptions,
}

fn main() -> ExitCode {
    exit_code(gpu::measure(&Args::parse().options))
}
