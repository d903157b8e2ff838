"""Reads a grid by the example of docs/format.md and with VTK, and compares them and sdftool. See run.sh."""

import csv
import hashlib
import json
import pathlib
import re
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

FORMAT = pathlib.Path(__file__).parents[2] / "docs" / "format.md"


def documented():
    """The functions of the example in docs/format.md."""
    [example] = re.findall(r"^```python\n(.*?)^```$", FORMAT.read_text(encoding="utf-8"), re.M | re.S)
    names = {}
    exec(compile(example, FORMAT.name, "exec"), names)
    return names


def check_documented_names(path):
    """The file holds what docs/format.md lists, no less and no more."""
    listing = re.search(r"^```text\n(.*?)^```$", FORMAT.read_text(encoding="utf-8"), re.M | re.S)[1]
    vtkhdf, sdf = listing.split("\n/sdf")
    with h5py.File(path, "r") as file:
        assert set(file) == {"VTKHDF", "sdf"} and not file.attrs
        assert set(file["VTKHDF"]) == {"PointData"} and set(file["VTKHDF/PointData"]) == {"distance"}
        assert list(file["VTKHDF"].attrs) == sorted(re.findall(r"^    (\w+) ", vtkhdf, re.M))
        assert list(file["VTKHDF/PointData"].attrs) == ["Scalars"]
        assert list(file["VTKHDF/PointData/distance"].attrs) == ["Attribute"]
        assert list(file["sdf"].attrs) == sorted(re.findall(r"^    (\w+) ", sdf, re.M))
        assert len(file["sdf"]) == 0


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
    """VTK interpolates as `sdftool eval` does, at the points inside the box."""
    table = np.array([list(map(float, row)) for row in list(csv.reader(printed.splitlines()))[1:]])
    near, far = np.reshape(image.GetBounds(), (3, 2)).T
    table = table[np.all((near < table[:, :3]) & (table[:, :3] < far), axis=1)]
    # VTK's points are f32 unless told otherwise.
    points, cloud, probe = vtkPoints(), vtkPolyData(), vtkProbeFilter()
    points.SetData(numpy_to_vtk(table[:, :3].copy(), deep=True))
    cloud.SetPoints(points)
    probe.SetInputData(cloud)
    probe.SetSourceData(image)
    probe.Update()
    found = probe.GetOutput().GetPointData()
    assert vtk_to_numpy(found.GetArray("vtkValidPointMask")).all()
    worst = np.abs(vtk_to_numpy(found.GetArray("distance")) - table[:, 3]).max()
    # VTK rounds what it has interpolated to f32.
    tolerance = 16 * 2.0**-24 * (np.abs(table[:, 3]).max() + sdf["spacing"])
    assert len(table) > 50 and worst <= tolerance, f"VTK and eval are {worst} apart, more than {tolerance}"
    return len(table), worst


def random_points(sdf, count, seed):
    """In a box twice as wide as the grid's, the grid's corners among them."""
    near, far = sdf["origin"], sdf["origin"] + sdf["spacing"] * (sdf["counts"] - 1.0)
    points = np.random.default_rng(seed).uniform(near - (far - near) / 2, far + (far - near) / 2, (count, 3))
    return np.vstack([points, near, far])


def evaluate(sdftool, path, points):
    """What `sdftool eval` prints for the points."""
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder, "points.csv")
        lines = ["x,y,z", *(",".join(repr(float(x)) for x in point) for point in points)]
        file.write_text("\n".join(lines) + "\n")
        command = [sdftool, "eval", str(path), "--points", str(file)]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout


def check_eval(printed, sdf, distance, interpolate):
    rows = list(csv.DictReader(printed.splitlines()))
    assert rows and list(rows[0]) == ["x", "y", "z", "distance", "gx", "gy", "gz"], "the header of eval"
    table = np.array([[float(row[name]) for name in row] for row in rows])
    points, values = table[:, :3], table[:, 3]
    expected = interpolate(sdf, distance, points)
    # sdftool may be asked in f32: 24 bits of the coordinates, of the size of the box, times the slope.
    size = np.abs(points).max() + sdf["spacing"] * sdf["counts"].max() + np.abs(distance).max()
    tolerance = 16 * 2.0**-24 * size * max(1.0, sdf["slope_bound"])
    worst = np.abs(values - expected).max()
    assert worst <= tolerance, f"eval is off by {worst}, which is more than {tolerance}"
    return len(rows), worst


def sheet(low, high):
    """An OBJ of a sheet of 10 x 10 squares, as wide as the box, on the slant through it."""
    steps = np.linspace(0, 1, 11)
    points = [low + (high - low) * (x, y, 0.3 + 0.4 * x) for y in steps for x in steps]
    lines = ["v " + " ".join(repr(float(x)) for x in point) for point in points]
    for corner in (11 * row + column + 1 for row in range(10) for column in range(10)):
        lines.append(f"f {corner} {corner + 1} {corner + 12} {corner + 11}")
    return "\n".join(lines) + "\n"


def check_contacts(sdftool, path, sdf):
    """What `sdftool contacts` writes as HDF5 is what it prints as JSON; of no contacts too."""
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
    columns = """distance element evaluations feature feature_id id key lower_bound normal point polygon status
                 surface_point weights"""
    assert sorted(table) == columns.split()
    assert table["point"].shape == table["weights"].shape == (len(contacts), 3)
    assert table["feature_id"].shape == (len(contacts), 2)
    for row, contact in enumerate(contacts):
        for name in ["id", "evaluations", "distance", "lower_bound", "key"]:
            assert table[name][row] == contact[name], name
        for name in ["point", "surface_point", "normal"]:
            assert table[name][row].tolist() == contact[name], name
        assert table["polygon"][row] == contact.get("polygon", 0)
        assert kinds[table["element"][row]] == contact["element"]
        assert kinds[table["feature"][row]] == contact["feature"]
        assert statuses[table["status"][row]] == contact["status"]
        assert table["feature_id"][row].tolist() == (contact["feature_id"] + [2**32 - 1])[:2]
        assert table["weights"][row].tolist() == (contact["weights"] + [0, 0])[:3]


def write_by_h5py(path, names, sdf, distance):
    """The same grid, written by h5py as the end of docs/format.md tells."""
    with h5py.File(path, "w") as file:
        group = file.create_group("VTKHDF")
        group.attrs["Version"] = [2, 6]
        group.attrs["Type"] = np.bytes_("ImageData")
        group.attrs["WholeExtent"] = np.column_stack([np.zeros(3, int), sdf["counts"].astype(int) - 1]).ravel()
        group.attrs["Origin"] = sdf["origin"]
        group.attrs["Spacing"] = np.full(3, sdf["spacing"])
        group.attrs["Direction"] = np.eye(3).ravel()
        points = group.create_group("PointData")
        points.attrs["Scalars"] = np.bytes_("distance")
        chunks = tuple(np.minimum(distance.shape, 32))
        options = {"chunks": chunks, "shuffle": True, "compression": "gzip"}
        points.create_dataset("distance", data=distance, **options).attrs["Attribute"] = np.bytes_("Scalars")
        attrs = file.create_group("sdf").attrs
        for name, value in (sdf | {"tool": "h5py"}).items():
            attrs[name] = value
        attrs["attributes_sha256"] = hashlib.sha256(names["canonical"](dict(attrs)).encode()).hexdigest()


def main(path, sdftool_or_csv=None, seed="1"):
    names = documented()
    check_documented_names(path)
    sdf, distance = names["read_grid"](path)
    assert distance.dtype == np.dtype("<f4") and distance.shape == tuple(sdf["counts"][::-1])
    nodes = np.argwhere(np.ones_like(distance, bool))[:: max(1, distance.size // 1000)]
    at_nodes = names["interpolate"](sdf, distance, sdf["origin"] + sdf["spacing"] * nodes[:, ::-1])
    assert np.allclose(at_nodes, distance[tuple(nodes.T)], atol=1e-6 * np.abs(distance).max())
    print(f"h5py: {distance.size} samples, both checksums hold")
    image = check_vtk(path, sdf, distance)
    print("VTK: the same, bit for bit")
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
            write_by_h5py(ours, names, sdf, distance)
            assert evaluate(sdftool_or_csv, ours, points) == printed
        print("sdftool eval: the same of a grid that h5py wrote")
    count, worst = check_eval(printed, sdf, distance, names["interpolate"])
    print(f"sdftool eval: {count} points, off by {worst:.2g} at most")
    count, worst = check_probe(image, printed, sdf)
    print(f"VTK's vtkProbeFilter: {count} points, apart by {worst:.2g} at most")
    if not sdftool_or_csv.endswith(".csv"):
        print(f"sdftool contacts: {check_contacts(sdftool_or_csv, path, sdf)} contacts in HDF5, the same with h5py")


if __name__ == "__main__":
    main(*sys.argv[1:])
