#!/bin/sh
# Builds the module and puts it with its page into a folder: sh build.sh FOLDER
#
# Takes Rust with the target wasm32-unknown-unknown (rustup target add wasm32-unknown-unknown); else Debian's rustc-web, cargo-web,
# rust-web-src, rust-web-llvm and lld-22, whose standard library is compiled along.
set -eu
[ $# = 1 ] || { echo "usage: build.sh FOLDER" >&2; exit 2; }
mkdir -p "$1"
folder=$(cd "$1" && pwd)
cd "$(dirname "$0")"
triple=wasm32-unknown-unknown
# Apart from other builds, which another compiler made.
target=${CARGO_TARGET_DIR:-$PWD/../target}/wasm
build="build --profile wasm --locked --quiet --manifest-path ../Cargo.toml --target-dir $target --target $triple -p sdftool-wasm"
# Every browser since 2023 and node 16 have these vectors.
export RUSTFLAGS='-C target-feature=+simd128'
if ls "$(rustc --print sysroot)/lib/rustlib/$triple/lib/"libstd-*.rlib >/dev/null 2>&1; then
    cargo $build
elif [ -x /usr/bin/cargo ] && [ -d "$(/usr/bin/rustc --print sysroot)/lib/rustlib/src/rust/library/std" ]; then
    RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1 /usr/bin/cargo $build -Z build-std=std,panic_abort -Z build-std-features=compiler-builtins-mem
else
    echo "build.sh: Rust cannot compile for browsers yet: rustup target add $triple" >&2
    exit 1
fi
cp "$target/$triple/wasm/sdftool_wasm.wasm" "$folder/sdftool.wasm"
cp web/* "$folder/"
