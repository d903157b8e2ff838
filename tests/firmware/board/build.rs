//! Hands the board's memory map to the linker script of cortex-m-rt. It lies in a folder of its own, which the linker
//! looks in only because it is told to; one beside Cargo.toml would win over it unasked.

fn main() {
    let folder = std::env::var("CARGO_MANIFEST_DIR").expect("cargo names the package's folder") + "/link";
    println!("cargo::rustc-link-search={folder}");
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    println!("cargo::rerun-if-changed=link/memory.x");
}
