#!/usr/bin/env bash
# Runs every scene at an eighth of its size, by faces. Each must stay finite, and those that follow must reach what they ask for.
set -euo pipefail
cd "$(dirname "$0")/.."

cargo build --release --locked --quiet -p sdftool
results=$(mktemp)
trap 'rm -f "$results"' EXIT
"${CARGO_TARGET_DIR:-target}/release/sdftool" simulate --suite --small --json > "$results"

must_reach='04-ropes 05-cone 07-boxes 09-cloth-on-soft-pot 10-cylinder 10-torus 12-thin-shell 12-thin-wall 15-spin'
for scene in $must_reach; do
    line=$(grep "\"scene\":\"$scene\"" "$results" | grep '"method":"auto"')
    [[ $line == *'"missed":{}'* ]] || { echo "$scene misses what it asks for: $line" >&2; exit 1; }
done
# What shows an explosion is meant to explode.
if grep -v one-way "$results" | grep '"finite":false' >&2; then
    echo 'a scene is not finite' >&2
    exit 1
fi
wc -l < "$results" | xargs printf '%s scenes\n'
