#!/bin/sh
# Builds the library for a processor, and puts it and its header into a folder: sh build.sh TARGET FOLDER [FEATURES]
#
# FEATURES, such as dense-u16,smooth, are the kinds of blobs that are linked: see Cargo.toml. CARGO and RUSTC name the compiler: that of
# rustup after `rustup target add TARGET`, or any that includes the source of `core`, as Debian's rustc-web with rust-web-src does.
set -eu
[ $# -ge 2 ] || { echo "usage: build.sh TARGET FOLDER [FEATURES]" >&2; exit 2; }
here=$(cd "$(dirname "$0")" && pwd -P)
target_dir=${CARGO_TARGET_DIR:-$here/../target}
set -- "$1" "$2" "${3:-dense-f32,dense-u16,sparse-f32,sparse-u16,sparse-u8,smooth}"
core=
[ -d "$("${RUSTC:-rustc}" --print sysroot)/lib/rustlib/$1" ] || core='-Zbuild-std=core -Zbuild-std-features=compiler-builtins-mem'
# core_float_math, square roots by the processor, is not yet stable.
# shellcheck disable=SC2086
RUSTC_BOOTSTRAP=1 "${CARGO:-cargo}" build --quiet --locked --manifest-path "$here/../Cargo.toml" --package sdftool-firmware \
    --profile firmware --target "$1" --target-dir "$target_dir" --no-default-features --features "core-math,$3" $core
mkdir -p "$2"
cp "$here/include/sdf_blob.h" "$target_dir/$1/firmware/libsdftool_firmware.a" "$2"
