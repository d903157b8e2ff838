"""The wheel gives the bits of the program: contacts, samples, errors, overlaps."""

import numpy as np
import pytest
import sdftool
from conftest import dented_ball, sheet, write_obj

CASES = [
    (dict(res=48), ["--res", "48"]),
    (dict(voxel_size=0.05, padding=6, sign="winding"), ["--voxel-size", "0.05", "--padding", "6", "--sign", "winding"]),
    (
        dict(res=96, layout="sparse", band=5, precision="u8"),
        ["--res", "96", "--layout", "sparse", "--band", "5", "--precision", "u8"],
    ),
    (dict(res=48, precision="u16"), ["--res", "48", "--precision", "u16"]),
    (dict(max_error="1%"), ["--max-error", "1%"]),
]

QUERIES = [
    (dict(), []),
    (dict(method="fw", margin=0.02), ["--method", "fw", "--margin", "0.02"]),
    (dict(elements="edges", method="gss"), ["--elements", "edges", "--method", "gss"]),
    (dict(elements="vertices", margin=0.02), ["--elements", "vertices", "--margin", "0.02"]),
    (
        dict(pose=([0.1, 0.2, 0.0], [0.0, 0.0, 1.0, 2.0]), method="newton"),
        ["--translate", "0.1,0.2,0", "--rotate", "0,0,1,2", "--method", "newton"],
    ),
    (dict(all_minima=True, method="certified"), ["--all-minima", "--method", "certified"]),
    (dict(complete=True, one_per_feature=True), ["--complete", "--one-per-feature"]),
    (dict(lean=True, method="fw", margin=0.02), ["--lean", "--method", "fw", "--margin", "0.02"]),
]


@pytest.mark.parametrize("options, arguments", CASES)
def test_grids_and_their_contacts_have_the_bits_of_the_program(program, tmp_path, options, arguments):
    body, cloth = dented_ball(24), sheet(20)
    write_obj(tmp_path / "body.obj", *body)
    write_obj(tmp_path / "cloth.obj", *cloth)
    program("bake", "body.obj", "-o", "body.sdf.h5", *arguments, folder=tmp_path)
    theirs = sdftool.load(tmp_path / "body.sdf.h5")
    ours = sdftool.bake(*body, **options)
    assert (ours.error_bound, ours.shape, ours.layout, ours.precision) == (
        theirs.error_bound,
        theirs.shape,
        theirs.layout,
        theirs.precision,
    )
    points = np.random.default_rng(16).uniform(-1.2, 1.2, (2000, 3))
    for a, b in zip(ours.sample(points), theirs.sample(points)):
        assert np.array_equal(a, b)
    for query, query_arguments in QUERIES:
        answer = program("contacts", "cloth.obj", "body.sdf.h5", *query_arguments, folder=tmp_path)
        found = answer["contacts"]
        records, counts = theirs.contacts(*cloth, **query, counts=True)
        assert counts == dict(elements=answer["elements"], searched=answer["passed_cull"], possible=answer["possible"], undecided=answer["undecided"])
        assert len(records) == len(found) > 10
        same_records(records, found)
        baked = ours.contacts(*cloth, **query)
        for name in records.dtype.names:
            assert np.array_equal(baked[name], records[name]), name


def test_exact_contacts_have_the_bits_of_the_program(program, tmp_path):
    body, cloth = dented_ball(24), sheet(20)
    write_obj(tmp_path / "body.obj", *body)
    write_obj(tmp_path / "cloth.obj", *cloth)
    program("bake", "body.obj", "-o", "body.sdf.h5", "--res", "48", "--keep-mesh", folder=tmp_path)
    found = program("contacts", "cloth.obj", "body.sdf.h5", "--exact", "--margin", "0.02", folder=tmp_path)["contacts"]
    for field in [sdftool.load(tmp_path / "body.sdf.h5"), sdftool.bake(*body, res=48, keep_mesh=True)]:
        records = field.contacts(*cloth, exact=True, margin=0.02)
        assert len(records) == len(found) > 10
        same_records(records, found)
    with pytest.raises(ValueError, match="keep_mesh"):
        sdftool.bake(*body, res=48).contacts(*cloth, exact=True)


def same_records(records, found):
    for record, contact in zip(records, found):
        count = len(contact["weights"])
        for name in ["point", "surface_point", "normal"]:
            assert record[name].tolist() == contact[name]
        for name in ["id", "distance", "lower_bound", "slope", "evaluations", "key"]:
            assert record[name] == contact[name]
        for name in ["error_bound", "shape_lower_bound"]:
            # JSON has no infinity.
            assert (record[name] if np.isfinite(record[name]) else None) == contact[name]
        assert record["weights"].tolist()[:count] == contact["weights"]
        assert record["vertices"].tolist()[:count] == contact["vertices"]
        assert sdftool.STATUS_NAMES[record["status"]] == contact["status"]
        assert sdftool.ELEMENT_NAMES[record["element"]] == contact["element"]
        assert sdftool.ELEMENT_NAMES[record["feature"]] == contact["feature"]
        assert record["feature_id"].tolist()[: len(contact["feature_id"])] == contact["feature_id"]


def test_closed_forms_have_the_bits_of_the_program(program, tmp_path):
    field = (sdftool.sphere(0.5) | sdftool.cuboid([0.7, 0.2, 0.2])) - sdftool.torus(0.5, 0.1).moved([0.0, 0.0, 0.3])
    field.save(tmp_path / "form.sdf.toml")
    cloth = sheet(20, height=0.45)
    write_obj(tmp_path / "cloth.obj", *cloth)
    found = program("contacts", "cloth.obj", "form.sdf.toml", folder=tmp_path)["contacts"]
    records = field.contacts(*cloth)
    assert len(records) == len(found) > 10
    same_records(records, found)


def test_two_fields_have_the_bits_of_the_program(program, tmp_path):
    a, b = sdftool.sphere(1.0), sdftool.cuboid([0.5, 0.5, 0.5])
    a.save(tmp_path / "a.sdf.toml")
    b.save(tmp_path / "b.sdf.toml")
    arguments = ["--translate-first", "0,0,1.2"]
    found = program("contacts", "a.sdf.toml", "b.sdf.toml", *arguments, folder=tmp_path)
    overlap = a.overlap(b, pose=([0.0, 0.0, 1.2], [0.0, 0.0, 0.0, 1.0]))
    assert overlap.verdict == "contact" == found["verdict"]
    assert overlap.area == found["patch"]["area"] and len(overlap.patch_areas) == found["patch"]["points"]
    assert (overlap.unknown, overlap.complete) == (found["patch"]["unknown"], found["patch"]["complete"])
    assert overlap.lower_bound == found["deepest"]["lower_bound"]
