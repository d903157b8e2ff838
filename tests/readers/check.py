"""Reads grids with the example of docs/format.md and with VTK, and compares both with sdftool. See run.sh."""

import csv
import json
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

import h5py
import numpy as np
from vtkmodules.util.numpy_support import numpy_to_vtk, vtk_to_numpy
from vtkmodules.vtkCommonCore import vtkPoints
from vtkmodules.vtkCommonDataModel import vtkPolyData
from vtkmodules.vtkFiltersCore import vtkProbeFilter
from vtkmodules.vtkIOHDF import vtkHDFReader
from write_grid import write_by_h5py

FORMAT = pathlib.Path(__file__).parents[2] / "docs" / "format.md"


def documented():
    """The functions of the example in docs/format.md."""
    [example] = re.findall(r"^```python\n(.*?)^```$", FORMAT.read_text(encoding="utf-8"), re.M | re.S)
    names = {}
    exec(compile(example, FORMAT.name, "exec"), names)
    return names


def check_documented_names(path, layout):
    """The file has exactly the names that docs/format.md lists for its layout, and for codes."""
    lists = re.findall(r"^```text\n(.*?)^```$", FORMAT.read_text(encoding="utf-8"), re.M | re.S)
    dense, sparse, blocks, kept_mesh, attributes, of_open_mesh, *_ = lists
    of_open_mesh = set(re.findall(r"^    (\w+) ", of_open_mesh, re.M))
    vtkhdf, beside = dense.split("\n/sdf")
    only_sparse = set(re.findall(r"^    (\w+) .*sparse only", attributes, re.M))
    only_codes = set(re.findall(r"^    (\w+) .*absent from dense f32", attributes, re.M))
    some = set(re.findall(r"^    (\w+) .*else absent", attributes, re.M))
    attributes = set(re.findall(r"^    (\w+) ", attributes, re.M))
    with h5py.File(path, "r") as file:
        has_codes = layout == "sparse" or "precision" in file["sdf"].attrs
        listed = sparse if layout == "sparse" else blocks if has_codes else beside
        datasets = re.findall(r"^    (\w+) .*dataset,", listed, re.M)
        if file["sdf"].attrs["kept_mesh"] != "none":
            datasets += re.findall(r"^    (\w+) .*dataset,", kept_mesh, re.M)
        found = set(file["sdf"].attrs)
        assert found & of_open_mesh in (set(), of_open_mesh)
        absent = set() if layout == "sparse" else only_sparse if has_codes else only_sparse | only_codes
        absent |= some - found
        assert found - of_open_mesh == attributes - absent
        assert list(file["sdf"]) == sorted(datasets) and not file.attrs
        if has_codes:
            assert set(file) == {"sdf"}
            return
        assert set(file) == {"VTKHDF", "sdf"}
        assert set(file["VTKHDF"]) == {"PointData"} and set(file["VTKHDF/PointData"]) == {"distance"}
        assert list(file["VTKHDF"].attrs) == sorted(re.findall(r"^    (\w+) ", vtkhdf, re.M))
        assert list(file["VTKHDF/PointData"].attrs) == ["Scalars"]
        assert list(file["VTKHDF/PointData/distance"].attrs) == ["Attribute"]


def check_damage(path, names):
    """The example detects a changed number in any dataset."""
    with h5py.File(path, "r") as file:
        datasets = []
        file.visititems(lambda name, item: datasets.append(name) if isinstance(item, h5py.Dataset) else None)
    for name in datasets:
        with tempfile.TemporaryDirectory() as folder:
            damaged = pathlib.Path(folder, "damaged.h5")
            shutil.copy(path, damaged)
            with h5py.File(damaged, "r+") as file:
                at = tuple(np.array(file[name].shape) - 1)
                file[name][at] = file[name][at] == 0
            try:
                names["read_grid"](damaged)
            except ValueError as error:
                assert "checksum" in str(error)
            else:
                raise AssertionError(f"damage in {name} was not detected")
    return len(datasets)


def check_vtk(path, sdf, distance):
    reader = vtkHDFReader()
    assert reader.CanReadFile(str(path))
    reader.SetFileName(str(path))
    reader.Update()
    image = reader.GetOutput()
    assert image.GetDimensions() == tuple(sdf["counts"])
    assert image.GetOrigin() == tuple(sdf["origin"])
    assert image.GetSpacing() == (sdf["spacing"],) * 3
    assert image.GetDirectionMatrix().IsIdentity()
    scalars = image.GetPointData().GetScalars()
    assert scalars is not None and scalars.GetName() == "distance"
    assert vtk_to_numpy(scalars).tobytes() == distance.tobytes()
    return image


def check_probe(image, printed, sdf):
    """VTK interpolates like `sdftool eval` at the points inside the box."""
    table = np.array([list(map(float, row[:7])) for row in list(csv.reader(printed.splitlines()))[1:]])
    near, far = np.reshape(image.GetBounds(), (3, 2)).T
    table = table[np.all((near < table[:, :3]) & (table[:, :3] < far), axis=1)]
    # VTK's points are f32 by default.
    points, cloud, probe = vtkPoints(), vtkPolyData(), vtkProbeFilter()
    points.SetData(numpy_to_vtk(table[:, :3].copy(), deep=True))
    cloud.SetPoints(points)
    probe.SetInputData(cloud)
    probe.SetSourceData(image)
    probe.Update()
    found = probe.GetOutput().GetPointData()
    assert vtk_to_numpy(found.GetArray("vtkValidPointMask")).all()
    worst = np.abs(vtk_to_numpy(found.GetArray("distance")) - table[:, 3]).max()
    # VTK rounds interpolated values to f32.
    tolerance = 16 * 2.0**-24 * (np.abs(table[:, 3]).max() + sdf["spacing"])
    assert len(table) > 50 and worst <= tolerance, f"VTK and eval differ by {worst}, more than {tolerance}"
    return len(table), worst


def random_points(sdf, count, seed):
    """Random points in a box twice as wide as the grid's, and two corners of the grid's box."""
    near, far = sdf["origin"], sdf["origin"] + sdf["spacing"] * (sdf["counts"] - 1.0)
    points = np.random.default_rng(seed).uniform(near - (far - near) / 2, far + (far - near) / 2, (count, 3))
    return np.vstack([points, near, far])


def evaluate(sdftool, path, points):
    """The output of `sdftool eval` for the points."""
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder, "points.csv")
        lines = ["x,y,z", *(",".join(repr(float(x)) for x in point) for point in points)]
        file.write_text("\n".join(lines) + "\n")
        command = [sdftool, "eval", str(path), "--points", str(file)]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def parse_table(printed):
    rows = list(csv.DictReader(printed.splitlines()))
    names = ["x", "y", "z", "distance", "gx", "gy", "gz"]
    assert rows and list(rows[0]) == [*names, "status"], "the header of eval"
    return np.array([[float(row[name]) for name in names] for row in rows])


def check_eval(printed, sdf, grid, interpolate):
    table = parse_table(printed)
    points, values = table[:, :3], table[:, 3]
    expected = interpolate(sdf, grid, points)
    # sdftool may evaluate in f32: 24 bits of coordinates as large as the box, times the slope.
    size = np.abs(points).max() + sdf["spacing"] * sdf["counts"].max() + np.abs(expected).max()
    tolerance = 16 * 2.0**-24 * size * max(1.0, sdf["slope_bound"])
    worst = np.abs(values - expected).max()
    assert worst <= tolerance, f"eval has an error of {worst}, more than {tolerance}"
    return len(table), worst


def check_nodes(sdftool, names, sdf, grid):
    """At nodes with exact coordinates, `sdftool eval` prints the samples bit for bit, from a file that h5py wrote."""
    sdf = sdf | {"origin": np.zeros(3), "spacing": 2.0**-6}
    seed = np.random.default_rng(1)
    nodes = seed.integers(0, sdf["counts"].astype(int), (2000, 3))
    expected = names["samples"](sdf, grid, nodes)
    if sdf["layout"] == "sparse":
        near = grid["table"][tuple(nodes.T[::-1] // 8)] >= 0
        assert 0 < near.sum() < len(nodes)
        # Interpolation in the coarse grid may round differently.
        nodes, expected = nodes[near], expected[near]
    with tempfile.TemporaryDirectory() as folder:
        ours = pathlib.Path(folder, "by-h5py.sdf.h5")
        write_by_h5py(ours, names, sdf, grid)
        values = parse_table(evaluate(sdftool, ours, sdf["spacing"] * nodes))[:, 3]
    assert (values.astype("f4") == expected).all() and (values == expected.astype(float)).all()
    return len(nodes)


def sheet(low, high):
    """An OBJ of a sheet of 10 x 10 squares, as wide as the box, slanting through it."""
    steps = np.linspace(0, 1, 11)
    points = [low + (high - low) * (x, y, 0.3 + 0.4 * x) for y in steps for x in steps]
    lines = ["v " + " ".join(repr(float(x)) for x in point) for point in points]
    for corner in (11 * row + column + 1 for row in range(10) for column in range(10)):
        lines.append(f"f {corner} {corner + 1} {corner + 12} {corner + 11}")
    return "\n".join(lines) + "\n"


def check_contacts(sdftool, path, sdf):
    """`sdftool contacts` writes the same to HDF5 as it prints in JSON, also for an empty list."""
    size = sdf["spacing"] * (sdf["counts"] - 1.0)
    total = 0
    with tempfile.TemporaryDirectory() as folder:
        obj, list_file = pathlib.Path(folder, "sheet.obj"), pathlib.Path(folder, "list.h5")
        for elements in ["faces", "edges", "vertices"]:
            for away in [0, 100]:
                low = sdf["origin"] + away * size
                obj.write_text(sheet(low, low + size))
                command = [sdftool, "contacts", obj, path, "--elements", elements, "--json", "-o", list_file]
                printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
                contacts = json.loads(printed)["contacts"]
                assert bool(contacts) == (away == 0), elements
                check_contact_list(list_file, contacts)
                total += len(contacts)
    return total


def check_contact_list(path, contacts):
    with h5py.File(path, "r") as file:
        group = file["contacts"]
        kinds, statuses = (group.attrs[name].split() for name in ["kind_names", "status_names"])
        assert group.attrs["count"] == len(contacts)
        assert all(len(column) == len(contacts) for column in group.values())
        table = {name: group[name][:] for name in group}
    columns = """distance element error_bound evaluations feature feature_id id key lower_bound normal point polygon
                 shape_lower_bound slope status surface_point vertices weights"""
    assert sorted(table) == columns.split()
    assert table["point"].shape == table["weights"].shape == (len(contacts), 3)
    assert table["feature_id"].shape == (len(contacts), 2)
    for row, contact in enumerate(contacts):
        for name in ["id", "evaluations", "distance", "lower_bound", "key", "slope"]:
            assert table[name][row] == contact[name], name
        for name in ["point", "surface_point", "normal"]:
            assert table[name][row].tolist() == contact[name], name
        assert table["polygon"][row] == contact.get("polygon", 0)
        assert kinds[table["element"][row]] == contact["element"]
        assert kinds[table["feature"][row]] == contact["feature"]
        assert statuses[table["status"][row]] == contact["status"]
        assert table["feature_id"][row].tolist() == (contact["feature_id"] + [2**32 - 1])[:2]
        assert table["vertices"][row].tolist() == (contact["vertices"] + 2 * [2**32 - 1])[:3]
        assert table["weights"][row].tolist() == (contact["weights"] + [0, 0])[:3]


def torus():
    """An OBJ of a closed torus of 60 x 24 squares, its axis along z, its radii 1 and 0.4."""
    around, across = np.meshgrid(np.arange(60) * np.pi / 30, np.arange(24) * np.pi / 12, indexing="ij")
    from_axis = 1 + 0.4 * np.cos(across)
    points = np.stack([from_axis * np.cos(around), from_axis * np.sin(around), 0.4 * np.sin(across)], axis=-1)
    lines = ["v " + " ".join(repr(float(x)) for x in point) for point in points.reshape(-1, 3)]
    number = lambda i, j: i % 60 * 24 + j % 24 + 1
    for i, j in np.ndindex(60, 24):
        lines.append(f"f {number(i, j)} {number(i + 1, j)} {number(i + 1, j + 1)} {number(i, j + 1)}")
    return "\n".join(lines) + "\n"


def check_sparse(sdftool, precision, seed):
    """Reads what `sdftool bake --layout sparse` writes with the example, and compares it with a dense grid of the same mesh."""
    names = documented()
    with tempfile.TemporaryDirectory() as folder:
        mesh, path, dense_path = (pathlib.Path(folder, name) for name in ["torus.obj", "sparse.h5", "dense.h5"])
        mesh.write_text(torus())
        bake = [sdftool, "bake", mesh, "--res", "96", "--keep-mesh"]
        sparse = ["--layout", "sparse", "--precision", precision, "--band", "3"]
        subprocess.run([*bake, *sparse, "-o", path], check=True, capture_output=True)
        subprocess.run([*bake, "-o", dense_path], check=True, capture_output=True)
        sdf, grid = check_file(path, names)
        points = random_points(sdf, 1000, seed)
        printed = evaluate(sdftool, path, points)
        ours = pathlib.Path(folder, "by-h5py.sdf.h5")
        write_by_h5py(ours, names, sdf, grid)
        assert evaluate(sdftool, ours, points) == printed
        _, worst = check_eval(printed, sdf, grid, names["interpolate"])
        print(f"sdftool eval: {len(points)} points, error at most {worst:.2g}; {check_nodes(sdftool, names, sdf, grid)} "
              "nodes equal bit for bit; equal for a grid that h5py wrote")
        dense_sdf, dense_grid = names["read_grid"](dense_path)
        check_band(sdf, grid, dense_sdf, dense_grid, names)
        # The mesh beside the grid keeps nobody from opening it.
        check_documented_names(dense_path, "dense")
        check_vtk(dense_path, dense_sdf, dense_grid["distance"])
        for kept in [grid, dense_grid]:
            assert kept["mesh_vertices"].shape == (1440, 3) and kept["mesh_triangles"].shape == (2880, 3)
            assert kept["mesh_triangles"].max() == 1439


def check_codes(sdftool, precision, seed):
    """Reads a dense grid of codes with the example, and compares it with one of f32 of the same mesh."""
    names = documented()
    with tempfile.TemporaryDirectory() as folder:
        mesh, path, plain_path = (pathlib.Path(folder, name) for name in ["torus.obj", "codes.h5", "f32.h5"])
        mesh.write_text(torus())
        bake = [sdftool, "bake", mesh, "--res", "40"]
        subprocess.run([*bake, "--precision", precision, "-o", path], check=True, capture_output=True)
        subprocess.run([*bake, "-o", plain_path], check=True, capture_output=True)
        sdf, grid = check_file(path, names)
        points = random_points(sdf, 1000, seed)
        printed = evaluate(sdftool, path, points)
        ours = pathlib.Path(folder, "by-h5py.sdf.h5")
        write_by_h5py(ours, names, sdf, grid)
        assert evaluate(sdftool, ours, points) == printed
        _, worst = check_eval(printed, sdf, grid, names["interpolate"])
        plain_sdf, plain_grid = names["read_grid"](plain_path)
        nodes = np.argwhere(np.ones(sdf["counts"].astype(int), bool))
        codes, exact = names["samples"](sdf, grid, nodes), names["samples"](plain_sdf, plain_grid, nodes)
        change = np.abs(codes.astype(float) - exact).max()
        assert 0 < change <= sdf["error_bound"] - plain_sdf["error_bound"] and ((codes < 0) == (exact < 0)).all()
        print(f"sdftool eval: {len(points)} points, error at most {worst:.2g}; equal for a grid that h5py wrote; "
              f"{len(nodes)} nodes keep their side and change by at most {change:.2g}")


def check_band(sdf, grid, dense_sdf, dense_grid, names):
    """In its band a sparse grid equals the dense one to within the bricks' errors."""
    low, high = dense_sdf["origin"], dense_sdf["origin"] + dense_sdf["spacing"] * (dense_sdf["counts"] - 1.0)
    points = np.random.default_rng(1).uniform(low, high, (20000, 3))
    expected = names["interpolate"](dense_sdf, dense_grid, points)
    near = np.abs(expected) + dense_sdf["error_bound"] < sdf["band"]
    worst = np.abs(names["interpolate"](sdf, grid, points[near]) - expected[near]).max()
    # The two lattices may differ.
    allowed = sdf["error_bound"] + dense_sdf["error_bound"]
    assert near.sum() > 50 and worst <= allowed, f"error {worst}, more than {allowed}, of {near.sum()}"
    print(f"the dense grid: differs by at most {worst:.2g} at {near.sum()} points of the band")


def check_file(path, names):
    """Checks the file's names, types, bounds and checksums."""
    sdf, grid = names["read_grid"](path)
    check_documented_names(path, sdf["layout"])
    if "precision" not in sdf:
        types = {"distance": "<f4", "bounds": "<f4"}
        assert grid["distance"].shape == tuple(sdf["counts"][::-1])
    else:
        types = {"samples": {"f32": "<f4", "u16": "<u2", "u8": "|u1"}[sdf["precision"]], "places": "<u4"}
        types |= dict.fromkeys(["bounds", "scales"], "<f4")
        if sdf["layout"] == "sparse":
            types |= dict.fromkeys(["errors", "coarse"], "<f4")
        assert len(grid["samples"]) == sdf.get("bricks", grid["table"].size) and sdf["brick_side"] == 8
    assert all(grid[name].dtype == np.dtype(kind) for name, kind in types.items())
    check_bounds(sdf, grid, names)
    print(f"h5py: {sdf['layout']}, checksums hold, and damage in any of {check_damage(path, names)} datasets is detected")
    return sdf, grid


def check_bounds(sdf, grid, names):
    """No sample of a block is outside its bounds, and no cell of it is steeper."""
    counts = sdf["counts"].astype(int)
    blocks = -(-counts // 8)
    for row in np.random.default_rng(1).integers(0, len(grid["bounds"]), 100):
        block = grid["places"][row] if "places" in grid else np.array(np.unravel_index(row, blocks[::-1]))[::-1]
        first, last = block.astype(int) * 8, np.minimum(block.astype(int) * 8 + 8, counts)
        nodes = np.stack(np.meshgrid(*map(np.arange, first, last), indexing="ij"), axis=-1).reshape(-1, 3)
        found = names["samples"](sdf, grid, nodes)
        lower, upper, slope = grid["bounds"][row]
        assert lower <= found.min() and found.max() <= upper
        cells = nodes[(nodes < counts - 1).all(axis=1)]
        corners = np.array([names["samples"](sdf, grid, cells + corner) for corner in np.ndindex(2, 2, 2)], float)
        corners = corners.reshape(2, 2, 2, -1)
        along = [np.abs(np.diff(corners, axis=axis)).reshape(4, -1).max(axis=0) for axis in range(3)]
        steepest = np.linalg.norm(along, axis=0).max(initial=0) / sdf["spacing"]
        assert steepest <= slope * (1 + 1e-5)


def main(path, sdftool_or_csv=None, seed="1"):
    names = documented()
    sdf, grid = check_file(path, names)
    nodes = np.argwhere(np.ones(sdf["counts"].astype(int), bool))[:: max(1, int(np.prod(sdf["counts"])) // 1000)]
    at_nodes = names["interpolate"](sdf, grid, sdf["origin"] + sdf["spacing"] * nodes)
    values = names["samples"](sdf, grid, nodes)
    assert np.allclose(at_nodes, values, atol=1e-5 * sdf["slope_bound"] * np.abs(values).max())
    if "precision" in sdf:
        return
    image = check_vtk(path, sdf, grid["distance"])
    print("VTK: equal bit for bit")
    if sdftool_or_csv is None:
        return
    if sdftool_or_csv.endswith(".csv"):
        printed = pathlib.Path(sdftool_or_csv).read_text()
    else:
        print(f"points: seed {seed}")
        points = random_points(sdf, 1000, int(seed))
        printed = evaluate(sdftool_or_csv, path, points)
        with tempfile.TemporaryDirectory() as folder:
            ours = pathlib.Path(folder, "by-h5py.sdf.h5")
            write_by_h5py(ours, names, sdf, grid)
            assert evaluate(sdftool_or_csv, ours, points) == printed
        print(f"sdftool eval: equal for a grid that h5py wrote, {check_nodes(sdftool_or_csv, names, sdf, grid)} nodes "
              "bit for bit")
    count, worst = check_eval(printed, sdf, grid, names["interpolate"])
    print(f"sdftool eval: {count} points, error at most {worst:.2g}")
    count, worst = check_probe(image, printed, sdf)
    print(f"VTK's vtkProbeFilter: {count} points, difference at most {worst:.2g}")
    if not sdftool_or_csv.endswith(".csv"):
        print(f"sdftool contacts: {check_contacts(sdftool_or_csv, path, sdf)} contacts in HDF5, equal by h5py")
        for precision in ["f32", "u16", "u8"]:
            print(f"sparse, {precision}:")
            check_sparse(sdftool_or_csv, precision, int(seed))
        for precision in ["u16", "u8"]:
            print(f"dense, {precision}:")
            check_codes(sdftool_or_csv, precision, int(seed))


if __name__ == "__main__":
    main(*sys.argv[1:])
