"""Bakes the meshes of a folder by Dask or Ray: fleet.py dask|ray MESHES GRIDS [--res N] [--workers N]

A task is one mesh. Its grid has the hash of mesh and options in its name, and is whole or not there: so a task that is lost with its
worker is run again elsewhere, and a second run of the script bakes what is missing.
"""

import argparse
import hashlib
import json
import os
from pathlib import Path


def bake(mesh, folder, options):
    """Bakes one mesh, unless its grid is there: the grid's path, whether it was baked, and the process that answered."""
    import sdftool
    import trimesh

    text = json.dumps([sdftool.__version__, options], sort_keys=True)
    key = hashlib.sha256(Path(mesh).read_bytes() + text.encode()).hexdigest()[:16]
    grid = Path(folder) / f"{Path(mesh).stem}.{key}.sdf.h5"
    is_new = not grid.exists()
    if is_new:
        # One thread a task: the cluster counts cores, not we.
        sdftool.bake(trimesh.load(mesh, process=False), threads=1, **options).save(grid)
    else:
        # A worker may have been killed just after its grid was whole.
        sdftool.clear_leftovers(grid)
    return str(grid), is_new, os.getpid()


def by_dask(meshes, folder, options, workers):
    """Results as they come. On a cluster: Client("scheduler:8786"), and folders that all workers see."""
    from dask.distributed import Client, LocalCluster, as_completed

    with LocalCluster(n_workers=workers, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        tasks = client.map(bake, meshes, folder=folder, options=options, pure=False)
        for _, result in as_completed(tasks, with_results=True):
            yield result


def by_ray(meshes, folder, options, workers):
    """Results as they come. On a cluster: ray.init("auto"), and folders that all nodes see."""
    import ray

    ray.init(num_cpus=workers, include_dashboard=False, logging_level="ERROR", object_store_memory=100 * 2**20)
    task = ray.remote(max_retries=3)(bake)
    left = [task.remote(mesh, folder, options) for mesh in meshes]
    while left:
        done, left = ray.wait(left)
        yield from ray.get(done)
    ray.shutdown()


def run(runner, meshes, folder, options, workers=4, on_result=lambda result: None):
    """Bakes all meshes: how many are new, and how many were there."""
    Path(folder).mkdir(parents=True, exist_ok=True)
    counts = {True: 0, False: 0}
    for result in {"dask": by_dask, "ray": by_ray}[runner]([str(mesh) for mesh in meshes], str(folder), options, workers):
        counts[result[1]] += 1
        on_result(result)
    return counts[True], counts[False]


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("runner", choices=["dask", "ray"])
    parser.add_argument("meshes", type=Path)
    parser.add_argument("grids", type=Path)
    parser.add_argument("--res", type=int, default=128)
    parser.add_argument("--workers", type=int, default=os.cpu_count())
    given = parser.parse_args()
    found = sorted(path for path in given.meshes.iterdir() if path.suffix.lower() in [".obj", ".ply", ".stl", ".off"])
    options = {"res": given.res, "layout": "sparse"}
    baked, kept = run(given.runner, found, given.grids, options, given.workers)
    print(f"{baked} baked, {kept} kept")
