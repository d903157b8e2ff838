#!/usr/bin/env bash
# Finds contacts on an emulated Cortex-M4F and on this computer, and compares the output byte for byte. Checks that the grid is in the
# flash of the board's program, and that the program has neither panics nor an allocator.
#
#  1. A Rust program with one contact, whose grid its build bakes.
#  2. The queries of docs/firmware.md, each linked alone: none can panic, and none computes in double where it should not.
#  3. A C program with 800 queries and a body that the program baked: the chapter Firmware of the README, to the letter. It has no soft
#     double either. The program is that of SDFTOOL, else the project's release.
#
#     .ci/firmware.sh               all of that
#     .ci/firmware.sh --table       writes the table of docs/firmware.md: sizes of queries on four processors
#
# Debian's compiler builds the board's program, because it includes the source of `core` for -Z build-std. As root this installs
# it and the emulator if they are missing. --may-remove, for a disposable machine, lets that remove conflicting packages, such as
# another version of qemu-utils.
set -euo pipefail

root=$(realpath "$(dirname "$0")/..")
. "$root/.ci/packages.sh"
workspace=$root/tests/firmware
target_dir=$(realpath -m "${CARGO_TARGET_DIR:-$workspace/target}")
triple=thumbv7em-none-eabihf
elf=$target_dir/board/$triple/release/board
sdftool=${SDFTOOL:+$(realpath "$SDFTOOL")}
apt_options=--no-remove apt_advice='if other packages conflict, pass --may-remove' task=check
for option; do
    case $option in
        --may-remove) apt_options=--remove ;;
        --table) task=table ;;
        *) echo "firmware: unknown option $option" >&2; exit 2 ;;
    esac
done
packages=(rustc-web cargo-web rust-web-src rust-web-llvm lld-22 llvm-22 qemu-system-arm gcc gcc-arm-none-eabi python3)
unwanted='panick|rust_begin_unwind|core::fmt|__rust_(re)?alloc|malloc'

main() {
    cd "$workspace"
    install_packages "${packages[@]}"
    [ "$task" = check ] || { write_table; return; }
    echo "firmware: board $(/usr/bin/rustc --version), host $(rustc --version), $(qemu-system-arm --version | head -n 1)"

    cargo build --quiet --locked --release --package host --target-dir "$target_dir/host"
    "$target_dir/host/release/host" >"$target_dir/host.txt"
    cat "$target_dir/host.txt"

    check_board "square roots by the processor" --features core-math
    check_queries
    check_board "square roots by libm"
    echo "firmware: contact on Cortex-M4F equals the host's, $code bytes of code, $grid bytes of grid in flash"
    check_door
}

# Builds the board's program with the given options, inspects it and runs it.
check_board() {
    local name=$1
    shift
    RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1 RUSTFLAGS='' /usr/bin/cargo build --quiet --locked --release \
        -Z build-std=core --package board --target "$triple" --target-dir "$target_dir/board" "$@" ||
        fail "$name: the board's program does not build"

    local symbols found
    symbols=$(llvm-nm-22 --demangle --print-size "$elf")
    found=$(grep -E "$unwanted" <<<"$symbols" || true)
    [ -z "$found" ] || fail "$name: the program can panic or allocate:"$'\n'"$found"

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

    run_board "$elf" >"$target_dir/board.txt" || fail "$name: the board ended with status $?"
    local unused
    unused=$(sed -n 's/^bytes of stack never used: //p' "$target_dir/board.txt")
    ((${unused:-0} >= 128)) || fail "$name: the stack has ${unused:-0} bytes left of the board's RAM: beyond them contacts are wrong without a word"
    echo "firmware: $name: $unused bytes of RAM are left by the stack"
    sed -i '$d' "$target_dir/board.txt"
    diff --label host --label board -u "$target_dir/host.txt" "$target_dir/board.txt" ||
        fail "$name: the board's contact differs from the host's"
}

run_board() {
    timeout 60 qemu-system-arm -M mps2-an386 -display none -serial none -monitor none \
        -chardev stdio,id=console -semihosting-config enable=on,target=native,chardev=console -kernel "$1" </dev/null
}

# Beside the board's program, with which they share all crates.
check_queries() {
    RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1 RUSTFLAGS='' /usr/bin/cargo build --quiet --locked --release \
        -Z build-std=core --package sizes --target "$triple" --target-dir "$target_dir/board" || fail "the queries do not build"
    queries | python3 table.py --check "$target_dir/board/$triple/release/libsizes.a" || fail "a query has what no firmware should have"
    echo "firmware: $(queries | wc -l) queries, each linked alone: no panic, and no double but in proofs and bounds"
}

# The names of the queries, one a line.
queries() {
    sed -n 's/.* "\([^"]*\.[^"]*\..*\)";$/\1/p; s/.*export_name = "\([^"]*\)".*/\1/p' sizes/src/lib.rs | grep '\..*\.'
}

# The door for C: docs/firmware.md.
check_door() {
    local folder=$target_dir/door symbols found address size
    if [ -z "$sdftool" ]; then
        (cd "$root" && cargo build --release --locked --quiet -p sdftool)
        sdftool=$(realpath "${CARGO_TARGET_DIR:-$root/target}")/release/sdftool
    fi
    rm -rf "$folder"
    mkdir -p "$folder"
    cd "$folder"
    ln -s "$root/bindings" bindings
    ln -s "$sdftool" sdftool
    ./sdftool demo >/dev/null
    awk '/^#/ { on = $0 == "### Firmware" } on && $0 == "```" { block = 0 } block { print } on && $0 == "```sh" { block = 1 }' \
        "$root/README.md" >chapter.sh
    grep -q 'bindings/firmware/build.sh' chapter.sh || fail "README.md has no chapter Firmware"
    PATH=$folder:$PATH CARGO=/usr/bin/cargo RUSTC=/usr/bin/rustc CARGO_TARGET_DIR=$target_dir/door-board bash -e chapter.sh >/dev/null

    local said
    ! said=$(RUSTC=/bin/false sh bindings/firmware/build.sh "$triple" none 2>&1) || fail "the library was built without Rust"
    [[ $said =~ ^[^$'\n']*"rustup target add $triple"[^$'\n']*$ ]] || fail "without Rust for the board, build.sh says: $said"

    # The same C source and the same library on this computer.
    CARGO_TARGET_DIR=$target_dir/door-host sh bindings/firmware/build.sh "$(rustc --print host-tuple)" host dense-u16,smooth
    cc -O2 -I host bindings/firmware/examples/board/{main,host}.c body.c host/libsdftool_firmware.a -lpthread -ldl -lm -o host/board
    host/board >host.txt
    run_board board.elf >board.txt || fail "the C program ended with status $?"
    diff --label host --label board -u host.txt board.txt || fail "the C program's contacts differ from the host's"
    grep -qE '^margins (00000001 ){8}$' board.txt || fail "the C program takes margins that are no lengths: $(grep margins board.txt)"
    grep -qE '^opened 00000000 $' board.txt || fail "the C program did not open its blob: $(head -n 2 board.txt)"

    symbols=$(llvm-nm-22 --demangle --print-size board.elf)
    found=$(grep -E "$unwanted|__aeabi_(d[a-z]|[a-z0-9]+2d)|__[a-z]+df" <<<"$symbols" || true)
    [ -z "$found" ] || fail "the C program can panic or allocate, or has soft doubles:"$'\n'"$found"
    read -r address size _ < <(grep ' body_sdf$' <<<"$symbols") || fail "the blob is not in the C program"
    ((16#$address < 16#20000000)) || fail "the blob is at 0x$address, not in flash"
    elf=$folder/board.elf
    echo "firmware: C: $(tail -n 1 board.txt)of 800 queries are the host's bit for bit: code $(section .text), blob $((16#$size)) at" \
        "0x$address, data $(section .data), bss $(section .bss) bytes; no panic, no allocator, no double"
}

# Sizes of queries, each linked alone, in the place of the table in docs/firmware.md.
write_table() {
    local page=$root/docs/firmware.md table=$target_dir/table.md libraries=() name triple flags
    while IFS='|' read -r name triple flags; do
        RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1 RUSTFLAGS="-Zemit-stack-sizes $flags" /usr/bin/cargo build --quiet --locked --release \
            -Z build-std=core -Z build-std-features=compiler-builtins-mem --package sizes --target "$triple" \
            --target-dir "$target_dir/sizes-${name// /-}" </dev/null || fail "$name: the queries do not build"
        libraries+=("$name=$target_dir/sizes-${name// /-}/$triple/release/libsizes.a")
    done <<'END'
Cortex-M0+|thumbv6m-none-eabi|
Cortex-M4F|thumbv7em-none-eabihf|-Ctarget-cpu=cortex-m4
Cortex-M7|thumbv7em-none-eabihf|-Ctarget-cpu=cortex-m7
RISC-V IMAC|riscv32imac-unknown-none-elf|
END
    queries | python3 table.py "${libraries[@]}" >"$table"
    python3 - "$page" "$table" <<'END'
import sys
page, table = (open(path).read() for path in sys.argv[1:])
start, end = "<!-- table -->\n", "<!-- end -->"
before, rest = page.split(start)
open(sys.argv[1], "w").write(before + start + table + end + rest.split(end)[1])
END
    cat "$table"
}

section() {
    llvm-size-22 -A "$elf" | awk -v section="$1" '$1 == section { print $2 }'
}

fail() {
    echo "firmware: $*" >&2
    exit 1
}

main
