"""Reads what `sdftool export` writes with the programs that it is for, and compares values with `sdftool eval`.

    exports.py SDFTOOL GRID.sdf.h5

nanovdb_validate, nanovdb_convert and vdb_print check NanoVDB files where they are installed; Warp reads one where it is
(`SDFTOOL_LARGE=0` in `.ci/readers.sh` leaves out its 400 MB). numpy, pynrrd, VTK and trimesh read the other formats.
"""

import csv
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile

import nrrd
import numpy as np
import trimesh
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOHDF import vtkHDFReader


def run(*command):
    return subprocess.run([str(word) for word in command], check=True, capture_output=True, text=True).stdout


class Grid:
    """A grid file, and its values as `sdftool eval` prints them."""

    def __init__(self, sdftool, path):
        self.sdftool, self.path = sdftool, path
        info = json.loads(run(sdftool, "info", path, "--json"))
        self.counts, self.origin, self.spacing = np.array(info["counts"]), np.array(info["origin"]), info["spacing"]
        self.band = info["band"] or 4 * self.spacing
        self.diagonal = np.linalg.norm(self.spacing * (self.counts - 1))

    def export(self, folder, kind, *options):
        file = folder / f"field.{kind}"
        run(self.sdftool, "export", self.path, "--format", kind, "-o", file, *options)
        return file

    def values(self, points):
        with tempfile.TemporaryDirectory() as folder:
            file = pathlib.Path(folder, "points.csv")
            file.write_text("x,y,z\n" + "\n".join(",".join(repr(float(x)) for x in point) for point in points) + "\n")
            rows = csv.DictReader(run(self.sdftool, "eval", self.path, "--points", file).splitlines())
            return np.array([float(row["distance"]) for row in rows])

    def check_nodes(self, samples, what):
        """Samples by z, y, x are the values at the nodes."""
        assert samples.shape == tuple(self.counts[::-1]) and samples.dtype == np.float32, what
        nodes = np.random.default_rng(1).integers(0, self.counts, (2000, 3))
        worst = np.abs(samples[tuple(nodes.T[::-1])] - self.values(self.origin + self.spacing * nodes)).max()
        assert worst <= 1e-6 * self.diagonal, f"{what}: {worst}"
        print(f"{what}: 2000 nodes, difference at most {worst:.2g}")

    def points_in_band(self, count):
        high = self.origin + self.spacing * (self.counts - 1)
        points = np.random.default_rng(2).uniform(self.origin, high, (count, 3))
        values = self.values(points)
        near = np.abs(values) < self.band
        assert near.sum() > 100
        return points[near], values[near]


def check_arrays(grid, folder):
    raw = grid.export(folder, "raw")
    about = json.loads(pathlib.Path(f"{raw}.json").read_text())
    assert about["counts"] == grid.counts.tolist() and about["file"] == raw.name
    grid.check_nodes(np.fromfile(raw, "<f4").reshape(about["counts"][::-1]), "raw by its description")
    grid.check_nodes(np.load(grid.export(folder, "npy")), "NumPy")
    data, header = nrrd.read(str(grid.export(folder, "nrrd")), index_order="C")
    assert np.array_equal(header["space origin"], grid.origin)
    assert np.array_equal(header["space directions"], grid.spacing * np.eye(3))
    grid.check_nodes(data, "pynrrd")
    reader = vtkHDFReader()
    file = str(grid.export(folder, "vtkhdf"))
    assert reader.CanReadFile(file)
    reader.SetFileName(file)
    reader.Update()
    image = reader.GetOutput()
    assert np.allclose(image.GetOrigin(), grid.origin, rtol=0, atol=0) and image.GetSpacing() == (grid.spacing,) * 3
    scalars = image.GetPointData().GetScalars()
    assert scalars.GetName() == "distance"
    grid.check_nodes(vtk_to_numpy(scalars).reshape(grid.counts[::-1]), "VTK")


def check_surface(grid, folder):
    """Vertices are within a cell of the surface; the faces are wound counterclockwise seen from outside."""
    mesh = trimesh.load(grid.export(folder, "glb"), force="mesh", process=False)
    worst = np.abs(grid.values(mesh.vertices)).max()
    assert len(mesh.faces) > 100 and worst < grid.spacing, worst
    outside = grid.values(mesh.triangles_center + 0.5 * grid.spacing * mesh.face_normals)
    assert (outside > 0).mean() > 0.95
    print(f"trimesh: {len(mesh.faces)} triangles, at most {worst / grid.spacing:.2g} voxels off the surface")


def check_level_set(grid, folder):
    file = grid.export(folder, "nvdb")
    if shutil.which("nanovdb_validate"):
        assert run("nanovdb_validate", "-v", file).strip()
        vdb = folder / "field.vdb"
        run("nanovdb_convert", file, vdb)
        listed = run("vdb_print", "-l", vdb)
        assert "class: level set" in listed, listed
        print("nanovdb_validate: valid; vdb_print: class level set")
    else:
        print("nanovdb_validate: not installed, not run")
    again = folder / "again.sdf.h5"
    run(grid.sdftool, "import", file, "-o", again)
    points, values = grid.points_in_band(20000)
    worst = np.abs(Grid(grid.sdftool, again).values(points) - values).max()
    assert worst <= 1e-6 * grid.diagonal, worst
    print(f"sdftool import: {len(points)} points of the band, difference at most {worst / grid.diagonal:.2g} diagonals")
    check_warp(grid, file, points, values)


def check_warp(grid, file, points, values):
    try:
        import warp as wp
    except ImportError:
        print("Warp: not installed, not run")
        return
    wp.config.quiet = True

    @wp.kernel
    def sample(volume: wp.uint64, points: wp.array(dtype=wp.vec3), out: wp.array(dtype=float)):
        i = wp.tid()
        out[i] = wp.volume_sample_f(volume, wp.volume_world_to_index(volume, points[i]), wp.Volume.LINEAR)

    with open(file, "rb") as data:
        volume = wp.Volume.load_from_nvdb(data, device="cpu")
    out = wp.zeros(len(points), device="cpu")
    wp.launch(sample, len(points), [volume.id, wp.array(points.astype("f4"), dtype=wp.vec3, device="cpu"), out], device="cpu")
    worst = np.abs(out.numpy() - values).max()
    assert worst <= 1e-6 * grid.diagonal, worst / grid.diagonal
    print(f"Warp {wp.config.version}: {len(points)} points of the band, difference at most {worst / grid.diagonal:.2g} diagonals")


def main(sdftool, path):
    grid = Grid(sdftool, path)
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        check_arrays(grid, folder)
        check_surface(grid, folder)
        check_level_set(grid, folder)


if __name__ == "__main__":
    main(*sys.argv[1:])
