//! `sdftool bench` as cargo runs it: `cargo bench -p sdftool --bench works -- --quick`.

use std::process::{Command, exit};

fn main() {
    // Cargo adds --bench itself.
    let words = std::env::args().skip(1).filter(|word| word != "--bench");
    let status = Command::new(env!("CARGO_BIN_EXE_sdftool")).arg("bench").args(words).status();
    exit(status.ok().and_then(|status| status.code()).unwrap_or(1));
}
