#!/usr/bin/env bash
# Measures other programs beside ours and writes docs/performance/peers.csv and entangled.csv, then docs/performance.md.
#
#     tests/peers/run.sh [--meshes FOLDER] [--only dense,sparse,fine,contacts,obj,entangled] [--rounds N] [--limit SECONDS]
#
# FOLDER has the meshes as OBJ (stanford-bunny, armadillo, dragon, cow, teapot, cloth; --names and --shells select others). Needs Python 3.11 and PyPI;
# as root on Debian it installs OpenVDB for Python, and Eigen to build pysdf. A full run takes about 20 minutes on an idle
# machine.
set -euo pipefail
cd "$(dirname "$0")/../.."

needed=(python3-openvdb libeigen3-dev g++)
missing=()
for package in "${needed[@]}"; do
    [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>&1)" = installed ] || missing+=("$package")
done
if [ ${#missing[@]} -gt 0 ] && [ "$(id -u)" = 0 ]; then
    export DEBIAN_FRONTEND=noninteractive
    { apt-get update && apt-get install --yes --no-install-recommends "${missing[@]}"; } >/dev/null
elif [ ${#missing[@]} -gt 0 ]; then
    echo "peers: not installed, skipped: ${missing[*]}" >&2
fi

target=$(realpath -m "${CARGO_TARGET_DIR:-target}")
cargo build --release --locked --quiet -p sdftool -p sdf-bench
cargo build --release --quiet --manifest-path tests/peers/Cargo.toml --target-dir "$target/peers"

venv=$target/peers-venv
if ! cmp --silent tests/peers/requirements.txt "$venv/requirements.txt"; then
    python3 -m venv "$venv"
    CPLUS_INCLUDE_PATH=/usr/include/eigen3 "$venv/bin/pip" install --quiet -r tests/peers/requirements.txt
    cp tests/peers/requirements.txt "$venv/requirements.txt"
fi

"$venv/bin/python" tests/peers/run.py --sdftool "$target/release/sdftool" --speed "$target/release/speed" \
    --peers "$target/peers/release/peers" "$@"
"$target/release/speed" --docs docs --rewrite
