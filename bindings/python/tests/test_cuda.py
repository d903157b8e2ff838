"""Contacts on a card, for arrays of numpy and for arrays that are there: with the driver of gpu/stub, which has the kernels on the CPU.

SDFTOOL_STUB names its folder, which must be in LD_LIBRARY_PATH, too: .ci/bindings.sh does so."""

import gc
import os
import subprocess
import sys
import threading
import weakref

import numpy as np
import pytest
import sdftool
from card import CardArray, new_stream, on_host
from conftest import ball, dented_ball, sheet, write_obj

STUB = os.environ.get("SDFTOOL_STUB", "")
KERNELS = os.path.join(STUB, "kernels.ptx")
pytestmark = pytest.mark.skipif(not STUB, reason="SDFTOOL_STUB does not name the driver's folder")

BODY = sdftool.bake(*dented_ball(24), res=48)
POINTS, FACES = sheet(20)
POINTS = POINTS.astype(np.float32)
FACES = FACES.astype(np.uint32)
# One of its vertices, a corner of three faces, is not finite.
TORN = POINTS.copy()
TORN[[1]] = np.nan
MARGIN = 0.02
POSE = ([0.1, 0.2, 0.0], [0.0, 0.0, 1.0, 2.0])


def on_cpu(points=POINTS, faces=FACES, **options):
    return BODY.contacts(points, faces, **{"margin": MARGIN, **options})


def on_card(points=POINTS, faces=FACES, **options):
    return BODY.contacts(points, faces, device="cuda", kernels=KERNELS, **{"margin": MARGIN, **options})


def query(points=POINTS, faces=FACES, **options):
    return BODY.cuda_query(points, faces, kernels=KERNELS, **{"margin": MARGIN, **options})


def same(a, b, is_posed=False):
    """All bits; but bounds of points that were given on the host are lowered by the rounding into the frame of a field with a pose."""
    assert a.dtype == b.dtype == sdftool.contact_dtype and len(a) == len(b) > 10
    for name in a.dtype.names:
        if is_posed and name in ["lower_bound", "shape_lower_bound"]:
            assert np.abs(a[name] - b[name]).max() < 1e-6, name
        else:
            assert np.array_equal(a[name], b[name]), name


@pytest.mark.parametrize("options", [dict(), dict(method="fw"), dict(method="certified"), dict(pose=POSE), dict(elements="vertices"),
                                     dict(elements="edges", method="gss"), dict(one_per_feature=True, method="pgd"),
                                     dict(lean=True, method="fw")])
def test_contacts_on_a_card_are_those_of_the_cpu_to_seven_digits(options):
    card, cpu = on_card(**options), on_cpu(**options)
    # The cloth has elements that are flat to the body: minima may lie anywhere in them.
    assert np.array_equal(card["id"], cpu["id"]) and len(cpu) > 10
    difference = card["distance"] - cpu["distance"]
    assert difference.min() > -1e-5 and difference.max() < 1e-3


@pytest.mark.parametrize("options", [dict(), dict(method="fw"), dict(method="certified"), dict(pose=POSE), dict(elements="vertices"),
                                     dict(elements="edges")])
@pytest.mark.parametrize("dtype", [np.uint32, np.int32])
def test_arrays_on_the_card_have_the_bits_of_arrays_of_numpy(options, dtype):
    expected = on_card(**options)
    points, faces = CardArray(POINTS), CardArray(FACES.astype(dtype))
    for mesh in [(points, faces), (points, FACES), (POINTS, faces)]:
        same(on_card(*mesh, **options), expected, "pose" in options and mesh[0] is points)

    class Mesh:
        vertices, triangles = points, faces

    same(BODY.contacts(Mesh(), device="cuda", kernels=KERNELS, margin=MARGIN, **options), expected, "pose" in options)


def test_points_on_the_card_are_read_there_and_nowhere_else():
    points = CardArray(POINTS)
    asked = query(points, method="fw")
    expected = asked.contacts()
    # The same memory, written anew: no copy that was made before counts.
    points.write(POINTS + np.float32([0.0, 0.0, 0.1]))
    asked.set_points(points)
    moved = asked.contacts()
    same(moved, on_card(POINTS + np.float32([0.0, 0.0, 0.1]), method="fw"))
    assert len(moved) != len(expected)


@pytest.mark.parametrize("version, named", [(3, True), (2, False)])
@pytest.mark.parametrize("own", [True, False])
def test_the_stream_of_an_array_is_waited_for(version, named, own):
    changes = {} if named else dict(version=version, stream="left out")
    stream = new_stream() if own else 1
    points, faces = CardArray(POINTS, stream, **changes), CardArray(FACES, stream, **changes)
    same(on_card(points, faces), on_card())
    asked = query(points, faces)
    points.write(POINTS + np.float32(0.05), stream)
    asked.set_points(points)
    same(asked.contacts(), on_card(POINTS + np.float32(0.05)))


def test_an_array_without_a_stream_is_there_already():
    stream = new_stream()
    points = CardArray(POINTS, stream)
    points.changes["stream"] = None
    # Nobody waited: the memory holds what the stub leaves in it, tiny numbers.
    assert np.abs(on_card(points)["point"]).max() < 1e-6
    points.changes = {}
    same(on_card(points), on_card())


def test_a_query_keeps_field_and_mesh_for_many_frames():
    for first in [POINTS, CardArray(POINTS)]:
        asked = query(first)
        assert asked.card == "stub on the CPU"
        same(asked.contacts(), on_card())
        same(asked.contacts(), on_card())
        for step in range(1, 4):
            points = POINTS + np.float32([0.0, 0.01 * step, 0.02 * step])
            asked.set_points(points if step % 2 else CardArray(points))
            same(asked.contacts(), on_card(points))
        asked.set_points(POINTS.astype(float))
        asked.set_pose(POSE)
        same(asked.contacts(), on_card(pose=POSE))
        asked.set_points(CardArray(POINTS + np.float32(0.01)))
        same(asked.contacts(), on_card(POINTS + np.float32(0.01), pose=POSE), is_posed=True)
        asked.set_pose(None)
        same(asked.contacts(), on_card(POINTS + np.float32(0.01)))


def test_a_query_keeps_the_points_that_it_reads_and_no_others():
    points, faces = CardArray(POINTS), CardArray(FACES)
    asked = query(points, faces)
    points_alive, faces_alive = weakref.ref(points), weakref.ref(faces)
    del points, faces
    gc.collect()
    # The faces were copied, and may change or go.
    assert points_alive() is not None and faces_alive() is None
    same(asked.contacts(), on_card())
    asked.set_points(POINTS)
    gc.collect()
    assert points_alive() is None
    same(asked.contacts(), on_card())
    last = CardArray(POINTS)
    last_alive = weakref.ref(last)
    asked.set_points(last)
    with pytest.raises(ValueError, match="3 points given for a mesh of 441"):
        asked.set_points(CardArray(POINTS[:3]))
    del last
    gc.collect()
    assert last_alive() is not None
    same(asked.contacts(), on_card())
    del asked
    gc.collect()
    assert last_alive() is None


def test_faces_that_change_later_do_not_matter():
    faces = CardArray(FACES)
    asked = query(POINTS, faces)
    expected = asked.contacts()
    faces.write(np.full_like(FACES, 4_000_000_000))
    CardArray(FACES, faces.stream)
    BODY.contacts(CardArray(POINTS), FACES, device="cuda", kernels=KERNELS)
    same(asked.contacts(), expected)


@pytest.mark.parametrize("options", [dict(method="fw"), dict(method="certified"), dict(method="fw", pose=POSE),
                                     dict(method="pgd", elements="edges"), dict(elements="vertices")])
def test_contacts_that_stay_on_the_card_are_the_same(options):
    asked = query(CardArray(POINTS), CardArray(FACES), **options)
    on_host_ = asked.contacts()
    found = asked.contacts_on_card()
    # The columns keep the contacts, and another frame does not change them.
    columns = {name: found[name] for name in found.keys()}
    count = len(found)
    del found
    asked.set_points(POINTS + np.float32(0.1))
    asked.contacts()
    del asked
    gc.collect()
    columns = {name: on_host(column) for name, column in columns.items()}
    assert count == len(on_host_) > 10
    order = np.argsort(columns["id"])
    for name, column in columns.items():
        assert column.dtype == (np.uint32 if expected_kind(name) else np.float32)
        column, expected = column[order], on_host_[name]
        if name == "feature_id":
            column, expected = column[:, 0], expected[:, 0]
        if name == "status":
            names = sdftool.CudaContacts.STATUS_NAMES
            assert sorted(names) == sorted(sdftool.STATUS_NAMES)
            column = [sdftool.STATUS_NAMES.index(names[code]) for code in column]
        if name == "weights":
            # They are made to sum to one in f64.
            assert np.abs(column - expected).max() < 1e-6
        else:
            assert np.array_equal(column, expected), name
    assert set(columns) == set(sdftool.contact_dtype.names) - {"key", "padding"}


def expected_kind(name):
    """Is it a column of integers?"""
    return sdftool.contact_dtype[name].base.kind == "u"


def test_contacts_that_cannot_stay_on_the_card_are_refused():
    far = query(POINTS + np.float32([0.0, 0.0, 50.0])).contacts_on_card()
    assert len(far) == 0 and on_host(far["point"]).shape == (0, 3)
    with pytest.raises(KeyError, match='"force": give one of element, id'):
        far["force"]
    with pytest.raises(ValueError, match="one contact for each feature: not on a GPU"):
        query(one_per_feature=True, method="fw").contacts_on_card()
    # Elements that Frank-Wolfe does not settle, nor a certified search by one evaluation.
    with pytest.raises(ValueError, match="elements are left to the CPU"):
        query(budget=1).contacts_on_card()


def test_meshes_of_nothing_have_no_contacts():
    nothing = CardArray(np.zeros((0, 3), np.float32)), CardArray(np.zeros((0, 3), np.uint32))
    for points, faces in [nothing, (CardArray(POINTS), nothing[1]), (np.zeros((0, 3)), nothing[1])]:
        assert len(on_card(points, faces)) == 0
        assert len(on_card(points, faces, pose=POSE)) == 0


def test_several_threads_may_ask_one_query():
    asked = query(CardArray(POINTS), CardArray(FACES))
    expected, found = on_card(), []
    threads = [threading.Thread(target=lambda: found.append([asked.contacts() for _ in range(5)])) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(timeout=60)
    assert len(found) == 4
    for contacts in sum(found, []):
        same(contacts, expected)


def test_contacts_have_the_bits_of_the_program(program, tmp_path):
    from test_same_bits import same_records

    BODY.save(tmp_path / "body.sdf.h5")
    write_obj(tmp_path / "cloth.obj", POINTS.astype(float), FACES)
    for options, arguments in [(dict(), []), (dict(method="pgd"), ["--method", "pgd"])]:
        arguments = ["--margin", str(MARGIN), "--device", "cuda", "--kernels", KERNELS, *arguments]
        report = program("contacts", "cloth.obj", "body.sdf.h5", *arguments, folder=tmp_path)
        assert report["device"] == "cuda"
        same_records(on_card(CardArray(POINTS), CardArray(FACES), **options), report["contacts"])


POINT_ARRAY, FACE_ARRAY = (CardArray(POINTS), CardArray(FACES)) if STUB else (None, None)
BAD_FACES = FACES.copy()
BAD_FACES[7, 2] = 441
HOST = POINTS.ctypes.data


def changed(numbers, **changes):
    return CardArray(numbers, **changes)


REFUSALS = [
    (lambda: on_card(changed(POINTS.astype(float)), FACE_ARRAY), TypeError, "vertices: an array of <f8 on the card, not of float32"),
    (lambda: on_card(changed(POINTS, typestr=">f4"), FACE_ARRAY), TypeError, "vertices: an array of >f4"),
    (lambda: on_card(POINT_ARRAY, changed(FACES.astype(np.int64))), TypeError, "faces: an array of <i8 .* uint32 or int32"),
    (lambda: on_card(POINT_ARRAY, changed(POINTS)), TypeError, "faces: an array of <f4"),
    (lambda: on_card(changed(POINTS, strides=(4, 1764)), FACE_ARRAY), TypeError, r"strides \(4, 1764\) .*not contiguous"),
    (lambda: on_card(changed(POINTS, strides=(24, 4)), FACE_ARRAY), TypeError, "not contiguous"),
    (lambda: on_card(changed(POINTS, strides=(12,)), FACE_ARRAY), TypeError, "strides"),
    (lambda: on_card(changed(POINTS, shape=(1323,)), FACE_ARRAY), TypeError, r"shape \(1323,\) on the card, not \(n, 3\)"),
    (lambda: on_card(POINT_ARRAY, changed(FACES, shape=(600, 4))), TypeError, r"faces: an array of shape \(600, 4\)"),
    (lambda: on_card(changed(POINTS, shape=(-1, 3)), FACE_ARRAY), TypeError, "shape"),
    (lambda: on_card(changed(POINTS, shape=(442, 3)), FACE_ARRAY), ValueError, "vertices: an array that ends beyond its memory"),
    (lambda: on_card(changed(POINTS, shape=(2**62, 3)), FACE_ARRAY), ValueError, "vertices: an array of more rows"),
    (lambda: on_card(changed(POINTS, data=(HOST, False)), FACE_ARRAY), ValueError, "not in the card's memory"),
    (lambda: on_card(changed(POINTS, data=(0, False)), FACE_ARRAY), ValueError, "not in the card's memory"),
    (lambda: on_card(changed(POINTS, data=(POINT_ARRAY.address + 2, False)), FACE_ARRAY), ValueError, "address that no number"),
    (lambda: on_card(POINT_ARRAY, changed(FACES, data=(HOST, False))), ValueError, "faces: .*not in the card's memory"),
    (lambda: on_card(changed(POINTS, data=HOST), FACE_ARRAY), TypeError, "'?\"?data"),
    (lambda: on_card(changed(POINTS, data="left out"), FACE_ARRAY), TypeError, "has no \"data\""),
    (lambda: on_card(changed(POINTS, stream=0), FACE_ARRAY), TypeError, "stream"),
    (lambda: on_card(changed(POINTS, version=1), FACE_ARRAY), TypeError, "version 1"),
    (lambda: on_card(changed(POINTS, mask=POINT_ARRAY), FACE_ARRAY), TypeError, "mask"),
    (lambda: on_card(POINT_ARRAY, changed(BAD_FACES)), ValueError, "element 7: vertex 441 of 441 does not exist"),
    (lambda: on_card(POINT_ARRAY, changed(-FACES.astype(np.int32))), ValueError, "vertex 42949.* of 441 does not exist"),
    (lambda: on_card(POINTS, changed(BAD_FACES)), ValueError, "vertex 441 of 441"),
    (lambda: on_card(POINT_ARRAY, BAD_FACES), ValueError, "refers to vertex 441, but there are 441"),
    (lambda: on_card(POINT_ARRAY, changed(BAD_FACES), elements="edges"), ValueError, "vertex 441 of 441"),
    (lambda: on_cpu(POINT_ARRAY, FACES), TypeError, 'vertices: an array on a card: add device="cuda"'),
    (lambda: BODY(POINT_ARRAY), TypeError, "points: an array on a card: copy it"),
    (lambda: BODY.contacts(POINTS, FACES, kernels=KERNELS), ValueError, 'kernels: only with device="cuda"'),
    (lambda: BODY.contacts(POINTS, FACES, device="tpu"), ValueError, "device=.*cpu, cuda"),
    (lambda: on_card(TORN), ValueError, "^3 faces have coordinates that are not finite or too large$"),
    (lambda: on_card(TORN, elements="vertices"), ValueError, "^1 vertex has coordinates that are not finite or too large$"),
    (lambda: on_card(all_minima=True), ValueError, "all minima: not on a GPU"),
    (lambda: on_card(method="gss"), ValueError, "edges only"),
    (lambda: sdftool.half_space().contacts(POINTS, FACES, device="cuda", kernels=KERNELS), ValueError, "not a field that the GPU"),
    (lambda: BODY.contacts(POINTS, FACES, device="cuda", kernels="/nowhere/kernels.ptx"), FileNotFoundError, "/nowhere/kernels.ptx"),
    (lambda: BODY.contacts(POINTS, FACES, device="cuda", kernels=__file__), ValueError, "test_cuda.py.*kernels do not load"),
    (lambda: BODY.contacts(POINTS, FACES, device="cuda"), FileNotFoundError, "no GPU kernels: .*sdftool"),
    (lambda: sdftool.CudaQuery(), TypeError, "cannot create"),
]


@pytest.mark.parametrize("call, error, words", REFUSALS)
def test_wrong_input_says_what_is_wrong(call, error, words):
    with pytest.raises(error, match=words) as raised:
        call()
    assert len(str(raised.value).splitlines()) == 1


def test_an_array_that_may_not_be_written_is_fine():
    for numbers in [POINTS, POINTS[:0]]:
        read_only = CardArray(numbers)
        read_only.changes["data"] = (read_only.address, True)
        on_card(read_only, FACES if len(numbers) else FACES[:0])
    contiguous = CardArray(POINTS, strides=(12, 4))
    same(on_card(contiguous), on_card())


@pytest.mark.parametrize("environment, words", [(dict(SDF_STUB_CARDS="0"), "no NVIDIA GPU"), (dict(LD_LIBRARY_PATH=""), "no CUDA driver")])
def test_without_a_card_or_a_driver_all_else_works(environment, words):
    if "LD_LIBRARY_PATH" in environment and os.path.exists("/dev/nvidia0"):
        pytest.skip("this machine has a driver of its own")
    script = """
import sdftool
points, faces = [[0, 0, 0], [1, 0, 0], [0, 1, 0]], [[0, 1, 2]]
field = sdftool.sphere(0.5)
assert len(field.contacts(points, faces)) == 1
try:
    field.contacts(points, faces, device="cuda")
except RuntimeError as error:
    print(error)
"""
    found = subprocess.run([sys.executable, "-c", script], env={**os.environ, **environment}, capture_output=True, text=True)
    assert found.returncode == 0, found.stderr
    assert words in found.stdout and len(found.stdout.splitlines()) == 1
