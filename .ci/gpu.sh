#!/usr/bin/env bash
# Builds the GPU kernels from the source of `core`, assembles them by NVIDIA's ptxas for two generations of cards, and compares what
# each kernel takes with .ci/gpu.txt. No card is needed.
#
#     .ci/gpu.sh              compare
#     .ci/gpu.sh --write      write the file anew, and the table of docs/gpu.md after it
#     .ci/gpu.sh --out DIR    build only: DIR/kernels.ptx, DIR/kernels.sm_80.cubin, DIR/kernels.sm_90.cubin
#     .ci/gpu.sh --model ...  build, and run kernels.ptx on the CPU for the scenes of docs/gpu.md, with a model of an H100's times
#                             (options of sdf-bench's gpu, such as --only Dragon)
#
# Fails if a kernel has more spilled bytes, f64 operations or calls than in the file, if any is contracted to an fma, or if something
# external is called. Registers and stack depend on the compilers, whose versions are in the file: they are compared where those are
# the same, and may not grow.
#
# Debian's compiler builds the kernels, because it includes the source of `core` for -Z build-std; ptxas comes from PyPI. As root
# this installs what is missing.
set -euo pipefail
cd "$(dirname "$0")/.."
. .ci/packages.sh

file=.ci/gpu.txt
table=docs/gpu.md
ptxas_package=nvidia-cuda-nvcc-cu12==12.9.86
targets=(sm_80 sm_90)
target_dir=$(realpath -m "${CARGO_TARGET_DIR:-target}")/gpu-kernels
ptx=$target_dir/kernels.ptx
venv=$target_dir/venv
# Kernels that are assembled for no more registers than this, as they spill none: 16 blocks of 64 threads fit on a multiprocessor.
narrow=(search_faces_dense_frank_wolfe search_faces_dense_projected_gradient)
narrow_registers=64
# Lean contacts are for small meshes, which do not fill a card: the assembler is told that few blocks of a launch's 64 threads are
# enough, and then loads all samples of a cell at once.
lean_launch='.maxntid 64, 1, 1\n.minnctapersm 4'
packages=(rustc-web cargo-web rust-web-src rust-web-llvm llvm-22 python3 python3-venv)

main() {
    install_packages "${packages[@]}"
    install_ptxas
    build
    case ${1:-} in
        --out)
            mkdir -p "$2"
            cp "$ptx" "$2"
            for target in "${targets[@]}"; do cp "$target_dir/$target.cubin" "$2/kernels.$target.cubin"; done
            ;;
        --write)
            { grep '^#' "$file" | sed "s/^# versions: .*/# versions: $(versions)/"; measure; } >"$target_dir/new"
            cp "$target_dir/new" "$file"
            document >"$target_dir/new"
            cp "$target_dir/new" "$table"
            ;;
        --model)
            shift
            model "$@"
            ;;
        *) compare && run_ptx ;;
    esac
}

install_ptxas() {
    [ ! -x "$(ptxas)" ] || return 0
    mkdir -p "$target_dir"
    python3 -m venv "$venv"
    "$venv/bin/pip" install --quiet --disable-pip-version-check "$ptxas_package"
}

ptxas() { echo "$venv"/lib/python3*/site-packages/nvidia/cuda_nvcc/bin/ptxas; }

versions() { echo "$(/usr/bin/rustc --version | cut -d ' ' -f 2), $ptxas_package"; }

build() {
    RUSTC=/usr/bin/rustc RUSTC_BOOTSTRAP=1 RUSTFLAGS="-C target-cpu=${targets[0]} -C linker=$PWD/gpu/kernels/link -C llvm-args=-inline-threshold=100000" \
        CARGO_TARGET_DIR=$target_dir /usr/bin/cargo build --quiet --locked --release --manifest-path gpu/kernels/Cargo.toml \
        -Z build-std=core --target nvptx64-nvidia-cuda || fail "the kernels do not build"
    cp "$target_dir/nvptx64-nvidia-cuda/release/sdf_gpu_kernels.ptx" "$ptx"
    local kernel
    for kernel in "${narrow[@]}"; do
        sed -i "/\.entry $kernel(/,/^{/ s/^)[^{]*$/)\n.maxnreg $narrow_registers/" "$ptx"
        grep -A 6 "\.entry $kernel(" "$ptx" | grep -q maxnreg || fail "$kernel: no place for its number of registers"
    done
    sed -i "/\.entry lean_/,/^{/ s/^)[^{]*$/)\n$lean_launch/" "$ptx"
    # A fma or an approximation would change bits, ftz the smallest numbers.
    local forbidden
    forbidden=$(grep -nE '\bfma\.|\.approx|\.ftz|\.extern' "$ptx" | head -n 3 || true)
    [ -z "$forbidden" ] || fail "the kernels contract, approximate or call something external: $forbidden"
    # Both generations at once.
    local target index assembling=()
    for target in "${targets[@]}"; do
        "$(ptxas)" --verbose --gpu-name "$target" "$ptx" --output-file "$target_dir/$target.cubin" 2>"$target_dir/$target.log" &
        assembling+=($!)
    done
    for index in "${!targets[@]}"; do
        wait "${assembling[$index]}" || fail "ptxas: $(tail -n 1 "$target_dir/${targets[$index]}.log")"
    done
}

# A line per kernel and target: name, target, registers, bytes of stack, spilled bytes, f64 operations, calls.
measure() {
    local target
    for target in "${targets[@]}"; do
        awk -v target="$target" '
            # PTX: what stands in the kernel itself. Conversions are no operations.
            FNR == NR && /\.entry/ { kernel = $3; sub(/\(.*/, "", kernel); f64[kernel] = calls[kernel] = 0 }
            FNR == NR && /^}/ { kernel = "" }
            FNR == NR && kernel && /(add|sub|mul|div|sqrt|min|max|setp\.[a-z]+)(\.rn)?\.f64/ { f64[kernel]++ }
            FNR == NR && kernel && /^[ \t{]*call/ { calls[kernel]++ }
            FNR == NR { next }
            # The log of ptxas.
            /Compiling entry function/ { split($0, quoted, "\047"); kernel = quoted[2] }
            /bytes stack frame/ && kernel { stack[kernel] = $1; spilled[kernel] = $5 + $9 }
            /Used [0-9]+ registers/ && kernel {
                match($0, /Used [0-9]+/)
                print kernel, target, substr($0, RSTART + 5, RLENGTH - 5), stack[kernel], spilled[kernel], f64[kernel], calls[kernel]
                kernel = ""
            }' "$ptx" "$target_dir/$target.log"
    done | sort
}

# docs/gpu.md with the numbers of the file in the table of kernels.
document() {
    awk '
        FNR == NR { if ($2 == "sm_90") of[$1] = $3 " | " $4 " | " $5 " | " $6 " | " $7; next }
        match($0, /^\| `[a-z0-9_]+` \|/) {
            kernel = substr($0, 4, RLENGTH - 6)
            if (kernel in of) { print "| `" kernel "` | " of[kernel] " |"; next }
        }
        { print }' "$file" "$table"
}

compare() {
    document | cmp -s - "$table" || fail "the table of $table is not that of $file: .ci/gpu.sh --write"
    local same=yes status=0 line
    [ "$(sed -n 's/^# versions: //p' "$file")" = "$(versions)" ] || same=no
    measure >"$target_dir/found"
    # Both files have the kernel and the target first.
    awk -v same="$same" '
        /^#/ { next }
        FNR == NR { wanted[$1 " " $2] = $3 " " $4 " " $5 " " $6 " " $7; next }
        {
            key = $1 " " $2
            if (!(key in wanted)) { print "gpu: " key " is not in .ci/gpu.txt: renew it by .ci/gpu.sh --write"; failed = 1; next }
            split(wanted[key], w, " ")
            split("registers,bytes of stack,spilled bytes,f64 operations,calls", names, ",")
            for (i = same == "yes" ? 1 : 3; i <= 5; i++) {
                if ($(i + 2) > w[i]) { print "gpu: " key ": " $(i + 2) " " names[i] ", " w[i] " in .ci/gpu.txt"; failed = 1 }
            }
            delete wanted[key]
        }
        END {
            for (key in wanted) { print "gpu: " key " is in .ci/gpu.txt, but not a kernel: renew it by .ci/gpu.sh --write"; failed = 1 }
            exit failed
        }' "$file" "$target_dir/found" >&2 || status=1
    awk '$1 == "search_faces_dense_frank_wolfe" {
        print "gpu: Frank-Wolfe on faces and a dense grid, " $2 ": " $3 " registers, " $4 " bytes of stack, " $5 " spilled, " $6 " f64"
    }' "$target_dir/found"
    [ "$same" = yes ] || echo "gpu: registers and stack are of $(sed -n 's/^# versions: //p' "$file"): not compared"
    [ $status = 0 ] || fail "a kernel takes more than before; if it must, renew the file by .ci/gpu.sh --write and say why"
    echo "gpu: $(wc -l <"$target_dir/found") kernels as in $file"
}

# The tests of contacts by the instructions of the PTX, and not by the source of the kernels.
run_ptx() {
    # Of the workspace, not of the package: with the same features, tests of all compile its crates once.
    SDF_STUB_KERNELS=$ptx cargo test --quiet --locked --workspace --test contacts --test ptx ||
        fail "kernels.ptx does not find the contacts of the source"
}

model() {
    cargo build --quiet --release --locked -p sdf-gpu-stub -p sdf-bench
    local built stub=$target_dir/stub
    built=$(realpath "${CARGO_TARGET_DIR:-target}")/release
    mkdir -p "$stub"
    cp "$built/libsdf_gpu_stub.so" "$stub/libcuda.so"
    SDF_STUB_LAUNCHES=1 LD_LIBRARY_PATH=$stub "$built/gpu" "$ptx" --repetitions 1 "$@"
}

fail() {
    echo "gpu: $*" >&2
    exit 1
}

main "$@"
