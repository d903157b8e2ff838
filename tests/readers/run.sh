#!/bin/sh
# Reads a grid with h5py and VTK, and compares them with each other and with sdftool.
#
#   run.sh FILE.sdf.h5 [SDFTOOL | EVAL.csv]
#
# With the program SDFTOOL, or the output of its `eval`, compares interpolated values of a dense grid too; with the program, also
# its lists of contacts, and sparse grids that it bakes.
# PYTHON is a Python 3.11 or newer. The packages are installed once, in target/readers-venv.
set -eu
here=$(cd "$(dirname "$0")" && pwd)
venv=${CARGO_TARGET_DIR:-$here/../../target}/readers-venv
if ! cmp -s "$here/requirements.txt" "$venv/installed.txt"; then
    "${PYTHON:-python3}" -m venv --clear "$venv"
    "$venv/bin/pip" install --quiet --disable-pip-version-check -r "$here/requirements.txt"
    cp "$here/requirements.txt" "$venv/installed.txt"
fi
exec "$venv/bin/python" "$here/check.py" "$@"
