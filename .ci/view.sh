#!/usr/bin/env bash
# Opens a page of `sdftool view` in headless Chromium: it must be drawn without an error of WebGL, in the colours of the surface, the
# mesh and the contacts, and a contact that is picked must have the numbers of the contact list. Far from the origin, and with a vertex
# that no face uses, the picture must be the same. So must a page of `sdftool simulate` be drawn, in the colours of a cloth and a body.
# As root on Debian it installs Chromium if it is missing. Pictures are left in the folder named by OUT, if it is set.
set -euo pipefail
cd "$(dirname "$0")/.."
. .ci/packages.sh

fail() { echo "view: $*" >&2; exit 1; }

command -v chromium >/dev/null || install_packages chromium
if [ -z "${SDFTOOL:-}" ]; then
    cargo build --release --locked --quiet -p sdftool
    SDFTOOL=${CARGO_TARGET_DIR:-target}/release/sdftool
fi
SDFTOOL=$(realpath "$SDFTOOL")
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
out=$(realpath "${OUT:-$folder}")

open() {
    timeout 120 chromium --headless --no-sandbox --disable-quic --no-first-run --disable-background-networking \
        --disable-component-update --disable-sync --user-data-dir="$folder/profile" --use-angle=swiftshader \
        --enable-unsafe-swiftshader --window-size=1000,700 --virtual-time-budget=20000 "$@" 2>"$folder/chromium.txt"
}

scene=$PWD/scenes/02-coarse-cloth.toml
cd "$folder"
"$SDFTOOL" demo -o demo >/dev/null
"$SDFTOOL" view demo/body.sdf.h5 demo/cloth.obj --margin 0.02 -o page.html
"$SDFTOOL" contacts demo/cloth.obj demo/body.sdf.h5 --margin 0.02 -o list.csv >/dev/null
page="file://$folder/page.html#up=z&pick=7"
open --dump-dom "$page" >page.txt || fail "chromium ended with status $?: $(tail -n 1 chromium.txt)"
open --screenshot="$out/view.png" "$page" || fail "chromium ended with status $?"
open --screenshot="$out/slice.png" "file://$folder/page.html#up=z&show=slice,normals,bricks&hide=mesh" || fail "chromium ended with status $?"
for mesh in body cloth; do
    awk '/^v / { printf "v %.9f %.9f %.9f\n", $2 + 1e6, $3 - 2e6, $4 + 1e6; next } { print }' demo/$mesh.obj >far-$mesh.obj
done
echo "v 9e9 9e9 9e9" >>far-cloth.obj
"$SDFTOOL" bake far-body.obj --res 128 -o far.sdf.h5 >/dev/null
"$SDFTOOL" view far.sdf.h5 far-cloth.obj --margin 0.02 -o far.html
open --screenshot="$out/far.png" "file://$folder/far.html#up=z&pick=7" || fail "chromium ended with status $?"
printf 'v -1.5 -1.5 0.4\nv 0 0 0.6\nv 1.5 1.5 0.4\nl 1 2 3\n' >rope.obj
"$SDFTOOL" view demo/body.sdf.h5 rope.obj -o rope.html
open --screenshot="$out/rope.png" "file://$folder/rope.html#up=z" || fail "chromium ended with status $?"
"$SDFTOOL" simulate "$scene" --small --frames 4 -o run.html >/dev/null
open --virtual-time-budget=500 --dump-dom "file://$folder/run.html" >run.txt || fail "chromium ended with status $?"
grep -q '<title>A coarse cloth.* [1-5]</title>' run.txt || fail "the page of simulate draws no frame: $(grep -m 1 '<title>' run.txt)"
open --virtual-time-budget=500 --screenshot="$out/run.png" "file://$folder/run.html" || fail "chromium ended with status $?"
python3 - page.txt list.csv "$out/view.png" "$out/slice.png" "$out/run.png" "$out/far.png" "$out/rope.png" <<'PYTHON'
import csv, re, struct, sys, zlib

dom, table, *pictures = sys.argv[1:]
text = open(dom).read()
drawn = re.search('data-drawn="(.*?)"', text)
assert drawn and drawn[1] == "ready 0", drawn
picked = dict(re.findall(r"<tr><td>(.*?)</td><td>(.*?)</td></tr>", re.search(r'id="picked">(.*?)</table>', text, re.S)[1]))
[row] = [row for row in csv.DictReader(open(table)) if row["id"] == picked["face"]]
numbers = [float(x) for key in ["distance", "lower bound", "point", "normal", "evaluations"] for x in picked[key].split(", ")]
names = ["distance", "lower_bound", "x", "y", "z", "normal_x", "normal_y", "normal_z", "evaluations"]
for name, number in zip(names, numbers, strict=True):
    expected = float(row[name])
    assert abs(number - expected) <= 2e-6 * max(abs(expected), 0.1), (name, number, expected)
assert picked["status"] == row["status"]


def colours(path):
    """Colours of a PNG of 8-bit RGB or RGBA, in steps of 32, with their numbers of pixels."""
    data, at, packed = open(path, "rb").read(), 8, b""
    while at < len(data):
        length, kind = struct.unpack(">I4s", data[at:at + 8])
        if kind == b"IHDR":
            width, height, depth, colour = struct.unpack(">IIBB", data[at + 8:at + 18])
        packed += data[at + 8:at + 8 + length] if kind == b"IDAT" else b""
        at += 12 + length
    size, found = {2: 3, 6: 4}[colour], {}
    raw, stride, last = zlib.decompress(packed), width * size, bytes(width * size)
    for y in range(height):
        method, line = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for x in range(stride):
            left, up, corner = line[x - size] if x >= size else 0, last[x], last[x - size] if x >= size else 0
            p = left + up - corner
            paeth = min((abs(p - left), 0, left), (abs(p - up), 1, up), (abs(p - corner), 2, corner))[2]
            line[x] = (line[x] + [0, left, up, (left + up) // 2, paeth][method]) & 255
        last = bytes(line)
        for x in range(320 * size, stride, size):
            key = tuple(c // 32 for c in line[x:x + 3])
            found[key] = found.get(key, 0) + 1
    return found


def is_there(found, what, holds):
    count = sum(n for key, n in found.items() if holds(*key))
    assert count > 30, f"{what}: {count} pixels"
    return f"{what} {count}"


view, slice_, run, far, rope = map(colours, pictures)
differing = sum(abs(view.get(key, 0) - far.get(key, 0)) for key in {*view, *far}) / sum(view.values())
assert differing < 0.01, f"far from the origin {differing:.1%} of the picture is another"
print("view: pixels:", ", ".join([
    is_there(view, "grey surface", lambda r, g, b: r == g == b and 1 < r < 6),
    is_there(view, "green mesh", lambda r, g, b: g > r and g > b),
    is_there(view, "red contacts", lambda r, g, b: r > 4 and g < 4 and b < 4),
    is_there(slice_, "orange slice", lambda r, g, b: r > 5 and r > b + 1),
    is_there(slice_, "blue slice", lambda r, g, b: b > 4 and b > r + 1),
    is_there(rope, "green rope", lambda r, g, b: g > r and g > b),
    is_there(run, "blue cloth", lambda r, g, b: b > g > r),
    is_there(run, "brown body", lambda r, g, b: r > g > b),
]))
print(f"view: {drawn[1]}; far away {differing:.2%} of the picture is another; contact of face {picked['face']} as in the list")
PYTHON
echo "view: $(stat -c %s page.html) bytes of page"
