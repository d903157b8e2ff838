#!/bin/sh
# Builds the library for a processor, and puts it and its header into a folder: sh build.sh TARGET FOLDER [FEATURES]
#
# FEATURES, such as dense-u16,smooth, are the kinds of blobs that are linked: see Cargo.toml. Takes Rust with the target (rustup target
# add TARGET) or with the source of `core`; else Debian's rustc-web, cargo-web and rust-web-src. CARGO and RUSTC name another compiler.
set -eu
[ $# -ge 2 ] || { echo "usage: build.sh TARGET FOLDER [FEATURES]" >&2; exit 2; }
here=$(cd "$(dirname "$0")" && pwd -P)
target_dir=${CARGO_TARGET_DIR:-$here/../target}
set -- "$1" "$2" "${3:-dense-f32,dense-u16,sparse-f32,sparse-u16,sparse-u8,smooth}"

# Does a compiler have this folder?
has() { sysroot=$("$1" --print sysroot 2>/dev/null) && [ -d "$sysroot/lib/rustlib/$2" ]; }
source=src/rust/library/core
rustc=${RUSTC:-rustc} cargo=${CARGO:-cargo} core=
if ! has "$rustc" "$1"; then
    core='-Zbuild-std=core -Zbuild-std-features=compiler-builtins-mem'
    if ! has "$rustc" $source && [ -z "${RUSTC:-}${CARGO:-}" ]; then
        rustc=/usr/bin/rustc cargo=/usr/bin/cargo
    fi
    if ! has "$rustc" $source; then
        echo "build.sh: Rust cannot compile for $1 yet: rustup target add $1 (or install Debian's rustc-web, cargo-web and rust-web-src)" >&2
        exit 1
    fi
fi
# core_float_math, square roots by the processor, is not yet stable.
# shellcheck disable=SC2086
RUSTC=$rustc RUSTC_BOOTSTRAP=1 "$cargo" build --quiet --locked --manifest-path "$here/../Cargo.toml" --package sdftool-firmware \
    --profile firmware --target "$1" --target-dir "$target_dir" --no-default-features --features "core-math,$3" $core
mkdir -p "$2"
cp "$here/include/sdf_blob.h" "$target_dir/$1/firmware/libsdftool_firmware.a" "$2"
