"""Reads recordings of `sdftool simulate` with VTK's own reader, and compares every frame with the OBJ files of the same run.

    recordings.py SDFTOOL SCENE.toml

A run that is ended by a signal leaves a recording, too.
"""

import pathlib
import signal
import subprocess
import sys
import tempfile
import time

import numpy as np
import trimesh
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOHDF import vtkHDFReader

FRAMES = 5


class Recording:
    """A VTKHDF file as VTK's reader has it."""

    def __init__(self, path):
        self.reader = vtkHDFReader()
        assert self.reader.CanReadFile(str(path)), path
        self.reader.SetFileName(str(path))
        self.reader.UpdateInformation()
        self.steps = self.reader.GetNumberOfSteps()

    def step(self, index):
        self.reader.SetStep(index)
        self.reader.Update()
        data = self.reader.GetOutput()
        polygons = vtk_to_numpy(data.GetPolys().GetConnectivityArray()).reshape(-1, 3)
        return data, vtk_to_numpy(data.GetPoints().GetData()), polygons


def simulate(sdftool, scene, *options):
    subprocess.run([sdftool, "simulate", scene, *options], check=True, capture_output=True)


def obj(path):
    return trimesh.load(path, process=False)


def check_frames(sdftool, scene, folder):
    """Every step has the points, the faces and the time of its frame."""
    run, frames = folder / "run.vtkhdf", folder / "frames"
    for output in [run, f"{frames}/"]:
        simulate(sdftool, scene, "--frames", str(FRAMES), "--small", "--threads", "1", "-o", output)
    recording = Recording(run)
    assert recording.steps == FRAMES + 1, recording.steps
    seen = []
    for index in range(recording.steps):
        data, points, polygons = recording.step(index)
        expected = obj(frames / f"frame_{index:04}.obj")
        assert np.array_equal(points, expected.vertices.astype(np.float32)), index
        assert np.array_equal(polygons, expected.faces), index
        assert vtk_to_numpy(data.GetCellData().GetArray("body")).size == data.GetNumberOfCells()
        seen.append(recording.reader.GetTimeValue())
        assert abs(seen[-1] - index / 60) < 1e-9, seen
    print(f"vtkhdf: {recording.steps} steps of {len(points)} points and {len(polygons)} faces, as in the OBJ files")
    data, points, polygons = Recording(run.with_suffix(".still.vtkhdf")).step(0)
    expected = obj(frames / "still.obj")
    assert np.array_equal(points, expected.vertices.astype(np.float32)) and np.array_equal(polygons, expected.faces)


def check_interrupted(sdftool, scene, folder, number):
    """What a signal leaves can be read, and moves."""
    run = folder / f"ended{number}.vtkhdf"
    # A shell's background jobs ignore Ctrl-C.
    listen = lambda: signal.signal(number, signal.SIG_DFL)
    words = [sdftool, "simulate", scene, "--small", "--frames", "100000", "-o", run]
    process = subprocess.Popen(words, stderr=subprocess.PIPE, preexec_fn=listen)
    deadline = time.monotonic() + 120
    while not run.exists():
        assert time.monotonic() < deadline and process.poll() is None, "nothing was recorded"
        time.sleep(0.01)
    process.send_signal(number)
    said = process.communicate(timeout=120)[1].decode()
    assert process.returncode == 128 + number and "ended by a signal" in said, (process.returncode, said)
    recording = Recording(run)
    first, last = (recording.step(step)[1].copy() for step in [0, recording.steps - 1])
    assert recording.steps > 1 and not np.array_equal(first, last)
    print(f"vtkhdf: {recording.steps} steps after signal {number:d}")


def main():
    sdftool, scene = sys.argv[1:]
    with tempfile.TemporaryDirectory() as folder:
        check_frames(sdftool, scene, pathlib.Path(folder))
        for number in [signal.SIGINT, signal.SIGTERM]:
            check_interrupted(sdftool, scene, pathlib.Path(folder), number)


main()
