//! The command line of the measurements of motion: `cargo run --release -p sdf-bench --bin motion -- [MESH.obj]`.

use std::path::Path;
use std::process::ExitCode;

use sdf_bench::{exit_code, motion};

fn main() -> ExitCode {
    exit_code(motion::run(std::env::args_os().nth(1).as_deref().map(Path::new)))
}
