"""Fields, meshes of other packages, pickles, threads and signals."""

import copy
import multiprocessing
import pickle
import signal
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest
import sdftool
from conftest import assert_ctrl_c_ends, ball, dented_ball, sheet

POINTS = np.random.default_rng(4).uniform(-1.3, 1.3, (500, 3))


@pytest.fixture(scope="module")
def body():
    return sdftool.bake(*dented_ball(16), res=32)


@pytest.fixture(scope="module")
def fields(body):
    sparse = sdftool.bake(*dented_ball(16), res=48, layout="sparse")
    return [body, sparse, sdftool.sphere(1.0).shell(0.1)]


def test_negative_is_inside():
    sphere = sdftool.sphere(1.0)
    assert np.array_equal(sphere([[0, 0, 0], [3, 0, 0]]), [-1.0, 2.0])
    values, gradients = sphere.sample([[3.0, 0.0, 0.0]])
    assert values[0] == 2.0 and np.array_equal(gradients, [[1.0, 0.0, 0.0]])
    assert sdftool.bake(*ball(12), res=16)([[0.0, 0.0, 0.0]])[0] < -0.9
    assert sdftool.signed_distance(*ball(12), [[0.0, 0.0, 2.0], [0.0, 0.0, 0.5]]).tolist()[0] == 1.0
    for function in [sdftool.bake, sdftool.signed_distance, sdftool.load, sdftool.Sdf, sdftool.Sdf.sample]:
        assert "egative inside" in function.__doc__ or "negative inside" in function.__doc__


def test_distances_of_a_grid_keep_within_its_error_bound(body):
    low, high = body.bounds
    inside = POINTS[((POINTS > low) & (POINTS < high)).all(axis=1)]
    assert len(inside) > 100
    exact = sdftool.signed_distance(*dented_ball(16), inside)
    assert np.abs(body(inside) - exact).max() <= body.error_bound


def test_every_kind_of_array_gives_the_same(body):
    vertices, faces = sheet(12)
    single = vertices.astype(np.float32)
    expected = body.contacts(single.astype(np.float64), faces.astype(np.uint32))
    assert len(expected) > 10
    wide = np.zeros((len(single), 6))
    wide[:, ::2] = single
    for points in [single, wide[:, ::2], np.asfortranarray(single), single.tolist(), single.astype(">f4")]:
        for indices in [faces, faces.astype(np.int32), faces.astype(np.uint64), faces[:, ::-1][:, ::-1], faces.tolist()]:
            assert np.array_equal(body.contacts(points, indices), expected)
    assert np.array_equal(body(POINTS.astype(np.float32)), body(POINTS.astype(np.float32).astype(np.float64)))
    assert body.contacts(vertices, []).shape == (0,) and body([]).shape == (0,)


def not_aligned(array):
    """The same numbers in memory that begins at an odd address, as after the header of a file."""
    return np.frombuffer(b"?" + array.tobytes(), array.dtype, offset=1).reshape(array.shape)


@pytest.mark.parametrize("point_type", ["f8", "f4"])
@pytest.mark.parametrize("face_type", ["u4", "i4", "i8"])
def test_arrays_that_are_not_aligned_are_converted(body, point_type, face_type):
    points, faces = sheet(20)
    points, faces = points.astype(point_type), faces.astype(face_type)
    odd = [not_aligned(points), not_aligned(faces)]
    assert not odd[0].flags.aligned and not odd[1].flags.aligned
    assert np.array_equal(body(odd[0]), body(points))
    found = body.contacts(*odd, margin=0.05)
    assert len(found) > 0 and np.array_equal(found, body.contacts(points, faces, margin=0.05))


def test_meshes_of_other_packages_are_taken_as_they_are(body):
    vertices, faces = sheet(12)
    expected = body.contacts(vertices, faces)
    numpy = lambda array: SimpleNamespace(numpy=lambda: array)
    tensor = SimpleNamespace(vertex=SimpleNamespace(positions=numpy(vertices)), triangle=SimpleNamespace(indices=numpy(faces)))
    for mesh in [SimpleNamespace(vertices=vertices, faces=faces), SimpleNamespace(vertices=vertices, triangles=faces), tensor]:
        assert np.array_equal(body.contacts(mesh), expected)
    mesh = SimpleNamespace(vertices=ball(8)[0], faces=ball(8)[1])
    assert np.array_equal(sdftool.signed_distance(mesh, POINTS), sdftool.signed_distance(*ball(8), POINTS))
    assert np.array_equal(sdftool.signed_distance(mesh, points=POINTS), sdftool.signed_distance(*ball(8), POINTS))


def test_trimesh_and_its_scenes(body):
    trimesh = pytest.importorskip("trimesh")
    vertices, faces = sheet(12)
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    assert np.array_equal(body.contacts(mesh), body.contacts(vertices, faces))
    scene = trimesh.Scene([mesh])
    with pytest.raises(TypeError, match="to_mesh"):
        body.contacts(scene)
    assert len(body.contacts(scene.to_mesh())) == len(body.contacts(mesh))


def test_open3d(body):
    open3d = pytest.importorskip("open3d")
    vertices, faces = sheet(12)
    mesh = open3d.geometry.TriangleMesh(open3d.utility.Vector3dVector(vertices), open3d.utility.Vector3iVector(faces))
    assert np.array_equal(body.contacts(mesh), body.contacts(vertices, faces))


def test_a_matrix_and_a_quaternion_are_one_pose(body):
    turn = np.deg2rad(40.0)
    pose = np.eye(4)
    pose[:3, :3] = [[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
    pose[:3, 3] = [0.1, -0.2, 0.05]
    quaternion = [0.0, 0.0, np.sin(turn / 2), np.cos(turn / 2)]
    by_matrix = body.contacts(*sheet(12), pose=pose)
    by_quaternion = body.contacts(*sheet(12), pose=(pose[:3, 3], quaternion))
    assert len(by_matrix) == len(by_quaternion) > 10
    assert np.allclose(by_matrix["distance"], by_quaternion["distance"], atol=1e-12)
    by_lists = body.contacts(*sheet(12), pose=[pose[:3, 3].tolist(), quaternion])
    assert np.array_equal(by_lists, by_quaternion)
    by_single = body.contacts(*sheet(12), pose=pose.astype(np.float32))
    assert len(by_single) == len(by_matrix) and np.allclose(by_single["distance"], by_matrix["distance"], atol=1e-6)
    # The field moves with the pose: the mesh moved back has the same distances.
    vertices, faces = sheet(12)
    moved_back = body.contacts((vertices - pose[:3, 3]) @ pose[:3, :3], faces)
    assert np.allclose(by_matrix["distance"], moved_back["distance"], atol=1e-9)


def test_fields_survive_files_bytes_and_pickles(fields, tmp_path):
    for field, ending in zip(fields, ["sdf.h5", "sdf.h5", "sdf.toml"]):
        path = tmp_path / f"field.{ending}"
        field.save(path)
        data = field.to_bytes()
        assert path.read_bytes() == data
        again = [sdftool.load(path), sdftool.load(str(path)), sdftool.from_bytes(data), pickle.loads(pickle.dumps(field))]
        for other in again + [copy.copy(field), copy.deepcopy(field)]:
            assert np.array_equal(other(POINTS), field(POINTS))


def test_results_do_not_depend_on_threads(fields):
    vertices, faces = sheet(40)
    for field in fields:
        expected = field.contacts(vertices, faces, threads=1)
        for threads in [None, 2, 3]:
            assert np.array_equal(field.contacts(vertices, faces, threads=threads), expected)
        assert np.array_equal(field(np.tile(POINTS, (20, 1)), threads=2), field(np.tile(POINTS, (20, 1)), threads=1))
    assert sdftool.bake(*ball(8), res=16, threads=1).to_bytes() == sdftool.bake(*ball(8), res=16, threads=2).to_bytes()


def test_threads_that_would_starve_a_machine_are_refused(body):
    with pytest.raises(ValueError, match="threads=1025: give 1 to 1024"):
        body.contacts(*sheet(4), threads=1025)


def test_other_threads_run_during_a_call(body):
    count, is_done = [0], threading.Event()

    def work():
        while not is_done.is_set():
            count[0] += 1
            time.sleep(0)

    thread = threading.Thread(target=work)
    thread.start()
    before = count[0]
    sdftool.signed_distance(*dented_ball(40), np.tile(POINTS, (40, 1)), threads=1)
    after = count[0]
    is_done.set()
    thread.join()
    assert after - before > 100


def call_in_child(field, result):
    result.put(field.contacts(*sheet(40), threads=2)["distance"].sum())


def test_a_forked_process_has_threads_of_its_own(body):
    expected = body.contacts(*sheet(40), threads=2)["distance"].sum()
    for method in ["fork", "spawn"]:
        context = multiprocessing.get_context(method)
        result = context.Queue()
        child = context.Process(target=call_in_child, args=(body, result))
        child.start()
        assert result.get(timeout=60) == expected
        child.join()


def sum_and_import_in_child(field, array):
    imported = sdftool.import_grid(array, spacing=0.1)
    return field.contacts(*sheet(40), threads=2)["distance"].sum(), len(field.to_bytes()), imported.slope_bound


def test_a_pool_of_forked_processes_takes_pickled_fields(fields, tmp_path):
    grid, array, path = fields[0], tmp_path / "grid.npy", tmp_path / "grid.sdf.h5"
    np.save(array, grid.values)
    grid.save(path)
    assert sdftool.load(path).to_bytes() == grid.to_bytes()
    expected = [sum_and_import_in_child(field, array) for field in fields]
    with multiprocessing.get_context("fork").Pool(2) as pool:
        found = pool.starmap_async(sum_and_import_in_child, [(field, array) for field in fields])
        assert found.get(timeout=60) == expected
        pool.apply_async(grid.save, [tmp_path / "again.sdf.h5"]).get(timeout=60)
        assert pool.apply_async(sdftool.load, [tmp_path / "again.sdf.h5"]).get(timeout=60).to_bytes() == grid.to_bytes()


@pytest.mark.parametrize("layout", ["dense", "sparse"])
def test_ctrl_c_ends_a_bake(layout):
    assert_ctrl_c_ends("mesh = dented_ball(200)", f"sdftool.bake(*mesh, res=700, layout={layout!r}, threads=2)")


def test_ctrl_c_ends_distances_from_a_mesh_and_first_touches_of_a_few_faces():
    points = "points = np.random.default_rng(0).normal(size=(4_000_000, 3))"
    assert_ctrl_c_ends(f"mesh = dented_ball(100); {points}", "sdftool.signed_distance(*mesh, points, sign='winding', threads=1)")
    rings = "[sdftool.torus(1, 0.3).moved(np.random.default_rng(i).normal(size=3)) for i in range(200)]"
    setup = f"points = np.random.default_rng(0).normal(size=(1500, 3)); rings = sdftool.union({rings})"
    call = "rings.first_touches(points * 3, np.arange(1500).reshape(-1, 3), end=points, end_pose=([1, 2, 3], [1, 2, 3, 4]), tolerance=1e-9)"
    assert_ctrl_c_ends(setup, call)


def test_progress_is_told_and_its_exception_ends_the_bake():
    told = []
    sdftool.bake(*dented_ball(60), res=160, threads=1, progress=lambda done, total: told.append((done, total)))
    assert told and all(0 < total and done <= total for done, total in told) and told == sorted(told)
    assert told[-1][0] == told[-1][1]
    told.clear()
    sdftool.bake(*ball(6), res=8, progress=lambda done, total: told.append((done, total)))
    assert told[-1][0] == told[-1][1] > 0

    def refuse(done, total):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        sdftool.bake(*dented_ball(60), res=400, layout="sparse", progress=refuse)


def test_samples_of_a_dense_grid_are_lent_and_outlive_the_field():
    field = sdftool.bake(*ball(8), res=16)
    values, low = field.values, np.array(field.bounds[0])
    assert values.dtype == np.float32 and values.shape == field.shape and not values.flags.writeable
    with pytest.raises(ValueError):
        values[0, 0, 0] = 1.0
    node = low + field.spacing * np.array([3, 5, 7])
    assert abs(field([node])[0] - values[7, 5, 3]) < 1e-6
    assert np.shares_memory(values, field.values)
    del field
    assert values[8, 8, 8] < 0.0
    assert sdftool.sphere(1.0).values is None


def test_combinations(body):
    sphere, box = sdftool.sphere(1.0), sdftool.cuboid((0.5, 0.6, 0.7))
    a, b = sphere(POINTS), box(POINTS)
    assert np.array_equal((sphere | box)(POINTS), np.minimum(a, b))
    assert np.array_equal((sphere & box)(POINTS), np.maximum(a, b))
    assert np.array_equal((sphere - box)(POINTS), np.maximum(a, -b))
    assert np.array_equal(sphere.offset(0.25)(POINTS), a - 0.25)
    assert np.array_equal(sphere.shell(0.5)(POINTS), np.abs(a) - 0.25)
    assert np.array_equal(sdftool.union([sphere, box, body])(POINTS), np.minimum(np.minimum(a, b), body(POINTS)))
    assert (sphere.smooth_union(box, 0.1)(POINTS) <= np.minimum(a, b)).all()
    assert np.allclose(sphere.moved([1, 2, 3], scale=2.0)([[1, 2, 8]]), 3.0)
    shapes = [
        sdftool.half_space(),
        sdftool.rounded_box([1, 1, 1], 0.1),
        sdftool.capsule([0, 0, 0], [0, 0, 1], 0.2),
        sdftool.cylinder(1, 1),
        sdftool.cone(0.4, 1),
        sdftool.octahedron(1),
        sdftool.ellipsoid([1, 2, 3]),
        sdftool.bowl(1, 0.2, 0.1),
        sdftool.horseshoe(1, 0.3, 1.2, 0.5, 0.2),
    ]
    for shape in shapes:
        assert shape.layout == "closed form" and np.isfinite(shape(POINTS)).all()


def test_each_number_of_a_shape_is_the_one_that_its_name_says():
    for shape, point, value in [
        (sdftool.half_space([0, 2, 0], 1.5), [0, 3, 0], 1.5),
        (sdftool.cuboid([1, 2, 3]), [0, 5, 0], 3.0),
        (sdftool.rounded_box([1, 2, 3], 0.5), [0, 0, 5], 1.5),
        (sdftool.capsule([0, 0, 0], [0, 0, 4], 0.5), [0, 0, 6], 1.5),
        (sdftool.cylinder(1, 3), [0, 0, 2.5], -0.5),
        (sdftool.cone(0.4, 2), [0, 0, -2.5], 0.5),
        (sdftool.torus(2, 0.5), [2, 0, 0], -0.5),
        (sdftool.octahedron(2), [0, 2, 0], 0.0),
        (sdftool.ellipsoid([1, 2, 3]), [0, 0, 3], 0.0),
        (sdftool.bowl(1, 0.5, 0.1), [0, 0, -1], -0.05),
        (sdftool.bowl(1, 0.5, 0.1), [0, 0, 1], 0.95),
    ]:
        assert abs(shape([point])[0] - value) < 1e-9, (point, value)


def test_budget_and_tolerance_count():
    field = sdftool.sphere(0.6).smooth_union(sdftool.cuboid([0.3, 0.3, 0.7]), 0.2)

    def evaluations(**options):
        found = field.contacts(*sheet(8), method="certified", margin=0.3, **options)
        assert len(found) > 10
        return found["evaluations"].astype(int)

    assert evaluations(budget=8).max() == 8 < evaluations().max()
    assert evaluations(tolerance=0.3).sum() < evaluations().sum() < evaluations(tolerance=1e-6).sum()


def test_few_contacts_hold_a_body_as_all_do():
    points, faces = sheet(24)
    ground = sdftool.half_space([0, 0, 1], points[:, 2].min() + 1e-3)
    found = ground.contacts(points, faces, margin=0.1)
    kept, shortfall = sdftool.reduce(found, 16, movement=0.1)
    assert kept.dtype == found.dtype and 3 <= len(kept) <= 16 < len(found) and 0.0 <= shortfall < 0.01
    assert np.isin(kept["key"], found["key"]).all() and kept["distance"].min() == found["distance"].min()
    again = found[np.isin(found["key"], kept["key"])]
    assert kept.tobytes() == again.tobytes()
    reversed_kept, reversed_shortfall = sdftool.reduce(found[::-1], 16, movement=0.1)
    assert reversed_kept.tobytes() == kept.tobytes() and reversed_shortfall == shortfall
    assert len(sdftool.reduce(found[:0], 4, movement=1.0)[0]) == 0
    for wrong in [dict(count=0), dict(count=65), dict(movement=0.0), dict(movement=float("nan"))]:
        with pytest.raises(ValueError):
            sdftool.reduce(found, **{"count": 4, "movement": 1.0, **wrong})
    for column in ["point", "normal", "distance"]:
        bad = found.copy()
        bad[column].reshape(len(bad), -1)[3, -1] = np.nan
        with pytest.raises(ValueError, match="^contact 3: its point, normal and distance must be finite$"):
            sdftool.reduce(bad, 4, movement=1.0)
    bad = found.copy()
    bad["status"] = 99
    with pytest.raises(ValueError, match="codes that mean nothing"):
        sdftool.reduce(bad, 4, movement=1.0)


def test_an_overlap_has_the_distances_of_either_field_and_keeps_its_margin():
    large, small = sdftool.sphere(1.0), sdftool.sphere(0.5)
    inside = large.overlap(small, other_pose=([0, 0, 0.2], [0, 0, 0, 1]))
    assert np.allclose(inside.distances, [[-0.8, -0.5]], atol=1e-2)
    apart = dict(other_pose=([0, 0, 1.55], [0, 0, 0, 1]))
    assert large.overlap(small, **apart).verdict == "separated"
    assert large.overlap(small, margin=0.05, **apart).verdict == "contact"


def test_overlap_of_two_fields(body):
    found = sdftool.sphere(1.0).overlap(sdftool.sphere(1.0), pose=([0, 0, 1.5], [0, 0, 0, 1]))
    assert found.verdict == "contact" and len(found.points) == 1 and found.normals[0][2] > 0.99
    assert abs(found.distances[0].sum() + 0.5) < 1e-2 and abs(found.area / (np.pi * (1 - 0.75**2)) - 1) < 0.05
    assert found.patch_points.shape == found.patch_normals.shape == (len(found.patch_areas), 3)
    apart = body.overlap(sdftool.sphere(0.1), other_pose=([0, 0, 1.5], [0, 0, 0, 1]))
    assert apart.verdict == "separated" and apart.area == 0.0 and apart.points.shape == (0, 3)
    assert (apart.unknown, apart.complete, apart.converged, found.converged) == (0, True, True, True)
    # Also with more open boxes than there is room for: the bound holds, and converged says whether it is as near.
    bowl, cylinder = sdftool.bowl(0.8, 0.2, 0.2), sdftool.cylinder(0.5, 0.4)
    smooth = cylinder.smooth_union(sdftool.ellipsoid([0.6, 0.3, 0.5]), 0.3)
    for tolerance in [1e-2, 1e-5]:
        near = bowl.overlap(smooth, other_pose=([0.3, 0.2, 0.1], [0, 0, 0, 1]), tolerance=tolerance, resolution=0.3)
        gap = near.distances[0].max() - near.lower_bound
        assert gap >= 0.0 and (gap <= tolerance * 1.6 or not near.converged)
    # Where both have the same slope nothing is cut.
    equal = sdftool.sphere(1.0).overlap(sdftool.sphere(1.0))
    assert equal.verdict == "contact" and equal.area == 0.0 and equal.unknown > 100


def test_statuses_say_where_a_value_is_only_a_bound(fields):
    far = [[9.0, 9.0, 9.0], [np.nan, 0, 0], [0.0, 0.0, 0.0]]
    values, _, status = fields[1].sample(far, status=True)
    assert status.dtype == np.uint8 and status[0] & 2 and status[1] == 8 and np.isnan(values[1]) and status[2] & 4
    assert 0.0 < values[0] <= np.linalg.norm(far[0])


def test_contacts_are_saved_and_joined_by_numpy(tmp_path, body):
    contacts = body.contacts(*sheet(20), margin=0.05)
    assert len(contacts) > 10
    np.savez(tmp_path / "contacts.npz", contacts=contacts)
    saved = np.load(tmp_path / "contacts.npz")["contacts"]
    assert saved.dtype == sdftool.contact_dtype and saved.tobytes() == contacts.tobytes()
    joined = np.concatenate([contacts, contacts])
    assert joined.dtype == sdftool.contact_dtype and len(memoryview(joined).tobytes()) == joined.nbytes
    # Columns in another order and with gaps are those of the names.
    names = list(contacts.dtype.names)[::-1]
    mixed = contacts[names]
    for given in [saved, joined[: len(contacts)], mixed]:
        kept, shortfall = sdftool.reduce(given, 4, movement=0.1)
        expected, same = sdftool.reduce(contacts, 4, movement=0.1)
        assert np.array_equal(kept, expected) and shortfall == same
    for other in [np.zeros(3), contacts[0], contacts.reshape(1, -1), {name: contacts[name] for name in names}]:
        with pytest.raises(TypeError, match="give an array .* of contact_dtype"):
            sdftool.reduce(other, 4, movement=0.1)
    with pytest.raises(ValueError, match="contacts: some entries are masked"):
        sdftool.reduce(np.ma.array(contacts, mask=np.arange(len(contacts)) < 2), 4, movement=0.1)


def test_columns_renamed_in_one_array_keep_their_names_in_others(body):
    before, renamed = (body.contacts(*sheet(20), margin=0.05) for _ in range(2))
    names = renamed.dtype.names
    renamed.dtype.names = tuple(f"{name}_" for name in names)
    assert renamed.dtype.names[0] == "weights_"
    for array in [before, body.contacts(*sheet(20), margin=0.05), np.zeros(1, sdftool.contact_dtype)]:
        assert array.dtype.names == names
    assert len(sdftool.reduce(before, 4, movement=0.1)[0]) <= 4


def test_a_grid_named_alone_in_toml_is_that_grid(tmp_path):
    grid = sdftool.bake(*ball(8), res=16, layout="sparse", keep_mesh=True)
    grid.save(tmp_path / "ball.sdf.h5")
    (tmp_path / "named.sdf.toml").write_text('[field]\nshape = "grid"\nfile = "ball.sdf.h5"\n')
    named = sdftool.load(tmp_path / "named.sdf.toml")
    assert named.to_bytes() == grid.to_bytes() and pickle.loads(pickle.dumps(named)).to_bytes() == grid.to_bytes()
    assert (named.error_bound, named.band, named.max_margin) == (grid.error_bound, grid.band, grid.max_margin)
    assert np.array_equal(named.contacts(*sheet(20), exact=True), grid.contacts(*sheet(20), exact=True))
    # With a pose it is another field.
    (tmp_path / "moved.sdf.toml").write_text('[field]\nshape = "grid"\nfile = "ball.sdf.h5"\npose.translation = [1.0, 0.0, 0.0]\n')
    assert sdftool.load(tmp_path / "moved.sdf.toml").error_bound is None


def test_a_signal_during_a_query_raises_what_its_handler_raises(body):
    def late(*_):
        raise TimeoutError("late")

    before = signal.signal(signal.SIGALRM, late)
    try:
        for _ in range(3):
            signal.setitimer(signal.ITIMER_REAL, 0.02)
            with pytest.raises(TimeoutError, match="late"):
                while True:
                    body.contacts(*sheet(20), margin=0.05)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0)
        signal.signal(signal.SIGALRM, before)
