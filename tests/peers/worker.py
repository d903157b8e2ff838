"""A program with a Python interface as a worker: worker.py PROGRAM MESH NODES|FIELD.

Follows the protocol of the Rust workers in src/main.rs: reads its files, prints "ready", does its work once for each line `go`,
and prints {"seconds": ...}; `save PATH` writes the distances of the last run as f32, x fastest.
"""

import json
import sys
import time

import numpy as np


def read_obj(path):
    points, faces = [], []
    with open(path) as lines:
        for line in lines:
            words = line.split()
            if not words:
                continue
            if words[0] == "v":
                points.append([float(x) for x in words[1:4]])
            elif words[0] == "f":
                corners = [int(word.split("/")[0]) for word in words[1:]]
                corners = [index - 1 if index > 0 else len(points) + index for index in corners]
                faces += [[corners[0], corners[i], corners[i + 1]] for i in range(1, len(corners) - 1)]
    return np.array(points), np.array(faces)


class Nodes:
    """Nodes of the distances."""

    def __init__(self, text):
        lattice = json.loads(text)
        self.spacing = lattice["spacing"]
        self.origin = np.array(lattice["origin"])
        axes = [origin + self.spacing * np.arange(count) for origin, count in zip(lattice["origin"], lattice["counts"])]
        z, y, x = np.meshgrid(axes[2], axes[1], axes[0], indexing="ij")
        self.points = np.stack([x.ravel(), y.ravel(), z.ravel()], axis=1)


def open3d(mesh, nodes):
    import open3d as o3d

    points, faces = mesh
    queries = o3d.core.Tensor(nodes.points.astype(np.float32))
    corners = o3d.core.Tensor(points.astype(np.float32)), o3d.core.Tensor(faces.astype(np.uint32))

    def work():
        scene = o3d.t.geometry.RaycastingScene(nthreads=1)
        scene.add_triangles(*corners)
        return scene.compute_signed_distance(queries, nthreads=1).numpy()

    return work


def libigl(mesh, nodes):
    import igl

    points, faces = mesh
    faces = faces.astype(np.int64)

    def work():
        # Its signed_distance multiplies by 1 - 2w, which is not 1 or -1 where a mesh is open.
        squared = igl.point_mesh_squared_distance(nodes.points, points, faces)[0]
        winding = igl.fast_winding_number(points, faces, nodes.points)
        return np.where(winding >= 0.5, -1.0, 1.0) * np.sqrt(squared)

    return work


def pysdf(mesh, nodes):
    from pysdf import SDF

    points, faces = mesh
    queries = nodes.points.astype(np.float32)
    # It fails near a point without a triangle, and keeps no copy of the arrays.
    used, corners = np.unique(faces, return_inverse=True)
    points, faces = points[used].astype(np.float32), corners.reshape(faces.shape).astype(np.uint32)

    def work():
        # Positive inside.
        return -SDF(points, faces)(queries, trunc_aabb=False, n_threads=1)

    return work


def fcpw(mesh, nodes):
    import fcpw

    points, faces = mesh
    queries = np.asfortranarray(nodes.points.astype(np.float32))
    anywhere = np.full(len(queries), np.inf, dtype=np.float32)

    def work():
        scene = fcpw.scene_3D()
        scene.set_object_count(1)
        scene.set_object_vertices(np.asfortranarray(points.astype(np.float32)), 0)
        scene.set_object_triangles(np.asfortranarray(faces.astype(np.int32)), 0)
        scene.build(fcpw.aggregate_type.bvh_surface_area, True)
        found = fcpw.interaction_3D_list()
        scene.find_closest_points(queries, anywhere, found, True)
        # Reading the number of each hit is Python's time, not FCPW's.
        return lambda: np.array([hit.signed_distance(point) for hit, point in zip(found, nodes.points)])

    return work


def warp(mesh, nodes):
    import warp as wp

    import warp_kernels

    # Compiled before the first run.
    wp.load_module(warp_kernels, device="cpu")
    points, faces = mesh
    queries = wp.array(nodes.points.astype(np.float32), dtype=wp.vec3, device="cpu")
    distances = wp.zeros(len(nodes.points), dtype=float, device="cpu")

    def work():
        corners = wp.array(points.astype(np.float32), dtype=wp.vec3, device="cpu")
        indices = wp.array(faces.astype(np.int32).ravel(), dtype=int, device="cpu")
        body = wp.Mesh(corners, indices, support_winding_number=True)
        farthest = float(np.linalg.norm(np.ptp(nodes.points, axis=0)))
        wp.launch(warp_kernels.distance, len(nodes.points), [body.id, queries, farthest, distances], device="cpu")
        return distances.numpy().copy()

    return work


def warp_frank_wolfe(mesh, field):
    import h5py
    import warp as wp

    import warp_kernels

    wp.load_module(warp_kernels, device="cpu")
    points, faces = mesh
    with h5py.File(field["file"]) as file:
        attributes = file["sdf"].attrs
        origin, spacing = attributes["origin"], float(attributes["spacing"])
        volume = wp.array(file["VTKHDF/PointData/distance"][:], dtype=float, device="cpu")
    corners = wp.array(points.astype(np.float32), dtype=wp.vec3, device="cpu")
    indices = wp.array(faces.astype(np.int32), dtype=wp.vec3i, device="cpu")
    values = wp.zeros(len(faces), dtype=float, device="cpu")
    weights = wp.zeros(len(faces), dtype=wp.vec3, device="cpu")
    inputs = [corners, indices, volume, wp.vec3(*map(float, origin)), spacing, field["margin"], field["slope_bound"], 32]

    def work():
        wp.launch(warp_kernels.frank_wolfe, len(faces), [*inputs, values, weights], device="cpu")
        found = values.numpy()
        return {"passed_cull": int((found < 1e30).sum()), "faces": int((found <= field["margin"]).sum())}

    return work


def mujoco(mesh, field):
    import mujoco as mj

    def words(numbers):
        return " ".join(map(repr, numbers.ravel().tolist()))

    points, faces = mesh
    body_points, body_faces = read_obj(field["body"])
    # MuJoCo bakes the body into its own octree, moves the cloth as one rigid body, and ignores the margin here.
    model = mj.MjModel.from_xml_string(f"""
        <mujoco>
          <option sdf_iterations="32" sdf_initpoints="1" gravity="0 0 0"/>
          <asset><mesh name="body" vertex="{words(body_points)}" face="{words(body_faces)}"/></asset>
          <worldbody>
            <geom type="sdf" mesh="body"/>
            <body name="cloth">
              <freejoint/><inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/>
              <flexcomp name="cloth" type="direct" dim="2" rigid="true" radius="1e-5"
                        point="{words(points)}" element="{words(faces)}">
                <contact selfcollide="none"/>
              </flexcomp>
            </body>
          </worldbody>
        </mujoco>""")
    state = mj.MjData(model)
    mj.mj_kinematics(model, state)
    mj.mj_comPos(model, state)
    mj.mj_flex(model, state)

    def work():
        mj.mj_collision(model, state)
        return {"kept": state.ncon}

    return work


def openvdb(mesh, nodes):
    import pyopenvdb as vdb

    points, faces = mesh
    points, faces = (points - nodes.origin).astype(np.float32), faces.astype(np.uint32)
    transform = vdb.createLinearTransform(voxelSize=nodes.spacing)

    def work():
        grid = vdb.FloatGrid.createLevelSetFromPolygons(points, triangles=faces, transform=transform, halfWidth=3)
        return {"nodes": grid.activeVoxelCount(), "result_mib": grid.memUsage() / 2**20}

    return work


def physx(mesh, nodes):
    from sapien import physx as engine

    points, faces = mesh
    points, faces = points.astype(np.float32), faces.astype(np.uint32)
    engine.set_sdf_config(spacing=nodes.spacing, subgrid_size=8, num_threads_for_construction=1)
    material = engine.PhysxMaterial(0.5, 0.5, 0.0)

    def work():
        # There is no way to the samples: the shape keeps them.
        engine.PhysxCollisionShapeTriangleMesh(points, faces, [1, 1, 1], material, True)
        return {}

    return work


PROGRAMS = {work.__name__: work for work in [open3d, libigl, pysdf, fcpw, warp, warp_frank_wolfe, mujoco, openvdb, physx]}


def memory():
    """Peak and current memory of this process, in MiB."""
    with open("/proc/self/status") as status:
        values = {line.split(":")[0]: line.split()[1] for line in status if line.startswith(("VmHWM", "VmRSS"))}
    return int(values["VmHWM"]) / 1024, int(values["VmRSS"]) / 1024


def main():
    program, mesh, query = sys.argv[1:]
    mesh = read_obj(mesh)
    work = PROGRAMS[program](mesh, Nodes(query) if "counts" in query else json.loads(query))
    before = memory()[1]
    print(json.dumps("ready"), flush=True)
    distances = None
    for line in sys.stdin:
        if line.startswith("save "):
            answer = distances() if callable(distances) else distances
            answer.astype("<f4").ravel().tofile(line[5:].strip())
            print(json.dumps("saved"), flush=True)
            continue
        started = time.perf_counter()
        distances = work()
        seconds = time.perf_counter() - started
        facts = distances if isinstance(distances, dict) else {}
        facts = {**facts, "peak_mib": memory()[0] - before}
        print(json.dumps({"seconds": seconds, "facts": facts}), flush=True)


if __name__ == "__main__":
    main()
