#!/usr/bin/env bash
# Runs the recipe of docs/fleets.md for GNU parallel on 200 meshes, kills three workers with SIGKILL, and runs it again: no grid may be
# lost or partial, and a third run bakes nothing. As root on Debian it installs parallel if it is missing.
set -euo pipefail
cd "$(dirname "$0")/.."

fail() { echo "fleet: $*" >&2; exit 1; }

if ! command -v parallel >/dev/null; then
    [ "$(id -u)" = 0 ] || fail "needs parallel"
    export DEBIAN_FRONTEND=noninteractive
    { apt-get update && apt-get install --yes --no-install-recommends parallel; } >/dev/null || fail "apt-get cannot install parallel"
fi
if [ -z "${SDFTOOL:-}" ]; then
    cargo build --release --locked --quiet -p sdftool
    SDFTOOL=${CARGO_TARGET_DIR:-target}/release/sdftool
fi
SDFTOOL=$(realpath "$SDFTOOL")
recipe=$(grep '^parallel ' docs/fleets.md)
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

bash -c "$recipe" >/dev/null 2>&1 &
shell=$!
until [ "$(grids)" -ge 10 ]; do kill -0 $shell 2>/dev/null || fail "the recipe ended early"; sleep 0.02; done
killed=0
for worker in $(ps -eo pid=,args= | awk '$2 == "sdftool" && /--list meshes.txt/ { print $1 }' | head -n 3); do
    [ "$(readlink "/proc/$worker/cwd" 2>/dev/null)" = "$folder" ] && kill -9 "$worker" 2>/dev/null && killed=$((killed + 1))
done
wait $shell && [ $killed -gt 0 ] && fail "parallel did not see that workers were killed"
there=$(grids)
[ $killed = 3 ] && [ "$there" -lt 200 ] || fail "$killed workers killed, $there grids there: too late"

bash -c "${recipe/ --shard/ --json --shard}" >again.jsonl
bash -c "${recipe/ --shard/ --json --shard}" >third.jsonl
[ "$(grids)" = 200 ] || fail "$(grids) grids of 200"
[ "$(count kept third.jsonl)" = 200 ] || fail "the third run kept $(count kept third.jsonl) of 200"
for grid in grids/*.sdf.h5; do sdftool info "$grid" >/dev/null || fail "$grid does not open"; done
leftovers=$(find grids -mindepth 1 -not -name '*.sdf.h5' | wc -l)
[ "$leftovers" = 0 ] || fail "$leftovers leftovers"
echo "fleet: $killed workers killed after $there of 200 grids; the second run baked $(count baked again.jsonl), the third none"
