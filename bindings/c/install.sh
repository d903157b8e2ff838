#!/bin/sh
# Builds the library and installs header, static and shared library, CMake package and pkg-config file: sh install.sh PREFIX
set -eu
[ $# = 1 ] || { echo "usage: install.sh PREFIX" >&2; exit 2; }
mkdir -p "$1"
prefix=$(cd "$1" && pwd)
cd "$(dirname "$0")"
target=${CARGO_TARGET_DIR:-$PWD/../target}
cargo build --release --locked --quiet --manifest-path ../Cargo.toml --target-dir "$target" -p sdftool-c
version=$(sed -n 's/^version = "\(.*\)"/\1/p' ../Cargo.toml | head -n 1)
install -Dm644 include/sdftool.h "$prefix/include/sdftool.h"
install -Dm644 "$target/release/libsdftool.a" "$prefix/lib/libsdftool.a"
install -Dm755 -s "$target/release/libsdftool.so" "$prefix/lib/libsdftool.so"
install -Dm644 cmake/sdftoolConfig.cmake "$prefix/lib/cmake/sdftool/sdftoolConfig.cmake"
sed "s/@VERSION@/$version/" cmake/sdftoolConfigVersion.cmake.in > "$prefix/lib/cmake/sdftool/sdftoolConfigVersion.cmake"
mkdir -p "$prefix/lib/pkgconfig"
cat > "$prefix/lib/pkgconfig/sdftool.pc" <<EOF
prefix=$prefix
Name: sdftool
Description: Signed distance fields of meshes, and contacts of meshes with them
Version: $version
Cflags: -I\${prefix}/include
Libs: -L\${prefix}/lib -lsdftool
Libs.private: -lpthread -ldl -lm
EOF
