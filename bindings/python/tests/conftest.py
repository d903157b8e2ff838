"""Meshes by formula, and the program that results are compared with: its path in SDFTOOL."""

import json
import os
import signal
import subprocess
import sys
import time

import numpy as np
import pytest


LONG_CALL = """
import signal, sys, time, numpy as np, sdftool
# A shell's background jobs ignore it.
signal.signal(signal.SIGINT, signal.default_int_handler)
sys.path.insert(0, {folder!r})
from conftest import ball, dented_ball
{setup}
print("begins", flush=True)
try:
    {call}
    print("done", time.time(), flush=True)
except KeyboardInterrupt:
    print("interrupted", time.time(), flush=True)
"""


def assert_ctrl_c_ends(setup, call):
    """Ctrl-C ends a call that takes minutes, in a process of its own."""
    code = LONG_CALL.format(folder=os.path.dirname(__file__), setup=setup, call=call)
    child = subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True)
    assert child.stdout.readline() == "begins\n"
    time.sleep(0.7)
    sent = time.time()
    child.send_signal(signal.SIGINT)
    word, moment = child.stdout.readline().split()
    # It takes 0.1 s on an idle machine.
    assert word == "interrupted" and float(moment) - sent < 10
    assert child.wait(timeout=20) == 0


def ball(cells, radius=1.0):
    """A closed sphere of latitude and longitude: vertices and faces."""
    rows, columns = cells, 2 * cells
    theta = np.linspace(0.0, np.pi, rows + 1)[1:-1]
    phi = np.arange(columns) * (2.0 * np.pi / columns)
    ring = np.stack(
        [np.outer(np.sin(theta), np.cos(phi)), np.outer(np.sin(theta), np.sin(phi)), np.outer(np.cos(theta), np.ones(columns))],
        axis=-1,
    ).reshape(-1, 3)
    vertices = radius * np.concatenate([[[0.0, 0.0, 1.0]], ring, [[0.0, 0.0, -1.0]]])
    last = len(vertices) - 1
    faces = []
    for i in range(columns):
        j = (i + 1) % columns
        faces.append([0, 1 + i, 1 + j])
        faces.append([last, last - columns + j, last - columns + i])
        for row in range(rows - 2):
            a, b = 1 + row * columns + i, 1 + row * columns + j
            faces += [[a, a + columns, b + columns], [a, b + columns, b]]
    return vertices, np.array(faces, dtype=np.int64)


def dented_ball(cells):
    """A closed body with bumps and dents."""
    vertices, faces = ball(cells)
    x, y, z = vertices.T
    return vertices * (0.8 + 0.2 * np.sin(5.0 * x) * np.sin(4.0 * y + 1.0) * np.cos(3.0 * z))[:, None], faces


def sheet(cells, size=2.4, height=0.55):
    """An open cloth that bends over the origin: vertices and faces."""
    steps = np.linspace(-0.5 * size, 0.5 * size, cells + 1)
    x, y = np.meshgrid(steps, steps)
    vertices = np.stack([x, y, height - 0.3 * (x * x + y * y)], axis=-1).reshape(-1, 3)
    faces = []
    for row in range(cells):
        for column in range(cells):
            a = row * (cells + 1) + column
            faces += [[a, a + 1, a + cells + 2], [a, a + cells + 2, a + cells + 1]]
    return vertices, np.array(faces, dtype=np.int64)


def write_obj(path, vertices, faces):
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in vertices.tolist()]
    lines += ["f %d %d %d" % tuple(face) for face in (faces + 1).tolist()]
    path.write_text("\n".join(lines) + "\n")
    return path


@pytest.fixture(scope="session")
def program():
    """Runs the program and gives its JSON."""
    path = os.environ.get("SDFTOOL")
    if path is None:
        pytest.skip("SDFTOOL does not name the program to compare with")

    def run(*arguments, folder):
        command = [path, *map(str, arguments), "--json"]
        return json.loads(subprocess.run(command, cwd=folder, check=True, capture_output=True).stdout)

    return run
