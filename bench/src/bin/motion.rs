//! The command line of the measurements of motion: `cargo run --release -p sdf-bench --bin motion`.

use std::process::ExitCode;

use sdf_bench::{exit_code, motion};

fn main() -> ExitCode {
    exit_code(motion::run())
}
