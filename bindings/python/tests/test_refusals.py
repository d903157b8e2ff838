"""Wrong input is a TypeError, ValueError or OSError that says what."""

import errno
import math
import os
import pickle
import tempfile
from types import SimpleNamespace

import numpy as np
import pytest
import sdftool
from conftest import ball, sheet

VERTICES, FACES = ball(6)
NAN = VERTICES.copy()
NAN[3, 1] = math.nan
GRID = sdftool.bake(VERTICES, FACES, res=8)
KEPT = sdftool.bake(VERTICES, FACES, res=8, keep_mesh=True)


def saved_array():
    path = os.path.join(tempfile.mkdtemp(), "array.npy")
    np.save(path, np.zeros((2, 2, 2)))
    return path


def wanted(name, count):
    """Text of a vector with another number of numbers: from Python 3.11 on the name is in a note."""
    words = f"{count} finite numbers are needed"
    return f"^(argument '{name}': {words}|{words}\nwhile processing '{name}')$"


CASES = [
    (lambda: sdftool.bake("dragon.obj"), TypeError, "a str is not a mesh"),
    (lambda: sdftool.bake(VERTICES), TypeError, "give vertices and faces"),
    (lambda: sdftool.bake(SimpleNamespace(vertices=VERTICES, faces=FACES), 64), TypeError, "faces of its own.* by name, such as res=64"),
    (lambda: sdftool.bake(VERTICES[:, :2], FACES), TypeError, r"vertices: an array of shape \(62, 2\), not \(n, 3\)"),
    (lambda: sdftool.bake(VERTICES, FACES[:, :2]), TypeError, "triangulate"),
    (lambda: sdftool.bake(VERTICES, FACES.astype(float)), TypeError, "faces: an array of float64, not of integers"),
    (lambda: sdftool.bake(VERTICES.astype(str), FACES), TypeError, "vertices: an array of <U32, not of numbers"),
    (lambda: sdftool.bake(VERTICES, FACES + 60), ValueError, "refers to vertex 6[0-9], but there are 62 vertices"),
    (lambda: sdftool.bake(VERTICES, FACES.astype(np.int32) + 60), ValueError, "refers to vertex 6[0-9], but there are 62 vertices"),
    (lambda: sdftool.bake(VERTICES, FACES.astype(np.uint32) + 60), ValueError, "refers to vertex 6[0-9], but there are 62 vertices"),
    (lambda: sdftool.bake(VERTICES, FACES - 1), ValueError, "refers to vertex -1"),
    (lambda: sdftool.bake(VERTICES, FACES.astype(np.uint64) + 2**63), ValueError, "refers to vertex 92233720368547758[0-9]{2}, but"),
    (lambda: sdftool.bake(VERTICES, np.full((1, 3), 2**64 - 1)), ValueError, "refers to vertex 18446744073709551615, but"),
    (lambda: sdftool.bake(VERTICES, np.full((3, 1), 2**64 - 1).T), ValueError, "refers to vertex 18446744073709551615, but"),
    (lambda: sdftool.bake(NAN, FACES), ValueError, "NaN|finite"),
    (lambda: sdftool.bake([], []), ValueError, "no |empty|triangle"),
    (lambda: sdftool.bake(VERTICES, FACES, res=0), ValueError, "res=0"),
    (lambda: sdftool.bake(VERTICES, FACES, res=-1), ValueError, "^res=-1: give 1 to 4294967295 cells$"),
    (lambda: sdftool.bake(VERTICES, FACES, res=2**32), ValueError, "^res=4294967296: give 1 to 4294967295 cells$"),
    (lambda: sdftool.bake(VERTICES, FACES, res=10**9999), ValueError, "^res: give 1 to 4294967295 cells$"),
    (lambda: sdftool.bake(VERTICES, FACES, res="8"), TypeError, "res"),
    (lambda: sdftool.bake(VERTICES, FACES, band=-1), ValueError, "^band=-1: give 1 to 1000 cells$"),
    (lambda: sdftool.bake(VERTICES, FACES, padding=-1), ValueError, "^padding=-1: give 0 to 4294967295 cells$"),
    (lambda: sdftool.bake(VERTICES, FACES, res=4_000_000), ValueError, "grid of"),
    (lambda: sdftool.bake(VERTICES, FACES, res=8, voxel_size=1.0), TypeError, "give one of them"),
    (lambda: sdftool.bake(VERTICES, FACES, voxel_size=-1.0), ValueError, "voxel_size=-1"),
    (lambda: sdftool.bake(VERTICES, FACES, max_error="tiny"), ValueError, "0.1%"),
    (lambda: sdftool.bake(VERTICES, FACES, layout="octree"), ValueError, "give one of dense, sparse"),
    (lambda: sdftool.bake(VERTICES, FACES, sign="inside"), ValueError, "auto, pseudo-normal, winding"),
    (lambda: sdftool.bake(VERTICES, FACES, precision="f16"), ValueError, "give one of f32, u16, u8"),
    (lambda: sdftool.bake(VERTICES, FACES, threads=0), ValueError, "threads=0"),
    (lambda: sdftool.signed_distance(VERTICES, FACES, VERTICES, threads=-1), ValueError, "^threads=-1: give 1 to 1024, or None for all cores$"),
    (lambda: GRID(VERTICES, threads=1025), ValueError, "^threads=1025: give 1 to 1024"),
    (lambda: GRID.sample(VERTICES, threads=-1), ValueError, "^threads=-1: give 1 to 1024"),
    (lambda: GRID.contacts(*sheet(4), threads=2**80), ValueError, "^threads: give 1 to 1024"),
    (lambda: GRID.contacts(*sheet(4), budget=-1), ValueError, "^budget=-1: give 0 to 4294967295$"),
    (lambda: GRID.cuda_query(*sheet(4), budget=-1), ValueError, "^budget=-1: give"),
    (lambda: GRID.export("ball.npy", res=-1), ValueError, "^res=-1: give 1"),
    (lambda: GRID.export("ball.nvdb", band=-1), ValueError, "^band=-1: give 1 to 1000 cells$"),
    (lambda: sdftool.load("/nowhere/x.sdf.h5"), FileNotFoundError, "/nowhere/x.sdf.h5"),
    (lambda: sdftool.load(3), TypeError, "expected str, bytes or os.PathLike object, not int"),
    (lambda: GRID.contacts(*sheet(4), kernels=3), TypeError, "expected str, bytes or os.PathLike object, not int"),
    (lambda: sdftool.from_bytes(b"neither"), ValueError, "data: not TOML"),
    (lambda: GRID.save("/nowhere/x.sdf.h5"), OSError, "nowhere"),
    (lambda: GRID.export("ball.obj"), ValueError, "ball.obj: use a name that ends in one of .nvdb, .raw"),
    (lambda: GRID.export("ball", "obj"), ValueError, "format=.*nvdb, raw, npy, nrrd, vtkhdf, glb"),
    (lambda: GRID.export("ball.npy", band=3), ValueError, "band: only"),
    (lambda: GRID.export("ball.npy", res=0), ValueError, "res=0"),
    (lambda: GRID.export("/nowhere/ball.npy"), FileNotFoundError, "/nowhere/ball.npy"),
    (lambda: sdftool.half_space().export("ground.npy"), ValueError, "unbounded"),
    (lambda: sdftool.import_grid("/nowhere/a.npy", spacing=1.0), FileNotFoundError, "/nowhere/a.npy"),
    (lambda: sdftool.import_grid(saved_array()), ValueError, "spacing"),
    (lambda: sdftool.import_grid(__file__, spacing=1.0), ValueError, "its own place"),
    (lambda: sdftool.import_grid(__file__), ValueError, "test_refusals.py"),
    (lambda: GRID([1.0, 2.0, 3.0]), TypeError, r"shape \(3\), not \(n, 3\)"),
    (lambda: GRID.contacts(*sheet(4), margin=math.nan), ValueError, "margin=NaN"),
    (lambda: GRID.contacts(*sheet(4), margin=100.0), ValueError, "bake it with more padding"),
    (lambda: GRID.contacts(*sheet(4), method="magic"), ValueError, "auto, certified, fw"),
    (lambda: GRID.contacts(*sheet(4), method="gss"), ValueError, "edges only"),
    (lambda: GRID.contacts(*sheet(4), method="fw", all_minima=True), ValueError, "auto and certified only"),
    (lambda: GRID.contacts(*sheet(4), pose=2.0 * np.eye(4)), ValueError, "not a rigid motion"),
    (lambda: GRID.contacts(*sheet(4), pose=np.diag([1.0, 1.0, -1.0, 1.0])), ValueError, "not a rigid motion: .*mirror"),
    (lambda: GRID.contacts(*sheet(4), pose=np.eye(4) + np.eye(4)[[3, 0, 1, 2]] * [[0], [0], [0], [0.5]]), ValueError, "not a rigid motion"),
    (lambda: GRID.contacts(*sheet(4), pose=np.eye(3)), TypeError, r"\(4, 4\)"),
    (lambda: GRID.contacts(*sheet(4), pose=[[0, 0, 0], [0, 0, 1]]), TypeError, r"pose\[1\]: 4 numbers"),
    (lambda: GRID.contacts(*sheet(4), pose=([0, 0, 0], [0, 0, 0, 0])), ValueError, "quaternion is zero"),
    (lambda: GRID.overlap(GRID, other_pose=2.0 * np.eye(4)), ValueError, "^other_pose: not a rigid motion"),
    (lambda: GRID.overlap(GRID, pose=([0, 0], [0, 0, 0, 1])), TypeError, r"^pose\[0\]: 3 numbers"),
    (lambda: GRID | 1, TypeError, "unsupported operand"),
    (lambda: GRID.overlap(None), TypeError, "Sdf"),
    (lambda: sdftool.sphere(-1.0), ValueError, "radius must be positive"),
    (lambda: sdftool.sphere(10**400), ValueError, "radius must be positive and finite"),
    (lambda: sdftool.sphere(1.0).offset(-(10**400)), ValueError, "^distance: -inf is not a finite length"),
    (lambda: GRID.contacts(*sheet(4), margin=10**400), ValueError, "^margin=inf"),
    (lambda: sdftool.bake(VERTICES, FACES, voxel_size=10**400), ValueError, "^voxel_size=inf"),
    (lambda: sdftool.cuboid([1, 2]), TypeError, wanted("half_extents", 3)),
    (lambda: sdftool.cuboid([1, 2, 10**400]), TypeError, wanted("half_extents", 3)),
    (lambda: GRID.moved([1, 2]), TypeError, wanted("translation", 3)),
    (lambda: GRID.moved(rotation=[1, 2, 3]), TypeError, wanted("rotation", 4)),
    (lambda: sdftool.import_grid("a.npy", origin=[0, 0]), TypeError, wanted("origin", 3)),
    (lambda: GRID.offset(math.nan), ValueError, "^distance: NaN is not a finite length$"),
    (lambda: GRID.shell(math.nan), ValueError, "^thickness: NaN is not a positive finite length$"),
    (lambda: GRID.smooth_union(GRID, math.nan), ValueError, "^blend: NaN is not a positive finite length$"),
    (lambda: sdftool.reduce(GRID.contacts(*sheet(4)), 4, movement=0.1, thickness=math.nan), ValueError, "^the thickness must be a finite length$"),
    (lambda: sdftool.union([]), ValueError, "one field"),
    (lambda: sdftool.half_space().overlap(sdftool.half_space()), ValueError, "unbounded"),
    (lambda: pickle.dumps(GRID | sdftool.sphere(1.0)), TypeError, "cannot be pickled"),
    (lambda: sdftool.signed_distance(VERTICES, FACES, [[0.0, 0.0]]), TypeError, "points"),
    (lambda: sdftool.signed_distance(VERTICES, FACES), TypeError, r"^points: an array of shape \(n, 3\) is needed$"),
    (lambda: sdftool.signed_distance(VERTICES.tolist(), FACES.tolist()), TypeError, r"^points: an array of shape \(n, 3\) is needed$"),
    (lambda: sdftool.signed_distance("dragon.obj", VERTICES), TypeError, "a str is not a mesh"),
    (lambda: GRID.contacts(*sheet(4), exact=True), ValueError, r"bake\(\.\.\., keep_mesh=True\)$"),
    (lambda: KEPT.moved([1.0, 0.0, 0.0]).contacts(*sheet(4), exact=True), ValueError, "moved or combined ask the grid itself, with a pose"),
    (lambda: sdftool.bake(VERTICES, FACES, layout="sparse", band=0), ValueError, "band=0: give 1 to 1000 cells"),
    (lambda: sdftool.sphere(1.0).export("ball.nvdb", band=1001), ValueError, "band=1001: give 1 to 1000 cells"),
]


@pytest.mark.parametrize(
    "call, file",
    [
        (sdftool.load, "/nowhere/x.sdf.h5"),
        (GRID.save, "/nowhere/x.sdf.h5"),
        (sdftool.sphere(1.0).save, "/nowhere/x.sdf.toml"),
        (GRID.export, "/nowhere/ball.npy"),
        (lambda file: sdftool.import_grid(file, spacing=1.0), "/nowhere/a.npy"),
    ],
)
def test_refusals_of_the_system_have_its_number_and_the_file(call, file):
    with pytest.raises(FileNotFoundError, match=file) as caught:
        call(file)
    assert (caught.value.errno, caught.value.filename) == (errno.ENOENT, file)


def test_paths_are_what_open_takes(tmp_path):
    class Path:
        def __init__(self, name):
            self.name = name

        def __fspath__(self):
            return self.name

    grid, array = (str(tmp_path / name) for name in ["ball-ü.sdf.h5", "ball-ü.npy"])
    for kind in [str, str.encode, Path, lambda name: Path(name.encode())]:
        GRID.save(kind(grid))
        assert sdftool.load(kind(grid)).to_bytes() == GRID.to_bytes()
        assert [os.fspath(path) for path in GRID.export(kind(array))] == [array]
        assert sdftool.import_grid(kind(array), spacing=1.0).shape == GRID.shape
        sdftool.clear_leftovers(kind(grid))


def test_a_mesh_whose_attribute_raises_raises_that():
    class Broken:
        faces = FACES

        @property
        def vertices(self):
            raise KeyError("boom")

    for call in [lambda: sdftool.bake(Broken()), lambda: GRID.contacts(Broken()), lambda: sdftool.MeshClusters(Broken())]:
        with pytest.raises(KeyError, match="boom"):
            call()


CLOTH, CLOTH_FACES = sheet(4)
TORN = CLOTH.copy()
TORN[7, 2] = math.inf


def test_elements_that_are_not_finite_are_counted_and_the_first_is_named():
    count = np.count_nonzero((CLOTH_FACES == 7).any(axis=1))
    first = np.flatnonzero((CLOTH_FACES == 7).any(axis=1))[0]
    words = f"^{count} faces have coordinates that are not finite or too large, face {first} the first$"
    for options in [{}, {"method": "fw"}, {"one_per_feature": True}, {"lean": True}, {"threads": 1}]:
        with pytest.raises(ValueError, match=words):
            GRID.contacts(TORN, CLOTH_FACES, **options)
    with pytest.raises(ValueError, match="^1 vertex has coordinates that are not finite or too large, vertex 7 the first$"):
        GRID.contacts(TORN, CLOTH_FACES, elements="vertices")
    with pytest.raises(ValueError, match="^. edges have .*, edge . the first$"):
        GRID.contacts(TORN, CLOTH_FACES, elements="edges")
    whole = CLOTH_FACES[np.isfinite(TORN)[CLOTH_FACES].all((1, 2))]
    assert len(whole) == len(CLOTH_FACES) - count
    assert len(GRID.contacts(TORN, whole)) > 0


def test_vertices_that_no_face_uses_may_be_anything():
    padded, clean = np.concatenate([VERTICES, [[math.nan] * 3, [math.inf, 0.0, 0.0], [1e200, 0.0, 0.0]]]), VERTICES
    calls = [
        lambda vertices: sdftool.bake(vertices, FACES, res=8).values,
        lambda vertices: sdftool.bake(vertices, FACES, res=8, layout="sparse", sign="winding", inner_faces="keep")(VERTICES),
        lambda vertices: sdftool.bake(vertices, FACES, res=8, keep_mesh=True).contacts(*sheet(4), exact=True),
        lambda vertices: sdftool.signed_distance(vertices, FACES, 0.5 * VERTICES),
        lambda vertices: GRID.contacts(vertices, FACES),
        lambda vertices: KEPT.contacts(vertices, FACES, exact=True),
        lambda vertices: GRID.contacts(vertices, FACES, elements="edges"),
        lambda vertices: GRID.contacts(vertices, FACES, clusters=sdftool.MeshClusters(vertices, FACES)),
        lambda vertices: GRID.first_touches(vertices + [3.0, 0.0, 0.0], FACES, end=vertices, tolerance=1e-4)[1],
    ]
    for call in calls:
        assert np.array_equal(call(padded), call(clean))
    with pytest.raises(ValueError, match="^3 vertices have coordinates that are not finite or too large, vertex 62 the first$"):
        GRID.contacts(padded, FACES, elements="vertices")


SPARSE = sdftool.bake(VERTICES, FACES, res=16, layout="sparse", band=1)
DEEP = [
    SPARSE.moved([1.0, 0.0, 0.0]),
    SPARSE | sdftool.sphere(0.1).moved([9.0, 0.0, 0.0]),
    sdftool.cuboid([2.0, 2.0, 2.0]) & SPARSE,
    SPARSE.offset(0.01),
]


def test_a_margin_below_the_band_is_refused_wherever_the_grid_is():
    for field in [SPARSE, *DEEP]:
        for call in [lambda: field.contacts(*ball(6, 0.1), margin=-0.5), lambda: field.overlap(sdftool.sphere(0.3), margin=-0.5)]:
            with pytest.raises(ValueError, match="-0.5 is deeper than the .* around the surface .*wider band, or dense"):
                call()
    # What is complete leaves out nothing.
    with pytest.raises(ValueError, match="complete=True"):
        DEEP[1].contacts(*ball(6, 0.1), margin=-0.5)
    faces = ball(6, 0.1)[1]
    assert len(DEEP[1].contacts(*ball(6, 0.1), margin=-0.5, complete=True)) == len(faces)
    assert SPARSE.moved(scale=2.0).max_margin is None and SPARSE.max_margin == pytest.approx(SPARSE.band)


@pytest.mark.parametrize("call, error, words", CASES)
def test_wrong_input_says_what_is_wrong(call, error, words):
    with pytest.raises(error, match=words):
        call()


def test_combinations_nest_no_deeper_than_files_may():
    field = sdftool.sphere(1.0)
    with pytest.raises(ValueError, match="more than 63"):
        for _ in range(100):
            field = field.offset(0.01)
    assert np.isfinite(field([[0.0, 0.0, 0.0]])).all()
    # What could be made can be saved.
    assert sdftool.from_bytes(field.to_bytes())([[0.0, 0.0, 0.0]]) == field([[0.0, 0.0, 0.0]])
