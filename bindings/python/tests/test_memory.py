"""What cannot be allocated is an exception: the process lives on."""

import os
import subprocess
import sys

import numpy as np
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


# Room for neither 8 bytes of each point twice, nor 24 of each once.
SMALL_ARRAYS = """
import resource, numpy, sdftool
field = sdftool.sphere(1.0)
points = numpy.zeros((4_000_000, 3))
singles = points.astype("float32")
field(points[:10])
pages = int(open("/proc/self/statm").read().split()[0])
resource.setrlimit(resource.RLIMIT_AS, (pages * resource.getpagesize() + (40 << 20), resource.RLIM_INFINITY))
for call, given in [(field, points), (field.sample, points), (field, singles)]:
    try:
        call(given)
    except MemoryError as error:
        print(error, flush=True)
"""


@pytest.mark.skipif(sys.platform != "linux", reason="/proc")
def test_arrays_that_do_not_fit_are_a_memory_error():
    said = subprocess.run([sys.executable, "-c", SMALL_ARRAYS], capture_output=True, text=True)
    assert said.returncode == 0, said.stderr
    wanted = ["points: values: 64000000 bytes", "points: samples: ", "points: 96000000 bytes"]
    lines = said.stdout.splitlines()
    assert len(lines) == 3 and all(line.startswith(start) for line, start in zip(lines, wanted)), lines


@pytest.mark.parametrize("index, kind", [(0, "vertices"), (1, "faces")])
def test_masked_entries_are_refused(index, kind):
    field, arrays = sdftool.sphere(1.0), [np.asarray(array) for array in ball(6)]
    count = len(field.contacts(*arrays, margin=0.1))
    arrays[index] = np.ma.masked_array(arrays[index], mask=False)
    assert len(field.contacts(*arrays, margin=0.1)) == count > 0
    arrays[index][0, 0] = np.ma.masked
    with pytest.raises(ValueError, match=f"{kind}: some entries are masked"):
        field.contacts(*arrays, margin=0.1)
