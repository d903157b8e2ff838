#!/usr/bin/env bash
# Coverage-guided fuzzing (libFuzzer) of every reader and of the search for contacts: fuzz/src/lib.rs lists the targets.
#
#   .ci/fuzz.sh SECONDS [TARGET...]    each target for its share of the seconds, from the corpus in fuzz/corpus; all if none is named
#
# An input that fails is kept as fuzz/artifacts/TARGET-*; `TARGET_BINARY FILE` repeats it. Needs a C++ compiler, which it installs as
# root on Debian. No nightly compiler: coverage counters come from a pass of LLVM's, and there is no unsafe code for a sanitizer.
set -euo pipefail
cd "$(dirname "$0")/.."
. .ci/packages.sh
seconds=${1:?how many seconds in all?}
shift
targets=("$@")
[ ${#targets[@]} -gt 0 ] || targets=(obj ply stl off grid field scene points contact)
command -v c++ >/dev/null || install_packages g++

host=$(rustc -vV | sed -n 's/^host: //p')
counters="-Cpasses=sancov-module"
for option in level=4 inline-8bit-counters pc-table trace-compares; do
    counters+=" -Cllvm-args=-sanitizer-coverage-$option"
done
# With --target, build scripts and macros have no counters.
RUSTFLAGS="--cfg fuzzing $counters" cargo build --release --locked --quiet --manifest-path fuzz/Cargo.toml --target "$host" --bins

mkdir -p fuzz/artifacts
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
share=$(((seconds + ${#targets[@]} - 1) / ${#targets[@]}))
for target in "${targets[@]}"; do
    mkdir "$folder/$target"
    corpus=fuzz/corpus/$target
    [ "$target" != scene ] || corpus=scenes
    # New inputs go to the first folder; the corpus of the repository is only read.
    "${CARGO_TARGET_DIR:-fuzz/target}/$host/release/$target" "$folder/$target" "$corpus" -max_total_time="$share" -timeout=10 \
        -rss_limit_mb=1024 -max_len=32768 -print_final_stats=1 -verbosity=0 -artifact_prefix="fuzz/artifacts/$target-" \
        2>"$folder/log" || { cat "$folder/log" >&2; exit 1; }
    echo "$target: $(sed -n 's/^stat::number_of_executed_units: *//p' "$folder/log") inputs, none failed"
done
