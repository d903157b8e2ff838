"""Compares the contacts of the shaders with those of `sdftool contacts`, on the default Vulkan device. See .ci/wgsl.sh.

    check.py SDFTOOL                         all cases
    check.py SDFTOOL GRID MESH.obj MARGIN    faces of a mesh of one's own in a baked grid, and the processor time of either

The program searches in f64, the shader in f32. In every case
- the sets are equal, but for elements whose distance is within BOUND diagonals of the margin; these are counted;
- distances differ by at most BOUND diagonals of the grid's box. Exempt are searches that forked: a tie that rounding broke the
  other way led to another point, and either search was cut off after its iterations. These are counted, and few;
- φ of the program at the shader's point is the shader's distance to within the rounding of f32;
- where both found the same point, normals, surface points, slopes and statuses agree.
"""

import json
import math
import pathlib
import re
import resource
import subprocess
import sys
import tempfile
import time

import host
import meshes
import numpy as np

sys.path.append(str(pathlib.Path(__file__).parents[2] / "tests" / "readers"))
from write_grid import write_by_h5py  # noqa: E402

BOUND = 1e-5
# The same of searches that forked, and their share.
FORKED_BOUND = 1e-4
MAX_FORKED = 0.02
# Weights that differ by no more are of the same point: where φ is flat along an element, its minimum is not unique.
SAME_WEIGHT = 1e-4
MIN_SAME = 0.9
# Share of statuses and evaluations that may differ there: a search that met its condition in one precision and not in the other.
MAX_WRONG_STATUS = 0.1
# Evaluations.
MAX_LATER = 1
# Angle between normals at the same point, and distance between surface points in diagonals.
MAX_ANGLE_DEG = 0.1
# Operations of a field evaluation that round, as in core/src/rounding.rs.
EVALUATION = 32
FORMAT = pathlib.Path(__file__).parents[2] / "docs" / "format.md"


class Program:
    """sdftool, and a folder for its files."""

    def __init__(self, path, folder):
        self.path, self.folder = path, pathlib.Path(folder)
        [example] = re.findall(r"^```python\n(.*?)^```$", FORMAT.read_text(encoding="utf-8"), re.M | re.S)
        self.documented = {}
        exec(compile(example, FORMAT.name, "exec"), self.documented)

    def run(self, *arguments):
        result = subprocess.run([self.path, *map(str, arguments)], capture_output=True, text=True)
        if result.returncode != 0:
            raise SystemExit(f"wgsl: sdftool {' '.join(map(str, arguments))}: {result.stderr}")
        return result.stdout

    def contacts(self, case, margin, *more):
        """The document of `contacts --json`."""
        moved = []
        if case.pose:
            moved = ["--rotate", commas(case.pose[0]), "--translate", commas(case.pose[1])]
        method = {"frank_wolfe": "fw", "projected_gradient": "pgd"}[case.method]
        options = ["--method", method, "--elements", case.kind, "--margin", repr(float(margin)), *moved, *more]
        return json.loads(self.run("contacts", case.mesh.path, case.grid.path, *options, "--json"))

    def values(self, grid_path, points):
        """φ at points of the grid's frame."""
        file = self.folder / "points.csv"
        file.write_text("x,y,z\n" + "".join(commas(point) + "\n" for point in points))
        rows = self.run("eval", grid_path, "--points", file).splitlines()[1:]
        return np.array([float(row.split(",")[3]) for row in rows])


class BakedGrid:
    """A grid file, and the same on the device."""

    def __init__(self, program, device, path):
        self.path = path
        self.sdf, arrays = program.documented["read_grid"](path)
        self.on_device = host.Grid(device, self.sdf, arrays)
        self.bytes = sum(buffer.size for buffer in self.on_device.buffers)

    @property
    def diagonal(self):
        return float(np.linalg.norm((self.sdf["counts"] - 1.0) * self.sdf["spacing"]))


class Case:
    def __init__(self, name, grid, mesh, kind="faces", margin=0.0, pose=None, method="frank_wolfe", needs=0):
        """`needs`: a status bit that some contact must have, or the case shows nothing."""
        self.name, self.grid, self.mesh, self.kind, self.pose, self.method = name, grid, mesh, kind, pose, method
        self.margin, self.needs = float(np.float32(margin)), needs

    def rotation_and_translation(self):
        rotation, translation = self.pose or ([0, 0, 0, 1], [0, 0, 0])
        return meshes.rotation_matrix(rotation), np.array(translation, float)


def commas(numbers):
    return ",".join(repr(float(x)) for x in numbers)


def check(case, program, device):
    """One case; returns its line of the report."""
    elements = case.mesh.elements(case.kind)
    on_device = host.Mesh(device, case.mesh.points, elements)
    rotation, translation = pose = case.rotation_and_translation()

    found, counts = host.find_contacts(device, case.grid.on_device, on_device, case.margin, case.method, pose=pose)
    if len(elements) == 0:
        require(case, not any(counts.tolist()), f"counts of an empty mesh: {counts}")
        return f"{case.name}: no elements, no contacts"
    document = program.contacts(case, case.margin)
    require(case, counts["not_finite"] == document["not_finite"], f"not finite: {counts['not_finite']}, {document['not_finite']}")
    require(case, counts["contacts"] == len(found) > 0, "contacts that were counted, but not stored, or none")
    require(case, (found["status"] & case.needs).any() or not case.needs, f"no contact with the status bit {case.needs}")

    one_sided = check_sets(case, program, found, document)
    ours = {contact["id"]: contact for contact in document["contacts"]}
    both = found[[int(element) in ours for element in found["element"]]]
    expected = [ours[int(element)] for element in both["element"]]
    worst, forked = check_distances(case, both, expected)
    check_points(case, program, found, elements, rotation, translation)
    same, angle = check_records(case, both, expected)
    return (
        f"{case.name}: {len(elements)} {case.kind}, {len(found)} contacts, {one_sided} of one side only, {forked} forked; |Δφ| at "
        f"most {worst:.1e} diagonals; {100 * same:.1f} % at the same point, normals there to {angle:.4f}°"
    )


def check_sets(case, program, found, document):
    """How many elements are in one set alone. Their distance must be within the bound of the margin, by either."""
    bound = BOUND * case.grid.diagonal
    theirs = dict(zip(found["element"].tolist(), found["distance"].astype(float)))
    ours = {contact["id"]: contact["distance"] for contact in document["contacts"]}
    for element in ours.keys() - theirs.keys():
        require(case, ours[element] >= case.margin - bound, f"element {element} at {ours[element]} was not found")
    only_theirs = theirs.keys() - ours.keys()
    if only_theirs:
        wider = {contact["id"] for contact in program.contacts(case, case.margin + bound)["contacts"]}
        for element in only_theirs:
            require(case, element in wider and theirs[element] >= case.margin - bound, f"element {element} is not a contact")
    return len(ours.keys() ^ theirs.keys())


def check_distances(case, found, expected):
    """The largest difference of distances, in diagonals, but for forked searches, and how many of these there are."""
    difference = np.abs(found["distance"] - np.array([contact["distance"] for contact in expected])) / case.grid.diagonal
    is_cut_off = [contact["status"] == "budget_spent" == status(one) for one, contact in zip(found, expected)]
    is_forked = (difference > BOUND) & is_cut_off & ~at_same_point(found, expected)
    require(case, difference.max() <= FORKED_BOUND, f"distances differ by {difference.max():.1e} diagonals")
    require(case, is_forked.mean() <= MAX_FORKED, f"{is_forked.sum()} of {len(found)} searches forked")
    worst = difference[~is_forked].max()
    require(case, worst <= BOUND, f"distances differ by {worst:.1e} diagonals")
    return worst, is_forked.sum()


def at_same_point(found, expected):
    """For each contact: do the weights agree?"""
    weights = np.array([contact["weights"] for contact in expected])
    return np.abs(found["weights"][:, : weights.shape[1]] - weights).max(1) <= SAME_WEIGHT


def check_points(case, program, found, elements, rotation, translation):
    """Weights are barycentric, the point is theirs, and φ there is the distance."""
    weights, point = found["weights"].astype(float), found["point"].astype(float)
    corners = case.mesh.points[elements[found["element"]]].astype(float)
    require(case, (weights >= 0).all() and np.abs(weights.sum(1) - 1).max() < 1e-6, "weights are not barycentric")
    size = np.abs(corners).max()
    error = np.abs(np.einsum("nk,nkx->nx", weights[:, : elements.shape[1]], corners) - point).max()
    require(case, error <= 4e-7 * size, f"points are {error:.1e} from their weights'")
    value = program.values(case.grid.path, (point - translation) @ rotation)
    # φ rounds with the size of what is subtracted: the world's coordinates and the grid's.
    far = max(size, np.abs(translation).max(), np.abs(case.grid.sdf["origin"]).max() + case.grid.diagonal)
    rounding = EVALUATION * 2.0**-23 * far * max(case.grid.sdf["slope_bound"], 1.0)
    error = np.abs(value - found["distance"]).max()
    require(case, error <= rounding, f"φ at the points differs by {error:.1e}, more than {rounding:.1e}")


def check_records(case, found, expected):
    """The share of contacts at the same point, and the largest angle between their normals."""
    width = len(expected[0]["weights"])
    same = at_same_point(found, expected)
    require(case, same.mean() >= MIN_SAME, f"only {same.mean():.3f} of the weights agree")
    require(case, (found["weights"][:, width:] == 0).all(), "a weight of a corner that the element does not have")
    at = np.flatnonzero(same)
    normals = np.array([expected[k]["normal"] for k in at])
    # The chord of two unit vectors is their angle, which the arc cosine of f32 numbers is not.
    angle = math.degrees(np.linalg.norm(found["normal"][at] - normals, axis=1).max())
    require(case, angle <= MAX_ANGLE_DEG, f"normals differ by {angle:.3f}°")
    for name, bound in ("surface_point", BOUND * case.grid.diagonal), ("slope", 1e-3):
        error = np.abs(found[name][at] - np.array([expected[k][name] for k in at])).max()
        require(case, error <= bound, f"{name} differs by {error:.1e}, more than {bound:.1e}")
    # Where the steps of projected gradient descent are short enough to end, rounding decides: some sooner, some later.
    slack = MAX_LATER if case.method == "projected_gradient" else 0
    later = [int(found["status"][k] >> host.EVALUATIONS_SHIFT) - expected[k]["evaluations"] for k in at]
    wrong = sum(status(found[k]) != expected[k]["status"] or abs(n) > slack for k, n in zip(at, later))
    require(case, wrong <= MAX_WRONG_STATUS * len(at), f"{wrong} of {len(at)} statuses or evaluations differ")
    # Weights about FEATURE_WEIGHT are on either side of it.
    clear = at[(np.abs(found["weights"][at] - 1e-3) > SAME_WEIGHT).all(1)]
    corners = np.array([(found["status"][k] // host.SPANNED % 8).item().bit_count() for k in clear])
    features = [("vertex", "edge", "face").index(expected[k]["feature"]) + 1 for k in clear]
    require(case, (corners == features).all(), "features differ")
    return same.mean(), angle


def status(contact):
    """The status that the program gives a contact with these bits."""
    named = [
        (host.DEGENERATE_GRADIENT, "degenerate_gradient"),
        (host.OUTSIDE_GRID, "outside_grid"),
        (host.BEYOND_BAND, "beyond_band"),
        (host.CONVERGED, "converged"),
    ]
    return next((name for bit, name in named if contact["status"] & bit), "budget_spent")


def require(case, holds, otherwise):
    if not holds:
        raise SystemExit(f"wgsl: {case.name}: {otherwise}")


def crop(program, grid, path):
    """The file of a dense grid without what is beyond a plane, which cuts the body: it continues outside the grid."""
    sdf, arrays = program.documented["read_grid"](grid.path)
    distance = np.ascontiguousarray(arrays["distance"][:, :, : int(sdf["counts"][0]) * 2 // 3])
    counts = np.array(distance.shape[::-1], "<u8")
    # No bounds of blocks are known; outside the box φ is steeper where it is negative.
    bounds = np.tile(np.array([-10, 10, 10], "<f4"), (int(np.prod((counts + 7) // 8)), 1))
    sdf |= {"counts": counts, "slope_bound": 2.0 * sdf["slope_bound"]}
    write_by_h5py(path, program.documented, sdf, {"distance": distance, "bounds": bounds})
    return path


def cases(program, device):
    """Every layout, kind of element, method; with a pose and without; margins; odd meshes; a grid of more than 322³ nodes."""
    folder = program.folder
    program.run("demo", "-o", folder)

    def bake(name, *options, padding=8):
        path = folder / f"{name}.sdf.h5"
        program.run("bake", folder / "body.obj", "-o", path, "--padding", padding, *options)
        return BakedGrid(program, device, path)

    u16 = ["--layout", "sparse", "--precision", "u16"]
    dense = bake("dense", "--res", 96, "--layout", "dense")
    sparse, large = bake("sparse", "--res", 96, *u16), bake("large", "--res", 336, *u16)
    nodes = math.prod(int(n) for n in large.sdf["counts"])
    if nodes <= 322**3:
        raise SystemExit(f"wgsl: the large grid has {nodes} nodes only")
    size = " × ".join(map(str, large.sdf["counts"]))
    print(f"large grid: {size} nodes, {nodes / 322**3:.2f} × 322³, {large.bytes / 2**20:.1f} MiB on the device", flush=True)

    cloth = meshes.Mesh.read(folder / "cloth.obj", folder / "cloth-f32.obj")
    soup = meshes.soup(folder / "soup.obj", seed=int(meshes.SEED))
    soup_vertices = meshes.soup(folder / "vertices.obj", seed=1 + int(meshes.SEED), count=1000)
    empty = meshes.Mesh(folder / "empty.obj", np.zeros((0, 3)), np.zeros((0, 3), int))
    pose = ([0.1, -0.2, 0.3, math.sqrt(0.86)], [0.04, -0.03, 0.02])
    for name, grid in ("dense", dense), ("sparse", sparse):
        yield Case(f"{name}", grid, cloth)
        yield Case(f"{name}, margin", grid, cloth, margin=0.02)
        yield Case(f"{name}, pose, margin", grid, cloth, margin=0.02, pose=pose)
        yield Case(f"{name}, edges, pose", grid, cloth, "edges", pose=pose)
        yield Case(f"{name}, vertices", grid, cloth, "vertices", margin=0.02)
        yield Case(f"{name}, projected gradient", grid, cloth, method="projected_gradient")
        yield Case(f"{name}, projected gradient, edges", grid, cloth, "edges", margin=0.02, method="projected_gradient")
        needs = host.BEYOND_BAND if grid is sparse else 0
        yield Case(f"{name}, soup", grid, soup, margin=0.02, needs=needs)
        yield Case(f"{name}, empty mesh", grid, empty)
    # The spline of most of its contacts reaches beyond the lattice.
    tight = bake("tight", "--res", 24, "--layout", "dense", padding=1)
    yield Case("tight", tight, soup, margin=0.9 * tight.sdf["spacing"])
    for precision in "u16", "u8":
        yield Case(f"dense {precision}", bake(f"dense-{precision}", "--res", 96, "--layout", "dense", "--precision", precision), cloth)
    yield Case("sparse u8", bake("sparse-u8", "--res", 96, "--layout", "sparse", "--precision", "u8"), cloth, margin=0.02)
    cropped = BakedGrid(program, device, crop(program, dense, folder / "cropped.sdf.h5"))
    yield Case("cropped", cropped, soup, margin=0.1, needs=host.OUTSIDE_GRID)
    yield Case("cropped, vertices", cropped, soup_vertices, "vertices", margin=0.1, pose=pose, needs=host.OUTSIDE_GRID)
    yield Case("large", large, cloth)
    yield Case("large, pose, margin", large, cloth, margin=0.005, pose=pose)


def check_many(device, grid, mesh):
    """More elements than one dispatch takes: the contacts of one mesh, over and over."""
    elements = mesh.elements("faces")
    copies = host.MAX_ELEMENTS // len(elements) + 1
    one, all_ = [host.Mesh(device, mesh.points, np.tile(elements, (count, 1))) for count in (1, copies)]
    (once, once_counts), (found, counts) = [host.find_contacts(device, grid.on_device, each, 0.02) for each in (one, all_)]
    expected = np.tile(once, copies)
    expected["element"] += np.repeat(np.arange(copies, dtype="<u4") * len(elements), len(once))
    name = f"{all_.count} faces"
    if not np.array_equal(found, expected) or any(counts[key] != copies * once_counts[key] for key in counts.dtype.names):
        raise SystemExit(f"wgsl: {name}: {len(found)} contacts, not {copies} times the {len(once)} of {len(elements)} faces")
    return f"{name}: {len(found)} contacts, {copies} times those of {len(elements)} faces"


def times(case, program, device, repeats=9):
    """The smallest processor times, of all threads: of a search with its buffers on the device, and of the program's whole process."""
    mesh = host.Mesh(device, case.mesh.points, case.mesh.elements(case.kind))
    pose = case.rotation_and_translation()
    searches, processes = [], []
    for _ in range(repeats):
        start = time.process_time()
        host.find_contacts(device, case.grid.on_device, mesh, case.margin, case.method, pose=pose)
        searches.append(1e3 * (time.process_time() - start))
        start = processor_time_of_children()
        program.contacts(case, case.margin, "--threads", 1)
        processes.append(1e3 * (processor_time_of_children() - start))
    return f"processor time: {min(searches):.1f} ms to dispatch and read back, {min(processes):.0f} ms the program, files and all"


def processor_time_of_children():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def main(sdftool, grid=None, mesh=None, margin=0.0):
    device = host.Device()
    print(f"adapter: {device.adapter.info['device']}; seed {meshes.SEED}", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        program, count = Program(sdftool, folder), 0
        if grid is not None:
            body, cloth = BakedGrid(program, device, grid), meshes.Mesh.read(pathlib.Path(mesh), program.folder / "mesh.obj")
            for method in "frank_wolfe", "projected_gradient":
                case = Case(f"{pathlib.Path(mesh).stem}, {method}", body, cloth, margin=margin, method=method)
                print(check(case, program, device))
                print(times(case, program, device))
            return
        for case in cases(program, device):
            print(check(case, program, device), flush=True)
            count += 1
            if case.name == "dense":
                print(check_many(device, case.grid, case.mesh), flush=True)
    print(f"wgsl: {count} cases agree with the program")


if __name__ == "__main__":
    main(*sys.argv[1:])
