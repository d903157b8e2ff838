#!/usr/bin/env bash
# Builds the doors for Python, C and rapier by the commands of their chapters in the README, to the letter, and tests them: the wheel
# against the program, on a fleet and by the driver of gpu/stub, the library by each way of linking it, under valgrind, and against its
# header, the colliders at rest.
# The program is that of SDFTOOL, else the project's release, which another step has built as a rule.
#
# Needs PyPI (dask, maturin, numpy, open3d-cpu, pytest, ray, trimesh; SDFTOOL_LARGE=0 leaves out Open3D and ray, 550 MB together). As
# root it installs missing Debian packages.
set -euo pipefail
cd "$(dirname "$0")/.."

. .ci/packages.sh

missing=()
for program in cmake g++ pkg-config valgrind; do command -v "$program" >/dev/null || missing+=("$program"); done
python3 -c 'import ensurepip, venv' 2>/dev/null || missing+=(python3 python3-venv)
# Open3D's wheel needs it and does not contain it.
[ "${SDFTOOL_LARGE:-1}" = 0 ] || ldconfig -p | grep -q 'libusb-1\.0\.so\.0' || missing+=(libusb-1.0-0)
install_packages "${missing[@]}"
# One target folder for all: what the doors and the program share is built once.
CARGO_TARGET_DIR=$(realpath -m "${CARGO_TARGET_DIR:-target}")
export CARGO_TARGET_DIR
folder=$(mktemp -d)
trap 'rm -rf "$folder" sdftool-c sdf-parry-rest.obj' EXIT

# The blocks of one language in a chapter of the README.
chapter() { awk -v title="### $1" -v fence="\`\`\`$2" '/^#/ { on = $0 == title } on && $0 == "```" { block = 0 } block { print } on && $0 == fence { block = 1 }' README.md; }

for file in bindings/Cargo.toml bindings/python/Cargo.toml bindings/c/Cargo.toml bindings/parry/Cargo.toml; do
    version=$(sed -n '/^\[workspace.package\]/,/^$/s/^version = "\(.*\)"/\1/p' Cargo.toml)
    grep -qE "^version(\.workspace = true| = \"$version\")" "$file" || { echo "$file: the version is not $version" >&2; exit 1; }
done
if [ -z "${SDFTOOL:-}" ]; then
    cargo build --release --locked --quiet -p sdftool
    SDFTOOL=$CARGO_TARGET_DIR/release/sdftool
fi
export SDFTOOL

python3 -m venv "$folder/venv"
# shellcheck disable=SC1091
. "$folder/venv/bin/activate"
chapter Python sh > "$folder/python.sh"
grep -q 'pip install ./bindings/python' "$folder/python.sh"
PIP_QUIET=1 bash -e "$folder/python.sh"
wheel=$(find "$CARGO_TARGET_DIR/wheels" -name 'sdftool-*.whl' -newer "$folder/python.sh" | head -n 1)
[ -n "$wheel" ] && [ "$(stat -c %s "$wheel")" -le 4000000 ] || { echo "the wheel has more than 4 MB, or is missing: $wheel" >&2; exit 1; }
pip install --quiet 'dask[distributed]' mypy pytest trimesh
[ "${SDFTOOL_LARGE:-1}" = 0 ] || pip install --quiet open3d-cpu ray
# The stub against the module. Overloads have no defaults.
echo 'sdftool\.signed_distance' > "$folder/allowlist"
(cd "$folder" && python -m mypy.stubtest sdftool --allowlist allowlist >/dev/null || python -m mypy.stubtest sdftool --allowlist allowlist)
# A driver without a card, for the tests of device="cuda": gpu/stub has the kernels on the CPU.
cargo build --release --locked --quiet -p sdf-gpu-stub
mkdir "$folder/driver"
cp "$CARGO_TARGET_DIR/release/libsdf_gpu_stub.so" "$folder/driver/libcuda.so"
echo "// The stub has the kernels." > "$folder/driver/kernels.ptx"
SDFTOOL_STUB=$folder/driver LD_LIBRARY_PATH=$folder/driver${LD_LIBRARY_PATH:+:$LD_LIBRARY_PATH} \
    python -m pytest --quiet --no-header -p no:cacheprovider bindings/python/tests
chapter Python python > "$folder/chapter.py"
grep -q sdftool "$folder/chapter.py"
(cd "$folder" && python chapter.py && python "$OLDPWD/bindings/python/examples/gallery.py" gallery)

chapter "C and C++" sh > "$folder/c.sh"
grep -q 'bindings/c/install.sh' "$folder/c.sh"
bash -e "$folder/c.sh"
cmake -S bindings/c/examples -B "$folder/cmake" -DCMAKE_PREFIX_PATH="$PWD/sdftool-c" >/dev/null
cmake --build "$folder/cmake" >/dev/null
# find_package takes no other minor version, and no later one.
for version in 0.1 0.2.99 0.3 1.2; do
    echo "find_package(sdftool $version QUIET CONFIG PATHS $PWD/sdftool-c NO_DEFAULT_PATH)
        message(\"found \${sdftool_FOUND} of \${sdftool_CONSIDERED_VERSIONS}\")" > "$folder/version.cmake"
    cmake -P "$folder/version.cmake" 2>&1 | grep -q '^found 0 of [0-9]' || { echo "find_package(sdftool $version) takes another version" >&2; exit 1; }
done
for program in "$folder/cmake/contacts_static" "$folder/cmake/contacts_shared" sdftool-c/contacts; do
    "$program" "$folder/octahedron.sdf.h5" > "$folder/$(basename "$program").txt"
done
cmp "$folder/contacts_static.txt" "$folder/contacts_shared.txt"
cmp "$folder/contacts_static.txt" "$folder/contacts.txt"
# A program asks for the shared library by its name, not by the path where it lay.
mv sdftool-c "$folder/moved"
LD_LIBRARY_PATH=$folder/moved/lib "$folder/cmake/contacts_shared" "$folder/octahedron.sdf.h5" > "$folder/moved.txt"
mv "$folder/moved" sdftool-c
cmp "$folder/contacts_static.txt" "$folder/moved.txt"
valgrind --quiet --error-exitcode=9 --leak-check=full --errors-for-leak-kinds=definite,possible \
    "$folder/cmake/contacts_static" "$folder/octahedron.sdf.h5" > "$folder/valgrind.txt"
cmp "$folder/contacts_static.txt" "$folder/valgrind.txt"
exported=$(nm --dynamic --defined-only --extern-only sdftool-c/lib/libsdftool.so | awk '{ print $3 }' | grep -cv '^sdf_' || true)
[ "$exported" = 0 ] || { echo "libsdftool.so shows symbols beside sdf_*" >&2; exit 1; }
cargo test --release --locked --quiet --manifest-path bindings/Cargo.toml -p sdftool-c

chapter "rapier and parry" sh > "$folder/parry.sh"
grep -q 'bindings/parry' "$folder/parry.sh"
bash -e "$folder/parry.sh" > "$folder/parry.txt" || { cat "$folder/parry.txt" >&2; exit 1; }
grep -q '^o capsule' sdf-parry-rest.obj
cargo test --release --locked --quiet --manifest-path bindings/parry/Cargo.toml
