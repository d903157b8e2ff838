"""Writes a grid by h5py, as described at the end of docs/format.md: for check.py here, and for gpu/wgsl/check.py."""

import hashlib

import h5py
import numpy as np


def write_by_h5py(path, names, sdf, grid):
    """Writes the same grid by h5py, as described at the end of docs/format.md."""
    with h5py.File(path, "w") as file:
        group = file.create_group("sdf")
        digests = []

        def put(group, name, side):
            data = grid[name]
            chunks = tuple(np.minimum(data.shape, side))
            dataset = group.create_dataset(name, data=data, chunks=chunks, shuffle=True, compression="gzip")
            digests.extend(names["digest"](sdf, data[chunk].tobytes()) for chunk in dataset.iter_chunks())
            return dataset

        if sdf["layout"] == "dense" and "precision" not in sdf:
            vtkhdf = file.create_group("VTKHDF")
            vtkhdf.attrs["Version"] = [2, 6]
            vtkhdf.attrs["Type"] = np.bytes_("ImageData")
            vtkhdf.attrs["WholeExtent"] = np.column_stack([np.zeros(3, int), sdf["counts"].astype(int) - 1]).ravel()
            vtkhdf.attrs["Origin"] = sdf["origin"]
            vtkhdf.attrs["Spacing"] = np.full(3, sdf["spacing"])
            vtkhdf.attrs["Direction"] = np.eye(3).ravel()
            points = vtkhdf.create_group("PointData")
            points.attrs["Scalars"] = np.bytes_("distance")
            put(points, "distance", 32).attrs["Attribute"] = np.bytes_("Scalars")
            put(group, "bounds", 1000)
        else:
            # Chunks that differ from sdftool's.
            put(group, "samples", (48, 512))
            for name in "bounds places scales errors".split():
                if name in grid:
                    put(group, name, 1000)
            if "coarse" in grid:
                put(group, "coarse", (7, 8, 9))
        for name in "mesh_vertices mesh_triangles".split():
            if name in grid:
                put(group, name, 100)
        rows = np.frombuffer(b"".join(digests), "<u4")
        if sdf["format_version"] < 4:
            rows = rows.view("u1").reshape(-1, 32)
        group.create_dataset("digests", data=rows, chunks=rows.shape, compression="gzip")
        checksum = hashlib.sha256(rows.tobytes()).hexdigest()
        for name, value in (sdf | {"tool": "h5py", "digests_sha256": checksum}).items():
            group.attrs[name] = value
        checksum = hashlib.sha256(names["canonical"](dict(group.attrs)).encode()).hexdigest()
        group.attrs["attributes_sha256"] = checksum
