"""Meshes and fields that move: clusters, poses and margins change no contact, and first touches are at their times."""

import pathlib

import numpy as np
import pytest
import sdftool
from conftest import assert_ctrl_c_ends, ball, dented_ball, sheet

SEED = 51
BODY = sdftool.bake(*dented_ball(12), res=32, padding=8)


def rotated(points, quaternion):
    """Points turned by a quaternion (x, y, z, w)."""
    q = np.asarray(quaternion, dtype=float) / np.linalg.norm(quaternion)
    t = 2.0 * np.cross(q[:3], points)
    return points + q[3] * t + np.cross(q[:3], t)


def same(found, expected):
    for name in expected.dtype.names:
        assert np.array_equal(found[name], expected[name]), name


def test_clusters_change_no_contact_wherever_the_mesh_stands():
    random = np.random.default_rng(SEED)
    vertices, faces = ball(24, 0.5)
    clusters = sdftool.MeshClusters(vertices, faces)
    assert len(clusters) == len(faces)
    touching = 0
    for _ in range(6):
        pose = (random.uniform(-1.2, 1.2, 3), random.normal(size=4))
        field_pose = (random.uniform(-0.2, 0.2, 3), random.normal(size=4))
        found = BODY.contacts(vertices, faces, margin=0.03, clusters=clusters, mesh_pose=pose, pose=field_pose)
        moved = rotated(vertices, pose[1]) + pose[0]
        plain = BODY.contacts(moved, faces, margin=0.03, pose=field_pose)
        # Numpy rounds the moved points otherwise.
        assert np.array_equal(found["id"], plain["id"])
        assert np.abs(found["distance"] - plain["distance"]).max(initial=0.0) < 1e-6
        same(found, BODY.contacts(vertices, faces, margin=0.03, mesh_pose=pose, pose=field_pose))
        touching += len(found)
    assert touching > 100


def test_clusters_are_fitted_to_a_mesh_that_was_deformed():
    vertices, faces = sheet(30)
    clusters = sdftool.MeshClusters(vertices, faces)
    bent = vertices - [0.0, 0.0, 0.6] + 0.1 * np.sin(3.0 * vertices[:, [2, 0, 1]])
    expected = BODY.contacts(bent, faces, margin=0.05)
    same(BODY.contacts(bent, faces, margin=0.05, clusters=clusters.refitted(bent)), expected)
    assert len(expected) > 50


def test_margins_are_those_of_each_face():
    vertices, faces = sheet(20)
    margins = np.random.default_rng(SEED).uniform(-0.05, 0.1, len(faces)).astype(np.float32)
    found = BODY.contacts(vertices, faces, margins=margins)
    plain = BODY.contacts(vertices, faces, margin=0.1)
    expected = plain[plain["distance"] <= margins.astype(float)[plain["id"]]]
    assert np.array_equal(found["id"], expected["id"]) and 20 < len(found) < len(plain)
    same(found, BODY.contacts(vertices, faces, margins=list(margins.astype(float)), threads=2))
    # They stand in place of the one margin, which nobody looks at.
    same(found, BODY.contacts(vertices, faces, margins=margins, margin=1e3))


def test_a_ball_that_flies_at_a_face_touches_it_at_its_time():
    ground = np.array([[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]])
    sphere = sdftool.sphere(0.5)
    # Its lowest point is at 1.5 - 2 t, and 0.1 above the face at t = 0.7.
    times, contacts = sphere.first_touches(
        ground, [[0, 1, 2]], end=ground, thickness=0.1, tolerance=1e-6, pose=([0, 0, 2], [0, 0, 0, 1]), end_pose=([0, 0, 0], [0, 0, 0, 1])
    )
    assert 0.7 - 1e-6 <= times[0] <= 0.7 and times.dtype == np.float64
    assert contacts["id"].tolist() == [0] and abs(contacts["distance"][0] - 0.1) <= 1e-6
    # Out of the ball, which is above.
    assert np.allclose(contacts["normal"][0], [0.0, 0.0, -1.0], atol=1e-3)
    # The same, seen from the ball.
    start = ground - [0.0, 0.0, 2.0]
    back, _ = sphere.first_touches(start, [[0, 1, 2]], end=ground, thickness=0.1, tolerance=1e-6)
    assert abs(back[0] - times[0]) < 2e-6
    still, none = sphere.first_touches(ground, [[0, 1, 2]], end=ground, pose=([0, 0, 2], [0, 0, 0, 1]))
    assert len(still) == len(none) == 0


def test_first_touches_of_a_cloth_are_never_late():
    vertices, faces = sheet(16)
    start, end = vertices + [0.0, 0.0, 0.8], vertices - [0.0, 0.1, 0.4]
    thickness = 0.01
    times, contacts = BODY.first_touches(start, faces, end=end, thickness=thickness)
    same(contacts, BODY.first_touches(start, faces, end=end, thickness=thickness, threads=2)[1])
    at = dict(zip(contacts["id"].tolist(), times.tolist()))
    for time in np.linspace(0.0, 1.0, 21):
        # Less by the rounding of a point on its way.
        found = BODY.contacts(start + time * (end - start), faces, margin=thickness - 1e-12, method="certified")
        assert all(at.get(face, 2.0) <= time + 1e-12 for face in found["id"].tolist())
    assert len(times) > 50 and (contacts["status"] == 0).all()
    # The tolerance that is taken where none is given: the cloth is 2.4 wide, and goes 0.1 along y.
    assert contacts["distance"].max() <= thickness + 1e-4 * 2.5 * (1 + 1e-9)
    for elements in ["edges", "vertices"]:
        assert len(BODY.first_touches(start, faces, end=end, elements=elements)[0]) > 10


def test_a_touch_that_the_budget_leaves_open_says_up_to_when_nothing_touches():
    vertices, faces = np.array([[2.0, 0, 0], [2.0, 0.1, 0], [2.0, 0, 0.1]]), [[0, 1, 2]]
    times, contacts = sdftool.torus(0.5, 0.2).first_touches(vertices, faces, end=0 * vertices, budget=3)
    exact, _ = sdftool.torus(0.5, 0.2).first_touches(vertices, faces, end=0 * vertices)
    assert sdftool.STATUS_NAMES[contacts["status"][0]] == "budget_spent"
    assert times[0] < exact[0] and contacts["distance"][0] > 0.1


LONG_SEARCH = """
vertices, faces = ball(16)
body = sdftool.bake(vertices, faces, res=32)
copies = np.concatenate([faces + k * len(vertices) for k in range(1000)])
end = np.tile(vertices, (1000, 1))
"""


@pytest.mark.parametrize("threads", [None, 1, 2])
def test_ctrl_c_ends_a_search_for_first_touches(threads):
    assert_ctrl_c_ends(LONG_SEARCH, f"body.first_touches(end + [3, 0, 0], copies, end=end, threads={threads})")


def test_ctrl_c_ends_a_search_for_first_touches_of_vertices():
    # They pass beside the ground, nearer than a step: beside a smooth union no tangent plane tells.
    setup = (
        "points = np.tile([0.0, 0.0, 2e-5], (20_000, 1)); "
        "ground = sdftool.half_space().smooth_union(sdftool.sphere(0.1).moved([0, 0, 9]), 0.1)"
    )
    call = "ground.first_touches(points, [], end=points + [1, 0, 0], elements='vertices', tolerance=1e-6)"
    assert_ctrl_c_ends(setup, call)


CLOTH = sheet(4)
CLUSTERS = sdftool.MeshClusters(*CLOTH)
NAN = np.where(np.arange(25)[:, None] == 7, np.nan, CLOTH[0])
SPARSE = sdftool.bake(*ball(6), res=16, layout="sparse")


@pytest.mark.parametrize(
    "call, kind, words",
    [
        (lambda: sdftool.MeshClusters(CLOTH[0]), TypeError, "give vertices and faces"),
        (lambda: sdftool.MeshClusters(CLOTH[0][:5], CLOTH[1]), ValueError, "but there are 5 vertices"),
        (lambda: CLUSTERS.refitted(CLOTH[0][:5]), ValueError, "but there are 5 vertices"),
        (lambda: CLUSTERS.refitted(np.full((25, 3), np.nan)), ValueError, "^32 "),
        (lambda: CLUSTERS.refitted(NAN), ValueError, "^6 "),
        (lambda: BODY.contacts(*CLOTH, margin=1e300), ValueError, "a margin of 1e300 is more than"),
        (lambda: BODY.contacts(*sheet(5), clusters=CLUSTERS), ValueError, "clusters: .* other faces"),
        (lambda: BODY.contacts(CLOTH[0], CLOTH[1][::-1], clusters=CLUSTERS), ValueError, "clusters: .* order"),
        (lambda: BODY.contacts(*CLOTH, clusters=CLOTH), TypeError, "MeshClusters"),
        (lambda: BODY.contacts(*CLOTH, elements="edges", clusters=CLUSTERS), ValueError, 'only with elements="faces"'),
        (lambda: BODY.contacts(*CLOTH, device="cuda", mesh_pose=np.eye(4)), ValueError, 'only with device="cpu"'),
        (lambda: BODY.contacts(*CLOTH, margins=[0.1]), ValueError, "^margins: 1 lengths, where the mesh has 32 faces: give one for each$"),
        (lambda: BODY.contacts(*CLOTH, margins=[99.0, np.nan]), ValueError, "^margins: 2 lengths"),
        (lambda: BODY.contacts(*CLOTH, margins=0.1), TypeError, r"margins: .*\(m,\)"),
        (lambda: BODY.contacts(*CLOTH, margins=["a"] * 32), TypeError, "margins: .* numbers"),
        (lambda: BODY.contacts(*CLOTH, margins=np.full(32, np.nan)), ValueError, "the margin of face 0 must be a finite length"),
        (lambda: BODY.contacts(*CLOTH, margins=np.where(np.arange(32) == 3, np.inf, 0.0)), ValueError, "^the margin of face 3 must be a finite length$"),
        (lambda: BODY.contacts(*CLOTH, mesh_pose=2.0 * np.eye(4)), ValueError, "^mesh_pose: not a rigid motion"),
        (lambda: BODY.first_touches(*CLOTH, end=CLOTH[0], end_pose=([0, 0, 0], [0, 0, 0, 0])), ValueError, "^end_pose: the quaternion is zero"),
        (lambda: SPARSE.contacts(*CLOTH, margins=np.linspace(-0.9, 0.0, 32)), ValueError, "margins: .*complete=True"),
        (lambda: SPARSE.contacts(*CLOTH, margins=np.linspace(0.0, 99.0, 32)), ValueError, "margins: "),
        (lambda: BODY.contacts(*CLOTH, exact=True, mesh_pose=np.eye(4)), ValueError, "exact search"),
        (lambda: BODY.contacts(NAN, CLOTH[1], clusters=sdftool.MeshClusters(NAN, CLOTH[1])), ValueError, "6 faces have coordinates"),
        (lambda: BODY.first_touches(*CLOTH), TypeError, "end"),
        (lambda: BODY.first_touches(*CLOTH, end=CLOTH[0][:5]), TypeError, "end: 5 vertices, where the mesh has 25"),
        (lambda: BODY.first_touches(*CLOTH, end=CLOTH[0], thickness=np.nan), ValueError, "thickness=NaN"),
        (lambda: BODY.first_touches(*CLOTH, end=CLOTH[0], tolerance=0.0), ValueError, "tolerance"),
        (lambda: BODY.first_touches(*CLOTH, end=CLOTH[0], budget=-1), ValueError, "^budget=-1"),
        (lambda: BODY.first_touches(*CLOTH, end=NAN), ValueError, "6 faces have coordinates that are not finite or too large, face"),
        (lambda: SPARSE.first_touches(*CLOTH, end=CLOTH[0], thickness=-0.9), ValueError, "thickness: "),
        (lambda: BODY.first_touches(*CLOTH, end=CLOTH[0], elements="tets"), ValueError, "elements"),
    ],
)
def test_what_cannot_be_answered_is_refused_in_words(call, kind, words):
    with pytest.raises(kind, match=words):
        call()


def test_the_example_of_the_documentation_runs():
    page = (pathlib.Path(__file__).parents[3] / "docs/motion.md").read_text()
    exec(page.split("```python\n")[1].split("```")[0], {})


def test_elements_that_the_budget_leaves_open_are_counted():
    field, (vertices, faces) = sdftool.torus(0.6, 0.2), sheet(12, height=0.4)
    plain, none = field.contacts(vertices, faces, margin=0.05, counts=True)
    assert none == dict(elements=len(faces), searched=none["searched"], possible=0, undecided=0) and none["searched"] > len(plain)
    found, counts = field.contacts(vertices, faces, margin=0.05, budget=1, counts=True)
    assert counts["undecided"] > 0 and len(found) <= len(plain)
    same(found, field.contacts(vertices, faces, margin=0.05, budget=1))
