#!/usr/bin/env bash
# Bakes the demo's body, reads the file with h5py and VTK, and compares their values with those of `sdftool eval`; then the same
# with the files that `sdftool export` writes.
# Needs Python 3.11 or newer with venv, and PyPI (SDFTOOL_LARGE=0 leaves out Warp, 400 MB); as root on Debian it installs a missing Python.
set -euo pipefail
cd "$(dirname "$0")/.."
. .ci/packages.sh

python3 -c 'import ensurepip, venv' 2>/dev/null || install_packages python3 python3-venv
cargo build --release --locked --quiet -p sdftool
sdftool=${CARGO_TARGET_DIR:-target}/release/sdftool
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"$sdftool" demo -o "$folder/demo"
sh tests/readers/run.sh "$folder/demo/body.sdf.h5" "$(realpath "$sdftool")"

# What `export` writes, read by NanoVDB's own tools, numpy, pynrrd, VTK and trimesh.
if ! command -v nanovdb_validate >/dev/null && [ "$(id -u)" = 0 ]; then install_packages libnanovdb-tools libopenvdb-tools; fi
"$sdftool" bake "$folder/demo/body.obj" --res 64 --layout sparse -o "$folder/sparse.sdf.h5" >/dev/null
python=${CARGO_TARGET_DIR:-target}/readers-venv/bin/python
[ "${SDFTOOL_LARGE:-1}" = 0 ] || "$python" -m pip install --quiet --disable-pip-version-check warp-lang==1.19.0
for grid in "$folder/demo/body.sdf.h5" "$folder/sparse.sdf.h5"; do
    "$python" tests/readers/exports.py "$(realpath "$sdftool")" "$grid"
done

# What `simulate` records, read by VTK.
"$python" tests/readers/recordings.py "$(realpath "$sdftool")" scenes/02-coarse-cloth.toml
