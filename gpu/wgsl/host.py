"""A small host of the shaders by the package wgpu: buffers, bindings and dispatches. query.wgsl describes what they hold."""

import pathlib

import numpy as np
import wgpu

FOLDER = pathlib.Path(__file__).parent
WORKGROUP = 64
MAX_WORKGROUPS = 65535
# The default limits of WebGPU, which every device has.
LIMITS = {"max-storage-buffers-per-shader-stage": 8, "max-storage-buffer-binding-size": 128 << 20}
NO_BAND = np.float32(3.4e38)

# The structs of query.wgsl, as WGSL lays them out.
QUERY = np.dtype([
    ("rotation", "<f4", (3, 4)), ("translation", "<f4", 3), ("margin", "<f4"), ("nodes", "<u4", 3), ("spacing", "<f4"),
    ("inv_spacing", "<f4"), ("slope_bound", "<f4"), ("band", "<f4"), ("element_count", "<u4"), ("first_element", "<u4"),
    ("corner_count", "<u4"), ("capacity", "<u4"), ("iterations", "<u4"),
])  # fmt: skip
CONTACT = np.dtype([
    ("point", "<f4", 3), ("element", "<u4"), ("normal", "<f4", 3), ("distance", "<f4"),
    ("surface_point", "<f4", 3), ("slope", "<f4"), ("weights", "<f4", 3), ("status", "<u4"),
])  # fmt: skip
COUNTS = np.dtype([("contacts", "<u4"), ("searched", "<u4"), ("not_finite", "<u4")])
CONVERGED, BEYOND_BAND, OUTSIDE_GRID, DEGENERATE_GRADIENT, SPANNED, EVALUATIONS_SHIFT = 1, 2, 4, 8, 16, 8


def source(layout, method):
    """The shader for "dense" or "sparse" grids, and "frank_wolfe" or "projected_gradient"."""
    names = ["query", f"grid_{layout}", "grid", method, "contacts"]
    return "\n".join((FOLDER / f"{name}.wgsl").read_text(encoding="utf-8") for name in names)


# Elements of a dispatch: one thread each, and room for a contact of each in one buffer.
MAX_ELEMENTS = min(WORKGROUP * MAX_WORKGROUPS, LIMITS["max-storage-buffer-binding-size"] // CONTACT.itemsize)


class Device:
    """The default adapter; `WGPUPY_WGPU_ADAPTER_NAME` chooses another."""

    def __init__(self):
        self.adapter = wgpu.gpu.request_adapter_sync()
        self.device = self.adapter.request_device_sync(required_limits=LIMITS)
        self.pipelines = {}

    def buffer(self, array):
        """A storage buffer with the array's bytes; of four bytes where that is empty."""
        most = LIMITS["max-storage-buffer-binding-size"]
        if array.nbytes > most:
            raise ValueError(f"an array of {array.nbytes} bytes: a buffer of WebGPU has {most} at most")
        data = np.ascontiguousarray(array).tobytes() or bytes(4)
        usage = wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_SRC
        return self.device.create_buffer_with_data(data=data, usage=usage)

    def pipeline(self, layout, method):
        """The compiled shader."""
        if (layout, method) not in self.pipelines:
            module = self.device.create_shader_module(code=source(layout, method))
            compute = {"module": module, "entry_point": "find_contacts"}
            self.pipelines[layout, method] = self.device.create_compute_pipeline(layout="auto", compute=compute)
        return self.pipelines[layout, method]


class Grid:
    """A grid on the device, from its attributes and datasets as `read_grid` of docs/format.md returns them."""

    def __init__(self, device, sdf, grid):
        self.sdf, self.layout = sdf, sdf["layout"]
        if self.layout == "dense":
            self.buffers = [device.buffer(dense_samples(sdf, grid))]
            return
        if sdf["precision"] == "f32":
            raise ValueError("precision f32: grid_sparse.wgsl reads codes, of u16 or u8")
        arrays = grid["codes"].astype("<u2"), grid["table"].astype("<u4"), grid["scales"], grid["coarse"]
        self.buffers = [device.buffer(array) for array in arrays]


def dense_samples(sdf, grid):
    """The samples [z, y, x] of a dense grid as f32: those of u16 and u8 are coded by bricks."""
    if "precision" not in sdf:
        return grid["distance"]
    bricks = grid["table"]
    base, step = grid["scales"].astype("<f4")[bricks].reshape(*bricks.shape, 1, 1, 1, 2).transpose(6, 0, 3, 1, 4, 2, 5)
    nodes = base + step * grid["codes"][bricks].astype("<f4").transpose(0, 3, 1, 4, 2, 5)
    x, y, z = sdf["counts"]
    return nodes.reshape([8 * n for n in bricks.shape])[:z, :y, :x]


class Mesh:
    """Points and elements on the device: faces [n, 3], edges [n, 2] or vertices [n, 1]."""

    def __init__(self, device, points, elements):
        self.count, self.corners = elements.shape
        self.buffers = [device.buffer(points.astype("<f4")), device.buffer(elements.astype("<u4"))]
        self.contacts = device.device.create_buffer(
            size=CONTACT.itemsize * min(max(self.count, 1), MAX_ELEMENTS), usage=wgpu.BufferUsage.STORAGE | wgpu.BufferUsage.COPY_SRC
        )


def find_contacts(device, grid, mesh, margin, method="frank_wolfe", iterations=32, pose=(np.eye(3), np.zeros(3))):
    """The contacts in the order of elements, and the counts. `pose`: rotation and translation of the grid into the world."""
    rotation, translation = pose
    query = np.zeros((), QUERY)
    # Columns of a matrix are 16 bytes apart.
    query["rotation"][:, :3] = rotation.T
    query["translation"] = translation + rotation @ grid.sdf["origin"]
    query["margin"], query["nodes"] = margin, grid.sdf["counts"]
    query["spacing"], query["inv_spacing"] = grid.sdf["spacing"], 1.0 / grid.sdf["spacing"]
    query["slope_bound"], query["band"] = grid.sdf["slope_bound"], grid.sdf.get("band", NO_BAND)
    query["corner_count"], query["iterations"], query["capacity"] = mesh.corners, iterations, min(mesh.count, MAX_ELEMENTS)

    pipeline = device.pipeline(grid.layout, method)
    found, total = [np.zeros(0, CONTACT)], np.zeros(1, COUNTS)
    for first in range(0, mesh.count, MAX_ELEMENTS):
        query["first_element"], query["element_count"] = first, min(MAX_ELEMENTS, mesh.count - first)
        uniform = device.device.create_buffer_with_data(data=query.tobytes(), usage=wgpu.BufferUsage.UNIFORM)
        counts = device.buffer(np.zeros(1, COUNTS))
        bound = [uniform, *mesh.buffers, mesh.contacts, counts, *grid.buffers]
        entries = [{"binding": k, "resource": {"buffer": buffer}} for k, buffer in enumerate(bound)]
        group = device.device.create_bind_group(layout=pipeline.get_bind_group_layout(0), entries=entries)
        commands = device.device.create_command_encoder()
        compute = commands.begin_compute_pass()
        compute.set_pipeline(pipeline)
        compute.set_bind_group(0, group)
        compute.dispatch_workgroups(-(-int(query["element_count"]) // WORKGROUP))
        compute.end()
        device.device.queue.submit([commands.finish()])
        [counts] = np.frombuffer(device.device.queue.read_buffer(counts), COUNTS)
        for name in COUNTS.names:
            total[name] += counts[name]
        size = int(counts["contacts"]) * CONTACT.itemsize
        if size > 0:
            contacts = np.frombuffer(device.device.queue.read_buffer(mesh.contacts, size=size), CONTACT)
            found.append(contacts[np.argsort(contacts["element"])])
    return np.concatenate(found), total[0]
