//! Gives the shared library its name: a program that links it asks for `libsdftool.so`, not for the path where it lay.

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    if std::env::var("CARGO_CFG_TARGET_OS").as_deref() == Ok("linux") {
        println!("cargo:rustc-cdylib-link-arg=-Wl,-soname,libsdftool.so");
    }
}
