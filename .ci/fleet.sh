#!/usr/bin/env bash
# Runs the recipes of docs/fleets.md for GNU parallel and for Slurm on 200 meshes, kills three workers with SIGKILL, and runs each again:
# no grid may be lost or partial, and a third run bakes nothing. Slurm itself is not there: its array is 16 processes with its
# variables. As root on Debian it installs parallel if it is missing.
set -euo pipefail
cd "$(dirname "$0")/.."
. .ci/packages.sh

fail() { echo "fleet: $*" >&2; exit 1; }

command -v parallel >/dev/null || install_packages parallel
if [ -z "${SDFTOOL:-}" ]; then
    cargo build --release --locked --quiet -p sdftool
    SDFTOOL=${CARGO_TARGET_DIR:-target}/release/sdftool
fi
SDFTOOL=$(realpath "$SDFTOOL")
recipe=$(grep '^parallel ' docs/fleets.md)
script=$(awk '/^#!/ { on = 1 } /^```/ { on = 0 } on' docs/fleets.md)
grep -q 'SLURM_ARRAY_TASK_ID' <<<"$script" || fail "docs/fleets.md has no script for Slurm"
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
mkdir "$folder/bin"
ln -s "$SDFTOOL" "$folder/bin/sdftool"
export PATH=$folder/bin:$PATH HOME=$folder
cd "$folder"
for i in $(seq 200); do
    printf 'v 0 0 0\nv %s 0 0\nv 0 %s 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n' "$i" "$i" >"mesh$i.obj"
done
ls mesh*.obj >meshes.txt

grids() { find grids -maxdepth 1 -name '*.sdf.h5' 2>/dev/null | wc -l; }
# Lines of a log of --json, by status.
count() { grep -c "\"status\":\"$1\"" "$2" || true; }

by_parallel() { bash -c "${recipe/ --shard/ --json --shard}" >"$1"; }

# An array job: all of its tasks at once, each with one core. Coarser grids than the script's, for time.
by_slurm() {
    local task tasks=() status=0
    for task in $(seq 0 15); do
        SLURM_ARRAY_TASK_ID=$task SLURM_ARRAY_TASK_COUNT=16 SLURM_CPUS_PER_TASK=1 bash -c "${script/--res 128/--res 48}" &
        tasks+=($!)
    done
    for task in "${tasks[@]}"; do wait "$task" || status=1; done
    cat log.*.jsonl >"$1"
    return $status
}
# shellcheck disable=SC2016
printf '#!/bin/sh\nexec "$@"\n' >bin/srun
chmod +x bin/srun

survives() {
    local shell worker killed=0 there leftovers grid
    rm -rf grids
    "by_$1" first.jsonl 2>/dev/null &
    shell=$!
    until [ "$(grids)" -ge 10 ]; do kill -0 $shell 2>/dev/null || fail "$1: the recipe ended early"; sleep 0.02; done
    for worker in $(ps -eo pid=,args= | awk '$2 == "sdftool" && /--list meshes.txt/ { print $1 }'); do
        [ $killed -lt 3 ] && [ "$(readlink "/proc/$worker/cwd" 2>/dev/null)" = "$folder" ] && kill -9 "$worker" 2>/dev/null && killed=$((killed + 1))
    done
    wait $shell && [ $killed -gt 0 ] && fail "$1 did not see that workers were killed"
    there=$(grids)
    [ $killed = 3 ] && [ "$there" -lt 200 ] || fail "$1: $killed workers killed, $there grids there: too late"

    "by_$1" again.jsonl
    "by_$1" third.jsonl
    [ "$(grids)" = 200 ] || fail "$1: $(grids) grids of 200"
    [ "$(count kept third.jsonl)" = 200 ] || fail "$1: the third run kept $(count kept third.jsonl) of 200"
    for grid in grids/*.sdf.h5; do sdftool info "$grid" >/dev/null || fail "$grid does not open"; done
    leftovers=$(find grids -mindepth 1 -not -name '*.sdf.h5' | wc -l)
    [ "$leftovers" = 0 ] || fail "$leftovers leftovers"
    echo "fleet: $1: $killed workers killed after $there of 200 grids; the second run baked $(count baked again.jsonl), the third none"
}
survives parallel
survives slurm
