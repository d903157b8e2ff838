//! Writes docs/stability.md and docs/stability.csv: `cargo run -p sdf-tests --example stability`.

use std::path::Path;

use sdf_tests::stability::report::{Report, report};

fn main() -> std::io::Result<()> {
    let docs = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs");
    let Report { text, numbers } = report();
    std::fs::write(docs.join("stability.md"), text)?;
    std::fs::write(docs.join("stability.csv"), numbers)
}
