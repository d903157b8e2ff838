#!/usr/bin/env bash
# Finds one contact on an emulated Cortex-M4F and on this computer, and compares the output byte for byte. Checks that the grid is
# in the flash of the board's program, and that the program has neither panics nor an allocator.
#
# Debian's compiler builds the board's program, because it includes the source of `core` for -Z build-std. As root this installs
# it and the emulator if they are missing. --may-remove, for a disposable machine, lets that remove conflicting packages, such as
# another version of qemu-utils.
set -euo pipefail

workspace=$(realpath "$(dirname "$0")/../tests/firmware")
target_dir=$(realpath -m "${CARGO_TARGET_DIR:-$workspace/target}")
triple=thumbv7em-none-eabihf
elf=$target_dir/board/$triple/release/board
removal=--no-remove
[ "${1:-}" != --may-remove ] || removal=--remove
packages=(rustc-web cargo-web rust-web-src rust-web-llvm lld-22 llvm-22 qemu-system-arm)

main() {
    cd "$workspace"
    install_packages
    echo "firmware: board $(/usr/bin/rustc --version), host $(rustc --version), $(qemu-system-arm --version | head -n 1)"

    cargo build --quiet --locked --release --package host --target-dir "$target_dir/host"
    "$target_dir/host/release/host" >"$target_dir/host.txt"
    cat "$target_dir/host.txt"

    check_board "square roots by the processor" --features core-math
    check_board "square roots by libm"
    echo "firmware: contact on Cortex-M4F equals the host's, $code bytes of code, $grid bytes of grid in flash"
}

install_packages() {
    local missing=() package
    for package in "${packages[@]}"; do
        [ "$(dpkg-query -W -f '${db:Status-Status}' "$package" 2>&1)" = installed ] || missing+=("$package")
    done
    [ ${#missing[@]} -gt 0 ] || return 0
    [ "$(id -u)" = 0 ] || fail "not installed: ${missing[*]}; install them, or run this as root"
    echo "firmware: installing ${missing[*]}"
    export DEBIAN_FRONTEND=noninteractive
    { apt-get update && apt-get install --yes --no-install-recommends "$removal" "${missing[@]}"; } >/dev/null ||
        fail "apt-get cannot install ${missing[*]}; if other packages conflict, pass --may-remove"
}

# Builds the board's program with the given options, inspects it and runs it.
check_board() {
    local name=$1
    shift
    RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1 RUSTFLAGS='' /usr/bin/cargo build --quiet --locked --release \
        -Z build-std=core --package board --target "$triple" --target-dir "$target_dir/board" "$@" ||
        fail "$name: the board's program does not build"

    local symbols unwanted
    symbols=$(llvm-nm-22 --demangle --print-size "$elf")
    unwanted=$(grep -E 'panick|rust_begin_unwind|core::fmt|__rust_(re)?alloc|malloc' <<<"$symbols" || true)
    [ -z "$unwanted" ] || fail "$name: the program can panic or allocate:"$'\n'"$unwanted"

    # A line of symbols: address, size, kind (r: read-only data), name. Flash ends where RAM begins.
    local address size kind
    read -r address size kind _ < <(grep 'scene::SAMPLES$' <<<"$symbols") || fail "$name: the grid is not in the program"
    if [ "$kind" != r ] || ((16#$address >= 16#20000000)); then
        fail "$name: the grid is at 0x$address, not in flash"
    fi
    grid=$((16#$size))
    code=$(section .text)
    echo "firmware: $name: code $code, other constants $(($(section .rodata) - grid)), grid $grid at 0x$address," \
        "data $(section .data), bss $(section .bss) bytes; no panic, no allocator"

    timeout 60 qemu-system-arm -M mps2-an386 -display none -serial none -monitor none \
        -chardev stdio,id=console -semihosting-config enable=on,target=native,chardev=console \
        -kernel "$elf" </dev/null >"$target_dir/board.txt" || fail "$name: the board ended with status $?"
    diff --label host --label board -u "$target_dir/host.txt" "$target_dir/board.txt" ||
        fail "$name: the board's contact differs from the host's"
}

section() {
    llvm-size-22 -A "$elf" | awk -v section="$1" '$1 == section { print $2 }'
}

fail() {
    echo "firmware: $*" >&2
    exit 1
}

main
