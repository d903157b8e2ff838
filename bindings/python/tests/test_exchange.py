"""Files of other programs."""

import json
import warnings

import numpy as np
import pytest
import sdftool
from conftest import dented_ball, sheet

FORMATS = ["nvdb", "raw", "npy", "nrrd", "vtkhdf", "glb"]


@pytest.fixture(scope="module")
def body():
    return sdftool.bake(*dented_ball(16), res=24, layout="sparse")


@pytest.mark.parametrize("name", FORMATS)
def test_a_file_is_that_of_the_program(body, name, program, tmp_path):
    body.save(tmp_path / "body.sdf.h5")
    program("export", "body.sdf.h5", "--format", name, "-o", f"theirs.{name}", folder=tmp_path)
    (tmp_path / "here").mkdir()
    # The grid in a level set has the file's name.
    written = body.export(tmp_path / "here" / f"body.{name}")
    names = [f"body.{name}"] + ([f"body.{name}.json"] if name == "raw" else [])
    assert [path.name for path in written] == names and sorted(names) == sorted(p.name for p in (tmp_path / "here").iterdir())
    assert written[0].read_bytes() == (tmp_path / f"theirs.{name}").read_bytes()


def test_arrays_are_the_values_and_come_back(body, tmp_path):
    dense = sdftool.bake(*dented_ball(16), res=24)
    (path,) = dense.export(str(tmp_path / "body.bin"), "npy")
    assert np.array_equal(np.load(path), dense.values)
    path.rename(tmp_path / "body.npy")
    low, _ = dense.bounds
    again = sdftool.import_grid(tmp_path / "body.npy", spacing=dense.spacing, origin=low)
    assert np.array_equal(again.values, dense.values) and again.spacing == dense.spacing
    assert np.allclose(again.bounds, dense.bounds) and again.error_bound == np.inf
    raw, text = dense.export(tmp_path / "body.raw")
    described = json.loads(text.read_text())
    assert np.array_equal(np.fromfile(raw, "<f4"), dense.values.ravel()) and described


def test_a_level_set_comes_back_as_its_band(body, tmp_path):
    (path,) = body.export(tmp_path / "body.nvdb", band=2)
    again = sdftool.import_grid(path)
    points = np.random.default_rng(9).uniform(-1.0, 1.0, (3000, 3))
    near = np.abs(body(points)) < body.spacing
    assert near.sum() > 50
    assert np.abs(again(points[near]) - body(points[near])).max() < 1e-5


def test_a_closed_form_is_sampled_on_as_many_cells_as_asked(tmp_path):
    (path,) = sdftool.sphere(1.0).export(tmp_path / "ball.npy", res=16, threads=1)
    values = np.load(path)
    assert values.shape == (25, 25, 25) and abs(values.min() + 1.0) < 1e-6


def test_every_ending_that_the_advice_names_is_one(tmp_path):
    with pytest.raises(ValueError, match="use a name that ends in one of") as caught:
        sdftool.sphere(1.0).export(tmp_path / "ball.stl")
    endings = str(caught.value).split(" one of ")[1].split(", or ")[0].split(", ")
    assert len(endings) == 9
    for ending in endings:
        assert sdftool.sphere(1.0).export(tmp_path / f"ball{ending}", res=4)


def plate(thickness):
    """A closed plate of 2 by 2."""
    corners = np.array([[x, y, z] for x in (-1.0, 1.0) for y in (-1.0, 1.0) for z in (-0.5 * thickness, 0.5 * thickness)])
    sides = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
    return corners, [face for a, b, c, d in sides for face in ([a, b, c], [a, c, d])]


@pytest.mark.parametrize("name", ["nvdb", "raw", "npy", "nrrd", "vtkhdf", "blob", "c", "rust"])
def test_a_shape_that_the_cells_lose_is_warned_of(name, tmp_path):
    thin = sdftool.cuboid((1.0, 1.0, 0.0065))
    with pytest.warns(UserWarning, match=r"plate: the shape is thinner than the cells: the surface is empty: between 137 × 137 ×") as told:
        assert thin.export(tmp_path / "plate", name)[0].exists()
    # Warnings name the caller's line.
    assert len(told) == 1 and told[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        thin.export(tmp_path / "plate", name, res=512)
        # A sheet has no inside to lose.
        sdftool.bake(*sheet(4), res=16).export(tmp_path / "sheet", name, res=8)


def test_a_solid_that_no_node_is_inside_of_is_warned_of():
    with pytest.warns(UserWarning, match="no node is inside the solid: it is thinner than a voxel of 3.12e-2: bake with smaller voxels") as told:
        thin = sdftool.bake(*plate(0.01), res=64)
    assert thin.values.min() > 0.0 and len(told) == 1 and told[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sdftool.bake(*plate(0.1), res=64)
        sdftool.bake(*sheet(4), res=16)
