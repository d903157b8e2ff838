"""The fleets of examples/fleet.py: 200 meshes, three workers killed with SIGKILL, nothing lost, nothing partial, nothing baked twice."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import sdftool

EXAMPLES = str(Path(__file__).parent.parent / "examples")
sys.path.insert(0, EXAMPLES)
OPTIONS = {"res": 16, "layout": "sparse"}


@pytest.mark.parametrize("runner", ["dask", "ray"])
def test_three_killed_workers_lose_nothing(runner, tmp_path, monkeypatch):
    pytest.importorskip({"dask": "distributed", "ray": "ray"}[runner])
    # Ray's workers import what is not a script: by the environment.
    monkeypatch.setenv("PYTHONPATH", EXAMPLES)
    import fleet

    for index in range(200):
        size = 1.0 + 0.01 * index
        corners = [(0, 0, 0), (size, 0, 0), (0, size, 0), (0, 0, 1)]
        lines = ["v %r %r %r" % corner for corner in corners] + ["f 1 3 2", "f 1 2 4", "f 1 4 3", "f 2 3 4"]
        (tmp_path / f"mesh{index}.obj").write_text("\n".join(lines) + "\n")
    meshes = sorted(tmp_path.glob("*.obj"))
    killed, seen = set(), 0

    def kill_some(result):
        nonlocal seen
        seen += 1
        process = result[2]
        if seen % 40 == 0 and len(killed) < 3 and process not in killed:
            os.kill(process, signal.SIGKILL)
            killed.add(process)

    grids = tmp_path / "grids"
    fleet.run(runner, meshes, grids, OPTIONS, workers=2, on_result=kill_some)
    assert len(killed) == 3 and seen == 200
    files = sorted(grids.iterdir())
    assert len(files) == 200 and all(path.name.endswith(".sdf.h5") for path in files)
    assert all(sdftool.load(path).layout == "sparse" for path in files)
    assert fleet.run(runner, meshes, grids, OPTIONS, workers=2) == (0, 200)


def test_what_a_killed_writer_left_is_cleared(tmp_path):
    grid = tmp_path / "ball.sdf.h5"
    ball = sdftool.bake(*cube(), res=16)
    ball.save(grid)
    script = "import sys, sdftool\nball = sdftool.load(sys.argv[1])\nwhile True: ball.save(sys.argv[1])"
    deadline = time.monotonic() + 60
    while not leftovers(tmp_path):
        assert time.monotonic() < deadline, "no writer was killed between two steps of a write"
        writer = subprocess.Popen([sys.executable, "-c", script, str(grid)])
        while not leftovers(tmp_path) and time.monotonic() < deadline:
            pass
        writer.kill()
        writer.wait()
    sdftool.clear_leftovers(tmp_path / "other.sdf.h5")
    assert leftovers(tmp_path)
    sdftool.clear_leftovers(grid)
    assert list(tmp_path.iterdir()) == [grid] and sdftool.load(grid).to_bytes() == ball.to_bytes()


def leftovers(folder):
    return list(folder.glob(".sdftool-*.tmp"))


def cube():
    corners = [(x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)]
    squares = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return corners, [face for a, b, c, d in squares for face in [(a, b, c), (a, c, d)]]
