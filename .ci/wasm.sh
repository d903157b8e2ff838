#!/usr/bin/env bash
# Builds the door for browsers by the commands of its chapter in the README, to the letter, runs them, and compares what it finds with
# what the program finds: in node, and in headless Chromium, on whose page meshes are dropped. Refuses a module of more than 1 MB.
# The program is that of SDFTOOL, else the project's release. A picture is left in the folder named by OUT, if it is set.
#
# As root on Debian it installs what is missing. Without node, the module is built and measured, and not run.
set -euo pipefail
cd "$(dirname "$0")/.."
. .ci/packages.sh

fail() { echo "wasm: $*" >&2; exit 1; }

# Rust with the browsers' target, or Debian's, whose packages have the source of the standard library.
packages=()
if ! ls "$(rustc --print sysroot)/lib/rustlib/wasm32-unknown-unknown/lib/"libstd-*.rlib >/dev/null 2>&1; then
    packages=(rustc-web cargo-web rust-web-src rust-web-llvm lld-22)
fi
install_packages "${packages[@]}" chromium python3
CARGO_TARGET_DIR=$(realpath -m "${CARGO_TARGET_DIR:-target}")
export CARGO_TARGET_DIR
if [ -z "${SDFTOOL:-}" ]; then
    cargo build --release --locked --quiet -p sdftool
    SDFTOOL=$CARGO_TARGET_DIR/release/sdftool
fi
SDFTOOL=$(realpath "$SDFTOOL")
folder=$(mktemp -d)
out=$(realpath "${OUT:-$folder}")
server=
trap '[ -z "$server" ] || kill "$server"; rm -rf "$folder" sdftool-web' EXIT

# The blocks of one language in the chapter, as .ci/bindings.sh has it.
chapter() { awk -v title="### Browser" -v fence="\`\`\`$1" '/^#/ { on = $0 == title } on && $0 == "```" { block = 0 } block { print } on && $0 == fence { block = 1 }' README.md; }

chapter sh >"$folder/build.sh"
grep -q 'bindings/wasm/build.sh' "$folder/build.sh" || fail "README.md does not build the module"
bash -e "$folder/build.sh"
packed=$(gzip -9c sdftool-web/sdftool.wasm | wc -c)
[ "$packed" -le 1000000 ] || fail "the module has $packed bytes gzipped: more than 1 MB"
echo "wasm: module $(stat -c %s sdftool-web/sdftool.wasm) bytes, $packed gzipped"

if ! command -v node >/dev/null; then
    echo "wasm: no node here: the module was built, and not run"
    exit 0
fi
chapter js >"$folder/chapter.mjs"
grep -q sdftool.js "$folder/chapter.mjs" || fail "README.md has no program for the module"
node --input-type=module <"$folder/chapter.mjs"
node bindings/wasm/tests/native.mjs sdftool-web "$SDFTOOL"

port=$(python3 -c 'import socket; s = socket.socket(); s.bind(("127.0.0.1", 0)); print(s.getsockname()[1])')
python3 -m http.server --bind 127.0.0.1 -d sdftool-web "$port" >/dev/null 2>&1 &
server=$!
(cd "$folder" && "$SDFTOOL" demo -o demo >/dev/null)
node bindings/wasm/tests/page.mjs "http://127.0.0.1:$port/" "$folder/demo/body.obj" "$folder/demo/cloth.obj" "$SDFTOOL" "$out/browser.png"
