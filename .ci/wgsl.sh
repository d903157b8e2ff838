#!/usr/bin/env bash
# Runs the WGSL shaders on Mesa's lavapipe, a Vulkan device on the CPU, and compares their contacts with the program's. No GPU is
# needed. SDF_SEED chooses other random triangles.
#
#     .ci/wgsl.sh                   on lavapipe
#     .ci/wgsl.sh --default-device  on the Vulkan, Metal or Direct3D device that wgpu chooses
#
# Needs Python 3.11 or newer with venv, and PyPI; as root on Debian it installs a missing Python and lavapipe.
set -euo pipefail
cd "$(dirname "$0")/.."
. .ci/packages.sh

requirements=gpu/wgsl/requirements.txt
venv=${CARGO_TARGET_DIR:-target}/wgsl-venv
icd=(/usr/share/vulkan/icd.d/lvp_icd*.json)
sdftool=${CARGO_TARGET_DIR:-target}/release/sdftool

packages=()
python3 -c 'import ensurepip, venv' 2>/dev/null || packages+=(python3 python3-venv)
if [ "${1:-}" != --default-device ] && [ ! -e "${icd[0]}" ]; then packages+=(mesa-vulkan-drivers libvulkan1); fi
install_packages "${packages[@]}"
if ! cmp -s "$requirements" "$venv/installed.txt"; then
    python3 -m venv --clear "$venv"
    "$venv/bin/pip" install --quiet --disable-pip-version-check -r "$requirements"
    cp "$requirements" "$venv/installed.txt"
fi
if [ "${1:-}" != --default-device ]; then
    icd=(/usr/share/vulkan/icd.d/lvp_icd*.json)
    export VK_DRIVER_FILES=${icd[0]} VK_ICD_FILENAMES=${icd[0]}
fi
cargo build --release --locked --quiet -p sdftool
export XDG_RUNTIME_DIR=${XDG_RUNTIME_DIR:-/tmp} PYTHONDONTWRITEBYTECODE=1
"$venv/bin/python" gpu/wgsl/check.py "$sdftool"
