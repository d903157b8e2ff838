"""Contacts by other programs on an NVIDIA GPU, beside docs/gpu.md: a kernel of Warp, and Newton's own.

    target/release/gpu --export scenes                     # points, elements, samples and our contacts of each scene
    python tests/peers/gpu.py scenes                       # a Markdown table; needs warp-lang, and newton for its rows
    python tests/peers/gpu.py scenes64 --device cpu        # without a card; --cells 64 of the export keeps it short

Every query has its buffers on the card. Clearing the counters and all launches are captured as one CUDA graph; its time is between two
events, as in the column "graph" of docs/gpu.md. Rows:

| row | reads | contacts |
|---|---|---|
| Warp, points | our samples | vertices within the margin |
| Warp, Frank-Wolfe | our samples | elements within the margin: a cull at the centroid, then our 32 steps from the lowest corner |
| Newton, particles | the body's triangles, through its tree | vertices within the margin, by `CollisionPipeline.collide` |
| Newton, Frank-Wolfe | its own texture of distances | faces within the margin: 12 steps, each with 12 of golden section |
| Newton, mesh against SDF | its own texture, and the touching mesh's tree | points on edges of either mesh, by `collide` |

Newton's kernels compile for minutes at the first run, on a card or, by --compile-for, ahead of it. Without a card Newton builds no SDF: of
its rows only particles are left, and rigid meshes by their trees.

Newton's pipeline sends no mesh to its Frank-Wolfe kernel (1.8), so that row calls the kernel's own launcher. Its normals, and those of
Warp, are gradients of the interpolant; ours are smooth and come with bounds.
"""

import argparse
import functools
import json
import statistics
import sys
import time
import traceback
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parent))

CONTACT = np.dtype([("element", "<u4"), ("distance", "<f4"), ("point", "<f4", 3), ("normal", "<f4", 3)])
STEPS = 32


class Scene:
    """The files of one scene, as `gpu --export` writes them."""

    def __init__(self, folder):
        about = json.loads((folder / "scene.json").read_text())
        self.name, self.margin, self.slope_bound = about["name"], about["margin"], about["slope_bound"]
        self.origin, self.spacing = about["origin"], about["spacing"]
        self.is_faces = about["elements"] == "faces"
        self.points = self.read(folder / "points.f32", "<f4", 3)
        self.elements = self.read(folder / "elements.u32", "<u4", 3 if self.is_faces else 2)
        self.samples = np.fromfile(folder / "samples.f32", "<f4").reshape(about["nodes"][::-1])
        self.body_points = self.read(folder / "body_points.f32", "<f4", 3)
        self.body_faces = self.read(folder / "body_faces.u32", "<u4", 3)
        self.ours = {name: np.fromfile(folder / f"{name}.contacts", CONTACT) for name in ["points", "frank_wolfe"]}

    @staticmethod
    def read(path, kind, width):
        return np.fromfile(path, kind).reshape(-1, width)

    def cells(self):
        return max(self.samples.shape) - 1


class Clock:
    """Times of a query: a graph between two events on a card, wall clock on a processor."""

    def __init__(self, device, repetitions):
        self.device, self.repetitions = device, repetitions

    def median(self, query):
        """Microseconds."""
        import warp as wp

        query()
        wp.synchronize_device(self.device)
        if not self.device.is_cuda:
            times = []
            for _ in range(self.repetitions):
                start = time.perf_counter()
                query()
                times.append(1e6 * (time.perf_counter() - start))
            return statistics.median(times)
        try:
            with wp.ScopedCapture(self.device) as capture:
                query()
            launch = functools.partial(wp.capture_launch, capture.graph)
        except Exception as error:
            print(f"no graph, so launches one by one: {error!r}", file=sys.stderr)
            launch = query
        for _ in range(10):
            launch()
        times = []
        for _ in range(self.repetitions):
            start, end = (wp.Event(self.device, enable_timing=True) for _ in range(2))
            wp.synchronize_device(self.device)
            wp.record_event(start)
            launch()
            wp.record_event(end)
            times.append(1e3 * wp.get_event_elapsed_time(start, end))
        return statistics.median(times)


def compare(elements, distances, ours):
    """What a peer's contacts have in common with ours, in words."""
    ours = dict(zip(ours["element"].tolist(), ours["distance"].tolist()))
    theirs = dict(zip(elements.tolist(), distances.tolist()))
    both = [theirs[element] - ours[element] for element in theirs.keys() & ours.keys()]
    if not both:
        return f"none in common with our {len(ours)}"
    differences = np.array(both)
    middle, worst = np.median(np.abs(differences)), np.abs(differences).max()
    lower = int((differences < -1e-5).sum())
    return (
        f"{len(both)} in common with our {len(ours)}; distances differ by {middle:.1e} in the median, {worst:.1e} at most, "
        f"{lower} lower by more than 1e-5"
    )


def warp_rows(scene, clock, block_dims):
    import warp as wp

    import warp_kernels

    capacity = len(scene.elements) + len(scene.points)
    points = wp.array(scene.points, dtype=wp.vec3)
    # An edge is a face that has its second vertex twice.
    faces = scene.elements if scene.is_faces else scene.elements[:, [0, 1, 1]]
    elements = wp.array(faces.astype(np.int32), dtype=wp.vec3i)
    lattice = [wp.array(scene.samples, dtype=float), wp.vec3(*scene.origin), scene.spacing, scene.margin]
    count = wp.zeros(1, dtype=int)
    found = [wp.zeros(capacity, dtype=kind) for kind in [int, float, wp.vec3, wp.vec3]]
    searches = {
        "points": (warp_kernels.point_contacts, len(points), [points, *lattice]),
        "frank_wolfe": (
            warp_kernels.frank_wolfe_contacts, len(elements),
            [points, elements, *lattice, scene.slope_bound, STEPS],
        ),
    }
    for name, (kernel, size, inputs) in searches.items():
        for block_dim in block_dims:

            def query():
                count.zero_()
                wp.launch(kernel, size, [*inputs, count, *found], block_dim=block_dim)

            microseconds = clock.median(query)
            number = int(count.numpy()[0])
            check = compare(found[0].numpy()[:number], found[1].numpy()[:number], scene.ours[name])
            label = {"points": "points", "frank_wolfe": "Frank-Wolfe"}[name]
            yield f"Warp, {label}, blocks of {block_dim}", size, number, microseconds, check


def newton_body(scene):
    """Newton's mesh of the body, with an SDF of about as many cells as our grid along its longest side."""
    import newton
    import warp as wp

    body = newton.Mesh(scene.body_points, scene.body_faces.astype(np.int32).ravel(), compute_inertia=False)
    start = time.perf_counter()
    if not wp.is_cuda_available():
        print(f"{scene.name}: Newton builds SDFs on a card only, so its mesh against SDF takes trees", file=sys.stderr)
        return body
    body.build_sdf(max_resolution=max(8, scene.cells() // 8 * 8), texture_format="float32")
    print(f"{scene.name}: Newton's SDF in {time.perf_counter() - start:.1f} s", file=sys.stderr)
    return body


def newton_shape(margin, particles):
    """Shapes that touch within the margin: half of it is each one's gap."""
    import newton

    return newton.ModelBuilder.ShapeConfig(gap=margin / 2, has_particle_collision=particles)


def soft_rows(scene, clock, body):
    import newton
    import warp as wp
    from newton._src.geometry.soft_contacts_sdf import launch_soft_ef_contacts

    builder = newton.ModelBuilder()
    builder.add_shape_mesh(-1, mesh=body, cfg=newton_shape(scene.margin, particles=True))
    many = len(scene.points)
    builder.add_particles(scene.points.tolist(), [(0.0, 0.0, 0.0)] * many, mass=[1.0] * many, radius=[0.0] * many)
    model = builder.finalize()
    state = model.state()
    capacity = len(scene.elements) + many
    pipeline = newton.CollisionPipeline(
        model, broad_phase="nxn", soft_contact_gap=scene.margin, soft_contact_max=capacity, verify_buffers=False
    )
    contacts = pipeline.contacts()

    def gathered(positions):
        number = int(contacts.soft_contact_count.numpy()[0])
        from_body = positions(number) - contacts.soft_contact_body_pos.numpy()[:number]
        return number, (from_body * contacts.soft_contact_normal.numpy()[:number]).sum(axis=1)

    microseconds = clock.median(lambda: pipeline.collide(state, contacts))
    number, distances = gathered(lambda number: scene.points[contacts.soft_contact_particle.numpy()[:number]])
    check = compare(contacts.soft_contact_particle.numpy()[:number], distances, scene.ours["points"])
    yield "Newton, particles", many, number, microseconds, check
    if not scene.is_faces or body.sdf is None:
        return

    faces = scene.elements.astype(np.int32)
    model.tri_indices = wp.array(faces, dtype=int)
    pairs = wp.array(np.stack([np.arange(len(faces)), np.zeros(len(faces))], axis=1).astype(np.int32), dtype=wp.vec2i)
    contacts.soft_contact_tids = wp.empty(capacity, dtype=wp.int32)
    none, counter = wp.empty(0, dtype=wp.vec2i), wp.zeros(1, dtype=wp.int32)
    unused = wp.empty(0, dtype=wp.int32)

    def query():
        contacts.soft_contact_count.zero_()
        launch_soft_ef_contacts(
            model=model, state=state, contacts=contacts, margin=scene.margin, device=model.device, edge_pairs=none,
            face_pairs=pairs, sdf_fallback_tids=unused, sdf_fallback_count=counter, n_particle_pairs=0,
        )

    def positions(number):
        corners = scene.points[contacts.soft_contact_indices.numpy()[:number]]
        return np.einsum("nk,nkd->nd", contacts.soft_contact_barycentric.numpy()[:number], corners)

    microseconds = clock.median(query)
    number, distances = gathered(positions)
    ids = {tuple(face): i for i, face in enumerate(faces.tolist())}
    elements = np.array([ids[tuple(face)] for face in contacts.soft_contact_indices.numpy()[:number].tolist()])
    yield "Newton, Frank-Wolfe", len(faces), number, microseconds, compare(elements, distances, scene.ours["frank_wolfe"])


def rigid_rows(scene, clock, body):
    import newton
    import warp as wp

    faces = scene.elements.astype(np.int32)
    cloth = newton.Mesh(scene.points, faces.ravel(), compute_inertia=False)
    builder = newton.ModelBuilder()
    config = newton_shape(scene.margin, particles=False)
    builder.add_shape_mesh(-1, mesh=body, cfg=config)
    link = builder.add_body(mass=1.0, inertia=wp.mat33(np.eye(3)), lock_inertia=True)
    builder.add_shape_mesh(link, mesh=cloth, cfg=config)
    model = builder.finalize()
    state = model.state()
    for reduces in [False, True]:
        pipeline = newton.CollisionPipeline(
            model, broad_phase="nxn", reduce_contacts=reduces, rigid_contact_max=4 * len(faces), verify_buffers=False
        )
        contacts = pipeline.contacts()
        microseconds = clock.median(lambda: pipeline.collide(state, contacts))
        number = min(int(contacts.rigid_contact_count.numpy()[0]), 4 * len(faces))
        points = [array.numpy()[:number] for array in [contacts.rigid_contact_point0, contacts.rigid_contact_point1]]
        gaps = ((points[1] - points[0]) * contacts.rigid_contact_normal.numpy()[:number]).sum(axis=1)
        lowest = [array.min() if len(array) else np.nan for array in [gaps, scene.ours["frank_wolfe"]["distance"]]]
        label = "Newton, mesh against SDF" + (", reduced" if reduces else "")
        check = f"points on edges of both meshes; lowest distance {lowest[0]:.4f}, of our faces {lowest[1]:.4f}"
        yield label, len(faces), number, microseconds, check


class AheadCompiler:
    """Compiles what is launched for another card too, after the first launch of each module and block size."""

    def __init__(self, arch):
        import warp as wp

        self.arch, self.done = arch, set()
        for name in ["launch", "launch_tiled"]:
            setattr(wp, name, self.followed(getattr(wp, name)))

    def followed(self, launch):
        def launch_and_compile(kernel, *args, block_dim=256, **kwargs):
            result = launch(kernel, *args, block_dim=block_dim, **kwargs)
            self.compile(kernel.module, block_dim)
            return result

        return launch_and_compile

    def compile(self, module, block_dim):
        import warp as wp

        # Newton launches blocks of one thread on a processor where it launches 32 of these or 128 on a card.
        if block_dim == 1:
            block_dim = 32 if "mesh_tri" in module.name else 128
        if (module.name, block_dim) in self.done:
            return
        self.done.add((module.name, block_dim))
        usual = module.options["block_dim"]
        module.options["block_dim"] = block_dim
        module.mark_modified()
        start = time.perf_counter()
        for path in wp.compile_aot_module(module, arch=self.arch):
            print(f"{path.name}, blocks of {block_dim}: {time.perf_counter() - start:.1f} s", file=sys.stderr)
        module.options["block_dim"] = usual
        module.mark_modified()


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("scenes", type=Path, help="folder that `gpu --export` wrote")
    parser.add_argument("--only", default="", help="names of scenes, with commas between them")
    parser.add_argument("--newton", default="Dragon,Net,Teapot,Rope", help="scenes that Newton gets")
    parser.add_argument("--rows", default="warp,soft,rigid", help="groups of rows, with commas between them")
    parser.add_argument("--device", default="cuda:0", help="Warp's name of the device, cuda:0 or cpu")
    parser.add_argument("--repetitions", type=int, default=100, help="how often each time is taken")
    parser.add_argument("--blocks", default="64,256", help="threads in a block of Warp's kernels")
    parser.add_argument("--compile-for", type=int, metavar="ARCH", help="compile all launches for this too, 90 of an H100")
    options = parser.parse_args()

    import warp as wp

    # Newton's Frank-Wolfe with its derivatives compiles for minutes, and no row needs them.
    wp.config.enable_backward = False
    device = wp.get_device(options.device)
    wp.set_device(device)
    if options.compile_for:
        AheadCompiler(options.compile_for)
    clock = Clock(device, options.repetitions)
    print(f"{device.name}, Warp {wp.config.version}")
    print("| scene | peer | elements | contacts | µs | beside our contacts |\n|---|---|---|---|---|---|", flush=True)
    failed = 0
    for folder in sorted(path for path in options.scenes.iterdir() if (path / "scene.json").exists()):
        scene = Scene(folder)
        if options.only and scene.name not in options.only.split(","):
            continue
        groups = options.rows.split(",")
        parts = [("warp", lambda: warp_rows(scene, clock, [int(size) for size in options.blocks.split(",")]))]
        if scene.name in options.newton.split(","):
            body = functools.cache(lambda: newton_body(scene))
            parts.append(("soft", lambda: soft_rows(scene, clock, body())))
            if scene.is_faces:
                parts.append(("rigid", lambda: rigid_rows(scene, clock, body())))
        for group, rows in parts:
            if group not in groups:
                continue
            try:
                for peer, size, number, microseconds, check in rows():
                    print(f"| {scene.name} | {peer} | {size:,} | {number:,} | {microseconds:.1f} | {check} |", flush=True)
            except Exception as error:  # A peer that fails must not take the others' rows along.
                failed += 1
                traceback.print_exc()
                print(f"| {scene.name} | {group} | - | - | - | failed: {error!r} |", flush=True)
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
