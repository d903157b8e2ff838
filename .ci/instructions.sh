#!/usr/bin/env bash
# Counts the instructions of fixed workloads by valgrind and compares them with .ci/instructions.txt: noise on the machine does not
# change them. Fails if one takes over 5 % more, or over 5 % less, so that the file is renewed.
#
#     .ci/instructions.sh            compare
#     .ci/instructions.sh --write    count anew and write the file
#
# Valgrind emulates a processor with AVX2 and without AVX-512 if this one has AVX2: so every such machine gives the same counts.
# Elsewhere nothing is counted. Counts depend on the compiler, whose version is in the file: with another one they are printed and
# not compared.
set -euo pipefail
cd "$(dirname "$0")/.."
. .ci/packages.sh

counts=.ci/instructions.txt
tolerance=5
[ "$(uname -m)" = x86_64 ] && grep -qw avx2 /proc/cpuinfo || { echo "instructions: no x86-64 with AVX2 here: not counted"; exit 0; }
command -v valgrind >/dev/null || install_packages valgrind
cargo build --release --locked --quiet -p sdf-bench --bin speed
speed=$(realpath "${CARGO_TARGET_DIR:-target}")/release/speed
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT

main() {
    local written compared=yes status=0 kernel
    written=$(sed -n 's/^# rustc //p' "$counts")
    [ "$written" = "$(compiler)" ] || compared=no
    # In parallel: counts do not depend on it.
    kernels | xargs -P "$(nproc)" -I{} bash -c 'count "$1" 0 && count "$1" 1' _ {}
    if [ "${1:-}" = --write ]; then
        { grep '^#' "$counts" | sed "s/^# rustc .*/# rustc $(compiler)/"; for kernel in $(kernels); do echo "$kernel $(net_count "$kernel")"; done; } \
            >"$folder/new"
        cp "$folder/new" "$counts"
        cat "$counts"
        return
    fi
    for kernel in $(kernels); do check "$kernel" "$compared" || status=1; done
    [ "$compared" = yes ] || echo "instructions: counts are of rustc $written: not compared; renew them by .ci/instructions.sh --write"
    return $status
}

kernels() { sed -n 's/^\([a-z][a-z0-9-]*\) .*/\1/p' "$counts"; }

compiler() { rustc --version | cut -d ' ' -f 2; }

# Counts the instructions of a run with the given number of repetitions, into a file.
count() {
    local log=$folder/$1.$2.log
    # An empty environment, so that it cannot change a count.
    env -i RAYON_NUM_THREADS=1 valgrind --tool=callgrind --callgrind-out-file=/dev/null "$speed" --kernel "$1" --times "$2" \
        >"$log" 2>&1 || { cat "$log" >&2; return 1; }
    sed -n 's/.*Collected : //p' "$log" >"$folder/$1.$2"
}
export -f count
export folder speed

net_count() { echo $(($(cat "$folder/$1.1") - $(cat "$folder/$1.0"))); }

check() {
    local kernel=$1 compared=$2 found wanted change
    found=$(net_count "$kernel")
    wanted=$(sed -n "s/^$kernel //p" "$counts")
    change=$(((found - wanted) * 1000 / wanted))
    printf 'instructions: %-26s %13d, %13d in the file: %s%d.%d %%\n' "$kernel" "$found" "$wanted" \
        "$( ((change < 0)) && echo - || echo +)" $((${change#-} / 10)) $((${change#-} % 10))
    [ "$compared" = yes ] || return 0
    if ((change > tolerance * 10)); then
        echo "instructions: $kernel has become slower" >&2
        return 1
    elif ((change < -tolerance * 10)); then
        echo "instructions: $kernel has become faster: renew the file by .ci/instructions.sh --write" >&2
        return 1
    fi
}

main "$@"
