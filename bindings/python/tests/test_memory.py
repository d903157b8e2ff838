"""What cannot be allocated is an exception: the process lives on."""

import os
import subprocess
import sys

import pytest
import sdftool
from conftest import ball

# About 409³ nodes of 4 bytes take 274 MB: more than is left, and more than the 64 MB that an allocator may have reserved for each of some
# threads. The threads of the pool are there before.
SMALL_PROCESS = """
import resource, sys, sdftool
sys.path.insert(0, {folder!r})
from conftest import ball
sdftool.load({small!r})
pages = int(open("/proc/self/statm").read().split()[0])
resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + (16 << 20), resource.RLIM_INFINITY))
for call in [lambda: sdftool.load({large!r}), lambda: sdftool.bake(*ball(6), res=400, threads=1)]:
    try:
        call()
    except (MemoryError, ValueError) as error:
        print(type(error).__name__, error, flush=True)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="/proc")
def test_a_grid_that_is_not_damaged_is_too_large_for_a_small_process(tmp_path):
    files = dict(small=str(tmp_path / "small.sdf.h5"), large=str(tmp_path / "large.sdf.h5"))
    for file, res in zip(files.values(), [8, 400]):
        sdftool.bake(*ball(6), res=res).save(file)
    code = SMALL_PROCESS.format(folder=os.path.dirname(__file__), **files)
    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert said.returncode == 0, said.stderr
    loaded, baked = said.stdout.splitlines()
    assert loaded.startswith("MemoryError ") and loaded.endswith(" bytes, more than can be allocated")
    assert baked.startswith("ValueError a grid of ")
