//! Passes the board's memory map to the linker script of cortex-m-rt. The map has a folder of its own: a memory.x beside Cargo.toml
//! would be found first, without this script.

fn main() {
    let folder = std::env::var("CARGO_MANIFEST_DIR").expect("cargo names the package's folder") + "/link";
    println!("cargo::rustc-link-search={folder}");
    println!("cargo::rustc-link-arg-bins=-Tlink.x");
    println!("cargo::rerun-if-changed=link/memory.x");
}
